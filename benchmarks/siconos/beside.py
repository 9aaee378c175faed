"""The comparison: every motion with ever smaller steps by Siconos, the same by saltus, and the
files that hold them.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from measure import equal_error, interleave
from peers.peer import AbsentError
from report import number, table

from saltus.files import write_bytes, write_text
from siconos.case import CASES, Case
from siconos.picture import draw
from siconos.program import march, version

RESULTS = Path(__file__).resolve().parent.parent / "results"
STEPS = tuple(1000 * 2**k for k in range(10))
QUICK_STEPS = STEPS[:6]
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12)
EXACT = 1e-15  # the tol of the motions that errors are counted from
TARGETS = (1e-3, 1e-5)
HEAD = (
    "motion",
    "impacts",
    "Siconos' order",
    "error",
    "saltus, ms",
    "Siconos, ms",
    "with steps of",
    "ratio",
)

READING = """
Six motions of `TwoLayer` with Newton's law of impact, by saltus with exact events and by Siconos with Moreau and Jean's time
stepping (theta = 1/2, equations and their derivatives in C, the loop over steps in C++). An error is the largest one of both
openings and their rates at the end, against saltus at tol 1e-15; the order is the slope of its logarithm over that of the step.
Seconds are processor time: of saltus for a whole call of `simulate` with its dense output, of Siconos for its loop alone. saltus
at its loosest tol, 1e-6, is nearer than either error asked for. A star: extrapolated at first order, as the smallest step does
not reach that error.
""".strip()


def beside_siconos(about: dict[str, Any], quick: bool = False, folder: Path = RESULTS) -> None:
    """Measure, write siconos.json, siconos.md and siconos.png into `folder`, and print the table.

    Where Siconos is not installed, the report says how to install it, and nothing else is done.
    """
    start = time.perf_counter()
    try:
        results = {"about": about, "version": version(), "cases": measured(quick)}
        write_bytes(folder / "siconos.png", draw(results["cases"]))
    except AbsentError as reason:
        results = {"about": about, "absent": str(reason)}
    write_text(folder / "siconos.json", json.dumps(results, indent=1) + "\n")
    print(write_text(folder / "siconos.md", report(results)).read_text())
    print(f"siconos: {time.perf_counter() - start:.0f} s", flush=True)


def measured(quick: bool) -> list[dict[str, Any]]:
    """Errors and seconds of every motion, by both.

    Raises AbsentError where Siconos is not installed.
    """
    counts, rounds = (QUICK_STEPS, 1) if quick else (STEPS, 3)
    answers = iter(march([case.task(count, rounds) for case in CASES for count in counts]))
    rows = []
    for case in CASES:
        exact = case.end(EXACT)
        steps = [_step(case, count, next(answers), exact) for count in counts]
        tasks = {tol: lambda case=case, tol=tol: case.motion(tol) for tol in TOLERANCES}
        timings = interleave(tasks, 3 if quick else 15, one_core=True)
        ours = [
            {"tol": tol, "error": _error(case.end(tol), exact), "seconds": timings[tol].median}
            for tol in TOLERANCES
        ]
        row = {
            "about": case.about,
            "impacts": len(case.motion(EXACT).impacts),
            "siconos": steps,
            "saltus": ours,
        }
        rows.append(
            row | {"order": order(steps), "equal": [_at(target, steps, ours) for target in TARGETS]}
        )
    return rows


def _step(case: Case, count: int, answer: dict[str, Any], exact: np.ndarray) -> dict[str, float]:
    """One motion by Siconos, which may end a step late or early by rounding."""
    size = case.duration / count
    if abs(answer["time"] - case.duration) > 0.5 * size:
        raise RuntimeError(f"Siconos ended at {answer['time']} instead of {case.duration}")
    return {
        "step": size,
        "error": _error(np.array(answer["state"]), exact),
        "seconds": float(np.median(answer["seconds"])),
    }


def _error(state: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(state - exact).max())


def order(steps: list[dict[str, float]]) -> float:
    """The slope of the logarithm of the error over that of the step."""
    x, y = (np.log([row[name] for row in steps]) for name in ("step", "error"))
    return float(np.polyfit(x, y, 1)[0])


def _at(
    target: float, steps: list[dict[str, float]], ours: list[dict[str, float]]
) -> dict[str, Any]:
    """The seconds of both for an error of at most `target`, and Siconos' step: `reached` by one, or
    extrapolated.
    """
    smallest = min(steps, key=lambda row: row["step"])
    theirs, size = (
        equal_error([r["error"] for r in steps], costs, [target])[0]
        for costs in ([r["seconds"] for r in steps], [1.0 / r["step"] for r in steps])
    )
    mine = equal_error(
        [max(r["error"], 1e-16) for r in ours], [r["seconds"] for r in ours], [target]
    )[0]
    reached, more = bool(np.isfinite(theirs)), smallest["error"] / target
    if not reached:
        theirs, size = smallest["seconds"] * more, more / smallest["step"]
    return {
        "target": target,
        "saltus": float(mine),
        "siconos": float(theirs),
        "step": float(1.0 / size),
        "reached": reached,
    }


def report(results: dict[str, Any]) -> str:
    """What was found, in Markdown."""
    parts = ["# Both layers, beside Siconos"]
    if "absent" in results:
        return "\n\n".join([*parts, f"Siconos is absent: {results['absent']}."]) + "\n"
    parts.append(
        "\n".join(
            f"* {key}: {value}"
            for key, value in [*results["about"].items(), ("Siconos", results["version"])]
        )
    )
    parts.append(READING)
    parts.append(table(HEAD, [_line(row, at) for row in results["cases"] for at in row["equal"]]))
    parts.append("![error against step, and time against error](siconos.png)")
    return "\n\n".join(parts) + "\n"


def _line(row: dict[str, Any], at: dict[str, float]) -> tuple[str, ...]:
    ms, theirs = at["saltus"] * 1e3, at["siconos"] * 1e3
    star = "" if at["reached"] else "*"
    cells = (number(ms), *(number(x) + star for x in (theirs, at["step"], theirs / ms)))
    return (row["about"], str(row["impacts"]), f"{row['order']:.2f}", f"{at['target']:.0e}", *cells)
