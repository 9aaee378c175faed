"""Which machine follows an ensemble: the lanes of this processor, or a card."""

from __future__ import annotations

from functools import cache
from typing import Any

from saltus.errors import ParameterError, SaltusError, shown
from saltus.flow.cuda.targets import Card, Target
from saltus.flow.kernel.compiled import Program
from saltus.progress import say

DEVICES = ("cpu", "cuda", "auto")
FEWEST = 130  # motions: fewer take less time on two cores, by the prototype's measurement
SLOW = 32  # single numbers that a card computes in the time of a double one


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


def target_of(device: str, run: Program, motions: int) -> Target | None:
    """The card on which so many motions of a program run, or None: the lanes of this processor.

    Raises
    ------
    ParameterError
        The card cannot follow motions of this kind, and is asked for.
    SaltusError
        There is no card, and it is asked for.
    """
    if device == "cpu":
        return None
    wrong = _refused(run)
    if device == "auto":
        return None if wrong or motions < FEWEST else _card_if_any()
    if wrong:
        raise ParameterError(f"{wrong} on a card: leave device out", "device")
    return card()


def _refused(run: Program) -> str:
    """Why the motions of a program are not followed on a card, or nothing."""
    if run.trace.several:
        return "models with several contacts or with friction are not followed"
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
