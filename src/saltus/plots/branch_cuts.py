"""Branches of a diagram's DataTree, and borders of a chart's, as lines that are drawn in pictures
and read by measures.

A branch (see `branch_tables.py`) has `parameter`, `stable`, `impact_count` and quantities such as
`amplitude` over its points. It also has the model's margins as `margin_...`, and the `kind` of its
special points with their places.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

# the number of parts into which a step between two points of a branch is divided to smooth the line
STEPS_BETWEEN = 6
# The kinds of special points at which the stability can change.
STABILITY_CHANGES = ("LP", "PD", "BPC", "GR", "NS", "SW", "GS", "CS", "SS", "AS")
# the beginning of the names of a branch's variables with the least value of a margin
MARGIN = "margin_"


class ModelValidity(StrEnum):
    """Whether motions of a model are those of its mechanism, by the margins that they pass and the
    `margin_kind` of each.
    """

    HOLDS = "holds"  # they pass no margins except landmarks
    ASSUMPTION = "assumption"  # an assumption of the model fails: the mechanism does something else
    LIMIT = "limit"  # the mechanism has no such positions


class BranchLine(NamedTuple):
    """A part of a branch with one stability, one validity and one number of impacts."""

    stable: bool
    validity: ModelValidity
    points: range  # of the branch
    # (n, 2), parameter and quantity: those points, and the special points at which the part ends
    places: np.ndarray


def border_curves(tree: Any) -> list[Any]:
    """The exact borders of a chart's DataTree, its children `borders/curve_...`, as Datasets in
    order.
    """
    borders = tree["borders"]
    return [
        borders[name].to_dataset() for name in sorted(borders.children) if name.startswith("curve_")
    ]


def branch_lines(branch: Any, quantity: str = "amplitude") -> Iterator[BranchLine]:
    """A branch cut where the stability or the validity changes, and at every grazing, where curves
    have corners.
    """
    places = np.stack([branch["parameter"].values, branch[quantity].values], axis=1)
    stable = np.asarray(branch["stable"].values, dtype=bool)
    validity = validity_of(branch)
    changed = [
        values[1:] != values[:-1] for values in (stable, validity, branch["impact_count"].values)
    ]
    first = 0
    begin = np.empty((0, 2))
    for cut in (int(step) + 1 for step in np.flatnonzero(np.any(changed, axis=0))):
        turns = _turns(branch, quantity, cut, *(bool(change[cut - 1]) for change in changed[:2]))
        ends = np.array([place for place, _ in turns]).reshape(-1, 2)
        yield BranchLine(
            bool(stable[first]),
            validity[first],
            range(first, cut),
            np.concatenate([begin, places[first:cut], ends[:1]]),
        )
        # stability and validity change at different places between the same two points
        if len(turns) > 1:
            mixed = (
                (stable[cut], validity[first]) if turns[0][1] else (stable[first], validity[cut])
            )
            yield BranchLine(bool(mixed[0]), mixed[1], range(cut, cut), ends)
        first = cut
        begin = ends[-1:] if len(ends) else places[cut - 1 : cut]
    yield BranchLine(
        bool(stable[first]),
        validity[first],
        range(first, len(places)),
        np.concatenate([begin, places[first:]]),
    )


def validity_of(branch: Any) -> np.ndarray:
    """The `ModelValidity` of each point of a branch, (n,)."""
    result = np.full(branch.sizes["point"], ModelValidity.HOLDS, dtype=object)
    # the graver one last, so that it counts
    for validity in (ModelValidity.ASSUMPTION, ModelValidity.LIMIT):
        for name in margins_of(branch, validity):
            result[branch[MARGIN + name].values < 0] = validity
    return result


def margins_of(branch: Any, kind: ModelValidity) -> list[str]:
    """The margins that are of a kind."""
    margins = [str(name) for name in branch.data_vars if str(name).startswith(MARGIN)]
    return [
        name.removeprefix(MARGIN)
        for name in margins
        if branch[name].attrs.get("margin_kind") == kind
    ]


def _turns(
    branch: Any, quantity: str, cut: int, stability: bool, validity: bool
) -> list[tuple[np.ndarray, bool]]:
    """The places at which stability or validity change between the points cut - 1 and cut, in
    order; True for stability.
    """
    margins = tuple(
        name
        for kind in (ModelValidity.ASSUMPTION, ModelValidity.LIMIT)
        for name in margins_of(branch, kind)
    )
    kinds = [(STABILITY_CHANGES, True)] * stability + [((*margins, "GR"), False)] * validity
    found = [
        (_place_of_change(branch, quantity, cut, names), of_stability)
        for names, of_stability in kinds
    ]
    if len(found) == 2:
        if np.array_equal(found[0][0], found[1][0]):
            return found[:1]
        here = np.array([branch["parameter"].values[cut - 1], branch[quantity].values[cut - 1]])
        found.sort(key=lambda turn: float(np.linalg.norm(turn[0] - here)))
    return found


def smooth_lines(branch: Any, quantity: str = "amplitude") -> Iterator[BranchLine]:
    """The lines of `branch_lines`, smoothed: with further places on monotone cubics over the length
    between their points.
    """
    for line in branch_lines(branch, quantity):
        yield line._replace(places=_smoothed(line.places))


def _smoothed(line: np.ndarray) -> np.ndarray:
    """A denser row of points on the monotone cubics through the given ones, (n, 2)."""
    from scipy.interpolate import PchipInterpolator

    size = np.ptp(line, axis=0)
    steps = np.linalg.norm(np.diff(line, axis=0) / np.where(size > 0, size, 1.0), axis=1)
    line = line[np.append(True, steps > 1e-9)]
    if len(line) < 3:
        return line
    length = np.append(0.0, np.cumsum(steps[steps > 1e-9]))
    shares = np.arange(STEPS_BETWEEN) / STEPS_BETWEEN
    along = np.append((length[:-1, None] + np.diff(length)[:, None] * shares).ravel(), length[-1])
    return np.asarray(PchipInterpolator(length, line)(along))


def _place_of_change(branch: Any, quantity: str, cut: int, kinds: tuple[str, ...]) -> np.ndarray:
    """The place of a change between the points cut - 1 and cut: the special point of one of these
    kinds there, or the middle.
    """
    names = ("parameter", quantity)
    columns = [branch[name].values for name in names]
    a, b = (np.array([float(column[k]) for column in columns]) for k in (cut - 1, cut))
    size = np.array([np.ptp(column) or 1.0 for column in columns])
    middle = (a + b) / 2
    known = np.isin(branch["kind"].values, kinds)
    places = np.stack([branch[f"special_{name}"].values[known] for name in names], axis=1)
    if not len(places):
        return np.asarray(middle)
    detour = np.linalg.norm((places - a) / size, axis=1) + np.linalg.norm(
        (places - b) / size, axis=1
    )
    best = int(detour.argmin())
    near = detour[best] < 3 * np.linalg.norm((b - a) / size) + 1e-3
    return np.asarray(places[best]) if near else middle
