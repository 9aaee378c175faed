"""The public functions' arguments: refused before anything begins, or answered by their names where they do not fit."""

from __future__ import annotations

import functools
import inspect
import numbers
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar, cast

import numpy as np

from saltus.errors import ParameterError, SaltusError, near, shown

P = ParamSpec("P")
R = TypeVar("R", covariant=True)


class Checked(Protocol[P, R]):
    """A function whose arguments can be checked without computing anything."""

    __name__: str

    def __call__(self, *given: P.args, **named: P.kwargs) -> R:
        """What the function gives."""

    def check(self, *given: P.args, **named: P.kwargs) -> None:
        """Refuse what the function would refuse."""


def checked_by(check: Callable[..., object]) -> Callable[[Callable[P, R]], Checked[P, R]]:
    """A decorator by which a function refuses arguments without meaning before it begins, and has `function.check(...)`.

    `check` is called with every argument of the function by its name, defaults included.
    """

    def decorate(function: Callable[P, R]) -> Checked[P, R]:
        signature = inspect.signature(function)
        open_ended = [p.name for p in signature.parameters.values() if p.kind is p.VAR_KEYWORD]

        def refuse(*given: Any, **named: Any) -> None:
            bound = bound_arguments(function, given, named)
            bound.apply_defaults()
            arguments = dict(bound.arguments)
            for name in open_ended:
                arguments |= arguments.pop(name)
            answered(check, function)(**arguments)

        @functools.wraps(function)
        def call(*given: Any, **named: Any) -> R:
            given = tuple(_kept(value) for value in given)
            named = {name: _kept(value) for name, value in named.items()}
            refuse(*given, **named)
            return function(*given, **named)

        vars(call)["check"] = refuse
        return cast(Checked[P, R], call)

    return decorate


def _kept(value: Any) -> Any:
    """The value, or a tuple of what an iterator yields, which could otherwise be looked at only once."""
    return tuple(value) if isinstance(value, Iterator) else value


def bound_arguments(function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]) -> inspect.BoundArguments:
    """The arguments of a call by their names.

    Raises:
        ParameterError: one is unknown (with the near names), missing, or given twice.
    """
    signature = inspect.signature(function)
    try:
        return signature.bind(*given, **named)
    except TypeError as error:
        known = signature.parameters
        unknown = [name for name in named if name not in known]
        if unknown and not any(p.kind is p.VAR_KEYWORD for p in known.values()):
            sentence, argument = f"has no argument {unknown[0]!r:.40}; {near(unknown[0], known)}", unknown[0]
        else:
            sentence, argument = str(error), None
        raise ParameterError(f"{function.__name__}() {sentence}", argument) from None


def answered(function: Callable[P, R], described: Callable[..., Any] | None = None) -> Callable[P, R]:
    """The function, which answers arguments of a wrong kind with a ParameterError that names them.

    Only where something else than an error of saltus is raised are the arguments compared with their types (those of
    `described`, if that is another function), so that a call that fits costs nothing, and a mistake of saltus stays one.
    """
    described = described or function

    @functools.wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> R:
        try:
            return function(*given, **named)
        except SaltusError:
            raise
        except (TypeError, AttributeError, ValueError, LookupError, ArithmeticError, RecursionError) as error:
            problem = misfit(described, given, named)
            if problem is None:
                raise
            raise problem from error

    return call


def misfit(function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]) -> ParameterError | None:
    """What is wrong with the first argument of a call that is not of the type of its annotation, or None."""
    try:
        bound = bound_arguments(function, given, named)
    except ParameterError as error:
        return error
    for name, value in bound.arguments.items():
        parameter = inspect.signature(function).parameters[name]
        hint = _hint(function, parameter.annotation)
        values = {name: value}
        if parameter.kind is parameter.VAR_KEYWORD:
            values = value
        elif parameter.kind is parameter.VAR_POSITIONAL:
            values = {f"{name}[{i}]": each for i, each in enumerate(value)}
        for key, each in values.items():
            if not fits(each, hint):
                return ParameterError(f"{key} must be {in_words(hint)}, got {shown(each)}", key)
    return None


def _hint(function: Callable[..., Any], annotation: Any) -> Any:
    """The type that an annotation stands for; Any where it is known to the type checker alone."""
    if not isinstance(annotation, str):
        return Any if annotation is inspect.Parameter.empty else annotation
    try:
        return eval(annotation, inspect.unwrap(function).__globals__)  # saltus's own text
    except Exception:
        return Any


def fits(value: Any, hint: Any) -> bool:
    """Whether a value is of a type; of what cannot be told it is."""
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if hint in (Any, object) or isinstance(hint, TypeVar):
        return True
    if origin in (typing.Union, types.UnionType):
        return any(fits(value, part) for part in parts)
    if hint is None or hint is type(None):
        return value is None
    if hint in (float, int):
        return isinstance(value, numbers.Real) or (
            isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "fiu"
        )
    if origin in (Iterable, np.ndarray, list, tuple) or hint is np.ndarray:
        if isinstance(value, np.ndarray) and value.ndim == 0 and origin in (Iterable, list, tuple):
            return False
        numeric = hint is np.ndarray or origin is np.ndarray or (parts[:1] == (float,))
        return not isinstance(value, (str, bytes)) and isinstance(value, Iterable) and not (numeric and not _is_numeric(value))
    if isinstance(origin, type) or isinstance(hint, type):
        kind = origin or hint
        return callable(value) if kind is Callable else isinstance(value, kind)
    return True


def _is_numeric(value: Any) -> bool:
    try:
        return bool(np.isfinite(np.asarray(value, dtype=float)).all())
    except (TypeError, ValueError, OverflowError):
        return False


WORDS: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    str: "a text in quotes",
    Path: "a path",
    np.ndarray: "an array of numbers",
    Mapping: "a dict",
    type(None): "None",
    Callable: "a function",
}


def in_words(hint: Any) -> str:
    """A type as a sentence names it."""
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(in_words(part) for part in parts))
    if (origin or hint) in WORDS:
        return WORDS[origin or hint]
    if origin in (Iterable, list, tuple):
        return "finite numbers" if parts[:1] == (float,) else "a list or a tuple"
    name = getattr(origin or hint, "__name__", "something else")
    return f"{'an' if name[0].lower() in 'aeio' else 'a'} {name}"
