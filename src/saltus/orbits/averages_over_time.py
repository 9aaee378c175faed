"""Averages over time that experimenters measure: the transmissibility of a motion, and the mean power that it dissipates."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import check_count
from saltus.errors import ParameterError, near
from saltus.flow import Motion
from saltus.orbits.free_orbits import FreeOrbit
from saltus.orbits.orbit import PeriodicOrbit
from saltus.public_functions import answered
from saltus.systems import ContactModel, Model, System

NODES, WEIGHTS = np.polynomial.legendre.leggauss(
    16
)  # Gauss's rule in each step: exact for polynomials up to degree 31, and a step's Taylor series has order 23 at most
Followed = Motion | PeriodicOrbit | FreeOrbit
Response = Callable[[np.ndarray, Any, Any], Any]


@dataclass(frozen=True)
class _Course:
    """A motion between two times, sampled at Gauss's points of its steps: states are (coordinates, n), all else is (n,)."""

    motion: Motion
    begin: float
    end: float
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    side: np.ndarray
    weight: np.ndarray

    @property
    def system(self) -> System:
        return self.motion.system

    @property
    def length(self) -> float:
        return self.end - self.begin

    def mean(self, values: Any) -> float:
        """The mean over time."""
        return float(np.sum(self.weight * values) / self.length)


@answered
def transmissibility(of: Followed, channel: str, response: Response | None = None, *, periods: int | None = None) -> float:
    """The ratio of the standard deviations over time of a response and of the load that drives it,

        T = sigma(r) / sigma(u),    sigma(f)^2 = (1/D) int (f - mean f)^2 dt,

    for the channel u of the load (its value: a force, or a displacement of the ground) and the response r, over one period of an
    orbit or the last forcing periods of a motion, of duration D. For harmonic functions it is the ratio of their amplitudes.

    Parameters
    ----------
    of
        An orbit, or a motion that was kept densely.
    channel
        The name of a channel of the load, such as "horizontal".
    response
        r(t, position, velocity) of arrays, such as the force on the ground k x + c x', or x plus the ground's
        displacement; by default the first coordinate. With several coordinates positions and velocities are arrays
        (coordinates, n).
    periods
        How many of the last forcing periods of a motion are used, by default 1; under a load without a frequency all of it.

    Raises
    ------
    ParameterError
        The channel does not vary, the motion was not kept densely or is too short, or the response does not return numbers.

    Examples
    --------
    >>> spring = saltus.System(
    ...     model=saltus.WallOscillator(damping=0.1, wall=9.0), load=saltus.Load(frequency=2.0, force=saltus.Harmonic(1.0))
    ... )
    >>> orbit = saltus.find_orbit(spring, x=0.0)
    >>> round(saltus.transmissibility(orbit, "force") * np.hypot(1 - 2.0**2, 0.1 * 2.0), 9)  # x over force
    np.float64(1.0)
    """
    course = _course(of, periods)
    model, load = course.system.model, course.system.load
    if channel not in load.channels:
        raise ParameterError(f"the load has no channel {channel!r}; {near(channel, load.channels)}", "channel")
    single = len(model.coordinates) == 1
    state = (course.position[0], course.velocity[0]) if single else (course.position, course.velocity)
    answer = course.position[0] if response is None else response(course.time, *state)
    try:
        values = np.broadcast_to(np.asarray(answer, dtype=float), course.time.shape)
    except (TypeError, ValueError):
        raise ParameterError("response must return a number for each time, position and velocity", "response") from None
    driving = _deviation(
        course, np.broadcast_to(load.channels[channel].derivative(course.time, load.frequency), course.time.shape)
    )
    if driving == 0.0:
        raise ParameterError(f"load.{channel} does not vary, so nothing is transmitted", "channel")
    return _deviation(course, values) / driving


@answered
def mean_dissipated_power(of: Followed, *, periods: int | None = None) -> float:
    """The energy that damping, friction and impacts dissipate, divided by the time:

        P = (1/D) { sum over impacts [v- M- v- - v+ M+ v+] / 2 - int v f_d dt + sum over frictions int mu_k N abs(v - w) dt },

        f_d = [f(t, q, v) - f(t, q, -v)] / 2,

    over one period of an orbit or the last forcing periods of a motion, of duration D. M is the mass (of the mass matrix, or
    twice the kinetic energy over v^2), f = M q'' the generalised force and f_d its part that is odd in the velocity, such as -c
    v; velocities are relative to the ground. On a periodic orbit P equals the mean power that the load and moving
    grounds supply. For load (i) its unit is that of K2 over the unit of time.

    Parameters
    ----------
    of
        An orbit, or a motion that was kept densely.
    periods
        How many of the last forcing periods of a motion are used, by default 1; under a load without a frequency all of it.

    Raises
    ------
    ParameterError
        The motion was not kept densely or is too short; or the model gives neither its kinetic energy nor its mass
        matrix.

    Examples
    --------
    >>> spring = saltus.System(
    ...     model=saltus.WallOscillator(damping=0.1, wall=9.0), load=saltus.Load(frequency=2.0, force=saltus.Harmonic(1.0))
    ... )
    >>> orbit = saltus.find_orbit(spring, x=0.0)
    >>> expected = 0.1 * (2.0 * orbit.amplitude) ** 2 / 2  # c v^2 over a period
    >>> round(float(saltus.mean_dissipated_power(orbit) / expected), 6)
    1.0
    """
    course = _course(of, periods)
    return course.mean(_friction_power(course) - _damping_power(course)) + _impact_losses(course) / course.length


def _deviation(course: _Course, values: Any) -> float:
    return math.sqrt(max(course.mean((values - course.mean(values)) ** 2), 0.0))


def _course(of: Followed, periods: int | None) -> _Course:
    """An orbit's period, or the last periods of a motion."""
    if periods is not None:
        check_count("periods", periods, 1)
    if isinstance(of, Motion):
        motion, length = of, of.system.load.period
        begin, end = of.start if length is None else of.time - length * (1 if periods is None else periods), of.time
    else:
        motion, begin, end = _round(of)
    if motion.dense is None or begin < motion.start - 1e-9 * max(1.0, abs(motion.time)) or not end > begin:
        raise ParameterError(
            "the motion must have been kept densely for so many forcing periods; simulate it for longer", "periods"
        )
    dense = motion.dense
    first = np.clip(dense.start, begin, end)
    length_left = np.clip(np.minimum(dense.start + dense.length, end) - first, 0.0, None)
    used = length_left > 0.0
    middle, half = (first + 0.5 * length_left)[used], 0.5 * length_left[used]
    time = (middle[:, None] + half[:, None] * NODES).reshape(-1)
    position, velocity, side = dense.states(time)
    return _Course(motion, begin, end, time, position, velocity, side, (half[:, None] * WEIGHTS).reshape(-1))


def _round(orbit: PeriodicOrbit | FreeOrbit) -> tuple[Motion, float, float]:
    """A motion on an orbit, and one period of it that neither begins nor ends at an impact."""
    if isinstance(orbit, FreeOrbit):
        motion = orbit.motion()
        return motion, motion.start, motion.time
    motion = orbit.motion(2 * orbit.period)
    edges = [time for time in motion.impacts.time.tolist() if time > motion.start + 1e-9 * orbit.duration]
    begin = 0.5 * (edges[0] + motion.start) if edges else motion.start
    return motion, begin, begin + orbit.duration


def _has_matrix(model: Model) -> bool:
    return isinstance(model, ContactModel)


def _damping_power(course: _Course) -> Any:
    """v f_d at every time, (n,)."""
    model, load = course.system.model, course.system.load
    if _has_matrix(model):
        q, v = (tuple(x) if len(x) > 1 else x[0] for x in (course.position, course.velocity))
        back = tuple(-x for x in v) if isinstance(v, tuple) else -v
        ahead, behind = (
            np.atleast_2d(np.array(_rows(course.system.contact_model.force(course.time, q, w, load), course.time)))
            for w in (v, back)
        )
        return np.sum(course.velocity * (ahead - behind) / 2, axis=0)
    q, v, side = course.position[0], course.velocity[0], np.where(course.side == 0, 1.0, course.side)
    odd = (model.acceleration(course.time, q, v, side, load) - model.acceleration(course.time, q, -v, side, load)) / 2
    return v * odd * _mass(course, course.time, q, side)


def _friction_power(course: _Course) -> Any:
    """The power that frictions dissipate at every time, (n,)."""
    model, taken = course.system.model, np.zeros_like(course.time)
    if not model.frictions:
        return taken
    q, v = (tuple(x) if len(x) > 1 else x[0] for x in (course.position, course.velocity))
    forces = course.system.contact_model.normal_forces(course.time, q, v, course.system.load)
    for friction, normal in zip(model.frictions, forces, strict=True):
        sliding = course.velocity[model.coordinates.index(friction.coordinate)] - friction.ground_speed
        taken = taken + friction.kinetic * normal * np.abs(sliding)
    return taken


def _rows(forces: Any, times: np.ndarray) -> list[np.ndarray]:
    parts = forces if isinstance(forces, (tuple, list)) else [forces]
    return [np.broadcast_to(np.asarray(part, dtype=float), times.shape) for part in parts]


def _mass(course: _Course, time: Any, q: Any, side: Any) -> Any:
    """The mass M on a side, T(1) + T(-1) - 2 T(0), as the kinetic energy T is quadratic in the velocity."""
    model, load = course.system.model, course.system.load
    forth, back, still = (model.kinetic_energy(time, q, v, side, load) for v in (1.0, -1.0, 0.0))
    return forth + back - 2 * still


def _impact_losses(course: _Course) -> float:
    """The energy that all impacts dissipate."""
    system, impacts = course.system, course.motion.impacts
    late = (impacts.time > course.begin) & (impacts.time <= course.end)
    if not late.any():
        return 0.0
    before, after, times = impacts.velocity_before[late], impacts.velocity_after[late], impacts.time[late]
    if _has_matrix(system.model):
        places, model = course.motion._states(times)[0].T, system.contact_model
        matrices = [np.atleast_2d(np.array(model.mass_matrix(tuple(q) if len(q) > 1 else q[0]), dtype=float)) for q in places]
        pairs = zip(np.reshape(before, places.shape), np.reshape(after, places.shape), matrices, strict=True)
        return float(sum(0.5 * (v @ m @ v - w @ m @ w) for v, w, m in pairs))
    load, impact, side = system.load, system.impact, impacts.side[late].astype(float)
    beyond = np.array(
        [system.one_contact.reset(t, v, s, load, impact)[0] for t, v, s in zip(times, before, side, strict=True)], dtype=float
    )
    contact = float(system.model.contact)
    first, second = (_mass(course, times, contact, s) for s in (side, beyond))
    return float(np.sum(0.5 * (first * before**2 - second * after**2)))
