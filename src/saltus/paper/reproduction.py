"""From names to files: compute, draw and judge what is not up to date, then write the report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from saltus.errors import ParameterError, near
from saltus.files import check_writable, write_dataset, write_figure, write_text
from saltus.paper import report
from saltus.paper import up_to_date as state
from saltus.paper.claims.claim import Claim
from saltus.paper.figures.figure import PaperFigure
from saltus.plots import style
from saltus.progress import Progress, silent


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of one name: its files, its claims, and whether it was made anew."""

    name: str
    made: bool  # False: it was up to date
    seconds: float
    files: tuple[Path, ...]
    claims: tuple[Claim, ...]


def reproduce(
    names: Sequence[str] = (), output: Path | str = Path("results"), force: bool = False, progress: Progress = silent
) -> list[Result]:
    """Compute and draw the named parts of the paper (all where none is named) into `output`, and write the report.

    What is up to date is left alone unless `force`. An interrupt leaves complete files only, and the next run goes on from there.

    Raises:
        ParameterError: an unknown name, with the near ones; an output folder that cannot be written to.
    """
    from saltus.paper.parts import FIGURES

    for name in names:
        if name not in FIGURES:
            raise ParameterError(f"no part of the paper is called {name!r}; {near(name, FIGURES)}")
    output = Path(output)
    check_writable(output)
    chosen = [figure for name, figure in FIGURES.items() if not names or name in names]
    results = []
    for i, figure in enumerate(chosen):
        progress(i / len(chosen), f"{figure.name}, {figure.title}")
        results.append(_make(figure, output, force))
    progress(1.0, "writing the report")
    report.write(FIGURES.values(), output, {result.name: result.claims for result in results})
    return results


def _make(figure: PaperFigure, output: Path, force: bool) -> Result:
    start = time.perf_counter()
    stale = force or not state.up_to_date(figure, output)
    if stale:
        data = figure.compute(**figure.parameters)
        _write(figure, data, output)
        # From memory, which tests show to be what the file gives back: reading many branches takes minutes (see `read_dataset`).
        state.write(figure, output, figure.claims(data), time.perf_counter() - start)
    claims = tuple(state.claims(figure, output))
    files = tuple(output / name for name in figure.files())
    return Result(name=figure.name, made=stale, seconds=time.perf_counter() - start, files=files, claims=claims)


def _write(figure: PaperFigure, data: Any, output: Path) -> None:
    write_dataset(output / f"{figure.name}.nc", data)
    if figure.table is not None:
        write_text(output / f"{figure.name}.md", figure.table(data))
    if figure.draw is not None:
        picture = figure.draw(data)
        with style():
            write_figure(output / figure.name, picture, figure.title)
