"""From names to files: compute, draw and judge what is not up to date, then write the report."""

from __future__ import annotations

import difflib
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from saltus import ParameterError, SaltusError, page, save
from saltus.flow import available_cores
from saltus.plots import style
from saltus_paper import up_to_date as state
from saltus_paper.claims.claim import Claim
from saltus_paper.expected_time import expected_seconds, measured_speeds, on_the_clock
from saltus_paper.figures.figure import EFFORTS, PaperFigure
from saltus_paper.output_folder import check_writable
from saltus_paper.panel_work import ComputedPart, compute_panels
from saltus_paper.report.report import write_report

# what `saltus.cli.progress_bar` and `saltus.show_progress` are
Progress = Callable[[float, str], object]


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeFigure:
    """The result for one name: its files, its claims, and whether it was made anew, or why not."""

    name: str
    made: bool  # False: it was up to date
    seconds: float  # of processor time, of all cores together; 0 if it was up to date
    files: tuple[Path, ...]
    claims: tuple[Claim, ...]
    error: str = ""  # why the part could not be made, in a sentence; it has no files and no claims
    draft: bool = False  # made with the effort "quick", from which some claims cannot be judged


FAILURES = "failures.txt"  # in the output folder: the tracebacks of the parts that failed


@dataclass(slots=True)
class _Progress:
    """What became of the parts so far."""

    seconds: dict[str, float] = field(default_factory=dict)  # of processor time, of those made
    errors: dict[str, Exception] = field(default_factory=dict)

    def is_open(self, name: str) -> bool:
        return name not in self.seconds and name not in self.errors


def reproduce(
    names: Sequence[str] = (),
    output: Path | str = Path("results"),
    force: bool = False,
    progress: Progress = lambda fraction, what: None,
    effort: str = "standard",
) -> list[MadeFigure]:
    """Compute and draw the named parts of the paper (all if none is named) into `output`, and write
    the report.

    With the effort "quick" parts that take long are drafts: spectra and diagrams of fewer starts,
    charts of a quarter of the cells. A part that is there in full stays as it is, and a later run
    at the standard effort replaces drafts.

    What is up to date is left alone unless `force`. It is said at once how long the rest will take
    here, and each picture is named as soon as it can be looked at. An interrupt leaves complete
    files only, and the next run goes on from there.

    A part that fails leaves the others alone. Its result says why, the report is written without
    it, and failures.txt has the tracebacks.

    Raises
    ------
    ParameterError
        An unknown name or effort (the error gives similar ones); an output folder that cannot be
        written to.
    """
    from saltus_paper.parts import FIGURES, ORDER

    for name in names:
        if name not in FIGURES:
            alike = difflib.get_close_matches(name, FIGURES)
            hint = (
                f"did you mean {' or '.join(map(repr, alike))}?"
                if alike
                else f"its parts are {', '.join(FIGURES)}"
            )
            raise ParameterError(f"no part of the paper is called {name!r}; {hint}")
    if effort not in EFFORTS:
        raise ParameterError(
            f"effort must be one of {', '.join(map(repr, EFFORTS))}, got {effort!r}", "effort"
        )
    output = Path(output)
    check_writable(output)
    chosen = [figure for name, figure in FIGURES.items() if not names or name in names]
    chosen = [
        figure if not force and state.up_to_date(figure, output) else figure.at(effort)
        for figure in chosen
    ]
    stale = {
        figure.name: figure for figure in chosen if force or not state.up_to_date(figure, output)
    }
    made = _make(
        {name: stale[name] for name in dict.fromkeys((*ORDER, *stale)) if name in stale},
        output,
        progress,
    )
    _keep_tracebacks(made.errors, output)
    progress(1.0, "writing the report")
    results = [_result(figure, output, made) for figure in chosen]
    write_report(
        FIGURES.values(),
        output,
        {result.name: result.claims for result in results if not result.error},
    )
    return results


def _make(figures: Mapping[str, PaperFigure], output: Path, progress: Progress) -> _Progress:
    """Compute, draw and judge these parts, begun in their order."""
    made = _Progress()
    expected = _announced(figures, progress)
    panels = {}
    for name, figure in figures.items():
        try:
            panels[name] = figure.panels(**figure.parameters)
        except Exception as error:
            made.errors[name] = error
    with closing(compute_panels(panels)) as parts:
        for part in parts:
            figure = figures[part.name]
            try:
                if part.error is not None:
                    raise part.error
                made.seconds[part.name] = _finish(figure, part, output)
            except Exception as error:
                made.errors[part.name] = error
            left = sum(expected[name] for name in figures if made.is_open(name))
            what = (
                f"{figure.name} FAILED, {_sentence(made.errors[part.name])}"
                if part.name in made.errors
                else f"{_first_to_look_at(figure, output)} is ready, {figure.title}"
            )
            progress(
                1.0 - left / sum(expected.values()), f"{what}; about {on_the_clock(left)} left"
            )
    return made


def _finish(figure: PaperFigure, part: ComputedPart, output: Path) -> float:
    """Draw and judge a part whose panels are computed; the seconds of processor time of it all."""
    start = time.process_time()
    data = figure.join(part.panels)
    _write(figure, data, output)
    # The data are taken from memory; tests show that reading the file gives the same.
    claims = figure.claims(data)
    seconds = part.seconds + time.process_time() - start
    state.write(figure, output, claims, seconds)
    return seconds


def _first_to_look_at(figure: PaperFigure, output: Path) -> Path:
    return next(
        output / file
        for file in figure.files()
        if not file.endswith(".nc") or len(figure.files()) == 1
    )


def _sentence(error: Exception) -> str:
    """The error in one line; the name of its class too, unless it is one of saltus, which are
    sentences.
    """
    text = " ".join(str(error).split())
    return text if isinstance(error, SaltusError) else f"{type(error).__name__}: {text}"


def _keep_tracebacks(errors: Mapping[str, Exception], output: Path) -> None:
    """Write where each part failed, for those who mend it."""
    if errors:
        texts = [
            f"{name}\n{'-' * len(name)}\n{''.join(traceback.format_exception(error))}"
            for name, error in errors.items()
        ]
        save(output / FAILURES, "\n".join(texts))
    else:
        (output / FAILURES).unlink(missing_ok=True)


def _announced(figures: Mapping[str, PaperFigure], progress: Progress) -> dict[str, float]:
    """The seconds of one core that each part is expected to take here; their sum is told."""
    if not figures:
        return {}
    progress(0.0, "measuring the speed of this machine, after compiling if it is the first run")
    expected = expected_seconds(figures.values(), measured_speeds())
    cores = f"{available_cores()} core{'s' if available_cores() > 1 else ''}"
    progress(
        0.0,
        (
            f"{len(figures)} parts will take about {on_the_clock(sum(expected.values()))} here on "
            f"{cores}"
        ),
    )
    return expected


def _result(figure: PaperFigure, output: Path, made: _Progress) -> MadeFigure:
    error = made.errors.get(figure.name)
    return MadeFigure(
        name=figure.name,
        made=figure.name in made.seconds,
        seconds=made.seconds.get(figure.name, 0.0),
        files=() if error else tuple(output / name for name in figure.files()),
        claims=() if error else tuple(state.claims(figure, output)),
        error=_sentence(error) if error else "",
        draft=figure.effort == "quick",
    )


def _write(figure: PaperFigure, data: Any, output: Path) -> None:
    save(output / f"{figure.name}.nc", data)
    if figure.table is not None:
        save(output / f"{figure.name}.md", figure.table(data))
    if figure.page is not None:
        system, results, first = figure.page(data)
        page(system, *results, path=output / f"{figure.name}.html", title=figure.title, **first)
    if figure.draw is not None:
        picture = figure.draw(data)
        with style():
            save(output / f"{figure.name}.png", picture)
            # the PDF has the layout of the PNG: a second one would take as long again
            picture.set_layout_engine("none")
            save(output / f"{figure.name}.pdf", picture, title=figure.title)
