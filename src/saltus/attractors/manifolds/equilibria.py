"""Equilibria of the phase plane under a constant load, of any model of one coordinate, with their eigenvalues.

At an equilibrium (q*, 0) on a side the flow is q'' = a_q (q - q*) + a_v q', with the eigenvalues lambda^2 - a_v lambda - a_q = 0:
a saddle where a_q > 0. At the contact the system rests while the accelerations of all its sides push it into the contact.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from saltus.attractors.manifolds.saddle_manifolds import PLANE
from saltus.attractors.stroboscopic_section import check_periodic
from saltus.errors import ParameterError
from saltus.systems import Constant, System, check_system
from saltus.window import Box, check_window


@dataclass(frozen=True)
class EquilibriumSettings:
    """How equilibria are found, and their eigenvalues."""

    grid: int = 2001  # Number of points of the window between which equilibria are looked for.
    difference: float = 1e-3  # Derivatives are central differences of sixth order with this step.
    neutral: float = 1e-9  # Real parts up to this count as 0: where no energy is lost the differences leave such an error.
    inside: float = 1e-6  # If the acceleration at the contact is 0, its sign is that at this distance inside the side.


SETTINGS = EquilibriumSettings()
SIXTH_ORDER = ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60))  # (step, weight) of the central difference for a first derivative


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
        return self.eigenvalues is not None and self.eigenvalues[0].real > 0.0 > self.eigenvalues[1].real


def equilibria(system: System, window: Box = PLANE) -> tuple[Equilibrium, ...]:
    """The equilibria in a window of the phase plane, by their coordinate, including the contact if the system can rest there.

    They are the zeros of the acceleration at rest between 2001 points of the window: two equilibria that are closer together than
    a thousandth of it, as near a fold, may be missed.

    Parameters
    ----------
    system
        What moves, under a constant load.
    window
        A pair (low, high) for the coordinate and one for the velocity.

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
    area = check_window(window, system)
    model, low, high = system.model, *area[0]
    found = []
    for side in model.sides or (1,):
        grid = np.linspace(low, high, SETTINGS.grid)
        if model.sides:
            grid = np.sort(np.append(grid[np.asarray(model.gap(grid, side)) > 0.0], _beside(system, side)))
        pull = _pull(system, side)
        for place in _zeros(pull, grid[(grid >= low) & (grid <= high)]):
            values = _eigenvalues(system, place, side)
            found.append(Equilibrium(place, side, values, values[0].real <= SETTINGS.neutral))
    if model.sides and low <= float(model.contact) <= high:
        found += _at_contact(system)
    return tuple(sorted(found, key=lambda one: one.place))


def check_constant(system: System) -> None:
    """Refuse systems that have no phase plane."""
    check_system(system, "a phase plane", coordinates=1)
    check_periodic(system)
    for name, signal in system.load.channels.items():
        if not isinstance(signal, Constant):
            raise ParameterError(
                f"load.{name} varies, so there is no phase plane; `basins` and `stable_manifold` are for loads that repeat",
                f"load.{name}",
            )


def _pull(system: System, side: int) -> Callable[[float], float]:
    """The acceleration at rest on a side, as a function of the coordinate."""
    return lambda place: float(system.model.acceleration(0.0, place, 0.0, float(side), system.load))


def _beside(system: System, side: int) -> float:
    """A coordinate just inside a side."""
    contact = float(system.model.contact)
    return contact + (SETTINGS.inside if float(system.model.gap(contact + SETTINGS.inside, side)) > 0.0 else -SETTINGS.inside)


def _zeros(pull: Callable[[float], float], grid: np.ndarray) -> Iterator[float]:
    """The zeros of the acceleration, at or between the points of a grid."""
    from scipy.optimize import brentq

    values = np.array([pull(place) for place in grid])
    yield from (float(place) for place in grid[values == 0.0])
    for i in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        yield float(brentq(pull, grid[i], grid[i + 1], xtol=1e-15, rtol=1e-15))


def _eigenvalues(system: System, place: float, side: int) -> tuple[complex, complex]:
    def pull(q: float, v: float) -> float:
        return float(system.model.acceleration(0.0, q, v, float(side), system.load))

    h = SETTINGS.difference
    slope = sum(w * (pull(place + j * h, 0.0) - pull(place - j * h, 0.0)) for j, w in SIXTH_ORDER) / h
    loss = sum(w * (pull(place, j * h) - pull(place, -j * h)) for j, w in SIXTH_ORDER) / h
    root = cmath.sqrt(0.25 * loss * loss + slope)
    return 0.5 * loss + root, 0.5 * loss - root


def _at_contact(system: System) -> list[Equilibrium]:
    """The contact as an equilibrium: a stable one if all sides push towards it, an unstable one if both push away from it."""
    contact, outward = float(system.model.contact), []
    for side in system.model.sides:
        place = _beside(system, side)
        pull = _pull(system, side)
        outward.append((pull(contact) or pull(place)) * (place - contact) > 0.0)
    none = any(outward) and (len(outward) == 1 or not all(outward))
    return [] if none else [Equilibrium(contact, 0, None, not any(outward))]
