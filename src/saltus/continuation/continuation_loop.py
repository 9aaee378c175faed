"""The loop of a continuation: it follows a curve step by step, through its events, up to an end for
which it gives the reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.continuation.course import Course, middle_of, solved_between, turning_point
from saltus.continuation.curve import Zero
from saltus.continuation.end import CurveEnd, CurveMissed, End, Missed
from saltus.continuation.pseudo_arclength import STEPS, StepSettings
from saltus.continuation.test_functions import Cut, Events, TestFunction, located
from saltus.continuation.trail import SETTINGS as TRAIL
from saltus.continuation.trail import Trail, TrailPoint
from saltus.progress import Progress, is_idle, silent

# the least and the largest value of each parameter, by its name
Bounds = Mapping[str, tuple[float, float]]


class Watch:
    """Reports the progress along a curve: the share of the range of its first parameter, or of the
    largest number of points.
    """

    def __init__(self, progress: Progress, bounds: Bounds, most_points: int) -> None:
        self.progress = progress
        self.names = tuple(bounds)
        self.most_points = most_points
        self.bounds = next(iter(bounds.values()))
        self.seen = (np.inf, -np.inf)
        self.points = 0

    def __call__(self, point: Any) -> None:
        """Report a new point."""
        if is_idle(self.progress):
            return
        self.seen, self.points = (
            (min(self.seen[0], point.parameter), max(self.seen[1], point.parameter)),
            self.points + 1,
        )
        low, high = np.clip(self.seen, *self.bounds)
        share = max(
            (high - low) / (self.bounds[1] - self.bounds[0]), self.points / self.most_points
        )
        what = ", ".join(
            f"{name} = {value:.6g}"
            for name, value in zip(self.names, point.parameters, strict=True)
        )
        self.progress(min(1.0, float(share)), what)


@dataclass
class Continuation:
    """The continuation of a curve in one direction: its settings, and the points and special points
    found so far.
    """

    bounds: Bounds
    events: Events
    steps: StepSettings = STEPS
    watch: Callable[[Any], object] = lambda point: None
    points: list[Any] = field(default_factory=list)
    special: list[Zero] = field(default_factory=list)
    missed: list[Missed] = field(default_factory=list)
    end: End | None = None
    trail: Trail = field(init=False)

    def follow(self, first: Any, born: bool = False, cut: Cut | None = None) -> None:
        """Follow the curve from a point until it ends. `born` says that this is a special point of
        another curve, whose events are not to be found again; `cut`, that the curve begins beyond a
        change of its equations there."""
        self.points.append(first)
        self.end = self._on_a_bound(first) if cut is None else None
        self.trail = Trail(self.events, first)
        before = None
        step = min(self.steps.first, self.steps.longest)
        if cut is not None and self._cross(cut):
            self.end = self._on_a_bound(self.points[-1])
            step = min(step, self.events.first_step(self.points))
        while self.end is None:
            point = self.points[-1]
            ahead, step = self._step(before, point, step)
            if isinstance(ahead, End):
                self.end = ahead
            elif isinstance(ahead, Cut):
                step = min(
                    self.steps.restart,
                    self.events.first_step(self.points) if self._cross(ahead) else np.inf,
                )
            elif self._accept(point, ahead, born):
                step = min(
                    self.steps.restart,
                    max(0.1 * step, self.steps.renewed),
                    self.events.first_step(self.points),
                )
            before = point
            born = False
            if self.end is None and len(self.points) > self.steps.most_points:
                self.end = End(
                    CurveEnd.MOST_POINTS,
                    self.points[-1].parameter,
                    detail=str(self.steps.most_points),
                )

    def course(self, start: End) -> Course[Any, Any]:
        """The curve as it was followed; `start` says why it begins where it does."""
        assert self.end is not None
        return Course(
            tuple(self.points), tuple(self.special), (start, self.end), tuple(self.missed)
        )

    def _step(self, before: Any, point: Any, step: float) -> tuple[Any, float]:
        """The next point, or a cut or an end in its place, and the length of the step after it."""
        curve = point.curve
        length = step
        while step > self.steps.least:
            length = min(step, curve.reach(point))
            ahead = curve.advance(before, point, length)
            if ahead is not None and self.events.accepts(point, ahead):
                turn = curve.turn(point, ahead)
                if turn < self.steps.most and (
                    length < self.steps.restart
                    or (self.trail.explains(ahead) and self._crosses(point, ahead))
                ):
                    return ahead, self.steps.following(step, turn, ahead.iterations)
            step = self.steps.shrink * length
        return self.events.stalled(self, point, length), step

    def _crosses(self, point: Any, ahead: Any) -> bool:
        """Whether each crossing of curves that a step shows is located. If one is not, the step may
        have jumped onto another curve that passes nearby, between two of its sharp corners.
        """
        before = self.trail.values_at(point)
        after = self.trail.values_at(ahead)
        return all(
            located(self.trail.tests[i], point, ahead, singular=True) is not None
            for i in self.trail.singular
            if before[i] * after[i] < 0.0
        )

    def _accept(self, point: Any, ahead: Any, born: bool) -> bool:
        """Accept a step up to its first event; returns whether the curve goes on with other
        equations.

        The step is cut at the bounds first, so that events outside of them are not found.
        """
        bounded = self._beyond(point, ahead)
        if isinstance(bounded, End):
            self.end = bounded
            return False
        ahead, end = bounded
        samples = [] if born else self.trail.to_barrier(ahead)
        ahead, end = (
            (ahead, end) if not samples or samples[-1].point is ahead else (samples[-1].point, None)
        )
        cut = self.events.cut(point, ahead)
        if isinstance(cut, End):
            found = self.events.unlocated(self, point, ahead, cut)
            if isinstance(found, Cut):
                return self._cross(found)
            self.end = found
            return False
        ahead, end = (ahead, end) if cut is None else (cut.point, None)
        self.end = None if born else self.events.interrupted(self, point, ahead)
        if self.end is not None:
            return False
        closed = end is None and self._closes(point, ahead)
        if closed:
            ahead, end, cut = self.events.closing(self.points[0], ahead), End(CurveEnd.CLOSED), None
        if closed or not born:
            self._locate(self.trail.examined(self.trail.up_to(samples, ahead)))
            if cut is not None and cut.special is not None:
                self._show_between(point, ahead)
        else:
            self.trail.begin(ahead)
        self.points += (
            [ahead, self.points[0]] if closed and ahead is not self.points[0] else [ahead]
        )
        self.watch(ahead)
        self.end = self.end or end or self.events.ended(self, ahead, cut)
        return self.end is None and cut is not None and self._cross(cut)

    def _cross(self, cut: Cut) -> bool:
        """Go on beyond a cut; returns whether the curve then has other equations."""
        self.special += [] if cut.special is None else [cut.special]
        following = self.events.across(self, cut)
        if isinstance(following, End):
            self.end = following
            return False
        self.trail.begin(cut.point if following is None else following)
        if following is not None:
            self.points.append(following)
        return following is not None

    def take(self, ahead: Any) -> None:
        """Add a point ahead, with the same equations, and the special points on the way to it."""
        self._locate(self.trail.examined(self.trail.up_to([], ahead)))
        self.points.append(ahead)

    def _locate(self, samples: list[TrailPoint]) -> None:
        """Locate the special points of a step, in order."""
        found = []
        for a, b in pairwise(samples):
            zeros, jumps = self._zeros(a, b)
            found += zeros
            # a test function with two zeros in the interval shows them at the zero of another one
            # between them, as an NS just before an LP
            inner = self.trail.with_zeros(a, b, zeros) if zeros else []
            for first, last in pairwise(inner if len(inner) > 2 else []):
                found += self._zeros(first, last, self.trail.unchanged(a, b))[0]
            reason = CurveMissed.JUMP if jumps else CurveMissed.STABILITY
            if jumps and not self.trail.explained(a, b, jumps):
                # a jump may hide a special point beside it
                a, b = self.trail.narrowed(a, b, jumps)
                zeros, jumps = self._zeros(a, b)
                found += zeros
            if not self.trail.explained(a, b, jumps):
                self.missed.append(Missed(reason, "", a.point.parameters, b.point.parameters))
        first = samples[0].point
        for zero in sorted(
            self.events.distinct(found),
            key=lambda zero: first.curve.norm(zero.point.place - first.place),
        ):
            if self.events.keeps_special:
                self._show_between(first, zero.point)
                self.points.append(zero.point)
            self.special.append(zero)
            self.end = self.end or self.events.last(zero)
        self.trail.go_on(samples)

    def _show_between(self, first: Any, special: Any) -> None:
        """Add a point before a special one if the last point is special too and lies in the same
        step, which begins at `first`.

        At special points a multiplier is 1 in modulus up to rounding, so that a part of the curve
        between two of them shows its stability only at a point of its own.
        """
        last = self.points[-1]
        if not self.special or last is not self.special[-1].point:
            return
        norm = first.curve.norm
        if norm(special.place - last.place) > TRAIL.narrowest * norm(special.place - first.place):
            middle = middle_of(last, special)
            self.points += [] if middle is None else [middle]

    def _zeros(
        self, a: TrailPoint, b: TrailPoint, chosen: np.ndarray | bool = True
    ) -> tuple[list[Zero], list[TestFunction]]:
        """The zeros of the test functions, or of those chosen, that change their signs between two
        points; and the test functions that jump over 0 there.
        """
        changes = [
            before < 0.0 < after or after < 0.0 < before
            for before, after in zip(a.values.tolist(), b.values.tolist(), strict=True)
        ]
        if not any(changes):
            return [], []
        signs = zip(self.trail.tests, changes & np.asarray(chosen), strict=True)
        changed = [test for test, sign in signs if sign and test is not self.trail.barrier]
        singular = any(test.singular for test in changed)
        found = []
        jumps = []
        for test in changed:
            zero = located(test, a.point, b.point, singular)
            if self.events.jumps_over(test.kind, a.point, b.point, zero):
                jumps.append(test)
            elif zero is None:
                places = a.point.parameters, b.point.parameters
                self.missed.append(Missed(CurveMissed.NOT_LOCATED, test.kind, *places))
            else:
                found.append(zero)
        return found, jumps

    def _on_a_bound(self, point: Any) -> End | None:
        """The end of a curve that starts on a bound and leads beyond it."""
        values = point.parameters.tolist()
        for i, (name, (low, high)) in enumerate(self.bounds.items()):
            value = values[i]
            if low < value < high:
                continue
            rate = float(point.tangent[i - len(values)])
            if (value <= low and rate < 0.0) or (value >= high and rate > 0.0):
                return self._bound(name, value)
        return None

    def _bound(self, name: str, value: float) -> End:
        return End(
            CurveEnd.BOUND, float(value), detail=f"{name} = " if len(self.bounds) > 1 else ""
        )

    def _beyond(self, a: Any, b: Any) -> tuple[Any, End | None] | End:
        """The point on the first bound that a step crosses or reaches, with the end there; an end
        alone if it is not found.
        """
        length = a.curve.norm(b.place - a.place)
        passed = [
            crossing
            for i, bounds in enumerate(self.bounds.values())
            for crossing in self._crossings(a, b, i, bounds, length)
        ]
        if not passed:
            return b, self._on_a_bound(b)
        if any(point is None for _, _, point in passed):
            return End(CurveEnd.NOT_LOCATED, b.parameter, "bound")
        index, bound, point = min(passed, key=lambda found: a.curve.norm(found[2].place - a.place))
        return point, self._bound(list(self.bounds)[index], bound)

    def _crossings(
        self, a: Any, b: Any, i: int, bounds: tuple[float, float], length: float
    ) -> list[tuple[int, float, Any]]:
        """The places at which a step of a length leaves the bounds of a parameter, even if it comes
        back: the parameter's index, the bound, and the point if it is found."""
        found: list[tuple[int, float, Any]] = []
        index = i - len(self.bounds)
        low, high = bounds
        first = float(a.place[index])
        last = float(b.place[index])
        room = min(first - low, last - low, high - first, high - last)
        if room * a.curve.weights[index] > length:
            return found  # not even a step that turns round reaches a bound
        turn = turning_point(a, b, index)
        for bound, beyond in zip((low, high), (np.less, np.greater), strict=True):
            if beyond(b.place[index], bound) or (
                turn is not None and beyond(turn.place[index], bound)
            ):
                found.append((i, bound, next(iter(solved_between(a, b, index, bound)), None)))
        return found

    def _closes(self, a: Any, b: Any) -> bool:
        """Whether a step passes through the first point of the curve, in the direction in which the
        curve was followed there.
        """
        if len(self.points) <= 3:
            return False
        first = self.points[0]
        across = b.place - a.place
        length = b.curve.norm(across)
        # how far the parameters lie off those of the step: `nearest` may take long
        off = [
            weight * (value - min(max(value, min(ends)), max(ends)))
            for weight, value, *ends in zip(
                b.curve.weights[-len(self.bounds) :].tolist(),
                first.parameters.tolist(),
                a.parameters.tolist(),
                b.parameters.tolist(),
                strict=True,
            )
        ]
        if math.hypot(*off) > STEPS.closing * length:
            return False
        place = self.events.nearest(first, first.place, b)
        if place is None or length == 0.0:
            return False
        along = place - a.place
        share = float(along @ (b.curve.weights**2 * across)) / length**2
        if not (
            0.0 < share <= 1.0 and b.curve.norm(along - share * across) < STEPS.closing * length
        ):
            return False
        moved = self.events.nearest(first, first.place + STEPS.ahead * first.tangent, b)
        if moved is None:
            return False
        # otherwise the curve has turned round
        return float((moved - place) @ (b.curve.weights**2 * b.tangent)) > 0.0


def both_ways(
    first: Any,
    events: Callable[[], Events],
    bounds: Bounds,
    steps: StepSettings = STEPS,
    progress: Progress = silent,
    growing: Callable[[tuple[Any, ...]], object] | None = None,
    cut: Cut | None = None,
) -> Course[Any, Any]:
    """The curve through a point, followed against its tangent and then along it, or once if it
    closes.

    `growing` is called with all points so far, in order, whenever there is a new one. `cut` is a
    change of the equations at the first point itself, beyond which the second half begins.
    """
    watch: Watch = Watch(progress, bounds, steps.most_points)
    halves: list[Course[Any, Any]] = []

    def watched(point: Any) -> None:
        watch(point)
        if growing is not None:
            back, ahead = (halves[0].points, run.points) if halves else (run.points, [first])
            growing((*(point.turned() for point in reversed(back[1:])), *ahead))

    for point in (first.turned(), first):
        run: Continuation = Continuation(bounds, events(), steps, watched)
        run.follow(point, cut=cut if halves else None)
        halves.append(run.course(End(CurveEnd.CLOSED)))
        if run.end == End(CurveEnd.CLOSED):
            return halves[-1]
    back, ahead = halves
    points = (*(point.turned() for point in reversed(back.points[1:])), *ahead.points)
    special = (*reversed(back.special), *ahead.special)
    return Course(points, special, (back.ends[1], ahead.ends[1]), (*back.missed, *ahead.missed))
