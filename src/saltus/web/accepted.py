"""Which values each number of a system may have, and the sentences with which Python refuses
others: asked of Python itself.

A page has no checks of its own. For every number the ends of the range that `System.with_` takes
are found by trying. The sentences of the refusals are stored with marks in the places of the
numbers.
"""

from __future__ import annotations

import math
import warnings
from typing import Any

from saltus.errors import SaltusError, shown
from saltus.systems import System, numbers

# They stand in a sentence for the value, for the value in six digits, and for another number that
# bounds it, in six digits.
MARK = "{value}"
SHORT = "{short}"
OTHER = "{other}"
# Sizes of the values that are tried, odd in their digits so that no sentence has them by chance;
# Python's hint at degrees begins and ends near the second and the fifth of them. No number may be
# as large as the last one.
TRIED = (
    0.0070173,
    3.2000173,
    7.0170173,
    70.170173,
    360.00173,
    7017.0173,
    7.0170173e6,
    7.0170173e12,
    7.0170173e20,
    7.0170173e105,
)
TRIED_WHOLE = (173.0, 7017.0, 7017017.0)


def accepted(system: System) -> dict[str, dict[str, Any]]:
    """For each path of a number that a reader may change: `least` and `most`, as far as there is a bound, each with

    * `end`, the last value, and `taken`, whether it is taken itself;
    * `of`, the path of the number that it is, if another number of the system bounds this one;
    * `said`, pairs of a value and the sentence that is said from there on, the first of them from
      the end on;

    and `whole`, the sentence that refuses a fraction, for numbers that are whole.

    Parameters
    ----------
    system
        The system; its own numbers are taken.
    """
    return {
        path: _NumberBounds(system, path, value).bounds()
        for path, value in numbers(system, given=True)
    }


class _NumberBounds:
    """One number of a system, and what Python says to other values of it."""

    def __init__(self, system: System, path: str, value: float) -> None:
        self.system = system
        self.path = path
        self.value = value
        half = self.refusal(value + 0.5) or self.refusal(value - 0.5)
        self.whole = (
            value.is_integer()
            and bool(half)
            and self.refusal(value + 1) is None
            and path.endswith(".order")
        )
        self.fraction = half if self.whole else None

    def refusal(self, value: float) -> str | None:
        """Python's sentence where it refuses a value, else None."""
        return _refusal(self.system, {self.path: value})

    def bounds(self) -> dict[str, Any]:
        """Both ends, as far as there are any."""
        found: dict[str, Any] = {}
        for side, sign in (("least", -1.0), ("most", 1.0)):
            tried = [
                sign * size
                for size in (TRIED_WHOLE if self.whole else TRIED)
                if size > sign * self.value
            ]
            first = next((x for x in tried if self.refusal(x) is not None), None)
            if first is None:
                continue
            found[side] = self._end(first)
            end = found[side]["end"]
            near = [] if self.whole else [end + sign * TRIED[0]]
            found[side]["said"] = self._said(
                end, [x for x in (*near, *tried) if sign * (x - end) > 0]
            )
            self._follow(found[side])
        if self.fraction:
            found["whole"] = self.fraction.replace(shown(self.value + 0.5), MARK).replace(
                shown(self.value - 0.5), MARK
            )
        return found

    def _end(self, refused: float) -> dict[str, Any]:
        """Where what is taken ends, by halving."""
        taken = self.value
        while (
            not self.whole
            and (middle := 0.5 * (taken + refused)) not in (taken, refused)
            and abs(taken - refused) > 1e-12
        ):
            taken, refused = (middle, refused) if self.refusal(middle) is None else (taken, middle)
        while self.whole and abs(taken - refused) > 1:
            middle = float(math.floor((taken + refused) / 2))
            taken, refused = (middle, refused) if self.refusal(middle) is None else (taken, middle)
        others = [x for path, x in numbers(self.system, given=True) if path != self.path]
        simple = [
            x
            for x in (float(round(taken)), math.pi, math.pi / 2, *others)
            if math.isclose(x, taken, abs_tol=1e-9)
        ]
        end = simple[0] if simple else taken
        return {"end": end, "taken": self.refusal(end) is None}

    def _said(self, end: float, tried: list[float]) -> list[list[Any]]:
        """The sentences beyond the end, each with the value from which on it is said."""
        found: list[list[Any]] = []
        before = end
        for x in sorted(tried, key=lambda x: abs(x - end)):
            marked = self._marked(x)
            if marked and (not found or found[-1][1] != marked):
                found.append([self._change(before, x, marked) if found else end, marked])
            before = x
        return found

    def _change(self, before: float, x: float, marked: str) -> float:
        """From where on a sentence is said, by halving."""
        while (
            not self.whole
            and (middle := 0.5 * (before + x)) not in (before, x)
            and abs(x - before) > 1e-12
        ):
            before, x = (before, middle) if self._marked(middle) == marked else (middle, x)
        return x

    def _marked(self, x: float) -> str | None:
        """Python's sentence to a value, with marks for the value."""
        said = self.refusal(x)
        return said and said.replace(shown(int(x) if self.whole else x), MARK).replace(
            f"{x:g}", SHORT
        )

    def _follow(self, bound: dict[str, Any]) -> None:
        """Find out whether another number of the system is the bound: then the bound moves with
        it.
        """
        for path, value in numbers(self.system, given=True):
            if (
                path == self.path
                or value == 0.0
                or not math.isclose(value, bound["end"], abs_tol=1e-9)
            ):
                continue
            moved = value + math.copysign(0.0625, self.value - value)
            beyond = {path: moved, self.path: 0.5 * (value + moved)}
            # the other number alone may be moved there, unlike the order of a harmonic
            if (
                _refusal(self.system, {path: moved}) is None
                and self.refusal(value + 2 * (moved - value)) is None
                and _refusal(self.system, beyond)
            ):
                bound |= {
                    "of": path,
                    "said": [[at, said.replace(f"{value:g}", OTHER)] for at, said in bound["said"]],
                }


def _refusal(system: System, changes: dict[str, float]) -> str | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # nobody means the values that are tried
            system.with_(
                {
                    path: int(x) if path.endswith(".order") and x.is_integer() else x
                    for path, x in changes.items()
                }
            )
    except SaltusError as error:
        return str(error)
    return None
