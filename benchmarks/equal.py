"""The comparison at equal achieved error, and what was asked of it."""

from __future__ import annotations

import math
from typing import Any

from measure import equal_error

TARGETS = (1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14)
OURS = "saltus lanes"
AT_LEAST = {"heyoka.py batch": 5.0, "SciPy DOP853": 1000.0, "SciPy LSODA": 1000.0}


def at_equal_error(work: list[dict[str, Any]]) -> dict[str, list[float]]:
    """Microseconds for one motion over one period at each of TARGETS, by peer; NaN where a code does not get there."""
    columns: dict[str, list[float]] = {}
    for name in dict.fromkeys(row["peer"] for row in work):
        rows = [row for row in work if row["peer"] == name]
        columns[name] = equal_error([r["error"] for r in rows], [r["median"] for r in rows], TARGETS).tolist()
    return columns


def ratios(table: dict[str, list[float]], ours: str) -> dict[str, list[float]]:
    """How many times longer each peer takes than `ours`, at each of TARGETS."""
    return {name: [theirs / own for theirs, own in zip(times, table[ours], strict=True)] for name, times in table.items()}


def asked(results: dict[str, Any]) -> list[tuple[str, str, str]]:
    """What the lanes and the start were asked to reach, what was found, and whether that is enough."""
    lines = []
    table = at_equal_error(results["work"])
    if OURS in table:
        against = ratios(table, OURS)
        for name, least in AT_LEAST.items():
            found = [x for x in against.get(name, []) if math.isfinite(x)]
            if found:
                wanted = f"at equal error at least {least:g} times {name}"
                lines.append((wanted, f"{min(found):.3g} to {max(found):.3g} times", _verdict(min(found) >= least)))
    for row in results["startup"]:
        most = {"another structure, cold": 10.0, "cached": 0.5}.get(row["start"])
        if most and "median" in row:
            wanted = f"{row['peer']}, {row['start']}: under {most:g} s"
            lines.append((wanted, f"{row['median']:.2f} s", _verdict(row["median"] < most)))
        if row["start"] == "other numbers" and "new_files" in row:
            files = row["new_files"]
            lines.append((f"{row['peer']}: nothing compiled for other numbers", f"{files} new files", _verdict(not files)))
    return lines


def _verdict(good: bool) -> str:
    return "yes" if good else "no"
