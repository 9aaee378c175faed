"""Parts of a search at the same time: one in the calling thread, the others in threads of their own.

The compiled code of ensembles and of orbits' segments releases Python's lock, so that several parts keep several cores busy where
one of them alone would not: small ensembles run on one core, and so does everything that is written in Python.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, wait
from typing import TypeVar

from saltus.flow import available_cores
from saltus.progress import Progress

R = TypeVar("R")

LOOK_INTERVAL = 0.1  # Seconds between looks at Ctrl-C and at the progress of the other thread.


def side_by_side(beside: Callable[[Progress], object], here: Callable[[Progress], object], progress: Progress) -> None:
    """Do two things at the same time, `beside` in another thread.

    Neither may change what the other one reads; the results are then those of one after the other, which is how they are done if
    there is one core only. Only this thread calls `progress`. If `here` is interrupted, `beside` ends when it next reports its
    progress.
    """
    if available_cores() == 1:
        beside(progress)
        here(progress)
        return
    stopped, reports = threading.Event(), list[tuple[float, str]]()

    def report(fraction: float, what: str) -> None:
        if stopped.is_set():
            raise CancelledError
        reports[:] = [(fraction, what)]

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(beside, report)
        try:
            here(progress)
            while wait([other], LOOK_INTERVAL).not_done:
                for last in list(reports):
                    progress(*last)
        except BaseException:
            stopped.set()
            raise
        other.result()


def all_at_once(computations: Sequence[Callable[[], R]]) -> list[R]:
    """The results of computations that do not depend on one another, each in a thread of its own if there are several cores."""
    if available_cores() == 1 or len(computations) < 2:
        return [compute() for compute in computations]
    with ThreadPoolExecutor(len(computations)) as pool:
        return [run.result() for run in [pool.submit(compute) for compute in computations]]
