"""The report in Markdown, from the results that run.py also writes as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from equal import OURS, TARGETS, asked, at_equal_error, ratios
from measure import equal_error
from tasks.one_motion import CODES, PERIODS


def report(results: dict[str, Any]) -> str:
    """Everything that was measured, the comparison at equal error first."""
    work = results["work"]
    sections = [
        "# Benchmarks",
        _about(results),
        _asked(results),
        _equal_error(work),
        "![time against error, and throughput](benchmarks.png)",
        _one_motion(results.get("one_motion")),
        _throughput(results["throughput"]),
        _derivatives(results["derivatives"]),
        _fits(results.get("fits")),
        _startup(results["startup"]),
        _paper_way(results["paper_way"], work),
        _zeno(results["zeno"]),
        _grid(results.get("grid")),
        _work(work),
        _peers(results),
    ]
    return "\n\n".join(section for section in sections if section) + "\n"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    head = list(head)
    lines = ["| " + " | ".join(line) + " |" for line in [head, *rows]]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]])


def number(x: float, digits: int = 3) -> str:
    """A number to three digits, without an exponent from 0.001 to 10^5; a dash for none."""
    if x is None or not math.isfinite(x):
        return "-"
    if x and not 1e-3 <= abs(x) < 1e5:
        return f"{x:.{digits - 1}e}"
    return f"{x:,.{max(0, digits - 1 - math.floor(math.log10(abs(x))))}f}" if x else "0"


def _about(results: dict[str, Any]) -> str:
    about = results["about"]
    lines = [f"* {key}: {value}" for key, value in about.items()]
    return (
        "The case: the paper's system under load (i), beta0 = 80 deg, C = 0.1, V = -0.5, H = 0.5,"
        " Omega = 1, e = 1, over 20 forcing periods; one trajectory-period is one motion over one"
        " of them.\n\n" + "\n".join(lines)
    )


def _asked(results: dict[str, Any]) -> str:
    rows = asked(results)
    return "## What was asked\n\n" + table(("asked", "found", "reached"), rows) if rows else ""


def _equal_error(work: list[dict[str, Any]]) -> str:
    times = at_equal_error(work)
    ours = OURS if OURS in times else next(iter(times))
    against = ratios(times, ours)

    def cell(name: str, i: int) -> str:
        if not math.isfinite(times[name][i]):
            return "not reached"
        return number(times[name][i]) + (f" ({number(against[name][i])}x)" if name != ours else "")

    rows = [[name, *(cell(name, i) for i in range(len(TARGETS)))] for name in times]
    return (
        "## At equal achieved error, on one core\n\nMicroseconds of processor time for a"
        f" trajectory-period, and in brackets how many times that of {ours}. The error is the"
        " largest over sixteen motions whose ends are known to 25 digits; times are interpolated"
        " in log-log between the tolerances of each code.\n\n"
        + table(("code", *(f"{t:.0e}" for t in TARGETS)), rows)
    )


MOST = {1: 2.0, 20: 1.0, 1000: 1.0}  # what one motion may take of heyoka's time, by its periods
LOOSE = (1e-6, 1e-8, 1e-10, 1e-12)


def _one_motion(rows: list[dict[str, Any]] | None) -> str:
    if not rows:
        return ""
    codes, times = list(dict.fromkeys(row["code"] for row in rows)), dict[tuple[str, int], Any]()
    for code in codes:
        for periods in PERIODS:
            own = [row for row in rows if (row["code"], row["periods"]) == (code, periods)]
            times[code, periods] = equal_error(
                [row["error"] for row in own], [row["least"] for row in own], LOOSE
            )

    def cell(code: str, periods: int, i: int) -> str:
        own, theirs = times[code, periods][i], times[CODES[0], periods][i]
        return number(own) + (f" ({number(own / theirs, 2)}x)" if code != CODES[0] else "")

    cells = [
        [
            str(periods),
            code,
            *(cell(code, periods, i) for i in range(len(LOOSE))),
            f"{MOST[periods]:g}x" if code == CODES[1] else "",
        ]
        for periods in PERIODS
        for code in codes
    ]
    return (
        "## One motion beside heyoka.py's scalar code, at equal achieved error\n\nMicroseconds of"
        " processor time for a call, the least of all rounds, and in brackets how many times that"
        " of heyoka.py, whose integrator is made once and used again.\n\n"
        + table(("periods", "code", *(f"{t:.0e}" for t in LOOSE), "asked: at most"), cells)
    )


def _throughput(rows: list[dict[str, Any]]) -> str:
    shown = sorted(rows, key=lambda row: (not row["measured"], row["peer"], -row["tol"]))
    cells = [
        [row["peer"], f"{row['tol']:.0e}", number(row["rate"] / 1e6),
         f"{number(row['slowest'] / 1e6)} to {number(row['fastest'] / 1e6)}",
         f"{row['motions']:,} motions" if row["measured"] else "extrapolated from one core"]
        for row in shown
    ]  # fmt: skip
    return "## Throughput on all cores\n\n" + table(
        ("code", "tol", "million trajectory-periods / s", "third quartile to best", "measured on"),
        cells,
    )


def _derivatives(rows: list[dict[str, Any]]) -> str:
    cells = [
        [row["peer"], *(["fails", "", "", "", row["fails"]] if "fails" in row else
         [number(row["without"]), number(row["with"]), number(row["ratio"]), f"{row['error']:.0e}", row["about"]])]
        for row in rows
    ]  # fmt: skip
    return "## Derivatives, at tol 1e-10 on one core\n\n" + table(
        (
            "code",
            "without, us",
            "with, us",
            "ratio",
            "relative error of d(end)/dH",
            "derivatives to",
        ),
        cells,
    )


def _fits(rows: list[dict[str, Any]] | None) -> str:
    if not rows:
        return ""
    head = (
        "unknowns",
        "saltus.fit, ms",
        "two-point differences, ms",
        "ratio",
        "standard errors missed",
        "and by differences",
    )
    cells = [
        [str(row["unknowns"]), *(number(row[name]) for name in ("exact", "differences", "ratio"))]
        + [f"{row[name]:.0e}" for name in ("missed", "missed_by_differences")]
        for row in rows
    ]
    return (
        "## A fit with exact derivatives, on one core\n\nFrom 300 noisy samples of 12 units of"
        " time, from a guess 3 % off. SciPy's `least_squares` with two-point differences of"
        " `simulate` ends at the loosest of its tolerances with which it misses the least squares"
        " by less than 1e-5 standard errors.\n\n" + table(head, cells)
    )


def _startup(rows: list[dict[str, Any]]) -> str:
    def cells(row: dict[str, Any]) -> list[str]:
        if "fails" in row:
            return ["fails: " + row["fails"], "", ""]
        spread = f"{row['median']:.2f} ({row['least']:.2f} to {row['high']:.2f})"
        return [spread, f"{row['after_imports']:.2f}", str(row.get("new_files", "nothing kept"))]

    head = (
        "code",
        "start",
        "seconds: median (least to third quartile)",
        "after the imports",
        "files added to the cache",
    )
    lines = [[row["peer"], row["start"], *cells(row)] for row in rows]
    return "## From the start of Python to the end of the first motion\n\n" + table(head, lines)


def _paper_way(rows: list[dict[str, Any]], work: list[dict[str, Any]]) -> str:
    times = at_equal_error(work)
    ours = OURS if OURS in times else next(iter(times))
    cheapest = min(row["median"] for row in work if row["peer"] == ours)
    cells = [
        [
            number(row["sharpness"]),
            f"{row['error']:.1e}",
            number(row["median"]),
            number(row["median"] * 1e6 / cheapest),
        ]
        for row in rows
    ]
    return (
        "## The paper's way\n\nRK45 at 1e-8 with steps of at most 1e-4 on the equation with"
        f" sgn(theta) smoothed to tanh(B theta / 2), over one period; compared with {ours} at its"
        " loosest tolerance.\n\n"
        + table(("B", "error after one period", "seconds a period", f"times {ours}"), cells)
    )


def _zeno(rows: list[dict[str, Any]]) -> str:
    return (
        "## Infinitely many impacts in a finite time\n\ne = 0.8, H = 0, from theta = 0.3: the"
        " motion is at rest from 17.82077858790958 on. What each code does until time 25:\n\n"
        + table(("code", "outcome"), ([row["peer"], row["verdict"]] for row in rows))
    )


def _grid(row: dict[str, Any] | None) -> str:
    if not row:
        return ""
    if "fails" in row:
        return f"## A grid of initial states\n\nfails: {row['fails']}"
    text = (
        f"{row['n']} x {row['n']} states over {row['periods']} periods at tol {row['tol']:.0e}:"
        f" {row['seconds']:.1f} s, {row['rate'] / 1e6:.2f} million trajectory-periods a second;"
        f" peak memory {row['peak'] / 2**20:.0f} MiB, of which {row['peak_before'] / 2**20:.0f}"
        f" before it began and {row['bytes_of_result'] / 2**20:.0f} of results."
    )
    return (
        "## A grid of initial states\n\n"
        + text
        + ("" if row["finite"] else " Some results are not finite.")
    )


def _work(work: list[dict[str, Any]]) -> str:
    rows = [
        [r["peer"], f"{r['tol']:.0e}", f"{r['error']:.1e}", f"{r['median_error']:.1e}", number(r["median"]),
         f"{number(r['low'])} to {number(r['high'])}", number(r["least"])]
        for r in work
    ]  # fmt: skip
    head = ("code", "tol", "largest error", "median error", "us: median", "quartiles", "least")
    return "## Work and precision, as measured\n\n" + table(head, rows)


def _peers(results: dict[str, Any]) -> str:
    lines = [f"* {peer['name']}: {peer['about']}." for peer in results["peers"]]
    lines += [
        f"* {name}: absent ({reason})."
        for name, reason in results["absent"].items()
        if name != "prototype"
    ]
    return "## What each code does\n\n" + "\n".join(lines)
