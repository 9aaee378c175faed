"""The panels of all parts of the paper, computed on all cores in one pool of processes; a panel of
two parts is computed once.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from typing import Any

from saltus.flow import available_cores, share_cores

# the functions that compute the panels of a part, by the panels' names
Panels = Mapping[str, Callable[[], Any]]
Task = tuple[str, str]  # the names of a part and of its panel
Work = tuple[Callable[[], Any], list[Task]]  # what computes a panel, and all that it is a panel of


@dataclass(frozen=True, slots=True)
class PanelOutcome:
    """What became of one panel: its data and seconds of processor time, or why there are none."""

    data: Any = None
    seconds: float = 0.0
    error: Exception | None = None


@dataclass(frozen=True, slots=True)
class ComputedPart:
    """What became of one part: its panels by name and in their order, or the first error of one."""

    name: str
    panels: dict[str, Any]
    seconds: float  # of processor time
    error: Exception | None = None


def compute_panels(parts: Mapping[str, Panels]) -> Generator[ComputedPart, None, None]:
    """Compute the panels of all parts; each part is given as soon as its last panel is there.

    Panels are begun in the order of the parts. Parts of a single panel each are computed here: to
    start a process takes longer. A panel that fails leaves the others alone: its parts have its
    error.
    """
    # by the function and its arguments: a chart of two figures is computed once
    shared: dict[Any, list[Task]] = {}
    for part, panels in parts.items():
        for name, make in panels.items():
            shared.setdefault(_what(make), []).append((part, name))
    outcomes: dict[Task, PanelOutcome] = {}
    work = [(parts[tasks[0][0]][tasks[0][1]], tasks) for tasks in shared.values()]
    cores = min(available_cores(), max(map(len, parts.values()), default=1))
    for tasks, outcome in _outcomes(work, cores):
        outcomes |= dict.fromkeys(tasks, outcome)
        for part in dict.fromkeys(part for part, _ in tasks):
            if all((part, name) in outcomes for name in parts[part]):
                yield _joined(part, {name: outcomes.pop((part, name)) for name in parts[part]})


def _joined(part: str, panels: Mapping[str, PanelOutcome]) -> ComputedPart:
    errors = [outcome.error for outcome in panels.values() if outcome.error is not None]
    return ComputedPart(
        part,
        {} if errors else {name: outcome.data for name, outcome in panels.items()},
        sum(outcome.seconds for outcome in panels.values()),
        errors[0] if errors else None,
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


def _outcomes(work: Sequence[Work], cores: int) -> Iterator[tuple[list[Task], PanelOutcome]]:
    """What becomes of each piece of work, as it comes.

    Where a process is ended from outside, for instance for want of memory, nobody knows by which of
    the panels: each panel that is not done yet is then computed alone, one after another.
    """
    if cores < 2:
        yield from ((tasks, _attempted(make)) for make, tasks in work)
        return
    alone = []
    for piece, outcome in _in_processes(work, cores):
        if isinstance(outcome.error, BrokenProcessPool):
            alone.append(piece)
        else:
            yield piece[1], outcome
    for piece in alone:
        for _, outcome in _in_processes([piece], 1):
            yield piece[1], outcome


def _in_processes(work: Sequence[Work], cores: int) -> Iterator[tuple[Work, PanelOutcome]]:
    """The outcomes of a pool of processes, as they come."""
    context = multiprocessing.get_context("spawn")
    left = context.Value("i", len(work))
    with ProcessPoolExecutor(
        cores, mp_context=context, initializer=_begin, initargs=(left,)
    ) as pool:
        futures = {pool.submit(_counted, piece[0]): piece for piece in work}
        try:
            for future in as_completed(list(futures)):
                piece, error = futures.pop(future), future.exception()
                if error is None:
                    yield piece, future.result()
                elif isinstance(error, Exception):
                    yield piece, PanelOutcome(error=error)
                else:
                    raise error
        except BaseException:  # after an interruption nobody waits for the others
            _stop(pool)
            raise


def _attempted(make: Callable[[], Any]) -> PanelOutcome:
    try:
        return _timed(make)
    except Exception as error:
        return PanelOutcome(error=error)


def _timed(make: Callable[[], Any]) -> PanelOutcome:
    start = time.process_time()
    data = make()
    return PanelOutcome(data, time.process_time() - start)


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


def _counted(make: Callable[[], Any]) -> PanelOutcome:
    """Compute a panel of the pool; afterwards the panels that are left share the cores anew."""
    try:
        return _timed(make)
    finally:
        with _left[0].get_lock():
            _left[0].value -= 1
