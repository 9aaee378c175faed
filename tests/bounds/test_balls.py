"""Balls contain the exact results: of arithmetic, of linear systems, of Taylor series, of steps."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from saltus.bounds import (
    Ball,
    Tape,
    coordinate,
    product,
    rounded_ball,
    rounded_down,
    rounded_up,
    velocity,
)
from saltus.bounds.balls import solve
from saltus.bounds.tape import Steps, load_balls
from saltus.taylor import FUNCTIONS, Expr, combine, number

RNG = np.random.default_rng(1)
DIGITS = 60


def some(count: int) -> tuple[Ball, list[Fraction]]:
    """Random balls of very different widths, and a number of each, near its border or at it."""
    middle = RNG.normal(size=count) * 10.0 ** RNG.integers(-6, 7, count)
    radius = np.abs(middle) * 10.0 ** RNG.integers(-16, -1, count) * RNG.integers(0, 2, count)
    shares = [Fraction(int(share), 4) for share in RNG.integers(-4, 5, count)]
    inside = [
        Fraction(float(m)) + Fraction(float(r)) * share
        for m, r, share in zip(middle, radius, shares, strict=True)
    ]
    return Ball(middle, radius), inside


def holds(ball: Ball, exact: list[Fraction]) -> bool:
    """Whether each number lies in its ball, decided without rounding."""
    pairs = zip(ball.middle.ravel(), ball.radius.ravel(), exact, strict=True)
    return all(abs(Fraction(float(m)) - x) <= Fraction(float(r)) for m, r, x in pairs)


@pytest.mark.parametrize("name", ["add", "sub", "mul", "div"])
def test_arithmetic_contains_exact_results_and_is_no_wider_than_needed(name: str) -> None:
    operation = {
        "add": lambda x, y: x + y,
        "sub": lambda x, y: x - y,
        "mul": lambda x, y: x * y,
        "div": lambda x, y: x / y,
    }[name]
    a, x = some(3000)
    b, y = some(3000)
    result = operation(a, b)
    assert holds(result, [operation(p, q) for p, q in zip(x, y, strict=True)])
    exact = operation(Ball(a.middle), Ball(b.middle))
    assert (exact.radius <= 3e-16 * np.abs(exact.middle) * 2.0 + 1e-280).all()


def test_a_divisor_that_may_be_0_encloses_nothing() -> None:
    assert np.isnan((Ball(1.0) / Ball(0.1, 0.2)).radius)
    assert np.isnan(Ball(0.1, 0.2).sqrt().radius)


def test_square_roots_contain_exact_ones() -> None:
    a, x = some(500)
    ball = Ball(np.abs(a.middle) + a.radius * 1.01, a.radius)
    root = ball.sqrt()
    with mp.workdps(DIGITS):
        for i in range(500):
            for end in (-1, 0, 1):
                value = mp.mpf(float(ball.middle[i])) + end * mp.mpf(float(ball.radius[i]))
                off = abs(mp.sqrt(value) - mp.mpf(float(root.middle[i])))
                assert off <= mp.mpf(float(root.radius[i]))
    assert len(x) == 500


def test_products_of_matrices_contain_exact_ones() -> None:
    a, x = some(35)
    b, y = some(28)
    result = product(a.reshape(5, 7), b.reshape(7, 4))
    exact = [sum(x[7 * i + k] * y[4 * k + j] for k in range(7)) for i in range(5) for j in range(4)]
    assert holds(result, exact)


def test_linear_systems_are_solved_for_every_matrix_of_the_ball() -> None:
    middle = RNG.normal(size=(6, 6))
    matrix = Ball(middle, 1e-6 * np.abs(RNG.normal(size=(6, 6))))
    right = Ball(RNG.normal(size=(6, 2)), 1e-7)
    solution = solve(matrix, right)
    assert solution is not None
    for _ in range(200):
        inner = middle + matrix.radius * RNG.choice([-1.0, 1.0], size=(6, 6))
        given = right.middle + right.radius * RNG.choice([-1.0, 1.0], size=(6, 2))
        found = np.linalg.solve(inner, given)
        assert (np.abs(found - solution.middle) <= solution.radius + 1e-13).all()
    singular = Ball(np.ones((2, 2)), 1e-3)
    assert solve(singular, Ball(np.ones((2, 1)))) is None


# --- series ------------------------------------------------------------------

Y = coordinate(0)
INNER = number(0.5) + Y * Y  # above 0
ONE = [Expr(name, (INNER,)) for name in FUNCTIONS]
TWO = [Expr("pow", (INNER, Expr("parameter", (), 0))), Y / INNER, INNER * (Y - number(2.0))]
MPMATH = {name: getattr(mp, name) for name in FUNCTIONS}


def in_digits(node: Expr, y: mp.mpf, p: mp.mpf) -> mp.mpf:
    """An expression with mpmath."""
    if node.op == "number":
        return mp.mpf(node.value)
    if node.op == "parameter":
        return p
    if node.op == "coordinate":
        return y
    below = [in_digits(operand, y, p) for operand in node.args]
    if node.op in MPMATH:
        return MPMATH[node.op](below[0])
    return {
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b,
        "pow": lambda a, b: a**b,
    }[node.op](*below)


@pytest.mark.parametrize("root", ONE + TWO, ids=lambda node: node.op)
def test_series_of_every_function_contain_the_exact_coefficients(root: Expr) -> None:
    """y'' = f(y) from y = 0.3, y' = 0.7; y'''s coefficients follow from mpmath's Taylor series of f
    along the known polynomial of y, order by order.
    """
    order = 9
    begin = (0.3, 0.7)
    tape = Tape([root])
    parameters = np.array([1.7])
    arguments = (*tape.arrays, order, parameters, np.zeros(1), 0.0, 0.0)
    state = np.array([begin])
    for width in (0.0, 1e-9):
        middle, radius = load_balls().ball_series(*arguments, state, np.full((1, 2), width))
        with mp.workdps(DIGITS):
            for shift in (-1, 1):
                start = [mp.mpf(x) + shift * mp.mpf(width) for x in begin]
                exact = taylor_of(root, start, order, mp.mpf(float(parameters[0])))
                for k in range(order + 1):
                    off = abs(mp.mpf(float(middle[0, k])) - exact[k])
                    assert off <= mp.mpf(float(radius[0, k])), (root.op, k)
        if width == 0.0:
            assert (radius[0] <= 1e-12 * np.maximum(1.0, np.abs(middle[0]))).all()


def taylor_of(root: Expr, start: list[mp.mpf], order: int, p: mp.mpf) -> list[mp.mpf]:
    """The Taylor coefficients of the solution of y'' = f(y)."""
    found = list(start)
    for k in range(order - 1):
        known = list(found)

        def along(t: mp.mpf, known: list[mp.mpf] = known) -> mp.mpf:
            return in_digits(root, mp.polyval(known[::-1], t), p)

        coefficient = mp.taylor(along, 0, k)[k] if k else along(mp.mpf(0))
        found.append(coefficient / ((k + 1) * (k + 2)))
    return found


def test_a_pendulum_s_steps_contain_its_motion_and_derivatives() -> None:
    """y'' = -sin y against mpmath's integration, at the ends of the lengths and of the start."""
    flow = [
        number(-1.0) * Expr("sin", (Y,)),
        number(-1.0) * Expr("cos", (Y,)) * coordinate(1),
        number(-1.0) * Expr("cos", (Y,)) * coordinate(2),
    ]
    tape = Tape(flow)
    begin = np.array([[[1.1, 0.4], [1.0, 0.0], [0.0, 1.0]]])
    radius = np.zeros((1, 3, 2))
    radius[0, 0] = 1e-8
    taken = Steps(
        tape,
        20,
        Ball(np.zeros((1, 0))),
        Ball(np.zeros(1)),
        Ball(np.array([0.4]), np.array([1e-9])),
        Ball(begin, radius),
    )
    assert taken.proved.all()
    assert taken.ends.radius.max() < 1e-7
    with mp.workdps(30):
        for dy, dv, dh in ((-1, -1, -1), (1, -1, 1), (0, 0, 0), (1, 1, 1)):
            h = mp.mpf("0.4") + dh * mp.mpf("1e-9") * mp.mpf("0.999")
            y0 = mp.mpf(1.1) + dy * mp.mpf(1e-8)
            v0 = mp.mpf(0.4) + dv * mp.mpf(1e-8)
            exact = pendulum(y0, v0, h)
            ends = taken.ends
            for c in range(3):
                for d in range(2):
                    off = abs(mp.mpf(float(ends.middle[0, c, d])) - exact[c][d])
                    assert off <= mp.mpf(float(ends.radius[0, c, d]))


def pendulum(y0: mp.mpf, v0: mp.mpf, h: mp.mpf) -> list[tuple[mp.mpf, mp.mpf]]:
    """The state and the columns of its derivative after h, by mpmath's Taylor method."""

    def field(_: mp.mpf, z: list[mp.mpf]) -> list[mp.mpf]:
        turn = -mp.cos(z[0])
        return [z[1], -mp.sin(z[0]), z[3], turn * z[2], z[5], turn * z[4]]

    end = mp.odefun(field, 0, [y0, v0, 1, 0, 0, 1])(h)
    return [(end[0], end[1]), (end[2], end[3]), (end[4], end[5])]


def test_conditions_that_balls_do_not_decide_enclose_nothing() -> None:
    """`where` takes a branch only if the whole ball lies on one side."""
    root = combine("where", combine("greater", Y, number(0.0)), Y * Y, number(3.0))
    tape = Tape([root, combine("maximum", Y, number(0.0))])

    def at(middle: float, radius: float) -> Ball:
        one = Ball(np.array([[middle]]), np.array([[radius]]))
        nothing = Ball(np.zeros((1, 1)))
        return tape.values(Ball(np.zeros((1, 0))), Ball(np.zeros(1)), one, nothing)[0]

    assert at(2.0, 0.1).middle[0] == pytest.approx(4.0)
    assert at(-2.0, 0.1).middle[0] == 3.0
    undecided = at(0.05, 0.1)
    assert np.isnan(undecided.radius[0])
    assert undecided[1].low <= 0.0
    assert undecided[1].high >= 0.15


def test_a_step_that_is_too_long_is_not_proved() -> None:
    """y'' = y^3 from 1 with speed 1 blows up within 1.6."""
    tape = Tape([Y * Y * Y + number(0.0) * velocity(0)])
    taken = Steps(
        tape,
        12,
        Ball(np.zeros((1, 0))),
        Ball(np.zeros(1)),
        Ball(np.array([3.0])),
        Ball(np.array([[[1.0, 1.0]]])),
    )
    assert not taken.proved.any()


# --- words -------------------------------------------------------------------


def test_printed_numbers_contain_what_was_proved() -> None:
    for _ in range(500):
        middle = float(RNG.normal() * 10.0 ** RNG.integers(-8, 9))
        radius = float(abs(RNG.normal()) * 10.0 ** RNG.integers(-18, 1))
        shown, spread = rounded_ball(middle, radius).split(" +- ")
        exact = Fraction(Decimal(shown))
        reach = Fraction(Decimal(spread))
        assert exact - reach <= Fraction(middle) - Fraction(radius)
        assert exact + reach >= Fraction(middle) + Fraction(radius)
        assert Fraction(Decimal(rounded_up(radius))) >= Fraction(radius)
        assert Fraction(Decimal(rounded_down(middle))) <= Fraction(middle)
