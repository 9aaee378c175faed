"""The regularity of surfaces, which decides what a touch of one is; it is determined from the
traced expressions.

Where the accelerations on both sides are equal at the surface without speed along it, the map's
derivative is continuous at a touch. It is so at such a single contact, too (see
`flow/one_contact/regularity.py`): the touch is no event of an orbit.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from saltus.taylor import (
    Expr,
    Form,
    NoNormalForm,
    Trace,
    constant,
    differentiate,
    leaves_of,
    normal_form,
    number,
    substitute,
)


@lru_cache(maxsize=4096)
def continuous_surfaces(
    traced: Trace, values: tuple[float, ...], free: tuple[str, ...] = ()
) -> frozenset[int]:
    """The numbers of the surfaces at which no acceleration jumps without speed, for the given
    numbers, and for any values of the parameters at the paths `free`.

    This is proved in exact arithmetic (`taylor/exact_algebra.py`); surfaces without a proof are
    left out. The accelerations are compared with all contacts open: where forces are equal, so are
    reactions.
    """
    leaves = {
        Expr("parameter", (), i): constant(value)
        for i, (path, value) in enumerate(zip(traced.parameters, values, strict=True))
        if path not in free
    } | {Expr("free", (), i): constant(1.0) for i in range(traced.dof)}
    frictions = sum(not part.is_surface for part in traced.sided)
    return frozenset(
        k - frictions
        for k, part in enumerate(traced.sided)
        if part.is_surface
        and k not in traced.keeping_sides
        and _is_continuous(traced, leaves, k, part.coordinate)
    )


def _places_on(traced: Trace, part: int, coordinate: int) -> list[dict[Expr, Any]]:
    """The leaves on a surface, where there is no speed along it: of a coordinate its position, of a
    function one of the leaves in which it is linear."""
    if coordinate < traced.dof:
        position = traced.levels[part]
        return [
            {Expr("coordinate", (), coordinate): position, Expr("velocity", (), coordinate): 0.0}
        ]
    function = traced.reactions[len(traced.signs) + 2 * part]
    found = list[dict[Expr, Any]]()
    for leaf in leaves_of(function):
        slope = differentiate(function, leaf)
        if not leaves_of(slope) and slope is not number(0.0):
            found.append({leaf: leaf - function / slope})
    return found


def _is_continuous(traced: Trace, leaves: dict[Expr, Form], part: int, coordinate: int) -> bool:
    """Whether the accelerations on both sides of a surface along a coordinate are equal, at rest
    along it.
    """
    if coordinate in traced.first_order_rows:
        return False
    for at in _places_on(traced, part, coordinate):
        try:
            above, below = (
                [
                    normal_form(
                        substitute(acceleration, at | {Expr("slide", (), part): side}), leaves
                    )
                    for acceleration in traced.acceleration[: traced.dof]
                ]
                for side in (1.0, -1.0)
            )
        except NoNormalForm:
            continue
        if above == below:
            return True
    return False
