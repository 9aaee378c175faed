"""The mirror symmetry of a system: images of its states, contacts and frictions, and the check of the model's `mirror`."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems.contact_model import normal_forces
from saltus.systems.impact_laws import ImpactLaw
from saltus.systems.model import Model

PROBE = (0.3711, 0.2931, 0.6173)  # An arbitrary time, gap and velocity, at which equations that differ have different values.
MIRROR_ROUNDING = 1e-9  # Accelerations and velocities of mirror images may differ by this, relatively, through rounding.


def image_places(model: Model) -> list[int]:
    """For each coordinate of a mirror image, the index of the original coordinate whose negative it is."""
    return [model.coordinates.index(name) for name in model.images]


def image_of(model: Model, states: np.ndarray) -> np.ndarray:
    """The mirror images of states (..., 2 coordinates), coordinates and then velocities."""
    places, n = image_places(model), len(model.coordinates)
    return np.asarray(-states[..., [*places, *(n + place for place in places)]])


def contact_images(model: Model, impact: ImpactLaw) -> tuple[int, ...] | None:
    """The index of the mirror image of each contact, then of each friction; None if one has no image or the laws differ."""
    contacts, frictions, count = model.contacts, model.frictions, len(model.contacts)
    found = []
    for contact in contacts:
        wanted = (model.images[model.coordinates.index(contact.coordinate)], -contact.sign, -float(contact.position))
        same = [i for i, c in enumerate(contacts) if (c.coordinate, c.sign, float(c.position)) == wanted]
        found += same
    for friction in frictions:
        numbers = (float(friction.kinetic), float(friction.most), -float(friction.ground_speed))
        image = (model.images[model.coordinates.index(friction.coordinate)], *numbers)
        found += [
            count + i
            for i, f in enumerate(frictions)
            if (f.coordinate, float(f.kinetic), float(f.most), float(f.ground_speed)) == image
        ]
    if len(found) < count + len(frictions):
        return None
    if not count:
        return tuple(found)  # frictions have no impact law
    law = np.array(impact.restitution_matrix(model), dtype=float).reshape(count, count)
    return tuple(found) if np.array_equal(law, law[np.ix_(found[:count], found[:count])]) else None


def check_mirror(system: Any, mirrored: Any, side: int) -> None:
    """Refuse a mirrored system in which the mirror image of a state does not move as the mirror image of the state's motion.

    Raises
    ------
    ParameterError
        The error names the class of the model.
    """
    model, (t, distance, v) = system.model, PROBE
    count, places = len(model.coordinates), image_places(model)
    if count == 1:
        into = model.inward(side) if model.sides else 1.0
        at = [model.contact + into * distance]
    else:
        at = [distance / (1 + i) for i in range(count)]
    rates = [v / (1 + i) for i in range(count)]
    there = _each(model.acceleration(t, _of(at), _of(rates), side, system.load))
    image = _each(model.acceleration(t, _of([-at[i] for i in places]), _of([-rates[i] for i in places]), -side, mirrored.load))
    pairs = [(there[i], x) for i, x in zip(places, image, strict=True)]
    names = [friction.coordinate for friction in model.frictions]
    pressing = normal_forces(model, t, _of(at), _of(rates), system.load)
    pressed = normal_forces(model, t, _of([-at[i] for i in places]), _of([-rates[i] for i in places]), mirrored.load)
    pairs += [(pressing[names.index(model.images[model.coordinates.index(c)])], -n) for c, n in zip(names, pressed, strict=True)]
    if model.sides:
        pairs.append((model.gap(at[0], side), -model.gap(-at[0], -side)))
        inward = -into * v
        one = model.reset(t, inward, side, system.load, system.impact)
        pairs += zip(one, model.reset(t, -inward, -side, mirrored.load, system.impact), strict=True)
    if any(abs(float(a) + float(b)) > MIRROR_ROUNDING * (1.0 + abs(float(a))) for a, b in pairs):
        raise ParameterError(
            f"{type(model).__name__}.mirror is no symmetry of its equations: with the signs of coordinate, velocity and side "
            "turned, the load that it returns does not turn the sign of the acceleration; return None where there is none"
        )


def _of(values: list[Any]) -> Any:
    return values[0] if len(values) == 1 else tuple(values)


def _each(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (tuple, list)) else [value]
