"""Following a branch in one direction: steps, special points, grazings, and the ways in which a branch ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from saltus.orbits.grazing import other_side
from saltus.orbits.orbit import TOUCH
from saltus.orbits.path import Point, predicted
from saltus.orbits.problem import Problem
from saltus.orbits.special import SpecialPoint, UserFunction, asymmetry, grazing, located, parent_point, tests_between

CLOSED = "closes"
UNSTABLE = "is no longer stable"
ANGLE = 0.12  # rad between the tangents of neighbouring points that is aimed at,
SHARPEST = 0.5  # and the most that is accepted
STEP = 0.1  # the longest step: a thirtieth of the parameter's range, or a tenth of a radian and of a unit of speed
FIRST_STEP = 1e-3
LEAST_STEP = 1e-11
MOST_POINTS = 20_000
MOST_IMPACTS = 120  # of one period
ACCUMULATE = 5  # grazings one after the other that each add impacts, within
NEARBY = 1e-3  # of the parameter's range, or shrinking towards rest below
SMALL = 1e-2  # of the largest amplitude with more impacts than
ENOUGH = 60  # a period: there are infinitely many
STEEPEST = 1e8  # multiplier beyond which an orbit is no longer solved for: its motions part by that much within a period
SMALLEST = 1e-7  # amplitude below which an orbit has shrunk to rest
SAME = 1e-5  # between unknowns of orbits that coincide where both graze
AHEAD = 1e-6  # of a point along its tangent, to tell its direction
FAR = 0.3  # share of a step by which its end may differ from its tangent's


@dataclass
class Walk:
    """One direction of a branch while it is being followed."""

    bounds: tuple[float, float]
    functions: dict[str, UserFunction]
    longest: float
    progress: Callable[[float], object] | None
    until: str | None = None  # the kind of special point at which to stop, or UNSTABLE: beyond the loss of stability
    points: list[Point] = field(default_factory=list)
    special: list[SpecialPoint] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)  # test functions that changed their sign where no zero was found
    before: Point | None = None  # from which the last step was made
    reason: str = ""

    def follow(self, first: Point, born: bool = False, step: float = FIRST_STEP) -> None:
        """Follow the branch from a point until it ends; `born` at a special point, whose kind is not to be found again."""
        self.points.append(first)
        step, at_birth = min(step, self.longest), born
        while not self.reason:
            point = self.points[-1]
            ahead, step = self._step(point, step)
            if ahead is None:
                break
            grown = self._take(point, ahead, at_birth)
            self.before, at_birth = point, False
            if grown is not None:  # through a grazing, or cut short: begin again with care
                step = min(FIRST_STEP, 0.1 * step) if grown else step
            if len(self.points) > MOST_POINTS:
                self.reason = f"more than {MOST_POINTS} points"

    def _step(self, point: Point, step: float) -> tuple[Point | None, float]:
        """The next point, and the length of the step after it."""
        while step > LEAST_STEP:
            ahead = point.curve.solve(predicted(self.before, point, step), point.tangent)
            if ahead is not None and self._on_curve(point, ahead, step):
                cosine = float(ahead.tangent @ (point.curve.weights**2 * point.tangent))
                angle = math.acos(min(1.0, max(-1.0, cosine)))
                if angle < SHARPEST:
                    factor = min(2.0, max(0.5, ANGLE / max(angle, 1e-3)))
                    return ahead, min(self.longest, step * (factor if ahead.solution.iterations <= 5 else min(factor, 0.7)))
            step *= 0.4
        largest = abs(point.orbit.multipliers[0])
        if largest > STEEPEST and not point.orbit.grazes:
            self.reason = f"the orbit repels too strongly to be followed: its largest multiplier is {largest:.1g}"
        else:
            self.reason = "the steps shrink to nothing: the branch has a singularity that is none of the known kinds"
        return None, step

    def _on_curve(self, point: Point, ahead: Point, step: float) -> bool:
        """Whether a step has stayed on its branch: near its tangent, and not on that of the orbits that are their own images."""
        before, after = asymmetry(point), asymmetry(ahead)
        if before is not None and after is not None and np.abs(before).max() > 1e-6 > 100.0 * np.abs(after).max():
            return False
        if grazing(point) <= TOUCH and grazing(ahead) < 0.0:  # born at a grazing, and already over the next one
            return False
        return point.curve.norm(ahead.place - point.place - step * point.tangent) < FAR * step

    def _take(self, point: Point, ahead: Point, born: bool) -> bool | None:
        """Accept a step, up to the first of a grazing, a bound, the orbit's own image and the closing of the loop.

        Returns None for an ordinary step, True after a grazing.
        """
        graze = located("GR", grazing, point, ahead) if grazing(ahead) < 0.0 else None
        if grazing(ahead) < 0.0 and graze is None:
            self.reason = "a grazing that could not be located"
            return None
        if graze is not None:
            ahead = graze.point
        if not born and _passes_image(point, ahead):
            self._end_at_image(point, ahead)
            return None
        beyond = self._beyond(point, ahead)
        if beyond is not None:
            ahead, graze = beyond, None
        if len(self.points) > 3 and self._closes(point, ahead):
            self._note(point, self.points[0])
            self.points.append(self.points[0])
            self.reason = CLOSED
            return None
        if not born:
            self._note(point, ahead)
        self.points.append(ahead)
        if self.reason:
            return None
        if beyond is not None:
            self.reason = f"bound {ahead.parameter:g}"
        elif ahead.orbit.amplitude < SMALLEST:
            self.reason = "shrinks to rest"
        elif graze is not None:
            if any(_same_place(graze, earlier) for earlier in self.special):
                self.reason = (
                    f"comes back onto itself at {graze.parameter:.9g}: between two branches that nearly meet it has gone over "
                    "from one to the other; use a smaller step"
                )
                return None
            self.special.append(graze)
            return self._switch(graze)
        elif self.until == UNSTABLE and not ahead.orbit.stable:
            self.reason = UNSTABLE
        if self.progress is not None:
            self.progress(ahead.parameter)
        return None

    def _switch(self, graze: SpecialPoint) -> bool:
        """Go on with the signature on the other side of a grazing."""
        following = other_side(graze.point)
        if isinstance(following, str):
            self.reason = following
        elif (shorter := repetition(following)) is not None:
            self.reason = f"ends at a grazing of the {shorter}"
        elif following.curve.problem.signature.impact_count > MOST_IMPACTS:
            self.reason = f"more than {MOST_IMPACTS} impacts a period"
        elif self._accumulates(following):
            self.reason = (
                f"grazings accumulate near {following.parameter:.9g}: {following.orbit.signature.impact_count} impacts and more"
            )
        else:
            self.points.append(following)
        return True

    def _accumulates(self, following: Point) -> bool:
        """Whether the last grazings have all added impacts, ever closer to one parameter."""
        last = [(s.parameter, s.orbit.signature.impact_count) for s in self.special if s.kind == "GR"][-ACCUMULATE:]
        counts = [*(n for _, n in last), following.orbit.signature.impact_count]
        span = max((p for p, _ in last), default=0.0) - min((p for p, _ in last), default=0.0)
        growing = len(last) == ACCUMULATE and bool((np.diff(counts) > 0).all())
        small = following.orbit.amplitude < SMALL * max(point.orbit.amplitude for point in self.points)
        return growing and (span < NEARBY * following.curve.scale or (small and counts[-1] > ENOUGH))

    def _note(self, a: Point, b: Point) -> None:
        """Locate the special points of a step, in order."""
        found = []
        for kind, test in tests_between(a, b, self.functions):
            special = located(kind, test, a, b)
            if special is not None:
                found.append(special)
            else:
                self.missed.append(f"{kind} between {a.parameter:.9g} and {b.parameter:.9g}")
        folds = [s.parameter for s in found if s.kind == "LP"]
        found = [
            s
            for s in found
            if not (s.kind == "BPC" and not s.orbit.symmetric and any(abs(s.parameter - p) < 1e-8 for p in folds))
        ]
        for special in sorted(found, key=lambda s: a.curve.norm(s.point.place - a.place)):
            self.special.append(special)
            self.points.append(special.point)  # so that a line through the points shows the fold
            if special.kind == self.until and not self.reason:
                self.reason = f"the first {special.kind}"

    def _end_at_image(self, a: Point, b: Point) -> None:
        """End where the orbit becomes its own image: on the branch that its family was born from, at its BPC or PD."""
        kind = "BPC" if a.curve.problem.signature.period % 2 else "PD"
        parent = parent_point(kind, a, b)
        self.reason = f"meets its own image at a {kind}"
        if parent is not None:
            self.points.append(parent.point)
            self.special.append(parent)

    def _beyond(self, a: Point, b: Point) -> Point | None:
        """The point on the bound of the parameter that the step goes over."""
        low, high = self.bounds
        if low <= b.parameter <= high:
            return None
        bound = low if b.parameter < low else high
        share = (bound - a.parameter) / (b.parameter - a.parameter)
        guess = a.place + share * (b.place - a.place)
        guess[-1] = bound
        return a.curve.solve_at(guess, b.place - a.place) or b

    def _closes(self, a: Point, b: Point) -> bool:
        """Whether the step goes by the first point of the branch."""
        begin = self.points[0].parameter
        if (a.parameter - begin) * (b.parameter - begin) > 0.0:
            return False
        shift = separation(self.points[0].curve.problem, self.points[0].solution.unknowns, b)
        length = b.curve.norm(b.place - a.place)
        if shift is None:
            return False
        first = np.append(shift, self.points[0].parameter)
        along, across = first - a.place, b.place - a.place
        share = float(along @ (b.curve.weights**2 * across)) / length**2
        if not (0.0 < share <= 1.0 and b.curve.norm(along - share * across) < 0.2 * length):
            return False
        return self._goes_as_the_first(shift, b)  # a branch that comes back along itself does not close

    def _goes_as_the_first(self, shift: np.ndarray, b: Point) -> bool:
        """Whether a point is followed in the direction of the first one, whose unknowns lie nearest to it as `shift`."""
        first = self.points[0]
        moved = separation(first.curve.problem, first.solution.unknowns + AHEAD * first.tangent[:-1], b)
        assert moved is not None
        direction = np.append((moved - shift) / AHEAD, first.tangent[-1])
        return float(direction @ (b.curve.weights**2 * b.tangent)) > 0.0


def _same_place(a: SpecialPoint, b: SpecialPoint) -> bool:
    """Whether two grazings are one and the same, met from the same side."""
    same = (a.kind, a.orbit.signature) == (b.kind, b.orbit.signature)
    return same and math.isclose(a.parameter, b.parameter, rel_tol=1e-10) and math.isclose(a.amplitude, b.amplitude, rel_tol=1e-9)


def _passes_image(a: Point, b: Point) -> bool:
    """Whether a step goes through an orbit that is its own image."""
    before, after = asymmetry(a), asymmetry(b)
    return before is not None and after is not None and bool(before @ after < 0.0) and np.abs(before).max() > 1e-6


def repetition(point: Point) -> str | None:
    """What an orbit is that is another one gone round several times, or its own mirror image; None for one that is not."""
    signature, n = point.curve.problem.signature, len(point.curve.problem.signature.sides)
    difference = asymmetry(point)
    if signature.period % 2 and difference is not None and np.abs(difference).max() < SAME:
        return "symmetric orbit"
    for periods in range(1, signature.period):
        part = n * periods // signature.period
        if signature.period % periods or n * periods % signature.period or part == 0 or signature.symmetric:
            continue
        pairs = point.solution.unknowns.reshape(-1, part, 2).copy()
        pairs[:, :, 0] -= 2.0 * math.pi * periods * np.arange(len(pairs))[:, None]
        if signature.sides == signature.sides[:part] * len(pairs) and np.ptp(pairs, axis=0).max() < SAME:
            return f"orbit of period {periods}"
    return None


def separation(problem: Problem, unknowns: np.ndarray, other: Point) -> np.ndarray | None:
    """The unknowns of an orbit, renumbered and shifted by whole forcing periods to lie nearest to those of another point.

    None where the signatures differ.
    """
    target, signature = other.curve.problem.signature, problem.signature
    n = len(signature.sides)
    if (n, signature.period, signature.symmetric) != (len(target.sides), target.period, target.symmetric):
        return None
    if n == 0:
        return unknowns if signature.side == target.side else None
    pairs, best, least = unknowns.reshape(n, 2), None, math.inf
    goal = other.solution.unknowns.reshape(n, 2)
    for turn in range(n * (2 if signature.symmetric else 1)):
        rolled = np.roll(pairs, -turn, axis=0)
        flips = (turn + np.arange(n)) // n  # how often each has gone round the (half) period
        sides = np.roll(signature.sides, -turn) * ((-1) ** flips if signature.symmetric else 1)
        if tuple(sides) != tuple(target.sides):
            continue
        rolled = rolled + np.stack([flips * problem.closing, np.zeros(n)], axis=1)
        rolled[:, 0] += 2.0 * math.pi * round((goal[0, 0] - rolled[0, 0]) / (2.0 * math.pi))
        distance = float(np.abs(rolled - goal).max())
        if distance < least:
            best, least = rolled.ravel(), distance
    return best
