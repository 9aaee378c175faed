"""Models from expressions of SymPy: M(q) q'' = f(t, q, q') with contacts, frictions, surfaces and
relays, as classes with a number for each parameter.

Nothing here imports SymPy before it is asked for a model. A class keeps its equations as Python's
text, of which it is made anew in another process; SymPy is not needed there.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, make_dataclass, replace
from typing import Any

import numpy as np

from saltus.errors import ParameterError, shown
from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.contracts.contact_model import (
    Contact,
    ContactModel,
    Friction,
    Relay,
    Surface,
    called_part,
)
from saltus.systems.serial import MODELS


@dataclass(frozen=True)
class _Part:
    """A contact, friction, surface or relay, and its numbers that are expressions of the
    parameters, as texts.
    """

    part: Any
    texts: tuple[tuple[str, str], ...]  # by the names of its fields


@dataclass(frozen=True)
class _Method:
    """A method of a class as text: what it takes, and what it returns."""

    takes: tuple[str, ...]
    returns: tuple[str, ...]


@dataclass(frozen=True)
class _Equations:
    """The parts of a class as text, in which `q`, `v`, `p`, `c` and `s` are coordinates,
    velocities, parameters, channels and sides of surfaces.
    """

    name: str
    coordinates: tuple[str, ...]
    parameters: tuple[str, ...]
    channels: tuple[str, ...]
    mass: tuple[str, ...]  # the rows, one after the other
    force: tuple[str, ...]
    first_order: tuple[str, ...]
    contacts: tuple[_Part, ...]
    frictions: tuple[_Part, ...]
    surfaces: tuple[_Part, ...]
    normal_forces: tuple[str, ...] | None
    methods: tuple[tuple[str, _Method], ...]  # by their names


# What the methods take that parts name: a surface's function, a relay's two, the rate of a friction
# and a reset; the distance of a contact; a function in a sum of coordinates.
OF_STATE = ("t", "q", "v", "load")
OF_PLACE_AND_TIME = ("t", "q", "load")
OF_PLACE = ("q",)


def from_sympy(
    equations: Any = None,
    *,
    coordinates: Sequence[Any] = (),
    velocities: Sequence[Any] = (),
    mass: Any = None,
    force: Any = (),
    parameters: Mapping[Any, float] | None = None,
    channels: Mapping[str, Any] | None = None,
    contacts: Sequence[Contact] = (),
    frictions: Sequence[Friction] = (),
    normal_forces: Sequence[Any] | None = None,
    surfaces: Sequence[Surface | Relay] = (),
    sides: Mapping[str, Any] | None = None,
    functions: Mapping[str, Any] | None = None,
    resets: Mapping[str, Any] | None = None,
    first_order: Sequence[Any] = (),
    name: str | None = None,
) -> ContactModel:
    """A model M(q) q'' = f(t, q, q') from expressions of SymPy, or from `LagrangesMethod` or
    `KanesMethod` of its mechanics.

    The coordinates have the names of their symbols, and each parameter is a number of the model
    with its symbol's name. A system with the model is written to files as others are; in another
    process call this function with the same equations and `name` before such a file is read.

    Parameters
    ----------
    equations
        A `LagrangesMethod` or a `KanesMethod`, of which coordinates, mass matrix and forces are
        read, in place of the next four. The speeds of a `KanesMethod` must be the rates of its
        coordinates.
    coordinates
        The symbols of the coordinates: functions of time, `dynamicsymbols("x y")`, or plain
        symbols.
    velocities
        For plain symbols, those of their rates; of a function of time the rate is its derivative.
    mass
        M, a matrix of expressions of the coordinates; by default the identity.
    force
        f, an expression for each coordinate.
    parameters
        The number of each other symbol; by default there is none.
    channels
        The symbols that are channels of the load, by the names of the channels: `{"force": F}`.
    contacts, frictions, surfaces
        `Contact`, `Friction`, and `Surface` or `Relay`, with coordinates by name; their numbers may
        be expressions of the parameters.
    normal_forces
        An expression for each friction; by default 1.
    sides
        The symbols that are the sides of surfaces and relays in the force, +1 or -1, by the names
        of these: `{"heater": s}`.
    functions
        The expressions that parts name: the `function` of a surface, `on` and `off` of a relay, the
        `rate` of a friction, the `distance` of a contact.
    resets
        What an `after_event` names: the expressions of all coordinates and of all velocities after
        the event, `{"kicked": ([x], [v + 1])}`.
    first_order
        The coordinates without velocities, which come last: the `force` of each is its rate.
    name
        The name of the model's class, which no model with other equations has; by default FromSympy
        with a digest of them.

    Raises
    ------
    ParameterError
        SymPy is not installed; an argument is of another type; an expression has a symbol that is
        none of these; a mass matrix is of another size or depends on velocities; a part that names
        a function or a reset that is not given; a name that another model has.

    Examples
    --------
    >>> import sympy
    >>> x, v, k = sympy.symbols("x v k")
    >>> model = saltus.from_sympy(coordinates=[x], velocities=[v], force=[-k * x - v / 10], parameters={k: 4.0}, name="Damped")
    >>> saltus.System(model=model).parameters["model.k"]
    4.0
    """
    sympy = _sympy()
    parameters = {} if parameters is None else parameters
    for symbol in parameters:
        if not isinstance(symbol, sympy.Basic):
            raise ParameterError(
                f"parameters must be numbers by symbols of SymPy, got {shown(parameters)}",
                "parameters",
            )
    given_tables = {
        "parameters": parameters,
        "channels": channels or {},
        "sides": sides or {},
        "functions": functions or {},
        "resets": resets or {},
    }
    _check_tables(given_tables)
    _check_symbols(sympy, coordinates, velocities, first_order, channels or {}, sides or {})
    if equations is not None:
        coordinates, velocities, mass, force = _read_method(equations)
    replaced, names = _replacements(sympy, coordinates, velocities, first_order, given_tables)
    kinds = dict(replaced)

    def text(what: str, expression: Any, allowed: str) -> str:
        """An expression as Python's text."""
        try:
            given = sympy.sympify(expression, strict=True).xreplace(kinds)
        except (TypeError, ValueError, AttributeError):  # SymPy's own error is a ValueError
            raise ParameterError(
                f"{what} must be an expression of SymPy, got {shown(expression)}", what
            ) from None
        if given.has(sympy.nan, sympy.oo, -sympy.oo, sympy.zoo):
            raise ParameterError(f"{what} must be finite, got {shown(expression)}", what)
        for symbol in sorted(given.free_symbols, key=str):
            if symbol not in names.values() or str(symbol)[0] not in allowed:
                known = ", ".join(
                    _name_of(own) if own in coordinates else str(own)
                    for own, made in names.items()
                    if str(made)[0] in allowed
                )
                called = next((str(own) for own, made in names.items() if made == symbol), symbol)
                raise ParameterError(
                    f"{what} has {shown(str(called))}, which is none of {known}", what
                )
        try:
            return str(printer.doprint(given))
        except _NoForce as error:
            raise ParameterError(f"{what} has {error}", what) from None

    printer = _printer(sympy)

    count = len(coordinates)
    try:
        rows = sympy.eye(count) if mass is None else sympy.Matrix(mass)
    except (TypeError, ValueError, NotImplementedError):
        raise ParameterError(
            f"mass must be rows of expressions, got {shown(mass)}", "mass"
        ) from None
    forces = list(force) if isinstance(force, (Sequence, sympy.MatrixBase)) else [force]
    if rows.shape != (count, count) or len(forces) != count:
        raise ParameterError(
            f"{count} coordinates need a mass matrix of {count} rows and {count} forces, got "
            f"{rows.shape} and {len(forces)}",
            "force",
        )
    parts: dict[str, tuple[_Part, ...]] = {}
    for what, kinds_of_parts, given_parts in (
        ("contacts", (Contact,), contacts),
        ("frictions", (Friction,), frictions),
        ("surfaces", (Surface, Relay), surfaces),
    ):
        _check_parts(what, kinds_of_parts, given_parts)
        parts[what] = tuple(_part(sympy, what, part, text) for part in given_parts)
    of_parts = _Named(contacts, frictions, surfaces)
    of_parts.check(functions or {}, resets or {}, sides or {})
    own_names = {_name_of(each) for each in (*coordinates, *parameters)}
    methods: list[tuple[str, _Method]] = []
    for called, expression in (functions or {}).items():
        _check_method_name(called, own_names, "functions")
        takes = of_parts.taken_by(called)
        allowed = {OF_STATE: "qvpc", OF_PLACE_AND_TIME: "qpc", OF_PLACE: "qp"}[takes]
        found = text(f"functions.{called}", expression, allowed)
        methods.append((called, _Method(takes, (found,))))
    for called, state in (resets or {}).items():
        _check_method_name(called, own_names, "resets")
        methods.append(
            (called, _Method(OF_STATE, _reset_of(f"resets.{called}", state, count, text)))
        )
    made = _Equations(
        "FromSympy" if name is None else name,
        tuple(_name_of(each) for each in coordinates),
        tuple(_name_of(each) for each in parameters),
        tuple(channels or ()),
        tuple(text("mass", entry, "qp") for entry in rows),
        tuple(text("force", each, "qvpcs") for each in forces),
        tuple(_name_of(each) for each in first_order),
        **parts,
        normal_forces=(
            None
            if normal_forces is None
            else tuple(text("normal_forces", each, "qvpc") for each in normal_forces)
        ),
        methods=tuple(methods),
    )
    if name is None:
        made = replace(
            made, name=f"FromSympy_{hashlib.sha256(repr(made).encode()).hexdigest()[:8]}"
        )
    model: ContactModel = _class_of(made)(
        **{_name_of(key): value for key, value in parameters.items()}
    )
    return model


class _NoForce(Exception):
    """What of an expression cannot be a force."""


def _printer(sympy: Any) -> Any:
    """A printer of NumPy's text, whose maxima and conditions take two operands each, as those of a
    force do.
    """

    class Printer(sympy.printing.numpy.NumPyPrinter):  # type: ignore[misc]
        def _nested(self, function: str, given: Sequence[Any]) -> str:
            *rest, last = map(self._print, given)
            text = str(last)
            for one in reversed(rest):
                text = f"{function}({one}, {text})"
            return text

        def _joined(self, operator: str, given: Sequence[Any]) -> str:
            return "(" + f" {operator} ".join(f"({self._print(each)})" for each in given) + ")"

        def _print_Max(self, expression: Any) -> str:
            return self._nested("maximum", expression.args)

        def _print_Min(self, expression: Any) -> str:
            return self._nested("minimum", expression.args)

        def _print_And(self, expression: Any) -> str:
            return self._joined("&", expression.args)

        def _print_Or(self, expression: Any) -> str:
            return self._joined("|", expression.args)

        def _print_Relational(self, expression: Any) -> str:
            if expression.rel_op in ("==", "!="):
                raise _NoForce(f"{expression}, which differs at an instant only: use < or >")
            left, right = map(self._print, expression.args)
            return f"(({left}) {expression.rel_op} ({right}))"

        def _print_Heaviside(self, expression: Any) -> str:
            return f"heaviside({self._print(expression.args[0])}, 0.5)"

        def _print_Piecewise(self, expression: Any) -> str:
            *cases, (otherwise, condition) = expression.args
            if condition != sympy.true:
                raise _NoForce(
                    "a Piecewise that is nothing outside its conditions: end it with (value, True)"
                )
            text = str(self._print(otherwise))
            for value, condition in reversed(cases):
                text = f"where({self._print(condition)}, {self._print(value)}, {text})"
            return text

    return Printer({"fully_qualified_modules": False, "allow_unknown_functions": True})


def _sympy() -> Any:
    try:
        import sympy
        import sympy.printing.numpy
    except ImportError:
        raise ParameterError(
            'from_sympy needs SymPy: pip install ".[sympy]"', "equations"
        ) from None
    return sympy


EXAMPLES = {
    "parameters": "{k: 4.0}",
    "channels": '{"force": F}',
    "sides": '{"heater": s}',
    "functions": '{"too_cold": 19 - T}',
    "resets": '{"kicked": ([x], [v + 1])}',
}


def _check_tables(tables: dict[str, Any]) -> None:
    """Refuse what is no dictionary."""
    for what, given in tables.items():
        if not isinstance(given, Mapping):
            raise ParameterError(
                f"{what} must be a dictionary such as {EXAMPLES[what]}, got {shown(given)}", what
            )


def _check_symbols(
    sympy: Any, coordinates: Any, velocities: Any, first_order: Any, channels: Any, sides: Any
) -> None:
    """Refuse what holds no symbols, and coordinates of first order that are none of the model's."""
    for what, given in (
        ("coordinates", coordinates),
        ("velocities", velocities),
        ("first_order", first_order),
        ("channels", list(channels.values())),
        ("sides", list(sides.values())),
    ):
        if not isinstance(given, Sequence) or not all(
            isinstance(each, sympy.Basic) for each in given
        ):
            raise ParameterError(
                f"{what} must be symbols of SymPy, such as [x], got {shown(given)}", what
            )


def _check_parts(what: str, kinds: tuple[type, ...], given: Any) -> None:
    """Refuse parts of other classes."""
    listed = isinstance(given, Sequence) and not isinstance(given, str)
    wrong = [part for part in given if not isinstance(part, kinds)] if listed else [given]
    if wrong:
        names = " or ".join(kind.__name__ for kind in kinds)
        raise ParameterError(f"{what} must be a list of {names}, got {shown(wrong[0])}", what)


def _part(sympy: Any, what: str, part: Any, text: Any) -> _Part:
    """A part without the numbers that are expressions, and their texts."""
    texts = {
        each.name: text(f"{what}.{part.name}.{each.name}", value, "p")
        for each in fields(part)
        if isinstance(value := getattr(part, each.name), sympy.Basic)
    }
    usual = {
        each.name: 0.0 if each.default is MISSING else each.default
        for each in fields(part)
        if each.name in texts
    }
    return _Part(replace(part, **usual), tuple(texts.items()))


class _Named:
    """Which functions and resets the parts of a model name, and what these take."""

    def __init__(self, contacts: Any, frictions: Any, surfaces: Any) -> None:
        self.surfaces = [part.name for part in surfaces]
        self.resets: dict[str, Any] = {}
        self.takes: dict[str, dict[tuple[str, ...], Any]] = {}
        for part in surfaces:
            if part.after_event is not None:
                self.resets[part.after_event] = part
            for called in part.methods:
                self._add(called, OF_STATE, part)
        for part in contacts:
            if part.distance is not None:
                self._add(part.distance, OF_PLACE_AND_TIME, part)
        for part in frictions:
            if part.rate is not None:
                self._add(part.rate, OF_STATE, part)
        # a sum has names of coordinates and of channels, too
        self.terms = {
            term: part
            for part in (*contacts, *frictions, *surfaces)
            if isinstance(part.coordinate, Mapping)
            for term in part.coordinate
        }

    def _add(self, called: str, takes: tuple[str, ...], part: Any) -> None:
        self.takes.setdefault(called, {})[takes] = part

    def taken_by(self, called: str) -> tuple[str, ...]:
        """What a function takes, by the parts that name it."""
        known = [*self.takes.get(called, {})] + [OF_PLACE] * (called in self.terms)
        if not known:
            raise ParameterError(
                f"functions.{called} is named by no part: give it to a contact, a friction, a"
                " surface or a relay, or leave it out",
                "functions",
            )
        if len(known) > 1:
            raise ParameterError(
                f"functions.{called} is named by parts that take it of other arguments (a distance"
                " takes no velocity): give each a function of its own",
                "functions",
            )
        return known[0]

    def check(self, functions: Any, resets: Any, sides: Any) -> None:
        """Refuse parts that name what is not given, and what no part names."""
        for called, by in self.takes.items():
            if called not in functions:
                part = next(iter(by.values()))
                raise ParameterError(
                    f"{called_part(part)} names {shown(called)}, which is none of the functions"
                    f" ({', '.join(functions) or 'there are none'})",
                    "functions",
                )
        for called, part in self.resets.items():
            if called not in resets:
                raise ParameterError(
                    f"{called_part(part)} has the after_event {shown(called)}, which is none of the"
                    f" resets ({', '.join(resets) or 'there are none'})",
                    "resets",
                )
        for called in resets:
            if called not in self.resets:
                raise ParameterError(
                    f"resets.{called} is the after_event of no surface: leave it out", "resets"
                )
        for called in sides:
            if called not in self.surfaces:
                known = ", ".join(self.surfaces) or "there are none"
                raise ParameterError(
                    f"sides has {shown(called)}, which is none of the surfaces ({known})", "sides"
                )


def _check_method_name(called: Any, own: set[str], what: str) -> None:
    """Refuse a name that no method of the class can have."""
    usable = isinstance(called, str) and called.isidentifier() and not called.startswith("_")
    if not usable or called in own or hasattr(ContactModel, called):
        raise ParameterError(
            f"{what}: {shown(called)} is not a name for a method of the model, such as too_cold",
            what,
        )


def _reset_of(what: str, given: Any, count: int, text: Any) -> tuple[str, ...]:
    """The texts of all coordinates and of all velocities after an event."""
    halves = given if isinstance(given, Sequence) and len(given) == 2 else ()
    rows = [list(half) if isinstance(half, Sequence) else [half] for half in halves]
    if [len(row) for row in rows] != [count, count]:
        each = "an expression" if count == 1 else f"{count} expressions"
        raise ParameterError(
            f"{what} must have the coordinates and the velocities after the event, each {each},"
            f" got {shown(given)}",
            what,
        )
    return tuple(text(what, expression, "qvpc") for row in rows for expression in row)


def _read_method(equations: Any) -> tuple[Any, Any, Any, Any]:
    """Coordinates, velocities, mass matrix and forces of a method of SymPy's mechanics."""
    try:
        coordinates = list(equations.q)
        mass = equations.mass_matrix
        force = equations.forcing
        kinematics = getattr(equations, "kindiffdict", None)  # of a KanesMethod alone
        speeds, rates = (list(equations.u), kinematics()) if kinematics else ([], {})
    except (AttributeError, ValueError, TypeError) as error:
        raise ParameterError(
            "equations must be a LagrangesMethod or a KanesMethod whose equations are formed, "
            f"got {shown(equations)} ({error})",
            "equations",
        ) from None
    if any(rate != speed for rate, speed in zip(rates.values(), speeds, strict=False)):
        raise ParameterError(
            "the speeds of the KanesMethod must be the rates of its coordinates, u = q'",
            "equations",
        )
    return coordinates, speeds, mass, force


def _replacements(
    sympy: Any, coordinates: Any, velocities: Any, first_order: Any, tables: dict[str, Any]
) -> tuple[Any, dict[Any, Any]]:
    """What each symbol becomes in the text, derivatives first; and the symbols of the text."""
    names: dict[Any, Any] = {}
    for i, each in enumerate(coordinates):
        names[each] = sympy.Symbol(f"q[{i}]")
        if each in first_order:
            continue
        if each.args:
            names[each.diff(*each.args)] = sympy.Symbol(f"v[{i}]")
        if len(velocities) > i:
            names[velocities[i]] = sympy.Symbol(f"v[{i}]")
        elif not each.args:
            raise ParameterError(
                f"velocities must have the rate of each coordinate, and {each} has none",
                "velocities",
            )
    for letter, table in (("c", tables["channels"]), ("s", tables["sides"])):
        names |= {symbol: sympy.Symbol(f"{letter}[{called!r}]") for called, symbol in table.items()}
    for symbol in tables["parameters"]:
        found = _name_of(symbol)
        if not found.isidentifier() or found.startswith("_"):
            raise ParameterError(
                f"a parameter must have a name as Python's, got {shown(found)}", "parameters"
            )
        names[sympy.Symbol(symbol) if isinstance(symbol, str) else symbol] = sympy.Symbol(
            f"p.{found}"
        )
    return sorted(names.items(), key=lambda pair: not pair[0].is_Derivative), names


def _name_of(symbol: Any) -> str:
    """The name of a symbol, or of a function of time."""
    return (
        symbol
        if isinstance(symbol, str)
        else str(getattr(symbol, "func", symbol) if symbol.args else symbol)
    )


_CLASSES: dict[str, Any] = {}  # by their equations, so that equal equations are one class


def _class_of(made: _Equations) -> Any:
    """The class of a model with these equations, which is then known by its name."""
    if repr(made) in _CLASSES:
        return _CLASSES[repr(made)]
    if made.name in MODELS:
        raise ParameterError(
            f"there is a model {shown(made.name)} with other equations already; give this one "
            "another name",
            "name",
        )
    if not re.fullmatch(r"[A-Za-z]\w*", made.name):
        raise ParameterError(f"name must be one as Python's, got {shown(made.name)}", "name")
    one = len(made.coordinates) == 1
    size = len(made.coordinates)
    moving = size - len(made.first_order)
    pushed = _compiled("q, v, p, c, s", made.force)
    masses = _compiled("q, p", made.mass)

    def rows(self: Any, theta: Any) -> Any:
        entries = masses((theta,) if one else theta, self)
        return entries[0] if one else [entries[size * i : size * (i + 1)] for i in range(size)]

    def acting(load: Any, t: Any) -> dict[str, Any]:
        return {channel: getattr(load, channel)(t) for channel in made.channels}

    def push(self: Any, t: Any, theta: Any, velocity: Any, load: Any, *sides: Any) -> Any:
        state = ((theta,), (velocity,)) if one else (theta, velocity)
        given = pushed(*state, self, acting(load, t), sides[0] if sides else {})
        return given[0] if one else tuple(given)

    def energy(self: Any, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        mass = masses((theta,) if one else theta, self)
        rates = (velocity,) if one else velocity
        return 0.5 * sum(
            mass[size * i + j] * rates[i] * rates[j] for i in range(moving) for j in range(moving)
        )

    body: dict[str, Any] = {
        "coordinates": made.coordinates,
        "channels": made.channels,
        "force": push,
    }
    if moving or made.mass != ("1",):  # a rate has no inertia
        body["mass_matrix"] = rows
    for what in ("contacts", "frictions", "surfaces"):
        if parts := getattr(made, what):
            body[what] = _property_of(parts)
    if made.first_order:
        body["first_order"] = made.first_order
    if made.normal_forces is not None:
        pressing = _Method(OF_STATE, made.normal_forces)
        body["normal_forces"] = _method_of(pressing, one, acting, tuple)
    resets = {each.part.after_event for each in made.surfaces}
    for called, method in made.methods:
        answer = _state_of(size) if called in resets else _only
        body[called] = _method_of(method, one, acting, answer)
    body |= {"kinetic_energy": energy, "__module__": __name__}
    body["__post_init__"] = lambda self: settle_numbers(self)
    body["__reduce__"] = lambda self: (
        _made_again,
        (made, {name: getattr(self, name) for name in made.parameters}),
    )
    fields = [(name, float, field(metadata=number_range())) for name in made.parameters]
    found = make_dataclass(
        made.name, fields, bases=(ContactModel,), namespace=body, frozen=True, kw_only=True
    )
    found.__doc__ = f"{made.name}, a model from expressions of SymPy."
    _CLASSES[repr(made)] = MODELS[made.name] = found
    return found


def _property_of(parts: tuple[_Part, ...]) -> property:
    """The parts of a model with its own numbers."""
    texts = tuple(text for each in parts for _, text in each.texts)
    values = _compiled("p", texts)

    def found(self: Any) -> tuple[Any, ...]:
        known = iter(values(self))
        return tuple(
            replace(each.part, **{name: next(known) for name, _ in each.texts})
            if each.texts
            else each.part
            for each in parts
        )

    return property(found)


def _method_of(method: _Method, one: bool, acting: Any, answer: Any) -> Any:
    """A method of a class; `acting` gives the channels of the load at a time, and `answer` makes
    what it returns of its values.
    """
    values = _compiled("q, v, p, c", method.returns)

    def state_of(q: Any) -> Any:
        return (q,) if one else q

    def of_state(self: Any, t: Any, q: Any, v: Any, load: Any) -> Any:
        return answer(values(state_of(q), state_of(v), self, acting(load, t)))

    def of_place_and_time(self: Any, t: Any, q: Any, load: Any) -> Any:
        return answer(values(state_of(q), (), self, acting(load, t)))

    def of_place(self: Any, q: Any) -> Any:
        return answer(values(state_of(q), (), self, {}))

    return {OF_STATE: of_state, OF_PLACE_AND_TIME: of_place_and_time, OF_PLACE: of_place}[
        method.takes
    ]


def _only(values: list[Any]) -> Any:
    """The value of a method that returns one."""
    return values[0]


def _state_of(size: int) -> Any:
    """What a reset returns, of its values: coordinates and velocities."""

    def state(values: list[Any]) -> tuple[Any, Any]:
        if size == 1:
            return values[0], values[1]
        return tuple(values[:size]), tuple(values[size:])

    return state


def _made_again(made: _Equations, numbers: dict[str, float]) -> Any:
    """A model from its equations, in another process."""
    return _class_of(made)(**numbers)


def _compiled(arguments: str, texts: tuple[str, ...]) -> Any:
    """A function that returns the values of texts, of which functions are NumPy's."""
    # texts that SymPy has printed
    return eval(f"lambda {arguments}: [{', '.join(texts)}]", dict(vars(np)))
