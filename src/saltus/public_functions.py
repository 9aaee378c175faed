"""Public functions: an argument that a function does not have is refused with the names that are near, and checks come first.

What is checked besides are values, by the function itself; of an object of a senseless type Python's own error says enough.
"""

from __future__ import annotations

import functools
import inspect
import itertools
from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, Protocol, TypeAlias, TypeVar, cast

from saltus.checks import LIMITS
from saltus.errors import ParameterError, near, shown

P = ParamSpec("P")
R = TypeVar("R", covariant=True)
Numbers: TypeAlias = Any  # a number or an array of numbers, which the type checker cannot tell, as arrays have many types


class Checked(Protocol[P, R]):
    """A function whose arguments can be checked without computing anything."""

    __name__: str

    def __call__(self, *given: P.args, **named: P.kwargs) -> R:
        """Call the function."""

    def check(self, *given: P.args, **named: P.kwargs) -> None:
        """Refuse the arguments that the function would refuse."""


def checked_by(check: Callable[..., object]) -> Callable[[Callable[P, R]], Checked[P, R]]:
    """A decorator by which a function refuses arguments without meaning before it begins, and has `function.check(...)`.

    `check` is called with every argument of the function by its name, defaults included. Iterators are replaced by tuples, as
    they can be read only once.
    """

    def decorate(function: Callable[P, R]) -> Checked[P, R]:
        open_ended = [p.name for p in inspect.signature(function).parameters.values() if p.kind is p.VAR_KEYWORD]

        def refuse(*given: Any, **named: Any) -> inspect.BoundArguments:
            bound = bound_arguments(function, given, named)
            bound.apply_defaults()
            for name, value in bound.arguments.items():
                if isinstance(value, Iterator):
                    bound.arguments[name] = tuple(itertools.islice(value, LIMITS.count + 1))
            arguments = dict(bound.arguments)
            for name in open_ended:
                arguments |= arguments.pop(name)
            check(**arguments)
            return bound

        @functools.wraps(function)
        def call(*given: Any, **named: Any) -> R:
            bound = refuse(*given, **named)
            return function(*bound.args, **bound.kwargs)

        vars(call).update(check=refuse, answers=True)
        return cast(Checked[P, R], call)

    return decorate


def answered(function: Callable[P, R]) -> Callable[P, R]:
    """The function, for users: an argument that it does not have is refused as `bound_arguments` does it."""

    @functools.wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> R:
        try:
            return function(*given, **named)
        except TypeError:
            bound_arguments(function, given, named)
            raise

    vars(call)["answers"] = True
    return call


def bound_arguments(function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]) -> inspect.BoundArguments:
    """The arguments of a call by their names.

    Raises
    ------
    ParameterError
        An argument is unknown (the error gives similar names), missing, or given twice.
    """
    signature = inspect.signature(function)
    try:
        return signature.bind(*given, **named)
    except TypeError as error:
        sentence, known = str(error), signature.parameters
        if sentence == "too many positional arguments":
            names = getattr(getattr(given[0], "model", None), "coordinates", ())
            example = ", ".join(f"{name}={shown(value, 20)}" for name, value in zip(names, given[1:], strict=False))
            sentence += f"; give the arguments after the first by their names{f': {example}' if example else ''}"
        wrong = next((name for name in named if name not in known), None)
        if wrong is not None and not any(p.kind is p.VAR_KEYWORD for p in known.values()):
            sentence = f"has no argument {wrong!r:.40}; {near(wrong, [name for name in known if name != 'self'])}"
        else:
            wrong = next((name for name in known if sentence.endswith(repr(name))), None)  # missing, or given twice
        owner, _, own = function.__qualname__.rpartition(".")
        name = owner.rpartition(".")[2] if own == "__init__" else own
        raise ParameterError(f"{name}() {sentence}", wrong) from None
