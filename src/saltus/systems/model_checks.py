"""The checks of a model that are made when a system is made of it, so that none fails only when it
is first simulated.
"""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Mapping
from importlib import import_module
from types import FunctionType
from typing import Any

import numpy as np

from saltus.errors import ParameterError, SaltusError, shown
from saltus.systems.contracts.contact_model import (
    MOST_CONTACTS,
    MOST_FRICTIONS,
    MOST_MULTIPLIERS,
    Contact,
    ContactModel,
    Friction,
    Relay,
    Surface,
    sides_for,
)
from saltus.systems.contracts.model import (
    SCALES,
    Jet,
    Model,
    OneContactModel,
    as_given,
    check_one_contact,
    is_function,
)
from saltus.systems.gap_coordinates import InGapCoordinates
from saltus.systems.gap_places import INVERSE, Part
from saltus.systems.impact_laws import ImpactLaw, check_paradox
from saltus.systems.loads.load import DeclaredLoad, Load

# The parts of the contracts of the two siblings: a class that defines one of them and is of neither
# has the wrong base.
OWN_PARTS = {
    OneContactModel: ("sides", "gap", "reset", "inelastic_factor"),
    ContactModel: (
        "contacts",
        "frictions",
        "surfaces",
        "force",
        "mass_matrix",
        "normal_forces",
        "transfers",
        "after_impact",
    ),
}
# What may be rounding in a gap at the contact, relative to its rate, and in entries of a mass
# matrix; a mistake is larger.
MODEL_ROUNDING = 1e-9
# The least eigenvalue of a mass matrix whose diagonal is scaled to 1; of a smaller one it is rounding.
SINGULAR = 1e-14
MOST_SHOWN = 4  # of the masses, in an error
FEW = 6  # coordinates, whose matrix is eliminated without an array, which takes microseconds
# time, coordinate and velocity at which a model's answers are counted: any numbers would do
PROBE = (0.37, 0.21, 0.13)


def check_works(model: Model) -> bool:
    """Refuse a model that cannot be simulated: parts of another class of models, parts that are
    missing or of the wrong size.

    Returns whether contacts or surfaces of it are of sums of coordinates.

    Raises
    ------
    ParameterError
        The error names the class and what is wrong.
    """
    sums = False
    if type(model) not in _known:
        _check_class(type(model))
        _check_attributes(model)
    if model.first_order or type(model) not in _known:
        _check_first_order(model)
    if isinstance(model, OneContactModel):
        check_one_contact(model)
    if isinstance(model, ContactModel):
        sums = check_contact_model(model)
    if type(model) not in _known:
        _probe(model)
        _known.add(type(model))
    return sums


# classes of which one model has passed, as systems are made by the thousand
_known = set[type[Model]]()


def check_traces(system: Any) -> None:
    """Refuse a system of one's own class whose equations cannot be traced, or are others for
    symbols than for numbers, when it is made.

    The tracer is in a room above this one, which is asked by its name.

    Raises
    ------
    TraceError, ParameterError
        The error says what cannot be traced, and what to write instead.
    """
    kind = type(system.model)
    if kind in _traced or kind.__module__.partition(".")[0] == "saltus":
        return
    if kind.__hash__ is None and not getattr(kind, "__dataclass_fields__", {}):
        raise ParameterError(
            f"{kind.__name__} is not frozen, so its numbers could change unseen: write "
            f"@dataclass(frozen=True, kw_only=True) above class {kind.__name__}",
            "model",
        )
    taylor = import_module("saltus.taylor")
    taylor.check_agreement(system, taylor.trace(system))
    _traced.add(kind)


_traced = set[type[Model]]()  # classes of which one system could be traced


def _check_class(kind: type[Model]) -> None:
    """Refuse a class that lacks its equation of motion, or has parts that only another class of
    models has.
    """
    _check_fields(kind)
    numbers = getattr(kind, "__dataclass_fields__", {})  # `gap` may be a clearance
    for base, parts in OWN_PARTS.items():
        given = [
            name
            for name in parts
            if name not in numbers
            and getattr(kind, name, ()) not in ((), getattr(Model, name, None))
        ]
        if given and not issubclass(kind, base):
            raise ParameterError(
                f"{kind.__name__} defines {given[0]}, so its base class must be"
                f" saltus.{base.__name__}, not {kind.__mro__[1].__name__}",
                "model",
            )
    if issubclass(kind, ContactModel):
        if kind.force is ContactModel.force and kind.acceleration is ContactModel.acceleration:
            raise ParameterError(
                f"{kind.__name__} must define force(t, q, velocity, load)", "model"
            )
    elif kind.acceleration is Model.acceleration:
        raise ParameterError(
            f"{kind.__name__} must define acceleration(t, q, velocity, side, load)", "model"
        )
    for base in (each for each in (Model, OneContactModel, ContactModel) if issubclass(kind, each)):
        for name, function in vars(base).items():
            if isinstance(function, FunctionType) and not name.startswith("_"):
                _check_arguments(kind, name, function)


def _check_attributes(model: Model) -> None:
    """Refuse numbers that a class of its own `__init__` keeps: they are no parameters, and are in no
    file.
    """
    kind = type(model)
    if getattr(kind, "__dataclass_fields__", {}):
        return
    lost = [
        name
        for name in getattr(model, "__dict__", {})
        if not name.startswith("_") and not hasattr(kind, name)
    ]
    if lost:
        raise ParameterError(
            f"{kind.__name__} is not a dataclass, so {', '.join(lost)} would not be a parameter:"
            f" write @dataclass(frozen=True, kw_only=True) above class {kind.__name__}, and its"
            f" numbers as fields, such as {lost[0]}: float, in place of __init__",
            "model",
        )


def _check_fields(kind: type[Model]) -> None:
    """Refuse numbers of a class that is no dataclass, and those whose names are those of methods
    of its own contract.
    """
    fields: dict[str, Any] = getattr(kind, "__dataclass_fields__", {})
    given = {
        name
        for name, what in vars(kind).get("__annotations__", {}).items()
        if "ClassVar" not in str(what)
    }
    if lost := sorted(given - fields.keys()):
        raise ParameterError(
            f"{kind.__name__} is not a dataclass, so {', '.join(lost)} would not be a parameter: "
            f"write"
            f" @dataclass(frozen=True, kw_only=True) above class {kind.__name__}",
            "model",
        )
    contracts = (base for base in (Model, OneContactModel, ContactModel) if issubclass(kind, base))
    for base in contracts:
        for name in fields:
            if isinstance(vars(base).get(name), FunctionType):
                raise ParameterError(
                    f"{kind.__name__} has a number named {name}, which is the name of a method of"
                    f" saltus.{base.__name__}: rename it, such as {name}_size",
                    f"model.{name}",
                )


def _check_arguments(kind: type[Model], name: str, function: FunctionType) -> None:
    """Refuse a method that does not take the arguments of the contract's."""
    wanted = list(inspect.signature(function).parameters)
    if name == "force" and getattr(kind, "surfaces", ()) not in ((), Model.surfaces):
        wanted.append("sides")
    try:
        inspect.signature(getattr(kind, name)).bind(*wanted)
    except TypeError:
        raise ParameterError(
            f"{kind.__name__}.{name} must take the arguments {', '.join(wanted)}", "model"
        ) from None


def _check_first_order(model: Model) -> None:
    """Refuse coordinates of first order that are not the last ones, and those of which a part of
    the model needs the velocity.
    """
    kind = type(model).__name__
    names = model.coordinates
    given = model.first_order
    if isinstance(given, str) or given != names[len(names) - len(given) :]:
        raise ParameterError(
            f"{kind}.first_order must be a tuple of the last of the coordinates {', '.join(names)},"
            f" such as ({names[-1]!r},), got {shown(given)}",
            "model",
        )
    if given and model.sides:
        raise ParameterError(
            f"{names[0]} of {kind} is of first order, so it has no velocity with which to hit a"
            " contact",
            "model",
        )
    jumps = isinstance(model, ContactModel) and model.jumps
    if jumps and not (given and model.contacts):
        what = (
            "no contact"
            if given
            else "no coordinate of first order, such as first_order = ('voltage',)"
        )
        raise ParameterError(f"{kind} defines after_impact and has {what}: leave it out", "model")
    parts: tuple[Contact | Friction | Surface | Relay, ...] = (
        *model.contacts,
        *model.frictions,
        *model.surfaces,
    )
    if given and model.has_multipliers:
        raise ParameterError(
            f"{kind} has {given[0]}, of first order, beside a distance or a rate: models with these"
            " have coordinates with velocities of their own so far",
            "model",
        )
    for part in parts if given else ():
        if part.coordinate is None:
            continue
        terms = [part.coordinate] if isinstance(part.coordinate, str) else list(part.coordinate)
        held = [name for name in terms if name in getattr(model, "own_class", model).first_order]
        if held and not (isinstance(part, Surface) and len(terms) == 1):
            what = type(part).__name__.lower()
            raise ParameterError(
                f"the {what} {part.name!r} of {kind} holds {held[0]}, which is of first order and"
                " has no velocity that could stop; a surface may have one such coordinate alone",
                "model",
            )
    if jumps and isinstance(model, InGapCoordinates) and any(model.gap_sums()[1]):
        raise ParameterError(
            f"{kind} has a wall that moves, at which after_impact is not told its velocity: leave"
            " it out",
            "model",
        )


def _check_rates(model: Model) -> None:
    """Refuse functions that read the velocity of a coordinate of first order, which is to follow
    from the state.
    """
    size = len(model.coordinates)
    moving = len(model.moving)
    t, q, v = PROBE
    load = DeclaredLoad(Load(frequency=1.0), model)

    def is_known(method: str, unknown: float) -> bool:
        state = [(q,) * size, (v,) * moving + (unknown,) * (size - moving)]
        place, speed = (x[0] if size == 1 else x for x in state)
        rest = {
            "force": (load, *sides_for(model, t, place, speed, load)),
            "normal_forces": (load,),
            "margins": (speed, 1, load),
        }
        arguments = (
            (model.contacts[0].name, place, speed)
            if method == "after_impact"
            else (t, place, speed)
        )
        found = _asked(
            model,
            method,
            *arguments,
            *rest.get(method, () if method == "after_impact" else (1, load)),
        )
        values = list(found.values()) if isinstance(found, dict) else found
        return found is None or bool(np.isfinite(np.asarray(values, dtype=float)).all())

    methods = ["acceleration", "margins"] + ["kinetic_energy"] * (
        type(model).kinetic_energy is not Model.kinetic_energy
    )
    if isinstance(model, ContactModel):
        methods = ["force", "normal_forces", *methods] + ["after_impact"] * bool(model.contacts)
    for contact in model.contacts if model.first_order else ():
        found = _asked(model, "after_impact", contact.name, (q,) * size, (v,) * size)
        wanted = size - moving
        if found is not None and (len(found) if _is_row(found) else 1) != wanted:
            names = ", ".join(model.first_order)
            raise ParameterError(
                f"{type(model).__name__}.after_impact must return {wanted} value(s), of {names},"
                f" got {shown(found)}",
                "model",
            )
    for method in methods:
        if is_known(method, v) and not is_known(method, math.nan):
            names = " or ".join(model.first_order)
            raise ParameterError(
                f"{type(model).__name__}.{method} reads the velocity of {names}, which is of first"
                " order: its velocity is what the model returns for it, so take the terms of that",
                "model",
            )


def check_contact(model: OneContactModel, impact: ImpactLaw) -> None:
    """Refuse a gap that is not 0 at `contact`, and a reset that sends the motion beyond the
    contact.

    Raises
    ------
    ParameterError
        The error has the numbers.
    """
    point = float(model.contact)
    name = type(model).__name__
    rates = {
        side: float(model.gap(point + 0.5, side)) - float(model.gap(point - 0.5, side))
        for side in model.sides
    }
    for side, rate in rates.items():
        at = float(model.gap(point, side))
        if rate == 0.0:
            raise ParameterError(
                f"{name}.gap must depend on the coordinate, such as side * (x - d)", "model"
            )
        if abs(at) > MODEL_ROUNDING * abs(rate):
            raise ParameterError(
                f"{name}.gap must be 0 at {name}.contact = {point:g}, got {at:g} on side {side};"
                " give both",
                "model",
            )
        # a slow impact: a law may have no meaning for fast ones
        before = -math.copysign(PROBE[2], rate)
        answer = _asked(model, "reset", 0.0, before, side, Load(), impact)
        if answer is None:
            continue
        following, after = answer
        if rates.get(int(following), 0.0) * after < 0.0:
            raise ParameterError(
                f"{name}.reset sends the motion beyond the contact: on side {side} the velocity"
                f" {before:g} becomes {float(after):g} on side {int(following)}; velocities are"
                " rates of the coordinate, and "
                + (
                    "a bounce turns the sign of what impact.velocity_after returns"
                    if following == side
                    else "a passage keeps it"
                ),
                "model",
            )


def _why_not_both(a: Contact, b: Contact) -> str:
    """Why one coordinate cannot have both contacts: they leave no room, or one hides the other."""
    if a.sign != b.sign:
        return f"the contacts {a.name!r} and {b.name!r} leave {a.coordinate} no room between them"
    near, far = (b, a) if b.gap(a.position) < 0.0 else (a, b)
    return (
        f"the contacts {near.name!r} and {far.name!r} stop {a.coordinate} on one side, and"
        f" {near.name!r} at {float(near.position):g} always comes first: leave {far.name!r} out"
    )


def check_contact_model(model: ContactModel) -> bool:
    """Refuse contacts and frictions that have no meaning; returns whether there are sums of
    coordinates among them.

    Raises
    ------
    ParameterError
        Sides; too many parts or two of one name; an unknown coordinate, or one that two parts hold;
        a sum of coordinates without meaning; two contacts that leave no room; a coefficient of
        friction below 0; mu_s < mu_k.
    """
    contacts = model.contacts
    frictions = model.frictions
    kind = type(model).__name__
    if model.sides:
        raise ParameterError(
            f"{kind} is a ContactModel, so it has no sides: leave them out", "model"
        )
    rows = len(frictions) + len(model.surfaces)
    most = MOST_FRICTIONS if model.rubs_in_contacts else MOST_CONTACTS - 2 * rows
    if model.has_multipliers:
        most = min(most, MOST_MULTIPLIERS)
    given = (("frictions and surfaces", rows, MOST_FRICTIONS), ("contacts", len(contacts), most))
    for what, count, most in given:
        if count > most:
            raise ParameterError(
                f"{kind} has {count} {what}, and at most {most} can be followed", "model"
            )
    parts: tuple[Contact | Surface | Relay, ...] = (*contacts, *model.surfaces)
    names = [*(part.name for part in parts), *(friction.name for friction in frictions)]
    if len(set(names)) < len(names):
        raise ParameterError(
            f"contacts, frictions and surfaces of {kind} must have names of their own, got"
            f" {', '.join(names)}",
            "model",
        )
    for contact in parts:
        if isinstance(contact, Contact) and contact.distance is not None:
            _check_method(model, contact, contact.distance, DISTANCE)
            continue
        if not isinstance(contact, Contact) and contact.function is not None:
            for name in contact.methods:
                _check_method(model, contact, name, RATE)
            continue
        if isinstance(contact.coordinate, str) and contact.coordinate not in model.coordinates:
            known = ", ".join(model.coordinates)
            what = _named(contact)
            raise ParameterError(f"{what} {contact.coordinate!r}, but {kind} has {known}", "model")
        if not isinstance(contact.coordinate, str):
            _check_sum(model, contact)
    for a in contacts:
        for b in contacts:
            if (
                a is not b
                and a.coordinate is not None
                and a.coordinate == b.coordinate
                and not (a.sign != b.sign and b.gap(a.position) > 0.0)
            ):
                raise ParameterError(_why_not_both(a, b), "model")
    _check_frictions(model)
    _check_mass(model)
    placed = [part for part in (*parts, *frictions) if part.coordinate is not None]
    sums = any(not isinstance(part.coordinate, str) for part in placed)
    _check_resets(model, sums)
    if model.has_multipliers:
        _check_surfaces(model)
        return False
    if model.rubs_in_contacts and not sums:
        check_paradox(model)
    return sums


def _check_resets(model: ContactModel, sums: bool) -> None:
    """Refuse a reset that gives no state, and one beside parts that are no single coordinates."""
    kind = type(model).__name__
    if model.resets and (sums or model.has_multipliers):
        what = "a distance or a rate" if model.has_multipliers else "a sum of coordinates"
        raise ParameterError(
            f"the surface {model.resets[0]!r} of {kind} has an after_event beside {what}: there a"
            " reset of the state is not followed so far",
            "model",
        )
    for surface in model.surfaces:
        if surface.after_event is not None:
            _check_reset(model, surface, surface.after_event)


def _check_reset(model: ContactModel, surface: Any, name: str) -> None:
    """Refuse a reset that is no method of the model, or does not return all coordinates and all
    velocities."""
    size = len(model.coordinates)
    found = _check_method(model, surface, name, RATE, resets=True)
    if found is None:
        return
    wanted = "a number" if size == 1 else f"{size} numbers"
    both = _is_row(found) and len(found) == 2
    if not both or any(_size_of(part) != wanted for part in found):
        raise ParameterError(
            f"{type(model).__name__}.{name} must return the coordinates and the velocities after"
            f" the event, each {wanted}, got {shown(found)}",
            "model",
        )


def _check_surfaces(model: ContactModel) -> None:
    """Refuse surfaces of sums beside distances and rates."""
    kind = type(model).__name__
    for surface in model.surfaces:
        if not isinstance(surface.coordinate, str) and surface.function is None:
            raise ParameterError(
                f"the surface {surface.name!r} of {kind} is of a sum: beside a distance or a rate"
                " it must be of one coordinate so far",
                "model",
            )


# The arguments of the methods that a contact's `distance` names, and a friction's `rate` or a
# surface's `function`.
DISTANCE = ("t", "q", "load")
RATE = ("t", "q", "velocity", "load")


def _check_method(
    model: ContactModel, part: Any, name: str, arguments: tuple[str, ...], resets: bool = False
) -> Any:
    """Refuse a distance or a rate that is no method of the model with its arguments, and one that
    gives no number, but for what `resets` the state. What it answers; None where it has no
    value."""
    kind = type(model).__name__
    method = getattr(model, name, None)
    takes_them = callable(method) and not hasattr(ContactModel, name)
    try:
        inspect.signature(method).bind(*arguments)  # type: ignore[arg-type]
    except TypeError:
        takes_them = False
    if not takes_them:
        raise ParameterError(
            f"the {type(part).__name__.lower()} {part.name!r} needs a method"
            f" {name}({', '.join(arguments)}) of {kind}",
            "model",
        )
    size = len(model.coordinates)
    t, q, v = PROBE
    place, speed = (x if size == 1 else tuple(x / (1 + i) for i in range(size)) for x in (q, v))
    load = DeclaredLoad(Load(frequency=1.0), model)
    given = {"t": t, "q": place, "velocity": speed, "load": load}
    found = _asked(model, name, *(given[each] for each in arguments))
    if found is not None and _is_row(found) and not resets:
        raise ParameterError(f"{kind}.{name} must return a number, got {shown(found)}", "model")
    return found


def _check_frictions(model: ContactModel) -> None:
    """Refuse frictions on coordinates that they cannot hold, or with coefficients without
    meaning.
    """
    kind = type(model).__name__
    taken = list[Any]()
    pressed = [friction.contact for friction in model.frictions]
    without_place = [friction.name for friction in getattr(model, "left_out", ())]
    placed = [each for each in model.frictions if each.name not in without_place]
    along = [friction.coordinate for friction in placed]
    for friction in placed:
        where = f"the friction {friction.name!r} of {kind}"
        if friction.coordinate is None:
            _check_method(model, friction, str(friction.rate), RATE)
        elif isinstance(friction.coordinate, str) and friction.coordinate not in model.coordinates:
            raise ParameterError(
                f"{where} acts along {friction.coordinate!r}, which is none of "
                f"{', '.join(model.coordinates)}",
                "model",
            )
        elif not isinstance(friction.coordinate, str):
            _check_sum(model, friction)
        if not model.has_multipliers and friction.coordinate in taken:
            raise ParameterError(
                f"{where} and another one act along {friction.coordinate}: a coordinate can have one;"
                " in place of its coordinate each may have a rate, a method of the model",
                "model",
            )
        if friction.contact is not None and friction.contact not in [
            contact.name for contact in model.contacts
        ]:
            raise ParameterError(
                f"{where} is in the contact {shown(friction.contact)}, which {kind} does not have",
                "model",
            )
        if friction.contact is not None and pressed.count(friction.contact) > 1:
            raise ParameterError(
                f"{where} is in the contact {friction.contact!r}, which has a friction already: a "
                f"contact can have one",
                "model",
            )
        for other in (c for c in model.contacts if c.name == friction.contact):
            if not model.has_multipliers and other.coordinate in along:
                way = f"along whose coordinate {other.coordinate} a friction acts: take another one"
                raise ParameterError(f"{where} is in the contact {other.name!r}, {way}", "model")
        if friction.stribeck_speed is not None and not float(friction.stribeck_speed) > 0.0:
            raise ParameterError(
                f"{where} must have stribeck_speed > 0, got {float(friction.stribeck_speed):g}",
                "model",
            )
        if not 0.0 <= float(friction.kinetic) <= float(friction.most):
            pair = f"kinetic = {float(friction.kinetic):g} and static = {float(friction.most):g}"
            raise ParameterError(f"{where} must have 0 <= kinetic <= static, got {pair}", "model")
        taken.append(friction.coordinate)


def _check_mass(model: ContactModel) -> None:
    """Refuse a mass matrix of another size than the coordinates have, or one that is not
    symmetric.
    """
    names = model.coordinates
    kind = type(model)
    size = len(names)
    if kind.mass_matrix is ContactModel.mass_matrix:
        return
    found = _asked(
        model,
        "mass_matrix",
        PROBE[1] if size == 1 else tuple(PROBE[1] / (1 + i) for i in range(size)),
    )
    if found is None:
        return
    fitting = (
        ("a number", "1 row of 1 number") if size == 1 else (f"{size} rows of {size} numbers",)
    )
    if _size_of(found) not in fitting:
        wanted = (
            "a number or [[M]], as there is one coordinate"
            if size == 1
            else f"{size} rows of {size} numbers, for {', '.join(names)}"
        )
        raise ParameterError(
            f"{kind.__name__}.mass_matrix must return {wanted}, got {_size_of(found)}", "model"
        )
    moving = len(model.moving)
    others = (
        [[float(found[i][j]) - (i == j) for j in range(size)] for i in range(moving, size)]
        if size > 1
        else []
    )
    if np.any(others) or (size > moving and size == 1):
        what = f"{', '.join(model.first_order)}, which have no inertia"
        raise ParameterError(
            f"{kind.__name__}.mass_matrix must have the rows of the unit matrix for {what}", "model"
        )
    if model.jumps and size > 1:
        other = _asked(
            model,
            "mass_matrix",
            tuple(PROBE[1] / (1 + i) if i < moving else PROBE[2] for i in range(size)),
        )
        if other is None or not np.array_equal(
            np.array(found, dtype=float), np.array(other, dtype=float)
        ):
            jumping = ", ".join(model.first_order)
            raise ParameterError(
                f"{kind.__name__}.mass_matrix depends on {jumping}, which jumps at impacts: leave"
                " one out",
                "model",
            )
    for i, j in itertools.combinations(range(size), 2):
        a = found[i][j]
        b = found[j][i]
        if a is b or a == b:  # as they are nearly always
            continue
        a, b = float(a), float(b)
        if abs(a - b) > MODEL_ROUNDING * max(abs(a), abs(b)):
            raise ParameterError(
                f"{kind.__name__}.mass_matrix must be symmetric, got {a:g} for {names[i]},"
                f" {names[j]} and {b:g} for {names[j]}, {names[i]}",
                "model",
            )
    _check_definite(model, found)


def _check_definite(model: ContactModel, found: Any) -> None:
    """Refuse a mass matrix that is not positive definite: a mass of 0, below it or nan.

    One that depends on the coordinates may be so beyond the model's own range: it is refused where
    it is so at several places.
    """
    if type(model).__module__.partition(".")[0] == "saltus":
        return  # these check their numbers themselves
    size = len(model.coordinates)
    if size <= FEW and has_pivots(found, size):
        return
    matrix = as_matrix(found, size)
    if matrix is None or is_definite(matrix):
        return
    for share in (0.0, -0.7, 3.1):
        other = _asked(
            model,
            "mass_matrix",
            share if size == 1 else tuple(share / (1 + i) for i in range(size)),
        )
        beside = None if other is None else as_matrix(other, size)
        if beside is not None and is_definite(beside):
            return
    entries = ", ".join(
        f"{matrix[i, i]:g} for {name}" for i, name in enumerate(model.coordinates[:MOST_SHOWN])
    )
    raise ParameterError(
        f"{type(model).__name__}.mass_matrix must be positive definite, with all masses above 0;"
        f" got one that is not, with {entries} on its diagonal",
        "model",
    )


def has_pivots(found: Any, size: int) -> bool:
    """Whether the elimination of a few numbers finds all pivots above rounding, without an array.

    Parameters
    ----------
    found
        A number or rows of numbers.
    size
        The number of coordinates.
    """
    try:
        rows = [[float(found)]] if size == 1 else [[float(x) for x in row] for row in found]
    except (TypeError, ValueError):
        return False
    least = [SINGULAR * abs(rows[k][k]) for k in range(size)]
    for k in range(size):
        pivot = rows[k][k]
        if not least[k] < pivot < math.inf:
            return False
        for i in range(k + 1, size):
            factor = rows[i][k] / pivot
            for j in range(k + 1, size):
                rows[i][j] -= factor * rows[k][j]
    return True


def as_matrix(found: Any, size: int) -> np.ndarray | None:
    """What `mass_matrix` returns, as an array; None if it has other entries than numbers.

    Parameters
    ----------
    found
        A number or rows of numbers.
    size
        The number of coordinates.
    """
    try:
        return np.array(found, dtype=float).reshape(size, size)
    except (TypeError, ValueError):
        return None


def is_definite(matrix: np.ndarray) -> bool:
    """Whether a symmetric matrix is positive definite, by more than rounding.

    Parameters
    ----------
    matrix
        The matrix, (n, n).
    """
    diagonal = np.diagonal(matrix)
    if not (np.isfinite(matrix).all() and (diagonal > 0.0).all()):
        return False
    # units of coordinates and masses do not matter
    roots = np.sqrt(diagonal)
    with np.errstate(all="ignore"):
        scaled = matrix / roots / roots[:, None]
    return bool(np.linalg.eigvalsh(scaled)[0] > SINGULAR)


def _size_of(found: Any) -> str:
    """The size of what a method returns, in words."""
    if not _is_row(found):
        return "a number"
    rows = {len(row) if _is_row(row) else 0 for row in found}
    if rows == {0}:
        return f"{len(found)} number{'s' * (len(found) != 1)}"
    return (
        f"{len(found)} row{'s' * (len(found) != 1)} of {' and '.join(map(str, sorted(rows)))}"
        f" number{'s' * (rows != {1})}"
    )


def _is_row(found: Any) -> bool:
    return isinstance(found, (tuple, list)) or (isinstance(found, np.ndarray) and found.ndim > 0)


def _check_sum(model: ContactModel, contact: Part) -> None:
    """Refuse a sum of coordinates and displacements of the ground that a contact cannot keep on one
    side.
    """
    names = model.coordinates
    given = contact.coordinate
    where = f"the {type(contact).__name__.lower()} {contact.name!r} of {type(model).__name__}"
    if not isinstance(given, Mapping) or not given:
        raise ParameterError(
            f"{where} must be given a coordinate, or a dictionary such as {{'y': 1.0, 'x': -1.0}},"
            f" got {shown(given)}",
            "model",
        )
    grounds = [channel for channel in model.channels if channel.startswith("ground")]
    for name, factor in given.items():
        own = (
            is_function(model, name)
            and callable(getattr(model, name, None))
            and not hasattr(ContactModel, name)
        )
        if name not in (*names, *grounds) and not own:
            known = ", ".join((*names, *grounds))
            reason = (
                " (a wall moves with a channel whose name begins with ground, as those are"
                " displacements)"
            )
            no_function = f" and no function {name}(q) of {type(model).__name__}"
            raise ParameterError(
                f"{_named(contact)} {shown(name)}, none of"
                f" {known}{reason if name in model.channels else no_function}",
                "model",
            )
        if own and hasattr(model, name + INVERSE):
            _check_inverse(model, name)
        if not (isinstance(factor, (int, float)) and math.isfinite(factor) and factor != 0.0):
            raise ParameterError(
                f"{where} must have coefficients that are numbers other than 0, got {shown(factor)}"
                f" of {name}",
                "model",
            )
    if all(name in grounds for name in given):
        raise ParameterError(
            f"{_named(contact)} {', '.join(given)} and no coordinate of {', '.join(names)}", "model"
        )
    if type(model).acceleration is not ContactModel.acceleration:
        raise ParameterError(
            f"{_named(contact)} a sum of coordinates, so {type(model).__name__} must define force,"
            " not acceleration",
            "model",
        )


def _check_inverse(model: ContactModel, name: str) -> None:
    """Refuse an inverse that is none, and one of a function that falls with its coordinate."""
    for x in SCALES:
        value = _asked(model, name, as_given([x] * len(model.coordinates)))
        found = None if value is None else _asked(model, name + INVERSE, value)
        again = (
            None
            if found is None
            else _asked(model, name, as_given([Jet(found, 1.0)] * len(model.coordinates)))
        )
        if again is not None and (again.first < 0.0 or abs(again.value - value) > MODEL_ROUNDING):
            what = (
                f"{type(model).__name__}.{name}{INVERSE} must give the coordinate at which {name}"
                " has a value"
            )
            raise ParameterError(
                f"{what}, where {name} rises with it, and gives {found:g} for {float(value):g}",
                "model",
            )


def _named(part: Contact | Surface | Friction) -> str:
    """What a part is called, with the verb for what it does to its coordinate: a motion passes a
    surface.
    """
    verb = (
        "holds"
        if isinstance(part, Contact)
        else "rubs on"
        if isinstance(part, Friction)
        else "is of"
    )
    return f"the {type(part).__name__.lower()} {part.name!r} {verb}"


def _probe(model: Model) -> None:
    """Refuse a model whose equations fail at a state by a mistake of its author, or have other
    sizes than its coordinates.
    """
    size = len(model.coordinates)
    t, q, v = PROBE
    load = DeclaredLoad(Load(frequency=1.0), model)
    state: tuple[Any, Any] = (q, v) if size == 1 else ((q,) * size, (v,) * size)
    single = all(
        isinstance(each.coordinate, str) or each.function is not None
        for each in getattr(model, "surfaces", ())
    )
    if model.first_order and single and not isinstance(model, InGapCoordinates):
        _check_rates(model)
    if isinstance(model, ContactModel) and single and type(model).force is not ContactModel.force:
        pushed = _asked(model, "force", t, *state, load, *sides_for(model, t, *state, load))
        if pushed is not None and _size_of(pushed) != (
            "a number" if size == 1 else f"{size} numbers"
        ):
            wanted = "a number" if size == 1 else f"{size} numbers"
            names = ", ".join(model.coordinates)
            raise ParameterError(
                f"{type(model).__name__}.force must return {wanted}, for {names}, got"
                f" {_size_of(pushed)}",
                "model",
            )
    for side in model.every_side:
        found = _asked(model, "acceleration", t, *state, side, load)
        count = len(found) if isinstance(found, (tuple, list)) else 1
        if found is not None and count != size:
            raise ParameterError(
                f"{type(model).__name__}.acceleration must return {size} value(s), got"
                f" {shown(found)}",
                "model",
            )


def _asked(model: Model, method: str, *arguments: Any) -> Any:
    """What a method of a model answers; None where its numbers have no value there.

    Errors of saltus go on.
    """
    try:
        with np.errstate(all="ignore"):
            return getattr(model, method)(*arguments)
    except (SaltusError, KeyboardInterrupt):
        raise
    except Exception as error:  # a user's own code may raise anything; what depends on the kind of numbers is said by the trace
        if not isinstance(error, NameError) and getattr(error, "obj", None) is not model:
            return None
        name = f"{type(model).__name__}.{method}"
        raise ParameterError(f"{name} fails: {type(error).__name__}: {error}", "model") from error
