"""The phase plane under a constant load: the equilibria of any model of one coordinate, and the
separatrices of its saddles.

At an equilibrium (q*, 0) on a side the flow is q'' = a_q (q - q*) + a_v q'. Its eigenvalues obey
lambda^2 - a_v lambda - a_q = 0: a saddle where a_q > 0. At the contact the system rests while the
accelerations of all its sides push it into the contact. The stable manifolds of a saddle, which are
tangent to (1, lambda) there, are computed by the exact backward flow.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.saddle_manifolds import MANIFOLDS, has_left, plane_window
from saltus.attractors.stroboscopic_section import check_periodic
from saltus.checks import LIMITS, check_number
from saltus.errors import ParameterError
from saltus.flow import Motion, Stop, simulate
from saltus.result import Result, result_dataset
from saltus.systems import (
    Box,
    Constant,
    System,
    Window,
    check_system,
    natural_units,
    reversed_system,
    unit_of_time,
)

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class EquilibriumSettings:
    """How equilibria are found, and their eigenvalues."""

    grid: int = 2001  # Number of points of the window between which equilibria are looked for.
    # All of these are in natural units. Derivatives are central differences of sixth order with this
    # step.
    difference: float = 1e-3
    # Real parts up to this count as 0: where no energy is lost the differences leave such an error.
    neutral: float = 1e-9
    # If the acceleration at the contact is 0, its sign is that at this distance inside the side.
    inside: float = 1e-6


EQUILIBRIA = EquilibriumSettings()
# (step, weight) of the central difference for a first derivative
SIXTH_ORDER = ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60))


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium under a constant load.

    Attributes
    ----------
    place
        The coordinate.
    side
        The side on which it lies, 0 at the contact.
    eigenvalues
        The eigenvalues, the one with the larger real part first; None at the contact.
    stable
        Whether no disturbance grows; disturbances need not decay.

    Examples
    --------
    >>> places = saltus.attractors.equilibria(tristable, window=((-2.0, 2.0), (-2.0, 2.0)))
    >>> bool(np.allclose([rest.place for rest in places], [rest.theta for rest in saltus.theory.equilibria(tristable)]))
    True
    """

    place: float
    side: int
    eigenvalues: tuple[complex, complex] | None
    stable: bool

    @property
    def saddle(self) -> bool:
        """Whether one disturbance grows and another one decays."""
        return (
            self.eigenvalues is not None
            and self.eigenvalues[0].real > 0.0 > self.eigenvalues[1].real
        )


def equilibria(system: System, window: Box | None = None) -> tuple[Equilibrium, ...]:
    """The equilibria in a window of the phase plane, by their coordinate, including the contact if
    the system can rest there.

    They are the zeros of the acceleration at rest between 2001 points of the window: two equilibria
    that are closer together than a thousandth of it, as near a fold, may be missed.

    Parameters
    ----------
    system
        What moves, under a constant load.
    window
        A pair (low, high) for the coordinate and one for the velocity; by default 3 natural units to
        both sides of the contact, or of 0 without one.

    Raises
    ------
    ParameterError
        A load that is not constant, several coordinates, a window without meaning.

    Examples
    --------
    >>> rests = saltus.attractors.equilibria(tristable, window=((-2.0, 2.0), (-2.0, 2.0)))
    >>> [rest.stable for rest in rests]
    [True, False, True, False, True]
    """
    check_constant(system)
    area = plane_window(window, system)
    model, low, high = system.model, *area[0]
    touches = model.has_one_contact
    neutral = EQUILIBRIA.neutral / _units(system)[1]
    found = []
    for side in model.every_side:
        grid = np.linspace(low, high, EQUILIBRIA.grid)
        if touches:
            grid = np.sort(
                np.append(
                    grid[np.asarray(system.one_contact.gap(grid, side)) > 0.0],
                    _beside(system, side),
                )
            )
        pull = _pull(system, side)
        for place in _zeros(pull, grid[(grid >= low) & (grid <= high)]):
            values = _eigenvalues(system, place, side)
            found.append(Equilibrium(place, side, values, values[0].real <= neutral))
    if touches and low <= float(model.contact) <= high:
        found += _at_contact(system)
    return tuple(sorted(found, key=lambda one: one.place))


def check_constant(system: System) -> None:
    """Refuse systems that have no phase plane."""
    check_system(system, "a phase plane", coordinates=1)
    check_periodic(system)
    for name, signal in system.load.channels.items():
        if not isinstance(signal, Constant):
            raise ParameterError(
                f"load.{name} varies, so there is no phase plane; `basins` and `stable_manifold` "
                "are for loads that repeat",
                f"load.{name}",
            )


def _pull(system: System, side: int) -> Callable[[float], float]:
    """The acceleration at rest on a side, as a function of the coordinate."""
    return lambda place: float(system.model.acceleration(0.0, place, 0.0, float(side), system.load))


def _beside(system: System, side: int) -> float:
    """A coordinate just inside a side."""
    inside = EQUILIBRIA.inside * _units(system)[0]
    return float(system.model.contact) + inside * system.one_contact.inward(side)


def _units(system: System) -> tuple[float, float]:
    """The natural length and time of a system under a constant load; 1 where it has none."""
    return natural_units(system).length, unit_of_time(system)


def _zeros(pull: Callable[[float], float], grid: np.ndarray) -> Iterator[float]:
    """The zeros of the acceleration, at or between the points of a grid."""
    from scipy.optimize import brentq

    values = np.array([pull(place) for place in grid])
    yield from (float(place) for place in grid[values == 0.0])
    for i in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        low, high = grid[i], grid[i + 1]
        most = LIMITS.halvings
        yield float(brentq(pull, low, high, xtol=1e-300, rtol=1e-15, maxiter=most))


def _eigenvalues(system: System, place: float, side: int) -> tuple[complex, complex]:
    def pull(q: float, v: float) -> float:
        return float(system.model.acceleration(0.0, q, v, float(side), system.load))

    length, time = _units(system)
    h = EQUILIBRIA.difference * length
    u = h / time
    slope = (
        sum(w * (pull(place + j * h, 0.0) - pull(place - j * h, 0.0)) for j, w in SIXTH_ORDER) / h
    )
    loss = sum(w * (pull(place, j * u) - pull(place, -j * u)) for j, w in SIXTH_ORDER) / u
    root = cmath.sqrt(0.25 * loss * loss + slope)
    return 0.5 * loss + root, 0.5 * loss - root


def _at_contact(system: System) -> list[Equilibrium]:
    """The contact as an equilibrium: a stable one if all sides push towards it, an unstable one if
    both push away from it.
    """
    contact = float(system.model.contact)
    outward = []
    for side in system.model.every_side:
        place = _beside(system, side)
        pull = _pull(system, side)
        outward.append((pull(contact) or pull(place)) * (place - contact) > 0.0)
    none = any(outward) and (len(outward) == 1 or not all(outward))
    return [] if none else [Equilibrium(contact, 0, None, not any(outward))]


@dataclass(frozen=True)
class SeparatrixSettings:
    """How a separatrix is followed."""

    # It ends within this distance of a saddle, in natural units, once it has been ten times as far
    # from all saddles.
    close: float = 1e-4
    # All of these are in times of the saddle: for how long it is followed, for how long by one call
    # of `simulate`, and the time between its points.
    whole: float = 60.0
    span: float = 2.0
    step: float = 0.02


SEPARATRICES = SeparatrixSettings()


class SeparatrixEnd(StrEnum):
    """Where a separatrix ends."""

    WINDOW = "window"  # it has left the window for good
    SADDLE = "saddle"
    LIMIT = "limit"  # a margin of the model ends all motions there, as that of an overturned block
    SPAN = "span"  # it was followed for all of the time asked for


@dataclass(frozen=True, eq=False, repr=False)
class Separatrix(Result):
    """A branch of the stable manifold of a saddle, followed back in time from it; nan where an
    impact makes the velocity jump.

    Attributes
    ----------
    system
        What moves.
    saddle
        The coordinate of the saddle.
    time
        (n,), from 0 to negative times.
    theta
        (n,), the coordinate.
    velocity
        (n,), its rate.
    impacts
        (m, 2): the times of the impacts of the forward motion and the velocities just before them,
        latest first.
    end
        Why it ends.

    Examples
    --------
    >>> curve = saltus.separatrices(tristable, window=((-2.0, 2.0), (-2.0, 2.0)))[0]
    >>> energy = saltus.theory.total_energy(tristable, curve.theta[1:], curve.velocity[1:])
    >>> bool(np.ptp(energy) < 1e-6)  # all of it has the energy of its saddle
    True
    """

    system: System
    saddle: float
    time: np.ndarray
    theta: np.ndarray
    velocity: np.ndarray
    impacts: np.ndarray
    end: SeparatrixEnd

    def to_xarray(self) -> xarray.Dataset:
        """Coordinate and velocity over `time`, and the impacts over `impact`."""
        name = self.system.model.coordinates[0]
        unit = self.system.model.unit_of(name)
        columns: dict[str, tuple[Any, ...]] = {
            name: ("time", self.theta, unit, f"{name} along the separatrix"),
            "velocity": ("time", self.velocity, unit, f"d {name} / d tau"),
            "impact_time": (
                "impact",
                self.impacts[:, 0],
                "1",
                "times of the impacts of the forward motion",
            ),
            "impact_velocity_before": (
                "impact",
                self.impacts[:, 1],
                unit,
                "velocities just before them",
            ),
        }
        facts = {"saddle": self.saddle, "end": str(self.end), "plane": [name, "velocity"]}
        return result_dataset("separatrix", columns, {"time": self.time}, self.system, **facts)


def saddles(system: System, window: Box | None = None) -> tuple[Equilibrium, ...]:
    """The saddle equilibria in a window of the phase plane, by their coordinate.

    Raises
    ------
    ParameterError
        A load that is not constant; a window without meaning.
    """
    return tuple(point for point in equilibria(system, window) if point.saddle)


def separatrices(
    system: System,
    window: Box | None = None,
    *,
    span: float | None = None,
    step: float | None = None,
) -> tuple[Separatrix, ...]:
    """The stable manifolds of all saddles in a window: the curves that separate the basins under a
    constant load.

    Each branch is followed back for at most a time `span`. It ends where it leaves the window for
    good (three half widths), or comes to a saddle or to a margin that ends all motions; points are
    given every `step` of time.

    Parameters
    ----------
    system
        What moves, under a constant load.
    window
        A pair (low, high) for the coordinate and one for the velocity; by default 3 natural units to
        both sides of the contact, or of 0 without one.
    span
        For how long each branch is followed back; by default 60 times in which motions approach the
        saddle by a factor of e, or 60 of a model without units of time.
    step
        The time between the points that are given; by default 0.02 such times.

    Raises
    ------
    ParameterError
        A load that is not constant, an impact law without an inverse, numbers without meaning.

    Examples
    --------
    >>> len(saltus.separatrices(tristable, window=((-2.0, 2.0), (-2.0, 2.0))))  # of two saddles
    4
    """
    area = plane_window(window, system)
    for name, value in (("span", span), ("step", step)):
        if value is not None:
            check_number(name, value, above=0.0)
    points = saddles(system, window)
    places = np.array([point.place for point in points])
    return tuple(
        _branch(system, point, away, places, area, (span, step))
        for point in points
        for away in (1.0, -1.0)
    )


def _branch(
    system: System,
    saddle: Equilibrium,
    away: float,
    saddles: np.ndarray,
    window: Window,
    times: tuple[float | None, float | None],
) -> Separatrix:
    """The branch to one side of a saddle; `saddles` are the coordinates of all saddles, (n,),
    `times` are `span` and `step`, None in the times of the saddle.
    """
    assert saddle.eigenvalues is not None
    backward = reversed_system(system)
    length, unit_time = _units(system)
    own_time = 1.0 if system.model.dimensionless else -1.0 / saddle.eigenvalues[1].real
    span, step = times
    span = SEPARATRICES.whole * own_time if span is None else span
    step = SEPARATRICES.step * own_time if step is None else step
    stretch = SEPARATRICES.span * own_time
    offset = away * MANIFOLDS.offset * length
    theta = saddle.place + offset
    velocity = -offset * saddle.eigenvalues[1].real
    now = 0.0
    end = SeparatrixEnd.SPAN
    left = False
    parts: list[np.ndarray] = []
    impacts: list[np.ndarray] = []
    while now < span and end is SeparatrixEnd.SPAN:
        start: dict[str, Any] = {backward.model.coordinates[0]: theta, "velocity": velocity}
        motion = simulate(backward, **start, duration=stretch, tol=1e-13)
        part = _sampled(motion, now, stretch, step)
        distances = np.hypot((part[1] - saddles[:, None]) / length, part[2] * unit_time / length)
        apart = np.min(distances, axis=0)
        back = np.flatnonzero(apart < SEPARATRICES.close)
        if left and back.size:
            part, end = part[:, : back[0] + 1], SeparatrixEnd.SADDLE
        elif has_left(window, part[1:, -1:].T)[0]:
            end = SeparatrixEnd.WINDOW
        elif motion.stop is Stop.LIMIT:
            end = SeparatrixEnd.LIMIT
        left = left or bool(apart[-1] > 10.0 * SEPARATRICES.close)
        within = motion.impacts.time < part[0, -1] - now + step
        impacts.append(
            np.stack([now + motion.impacts.time, -motion.impacts.velocity_after], axis=1)[within]
        )
        parts.append(part)
        now += stretch
        theta = motion.position
        velocity = motion.velocity
    time, thetas, velocities = np.concatenate(parts, axis=1)
    contacts = np.concatenate(impacts) * np.array([-1.0, 1.0])
    return Separatrix(system, saddle.place, -time, thetas, -velocities, contacts, end)


def _sampled(motion: Motion, begin: float, span: float, step: float) -> np.ndarray:
    """Rows (time, coordinate, velocity) of a motion, with both sides of every impact, and nan
    between them where they differ.
    """
    times = np.linspace(0.0, span, round(span / step) + 1)
    times = np.append(times[times < motion.time], motion.time)
    theta, velocity = motion.at(times)
    impacts = motion.impacts
    contact = float(motion.system.model.contact)
    rows = [np.stack([times, theta, velocity])]
    jump = bool((impacts.velocity_before != impacts.velocity_after).any())
    for values in (impacts.velocity_before, np.full(len(impacts), np.nan), impacts.velocity_after)[
        :: 1 if jump else 2
    ]:
        at = np.full(len(impacts), contact)
        rows.append(np.stack([impacts.time, np.where(np.isnan(values), np.nan, at), values]))
    joined = np.concatenate(rows, axis=1)
    joined = joined[:, np.argsort(joined[0], kind="stable")]
    return np.asarray(joined + np.array([[begin], [0.0], [0.0]]))
