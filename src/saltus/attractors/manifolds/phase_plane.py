"""Separatrices of the phase plane under a constant load: the stable manifolds of its saddles, by the exact backward flow.

The manifolds of a saddle are tangent to (1, lambda) there, with its eigenvalues lambda (see `equilibria`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.manifolds.equilibria import Equilibrium, equilibria
from saltus.attractors.manifolds.manifold_growth import has_left
from saltus.attractors.manifolds.saddle_manifolds import PLANE
from saltus.checks import check_number
from saltus.flow import Motion, simulate
from saltus.result import Result, result_dataset
from saltus.systems import System, VelocityReduction, reversed_system
from saltus.window import Box, Window, check_window

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class SeparatrixSettings:
    """How a separatrix is followed."""

    offset: float = 1e-6  # Distance from the saddle at which it begins, on the tangent: the error is of the order of its square.
    # It ends within this distance of a saddle, once it has been ten times as far from all saddles.
    close: float = 1e-4
    span: float = 2.0  # The dimensionless time for which one call of `simulate` follows it.


SETTINGS = SeparatrixSettings()


class SeparatrixEnd(StrEnum):
    """Where a separatrix ends."""

    WINDOW = "window"  # it has left the window for good
    SADDLE = "saddle"
    SPAN = "span"  # it was followed for all of the time asked for


@dataclass(frozen=True, eq=False, repr=False)
class Separatrix(Result):
    """A branch of the stable manifold of a saddle, followed back in time from it; nan where an impact makes the velocity jump.

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
        (m, 2): the times of the impacts of the forward motion and the velocities just before them, latest first.
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
            "impact_time": ("impact", self.impacts[:, 0], "1", "times of the impacts of the forward motion"),
            "impact_velocity_before": ("impact", self.impacts[:, 1], unit, "velocities just before them"),
        }
        facts = {"saddle": self.saddle, "end": str(self.end), "plane": [name, "velocity"]}
        return result_dataset("separatrix", columns, {"time": self.time}, self.system, **facts)


def saddles(system: System, window: Box = PLANE) -> tuple[Equilibrium, ...]:
    """The saddle equilibria in a window of the phase plane, by their coordinate.

    Raises
    ------
    ParameterError
        A load that is not constant; a window without meaning.
    """
    return tuple(point for point in equilibria(system, window) if point.saddle)


def separatrices(system: System, window: Box = PLANE, *, span: float = 60.0, step: float = 0.02) -> tuple[Separatrix, ...]:
    """The stable manifolds of all saddles in a window: the curves that separate the basins under a constant load.

    Each branch is followed back for at most a time `span`, until it leaves the window for good (three half widths) or comes to a
    saddle; points are given every `step` of time.

    Parameters
    ----------
    system
        What moves, under a constant load.
    window
        A pair (low, high) for the coordinate and one for the velocity.
    span
        For how long each branch is followed back, in dimensionless time.
    step
        The time between the points that are given.

    Raises
    ------
    ParameterError
        A load that is not constant, an impact law without an inverse, numbers without meaning.

    Examples
    --------
    >>> len(saltus.separatrices(tristable, window=((-2.0, 2.0), (-2.0, 2.0))))  # of two saddles
    4
    """
    area = check_window(window, system)
    check_number("span", span, above=0.0)
    check_number("step", step, above=0.0)
    points = saddles(system, window)
    places = np.array([point.place for point in points])
    return tuple(_branch(system, point, away, places, area, (span, step)) for point in points for away in (1.0, -1.0))


def _branch(
    system: System, saddle: Equilibrium, away: float, saddles: np.ndarray, window: Window, times: tuple[float, float]
) -> Separatrix:
    """The branch to one side of a saddle; `saddles` are the coordinates of all saddles, (n,), `times` are `span` and `step`."""
    assert saddle.eigenvalues is not None
    backward = reversed_system(system)
    span, step = times
    theta, velocity = saddle.place + away * SETTINGS.offset, -away * SETTINGS.offset * saddle.eigenvalues[1].real
    now, end, left = 0.0, SeparatrixEnd.SPAN, False
    parts: list[np.ndarray] = []
    impacts: list[np.ndarray] = []
    while now < span and end is SeparatrixEnd.SPAN:
        start: dict[str, Any] = {backward.model.coordinates[0]: theta, "velocity": velocity}
        motion = simulate(backward, **start, duration=SETTINGS.span, tol=1e-13)
        part = _sampled(motion, now, step)
        apart = np.min(np.hypot(part[1] - saddles[:, None], part[2]), axis=0)
        back = np.flatnonzero(apart < SETTINGS.close)
        if left and back.size:
            part, end = part[:, : back[0] + 1], SeparatrixEnd.SADDLE
        elif has_left(window, part[1:, -1:].T)[0]:
            end = SeparatrixEnd.WINDOW
        left = left or bool(apart[-1] > 10.0 * SETTINGS.close)
        within = motion.impacts.time < part[0, -1] - now + step
        impacts.append(np.stack([now + motion.impacts.time, -motion.impacts.velocity_after], axis=1)[within])
        parts.append(part)
        now, theta, velocity = now + SETTINGS.span, motion.position, motion.velocity
    time, thetas, velocities = np.concatenate(parts, axis=1)
    contacts = np.concatenate(impacts) * np.array([-1.0, 1.0])
    return Separatrix(system, saddle.place, -time, thetas, -velocities, contacts, end)


def _sampled(motion: Motion, begin: float, step: float) -> np.ndarray:
    """Rows (time, coordinate, velocity) of a motion, with both sides of every impact, and nan between them where they differ."""
    times = np.linspace(0.0, SETTINGS.span, round(SETTINGS.span / step) + 1)
    theta, velocity = motion.at(times)
    impacts, contact = motion.impacts, float(motion.system.model.contact)
    rows = [np.stack([times, theta, velocity])]
    jump = not (isinstance(motion.system.impact, VelocityReduction) and len(motion.system.model.sides) == 2)
    for values in (impacts.velocity_before, np.full(len(impacts), np.nan), impacts.velocity_after)[:: 1 if jump else 2]:
        at = np.full(len(impacts), contact)
        rows.append(np.stack([impacts.time, np.where(np.isnan(values), np.nan, at), values]))
    joined = np.concatenate(rows, axis=1)
    joined = joined[:, np.argsort(joined[0], kind="stable")]
    return np.asarray(joined + np.array([[begin], [0.0], [0.0]]))
