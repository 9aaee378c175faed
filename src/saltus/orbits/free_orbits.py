"""Free periodic motions of systems without loss, from one turning point to the other and back, and
their period by amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import LIMITS, answered, as_numbers, check_number
from saltus.enumerations import Sentence
from saltus.errors import MotionError, ParameterError, shown
from saltus.flow import Ending, EventKind, Motion, Stop, simulate
from saltus.progress import Progress, silent
from saltus.result import Result, provenance
from saltus.systems import (
    Constant,
    System,
    check_system,
    natural_units,
    time_without_period,
)

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class FreeOrbitSettings:
    """How a free motion is followed until it is back where it began."""

    tol: float = 1e-15  # The error of a step: periods are then exact to some 1e-14.
    # How long the motion is followed first, in natural times; this is then doubled until it comes
    # back.
    first_duration: float = 8.0
    # How many falls from near a contact are followed first.
    falls: float = 100.0
    most_duration: float = (
        # Near a saddle the period grows as the logarithm of the distance from it: with rounding 1e5
        # is never reached.
        1e5
    )
    # The distance from the start, relative to that of the turning points, at which a motion has come
    # back.
    returned: float = 1e-9
    # The sign of the velocity is compared at the ends of so many parts of each step, which takes a
    # third of the period at most.
    parts: int = 16


SETTINGS = FreeOrbitSettings()
ROUNDING = 1e-13


class NoFreeOrbit(Sentence):
    """Why a free motion that begins at rest is no orbit."""

    EQUILIBRIUM = "it stays where it is"
    LOST = "it does not come back to where it began: energy is lost or gained"
    ENDED = "it is ended by a margin of the model, or cannot go on"
    AVERAGED = "it lies so near its contact that impacts are averaged instead of followed; begin farther away"
    AWAY = "it does not turn round within 1e5 natural times"


@dataclass(frozen=True)
class FreeOrbit(Result):
    """A free periodic motion of a system with one coordinate, which begins at rest at one of its
    two turning points.

    If it hits a wall and is thrown back, the wall is the other turning point.

    Attributes
    ----------
    system
        What moves.
    amplitude
        The coordinate of the turning point at which it begins.
    turning
        The coordinate of the other turning point.
    period
        The time after which it repeats itself.
    impact_speed
        The largest speed at an impact; nan without impacts.
    defect
        The distance of its state from itself after the period.

    Examples
    --------
    >>> free = saltus.System(model=saltus.RockingBlock(alpha=0.25), impact=saltus.VelocityReduction(1.0))
    >>> orbit = saltus.free_orbit(free, 0.1)
    >>> bool(abs(orbit.period - saltus.theory.rocking_period(0.1, alpha=0.25)) < 1e-10)
    True
    """

    system: System
    amplitude: float
    turning: float
    period: float
    impact_speed: float
    defect: float

    @property
    def frequency(self) -> float:
        """2 pi / period."""
        return 2.0 * math.pi / self.period

    def motion(self) -> Motion:
        """One period of it."""
        return _followed(self.system, self.amplitude, self.period)

    def to_xarray(self) -> xarray.Dataset:
        """One period of it over `time`, with its numbers as attributes."""
        data = self.motion().to_xarray()
        numbers = {
            name: getattr(self, name)
            for name in ("amplitude", "turning", "period", "impact_speed", "defect")
        }
        data.attrs |= {"title": "free orbit computed by saltus", "kind": "free_orbit"} | numbers
        return data


@answered
def free_orbit(system: System, amplitude: float) -> FreeOrbit:
    """The free periodic motion that begins at rest at the coordinate `amplitude`, of a system
    without loss.

    It is followed from one turning point, theta' = 0, to the other one and back. Each turning point
    is a root of the velocity's Taylor series, and every impact between them is exact. The load must
    be constant. If the motion begins at a distance d from a saddle, its period is exact to about
    1e-16 / d^2, because rounding of the energy then moves the turning point.

    Parameters
    ----------
    system
        What moves, without loss, under a constant load.
    amplitude
        The coordinate at which it begins, at rest.

    Raises
    ------
    ParameterError
        The system has several coordinates, its load varies, or the amplitude is no finite number.
    MotionError
        The motion does not come back: `NoFreeOrbit` says why.

    Examples
    --------
    >>> spring = saltus.System(model=saltus.WallOscillator(stiffness=4.0))
    >>> round(saltus.free_orbit(spring, -0.5).frequency, 12)  # sqrt(k)
    2.0
    """
    _check(system, "free_orbit")
    check_number("amplitude", amplitude)
    found = _found(system, float(amplitude))
    if isinstance(found, NoFreeOrbit):
        name = system.model.coordinates[0]
        raise MotionError(f"no free orbit begins at rest at {name} = {amplitude:g}: {found}")
    return found


@answered
def backbone(
    system: System, amplitudes: Iterable[float], *, progress: Progress = silent
) -> xarray.Dataset:
    """The free periodic motions of a system without loss for several amplitudes: the backbone curve
    of its resonances.

    Parameters
    ----------
    system
        What moves, with one coordinate, under a constant load.
    amplitudes
        The coordinates of the turning point at which the motions begin, at rest.
    progress
        Called with the fraction done.

    Returns
    -------
    xarray.Dataset
        A Dataset over (amplitude): `period`, `frequency` = 2 pi / period, `turning` (the other
        turning point), `impact_speed` (the largest; nan without impacts), `defect`, and `outcome`,
        periodic or a word of `NoFreeOrbit`; nan where there is none.

    Raises
    ------
    ParameterError
        The system has several coordinates, its load varies, or the amplitudes are no finite
        numbers.

    Examples
    --------
    >>> free = saltus.System(model=saltus.RockingBlock(alpha=0.25), impact=saltus.VelocityReduction(1.0))
    >>> line = saltus.backbone(free, [0.05, 0.1, 0.2])
    >>> bool(np.allclose(line.period, saltus.theory.rocking_period([0.05, 0.1, 0.2], alpha=0.25)))
    True
    """
    import xarray

    _check(system, "backbone")
    grid = _numbers(amplitudes)
    found = []
    for i, amplitude in enumerate(grid.tolist()):
        progress(i / grid.size, "free orbits")
        found.append(_found(system, amplitude))
    progress(1.0, "done")
    name = system.model.coordinates[0]
    unit = system.model.unit_of(name)
    columns = {
        "period": ("1", "period"),
        "frequency": ("1", "2 pi / period"),
        "turning": (unit, f"{name} at the other turning point"),
        "impact_speed": (unit, "largest speed of an impact"),
        "defect": (unit, "distance from itself after the period"),
    }
    data = xarray.Dataset(
        coords={
            "amplitude": (
                "amplitude",
                grid,
                {"units": unit, "long_name": f"{name} at a turning point"},
            )
        }
    )
    for key, (units, text) in columns.items():
        values = [
            getattr(orbit, key) if isinstance(orbit, FreeOrbit) else math.nan for orbit in found
        ]
        data[key] = ("amplitude", np.array(values), {"units": units, "long_name": text})
    words = [
        str(Ending.PERIODIC) if isinstance(orbit, FreeOrbit) else orbit.name.lower()
        for orbit in found
    ]
    data["outcome"] = ("amplitude", np.array(words), {"long_name": "what becomes of the motion"})
    data.attrs = {"title": "free orbits computed by saltus", "kind": "backbone"}
    data.attrs |= provenance(system, tol=SETTINGS.tol, coordinate=name)
    return data


def _check(system: System, asking: str) -> None:
    check_system(system, asking, coordinates=1)
    for name, signal in system.load.channels.items():
        if not isinstance(signal, Constant):
            raise ParameterError(
                f"load.{name} varies, and free orbits are those under a constant load",
                f"load.{name}",
            )


def _numbers(amplitudes: Any) -> np.ndarray:
    grid = np.atleast_1d(as_numbers(amplitudes, "amplitudes"))
    if grid.ndim != 1 or not grid.size or not np.isfinite(grid).all():
        raise ParameterError(
            f"amplitudes must be finite numbers, got {shown(amplitudes)}", "amplitudes"
        )
    return grid


def _followed(system: System, amplitude: float, duration: float) -> Motion:
    start: dict[str, Any] = {system.model.coordinates[0]: amplitude}
    return simulate(system, **start, duration=duration, tol=SETTINGS.tol)


def _found(system: System, amplitude: float) -> FreeOrbit | NoFreeOrbit:
    """The free orbit that begins at rest at the coordinate `amplitude`, or the reason why the
    motion is not periodic.
    """
    unit = time_without_period(system) or 1.0
    duration = SETTINGS.first_duration * unit * _share_of_unit(system, amplitude)
    while duration <= SETTINGS.most_duration * unit:
        motion = _followed(system, amplitude, duration)
        turns = _turning_times(motion)
        if len(turns) >= 2:
            return _closed(motion, amplitude, turns[0], turns[1])
        if (motion.stop is Stop.REST and motion.rest_time == motion.start) or not _moves(motion):
            return NoFreeOrbit.EQUILIBRIUM
        if motion.stop is Stop.REST:
            return NoFreeOrbit.LOST
        if any(event.kind is EventKind.CHATTER for event in motion.events):
            return NoFreeOrbit.AVERAGED
        if motion.stop is not Stop.HORIZON:
            return NoFreeOrbit.ENDED
        duration *= 2.0
    return NoFreeOrbit.AWAY


def _share_of_unit(system: System, amplitude: float) -> float:
    """The share of the natural time in which a motion from so near a contact comes back, a hundred
    times over; 1 from anywhere else. Followed for a natural time it would bounce for ever.
    """
    model: Any = system.model
    units = natural_units(system)
    places = (
        [float(model.contact)]
        if model.has_one_contact
        else [
            float(part.position)
            for part in (*model.contacts, *model.surfaces)
            if part.coordinate == model.coordinates[0]
        ]
    )
    distances = [distance for at in places if (distance := abs(amplitude - at)) > 0.0]
    # a fall takes the root of the distance
    share = math.sqrt(min(distances, default=math.inf) / units.length)
    return min(1.0, SETTINGS.falls * share)


def _moves(motion: Motion) -> bool:
    return motion.dense is not None and bool(np.any(motion.dense.series[:, :, 1:]))


def _closed(
    motion: Motion, amplitude: float, half: float, period: float
) -> FreeOrbit | NoFreeOrbit:
    """The orbit whose turning points are reached at `half` and `period`, if it is then back at its
    start.
    """
    turning, back = (float(motion.at(time)[0]) for time in (half, period))
    defect = abs(back - amplitude)
    # the positions themselves have rounding, far from the origin
    if defect > SETTINGS.returned * abs(amplitude - turning) + ROUNDING * abs(amplitude):
        return NoFreeOrbit.LOST
    inside = motion.impacts.time <= period
    speeds = np.abs(motion.impacts.velocity_before[inside])
    return FreeOrbit(
        motion.system,
        amplitude,
        turning,
        period,
        float(speeds.max()) if speeds.size else math.nan,
        defect,
    )


def _turning_times(motion: Motion) -> list[float]:
    """The instants at which the velocity changes its sign, at a root of its series or at an impact,
    after the start.
    """
    dense = motion.dense
    if dense is None:
        return []
    slopes = dense.series[:, 0, 1:] * np.arange(1, dense.series.shape[2])
    shares = np.linspace(0.0, 1.0, SETTINGS.parts + 1)
    turns = []
    sign = 0.0
    for start, length, slope in zip(
        dense.start.tolist(), dense.length.tolist(), slopes[:, ::-1], strict=True
    ):
        values = np.polyval(slope, shares * length)
        values[np.abs(values) <= SETTINGS.tol * np.abs(values).max(initial=0.0)] = 0.0
        known = None  # the last of these instants at which the velocity is not 0, in this step
        for share, value in zip(shares.tolist(), np.sign(values).tolist(), strict=True):
            if value * sign < 0.0:
                turns.append(
                    start if known is None else start + _root(slope, known, share * length)
                )
            if value:
                sign = value
                known = share * length
    return turns


def _root(slope: np.ndarray, low: float, high: float) -> float:
    """The zero of a polynomial between two values of different signs."""
    from scipy.optimize import brentq

    return float(
        brentq(
            lambda time: np.polyval(slope, time),
            low,
            high,
            xtol=1e-300,
            rtol=1e-15,
            maxiter=LIMITS.halvings,
        )
    )
