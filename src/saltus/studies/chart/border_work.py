"""The work on the borders of a chart: what becomes of its changes, and the curves through their
ends.

Both are pure functions of JSON and arrays, which the memo of the chart's own store remembers, so
that a run that was stopped goes on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.orbits import Branch, SpecialPoint, continue_special, find_orbit, follow_stable
from saltus.progress import Progress
from saltus.result import check_provenance, identity
from saltus.studies.chart.changes import Changes, ChartMotions, Ways, ending_type, trace
from saltus.studies.chart.motions import ALIKE
from saltus.systems import System, arguments_of

if TYPE_CHECKING:
    import xarray

    from saltus.sweep import Memo

ON_CURVE = 0.02  # largest distance, in cells, of a curve from a point through which it goes
# largest distance, in cells, of a crossing from the line through the middles of cells on which it
# lies
ON_LINE = 1e-9


def curve_dataset(curve: Any, paths: Sequence[str]) -> xarray.Dataset:
    """A curve of special points as a Dataset along `point`: `horizontal`, `vertical`, `amplitude`,
    `residual` of its orbits.
    """
    data = curve.to_xarray()
    data["amplitude"] = data["amplitude"].copy(data=[orbit.size for orbit in curve.orbits])
    order = [list(curve.paths).index(path) for path in paths]
    for name, i in zip(("horizontal", "vertical"), order, strict=True):
        data[name] = ("point", curve.parameters[:, i])
    kept: xarray.Dataset = data[["horizontal", "vertical", "amplitude", "residual", "special_kind"]]
    kept["special_place"] = (("special", "axis"), data["special_parameter"].values[:, order])
    orbit = curve.orbits[0]
    kept.attrs = {
        **data.attrs,
        "period": orbit.period,
        "impact_count": orbit.impact_count,
        "path": list(paths),
    }
    return kept


def crossings(chart: ChartMotions, curve: xarray.Dataset) -> np.ndarray:
    """Where a curve crosses the rows and the columns of the cells' middles, (n, 3): row and column
    as numbers of cells from the first ones, not necessarily whole, and the orbit's amplitude
    there."""
    rows, columns = (
        np.interp(curve[name].values, axis, np.arange(len(axis)), left=-1, right=len(axis))
        for name, axis in (("vertical", chart.vertical), ("horizontal", chart.horizontal))
    )
    points = np.stack([rows, columns, curve["amplitude"].values], axis=1)
    found = [np.empty((0, 3))]
    for along in (0, 1):
        for a, b in pairwise(points):
            low, high = sorted((a[along], b[along]))
            lines = np.arange(np.ceil(low), np.floor(high) + 1)
            share = (
                (lines - a[along]) / (b[along] - a[along]) if high > low else np.zeros(len(lines))
            )
            found.append(a + share[:, None] * (b - a))
    return np.concatenate(found)


def explained(
    chart: ChartMotions, changes: Changes, curves: Sequence[xarray.Dataset]
) -> np.ndarray:
    """Whether a curve explains each change: one of orbits similar to the motion that crosses the
    line between the two cells, or its continuation by one cell on both sides."""
    known = np.zeros(len(changes), dtype=bool)
    motions = chart.motions[changes.motion]
    step = changes.target - changes.source
    for curve in curves:
        period = int(curve.attrs["period"])
        same_period = np.isin(motions["period"], (period, 2 * period))
        for *place, amplitude in crossings(chart, curve):
            offset = np.array(place) - changes.source
            along = (offset * step).sum(axis=1)
            across = np.abs(offset * (1 - np.abs(step))).sum(axis=1)
            here = (across < ON_LINE) & (along > -1.0) & (along < 2.0)
            known |= here & same_period & _is_similar(motions["amplitude"], amplitude)
    return known


def _is_similar(amplitudes: np.ndarray, amplitude: float) -> np.ndarray:
    """Whether motions of these amplitudes may end in an orbit of this amplitude."""
    return np.asarray(
        np.abs(amplitudes - amplitude) <= ALIKE.curve * np.maximum(amplitudes, amplitude)
    )


def passes_through(chart: ChartMotions, curve: xarray.Dataset, spot: Sequence[float]) -> bool:
    """Whether a curve goes through a point of the plane."""
    axes = (chart.horizontal, chart.vertical)
    scale = np.array([np.diff(axis).min(initial=np.inf) if axis.size > 1 else 1.0 for axis in axes])
    points = np.stack([curve["horizontal"].values, curve["vertical"].values], axis=1) / scale
    chord = np.diff(points, axis=0)
    away = np.array(spot) / scale - points[:-1]
    length = np.maximum((chord**2).sum(axis=1), 1e-300)
    share = np.clip((away * chord).sum(axis=1) / length, 0.0, 1.0)
    return bool(
        np.linalg.norm(away - share[:, None] * chord, axis=1).min(initial=np.inf) < ON_CURVE
    )


def unseen_folds(chart: ChartMotions, curves: Sequence[xarray.Dataset]) -> np.ndarray:
    """Places (n, 2), row and column, where a curve of folds of motions that count runs between
    cells, and none of these has such a motion.

    Places with another border of the same motions less than a cell away are left out: the motions
    may exist in a strip between the two that is too narrow to contain the middle of a cell.
    """
    found = [np.empty((0, 2))]
    rows = [crossings(chart, curve) for curve in curves]
    rows = [
        row[((row[:, :2] >= 0) & (row[:, :2] <= np.array(chart.monostable.shape) - 1)).all(axis=1)]
        for row in rows
    ]
    points = np.concatenate([np.empty((0, 3)), *rows])
    number = np.repeat(np.arange(len(curves)), [len(row) for row in rows])
    period = np.array([int(curve.attrs["period"]) for curve in curves], dtype=int)[number]
    place = chart.place
    for i, (*spot, amplitude) in enumerate(points):
        if curves[number[i]].attrs["kind"] != "LP" or amplitude < (1 + ALIKE.curve) * chart.least:
            continue
        here = (np.abs(place - spot) < 1 + ON_LINE).all(axis=1) & (
            chart.motions["period"] == period[i]
        )
        strip = (number != number[i]) & (np.abs(points[:, :2] - spot) < 1 + ON_LINE).all(axis=1)
        strip &= np.isin(period, (period[i], 2 * period[i], period[i] / 2)) & _is_similar(
            points[:, 2], amplitude
        )
        if (
            not (here & _is_similar(chart.motions["amplitude"], amplitude)).any()
            and not strip.any()
        ):
            found.append(points[i : i + 1, :2])
    return np.concatenate(found)


# kinds of special points, the last two of orbits with rests
STABILITY_ENDS = ("LP", "PD", "BPC", "GR", "RL", "CH")
AT_THE_END = 1e-6  # a special point within this share of the branch's range from its end is its end


def stability_loss(branch: Branch) -> SpecialPoint | str:
    """The special point at which the orbits of a branch lose their stability, seen from its first
    point, or why there is none.

    It may also be the end of the branch: an orbit that is its own mirror image, a grazing, or the
    end of a rest.
    """
    points = list(branch.points)
    unstable = [
        i for i, point in enumerate(points) if not point.orbit.stable and not point.orbit.grazes
    ]
    known = [special for special in branch.special if special.kind in STABILITY_ENDS]
    if not unstable:
        reach = AT_THE_END * (float(np.ptp(branch.parameters)) or 1.0)
        if known and abs(known[-1].parameter - points[-1].parameter) <= reach:
            return known[-1]
        return f"no loss of stability: {branch.ends[1]}"
    if unstable[0] == 0:
        return "the orbit is not stable to its multipliers"
    if not known:
        return "no special point where the stability is lost"
    scale = np.array([np.ptp(branch.parameters) or 1.0, np.ptp(branch.sizes) or 1.0])
    beside = (
        np.array([[p.parameter, p.orbit.size] for p in points[unstable[0] - 1 : unstable[0] + 1]])
        / scale
    )

    def distance(special: SpecialPoint) -> float:
        spot = np.array([special.parameter, special.orbit.size]) / scale
        return float(np.linalg.norm(spot - beside, axis=1).sum())

    return min(known, key=distance)


HERE = "saltus.studies.chart.border_work"
# Changes in a chunk, as many as most charts have: a change whose end takes many steps to enclose
# costs little if it is followed in lanes together with all others. All take some seconds, which a
# run that is stopped can afford to lose.
CHUNK = 10_000
# The most points of a curve in each direction. Curves from one side of a chart to the other take 20
# to 75. One that needs more creeps along a grazing, by less than a hundredth of a cell a step; four
# fifths of the time of Fig. 14 (a) went into such steps.
MOST_POINTS = 100


@dataclass(frozen=True)
class BorderComputations:
    """The system and the numbers of the work on a chart's borders, and who does this work."""

    system: System
    paths: tuple[str, str]
    periods: int
    max_period: int
    tol: float
    store: Path | None = None
    scheduler: str | None = None
    workers: int | None = None

    def ends(self, chart: ChartMotions, changes: Changes, progress: Progress) -> np.ndarray:
        """What becomes of the motion of each of these changes, of `ending_type`."""
        kind = ending_type(self.system.dimension)
        if not len(changes):
            return np.zeros(0, kind)
        motions = chart.motions[changes.motion]
        starts, goals = (
            _values(chart, self.paths, cells) for cells in (changes.source, changes.target)
        )
        inputs = [
            {"start": a, "goal": b, "motion": motion}
            for a, b, motion in zip(starts, goals, motions, strict=True)
        ]
        numbers = {
            "periods": self.periods,
            "max_period": self.max_period,
            "tol": self.tol,
            "least": chart.least,
        }
        from saltus.sweep import MemoKind

        found = self._memo(numbers).results(
            MemoKind("ends", f"{HERE}:ends", CHUNK), inputs, progress
        )
        return np.stack([np.asarray(one["end"]) for one in found])

    def curves(
        self, starts: Sequence[Any], bounds: Any, progress: Progress
    ) -> list[xarray.Dataset | None]:
        """For each list of starts, the curve from the first of them that leads to one, or None."""
        from saltus.sweep import MemoKind

        kind = MemoKind("curves", f"{HERE}:curves", chunk=1, threaded=False)
        found = self._memo({"bounds": bounds}).results(kind, list(starts), progress)
        return [_read(one["curve"]) for one in found]

    def _memo(self, numbers: Mapping[str, Any]) -> Memo:
        from saltus.sweep import Memo

        common = {
            "system": self.system.to_json(),
            "paths": list(self.paths),
            **identity(self.system),
            **numbers,
        }
        return Memo(common, self.store, self.workers, self.scheduler, patience=0.0)


def _values(chart: ChartMotions, paths: tuple[str, str], cells: np.ndarray) -> np.ndarray:
    """The parameters in the middle of cells (n, 2), in the order of the paths, (n, 2)."""
    return np.column_stack([chart.horizontal[cells[:, 1]], chart.vertical[cells[:, 0]]])


def _checked_system(arguments: Mapping[str, Any]) -> System:
    system = System.from_json(arguments["system"])
    check_provenance(arguments, system, "this chart")
    return system


def ends(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, np.ndarray]:
    """What becomes of some changes of a chart."""
    system = _checked_system(arguments)
    paths = arguments["paths"]
    motions = np.stack([np.asarray(given["motion"]) for given in inputs])
    places = (np.array([given[name] for given in inputs]) for name in ("start", "goal"))
    start, goal = (dict(zip(paths, place.T, strict=True)) for place in places)
    numbers = {name: arguments[name] for name in ("periods", "max_period", "tol")}
    return {"end": trace(Ways(system, start, goal, motions, **numbers), float(arguments["least"]))}


def curves(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, Any]:
    """Curves on which motions of a chart end, as records of datasets; None where none can be
    followed.
    """
    system = _checked_system(arguments)
    paths = arguments["paths"]
    rows = []
    for starts in inputs:  # several for each curve
        found = (curve_from(system, paths, start, arguments["bounds"]) for start in starts)
        curve = next((c for c in found if c is not None), None)
        rows.append(None if curve is None else as_record(curve))
    return {"curve": rows}


def as_record(data: xarray.Dataset) -> dict[str, Any]:
    """A dataset as what JSON has, and arrays."""
    variables = {
        str(name): [list(each.dims), each.values, dict(each.attrs)]
        for name, each in data.variables.items()
    }
    return {"variables": variables, "attrs": dict(data.attrs)}


def _read(record: Any) -> xarray.Dataset | None:
    """The dataset of a record; None if there is none."""
    import xarray

    if record is None:
        return None
    return xarray.Dataset(
        {name: tuple(each) for name, each in record["variables"].items()}, attrs=record["attrs"]
    )


def curve_from(
    system: System, paths: Sequence[str], start: Mapping[str, Any], bounds: Any
) -> xarray.Dataset | None:
    """The curve of the special point at which a motion ends between two cells, or None if it cannot
    be followed.

    `start` has the motion's state, period and place, the axis along which it ends, and a value
    beyond its end.
    """
    special = special_point(system, paths, start)
    along = int(start["along"])
    if special is None:
        return None
    try:
        curve = continue_special(
            special,
            paths[1 - along],
            bounds=tuple(bounds[1 - along]),
            first_bounds=tuple(bounds[along]),
            most_points=MOST_POINTS,
        )
        return curve_dataset(curve, paths)
    except (MotionError, ParameterError):
        return None


def special_point(
    system: System, paths: Sequence[str], start: Mapping[str, Any]
) -> SpecialPoint | None:
    """The special point at which a motion ends between two cells, by continuation of its orbit
    (`start` as in `curve_from`).
    """
    here = system.with_(dict(zip(paths, start["place"], strict=True)))
    try:
        orbit = find_orbit(
            here, **arguments_of(system, start["state"]), period=int(start["period"]), settle=0
        )
        special = stability_loss(
            follow_stable(orbit, paths[int(start["along"])], float(start["goal"]))
        )
    except (MotionError, ParameterError):
        return None
    return special if isinstance(special, SpecialPoint) else None
