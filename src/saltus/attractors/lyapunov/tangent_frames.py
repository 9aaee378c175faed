"""Many motions with orthonormal frames of derivatives, in lanes: how much the frames are stretched in each period."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np

from saltus.attractors.lyapunov.renormalisation import first_frame, span_count
from saltus.attractors.lyapunov.settings import LYAPUNOV
from saltus.flow import TangentEnsemble, available_cores
from saltus.progress import Progress, silent
from saltus.systems import System


@dataclass(frozen=True)
class Stretched:
    """The run of many motions; growth is NaN once a motion is lost, and -inf once it has come to rest with a loss at impacts."""

    growth: np.ndarray  # (periods, n, 2): ln of the stretch of each direction of the frame in each period
    states: np.ndarray  # (n, 2): coordinate and velocity at the end; NaN where the motion was lost


def stretch_many(
    system: System,
    states: np.ndarray,
    parameters: Mapping[str, np.ndarray],
    lengths: np.ndarray,
    periods: int,
    tol: float,
    progress: Progress = silent,
) -> Stretched:
    """Follow motions from states (n, 2) at phase 0 over so many periods of the given lengths, (n,).

    `parameters` replaces numbers of the system by path, (n,) each. Results do not depend on the number of cores.
    """
    ensemble = TangentEnsemble(system, parameters, lengths, tol)
    result = Stretched(np.full((periods, len(states), 2), np.nan), np.full((len(states), 2), np.nan))
    counts = np.array([span_count(length) for length in lengths])
    groups = [group for count in np.unique(counts) for group in _groups(np.flatnonzero(counts == count))]
    done = np.zeros(1)
    stopped: list[bool] = []

    def work(rows: np.ndarray) -> None:
        follower = _Follower(ensemble, rows, states[rows], lengths[rows])
        for p in range(periods):
            if stopped:
                return
            result.growth[p, rows] = follower.period(int(counts[rows[0]]))
            done[0] += len(rows)
        result.states[rows] = follower.ends()

    with ThreadPoolExecutor(available_cores()) as pool:
        workers = [pool.submit(work, rows) for rows in groups]
        try:
            while wait(workers, LYAPUNOV.look).not_done:
                progress(float(done[0]) / (periods * max(1, len(states))), "derivatives")
        except BaseException:
            stopped.append(True)
            raise
        for worker in workers:
            worker.result()
    return result


def _groups(rows: np.ndarray) -> list[np.ndarray]:
    """Rows in groups for the threads, a group or more for each core."""
    least = max(available_cores(), math.ceil(len(rows) / LYAPUNOV.largest_group))
    return [group for group in np.array_split(rows, least) if group.size]


class _Follower:
    """A group of motions with frames; the row of each has the coordinate, its two derivatives, the velocity, its two
    derivatives."""

    def __init__(self, ensemble: TangentEnsemble, rows: np.ndarray, states: np.ndarray, lengths: np.ndarray) -> None:
        self._ensemble, self._rows, self._lengths = ensemble, rows, lengths
        self._states = np.zeros((len(states), 6))
        self._states[:, [0, 3]] = states
        self._states[:, [1, 2, 4, 5]] = first_frame(2).ravel()
        self._alive = np.isfinite(states).all(axis=1)
        self._rounding = LYAPUNOV.rounding if ensemble.held else 0.0

    def period(self, spans: int) -> np.ndarray:
        """Go on for a period; returns ln of the stretch in it, (n, 2)."""
        growth = np.where(self._alive[:, None], 0.0, np.full((len(self._rows), 2), np.nan))
        for j in range(spans):
            here = np.flatnonzero(self._alive)
            if not here.size:
                break
            span = self._lengths[here] / spans
            ends = self._ensemble.advance(self._rows[here], self._states[here], j * span, (j + 1) * span)
            self._states[here], stretch = _orthonormal(ends.states, self._rounding)
            self._alive[here[~ends.sound]] = False
            growth[here] += np.where(ends.sound[:, None], stretch, np.nan)
        return growth

    def ends(self) -> np.ndarray:
        """Coordinate and velocity at the end, (n, 2)."""
        return np.where(self._alive[:, None], self._states[:, [0, 3]], np.nan)


def _orthonormal(states: np.ndarray, rounding: float) -> tuple[np.ndarray, np.ndarray]:
    """The states with their derivatives made orthonormal, by Gram and Schmidt, and ln of the lengths that they had, (n, 2).

    A second length that is no more than `rounding` of the first one is 0.
    """
    states = states.copy()
    x1, x2, y1, y2 = states[:, 1], states[:, 2], states[:, 4], states[:, 5]
    first, area = np.hypot(x1, y1), x1 * y2 - x2 * y1
    area[np.abs(area) <= rounding * first**2] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = np.log(np.stack([first, np.abs(area) / first], axis=1))
        unit_x, unit_y = np.where(first > 0.0, x1 / first, 1.0), np.where(first > 0.0, y1 / first, 0.0)
    growth[first == 0.0] = -np.inf
    turn = np.where(area < 0.0, -1.0, 1.0)
    states[:, 1], states[:, 4], states[:, 2], states[:, 5] = unit_x, unit_y, -turn * unit_y, turn * unit_x
    return states, growth
