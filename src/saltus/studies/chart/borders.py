"""The exact borders of a stability chart: where its motions are born or lose their stability.

If a cell has a motion that its neighbour lacks, simulation between the two cells shows what becomes of the motion. At the ends of
motions on the longest borders the orbits are solved for, and their special points are followed as curves through the plane.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import check_count
from saltus.enumerations import flags
from saltus.progress import Progress, part_of, silent
from saltus.public_functions import answered
from saltus.studies.chart.added_motions import ADDED, has_motion, with_motions
from saltus.studies.chart.border_curves import explained, passes_through
from saltus.studies.chart.border_starts import border_starts, places
from saltus.studies.chart.border_work import Workshop
from saltus.studies.chart.changes import Changes, ChartMotions, changes_of, keys_of, read_chart
from saltus.studies.chart.endings import ChangeOutcome, ending_type
from saltus.studies.chart.request import ChartRequest
from saltus.systems import System, check_system

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class BorderSettings:
    """How much work the borders of a chart may take."""

    curves: int = 12  # The largest number of curves on which motions end.
    batch: int = 4  # The number of curves that are followed at a time; no further curve is begun at ends that they explain.
    rounds: int = 12  # The largest number of rounds in which motions are added to cells, and the new changes looked into.


SETTINGS = BorderSettings()
KEY = ("row", "column", "amplitude_nrad", "to_row", "to_column")


@dataclass
class Borders:
    """Curves through the plane of a chart, each a Dataset along `point`, and what becomes of its changes.

    Attributes
    ----------
    curves
        The curves on which motions end.
    endings
        What becomes of the motion of each change, of `ending_type`, by the change's key (see `keys_of`).

    Examples
    --------
    >>> len(saltus.studies.Borders().curves)
    0
    """

    curves: list[xarray.Dataset] = field(default_factory=list)
    endings: dict[tuple[int, ...], np.ndarray] = field(default_factory=dict)

    def of(self, chart: ChartMotions, changes: Changes) -> np.ndarray:
        """What becomes of the motions of these changes, of `ending_type`; unknown for changes that were not looked into.

        Parameters
        ----------
        chart
            The motions of a chart.
        changes
            The changes between its neighbouring cells.
        """
        kind = ending_type(chart.motions["state"].shape[1])
        unknown = np.zeros((), kind)
        found = [self.endings.get(key, unknown) for key in keys_of(chart, changes)]
        return np.array(found, dtype=kind).reshape(len(changes))

    def to_xarray(self, chart: ChartMotions) -> xarray.DataTree:
        """The curves as groups, and all changes of a chart in the group `ends`: `key` (see `keys_of`), the `outcome`, the place
        at which the motion ends (`horizontal`, `vertical`) with its `uncertainty` in cells, and the last `amplitude` and `period`
        of the motion.

        Parameters
        ----------
        chart
            The motions of a chart.
        """
        import xarray as xr

        changes = changes_of(chart)
        found, rows = self.of(chart, changes), places(changes, self.of(chart, changes))
        is_end = np.isin(found["outcome"], [outcome for outcome in ChangeOutcome if outcome.is_end])
        spot = np.where(is_end[:, None], rows, np.nan)
        columns = {
            "outcome": (found["outcome"], flags(ChangeOutcome)),
            "horizontal": (np.interp(spot[:, 1], np.arange(len(chart.horizontal)), chart.horizontal), {}),
            "vertical": (np.interp(spot[:, 0], np.arange(len(chart.vertical)), chart.vertical), {}),
            "uncertainty": (np.where(is_end, 0.5 * (found["next"]["share"] - found["settled"]), np.nan), {"units": "cells"}),
            "amplitude": (found["last"]["amplitude"], {}),
            "period": (found["last"]["period"], {}),
        }
        data: dict[str, Any] = {name: ("end", values, attrs) for name, (values, attrs) in columns.items()}
        data["key"] = (("end", "index"), np.array(keys_of(chart, changes), dtype=int).reshape(-1, len(KEY)))
        groups = {f"curve_{i:02d}": curve for i, curve in enumerate(self.curves)}
        return xr.DataTree.from_dict({"ends": xr.Dataset(data), **groups})


@answered
def with_borders(
    system: System,
    chart: xarray.Dataset,
    *,
    curves: int = SETTINGS.curves,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> tuple[xarray.Dataset, Borders]:
    """A chart completed by the stable motions that go on into a cell where no start has led to them, and its exact borders.

    Where a cell has a motion that its neighbour lacks, the motion is followed by simulation towards the neighbour, and its end is
    enclosed between two values of the parameter. A motion that reaches the neighbour is added to the chart. At the ends on the
    longest borders, above all those next to cells with rest alone, the orbit is continued to its special point, and the curve of
    LP, PD, BPC or GR through this point is followed through the plane of the chart.

    Parameters
    ----------
    system
        The system of the chart.
    chart
        A chart as `stability_chart` returns it.
    curves
        The largest number of curves.
    store
        The store of the chart; the work on its borders is kept in it in chunks, so that a run that was stopped goes on.
    workers, scheduler
        Who computes the chunks, see `saltus.sweep.run`.
    progress
        Called with the fraction done and what is being done.

    Returns
    -------
    tuple[xarray.Dataset, Borders]
        The chart, whose attribute `added_by_continuation` is the number of motions added, and its borders.

    Examples
    --------
    >>> chart = saltus.stability_chart(system, horizontal=[0.2, 0.21], vertical=[-0.5, -0.49], starts=4)
    >>> _, borders = saltus.studies.with_borders(system, chart)
    >>> len(borders.curves)  # no border passes between these cells
    0
    """
    check_system(system, "the borders of a chart", several_contacts=True)
    check_count("curves", curves, 0)
    request = ChartRequest.of_chart(system, chart)
    numbers = {"periods": request.periods, "max_period": request.max_period, "tol": request.tol}
    place = None if store is None else Path(store)
    work = Workshop(system, request.paths, store=place, workers=workers, scheduler=scheduler, **numbers)
    search = _BorderSearch(request, work, chart.assign_attrs({ADDED: 0}))
    search.complete(part_of(progress, 0.0, 0.6))
    search.follow_curves(curves, part_of(progress, 0.6, 1.0))
    return search.chart, search.borders


class _BorderSearch:
    """The search for borders: the chart, to which motions are added, and the borders found so far."""

    def __init__(self, request: ChartRequest, work: Workshop, chart: xarray.Dataset) -> None:
        self.request, self.work, self.chart, self.borders = request, work, chart, Borders()
        self._begun: set[str] = set()  # the starts of curves that were tried

    def complete(self, progress: Progress) -> None:
        """Look into all changes of the chart and add the motions that go on; repeat with the new changes until none is added."""
        for i in range(SETTINGS.rounds):
            cells = read_chart(self.chart)
            changes, known = changes_of(cells), self.borders.endings
            fresh = changes.only(np.array([key not in known for key in keys_of(cells, changes)], dtype=bool))
            report = part_of(progress, i / SETTINGS.rounds, (i + 1) / SETTINGS.rounds, "changes between cells")
            known |= dict(zip(keys_of(cells, fresh), self.work.ends(cells, fresh, report), strict=True))
            changes, found = self._missed(cells, changes)
            before = self.chart.attrs[ADDED]
            self.chart = with_motions(self.chart, self.request, changes.target, found["last"])
            if self.chart.attrs[ADDED] == before:
                break

    def _missed(self, cells: ChartMotions, changes: Changes) -> tuple[Changes, np.ndarray]:
        """The changes whose motion reaches a neighbour that lacks it; if the neighbour has it, the change is marked as
        continued."""
        found = self.borders.of(cells, changes)
        reached = np.flatnonzero(found["outcome"] == ChangeOutcome.MISSED)
        there = [has_motion(cells, changes.target[k], found["last"]["amplitude"][k]) for k in reached]
        known = reached[np.array(there, dtype=bool)]
        for key in keys_of(cells, changes.only(known)):
            self.borders.endings[key]["outcome"] = ChangeOutcome.CONTINUED
        left = np.setdiff1d(reached, known)
        return changes.only(left), found[left]

    def follow_curves(self, most: int, progress: Progress) -> None:
        """Follow the curves of the longest borders through the plane, until there are `most` of them."""
        cells = read_chart(self.chart)
        changes = changes_of(cells)
        bounds = [[float(values.min()), float(values.max())] for values in (cells.horizontal, cells.vertical)]
        known = self.borders.curves
        while len(known) < most:
            changes = changes.only(~explained(cells, changes, known))
            starts = border_starts(cells, changes, self.borders.of(cells, changes))
            starts = [start for start in starts if repr(start) not in self._begun][: min(SETTINGS.batch, most - len(known))]
            if not starts:
                break
            self._begun |= {repr(start) for start in starts}
            report = part_of(progress, len(known) / most, (len(known) + len(starts)) / most, "border curves")
            known += [
                curve for curve in self.work.curves(starts, bounds, report) if curve is not None and self._is_new(cells, curve)
            ]

    def _is_new(self, cells: ChartMotions, curve: xarray.Dataset) -> bool:
        """Whether no known curve of its kind goes through the middle of this one."""
        middle = curve.sizes["point"] // 2
        spot = tuple(float(curve[name][middle]) for name in ("horizontal", "vertical"))
        same = (other for other in self.borders.curves if other.attrs["kind"] == curve.attrs["kind"])
        return not any(passes_through(cells, other, spot) for other in same)
