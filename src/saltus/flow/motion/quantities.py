"""Quantities of a motion: one rule for what results, tables and pictures show of it.

A `Quantity` is a number of a motion that takes one period: the amplitude, the largest or the smallest
value of a displacement (`Extreme`), or what a function of the user's own returns (`OwnQuantity`). A
displacement is a coordinate of the model, or a named point of a `Structure`. `quantity_of` finds a
quantity by its name, and refuses one that there is not with those that there are. Without a choice
it is the amplitude of the displacement that the load drives, never the largest of coordinates of
different meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from saltus.errors import ParameterError, near, shown
from saltus.flow.motion.motion import Motion
from saltus.systems import System, driven_displacement, driven_displacements

AMPLITUDE = "amplitude"
LARGEST = "largest"
SMALLEST = "smallest"
# The quantities of the displacement that the load drives, and what each is of it.
OF_DRIVEN = {AMPLITUDE: AMPLITUDE, "highest": LARGEST, "lowest": SMALLEST}
TEXTS = {AMPLITUDE: "max abs({})", LARGEST: "max {}", SMALLEST: "min {}"}


# Quantities by the names that a user gives them: functions of a motion, or names of quantities.
Functions = Mapping[str, Callable[[Motion], Any] | str]


class Quantity:
    """A number of a motion. Contract: a subclass has its `name`, under which tables have it, its
    `unit` and its `text` in words, and gives `of`.
    """

    name: str
    unit: str
    text: str

    def of(self, motion: Motion) -> float:
        """Its value.

        Parameters
        ----------
        motion
            The motion, with its dense output.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class Extreme(Quantity):
    """The amplitude, the largest or the smallest value of a displacement, or of some that have the
    same meaning."""

    system: System
    kind: str  # AMPLITUDE, LARGEST or SMALLEST
    displacements: tuple[str, ...]
    name: str

    @property
    def unit(self) -> str:  # type: ignore[override]
        """The unit of the displacement."""
        return unit_of(self.system, self.displacements[0])

    @property
    def text(self) -> str:  # type: ignore[override]
        """What it is, such as "max abs(z)"."""
        return TEXTS[self.kind].format(" or ".join(self.displacements))

    def of(self, motion: Motion) -> float:
        """Its value.

        Parameters
        ----------
        motion
            The motion.
        """
        return self.over({name: motion.range_of(name) for name in self.displacements})

    def over(self, ranges: Mapping[str, tuple[float, float]]) -> float:
        """Its value, where the least and the largest value of each displacement are known.

        Parameters
        ----------
        ranges
            These values by the names of displacements.
        """
        low = min(ranges[name][0] for name in self.displacements)
        high = max(ranges[name][1] for name in self.displacements)
        return {AMPLITUDE: max(abs(low), abs(high)), LARGEST: high, SMALLEST: low}[self.kind]


@dataclass(frozen=True)
class OwnQuantity(Quantity):
    """What a function of the user's own returns of a motion."""

    name: str
    function: Callable[[Motion], Any]
    unit: str = "1"

    @cached_property
    def text(self) -> str:  # type: ignore[override]
        """Its name."""
        return self.name

    def of(self, motion: Motion) -> float:
        """What the function returns; refused if that is no number.

        Parameters
        ----------
        motion
            The motion.
        """
        number = np.asarray(self.function(motion))
        if number.ndim or number.dtype.kind not in "biuf":
            raise ParameterError(
                f"functions must return a number, and {self.name!r} returned {shown(number)}",
                "functions",
            )
        return float(number)


def own_quantities(system: System, functions: Functions | None) -> tuple[OwnQuantity, ...]:
    """The quantities of functions of the user's own, by their names; refused where one is no
    function.

    Parameters
    ----------
    system
        The system of the motions.
    functions
        The functions by their names; the name of another quantity stands for it.
    """
    if functions is None:
        return ()
    if not isinstance(functions, Mapping):
        raise ParameterError(
            f'functions must be a dictionary, {{"name": function}}, got {shown(functions)}',
            "functions",
        )
    for name, function in functions.items():
        if not isinstance(name, str) or not name.isprintable() or not name.strip():
            raise ParameterError(
                f"functions must have words as names, got {shown(name)}", "functions"
            )
        if not callable(function) and not isinstance(function, str):
            raise ParameterError(
                f"functions must be functions of a motion, and {name!r} is {shown(function)}",
                "functions",
            )
    return tuple(_own(system, name, asked) for name, asked in functions.items())


def _own(system: System, name: str, asked: str | Callable[[Motion], Any]) -> OwnQuantity:
    if callable(asked):
        return OwnQuantity(name, asked)
    other = quantity_of(system, asked)
    return OwnQuantity(name, other.of, other.unit)


def check_new_names(own: Iterable[Quantity], known: Iterable[Any]) -> None:
    """Refuse a function under a name that a result has already.

    Parameters
    ----------
    own
        Quantities of the user's own.
    known
        The names that the result has.
    """
    for quantity in own:
        if quantity.name in set(map(str, known)):
            raise ParameterError(
                f"functions: the result has {quantity.name!r} already; give the function another name",
                "functions",
            )


def unit_of(system: System, displacement: str) -> str:
    """The unit of a coordinate or of a point.

    Parameters
    ----------
    system
        The system.
    displacement
        The name of the coordinate or the point.
    """
    model = system.model
    return str(model.unit_of(displacement)) if displacement in model.coordinates else "1"


def displacements_of(system: System) -> tuple[str, ...]:
    """The displacements whose extrema tables have: the coordinates, the points, and the one that
    the load drives.

    Parameters
    ----------
    system
        The system.
    """
    model = system.model
    names = (*model.coordinates, *model.point_names, driven_displacement(system))
    return tuple(dict.fromkeys(names))


def driven_range(motion: Motion) -> tuple[float, float]:
    """The least and the largest value of what "amplitude" is of: the displacement that the load
    drives, and its mirror image.

    Parameters
    ----------
    motion
        The motion.
    """
    ranges = [motion.range_of(name) for name in driven_displacements(motion.system)]
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def extremes_of(system: System) -> tuple[Extreme, ...]:
    """The largest and the smallest value of each displacement, as tables of results have them.

    Parameters
    ----------
    system
        The system.
    """
    return tuple(
        Extreme(system, kind, (name,), f"{kind}_{name}")
        for name in displacements_of(system)
        for kind in (LARGEST, SMALLEST)
    )


def quantity_of(system: System, which: str | Callable[[Motion], Any]) -> Quantity:
    """A quantity by its name, or a function of a motion.

    Parameters
    ----------
    system
        The system of the motions.
    which
        "amplitude", "highest" or "lowest" of the displacement that the load drives; "amplitude_x",
        "largest_x" or "smallest_x" of a displacement x, of which "x" alone is the amplitude; or a
        function of a motion.

    Raises
    ------
    ParameterError
        There is no such quantity.
    """
    if callable(which):
        return OwnQuantity(getattr(which, "__name__", "function"), which)
    if isinstance(which, str) and which in OF_DRIVEN:
        return Extreme(system, OF_DRIVEN[which], driven_displacements(system), which)
    if not isinstance(which, str):
        raise ParameterError(
            f"a quantity is a name or a function of a motion, got {shown(which)}", "quantity"
        )
    kind, _, displacement = which.partition("_")
    if kind not in TEXTS or system.model.weights_of(displacement) is None:
        kind = AMPLITUDE
        displacement = which
    if system.model.weights_of(displacement) is None:
        known = [*OF_DRIVEN, *displacements_of(system)]
        known += [f"{kind}_{name}" for kind in TEXTS for name in displacements_of(system)]
        raise ParameterError(
            f"there is no quantity {shown(which)}; {near(which, known)}", "quantity"
        )
    return Extreme(system, kind, (displacement,), f"{kind}_{displacement}")
