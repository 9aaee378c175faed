"""Systems as plain dictionaries, and back: the form in which they are written to files; and the
types that a file may name.

A new model, impact law or pulse is one new file, one line in the door of this room and one name
here.
"""

from __future__ import annotations

import dataclasses
from collections import UserDict, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import import_module
from typing import Any, TypeVar

import numpy as np

from saltus.errors import ParameterError, SaltusError, near, shown
from saltus.systems.contracts.model import Count, Model, OneContactModel, check_one_contact
from saltus.systems.gap_coordinates import IN_GAPS, fields_of, in_gap_coordinates
from saltus.systems.impact_laws import Coefficients, Factors, ImpactLaw
from saltus.systems.loads.load import Load
from saltus.systems.loads.signals import Constant, Harmonic, Record, Setting, Signal, Sum, as_signal


def children(node: Any) -> dict[str, Any]:
    """The named parts of a part of a system: fields of a dataclass, channels of a load, terms of a
    sum, factors of a law.
    """
    if isinstance(node, Load):
        return {"frequency": node.frequency, **node.channels}
    if isinstance(node, Factors):
        return node.named
    if isinstance(node, Sum):
        return {str(i): term for i, term in enumerate(node.terms)}
    kind: Any = type(node)
    return {name: getattr(node, name) for name in fields_of(kind)}


def is_number(value: Any) -> bool:
    """Whether a leaf is a number of the system; switches, names and counts belong to its
    structure.
    """
    return isinstance(value, (int, float)) and not isinstance(value, (bool, Count, Setting))


def is_fixed(node: Any) -> bool:
    """Whether nothing below `node` can change: frozen classes, arrays that cannot be written, and
    what can be the key of a dictionary."""
    if isinstance(node, np.ndarray):
        return not node.flags.writeable
    settings = getattr(type(node), "__dataclass_params__", None)
    if settings is None or isinstance(node, Factors):
        return type(node).__hash__ is not None
    if not settings.frozen:
        return False
    for part in children(node).values():  # a generator takes three times as long
        if type(part) is not float and not is_fixed(part):
            return False
    return True


def numbers(node: Any, prefix: str = "", given: bool = False) -> Iterator[tuple[str, float]]:
    """Every number below `node` with its dotted path, or all but those that follow from others; a
    `Constant` is the path of its channel."""
    if given and isinstance(node, Coefficients):
        return
    if isinstance(node, Constant):
        yield prefix, node.value
        return
    for name, child in children(node).items():
        path = f"{prefix}.{name}" if prefix else name
        if type(child) is float:
            yield path, child
        elif is_number(child):
            yield path, float(child)
        elif child is not None:
            yield from numbers(child, path, given)


def replace(node: Any, changes: Mapping[str, Any], where: str = "") -> Any:
    """A copy of `node` with the parts at the given dotted paths replaced, all at once, so that
    their order does not matter.

    Where a part and something below it are both given, the part is replaced first. Numbers become
    constant signals where signals stand.

    Raises
    ------
    ParameterError
        A path that leads nowhere; the error names similar ones. A value that the new system
        refuses.
    """
    parts = children(node)
    below = defaultdict[str, dict[str, Any]](dict)
    for path, value in changes.items():
        head, _, rest = str(path).partition(".")
        if head not in parts and not (isinstance(node, Load) and head.isidentifier() and not rest):
            hint = f"{type(node).__name__} has no {shown(head)}; {near(head, children(node))}"
            raise ParameterError(
                f"no parameter {shown(where + str(path))}: {hint}", where + str(path)
            )
        if rest:
            below[head][rest] = value
        else:
            parts[head] = value
    for head, deeper in below.items():
        parts[head] = replace(parts[head], deeper, f"{where}{head}.")
    if isinstance(node, Load):
        return Load(**parts)
    if isinstance(node, Sum):
        return Sum(tuple(as_signal(part, f"{where}{name}") for name, part in parts.items()))
    if isinstance(node, Factors):
        return node.with_values(parts.values())
    try:
        return dataclasses.replace(node, **parts)
    except SaltusError as error:
        raise (
            error.inside(where[:-1]) if where and isinstance(error, ParameterError) else error
        ) from None
    except REFUSALS as error:
        refused = refusal(
            error,
            {str(path).partition(".")[0]: parts[str(path).partition(".")[0]] for path in changes},
        )
        raise (refused.inside(where[:-1]) if where else refused) from error


def differ_in_numbers(one: Any, other: Any, changes: Iterable[str]) -> bool:
    """Whether two parts of systems differ in floating-point numbers alone, so that they have the
    same structure. One is a copy of the other with parts at these dotted paths replaced.
    """
    if type(one) is not type(other):
        return False
    mine, others = children(one), children(other)
    if mine.keys() != others.keys():
        return False
    below = defaultdict[str, list[str]](list)
    for path in changes:
        head, _, rest = str(path).partition(".")
        below[head].append(rest)
    for name, part in mine.items():
        new = others[name]
        if part is new or (type(part) is float and type(new) is float):
            continue
        if name not in below or not children(part):
            return False
        if not differ_in_numbers(part, new, below[name]):
            return False
    return True


# what the checks of a user's own class raise where a number has no meaning
REFUSALS = (ValueError, TypeError, ArithmeticError)


def refusal(error: Exception, given: Mapping[str, Any]) -> ParameterError:
    """The error of a user's own class as a ParameterError, with the name and value of the field
    that it is about.

    That is the field of those `given` with which its sentence begins, or the only one that is
    given.
    """
    sentence = str(error) or type(error).__name__
    name = next(
        (name for name in given if sentence.startswith(f"{name} ")),
        next(iter(given)) if len(given) == 1 else None,
    )
    if name is not None and shown(given[name]) not in sentence:
        sentence += f", got {shown(given[name])}"
    return ParameterError(sentence, name)


def substitute(node: Any, leaf: Callable[[str, float], Any], prefix: str = "") -> Any:
    """A copy of `node` with every number replaced by `leaf(path, number)`, made without checks: for
    tracing.
    """
    twin: Any
    if isinstance(node, Constant):
        twin = object.__new__(Constant)
        object.__setattr__(twin, "value", leaf(prefix, node.value))
        return twin
    parts = {}
    for name, child in children(node).items():
        path = f"{prefix}.{name}" if prefix else name
        parts[name] = (
            leaf(path, float(child)) if is_number(child) else substitute(child, leaf, path)
        )
    if isinstance(node, Load):
        twin = object.__new__(Load)
        object.__setattr__(twin, "frequency", parts.pop("frequency"))
        object.__setattr__(twin, "channels", parts)
        return twin
    if isinstance(node, Sum):
        twin = object.__new__(Sum)
        object.__setattr__(twin, "terms", tuple(parts.values()))
        return twin
    if isinstance(node, Factors):
        return node.with_values(parts.values())
    if not dataclasses.is_dataclass(node):
        return node
    twin = object.__new__(type(node))
    for name, part in parts.items():
        object.__setattr__(twin, name, part)
    return twin


class NamedTypes(UserDict[str, Any]):
    """Classes by their names.

    One of saltus is imported when it is first asked for: a motion needs one model, not all.
    """

    def __getitem__(self, name: str) -> Any:
        if self.data[name] is None:
            self.data[name] = getattr(import_module("saltus"), name)
        return self.data[name]


MODELS = NamedTypes(
    dict.fromkeys(
        (
            "Metainterface",
            "RockingBlock",
            "TwoLayer",
            "WallOscillator",
            "TwoStops",
            "ImpactPair",
            "BeltOscillator",
        )
    )
    | {"CellChain": None, "Structure": None}
)
IMPACTS = NamedTypes(
    dict.fromkeys(
        (
            "VelocityReduction",
            "EnergyRestitution",
            "InelasticImpact",
            "NewtonImpact",
            "PoissonImpact",
        )
    )
)
PULSES = NamedTypes(
    dict.fromkeys(
        (
            "HalfSine",
            "OneSine",
            "OneCosine",
            "MavroeidisPapageorgiou",
            "Ricker",
            "Ramp",
            "Chirp",
            "Pulse",
            "Step",
            "Square",
            "Triangle",
            "Sawtooth",
            "Table",
        )
    )
)

T = TypeVar("T", type[Model], type[ImpactLaw])


def register(cls: T) -> T:
    """Make a model or an impact law of your own known by its class name, so that files can name it;
    use as a decorator.

    Raises
    ------
    ParameterError
        A class that is neither; a model whose sides and reset do not go together.

    Examples
    --------
    >>> saltus.register(saltus.WallOscillator) is saltus.WallOscillator
    True
    """
    if not isinstance(cls, type):
        raise ParameterError(f"register takes a Model or an ImpactLaw, got {shown(cls)}", "cls")
    if issubclass(cls, Model):
        if issubclass(cls, OneContactModel):
            check_one_contact(cls)
        MODELS[cls.__name__] = cls
    elif issubclass(cls, ImpactLaw):
        IMPACTS[cls.__name__] = cls
    else:
        raise ParameterError(f"register takes a Model or an ImpactLaw, got {shown(cls)}", "cls")
    return cls


def find(kind: str, name: str) -> type[Model] | type[ImpactLaw]:
    """The class called `name`, of the `kind` "model" or "impact"."""
    known = MODELS if kind == "model" else IMPACTS
    if name not in known:
        hint = f"{near(name, known)} (one of your own is made known by saltus.register)"
        raise ParameterError(f"{kind}.type {shown(name)} is not known; {hint}", f"{kind}.type")
    found: type[Model] | type[ImpactLaw] = known[name]
    return found


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
        fields = {
            "time": part.time.tolist(),
            "value": part.value.tolist(),
            "quantity": part.quantity,
        }
        named = {name: getattr(part, name) for name in ("interpolation", "source")}
        return {**fields, "scale": part.scale, **{n: text for n, text in named.items() if text}}
    kind: Any = type(part)
    if hasattr(part, "to_table"):
        return {"type": kind.__name__, **part.to_table()}
    fields = {name: getattr(part, name) for name in fields_of(kind)}
    fields = {name: value for name, value in fields.items() if value is not None}
    return fields if isinstance(part, Harmonic) else {"type": kind.__name__, **fields}


def from_dict(kind: str, data: Any) -> Any:
    """The inverse of `to_dict` for `kind` one of model, load, impact."""
    if not isinstance(data, Mapping):
        raise ParameterError(f"{kind} must be a table of keys and values, got {shown(data)}", kind)
    if kind == "load":
        for name in data:
            if not isinstance(name, str) or not name.isidentifier() or name == "self":
                raise ParameterError(f"load has no channel {shown(name)}", f"load.{shown(name)}")
        channels = {
            name: read_signal(value, f"load.{name}")
            for name, value in data.items()
            if name != "frequency"
        }
        return Load(frequency=data.get("frequency"), **channels)
    fields = dict(data)
    if "type" not in fields:
        raise ParameterError(
            f"{kind}.type is missing: it names the {kind}, such as 'Metainterface' or "
            "'VelocityReduction'",
            kind,
        )
    name = fields.pop("type")
    if not isinstance(name, str):
        raise ParameterError(
            f"{kind}.type must be a name in quotes, got {shown(name)}", f"{kind}.type"
        )
    made = build(find(kind, name.removesuffix(IN_GAPS)), fields, kind)
    return in_gap_coordinates(made) if name.endswith(IN_GAPS) else made


def read_signal(data: Any, where: str) -> Any:
    """A number, a table of a `Harmonic`, a `Record` or (with its `type`) a pulse, or a list of them
    (their sum).
    """
    if isinstance(data, (list, tuple)):
        return as_signal([read_signal(item, f"{where}.{i}") for i, item in enumerate(data)], where)
    if isinstance(data, Mapping):
        return build(
            signal_class(data, where),
            {key: value for key, value in data.items() if key != "type"},
            where,
        )
    return data


def signal_class(data: Mapping[str, Any], where: str) -> type[Signal]:
    """The class of a signal's table: the pulse that its `type` names or, without one, `Record` if
    it has samples, or `Harmonic`.

    Raises
    ------
    ParameterError
        A type that is no pulse.
    """
    if "type" not in data:
        return Record if "time" in data or "value" in data else Harmonic
    name = data["type"]
    if not isinstance(name, str) or name not in PULSES:
        hint = f"{near(str(name), PULSES)} (a harmonic and a record have no type)"
        raise ParameterError(f"{where}.type {shown(name)} is not a pulse; {hint}", f"{where}.type")
    found: type[Signal] = PULSES[name]
    return found


def build(cls: type, fields: dict[str, Any], where: str) -> Any:
    """An instance of a dataclass from a table, with unknown and missing keys named."""
    known = {f.name: f for f in dataclasses.fields(cls)}
    for name in fields:
        if name not in known:
            raise ParameterError(
                f"unknown key {where}.{name:.60}; {near(name, known)}", f"{where}.{name}"
            )
    for name, f in known.items():
        needed = f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
        if needed and name not in fields:
            raise ParameterError(f"{where}.{name} is missing; {cls.__name__} needs it", where)
    try:
        return cls(**fields)
    except ParameterError as error:
        raise error.inside(where) from None
    except REFUSALS as error:
        raise refusal(error, fields).inside(where) from error
