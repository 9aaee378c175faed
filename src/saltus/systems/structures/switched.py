"""What a structure has in place of methods: functions that are data, and forces that switch with
the sides of its surfaces and relays.

A function is a sum with numbers, or a product of such sums, of displacements, their rates, channels
of the load and 1. Parts name it as they name the method of a model's class.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from saltus.checks import check_number
from saltus.errors import ParameterError, near, shown
from saltus.systems.contracts.contact_model import Relay, Surface
from saltus.systems.contracts.model import is_zero
from saltus.systems.gap_coordinates import InGapCoordinates
from saltus.systems.impact_laws import Factors

RATE = "_velocity"  # ends the name of a displacement's rate in a function
CONSTANT = "constant"  # the term that is 1


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchedForce:
    """A force of a `Structure` on a displacement d, which is switched by the side s of a surface or
    a relay:

        F = factor_on f(t, u, u')  while s = +1,    F = factor_off f(t, u, u')  while s = -1.

    f is one of the structure's `functions`, or 1. F acts along d: its work is F d'. A damper of a
    rate c that acts while s = +1 has the function {"d_velocity": 1.0} and `factor_on` = -c.

    Parameters
    ----------
    name
        Its name, such as "damper".
    coordinate
        The displacement d: a row of the matrices, a point, or the coefficients of some rows.
    surface
        The name of the `Surface` or the `Relay` whose side switches it.
    function
        The name of f; by default f = 1.
    factor_on, factor_off
        The factors on the sides +1 and -1.

    Examples
    --------
    >>> brake = saltus.SwitchedForce(name="brake", coordinate=0, surface="valve", function="rate", factor_on=-0.4)
    >>> brake.factor(-1.0)
    0.0
    """

    name: str
    coordinate: Any
    surface: str
    function: str | None = None
    factor_on: Any = 1.0
    factor_off: Any = 0.0

    def __post_init__(self) -> None:
        texts = {"name": self.name, "surface": self.surface}
        if self.function is not None:
            texts["function"] = self.function
        for field, value in texts.items():
            if not isinstance(value, str) or not value:
                raise ParameterError(
                    f"{field} of a SwitchedForce must be a text, got {shown(value)}", field
                )
        for field in ("factor_on", "factor_off"):
            try:
                check_number(field, getattr(self, field))
            except ParameterError as error:
                sentence = str(error).removeprefix(field)
                raise ParameterError(
                    f"{field} of the switched force {self.name!r}{sentence}", field
                ) from None

    def factor(self, s: Any) -> Any:
        """The factor on a side; between the two, where a motion slides along the surface, in
        between.

        Parameters
        ----------
        s
            The side, from -1 to +1.
        """
        return 0.5 * ((self.factor_on + self.factor_off) + s * (self.factor_on - self.factor_off))


class NamedNumbers(Factors):
    """Numbers by their names, or such numbers or products of them: a trace replaces them by
    symbols, and their paths have these names.
    """

    names: tuple[str, ...]

    def __new__(cls, values: Iterable[Any], names: Iterable[str]) -> NamedNumbers:
        made = super().__new__(cls, values)
        made.names = tuple(names)
        return made

    def __getnewargs__(self) -> tuple[Any, ...]:
        return tuple(self), self.names

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, NamedNumbers)
            and self.names == other.names
            and tuple.__eq__(self, other)
        )

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((self.names, tuple(self)))

    @property
    def named(self) -> dict[str, Any]:
        """The numbers by their names."""
        return dict(zip(self.names, self, strict=True))

    def with_values(self, values: Iterable[Any]) -> NamedNumbers:
        """The same names with other values.

        Parameters
        ----------
        values
            In the same order.
        """
        return NamedNumbers(values, self.names)


class Term(NamedTuple):
    """What a name in a function stands for."""

    kind: str  # "displacement", "rate", "channel" or "constant"
    of: str  # the displacement or the channel


class Terms:
    """What the names in the functions of a structure stand for, by its rows, points and
    channels.
    """

    def __init__(self, rows: Sequence[str], points: Iterable[str], channels: Iterable[str]) -> None:
        self.rows = tuple(rows)
        self.displacements = tuple(dict.fromkeys((*rows, *points)))
        self.channels = tuple(channels)

    def meaning(self, term: str, where: str) -> Term:
        """What a name stands for.

        Parameters
        ----------
        term
            The name.
        where
            Where it stands, for the sentence of a refusal.

        Raises
        ------
        ParameterError
            It stands for nothing, or for two things.
        """
        found = [Term("displacement", term)] if term in self.displacements else []
        if term.endswith(RATE) and term.removesuffix(RATE) in self.displacements:
            found.append(Term("rate", term.removesuffix(RATE)))
        if term in self.channels:
            found.append(Term("channel", term))
        if term == CONSTANT:
            found.append(Term(CONSTANT, term))
        if len(found) > 1:
            both = " and ".join(f"a {each.kind}" for each in found)
            raise ParameterError(f"{where}: {term!r} is {both}; give one another name", where)
        if not found:
            rates = [name + RATE for name in self.displacements]
            known = (*self.displacements, *rates, *self.channels, CONSTANT)
            raise ParameterError(
                f"{where}: {shown(term)} is no displacement, no rate such as"
                f" {rates[0]!r}, no channel, and not {CONSTANT!r}; {near(term, known)}",
                where,
            )
        return found[0]

    def name_of(self, term: Any, where: str) -> str:
        """The name of a term that may be the number of a row."""
        if isinstance(term, (int, np.integer)) and not isinstance(term, bool):
            if not -len(self.rows) <= term < len(self.rows):
                raise ParameterError(
                    f"{where}: there is no row {term}; the rows are 0 to {len(self.rows) - 1}",
                    where,
                )
            return self.rows[term]
        return str(term)


def read_functions(given: Any, terms: Terms, taken: type) -> NamedNumbers:
    """The functions of a structure of a class, from a dictionary, in which each is a dictionary of
    its terms, or a list of such, whose product it is.
    """
    if isinstance(given, NamedNumbers):
        given = given.named
    if given is not None and not isinstance(given, Mapping):
        raise ParameterError(
            'functions must be a dict of sums by their names, such as {"high": {"x0": 1.0,'
            f' "constant": -0.1}}}}, got {shown(given)}',
            "functions",
        )
    found = {}
    for name, function in dict(given or {}).items():
        usable = isinstance(name, str) and name.isidentifier() and not name.startswith("_")
        own = hasattr(taken, name) or name in InGapCoordinates.__annotations__
        if not usable or own or hasattr(InGapCoordinates, name):
            raise ParameterError(
                f"functions: {shown(name)} is not a name for a function, such as too_high",
                "functions",
            )
        where = f"functions.{name}"
        is_product = isinstance(function, (list, tuple)) and not isinstance(function, NamedNumbers)
        if is_product and len(function):
            sums = [_read_sum(each, terms, f"{where}.{i}") for i, each in enumerate(function)]
            found[name] = Factors(sums)
        else:
            found[name] = _read_sum(function, terms, where)
    return NamedNumbers(found.values(), found)


def _read_sum(given: Any, terms: Terms, where: str) -> NamedNumbers:
    """The terms of a sum with their numbers."""
    if isinstance(given, NamedNumbers):
        given = given.named
    if not isinstance(given, Mapping) or not given:
        raise ParameterError(
            f'{where} must be a sum such as {{"x0": 1.0, "constant": -0.1}}, or a list of sums,'
            f" whose product it is, got {shown(given)}",
            where,
        )
    found: dict[str, float] = {}
    for term, number in given.items():
        name = terms.name_of(term, where)
        terms.meaning(name, where)
        if name in found:
            raise ParameterError(f"{where} has the term {name!r} twice", where)
        check_number(f"{where}.{name}", number)
        found[name] = float(number)
    return NamedNumbers(found.values(), found)


def sums_of(function: Any) -> tuple[Any, ...]:
    """The sums whose product a function is."""
    return (function,) if isinstance(function, NamedNumbers) else tuple(function)


def displacements_in(functions: NamedNumbers, terms: Terms) -> list[str]:
    """The displacements that functions read, or whose rates they read, each once."""
    found = {
        meaning.of: None
        for function in functions
        for each in sums_of(function)
        for term in each.names
        if (meaning := terms.meaning(term, "functions")).kind in ("displacement", "rate")
    }
    return list(found)


def value_of_product(function: Any, value_of_term: Any) -> Any:
    """The value of a function.

    Parameters
    ----------
    function
        Its sum or sums.
    value_of_term
        The value of a term by its name.
    """
    product: Any = 1.0
    for each in sums_of(function):
        total: Any = 0.0
        for term, number in each.named.items():
            value = number * value_of_term(term)
            total = value if is_zero(total) else total + value
        product = total if _is_one(product) else product * total
    return product


def _is_one(value: Any) -> bool:
    return isinstance(value, float) and value == 1.0


def check_named(
    surfaces: Sequence[Surface | Relay], switched: Sequence[SwitchedForce], functions: NamedNumbers
) -> None:
    """Refuse parts that name a function or a surface that is not given, and functions that no part
    names.
    """
    known = ", ".join(functions.names) or "there are none"
    named = dict[str, None]()
    by_parts = [("surfaces", part, part.methods) for part in surfaces]
    by_forces = [
        ("switched", part, () if part.function is None else (part.function,)) for part in switched
    ]
    for field, part, names in (*by_parts, *by_forces):
        for name in names:
            named[name] = None
            if name not in functions.names:
                raise ParameterError(
                    f"{field}.{part.name} names {shown(name)}, which is none of the functions"
                    f" ({known})",
                    field,
                )
    for name in functions.names:
        if name not in named:
            raise ParameterError(
                f"functions.{name} is named by no part: give it to a surface, a relay or a switched"
                " force, or leave it out",
                "functions",
            )
    of_surfaces = [part.name for part in surfaces]
    own = [part.name for part in switched]
    for part in switched:
        if part.surface not in of_surfaces:
            raise ParameterError(
                f"switched.{part.name} is switched by {shown(part.surface)}, which is none of the"
                f" surfaces ({', '.join(of_surfaces) or 'there are none'})",
                "switched",
            )
        if own.count(part.name) > 1:
            raise ParameterError(
                f"switched has {part.name!r} twice: give each force a name of its own", "switched"
            )


class Shares(NamedTuple):
    """Displacements that follow from the local ones: their names, and their coefficients."""

    names: tuple[str, ...]
    rows: np.ndarray  # (names, local)


# A coefficient that is 0 or a whole number but for this is so: rounding of the division.
EXACT = 1e-13


def independent(rows: Mapping[str, np.ndarray], first: Sequence[str]) -> tuple[list[str], Shares]:
    """The local displacements, of which those in `first` are independent, and the others by these.

    Parameters
    ----------
    rows
        The coefficients of each displacement, in the order in which they are taken.
    first
        Those that are taken in any case.
    """
    kept = list(first)
    later = list[str]()
    sizes = {name: float(np.linalg.norm(row)) for name, row in rows.items()}
    units = {name: row / (sizes[name] or 1.0) for name, row in rows.items()}
    for name in rows:
        if name in first:
            continue
        if sizes[name] == 0.0:
            raise ParameterError(f"the displacement {name} is 0", "points")
        rest = units[name] - _shares(units, kept, name) @ _stacked(units, kept, name)
        if np.linalg.norm(rest) <= 1e-9:
            later.append(name)
        else:
            kept.append(name)
    found = np.zeros((len(later), len(kept)))
    for i, name in enumerate(later):
        shares = _shares(units, kept, name)
        shares[np.abs(shares) <= EXACT] = 0.0
        shares = shares * sizes[name] / np.array([sizes[each] for each in kept])
        whole = np.round(shares)
        found[i] = np.where(np.abs(shares - whole) <= EXACT * np.abs(whole), whole, shares)
    return kept, Shares(tuple(later), found)


def _stacked(units: Mapping[str, np.ndarray], kept: Sequence[str], name: str) -> np.ndarray:
    return np.array([units[each] for each in kept]).reshape(len(kept), len(units[name]))


def _shares(units: Mapping[str, np.ndarray], kept: Sequence[str], name: str) -> np.ndarray:
    """The coefficients of a displacement by those that are kept, as near as they come."""
    if not kept:
        return np.zeros(0)
    stacked = _stacked(units, kept, name)
    return np.asarray(np.linalg.lstsq(stacked.T, units[name], rcond=None)[0])
