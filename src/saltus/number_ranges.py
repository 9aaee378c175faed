"""One declaration of a number: the values that a field of a dataclass may have, and its unit.

Python, files, pages and the reference read it: `beta0: float = field(metadata=number_range(above=0,
below=pi, unit="rad"))`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import Any

from saltus.checks import LIMITS, check_count, check_number, range_text
from saltus.errors import ParameterError, shown

# A bound by another number of the same part, and the words for it.
BESIDE = {
    "above": "lie above",
    "below": "lie below",
    "at_least": "be at least",
    "at_most": "be at most",
}


@dataclass(frozen=True)
class NumberRange:
    """The values that a number may have: between numbers, or beside another number of its part."""

    above: float | str | None = None
    below: float | str | None = None
    at_least: float | str | None = None
    at_most: float | str | None = None
    unit: str = ""
    whole: bool = False
    each: bool = False  # whether a tuple of them may stand for one, with a number for each contact

    @functools.cached_property
    def bounds(self) -> dict[str, float]:
        """The bounds that are numbers, as `check_number` takes them."""
        given = {side: getattr(self, side) for side in BESIDE}
        return {side: x for side, x in given.items() if isinstance(x, (int, float))}

    @functools.cached_property
    def beside(self) -> tuple[tuple[str, str], ...]:
        """The bounds that are other numbers: which bound, and the name of the other one."""
        given = {side: getattr(self, side) for side in BESIDE}
        return tuple((side, x) for side, x in given.items() if isinstance(x, str))

    @functools.cached_property
    def text(self) -> str:
        """The range in brackets, such as "[0, inf)"; empty without bounds."""
        words = range_text(*(self.bounds.get(side) for side in BESIDE))
        return words.removeprefix("lie in ") if self.bounds else ""

    @functools.cached_property
    def demand(self) -> str:
        """What a value must, as refusals say it: "must lie in (0, pi) rad"."""
        words = range_text(*(self.bounds.get(side) for side in BESIDE))
        return f"must {words}" + (f" {self.unit}" if self.unit else "")

    def holds(self, value: float) -> bool:
        """Whether a plain float is within the bounds that are numbers."""
        bounds = self.bounds
        return (
            -LIMITS.value <= value <= LIMITS.value
            and not self.whole
            and (not bounds or self._within(value, **bounds))
        )

    @staticmethod
    def _within(
        value: float,
        above: float = -math.inf,
        below: float = math.inf,
        at_least: float = -math.inf,
        at_most: float = math.inf,
    ) -> bool:
        return above < value < below and at_least <= value <= at_most


def number_range(
    *,
    above: float | str | None = None,
    below: float | str | None = None,
    at_least: float | str | None = None,
    at_most: float | str | None = None,
    unit: str = "",
    whole: bool = False,
) -> dict[str, Any]:
    """The declaration of a number of a model or an impact law, as the metadata of its field.

    A `System` refuses other values, and a page has its sliders within them.

    Parameters
    ----------
    above, below
        Bounds that are not taken: numbers, or the names of other numbers of the class.
    at_least, at_most
        Bounds that are taken, likewise.
    unit
        Its unit; files give an angle, "rad", in degrees too.
    whole
        Whether it is a whole number.

    Raises
    ------
    ParameterError
        A bound that is neither a number nor a name.

    Examples
    --------
    >>> from dataclasses import dataclass, field
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Spring(saltus.ContactModel):
    ...     stiffness: float = field(default=1.0, metadata=saltus.number_range(above=0.0))
    ...     coordinates = ("x",)
    ...     def force(self, t, x, velocity, load):
    ...         return -self.stiffness * x
    >>> saltus.System(model=Spring(stiffness=-2.0))
    Traceback (most recent call last):
        ...
    saltus.errors.ParameterError: model.stiffness must lie in (0, inf), got -2.0
    """
    sides = {"above": above, "below": below, "at_least": at_least, "at_most": at_most}
    for side, bound in sides.items():
        if isinstance(bound, str) and not bound.isidentifier():
            raise ParameterError(
                f"{side} must be a number or the name of a number, got {shown(bound)}", side
            )
        if bound is not None and not isinstance(bound, str):
            check_number(side, bound)
    if not isinstance(unit, str):
        raise ParameterError(f"unit must be a text such as 'rad', got {shown(unit)}", "unit")
    declared = NumberRange(above, below, at_least, at_most, unit, whole)
    return {"unit": unit, "range": declared} if unit else {"range": declared}


@functools.cache
def ranges_of(kind: type) -> dict[str, NumberRange]:
    """The declared ranges of a class's fields by their names."""
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    return {f.name: f.metadata["range"] for f in fields if "range" in f.metadata}


@functools.cache
def _optional(kind: Any) -> frozenset[str]:
    """The names of a class's fields that are None by default."""
    return frozenset(f.name for f in dataclasses.fields(kind) if f.default is None)


def settle_numbers(owner: Any, *names: str) -> None:
    """Check fields of a frozen dataclass against their declared ranges, and store them as plain
    floats; all that are declared, or those with the names. None, where it is the default, stays.

    Raises
    ------
    ParameterError
        The first value outside its range; the error has the name, the range and the value.
    """
    kind: Any = type(owner)
    ranges = ranges_of(kind)
    beside = False
    for name in names or ranges:
        declared = ranges[name]
        value = getattr(owner, name)
        beside = beside or bool(declared.beside)
        if type(value) is float and declared.holds(value):
            continue
        if value is None and name in _optional(kind):
            continue
        if declared.each and isinstance(value, (tuple, list)):
            each = [settled(f"{name}.{i}", x, declared) for i, x in enumerate(value)]
            object.__setattr__(owner, name, type(value)(each))
            continue
        object.__setattr__(owner, name, settled(name, value, declared))
    if beside:
        _check_beside(owner, ranges)


def settled(name: str, value: Any, declared: NumberRange) -> float:
    """A value as a plain number, checked against the bounds that are numbers.

    Raises
    ------
    ParameterError
        A value outside; the error has the name, the range and the value.
    """
    if declared.whole:
        if isinstance(value, float) and value.is_integer():  # from a column of numbers
            value = int(value)
        least = declared.bounds.get("at_least", -LIMITS.count)
        check_count(name, value, int(least), declared.bounds.get("at_most"))  # type: ignore[arg-type]
        return value  # type: ignore[no-any-return]  # a whole number, of its own type
    check_number(name, value, unit=declared.unit, **declared.bounds)
    return float(value)


def _check_beside(owner: Any, ranges: dict[str, NumberRange]) -> None:
    """Refuse numbers on the wrong side of other numbers of the same part."""
    for name, declared in ranges.items():
        for side, other in declared.beside:
            value = getattr(owner, name)
            bound = getattr(owner, other, None)
            if bound is None or callable(bound) or isinstance(bound, (str, tuple, list)):
                raise ParameterError(
                    f"the range of {name} reads {other!r}, which is no number of "
                    f"{type(owner).__name__}",
                    name,
                )
            if not declared._within(value, **{side: bound}):
                raise ParameterError(
                    f"{name} must {BESIDE[side]} {other} = {bound:g}, got {value:g}", name
                )
