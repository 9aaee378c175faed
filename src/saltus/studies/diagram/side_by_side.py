"""Parts of a search at the same time: one in the calling thread, the others in threads of their own.

The compiled code of ensembles and of orbits' segments releases Python's lock, so that several parts keep several cores busy where
one of them alone would not: small ensembles run on one core, and so does everything that is written in Python.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, CancelledError, Future, ThreadPoolExecutor, wait
from typing import Any, TypeVar

from saltus.flow import available_cores
from saltus.progress import Progress, silent

R = TypeVar("R")

LOOK_INTERVAL = 0.1  # Seconds between looks at Ctrl-C and at the progress of other threads.


def side_by_side(beside: Callable[[Progress], object], here: Callable[[Progress], object], progress: Progress) -> None:
    """Do two things at the same time, `beside` in another thread.

    Neither may change what the other one reads; the results are then those of one after the other, which is how they are done if
    there is one core only. Only this thread calls `progress`. If one of them is interrupted or fails, the other one ends when it
    next reports its progress.
    """
    if available_cores() == 1:
        beside(progress)
        here(progress)
        return
    with _Others(1) as others:
        other = others.begin(beside)

        def watched(fraction: float, what: str) -> None:
            if other.done():
                other.result()  # raises its error
            progress(fraction, what)

        here(watched)
        others.wait(progress)


def all_at_once(computations: Sequence[Callable[[Progress], R]]) -> list[R]:
    """The results of computations that do not depend on one another, each in a thread of its own if there are several cores.

    After an interrupt each ends when it next reports its progress.
    """
    if available_cores() == 1 or len(computations) < 2:
        return [compute(silent) for compute in computations]
    with _Others(len(computations)) as others:
        runs = [others.begin(compute) for compute in computations]
        others.wait(silent)
        return [run.result() for run in runs]


class _Others:
    """Threads beside this one. If this one leaves the context by an exception, they end when they next report their progress."""

    def __init__(self, count: int) -> None:
        self._pool, self._stopped = ThreadPoolExecutor(count), threading.Event()
        self._runs, self._report = list[Future[Any]](), (0.0, "")

    def __enter__(self) -> _Others:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._stopped.set()
        self._pool.shutdown()

    def begin(self, compute: Callable[[Progress], R]) -> Future[R]:
        """Begin a computation in a thread of its own."""
        run = self._pool.submit(compute, self._take_report)
        self._runs.append(run)
        return run

    def wait(self, progress: Progress) -> None:
        """Wait until all are done, and pass on what they report; raises the first error."""
        while wait(self._runs, LOOK_INTERVAL, FIRST_EXCEPTION).not_done:
            for run in self._runs:
                if run.done():
                    run.result()
            if self._report[1]:
                progress(*self._report)
        for run in self._runs:
            run.result()

    def _take_report(self, fraction: float, what: str) -> None:
        if self._stopped.is_set():
            raise CancelledError
        self._report = fraction, what
