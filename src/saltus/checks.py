"""Checks of arguments: values, shared by every model, load and impact law; and those that a public
function does not have, which are refused with the names that are near. Of an object of a senseless
type Python's own error says enough."""

from __future__ import annotations

import contextlib
import functools
import inspect
import itertools
import math
import os
import re
import struct
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeAlias, TypeVar, cast

import numpy as np

from saltus.errors import ParameterError, SaltusError, near, shown
from saltus.kinds import check_kinds, check_switches, check_together, switches_of
from saltus.progress import LongWork, is_unwatched, silent, watched


class ManyNumbers(np.ndarray):
    """A number of a system for each of many motions. Each motion's own system checks it."""


@dataclass(frozen=True)
class Limits:
    """The most that may be asked for, on any machine; the memory that a request needs is estimated
    besides.
    """

    # Motions, points, samples: more of them at once are a typing error, and fit into no memory.
    count: int = 10_000_000
    periods: int = 10**12  # Forcing periods, or units of time, of one motion: days of one core.
    # No machine has so many cores, and each thread takes memory before it does anything.
    threads: int = 1024
    # The size of any number: differences and squares of larger numbers overflow.
    value: float = 1e100
    # Of a structure: one of more is reduced first, as few of its modes matter.
    coordinates: int = 200
    # Steps of a search for a zero between two places: one of 1e-300 takes a thousand halvings.
    halvings: int = 4000
    order: int = 1000  # The order of a harmonic: the step of the integrator shrinks with it.
    seed: int = 2**63 - 1  # The largest number that files and random generators can hold.
    # Bytes that a motion of an ensemble takes; 1000 were measured without its samples.
    motion: int = 2048
    # Bytes that a forcing period of a motion with dense output takes; 5400 were measured.
    dense: int = 6000
    # Motions times forcing periods: four days of one core, at three million in a second.
    work: float = 1e12
    # Loops over Taylor coefficients that take a minute to compile; saltus's own models have 92 at
    # most.
    operations: int = 600
    nodes: int = 100_000  # Operations of any kind in these equations that take a minute to compile.
    # Coordinates of a model whose code always goes through LLVM's passes, whose time grows faster
    # than it.
    optimised: int = 8
    lanes: float = 3.0  # The factor of the time of compiling for vector lanes; 2.7 was measured.
    # The most minutes of compiling for lanes or derivatives; those of 32 cells are estimated at
    # two.
    compiling: float = 5.0
    # The share of the free memory that one request may take: the rest keeps the machine usable.
    memory: float = 0.8
    # Letters of LLVM's text that are compiled in a second; 1.7e5 to 3.5e5 were measured.
    letters: float = 2e5
    unsaid: float = 2.0  # Seconds of compiling without a word to whoever watches the progress.
    # Bytes that are always free: smaller requests are not checked, as checking takes time.
    any_machine: float = 1e8


LIMITS = Limits()
MOST = dict.fromkeys(("periods", "transient", "settle"), LIMITS.periods)
MOST |= {
    "seed": LIMITS.seed,
    "threads": LIMITS.threads,
    "workers": LIMITS.threads,
    "order": LIMITS.order,
}


def check_number(name: str, value: Any, **bounds: Any) -> None:
    """Refuse anything but a finite real number within the bounds of `number_problem`.

    Raises
    ------
    ParameterError
        The error has the name, the range and the value, and a hint if the number is likely in
        degrees.
    """
    plain = not bounds and type(value) is float and abs(value) <= LIMITS.value
    problem = None if plain else number_problem(value, **bounds)
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
    """What is wrong with a value that must be a finite real number within bounds, such as "must lie
    in [0, 1], got 2".
    """
    number = isinstance(value, (float, int, np.floating, np.integer)) and not isinstance(
        value, (bool, np.timedelta64)
    )
    if number and isinstance(value, int) and abs(value) > sys.float_info.max:
        value = math.inf
    inside = (
        number
        and math.isfinite(value)
        and (above is None or value > above)
        and (below is None or value < below)
        and (at_least is None or value >= at_least)
        and (at_most is None or value <= at_most)
    )
    if inside:
        return (
            None
            if abs(float(value)) <= LIMITS.value
            else f"must be at most {LIMITS.value:g} in size, got {shown(value)}"
        )
    wanted = range_text(above, below, at_least, at_most) + (f" {unit}" if unit else "")
    if not number:
        kind = wanted.replace("lie in", "be a number in").replace("be finite", "be a finite number")
        return f"must {kind}, got {shown(value)}"
    hint = (
        " (degrees?)" if unit == "rad" and math.isfinite(value) and 3.2 < abs(value) <= 360 else ""
    )
    return f"must {wanted}, got {shown(value)}{hint}"


def range_text(
    above: float | None, below: float | None, at_least: float | None, at_most: float | None
) -> str:
    """A range in words, such as "lie in [0, 1]"."""
    if above is None and at_least is None and below is None and at_most is None:
        return "be finite"
    left = (
        f"({_short(above)}"
        if above is not None
        else "(-inf"
        if at_least is None
        else f"[{_short(at_least)}"
    )
    right = (
        f"{_short(below)})"
        if below is not None
        else "inf)"
        if at_most is None
        else f"{_short(at_most)}]"
    )
    return f"lie in {left}, {right}"


def _short(value: float) -> str:
    for multiple, text in (
        (math.pi, "pi"),
        (math.pi / 2, "pi/2"),
        (-math.pi, "-pi"),
        (2 * math.pi, "2 pi"),
    ):
        if value == multiple:
            return text
    return f"{value:g}"


def check_count(name: str, value: Any, at_least: int, at_most: int | None = None) -> None:
    """Refuse anything but a whole number within the bounds; the upper bound is that of `Limits` if
    none is given.

    Raises
    ------
    ParameterError
        The error has the name, the range and the value.
    """
    at_most = MOST.get(name.rpartition(".")[2], LIMITS.count) if at_most is None else at_most
    problem = number_problem(value, at_least=at_least, at_most=at_most)
    if problem is None and not isinstance(value, (int, np.integer)):
        problem = f"must be a whole number, got {shown(value)}"
    if problem is not None:
        raise ParameterError(f"{name} {problem.replace('be a number', 'be a whole number')}", name)


def check_memory(name: str, size: float, what: str) -> None:
    """Refuse a request that needs more than its share of the memory that is free, before anything
    is computed.

    Parameters
    ----------
    name
        The argument to make smaller.
    size
        The estimate, in bytes.
    what
        What needs it, such as "1000000 starts".

    Raises
    ------
    ParameterError
        The error has the estimate and the free memory.
    """
    free = free_memory() if size > LIMITS.any_machine else math.inf
    if size > LIMITS.memory * free:
        raise ParameterError(
            f"{name} is too large: {what} need about {size / 1e9:.3g} GB of memory, and"
            f" {free / 1e9:.3g} GB are free",
            name,
        )


def check_work(name: str, motions: float, periods: float) -> None:
    """Refuse a number of motions of so many forcing periods that would take days.

    Raises
    ------
    ParameterError
        The error has the estimate.
    """
    if motions * periods > LIMITS.work:
        days = motions * periods / LIMITS.work * 4.0
        raise ParameterError(
            f"{name} is too large: {motions:.3g} motions of {periods:.3g} forcing periods take"
            f" about {days:.2g} days of one core, and {LIMITS.work:.0e} periods in all are the"
            " most",
            name,
        )


def check_starts(starts: Any, beside: int = 1) -> None:
    """Refuse a number of initial states that is no such number, or that needs too much memory,
    `beside` times as many at once.

    Raises
    ------
    ParameterError
        The error has the range, or the estimate of the memory.
    """
    check_count("starts", starts, 1)
    each = f" in each of {beside} places" if beside > 1 else ""
    check_memory("starts", float(starts) * beside * LIMITS.motion, f"{starts} starts{each}")


def free_memory() -> float:
    """The memory that is available to programs, in bytes; infinite if the operating system does not
    say it.
    """
    found = [math.inf]
    with contextlib.suppress(OSError, ValueError, IndexError):
        lines = Path("/proc/meminfo").read_text().splitlines()
        found += [
            1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable")
        ]
    with contextlib.suppress(OSError, ValueError):  # the limit of a container
        group = Path("/sys/fs/cgroup")
        used = float((group / "memory.current").read_text())
        found.append(max(0.0, float((group / "memory.max").read_text()) - used))
    if len(found) == 1 and hasattr(os, "sysconf"):
        with contextlib.suppress(OSError, ValueError):
            found.append(float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE"))
    return min(found)


def check_dataset(
    dataset: Any,
    source: str,
    variables: Iterable[str],
    attributes: Iterable[str] = (),
    name: str = "dataset",
) -> None:
    """Refuse a dataset that lacks variables or attributes of the datasets that `source`, a
    function, makes.

    Raises
    ------
    ParameterError
        The error names what is missing.
    """
    lacks = [each for each in variables if each not in dataset] + [
        each for each in attributes if each not in dataset.attrs
    ]
    if lacks:
        raise ParameterError(
            f"{name} must be the dataset of {source}; this one lacks {lacks[0]!r}", name
        )


def check_bounds(bounds: Any, name: str = "bounds") -> tuple[float, float]:
    """Two finite numbers, the smaller first.

    Raises
    ------
    ParameterError
        Bounds that are not such a pair.
    """
    try:
        low, high = (float(x) for x in real_array(list(bounds)))
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} must be two numbers (lowest, highest), got {shown(bounds)}", name
        ) from None
    if not -math.inf < low < high < math.inf:
        raise ParameterError(
            f"{name} must be two numbers, the smaller one first, got {shown(bounds)}", name
        )
    return low, high


def check_step(step: Any) -> None:
    """Refuse longest steps along a curve outside [1e-6, 1]: shorter ones take for ever, longer ones
    miss its features.

    Raises
    ------
    ParameterError
        A step that is no number in [1e-6, 1].
    """
    check_number("step", step, at_least=1e-6, at_most=1.0)


def check_size(values: Any, name: str | None = None) -> None:
    """Refuse more values than can be meant before they become an array: a range, or an array that
    repeats one number, may be longer than the memory.

    Raises
    ------
    ParameterError
        The error has the number of values.
    """
    size = (
        getattr(values, "size", None)
        if hasattr(values, "ndim")
        else len(values)
        if hasattr(values, "__len__")
        else 0
    )
    if isinstance(size, int) and size > LIMITS.count:
        raise ParameterError(
            f"{name or 'a list'} has {size} values; at most {LIMITS.count} are allowed", name
        )


def real_array(given: Any) -> np.ndarray:
    """An array of real numbers, from what NumPy takes for one.

    Raises
    ------
    TypeError
        Complex numbers, which would lose their imaginary parts, or masked ones, which would count.
    """
    array = np.asarray(given)
    if array.dtype.kind == "c" or np.ma.is_masked(given):
        raise TypeError("complex or masked numbers")
    return array if array.dtype == float else array.astype(float)


def as_numbers(given: Any, name: str | None = None) -> np.ndarray:
    """An array of numbers; an empty one for anything else, so that functions that refuse an empty
    array refuse it too.

    Raises
    ------
    ParameterError
        There are more of them than can be meant.
    """
    if not hasattr(given, "__array__") and np.iterable(given):
        given = list(itertools.islice(given, LIMITS.count + 1))  # an iterator may have no end
    check_size(given, name)
    try:
        return real_array(given)
    except (TypeError, ValueError, OverflowError):
        return np.empty(0)


def check_axis(name: str, values: Any, either_way: bool = False) -> np.ndarray:
    """The numbers along an axis of a grid, which may also fall if they may go `either_way`.

    Raises
    ------
    ParameterError
        Anything but a list of finite increasing numbers, or of falling ones; the error has the
        name.
    """
    axis = np.atleast_1d(as_numbers(values, name))
    falls = either_way and axis.ndim == 1 and axis.size > 1 and axis[0] > axis[-1]
    steps = np.diff(-axis if falls else axis)
    if (
        axis.ndim != 1
        or not axis.size
        or not (np.abs(axis) <= LIMITS.value).all()
        or not (steps > 0).all()
    ):
        order = "rise, or all fall, each beyond" if either_way else "rise, each above"
        raise ParameterError(
            f"{name} must be numbers that {order} the one before, got {shown(values)}", name
        )
    return axis


def check_names(name: str, values: Any, meaning: str) -> tuple[str, ...]:
    """The texts of a list, or a single one.

    Raises
    ------
    ParameterError
        Anything else; the error has the name, and `meaning` says of what the texts are the names.
    """
    try:
        texts = (values,) if isinstance(values, str) else tuple(values)
    except TypeError:
        texts = (None,)
    if not all(isinstance(text, str) for text in texts):
        raise ParameterError(f"{name} must be the names of {meaning}, got {shown(values)}", name)
    return texts


def instants(times: Any) -> np.ndarray:
    """A time or a list of times as an array (n,).

    Raises
    ------
    ParameterError
        Anything else.
    """
    check_size(times, "times")
    try:
        asked = np.atleast_1d(real_array(times))
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"times must be a number or an array of numbers, got {shown(times)}", "times"
        ) from None
    if asked.ndim > 1:
        raise ParameterError(
            f"times must be a number or a list of numbers, got an array of shape {asked.shape}",
            "times",
        )
    return asked


def check_states(name: str, states: Any, dimension: int = 2) -> np.ndarray:
    """States, coordinates then velocities, as an array (n, dimension).

    Raises
    ------
    ParameterError
        Anything but such an array of finite numbers; the error has the name.
    """
    check_size(states, name)
    try:
        array = real_array(states).reshape(-1, dimension)
    except (TypeError, ValueError, OverflowError):
        array = np.full((1, dimension), np.nan)
    if not (np.abs(array) <= LIMITS.value).all():
        each = "coordinate, velocity" if dimension == 2 else "coordinates, velocities"
        raise ParameterError(
            f"{name} must be states ({each}), an array (n, {dimension}), got {shown(states)}", name
        )
    return array


def notice_degrees(name: str, value: float) -> None:
    """Warn of a whole number as an angle of more than a turn, which is allowed, and is hardly ever
    meant in radians.
    """
    if abs(value) > 2.0 * math.pi and float(value).is_integer():
        text = (
            f"{name} = {value:g} is read in radians; {value:g} degrees are np.radians({value:g}) ="
            f" {math.radians(value):.6g}"
        )
        warnings.warn(text, UserWarning, stacklevel=2)


def check_environment() -> None:
    """Refuse settings that would make numba fail with its own message when it is imported, or,
    without its compiler, much later.

    Raises
    ------
    SaltusError
        NUMBA_DISABLE_JIT is set, or NUMBA_NUM_THREADS is no count.
    """
    disabled = os.environ.get("NUMBA_DISABLE_JIT", "0")
    threads = os.environ.get("NUMBA_NUM_THREADS", "1")
    if disabled not in ("", "0"):
        raise SaltusError(
            "the environment has NUMBA_DISABLE_JIT set, but saltus needs its compiler; unset it"
        )
    if not (threads.isdecimal() and int(threads) > 0):
        raise SaltusError(
            f"the environment has NUMBA_NUM_THREADS={threads[:20]!r}, which is not a number of "
            f"threads; unset it"
        )


P = ParamSpec("P")
R = TypeVar("R", covariant=True)
Kind = TypeVar("Kind")
# a number or an array of numbers, which the type checker cannot tell, as arrays have many types
Numbers: TypeAlias = Any
# the velocity of a start: a number, or one for each coordinate
Speeds: TypeAlias = float | Iterable[float] | np.ndarray


class Checked(Protocol[P, R]):
    """A function whose arguments can be checked without computing anything."""

    __name__: str

    def __call__(self, *given: P.args, **named: P.kwargs) -> R:
        """Call the function."""

    def check(self, *given: P.args, **named: P.kwargs) -> None:
        """Refuse the arguments that the function would refuse."""


def checked_by(check: Callable[..., object]) -> Callable[[Callable[P, R]], Checked[P, R]]:
    """A decorator by which a function refuses arguments without meaning before it begins, and has
    `function.check(...)`.

    `check` is called with every argument of the function by its name, defaults included. Iterators
    are replaced by tuples, as they can be read only once.
    """

    def decorate(function: Callable[P, R]) -> Checked[P, R]:
        switches = switches_of(function)
        shows = _has_progress(function)
        open_ended = [
            p.name
            for p in inspect.signature(function).parameters.values()
            if p.kind is p.VAR_KEYWORD
        ]

        def refuse(*given: Any, **named: Any) -> inspect.BoundArguments:
            bound = bound_arguments(function, given, named)
            check_switches(switches, named)
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
            try:
                bound = refuse(*given, **named)
                if shows or "progress" in named:
                    return told(function, *bound.args, **bound.kwargs)
                return function(*bound.args, **bound.kwargs)
            except OF_OTHER_KINDS as error:
                _refuse_kinds(function, given, named, error)
                raise

        vars(call).update(check=refuse, answers=True)
        return cast(Checked[P, R], call)

    return decorate


def answered(function: Callable[P, R]) -> Callable[P, R]:
    """The function, for users: an argument that it does not have is refused as `bound_arguments`
    does it, and one of another kind than its annotation as `check_kinds` does it.
    """

    switches = switches_of(function)
    shows = _has_progress(function)

    @functools.wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> R:
        if not switches.isdisjoint(named):
            check_switches(switches, named)
        try:
            if "progress" in named or shows:
                return told(function, *given, **named)
            return function(*given, **named)
        except OF_OTHER_KINDS as error:
            _refuse_kinds(function, given, named, error)
            raise

    vars(call)["answers"] = True
    return call


def with_answers(kind: type[Kind]) -> type[Kind]:
    """A class decorator by which the public methods of a class answer arguments that they do not
    have, and those of other kinds."""
    for name, method in list(vars(kind).items()):
        function = getattr(method, "__func__", method)
        plain = inspect.isfunction(function) and not name.startswith("_")
        if plain and not hasattr(function, "answers") and function.__code__.co_argcount > 1:
            wrapped: Any = answered(function)
            setattr(kind, name, type(method)(wrapped) if function is not method else wrapped)
    return kind


# what Python and NumPy raise where an argument is of another kind than was meant
OF_OTHER_KINDS = (
    *(TypeError, ValueError, AttributeError, LookupError, ArithmeticError, AssertionError),
    *(struct.error, IsADirectoryError, NotADirectoryError),
)


def _refuse_kinds(
    function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any], error: Exception
) -> None:
    """Refuse a call that failed by an error of Python's own because its arguments are unknown, or
    of other kinds than the function's annotations."""
    if isinstance(error, (IsADirectoryError, NotADirectoryError)):
        name = str(error.filename)
        raise ParameterError(f"{name} cannot be written ({error.strerror})", "path") from error
    if not isinstance(error, SaltusError):
        if isinstance(error, TypeError):
            bound_arguments(function, given, named)
            # one that went among the coordinates, and is an argument of what is called inside
            twice = re.search(r"multiple values for (?:keyword )?argument '(\w+)'", str(error))
            parameters = inspect.signature(function).parameters.values()
            known = [p.name for p in parameters if p.kind is not p.VAR_KEYWORD]
            if twice and twice[1] in named and twice[1] not in known:
                name = function.__qualname__
                raise ParameterError(
                    f"{name}() has no argument {twice[1]!r}; {near(twice[1], known)}", twice[1]
                )
        check_kinds(function, given, named)
        if isinstance(error, ValueError):
            check_together(function, given, named)


# functions that are called by the thousand show long work themselves
OWN_PROGRESS = frozenset({"simulate"})


def _has_progress(function: Callable[..., Any]) -> bool:
    """Whether a function has a progress, which is shown by default if it takes long."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None or function.__name__ in OWN_PROGRESS:
        return False
    named = code.co_varnames[code.co_argcount : code.co_argcount + code.co_kwonlyargcount]
    return "progress" in named


def told(function: Callable[P, R], /, *given: P.args, **named: P.kwargs) -> R:
    """Call a function of which somebody may watch the progress: what takes long within it is told
    too. A progress that nobody has asked for is shown if it takes long.
    """
    asked: Any = named.get("progress", silent)
    if not callable(asked) or (asked is silent and not is_unwatched()):
        return function(*given, **named)
    work = LongWork() if asked is silent else None
    try:
        with watched(work or asked) as named["progress"]:
            return function(*given, **named)
    finally:
        if work is not None:
            work.end()


def bound_arguments(
    function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]
) -> inspect.BoundArguments:
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
        sentence = str(error)
        known = signature.parameters
        if sentence == "too many positional arguments":
            names = getattr(getattr(given[0], "model", None), "coordinates", ())
            example = ", ".join(
                f"{name}={shown(value, 20)}" for name, value in zip(names, given[1:], strict=False)
            )
            first = any(
                p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
                for name, p in known.items()
                if name != "self"
            )
            those = "the arguments after the first" if first else "all arguments"
            sentence += f"; give {those} by their names{f': {example}' if example else ''}"
        wrong = next((name for name in named if name not in known), None)
        if wrong is not None and not any(p.kind is p.VAR_KEYWORD for p in known.values()):
            sentence = (
                f"has no argument {wrong!r:.40};"
                f" {near(wrong, [name for name in known if name != 'self'])}"
            )
        else:
            # missing, or given twice
            wrong = next((name for name in known if sentence.endswith(repr(name))), None)
        owner, _, own = function.__qualname__.rpartition(".")
        name = owner.rpartition(".")[2] if own == "__init__" else own
        raise ParameterError(f"{name}() {sentence}", wrong) from None
