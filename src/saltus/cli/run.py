"""`saltus run`: everything that a study asks for, computed, written and drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from saltus.config import Study
    from saltus.config.asks import Ask

Tell = Callable[[float, str], None]


def run_study(path: Path, output: Path | None, plot: bool, scheduler: str | None) -> None:
    """Answer every question of the study at `path` into `output`, the motion first.

    Raises:
        SaltusError: a bad study or one that asks nothing, a folder that cannot be written to, what a question's function raises.
    """
    from saltus.cli.simulate import simulate_study
    from saltus.config import load_study
    from saltus.files import check_writable

    study = load_study(path)
    if study.simulate is None and not study.asks:
        study.source.refuse(
            (), "asks for nothing; add [simulate], or [response_spectrum], [stability_chart], ... (docs/study.md)"
        )
    output = Path("results") / study.name if output is None else output
    check_writable(output)
    if study.simulate is not None:
        simulate_study(path, output, plot)
    console = Console(highlight=False)
    for ask in study.asks:
        with _progress(ask.kind.replace("_", " ")) as tell:
            store, data = ANSWERS[ask.kind](study, ask, output, tell, scheduler)
            files = [store]
            if plot:
                from saltus.cli.plot import draw_file

                files += draw_file(store, output / ask.kind, data)
        for line in said(ask.kind, data):
            console.print(line, markup=False, soft_wrap=True)
        console.print(f"Results are in {output}: {', '.join(file.name for file in files)}", markup=False, soft_wrap=True)


@contextmanager
def _progress(what: str) -> Iterator[Tell]:
    """A bar on a terminal; elsewhere a line whenever what is done changes."""
    messages = Console(stderr=True, highlight=False)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn())
    with Progress(*columns, console=messages, transient=True, disable=not messages.is_terminal) as progress:
        task, last = progress.add_task(what, total=1.0), ""

        def tell(share: float, doing: str = "") -> None:
            nonlocal last
            progress.update(task, completed=share, description=f"{what}: {doing}" if doing else what)
            words = doing.split(",")[0]
            if not messages.is_terminal and words != last:
                print(f"{what}: {words}", file=messages.file, flush=True)
                last = words

        tell(0.0, "computing")
        yield tell


def _diagram(study: Study, ask: Ask, output: Path, tell: Tell, scheduler: str | None) -> tuple[Path, Any]:
    from saltus import studies
    from saltus.files import write_dataset

    tree = study.answer(ask, getattr(studies, ask.kind), progress=tell)
    tree.attrs["kind"] = ask.kind
    return write_dataset(output / f"{ask.kind}.nc", tree), tree


def _portrait(study: Study, ask: Ask, output: Path, tell: Tell, scheduler: str | None) -> tuple[Path, Any]:
    from saltus.files import write_dataset
    from saltus.studies import phase_portrait

    data = study.answer(ask, phase_portrait)
    return write_dataset(output / "phase_portrait.nc", data), data


def _attractors(study: Study, ask: Ask, output: Path, tell: Tell, scheduler: str | None) -> tuple[Path, Any]:
    from saltus.attractors.found import attractors
    from saltus.files import write_dataset

    data = study.answer(ask, attractors, progress=lambda share: tell(share, "computing")).to_xarray()
    return write_dataset(output / "attractors.nc", data), data


def _basins(study: Study, ask: Ask, output: Path, tell: Tell, scheduler: str | None) -> tuple[Path, Any]:
    from saltus.attractors.basins import basins
    from saltus.files import write_dataset

    data = study.answer(ask, basins, progress=lambda share: tell(share, "computing"))
    return write_dataset(output / "basins.nc", data), data


def _chart(study: Study, ask: Ask, output: Path, tell: Tell, scheduler: str | None) -> tuple[Path, Any]:
    from saltus.studies import stability_chart

    def chunks(done: int, total: int, left: float | None) -> None:
        tell(done / total, f"{done} of {total} chunks" + ("" if not left else f", {left:.0f} s left"))

    store = output / "stability_chart.zarr"
    return store, study.answer(ask, stability_chart, store=store, scheduler=scheduler, progress=chunks)


ANSWERS: dict[str, Callable[..., tuple[Path, Any]]] = {
    "phase_portrait": _portrait,
    "response_spectrum": _diagram,
    "bifurcation_diagram": _diagram,
    "attractors": _attractors,
    "basins": _basins,
    "stability_chart": _chart,
}


def said(kind: str, data: Any) -> Iterator[str]:
    """What there is to say of an answer, in a few lines."""
    if kind in ("response_spectrum", "bifurcation_diagram"):
        yield from _said_of_diagram(data)
    elif kind in ("attractors", "basins"):
        yield from _said_of_attractors(data)
    elif kind == "stability_chart":
        moving = int((data["count"] > 0).sum())
        largest = float(data["amplitude"].max())
        yield f"Stable motions beside rest in {moving} of {data['count'].size} cells, up to {largest:.4g} rad."
    else:
        yield f"{data.sizes['motion']} motions, {data.sizes['equilibrium']} saddles."


def _said_of_diagram(tree: Any) -> Iterator[str]:
    path = tree.attrs["path"]
    for name in sorted(tree.children):
        if name.startswith("branch_"):
            branch = tree[name]
            kinds = [
                f"{kind} {value:.6g}"
                for kind, value in zip(branch["kind"].values, branch["special_parameter"].values, strict=True)
            ]
            more = f" and {len(kinds) - 8} more" if len(kinds) > 8 else ""
            x = branch["parameter"].values
            yield (
                f"{name}: period {int(branch['periods'][0])}, {path} {x.min():.6g} to {x.max():.6g}, "
                f"{int(branch['stable'].sum())} of {x.size} points stable; {', '.join(kinds[:8]) or 'no special points'}{more}"
            )
    for low, high, rate in zip(*(tree["bands"][name].values for name in ("low", "high", "exponent")), strict=True):
        yield f"chaos: {path} {low:.6g} to {high:.6g}, largest exponent {rate:.3g}"


def _said_of_attractors(data: Any) -> Iterator[str]:
    share = "cells" if "cells" in data else "fraction"
    for i, label in enumerate(data["attractor"].values):
        periods = int(data["attractor_periods"][i])
        kind = str(data["attractor_kind"].values[i]) + (f" {periods}" if periods else "")
        part, size = 100 * float(data[share][i]), float(data["amplitude"][i])
        yield f"{int(label)}: {kind}, amplitude {size:.4g}, {part:.1f} % of the states"
