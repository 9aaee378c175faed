"""A system as its page knows it: names, numbers with their ranges, and where everything is in the
memory of the page's engine.

All of it is read from the model's own declaration and from the types with which the kernels are
compiled. So a user's own model has a page without a line of JavaScript.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import saltus
from saltus.errors import SaltusError
from saltus.flow import PortableMotion, state_names
from saltus.systems import System, children, numbers, stops_of
from saltus.web.objects import KERNEL_DATA, KERNEL_FUNCTIONS, kernel_code, structure_code

FREQUENCY = "load.frequency"


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
    return b"".join(modules), description(motion) | {"engine": engine}


def description(motion: PortableMotion) -> dict[str, Any]:
    """The names and numbers of a system."""
    system = motion.system
    model = motion.system.model
    entries = {number["path"]: number for number in _numbers(system)}
    states = state_names(model.coordinates)
    size = len(model.coordinates)
    units = [model.unit_of(name) for name in model.coordinates]

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
                }
                for i, name in enumerate(model.coordinates)
            ],
            "parameters": below(model, "model"),
            **motion.parts(),
            "stops": list(_stops(system)),
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
                "kind": type(signal).__name__,
                "parameters": below(signal, f"load.{name}"),
            }
            for name, signal in system.load.channels.items()
        ],
        "numbers": list(entries.values()),
        "study": {"system": system.to_dict()},
    }


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


def _numbers(system: System) -> Iterator[dict[str, Any]]:
    """Each number of a system, in the order in which compiled code has them."""
    for path, value in numbers(system):
        unit = _unit(system, path)
        whole = path.endswith(".order")
        reach = math.pi if unit == "rad" else max(1.0, 2.0 * abs(value))
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
        }


def _unit(system: System, path: str) -> str:
    """The unit of a number, as the field that holds it declares it."""
    node: Any = system
    *above, name = path.split(".")
    for part in above:
        node = children(node)[part]
    fields = (
        {field.name: field for field in dataclasses.fields(node)}
        if dataclasses.is_dataclass(node)
        else {}
    )
    return str(fields[name].metadata.get("unit", "")) if name in fields else ""
