"""The panels of all parts of the paper, computed on all cores in one pool of processes; a panel of
two parts is computed once.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from typing import Any

from saltus.flow import available_cores, share_cores

# the functions that compute the panels of a part, by the panels' names
Panels = Mapping[str, Callable[[], Any]]
Task = tuple[str, str]  # the names of a part and of its panel


def compute_panels(parts: Mapping[str, Panels]) -> Iterator[tuple[str, dict[str, Any], float]]:
    """Compute the panels of all parts; each part is given as soon as its last panel is there.

    Panels are begun in the order of the parts. Parts of a single panel each are computed here: to
    start a process takes longer.

    Yields
    ------
    tuple[str, dict[str, Any], float]
        The name of the part, its panels by name and in their order, and the seconds of processor
        time that they took.
    """
    # by the function and its arguments: a chart of two figures is computed once
    shared: dict[Any, list[Task]] = {}
    for part, panels in parts.items():
        for name, make in panels.items():
            shared.setdefault(_what(make), []).append((part, name))
    found: dict[Task, tuple[Any, float]] = {}
    work = [(parts[tasks[0][0]][tasks[0][1]], tasks) for tasks in shared.values()]
    with _results(
        work, min(available_cores(), max(map(len, parts.values()), default=1))
    ) as results:
        for tasks, result in results:
            found |= dict.fromkeys(tasks, result)
            for part in dict.fromkeys(part for part, _ in tasks):
                if all((part, name) in found for name in parts[part]):
                    made = {name: found.pop((part, name)) for name in parts[part]}
                    yield (
                        part,
                        {name: data for name, (data, _) in made.items()},
                        sum(seconds for _, seconds in made.values()),
                    )


def _what(make: Callable[[], Any]) -> Any:
    """A key of what a function computes: for a `partial`, the function and its arguments, which are
    plain data.
    """
    return (
        (make.func, repr(make.args), repr(sorted(make.keywords.items())))
        if isinstance(make, partial)
        else make
    )


@contextmanager
def _results(
    work: Sequence[tuple[Callable[[], Any], list[Task]]], cores: int
) -> Iterator[Iterator[tuple[list[Task], tuple[Any, float]]]]:
    """The results of each piece of work, and its seconds, as they come."""
    if cores < 2:
        yield ((tasks, _timed(make)) for make, tasks in work)
        return
    context = multiprocessing.get_context("spawn")
    left = context.Value("i", len(work))
    with ProcessPoolExecutor(
        cores, mp_context=context, initializer=_begin, initargs=(left,)
    ) as pool:
        futures = {pool.submit(_counted, make): tasks for make, tasks in work}
        try:
            yield ((futures.pop(future), future.result()) for future in as_completed(list(futures)))
        except (
            BaseException
        ):  # after an interruption or a failed panel the others are not needed any more
            _stop(pool)
            raise


def _timed(make: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    return make(), time.process_time() - start


def _stop(pool: Executor) -> None:
    pool.shutdown(wait=False, cancel_futures=True)
    for child in multiprocessing.active_children():
        child.terminate()


_left: list[Any] = []  # in a process of the pool: how many panels are not done


def _begin(left: Any) -> None:
    """Share the cores with the panels that are left.

    Ctrl-C reaches every process of a terminal; it is ignored here, as the main process handles it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _left[:] = [left]
    share_cores(lambda: int(left.value))


def _counted(make: Callable[[], Any]) -> tuple[Any, float]:
    """Compute a panel of the pool; afterwards the panels that are left share the cores anew."""
    result = _timed(make)
    with _left[0].get_lock():
        _left[0].value -= 1
    return result
