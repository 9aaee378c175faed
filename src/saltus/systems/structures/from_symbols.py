"""Models from expressions of SymPy: M(q) q'' = f(t, q, q') with contacts, as classes with a number
for each parameter.

Nothing here imports SymPy before it is asked for a model. A class keeps its equations as Python's
text, of which it is made anew in another process; SymPy is not needed there.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from typing import Any

import numpy as np

from saltus.errors import ParameterError, shown
from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.contracts.contact_model import Contact, ContactModel
from saltus.systems.serial import MODELS


@dataclass(frozen=True)
class _Equations:
    """The parts of a class as text, in which `q`, `v`, `p` and `c` are coordinates, velocities,
    parameters and channels.
    """

    name: str
    coordinates: tuple[str, ...]
    parameters: tuple[str, ...]
    channels: tuple[str, ...]
    mass: tuple[str, ...]  # the rows, one after the other
    force: tuple[str, ...]
    contacts: tuple[Contact, ...]
    positions: tuple[str, ...]  # of the contacts


def from_sympy(
    equations: Any = None,
    *,
    coordinates: Sequence[Any] = (),
    velocities: Sequence[Any] = (),
    mass: Any = None,
    force: Any = (),
    parameters: Mapping[Any, float],
    channels: Mapping[str, Any] | None = None,
    contacts: Sequence[Contact] = (),
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
        The number of each other symbol.
    channels
        The symbols that are channels of the load, by the names of the channels: `{"force": F}`.
    contacts
        Contacts, with coordinates by name; a position may be an expression of the parameters.
    name
        The name of the model's class, which no model with other equations has; by default FromSympy
        with a digest of them.

    Raises
    ------
    ParameterError
        SymPy is not installed; an argument is of another type; an expression has a symbol that is
        none of these; a mass matrix is of another size or depends on velocities; a name that
        another model has.

    Examples
    --------
    >>> import sympy
    >>> x, v, k = sympy.symbols("x v k")
    >>> model = saltus.from_sympy(coordinates=[x], velocities=[v], force=[-k * x - v / 10], parameters={k: 4.0}, name="Damped")
    >>> saltus.System(model=model).parameters["model.k"]
    4.0
    """
    sympy = _sympy()
    for symbol in parameters:
        if not isinstance(symbol, sympy.Basic):
            raise ParameterError(
                f"parameters must be numbers by symbols of SymPy, got {shown(parameters)}",
                "parameters",
            )
    _check_types(sympy, coordinates, velocities, parameters, channels or {})
    if equations is not None:
        coordinates, velocities, mass, force = _read_method(equations)
    replaced, names = _replacements(sympy, coordinates, velocities, parameters, channels or {})
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
                known = ", ".join(map(str, [*coordinates, *parameters]))
                raise ParameterError(
                    f"{what} has {shown(str(symbol))}, which is none of {known}", what
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
    made = _Equations(
        "FromSympy" if name is None else name,
        tuple(_name_of(each) for each in coordinates),
        tuple(_name_of(each) for each in parameters),
        tuple(channels or ()),
        tuple(text("mass", entry, "qp") for entry in rows),
        tuple(text("force", each, "qvpc") for each in forces),
        tuple(replace(contact, position=0.0) for contact in contacts),
        tuple(text("contacts", contact.position, "p") for contact in contacts),
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


def _check_types(
    sympy: Any, coordinates: Any, velocities: Any, parameters: Any, channels: Any
) -> None:
    """Refuse what holds no symbols."""
    for what, given in (("parameters", parameters), ("channels", channels)):
        if not isinstance(given, Mapping):
            raise ParameterError(
                f"{what} must be a dictionary such as {{k: 4.0}}, got {shown(given)}", what
            )
    for what, given in (
        ("coordinates", coordinates),
        ("velocities", velocities),
        ("channels", list(channels.values())),
    ):
        if not isinstance(given, Sequence) or not all(
            isinstance(each, sympy.Basic) for each in given
        ):
            raise ParameterError(
                f"{what} must be symbols of SymPy, such as [x], got {shown(given)}", what
            )


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
    sympy: Any, coordinates: Any, velocities: Any, parameters: Any, channels: Any
) -> tuple[Any, dict[Any, Any]]:
    """What each symbol becomes in the text, derivatives first; and the symbols of the text."""
    names: dict[Any, Any] = {}
    for i, each in enumerate(coordinates):
        names[each] = sympy.Symbol(f"q[{i}]")
        if each.args:
            names[each.diff(*each.args)] = sympy.Symbol(f"v[{i}]")
        if len(velocities) > i:
            names[velocities[i]] = sympy.Symbol(f"v[{i}]")
        elif not each.args:
            raise ParameterError(
                f"velocities must have the rate of each coordinate, and {each} has none",
                "velocities",
            )
    names |= {symbol: sympy.Symbol(f"c[{channel!r}]") for channel, symbol in channels.items()}
    for symbol in parameters:
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
    pushed = _compiled("q, v, p, c", made.force)
    masses = _compiled("q, p", made.mass)
    places = _compiled("p", made.positions)

    def rows(self: Any, theta: Any) -> Any:
        entries = masses((theta,) if one else theta, self)
        return entries[0] if one else [entries[size * i : size * (i + 1)] for i in range(size)]

    def push(self: Any, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
        acting = {channel: getattr(load, channel)(t) for channel in made.channels}
        given = pushed((theta,) if one else theta, (velocity,) if one else velocity, self, acting)
        return given[0] if one else tuple(given)

    def energy(self: Any, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        mass = masses((theta,) if one else theta, self)
        rates = (velocity,) if one else velocity
        return 0.5 * sum(
            mass[size * i + j] * rates[i] * rates[j] for i in range(size) for j in range(size)
        )

    def touching(self: Any) -> tuple[Contact, ...]:
        return tuple(
            replace(each, position=at) for each, at in zip(made.contacts, places(self), strict=True)
        )

    body: dict[str, Any] = {
        "coordinates": made.coordinates,
        "channels": made.channels,
        "mass_matrix": rows,
        "force": push,
    }
    body |= {"kinetic_energy": energy, "contacts": property(touching), "__module__": __name__}
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


def _made_again(made: _Equations, numbers: dict[str, float]) -> Any:
    """A model from its equations, in another process."""
    return _class_of(made)(**numbers)


def _compiled(arguments: str, texts: tuple[str, ...]) -> Any:
    """A function that returns the values of texts, of which functions are NumPy's."""
    # texts that SymPy has printed
    return eval(f"lambda {arguments}: [{', '.join(texts)}]", dict(vars(np)))
