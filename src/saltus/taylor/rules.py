"""The Taylor recurrences of `taylor/scalar_source.py` on tapes, for one order of one node: see `series.py`.

A rule is given the node's own series, without the coefficient of this order, and those of its operands; it appends that
coefficient.
"""

from __future__ import annotations

from collections.abc import Callable

from saltus.taylor.series import Coefficient, Row, Series
from saltus.taylor.vector_code import add, multiply, negative, subtract


def _product(w: Series, own: Row, a: Row, b: Row) -> None:
    w.push(own, w.product(a, b))


def _quotient(w: Series, own: Row, a: Row, b: Row) -> None:
    above = subtract(w.now(a), w.product(b, own, first=False))
    w.push(own, multiply(above, w.inverse(b)))


def _derivative(w: Series, u: Row, other: Row, sign: float = 1.0) -> Coefficient:
    """(1/k) sum_{j=1}^{k} j u_j other_{k-j}: of a series whose derivative is u' times another one, or minus that."""
    return w.per_order(w.product(w.scaled(u), other, first=False), sign)


def _sine(w: Series, own: Row, u: Row) -> None:
    s, c = (w.beside(u, name, own.degree, own.early) for name in ("sin", "cos"))
    sine, cosine = w.start(u).sin_cos() if w.starts else (_derivative(w, u, c), _derivative(w, u, s, -1.0))
    w.push(s, sine)
    w.push(c, cosine)


def _hyperbolic(name: str, other: str) -> Callable[..., None]:
    def rule(w: Series, own: Row, u: Row) -> None:
        twin = w.beside(own, other, own.degree, own.early)
        values = [w.start(u).lane_by_lane(f) if w.starts else _derivative(w, u, g) for f, g in ((name, twin), (other, own))]
        w.push(own, values[0])
        w.push(twin, values[1])

    return rule


def _hyperbolic_tangent(w: Series, own: Row, u: Row) -> None:
    square = w.beside(own, "1 - tanh^2", own.degree, own.early)
    w.push(own, w.start(u).lane_by_lane("tanh") if w.starts else _derivative(w, u, square))
    below = negative(w.product(own, own))
    w.push(square, add(1.0, below) if w.starts else below)


def _exponential(w: Series, own: Row, u: Row) -> None:
    w.push(own, w.start(u).lane_by_lane("exp") if w.starts else _derivative(w, u, own))


def _logarithm(w: Series, own: Row, u: Row) -> None:
    if w.starts:
        w.push(own, w.start(u).lane_by_lane("log"))
    else:
        below = w.per_order(w.product(w.scaled(own, newest=False), u, first=False, last=False))
        w.push(own, multiply(subtract(w.now(u), below), w.inverse(u)))
    w.scaled(own)


def _square_root(w: Series, own: Row, u: Row) -> None:
    if w.starts:
        w.push(own, w.start(u).sqrt())
    else:
        above = subtract(w.now(u), w.product(own, own, first=False, last=False))
        w.push(own, multiply(multiply(0.5, w.inverse(own)), above))


def _power(w: Series, own: Row, u: Row, exponent: Row) -> None:
    """u r' = p u' r for r = u^p: k u_0 r_k = p sum_{j=1}^{k} j u_j r_{k-j} - sum_{j=1}^{k-1} u_j (k - j) r_{k-j}."""
    p = exponent.first[0]
    if w.starts:
        w.push(own, w.start(u).lane_by_lane("pow", p))
    else:
        above = multiply(p, w.product(w.scaled(u), own, first=False))
        below = w.product(u, w.scaled(own, newest=False), first=False, last=False)
        w.push(own, multiply(w.inverse(u), w.per_order(subtract(above, below))))
    w.scaled(own)


RULES: dict[str, Callable[..., None]] = {
    "add": lambda w, own, a, b: w.push(own, add(w.now(a), w.now(b))),
    "sub": lambda w, own, a, b: w.push(own, subtract(w.now(a), w.now(b))),
    "mul": _product,
    "div": _quotient,
    "sin": _sine,
    "cos": _sine,
    "sinh": _hyperbolic("sinh", "cosh"),
    "cosh": _hyperbolic("cosh", "sinh"),
    "tanh": _hyperbolic_tangent,
    "exp": _exponential,
    "log": _logarithm,
    "sqrt": _square_root,
    "pow": _power,
}
