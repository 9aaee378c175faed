"""Frictions without any force, which must not change a motion: they are left out of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from saltus.errors import SaltusError

if TYPE_CHECKING:
    from saltus.systems.system import System

# A number is moved by this share of itself, and as much, to see whether a friction depends on it.
MOVED = 1e-3
# numbers of these parts of a system are no coefficients of friction
OTHER_PARTS = ("load.", "impact.")


def inert_frictions(system: System, varied: Mapping[str, Iterable[float]]) -> tuple[int, ...]:
    """The numbers of the frictions whose coefficients are 0, for all values of what is varied too.

    Parameters
    ----------
    system
        What moves.
    varied
        For the path of each number that is varied, or of which derivatives are asked for, some of
        its values; none for values near its own.
    """
    inert: tuple[int, ...] = system._remembered("inert frictions", lambda: _without_force(system))
    paths = [path for path in varied if not path.startswith(OTHER_PARTS)]
    if not inert or not paths:
        return inert
    for path in paths:
        own = float(system.get(path))
        values = [*varied[path]] or [own * (1.0 + s) + s for s in (MOVED, -MOVED)]
        moved = [_moved(system, path, value) for value in values]
        inert = tuple(k for k in inert if all(other is not None and k in other for other in moved))
    return inert


def _without_force(system: System) -> tuple[int, ...]:
    frictions: Any = getattr(system.model, "frictions", ())
    return tuple(
        k
        for k, friction in enumerate(frictions)
        if float(friction.kinetic) == 0.0 and float(friction.most) == 0.0
    )


def _moved(system: System, path: str, value: float) -> tuple[int, ...] | None:
    """The frictions without force for another value of a number; all where it is refused."""
    try:
        return _without_force(system.with_({path: float(value)}))
    except SaltusError:
        return _without_force(system)
