"""Checks of parameter values, shared by every model, load and impact law."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec, Protocol, TypeVar, cast

import numpy as np

from saltus.errors import ParameterError, near

if TYPE_CHECKING:
    from saltus.systems import System

P = ParamSpec("P")
R = TypeVar("R", covariant=True)

RADIANS = {"unit": "rad"}  # the metadata of a dataclass's field that is an angle
HALF_WIDTH = 1.5  # of the window that is taken where none is given: about the size of the motions that the paper shows


def check_number(name: str, value: Any, **bounds: Any) -> None:
    """Refuse what is not a finite real number within the bounds of `number_problem`.

    Raises:
        ParameterError: with the name, the range and the value, and a hint where degrees look likely.
    """
    problem = number_problem(value, **bounds)
    if problem is not None:
        raise ParameterError(f"{name} {problem}", name)


def number_problem(
    value: Any,
    *,
    above: float | None = None,
    below: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    unit: str = "",
) -> str | None:
    """What is wrong with a value that must be a finite real number within bounds, such as "must lie in [0, 1], got 2"."""
    number = isinstance(value, (float, int, np.floating, np.integer)) and not isinstance(value, bool)
    if number and isinstance(value, int) and abs(value) > sys.float_info.max:
        value = math.inf
    wanted = _range_text(above, below, at_least, at_most) + (f" {unit}" if unit else "")
    if not number:
        kind = wanted.replace("lie in", "be a number in").replace("be finite", "be a finite number")
        return f"must {kind}, got {value!r}"
    inside = (
        math.isfinite(value)
        and (above is None or value > above)
        and (below is None or value < below)
        and (at_least is None or value >= at_least)
        and (at_most is None or value <= at_most)
    )
    if inside:
        return None
    hint = " (degrees?)" if unit == "rad" and math.isfinite(value) and 3.2 < abs(value) <= 360 else ""
    return f"must {wanted}, got {value!r}{hint}"


def _range_text(above: float | None, below: float | None, at_least: float | None, at_most: float | None) -> str:
    if above is None and at_least is None and below is None and at_most is None:
        return "be finite"
    left = f"({_short(above)}" if above is not None else "(-inf" if at_least is None else f"[{_short(at_least)}"
    right = f"{_short(below)})" if below is not None else "inf)" if at_most is None else f"{_short(at_most)}]"
    return f"lie in {left}, {right}"


def _short(value: float) -> str:
    for multiple, text in ((math.pi, "pi"), (math.pi / 2, "pi/2"), (-math.pi, "-pi"), (2 * math.pi, "2 pi")):
        if value == multiple:
            return text
    return f"{value:g}"


def check_count(name: str, value: Any, at_least: int, at_most: int | None = None) -> None:
    """Refuse what is not a whole number within the stated bounds.

    Raises:
        ParameterError: with the name, the range and the value.
    """
    check_number(name, value, at_least=at_least, at_most=at_most)
    if value != int(value):
        raise ParameterError(f"{name} must be a whole number, got {value!r}", name)


def check_kind(name: str, value: Any, *kinds: type, source: str = "") -> None:
    """Refuse what is of none of the classes; `source` are the functions that return them.

    Raises:
        ParameterError: with the name, the first of the classes, the functions and the value.
    """
    if not isinstance(value, kinds):
        wanted = kinds[0].__name__
        article, returned = "an" if wanted[0].lower() in "aeio" else "a", f", as {source} gives it" if source else ""
        raise ParameterError(f"{name} must be {article} {wanted}{returned}, got {value!r:.80}", name)


def check_bounds(bounds: Any) -> tuple[float, float]:
    """Two finite numbers, the smaller first.

    Raises:
        ParameterError: bounds that are no such pair.
    """
    try:
        low, high = (float(x) for x in bounds)
    except (TypeError, ValueError):
        raise ParameterError(f"bounds must be two numbers (lowest, highest), got {bounds!r}", "bounds") from None
    if not -math.inf < low < high < math.inf:
        raise ParameterError(f"bounds must be two numbers, the smaller one first, got {bounds!r}", "bounds")
    return low, high


def check_axis(name: str, values: Any) -> np.ndarray:
    """The numbers along an axis of a grid.

    Raises:
        ParameterError: with the name, for what is no list of finite numbers that rise.
    """
    try:
        axis = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        axis = np.empty(0)
    if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all() or not (np.diff(axis) > 0).all():
        raise ParameterError(f"{name} must be numbers that rise, each above the one before, got {values!r:.80}", name)
    return axis


def check_path(system: Any, path: Any, name: str = "path") -> None:
    """Refuse what is not the dotted path of a number of the system.

    Raises:
        ParameterError: of the argument `name`, with the paths that are near.
    """
    if path in system.parameters:
        return
    try:
        system.get(path)
    except ParameterError as error:
        raise ParameterError(str(error), name) from None
    raise ParameterError(f"{path} is not a number, so nothing can be computed along it", name)


def check_along(system: Any, path: str, values: Iterable[float], name: str) -> None:
    """Refuse values of the parameter at `path` that the system does not allow.

    Raises:
        ParameterError: of the argument `name`, with what the system says.
    """
    for value in values:
        try:
            system.with_({path: float(value)})
        except ParameterError as error:
            raise ParameterError(f"{name} reach beyond what the system allows: {error}", name) from None


Rectangle = tuple[tuple[float, float], tuple[float, float]]  # bounds of the coordinate, and of the velocity


class Window(NamedTuple):
    """A rectangle of the state plane, by the bounds of the first coordinate and of its velocity."""

    coordinate: tuple[float, float]
    velocity: tuple[float, float]

    @property
    def centre(self) -> np.ndarray:
        """Its middle, (2,)."""
        return np.asarray(self).mean(axis=1)

    @property
    def half(self) -> np.ndarray:
        """Its half widths, (2,)."""
        return 0.5 * np.diff(np.asarray(self), axis=1)[:, 0]

    def scaled(self, states: np.ndarray) -> np.ndarray:
        """States (..., 2) in half widths from the middle."""
        return np.asarray((states - self.centre) / self.half)


def check_window(window: Any, system: System) -> Window:
    """A window of the state plane; that of half widths 1.5 around the contact, or around 0 without one, for None.

    Raises:
        ParameterError: what is no pair of bounds for the coordinate and one for the velocity.
    """
    if window is None:
        contact = float(system.model.contact) if system.model.sides else 0.0
        return Window((contact - HALF_WIDTH, contact + HALF_WIDTH), (-HALF_WIDTH, HALF_WIDTH))
    try:
        bounds = np.asarray(window, dtype=float)
    except (TypeError, ValueError):
        bounds = np.empty(0)
    if bounds.shape != (2, 2) or not np.isfinite(bounds).all() or not (bounds[:, 0] < bounds[:, 1]).all():
        raise ParameterError(f"window must be ((least, largest coordinate), (least, largest velocity)), got {window!r}", "window")
    return Window(*map(tuple, bounds.tolist()))


def check_states(name: str, states: Any) -> np.ndarray:
    """States (coordinate, velocity) as an array (n, 2).

    Raises:
        ParameterError: with the name, for what is no such array, or not finite.
    """
    try:
        array = np.asarray(states, dtype=float).reshape(-1, 2)
    except (TypeError, ValueError):
        array = np.full((1, 2), np.nan)
    if not np.isfinite(array).all():
        raise ParameterError(f"{name} must be states (coordinate, velocity), an array (n, 2), got {states!r}", name)
    return array


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
            try:
                bound = signature.bind(*given, **named)
            except TypeError as error:
                unknown = [name for name in named if name not in signature.parameters]
                hint = f"; {near(unknown[0], signature.parameters)}" if unknown and not open_ended else ""
                raise TypeError(f"{function.__name__}() {error}{hint}") from None
            bound.apply_defaults()
            arguments = dict(bound.arguments)
            for name in open_ended:
                arguments |= arguments.pop(name)
            check(**arguments)

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


def settle_numbers(owner: Any, *names: str, **bounds: Any) -> None:
    """Check fields of a frozen dataclass against the bounds of `check_number` and store them as plain floats.

    The unit of a field is that of its metadata, as in `field(metadata=RADIANS)`.
    """
    units = {f.name: f.metadata.get("unit", "") for f in dataclasses.fields(owner)}
    for name in names:
        check_number(name, getattr(owner, name), unit=units[name], **bounds)
        object.__setattr__(owner, name, float(getattr(owner, name)))
