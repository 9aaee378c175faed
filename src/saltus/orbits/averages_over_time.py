"""Averages over time along a motion, at Gauss's points of its steps; the transmissibility that experimenters measure."""

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
from saltus.systems import System

NODES, WEIGHTS = np.polynomial.legendre.leggauss(
    16
)  # Gauss's rule in each step: exact for polynomials up to degree 31, and a step's Taylor series has order 23 at most
Followed = Motion | PeriodicOrbit | FreeOrbit
Response = Callable[[np.ndarray, Any, Any], Any]


def _slopes(nodes: np.ndarray) -> np.ndarray:
    """The matrix that takes the values of a polynomial at the nodes to its slopes there, by the barycentric formula."""
    one = np.eye(nodes.size)
    apart = nodes[:, None] - nodes + one
    products = np.prod(apart, axis=1)
    matrix = products[:, None] / products / apart * (1.0 - one)
    return np.asarray(matrix - np.diag(matrix.sum(axis=1)))


SLOPES = _slopes(NODES)


@dataclass(frozen=True)
class SampledPart:
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

    def integral(self, values: Any) -> float:
        """The integral over time, of several rows their sum."""
        return float(np.sum(self.weight * values))

    def mean(self, values: Any) -> float:
        """The mean over time."""
        return self.integral(values) / self.length

    def rate(self, values: np.ndarray) -> np.ndarray:
        """The derivatives in time of values (..., n), by the polynomial through Gauss's points of each step."""
        steps = np.reshape(values, (*values.shape[:-1], -1, NODES.size))
        half = self.weight.reshape(-1, NODES.size)[:, :1] / WEIGHTS[0]
        return np.reshape(steps @ SLOPES.T / half, values.shape)


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
    course = course_of(of, periods)
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


def _deviation(course: SampledPart, values: Any) -> float:
    return math.sqrt(max(course.mean((values - course.mean(values)) ** 2), 0.0))


def course_of(of: Followed, periods: int | None) -> SampledPart:
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
    return SampledPart(motion, begin, end, time, position, velocity, side, (half[:, None] * WEIGHTS).reshape(-1))


def _round(orbit: PeriodicOrbit | FreeOrbit) -> tuple[Motion, float, float]:
    """A motion on an orbit, and one period of it that neither begins nor ends at an impact."""
    if isinstance(orbit, FreeOrbit):
        motion = orbit.motion()
        return motion, motion.start, motion.time
    motion = orbit.motion(2 * orbit.period)
    edges = [time for time in motion.impacts.time.tolist() if time > motion.start + 1e-9 * orbit.duration]
    begin = 0.5 * (edges[0] + motion.start) if edges else motion.start
    return motion, begin, begin + orbit.duration
