"""`saltus simulate`, `run`, `prove`, `plot`, `page` and `explore`: a study's motion and the answers to its
questions, computed, written and drawn, and its page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from saltus.errors import ParameterError, SaltusError
from saltus.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Iterable

    from saltus.config import Ask, Study
    from saltus.flow import Motion

DIAGRAMS = ("response_spectrum", "bifurcation_diagram")
# computed in parts into a store, so that a run that was stopped goes on
SWEPT = ("basins", "stability_chart", *DIAGRAMS)


def run_study(
    path: Path, output: Path | None, plot: bool, scheduler: str | None, fresh: bool = False
) -> None:
    """Answer every question of the study at `path` into `output`, the motion first; `fresh` begins
    every store anew.

    Raises
    ------
    SaltusError
        A bad study or one that asks nothing, a folder that cannot be written to, a scheduler that
        does not answer, all before anything is computed; then what a question's function raises.
    """
    from saltus.config import load_study
    from saltus.files import check_writable
    from saltus.sweep import remove_store

    study = load_study(path)
    if study.simulate is None and not study.asks:
        study.source.refuse(
            (),
            "asks for nothing; add [simulate], or [response_spectrum], [stability_chart], ... "
            "(docs/study.md)",
        )
    output = Path("results") / study.name if output is None else output
    check_writable(output)
    for ask in study.asks:
        check(study, ask, None if fresh else output)
    if scheduler is not None:
        check_scheduler(study, scheduler)
    for ask in study.asks if fresh else ():
        remove_store(output / f"{ask.kind}.zarr")
    if study.simulate is not None:
        simulate_study(path, output, plot)
    for ask in study.asks:
        answer(study, ask, output, plot, scheduler)


def prove_study(path: Path, output: Path | None, plot: bool) -> None:
    """Prove what [prove] of the study at `path` asks for, and print the theorems.

    Raises
    ------
    SaltusError
        A bad study or one without [prove], a folder that cannot be written to, all before anything
        is computed; then what finding the orbit raises.
    """
    from saltus.config import load_study
    from saltus.files import check_writable

    study = load_study(path)
    asks = [ask for ask in study.asks if ask.kind == "prove"]
    if not asks:
        study.source.refuse((), "has no [prove]; add one, such as [prove] theta = 0.3")
    output = Path("results") / study.name if output is None else output
    check_writable(output)
    check(study, asks[0], output)
    answer(study, asks[0], output, plot, None)


def check(study: Study, ask: Ask, output: Path | None) -> None:
    """Refuse what the function of a question would refuse.

    Raises
    ------
    ParameterError
        An argument without meaning, or a store of something else in `output`, if that is given.
    """
    function: Any = ask.function
    store = (
        {} if output is None or ask.kind not in SWEPT else {"store": output / f"{ask.kind}.zarr"}
    )
    study.answer(ask, function.check, **store)


def check_scheduler(study: Study, scheduler: str) -> None:
    """Refuse a scheduler that does not answer, or for which there is nothing to do."""
    from collections import deque

    from saltus.sweep import on_cluster

    if "://" not in scheduler:
        raise ParameterError(
            f"--scheduler must be an address such as tcp://host:8786, got {scheduler!r}"
        )
    if not any(ask.kind in SWEPT for ask in study.asks):
        known = "diagrams, [stability_chart] and [basins]"
        raise ParameterError(
            f"--scheduler is for {known}, of which the study has none; leave it out"
        )
    unused: Any = None
    next(on_cluster(unused, deque(), scheduler), None)  # connects without computing a chunk


def answer(study: Study, ask: Ask, output: Path, plot: bool, scheduler: str | None) -> None:
    """Compute, write and draw the answer to one question, and print its summary."""
    from saltus.cli.guard import progress_bar
    from saltus.cli.summaries import summarise

    console = Console(highlight=False)
    with progress_bar(ask.kind.replace("_", " ")) as progress:
        data = computed(study, ask, output, progress, scheduler)
        progress(1.0, "writing")
        files = written(ask, data, output, plot)
    for line in summarise(ask.kind, data):
        console.print(line, markup=False, soft_wrap=True)
    console.print(
        f"Results are in {output}: {', '.join(file.name for file in files)}",
        markup=False,
        soft_wrap=True,
    )


def computed(
    study: Study, ask: Ask, output: Path, progress: Progress, scheduler: str | None
) -> Any:
    """The Dataset or DataTree that answers a question."""
    from saltus.flow import available_cores

    more: dict[str, Any] = (
        {"store": output / f"{ask.kind}.zarr", "scheduler": scheduler} if ask.kind in SWEPT else {}
    )
    # other processes do not know a model of one's own
    known = type(study.system.model).__module__.startswith("saltus.")
    alone = scheduler is not None or ask.options.get("device", "cpu") != "cpu"
    if ask.kind in DIAGRAMS and not alone and known and available_cores() > 1:
        more["workers"] = available_cores()
    data = study.answer(ask, ask.function, progress=progress, **more)
    return data.to_xarray() if ask.kind == "attractors" else data


def written(ask: Ask, data: Any, output: Path, plot: bool) -> list[Path]:
    """The files of an answer: its data, if no store keeps them, and with `plot` the picture."""
    from saltus.files import write_dataset

    store = output / f"{ask.kind}.zarr"
    if ask.kind == "stability_chart" and not hasattr(data, "children"):
        files = [store]
    else:
        data.attrs["kind"] = ask.kind
        files = [write_dataset(output / f"{ask.kind}.nc", data)] + (
            [store] if ask.kind in SWEPT else []
        )
    if plot:
        files += draw_file(files[0], output / ask.kind, data)
    return files


@dataclass(frozen=True)
class SampleSettings:
    """How densely a motion is written if the study does not say it."""

    # With more samples other programs could not read motion.nc at once.
    max_samples: int = 1_000_000
    per_period: int = 200  # Number of samples in a forcing period if the study gives none.
    # The dense output of a longer motion takes more memory than a laptop has.
    max_dense_periods: int = 20_000


SETTINGS = SampleSettings()


def simulate_study(path: Path, output: Path | None, plot: bool) -> None:
    """Run the study at `path`, write its motion into `output`, and print a summary.

    Raises
    ------
    SaltusError
        A bad study, a folder that cannot be written to (before anything is computed), a motion that
        cannot go on.
    """
    from saltus.cli.guard import progress_bar
    from saltus.cli.summaries import print_summary
    from saltus.config import load_study
    from saltus.files import check_writable

    study = load_study(path)
    study.settings()
    output = Path("results") / study.name if output is None else output
    check_writable(output)
    with progress_bar(f"motion of {path}") as progress:
        motion = study.run(progress=progress, times=long_samples(study))
        progress(1.0, "writing")
        files = write_motion(motion, study, output, plot)
    console = Console(highlight=False)
    print_summary(motion, console)
    console.print(
        f"Results are in {output}: {', '.join(file.name for file in files)}",
        markup=False,
        soft_wrap=True,
    )


def write_motion(motion: Motion, study: Study, output: Path, plot: bool) -> list[Path]:
    """Write motion.nc and, with `plot`, motion.png and motion.pdf, each complete or not at all;
    their paths.
    """
    from saltus.files import write_dataset, write_figure

    dataset = motion.to_xarray(sample_times(motion, study.settings().samples))
    dataset.attrs["study"] = study.source.path.name
    files = [write_dataset(output / "motion.nc", dataset)]
    if plot:
        from saltus.plots import draw_motion, figure_of, style

        figure = figure_of(draw_motion(dataset))
        with style():
            files += write_figure(output / "motion", figure)
    return files


def long_samples(study: Study) -> Any:
    """The times at which states are kept if a motion is too long for dense output; None if it is
    not.
    """
    import numpy as np

    given = study.settings().arguments
    period = study.system.load.period
    span = given["periods"] * (period or 1.0) if "periods" in given else given["duration"]
    if span / (period or 2 * np.pi) <= SETTINGS.max_dense_periods:
        return None
    start = given.get("time", 0.0)
    return np.linspace(start, start + span, study.settings().samples or SETTINGS.max_samples)


def sample_times(motion: Motion, samples: int | None) -> Any:
    """Evenly spaced times over a motion, or None if the motion's own times are not too many."""
    import numpy as np

    period = motion.system.load.period
    short = (
        period is None
        or SETTINGS.per_period * (motion.time - motion.start) / period <= SETTINGS.max_samples
    )
    if motion.kept is not None or (samples is None and short):
        return None
    return np.linspace(
        motion.start, motion.time, SETTINGS.max_samples if samples is None else samples
    )


def plot_store(path: Path, output: Path | None) -> None:
    """Draw the result at `path` (netCDF, or the Zarr store of a sweep) beside it, or into the
    folder `output`.

    Raises
    ------
    ParameterError
        There is no result of saltus at `path`, a sweep is not complete, `output` is no folder or
        cannot be written to.
    """
    from saltus.config import open_result
    from saltus.files import UNCHECKED, check_writable, has_checksum

    folder = path.parent if output is None else output
    if folder.suffix in (".png", ".pdf") and not folder.is_dir():
        raise ParameterError(
            f"--output names a folder, in which the picture is {path.stem}.png, got {folder}"
        )
    check_writable(folder)
    data = open_result(path)
    _check_sizes(path, data)
    files = draw_file(path, folder / path.stem, data)
    names = ", ".join(file.name for file in files)
    if path.is_file() and not has_checksum(path.read_bytes()):
        Console(highlight=False, stderr=True).print(
            f"{path} {UNCHECKED}.", markup=False, soft_wrap=True
        )
    Console(highlight=False).print(
        f"The picture is in {folder}: {names}", markup=False, soft_wrap=True
    )


def _check_sizes(path: Path, data: Any) -> None:
    """Refuse numbers that are too large for an axis; computations never give such numbers."""
    import numpy as np

    from saltus.checks import LIMITS

    for node in getattr(data, "subtree", (data,)):
        for name, variable in node.variables.items():
            if (
                variable.dtype.kind == "f"
                and (np.isfinite(variable.values) & (np.abs(variable.values) > LIMITS.value)).any()
            ):
                raise ParameterError(
                    f"{path} cannot be drawn: {name!s:.60} has numbers above {LIMITS.value:g} in "
                    "size"
                )


def draw_file(path: Path, stem: Path, data: Any) -> list[Path]:
    """Draw a result as `stem`.png and `stem`.pdf.

    Raises
    ------
    ParameterError
        The result is of no kind that has a picture, or its data do not fit its kind.
    """
    from saltus.config import kind_of
    from saltus.files import write_figure
    from saltus.plots import DRAWINGS, figure_of, style

    kind = kind_of(data)
    if kind not in DRAWINGS:
        what = f"its kind is {kind!r}" if kind else "it does not say of what kind it is"
        raise ParameterError(
            f"{path} is not a result that `saltus plot` draws: {what:.60}; it draws "
            f"{', '.join(DRAWINGS)}"
        )
    try:
        with style():
            return write_figure(stem, figure_of(DRAWINGS[kind](data)))
    except OSError:
        raise
    except Exception as error:  # a file of another program may lack anything, or contain anything
        said = "" if isinstance(error, SaltusError) else f"{type(error).__name__}: "
        said += " ".join(str(error).split())
        raise ParameterError(
            f"{path} says that it is of the kind {kind!r}, but it cannot be drawn ({said:.150})"
        ) from None


def write_page(
    path: Path, results: Iterable[Path], output: Path | None, show: bool = False
) -> None:
    """Write the page of the study at `path`, open it if it is to be shown, and print where it is.

    Raises
    ------
    SaltusError
        A bad study, a file that is no result of it, a page that cannot be made or written.
    """
    import webbrowser

    import saltus

    study = saltus.load_study(path)
    given = dict(study.simulate.arguments) if study.simulate else {}
    known = (*study.system.model.coordinates, "velocity", "periods", "duration", "tol", "time")
    settings = {name: value for name, value in given.items() if name in known}
    file = (
        (Path("results") / study.name if show else Path()) / f"{study.name}.html"
        if output is None
        else output
    )
    made = saltus.page(
        study.system, *map(saltus.load, results), path=file, title=study.name, **settings
    )
    opened = show and webbrowser.open(made.absolute().as_uri())
    said = "your browser opens it" if opened else "open it in a browser"
    Console(highlight=False).print(f"The page is {made}; {said}.", markup=False, soft_wrap=True)
