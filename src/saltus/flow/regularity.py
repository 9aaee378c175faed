"""What a contact does to the motion that passes it, and so what a grazing is: decided on the traced expressions.

Beside a grazing the return map of the states has a term in the depth d by which a motion goes through the contact. It is a square
root of d where the velocity changes at an impact, or the acceleration as the contact is passed without speed, and of the order
d^(3/2), so that the derivative is continuous, where neither does (di Bernardo, Budd and Champneys, Physica D 160 (2001) 222-254).
A jump of the acceleration that is proportional to the velocity, as by a damper that begins at the contact, leaves it at d^(3/2):
what it adds to the velocity on the way in it takes away on the way out, as the integral of x' over the excursion is 0.
"""

from __future__ import annotations

from functools import lru_cache

from saltus.enumerations import Sentence
from saltus.taylor import Expr, Form, NoNormalForm, Trace, constant, constant_value, normal_form


class ContactRegularity(Sentence):
    """What passing the contact does to a motion.

    Examples
    --------
    >>> [kind.name for kind in saltus.flow.ContactRegularity]
    ['IMPACT', 'JUMP', 'CONTINUOUS']
    """

    IMPACT = "the velocity changes: a grazing is a square root in the map"
    JUMP = "the velocity stays, the acceleration at zero speed jumps: a grazing is a square root in the map"
    CONTINUOUS = "neither changes at zero speed: the map's derivative is continuous, and a grazing is an ordinary orbit"


@lru_cache(maxsize=4096)
def contact_regularity(traced: Trace, values: tuple[float, ...], free: tuple[str, ...] = ()) -> ContactRegularity:
    """The regularity of a traced system's contact for the given numbers, whatever those at the paths `free` are.

    What is better than IMPACT is proved in exact arithmetic (`taylor/exact_algebra.py`); an identity for which no proof is found
    counts as none. Without a contact it is CONTINUOUS.
    """
    if traced.sides == 0:
        return ContactRegularity.CONTINUOUS
    leaves = {
        Expr("parameter", (), i): constant(value)
        for i, (path, value) in enumerate(zip(traced.parameters, values, strict=True))
        if path not in free
    }
    try:
        if traced.sides == 1 or not all(_passes(traced, leaves, side) for side in (1, -1)):
            return ContactRegularity.IMPACT
        equal = _contact_acceleration(traced, leaves, 1) == _contact_acceleration(traced, leaves, -1)
    except NoNormalForm:
        return ContactRegularity.IMPACT
    return ContactRegularity.CONTINUOUS if equal else ContactRegularity.JUMP


def _passes(traced: Trace, leaves: dict[Expr, Form], side: int) -> bool:
    """Whether an impact that ends a side leads to the other one with the velocity as it was, and the gap opens there."""
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
    at = {Expr("coordinate", (), 0): normal_form(traced.contact, leaves), Expr("velocity", (), 0): {}}
    return normal_form(traced.acceleration[0], leaves | at | {Expr("side"): constant(side)})
