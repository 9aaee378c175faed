"""`saltus run`: everything that a study asks for, checked first, then computed, written and drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from saltus.errors import ParameterError

if TYPE_CHECKING:
    from saltus.config import Ask, Study

SWEPT = ("basins", "stability_chart")  # computed chunk by chunk into a store, from which a run that was stopped goes on

Tell = Callable[..., None]  # of the share that is done, None where it is not known, and of what is being done


class _BeginningError(Exception):
    """All arguments have been checked, and computing would begin."""


def run_study(path: Path, output: Path | None, plot: bool, scheduler: str | None) -> None:
    """Answer every question of the study at `path` into `output`, the motion first.

    Raises:
        SaltusError: a bad study or one that asks nothing, a folder that cannot be written to, a scheduler that does not answer,
            all before anything is computed; then what a question's function raises.
    """
    from saltus.cli.simulate_command import simulate_study
    from saltus.config import load_study
    from saltus.files import check_writable

    study = load_study(path)
    if study.simulate is None and not study.asks:
        study.source.refuse(
            (), "asks for nothing; add [simulate], or [response_spectrum], [stability_chart], ... (docs/study.md)"
        )
    output = Path("results") / study.name if output is None else output
    check_writable(output)
    for ask in study.asks:
        check(study, ask, output)
    if scheduler is not None:
        check_scheduler(study, scheduler)
    if study.simulate is not None:
        simulate_study(path, output, plot)
    console = Console(highlight=False)
    for ask in study.asks:
        with _progress(ask.kind.replace("_", " ")) as tell:
            data = computed(study, ask, output, tell, scheduler)
            tell(None, "writing")
            files = written(ask, data, output, plot)
        for line in said(ask.kind, data):
            console.print(line, markup=False, soft_wrap=True)
        console.print(f"Results are in {output}: {', '.join(file.name for file in files)}", markup=False, soft_wrap=True)


def check(study: Study, ask: Ask, output: Path) -> None:
    """Refuse what the function of a question would refuse: it is called until it first tells of progress.

    Raises:
        ParameterError: an argument without meaning, or in `output` the store of something else.
    """

    def beginning(*_: Any) -> None:
        raise _BeginningError

    with suppress(_BeginningError):
        computed(study, ask, output, beginning, None, only_there=True)


def check_scheduler(study: Study, scheduler: str) -> None:
    """Refuse a scheduler that does not answer, or for which there is nothing to do."""
    from collections import deque

    from saltus.sweep import on_cluster

    if "://" not in scheduler:
        raise ParameterError(f"--scheduler must be an address such as tcp://host:8786, got {scheduler!r}")
    if not any(ask.kind in SWEPT for ask in study.asks):
        raise ParameterError("--scheduler is for [stability_chart] and [basins], of which the study has none; leave it out")
    unused: Any = None
    next(on_cluster(unused, deque(), scheduler), None)  # connects, and has no chunk to compute


def computed(study: Study, ask: Ask, output: Path, tell: Tell, scheduler: str | None, only_there: bool = False) -> Any:
    """The Dataset or DataTree that answers a question; `only_there` makes no store that is not there."""
    from saltus import attractors, studies

    if ask.kind == "attractors":
        return study.answer(ask, attractors.find_attractors, progress=tell).to_xarray()
    if ask.kind not in SWEPT:
        return study.answer(ask, getattr(studies, ask.kind), progress=tell)
    function: Any = studies.basin_sweep if ask.kind == "basins" else studies.stability_chart
    if "curves" in ask.options and ask.kind == "stability_chart":
        function = partial(studies.bordered_chart, exploring=lambda share: tell(share, "exact borders"))
    store = output / f"{ask.kind}.zarr"
    place = None if only_there and not store.exists() else store
    return study.answer(ask, function, store=place, scheduler=scheduler, progress=lambda *done: _chunks(tell, *done))


def _chunks(tell: Tell, done: int, total: int, left: float | None) -> None:
    """Tell of chunks; within one there is nothing to tell."""
    text = f"{done} of {total} chunks" + (f", {left:.0f} s left" if left else "")
    tell(done / total if total > 1 else None, text if total > 1 else "computing")


def written(ask: Ask, data: Any, output: Path, plot: bool) -> list[Path]:
    """The files of an answer: its data, if no store keeps them, and with `plot` the picture."""
    from saltus.files import write_dataset
    from saltus.plots import data_is_tree

    store = output / f"{ask.kind}.zarr"
    if ask.kind == "stability_chart" and not data_is_tree(data):
        files = [store]
    else:
        data.attrs["kind"] = ask.kind
        files = [write_dataset(output / f"{ask.kind}.nc", data)] + ([store] if ask.kind in SWEPT else [])
    if plot:
        from saltus.cli.plot_command import draw_file

        files += draw_file(files[0], output / ask.kind, data)
    return files


@contextmanager
def _progress(what: str) -> Iterator[Tell]:
    """A bar on a terminal; elsewhere a line whenever what is done changes."""
    messages = Console(stderr=True, highlight=False)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn())
    with Progress(*columns, console=messages, transient=True, disable=not messages.is_terminal) as progress:
        task, last = progress.add_task(what, total=None), ""

        def tell(share: float | None, doing: str = "computing") -> None:
            nonlocal last
            progress.update(task, total=None if share is None else 1.0, completed=share or 0.0, description=f"{what}: {doing}")
            words = doing.split(",")[0]
            if not messages.is_terminal and words != last:
                print(f"{what}: {words}", file=messages.file, flush=True)
                last = words

        tell(None)
        yield tell


def said(kind: str, data: Any) -> Iterator[str]:
    """What there is to say of an answer, in a few lines."""
    if kind in ("response_spectrum", "bifurcation_diagram"):
        yield from _said_of_diagram(data)
    elif kind in ("attractors", "basins"):
        yield from _said_of_attractors(data)
    elif kind == "stability_chart":
        yield from _said_of_chart(data)
    else:
        stable = int(data["stable"].sum())
        unstable = data.sizes["equilibrium"] - stable
        why = data.attrs["separatrices"].removeprefix("none: ")
        yield f"{data.sizes['motion']} motions, {stable} stable and {unstable} unstable equilibria, " + (
            f"{data.sizes['separatrix']} separatrices." if why == "computed" else f"no separatrices ({why})."
        )


def _said_of_chart(data: Any) -> Iterator[str]:
    if "chart" in getattr(data, "children", ()):
        yield from _said_of_chart(data["chart"].to_dataset())
        yield from _said_of_borders(data)
        return
    moving, wild = int((data["count"] > 0).sum()), int((data["unsettled"] > 0).sum())
    text = f"Stable motions beside rest in {moving} of {data['count'].size} cells"
    yield text + (f", the largest amplitude is {float(data['amplitude'].max()):.4g} rad." if moving else ".")
    if wild:
        yield f"In {wild} cells some motion does not settle."


def _said_of_borders(tree: Any) -> Iterator[str]:
    """What is known of the changes between neighbouring cells."""
    from saltus.plots import curves_of

    left, kinds = tree["disagreements"].to_dataset(), [str(curve.attrs["kind"]) for curve in curves_of(tree)]
    curves = ", ".join(f"{kinds.count(kind)} {kind}" for kind in sorted(set(kinds))) or "none"
    total, looked = int(left.attrs["changes"]), int(left["looked_into"].sum())
    on, harmless, unexplained = int(left.attrs["on_curves"]), int(left.attrs["harmless"]), left.sizes["change"]
    added = int(tree["chart"].attrs["added_by_continuation"])
    yield (
        f"Exact borders: {curves} as curves. Of {total} ends of motions between neighbouring cells "
        f"{on} lie on them, {total - on - harmless - unexplained} at other special points, {harmless} are none, as the same "
        f"motion goes on, {looked} are not explained and {unexplained - looked} were not looked into."
    )
    if added:
        yield f"{added} motions of cells, to which no start leads, are known from their neighbours by continuation."


def _said_of_diagram(tree: Any) -> Iterator[str]:
    path = tree.attrs["path"]
    for name in sorted(tree.children):
        if name.startswith("branch_"):
            branch = tree[name]
            special = [branch[key].values for key in ("kind", "special_parameter") if key in branch]  # a branch may have none
            kinds = [f"{kind} {value:.6g}" for kind, value in zip(*special, strict=True)]
            more = f" and {len(kinds) - 8} more" if len(kinds) > 8 else ""
            x = branch["parameter"].values
            yield (
                f"{name}: period {int(branch['period'][0])}, {path} {x.min():.6g} to {x.max():.6g}, "
                f"{int(branch['stable'].sum())} of {x.size} points stable; {', '.join(kinds[:8]) or 'no special points'}{more}"
            )
    for low, high, rate in zip(*(tree["bands"][name].values for name in ("low", "high", "exponent")), strict=True):
        yield f"chaos: {path} {low:.6g} to {high:.6g}, largest exponent {rate:.3g}"


def _said_of_attractors(data: Any) -> Iterator[str]:
    share, of = ("cells", "cells") if "cells" in data else ("fraction", "starts")
    for i, label in enumerate(data["attractor"].values):
        periods = int(data["attractor_period"][i])
        kind = str(data["attractor_kind"].values[i]) + (f", period {periods}" if periods else "")
        part, size = 100 * float(data[share][i]), float(data["amplitude"][i])
        yield f"{int(label)}: {kind}, amplitude {size:.4g}, {part:.3g} % of the {of}"
    left = float(data.attrs.get("undecided", 0.0))
    if left:
        yield f"undecided: {100 * left:.3g} % of the {of}"
