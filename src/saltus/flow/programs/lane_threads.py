"""Many trajectories on all cores: chunks of jobs are handed to threads that release Python's
lock.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from saltus.flow.kernel.contact_layout import NoPress, PartColumn, PartKind, solver_arrays
from saltus.flow.kernel.layout import CHATTER_SPEED, LEAST_SHARE, ROUGHER, SERIES_LENGTH, SLOW
from saltus.flow.kernel.memory import MOTION
from saltus.flow.lane_steps.memory import (
    END,
    FLAGS,
    LONGEST_RECURRENCE,
    ROW,
    UNBOUNDED,
    Code,
    Control,
    Helpers,
    LaneGroup,
    LaneSettings,
    LaneSizes,
    MemoryPlan,
    Work,
    is_over,
)
from saltus.flow.lane_steps.steps import step_limits
from saltus.flow.programs.compiled import Program, taylor_order
from saltus.flow.programs.compiled_lanes import (
    compile_everything,
    load_advance,
    load_driver,
    load_helpers,
)
from saltus.progress import LOOK_INTERVAL, Progress, shown_if_long, silent
from saltus.taylor.vectors import CACHE_LINE, WIDTH

WHAT = "following the motions"  # for the progress


@dataclass(frozen=True)
class ThreadSettings:
    """How trajectories are shared between threads, and how often threads are checked."""

    # The largest number of trajectories in one call of the driver, and of samples that it keeps in
    # all: 25 MB for one coordinate. Chunks are large because lanes stand empty at the end of each
    # one; for long, if a few motions have a thousand times the impacts of the others.
    largest_chunk: int = 8192
    most_samples: int = 1 << 19
    # The smallest number of trajectories in a chunk, if there are as many for each thread.
    smallest_chunk: int = 8 * WIDTH
    # When a chunk is taken, at least so many chunks of its size remain for each thread: the last
    # ones are small, so that all threads end at about the same time.
    chunks_ahead: int = 2
    most_threads: int = 256  # The most threads of all ensembles that run at the same time.


SETTINGS = ThreadSettings()


def chunks(count: int, threads: int, kept: int = 1) -> Iterator[slice]:
    """The chunks of `count` trajectories: large ones first, then smaller ones, so that all threads
    end at about the same time.

    `kept` is the number of forcing periods for which samples of each trajectory are kept.
    """
    first = 0
    least = min(SETTINGS.smallest_chunk, math.ceil(count / threads))
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
    rows: np.ndarray  # (n,), see `JOB`
    columns: dict[int, np.ndarray]  # by the parameter's place, (n,)
    # breakpoints (n or 1, m) and pieces, see `record_tables`
    records: tuple[np.ndarray, np.ndarray]

    def __len__(self) -> int:
        return len(self.states)


@dataclass(frozen=True)
class Ends:
    """How the trajectories ended, an array with a row for each."""

    states: np.ndarray  # (n, 2 coordinates)
    rows: np.ndarray  # (n,), see `END`
    # (n, own coordinates + columns of the tangent): accelerations, then the shifts of the last
    # event
    rates: np.ndarray
    samples: np.ndarray  # (n, kept, columns asked for)
    # (n, relays): the side of each relay, +1 or -1, of models with some
    sides: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int8))


_sharing: list[Callable[[], int]] = [lambda: 1]  # how many processes share the cores


def share_cores(processes: Callable[[], int]) -> None:
    """Let this process use only its share of the cores, as other processes compute at the same
    time.

    More threads than cores would only split small ensembles further, and more lanes would stand
    empty at the end.

    Parameters
    ----------
    processes
        Counts the processes that compute at the same time, this one included, whenever it is
        called.

    Examples
    --------
    >>> saltus.flow.share_cores(lambda: 1)  # this process alone
    """
    _sharing[:] = [processes]


def available_cores() -> int:
    """The number of cores that this process may use, or its share of them (`share_cores`).

    Examples
    --------
    >>> saltus.flow.available_cores() >= 1
    True
    """
    cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return max(1, cores // max(1, _sharing[0]()))


@cache
def _pool(process: int) -> ThreadPoolExecutor:
    """The threads of a process, kept because starting one takes as long as a short ensemble; a
    forked process needs its own.

    A thread is started where none is idle, so that ensembles that run at the same time do not wait
    for one another.
    """
    return ThreadPoolExecutor(SETTINGS.most_threads, thread_name_prefix="saltus")


@dataclass(frozen=True)
class Lanes:
    """A structure ready to run in lanes, with the settings that are the same for all of its
    trajectories.
    """

    program: Program
    plan: MemoryPlan
    # lane_series, lane_impact, lane_field, and of a model with several contacts lane_one_free
    functions: tuple[Any, ...]
    parameters: np.ndarray  # of the system; `Jobs.columns` replaces some
    tol: float
    kept: int  # how many of the last forcing periods are kept
    sampled: list[int]  # which columns of a sample are kept
    extrema: bool  # whether extrema are recorded
    # whether from the start of a motion, not only in the forcing periods that are kept
    from_start: bool
    natural_length: float  # in which states that recur are compared
    settle: bool  # whether a trajectory ends when it repeats itself
    natural_time: float  # of what moves without a forcing period, inf where the load has one
    shortest_step: float  # below which an acceleration counts as singular
    inert_frictions: tuple[int, ...] = ()  # the numbers of those without any force

    def run(
        self, jobs: Jobs, threads: int, progress: Progress = silent, total: float = 0.0
    ) -> Ends:
        """Run all jobs; `total` is the number of their forcing periods, for the progress.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C, within a step of every lane.
        """
        n = len(jobs)
        # starting a thread costs time even if it has no lanes
        threads = max(1, min(threads, math.ceil(n / WIDTH)))
        ends = self.no_ends(n)
        controls = [np.array(UNBOUNDED) for _ in range(threads)]
        waiting = chunks(n, threads, self.kept)
        lock = threading.Lock()
        compile_everything(self.several)  # here, not in each thread
        progress = shown_if_long(progress)
        progress(0.0, WHAT)
        pool = _pool(os.getpid())
        workers = list[Future[None]]()
        try:  # an interrupt while they are begun must stop them, too
            for control in controls:
                workers.append(pool.submit(self._work, jobs, ends, waiting, lock, control))
            while wait(workers, LOOK_INTERVAL).not_done:
                if total > 0:
                    progress(min(1.0, sum(int(c[Control.PERIODS]) for c in controls) / total), WHAT)
        except BaseException:
            for control in controls:
                control[Control.MOST_PERIODS] = 0
            wait(workers)
            raise
        for worker in workers:
            worker.result()
        progress(1.0, WHAT)
        return ends

    def no_ends(self, n: int) -> Ends:
        """Room for the ends of so many trajectories."""
        sizes = self.program.structure.sizes
        return Ends(
            np.empty((n, 2 * sizes.dof)),
            np.zeros(n, dtype=END),
            np.zeros((n, self.own + sizes.columns)),
            np.empty((n, self.kept, len(self.sampled))),
        )

    @property
    def several(self) -> bool:
        """Whether the model has contacts or frictions that hold single coordinates."""
        return self.program.trace.several

    @property
    def own(self) -> int:
        """The model's coordinates."""
        return self.program.structure.sizes.own

    def _work(
        self,
        jobs: Jobs,
        ends: Ends,
        waiting: Iterator[slice],
        lock: threading.Lock,
        control: np.ndarray,
    ) -> None:
        """Run chunk after chunk until there are none."""
        group = self.group(control)
        while True:
            with lock:
                rows = next(waiting, None)
            if rows is None or is_over(control):
                return
            self._run_chunk(group, jobs, ends, rows)

    def _run_chunk(self, group: LaneGroup, jobs: Jobs, ends: Ends, rows: slice) -> None:
        work = self.work(jobs, ends, rows, group.work.control)
        load_driver(self.several)(group._replace(work=work))
        ends.samples[rows] = work.samples[:, :, self.sampled]

    def work(self, jobs: Jobs, ends: Ends, rows: slice, control: np.ndarray) -> Work:
        """What the driver is given of some jobs, and where it writes how they end."""
        states = np.ascontiguousarray(jobs.states[rows])
        parameters = np.tile(self.parameters, (len(states), 1))
        for place, column in jobs.columns.items():
            parameters[:, place] = column[rows]
        tables = tuple(table if len(table) == 1 else table[rows] for table in jobs.records)
        return Work(
            states=states,
            jobs=jobs.rows[rows],
            parameters=parameters,
            tables=(tables[0], tables[1]),
            last=ends.states[rows],
            ends=ends.rows[rows],
            rates=ends.rates[rows],
            samples=np.full((len(states), self.kept, 2 * self.own + 4), np.nan),
            control=control,
        )

    def group(self, control: np.ndarray) -> LaneGroup:
        """A group of lanes for one thread, still without work."""
        trace = self.program.trace
        own = self.own
        plan = self.plan
        numbers = len(trace.contact_numbers) if self.several else 3
        nothing = np.zeros((0, 0))
        return LaneGroup(
            memory=self._memory(),
            places=np.array(plan.places, dtype=np.int64),
            sizes=self._sizes(),
            settings=self._settings(),
            code=self._code(),
            helpers=Helpers._make(
                (
                    *load_helpers(self.several),
                    *([] if self.several else [None]),
                    load_advance(self.several),
                )
            ),
            kernel=(self.program.model if self.several else self.program.structure.functions,),
            flags=np.zeros(1, dtype=FLAGS),
            rows=np.zeros(WIDTH, dtype=ROW),
            constants_of=np.tile(
                np.append(np.zeros(plan.constants), self.program.data), (WIDTH, 1)
            ),
            geometry=np.zeros((WIDTH, numbers)),
            stroboscopic=np.zeros((WIDTH, 2 * LONGEST_RECURRENCE, 2 * own)),
            agreements=np.zeros((WIDTH, LONGEST_RECURRENCE + 1), dtype=np.int64),
            contact_rows=np.tile(self._contact_rows(), (WIDTH, 1, 1)),
            polynomial=np.zeros(SERIES_LENGTH + 2),
            gap=np.zeros(SERIES_LENGTH + 2),
            impact_space=self._impact_space() if self.several else None,
            work=Work(
                nothing,
                np.zeros(0),
                nothing,
                (nothing, nothing),
                nothing,
                np.zeros(0),
                nothing,
                nothing,
                control,
            ),
        )

    def _impact_space(self) -> tuple[Any, ...]:
        """Room for an impact in a model with several contacts."""
        own = self.own
        count = len(self.program.trace.signs)
        rows = self._contact_rows()
        solver = solver_arrays(
            self.plan.local, count, 0, len(rows) - count, len(self.program.trace.contact_numbers), 0
        )
        return np.zeros(1, dtype=MOTION), np.zeros(2 * own), rows[:count], solver

    def _contact_rows(self) -> np.ndarray:
        """The scalar kernel's rows of contacts and frictions, before a motion has begun."""
        trace = self.program.trace
        contacts = len(trace.signs)
        frictions = len(trace.sided)
        rows = np.zeros((contacts + frictions, len(PartColumn)), dtype=np.int64)
        rows[contacts:, PartColumn.KIND] = PartKind.FRICTION
        rows[contacts:, PartColumn.PRESSED] = [1 + part.contact for part in trace.sided]
        rows[[contacts + k for k in self.inert_frictions], PartColumn.PRESSED] = NoPress.INERT
        return rows

    def _sizes(self) -> LaneSizes:
        """The numbers of the structure, and of what is asked for."""
        sizes = self.program.structure.sizes
        trace = self.program.trace
        plan = self.plan
        return LaneSizes(
            own=sizes.own,
            local=sizes.local,
            first_order=sizes.first_order,
            jumps=int(any(jump.op != "coordinate" for jump in trace.jumps)),
            dependent=trace.dependent,
            rows=sizes.dof,
            columns=sizes.columns,
            margins=sizes.stops,
            sides=sizes.sides,
            checked=sizes.steep,
            records=plan.records,
            order=lane_order(self.tol),
            scalar_order=taylor_order(self.tol),
            workspace=sizes.rows,
            kept=self.kept,
            extrema=int(self.extrema),
            from_start=int(self.from_start),
            settle=int(self.settle),
            ends_asked=int(self.settle or bool(self.sampled)),
            every_end=int(self.settle or self.kept > 1),
            one_free=int(plan.guards is not None and not sizes.steep),
            guards=plan.guards or 0,
            constant_guards=plan.constant_guards,
            contacts=len(trace.signs),
            frictions=len(trace.sided),
            repeats=sizes.repeats,
            contact_numbers=sizes.contact_numbers,
            coordinates=np.array([*trace.contact_coordinates, *trace.places], dtype=np.int64),
            signs=np.array(trace.signs, dtype=np.int64),
        )

    def _settings(self) -> LaneSettings:
        order = lane_order(self.tol)
        slowest = max(SLOW * math.sqrt(self.tol), LEAST_SHARE)
        if not self.program.structure.several:  # impacts of one contact may lose nothing
            slowest = max(slowest, CHATTER_SPEED)
        limits = step_limits(order, self.tol), step_limits(order, ROUGHER * self.tol)
        scales = self.natural_time, self.shortest_step, slowest
        return LaneSettings(self.tol, *scales, *limits, self.natural_length)

    def _code(self) -> Code:
        """The functions of the structure."""
        series, impact, field, *one_free = self.functions
        constants, geometry = self.program.structure.tables
        return Code(series, impact, field, constants, geometry, one_free[0] if one_free else None)

    def _memory(self) -> np.ndarray:
        """The lanes' memory, aligned such that each vector lies within one cache line; otherwise
        every load would touch two.
        """
        size = self.plan.end * WIDTH
        line = CACHE_LINE // 8
        buffer = np.zeros(size + line)
        start = -(buffer.ctypes.data // 8) % line
        return buffer[start : start + size]


def lane_order(tol: float) -> int:
    """The order of series in lanes: 14 at 1e-6, 18 at 1e-10, 22 at 1e-14; always even (see
    `kernel/layout.py`).

    An order higher by two takes up to 5 % less time. But if the last coefficients nearly vanish, a
    step is too long by some factor, and the error too large by this factor to the power of the
    order.
    """
    return 2 * math.ceil((7 - math.log10(tol)) / 2 - 1e-9)
