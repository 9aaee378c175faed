"""The work on the borders of a chart: what becomes of its changes, and the curves through their ends.

Both are pure functions of JSON and arrays, which the memo of the chart's own store remembers, so that a run that was stopped goes
on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.orbits import SpecialPoint, continue_special, find_orbit, follow_stable, start_at
from saltus.progress import Progress
from saltus.provenance import check_provenance, identity
from saltus.studies.chart.border_curves import curve_dataset
from saltus.studies.chart.changes import Changes, ChartMotions, Ways, ending_type, trace
from saltus.studies.chart.follow import stability_loss
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

    from saltus.sweep import Memo

HERE = "saltus.studies.chart.border_work"
# Changes in a chunk, as many as most charts have: a change whose end takes many steps to enclose costs little if it is followed
# in lanes together with all others. All take some seconds, which a run that is stopped can afford to lose.
CHUNK = 10_000
# The most points of a curve in each direction. Curves from one side of a chart to the other take 20 to 75. One that needs more
# creeps along a grazing, by less than a hundredth of a cell a step; four fifths of the time of Fig. 14 (a) went into such steps.
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
        starts, goals = (_values(chart, self.paths, cells) for cells in (changes.source, changes.target))
        inputs = [{"start": a, "goal": b, "motion": motion} for a, b, motion in zip(starts, goals, motions, strict=True)]
        numbers = {"periods": self.periods, "max_period": self.max_period, "tol": self.tol, "least": chart.least}
        from saltus.sweep import MemoKind

        found = self._memo(numbers).results(MemoKind("ends", f"{HERE}:ends", CHUNK), inputs, progress)
        return np.stack([np.asarray(one["end"]) for one in found])

    def curves(self, starts: Sequence[Any], bounds: Any, progress: Progress) -> list[xarray.Dataset | None]:
        """For each list of starts, the curve from the first of them that leads to one, or None."""
        from saltus.sweep import MemoKind

        kind = MemoKind("curves", f"{HERE}:curves", chunk=1, threaded=False)
        found = self._memo({"bounds": bounds}).results(kind, list(starts), progress)
        return [_read(one["curve"]) for one in found]

    def _memo(self, numbers: Mapping[str, Any]) -> Memo:
        from saltus.sweep import Memo

        common = {"system": self.system.to_json(), "paths": list(self.paths), **identity(self.system), **numbers}
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
    system, paths = _checked_system(arguments), arguments["paths"]
    motions = np.stack([np.asarray(given["motion"]) for given in inputs])
    places = (np.array([given[name] for given in inputs]) for name in ("start", "goal"))
    start, goal = (dict(zip(paths, place.T, strict=True)) for place in places)
    numbers = {name: arguments[name] for name in ("periods", "max_period", "tol")}
    return {"end": trace(Ways(system, start, goal, motions, **numbers), float(arguments["least"]))}


def curves(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, Any]:
    """Curves on which motions of a chart end, as records of datasets; None where none can be followed."""
    system, paths, rows = _checked_system(arguments), arguments["paths"], []
    for starts in inputs:  # several for each curve
        found = (curve_from(system, paths, start, arguments["bounds"]) for start in starts)
        curve = next((c for c in found if c is not None), None)
        rows.append(None if curve is None else as_record(curve))
    return {"curve": rows}


def as_record(data: xarray.Dataset) -> dict[str, Any]:
    """A dataset as what JSON has, and arrays."""
    variables = {str(name): [list(each.dims), each.values, dict(each.attrs)] for name, each in data.variables.items()}
    return {"variables": variables, "attrs": dict(data.attrs)}


def _read(record: Any) -> xarray.Dataset | None:
    """The dataset of a record; None if there is none."""
    import xarray

    if record is None:
        return None
    return xarray.Dataset({name: tuple(each) for name, each in record["variables"].items()}, attrs=record["attrs"])


def curve_from(system: System, paths: Sequence[str], start: Mapping[str, Any], bounds: Any) -> xarray.Dataset | None:
    """The curve of the special point at which a motion ends between two cells, or None if it cannot be followed.

    `start` has the motion's state, period and place, the axis along which it ends, and a value beyond its end.
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


def special_point(system: System, paths: Sequence[str], start: Mapping[str, Any]) -> SpecialPoint | None:
    """The special point at which a motion ends between two cells, by continuation of its orbit (`start` as in `curve_from`)."""
    here = system.with_(dict(zip(paths, start["place"], strict=True)))
    try:
        orbit = find_orbit(here, **start_at(system, start["state"]), period=int(start["period"]), settle=0)
        special = stability_loss(follow_stable(orbit, paths[int(start["along"])], float(start["goal"])))
    except (MotionError, ParameterError):
        return None
    return special if isinstance(special, SpecialPoint) else None
