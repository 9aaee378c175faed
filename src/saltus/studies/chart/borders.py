"""The exact borders of a stability chart: where its motions are born or lose their stability.

Every change between neighbouring cells is looked into: the orbit is followed across it to the special point at which it ends, and
the points of the widest families are followed as curves through the plane. What neither explains is listed.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count
from saltus.errors import MotionError, ParameterError
from saltus.orbits import PeriodicOrbit, SpecialPoint, continue_special
from saltus.progress import Progress, silent
from saltus.studies.chart.added_motions import ADDED, with_motions
from saltus.studies.chart.border_curves import curve_dataset, explained, passes_through
from saltus.studies.chart.changes import Changes, changes_of, keys_of, read_chart
from saltus.studies.chart.follow import ChangeOutcome, Ending, Follower
from saltus.systems import System

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class BorderSettings:
    """How much work the borders of a chart may take."""

    curves: int = 24  # The largest number of curves on which motions end.
    # The search for curves ends after this many changes, for each curve that is wanted, that could not be explained.
    vain: int = 3
    harmless: int = 10  # It also ends after this many, for each curve, at which the same motion goes on: these cost little.
    one_by_one: int = 2000  # The largest number of changes that are looked into one by one.
    # A change counts this many times where rest is the only motion of the neighbour: that is what a designer asks for.
    beside_rest: int = 10


SETTINGS = BorderSettings()


@dataclass
class Borders:
    """Curves through the plane of a chart, each a Dataset along `point`, and what became of the changes on none of them."""

    curves: list[xarray.Dataset] = field(default_factory=list)
    endings: dict[tuple[int, ...], Ending] = field(default_factory=dict)  # by the key of the change

    def to_xarray(self) -> xarray.DataTree:
        """The curves as groups, and the changes on none of them in the group `ends`: `key` (see `keys_of`), the `outcome`, and
        where the motion ends at a special point its kind, `horizontal`, `vertical` and `amplitude`."""
        import xarray as xr

        rows = [asdict(ending) for ending in self.endings.values()]
        ends: dict[str, Any] = {"key": (("end", "index"), np.array(list(self.endings), dtype=int).reshape(-1, 5))}
        for column in fields(Ending):
            values = [row[column.name] for row in rows]
            ends[column.name] = ("end", np.array(values, dtype=float if column.type == "float" else str))
        groups = {f"curve_{i:02d}": curve for i, curve in enumerate(self.curves)}
        return xr.DataTree.from_dict({"ends": xr.Dataset(ends), **groups})


def with_borders(
    system: System, chart: xarray.Dataset, *, curves: int = SETTINGS.curves, progress: Progress = silent
) -> tuple[xarray.Dataset, Borders]:
    """A chart with the stable motions that go on into a cell where no start has led to them, and the exact borders of it.

    Where a cell has a motion and its neighbour none alike, the orbit is solved for and followed towards the neighbour to the
    special point at which it is lost. The points of the widest families, above all those next to cells with rest only, are
    followed as curves of LP, PD, BPC and GR through the plane of the chart; the changes that a curve explains are passed over,
    and at most 2000 are looked into.

    Args:
        system: that of the chart.
        chart: as `stability_chart` returns it.
        curves: how many curves at most.
        progress: called with the share of the changes that are explained.

    Returns:
        The chart, whose attribute `added_by_continuation` is the number of motions added, and its borders.
    """
    check_count("curves", curves, 0)
    search = first_borders(system, chart, curves, progress)
    chart, borders = chart.assign_attrs({ADDED: 0}), search.borders
    while search.missed:
        before, chart = chart, with_motions(chart, system, search.missed)
        if chart.attrs[ADDED] == before.attrs[ADDED]:
            break
        search = BorderSearch(system, chart, borders, progress)
        search.look_into(search.renewed())
    return chart, borders


def first_borders(system: System, chart: xarray.Dataset, curves: int, progress: Progress = silent) -> BorderSearch:
    """The borders of a chart as it is, in a search that also holds the motions that it lacks."""
    search = BorderSearch(system, chart, Borders(), progress)
    search.follow_curves(curves)
    search.look_into(search.waiting)
    return search


class BorderSearch:
    """The changes of a chart that are still to be explained, and what is known of the others."""

    def __init__(self, system: System, chart: xarray.Dataset, borders: Borders, progress: Progress) -> None:
        self.paths: tuple[str, str] = (str(chart.attrs["path"][0]), str(chart.attrs["path"][1]))
        self.chart, self.borders, self.progress = read_chart(chart), borders, progress
        self.follower = Follower(system, self.paths, self.chart)
        self.waiting = changes_of(self.chart)
        self.total = max(len(self.waiting), 1)

    @property
    def missed(self) -> list[tuple[int, int, PeriodicOrbit]]:
        """Orbits that the chart lacks: row, column, orbit."""
        return self.follower.missed

    def follow_curves(self, most: int) -> None:
        """Follow the most urgent change to its special point and that through the plane, until `most` curves are known."""
        curves, vain, harmless = self.borders.curves, SETTINGS.vain * most, SETTINGS.harmless * most
        while len(self.waiting) and len(curves) < most and vain and harmless:
            self._report_progress(len(self.waiting))
            known, first = len(curves), np.arange(len(self.waiting)) == np.argmax(self._urgency(self.waiting))
            change = self.waiting.only(first)
            ending, special = self.follower.follow(change)
            curve = None if special is None else self._curve(special, change, ending)
            if curve is not None:
                curves.append(curve)
            else:
                self._record(change, ending)
                vain, harmless = (vain, harmless - 1) if ending.outcome.is_explained else (vain - 1, harmless)
            self.waiting = self.waiting.only(~first & ~explained(self.chart, self.waiting, curves[known:]))

    def look_into(self, changes: Changes) -> None:
        """Follow each of these changes, the most urgent ones if there are too many; all of one motion are one after the other."""
        room = max(0, SETTINGS.one_by_one - len(self.borders.endings))
        chosen = np.argsort(-self._urgency(changes), kind="stable")[:room]
        for done, i in enumerate(chosen[np.argsort(changes.motion[chosen], kind="stable")]):
            self._report_progress(len(chosen) - done)
            change = changes.only(np.array([i]))
            self._record(change, self.follower.follow(change)[0])

    def renewed(self) -> Changes:
        """The changes of a chart with added motions of which nothing is known yet; what is gone with them is forgotten."""
        keys, endings = keys_of(self.chart, self.waiting), self.borders.endings
        kept = {key: endings[key] for key in keys if key in endings and endings[key].outcome is not ChangeOutcome.MISSED}
        self.borders.endings = kept
        fresh = np.array([key not in kept for key in keys], dtype=bool)
        return self.waiting.only(fresh & ~explained(self.chart, self.waiting, self.borders.curves))

    def _urgency(self, changes: Changes) -> np.ndarray:
        """The larger the family the more, above all where it is next to a cell with rest only."""
        beside_rest = self.chart.monostable[tuple(changes.target.T)]
        return np.asarray(self.chart.family_size[changes.motion] * np.where(beside_rest, SETTINGS.beside_rest, 1))

    def _record(self, change: Changes, ending: Ending) -> None:
        self.borders.endings[keys_of(self.chart, change)[0]] = ending

    def _report_progress(self, left: int) -> None:
        self.progress(1 - left / self.total, "exact borders")

    def _curve(self, special: SpecialPoint, change: Changes, ending: Ending) -> xarray.Dataset | None:
        """The curve through a special point, or None if a known one goes through it or it cannot be followed."""
        spot = (ending.horizontal, ending.vertical)
        known = (curve for curve in self.borders.curves if curve.attrs["kind"] == special.kind)
        if any(passes_through(self.chart, curve, spot) for curve in known):
            return None
        bounds = [(float(values.min()), float(values.max())) for values in (self.chart.horizontal, self.chart.vertical)]
        along = change.along
        try:
            curve = continue_special(special, self.paths[1 - along], bounds=bounds[1 - along], first_bounds=bounds[along])
            return curve_dataset(curve, self.paths)
        except (MotionError, ParameterError):
            return None
