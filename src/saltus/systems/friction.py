"""Dry friction with a known normal force, which may hold a coordinate at the velocity of the ground on which it slides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from saltus.errors import ParameterError

Number = Any  # a float, or a parameter of the model while its equations are traced

MOST_FRICTIONS = 6  # The most frictions: which stick, and which way the others slide, is found by trying 3^n choices at worst.


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Coulomb friction along a coordinate q on a ground that moves with the speed w, under the normal force N of the model:

        it slides, and the force on q is -mu_k N sign(q' - w), or it sticks, q' = w, and the force is at most mu_s N.

    N is the model's `normal_forces`, a function of time, state and load, but not of accelerations.

    Parameters
    ----------
    name
        Its name, such as "belt", in events.
    coordinate
        The name of the model's coordinate.
    kinetic
        mu_k, a number, which may be one of the model's parameters.
    static
        mu_s, at least mu_k; by default mu_k.
    ground_speed
        w, the speed of the ground.

    Examples
    --------
    >>> saltus.Friction(name="belt", coordinate="x", kinetic=0.2, static=0.3, ground_speed=0.5).static
    0.3
    """

    name: str
    coordinate: str
    kinetic: Number
    static: Number | None = None
    ground_speed: Number = 0.0

    @property
    def limit(self) -> str:
        """The name of the limit at which a motion ends, as the normal force does not press any more."""
        return f"normal force of {self.name}"

    @property
    def most(self) -> Any:
        """mu_s."""
        return self.kinetic if self.static is None else self.static


def check_frictions(model: Any) -> None:
    """Refuse frictions of a model that have no meaning.

    Raises
    ------
    ParameterError
        Too many frictions, two of one name or on one coordinate, an unknown coordinate or one with a contact, a model with sides,
        a coefficient below 0, mu_s < mu_k.
    """
    frictions, kind = model.frictions, type(model).__name__
    names = [part.name for part in (*model.contacts, *frictions)]
    if len(frictions) > MOST_FRICTIONS:
        raise ParameterError(f"{kind} has {len(frictions)} frictions, and at most {MOST_FRICTIONS} can be followed", "model")
    if len(set(names)) < len(names):
        raise ParameterError(f"contacts and frictions of {kind} must have names of their own, got {', '.join(names)}", "model")
    if model.sides:
        raise ParameterError(f"{kind} has frictions, so it must have no sides: give it `sides = ()`", "model")
    taken = [contact.coordinate for contact in model.contacts]
    for friction in frictions:
        where = f"the friction {friction.name!r} of {kind}"
        if friction.coordinate not in model.coordinates:
            raise ParameterError(f"{where} holds {friction.coordinate!r}, none of {', '.join(model.coordinates)}", "model")
        if friction.coordinate in taken:
            raise ParameterError(f"{where} and something else hold {friction.coordinate}: take two coordinates", "model")
        if not 0.0 <= float(friction.kinetic) <= float(friction.most):
            pair = f"kinetic = {float(friction.kinetic):g} and static = {float(friction.most):g}"
            raise ParameterError(f"{where} must have 0 <= kinetic <= static, got {pair}", "model")
        taken.append(friction.coordinate)
