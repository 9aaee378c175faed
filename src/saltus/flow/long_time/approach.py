"""The periodic orbit that a motion approaches, extrapolated from its stroboscopic states as iterates of a linear map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ApproachSettings:
    """When the states of a motion are taken to approach an orbit."""

    # The largest error with which the map may predict the last step between two states, relative to that step. The extrapolated
    # orbit has an error of about this share of the way to it; the next extrapolation begins nearer, with the square of this.
    linear: float = 0.02
    # The largest multiplier of the map. It excludes extrapolation to orbits that are not stable: with an error of 2 % the map
    # cannot show 0.95 where a multiplier is 1, and no state is moved along an unstable direction.
    multiplier: float = 0.95
    # The longest way to the orbit, as a share of the size of the states: a longer one may lead into another basin.
    reach: float = 0.2
    # Steps below this share of the size of the states consist mostly of rounding and of the errors of the motions.
    least: float = 1e-9
    # Two steps are parallel if the sine of the angle between them is smaller than this: they then give one multiplier, not two.
    parallel: float = 1e-3


SETTINGS = ApproachSettings()


def approached(states: np.ndarray, longest: int) -> tuple[np.ndarray, np.ndarray]:
    """The states on the orbits that motions approach, and the periods of these orbits; 0 for a motion that approaches none.

    Let s_k be states q forcing periods apart, d_k = s_k - s_(k-1), and M the linear map that takes d_1 to d_2 and d_2 to d_3. If
    M also predicts the last step, d_4 = M d_3, and is a contraction, the orbit is at s_4 + M (1 - M)^-1 d_4. The shortest period
    q up to `longest` is taken for which this holds; it needs 4 q + 1 states.

    Parameters
    ----------
    states
        Coordinate and velocity at the ends of the last forcing periods, in the order of time, (n, kept, 2).
    longest
        The longest period that is looked for.

    Returns
    -------
    tuple[np.ndarray, np.ndarray]
        The states on the orbits, or the last states of motions that approach none, (n, 2); and the periods, (n,).
    """
    limit, period = states[:, -1].copy(), np.zeros(len(states), dtype=int)
    size = np.nanmax(np.abs(states), axis=1, initial=0.0).max(axis=1)
    for q in range(1, min(longest, (states.shape[1] - 1) // 4) + 1):
        left = np.flatnonzero(period == 0)
        found, good = _limits(states[left, -1 - 4 * q :: q], size[left])
        limit[left[good]], period[left[good]] = found[good], q
    return limit, period


def _limits(states: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The states that sequences of five states, (n, 5, 2), approach, and whether they do approach them."""
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
    """The linear maps (n, 2, 2) that take the first of the steps (n, 4, 2) to the second, and the second to the third. If the
    first two are parallel, the map takes the second step to the third, and directions orthogonal to the second to 0."""
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
