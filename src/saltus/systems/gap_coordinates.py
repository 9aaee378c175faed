"""A model with several contacts in coordinates of its gaps: sums of coordinates that contacts keep take the places of terms.

The gap between two bodies, y - x, becomes a coordinate, and that over a table which shakes, x - zeta(t), too. Each contact then
holds one coordinate, as all that follows motions needs it, and where a wall moves its position stays constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import cache
from typing import Any, ClassVar

import numpy as np

from saltus.errors import ParameterError
from saltus.systems.contact_model import Contact, ContactModel, Friction, Surface, is_zero

Part = Contact | Surface | Friction
CLOSED_BELOW = 1e-13  # A contact is closed, up to rounding, if both its gap and its speed are smaller than this.


@dataclass(frozen=True)
class GapPlaces:
    """Which coordinates the gaps of a model take the place of."""

    names: tuple[str, ...]  # of the coordinates, in which the sum of a gap has the place of one of its terms
    order: tuple[int, ...]  # the places of sums, in the order in which their terms are eliminated
    contacts: tuple[tuple[int, int], ...]  # the place of each contact's sum, and +1, or -1 if the coordinate is minus the sum
    surfaces: tuple[tuple[int, int], ...]  # of each surface likewise
    frictions: tuple[tuple[int, int], ...]  # and of each friction


class InGapCoordinates(ContactModel):
    """A model in which sums z = A q + m(t) that its contacts keep on one side take the place of coordinates q = T (z - m):

        T' M T z'' = T' (r - M q_0'') + the reactions,    T = A^-1,    q_0 = -T m(t).

    Each contact then holds one coordinate, and its position stays constant where a wall moves. Its classes are made of a model's
    own by `in_gap_coordinates`, with the same numbers under the same names.
    """

    __slots__ = ()

    places: ClassVar[GapPlaces]
    own_class: ClassVar[Any]  # the class of the model that the user gave

    def __reduce__(self) -> Any:
        return in_gap_coordinates, (self.as_given(),)

    def as_given(self) -> Any:
        """The model as the user gave it."""
        return self.own_class(**{field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts, each of which holds one of the coordinates."""
        return self._on_coordinates(super().contacts, self.places.contacts)

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces, each of one of the coordinates."""
        return self._on_coordinates(super().surfaces, self.places.surfaces)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The frictions, each along one of the coordinates."""
        places = zip(super().frictions, self.places.frictions, strict=True)
        return tuple(
            replace(part, coordinate=self.coordinates[i], ground_speed=part.ground_speed if s > 0 else -part.ground_speed)
            for part, (i, s) in places
        )

    def _on_coordinates(self, parts: Any, places: tuple[tuple[int, int], ...]) -> tuple[Any, ...]:
        """Contacts or surfaces of single coordinates."""
        return tuple(
            replace(part, coordinate=self.coordinates[i], sign=s * part.sign, position=part.position if s > 0 else -part.position)
            for part, (i, s) in zip(parts, places, strict=True)
        )

    @property
    def images(self) -> tuple[str, ...]:
        """The coordinates: mirror images that swap some are not looked for."""
        return self.coordinates

    def mirror(self, load: Any) -> Any:
        """That of the model as it was given, unless its mirror images swap coordinates."""
        return super().mirror(load) if self.own_class.images is ContactModel.images else None

    def sums(self) -> tuple[list[list[Any]], list[dict[str, Any]]]:
        """A as rows, and for each row the coefficients of load channels in m(t)."""
        names = super().coordinates
        rows = [[float(i == j) for j in range(len(names))] for i in range(len(names))]
        moving: list[dict[str, Any]] = [{} for _ in names]
        parts: list[Part] = [*super().contacts, *super().surfaces, *super().frictions]
        places = self.places.contacts + self.places.surfaces + self.places.frictions
        for part, (i, sign) in zip(parts, places, strict=True):
            if sign > 0 and i in self.places.order:
                given = terms_of(part)
                rows[i] = [given.get(name, 0.0) for name in names]
                moving[i] = {name: factor for name, factor in given.items() if name not in names}
        return rows, moving

    def from_gaps(self) -> list[list[Any]]:
        """T as rows."""
        rows, _ = self.sums()
        return _inverse(rows, self.places.order)

    def shift(self, t: Any, load: Any, order: int = 0) -> list[Any]:
        """m(t) or one of its first two derivatives."""
        rates = (lambda channel: channel(t), lambda channel: channel.velocity(t), lambda channel: channel.acceleration(t))
        _, moving = self.sums()
        return [_weighted(list(m.values()), [rates[order](getattr(load, name)) for name in m]) for m in moving]

    def own(self, t: Any, values: Any, load: Any, order: int = 0) -> Any:
        """The user's coordinates, or their first or second derivatives, where those of this model have these values."""
        given = values if len(self.coordinates) > 1 else [values]
        moved = [z if is_zero(m) else z - m for z, m in zip(given, self.shift(t, load, order), strict=True)]
        return _as_given([_weighted(row, moved) for row in self.from_gaps()])

    def in_gaps(self, t: Any, values: Any, load: Any, order: int = 0) -> Any:
        """The inverse of `own`."""
        sums = [_weighted(row, values if len(self.coordinates) > 1 else [values]) for row in self.sums()[0]]
        return _as_given([z if is_zero(m) else z + m for z, m in zip(sums, self.shift(t, load, order), strict=True)])

    def own_states(self, t: Any, position: Any, velocity: Any, load: Any) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and velocities of the model as it was given, a row for each coordinate."""
        return _stacked(self.own(t, _values(position), load)), _stacked(self.own(t, _values(velocity), load, 1))

    def gap_states(self, t: Any, position: Any, velocity: Any, load: Any) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of `own_states`, in which what contacts hold up to rounding is held exactly."""
        places, rates = self.in_gaps(t, _values(position), load), self.in_gaps(t, _values(velocity), load, 1)
        q, v = np.split(_stacked([*_each_of(places), *_each_of(rates)]), 2)
        for contact in self.contacts:
            place, at = self.coordinates.index(contact.coordinate), np.asarray(contact.position, dtype=float)
            there = np.abs(q[place] - at) <= CLOSED_BELOW * (1.0 + np.abs(q).max(axis=0))
            still = there & (np.abs(v[place]) <= CLOSED_BELOW * (1.0 + np.abs(v).max(axis=0)))
            q[place], v[place] = np.where(there, at, q[place]), np.where(still, 0.0, v[place])
        return q, v

    def mass_matrix(self, theta: Any) -> Any:
        """T' M T; M may depend on the coordinates only where no wall moves."""
        back = self.from_gaps()
        columns = list(zip(*back, strict=True))
        q = _as_given([_weighted(row, _each_of(theta)) for row in back])
        right = [[_weighted(row, column) for column in columns] for row in _rows_of(super().mass_matrix(q))]  # M T
        return _as_given(
            [_as_given([_weighted(column, [row[j] for row in right]) for j in range(len(back))]) for column in columns]
        )

    def force(self, t: Any, theta: Any, velocity: Any, load: Any, *sides: Any) -> Any:
        """T' (r - M q_0'')."""
        q, v = self.own(t, theta, load), self.own(t, velocity, load, 1)
        pushed, mass = _each_of(super().force(t, q, v, load, *sides)), _rows_of(super().mass_matrix(q))
        carried = _each_of(self.own(t, _as_given([0.0] * len(pushed)), load, 2))
        inertia = [_weighted(row, carried) for row in mass]
        pushed = [f if is_zero(a) else f - a for f, a in zip(pushed, inertia, strict=True)]
        return _as_given([_weighted(column, pushed) for column in zip(*self.from_gaps(), strict=True)])

    def normal_forces(self, t: Any, theta: Any, velocity: Any, load: Any) -> tuple[Any, ...]:
        """Those of the model as it was given."""
        return super().normal_forces(t, self.own(t, theta, load), self.own(t, velocity, load, 1), load)

    def after_impact(self, contact: str, theta: Any, velocity: Any) -> Any:
        """That of the model as it was given; none has one where a wall moves, as it would not be told its velocity."""
        if not self.jumps:
            return tuple(theta[len(self.moving) :])
        return super().after_impact(contact, self.own(0.0, theta, None), self.own(0.0, velocity, None, 1))

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """That of the model as it was given."""
        return super().kinetic_energy(t, self.own(t, theta, load), self.own(t, velocity, load, 1), side, load)

    def margins(self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Any) -> dict[str, Any]:
        """Those of the model as it was given."""
        q, v, a = (self.own(t, values, load, order) for order, values in enumerate((theta, velocity, acceleration)))
        return super().margins(t, q, v, a, side, load)


def in_gap_coordinates(model: Any) -> Any:
    """A model in coordinates of which each contact holds one; itself, if each of its contacts holds one already.

    Raises
    ------
    ParameterError
        The sum that a contact keeps follows from those of others, or needs the coordinate of a friction.
    """
    places = _places_of(model)
    if places is None:
        return model
    kind: Any = type(model)
    made = object.__new__(_class_in(kind, places))  # its numbers have been checked
    for field in fields(model):
        object.__setattr__(made, field.name, getattr(model, field.name))
    return made


@cache
def _class_in(cls: Any, places: GapPlaces) -> Any:
    """The class of a model in coordinates of its gaps: a subclass with the same fields."""
    body: dict[str, Any] = {"__slots__": (), "__doc__": f"{cls.__name__} in coordinates of its gaps.", "__module__": __name__}
    body |= {"places": places, "own_class": cls, "coordinates": places.names}
    return type(cls.__name__ + IN_GAPS, (InGapCoordinates, cls), body)


IN_GAPS = "InGapCoordinates"  # behind the name of a model's class, the name of its class in these coordinates


def terms_of(contact: Part) -> dict[str, Any]:
    """The coefficients of the coordinates and load channels in the sum that a contact keeps on one side of its position."""
    return {contact.coordinate: 1.0} if isinstance(contact.coordinate, str) else dict(contact.coordinate)


def _places_of(model: Any) -> GapPlaces | None:
    """Which coordinates the sums of a model's contacts take the place of; None if each contact holds a single coordinate.

    Each sum takes the place of that of its coordinates which has the largest coefficient after the elimination of the earlier
    sums, of several the last. Coordinates that a contact holds alone, or along which a friction acts, keep their places.
    """
    contacts, names, order = (*model.contacts, *model.surfaces, *model.frictions), model.coordinates, []
    if all(isinstance(contact.coordinate, str) for contact in contacts):
        return None
    called, found = list(names), dict[int, tuple[int, int]]()
    rows = {names.index(part.coordinate): {part.coordinate: 1.0} for part in contacts if isinstance(part.coordinate, str)}
    reduced = dict[int, list[Fraction]]()
    for number, contact in enumerate(contacts):
        terms = {name: float(factor) for name, factor in terms_of(contact).items()}
        turned = {name: -factor for name, factor in terms.items()}
        same = [(place, 1 if terms == row else -1) for place, row in rows.items() if row in (terms, turned)]
        if not same:
            left = [Fraction(terms.get(name, 0.0)) for name in names]
            for place, row in reduced.items():
                left = [a - left[place] * b for a, b in zip(left, row, strict=True)]
            free = [place for place in range(len(names)) if left[place] and place not in rows]
            if not free:
                raise ParameterError(_no_place(contact, contacts), "model")
            place = max(free, key=lambda place: (abs(left[place]), place))
            rows[place], reduced[place], called[place] = terms, [a / left[place] for a in left], _called(contact)
            order.append(place)
            same = [(place, 1)]
        found[number] = same[0]
    count, every = len(model.contacts), tuple(found.values())
    last = count + len(model.surfaces)
    return GapPlaces(tuple(called), tuple(order), every[:count], every[count:last], every[last:])


def _no_place(contact: Part, contacts: Sequence[Part]) -> str:
    """Why a contact's sum cannot be a coordinate, in words."""
    others = ", ".join(other.name for other in contacts if other is not contact)
    kept = _called(contact)
    return (
        f"the {type(contact).__name__.lower()} {contact.name!r} keeps {kept}, which follows from what {others} keep, up "
        "to a displacement, so that it cannot be a coordinate beside them; leave it out, give sums that are the same the "
        "same coefficients, or let it keep a coordinate of its own, such as that of a heavy wall"
    )


def _called(contact: Part) -> str:
    """The name of a contact's sum, such as y_minus_x; with other coefficients than 1 and -1 it is called after the contact."""
    terms = {name: float(factor) for name, factor in terms_of(contact).items()}
    if any(abs(factor) != 1.0 for factor in terms.values()):
        return f"sum_at_{contact.name}"
    ranked = sorted(terms, key=lambda name: terms[name] < 0.0)  # positive terms first
    return "_".join(("minus_" if terms[name] < 0.0 else "plus_") + name for name in ranked).removeprefix("plus_")


def _inverse(rows: list[list[Any]], order: Sequence[int]) -> list[list[Any]]:
    """The inverse of a matrix whose rows are those of the unit matrix, except for those in `order`."""
    size = len(rows)
    left, right = [list(row) for row in rows], [[float(i == j) for j in range(size)] for i in range(size)]
    for k in (*order, *(k for k in range(size) if k not in order)):
        pivot = left[k][k]
        if not (isinstance(pivot, float) and pivot == 1.0):
            left[k], right[k] = [x / pivot for x in left[k]], [x if is_zero(x) else x / pivot for x in right[k]]
        for i in range(size):
            factor = left[i][k]
            if i != k and not is_zero(factor):
                left[i] = [x if is_zero(y) else x - factor * y for x, y in zip(left[i], left[k], strict=True)]
                right[i] = [x if is_zero(y) else x - factor * y for x, y in zip(right[i], right[k], strict=True)]
    return right


def _weighted(factors: Sequence[Any], values: Sequence[Any]) -> Any:
    """The sum of products, without those that are 0 for every state."""
    total: Any = 0.0
    for factor, value in zip(factors, values, strict=True):
        if not (is_zero(factor) or is_zero(value)):
            term = value if isinstance(factor, float) and factor == 1.0 else factor * value
            total = term if is_zero(total) else total + term
    return total


def _as_given(values: list[Any]) -> Any:
    """One value, or a tuple of several."""
    return values[0] if len(values) == 1 else tuple(values)


def _values(given: Any) -> Any:
    """A number or an array for each coordinate, as `_as_given`."""
    return _as_given([*np.atleast_1d(given)] if isinstance(given, np.ndarray) else _each_of(given))


def _stacked(values: Any) -> np.ndarray:
    """A row for each coordinate."""
    return np.stack(np.broadcast_arrays(*_each_of(values)))


def _each_of(values: Any) -> list[Any]:
    """The values of all coordinates, of one or of several."""
    return list(values) if isinstance(values, (tuple, list)) else [values]


def _rows_of(mass: Any) -> list[list[Any]]:
    """A mass matrix as rows, for any number of coordinates."""
    return [list(row) for row in mass] if isinstance(mass, (tuple, list)) else [[mass]]
