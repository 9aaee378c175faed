"""The kinds of arguments, as their annotations state them: the arguments of a public function are
compared with them in one place.

Truth values are compared before a function begins, as a list would pass for one. All else is
compared where a function fails with an error of Python's own, so that a call takes no longer. The
user then reads which argument is of another kind.
"""

from __future__ import annotations

import functools
import inspect
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from saltus.errors import ParameterError, shown

# what an object of saltus's own is, by the name of its class
OWN = {
    "System": "a System(model=..., load=..., impact=...)",
    "Model": "a Model, such as WallOscillator()",
    "Load": "a Load(...)",
    "ImpactLaw": "an ImpactLaw, such as NewtonImpact(e=0.5)",
    "PeriodicOrbit": "a PeriodicOrbit, as find_orbit gives it",
    "Motion": "a Motion, as simulate gives it",
    "Branch": "a Branch, as continue_orbit gives it",
    "SpecialPoint": "a SpecialPoint, as branch.special has them",
    "Measurement": "a Measurement(...)",
    "Plan": "a Plan(...)",
    "Metainterface": "a Metainterface",
    "TwoLayer": "a TwoLayer",
    "ContactModel": "a ContactModel, such as TwoStops()",
    "Contact": "a Contact",
    "Attractors": "what find_attractors gives",
    "Borders": "the borders of a chart",
    "Unknowns": "the unknowns of a fit",
}
PLAIN_NUMBERS = (int, float, np.integer, np.floating)


def _is_number(value: Any) -> bool:
    large = isinstance(value, int) and abs(value) > sys.float_info.max
    return isinstance(value, PLAIN_NUMBERS) and not isinstance(value, bool) and not large


def _is_switch(value: Any) -> bool:
    return isinstance(value, (bool, np.bool_))


def _is_pair(value: Any) -> bool:
    return _are_numbers(value) and np.shape(value) == (2,)


def _are_numbers(value: Any) -> bool:
    try:
        return np.asarray(value).dtype.kind in "biuf" and not np.ma.is_masked(value)
    except (TypeError, ValueError, OverflowError):
        return False


def _is_box(value: Any) -> bool:
    return _are_numbers(value) and np.ndim(value) == 2


def _is_list(value: Any) -> bool:
    return np.iterable(value) and not isinstance(value, (str, bytes))


def _is_dataset(value: Any) -> bool:
    kinds = type(value).__mro__
    own = {kind.__name__ for kind in kinds if kind.__module__.partition(".")[0] == "xarray"}
    return bool(own & {"Dataset", "DataTree"})


# each kind with the words for it, by the annotation up to its brackets
KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "bool": (_is_switch, "True or False"),
    "str": (lambda value: isinstance(value, str), "a text"),
    "Path": (lambda value: isinstance(value, os.PathLike), "the path of a file"),
    "Mapping": (lambda value: isinstance(value, Mapping), "a dict by name"),
    "dict": (lambda value: isinstance(value, Mapping), "a dict by name"),
    "Callable": (callable, "a function"),
    "Progress": (callable, "a function of the share that is done and of words"),
    "float": (_is_number, "a number"),
    "int": (_is_number, "a whole number"),
    "Number": (_is_number, "a number"),
    "Numbers": (_are_numbers, "a number or an array of numbers"),
    "Iterable[float]": (_are_numbers, "numbers"),
    "np.ndarray": (_are_numbers, "an array of numbers"),
    "tuple[float, float]": (_is_pair, "two numbers"),
    "Box": (_is_box, "pairs of numbers (lowest, highest)"),
    "Response": (callable, "a function"),
    "xarray.Dataset": (_is_dataset, "a Dataset that saltus has made"),
    "xarray.DataTree": (_is_dataset, "a DataTree that saltus has made"),
    "Iterable": (_is_list, "a list"),
    "Sequence": (_is_list, "a list"),
    "list": (_is_list, "a list"),
    "tuple": (_is_list, "a tuple"),
    "None": (lambda value: value is None, ""),
}
LISTS = ("Iterable", "Sequence", "list", "tuple")
PIECE = re.compile(r"(\w[\w.]*)(\[.*\])?")


def _own(name: str) -> Callable[[Any], bool]:
    """Whether an object is of a class with a name, or of one below it."""
    return lambda value: any(kind.__name__ == name for kind in type(value).__mro__)


@functools.cache
def _pieces(annotation: str) -> tuple[tuple[Callable[[Any], bool], str], ...]:
    """The kinds that an annotation allows; none where one of them is not known here."""
    found = []
    for piece in re.split(r" \| (?![^\[]*\])", annotation):
        match = PIECE.fullmatch(piece.strip())
        kind = KINDS.get(piece.strip()) or (KINDS.get(match[1]) if match else None)
        inner = _pieces(match[2][1:-1].removesuffix(", ...")) if match and match[2] else ()
        if kind is not None and inner and match and match[1] in LISTS:
            kind = (_list_of(inner), f"a list, each of which is {_words(inner)}")
        if kind is None and match and match[1].rpartition(".")[2] in OWN:
            name = match[1].rpartition(".")[2]
            kind = (_own(name), OWN[name])
        if kind is None:
            return ()
        found.append(kind)
    return tuple(found)


def _words(pieces: Iterable[tuple[Callable[[Any], bool], str]]) -> str:
    return " or ".join(dict.fromkeys(text for _, text in pieces if text))


def _list_of(pieces: Iterable[tuple[Callable[[Any], bool], str]]) -> Callable[[Any], bool]:
    """Whether a value is a list whose entries are of one of several kinds; an iterator is read no
    more than once, and not here."""
    return lambda value: (
        _is_list(value)
        and not isinstance(value, Mapping)
        and (
            not hasattr(value, "__len__") or all(any(fits(x) for fits, _ in pieces) for x in value)
        )
    )


def problem_of_kind(annotation: Any, value: Any) -> str | None:
    """What is wrong with the kind of a value, such as "must be a text, got 1"; None where its kind
    is right, or is not known.
    """
    pieces = _pieces(annotation) if isinstance(annotation, str) else ()
    if not pieces or any(fits(value) for fits, _ in pieces):
        return None
    return f"must be {_words(pieces)}, got {shown(value)}"


def switches_of(function: Callable[..., Any]) -> frozenset[str]:
    """The arguments of a function that are true or false."""
    known = function.__annotations__.items()
    return frozenset(name for name, annotation in known if annotation == "bool")


def check_switches(switches: frozenset[str], named: Mapping[str, Any]) -> None:
    """Refuse anything but true or false where that is meant, in the arguments `switches`.

    Raises
    ------
    ParameterError
        The error has the argument and its value.
    """
    for name in switches & named.keys():
        if not _is_switch(named[name]):
            raise ParameterError(f"{name} must be True or False, got {shown(named[name])}", name)


def check_together(
    function: Callable[..., Any], given: Iterable[Any], named: Mapping[str, Any]
) -> None:
    """Refuse arrays of numbers whose shapes do not fit one another.

    Raises
    ------
    ParameterError
        The error has the shapes.
    """
    signature = inspect.signature(function)
    try:
        arguments = signature.bind(*given, **named).arguments
    except TypeError:
        return
    shapes = {
        name: np.shape(value)
        for name, value in arguments.items()
        if str(signature.parameters[name].annotation).startswith("Numbers") and _are_numbers(value)
    }
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        texts = " and ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ParameterError(
            f"the shapes of {texts} do not fit one another", next(iter(shapes))
        ) from None


def check_kinds(
    function: Callable[..., Any], given: Iterable[Any], named: Mapping[str, Any]
) -> None:
    """Refuse arguments of other kinds than the annotations of a function.

    Raises
    ------
    ParameterError
        The error has the first such argument and its value.
    """
    signature = inspect.signature(function)
    try:
        bound = signature.bind(*given, **named)
    except TypeError:
        return
    for name, value in bound.arguments.items():
        parameter = signature.parameters[name]
        if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
            continue
        problem = problem_of_kind(parameter.annotation, value)
        if problem is not None:
            raise ParameterError(f"{name} {problem}", name)
