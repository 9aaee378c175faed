"""How far the sliders of a page reach: from a number's value, and where that is 0 from the natural
units of the system, so that a gap of 2e-3 m has no slider of a metre.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from saltus.number_ranges import NumberRange
from saltus.systems import NaturalUnits, System, natural_units, numbers

# A system whose natural units lie between these is of order 1, as one without dimensions.
LEAST_UNIT = 0.1
MOST_UNIT = 10.0
OF_VALUE = 2.0  # how many times its value a slider reaches to both sides
# Fields of saltus's own classes that are a length or a speed
LENGTHS = ("position", "wall", "left", "right", "clearance")
SPEEDS = ("ground_speed", "belt_speed")
# Fields of a load of the unit of its channel
OF_CHANNEL = ("value", "amplitude", "mean")
# The natural unit of the units that a field of one's own may declare
OF_UNITS = {
    **dict.fromkeys(("m", "cm", "mm", "um"), "length"),
    **dict.fromkeys(("m/s", "cm/s", "mm/s", "um/s"), "speed"),
    **dict.fromkeys(("s", "ms", "us"), "time"),
    **dict.fromkeys(("kg", "g", "t"), "mass"),
    **dict.fromkeys(("N", "kN", "mN"), "force"),
}


def is_of_order_1(system: System) -> bool:
    """Whether the natural units of a system, as far as it has such, are of order 1."""
    units = natural_units(system)
    found = np.concatenate([units.lengths, units.masses, [units.time]])
    return bool((found >= LEAST_UNIT).all() and (found <= MOST_UNIT).all())


def reach_of(
    system: System, path: str, value: float, holder: Any, field: str, declared: NumberRange
) -> float:
    """How far to both sides of its value the slider of a number reaches, within its bounds.

    Half a turn of an angle. In a system of order 1, and of a number between two numbers, it is 1 or
    twice the value. Else it is twice the value, and for a value of 0 the natural unit of what the
    number measures, or 1 where that is not known.

    Parameters
    ----------
    system
        The system.
    path
        The dotted path of the number.
    value
        Its value.
    holder
        The part of the system that has it.
    field
        The name of its field there.
    declared
        The range that the field declares.
    """
    if declared.unit == "rad":
        return math.pi
    ends = (declared.above, declared.at_least), (declared.below, declared.at_most)
    between = all(any(isinstance(end, (int, float)) for end in side) for side in ends)
    if between or declared.whole or is_of_order_1(system):
        return max(1.0, OF_VALUE * abs(value))
    if value != 0.0:
        return OF_VALUE * abs(value)
    size = _natural_size(system, path, holder, field, declared.unit)
    return _short(size) if size is not None and 0.0 < size < math.inf else 1.0


def start_reaches(system: System) -> list[list[float]]:
    """How far the sliders of each coordinate's start and its velocity reach at least; nothing in a
    system of order 1, where a page has a number of its own for it."""
    units = natural_units(system)
    if is_of_order_1(system):
        return []
    both = OF_VALUE * np.stack([units.lengths, units.speeds], axis=1)
    return [[_short(x) for x in row] for row in both]


def _short(size: float) -> float:
    """A size of two digits, so that the ends of a slider fit into their boxes."""
    return float(f"{size:.1e}")


def _natural_size(system: System, path: str, holder: Any, field: str, unit: str) -> float | None:
    """The natural unit of what a number measures, or None where that is not known."""
    units = natural_units(system)
    converts = {
        f.name: f.metadata.get("converts")
        for f in (dataclasses.fields(holder) if dataclasses.is_dataclass(holder) else ())
    }.get(field)
    if converts == "time":
        return _unit(units, "time")
    if path.startswith("load."):
        return _size_in_channel(system, path, holder, field)
    if type(holder).__module__.partition(".")[0] == "saltus":
        names = list(system.model.coordinates)
        coordinate = getattr(holder, "coordinate", None)
        if field in LENGTHS and units.has_length:
            if isinstance(coordinate, str) and coordinate in names:
                return float(units.lengths[names.index(coordinate)])
            return units.length
        if field in SPEEDS:
            return _unit(units, "speed")
    return _unit(units, OF_UNITS.get(unit, ""))


def _size_in_channel(system: System, path: str, holder: Any, field: str) -> float | None:
    """The largest number of the same load channel, and else the natural force, displacement or
    acceleration."""
    channel = path.split(".")[1]
    if field not in OF_CHANNEL and path != f"load.{channel}":
        return None
    below = numbers(system.load.channels[channel], f"load.{channel}", given=True)
    largest = max(
        (
            abs(x)
            for other, x in below
            if other == f"load.{channel}" or other.rpartition(".")[2] in OF_CHANNEL
        ),
        default=0.0,
    )
    if largest > 0.0:
        return largest
    ground = channel.startswith("ground")
    kinds = {"displacement": "length", "velocity": "speed", "acceleration": "acceleration"}
    kind = kinds.get(str(getattr(holder, "quantity", "displacement")), "") if ground else "force"
    return _unit(natural_units(system), kind)


def _unit(units: NaturalUnits, kind: str) -> float | None:
    """A natural unit by its name, or None where the system itself has none of it."""
    known = {
        "length": units.has_length,
        "time": units.has_time,
        "mass": True,
        **dict.fromkeys(("speed", "acceleration", "force"), units.has_length and units.has_time),
    }
    if not known.get(kind, False):
        return None
    return float(units.masses.max()) if kind == "mass" else float(getattr(units, kind))
