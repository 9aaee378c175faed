"""The elementary functions, each in one rule, and the Taylor recurrences of arithmetic.

An elementary function y = f(u) is added to everything (tracing, derivatives, one motion, ensembles) by one entry of FUNCTIONS
under its name in the C library: NumPy's function, its slope f'(u) in terms of u and y, written with NumPy, and optional
properties. The Taylor coefficients follow from y' = f'(u) u', as the slope is a series like any other,

    k y_k = sum_{j=1}^{k} j u_j s_{k-j},    s = f'(u).

If there is a recurrence that needs no series of the slope, as for the logarithm, the entry gives it. The tests go through the
table and compare each function's coefficients with 40 digits (tests/taylor/test_series.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.taylor.vectors import LONG, Coefficient, Vec, add, multiply, subtract

if TYPE_CHECKING:
    from saltus.taylor.series import Series

Rule = Callable[..., None]  # arguments: the writer, the node's own series (still without this order), its operands' series


@dataclass(frozen=True)
class Function:
    """An elementary function y = f(u)."""

    numpy: Callable[..., Any]
    slope: Callable[[Any, Any], Any]  # f'(u) of u and y
    increasing: bool = False  # wherever it is defined: its bounds over an interval are then its values at the ends
    # Whether the function may change steeply within a step although its Taylor terms are below rounding at the step's start;
    # steps are then checked.
    steep: bool = False
    recurrence: Rule | None = None  # used in place of the recurrence that follows from the slope


def by_slope(w: Series, own: Row, u: Row, slope: Row, factor: float, name: str) -> None:
    """y_k = (factor/k) sum_{j=1}^{k} j u_j s_{k-j}, where f'(u) = factor s."""
    if w.starts:
        w.push(own, w.start(u).function(name))
    else:
        w.push(own, w.per_order(multiply(factor, w.product(w.scaled(u), slope, first=False))))


def _logarithm(w: Series, own: Row, u: Row) -> None:
    """u y' = u': k u_0 y_k = k u_k - sum_{j=1}^{k-1} j y_j u_{k-j}."""
    if w.starts:
        w.push(own, w.start(u).function("log"))
    else:
        below = w.per_order(w.product(w.scaled(own, newest=False), u, first=False, last=False))
        w.push(own, w.over(subtract(w.now(u), below), u))
    w.scaled(own)


def _square_root(w: Series, own: Row, u: Row) -> None:
    """y y = u: 2 y_0 y_k = u_k - sum_{j=1}^{k-1} y_j y_{k-j}."""
    if w.starts:
        w.push(own, w.start(u).function("sqrt"))
    else:
        above = subtract(w.now(u), w.product(own, own, first=False, last=False))
        w.push(own, multiply(0.5, w.over(above, own)))


def _product(w: Series, own: Row, a: Row, b: Row) -> None:
    w.push(own, w.product(a, b))


def _quotient(w: Series, own: Row, a: Row, b: Row) -> None:
    w.push(own, w.over(subtract(w.now(a), w.product(b, own, first=False)), b))


def _power(w: Series, own: Row, u: Row, exponent: Row) -> None:
    """u y' = p u' y for y = u^p: k u_0 y_k = p sum_{j=1}^{k} j u_j y_{k-j} - sum_{j=1}^{k-1} u_j (k - j) y_{k-j}."""
    p = exponent.first[0]
    if w.starts:
        w.push(own, w.start(u).function("pow", p))
    else:
        above = multiply(p, w.product(w.scaled(u), own, first=False))
        below = w.product(u, w.scaled(own, newest=False), first=False, last=False)
        w.push(own, w.over(w.per_order(subtract(above, below)), u))
    w.scaled(own)


def _sum_of(combined: Callable[[Coefficient, Coefficient], Coefficient]) -> Rule:
    return lambda w, own, a, b: w.push(own, combined(w.now(a), w.now(b)))


ARITHMETIC: dict[str, Rule] = {"add": _sum_of(add), "sub": _sum_of(subtract), "mul": _product, "div": _quotient, "pow": _power}
FUNCTIONS: dict[str, Function] = {
    "sqrt": Function(np.sqrt, lambda u, y: 1.0 / (2.0 * y), increasing=True, recurrence=_square_root),
    "exp": Function(np.exp, lambda u, y: y, increasing=True, steep=True),
    "log": Function(np.log, lambda u, y: 1.0 / u, increasing=True, recurrence=_logarithm),
    "sin": Function(np.sin, lambda u, y: np.cos(u)),
    "cos": Function(np.cos, lambda u, y: -np.sin(u)),
    "sinh": Function(np.sinh, lambda u, y: np.cosh(u), increasing=True, steep=True),
    "cosh": Function(np.cosh, lambda u, y: np.sinh(u), steep=True),
    "tanh": Function(np.tanh, lambda u, y: 1.0 - y * y, increasing=True, steep=True),
    "atan": Function(np.arctan, lambda u, y: 1.0 / (1.0 + u * u), increasing=True),
}


@dataclass(frozen=True)
class SeriesSettings:
    """How the code of series is laid out."""

    # The most products in an inner loop, whose sums and loaded coefficients fit into the registers of AVX-512 and of AVX2.
    most_sums: int = 3
    # The highest degree of a polynomial whose vanishing coefficients are left out of the sums. The orders that are written out
    # for it must be fewer than the lowest order of an ensemble's series.
    most_ending: int = 7


SETTINGS = SeriesSettings()


@dataclass(eq=False)
class Row:
    """One series: its coefficients of the first orders, and those of a pair of orders as far as they are known."""

    degree: int | None  # above which all coefficients vanish; None where it does not end
    early: bool  # whether the coefficient k of a pair is known before the sums are
    first: list[Coefficient] = field(default_factory=list)
    pair: list[Coefficient] = field(default_factory=list)
    place: Any = None  # LLVM's pointer to coefficient 0, where the series lies in memory


class InnerLoop:
    """A loop over j = 1 .. k - 1 that makes the sums of some products for the orders k and k + 1."""

    def __init__(self, series: Series) -> None:
        self.series, self.builder = series, series.builder
        self.block = self.builder.append_basic_block("sums")
        self._changing: list[tuple[Any, Any, Any]] = []  # LLVM's variable, its value at first, its next value
        self._loaded: dict[tuple[int, bool], Vec] = {}
        self._carried: dict[int, Vec] = {}
        self._made = 0
        self._j = self._variable(LONG)

    @property
    def full(self) -> bool:
        """Whether the loop has as many sums as it should."""
        return self._made == SETTINGS.most_sums

    def sums(self, forward: Row, backward: Row) -> tuple[Vec, Vec]:
        """sum a_j b_{k-j} and sum a_j b_{k+1-j} of a `forward`, b `backward`; a_1 b_k only if b_k is known before the loop."""
        self._made += 1
        with self.builder.goto_block(self.block):
            a, b = self._load(forward, False), self._load(backward, True)
            return self._sum(a, b), self._sum(a, self._before(backward, b))

    def _variable(self, kind: Any) -> Any:
        with self.builder.goto_block(self.block):
            self.builder.position_at_start(self.block)
            return self.builder.phi(kind)

    def _load(self, row: Row, backwards: bool) -> Vec:
        """Coefficient j, or k - j, of a series."""
        key = (id(row), backwards)
        if key not in self._loaded:
            index = self.builder.sub(self.series.order, self._j) if backwards else self._j
            self._loaded[key] = self.series._at(row, index)
        return self._loaded[key]

    def _before(self, row: Row, loaded: Vec) -> Vec:
        """Coefficient k + 1 - j, which the iteration before has loaded."""
        if id(row) not in self._carried:
            variable = self._variable(self.series._kind)
            start = self.series.memory.value(row.pair[0] if row.early else None)
            self._changing.append((variable, start, loaded.value))
            self._carried[id(row)] = Vec(self.builder, variable, self.series.memory.arithmetic)
        return self._carried[id(row)]

    def _sum(self, a: Vec, b: Vec) -> Vec:
        variable = self._variable(self.series._kind)
        total = a.fma(b, Vec(self.builder, variable, self.series.memory.arithmetic))
        self._changing.append((variable, a.as_value(0.0), total.value))
        return total

    def close(self, before: Any, after: Any) -> None:
        """Join the loop to the code before and after it."""
        with self.builder.goto_block(self.block):
            following = self.builder.add(self._j, LONG(1))
            self.builder.cbranch(self.builder.icmp_signed("<", following, self.series.order), self.block, after)
        for variable, start, value in [(self._j, LONG(1), following), *self._changing]:
            variable.add_incoming(start, before)
            variable.add_incoming(value, self.block)
