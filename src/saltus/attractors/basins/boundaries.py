"""The curves that part the basins of a grid: stable manifolds of the saddles between them, found by tracking the edge.

Between two cells with different labels lies a state on the boundary. Halving brings two states with different ends to within
rounding of it, and the motion from there stays by the boundary until rounding has grown: it comes near a saddle on it, if the
boundary has one of a short period, and returns near to where it was. From there Newton's method finds the saddle orbit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.attractors.attractor import UNDECIDED, Attractors
from saltus.attractors.attractors_dataset import is_constant
from saltus.attractors.manifolds.phase_plane import separatrices
from saltus.attractors.manifolds.saddle_manifolds import HYPERBOLIC, check_window, stable_manifold
from saltus.attractors.registry import Collection
from saltus.attractors.stroboscopic_section import section_states
from saltus.orbits import PeriodicOrbit, is_symmetric, same_orbit
from saltus.systems import System

STEP = 0.01  # of the manifolds, in half widths of the window
POINTS = 8_000  # of each side of a manifold
LONGEST = 6  # forcing periods of a saddle
MOST_SADDLES = 4  # those of the fewest periods: where there are more, the manifold of each comes near all of the boundary
EDGES = 12  # places of the boundary that are tracked
PARTS, ROUNDS = 32, 9  # into which an interval is cut, and how often: 33^9 is past rounding
TRACKED = 40  # forcing periods of the motion by the boundary
RETURN = 0.2  # the farthest return from which Newton's method is tried

Label = Callable[[np.ndarray], np.ndarray]  # states (n, 2) -> labels (n,)


def boundaries(
    found: Attractors, label: Label, labels: np.ndarray, along: np.ndarray, velocity: np.ndarray
) -> tuple[np.ndarray, ...]:
    """The curves at which the basins of a grid meet, each an array (n, 2) with nan between pieces.

    Under a constant load they are the separatrices of the saddle equilibria in the window of the grid. Under a periodic load they
    are the stable manifolds of the saddle orbits, at most 4 and of up to 6 forcing periods, to which tracking of the edge leads.
    They are given in part where they are too long: those of a chaotic saddle have no end.

    Args:
        found: the attractors.
        label: tells the label of states.
        labels: the labels of the grid, (velocities, coordinates).
        along, velocity: the grid.
    """
    window = (float(along[0]), float(along[-1])), (float(velocity[0]), float(velocity[-1]))
    check_window(window, STEP)
    if is_constant(found.system.load):
        return tuple(np.stack([curve.theta, curve.velocity], axis=1) for curve in separatrices(found.system, window))
    saddles = edge_saddles(found.system, *edges(label, labels, along, velocity))
    return tuple(stable_manifold(saddle, window=window, step=STEP, points=POINTS).states for saddle in saddles)


def edges(label: Label, labels: np.ndarray, along: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of states (n, 2) with different labels, as close as rounding lets them be, at places spread over the boundary."""
    rows, columns = np.nonzero((labels[:, 1:] != labels[:, :-1]) & (labels[:, 1:] != UNDECIDED) & (labels[:, :-1] != UNDECIDED))
    chosen = np.unique(np.linspace(0, max(len(rows) - 1, 0), min(EDGES, len(rows))).astype(int))
    rows, columns = rows[chosen], columns[chosen]
    low = np.stack([along[columns], velocity[rows]], axis=1)
    high = np.stack([along[columns + 1], velocity[rows]], axis=1)
    first = labels[rows, columns]
    for _ in range(ROUNDS if len(rows) else 0):
        share = np.linspace(0.0, 1.0, PARTS + 2)[None, 1:-1, None]
        between = low[:, None] + share * (high - low)[:, None]
        other = label(between.reshape(-1, 2)).reshape(len(rows), PARTS) != first[:, None]
        between = np.concatenate([low[:, None], between, high[:, None]], axis=1)
        place = np.where(other.any(axis=1), np.argmax(other, axis=1), PARTS)  # the last state with the first label
        pick = np.arange(len(rows))
        low, high = between[pick, place], between[pick, place + 1]
    return low, high


def edge_saddles(system: System, low: np.ndarray, high: np.ndarray) -> list[PeriodicOrbit]:
    """The saddle orbits near which motions from both sides of the boundary come; and their mirror images."""
    if not len(low):
        return []
    collection, found = Collection(system), list[PeriodicOrbit]()
    for track in section_states(system, 0.5 * (low + high), TRACKED):
        for state, periods in _returns(track):
            orbit = collection.solved(state, periods)
            if orbit is None or not _is_saddle(orbit):
                continue
            for one in (orbit, *_image(collection, orbit)):
                if not any(same_orbit(one, other, mirrored=False) for other in found):
                    found.append(one)
    return sorted(found, key=lambda orbit: orbit.period)[:MOST_SADDLES]


def _returns(track: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """The states of a motion nearest to which it comes back, and after how many periods, for each number of these."""
    chosen = []
    for q in range(1, LONGEST + 1):
        apart = np.abs(track[q:] - track[:-q]).max(axis=1)
        apart = apart[: len(apart) // 2]  # later it has left the boundary for an attractor, and returns there
        nearest = int(np.nanargmin(apart))
        if apart[nearest] < RETURN:
            chosen.append((track[nearest], q))
    return chosen


def clipped(curves: tuple[np.ndarray, ...], window: Any) -> np.ndarray:
    """The curves in a row, (n, 2), with nan between them and where they are outside the window by more than its half."""
    frame = check_window(window, STEP)
    parts = [np.full((0, 2), np.nan)]
    for curve in curves:
        far = ~(np.abs(frame.scaled(curve)) <= 1.5).all(axis=1)
        parts += [np.where(far[:, None], np.nan, curve), np.full((1, 2), np.nan)]
    joined = np.concatenate(parts)
    gone = np.isnan(joined).any(axis=1)
    return joined[~(gone & np.append(True, gone[:-1]))] if len(joined) else joined


def _is_saddle(orbit: PeriodicOrbit) -> bool:
    size = np.sort(np.abs(orbit.multipliers))
    return bool(0.0 < size[0] < 1.0 - HYPERBOLIC and 1.0 + HYPERBOLIC < size[1] < np.inf)


def _image(collection: Collection, orbit: PeriodicOrbit) -> list[PeriodicOrbit]:
    """The mirror image of an orbit that is not its own."""
    if orbit.symmetric or not is_symmetric(collection.system):
        return []
    state = -section_states(collection.system, np.array([orbit.state]), 0.5)[0, 0]
    image = collection.solved(state, orbit.period)
    return [] if image is None else [image]
