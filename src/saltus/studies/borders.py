"""The exact borders of a stability chart: curves on which its motions are born or lose their stability.

Every change between neighbouring cells is looked into: the orbit is followed across it to the special point at which it ends, and
that is followed through the whole plane. What no curve explains is told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.orbits import Branch, SpecialPoint, continue_orbit, continue_special, find_orbit
from saltus.studies.chart_ends import Cells, Ends, ends_of, explained, keys_of, passes, read, unseen
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

KINDS = ("LP", "PD", "BPC", "GR")
EQUAL = 1e-3  # of the amplitude, between the orbit followed to a neighbour and the motion that is there
MOST = 24  # curves
LOOKS = 3  # times as many changes may be looked into in vain as curves are wanted
EASY = 10  # times as many may turn out to be none: the same motion a little further
BESIDE_REST = 10  # times as much as others do the changes matter where the neighbour has rest alone
CONTINUED, SHRINKS, MEETS = "the motion goes on", "becomes too small to count", "ends on a known curve"
HARMLESS = (CONTINUED, SHRINKS, MEETS)


@dataclass
class Borders:
    """Curves through the plane of a chart, each a Dataset along `point`, and what became of the changes without one."""

    curves: list[xarray.Dataset] = field(default_factory=list)
    ends: dict[tuple[int, ...], str] = field(default_factory=dict)  # by their keys, what became of those without one

    def to_xarray(self) -> xarray.DataTree:
        """The curves as groups, and the ends without one in the group `ends`: row, column and rank of the motion, row and
        column of the neighbour, and what is known of it."""
        import xarray as xr

        keys, said = list(self.ends), list(self.ends.values())
        ends = {"key": (("end", "index"), np.array(keys, dtype=int).reshape(-1, 5)), "said": ("end", np.array(said, dtype=str))}
        groups = {f"curve_{i:02d}": curve for i, curve in enumerate(self.curves)}
        return xr.DataTree.from_dict({"ends": xr.Dataset(ends), **groups})

    @classmethod
    def from_xarray(cls, tree: xarray.DataTree) -> Borders:
        """What `to_xarray` has made, read back."""
        names = sorted(name for name in tree.children if name.startswith("curve_"))
        ends = tree["ends"].to_dataset()
        keys = [tuple(map(int, key)) for key in np.asarray(ends["key"])]
        said = dict(zip(keys, map(str, np.asarray(ends["said"])), strict=True))
        return cls([tree[name].to_dataset() for name in names], said)


def exact_borders(
    system: System, chart: xarray.Dataset, *, most: int = MOST, progress: Callable[[float], object] | None = None
) -> Borders:
    """The curves of LP, PD, BPC and GR on which the motions of a chart end.

    Where a cell has a motion and its neighbour none alike, the orbit is solved for, continued towards the neighbour, and the
    special point at which it is lost continued through the plane of the chart. Changes that a known curve explains are passed
    over; those of the widest families come first, above all where rest alone is beside them.

    Args:
        system: that of the chart.
        chart: as `stability_chart` returns it.
        most: how many curves at most; three times as many changes are looked into in vain at most.
        progress: called with the share of the changes that are explained.
    """
    found, cells = Borders(), read(chart)
    waiting = ends_of(cells)
    total = max(len(waiting), 1)
    for _ in range((LOOKS + EASY) * most):
        if progress is not None:
            progress(1 - len(waiting) / total)
        vain = sum(said not in HARMLESS for said in found.ends.values())
        if not len(waiting) or len(found.curves) >= most or vain >= LOOKS * most:
            break
        first, before = _most_urgent(cells, waiting), len(found.curves)
        _look(system, chart, cells, waiting.only(first), found)
        waiting = waiting.only(~first & ~explained(cells, waiting, found.curves[before:]))
    return found


def _most_urgent(cells: Cells, waiting: Ends) -> np.ndarray:
    """The end of the widest family, above all of those with rest alone beside them; as a mask."""
    size = np.bincount(cells.family)[cells.family[waiting.motion]]
    weight = size * np.where(cells.empty[tuple(waiting.target.T)], BESIDE_REST, 1)
    return np.asarray(np.arange(len(waiting)) == np.argmax(weight))


def _look(system: System, chart: xarray.Dataset, cells: Cells, end: Ends, found: Borders) -> None:
    """Look into a change: a curve, the same motion a little further, or a failure."""
    key = keys_of(cells, end)[0]
    try:
        outcome = _curve(system, chart, cells, end, found.curves)
    except (MotionError, ParameterError) as error:
        outcome = str(error)
    if isinstance(outcome, str):
        found.ends[key] = outcome
    else:
        found.curves.append(outcome)


def disagreements(chart: xarray.Dataset, borders: Borders) -> xarray.Dataset:
    """Where chart and curves do not agree, away from the cells through which the curves run.

    Returns:
        A Dataset with the changes along `change` that no curve explains: `horizontal` and `vertical` halfway between the cells,
        `amplitude` and `period` of the motion that ends, `cells` of its family, and whether the neighbour has rest alone,
        `beside_rest`; and along `unseen` the places on the curves of folds beside which no cell has the motions that end
        there. The attributes `changes` and `changes_beside_rest` count all that there are.
    """
    import xarray as xr

    cells = read(chart)
    ends = ends_of(cells)
    harmless = np.array([borders.ends.get(key) in HARMLESS for key in keys_of(cells, ends)], dtype=bool)
    left = ends.only(~explained(cells, ends, borders.curves) & ~harmless)
    middle, lonely = (left.source + left.target) / 2, unseen(cells, borders.curves)
    columns = {
        "amplitude": cells.amplitude[left.motion],
        "period": cells.period[left.motion],
        "cells": np.bincount(cells.family, minlength=1)[cells.family[left.motion]],
        "beside_rest": cells.empty[tuple(left.target.T)],
    }
    data = {name: ("change", values) for name, values in columns.items()}
    for i, (name, axis) in enumerate((("vertical", cells.vertical), ("horizontal", cells.horizontal))):
        data[name] = ("change", np.interp(middle[:, i], np.arange(len(axis)), axis))
        data[f"unseen_{name}"] = ("unseen", np.interp(lonely[:, i], np.arange(len(axis)), axis))
    beside = int(cells.empty[tuple(ends.target.T)].sum())
    return xr.Dataset(data, attrs={"changes": len(ends), "changes_beside_rest": beside})


def _curve(
    system: System, chart: xarray.Dataset, cells: Cells, end: Ends, known: Sequence[xarray.Dataset]
) -> xarray.Dataset | str:
    """The curve on which a motion of a cell is lost on the way to a neighbour, or why there is none."""
    (row, column), (to_row, to_column) = end.source[0], end.target[0]
    motion = chart.isel(vertical=row, horizontal=column, motion=cells.rank[end.motion[0]])
    paths, along = list(chart.attrs["path"]), 0 if row == to_row else 1
    begin = (float(cells.horizontal[column]), float(cells.vertical[row]))
    target = (float(cells.horizontal[to_column]), float(cells.vertical[to_row]))[along]
    whole = [(float(values.min()), float(values.max())) for values in (cells.horizontal, cells.vertical)]
    state: dict[str, Any] = {system.model.coordinates[0]: float(motion["motion_theta"])}
    orbit = find_orbit(
        system.with_(dict(zip(paths, begin, strict=True))),
        **state,
        velocity=float(motion["motion_velocity"]),
        period=int(motion["motion_period"]),
        settle=0,
    )
    bounds = (min(begin[along], target), max(begin[along], target))
    branch = continue_orbit(orbit, paths[along], bounds)
    special = lost(branch, backwards=target < begin[along])
    if isinstance(special, str):
        here = (cells.cell == end.target[0]).all(axis=1)
        reached = [other.amplitude for other in branch.at(target) if other.stable or other.amplitude < 1e-9]
        same = [np.abs(cells.amplitude[here] - amplitude).min(initial=np.inf) < EQUAL * amplitude for amplitude in reached]
        if any(same):
            return CONTINUED
        return SHRINKS if reached and max(reached) < cells.least else special
    spot = (special.parameter, begin[1]) if along == 0 else (begin[0], special.parameter)
    if any(passes(cells, curve, spot) for curve in known if curve.attrs["kind"] == special.kind):
        return MEETS
    locus = continue_special(special, paths[1 - along], bounds=whole[1 - along], first_bounds=whole[along])
    return curve_dataset(locus, paths)


def lost(branch: Branch, backwards: bool = False) -> SpecialPoint | str:
    """The special point at which the orbits of a branch lose their stability, seen from one of its ends, or why there is none."""
    points = list(branch.points)[::-1] if backwards else list(branch.points)
    bad = [i for i, point in enumerate(points) if not point.orbit.stable and not point.orbit.grazes]
    if not bad:
        reached = branch.ends[0 if backwards else 1]
        return f"no loss of stability: {reached}"
    if bad[0] == 0:
        return "the orbit is not stable to its multipliers"
    before, after = points[bad[0] - 1], points[bad[0]]
    candidates = [special for special in branch.special if special.kind in KINDS]
    if not candidates:
        return "no special point where the stability is lost"
    scale = np.array([np.ptp(branch.parameters) or 1.0, np.ptp(branch.amplitudes) or 1.0])
    ends = np.array([[p.parameter, p.orbit.amplitude] for p in (before, after)]) / scale

    def away(special: SpecialPoint) -> float:
        spot = np.array([special.parameter, special.amplitude]) / scale
        return float(np.linalg.norm(spot - ends, axis=1).sum())

    return min(candidates, key=away)


def curve_dataset(locus: Any, paths: Sequence[str]) -> xarray.Dataset:
    """A curve as a Dataset along `point`: `horizontal`, `vertical`, the `amplitude` of its orbits, their `residual`."""
    data = locus.to_xarray()
    order = [list(locus.paths).index(path) for path in paths]
    for name, i in zip(("horizontal", "vertical"), order, strict=True):
        data[name] = ("point", locus.parameters[:, i])
    kept = data[["horizontal", "vertical", "amplitude", "residual", "special_kind"]]
    kept["special_place"] = (("special", "axis"), data["special_parameter"].values[:, order])
    crossings = locus.orbits[0].signature.crossings
    kept.attrs = {**data.attrs, "crossings": crossings, "path": list(paths)}
    return kept
