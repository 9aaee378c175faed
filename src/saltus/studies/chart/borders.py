"""The exact borders of a stability chart: where its motions are born or lose their stability.

If a cell has a motion that its neighbour lacks, simulation between the two cells shows what becomes
of the motion. Ends of motions that are similar and lie beside one another count as points of one
border. On the longest borders the orbits are solved for, and their special points are followed as
curves through the plane. Motions to which a neighbour's motion leads, but no initial state, are
added to their cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered, check_count
from saltus.enumerations import flags
from saltus.progress import Progress, part_of, silent
from saltus.studies.chart.border_work import BorderComputations, explained, passes_through
from saltus.studies.chart.cells import beyond_limits, spread
from saltus.studies.chart.changes import (
    ENDS,
    SEEN,
    ChangeOutcome,
    Changes,
    ChartMotions,
    changes_of,
    ending_type,
    is_symmetric,
    keys_of,
    read_chart,
)
from saltus.studies.chart.chart_request import ChartRequest
from saltus.studies.chart.motions import (
    ALIKE,
    KEPT,
    by_cell,
    distinct,
    has_alike,
    motion_type,
    outcomes,
    read_motions,
    table,
)
from saltus.systems import System, check_system

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class BorderStartSettings:
    """Which borders are worth a curve."""

    # Ends no farther than this from one another, in cells, may lie on one border.
    reach: float = 1.5
    fewest: int = 3  # The least number of ends on a border that is followed.
    # An end beside cells with rest alone counts this many times, as designers ask for the border of
    # rest.
    beside_rest: int = 10
    # The largest number of ends of a border from which its curve is tried to be begun.
    tries: int = 8
    beyond: float = 0.5  # Orbits are followed this far beyond the end of their motion, in cells.


STARTS = BorderStartSettings()


def border_starts(
    chart: ChartMotions, changes: Changes, endings: np.ndarray
) -> list[list[dict[str, Any]]]:
    """For each border, the most important ones first, the motions from whose ends its curve may be
    begun.
    """
    rows = np.flatnonzero(np.isin(endings["outcome"], ENDS))
    number, weight = _borders(chart, changes.only(rows), endings[rows])
    size = np.bincount(number)
    total = np.bincount(number, weights=weight)
    chosen = sorted(np.flatnonzero(size >= STARTS.fewest), key=lambda border: -total[border])
    return [list(_from(chart, changes, endings, rows[number == border])) for border in chosen]


def places(changes: Changes, endings: np.ndarray) -> np.ndarray:
    """Where motions end, row and column in cells, (n, 2): halfway between the last place where a
    motion has settled and the first place where it is lost."""
    share = 0.5 * (endings["settled"] + endings["next"]["share"])
    return np.asarray(changes.source + share[:, None] * (changes.target - changes.source))


def _borders(
    chart: ChartMotions, changes: Changes, endings: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The number of the border on which each end lies, and the weight of each end."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    last = endings["last"]
    spot = places(changes, endings)
    if not len(last):
        return np.zeros(0, dtype=int), np.zeros(0)
    one, other = cKDTree(spot).query_pairs(STARTS.reach, output_type="ndarray").T
    amplitude = last["amplitude"]
    like = np.abs(amplitude[one] - amplitude[other]) <= ALIKE.family * np.maximum(
        amplitude[one], amplitude[other]
    )
    for values in (last["period"], is_symmetric(last), endings["outcome"]):
        like &= values[one] == values[other]
    graph = coo_array((np.ones(like.sum()), (one[like], other[like])), shape=(len(last), len(last)))
    number = connected_components(graph, directed=False)[1]
    return number, np.where(chart.monostable[tuple(changes.target.T)], STARTS.beside_rest, 1)


def _from(
    chart: ChartMotions, changes: Changes, endings: np.ndarray, rows: np.ndarray
) -> Iterator[dict[str, Any]]:
    """The motions nearest to the middle of a border, as the starts of its curve."""
    spot = places(changes, endings)[rows]
    middle = np.median(spot, axis=0)
    axes = (chart.horizontal, chart.vertical)
    for i in rows[np.argsort(np.abs(spot - middle).sum(axis=1), kind="stable")[: STARTS.tries]]:
        source = changes.source[i]
        target = changes.target[i]
        last = endings["last"][i]
        along = 0 if source[0] == target[0] else 1
        shares = (last["share"], max(endings["next"]["share"][i] + STARTS.beyond, 1.0))
        here, beyond = (
            [_at(axes[k], source[1 - k] + share * (target - source)[1 - k]) for k in (0, 1)]
            for share in shares
        )
        state = [float(value) for value in last["state"]]
        yield {
            "state": state,
            "period": int(last["period"]),
            "place": here,
            "along": along,
            "goal": beyond[along],
        }


def _at(axis: np.ndarray, place: float) -> float:
    """The value of a parameter at a place in cells, within the chart."""
    return float(np.interp(place, np.arange(len(axis)), axis))


ADDED = "added_by_continuation"  # the attribute of the chart that counts them


def with_motions(
    chart: xarray.Dataset, request: ChartRequest, cells: np.ndarray, found: np.ndarray
) -> xarray.Dataset:
    """The chart with the motions found, of `way_type`, in these cells, (n, 2) rows and columns,
    unless the cells have them already. It also has the motions to which these lead in neighbouring
    cells."""
    # its arrays are written to
    made = chart.transpose("vertical", "horizontal", ...).copy(deep=True).load()
    shape = made["count"].shape
    known = read_motions(made)
    new = _as_motions(np.ravel_multi_index(tuple(cells.T), shape), found)
    new = distinct(new[~has_alike(known, new["cell"], new, ALIKE.same)])
    if not len(new):
        return made
    motions = by_cell(spread(request, new, distinct(np.concatenate([known, new]))))
    columns = table(motions, made["count"].size, request.variables)
    # other cells keep only some of their motions, so that none are added there
    complete = made["count"].values <= KEPT
    before = int(made["count"].sum())
    for name, values in columns.items():
        made[name].values[complete] = values.reshape(*shape, *values.shape[1:])[complete]
    parameters = {path: values.reshape(shape) for path, values in request.parameters.items()}
    for name, flag in beyond_limits(request.system, parameters, made["amplitude"].values).items():
        made[name].values[:] = flag
    made["outcome"].values[:] = outcomes(
        *(made[name].values for name in ("count", "unsettled", "verdict"))
    )
    made.attrs[ADDED] = int(chart.attrs[ADDED]) + int(made["count"].sum()) - before
    return made


def has_motion(chart: ChartMotions, cell: np.ndarray, amplitude: float) -> bool:
    """Whether a cell, given by its row and column, has a motion of about this amplitude."""
    there = chart.motions["amplitude"][(chart.place == cell).all(axis=1)]
    return bool(np.abs(there - amplitude).min(initial=np.inf) < ALIKE.followed * amplitude)


def _as_motions(cells: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Motions of `way_type` as motions of cells, of `motion_type`."""
    motions = np.zeros(len(found), motion_type(found["state"].shape[1]))
    motions["cell"] = cells
    for name in SEEN:
        motions[name] = found[name]
    return by_cell(motions)


@dataclass(frozen=True)
class BorderSettings:
    """How much work the borders of a chart may take."""

    curves: int = 12  # The largest number of curves on which motions end.
    # The number of curves that are followed at a time; no further curve is begun at ends that they
    # explain.
    batch: int = 4
    # The largest number of rounds in which motions are added to cells, and the new changes looked
    # into.
    rounds: int = 12


SETTINGS = BorderSettings()
KEY = ("row", "column", "amplitude_nrad", "to_row", "to_column")


@dataclass
class Borders:
    """Curves through the plane of a chart, each a Dataset along `point`, and what becomes of its
    changes.

    Attributes
    ----------
    curves
        The curves on which motions end.
    endings
        What becomes of the motion of each change, of `ending_type`, by the change's key (see
        `keys_of`). Its `outcome` is a number, whose words are in the `flag_meanings` of `outcome`
        in the group `ends` of `to_xarray`.

    Examples
    --------
    >>> len(saltus.studies.Borders().curves)
    0
    """

    curves: list[xarray.Dataset] = field(default_factory=list)
    endings: dict[tuple[int, ...], np.ndarray] = field(default_factory=dict)

    def of(self, chart: ChartMotions, changes: Changes) -> np.ndarray:
        """What becomes of the motions of these changes, of `ending_type`; unknown for changes that
        were not looked into.

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
        """The curves as groups, and all changes of a chart in the group `ends`: `key` (see
        `keys_of`), the `outcome`, the place at which the motion ends (`horizontal`, `vertical`)
        with its `uncertainty` in cells, and the last `amplitude` and `period` of the motion.

        Parameters
        ----------
        chart
            The motions of a chart.
        """
        import xarray as xr

        from saltus.result_tree import ResultTree

        changes = changes_of(chart)
        found = self.of(chart, changes)
        rows = places(changes, self.of(chart, changes))
        is_end = np.isin(found["outcome"], [outcome for outcome in ChangeOutcome if outcome.is_end])
        spot = np.where(is_end[:, None], rows, np.nan)
        columns = {
            "outcome": (found["outcome"], flags(ChangeOutcome)),
            "horizontal": (
                np.interp(spot[:, 1], np.arange(len(chart.horizontal)), chart.horizontal),
                {},
            ),
            "vertical": (np.interp(spot[:, 0], np.arange(len(chart.vertical)), chart.vertical), {}),
            "uncertainty": (
                np.where(is_end, 0.5 * (found["next"]["share"] - found["settled"]), np.nan),
                {"units": "cells"},
            ),
            "amplitude": (found["last"]["amplitude"], {}),
            "period": (found["last"]["period"], {}),
        }
        data: dict[str, Any] = {
            name: ("end", values, attrs) for name, (values, attrs) in columns.items()
        }
        data["key"] = (
            ("end", "index"),
            np.array(keys_of(chart, changes), dtype=int).reshape(-1, len(KEY)),
        )
        groups = {f"curve_{i:02d}": curve for i, curve in enumerate(self.curves)}
        return ResultTree.from_dict({"ends": xr.Dataset(data), **groups})


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
    """A chart completed by the stable motions that go on into a cell where no start has led to
    them, and its exact borders.

    Where a cell has a motion that its neighbour lacks, the motion is followed by simulation towards
    the neighbour, and its end is enclosed between two values of the parameter. A motion that
    reaches the neighbour is added to the chart. The ends on the longest borders are taken, above
    all those next to cells with rest alone. There the orbit is continued to its special point. The
    curve of LP, PD, BPC or GR through this point is followed through the plane of the chart.

    Parameters
    ----------
    system
        The system of the chart.
    chart
        A chart as `stability_chart` returns it.
    curves
        The largest number of curves.
    store
        The store of the chart; the work on its borders is kept in it in chunks, so that a run that
        was stopped goes on.
    workers, scheduler
        Who computes the chunks, see `saltus.sweep.run`.
    progress
        Called with the fraction done and what is being done.

    Returns
    -------
    tuple[xarray.Dataset, Borders]
        The chart, whose attribute `added_by_continuation` is the number of motions added, and its
        borders.

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
    work = BorderComputations(
        system, request.paths, store=place, workers=workers, scheduler=scheduler, **numbers
    )
    search = _BorderSearch(request, work, chart.assign_attrs({ADDED: 0}))
    search.complete(part_of(progress, 0.0, 0.6))
    search.follow_curves(curves, part_of(progress, 0.6, 1.0))
    return search.chart, search.borders


class _BorderSearch:
    """The search for borders: the chart, to which motions are added, and the borders found so
    far.
    """

    def __init__(
        self, request: ChartRequest, work: BorderComputations, chart: xarray.Dataset
    ) -> None:
        self.request = request
        self.work = work
        self.chart = chart
        self.borders = Borders()
        self._begun: set[str] = set()  # the starts of curves that were tried

    def complete(self, progress: Progress) -> None:
        """Look into all changes of the chart and add the motions that go on; repeat with the new
        changes until none is added.
        """
        for i in range(SETTINGS.rounds):
            cells = read_chart(self.chart)
            changes = changes_of(cells)
            known = self.borders.endings
            fresh = changes.only(
                np.array([key not in known for key in keys_of(cells, changes)], dtype=bool)
            )
            report = part_of(
                progress, i / SETTINGS.rounds, (i + 1) / SETTINGS.rounds, "changes between cells"
            )
            known |= dict(
                zip(keys_of(cells, fresh), self.work.ends(cells, fresh, report), strict=True)
            )
            changes, found = self._missed(cells, changes)
            before = self.chart.attrs[ADDED]
            self.chart = with_motions(self.chart, self.request, changes.target, found["last"])
            if self.chart.attrs[ADDED] == before:
                break

    def _missed(self, cells: ChartMotions, changes: Changes) -> tuple[Changes, np.ndarray]:
        """The changes whose motion reaches a neighbour that lacks it; if the neighbour has it, the
        change is marked as continued."""
        found = self.borders.of(cells, changes)
        reached = np.flatnonzero(found["outcome"] == ChangeOutcome.MISSED)
        there = [
            has_motion(cells, changes.target[k], found["last"]["amplitude"][k]) for k in reached
        ]
        known = reached[np.array(there, dtype=bool)]
        for key in keys_of(cells, changes.only(known)):
            self.borders.endings[key]["outcome"] = int(ChangeOutcome.CONTINUED)
        left = np.setdiff1d(reached, known)
        return changes.only(left), found[left]

    def follow_curves(self, most: int, progress: Progress) -> None:
        """Follow the curves of the longest borders through the plane, until there are `most` of
        them.
        """
        cells = read_chart(self.chart)
        changes = changes_of(cells)
        bounds = [
            [float(values.min()), float(values.max())]
            for values in (cells.horizontal, cells.vertical)
        ]
        known = self.borders.curves
        while len(known) < most:
            changes = changes.only(~explained(cells, changes, known))
            starts = border_starts(cells, changes, self.borders.of(cells, changes))
            starts = [start for start in starts if repr(start) not in self._begun][
                : min(SETTINGS.batch, most - len(known))
            ]
            if not starts:
                break
            self._begun |= {repr(start) for start in starts}
            report = part_of(
                progress, len(known) / most, (len(known) + len(starts)) / most, "border curves"
            )
            known += [
                curve
                for curve in self.work.curves(starts, bounds, report)
                if curve is not None and self._is_new(cells, curve)
            ]

    def _is_new(self, cells: ChartMotions, curve: xarray.Dataset) -> bool:
        """Whether no known curve of its kind goes through the middle of this one."""
        middle = curve.sizes["point"] // 2
        spot = tuple(float(curve[name][middle]) for name in ("horizontal", "vertical"))
        same = (
            other for other in self.borders.curves if other.attrs["kind"] == curve.attrs["kind"]
        )
        return not any(passes_through(cells, other, spot) for other in same)
