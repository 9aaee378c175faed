"""Interval arithmetic on a traced graph: bounds of an expression that hold for every value of its
leaves in given ranges.

Arrays of intervals run over parameter sets and over cells of the time or the state. After every
operation the bounds are moved outward by more than their rounding; zero stays zero, so that a
product with 0 is exactly 0. (Underflow, below 1e-307, is not accounted for.) If an operation leaves
its domain the bounds are NaN; no comparison with NaN holds, so that nothing is proved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import Any

import numpy as np

from saltus.taylor import FUNCTIONS, Expr, ordered

# relative, four times that of + - * / and sqrt: a literal factor such as 1/3 may be rounded too
ROUNDING = 2.0**-51
# relative, of the elementary functions: NumPy promises 4 units in the last place
LIBRARY = 2.0**-48
SLACK = 1e-9  # relative, far above the rounding of the few steps after the intervals
EXACT_FACTORS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # factors that do not round


class Interval:
    """Bounds `lo` <= `hi`, arrays that broadcast."""

    __slots__ = ("hi", "lo")
    __array_ufunc__ = None

    def __init__(self, lo: Any, hi: Any = None) -> None:
        self.lo = np.asarray(lo, dtype=float)
        self.hi = self.lo if hi is None else np.asarray(hi, dtype=float)

    def __add__(self, other: Any) -> Interval:
        o = as_interval(other)
        return outward(self.lo + o.lo, self.hi + o.hi)

    def __sub__(self, other: Any) -> Interval:
        o = as_interval(other)
        return outward(self.lo - o.hi, self.hi - o.lo)

    def __mul__(self, other: Any) -> Interval:
        if isinstance(other, (int, float)):
            lo, hi = (self.lo, self.hi) if other >= 0 else (self.hi, self.lo)
            return (
                Interval(lo * other, hi * other)
                if abs(other) in EXACT_FACTORS
                else outward(lo * other, hi * other)
            )
        a = self.lo * other.lo
        b = self.lo * other.hi
        c = self.hi * other.lo
        d = self.hi * other.hi
        return outward(
            np.minimum(np.minimum(a, b), np.minimum(c, d)),
            np.maximum(np.maximum(a, b), np.maximum(c, d)),
        )

    def __truediv__(self, other: Any) -> Interval:
        return self * as_interval(other).inverse()

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __radd__(self, other: Any) -> Interval:
        return self.__add__(other)

    def __rsub__(self, other: Any) -> Interval:
        return as_interval(other).__sub__(self)

    def __rmul__(self, other: Any) -> Interval:
        return self.__mul__(other)

    def inverse(self) -> Interval:
        """1 / x; NaN where x may be 0."""
        safe = (self.lo > 0) | (self.hi < 0)
        return outward(np.where(safe, 1 / self.hi, np.nan), np.where(safe, 1 / self.lo, np.nan))

    def square(self) -> Interval:
        """x^2; the product x * x would be wider, as it treats its factors as independent."""
        low = self.lo * self.lo
        high = self.hi * self.hi
        least = np.where((self.lo <= 0) & (self.hi >= 0), 0.0, np.minimum(low, high))
        return outward(least, np.maximum(low, high))

    def magnitude(self) -> Any:
        """The largest abs(x)."""
        return np.maximum(-self.lo, self.hi)

    def over_cells(self) -> Interval:
        """The hull over the first axis, kept with length 1."""
        return Interval(
            np.min(self.lo, axis=0, keepdims=True), np.max(self.hi, axis=0, keepdims=True)
        )


def as_interval(value: Any) -> Interval:
    """A number or an array becomes an interval without width."""
    return value if isinstance(value, Interval) else Interval(value)


def outward(lo: Any, hi: Any, error: float = ROUNDING) -> Interval:
    """The bounds moved apart by a relative error."""
    return Interval(lo - error * np.abs(lo), hi + error * np.abs(hi))


def enclose(roots: list[Expr], leaf: Callable[[Expr], Interval]) -> list[Interval]:
    """Bounds of expressions for all values of their leaves (time, coordinate, parameter, ...) in
    the ranges that `leaf` gives.
    """
    values: dict[int, Interval] = {}
    with np.errstate(all="ignore"):
        _fill(values, _in_order(*roots), leaf)
    return [values[id(root)] for root in roots]


def enclosed_along(
    root: Expr, leaf: Callable[[Expr], Interval], varied: Expr
) -> Callable[[Interval], Interval]:
    """`enclose` of an expression as a function of the range of one leaf; parts that do not depend
    on the leaf are bounded once."""
    depends = {id(varied)}
    fixed = []
    others = []
    for node in _in_order(root):
        if node is varied or any(id(a) in depends for a in node.args):
            depends.add(id(node))
            others.append(node)
        else:
            fixed.append(node)
    values: dict[int, Interval] = {}
    with np.errstate(all="ignore"):
        _fill(values, fixed, leaf)

    def bounds(given: Interval) -> Interval:
        here = values.copy()
        with np.errstate(all="ignore"):
            _fill(here, others, lambda _: given)
        return here[id(root)]

    return bounds


@lru_cache(maxsize=256)
def _in_order(*roots: Expr) -> tuple[Expr, ...]:
    """The nodes below some roots, operands first; cached, as the same few roots are bounded many
    times.
    """
    return tuple(ordered(list(roots)))


def _fill(
    values: dict[int, Interval], nodes: Iterable[Expr], leaf: Callable[[Expr], Interval]
) -> None:
    """Add the bounds of nodes, which are given with operands first, to the known ones."""
    for node in nodes:
        if node.op == "number":
            values[id(node)] = Interval(node.value)
        elif not node.args:
            values[id(node)] = leaf(node)
        else:
            values[id(node)] = _apply(node, [values[id(a)] for a in node.args])


def _apply(node: Expr, x: list[Interval]) -> Interval:
    if node.op == "mul" and node.args[0] is node.args[1]:
        return x[0].square()
    known = _OPERATIONS.get(node.op)
    return Interval(np.nan) if known is None else known(*x)  # NaN: nothing is known


def _increasing(function: Any) -> Callable[[Interval], Interval]:
    """An increasing function; if it has no value at the lower end, both bounds are NaN."""

    def bounds(x: Interval) -> Interval:
        low = function(x.lo)
        return outward(low, np.where(np.isnan(low), np.nan, function(x.hi)), LIBRARY)

    return bounds


def _wave(function: Any, peak: float) -> Callable[[Interval], Interval]:
    """A sine or cosine, whose maxima are at `peak` + 2 pi k and whose minima are half a turn
    later.
    """

    def bounds(x: Interval) -> Interval:
        x = outward(x.lo, x.hi, LIBRARY)
        at_lo = function(x.lo)
        at_hi = function(x.hi)

        def passes(point: float) -> Any:
            return np.floor((x.hi - point) / math.tau + LIBRARY) >= np.ceil(
                (x.lo - point) / math.tau - LIBRARY
            )

        result = outward(np.minimum(at_lo, at_hi), np.maximum(at_lo, at_hi), LIBRARY)
        # False where a bound is NaN, so that the result stays NaN
        full_turn = x.hi - x.lo >= math.tau
        # Over a full turn the bounds are -1 and 1, also where the ends are infinite and the
        # function there is NaN.
        result.lo, result.hi = (np.where(full_turn, 0.0, end) for end in (result.lo, result.hi))
        low = np.where(full_turn | passes(peak + math.pi), -1.0, np.maximum(result.lo, -1.0))
        return Interval(low, np.where(full_turn | passes(peak), 1.0, np.minimum(result.hi, 1.0)))

    return bounds


def _cosh(x: Interval) -> Interval:
    low = np.cosh(x.lo)
    high = np.cosh(x.hi)
    least = np.where((x.lo <= 0) & (x.hi >= 0), 1.0, np.minimum(low, high))
    return outward(least, np.maximum(low, high), LIBRARY)


def _pow(x: Interval, exponent: Interval) -> Interval:
    """x^p for x >= 0, monotone in both; NaN for negative x."""
    corners = [base**p for base in (x.lo, x.hi) for p in (exponent.lo, exponent.hi)]
    low = np.minimum.reduce(np.broadcast_arrays(*corners))
    high = np.maximum.reduce(np.broadcast_arrays(*corners))
    unsafe = (x.lo < 0) | ((x.lo == 0) & (exponent.lo <= 0))
    return outward(np.where(unsafe, np.nan, low), np.where(unsafe, np.nan, high), LIBRARY)


def _greater(x: Interval, y: Interval) -> Interval:
    """1 where x > y for all their values, 0 where for none, and [0, 1] otherwise."""
    return Interval(np.where(x.lo > y.hi, 1.0, 0.0), np.where(x.hi <= y.lo, 0.0, 1.0))


def _greater_equal(x: Interval, y: Interval) -> Interval:
    return Interval(np.where(x.lo >= y.hi, 1.0, 0.0), np.where(x.hi < y.lo, 0.0, 1.0))


def _where(condition: Interval, x: Interval, y: Interval) -> Interval:
    low = np.minimum(x.lo, y.lo)
    high = np.maximum(x.hi, y.hi)
    yes = condition.lo == 1.0
    no = condition.hi == 0.0
    return Interval(
        np.where(yes, x.lo, np.where(no, y.lo, low)), np.where(yes, x.hi, np.where(no, y.hi, high))
    )


_OPERATIONS: dict[str, Callable[..., Interval]] = {
    **{
        name: _increasing(function.numpy)
        for name, function in FUNCTIONS.items()
        if function.increasing
    },
    "add": Interval.__add__,
    "sub": Interval.__sub__,
    "mul": Interval.__mul__,
    "div": Interval.__truediv__,
    "pow": _pow,
    "cosh": _cosh,
    "sin": _wave(np.sin, math.pi / 2),
    "cos": _wave(np.cos, 0.0),
    "greater": _greater,
    "less": lambda x, y: _greater(y, x),
    "greater_equal": _greater_equal,
    "less_equal": lambda x, y: _greater_equal(y, x),
    "where": _where,
    "maximum": lambda x, y: Interval(np.maximum(x.lo, y.lo), np.maximum(x.hi, y.hi)),
    "minimum": lambda x, y: Interval(np.minimum(x.lo, y.lo), np.minimum(x.hi, y.hi)),
}
