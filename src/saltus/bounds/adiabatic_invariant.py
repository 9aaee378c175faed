"""A proof that small impacts decay under a varying load: a corrected adiabatic invariant falls
along every motion.

On one side the gap w obeys w'' = A(t, w, u), u = w'. The pull is alpha(t) = -A(t, 0, 0) > 0 and the
contact damping c(t) = -A_u(t, 0, 0). Let E = u^2/2 + alpha w, v = sqrt(2 E), x = u / v in [-1, 1].
A flight runs from x = 1 to x = -1, and an impact without loss puts x back to 1 on the next side.
Exactly, with q = alpha'/(2 alpha), b = -(q + c) and r = v^2 S the part of A beyond -alpha - c u,

    v'/v = q + b x^2 + v x S,        x' = -alpha/v + (1 - x^2) (b x + v S).

Let G = sum 1/alpha over the sides of a cycle, kappa = sum (c/alpha) / G, and

    L = 3 ln v + ln G + v h1(t, x) + v^2 h2(t, x),    alpha h1_x = 3 (q + b x^2) + G'/G + kappa,
    alpha h2_x = P1,

where P1 is the term of order v that h1 leaves in dL/dt. With h1 = (a x + b x^3)/alpha, a = 3 q +
G'/G + kappa, it is P1 = (e1 x + e3 x^3 + e5 x^5)/alpha, odd in x. So h2 = 0 at both ends of a
flight, and the h1 of both sides agree there. L is therefore continuous at an impact without loss.
At an impact with the factor f < 1 it changes by 3 ln f + v h1 (f - 1), and in flight

    dL/dt <= -kappa(t) + v^2 M(t),

where M bounds the terms that h2 leaves, with the exact S: interval bounds over cells of the time
and all x, w <= v^2 / (2 alpha). ln J = 3 ln v + ln G is the adiabatic invariant, and exp(-kappa t)
its decay (see `flow/one_contact/impacts.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from saltus.bounds.intervals import ROUNDING, SLACK, Interval

ODD_1 = 0.385  # above the largest x (1 - x^2), 2 / sqrt(27)
ODD_2 = 0.2863  # above the largest x (1 - x^2)^2, 16 / (25 sqrt(5))
LEAST_GROWTH = 1e-12  # least growth in a first guess, which divides by it
TRIALS = 0.8 ** np.arange(9)  # shares of the largest speed, tried in turn until the bounds hold


@dataclass
class Side:
    """Bounds on one side in cells of the time, arrays (cells, n): the pull with three derivatives,
    the contact damping with two, A_w and A_uu at contact with one.
    """

    pull: list[Interval]
    damping: list[Interval]
    slope: list[Interval]
    bend: list[Interval]


@dataclass
class Box:
    """Bounds for all u in [-v, v]: A_w and A_ww for all w in [0, v^2 / (2 alpha)], A_uu, A_wu and
    A_uuu at w = 0.
    """

    w: Interval
    ww: Interval
    uu: Interval
    wu: Interval
    uuu: Interval


@dataclass
class Form:
    """The normal form on one side, in cells of the time: bounds of the quantities that depend on
    the time alone.
    """

    pull: Any  # alpha, from below
    weight: Interval  # 1 / alpha
    decay: Any  # kappa, from below
    here: Box  # at the contact
    h: list[Interval]  # alpha, and alpha (h1 x + h1_x (1 - x^2)) as a polynomial in x^2
    even: list[Interval]  # alpha^2 M for S = 0, a polynomial in x^2
    steepness: Any  # alpha^2 abs(2 h2 x + h2_x (1 - x^2))
    first: Any  # abs(h1)
    second: Any  # abs(h2)
    jump: Any  # abs(h1) at the ends of a flight
    turn: Any  # abs(b x (1 - x^2))


def normal_form(side: Side, other: Side | None) -> Form:
    """h1 and h2 on a side, with their rates of change; `other` is the next side of the cycle, or
    None if it is the same side.
    """
    q, q1, q2 = _logarithmic(side.pull)
    c, c1, c2 = side.damping
    b = -(q + c)
    b1 = -(q1 + c1)
    b2 = -(q2 + c2)
    zero = Interval(0.0)
    y, y1, y2, kappa = (
        (zero, zero, zero, c) if other is None else _coupling(side, other, (q, q1, q2))
    )
    alpha, alpha1 = side.pull[:2]
    w = 1.5 * side.slope[0]
    w1 = 1.5 * side.slope[1]
    uu = 1.5 * (alpha * side.bend[0])
    uu1 = 1.5 * (alpha1 * side.bend[0] + alpha * side.bend[1])
    a = y - b
    a1 = y1 - b1
    a2 = y2 - b2
    bq = b - q
    square = b.square()
    twice = b * b1
    e1 = a * bq + a1 + w
    e1_rate = a1 * bq + a * (b1 - q1) + a2 + w1
    e3 = 3.0 * square - b * q + b1 - w + uu
    e3_rate = 6.0 * twice - b1 * q - b * q1 + b2 - w1 + uu1
    f = _vanishing(0.5 * e1, 0.25 * e3, square * (-1 / 3))
    f_rate = _vanishing(0.5 * e1_rate, 0.25 * e3_rate, twice * (-2 / 3))
    _, f2, f4, f6 = f
    return Form(
        pull=alpha.lo,
        weight=alpha.inverse(),
        decay=kappa.lo - SLACK * np.abs(kappa.lo) + 0.0 * alpha.lo,
        here=Box(side.slope[0], zero, side.bend[0], zero, zero),
        h=[alpha, a, 3.0 * b, -2.0 * b],
        even=_without_excess(q, b, f, f_rate),
        steepness=_most_of([-2.0 * (f4 + f6), 4.0 * f4, 6.0 * f6 - 2.0 * f4, -4.0 * f6]),
        first=(y.magnitude() + ODD_1 * b.magnitude()) / alpha.lo,
        second=_most_of([f2 + f4 + f6, f4 + f6, f6]) / alpha.lo**2,
        jump=y.magnitude() / alpha.lo,
        turn=ODD_1 * b.magnitude(),
    )


def _logarithmic(pull: list[Interval]) -> tuple[Interval, Interval, Interval]:
    """q = alpha' / (2 alpha) and its first two derivatives."""
    half = 0.5 * pull[0].inverse()
    q, second, third = (half * d for d in pull[1:])
    q1 = second - 2.0 * q.square()
    return q, q1, third - 2.0 * (q * second) - 4.0 * (q * q1)


def _coupling(
    side: Side, other: Side, q: tuple[Interval, ...]
) -> tuple[Interval, Interval, Interval, Interval]:
    """The effect of the other side of the cycle on this one: y = alpha h1 at x = 1, its first two
    derivatives, and kappa.

    With the weights p = (1/alpha) / G of the sides, y = p_other z, z = 2 (q - q_other) + c_other -
    c.
    """
    d, d1, d2 = (mine - its for mine, its in zip(q, _logarithmic(other.pull), strict=True))
    c, c1, c2 = (its - mine for mine, its in zip(side.damping, other.damping, strict=True))
    z = 2.0 * d + c
    z1 = 2.0 * d1 + c1
    z2 = 2.0 * d2 + c2
    p = (1.0 + other.pull[0] / side.pull[0]).inverse()
    mine = (1.0 + side.pull[0] / other.pull[0]).inverse()
    both = p * mine
    p1 = 2.0 * (both * d)
    p2 = 2.0 * (both * (2.0 * (d.square() * (mine - p)) + d1))
    return p * z, p1 * z + p * z1, p2 * z + 2.0 * (p1 * z1) + p * z2, side.damping[0] + p * c


def _vanishing(f2: Interval, f4: Interval, f6: Interval) -> list[Interval]:
    """The coefficients of an even polynomial that is 0 at x = 1."""
    return [-(f2 + f4 + f6), f2, f4, f6]


def _without_excess(
    q: Interval, b: Interval, f: list[Interval], f_rate: list[Interval]
) -> list[Interval]:
    """alpha^2 (2 h2 (q + b x^2) + h2_t + h2_x b x (1 - x^2)), the coefficients of a polynomial in
    x^2.
    """
    even = [*f_rate, Interval(0.0)]
    for j in range(4):
        bf = b * f[j]
        even[j] = even[j] - 2.0 * (q * f[j]) + (2.0 * j) * bf
        even[j + 1] = even[j + 1] + (2.0 - 2.0 * j) * bf
    return even


def _growth(form: Form, box: Box, v: Any) -> Any:
    """M(t): an upper bound of the terms that h2 leaves in dL/dt, over v^2, for all speeds up to v
    and all x, in every cell.
    """
    alpha, *h = form.h
    s = 0.5 * box.w, 0.5 * (alpha * box.uu - box.w)  # alpha S, in x^2
    # alpha^2 3 x (S - S at contact) / v, its even part
    wu = 1.5 * (alpha * box.wu)
    uuu = 0.5 * (alpha.square() * box.uuu)
    products = [
        h[0] * s[0],
        h[1] * s[0] + h[0] * s[1] + wu,
        h[2] * s[0] + h[1] * s[1] + uuu - wu,
        h[2] * s[1],
    ]
    even = [x + y for x, y in zip(form.even, [*products, Interval(0.0)], strict=True)]
    odd = (0.375 * ODD_2) * box.ww.magnitude() + form.steepness * _excess(form, box)
    return (_highest([x.hi for x in even]) + v * odd) / form.pull**2


def _excess(form: Form, box: Box) -> Any:
    """A bound of abs(S) = abs(A_w (1 - x^2) / (2 alpha) + A_uu x^2 / 2) in every cell."""
    return np.maximum(0.5 * box.w.magnitude() / form.pull, 0.5 * box.uu.magnitude())


def _most_of(c: list[Interval]) -> Any:
    """A bound of abs(sum c_j y^j) over y in [0, 1]."""
    return np.maximum(_highest([x.hi for x in c]), _highest([-x.lo for x in c]))


def _highest(c: list[Any]) -> Any:
    """An upper bound of sum c_j y^j over y in [0, 1]: the largest Bernstein coefficient, and more
    than its rounding.
    """
    n = len(c) - 1
    size = reduce(np.add, [np.abs(x) for x in c])
    sums = [
        reduce(np.add, [(math.comb(i, j) / math.comb(n, j)) * c[j] for j in range(i + 1)])
        for i in range(n + 1)
    ]
    return reduce(np.maximum, sums) + 16 * ROUNDING * size


def first_guess(forms: list[Form], loss: Any) -> Any:
    """A speed near which largest_start is likely to succeed, from the bounds at the contact; (1,
    n).
    """
    with np.errstate(all="ignore"):
        growth = [np.maximum(_growth(f, f.here, 0.0), LEAST_GROWTH) for f in forms]
        damped = reduce(np.minimum, [f.decay for f in forms]).mean(axis=0, keepdims=True)
        decay = damped / reduce(np.maximum, growth).mean(axis=0, keepdims=True)
        pull = reduce(np.minimum, [_least(f.pull) for f in forms])
        return np.fmax(
            np.sqrt(np.maximum(decay, 0.0)),
            np.cbrt(1.5 * loss * pull / reduce(np.maximum, map(_most, growth))),
        )


@dataclass
class Budget:
    """The bounds of M and abs(S) on one side for all speeds up to a largest one, arrays (cells,
    n).
    """

    form: Form
    growth: Any
    excess: Any


def budget(form: Form, box: Box, v: Any) -> Budget:
    """The bounds of one side for all speeds up to v (1, n), for which the box holds."""
    with np.errstate(all="ignore"):
        return Budget(form, _growth(form, box, v), _excess(form, box))


def largest_start(budgets: list[Budget], loss: Any, period: Any, v: Any) -> Any:
    """The largest speed after an impact from which the speed provably stays below v and falls to 0;
    0 if there is none.

    Parameters
    ----------
    budgets
        The budgets of the sides of a cycle.
    loss
        -ln of the impacts' factor, at least 0; (1, n).
    period
        The time that the cells divide evenly; (1, n).
    v
        The largest speed for which the budgets hold; (1, n).
    """
    best = np.zeros_like(v)
    with np.errstate(all="ignore"):
        for trial in TRIALS:
            best = np.fmax(best, _start(budgets, loss, period, trial * v))
        return np.fmax(_room([side.form for side in budgets]) * best * (1 - SLACK), 0.0)


def _start(budgets: list[Budget], loss: Any, period: Any, v: Any) -> Any:
    """The speed from which L stays so low that speeds remain below v, without the effect of the
    range of G; 0 where L may grow.

    Either L falls over every period, and rises within it by no more than `rise`; or it falls from
    flight to flight, by impacts.
    """
    forms = [side.form for side in budgets]
    growth = reduce(np.maximum, [v * v * side.growth - side.form.decay for side in budgets])
    swing = reduce(np.maximum, [v * _most(f.first) + v * v * _most(f.second) for f in forms])
    jump = reduce(np.maximum, [v * _most(f.jump) for f in forms])
    slowest = reduce(
        np.minimum,
        [_least(side.form.pull - v * (side.form.turn + v * side.excess)) for side in budgets],
    )
    # flight: abs(x') is at least slowest / v
    longest = np.where(slowest > 0, 2 * v / slowest, np.inf)
    in_period = period * np.maximum(growth, 0.0).mean(axis=0, keepdims=True)
    in_flight = np.where(_most(growth) <= 0, 0.0, longest * _most(growth))
    by_damping = growth.mean(axis=0, keepdims=True) < -SLACK * np.abs(growth).mean(
        axis=0, keepdims=True
    )
    by_impacts = in_flight - jump * np.expm1(-loss) < (3 - SLACK) * loss
    rise = np.minimum(
        np.where(by_damping, in_period, np.inf), np.where(by_impacts, in_flight, np.inf)
    )
    return np.where(jump < 3, v * np.exp(-(2 * swing + rise) / 3), 0.0)


def _room(forms: list[Form]) -> Any:
    """The cube root of the least G over the largest: the factor by which the speed may rise
    although ln J does not, (1, n).
    """
    low, high = (reduce(np.add, [getattr(f.weight, end) for f in forms]) for end in ("lo", "hi"))
    return np.cbrt(_least(low) / _most(high))


def _least(x: Any) -> Any:
    return np.min(x, axis=0, keepdims=True)


def _most(x: Any) -> Any:
    return np.max(x, axis=0, keepdims=True)
