"""Frictions without any force, which must not change a motion: they are left out of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, SaltusError
from saltus.systems.gap_places import has_no_force
from saltus.systems.serial import numbers, replace

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
    if paths:
        _check_left_out(system, {path: varied[path] for path in paths})
    if not inert or not paths:
        return inert
    for path in paths:
        moved = [_moved(system, path, value) for value in _values_of(system, path, varied[path])]
        inert = tuple(k for k in inert if all(other is not None and k in other for other in moved))
    return inert


def where_inert(system: System) -> list[dict[str, list[str]]]:
    """For each friction the paths of the numbers by which a page sees that it has no force.

    It has none where one of `any` is 0, or all of `all` are. A friction that never has a force has
    an empty list there, and one that always has a force has none.
    """
    frictions: Any = getattr(system.model, "frictions", ())
    found: list[dict[str, list[str]]] = [{"any": []} for _ in frictions]
    paths = [path for path, _ in numbers(system.model, "model")] if frictions else []
    moving: list[list[str]] = [[] for _ in frictions]
    for path in paths:
        own = float(system.get(path))
        for value in (0.0, own * (1.0 + MOVED) + MOVED):
            try:
                others = replace(system.model, {path.removeprefix("model."): value}).frictions
            except SaltusError:
                continue
            for k, (one, other) in enumerate(zip(frictions, others, strict=True)):
                if value == 0.0 and has_no_force(other):
                    found[k]["any"].append(path)
                if (one.kinetic, one.most) != (other.kinetic, other.most):
                    moving[k].append(path)
    for k, friction in enumerate(frictions):
        found[k]["any"] = [path for path in found[k]["any"] if path in moving[k]]
        if moving[k] or has_no_force(friction):
            found[k]["all"] = list(dict.fromkeys(moving[k]))
    return found


def _check_left_out(system: System, varied: Mapping[str, Iterable[float]]) -> None:
    """Refuse to vary what gives a force to a friction that has no coordinate, as it had none.

    Raises
    ------
    ParameterError
        The error names the friction and the number.
    """
    for friction in getattr(system.model, "left_out", ()):
        for path, values in varied.items():
            for value in _values_of(system, path, values):
                try:
                    moved = replace(system.model, {path.removeprefix("model."): float(value)})
                except SaltusError:
                    continue
                if not all(map(has_no_force, moved.left_out)):
                    raise ParameterError(
                        f"the friction {friction.name!r} has no coordinate of its own beside the"
                        f" sums of contacts, as its coefficients are 0: {path} cannot be varied here",
                        path,
                    )


def _values_of(system: System, path: str, values: Iterable[float]) -> list[float]:
    """Some of the values of a number, or values near its own."""
    own = float(system.get(path))
    return [*values] or [own * (1.0 + s) + s for s in (MOVED, -MOVED)]


def _without_force(system: System) -> tuple[int, ...]:
    frictions: Any = getattr(system.model, "frictions", ())
    return tuple(k for k, friction in enumerate(frictions) if has_no_force(friction))


def _moved(system: System, path: str, value: float) -> tuple[int, ...] | None:
    """The frictions without force for another value of a number; all where it is refused."""
    try:
        return _without_force(system.with_({path: float(value)}))
    except SaltusError:
        return _without_force(system)
