"""Test functions vanish at special points, which are located by bracketing and carry their
evidence.

By `Events` a problem defines them, with changes of its equations and its own ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.continuation.curve import Evidence, Zero
from saltus.continuation.end import CurveEnd, End
from saltus.continuation.pseudo_arclength import NEWTON, between

if TYPE_CHECKING:
    from saltus.continuation.continuation_loop import Continuation


@dataclass(frozen=True)
class LocationSettings:
    """How a zero of a test function is bracketed."""

    # The most points that are solved for; bisection alone needs 50 to reach rounding.
    most_points: int = 80
    # The narrowest bracket that is aimed at: it has room for a few different numbers.
    rounding: float = 4e-15
    # After so many points that have not halved the bracket, the next one is its middle.
    slow: int = 3
    # A point is put beyond the expected zero by this share of the wanted width, to close the
    # bracket.
    overshoot: float = 0.5
    # The uncertainty of a zero that is extrapolated from two values before it, as a share of the
    # way to it.
    unsure: float = 0.1
    # Bisections of the interval in which the zero of a power lies: down to rounding.
    halvings: int = 60
    nodes: int = 4  # The number of nearest points for inverse interpolation.
    # A further point is solved for at this share of the distance from an end to a singular zero.
    apart: float = 0.5
    # How far a point may lie off the cubic through its neighbours, as a share of their distance.
    near: float = 0.3
    # Where a curve has a kink at the zero of a one-sided function, points beside it are off the
    # cubic at every distance. The bracket of a step shorter than this, in the norm of the curve, is
    # then narrow enough; longer steps may hide another curve. So is a bracket of two points of the
    # curve within which rounding leaves no further one, whatever the step.
    kink: float = 2e-9


SETTINGS = LocationSettings()


@dataclass(frozen=True)
class TestFunction:
    """A function of the points of a curve whose zeros are special points of one kind."""

    kind: str
    value: Callable[[Any], float]
    # width of the bracket of the zero, as a share of the step; the best point in it is nearer still
    width: float = 1e-11
    decisive: bool = False  # whether the count of `Events.outside` changes at its zeros
    # whether it is smooth: a step in which it changes unexpectedly is then taken again, shorter
    guides: bool = False
    # whether the equations are singular at its zeros, so that points beside them cannot be solved
    # for
    singular: bool = False
    # whether only its values before the zero, a power of the distance from it, show where the zero
    # is
    one_sided: bool = False


@dataclass(frozen=True)
class KnownPlace:
    """A point between two others of a curve."""

    share: float  # of the chord between them
    point: Any
    value: float  # of the test function


def located(test: TestFunction, a: Any, b: Any, singular: bool = False) -> Zero | None:
    """The point between a and b at which a test function goes through zero; None if the curve
    cannot be followed between.

    `singular` says that the equations are singular somewhere between, where another curve crosses.
    """
    known = [KnownPlace(0.0, a, test.value(a)), KnownPlace(1.0, b, test.value(b))]
    before = known[0].value
    after = known[-1].value
    if before * after > 0.0 or not np.isfinite([before, after]).all():
        return None
    widths = [1.0]
    at_share = _interpolated(test, known) if singular else lambda share: _solved(known, share)
    following = _next_share_from_one_side if test.one_sided else _next_share
    while (share := following(known, before, test.width, widths)) is not None:
        point = at_share(share)
        if point is None and _is_narrow(known, before, whole=test.one_sided):
            break
        if point is None or not np.isfinite(value := test.value(point)):
            return None
        known.append(KnownPlace(share, point, value))
        known.sort(key=lambda place: place.share)
    i = _bracket(known, before) if before != 0.0 else 0
    # beyond the zero of a one-sided function other equations hold: points before it must not be
    # interpolated with those beyond
    best = known[i] if test.one_sided else min(known[i : i + 2], key=lambda place: abs(place.value))
    brackets = _brackets(best.point, before, known)
    # then rounding leaves a way to the zero
    if test.one_sided and i > 0 and best.point.residual > NEWTON.stalled:
        brackets = tuple(map(float, np.maximum(brackets, 2.0 * _way_left(*known[i - 1 : i + 1]))))
    evidence = Evidence(best.point.residual, brackets, before, after, best.value)
    zero: Zero = best.point.zero_type(test.kind, best.point, evidence)
    return zero


def _is_narrow(known: list[KnownPlace], before: float, whole: bool) -> bool:
    """Whether the bracket of the zero, or the whole step, is so short that no point of the curve
    need be found in it.
    """
    i = 0 if whole or before == 0.0 else _bracket(known, before)
    first = known[i].point
    last = known[-1 if whole else i + 1].point
    return bool(first.curve.norm(last.place - first.place) < SETTINGS.kink)


def _bracket(known: list[KnownPlace], before: float) -> int:
    """The index of the last place before the first change of sign."""
    return next(i for i, place in enumerate(known[1:]) if (place.value > 0.0) != (before > 0.0))


def _next_share(
    known: list[KnownPlace], before: float, width: float, widths: list[float]
) -> float | None:
    """The next share to look at, or None if the zero is bracketed: by inverse interpolation, or
    halfway if that is slow.
    """
    i = _bracket(known, before) if before != 0.0 else 0
    low = known[i].share
    high = known[i + 1].share
    width = max(width, SETTINGS.rounding)
    widths.append(high - low)
    if (
        high - low <= width
        or 0.0 in (known[i].value, known[i + 1].value)
        or len(widths) > SETTINGS.most_points
    ):
        return None
    middle = 0.5 * (low + high)
    if len(widths) > SETTINGS.slow + 1 and widths[-1] > 0.5 * widths[-1 - SETTINGS.slow]:
        return middle if low < middle < high else None
    near = sorted(known, key=lambda place: abs(place.share - middle))[: SETTINGS.nodes]
    guess = _inverse([place.share for place in near], [place.value for place in near])
    if not low < guess < high:
        guess = _inverse([low, high], [known[i].value, known[i + 1].value])
    beyond = SETTINGS.overshoot * width
    # towards the farther end, to move that end too
    guess += beyond if guess - low < high - guess else -beyond
    guess = min(max(guess, low + beyond), high - beyond)
    return guess if low < guess < high else middle if low < middle < high else None


def _next_share_from_one_side(
    known: list[KnownPlace], before: float, width: float, widths: list[float]
) -> float | None:
    """`_next_share` for one-sided functions: just beyond the extrapolated zero, or, if such a point
    is known, just before it.
    """
    i = _bracket(known, before) if before != 0.0 else 0
    low = known[i].share
    high = known[i + 1].share
    width = max(width, SETTINGS.rounding)
    widths.append(high - low)
    if high - low <= width or known[i].value == 0.0 or len(widths) > SETTINGS.most_points:
        return None
    middle = 0.5 * (low + high)
    slow = len(widths) > SETTINGS.slow + 1 and widths[-1] > 0.5 * widths[-1 - SETTINGS.slow]
    if i == 0 or slow:
        return middle if low < middle < high else None
    guess, unsure = _extrapolated(known[max(0, i - 3) : i + 1], high)
    unsure = max(unsure, SETTINGS.overshoot * width)
    if not low < guess < high:
        return middle if low < middle < high else None
    beyond = guess + unsure
    share = (
        beyond
        if beyond < low + 0.5 * (high - low) or high - guess > 3.0 * unsure
        else guess - unsure
    )
    return share if low < share < high else middle if low < middle < high else None


def _extrapolated(places: list[KnownPlace], high: float) -> tuple[float, float]:
    """The zero of a function that is nearly a power of the distance from it, extrapolated from
    places before, and the uncertainty."""
    last = places[-1].share
    if len(places) < 3 or (zero := _zero_of_power(places[-3:], high)) is None:
        guess = _inverse(
            [place.share for place in places[-2:]], [place.value for place in places[-2:]]
        )
        return guess, SETTINGS.unsure * abs(guess - last)
    before = _zero_of_power(places[-4:-1], high) if len(places) > 3 else None
    return zero, SETTINGS.unsure * (zero - last) if before is None else min(
        abs(zero - before), SETTINGS.unsure * (zero - last)
    )


def _zero_of_power(places: list[KnownPlace], high: float) -> float | None:
    """The zero before `high` of a power of the distance from it, through three places; None if
    there is no such power.
    """
    shares = [place.share for place in places]
    values = [abs(place.value) for place in places]
    if not values[0] > values[1] > values[2] > 0.0:
        return None
    steeper = math.log(values[0] / values[1]) / math.log(values[1] / values[2])
    low = shares[-1]
    top = high
    # the exponents between the first two and the last two places are equal at the zero
    for _ in range(SETTINGS.halvings):
        zero = 0.5 * (low + top)
        first, second, third = (math.log(max(zero - share, 1e-300)) for share in shares)
        low, top = (low, zero) if first - second > steeper * (second - third) else (zero, top)
    return zero


def _inverse(shares: list[float], values: list[float]) -> float:
    """The share at the value 0, by the polynomial of the shares as a function of the values; nan if
    two values are equal.
    """
    shares = list(shares)
    for order in range(1, len(shares)):
        for i in range(len(shares) - order):
            apart = values[i + order] - values[i]
            if apart == 0.0:
                return np.nan
            shares[i] = (values[i + order] * shares[i] - values[i] * shares[i + 1]) / apart
    return shares[0]


def _solved(known: list[KnownPlace], share: float) -> Any:
    """The point at a share of the chord, near the cubic through its neighbours; None where it
    cannot be solved for.
    """
    i = next(i for i, place in enumerate(known[1:]) if place.share > share)
    low = known[i]
    high = known[i + 1]
    first = known[0].point
    last = known[-1].point
    curve = first.curve
    chord = last.place - first.place
    direction = chord / curve.norm(chord)
    guess = between(low.point, high.point, (share - low.share) / (high.share - low.share))
    guess = guess + (
        share * chord - ((guess - first.place) @ (curve.weights**2 * direction)) * direction
    )
    point = curve.solve_beside(guess, direction, low.point)
    units = curve.units_at(guess).unknowns
    rounding = curve.norm(NEWTON.converged * np.maximum(units, np.abs(guess)))
    near = max(SETTINGS.near * curve.norm(high.point.place - low.point.place), rounding)
    return point if point is not None and curve.norm(point.place - guess) <= near else None


def _interpolated(test: TestFunction, known: list[KnownPlace]) -> Callable[[float], Any]:
    """A function that gives the points between two others by the polynomial through points away
    from the zero, with their tangents; two such points are added to those known.

    Near a crossing of two curves Newton's method may converge to either of them, so that points
    cannot be solved for there.
    """
    from scipy.interpolate import KroghInterpolator

    first = known[0].point
    last = known[-1].point
    curve = first.curve
    chord = last.place - first.place
    zero = known[0].value / (known[0].value - known[-1].value)
    for share in (SETTINGS.apart * zero, 1.0 - SETTINGS.apart * (1.0 - zero)):
        point = _solved(known, share)
        if point is not None:
            known.append(KnownPlace(share, point, test.value(point)))
            known.sort(key=lambda place: place.share)
    along = curve.weights**2 * chord / curve.norm(chord) ** 2
    shares = np.repeat([place.share for place in known], 2)
    rows = [
        row
        for place in known
        for row in (place.point.place, place.point.tangent / (place.point.tangent @ along))
    ]
    polynomial = KroghInterpolator(shares, np.array(rows))
    return lambda share: curve.beside_singular(polynomial(share), polynomial.derivative(share))


def _brackets(point: Any, before: float, known: list[KnownPlace]) -> tuple[float, ...]:
    """The width, in each parameter, of the interval at whose ends the test function is known to
    have different signs; a place at which it is exactly 0, as rounding may have it, is both ends.
    """
    sides: dict[bool, list[np.ndarray]] = {True: [], False: []}
    for place in known:
        apart = np.abs(place.point.parameters - point.parameters)
        for is_before in (True, False):
            if place.value == 0.0 or is_before == ((place.value > 0) == (before > 0)):
                sides[is_before].append(apart)
    widths = np.max([np.min(side, axis=0) for side in sides.values() if side], axis=0)
    return tuple(map(float, widths))


def _way_left(far: KnownPlace, near: KnownPlace) -> np.ndarray:
    """How far, in each parameter, the zero is from the nearer of two places on one side of it, if
    the function is linear.
    """
    fall = abs(far.value - near.value)
    way: np.ndarray = np.abs(near.point.parameters - far.point.parameters)
    return way * (abs(near.value) / fall) if fall > 0.0 else 0.0 * way


@dataclass(frozen=True)
class Cut:
    """A point at which a step is cut short because the equations change there, and the special
    point there, if it is one.
    """

    point: Any
    special: Zero | None


class Events:
    """The hooks of the loop for a problem.

    Subclasses replace some methods; with those given here a curve has no events.
    """

    name = "curve"  # what the curve is called in the sentences of its ends
    keeps_special = False  # whether special points are points of the curve as well

    def accepts(self, point: Any, ahead: Any) -> bool:
        """Whether a step has stayed on its curve."""
        return True

    def barrier(self, point: Any) -> TestFunction | None:
        """A function that is negative where the equations of a point do not hold; its zeros are
        special points too.
        """
        return None

    def cut(self, point: Any, ahead: Any) -> Cut | End | None:
        """The cut of a step beyond which its equations do not hold, by default at the zero of the
        barrier; None without one.
        """
        barrier = self.barrier(point)
        if barrier is None or barrier.value(ahead) >= 0.0:
            return None
        zero = located(barrier, point, ahead)
        return (
            End(CurveEnd.NOT_LOCATED, ahead.parameter, barrier.kind)
            if zero is None
            else Cut(zero.point, zero)
        )

    def unlocated(self, run: Continuation, point: Any, ahead: Any, end: End) -> Cut | End:
        """What a step comes to whose cut could not be located: the given end, or a cut at `point`,
        with which the step begins.
        """
        return end

    def interrupted(self, run: Continuation, point: Any, ahead: Any) -> End | None:
        """The end of the curve if it ends within a step, which is then not taken; else None."""
        return None

    def tests(self, point: Any) -> Iterable[TestFunction]:
        """The test functions for the step that begins at a point."""
        return ()

    def jumps_over(self, kind: str, point: Any, ahead: Any, zero: Zero | None) -> bool:
        """Whether the test function of a kind of special point, whose sign differs at two points,
        jumps over 0 between them, or is rounding there: then there is no special point. `zero` is
        where its sign changes, if that was located.
        """
        return False

    def outside(self, point: Any) -> int | None:
        """A count that changes at special points only, as of multipliers outside the unit circle;
        None where it has none.
        """
        return None

    def distinct(self, found: list[Zero]) -> list[Zero]:
        """The special points of a step, each once, as one point may be the zero of two test
        functions.
        """
        return found

    def ended(self, run: Continuation, ahead: Any, cut: Cut | None) -> End | None:
        """The end of the curve if it ends at a point that was just reached; else None."""
        return None

    def last(self, special: Zero) -> End | None:
        """The end of the curve if it ends at a special point that was just located; else None."""
        return None

    def across(self, run: Continuation, cut: Cut) -> Any:
        """The point with which the curve goes on beyond a cut, or an end; None if it goes on with
        the same equations.
        """
        return None

    def first_step(self, points: Sequence[Any]) -> float:
        """The longest first step after a change of equations; the last of the points is the first
        that solves the new ones.
        """
        return math.inf

    def stalled(self, run: Continuation, point: Any, step: float) -> Cut | End:
        """The end of the curve at a point from which even the shortest step fails, or the cut
        beyond which it goes on.
        """
        return End(CurveEnd.NO_STEP, point.parameter, detail=self.name)

    def nearest(self, point: Any, place: np.ndarray, other: Any) -> np.ndarray | None:
        """A place that solves the equations of `point`, in the unknowns that are nearest to those
        of `other`; None if the two cannot be compared."""
        return place

    def closing(self, first: Any, ahead: Any) -> Any:
        """The first point of a curve that closes, in the equations that the curve has when it
        returns, if that is possible.
        """
        return first
