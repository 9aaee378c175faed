"""Branches of a diagram's DataTree as lines over the parameter, and borders of a chart's: what pictures draw and measures read.

A diagram has children `branch_000`, `branch_001`, ... (see `saltus.orbits`), each with `parameter`, `stable`, `impact_count` and
quantities such as `amplitude` over its points, and the `kind` of its special points with their places.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

STEPS_BETWEEN = 6  # into which the step between two points of a branch is divided where the line is smoothed
STABILITY_CHANGES = ("LP", "PD", "BPC", "GR", "NS")  # the kinds of special points at which the stability can change


class BranchLine(NamedTuple):
    """A part of a branch with one stability and one number of impacts."""

    stable: bool
    points: range  # of the branch
    places: np.ndarray  # (n, 2), parameter and quantity: those points, and the special points where the stability changes


def branches_of(diagram: Any) -> Iterator[tuple[str, Any]]:
    """(name, Dataset) of every branch, in order."""
    for name in sorted(diagram.children):
        if name.startswith("branch_"):
            yield name, diagram[name].to_dataset()


def border_curves(tree: Any) -> list[Any]:
    """The exact borders of a chart's DataTree, its children `borders/curve_...`, as Datasets in order."""
    borders = tree["borders"]
    return [borders[name].to_dataset() for name in sorted(borders.children) if name.startswith("curve_")]


def branch_lines(branch: Any, quantity: str = "amplitude") -> Iterator[BranchLine]:
    """A branch cut where the stability changes and at every grazing, where curves have corners."""
    x, y = np.asarray(branch["parameter"].values), np.asarray(branch[quantity].values)
    stable, impacts = np.asarray(branch["stable"].values, dtype=bool), branch["impact_count"].values
    turned = stable[1:] != stable[:-1]
    cuts = [int(cut) + 1 for cut in np.flatnonzero(turned | (impacts[1:] != impacts[:-1]))]
    turns = {cut: [_stability_change(branch, quantity, cut)] if turned[cut - 1] else [] for cut in cuts}
    for first, last in pairwise([0, *cuts, len(x)]):
        points = [(x[k], y[k]) for k in range(first, last)]
        before = turns.get(first, []) or [(x[first - 1], y[first - 1])] * (first > 0)
        yield BranchLine(bool(stable[first]), range(first, last), np.array([*before, *points, *turns.get(last, [])]))


def smooth_lines(branch: Any, quantity: str = "amplitude") -> Iterator[tuple[bool, np.ndarray, np.ndarray]]:
    """(stable, parameter, quantity) of the same lines, as monotone cubics of the length along them between their points."""
    for line in branch_lines(branch, quantity):
        yield line.stable, *_smoothed(line.places)


def _smoothed(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A denser row of points on the monotone cubics through the given ones, (n, 2)."""
    from scipy.interpolate import PchipInterpolator

    size = np.ptp(line, axis=0)
    steps = np.linalg.norm(np.diff(line, axis=0) / np.where(size > 0, size, 1.0), axis=1)
    line = line[np.append(True, steps > 1e-9)]
    if len(line) < 3:
        return line[:, 0], line[:, 1]
    length = np.append(0.0, np.cumsum(steps[steps > 1e-9]))
    shares = np.arange(STEPS_BETWEEN) / STEPS_BETWEEN
    along = np.append((length[:-1, None] + np.diff(length)[:, None] * shares).ravel(), length[-1])
    dense = PchipInterpolator(length, line)(along)
    return dense[:, 0], dense[:, 1]


def _stability_change(branch: Any, quantity: str, cut: int) -> tuple[float, float]:
    """Where the stability changes between the points cut - 1 and cut: at the special point there, or in their middle."""
    names = ("parameter", quantity)
    a, b = (np.array([float(branch[name][k]) for name in names]) for k in (cut - 1, cut))
    size = np.array([np.ptp(branch[name].values) or 1.0 for name in names])
    middle = (float(a[0] + b[0]) / 2, float(a[1] + b[1]) / 2)
    if "kind" not in branch:
        return middle
    known = np.isin(branch["kind"].values, STABILITY_CHANGES)
    places = np.stack([branch[f"special_{name}"].values[known] for name in names], axis=1)
    if not len(places):
        return middle
    detour = np.linalg.norm((places - a) / size, axis=1) + np.linalg.norm((places - b) / size, axis=1)
    best = int(detour.argmin())
    near = detour[best] < 3 * np.linalg.norm((b - a) / size) + 1e-3
    return (float(places[best, 0]), float(places[best, 1])) if near else middle
