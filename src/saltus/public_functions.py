"""The arguments of public functions: one that is not of the kind of its annotation is refused by its name at once."""

from __future__ import annotations

import builtins
import functools
import inspect
import itertools
import numbers
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ParamSpec, Protocol, TypeVar, cast

import numpy as np

from saltus.checks import LIMITS
from saltus.errors import ParameterError, SaltusError, near, shown

P = ParamSpec("P")
R = TypeVar("R", covariant=True)
T = TypeVar("T")
NUMBER = (float, float | None, int, int | None)
Numbers = Annotated[Any, "a number or an array of numbers"]  # what the type checker cannot tell, as arrays have many types


class Checked(Protocol[P, R]):
    """A function whose arguments can be checked without computing anything."""

    __name__: str

    def __call__(self, *given: P.args, **named: P.kwargs) -> R:
        """Call the function."""

    def check(self, *given: P.args, **named: P.kwargs) -> None:
        """Refuse the arguments that the function would refuse."""


def checked_by(check: Callable[..., object]) -> Callable[[Callable[P, R]], Checked[P, R]]:
    """A decorator by which a function refuses arguments without meaning before it begins, and has `function.check(...)`.

    `check` is called with every argument of the function by its name, defaults included.
    """

    def decorate(function: Callable[P, R]) -> Checked[P, R]:
        open_ended = [p.name for p in inspect.signature(function).parameters.values() if p.kind is p.VAR_KEYWORD]

        def checked(bound: inspect.BoundArguments) -> None:
            bound.apply_defaults()
            arguments = dict(bound.arguments)
            for name in open_ended:
                arguments |= arguments.pop(name)
            check(**arguments)

        def refuse(*given: Any, **named: Any) -> inspect.BoundArguments:
            bound = fitting_arguments(function, given, named, checked)
            checked(bound)
            return bound

        @functools.wraps(function)
        def call(*given: Any, **named: Any) -> R:
            bound = refuse(*given, **named)
            return function(*bound.args, **bound.kwargs)

        vars(call).update(check=refuse, answers=True)
        return cast(Checked[P, R], call)

    return decorate


def bound_arguments(function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]) -> inspect.BoundArguments:
    """The arguments of a call by their names.

    Raises
    ------
    ParameterError
        An argument is unknown (the error gives similar names), missing, or given twice.
    """
    signature = _signature(function)
    try:
        return signature.bind(*given, **named)
    except TypeError as error:
        sentence, known = str(error), signature.parameters
        wrong = next((name for name in named if name not in known), None)
        if wrong is not None and not any(p.kind is p.VAR_KEYWORD for p in known.values()):
            sentence = f"has no argument {wrong!r:.40}; {near(wrong, [name for name in known if name != 'self'])}"
        else:
            wrong = next((name for name in known if sentence.endswith(repr(name))), None)  # missing, or given twice
        owner, _, own = function.__qualname__.rpartition(".")
        name = owner.rpartition(".")[2] if own == "__init__" else own
        raise ParameterError(f"{name}() {sentence}", wrong) from None


def answered(function: Callable[P, R]) -> Callable[P, R]:
    """The function, which refuses arguments of a wrong kind by their names before it begins."""

    def made(bound: inspect.BoundArguments) -> object:
        return function(*bound.args, **bound.kwargs)

    refuses = made if function.__name__ == "__init__" else None  # calling any other function may take long

    @functools.wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> R:
        if _is_plain(function, given, named):
            return function(*given, **named)
        bound = fitting_arguments(function, given, named, refuses)
        return function(*bound.args, **bound.kwargs)

    vars(call)["answers"] = True
    return call


def answering(*names: str) -> Callable[[type[T]], type[T]]:
    """A decorator of classes: the methods of these names, `__init__` included, refuse arguments as public functions do."""

    def decorate(cls: type[T]) -> type[T]:
        for name in names:
            found = inspect.getattr_static(cls, name)
            if isinstance(found, classmethod):
                setattr(cls, name, classmethod(answered(found.__func__)))
            else:
                setattr(cls, name, answered(found))
        return cls

    return decorate


def _is_plain(function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]) -> bool:
    """Whether a call of a method surely fits, as all arguments have exactly the types of the annotations; a fast test.

    It matters where systems are copied with other numbers, a hundred thousand times in a study.
    """
    places, kinds, others, needed = _plain_kinds(function)
    values = dict(zip(places, given, strict=False)) | named
    if len(values) < len(given) + len(named) or not needed <= values.keys():
        return False
    for name, value in values.items():
        kind = kinds.get(name, others)
        if kind is float or kind is int:
            if type(value) is not kind or not abs(value) <= LIMITS.value:
                return False
        elif kind is None or not isinstance(value, kind):
            return False
    return True


@functools.cache
def _plain_kinds(
    function: Callable[..., Any],
) -> tuple[tuple[str, ...], dict[str, type | None], type | None, frozenset[str]]:
    """For `_is_plain`: the positional arguments of a method, the type of each argument (None if it is not a single one), the type
    of `**named`, and the arguments that a call needs. For other functions, values with which no call is plain."""
    parameters = _signature(function).parameters
    if next(iter(parameters), "") != "self":
        return (), {}, None, frozenset({""})
    simple: dict[Any, type] = {float | None: float, Mapping[str, Any] | None: dict, Any: object, Any | None: object}
    hints = {name: simple.get(hint, hint) for name, hint in _hints(function).items()}
    kinds: dict[str, type | None] = dict.fromkeys(parameters)
    told_otherwise = (bool, np.ndarray, Callable, Iterable)  # types for which `fits` has other rules
    kinds |= {name: kind for name, kind in hints.items() if isinstance(kind, type) and kind not in told_otherwise}
    others = object if any(p.kind is p.VAR_KEYWORD for p in parameters.values()) else None
    places = tuple(p.name for p in parameters.values() if p.kind is p.POSITIONAL_OR_KEYWORD)
    needed = frozenset(p.name for p in parameters.values() if p.default is p.empty and p.kind is not p.VAR_KEYWORD)
    return places, kinds | {"self": object}, others, needed


def fitting_arguments(
    function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any], refuses: Callable[..., object] | None
) -> inspect.BoundArguments:
    """The arguments of a call by their names, each of the kind that its annotation says.

    Iterators are replaced by tuples, as they can be read only once, and floats by ints where whole numbers are asked for. If an
    argument does not fit, the function's own checks (`refuses`, if given) are tried first, as their sentences say more.

    Raises
    ------
    ParameterError
        An argument is unknown, missing or of another kind; the error has its name.
    """
    bound, hints = bound_arguments(function, given, named), _hints(function)
    for name, value in bound.arguments.items():
        if isinstance(value, Iterator):
            bound.arguments[name] = tuple(itertools.islice(value, LIMITS.count + 1))
        elif isinstance(value, np.ndarray) and value.ndim == 0 and hints.get(name) in NUMBER:
            bound.arguments[name] = value = value.item()
        if isinstance(value, float) and value.is_integer() and hints.get(name) in NUMBER[2:]:
            bound.arguments[name] = int(value)
    for name, value in bound.arguments.items():
        problem = _misfit(value, hints[name], refuses is None) if name in hints else None
        if problem is not None:
            if refuses is not None:
                _refused_in_own_words(refuses, bound)
            raise ParameterError(f"{name} must be {problem}, got {shown(value)}", name)
    return bound


def _misfit(value: Any, hint: Any, limited: bool) -> str | None:
    """What a value must be if it is not of its type, else None; if it is `limited`, its square must not overflow."""
    if not fits(value, hint):
        return in_words(hint)
    limited = limited and hint in (float, float | None) and value is not None
    return f"at most {LIMITS.value:g} in size" if limited and not _is_small(value) else None


def _refused_in_own_words(refuses: Callable[..., object], bound: inspect.BoundArguments) -> None:
    """Call the function's own checks; errors of saltus are raised, all others are ignored."""
    try:
        refuses(bound)
    except SaltusError:
        raise
    except Exception:
        return


@functools.cache
def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """The types of a function's annotations, without `**named`, which the function checks itself, as names may be wrong."""
    names = _Names(inspect.unwrap(function).__globals__)
    checked = (p for p in _signature(function).parameters.values() if p.kind is not p.VAR_KEYWORD)
    written = {p.name: p.annotation for p in checked if p.annotation is not p.empty}
    return {name: eval(hint, {}, names) if isinstance(hint, str) else hint for name, hint in written.items()}  # saltus's own text


_signature = functools.cache(inspect.signature)


class _NamedOnly(type):
    """A class of which only the name is known, as it is imported for the type checker only."""

    def __getattr__(cls, name: str) -> type:
        if name.startswith("__"):
            raise AttributeError(name)
        return _NamedOnly(name, (), {})

    def __instancecheck__(cls, value: Any) -> bool:
        return cls.__name__ in (kind.__name__ for kind in type(value).__mro__)


class _Names(dict[str, Any]):
    """The names that a file's annotations may use."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, None) or _NamedOnly(name, (), {})


def fits(value: Any, hint: Any) -> bool:
    """Whether a value is of a type; True if that cannot be decided."""
    kind, parts = typing.get_origin(hint) or hint, typing.get_args(hint)
    if kind in (Any, object):
        return True
    if kind is Annotated:
        return _is_numeric(value)
    if kind in (typing.Union, types.UnionType):
        return any(fits(value, part) for part in parts)
    if kind in (None, type(None)):
        return value is None
    if kind in (float, int):
        value = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
        whole = kind is float or isinstance(value, numbers.Integral) or (isinstance(value, float) and value.is_integer())
        return isinstance(value, numbers.Real) and not isinstance(value, bool) and whole
    if kind is Callable:
        return _can_be_called(value, parts[0] if parts else ...)
    if kind is np.ndarray:
        return _is_numeric(value) and np.ndim(value) > 0
    if kind in (dict, Mapping):
        return isinstance(value, Mapping) and (not parts or all(fits(each, parts[1]) for each in value.values()))
    if kind in (Iterable, list, tuple):
        return _is_iterable_of(value, parts[0] if parts else Any)
    return isinstance(value, kind) if isinstance(kind, type) else True


def _is_iterable_of(value: Any, part: Any) -> bool:
    """Whether a value is iterable and its entries are of a type; of an array only the first entry is looked at."""
    if isinstance(value, (bytes, Mapping)) or (isinstance(value, str) and part is not str):
        return False
    if part is float and not isinstance(value, (set, frozenset)):
        return _is_numeric(value) and np.ndim(value) > 0
    if not isinstance(value, Iterable) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return False
    return all(fits(each, part) for each in (value[:1] if isinstance(value, np.ndarray) else value))


def _is_numeric(value: Any) -> bool:
    try:
        array = np.asarray(value)
        return array.dtype.kind in "fiu" or (array.dtype.kind == "b" and array.ndim > 0)  # True alone is no number
    except Exception:  # arrays of several shapes, one for each coordinate; and a user's own class may raise anything
        return isinstance(value, (tuple, list)) and all(_is_numeric(each) for each in value)


def _is_small(value: Any) -> bool:
    """Whether the squares of all finite numbers among these are finite."""
    try:
        array = np.abs(np.asarray(value, dtype=float))
    except (TypeError, ValueError, OverflowError):  # arrays of several shapes, or a whole number beyond all floats
        return isinstance(value, (tuple, list)) and all(_is_small(each) for each in value)
    return not ((array > LIMITS.value) & np.isfinite(array)).any()


def _can_be_called(value: Any, arguments: Any) -> bool:
    """Whether a value is a function that takes so many arguments; True if its signature is unknown."""
    if not callable(value) or isinstance(value, type):
        return False
    try:
        inspect.signature(value).bind(*(() if arguments is ... else arguments))
    except TypeError:
        return arguments is ...
    except ValueError:  # it has no signature
        return True
    return True


WORDS: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    str: "a text in quotes",
    Path: "a path",
    np.ndarray: "an array of numbers",
    Mapping: "a dict",
    dict: "a dict",
    type(None): "None",
}
SOURCES = {  # where a user gets an object of a class from
    "PeriodicOrbit": "find_orbit or search_orbits",
    "SpecialPoint": "branch.special",
    "Attractors": "find_attractors",
}


def in_words(hint: Any) -> str:
    """A type in words, as part of a sentence."""
    kind, parts = typing.get_origin(hint) or hint, typing.get_args(hint)
    if kind is Annotated:
        return str(hint.__metadata__[0])
    if kind in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(in_words(part) for part in parts if part is not type(None)))  # which is seldom meant
    if kind is Callable:
        count = len(parts[0]) if parts and parts[0] is not ... else 0
        return f"a function of {count} arguments" if count else "a function"
    if kind in WORDS:
        return WORDS[kind]
    if kind is tuple and parts == (float, float):
        return "two numbers"
    if kind in (Iterable, list, tuple):
        return {float: "a list of numbers", str: "a list of texts"}.get(parts[0] if parts else Any, "a list or a tuple")
    name = getattr(kind, "__name__", "something else")
    source = f", as {SOURCES[name]} gives it" if name in SOURCES else "(model=..., load=..., impact=...)" * (name == "System")
    return f"{'an' if name[0].lower() in 'aeio' else 'a'} {name}{source}"
