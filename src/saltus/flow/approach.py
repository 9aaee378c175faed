"""Where motions are going: the periodic orbit that their stroboscopic states approach as a linear map does, extrapolated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ApproachSettings:
    """When states are taken to approach an orbit."""

    # The largest error of what the map predicts of the last step between two states, relative to that step. The orbit is then off
    # by about this share of the way to it, and the next extrapolation, from nearer, by its square.
    linear: float = 0.02
    # The largest multiplier of the map. It keeps an extrapolation from orbits that are not stable: a map that has been read to
    # within 2 % cannot show 0.95 where a multiplier is 1, and along an unstable direction a state is not moved.
    multiplier: float = 0.95
    # The longest way to the orbit, as a share of the size of the states: from farther away it may lead into another basin.
    reach: float = 0.2
    # Steps below this share of the size of the states are mostly rounding and the errors of the motions.
    least: float = 1e-9
    # Two steps whose directions have a smaller sine between them are parallel: then one multiplier is read off them, not two.
    parallel: float = 1e-3


SETTINGS = ApproachSettings()


def approached(states: np.ndarray, longest: int) -> tuple[np.ndarray, np.ndarray]:
    """The states on the orbits that motions approach, and after how many forcing periods these repeat; 0 where there is none.

    If s_k are the states q forcing periods apart, d_k = s_k - s_(k-1), and M is the linear map with d_(k+1) = M d_k for the two
    steps before the last, the orbit is at s + M (1 - M)^-1 d after the last one. It is believed if M predicts the last step too
    and is a contraction. The fewest periods q up to `longest` are taken for which 4 q + 1 states are there.

    Parameters
    ----------
    states
        (n, kept, 2), coordinate and velocity at the ends of the last forcing periods, the last one last.
    longest
        The longest period looked for.

    Returns
    -------
    tuple[np.ndarray, np.ndarray]
        (n, 2): the last states, or what they approach; (n,): the periods.
    """
    limit, period = states[:, -1].copy(), np.zeros(len(states), dtype=int)
    size = np.nanmax(np.abs(states), axis=1, initial=0.0).max(axis=1)
    for q in range(1, min(longest, (states.shape[1] - 1) // 4) + 1):
        left = np.flatnonzero(period == 0)
        found, good = _limits(states[left, -1 - 4 * q :: q], size[left])
        limit[left[good]], period[left[good]] = found[good], q
    return limit, period


def _limits(states: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What five states each, (n, 5, 2), approach, and whether they do."""
    steps = np.diff(states, axis=1)
    length = np.linalg.norm(steps, axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        m = _maps(steps, length)
        error = np.linalg.norm(np.einsum("nij,nj->ni", m, steps[:, 2]) - steps[:, 3], axis=1)
        inverse, moved = np.eye(2) - m, np.einsum("nij,nj->ni", m, steps[:, 3])
        way = np.stack([_det(moved, inverse[:, :, 1]), _det(inverse[:, :, 0], moved)], axis=1)
        way /= _det(inverse[:, :, 0], inverse[:, :, 1])[:, None]
        good = (error <= SETTINGS.linear * length[:, 3]) & (_radius(m) <= SETTINGS.multiplier)
        good &= (np.linalg.norm(way, axis=1) <= SETTINGS.reach * size) & (length[:, 3] > SETTINGS.least * size)
    return states[:, -1] + way, good


def _maps(steps: np.ndarray, length: np.ndarray) -> np.ndarray:
    """The linear maps (n, 2, 2) that take the first of steps (n, 4, 2) to the second and this to the third, or where these are
    parallel, that project onto the second and multiply."""
    one, two, three = steps[:, 0], steps[:, 1], steps[:, 2]
    area = _det(one, two)
    inverse = np.stack([np.stack([two[:, 1], -two[:, 0]], axis=1), np.stack([-one[:, 1], one[:, 0]], axis=1)], axis=1)
    both = np.einsum("nij,njk->nik", np.stack([two, three], axis=2), inverse) / area[:, None, None]
    single = np.einsum("ni,nj->nij", three, two) / (length[:, 1] ** 2)[:, None, None]
    parallel = np.abs(area) <= SETTINGS.parallel * length[:, 0] * length[:, 1]
    return np.asarray(np.where(parallel[:, None, None], single, both))


def _det(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The determinants of the matrices with these columns (n, 2)."""
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _radius(m: np.ndarray) -> np.ndarray:
    """The largest absolute values of the eigenvalues of matrices (n, 2, 2)."""
    half, det = 0.5 * (m[:, 0, 0] + m[:, 1, 1]), _det(m[:, :, 0], m[:, :, 1])
    spread = half**2 - det
    return np.asarray(np.where(spread >= 0.0, np.abs(half) + np.sqrt(np.maximum(spread, 0.0)), np.sqrt(np.maximum(det, 0.0))))
