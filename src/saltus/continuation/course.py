"""A curve as it was followed, in both directions from where it was begun."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic

from saltus.continuation.continuation_loop import Bounds, Continuation, Watch
from saltus.continuation.curve import P
from saltus.continuation.end import CurveEnd, End
from saltus.continuation.events import Events
from saltus.continuation.step_length import STEPS, StepSettings
from saltus.continuation.test_functions import Zero
from saltus.progress import Progress, silent


@dataclass(frozen=True)
class Course(Generic[P]):
    """A curve as it was followed: its points in order, the special ones, the reasons for both ends."""

    points: tuple[P, ...]
    special: tuple[Zero[P], ...]
    ends: tuple[End, End]
    missed: tuple[str, ...]  # test functions that changed their sign where no zero was located


def both_ways(
    first: P,
    events: Callable[[], Events[P]],
    bounds: Bounds,
    *,
    steps: StepSettings = STEPS,
    progress: Progress = silent,
) -> Course[P]:
    """The curve through a point, followed against its tangent and then along it, or once if it closes."""
    watch: Watch[P] = Watch(progress, bounds, steps.most_points)
    runs = []
    for point in (first.turned(), first):
        run: Continuation[P] = Continuation(bounds, events(), steps, watch)
        run.follow(point)
        assert run.end is not None
        if run.end.reason is CurveEnd.CLOSED:
            return Course(tuple(run.points), tuple(run.special), (run.end, run.end), tuple(run.missed))
        runs.append(run)
    back, ahead = runs
    assert back.end is not None
    assert ahead.end is not None
    return Course(
        (*(point.turned() for point in reversed(back.points[1:])), *ahead.points),
        (*reversed(back.special), *ahead.special),
        (back.end, ahead.end),
        (*back.missed, *ahead.missed),
    )


def solved_at(points: Sequence[P], value: float, index: int = -1) -> list[P]:
    """All points of a curve, given by its points in order, at a value of one number of its places, solved there."""
    found = []
    for a, b in pairwise(points):
        start, end = a.place[index], b.place[index]
        if start == end or (start - value) * (end - value) > 0.0 or end == value or not a.curve.joins(b.curve):
            continue
        guess = a.place + (value - start) / (end - start) * (b.place - a.place)
        guess[index] = value
        point = a.curve.solve_at(guess, a.tangent, index)
        found += [] if point is None else [point]
    return found + [point for point in points[-1:] if point.place[index] == value]
