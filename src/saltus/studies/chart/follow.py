"""What becomes of a motion of a stability chart on the way to a neighbouring cell, found by continuation."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.orbits import Branch, PeriodicOrbit, SpecialPoint, find_orbit, follow_stable
from saltus.studies.chart.changes import Cells, Ends
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

KINDS = ("LP", "PD", "BPC", "GR", "RL", "CH")  # the last two for orbits that rest
EQUAL = 1e-3  # of the amplitude, between the orbit followed to a neighbour and the motion that is there
HERE = 1e-6  # of the way, between a special point and the end of a branch there
CONTINUED, SHRINKS = "the motion goes on", "becomes too small to count"
MISSED = "goes on, but no start of the neighbour has led to it"


@dataclass(frozen=True)
class Ending:
    """What becomes of a motion: the kind of the special point at which it ends, with its place and amplitude, or in words."""

    said: str
    horizontal: float = nan
    vertical: float = nan
    amplitude: float = nan


class Follower:
    """Follows motions of a chart from the middle of their cell to that of a neighbour, one change after the other."""

    def __init__(self, system: System, chart: xarray.Dataset, cells: Cells) -> None:
        self._system, self._chart, self._cells = system, chart, cells
        self.missed: list[tuple[int, int, PeriodicOrbit]] = []  # row, column and a stable orbit there that the chart lacks
        self._paths: list[str] = list(chart.attrs["path"])
        self._last: tuple[int, PeriodicOrbit] | None = None  # the same motion often ends on several sides

    def follow(self, end: Ends) -> tuple[Ending, SpecialPoint | None]:
        """What becomes of the motion of this one change, and the special point if it ends at one."""
        try:
            return self._follow(end)
        except (MotionError, ParameterError) as error:
            return Ending(str(error)), None

    def _follow(self, end: Ends) -> tuple[Ending, SpecialPoint | None]:
        cells, source, target = self._cells, end.source[0], end.target[0]
        along = 0 if source[0] == target[0] else 1
        goal = self._values(target)[along]
        branch = follow_stable(self._orbit(int(end.motion[0])), self._paths[along], goal)
        special = lost(branch)
        if isinstance(special, SpecialPoint):
            place = list(self._values(source))
            place[along] = special.parameter
            return Ending(special.kind, place[0], place[1], special.amplitude), special
        reached = branch.points[-1].orbit
        if branch.points[-1].parameter != goal and reached.amplitude > cells.least:
            return Ending(special), None
        if reached.amplitude < cells.least:
            return Ending(SHRINKS), None
        if not reached.stable:  # and the special point could not be located
            return Ending(special), None
        there = cells.amplitude[(cells.cell == target).all(axis=1)]
        if np.abs(there - reached.amplitude).min(initial=np.inf) < EQUAL * reached.amplitude:
            return Ending(CONTINUED), None
        self.missed.append((int(target[0]), int(target[1]), reached))
        return Ending(MISSED), None

    def _values(self, cell: np.ndarray) -> tuple[float, float]:
        """Of the two parameters in the middle of a cell: along the horizontal axis, along the vertical one."""
        return float(self._cells.horizontal[cell[1]]), float(self._cells.vertical[cell[0]])

    def _orbit(self, motion: int) -> PeriodicOrbit:
        """The orbit of a motion of the chart."""
        if self._last is None or self._last[0] != motion:
            cell = self._cells.cell[motion]
            kept = self._chart.isel(vertical=cell[0], horizontal=cell[1], motion=self._cells.rank[motion])
            state: dict[str, Any] = {self._system.model.coordinates[0]: float(kept["motion_theta"])}
            orbit = find_orbit(
                self._system.with_(dict(zip(self._paths, self._values(cell), strict=True))),
                **state,
                velocity=float(kept["motion_velocity"]),
                period=int(kept["motion_period"]),
                settle=0,
            )
            self._last = motion, orbit
        return self._last[1]


def lost(branch: Branch) -> SpecialPoint | str:
    """The special point at which the orbits of a branch lose their stability, seen from its first point, or why there is none.

    That is also where a family ends at an orbit that is its own image, at a grazing, or where it can rest no longer.
    """
    points = list(branch.points)
    bad = [i for i, point in enumerate(points) if not point.orbit.stable and not point.orbit.grazes]
    known = [special for special in branch.special if special.kind in KINDS]
    if not bad:
        reach = HERE * (float(np.ptp(branch.parameters)) or 1.0)
        if known and abs(known[-1].parameter - points[-1].parameter) <= reach:
            return known[-1]
        return f"no loss of stability: {branch.ends[1]}"
    if bad[0] == 0:
        return "the orbit is not stable to its multipliers"
    before, after = points[bad[0] - 1], points[bad[0]]
    if not known:
        return "no special point where the stability is lost"
    scale = np.array([np.ptp(branch.parameters) or 1.0, np.ptp(branch.amplitudes) or 1.0])
    ends = np.array([[p.parameter, p.orbit.amplitude] for p in (before, after)]) / scale

    def away(special: SpecialPoint) -> float:
        spot = np.array([special.parameter, special.amplitude]) / scale
        return float(np.linalg.norm(spot - ends, axis=1).sum())

    return min(known, key=away)
