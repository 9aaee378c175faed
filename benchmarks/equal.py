"""The comparison at equal achieved error, and what was asked of it."""

from __future__ import annotations

import math
from typing import Any

from measure import equal_error
from tasks.startup import CACHED, OTHER_NUMBERS, OTHER_STRUCTURE

TARGETS = (1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14)
OURS = "saltus lanes"
LOST = 1e-2  # an error above this is a motion lost, not a motion followed coarsely
START = 0.5  # seconds
AT_LEAST = {
    "heyoka.py batch": 5.0,
    "SciPy DOP853": 1000.0,
    "SciPy LSODA": 1000.0,
    "prototype lanes": 0.9,  # what proofs and rare states may cost
}


def at_equal_error(work: list[dict[str, Any]]) -> dict[str, list[float]]:
    """Microseconds for one motion over one period at each of TARGETS, by peer; NaN where a code
    does not get there.
    """
    columns: dict[str, list[float]] = {}
    for name in dict.fromkeys(row["peer"] for row in work):
        rows = [row for row in work if row["peer"] == name and row["error"] < LOST]
        columns[name] = equal_error(
            [r["error"] for r in rows], [r["median"] for r in rows], TARGETS
        ).tolist()
    return columns


def ratios(table: dict[str, list[float]], ours: str) -> dict[str, list[float]]:
    """How many times longer each peer takes than `ours`, at each of TARGETS."""
    return {
        name: [theirs / own for theirs, own in zip(times, table[ours], strict=True)]
        for name, times in table.items()
    }


def asked(results: dict[str, Any]) -> list[tuple[str, str, str]]:
    """What the lanes and the start were asked to reach, what was found, and whether that is
    enough.
    """
    lines = []
    table = at_equal_error(results["work"])
    if OURS in table:
        against = ratios(table, OURS)
        for name, least in AT_LEAST.items():
            found = [x for x in against.get(name, []) if math.isfinite(x)]
            if found:
                wanted = f"at equal error at least {least:g} times {name}"
                lines.append(
                    (
                        wanted,
                        f"{min(found):.3g} to {max(found):.3g} times",
                        _verdict(min(found) >= least),
                    )
                )
    return lines + [line for row in results["startup"] for line in _asked_of_a_start(row)]


def _asked_of_a_start(row: dict[str, Any]) -> list[tuple[str, str, str]]:
    if "fails" in row:
        return []
    peer, seconds, after = row["peer"], row["median"], row["after_imports"]
    if row["start"] == OTHER_STRUCTURE:
        return [
            (
                f"{peer}: a structure compiled under 10 s",
                f"{after:.1f} s after the imports",
                _verdict(after < 10),
            )
        ]
    if row["start"] == OTHER_NUMBERS:
        files = row["new_files"]
        return [
            (
                f"{peer}: nothing compiled for other numbers",
                f"{files} files added",
                _verdict(not files),
            )
        ]
    if row["start"] == CACHED:
        wanted = f"{peer}: a cached start under {START:g} s"
        return [
            (f"{wanted}, its packages imported", f"{after:.2f} s", _verdict(after < START)),
            (
                f"{wanted}, Python and all imports included",
                f"{seconds:.2f} s",
                _verdict(seconds < START),
            ),
        ]
    return []


def _verdict(good: bool) -> str:
    return "yes" if good else "no"
