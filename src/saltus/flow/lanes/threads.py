"""Many trajectories on all cores: chunks of jobs are handed to threads that release Python's lock."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from saltus.flow.kernel.layout import CHATTER_SPEED, SHORTEST, SLOW
from saltus.flow.kernel.structures import Program, taylor_order
from saltus.flow.lanes.compiled_lanes import compile_everything, load_advance, load_driver, load_helpers
from saltus.flow.lanes.lane_functions import Slots
from saltus.flow.lanes.lane_layout import EndLabel, EndNumber, Size
from saltus.progress import Progress, silent
from saltus.taylor import CACHE_LINE, WIDTH

WHAT = "following the motions"  # for the progress


@dataclass(frozen=True)
class ThreadSettings:
    """How trajectories are shared between threads, and how often threads are checked."""

    # The largest number of trajectories in one call of the driver, and of samples that it keeps in all: 25 MB for one coordinate.
    # Chunks are large because lanes stand empty at the end of each one; for long, if a few motions have a thousand times the
    # impacts of the others.
    largest_chunk: int = 8192
    most_samples: int = 1 << 19
    # The smallest number of trajectories in a chunk, if there are as many for each thread.
    smallest_chunk: int = 8 * WIDTH
    # When a chunk is taken, at least so many chunks of its size remain for each thread: the last ones are small, so that all
    # threads end at about the same time.
    chunks_ahead: int = 2
    look_interval: float = 0.1  # Seconds between looks at Ctrl-C and at the progress.
    most_threads: int = 256  # The most threads of all ensembles that run at the same time.


SETTINGS = ThreadSettings()


def chunks(count: int, threads: int, kept: int = 1) -> Iterator[slice]:
    """The chunks of `count` trajectories: large ones first, then smaller ones, so that all threads end at about the same time.

    `kept` is the number of forcing periods for which samples of each trajectory are kept.
    """
    first, least = 0, min(SETTINGS.smallest_chunk, math.ceil(count / threads))
    largest = min(SETTINGS.largest_chunk, max(least, SETTINGS.most_samples // kept))
    while first < count:
        share = (count - first) / (SETTINGS.chunks_ahead * threads) if threads > 1 else count
        size = min(WIDTH * math.ceil(max(share, least) / WIDTH), largest)
        yield slice(first, min(first + size, count))
        first += size


@dataclass(frozen=True)
class Jobs:
    """Trajectories to run, an array with a row for each."""

    states: np.ndarray  # (n, 2 coordinates): coordinates, then velocities
    numbers: np.ndarray  # (n, len(JobNumber))
    labels: np.ndarray  # (n, len(JobLabel))
    columns: dict[int, np.ndarray]  # by the parameter's place, (n,)
    records: tuple[np.ndarray, np.ndarray]  # breakpoints (n or 1, m) and pieces, see `record_tables`

    def __len__(self) -> int:
        return len(self.states)


@dataclass(frozen=True)
class Ends:
    """How the trajectories ended, an array with a row for each."""

    states: np.ndarray  # (n, 2 coordinates)
    numbers: np.ndarray  # (n, EndNumber.RATES + own coordinates + columns of the tangent)
    labels: np.ndarray  # (n, len(EndLabel))
    samples: np.ndarray  # (n, kept, columns asked for)

    def of(self, label: EndLabel) -> np.ndarray:
        """One of the labels of every trajectory, (n,)."""
        column: np.ndarray = self.labels[:, label]
        return column


_sharing: list[Callable[[], int]] = [lambda: 1]  # how many processes share the cores


def share_cores(processes: Callable[[], int]) -> None:
    """Let this process use only its share of the cores, as other processes compute at the same time.

    More threads than cores would only split small ensembles further, and more lanes would stand empty at the end.

    Parameters
    ----------
    processes
        Called whenever an ensemble begins, for how many processes share the cores now.

    Examples
    --------
    >>> saltus.flow.share_cores(lambda: 10_000)
    >>> saltus.flow.available_cores()
    1
    >>> saltus.flow.share_cores(lambda: 1)
    """
    _sharing[:] = [processes]


def available_cores() -> int:
    """The number of cores that this process may use, or its share of them (`share_cores`).

    Examples
    --------
    >>> saltus.flow.available_cores() >= 1
    True
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // max(1, _sharing[0]()))


@cache
def _pool(process: int) -> ThreadPoolExecutor:
    """The threads of a process, kept because starting one takes as long as a short ensemble; a forked process needs its own.

    A thread is started where none is idle, so that ensembles that run at the same time do not wait for one another.
    """
    return ThreadPoolExecutor(SETTINGS.most_threads, thread_name_prefix="saltus")


@dataclass(frozen=True)
class Lanes:
    """A structure ready to run in lanes, with the settings that are the same for all of its trajectories."""

    program: Program
    slots: Slots
    functions: tuple[Any, ...]  # lane_series, lane_impact, lane_field, and of a model with several contacts lane_one_free
    parameters: np.ndarray  # of the system; `Jobs.columns` replaces some
    tol: float
    kept: int  # how many of the last forcing periods are kept
    sampled: list[int]  # which columns of a sample are kept
    extrema: bool  # whether extrema are recorded
    from_start: bool  # whether from the start of a motion, not only in the forcing periods that are kept
    settle: bool  # whether a trajectory ends when it repeats itself

    def run(self, jobs: Jobs, threads: int, progress: Progress = silent, total: float = 0.0) -> Ends:
        """Run all jobs; `total` is the number of their forcing periods, for the progress.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C, within a step of every lane.
        """
        n, own = len(jobs), self.own
        threads = max(1, min(threads, math.ceil(n / WIDTH)))  # starting a thread costs time even if it has no lanes
        ends = Ends(
            np.empty((n, jobs.states.shape[1])),
            np.zeros((n, EndNumber.RATES + own + self.program.structure.sizes.columns)),
            np.empty((n, len(EndLabel)), dtype=np.int64),
            np.empty((n, self.kept, len(self.sampled))),
        )
        controls = [np.zeros(2, dtype=np.int64) for _ in range(threads)]
        waiting, lock = chunks(n, threads, self.kept), threading.Lock()
        compile_everything(self.several)  # here, not in each thread
        progress(0.0, WHAT)
        pool, workers = _pool(os.getpid()), list[Future[None]]()
        try:  # an interrupt while they are begun must stop them, too
            for control in controls:
                workers.append(pool.submit(self._work, jobs, ends, waiting, lock, control))
            while wait(workers, SETTINGS.look_interval).not_done:
                if total > 0:
                    progress(min(1.0, sum(int(c[1]) for c in controls) / total), WHAT)
        except BaseException:
            for control in controls:
                control[0] = 1
            wait(workers)
            raise
        for worker in workers:
            worker.result()
        progress(1.0, WHAT)
        return ends

    @property
    def several(self) -> bool:
        """Whether the model has contacts or frictions that hold single coordinates."""
        return self.program.trace.several

    @property
    def own(self) -> int:
        """The model's coordinates."""
        return self.program.structure.sizes.own

    def _work(self, jobs: Jobs, ends: Ends, waiting: Iterator[slice], lock: threading.Lock, control: np.ndarray) -> None:
        """Run chunk after chunk until there are none."""
        fixed = self._arguments()
        memory = self._memory()
        while True:
            with lock:
                rows = next(waiting, None)
            if rows is None or control[0]:
                return
            self._run_chunk(fixed, memory, jobs, ends, rows, control)

    def _run_chunk(
        self, fixed: tuple[Any, ...], memory: np.ndarray, jobs: Jobs, ends: Ends, rows: slice, control: np.ndarray
    ) -> None:
        states = np.ascontiguousarray(jobs.states[rows])
        parameters = np.tile(self.parameters, (len(states), 1))
        for place, column in jobs.columns.items():
            parameters[:, place] = column[rows]
        samples = np.full((len(states), self.kept, 2 * self.own + 4), np.nan)
        results = (ends.states[rows], ends.numbers[rows], ends.labels[rows], samples)
        chunk = (states, jobs.numbers[rows], jobs.labels[rows], parameters)
        tables = tuple(table if len(table) == 1 else table[rows] for table in jobs.records)
        load_driver(self.several)(*fixed, memory, chunk, tables, results, control)
        ends.samples[rows] = samples[:, :, self.sampled]

    def _arguments(self) -> tuple[Any, ...]:
        """The arguments that are the same in every call of the driver: functions, sizes, places and settings."""
        structure, trace = self.program.structure, self.program.trace
        counts, scalar = structure.sizes, self.program.model if self.several else structure.functions
        code = (*self.functions[:3], *structure.tables, *self.functions[3:])
        contacts = np.array([len(trace.signs), *trace.held, *trace.signs, *trace.rubbed], dtype=np.int64)
        sizes = np.concatenate([np.zeros(Size.CONTACTS, dtype=np.int64), contacts])
        given = {
            Size.OWN: counts.own,
            Size.FRICTIONS: len(trace.rubbed),
            Size.COLUMNS: counts.columns,
            Size.MARGINS: counts.stops,
            Size.SIDES: counts.sides,
            Size.CHECKED: counts.steep,
            Size.RECORDS: self.slots.records,
            Size.ONE_FREE: self.slots.guards is not None and not counts.steep,
            Size.GUARDS: self.slots.guards or 0,
            Size.CONSTANT_GUARDS: self.slots.constant_guards,
            Size.ORDER: lane_order(self.tol),
            Size.SCALAR_ORDER: taylor_order(self.tol),
            Size.WORKSPACE: counts.rows,
            Size.KEPT: self.kept,
            Size.EXTREMA: self.extrema,
            Size.FROM_START: self.from_start,
            Size.SETTLE: self.settle,
            Size.ENDS_ASKED: self.settle or bool(self.sampled),
            Size.EVERY_END: self.settle or self.kept > 1,
        }
        sizes[list(given)] = list(given.values())
        slowest = max(SLOW * math.sqrt(self.tol), CHATTER_SPEED)
        settings = np.array([self.tol, SHORTEST, slowest])  # in the places of `LaneSetting`
        places = np.array(list(self.slots.places.values()), dtype=np.int64)
        return code, (load_advance(self.several), scalar), load_helpers(self.several), sizes, places, settings

    def _memory(self) -> np.ndarray:
        """The lanes' memory, aligned such that each vector lies within one cache line; otherwise every load would touch two."""
        size, line = self.slots.end * WIDTH, CACHE_LINE // 8
        buffer = np.zeros(size + line)
        start = -(buffer.ctypes.data // 8) % line
        return buffer[start : start + size]


def lane_order(tol: float) -> int:
    """The order of series in lanes: 14 at 1e-6, 18 at 1e-10, 22 at 1e-14; always even (see `kernel/memory_layout.py`).

    An order higher by two takes up to 5 % less time. But if the last coefficients nearly vanish, a step is too long by some
    factor, and the error too large by this factor to the power of the order.
    """
    return 2 * math.ceil((7 - math.log10(tol)) / 2 - 1e-9)
