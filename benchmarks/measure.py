"""Measuring side by side on a machine that is not quiet, and comparing at equal achieved error.

The tasks take turns, round after round, so that a machine whose speed drifts slows them alike. The
median over the rounds is the figure, the quartiles its spread, and the least time what the machine
can do when left alone.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TypeVar

import numpy as np

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class Timing:
    """Seconds over the rounds, and how many cores were busy (process time over wall time)."""

    median: float
    low: float  # first quartile
    high: float  # third quartile
    least: float
    cores: float  # NaN where not known
    rounds: int

    def per(self, count: float, unit: float = 1e6) -> Timing:
        """The same for one of `count` things, in microseconds unless told otherwise."""
        factor = unit / count
        return Timing(
            self.median * factor,
            self.low * factor,
            self.high * factor,
            self.least * factor,
            self.cores,
            self.rounds,
        )

    def as_dict(self) -> dict[str, float]:
        """For JSON."""
        return asdict(self)


def summary(times: Sequence[float], cores: float = float("nan")) -> Timing:
    """The timing of one task from its rounds."""
    low, median, high = np.percentile(times, [25, 50, 75])
    return Timing(float(median), float(low), float(high), float(min(times)), cores, len(times))


def interleave(
    tasks: Mapping[Key, Callable[[], object]],
    rounds: int,
    *,
    warm: bool = True,
    one_core: bool = False,
) -> dict[Key, Timing]:
    """Run every task once a round, in turn; with `warm` an untimed round comes first, to compile
    and to fill caches.

    Tasks that use one core are timed by their processor time, which does not count what else runs
    on the machine.
    """
    wall: dict[Key, list[float]] = {key: [] for key in tasks}
    cpu: dict[Key, list[float]] = {key: [] for key in tasks}
    if warm:
        for task in tasks.values():
            task()
    for _ in range(rounds):
        for key, task in tasks.items():
            gc.collect()
            start, busy = time.perf_counter(), time.process_time()
            task()
            wall[key].append(time.perf_counter() - start)
            cpu[key].append(time.process_time() - busy)
    return {
        key: summary(cpu[key] if one_core else wall[key], sum(cpu[key]) / sum(wall[key]))
        for key in tasks
    }


def front(errors: Sequence[float], times: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """The points that no other one beats in both error and time, the largest error and the shortest
    time first.
    """
    best: list[tuple[float, float]] = []
    for cost, error in sorted(
        (t, e) for e, t in zip(errors, times, strict=True) if np.isfinite(e) and np.isfinite(t)
    ):
        if not best or error < best[-1][0]:
            best.append((max(error, 1e-300), cost))
    kept = np.array(best).reshape(-1, 2)
    return kept[:, 0], kept[:, 1]


def equal_error(
    errors: Sequence[float], times: Sequence[float], targets: Sequence[float]
) -> np.ndarray:
    """The time that a code needs for an error of at most each target: log-log interpolation along
    its front.

    A target looser than anything measured costs what the cheapest point costs; one that the code
    never reached is NaN.
    """
    error, cost = front(errors, times)
    if not len(error):
        return np.full(len(targets), np.nan)
    x, y = -np.log(error), np.log(cost)  # both rise along the front
    wanted = -np.log(np.asarray(targets, dtype=float))
    return np.where(wanted > x[-1] + 1e-12, np.nan, np.exp(np.interp(wanted, x, y)))
