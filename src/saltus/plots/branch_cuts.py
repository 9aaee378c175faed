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
# Those of them at which the curve itself has a corner.
CORNERS = ("GR", "SW", "GS", "CS", "SS", "AS")
# Places nearer to one another than this share of their line's extent are one place.
SAME_PLACE = 1e-9
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

    Where two lines meet and the curve has no corner, as at a fold, both take the slope of the
    smooth curve there, from the places on both sides.
    """
    lines = list(branch_lines(branch, quantity))
    corners = np.isin(branch["kind"].values, CORNERS)
    corner_places = np.stack(
        [branch[f"special_{name}"].values[corners] for name in ("parameter", quantity)], axis=1
    )
    counts = branch["impact_count"].values
    joined = [
        bool(counts[line.points.start - 1] == counts[line.points.start])
        and not (corner_places == line.places[0]).all(axis=1).any()
        for line in lines[1:]
    ]
    nothing = np.empty((0, 2))
    for i, line in enumerate(lines):
        before = lines[i - 1].places if i and joined[i - 1] else nothing
        after = lines[i + 1].places if i < len(joined) and joined[i] else nothing
        yield line._replace(places=_smoothed(line.places, before, after))


def _smoothed(line: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """A denser row of points on the monotone cubics through the given ones, (n, 2). The row
    `before` ends, and the row `after` begins, where the line begins and ends: their nearest places
    count for the slope there.
    """
    from scipy.interpolate import PchipInterpolator

    extent = np.ptp(line, axis=0)
    size = np.where(extent > 0, extent, 1.0)

    def steps(rows: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.norm(np.diff(rows, axis=0) / size, axis=1))

    line = line[np.append(True, steps(line) > SAME_PLACE)]
    own = slice(0, len(line))
    for rows, end in ((before[::-1], 0), (after, -1)):
        away = np.linalg.norm((rows - line[end]) / size, axis=1) > SAME_PLACE
        nearest = rows[away][:1]
        if end == 0:
            line = np.concatenate([nearest, line])
            own = slice(len(nearest), len(line))
        else:
            line = np.concatenate([line, nearest])
    if len(line) < 3:
        return line[own]
    length = np.append(0.0, np.cumsum(steps(line)))
    within = length[own]
    shares = np.arange(STEPS_BETWEEN) / STEPS_BETWEEN
    along = np.append((within[:-1, None] + np.diff(within)[:, None] * shares).ravel(), within[-1])
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
