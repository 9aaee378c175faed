"""What becomes of a motion of a stability chart on the way to a neighbouring cell, found by continuation."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import nan
from typing import Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.orbits import Branch, PeriodicOrbit, SpecialPoint, find_orbit, follow_stable
from saltus.studies.chart.changes import Changes, ChartMotions
from saltus.studies.chart.motions import ALIKE
from saltus.systems import System

STABILITY_ENDS = ("LP", "PD", "BPC", "GR", "RL", "CH")  # kinds of special points; the last two are of orbits that rest
AT_THE_END = 1e-6  # share of the way: a special point nearer than this to the end of a branch is its end


class ChangeOutcome(StrEnum):
    """What becomes of a motion between two cells."""

    SPECIAL_POINT = "ends at a special point"
    CONTINUED = "the motion goes on"
    SHRINKS = "becomes too small to count"
    MISSED = "goes on, but no start of the neighbour has led to it"
    UNKNOWN = "not known"

    @property
    def is_change(self) -> bool:
        """Whether anything changes between the two cells."""
        return self not in (ChangeOutcome.CONTINUED, ChangeOutcome.SHRINKS)

    @property
    def is_explained(self) -> bool:
        """Whether what has become of the motion is known, and agrees with the chart."""
        return self not in (ChangeOutcome.MISSED, ChangeOutcome.UNKNOWN)


@dataclass(frozen=True)
class Ending:
    """What becomes of a motion: at a special point with its kind, place and amplitude; where nothing is known, why."""

    outcome: ChangeOutcome
    special_kind: str = ""
    reason: str = ""
    horizontal: float = nan
    vertical: float = nan
    amplitude: float = nan


class Follower:
    """Follows motions of a chart from the middle of their cell to that of a neighbour, one change after the other."""

    def __init__(self, system: System, paths: tuple[str, str], chart: ChartMotions) -> None:
        self._system, self._paths, self._chart = system, paths, chart
        self.missed: list[tuple[int, int, PeriodicOrbit]] = []  # row, column and a stable orbit there that the chart lacks
        self._last: tuple[int, PeriodicOrbit] | None = None  # the same motion often ends on several sides

    def follow(self, change: Changes) -> tuple[Ending, SpecialPoint | None]:
        """What becomes of the motion of this one change, and the special point if it ends at one."""
        try:
            return self._follow(change)
        except (MotionError, ParameterError) as error:
            return Ending(ChangeOutcome.UNKNOWN, reason=str(error)), None

    def _follow(self, change: Changes) -> tuple[Ending, SpecialPoint | None]:
        source, target, along = change.source[0], change.target[0], change.along
        goal = self._values(target)[along]
        branch = follow_stable(self._orbit(int(change.motion[0])), self._paths[along], goal)
        special = lost(branch)
        if isinstance(special, SpecialPoint):
            place = list(self._values(source))
            place[along] = special.parameter
            return Ending(ChangeOutcome.SPECIAL_POINT, str(special.kind), "", place[0], place[1], special.amplitude), special
        reached = branch.points[-1].orbit
        if reached.amplitude < self._chart.least:
            return Ending(ChangeOutcome.SHRINKS), None
        if branch.points[-1].parameter != goal or not reached.stable:  # its special point could not be located
            return Ending(ChangeOutcome.UNKNOWN, reason=special), None
        if self._has(target, reached):
            return Ending(ChangeOutcome.CONTINUED), None
        self.missed.append((int(target[0]), int(target[1]), reached))
        return Ending(ChangeOutcome.MISSED), None

    def _has(self, cell: np.ndarray, orbit: PeriodicOrbit) -> bool:
        """Whether a cell has a motion of the size of an orbit."""
        there = self._chart.motions["amplitude"][(self._chart.place == cell).all(axis=1)]
        return bool(np.abs(there - orbit.amplitude).min(initial=np.inf) < ALIKE.followed * orbit.amplitude)

    def _values(self, cell: np.ndarray) -> tuple[float, float]:
        """The two parameters in the middle of a cell: along the horizontal axis, along the vertical one."""
        return float(self._chart.horizontal[cell[1]]), float(self._chart.vertical[cell[0]])

    def _orbit(self, number: int) -> PeriodicOrbit:
        """The orbit of a motion of the chart."""
        if self._last is None or self._last[0] != number:
            motion, values = self._chart.motions[number], self._values(self._chart.place[number])
            state: dict[str, Any] = {self._system.model.coordinates[0]: float(motion["state"][0])}
            system = self._system.with_(dict(zip(self._paths, values, strict=True)))
            orbit = find_orbit(system, **state, velocity=float(motion["state"][1]), period=int(motion["period"]), settle=0)
            self._last = number, orbit
        return self._last[1]


def lost(branch: Branch) -> SpecialPoint | str:
    """The special point at which the orbits of a branch lose their stability, seen from its first point, or why there is none.

    That is also where a family ends at an orbit that is its own image, at a grazing, or where it can rest no longer.
    """
    points = list(branch.points)
    unstable = [i for i, point in enumerate(points) if not point.orbit.stable and not point.orbit.grazes]
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
    scale = np.array([np.ptp(branch.parameters) or 1.0, np.ptp(branch.amplitudes) or 1.0])
    beside = np.array([[p.parameter, p.orbit.amplitude] for p in points[unstable[0] - 1 : unstable[0] + 1]]) / scale

    def distance(special: SpecialPoint) -> float:
        spot = np.array([special.parameter, special.amplitude]) / scale
        return float(np.linalg.norm(spot - beside, axis=1).sum())

    return min(known, key=distance)
