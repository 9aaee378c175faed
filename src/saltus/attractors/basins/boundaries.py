"""The curves between the basins of a grid: stable manifolds of the saddles on the boundary, found by edge tracking.

Between two cells with different labels lies a state on the boundary. Repeated division of the interval brings two states with
different ends to within rounding of it. The motion from there stays near the boundary until the rounding errors have grown. If
there is a saddle orbit of a short period on the boundary, the motion comes near it and returns near to an earlier state; from
this state Newton's method finds the saddle orbit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.attractors.attractor import UNDECIDED, Attractors
from saltus.attractors.manifolds.phase_plane import separatrices
from saltus.attractors.manifolds.saddle_manifolds import is_saddle, stable_manifold
from saltus.attractors.orbit_certificate import solved_orbit
from saltus.attractors.stroboscopic_section import is_constant, section_states
from saltus.orbits import PeriodicOrbit, is_symmetric, same_orbit
from saltus.systems import System, Window, check_window, image_of


@dataclass(frozen=True)
class BoundarySettings:
    """How saddles on the boundary are found, and their manifolds computed."""

    step: float = 0.01  # Distance between neighbouring points of a manifold, in half widths of the window.
    points: int = 8_000  # The largest number of points of a manifold on each side of a saddle.
    max_period: int = 6  # The longest period of saddles that are looked for, in forcing periods.
    # The largest number of saddles, which are those of the shortest periods. If there are more, the manifold of each comes near
    # all of the boundary.
    saddles: int = 4
    edges: int = 12  # Number of places of the boundary from which the edge is tracked.
    tracked: int = 40  # Number of forcing periods for which it is tracked.
    cuts: int = 32  # Number of states that divide an interval across the boundary.
    rounds: int = 9  # Number of times that such an interval is divided: 33^-9 of it is less than rounding.
    farthest_return: float = 0.2  # Newton's method is tried from returns that are no farther than this.
    margin: float = 1.5  # Curves are given up to this distance from the middle of the window, in half widths.


SETTINGS = BoundarySettings()
Label = Callable[[np.ndarray], np.ndarray]  # states (n, 2) -> labels (n,)


def basin_boundaries(found: Attractors, label: Label, labels: np.ndarray, along: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """The curves at which the basins of a grid meet, one after the other, (n, 2), with nan between them.

    Under a constant load they are the separatrices of the saddle equilibria in the window of the grid. Under a periodic load they
    are the stable manifolds of at most 4 saddle orbits, of up to 6 forcing periods, that edge tracking finds. Of a curve that is
    too long only a part is given: the manifold of a chaotic saddle has no end.

    Parameters
    ----------
    found
        The attractors.
    label
        The labels of states.
    labels
        The labels of the grid, (velocities, coordinates).
    along, velocity
        The grid.
    """
    bounds = (float(along[0]), float(along[-1])), (float(velocity[0]), float(velocity[-1]))
    window = check_window(bounds, found.system)
    if is_constant(found.system.load):
        curves = [np.stack([curve.theta, curve.velocity], axis=1) for curve in separatrices(found.system, window)]
    else:
        saddles = edge_saddles(found.system, *edges(label, labels, along, velocity))
        curves = [stable_manifold(saddle, window=window, step=SETTINGS.step, points=SETTINGS.points).states for saddle in saddles]
    return clipped(curves, window)


def edges(label: Label, labels: np.ndarray, along: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of states (n, 2) with different labels, as close to each other as rounding allows, spread over the boundary."""
    rows, columns = np.nonzero((labels[:, 1:] != labels[:, :-1]) & (labels[:, 1:] != UNDECIDED) & (labels[:, :-1] != UNDECIDED))
    chosen = np.unique(np.linspace(0, max(len(rows) - 1, 0), min(SETTINGS.edges, len(rows))).astype(int))
    rows, columns = rows[chosen], columns[chosen]
    low = np.stack([along[columns], velocity[rows]], axis=1)
    high = np.stack([along[columns + 1], velocity[rows]], axis=1)
    first = labels[rows, columns]
    for _ in range(SETTINGS.rounds if len(rows) else 0):
        share = np.linspace(0.0, 1.0, SETTINGS.cuts + 2)[None, 1:-1, None]
        between = low[:, None] + share * (high - low)[:, None]
        other = label(between.reshape(-1, 2)).reshape(len(rows), SETTINGS.cuts) != first[:, None]
        between = np.concatenate([low[:, None], between, high[:, None]], axis=1)
        place = np.where(other.any(axis=1), np.argmax(other, axis=1), SETTINGS.cuts)  # the last state with the first label
        pick = np.arange(len(rows))
        low, high = between[pick, place], between[pick, place + 1]
    return low, high


def edge_saddles(system: System, low: np.ndarray, high: np.ndarray) -> list[PeriodicOrbit]:
    """The saddle orbits near which motions on the boundary come, and their mirror images."""
    found: list[PeriodicOrbit] = []
    for track in section_states(system, 0.5 * (low + high), SETTINGS.tracked) if len(low) else ():
        for state, period in _returns(track):
            orbit = solved_orbit(system, state, period)
            if orbit is None or not is_saddle(orbit):
                continue
            for one in (orbit, *_image(orbit)):
                if not any(same_orbit(one, other, mirrored=False) for other in found):
                    found.append(one)
    return sorted(found, key=lambda orbit: orbit.period)[: SETTINGS.saddles]


def _returns(track: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """For each period up to the longest, the state of a motion to which it returns most closely after this period, if near."""
    chosen = []
    for q in range(1, SETTINGS.max_period + 1):
        apart = np.abs(track[q:] - track[:-q]).max(axis=1)
        apart = apart[: len(apart) // 2]  # later it has left the boundary for an attractor, and returns there
        nearest = int(np.nanargmin(apart))
        if apart[nearest] < SETTINGS.farthest_return:
            chosen.append((track[nearest], q))
    return chosen


def clipped(curves: list[np.ndarray], window: Window) -> np.ndarray:
    """The curves one after the other, (n, 2), with nan between them and where they are more than 1.5 half widths from the middle
    of the window."""
    parts = [np.full((0, 2), np.nan)]
    for curve in curves:
        far = ~(np.abs(window.scaled(curve)) <= SETTINGS.margin).all(axis=1)
        parts += [np.where(far[:, None], np.nan, curve), np.full((1, 2), np.nan)]
    joined = np.concatenate(parts)
    gone = np.isnan(joined).any(axis=1)
    return joined[~(gone & np.append(True, gone[:-1]))] if len(joined) else joined


def _image(orbit: PeriodicOrbit) -> list[PeriodicOrbit]:
    """The mirror image of an orbit that is not its own."""
    if orbit.symmetric or not is_symmetric(orbit.system):
        return []
    state = image_of(orbit.system.model, section_states(orbit.system, np.array([orbit.state]), 0.5)[0, 0])
    image = solved_orbit(orbit.system, state, orbit.period)
    return [] if image is None else [image]
