"""The corrected adiabatic invariant behind capture: its bounds against the invariant itself,
computed from its definition.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

from saltus import OneContactModel
from saltus.bounds.adiabatic_invariant import budget, normal_form
from saltus.bounds.gap_equation import Leaves, Opening
from saltus.bounds.intervals import Interval
from saltus.systems import Harmonic, Load, System
from saltus.taylor.tracing import trace


@dataclass(frozen=True, kw_only=True)
class Bent(OneContactModel):
    """Two sides with every term that the normal form knows: w'' = -pull - c w' - k w - d w'^2 - g w
    w' - n w^2 - p w'^3.
    """

    pull: tuple[float, float]
    damping: tuple[float, float]
    slope: tuple[float, float]
    terms: tuple[float, float, float, float]  # d, g, n, p

    channels: ClassVar[tuple[str, ...]] = ("wind",)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        def at(pair):
            return pair[0] * (1 + side) / 2 + pair[1] * (1 - side) / 2

        w, u, (d, g, n, p) = side * x, side * velocity, self.terms
        free = (
            at(self.pull)
            + at(self.damping) * u
            + at(self.slope) * w
            + d * u * u
            + g * w * u
            + n * w * w
            + p * u * u * u
        )
        return load.wind(t) - side * free


CASES = {
    "equal": ((0.5, 0.5), (0.1, 0.1), (1.0, 1.0), (0.0, 0.0, 0.0, 0.0), 0.1),
    "unequal": ((0.5, 0.8), (0.1, 0.25), (1.0, -0.4), (0.3, 0.2, -0.5, 0.4), 0.12),
}


def rate(f, t, step=5e-3):
    """df/dt by differences of the fourth order."""
    return (8 * (f(t + step) - f(t - step)) - (f(t + 2 * step) - f(t - 2 * step))) / (12 * step)


def times(a, b):
    """The product of two polynomials, coefficients in ascending order along the first axis."""
    product = np.zeros((len(a) + len(b) - 1, *np.shape(a)[1:]))
    for k, coefficient in enumerate(a):
        product[k : k + len(b)] += coefficient * b
    return product


def integral(a, start):
    whole = np.concatenate([np.zeros_like(a[:1]), a / np.arange(1, len(a) + 1)[:, None]])
    whole[0] = -value(whole, start)
    return whole


def value(a, x):
    return sum(coefficient * x**k for k, coefficient in enumerate(a))


class Invariant:
    """L of one case of CASES on one side, from its definition."""

    def __init__(self, name, side):
        self.case, self.side = CASES[name], side

    def alpha(self, t, side=None):
        side = side or self.side
        return self.case[0][side < 0] - side * self.case[4] * np.sin(1.3 * t)

    def weight(self, t):
        return 1 / self.alpha(t, 1) + 1 / self.alpha(t, -1)

    def kappa(self, t):
        return sum(self.case[1][s < 0] / self.alpha(t, s) for s in (1, -1)) / self.weight(t)

    def acceleration(self, t, w, u):
        _, damping, slope, (d, g, n, p), _ = self.case
        linear = self.alpha(t) + damping[self.side < 0] * u + slope[self.side < 0] * w
        return -(linear + d * u * u + g * w * u + n * w * w + p * u**3)

    def parts(self, t):
        """v'/v and x' at the leading order, polynomials in x."""
        q, c = rate(self.alpha, t) / (2 * self.alpha(t)), self.case[1][self.side < 0]
        zero = np.zeros_like(t)
        return np.array([q, zero, -(q + c)]), times(
            np.array([zero, -(q + c)]), np.array([1 + zero, zero, -1 + zero])
        )

    def h1(self, t):
        """alpha h1_x = 3 (v'/v) + G'/G + kappa, odd in x."""
        slope = 3 * self.parts(t)[0]
        slope[0] += rate(lambda x: np.log(self.weight(x)), t) + self.kappa(t)
        return integral(slope, 0.0) / self.alpha(t)

    def h2(self, t):
        """alpha h2_x = what h1 leaves at the order v, 0 at x = -1."""
        (growth, turning), h1, a = self.parts(t), self.h1(t), self.alpha(t)
        a_w, a_uu, zero = -self.case[2][self.side < 0], -2 * self.case[3][0], np.zeros_like(t)
        left = times(h1, growth) + times(np.arange(1, 4)[:, None] * h1[1:], turning)
        left[:4] += rate(self.h1, t)
        left[:4] += np.array([zero, 1.5 * a_w / a, zero, 1.5 * (a_uu - a_w / a)])
        return integral(left, -1.0) / a

    def remainder(self, t, x, v):
        """(dL/dt + kappa) / v^2: the chain rule along w'' = A."""
        a, h1, h2 = self.alpha(t), self.h1(t), self.h2(t)
        w, u = v * v * (1 - x * x) / (2 * a), v * x
        A = self.acceleration(t, w, u)
        v_rate = (u * A + rate(self.alpha, t) * w + a * u) / v
        x_rate = (A - x * v_rate) / v
        along = [
            value(rate(f, t), x) + value(np.arange(1, len(h))[:, None] * h[1:], x) * x_rate
            for f, h in ((self.h1, h1), (self.h2, h2))
        ]
        total = 3 * v_rate / v + rate(lambda x: np.log(self.weight(x)), t) + self.kappa(t)
        total += v_rate * (value(h1, x) + 2 * v * value(h2, x)) + v * along[0] + v * v * along[1]
        return total / v**2


def budgets_of(name, speed, cells):
    """The package's bounds of M, h1 and h2 on both sides, in cells of the period."""
    pull, damping, slope, terms, H = CASES[name]
    model = Bent(pull=pull, damping=damping, slope=slope, terms=terms)
    system = System(model=model, load=Load(frequency=1.3, wind=Harmonic(H)))
    traced = trace(system)
    numbers = [Interval(np.full((1, 1), value)) for value in system.parameters.values()]
    edges = np.linspace(0, 2 * np.pi / 1.3, cells + 1)[:, None]
    leaves = Leaves(numbers, [], time=Interval(edges[:-1], edges[1:]))
    sides = [Opening(traced, s) for s in (1, -1)]
    bounds = [side.bounds(leaves) for side in sides]
    forms = [normal_form(bounds[i], bounds[1 - i]) for i in (0, 1)]
    v = np.full((1, 1), speed)
    return {
        s: budget(f, o.boxed(leaves, f.pull, v), v)
        for s, f, o in zip((1, -1), forms, sides, strict=True)
    }


@pytest.mark.parametrize("name", [pytest.param("equal", marks=pytest.mark.thorough), "unequal"])
def test_the_invariant_changes_no_faster_than_its_bounds_say(name):
    """dL/dt <= -kappa + v^2 M at random states, with dL/dt from the definition of L; and M is not
    far above what is met.
    """
    cells, speed = 512, 0.1
    found, rng = budgets_of(name, speed, cells), np.random.default_rng(11)
    for side in (1, -1):
        t, x, v = rng.uniform((0, -1, 0.2 * speed), (2 * np.pi / 1.3, 1, speed), (40_000, 3)).T
        M = Invariant(name, side).remainder(t, x, v)
        bound = found[side].growth[(t / (2 * np.pi / 1.3) * cells).astype(int), 0]
        assert (bound - M).min() > -1e-5  # what the differences are worth
        assert bound.max() < 3 * np.abs(M).max()


@pytest.mark.parametrize("name", CASES)
def test_the_corrections_of_the_invariant_are_bounded_and_agree_at_impacts(name):
    cells = 512
    found = budgets_of(name, 0.1, cells)
    t, x = np.random.default_rng(12).uniform((0, -1), (2 * np.pi / 1.3, 1), (20_000, 2)).T
    cell = (t / (2 * np.pi / 1.3) * cells).astype(int)
    for side in (1, -1):
        first, second = (f(t) for f in (Invariant(name, side).h1, Invariant(name, side).h2))
        for h, bound in ((first, found[side].form.first), (second, found[side].form.second)):
            assert (np.abs(value(h, x)) <= bound[cell, 0] + 1e-6).all()
            assert bound.max() < 3 * np.abs(value(h, x)).max()
        assert value(first, -1.0) == pytest.approx(
            value(Invariant(name, -side).h1(t), 1.0), abs=1e-7
        )
        assert np.abs(value(second, 1.0)).max() < 1e-7
        assert np.abs(value(first, 1.0)).max() <= found[side].form.jump.max() + 1e-7
