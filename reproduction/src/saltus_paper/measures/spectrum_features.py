"""The features of a diagram as numbers, from its DataTree alone: peaks, detached loops, coexisting
motions, onsets.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np

from saltus import branch_of, branches_of
from saltus.plots import branch_lines, smooth_lines

# least height of a resonance above the minima beside it, as a share of the highest amplitude
PROMINENT = 0.05
FREE_ENDS = {"closed", "bound"}  # the end reasons of a branch that is connected to no other


def within(spectrum: Any, branch: Any) -> np.ndarray:
    """Which points lie within the study's range: families of longer periods are followed beyond."""
    low, high = spectrum.attrs["bounds"]
    values = branch["parameter"].values
    return np.asarray((values >= low) & (values <= high))


def main_branch(spectrum: Any) -> Any:
    """The period-1 branch that covers most of the range."""
    return branch_of(spectrum, _main_number(spectrum))


def _main_number(spectrum: Any) -> int:
    """The number of the main branch, from the table of all points: making a dataset of every branch
    takes much longer.
    """
    # a tree of branches alone has no bounds
    points = spectrum["points"]
    bounds = spectrum.attrs.get("bounds", (-np.inf, np.inf))
    number = points["branch"].values
    values = np.clip(points["parameter"].values, *bounds)
    first = np.flatnonzero(np.diff(number, prepend=-1))
    covered = np.maximum.reduceat(values, first) - np.minimum.reduceat(values, first)
    simple = points["period"].values[first] == 1
    return int(number[first][simple][np.argmax(covered[simple])])


def detached(spectrum: Any) -> list[tuple[int, Any]]:
    """The branches that no special point connects to another one and that reach into the range,
    without the main branch.
    """
    found = []
    main = _main_number(spectrum)
    for number, branch in branches_of(spectrum):
        free = FREE_ENDS.issuperset(np.atleast_1d(branch.attrs["end_reasons"]).tolist())
        if (
            branch.attrs["origin"] == "start"
            and free
            and number != main
            and within(spectrum, branch).any()
        ):
            found.append((number, branch))
    return found


def peaks(branch: Any, share: float = PROMINENT) -> np.ndarray:
    """(parameter, amplitude, rise) of the maxima along a branch that rise by a share of the highest
    one, (n, 3).
    """
    from scipy.signal import find_peaks

    x = branch["parameter"].values
    y = branch["amplitude"].values
    at, facts = find_peaks(y, prominence=share * y.max())
    rows = np.stack([x[at], y[at], facts["prominences"]], axis=1)
    return np.asarray(rows[np.argsort(rows[:, 0], kind="stable")])


def superharmonic(branch: Any, share: float = PROMINENT) -> np.ndarray:
    """The superharmonic peaks, (n, 3): those at frequencies below 2/3 of that of the highest peak,
    the primary resonance.
    """
    top = float(branch["parameter"].values[int(np.argmax(branch["amplitude"].values))])
    found = peaks(branch, share)
    return np.asarray(found[found[:, 0] < 2 / 3 * top])


def amplitudes_at(branch: Any, value: float, stable: bool | None = None) -> np.ndarray:
    """The amplitudes with which the line of a branch passes a value of the parameter; given
    `stable`, of such motions only.
    """
    return passing(steps_of(smooth_lines(branch), stable), value)


def steps_of(lines: Iterable[Any], stable: bool | None = None) -> np.ndarray:
    """The steps of lines, as `smooth_lines` gives them, from place to place: parameter and
    amplitude at both ends, (n, 4).
    """
    chosen = [line.places for line in lines if stable in (None, line.stable)]
    return np.concatenate(
        [np.empty((0, 4)), *(np.hstack([places[:-1], places[1:]]) for places in chosen)]
    )


def passing(steps: np.ndarray, value: float) -> np.ndarray:
    """The amplitudes at which steps (n, 4) pass a value of the parameter; a step contains its lower
    end, not its upper end.
    """
    x, y, later, there = steps[
        (np.minimum(steps[:, 0], steps[:, 2]) <= value)
        & (value < np.maximum(steps[:, 0], steps[:, 2]))
    ].T
    return np.asarray(y + (value - x) / (later - x) * (there - y))


def stable_motions(spectrum: Any, values: np.ndarray) -> np.ndarray:
    """How many stable periodic motions coexist at values of the parameter (n,), mirror images
    counted once, (n,).
    """
    lines = [
        line.places[:, 0]
        for _, branch in branches_of(spectrum)
        for line in smooth_lines(branch)
        if line.stable
    ]
    steps = np.concatenate([np.empty((0, 2)), *(np.stack([x[:-1], x[1:]], axis=1) for x in lines)])
    # A step contains its lower end, but not its upper end, as in `passing`.
    begun, over = (
        np.searchsorted(np.sort(ends), values, side="right")
        for ends in (steps.min(axis=1), steps.max(axis=1))
    )
    return np.asarray(begun - over)


def first_fold(branch: Any) -> tuple[float, float]:
    """(parameter, amplitude) at which a branch begins: its fold of least parameter, nan where it
    has none.
    """
    folds = np.flatnonzero(branch["kind"].values == "LP")
    if not folds.size:
        return (np.nan, np.nan)
    least = folds[int(np.argmin(branch["special_parameter"].values[folds]))]
    return float(branch["special_parameter"][least]), float(branch["special_amplitude"][least])


def count(spectrum: Any, kind: str) -> int:
    """How many special points of a kind lie on all branches within the range."""
    low, high = spectrum.attrs["bounds"]
    kinds, places = (spectrum["special"][name].values for name in ("kind", "special_parameter"))
    return int(((kinds == kind) & (places >= low) & (places <= high)).sum())


def turning(branch: Any) -> np.ndarray:
    """The parameters of the folds at which the stability changes: there motions jump, (n,)."""
    folds = branch["special_parameter"].values[branch["kind"].values == "LP"]
    lines = list(branch_lines(branch))
    meets = [one.places[-1, 0] for one, two in pairwise(lines) if one.stable != two.stable]
    return np.array([fold for fold in folds if fold in meets])


def range_counts(spectrum: Any, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Values spread evenly over the range, and how many stable motions there are at each."""
    low, high = (float(bound) for bound in spectrum.attrs["bounds"])
    values = low + (high - low) * (np.arange(samples) + 0.5) / samples
    return values, stable_motions(spectrum, values)
