"""Separatrices of the phase plane under a constant load: the stable manifolds of its saddles, by the exact backward flow.

A saddle is left and approached along (1, lambda), lambda its eigenvalues (see `equilibria`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.manifolds.equilibria import equilibria
from saltus.attractors.manifolds.manifold_growth import Window
from saltus.attractors.manifolds.saddle_manifolds import check_window
from saltus.checks import check_number
from saltus.flow import Motion, simulate
from saltus.systems import System, VelocityReduction, reversed_system

OFFSET = 1e-6  # from the saddle; the curve leaves its tangent by the square of this
CLOSE = 1e-4  # distance at which a separatrix is said to end at a saddle
PIECE = 2.0  # of time that is followed at once


@dataclass(frozen=True)
class Saddle:
    """A saddle equilibrium under a constant load."""

    theta: float
    side: int
    rates: tuple[float, float]  # the eigenvalues, the positive one first


@dataclass(frozen=True, eq=False)
class Separatrix:
    """A branch of the stable manifold of a saddle, followed back in time from it; nan where an impact makes the velocity jump."""

    saddle: float
    time: np.ndarray  # (n,), from 0 to negative times
    theta: np.ndarray  # (n,)
    velocity: np.ndarray  # (n,)
    impacts: np.ndarray  # (m, 2): the times and velocities, just before each, of the impacts of the forward motion, latest first
    ends: str  # "window", "saddle" or "span"


def saddles(system: System, window: Any = ((-3.0, 3.0), (-3.0, 3.0))) -> tuple[Saddle, ...]:
    """The saddle equilibria in a window of the phase plane, by their coordinate.

    Raises:
        ParameterError: a load that is not constant; a window without meaning.
    """
    points = equilibria(system, window)
    return tuple(Saddle(p.place, p.side, _rates(p.eigenvalues)) for p in points if p.saddle and p.eigenvalues)


def _rates(values: tuple[complex, complex]) -> tuple[float, float]:
    return values[0].real, values[1].real


def separatrices(
    system: System, window: Any = ((-3.0, 3.0), (-3.0, 3.0)), *, span: float = 60.0, step: float = 0.02
) -> tuple[Separatrix, ...]:
    """The stable manifolds of all saddles in a window: the curves that part the basins of a constant load.

    Each branch is followed back for at most `span` of time, until it leaves the window for good (three half widths) or comes to
    a saddle, and given every `step` of time.

    Raises:
        ParameterError: a load that is not constant, an impact law without an inverse, numbers without meaning.
    """
    frame = check_window(window, 0.1)
    check_number("span", span, above=0.0)
    check_number("step", step, above=0.0)
    points = saddles(system, window)
    backward = reversed_system(system)
    return tuple(_branch(backward, saddle, away, points, frame, span, step) for saddle in points for away in (1.0, -1.0))


def _branch(
    backward: System, saddle: Saddle, away: float, points: tuple[Saddle, ...], frame: Window, span: float, step: float
) -> Separatrix:
    """The branch to one side of a saddle."""
    name = backward.model.coordinates[0]
    theta, velocity = saddle.theta + away * OFFSET, -away * OFFSET * saddle.rates[1]
    now, ends, left = 0.0, "span", False
    pieces: list[np.ndarray] = []
    impacts: list[np.ndarray] = []
    while now < span and ends == "span":
        start: dict[str, Any] = {name: theta, "velocity": velocity}
        motion = simulate(backward, **start, duration=PIECE, tol=1e-13)
        piece = _sampled(motion, now, step)
        apart = np.min([np.hypot(piece[1] - p.theta, piece[2]) for p in points], axis=0)
        back = np.flatnonzero(apart < CLOSE)
        if left and back.size:
            piece, ends = piece[:, : back[0] + 1], "saddle"
        elif frame.far(piece[1:, -1:].T)[0]:
            ends = "window"
        left = left or bool(apart[-1] > 10.0 * CLOSE)
        within = motion.impacts.time < piece[0, -1] - now + step
        impacts.append(np.stack([now + motion.impacts.time, -motion.impacts.velocity_after], axis=1)[within])
        pieces.append(piece)
        now, theta, velocity = now + PIECE, motion.position, motion.velocity
    time, thetas, velocities = np.concatenate(pieces, axis=1)
    contacts = np.concatenate(impacts) * np.array([-1.0, 1.0])
    return Separatrix(saddle.theta, -time, thetas, -velocities, contacts, ends)


def _sampled(motion: Motion, begin: float, step: float) -> np.ndarray:
    """Rows (time, coordinate, velocity) of a motion, with both sides of every impact, and nan between them where they differ."""
    times = np.linspace(0.0, PIECE, round(PIECE / step) + 1)
    theta, velocity = motion.at(times)
    impacts, contact = motion.impacts, float(motion.system.model.contact)
    rows = [np.stack([times, theta, velocity])]
    jump = not (isinstance(motion.system.impact, VelocityReduction) and len(motion.system.model.sides) == 2)
    for values in (impacts.velocity_before, np.full(len(impacts), np.nan), impacts.velocity_after)[:: 1 if jump else 2]:
        at = np.full(len(impacts), contact)
        rows.append(np.stack([impacts.time, np.where(np.isnan(values), np.nan, at), values]))
    joined = np.concatenate(rows, axis=1)
    joined = joined[:, np.argsort(joined[0], kind="stable")]
    return joined + np.array([[begin], [0.0], [0.0]])
