"""A system as its page knows it: names, numbers with their ranges, and where everything is in the
memory of the page's engine.

All of it is read from the model's own declaration and from the types with which the kernels are
compiled. So a user's own model has a page without a line of JavaScript.
"""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

import saltus
from saltus.errors import SaltusError, shown
from saltus.flow import PortableMotion, numbers_read, state_names
from saltus.number_ranges import BESIDE, NumberRange, ranges_of
from saltus.systems import (
    Constant,
    Harmonic,
    Signal,
    System,
    called_part,
    children,
    fields_of,
    numbers,
    stops_of,
)
from saltus.web.objects import KERNEL_DATA, KERNEL_FUNCTIONS, kernel_code, structure_code
from saltus.web.slider_ranges import reach_of, start_reaches

FREQUENCY = "load.frequency"
# How far beside its value a number is tried, odd in its digits so that no sentence has them.
BESIDE_IT = 0.0070173
MOST_ROWS = 60  # of a structure that are drawn


def page_parts(system: System) -> tuple[bytes, dict[str, Any]]:
    """The WebAssembly of a system's page, the modules of its kernel and of its structure one behind
    the other, and the description that its engine needs beside it.

    Raises
    ------
    SaltusError
        The equations need what a page does not have, or nothing can be compiled for browsers here.
    """
    motion = PortableMotion(system)
    several = motion.kernel.several
    functions = motion.functions()
    modules = [kernel_code(several), structure_code(functions)]
    engine = motion.layout() | {
        "functions": [KERNEL_FUNCTIONS, [function.name for function in functions]],
        "code_sizes": [len(code) for code in modules],
        "kernel_data": KERNEL_DATA,
    }
    described = description(motion) | {"without_effect": _without_effect(system, functions)}
    return b"".join(modules), described | {"engine": engine}


def _without_effect(system: System, functions: list[Any]) -> list[str]:
    """The numbers that no equation reads, such as the factor of an impact law beside a model with a
    restitution of its own. The frequency of a load is its period, which no equation need read.
    """
    read = numbers_read(functions)
    given = {path for path, _ in numbers(system, given=True)} - {FREQUENCY}
    return [path for i, (path, _) in enumerate(numbers(system)) if path in given and i not in read]


def description(motion: PortableMotion) -> dict[str, Any]:
    """The names and numbers of a system."""
    system = motion.system
    model = motion.system.model
    entries = {number["path"]: number for number in _numbers(system)}
    states = state_names(model.coordinates)
    size = len(model.coordinates)
    units = [model.unit_of(name) for name in model.coordinates]
    reaches = start_reaches(system)

    def below(part: Any, where: str) -> list[str]:
        return [path for path, _ in numbers(part, where, given=True)]

    frequency = (
        [{"channel": "", "kind": "frequency", "parameters": [FREQUENCY]}]
        if FREQUENCY in entries
        else []
    )
    return {
        "version": saltus.__version__,
        "model": {
            "name": type(model).__name__,
            "coordinates": [
                {
                    "name": name,
                    "velocity": f"{name}_velocity",
                    "python_velocity": states[size + i],
                    "unit": units[i],
                    **({"reach": reaches[i]} if reaches else {}),
                }
                for i, name in enumerate(model.coordinates)
            ],
            "parameters": below(model, "model"),
            **motion.parts(),
            "stops": list(_stops(system)),
            "points": _points(model) if isinstance(model, saltus.Structure) else [],
            "channels": list(model.channels),
            "margins": [
                {"name": name, "kind": str(model.margin_kind(name)), "stops": name in model.stops}
                for name in model.margin_names(system.load)
            ],
        },
        "impact": {
            "name": type(system.impact).__name__,
            "parameters": below(system.impact, "impact"),
        },
        "load": frequency
        + [
            {
                "channel": name,
                "kind": _kind(signal),
                "parameters": below(signal, f"load.{name}"),
            }
            for name, signal in system.load.channels.items()
        ],
        "numbers": list(entries.values()),
        "study": {"system": system.to_dict()},
    }


def _kind(signal: Signal) -> str:
    """The name of a signal's class; of a sum of others than constants and harmonics, "Mixture", as
    a page cannot add them."""
    plain = all(isinstance(term, (Constant, Harmonic)) for term in getattr(signal, "terms", ()))
    return type(signal).__name__ if plain else "Mixture"


def _stops(system: System) -> Iterator[dict[str, Any]]:
    """The stops of a model's drawing, with the slopes of their positions to its numbers, and the
    numbers from which these count: a slider moves the wall that is where its number says.
    """
    model = system.model
    first = stops_of(model)
    slopes: list[dict[str, float]] = [{} for _ in first]
    base = dict(numbers(model, "model", given=True))
    for path, value in base.items() if first else ():
        step = 1e-3 * abs(value) or 1e-3
        try:
            moved = stops_of(system.with_({path: value + step}).model)
        except SaltusError:
            continue  # at the end of what it may be
        for own, one, other in zip(slopes, first, moved, strict=True):
            if other.position != one.position:
                own[path] = (other.position - one.position) / step
    for stop, own in zip(first, slopes, strict=True):
        entry = {key: getattr(stop, key) for key in ("coordinate", "position", "side")}
        yield entry | {"slopes": own, "base": {path: base[path] for path in own}}


def _points(model: saltus.Structure) -> list[dict[str, Any]]:
    """What is drawn of a structure: each point's name, its weights of the coordinates, and how it
    is tied to the one before: "spring" where the stiffness couples both rows, "order" for points
    that its author names, or "".

    Its named points, or else the rows of its matrices that are called as those with contacts are,
    so that the rotations of a beam, which have another name, are left out. A contact that is no row
    and no point comes last.
    """
    named = list(model.points)
    local = list(model.coordinates[: model.local_count])
    stems = {_stem(name) for name in local}
    rows = [name for name in model.names if _stem(name) in stems]
    chosen = named or (rows if len(rows) <= MOST_ROWS else [])
    chosen += [name for name in local if name not in chosen]
    stiffness = model.stiffness.array
    found = []
    for before, name in zip([None, *chosen], chosen, strict=False):
        tie = "order" if name in named and before in named else ""
        if not named and before in rows and name in rows:
            coupling = stiffness[model.names.index(before), model.names.index(name)]
            tie = "spring" if coupling != 0.0 else ""
        weights = np.asarray(model.weights_of(name)).tolist()
        found.append({"name": name, "weights": weights, "tie": tie})
    return found


def _stem(name: str) -> str:
    """A name without the digits at its end."""
    return name.rstrip("0123456789")


def _numbers(system: System) -> Iterator[dict[str, Any]]:
    """Each number of a system, in the order in which compiled code has them."""
    given = {path for path, _ in numbers(system, given=True)}
    for path, value in numbers(system):
        holder, field, where = _holder(system, path)
        called, declared = _declared(holder, field)
        unit = declared.unit
        whole = declared.whole
        reach = reach_of(system, path, value, holder, field, declared)
        yield {
            "path": path,
            "name": path.rpartition(".")[2],
            "value": value,
            "unit": unit,
            "angle": unit == "rad",
            "whole": whole,
            "low": value - reach,
            "high": value + reach,
            "step": 1.0 if whole else 10.0 ** (math.floor(math.log10(reach)) - 3),
            "range": _range(system, path, where, called, declared) if path in given else {},
        }


def _holder(system: System, path: str) -> tuple[Any, str, str]:
    """The part of a system that holds a number, its field's name there, and the part's path."""
    node: Any = system
    field = where = ""
    holder: Any = system
    for number, name in enumerate(names := path.split(".")):
        if dataclasses.is_dataclass(node):
            holder = node
            field = name
            where = ".".join(names[:number])
        node = children(node).get(name)
    return holder, field, where


def _declared(holder: Any, field: str) -> tuple[str, NumberRange]:
    """How refusals call a part that has a name of its own, and the range that a field of it
    declares.
    """
    kind: Any = type(holder)
    called = f" of {called_part(holder)}" if "coordinate" in fields_of(kind) else ""
    if field in ranges_of(kind):
        return called, ranges_of(kind)[field]
    # a constant of a load has its channel's path; a field may declare its unit alone
    units = {f.name: f.metadata.get("unit", "") for f in dataclasses.fields(holder)}
    return called, NumberRange(unit=str(units.get(field, "")))


def _range(
    system: System, path: str, where: str, called: str, declared: NumberRange
) -> dict[str, Any]:
    """Which values the page takes for a number, and what it says to others, as Python does:

    * `least` and `most`: their `end`, or the path `of` the number that it is, and whether it is
      `taken`;
    * `demand`, "must lie in (0, pi) rad", and `beside`, "must lie below right = " another number;
    * `only`, the value of a number that may have no other one here, and the sentence.
    """
    ends: dict[str, Any] = {}
    sides = {"above": "least", "at_least": "least", "below": "most", "at_most": "most"}
    for bound, side in sides.items():
        end = getattr(declared, bound)
        if end is not None:
            which = {"of": f"{where}.{end}"} if isinstance(end, str) else {"end": end}
            ends[side] = which | {"taken": bound.startswith("at_")}
    for other, found in ranges_of(_part(system, where)).items():
        for bound, name in found.beside:
            if f"{where}.{name}" == path:
                side = "most" if sides[bound] == "least" else "least"
                bounded = {"of": f"{where}.{other}", "taken": bound.startswith("at_")}
                ends[side] = bounded | ends.get(side, {})
    beside = [
        {
            "side": sides[bound],
            "of": f"{where}.{name}",
            "taken": bound.startswith("at_"),
            "demand": f"{called.lstrip()} must {BESIDE[bound]} {name} = ".lstrip(),
        }
        for bound, name in declared.beside
    ]
    only = _only_value(system, path, declared)
    return {
        **ends,
        "demand": f"{called.lstrip()} {declared.demand}".lstrip(),
        **({"beside": beside} if beside else {}),
        **({"only": only} if only else {}),
    }


def _part(system: System, where: str) -> Any:
    """The class of the part at a path."""
    node: Any = system
    for name in where.split(".") if where else ():
        node = children(node)[name]
    return type(node)


def _only_value(system: System, path: str, declared: NumberRange) -> dict[str, Any] | None:
    """For a number that may have one value alone in this system, such as the restitution of a model
    without impacts: the value, and Python's sentence with marks for another one.
    """
    value = float(system.parameters[path])
    size = max(1.0, abs(value))
    near = [value + step * size for step in (-BESIDE_IT, BESIDE_IT)]
    near = [x for x in near if declared.holds(x)]
    said = [_refusal(system, path, x) for x in near]
    if not near or not all(said):
        return None
    sentence = str(said[0]).replace(shown(near[0]), "{value}").replace(f"{near[0]:g}", "{short}")
    return {"value": value, "said": sentence}


def notice_undeclared(system: System, entries: list[dict[str, Any]]) -> None:
    """Warn where a class of one's own refuses what a slider reaches, as its range is not declared:
    the page would go on where Python does not.
    """
    for entry in entries:
        declared = entry["range"]
        if not declared or "only" in declared:
            continue
        for side, end in (("least", entry["low"]), ("most", entry["high"])):
            refused = None if side in declared else _refusal(system, entry["path"], end)
            if refused:
                text = (
                    f"{refused}: the slider of the page goes there, as the field does not declare"
                    " its range, field(metadata=saltus.number_range(...))"
                )
                warnings.warn(text, UserWarning, stacklevel=4)


def _refusal(system: System, path: str, value: float) -> str | None:
    """Python's sentence where it refuses a value, else None."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # nobody means the values that are tried
            system.with_({path: value})
    except SaltusError as error:
        return str(error)
    return None
