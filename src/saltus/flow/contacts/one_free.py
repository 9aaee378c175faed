"""The motion of a model with several contacts while only one coordinate is free: one equation for
every choice of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from saltus.flow.kernel.contact_layout import MOST_TRIED
from saltus.taylor import Expr, Trace, combine, differentiate, number, ordered, substitute

Factors = tuple[Expr, ...]
# the coefficient of each product of factors; that of () is the constant
Terms = dict[Factors, Expr]


class CommonForm:
    """Makes expressions that equal the i-th of several alternatives wherever the i-th chooser is 1
    and the others are 0.
    """

    def __init__(self, choosers: Sequence[Expr]) -> None:
        self._choosers = choosers
        self._terms: dict[Expr, Terms] = {}
        self._kinds: dict[Expr, str] = {}
        self._made: dict[tuple[Expr, ...], Expr] = {}

    def of(self, alternatives: Sequence[Expr]) -> Expr:
        """The expression for these alternatives; all of them must have a value wherever one of them
        is chosen.
        """
        key = tuple(alternatives)
        if key not in self._made:
            self._made[key] = self._unified(key)
        return self._made[key]

    def integral(self, e: Expr, leaf: Expr) -> Expr | None:
        """The integral over a leaf of an expression made of sines and cosines of this leaf and
        constants; None for others.
        """
        sine = combine("sin", leaf)
        cosine = combine("cos", leaf)
        total = number(0.0)
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
                groups.setdefault((kinds, met[kinds]), [None] * len(alternatives))[i] = (
                    factors,
                    coefficient,
                )
        total = number(0.0)
        for terms in groups.values():
            total = total + self._term(terms)
        return total

    def _term(self, terms: list[tuple[Factors, Expr] | None]) -> Expr:
        """One term for the corresponding terms of the alternatives; for an alternative that has
        none the coefficient is 0.
        """
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
        return combine(
            first.op,
            *(
                self.of(arguments)
                for arguments in zip(*(e.args for e in alternatives), strict=True)
            ),
        )

    def _choice(self, values: Sequence[Expr]) -> Expr:
        """The constant that each lane chooses."""
        if len(set(values)) == 1:
            return values[0]
        total = number(0.0)
        for chooser, value in zip(self._choosers, values, strict=True):
            total = total + chooser * value
        return total

    # --- one expression as a sum ---------------------------------------------

    def _terms_of(self, e: Expr) -> Terms:
        if e not in self._terms:
            self._terms[e] = {
                factors: c for factors, c in self._expanded(e).items() if c is not number(0.0)
            }
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
            return {
                factors: coefficient / e.args[1]
                for factors, coefficient in self._terms_of(e.args[0]).items()
            }
        # sines and cosines of the time alone are cheap as they are
        if e.op in ("sin", "cos") and e.args[0].degree is None:
            return self._split(e)
        return {(e,): number(1.0)}

    def _multiplied(self, left: Expr, right: Expr) -> Terms:
        """The product of two sums: expanded only if one of them has a single term, so that no
        series is multiplied twice.
        """
        a = self._terms_of(left)
        b = self._terms_of(right)
        single = [
            next(iter(terms.items())) if len(terms) == 1 else _peeled(e)
            for terms, e in ((a, left), (b, right))
        ]
        (one, c), (other, d) = single
        if () in (one, other) and max(len(a), len(b)) > 1:  # a constant times a sum
            factor, terms = (c, b) if one == () else (d, a)
            return {factors: factor * coefficient for factors, coefficient in terms.items()}
        return {tuple(sorted((*one, *other), key=self._kind)): c * d}

    def _split(self, e: Expr) -> Terms:
        """sin(u + d) = cos(d) sin(u) + sin(d) cos(u) and cos(u + d) = cos(d) cos(u) - sin(d)
        sin(u), of a constant d.
        """
        terms = dict(self._terms_of(e.args[0]))
        shift = terms.pop((), number(0.0))
        rest = number(0.0)
        turn = number(-1.0 if all(c is number(-1.0) for c in terms.values()) else 1.0)
        for factors, coefficient in terms.items():
            product = coefficient * turn
            for factor in factors:
                product = product * factor
            rest = rest + product
        sine = (combine("sin", rest),)
        cosine = (combine("cos", rest),)
        if e.op == "sin":
            return {sine: turn * combine("cos", shift), cosine: combine("sin", shift)}
        return {cosine: combine("cos", shift), sine: -turn * combine("sin", shift)}

    def _kind(self, e: Expr) -> str:
        """The kind of a factor: its operation, and the non-constant leaves on which it depends."""
        if e not in self._kinds:
            leaves = sorted(
                {repr(node) for node in ordered([e]) if not node.args and node.degree != 0}
            )
            self._kinds[e] = f"{'sum' if self._is_sum(e) else e.op} of {', '.join(leaves)}"
        return self._kinds[e]

    def _is_sum(self, e: Expr) -> bool:
        return set(self._terms_of(e)) != {(e,)}


def _peeled(e: Expr) -> tuple[Factors, Expr]:
    """An expression split into its factors and a coefficient."""
    coefficient = number(1.0)
    while e.op in ("mul", "div") and 0 in (
        e.args[-1].degree,
        e.args[0].degree if e.op == "mul" else None,
    ):
        constant, rest = e.args if e.args[0].degree == 0 else e.args[::-1]
        coefficient, e = coefficient * constant if e.op == "mul" else coefficient / constant, rest
    return (e,), coefficient


def _counted(factors: list[Expr]) -> list[tuple[Expr, int]]:
    """Each factor with its number of occurrences, the most frequent ones first."""
    return sorted(
        {factor: factors.count(factor) for factor in factors}.items(), key=lambda item: -item[1]
    )


@dataclass(frozen=True)
class OneFree:
    """The equations of the free coordinate, which they call coordinate 0; the leaves `free` say
    which one it is.

    A reaction has the form p(q) q'' + p'(q) q'^2 + ... with an entry p of the mass matrix, that is,
    P'' + ..., where P is the integral of p. If p is a sine or cosine this saves products of series.
    The guard of a closed contact is the sum of the second derivative of an entry of `curved` and an
    entry of `guards`.
    """

    acceleration: Expr
    curved: list[Expr]  # P of each closed contact
    # the remaining terms of their reactions, then the margins that change along the motion
    guards: list[Expr]
    constant_guards: list[Expr]  # the other margins

    @property
    def roots(self) -> list[Expr]:
        """All expressions."""
        return [self.acceleration, *self.curved, *self.guards, *self.constant_guards]


def equations_of_one_free(trace: Trace, margins: list[Expr]) -> OneFree | None:
    """The equations with one free coordinate, if each of a few coordinates has one contact; else
    None. `margins` have accelerations substituted.

    All contacts but that of the free coordinate are then closed, so that the other coordinates are
    constants. None is given for a trace with a tangent, because the derivatives of the other
    coordinates need not be constant.
    """
    own = trace.dof
    if (
        len(trace.signs) < 2
        # of many it is rare that only one is free, and the equation would choose among as many
        or own > MOST_TRIED
        or trace.sided
        or sorted(trace.contact_coordinates) != list(range(own))
        or trace.columns
    ):
        return None
    common = CommonForm([Expr("free", (), j) for j in range(own)])
    accelerations = []
    curved = []
    changing = []
    constant = []
    for j in range(own):
        leaves = _leaves(trace, j)
        accelerations.append(substitute(trace.acceleration[j], leaves))
        others = [
            root
            for root, coordinate in zip(trace.reactions, trace.contact_coordinates, strict=True)
            if coordinate != j
        ]
        halves = [
            _halves(common, substitute(root, leaves | _accelerations(own, j)), accelerations[j])
            for root in others
        ]
        curved.append([half for half, _ in halves])
        limits = [substitute(root, leaves) for root in margins]
        changing.append(
            [rest for _, rest in halves] + [limit for limit in limits if limit.degree != 0]
        )
        constant.append([limit for limit in limits if limit.degree == 0])
    unified = [
        [common.of(row) for row in zip_longest(*rows, fillvalue=number(1.0))]
        for rows in (curved, changing, constant)
    ]
    return OneFree(common.of(accelerations), *unified)


def _halves(common: CommonForm, reaction: Expr, acceleration: Expr) -> tuple[Expr, Expr]:
    """P and the remaining terms of a reaction p q'' + p' q'^2 + ...

    = P'' + ...; 0 and the reaction if p has no such integral.
    """
    q, v, a = (Expr(op, (), 0) for op in ("coordinate", "velocity", "acceleration"))
    factor = differentiate(reaction, a)
    integral = common.integral(factor, q)
    if integral is None:
        return number(0.0), substitute(reaction, {a: acceleration})
    return integral, substitute(reaction, {a: number(0.0)}) - differentiate(factor, q) * (v * v)


def _accelerations(own: int, j: int) -> dict[Expr, Expr]:
    """The substitution for the accelerations if only coordinate j is free."""
    return {
        Expr("acceleration", (), i): Expr("acceleration", (), 0) if i == j else number(0.0)
        for i in range(own)
    }


def _leaves(trace: Trace, j: int) -> dict[Expr, Expr]:
    """The substitution for coordinates, velocities and `free` if only coordinate j is free."""
    leaves = {}
    for i, position in zip(trace.contact_coordinates, trace.positions, strict=True):
        leaves[Expr("coordinate", (), i)] = Expr("coordinate", (), 0) if i == j else position
        leaves[Expr("velocity", (), i)] = Expr("velocity", (), 0) if i == j else number(0.0)
        leaves[Expr("free", (), i)] = number(1.0 if i == j else 0.0)
    return leaves
