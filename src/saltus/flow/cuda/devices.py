"""Which machine follows an ensemble: the lanes of this processor, or a card.

A study is told its device once, by the argument `device` of its function; all ensembles within it
ask here (`on_device`). A study asks for derivatives and for a few motions now and then: these are
followed by the lanes, also where a card is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from saltus.errors import ParameterError, SaltusError, shown
from saltus.flow.cuda.targets import Card, Target
from saltus.flow.programs.compiled import Program
from saltus.progress import say
from saltus.systems import System
from saltus.taylor import trace

P = ParamSpec("P")
R = TypeVar("R")

DEVICES = ("cpu", "cuda", "auto")
# Motions for each core of this processor: fewer take less time there, by the prototype's
# measurement.
FEWEST = 65
# Forcing periods of all motions for each core, which it follows in about a second: for less nobody
# waits for a card, whose code may have to be made first.
LEAST_WORK = 1e6
SLOW = 32  # single numbers that a card computes in the time of a double one
RUBBING = "models with friction or with surfaces are not followed"


@dataclass
class _Choice:
    """The device of a study, and those that have followed ensembles of it."""

    device: str
    used: set[str] = field(default_factory=set)


_CHOICE: ContextVar[_Choice | None] = ContextVar("device of a study", default=None)


def read_device(device: Any) -> str:
    """The name of a device.

    Raises
    ------
    ParameterError
        It is none.
    """
    if not isinstance(device, str) or device not in DEVICES:
        wanted = ", ".join(DEVICES)
        raise ParameterError(f"device must be one of {wanted}, got {shown(device)}", "device")
    return device


def check_device(
    device: Any, system: System, workers: object = None, scheduler: object = None
) -> str:
    """The name of the device of a study of a system.

    Raises
    ------
    ParameterError
        It is none, the card cannot follow the system, or other processes compute.
    SaltusError
        There is no card, and it is asked for.
    """
    if read_device(device) != "cpu" and (workers is not None or scheduler is not None):
        raise ParameterError(
            "a card follows the motions of one process: leave device out, or workers and scheduler",
            "device",
        )
    if device == "cuda":
        if trace(system.in_gap_coordinates).sided:
            raise ParameterError(f"{RUBBING} on a card: leave device out", "device")
        card()
    return str(device)


def on_device(study: Callable[P, R]) -> Callable[P, R]:
    """A study, a function with an argument `device`, all ensembles of which run there; its result
    names the card as `device`.
    """

    @wraps(study)
    def call(*given: P.args, **named: P.kwargs) -> R:
        choice = _CHOICE.get() or _Choice(read_device(named.get("device", "cpu")))
        before = _CHOICE.set(choice)
        try:
            return _named(study(*given, **named), ", ".join(sorted(choice.used)))
        finally:
            _CHOICE.reset(before)

    return call


def _named(result: R, device: str) -> R:
    """A result that names its device."""
    if not device:
        return result
    if is_dataclass(result):
        return replace(result, device=device)  # type: ignore[type-var]
    result.attrs["device"] = device  # type: ignore[attr-defined]
    return result


def target_of(device: str, run: Program, motions: int, periods: float, cores: int) -> Target | None:
    """The card on which so many motions of a program run, of so many forcing periods in all, or
    None: the lanes on so many cores of this processor.

    Raises
    ------
    ParameterError
        The card cannot follow motions of this kind, and is asked for.
    SaltusError
        There is no card, and it is asked for.
    """
    study = _CHOICE.get()
    asked = device if device != "cpu" or study is None else study.device
    if asked == "cpu":
        return None
    wrong = _refused(run)
    few = motions < FEWEST * cores
    found: Target | None
    if asked == "auto":
        few = few or periods < LEAST_WORK * cores
        found = None if wrong or few else _card_if_any()
    elif study is not None:
        found = None if wrong or few else card()
    elif wrong:
        raise ParameterError(f"{wrong} on a card: leave device out", "device")
    else:
        found = card()
    if found is not None and study is not None:
        study.used.add(found.name)
    return found


def _refused(run: Program) -> str:
    """Why the motions of a program are not followed on a card, or nothing."""
    if run.trace.sided:
        return RUBBING
    if run.structure.several and run.model.eigenmodes.size:
        return "stiff structures, which move in eigenmodes, are not followed"
    if run.structure.sizes.columns:
        return "derivatives are not computed"
    return ""


@cache
def card() -> Card:
    """The card, which is opened once.

    Raises
    ------
    SaltusError
        There is none.
    """
    found = Card()
    if found.slow >= SLOW:
        say(f"{found.name} computes with doubles at 1/{found.slow} of its speed")
    return found


def _card_if_any() -> Card | None:
    try:
        return card()
    except SaltusError:
        return None


def has_card() -> bool:
    """Whether this machine has a card that follows motions."""
    return _card_if_any() is not None


def card_seen() -> str:
    """The card that this machine has, or why none is used.

    Examples
    --------
    >>> isinstance(saltus.flow.card_seen(), str)
    True
    """
    try:
        found = card()
    except SaltusError as error:
        return f"none: {error}"
    return (
        f"{found.name}, doubles at 1/{found.slow} of its speed, {found.free_memory / 2**30:.0f} GiB"
        " free"
    )
