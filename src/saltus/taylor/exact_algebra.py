"""Proofs that two traced expressions are the same function, in exact arithmetic on their graphs,
never by values.

An expression is written as a polynomial with rational coefficients in its atoms, which are leaves
and functions of such polynomials. Two expressions with the same normal form are equal wherever both
have a value. The converse does not hold: the normal form of sin(x)^2 + cos(x)^2 is not 1. Equality
is thus proved; different normal forms prove nothing.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Hashable, Mapping
from fractions import Fraction

import numpy as np

from saltus.taylor.graph import Expr, ordered
from saltus.taylor.rules import FUNCTIONS

Monomial = tuple[tuple[int, int], ...]  # (number of the atom, its power), by rising number
Form = dict[Monomial, Fraction]

ONE: Monomial = ()
# A longer polynomial is not written out: models have a few dozen terms, and products of sums grow
# fast.
MOST_TERMS = 1000
ODD = ("sin", "sinh", "tanh", "atan")
EVEN = ("cos", "cosh")

_atoms: dict[Hashable, int] = {}
_numbers = itertools.count()  # which gives no two threads the same number


class NoNormalForm(Exception):
    """An expression has no normal form, because it is not finite or too long, so that nothing is
    proved about it.
    """


def normal_form(root: Expr, leaves: Mapping[Expr, Form] | None = None) -> Form:
    """The normal form of an expression, with some of its leaves replaced by normal forms.

    Raises
    ------
    NoNormalForm
        The expression has a number that is not finite or a division by 0, or its polynomial is too
        long.
    """
    forms: dict[int, Form] = {id(leaf): form for leaf, form in (leaves or {}).items()}
    for node in ordered([root]):
        if id(node) not in forms:
            forms[id(node)] = _form(node, [forms[id(a)] for a in node.args])
    return forms[id(root)]


def constant(value: float) -> Form:
    """A number, exactly as it is stored."""
    if not math.isfinite(value):
        raise NoNormalForm
    return {ONE: Fraction(value)} if value else {}


def constant_value(form: Form) -> Fraction | None:
    """The number that a normal form is, or None where it depends on anything."""
    return form.get(ONE, Fraction(0)) if set(form) <= {ONE} else None


def _form(node: Expr, args: list[Form]) -> Form:
    if node.op == "number":
        return constant(node.value)
    if not args:
        return _atom((node.op, node.value))
    if node.op in ("add", "sub"):
        return _sum(args[0], args[1], 1 if node.op == "add" else -1)
    if node.op == "mul":
        return _product(*args)
    if node.op == "div":
        return _product(args[0], _inverse(args[1]))
    return _function(node.op, args)


def _atom(key: Hashable, factor: Fraction = Fraction(1)) -> Form:
    return {((_atoms.setdefault(key, next(_numbers)), 1),): factor}


def _sum(a: Form, b: Form, sign: int) -> Form:
    total = dict(a)
    for monomial, factor in b.items():
        total[monomial] = total.get(monomial, Fraction(0)) + sign * factor
    return {monomial: factor for monomial, factor in total.items() if factor}


def _product(a: Form, b: Form) -> Form:
    if len(a) * len(b) > MOST_TERMS:
        raise NoNormalForm
    total: Form = {}
    for one, first in a.items():
        for other, second in b.items():
            monomial = _times(one, other)
            total[monomial] = total.get(monomial, Fraction(0)) + first * second
    return {monomial: factor for monomial, factor in total.items() if factor}


def _times(one: Monomial, other: Monomial) -> Monomial:
    powers = dict(one)
    for atom, power in other:
        powers[atom] = powers.get(atom, 0) + power
    return tuple(sorted((atom, power) for atom, power in powers.items() if power))


def _inverse(a: Form) -> Form:
    """1 / a: for a single term, the term with negative powers; for a sum, an atom of the sum scaled
    to a first coefficient of 1."""
    if not a:
        raise NoNormalForm
    first, factor = min(a.items())
    if len(a) == 1:
        return {tuple((atom, -power) for atom, power in first): 1 / factor}
    return _atom(("inverse", _key({m: c / factor for m, c in a.items()})), 1 / factor)


def _function(op: str, args: list[Form]) -> Form:
    """An atom for a function of normal forms; odd and even functions have arguments whose first
    coefficient is positive.
    """
    sign = 1
    if op in FUNCTIONS and not args[0]:
        at_zero = float(FUNCTIONS[op].numpy(np.float64(0.0))) if op != "log" else math.nan
        return constant(at_zero)
    if op in (*ODD, *EVEN) and min(args[0].items())[1] < 0:
        args, sign = [{m: -c for m, c in args[0].items()}], -1 if op in ODD else 1
    return _atom((op, *map(_key, args)), Fraction(sign))


def _key(form: Form) -> Hashable:
    return frozenset(form.items())
