"""The work on the borders of a chart as sweeps, in chunks: what becomes of its changes, and the curves through their ends.

Both are pure functions of arguments that can be written as JSON. The results are kept in folders of the chart's own store, each
named by a digest of what is computed, so that a run that was stopped goes on.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured, unstructured_to_structured

from saltus.errors import MotionError, ParameterError
from saltus.orbits import SpecialPoint, continue_special, find_orbit, follow_stable, start_at
from saltus.progress import Progress
from saltus.provenance import check_provenance, identity
from saltus.studies.chart.border_curves import curve_dataset
from saltus.studies.chart.changes import Changes, ChartMotions, Ways, ending_type, trace
from saltus.studies.chart.follow import lost
from saltus.studies.chart.motions import motion_type
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

    from saltus.sweep import Plan

ENDS, CURVES = "saltus.studies.chart.border_work:ends", "saltus.studies.chart.border_work:curves"
# Changes in a chunk, as many as most charts have: a change whose end takes many steps to enclose costs little if it is followed
# in lanes together with all others. All take some seconds, which a run that is stopped can afford to lose.
CHUNK = 10_000
CURVE_BYTES = 1 << 17  # the most bytes of a curve as text: 1000 points
# The most points of a curve in each direction. Curves from one side of a chart to the other take 20 to 75. One that needs more
# creeps along a grazing, by less than a hundredth of a cell a step; four fifths of the time of Fig. 14 (a) went into such steps.
MOST_POINTS = 100


@dataclass(frozen=True)
class Workshop:
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
        places = {
            "start": _values(chart, self.paths, changes.source),
            "end": _values(chart, self.paths, changes.target),
        }
        numbers = {"periods": self.periods, "max_period": self.max_period, "tol": self.tol, "least": chart.least}
        arguments = {name: {path: a.tolist() for path, a in values.items()} for name, values in places.items()} | numbers
        arguments["motions"] = {name: motions[name].tolist() for name in motions.dtype.names}
        size = structured_to_unstructured(np.zeros(1, kind)).shape[1]
        found = self._run(ENDS, arguments, "change", len(motions), CHUNK, ("number", size), "f8", progress)
        return np.asarray(unstructured_to_structured(found, kind))

    def curves(self, starts: Sequence[Any], bounds: Any, progress: Progress) -> list[xarray.Dataset | None]:
        """For each list of starts, the curve from the first of them that leads to one, or None."""
        arguments = {"starts": list(starts), "bounds": bounds}
        found = self._run(CURVES, arguments, "start", len(starts), 1, ("byte", CURVE_BYTES), "u1", progress)
        return [_read(row) for row in found]

    def _run(
        self,
        function: str,
        arguments: dict[str, Any],
        axis: str,
        count: int,
        chunk: int,
        extra: Any,
        dtype: str,
        progress: Progress,
    ) -> np.ndarray:
        from saltus.sweep import Plan, Variable, run

        arguments |= {"system": self.system.to_json(), "paths": list(self.paths), **identity(self.system)}
        plan = Plan(
            function=function,
            arguments=arguments,
            axes={axis: np.arange(count)},
            chunk={axis: chunk},
            variables={"result": Variable(dtype=dtype, extra=(extra,))},
            attrs={"kind": "chart_borders"},
        )
        store = self._folder(plan)
        found = run(plan, store, workers=self.workers, scheduler=self.scheduler, progress=progress)
        return np.asarray(found["result"].values)

    def _folder(self, plan: Plan) -> Path | None:
        """The folder of a plan's results, by a digest of it, in the chart's store."""
        if self.store is None:
            return None
        digest = hashlib.sha256(json.dumps(plan.describe(), sort_keys=True).encode()).hexdigest()
        folder = self.store / "parts"
        folder.mkdir(parents=True, exist_ok=True)
        return folder / f"{plan.function.rsplit(':', 1)[1]}_{digest[:12]}"


def _values(chart: ChartMotions, paths: tuple[str, str], cells: np.ndarray) -> dict[str, np.ndarray]:
    """The parameters in the middle of cells (n, 2), by dotted path."""
    return {paths[0]: chart.horizontal[cells[:, 1]], paths[1]: chart.vertical[cells[:, 0]]}


def _checked_system(arguments: Mapping[str, Any]) -> System:
    system = System.from_json(arguments["system"])
    check_provenance(arguments, system, "this chart")
    return system


def ends(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """What becomes of some changes of a chart, as rows of numbers."""
    rows, system = np.asarray(block["change"], dtype=int), _checked_system(arguments)
    motions = np.zeros(len(rows), motion_type(system.dimension))
    for name in motions.dtype.names or ():
        motions[name] = np.array(arguments["motions"][name])[rows]
    start, end = ({path: np.array(values)[rows] for path, values in arguments[name].items()} for name in ("start", "end"))
    numbers = {name: arguments[name] for name in ("periods", "max_period", "tol")}
    found = trace(Ways(system, start, end, motions, **numbers), float(arguments["least"]))
    return {"result": structured_to_unstructured(found, dtype=float)}


def curves(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Curves on which motions of a chart end, as text in bytes; nothing but zeros where none can be followed."""
    system, paths = _checked_system(arguments), arguments["paths"]
    rows = []
    for number in np.asarray(block["start"], dtype=int):
        found = (curve_from(system, paths, start, arguments["bounds"]) for start in arguments["starts"][number])
        curve = next((c for c in found if c is not None), None)
        text = b"" if curve is None else json.dumps(as_record(curve)).encode()
        rows.append(text if len(text) <= CURVE_BYTES else b"")
    return {"result": np.stack([np.frombuffer(text.ljust(CURVE_BYTES, b"\0"), np.uint8) for text in rows])}


def as_record(data: xarray.Dataset) -> dict[str, Any]:
    """A dataset as a dictionary that can be written as JSON."""
    variables = {
        name: [list(variable.dims), variable.dtype.str, variable.shape, variable.values.tolist(), dict(variable.attrs)]
        for name, variable in data.variables.items()
    }
    attrs = {name: value.item() if isinstance(value, np.generic) else value for name, value in data.attrs.items()}
    return {"variables": variables, "attrs": attrs}


def _read(row: np.ndarray) -> xarray.Dataset | None:
    """The dataset whose record is written in a row of bytes; None if there is none."""
    import xarray

    text = bytes(row).rstrip(b"\0")
    if not text:
        return None
    record = json.loads(text)
    variables = {
        name: (dims, np.array(values, dtype=dtype).reshape(shape), attrs)
        for name, (dims, dtype, shape, values, attrs) in record["variables"].items()
    }
    return xarray.Dataset(variables, attrs=record["attrs"])


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
        special = lost(follow_stable(orbit, paths[int(start["along"])], float(start["goal"])))
    except (MotionError, ParameterError):
        return None
    return special if isinstance(special, SpecialPoint) else None
