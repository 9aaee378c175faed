"""The regularity of a contact, which decides what a grazing is; it is determined from the traced
expressions.

Beside a grazing the return map has a term in the depth d by which a motion goes beyond the contact.
This term is a square root of d if the velocity changes at an impact, or if the acceleration at zero
speed jumps at the contact. If neither does, it is of the order d^(3/2), and the map's derivative is
continuous (di Bernardo, Budd and Champneys, Physica D 160 (2001) 222-254). A jump of the
acceleration proportional to the velocity, as by a damper on one side, also leaves d^(3/2): its
effects on the velocity on the way in and on the way out cancel, because the integral of x' over the
excursion is 0.
"""

from __future__ import annotations

from functools import lru_cache

from saltus.enumerations import Sentence
from saltus.taylor import Expr, Form, NoNormalForm, Trace, constant, constant_value, normal_form


class ContactRegularity(Sentence):
    """How a motion changes as it passes the contact.

    Examples
    --------
    >>> [kind.name for kind in saltus.flow.ContactRegularity]
    ['IMPACT', 'JUMP', 'CONTINUOUS']
    """

    IMPACT = "the velocity changes: a grazing is a square root in the map"
    JUMP = (
        "the velocity stays, the acceleration at zero speed jumps: a grazing is a square root "
        "in the map"
    )
    CONTINUOUS = (
        "neither changes at zero speed: the map's derivative is continuous, and a "
        "grazing is an ordinary orbit"
    )


@lru_cache(maxsize=4096)
def contact_regularity(
    traced: Trace, values: tuple[float, ...], free: tuple[str, ...] = ()
) -> ContactRegularity:
    """The regularity of a traced system's contact for the given numbers, and for any values of the
    parameters at the paths `free`.

    JUMP and CONTINUOUS are proved in exact arithmetic (`taylor/exact_algebra.py`); if no proof is
    found, the result is IMPACT or JUMP. Without a contact it is CONTINUOUS.
    """
    if traced.side_count == 0:
        return ContactRegularity.CONTINUOUS
    leaves = {
        Expr("parameter", (), i): constant(value)
        for i, (path, value) in enumerate(zip(traced.parameters, values, strict=True))
        if path not in free
    }
    try:
        if traced.side_count == 1 or not all(_passes(traced, leaves, side) for side in (1, -1)):
            return ContactRegularity.IMPACT
        equal = _contact_acceleration(traced, leaves, 1) == _contact_acceleration(
            traced, leaves, -1
        )
    except NoNormalForm:
        return ContactRegularity.IMPACT
    return ContactRegularity.CONTINUOUS if equal else ContactRegularity.JUMP


def _passes(traced: Trace, leaves: dict[Expr, Form], side: int) -> bool:
    """Whether an impact on a side leads to the other side without a change of the velocity, and the
    gap opens there.
    """
    assert traced.velocity_after is not None
    assert traced.next_side is not None
    assert traced.gap_rate is not None
    here, there = (leaves | {Expr("side"): constant(s)} for s in (side, -side))
    rates = [constant_value(normal_form(traced.gap_rate, known)) for known in (here, there)]
    return (
        normal_form(traced.velocity_after, here) == normal_form(Expr("velocity", (), 0))
        and constant_value(normal_form(traced.next_side, here)) == -side
        and rates[0] is not None
        and rates[1] is not None
        and rates[0] * rates[1] < 0
    )


def _contact_acceleration(traced: Trace, leaves: dict[Expr, Form], side: int) -> Form:
    """The acceleration at rest at the contact, on one side: a function of the time."""
    assert traced.contact is not None
    at = {
        Expr("coordinate", (), 0): normal_form(traced.contact, leaves),
        Expr("velocity", (), 0): {},
    }
    return normal_form(traced.acceleration[0], leaves | at | {Expr("side"): constant(side)})
