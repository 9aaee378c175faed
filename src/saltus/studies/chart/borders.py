"""The exact borders of a stability chart: where its motions are born or lose their stability.

Every change between neighbouring cells is looked into: the orbit is followed across it to the special point at which it ends, and
the widest families' points are followed as curves through the whole plane. What neither explains is told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count
from saltus.errors import MotionError, ParameterError
from saltus.orbits import PeriodicOrbit, SpecialPoint, continue_special
from saltus.studies.chart.augment import ADDED, with_motions
from saltus.studies.chart.changes import Cells, Ends, ends_of, explained, keys_of, passes, read, unseen
from saltus.studies.chart.follow import CONTINUED, KINDS, MISSED, SHRINKS, Ending, Follower
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

MOST = 24  # curves
LOOKS = 3  # times as many changes may be looked into in vain as curves are wanted
MOST_LOOKS = 2000  # changes that are looked into one by one
EASY = 10  # times as many may turn out to be none: the same motion a little further
BESIDE_REST = 10  # times as much as others do the changes matter where the neighbour has rest alone
HARMLESS = (CONTINUED, SHRINKS)


@dataclass
class Borders:
    """Curves through the plane of a chart, each a Dataset along `point`, and what became of the changes on none of them."""

    curves: list[xarray.Dataset] = field(default_factory=list)
    ends: dict[tuple[int, ...], Ending] = field(default_factory=dict)  # by their keys

    def to_xarray(self) -> xarray.DataTree:
        """The curves as groups, and the changes on none of them in the group `ends`: `key` (see `chart_ends.keys_of`), what is
        known, `said`, and where the motion ends: `horizontal`, `vertical`, `amplitude`."""
        import xarray as xr

        keys, rows = list(self.ends), [astuple(ending) for ending in self.ends.values()]
        ends = {
            "key": (("end", "index"), np.array(keys, dtype=int).reshape(-1, 5)),
            "said": ("end", np.array([row[0] for row in rows], dtype=str)),
        }
        for i, name in enumerate(("horizontal", "vertical", "amplitude"), start=1):
            ends[name] = ("end", np.array([row[i] for row in rows], dtype=float))
        groups = {f"curve_{i:02d}": curve for i, curve in enumerate(self.curves)}
        return xr.DataTree.from_dict({"ends": xr.Dataset(ends), **groups})

    @classmethod
    def from_xarray(cls, tree: xarray.DataTree) -> Borders:
        """What `to_xarray` has made, read back."""
        names = sorted(name for name in tree.children if name.startswith("curve_"))
        ends = tree["ends"].to_dataset()
        keys = [tuple(map(int, key)) for key in np.asarray(ends["key"])]
        rows = zip(*(ends[name].values.tolist() for name in ("said", "horizontal", "vertical", "amplitude")), strict=True)
        return cls([tree[name].to_dataset() for name in names], dict(zip(keys, (Ending(*row) for row in rows), strict=True)))


def exact_borders(
    system: System, chart: xarray.Dataset, *, most: int = MOST, progress: Callable[[float], object] | None = None
) -> Borders:
    """The curves of LP, PD, BPC and GR on which the motions of a chart end, and its other ends cell by cell.

    Where a cell has a motion and its neighbour none alike, the orbit is solved for and followed towards the neighbour to the
    special point at which it is lost. The points of the widest families, above all where rest alone is beside them, are followed
    as curves through the plane of the chart; the changes that a curve explains are passed over, and at most 2000 are looked into.

    Args:
        system: that of the chart.
        chart: as `stability_chart` returns it.
        most: how many curves at most.
        progress: called with the share of the changes that are explained.
    """
    return _borders(system, chart, most, progress)[0]


def with_borders(
    system: System, chart: xarray.Dataset, *, most: int = MOST, progress: Callable[[float], object] | None = None
) -> tuple[xarray.Dataset, Borders]:
    """A chart with the stable motions that go on into a cell where no start has led to them, and the exact borders of it.

    Arguments as of `exact_borders`. The chart's attribute `added_by_continuation` is the number of motions added.
    """
    borders, missed = _borders(system, chart, most, progress)
    chart = chart.assign_attrs({ADDED: 0})
    while missed:
        before, chart = chart, with_motions(chart, system, missed)
        if chart.attrs[ADDED] == before.attrs[ADDED]:
            break
        cells, follower = read(chart), Follower(system, chart, read(chart))
        every = ends_of(cells)
        keys = keys_of(cells, every)
        borders.ends = {key: borders.ends[key] for key in keys if key in borders.ends and borders.ends[key].said != MISSED}
        fresh = np.array([key not in borders.ends for key in keys], dtype=bool)
        fresh &= ~explained(cells, every, borders.curves)
        _locate(follower, cells, every.only(fresh), borders, _told(progress, len(every)))
        missed = follower.missed
    return chart, borders


def _borders(
    system: System, chart: xarray.Dataset, most: int, progress: Callable[[float], object] | None
) -> tuple[Borders, list[tuple[int, int, PeriodicOrbit]]]:
    """The borders of a chart, and the orbits that it lacks: row, column, orbit."""
    check_count("most", most, 0)
    found, cells = Borders(), read(chart)
    waiting, follower = ends_of(cells), Follower(system, chart, cells)
    total, looks, easy = max(len(waiting), 1), LOOKS * most, EASY * most
    while len(waiting) and len(found.curves) < most and looks and easy:
        if progress is not None:
            progress(1 - len(waiting) / total)
        urgency, before = _urgency(cells, waiting), len(found.curves)
        first = np.arange(len(waiting)) == np.argmax(urgency)
        ending, special = follower.follow(waiting.only(first))
        curve = None if special is None else _curve(special, waiting.only(first), cells, found.curves, chart.attrs["path"])
        if curve is None:
            found.ends[keys_of(cells, waiting.only(first))[0]] = ending
            looks, easy = (looks, easy - 1) if ending.said in HARMLESS + KINDS else (looks - 1, easy)
        else:
            found.curves.append(curve)
        waiting = waiting.only(~first & ~explained(cells, waiting, found.curves[before:]))
    _locate(follower, cells, waiting, found, _told(progress, total))
    return found, follower.missed


def _told(progress: Callable[[float], object] | None, total: int) -> Callable[[int], object] | None:
    """Progress from how many changes are left of how many."""
    return None if progress is None else lambda left: progress(1 - left / max(total, 1))


def _locate(follower: Follower, cells: Cells, ends: Ends, found: Borders, left: Callable[[int], object] | None) -> None:
    """Follow each of these changes, the most urgent ones if there are too many; all of one motion are one after the other."""
    chosen = np.argsort(-_urgency(cells, ends), kind="stable")[: max(0, MOST_LOOKS - len(found.ends))]
    for done, i in enumerate(chosen[np.argsort(ends.motion[chosen], kind="stable")]):
        if left is not None:
            left(len(chosen) - done)
        end = ends.only(np.array([i]))
        found.ends[keys_of(cells, end)[0]] = follower.follow(end)[0]


def _urgency(cells: Cells, ends: Ends) -> np.ndarray:
    """The larger the family the more, above all with rest alone beside it."""
    size = np.bincount(cells.family, minlength=1)[cells.family[ends.motion]]
    return np.asarray(size * np.where(cells.empty[tuple(ends.target.T)], BESIDE_REST, 1))


def _curve(
    special: SpecialPoint, end: Ends, cells: Cells, known: Sequence[xarray.Dataset], paths: Sequence[str]
) -> xarray.Dataset | None:
    """The curve through a special point, or None if a known one goes through it or it cannot be followed."""
    along = 0 if end.source[0, 0] == end.target[0, 0] else 1
    spot = [float(cells.horizontal[end.source[0, 1]]), float(cells.vertical[end.source[0, 0]])]
    spot[along] = special.parameter
    if any(passes(cells, curve, (spot[0], spot[1])) for curve in known if curve.attrs["kind"] == special.kind):
        return None
    whole = [(float(values.min()), float(values.max())) for values in (cells.horizontal, cells.vertical)]
    try:
        locus = continue_special(special, paths[1 - along], bounds=whole[1 - along], first_bounds=whole[along])
        return curve_dataset(locus, paths)
    except (MotionError, ParameterError):
        return None


def disagreements(chart: xarray.Dataset, borders: Borders) -> xarray.Dataset:
    """Where chart and curves do not agree, away from the cells through which the curves run.

    Returns:
        A Dataset with the changes along `change` that neither a curve nor a special point between the two cells explains:
        `horizontal` and `vertical` halfway between the cells, `amplitude` and `period` of the motion that ends, `cells` of its
        family, whether the neighbour has rest alone, `beside_rest`, and whether the change was `looked_into`; and along
        `unseen` the places on the curves of folds beside which no cell has the motions that end there. The attributes
        `changes` and `changes_beside_rest` count all that there are, `on_curves` those that a curve explains, `harmless` those
        where the same motion goes on, with another amplitude than expected or too small to count; `chaos_beside_rest` counts
        pairs of neighbouring cells, one with rest alone and one where no start settles, between which no motion ends but chaos.
    """
    import xarray as xr

    cells = read(chart)
    ends = ends_of(cells)
    on_curves = explained(cells, ends, borders.curves)
    said = np.array([borders.ends[key].said if key in borders.ends else "" for key in keys_of(cells, ends)], dtype=str)
    harmless = np.isin(said, HARMLESS) & ~on_curves
    left = ends.only(~on_curves & ~harmless & ~np.isin(said, KINDS))
    looked = np.array([key in borders.ends for key in keys_of(cells, left)], dtype=bool)
    middle, lonely = (left.source + left.target) / 2, unseen(cells, borders.curves)
    columns = {
        "amplitude": cells.amplitude[left.motion],
        "period": cells.period[left.motion],
        "cells": np.bincount(cells.family, minlength=1)[cells.family[left.motion]],
        "beside_rest": cells.empty[tuple(left.target.T)],
        "looked_into": looked,
    }
    data = {name: ("change", values) for name, values in columns.items()}
    for i, (name, axis) in enumerate((("vertical", cells.vertical), ("horizontal", cells.horizontal))):
        data[name] = ("change", np.interp(middle[:, i], np.arange(len(axis)), axis))
        data[f"unseen_{name}"] = ("unseen", np.interp(lonely[:, i], np.arange(len(axis)), axis))
    number = chart.transpose("vertical", "horizontal", ...)
    chaos = ((number["count"] == 0) & (number["unsettled"] > 0)).values
    attrs = {
        "changes": len(ends),
        "changes_beside_rest": int(cells.empty[tuple(ends.target.T)].sum()),
        "on_curves": int(on_curves.sum()),
        "harmless": int(harmless.sum()),
        "chaos_beside_rest": _neighbours(chaos, cells.empty),
    }
    return xr.Dataset(data, attrs=attrs)


def _neighbours(some: np.ndarray, others: np.ndarray) -> int:
    """How many pairs of neighbouring cells there are, one of each kind."""
    pairs = ((some[1:], others[:-1]), (some[:-1], others[1:]), (some[:, 1:], others[:, :-1]), (some[:, :-1], others[:, 1:]))
    return int(sum((a & b).sum() for a, b in pairs))


def curve_dataset(locus: Any, paths: Sequence[str]) -> xarray.Dataset:
    """A curve as a Dataset along `point`: `horizontal`, `vertical`, the `amplitude` of its orbits, their `residual`."""
    data = locus.to_xarray()
    order = [list(locus.paths).index(path) for path in paths]
    for name, i in zip(("horizontal", "vertical"), order, strict=True):
        data[name] = ("point", locus.parameters[:, i])
    kept = data[["horizontal", "vertical", "amplitude", "residual", "special_kind"]]
    kept["special_place"] = (("special", "axis"), data["special_parameter"].values[:, order])
    impact_count = locus.orbits[0].signature.impact_count
    kept.attrs = {**data.attrs, "impact_count": impact_count, "path": list(paths)}
    return kept
