"""Systems as plain dictionaries, and back: the form in which they are written to files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from saltus.errors import ParameterError, near, shown
from saltus.systems.load import Load
from saltus.systems.pulses import Pulse
from saltus.systems.signals import Constant, Harmonic, Record, Signal, Sum, as_signal


def to_dict(part: Any) -> Any:
    """A model or impact law with its `type`, a load with its channels, a signal by its fields."""
    if isinstance(part, Load):
        frequency = {} if part.frequency is None else {"frequency": part.frequency}
        return {**frequency, **{name: to_dict(signal) for name, signal in part.channels.items()}}
    if isinstance(part, Constant):
        return part.value
    if isinstance(part, Sum):
        return [to_dict(term) for term in part.terms]
    if isinstance(part, Record):
        fields = {"time": part.time.tolist(), "value": part.value.tolist(), "quantity": part.quantity}
        return {**fields, "scale": part.scale, **({"source": part.source} if part.source else {})}
    fields = {f.name: getattr(part, f.name) for f in dataclasses.fields(part)}
    fields = {name: value for name, value in fields.items() if value is not None}
    return fields if isinstance(part, Signal) and not isinstance(part, Pulse) else {"type": type(part).__name__, **fields}


def from_dict(kind: str, data: Any) -> Any:
    """The inverse of `to_dict` for `kind` one of model, load, impact."""
    if not isinstance(data, Mapping):
        raise ParameterError(f"{kind} must be a table of keys and values, got {shown(data)}", kind)
    if kind == "load":
        for name in data:
            if not isinstance(name, str) or not name.isidentifier() or name == "self":
                raise ParameterError(f"load has no channel {shown(name)}", f"load.{shown(name)}")
        channels = {name: read_signal(value, f"load.{name}") for name, value in data.items() if name != "frequency"}
        return Load(frequency=data.get("frequency"), **channels)
    fields = dict(data)
    if "type" not in fields:
        raise ParameterError(f"{kind}.type is missing: it names the {kind}, such as 'Metainterface' or 'VelocityReduction'", kind)
    name = fields.pop("type")
    if not isinstance(name, str):
        raise ParameterError(f"{kind}.type must be a name in quotes, got {shown(name)}", f"{kind}.type")
    from saltus.systems.registry import find  # it imports all models, impact laws and pulses, which writing does not need

    return build(find(kind, name), fields, kind)


def read_signal(data: Any, where: str) -> Any:
    """A number, a table of a `Harmonic`, a `Record` or (with its `type`) a pulse, or a list of them (their sum)."""
    if isinstance(data, (list, tuple)):
        return as_signal([read_signal(item, f"{where}.{i}") for i, item in enumerate(data)], where)
    if isinstance(data, Mapping):
        return build(signal_class(data, where), {key: value for key, value in data.items() if key != "type"}, where)
    return data


def signal_class(data: Mapping[str, Any], where: str) -> type[Signal]:
    """The class of a signal's table: the pulse that its `type` names or, without one, `Record` if it has samples, or `Harmonic`.

    Raises
    ------
    ParameterError
        A type that is no pulse.
    """
    if "type" not in data:
        return Record if "time" in data or "value" in data else Harmonic
    from saltus.systems.registry import PULSES

    name = data["type"]
    if not isinstance(name, str) or name not in PULSES:
        hint = f"{near(str(name), PULSES)} (a harmonic and a record have no type)"
        raise ParameterError(f"{where}.type {shown(name)} is no pulse; {hint}", f"{where}.type")
    return PULSES[name]


def build(cls: type, fields: dict[str, Any], where: str) -> Any:
    """An instance of a dataclass from a table, with unknown and missing keys named."""
    known = {f.name: f for f in dataclasses.fields(cls)}
    for name in fields:
        if name not in known:
            raise ParameterError(f"unknown key {where}.{name:.60}; {near(name, known)}", f"{where}.{name}")
    for name, f in known.items():
        needed = f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
        if needed and name not in fields:
            raise ParameterError(f"{where}.{name} is missing; {cls.__name__} needs it", where)
    try:
        return cls(**fields)
    except ParameterError as error:
        raise error.inside(where) from None
    except (ValueError, TypeError, ArithmeticError) as error:  # a class of the user's own may raise anything
        raise ParameterError(f"{where}: {error}", where) from error
