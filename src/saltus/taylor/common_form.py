"""One expression that replaces several alternatives of which each lane needs one, so that all lanes can compute it together.

The motion of one free coordinate while all others are held is, say, theta_1'' = p sin(beta_0 + theta_1) - C theta_1' or theta_2''
= q sin(beta_0 - theta_2) - c theta_2'. With theta for the free one, both have the form a_1 sin(theta) + a_2 cos(theta) + a_3
theta', in which each lane chooses its own constant coefficients. Every alternative is expanded into a sum of terms, each a
coefficient that is constant in time times factors that are not; terms of different alternatives with factors of the same kinds
are merged. Sines and cosines of sums are expanded too, so that all angles that differ by constants share one sine and one cosine.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from saltus.taylor.graph import Expr, combine, number, ordered

Factors = tuple[Expr, ...]
Terms = dict[Factors, Expr]  # the coefficient of each product of factors; that of () is the constant


class CommonForm:
    """Makes expressions that equal the i-th of several alternatives wherever the i-th chooser is 1 and the others are 0."""

    def __init__(self, choosers: Sequence[Expr]) -> None:
        self._choosers = choosers
        self._terms: dict[Expr, Terms] = {}
        self._kinds: dict[Expr, str] = {}
        self._made: dict[tuple[Expr, ...], Expr] = {}

    def of(self, alternatives: Sequence[Expr]) -> Expr:
        """The expression for these alternatives; all of them must have a value wherever one of them is chosen."""
        key = tuple(alternatives)
        if key not in self._made:
            self._made[key] = self._unified(key)
        return self._made[key]

    def integral(self, e: Expr, leaf: Expr) -> Expr | None:
        """The integral over a leaf of an expression made of sines and cosines of this leaf and constants; None for others."""
        sine, cosine, total = combine("sin", leaf), combine("cos", leaf), number(0.0)
        integrals: dict[Factors, Expr] = {(): leaf, (sine,): -cosine, (cosine,): sine}
        for factors, coefficient in self._terms_of(e).items():
            if factors not in integrals:
                return None
            total = total + coefficient * integrals[factors]
        return total

    def _unified(self, alternatives: tuple[Expr, ...]) -> Expr:
        if all(e.degree == 0 for e in alternatives):
            return self._choice(alternatives)
        if len(set(alternatives)) == 1 and not alternatives[0].args:
            return alternatives[0]
        groups: dict[Any, list[tuple[Factors, Expr] | None]] = {}
        for i, expression in enumerate(alternatives):
            met: dict[Any, int] = {}
            for factors, coefficient in self._terms_of(expression).items():
                kinds = tuple(map(self._kind, factors))
                met[kinds] = met.get(kinds, -1) + 1
                groups.setdefault((kinds, met[kinds]), [None] * len(alternatives))[i] = factors, coefficient
        total = number(0.0)
        for terms in groups.values():
            total = total + self._term(terms)
        return total

    def _term(self, terms: list[tuple[Factors, Expr] | None]) -> Expr:
        """One term for the corresponding terms of the alternatives; for an alternative that has none the coefficient is 0."""
        coefficient = self._choice([number(0.0) if term is None else term[1] for term in terms])
        given = next(term[0] for term in terms if term is not None)
        columns = zip(*(given if term is None else term[0] for term in terms), strict=True)
        product = number(1.0)
        for factor, count in _counted([self._factor(column) for column in columns]):
            product = product * factor**count
        return coefficient * product

    def _factor(self, alternatives: tuple[Expr, ...]) -> Expr:
        first = alternatives[0]
        if not first.args or len(set(alternatives)) == 1:
            return first
        if self._is_sum(first):
            return self.of(alternatives)
        return combine(first.op, *(self.of(arguments) for arguments in zip(*(e.args for e in alternatives), strict=True)))

    def _choice(self, values: Sequence[Expr]) -> Expr:
        """The constant that each lane chooses."""
        if len(set(values)) == 1:
            return values[0]
        total = number(0.0)
        for chooser, value in zip(self._choosers, values, strict=True):
            total = total + chooser * value
        return total

    # --- one expression as a sum -----------------------------------------------------------------------------------------------

    def _terms_of(self, e: Expr) -> Terms:
        if e not in self._terms:
            self._terms[e] = {factors: c for factors, c in self._expanded(e).items() if c is not number(0.0)}
        return self._terms[e]

    def _expanded(self, e: Expr) -> Terms:
        if e.degree == 0:
            return {(): e}
        if e.op in ("add", "sub"):
            total = dict(self._terms_of(e.args[0]))
            for factors, coefficient in self._terms_of(e.args[1]).items():
                signed = coefficient if e.op == "add" else -coefficient
                total[factors] = total.get(factors, number(0.0)) + signed
            return total
        if e.op == "mul":
            return self._multiplied(*e.args)
        if e.op == "div" and e.args[1].degree == 0:
            return {factors: coefficient / e.args[1] for factors, coefficient in self._terms_of(e.args[0]).items()}
        if e.op in ("sin", "cos") and e.args[0].degree is None:  # sines and cosines of the time alone are cheap as they are
            return self._split(e)
        return {(e,): number(1.0)}

    def _multiplied(self, left: Expr, right: Expr) -> Terms:
        """The product of two sums: expanded only if one of them has a single term, so that no series is multiplied twice."""
        a, b = self._terms_of(left), self._terms_of(right)
        single = [next(iter(terms.items())) if len(terms) == 1 else _peeled(e) for terms, e in ((a, left), (b, right))]
        (one, c), (other, d) = single
        if () in (one, other) and max(len(a), len(b)) > 1:  # a constant times a sum
            factor, terms = (c, b) if one == () else (d, a)
            return {factors: factor * coefficient for factors, coefficient in terms.items()}
        return {tuple(sorted((*one, *other), key=self._kind)): c * d}

    def _split(self, e: Expr) -> Terms:
        """sin(u + d) = cos(d) sin(u) + sin(d) cos(u) and cos(u + d) = cos(d) cos(u) - sin(d) sin(u), of a constant d."""
        terms = dict(self._terms_of(e.args[0]))
        shift, rest = terms.pop((), number(0.0)), number(0.0)
        turn = number(-1.0 if all(c is number(-1.0) for c in terms.values()) else 1.0)
        for factors, coefficient in terms.items():
            product = coefficient * turn
            for factor in factors:
                product = product * factor
            rest = rest + product
        sine, cosine = (combine("sin", rest),), (combine("cos", rest),)
        if e.op == "sin":
            return {sine: turn * combine("cos", shift), cosine: combine("sin", shift)}
        return {cosine: combine("cos", shift), sine: -turn * combine("sin", shift)}

    def _kind(self, e: Expr) -> str:
        """The kind of a factor: its operation, and the non-constant leaves on which it depends."""
        if e not in self._kinds:
            leaves = sorted({repr(node) for node in ordered([e]) if not node.args and node.degree != 0})
            self._kinds[e] = f"{'sum' if self._is_sum(e) else e.op} of {', '.join(leaves)}"
        return self._kinds[e]

    def _is_sum(self, e: Expr) -> bool:
        return set(self._terms_of(e)) != {(e,)}


def _peeled(e: Expr) -> tuple[Factors, Expr]:
    """An expression split into its factors and a coefficient."""
    coefficient = number(1.0)
    while e.op in ("mul", "div") and 0 in (e.args[-1].degree, e.args[0].degree if e.op == "mul" else None):
        constant, rest = e.args if e.args[0].degree == 0 else e.args[::-1]
        coefficient, e = coefficient * constant if e.op == "mul" else coefficient / constant, rest
    return (e,), coefficient


def _counted(factors: list[Expr]) -> list[tuple[Expr, int]]:
    """Each factor with its number of occurrences, the most frequent ones first."""
    return sorted({factor: factors.count(factor) for factor in factors}.items(), key=lambda item: -item[1])
