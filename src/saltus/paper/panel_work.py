"""The panels of the paper's parts, computed on all cores: a process for each core, shared by all parts."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from saltus.flow import available_cores

Panels = Mapping[str, Callable[[], Any]]  # what computes each panel of a part, by the panel's name
Task = tuple[str, str]  # the names of a part and of its panel


def compute_panels(parts: Mapping[str, Panels]) -> Iterator[tuple[str, dict[str, Any], float]]:
    """Compute the panels of all parts; each part is given as soon as its last panel is there.

    Panels are begun in the order of the parts. Parts of a single panel each are computed here: to start a process takes longer.

    Yields:
        The name of the part, its panels by name and in their order, and the seconds of processor time that they took.
    """
    tasks: dict[Task, Callable[[], Any]] = {(part, name): make for part, panels in parts.items() for name, make in panels.items()}
    found: dict[Task, tuple[Any, float]] = {}
    with _results(tasks, min(available_cores(), max(map(len, parts.values()), default=1))) as results:
        for task, result in results:
            found[task] = result
            part = task[0]
            if all((part, name) in found for name in parts[part]):
                made = {name: found.pop((part, name)) for name in parts[part]}
                yield part, {name: data for name, (data, _) in made.items()}, sum(seconds for _, seconds in made.values())


@contextmanager
def _results(tasks: Mapping[Task, Callable[[], Any]], cores: int) -> Iterator[Iterator[tuple[Task, tuple[Any, float]]]]:
    """The results of tasks, and their seconds, as they come."""
    if cores < 2:
        yield ((task, _timed(make)) for task, make in tasks.items())
        return
    with ProcessPoolExecutor(cores, mp_context=multiprocessing.get_context("spawn"), initializer=_deaf) as pool:
        futures = {pool.submit(_timed, make): task for task, make in tasks.items()}
        try:
            yield ((futures[future], future.result()) for future in as_completed(futures))
        except BaseException:  # interrupted, or a panel failed: the others are of no use any more
            _stop(pool)
            raise


def _timed(make: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    return make(), time.process_time() - start


def _stop(pool: Executor) -> None:
    pool.shutdown(wait=False, cancel_futures=True)
    for child in multiprocessing.active_children():
        child.terminate()


def _deaf() -> None:
    """Leave Ctrl-C, which reaches every process of a terminal, to the one that knows what to say."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
