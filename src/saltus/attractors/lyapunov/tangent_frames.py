"""Many motions with orthonormal frames of derivatives beside them, in lanes: what stretches the frames, period by period."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np

from saltus.attractors.lyapunov.renormalisation import first_frame, piece_count
from saltus.flow import (
    Jobs,
    Lanes,
    Wanted,
    available_cores,
    compiled_lanes,
    limits_of,
    load_advance,
    load_driver,
    load_helpers,
    program,
)
from saltus.flow import kernel_layout as k
from saltus.systems import System

LARGEST_GROUP = 256  # motions that one thread follows together: enough that a call costs less than its work
LOOK = 0.2  # seconds between looks at Ctrl-C and at the progress


@dataclass(frozen=True)
class Stretched:
    """The run of many motions; what was lost on the way has NaN from then on, and -inf once it rests with a loss at impacts."""

    growth: np.ndarray  # (periods, n, 2): ln of what stretched each direction of the frame in the period
    states: np.ndarray  # (n, 2): coordinate and velocity at the end; NaN where the motion was lost


def stretch_many(
    system: System,
    states: np.ndarray,
    columns: dict[int, np.ndarray],
    lengths: np.ndarray,
    periods: int,
    tol: float,
    progress: Callable[[float], object] | None = None,
) -> Stretched:
    """Follow motions from states (n, 2) at phase 0 over so many periods of the given lengths, (n,).

    `columns` replaces parameters of the system by place, (n,) each. Results do not depend on the number of cores.
    """
    limits = limits_of(system, ())
    wanted = Wanted(tol=tol, periods=None, limits=limits, sample=(), until=(), paths=())
    lanes = compiled_lanes(system, program(system, limits, ()), wanted, 1)
    result = Stretched(np.full((periods, len(states), 2), np.nan), np.full((len(states), 2), np.nan))
    counts = np.array([piece_count(length) for length in lengths])
    groups = [group for count in np.unique(counts) for group in _groups(np.flatnonzero(counts == count))]
    done = np.zeros(1)
    stopped: list[bool] = []

    def work(rows: np.ndarray) -> None:
        follower = _Follower(lanes, states[rows], {c: values[rows] for c, values in columns.items()}, lengths[rows])
        for p in range(periods):
            if stopped:
                return
            result.growth[p, rows] = follower.period(int(counts[rows[0]]))
            done[0] += len(rows)
        result.states[rows] = follower.ends()

    load_driver(), load_helpers(), load_advance()  # compiled here, not by each thread
    with ThreadPoolExecutor(available_cores()) as pool:
        workers = [pool.submit(work, rows) for rows in groups]
        try:
            while wait(workers, LOOK).not_done:
                if progress is not None:
                    progress(float(done[0]) / (periods * max(1, len(states))))
        except BaseException:
            stopped.append(True)
            raise
        for worker in workers:
            worker.result()
    return result


def _groups(rows: np.ndarray) -> list[np.ndarray]:
    """Rows in groups for the threads, a group or more for each core."""
    least = max(available_cores(), math.ceil(len(rows) / LARGEST_GROUP))
    return [group for group in np.array_split(rows, least) if group.size]


class _Follower:
    """A group of motions with frames, a row of numbers for each: coordinate, its two derivatives, velocity, its two."""

    def __init__(self, lanes: Lanes, states: np.ndarray, columns: dict[int, np.ndarray], lengths: np.ndarray) -> None:
        self._lanes, self._columns, self._lengths = lanes, columns, lengths
        self._rows = np.zeros((len(states), 6))
        self._rows[:, [0, 3]] = states
        self._rows[:, [1, 2, 4, 5]] = first_frame(2).ravel()
        self._alive = np.isfinite(states).all(axis=1)

    def period(self, pieces: int) -> np.ndarray:
        """Go on for a period; returns ln of the stretch in it, (n, 2)."""
        growth = np.where(self._alive[:, None], 0.0, np.full((len(self._rows), 2), np.nan))
        for j in range(pieces):
            here = np.flatnonzero(self._alive)
            if not here.size:
                break
            growth[here] += self._piece(here, self._lengths[here] / pieces, j)
        return growth

    def _piece(self, here: np.ndarray, span: np.ndarray, j: int) -> np.ndarray:
        numbers, labels = np.zeros((here.size, 4)), np.zeros((here.size, 4), dtype=np.int64)
        numbers[:, 0], numbers[:, 1], numbers[:, 2] = j * span, self._lengths[here], (j + 1) * span
        jobs = Jobs(self._rows[here], numbers, labels, {c: values[here] for c, values in self._columns.items()})
        ends = self._lanes.run(jobs, 1)
        rows, growth = _orthonormal(ends.states)
        sound = (ends.labels[:, 0] == k.DONE) & np.isfinite(rows).all(axis=1) & (ends.labels[:, 2] != k.CHATTER)
        self._rows[here] = rows
        self._alive[here[~sound]] = False
        return np.where(sound[:, None], growth, np.nan)

    def ends(self) -> np.ndarray:
        """Coordinate and velocity at the end, (n, 2)."""
        return np.where(self._alive[:, None], self._rows[:, [0, 3]], np.nan)


def _orthonormal(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The states with their derivatives made orthonormal, by Gram and Schmidt, and ln of the lengths that they had, (n, 2)."""
    rows = rows.copy()
    x1, x2, y1, y2 = rows[:, 1], rows[:, 2], rows[:, 4], rows[:, 5]
    first, area = np.hypot(x1, y1), x1 * y2 - x2 * y1
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = np.log(np.stack([first, np.abs(area) / first], axis=1))
        unit_x, unit_y = np.where(first > 0.0, x1 / first, 1.0), np.where(first > 0.0, y1 / first, 0.0)
    growth[first == 0.0] = -np.inf
    turn = np.where(area < 0.0, -1.0, 1.0)
    rows[:, 1], rows[:, 4], rows[:, 2], rows[:, 5] = unit_x, unit_y, -turn * unit_y, turn * unit_x
    return rows, growth
