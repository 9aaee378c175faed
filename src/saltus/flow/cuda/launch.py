"""Motions in the threads of a card: what `Lanes.run` gives, launch by launch.

A launch takes every motion that goes on through some forcing periods; between two of them those that
have ended are left out, Ctrl-C ends all, and the progress is told. A motion with very many rare
events, in each of which its thread works alone, is left to the lanes of this processor, which follow
it from its start: its result is theirs. Where launches are cut changes nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.flow.cuda.targets import Target
from saltus.flow.cuda.thread_code import ThreadCode, thread_code
from saltus.flow.cuda.thread_memory import FLAG_WORDS, WORD, Request
from saltus.flow.lane_steps.memory import UNBOUNDED, LaneGroup, Work
from saltus.flow.programs.lane_threads import WHAT, Ends, Jobs, Lanes
from saltus.progress import Progress, silent


@dataclass(frozen=True)
class LaunchSettings:
    """How motions are shared between launches."""

    periods: int = 25  # of one launch
    calls: int = (
        256  # of the scalar kernel in one launch, after which a motion is left to the lanes
    )
    most_motions: int = 1 << 20


SETTINGS = LaunchSettings()


def run_on(
    target: Target,
    lanes: Lanes,
    jobs: Jobs,
    threads: int,
    progress: Progress = silent,
    total: float = 0.0,
    settings: LaunchSettings = SETTINGS,
) -> Ends:
    """Run all jobs in the threads of a target; the arguments are those of `Lanes.run`."""
    with _BUSY:  # one ensemble after the other
        return _run_on(target, lanes, jobs, threads, progress, total, settings)


_BUSY = threading.Lock()


def example_of(lanes: Lanes, jobs: Jobs, ends: Ends) -> LaneGroup:
    """A group of these lanes with one job, of which the code reads the sizes."""
    control = np.array(UNBOUNDED)
    return lanes.group(control)._replace(work=lanes.work(jobs, ends, slice(0, 1), control))


def _run_on(
    target: Target,
    lanes: Lanes,
    jobs: Jobs,
    threads: int,
    progress: Progress,
    total: float,
    settings: LaunchSettings,
) -> Ends:
    n = len(jobs)
    ends = lanes.no_ends(n)
    if n == 0:
        return ends
    probe = example_of(lanes, jobs, ends)
    code = thread_code(lanes, probe, target.card)
    loaded = target.load(code.code)
    numbers = np.array(list(_flat(probe.settings)))
    left: list[np.ndarray] = []
    done = 0.0
    progress(0.0, WHAT)
    for rows in _chunks(n, code, probe.work, target, settings):
        work = lanes.work(jobs, ends, rows, probe.work.control)
        try:
            for beyond, periods in _launches(target, loaded, code, work, numbers, settings):
                left.append(rows.start + beyond)
                done += periods
                progress(min(1.0, done / total) if total > 0 else 0.0, WHAT)
        finally:
            target.free()
        ends.samples[rows] = work.samples[:, :, lanes.sampled]
    again = np.concatenate([*left, np.zeros(0, dtype=np.int64)])
    if again.size:
        _take(ends, again, lanes.run(_some(jobs, again), threads))
    progress(1.0, WHAT)
    return ends


def _chunks(
    n: int, code: ThreadCode, work: Work, target: Target, settings: LaunchSettings
) -> Iterator[slice]:
    """Motions that go through their launches together, as the target's memory allows."""
    arrays = (
        work.states,
        work.parameters,
        work.last,
        work.ends,
        work.rates,
        work.samples,
        work.jobs,
    )
    tables = sum(table.nbytes for table in work.tables if len(table) > 1)
    each = (
        sum(array[0].nbytes for array in arrays)
        + WORD * (code.first_row.size + FLAG_WORDS + 2)
        + tables
    )
    size = max(1, min(settings.most_motions, int(target.memory / each)))
    for first in range(0, n, size):
        yield slice(first, min(first + size, n))


def _launches(
    target: Target,
    loaded: Any,
    code: ThreadCode,
    work: Work,
    numbers: np.ndarray,
    settings: LaunchSettings,
) -> Iterator[tuple[np.ndarray, float]]:
    """Launch after launch, until all motions have ended; gives the motions that a launch leaves to
    the lanes, and an estimate of the forcing periods done in it.
    """
    n = len(work.states)
    flags = np.zeros((n, FLAG_WORDS + 1), dtype=np.int64)
    made = (work.last, work.ends, work.rates, work.samples)
    given = (work.states, work.jobs, work.parameters, *work.tables)
    places = [
        target.put(flags),
        target.room(n * code.first_row.nbytes),  # the threads fill it
        target.put(code.first_row),
        *(target.put(array) for array in (*given, *made)),
    ]
    sizes = len(work.tables[0]), work.tables[0].shape[1], work.samples.shape[1]
    going = np.arange(n)
    while going.size:
        limits = settings.periods, settings.calls, target.put(numbers)
        request = Request._make((going.size, target.put(going), *places, *sizes, *limits))
        target.follow(loaded, np.array(request, dtype=np.int64), going.size)
        target.get(places[0], flags)
        busy = flags[going, 0] != 0
        beyond = busy & (flags[going, FLAG_WORDS] >= settings.calls)
        yield going[beyond], float(settings.periods * going.size)
        going = np.ascontiguousarray(going[busy & ~beyond])
    for place, array in zip(places[-len(made) :], made, strict=True):
        target.get(place, array)


def _flat(values: Any) -> Iterator[float]:
    """The numbers of tuples of tuples, one after the other."""
    for value in values:
        if isinstance(value, tuple):
            yield from _flat(value)
        else:
            yield float(value)


def _some(jobs: Jobs, rows: np.ndarray) -> Jobs:
    columns = {place: np.asarray(column)[rows] for place, column in jobs.columns.items()}
    records = tuple(table if len(table) == 1 else table[rows] for table in jobs.records)
    return Jobs(jobs.states[rows], jobs.rows[rows], columns, (records[0], records[1]))


def _take(ends: Ends, rows: np.ndarray, other: Ends) -> None:
    """Put the ends of some motions in their rows."""
    for name in ("states", "rows", "rates", "samples"):
        getattr(ends, name)[rows] = getattr(other, name)
