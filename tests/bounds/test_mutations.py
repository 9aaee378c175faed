"""Every bound of the ball arithmetic is needed: with one made smaller, one sign turned or one
rounding left out, exact results leave their balls, or balls become wider than they may be.
"""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from exact_motions import duffing, duffing_series
from mutations import mutated, mutations_of

from saltus.bounds import Tape, ball_kernel, balls, coordinate
from saltus.bounds.ball_kernel import Op
from saltus.taylor import Expr, number

KERNEL = (
    "convolution",
    "quotient",
    "hull",
    "elementary",
    "power_ball",
    "of_order_zero",
    "of_higher_order",
    "series_of",
    "horner_ball",
    "polynomial_hull",
    "remainder_reach",
    "one_step",
)
ARRAYS = (
    "Ball.__add__",
    "Ball.__mul__",
    "Ball.__truediv__",
    "Ball.sqrt",
    "product",
    "_sparse_product",
    "solve",
)
WIDER = 1.3  # the most that a ball may exceed the least one
UNARY = {
    Op.SIN: mp.sin,
    Op.COS: mp.cos,
    Op.EXP: mp.exp,
    Op.LOG: mp.log,
    Op.SQRT: mp.sqrt,
    Op.SINH: mp.sinh,
    Op.COSH: mp.cosh,
    Op.TANH: mp.tanh,
    Op.ATAN: mp.atan,
}
# Sites whose change no exact result can show, each with the reason.
COVERED = "UP, 1e-14, covers this rounding of a radius many times"
SPARE = "a bound of rounding beside it has more than this to spare, as EPS is twice 2^-53"
GUESS = "a guess of a box: the inclusion is verified afterwards"
EQUIVALENT: dict[str, str] = {
    "hull: sign turned: abs(low) + abs(high)": SPARE,
    "elementary: sign turned: abs(slope) * rx + 0.5 * rx * rx + 4 * EPS * rx": COVERED,
    "elementary: sign turned: 1.0 + 4 * EPS": COVERED,
    "elementary: sign turned: 1.0 + 8 * EPS": COVERED,
    "elementary: sign turned: abs(value) + EPS": SPARE,
    "power_ball: sign turned: rp * UP + 2.0 * EPS * abs(p)": SPARE,
    "power_ball: sign turned: 1.0 - 2.0 * EPS": SPARE,
    "power_ball: sign turned: 1.0 + 2.0 * EPS": SPARE,
    "power_ball: sign turned: 1.0 + abs(p) + rp": SPARE,
    "of_higher_order: sign turned: rx + spread + EPS * abs(x)": SPARE,
    "of_higher_order: sign turned: rx + below_spread": SPARE,
    "of_higher_order: sign turned: abs(x) + abs(below)": SPARE,
    "of_higher_order: sign turned: 0.5 * (r[p, k] + spread) + EPS * abs(x)": SPARE,
    "of_higher_order: sign turned: abs(x) + abs(total)": SPARE,
    "of_higher_order: sign turned: spread / k + EPS * abs(x)": SPARE,
    "product: sign turned: 1.0 + (n + 4) * EPS": COVERED,
    "_sparse_product: sign turned: 1.0 + (n + 4) * EPS": COVERED,
    "solve: sign turned: 1.0 + size * EPS": COVERED,
    "solve: no rounding: matrix: Ball, right: Ball": SPARE,
    "remainder_reach: sign turned: 1.0 + (n + 2.0) * EPS": COVERED,
    "polynomial_hull: sign turned: abs(middle) + spread": SPARE,
    "polynomial_hull: sign turned: spread + (n + 2.0) * EPS * (abs(middle) + spread)": SPARE,
    "polynomial_hull: sign turned: 0.5 * abs(ym[k]) + yr[k] + 2.0 * n * EPS * abs(ym[k])": SPARE,
    "horner_ball: sign turned: abs(value) * hr + spread * (abs(hm) + hr) + EPS * abs(scaled)": (
        SPARE
    ),
    "series_of: sign turned: (r[root, k] / factor + EPS * abs(ym[c, k + 2])) * UP + TINY": SPARE,
    "one_step: sign turned: tr + 0.5 * h + EPS * abs(middle_time)": SPARE,
    "one_step: sign turned: 1.5 * reach + 1e-10 * abs(bm[c, d])": GUESS,
    "one_step: sign turned: abs(bm[c, d]) + nr[c, d]": GUESS,
    "one_step: sign turned: INFLATED * nr[c, d] + 1e-10 * (abs(bm[c, d]) + nr[c, d]) + TINY": GUESS,
    "one_step: sign turned: INFLATED * nr[c, d] + 1e-10 * (abs(bm[c, d]) + nr[c, d])": GUESS,
    "one_step: no rounding: nodes, numbers, constant, roots, n, middles, radii, tm, tr, hm, hr, cm, cr, work": (
        SPARE
    ),
    "series_of: no rounding: nodes, numbers, constant, roots, order, middles, radii, tm, tr, m, r, ym, yr, accelerate": (
        SPARE
    ),
    "series_of: sign turned: (k + 1.0) * yr[p, k + 1] + EPS * abs(x)": SPARE,
    "series_of: sign turned: r[root, k] / factor + EPS * abs(ym[c, k + 2])": SPARE,
}


def contains(pair: Any, exact: Any) -> bool:
    middle, radius = map(float, pair)
    if not radius < np.inf:
        return False
    return bool(abs(mp.mpf(middle) - exact) <= mp.mpf(radius))


# --- what a correct kernel does ----------------------------------------------


def kernel_holds(kernel: SimpleNamespace) -> bool:
    with np.errstate(all="ignore"):
        return (
            functions_hold(kernel)
            and small_numbers_hold(kernel)
            and arithmetic_holds(kernel)
            and recurrences_hold(kernel)
            and series_hold(kernel)
            and polynomials_hold(kernel)
            and steps_hold(kernel)
        )


def functions_hold(kernel: SimpleNamespace) -> bool:
    """Each function of a ball, at its ends; without radius within a few units of the last place."""
    for op, function in UNARY.items():
        for x in (0.0, 0.3, 1.1, 2.0, -0.7):
            for rx in (0.0, 1e-12, 1e-3, 0.05):
                if op in (Op.LOG, Op.SQRT) and x <= rx:
                    continue
                pair = kernel.elementary(op, x, rx)
                ends = [function(mp.mpf(x) + k * mp.mpf(rx)) for k in (-1, 0, 1)]
                if not all(contains(pair, end) for end in ends):
                    return False
                reach = max(abs(end - ends[1]) for end in ends)
                steepest = 1.0 if op in (Op.SIN, Op.COS, Op.TANH, Op.ATAN) else 0.0
                if op in (Op.SINH, Op.COSH):
                    steepest = float(np.cosh(abs(x) + rx))
                most = WIDER * float(max(reach, steepest * rx)) + 4e-15 * float(abs(ends[1]) + 1)
                if not pair[1] <= most:
                    return False
    if not contains(kernel.elementary(Op.EXP, -800.0, 0.0), mp.exp(-800)):
        return False
    for x, rx, p, rp in (
        (2.0, 0.1, 1.7, 0.0),
        (0.5, 1e-9, 1.7, 1e-9),
        (3.0, 0.0, -0.5, 0.1),
        (1.3, 0.0, 30.1, 0.0),
        (1.7, 0.0, 2.5, 0.0),
    ):
        pair = kernel.power_ball(x, rx, p, rp)
        corners = [
            (mp.mpf(x) + i * mp.mpf(rx)) ** (mp.mpf(p) + j * mp.mpf(rp))
            for i in (-1, 1)
            for j in (-1, 1)
        ]
        if not all(contains(pair, corner) for corner in corners):
            return False
        spread = float(max(corners) - min(corners))
        if not pair[1] <= WIDER * 0.5 * spread + 1e-13 * max(1.0, float(corners[0])):
            return False
    return True


RNG = np.random.default_rng(4)
OPERANDS = [
    (float(m), float(r), float(n), float(s))
    for m, r, n, s in zip(
        RNG.normal(size=24) * 3.0,
        10.0 ** RNG.integers(-18, -1, 24),
        RNG.normal(size=24) + np.where(RNG.random(24) < 0.5, 2.0, -2.0),
        10.0 ** RNG.integers(-18, -1, 24),
        strict=True,
    )
    if abs(n) > 0.5
]
OPERANDS += [(m, 0.0, n, 0.0) for m, _, n, _ in OPERANDS]


def inexact(exact: Fraction) -> bool:
    return Fraction(float(exact)) != exact


def in_ball(pair: Any, exact: Fraction) -> bool:
    middle, radius = map(float, pair)
    if not radius < np.inf:
        return False
    return abs(Fraction(middle) - exact) <= Fraction(radius)


def corners_of(m: float, r: float, n: float, s: float) -> list[tuple[Fraction, Fraction]]:
    return [
        (Fraction(m) + i * Fraction(r), Fraction(n) + j * Fraction(s))
        for i in (-1, 1)
        for j in (-1, 1)
    ]


def small_numbers_hold(kernel: SimpleNamespace) -> bool:
    """What underflows to 0 lies in its ball."""
    rows = np.array([[1e-200], [1e-180]])
    none = np.zeros((2, 1))
    exact = Fraction(1e-200) * Fraction(1e-180)
    pairs = [
        (kernel.of_order_zero(Op.MUL, rows, none, 0, 1, -1), exact),
        (kernel.of_order_zero(Op.MUL, rows, none, 0, 0, -1), Fraction(1e-200) ** 2),
        (kernel.quotient(1e-200, 0.0, 1e200, 0.0), Fraction(1e-200) / Fraction(1e200)),
        (
            kernel.horner_ball(rows[:, 0] * 0.0 + [0.0, 1e-200], none[:, 0], 0, 0, 1e-180, 0.0),
            exact,
        ),
    ]
    return all(in_ball(pair, value) for pair, value in pairs)


def worst_corner(function: Any, middles: np.ndarray, radii: np.ndarray) -> list[Fraction]:
    """The value of a rational function at the middles, and near its extremes over the box."""
    centre = [Fraction(float(m)) for m in middles]
    spread = [Fraction(float(r)) for r in radii]
    here = function(centre)
    signs = []
    for i, r in enumerate(spread):
        moved = list(centre)
        moved[i] += r
        signs.append(1 if function(moved) >= here else -1)
    ends = [
        function([m + way * sign * r for m, sign, r in zip(centre, signs, spread, strict=True)])
        for way in (-1, 1)
    ]
    return [here, *ends]


def recurrences(k: int) -> dict[Op, Any]:
    """The coefficient of order k of each operation from rows u, w (or the partner), and y below k,
    in rational numbers."""

    def split(x: list[Fraction]) -> tuple[list[Fraction], list[Fraction], list[Fraction]]:
        return x[: k + 1], x[k + 1 : 2 * k + 2], x[2 * k + 2 :]

    def weighted(a: list[Fraction], b: list[Fraction], low: int, high: int) -> Fraction:
        return sum((j * a[j] * b[k - j] for j in range(low, high + 1)), Fraction(0))

    def plain(a: list[Fraction], b: list[Fraction], low: int, high: int) -> Fraction:
        return sum((a[j] * b[k - j] for j in range(low, high + 1)), Fraction(0))

    def on(work: Any) -> Any:
        return lambda x: work(*split(x))

    return {
        Op.ADD: on(lambda u, w, y: u[k] + w[k]),
        Op.SUB: on(lambda u, w, y: u[k] - w[k]),
        Op.MUL: on(lambda u, w, y: plain(u, w, 0, k)),
        Op.DIV: on(lambda u, w, y: (u[k] - plain(w, y, 1, k)) / w[0]),
        Op.POW: on(
            lambda u, w, y: (w[0] * weighted(u, y, 1, k) - weighted(y, u, 1, k - 1)) / (k * u[0])
        ),
        Op.SQRT: on(lambda u, w, y: (u[k] - plain(y, y, 1, k - 1)) / (2 * y[0])),
        Op.LOG: on(lambda u, w, y: (u[k] - weighted(y, u, 1, k - 1) / k) / u[0]),
        Op.SIN: on(lambda u, w, y: weighted(u, w, 1, k) / k),
        Op.COS: on(lambda u, w, y: -weighted(u, w, 1, k) / k),
        Op.EXP: on(lambda u, w, y: weighted(u, y, 1, k) / k),
    }


RECURRENCES = [
    (op, k, rows, spread, worst_corner(function, rows.ravel(), np.full(rows.size, spread)))
    for k in (1, 4)
    for op, function in recurrences(k).items()
    for spread in (0.0, 0.0, 0.0, 0.0, 1e-5)
    for rows in [RNG.normal(size=(3, k + 1)) + np.where(np.arange(k + 1) == 0, 3.0, 0.0)]
]


def recurrences_hold(kernel: SimpleNamespace) -> bool:
    """Each coefficient from given ones, at the corner at which it is largest."""
    for op, k, rows, spread, exact in RECURRENCES:
        radii = np.full(rows.shape, spread)
        pair = kernel.of_higher_order(op, rows, radii, 2, 0, 1, -1, k, np.zeros(3, dtype=bool))
        if not all(in_ball(pair, value) for value in exact):
            return False
        reach = max(abs(float(value - exact[0])) for value in exact)
        most = 2.0 if op == Op.POW else WIDER
        if not pair[1] <= most * reach + 1e-13:
            return False
    for low, high in RNG.normal(size=(60, 2)) + 1.0:
        low, high = min(low, high), max(low, high)
        pair = kernel.hull(low, high)
        if not (in_ball(pair, Fraction(low)) and in_ball(pair, Fraction(high))):
            return False
        if not pair[1] <= WIDER * 0.5 * (high - low) + 1e-15 * (abs(low) + abs(high)):
            return False
    return True


def arithmetic_holds(kernel: SimpleNamespace) -> bool:
    operations = {
        Op.ADD: lambda x, y: x + y,
        Op.SUB: lambda x, y: x - y,
        Op.MUL: lambda x, y: x * y,
        Op.DIV: lambda x, y: x / y,
        Op.MAXIMUM: max,
        Op.MINIMUM: min,
    }
    for m, r, n, s in OPERANDS:
        middles = np.array([[m], [n]])
        radii = np.array([[r], [s]])
        for op, operation in operations.items():
            pair = kernel.of_order_zero(op, middles, radii, 0, 1, -1)
            exact = [operation(x, y) for x, y in corners_of(m, r, n, s)]
            if not all(in_ball(pair, value) for value in exact):
                return False
            least = 0.5 * float(max(exact) - min(exact)) + 8e-16 * (abs(m) + abs(n) + abs(pair[0]))
            if not pair[1] <= WIDER * least + 1e-280:
                return False
        pair = kernel.of_order_zero(Op.MUL, middles, radii, 0, 0, -1)
        squares = [x * x for x, _ in corners_of(m, r, n, s)]
        if not all(in_ball(pair, value) for value in squares):
            return False
        pair = kernel.quotient(m, r, n, s)
        if not all(in_ball(pair, x / y) for x, y in corners_of(m, r, n, s)):
            return False
    for size in (1, 3):
        rows = RNG.normal(size=(2, 12)) ** 3
        spreads = np.full((2, 12), 1e-3 if size == 1 else 0.0)
        pair = kernel.convolution(rows, spreads, 0, 1, 11, 0, 11, size == 3)
        worst = sum(
            (j if size == 3 else 1)
            * (Fraction(rows[0, j]) + np.sign(rows[1, 11 - j]) * Fraction(spreads[0, j]))
            * (Fraction(rows[1, 11 - j]) + np.sign(rows[0, j]) * Fraction(spreads[1, 11 - j]))
            for j in range(12)
        )
        if not in_ball(pair, Fraction(worst)):
            return False
    return True


Y = coordinate(0)
INNER = number(0.5) + Y * Y
ROOTS = [Expr(op.name.lower(), (INNER,)) for op in UNARY]
ROOTS += [
    Expr("pow", (INNER, Expr("parameter", (), 0))),
    Y / INNER,
    INNER * (Y - number(2.0)),
    number(1.0) / INNER,
    Y * Y,
]
EXPONENT = 1.7
ORDER = 6
BEGIN = (0.3, 0.7)
TAPES = [Tape([root]) for root in ROOTS]


def value_of(root: Expr, y: mp.mpf) -> Any:
    """An expression with mpmath's numbers."""
    if root.op == "number":
        return mp.mpf(root.value)
    if root.op == "parameter":
        return mp.mpf(EXPONENT)
    if root.op == "coordinate":
        return y
    below = [value_of(operand, y) for operand in root.args]
    if len(below) == 1:
        return getattr(mp, root.op)(below[0])
    a, b = below
    return {
        "add": lambda: a + b,
        "sub": lambda: a - b,
        "mul": lambda: a * b,
        "div": lambda: a / b,
        "pow": lambda: a**b,
    }[root.op]()


def exact_series(root: Expr, begin: tuple[mp.mpf, mp.mpf]) -> list[mp.mpf]:
    """Taylor coefficients of y'' = f(y), order by order."""
    found = list(begin)
    for k in range(ORDER - 1):
        known_so_far = list(found)

        def along(t: mp.mpf, known: list[mp.mpf] = known_so_far) -> mp.mpf:
            return value_of(root, mp.polyval(known[::-1], t))

        coefficient = mp.taylor(along, 0, k)[k] if k else along(mp.mpf(0))
        found.append(coefficient / ((k + 1) * (k + 2)))
    return found


WIDTHS = (0.0, 1e-7)
with mp.workdps(40):
    SERIES = [
        [
            (
                width,
                [
                    exact_series(root, (mp.mpf(BEGIN[0]) + i * width, mp.mpf(BEGIN[1]) + j * width))
                    for i, j in ((0, 0), (-1, -1), (1, 1), (1, -1), (-1, 1))[
                        : 1 if not width else 5
                    ]
                ],
            )
            for width in WIDTHS
        ]
        for root in ROOTS
    ]


def series_hold(kernel: SimpleNamespace) -> bool:
    parameters = np.array([EXPONENT])
    for tape, cases in zip(TAPES, SERIES, strict=True):
        for width, exact in cases:
            middle, radius = kernel.ball_series(
                *tape.arrays,
                ORDER,
                parameters,
                np.zeros(1),
                0.0,
                0.0,
                np.array([BEGIN]),
                np.full((1, 2), width),
            )
            for k in range(ORDER + 1):
                pair = (middle[0, k], radius[0, k])
                if not all(contains(pair, found[k]) for found in exact):
                    return False
                if not radius[0, k] <= 60.0 * width + 1e-12:
                    return False
    return True


COEFFICIENTS = np.array([0.3, -1.7, 2.9, -0.4, 1.3, 0.6, -2.1])


def polynomials_hold(kernel: SimpleNamespace) -> bool:
    """Polynomials of balls: values, rates and hulls over an interval, at corners."""
    for spread, reach in ((0.0, 0.0), (1e-3, 1e-3), (1e-3, 0.0), (0.0, 1e-2)):
        radii = np.full(7, spread)
        for h in (0.7, 1.3):
            for first, derivative in ((0, 0), (1, 1), (2, 2), (2, 0)):
                pair = kernel.horner_ball(COEFFICIENTS, radii, first, derivative, h, reach)
                for i in (-1, 1):
                    for j in (-1, 1):
                        if not in_ball(
                            pair, polynomial(i * spread, h, j * reach, first, derivative)
                        ):
                            return False
                slope = abs(float(polynomial(0.0, h, 1e-6, first, derivative)) - pair[0]) * 1e6
                most = 40.0 * (spread + reach) * (1.0 + h) ** 5 + slope * reach + 1e-12
                if not pair[1] <= most:
                    return False
        for d in (0, 1):
            middle, radius = kernel.polynomial_hull(np.abs(COEFFICIENTS), radii, 6, 0.5, d)
            ends = [
                sum(
                    (k if d else 1)
                    * (Fraction(abs(c)) + (Fraction(spread) if share else -Fraction(spread)))
                    * Fraction(share) ** (k - d)
                    for k, c in enumerate(COEFFICIENTS)
                    if k >= d
                )
                for share in (0.0, 0.5)
            ]
            if not all(in_ball((middle, radius), Fraction(end)) for end in ends):
                return False
            if not radius <= WIDER * 0.5 * float(ends[1] - ends[0]) + 3.0 * spread + 1e-13:
                return False
            tail = kernel.remainder_reach(-2.0, spread, 6, 0.5, d)
            exact = (Fraction(2) + Fraction(spread)) * Fraction(1, 2) ** (7 - d) * (7 if d else 1)
            if not Fraction(tail) >= exact or not tail <= 1.01 * float(exact):
                return False
    return True


def polynomial(shift: float, h: float, dh: float, first: int, derivative: int) -> Fraction:
    """The exact value with all coefficients and the argument shifted."""
    place = Fraction(h) + Fraction(dh)
    total = Fraction(0)
    for k in range(first, 7):
        factor = Fraction(1)
        for d in range(derivative):
            factor *= k - d
        total += factor * (Fraction(COEFFICIENTS[k]) + Fraction(shift)) * place ** (k - first)
    return total


T = Expr("time")
DUFFING = Tape([number(0.0) - Y - Y * Y * Y + T * T])  # y'' = t^2 - y - y^3
OF_TIME = Tape([T * T * T * T])
GROWS = Tape([Y])
BLOWS_UP = Tape([Y * Y * Y])
BEGINS = 0.25
LENGTH = 0.5
STARTS = [(0, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)]


with mp.workdps(40):
    ENDS = {
        (width, order): [
            duffing(
                mp.mpf(BEGINS) + m * mp.mpf(width),
                mp.mpf(0.9) + i * mp.mpf(width),
                mp.mpf(0.4) + j * mp.mpf(width),
                mp.mpf(LENGTH) + k * mp.mpf(width),
            )
            for i, j in STARTS
            for k, m in ((-1, 1), (1, 1), (-1, -1), (1, -1))
        ]
        for width in (0.0, 1e-6)
        for order in (4, 14)
    }
    # y^(n+1) / (n+1)! along the solution, that of Lagrange's remainder, for a step of order 4.
    WIDE = 0.02
    SHORT = 0.4
    REMAINDERS = []
    for way in (-1, 1):
        begin = (mp.mpf(BEGINS) + way * WIDE, mp.mpf(0.9) + way * WIDE, mp.mpf(0.4) + way * WIDE)
        for share in range(5):
            moment = (mp.mpf(SHORT) + WIDE) * share / 4
            state = duffing(*begin, moment) if share else begin[1:]
            REMAINDERS.append(duffing_series(begin[0] + moment, *state, 5)[5])


def steps_hold(kernel: SimpleNamespace) -> bool:
    for (width, order), ends in ENDS.items():
        one = np.ones(1)
        proved, _, _, middle, radius = kernel.ball_steps(
            *DUFFING.arrays,
            order,
            np.zeros((1, 0)),
            np.zeros((1, 0)),
            BEGINS * one,
            width * one,
            LENGTH * one,
            width * one,
            np.array([[[0.9, 0.4]]]),
            np.full((1, 1, 2), width),
        )
        if not proved[0]:
            return False
        for d in range(2):
            pair = (middle[0, 0, d], radius[0, 0, d])
            if not all(contains(pair, end[d]) for end in ends):
                return False
            if order == 14 and not radius[0, 0, d] <= 30.0 * width + 1e-4:
                return False
    return remainders_hold(kernel)


def remainders_hold(kernel: SimpleNamespace) -> bool:
    """Remainders contain those of Lagrange; a step over a pole, at 1.36, is not proved."""
    one = np.ones(1)
    none = np.zeros((1, 0))
    _, middle, radius, _, _ = kernel.ball_steps(
        *DUFFING.arrays,
        4,
        none,
        none,
        BEGINS * one,
        WIDE * one,
        SHORT * one,
        WIDE * one,
        np.array([[[0.9, 0.4]]]),
        np.full((1, 1, 2), WIDE),
    )
    if not all(contains((middle[0, 0, 5], radius[0, 0, 5]), exact) for exact in REMAINDERS):
        return False
    # y'' = t^4 has y^(5) / 5! = t / 5, and y'' = y from (1, 1) has exp(t) / 5!.
    for tape, exact in ((OF_TIME, lambda t: t / 5), (GROWS, lambda t: mp.exp(t - BEGINS) / 120)):
        start = np.array([[[1.0, 1.0]]])
        _, middle, radius, _, _ = kernel.ball_steps(
            *tape.arrays,
            4,
            none,
            none,
            BEGINS * one,
            0 * one,
            0.8 * one,
            0.2 * one,
            start,
            0 * start,
        )
        ends = [exact(mp.mpf(BEGINS) + share) for share in (0, mp.mpf(0.8) + mp.mpf(0.2))]
        if not all(contains((middle[0, 0, 5], radius[0, 0, 5]), end) for end in ends):
            return False
        if tape is OF_TIME and not radius[0, 0, 5] <= 0.11:
            return False
    for length in (0.9, 1.0, 1.2, 1.37, 1.5, 2.0, 3.0):
        start = np.array([[[1.0, 1.0]]])
        made = kernel.ball_steps(
            *BLOWS_UP.arrays,
            8,
            none,
            none,
            0 * one,
            0 * one,
            length * one,
            0 * one,
            start,
            0 * start,
        )
        if made[0][0] and length > 1.3111:
            return False
    return True


# --- what correct arrays of balls do -----------------------------------------


def arrays_hold(module: SimpleNamespace) -> bool:
    with np.errstate(all="ignore"):
        return operations_hold(module) and products_hold(module) and systems_hold(module)


def operations_hold(module: SimpleNamespace) -> bool:
    small = module.Ball(np.full((2, 2), 1e-200))
    other = module.Ball(np.full((2, 2), 1e-180))
    exact = Fraction(1e-200) * Fraction(1e-180)
    for tiny in (small * other, small / module.Ball(np.full((2, 2), 1e180))):
        if not in_ball((tiny.middle[0, 0], tiny.radius[0, 0]), exact):
            return False
    tiny = module.product(small, other)
    if not in_ball((tiny.middle[0, 0], tiny.radius[0, 0]), 2 * exact):
        return False
    small = module.Ball(np.full((1, 130), 1e-200))
    tiny = module.product(small, module.Ball(np.eye(130) * 1e-180))
    if not in_ball((tiny.middle[0, 0], tiny.radius[0, 0]), exact):
        return False
    for m, r, n, s in OPERANDS:
        a = module.Ball(m, r)
        b = module.Ball(n, s)
        for operation in (
            lambda x, y: x + y,
            lambda x, y: x - y,
            lambda x, y: x * y,
            lambda x, y: x / y,
        ):
            result = operation(a, b)
            pair = (result.middle, result.radius)
            exact = [operation(x, y) for x, y in corners_of(m, r, n, s)]
            if not all(in_ball(pair, value) for value in exact):
                return False
            least = 0.5 * float(max(exact) - min(exact)) + 8e-16 * (abs(m) + abs(n) + abs(pair[0]))
            if not pair[1] <= WIDER * least + 1e-280:
                return False
        root = module.Ball(abs(m) + 2.0 * r, r).sqrt()
        for end in (-1, 1):
            inside = mp.mpf(abs(m) + 2.0 * r) + end * mp.mpf(r)
            if not contains((root.middle, root.radius), mp.sqrt(inside)):
                return False
        if not root.radius <= 1.5 * r / np.sqrt(abs(m) + r) + 1e-15 * root.middle:
            return False
    return True


LEFT = RNG.normal(size=(3, 130))
RIGHT = np.where(RNG.random((130, 130)) < 0.05, RNG.normal(size=(130, 130)), 0.0)


def products_hold(module: SimpleNamespace) -> bool:
    """At the corner at which every entry of the first row is largest."""
    for size in (4, 130):
        for left_spread, right_spread in ((0.0, 0.0), (1e-6, 0.0), (0.0, 1e-6), (1e-3, 1e-3)):
            left = module.Ball(LEFT[:, :size], left_spread)
            middle = RIGHT[:size, :size] if size == 130 else RIGHT[:size, :size] + 1.0
            spreads = np.where(middle != 0.0, right_spread, 0.0)
            result = module.product(left, module.Ball(middle, spreads))
            for row, column in ((0, 0), (1, size - 1), (2, 1)):
                for sign in (-1, 1):
                    exact = Fraction(0)
                    for k in range(size):
                        a = Fraction(LEFT[row, k])
                        b = Fraction(middle[k, column])
                        da = sign * Fraction(left_spread) * int(np.sign(middle[k, column]))
                        db = sign * Fraction(spreads[k, column]) * int(np.sign(LEFT[row, k]))
                        exact += (a + da) * (b + db)
                    pair = (result.middle[row, column], result.radius[row, column])
                    if not in_ball(pair, exact):
                        return False
                    most = 3.0 * abs(float(exact) - pair[0]) + 2e-13
                    if not pair[1] <= most:
                        return False
    return True


def systems_hold(module: SimpleNamespace) -> bool:
    """A diagonal system, whose extremes are known, and a full one by exact elimination."""
    for spread in (0.0, 1e-4):
        matrix = module.Ball(np.diag([2.0, 3.0]), np.diag([spread, spread]))
        right = module.Ball(np.array([[1.0], [0.7]]), spread)
        solution = module.solve(matrix, right)
        if solution is None:
            return False
        for i, (a, b) in enumerate(((2.0, 1.0), (3.0, 0.7))):
            for sign in (-1, 1):
                exact = (Fraction(b) + sign * Fraction(spread)) / (
                    Fraction(a) - sign * Fraction(spread)
                )
                if not in_ball((solution.middle[i, 0], solution.radius[i, 0]), exact):
                    return False
        if not solution.radius.max() <= 3.0 * spread + 1e-14:
            return False
    return module.solve(module.Ball(np.eye(2), 0.6), module.Ball(np.ones((2, 1)))) is None


MODULES = {
    "kernel": (ball_kernel, KERNEL, kernel_holds),
    "arrays": (balls, ARRAYS, arrays_hold),
}


@pytest.mark.parametrize("name", MODULES)
def test_the_checks_hold_without_a_mutation(name: str) -> None:
    module, functions, holds = MODULES[name]
    with mp.workdps(40):
        assert holds(mutated(module, functions, None))


def survivors(name: str, every: int) -> list[str]:
    """The mutations that no check notices."""
    module, functions, holds = MODULES[name]
    found = []
    for mutation in list(mutations_of(module, functions))[::every]:
        if mutation.name in EQUIVALENT:
            continue
        try:
            with mp.workdps(40):
                unnoticed = holds(mutated(module, functions, mutation.number))
        except Exception:  # whatever a mutation breaks is noticed
            unnoticed = False
        if unnoticed:
            found.append(mutation.name)
    return found


@pytest.mark.parametrize("name", MODULES)
def test_a_sample_of_mutations_is_noticed(name: str) -> None:
    assert survivors(name, 9) == []


@pytest.mark.thorough
@pytest.mark.parametrize("name", MODULES)
def test_every_mutation_is_noticed(name: str) -> None:
    assert survivors(name, 1) == []
