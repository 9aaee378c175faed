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
from saltus.systems.contact_model import Contact, ContactModel, Friction, Surface
from saltus.systems.load import Load
from saltus.systems.model import Jet, as_given, derivatives_along, each_of, is_function, is_zero, less, reads_of, weighted

Part = Contact | Surface | Friction
INVERSE, TURNS = "_inverse", " turns"  # behind the name of a model's function, its inverse, and the margin that ends this
CLOSED_BELOW = 1e-13  # A contact is closed, up to rounding, if both its gap and its speed are smaller than this.


@dataclass(frozen=True)
class GapPlaces:
    """Which coordinates the gaps of a model take the place of."""

    names: tuple[str, ...]  # of the coordinates, in which the sum of a gap has the place of one of its terms
    order: tuple[int, ...]  # the places of sums, in the order in which their terms are eliminated
    contacts: tuple[tuple[int, int], ...]  # the place of each contact's sum, and +1, or -1 if the coordinate is minus the sum
    surfaces: tuple[tuple[int, int], ...]  # of each surface likewise
    frictions: tuple[tuple[int, int], ...]  # and of each friction
    solved: tuple[tuple[int, tuple[str, ...]], ...]  # the coordinates in the order of solving, with the functions that each needs
    stands: tuple[tuple[int, str], ...]  # places of coordinates, with the functions of them alone that stand for them


class InGapCoordinates(ContactModel):
    """A model in which sums z = A q + h(q) + m(t) that its contacts keep on one side take the place of coordinates q:

        T' M T z'' = T' (r - M a) + the reactions,    T = dq/dz,    a = q'' where z'' = 0.

    Functions h read coordinates that follow without them, so that all follow one after the other; derivatives of them are exact
    (`Jet`). Each contact then holds one coordinate, and its position stays constant where a wall moves. Its classes are made of a
    model's own by `in_gap_coordinates`, with the same numbers under the same names.
    """

    __slots__ = ()

    gap_places: ClassVar[GapPlaces]
    own_class: ClassVar[Any]  # the class of the model that the user gave

    def __reduce__(self) -> Any:
        return in_gap_coordinates, (self.as_given(),)

    def as_given(self) -> Any:
        """The model as the user gave it."""
        return self.own_class(**{field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts, each of which holds one of the coordinates."""
        return self._on_coordinates(super().contacts, self.gap_places.contacts)

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces, each of one of the coordinates."""
        return self._on_coordinates(super().surfaces, self.gap_places.surfaces)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The frictions, each along one of the coordinates."""
        places = zip(super().frictions, self.gap_places.frictions, strict=True)
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
        """That of the model as it was given, unless its mirror images swap coordinates or functions of them are in sums."""
        return None if self.is_bent or self.own_class.images is not ContactModel.images else super().mirror(load)

    @property
    def stops(self) -> tuple[str, ...]:  # type: ignore[override]
        """Those of the model as it was given, and where functions that stand for coordinates turn."""
        return (*super().stops, *(name + TURNS for _, name in self.gap_places.stands))

    def gap_sums(self) -> tuple[list[list[Any]], list[dict[str, Any]], list[dict[str, Any]]]:
        """A as rows, and for each row the coefficients of load channels in m(t) and of functions in h(q)."""
        names = columns_of(super().coordinates, self.gap_places.stands)
        rows = [[float(i == j) for j in range(len(names))] for i in range(len(names))]
        moving, bending = ([dict[str, Any]() for _ in names] for _ in range(2))
        parts: list[Part] = [*super().contacts, *super().surfaces, *super().frictions]
        places = self.gap_places.contacts + self.gap_places.surfaces + self.gap_places.frictions
        for part, (i, sign) in zip(parts, places, strict=True):
            if sign > 0 and i in self.gap_places.order:
                given = terms_of(part)
                rows[i] = [given.get(name, 0.0) for name in names]
                moving[i] = {name: factor for name, factor in given.items() if name in self.channels}
                bending[i] = {name: factor for name, factor in given.items() if name not in (*names, *self.channels)}
        return rows, moving, bending

    @property
    def is_bent(self) -> bool:
        """Whether a sum has functions of coordinates among its terms, so that T depends on them."""
        return bool(self.gap_places.stands) or any(needed for _, needed in self.gap_places.solved)

    @property
    def has_moving_walls(self) -> bool:
        """Whether a sum has a displacement of the ground among its terms."""
        return any(self.gap_sums()[1])

    def walls_at(self, t: Any, load: Any, order: int = 0) -> list[Any]:
        """m(t) or one of its first two derivatives."""
        rates = (lambda channel: channel(t), lambda channel: channel.velocity(t), lambda channel: channel.acceleration(t))
        return [weighted(list(m.values()), [rates[order](getattr(load, name)) for name in m]) for m in self.gap_sums()[1]]

    def _each(self, values: Any) -> list[Any]:
        """The values of all coordinates; those of a single one may be an array of any shape."""
        return each_of(values) if len(self.coordinates) > 1 else [values]

    def own_values(self, t: Any, load: Any, *given: Any) -> list[Any]:
        """The user's coordinates and as many of their derivatives as are given of those of this model, two at most."""
        moved = [less(self._each(values), self.walls_at(t, load, order)) for order, values in enumerate(given)]
        if not self.is_bent:
            back = inverse(self.gap_sums()[0], self.gap_places.order)
            return [as_given([weighted(row, values) for row in back]) for values in moved]
        return derivatives_along(self._solved, moved)

    def gap_values(self, t: Any, load: Any, *given: Any) -> list[Any]:
        """The inverse of `own_values`."""
        found = [self._each(values) for values in derivatives_along(self._summed, [self._each(values) for values in given])]
        moved = [[-m for m in self.walls_at(t, load, order)] for order in range(len(found))]
        return [as_given(less(values, m)) for values, m in zip(found, moved, strict=True)]

    def _summed(self, q: list[Any]) -> list[Any]:
        """A q + h(q)."""
        rows, _, bending = self.gap_sums()
        u, stands = list(q), dict(self.gap_places.stands)
        for place, name in stands.items():
            u[place] = self._function(name, q)
        bent = [weighted(list(terms.values()), [self._function(name, q) for name in terms]) for terms in bending]
        return [weighted((*row, 1.0), (*u, more)) for row, more in zip(rows, bent, strict=True)]

    def _solved(self, sums: list[Any]) -> list[Any]:
        """The coordinates q of which A q + h(q) are these sums."""
        rows, _, bending = self.gap_sums()
        back, stands, q = inverse(rows, self.gap_places.order), dict(self.gap_places.stands), [0.0] * len(sums)
        for place, needed in self.gap_places.solved:
            row, q[place] = back[place], weighted(back[place], sums)
            for name in needed:
                factor = weighted(row, [terms.get(name, 0.0) for terms in bending])
                q[place] = q[place] - factor * self._function(name, q)
            if place in stands:
                q[place] = getattr(self, stands[place] + INVERSE)(q[place])
        return q

    def _function(self, name: str, q: list[Any]) -> Any:
        """The value of a function of the model at its own coordinates."""
        return getattr(self, name)(as_given(q))

    def own_slopes(self, t: Any, theta: Any, load: Any) -> list[list[Any]]:
        """T = dq/dz as rows."""
        if not self.is_bent:
            return inverse(self.gap_sums()[0], self.gap_places.order)
        z, size = less(self._each(theta), self.walls_at(t, load)), range(len(self.coordinates))
        columns = [self._solved([Jet(x, float(i == k)) for i, x in enumerate(z)]) for k in size]
        return [[column[j].first for column in columns] for j in size]

    def own_states(self, t: Any, position: Any, velocity: Any, load: Any) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and velocities of the model as it was given, a row for each coordinate."""
        q, v = self.own_values(t, load, _values(position), _values(velocity))
        return _stacked(q), _stacked(v)

    def gap_states(self, t: Any, position: Any, velocity: Any, load: Any) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of `own_states`, in which what contacts hold up to rounding is held exactly."""
        places, rates = self.gap_values(t, load, _values(position), _values(velocity))
        q, v = np.split(_stacked([*self._each(places), *self._each(rates)]), 2)
        for contact in self.contacts:
            place, at = self.coordinates.index(contact.coordinate), np.asarray(contact.position, dtype=float)
            there = np.abs(q[place] - at) <= CLOSED_BELOW * (1.0 + np.abs(q).max(axis=0))
            still = there & (np.abs(v[place]) <= CLOSED_BELOW * (1.0 + np.abs(v).max(axis=0)))
            q[place], v[place] = np.where(there, at, q[place]), np.where(still, 0.0, v[place])
        return q, v

    def mass_matrix(self, theta: Any, t: Any = 0.0, load: Any = None) -> Any:
        """T' M T; without a load where no wall has moved."""
        load = load or Load()
        (q,), slopes = self.own_values(t, load, theta), self.own_slopes(t, theta, load)
        columns = list(zip(*slopes, strict=True))
        right = [[weighted(row, column) for column in columns] for row in _rows_of(super().mass_matrix(q))]  # M T
        return as_given(
            [as_given([weighted(column, [row[j] for row in right]) for j in range(len(slopes))]) for column in columns]
        )

    def force(self, t: Any, theta: Any, velocity: Any, load: Any, *sides: Any) -> Any:
        """T' (r - M a), where a is q'' for z'' = 0."""
        q, v, carried = self.own_values(t, load, theta, velocity, as_given([0.0] * len(self.coordinates)))
        pushed, mass = self._each(super().force(t, q, v, load, *sides)), _rows_of(super().mass_matrix(q))
        pushed = less(pushed, [weighted(row, self._each(carried)) for row in mass])
        return as_given([weighted(column, pushed) for column in zip(*self.own_slopes(t, theta, load), strict=True)])

    def normal_forces(self, t: Any, theta: Any, velocity: Any, load: Any) -> tuple[Any, ...]:
        """Those of the model as it was given."""
        q, v = self.own_values(t, load, theta, velocity)
        return super().normal_forces(t, q, v, load)

    def after_impact(self, contact: str, theta: Any, velocity: Any) -> Any:
        """That of the model as it was given; none has one where a wall moves, as it would not be told its velocity."""
        if not self.jumps:
            return tuple(theta[len(self.moving) :])
        return super().after_impact(contact, *self.own_values(0.0, None, theta, velocity))

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """That of the model as it was given."""
        q, v = self.own_values(t, load, theta, velocity)
        return super().kinetic_energy(t, q, v, side, load)

    def margins(self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Any) -> dict[str, Any]:
        """Those of the model as it was given, and slopes of what stands for coordinates, whose inverses end where it turns."""
        q, v, a = self.own_values(t, load, theta, velocity, acceleration)
        found = dict(super().margins(t, q, v, a, side, load))
        for place, name in self.gap_places.stands:
            found[name + TURNS] = self._function(name, [Jet(x, float(i == place)) for i, x in enumerate(self._each(q))]).first
        return found


def in_gap_coordinates(model: Any) -> Any:
    """A model in coordinates of which each contact holds one; itself, if each of its contacts holds one already.

    Raises
    ------
    ParameterError
        The sum that a contact keeps follows from those of others, or needs the coordinate of a friction.
    """
    places = places_of(model)
    if places is None:
        return model
    kind: Any = type(model)
    if taken := {name for name in (*vars(InGapCoordinates), "own_class") if name not in dir(ContactModel)} & {*dir(kind)}:
        raise ParameterError(f"{kind.__name__} has a part named {min(taken)}, as its coordinates of gaps do: rename it", "model")
    made = object.__new__(_class_in(kind, places))  # its numbers have been checked
    for field in fields(model):
        object.__setattr__(made, field.name, getattr(model, field.name))
    return made


@cache
def _class_in(cls: Any, places: GapPlaces) -> Any:
    """The class of a model in coordinates of its gaps: a subclass with the same fields."""
    body: dict[str, Any] = {"__slots__": (), "__doc__": f"{cls.__name__} in coordinates of its gaps.", "__module__": __name__}
    body |= {"gap_places": places, "own_class": cls, "coordinates": places.names}
    return type(cls.__name__ + IN_GAPS, (InGapCoordinates, cls), body)


IN_GAPS = "InGapCoordinates"  # behind the name of a model's class, the name of its class in these coordinates


def terms_of(contact: Part) -> dict[str, Any]:
    """The coefficients of the coordinates and load channels in the sum that a contact keeps on one side of its position."""
    return {contact.coordinate: 1.0} if isinstance(contact.coordinate, str) else dict(contact.coordinate)


def places_of(model: Any) -> GapPlaces | None:
    """Which coordinates the sums of a model's contacts take the place of; None if each contact holds a single coordinate.

    Functions that stand for the coordinate on which they depend are tried only if there is no other way.
    """
    parts: tuple[Part, ...] = (*model.contacts, *model.surfaces, *model.frictions)
    if all(isinstance(part.coordinate, str) for part in parts):
        return None
    reads = {name: reads_of(model, name) for part in parts for name in terms_of(part) if is_function(model, name)}
    found = _placed(model, parts, reads, {})
    stands = {places[0]: name for name, places in reads.items() if len(places) == 1 and hasattr(model, name + INVERSE)}
    if isinstance(found, str) and stands:
        found = _placed(model, parts, reads, stands)
    if isinstance(found, str):
        raise ParameterError(found, "model")
    return found


def _placed(model: Any, parts: Sequence[Part], reads: dict[str, tuple[int, ...]], stands: dict[int, str]) -> GapPlaces | str:
    """The places of sums, or why there are none. Each takes that of the coordinate with the largest coefficient, of several the
    last, after the elimination of earlier sums, which none of its functions reads and which no part holds alone."""
    names = columns_of(model.coordinates, tuple(stands.items()))
    columns = [*names, *(name for name in reads if name not in names)]
    called, found, order = list(names), dict[int, tuple[int, int]](), list[int]()
    alone = {part.coordinate for part in parts if isinstance(part.coordinate, str)}
    rows = {names.index(name): {name: 1.0} for name in alone if name in names}
    reduced = dict[int, list[Fraction]]()
    for number, part in enumerate(parts):
        terms = {name: float(factor) for name, factor in terms_of(part).items()}
        turned = {name: -factor for name, factor in terms.items()}
        same = [(place, 1 if terms == row else -1) for place, row in rows.items() if row in (terms, turned)]
        if not same:
            left = [Fraction(terms.get(name, 0.0)) for name in columns]
            for place, row in reduced.items():
                left = [a - left[place] * b for a, b in zip(left, row, strict=True)]
            read = {place for name in columns[len(names) :] if left[columns.index(name)] for place in reads[name]}
            free = [place for place in range(len(names)) if left[place] and place not in rows and place not in read]
            if not free or any(name in model.coordinates and name not in names for name in terms):
                return _no_place(part, parts, reads)
            place = max(free, key=lambda place: (abs(left[place]), place))
            rows[place], reduced[place], called[place] = terms, [a / left[place] for a in left], _called(part)
            order.append(place)
            same = [(place, 1)]
        found[number] = same[0]
    solved = _order_of_solving(names, [rows.get(place, {name: 1.0}) for place, name in enumerate(names)], order, reads)
    if solved is None:
        return _no_place(parts[-1], parts, reads)
    count, every = len(model.contacts), tuple(found.values())
    last = count + len(model.surfaces)
    return GapPlaces(tuple(called), tuple(order), every[:count], every[count:last], every[last:], solved, tuple(stands.items()))


def _order_of_solving(
    names: Sequence[str], rows: list[dict[str, float]], order: Sequence[int], reads: dict[str, tuple[int, ...]]
) -> tuple[tuple[int, tuple[str, ...]], ...] | None:
    """The coordinates in an order in which each follows from sums and from functions of those before it, or None."""
    back = inverse([[Fraction(row.get(name, 0.0)) for name in names] for row in rows], order, Fraction(1))
    shares = [{f: sum(t * Fraction(row.get(f, 0.0)) for t, row in zip(ts, rows, strict=True)) for f in reads} for ts in back]
    needed = [tuple(f for f, share in each.items() if share and f not in names) for each in shares]
    found, left = list[tuple[int, tuple[str, ...]]](), list(range(len(names)))
    while left:
        known = {place for place, _ in found}
        ready = [place for place in left if all(known.issuperset(reads[f]) for f in needed[place])]
        if not ready:
            return None
        found.append((ready[0], needed[ready[0]]))
        left.remove(ready[0])
    return tuple(found)


def columns_of(names: Sequence[str], stands: Any) -> list[str]:
    """The coordinates, and in the places of some of them the functions that stand for them."""
    return [dict(stands).get(place, name) for place, name in enumerate(names)]


def _no_place(part: Part, parts: Sequence[Part], reads: dict[str, tuple[int, ...]]) -> str:
    """Why a part's sum cannot be a coordinate, in words."""
    others = ", ".join(other.name for other in parts if other is not part)
    kept, names = _called(part), [name for name in terms_of(part) if name in reads]
    what = f"the {type(part).__name__.lower()} {part.name!r} keeps {kept}"
    if names:
        return (
            f"{what}, and needs a coordinate of its own, with a constant coefficient and read by none of its functions: let it "
            f"keep a coordinate where its gap is 0, or, if {names[0]} is of one coordinate alone, give the model "
            f"{names[0]}{INVERSE}(value), the coordinate at which {names[0]} has this value"
        )
    return (
        f"{what}, which follows from what {others} keep, up to a displacement, so that it cannot be a coordinate beside them; "
        "leave it out, give sums that are the same the same coefficients, or let it keep one of its own, as of a heavy wall"
    )


def _called(contact: Part) -> str:
    """The name of a contact's sum, such as y_minus_x; with other coefficients than 1 and -1 it is called after the contact."""
    terms = {name: float(factor) for name, factor in terms_of(contact).items()}
    if any(abs(factor) != 1.0 for factor in terms.values()):
        return f"sum_at_{contact.name}"
    ranked = sorted(terms, key=lambda name: terms[name] < 0.0)  # positive terms first
    return "_".join(("minus_" if terms[name] < 0.0 else "plus_") + name for name in ranked).removeprefix("plus_")


def inverse(rows: list[list[Any]], order: Sequence[int], one: Any = 1.0) -> list[list[Any]]:
    """The inverse of a matrix whose rows are those of the unit matrix, except for those in `order`."""
    size = len(rows)
    left, right = [list(row) for row in rows], [[one * (i == j) for j in range(size)] for i in range(size)]
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


def _values(given: Any) -> Any:
    """A number or an array for each coordinate, as `_as_given`."""
    return as_given([*np.atleast_1d(given)] if isinstance(given, np.ndarray) else each_of(given))


def _stacked(values: Any) -> np.ndarray:
    """A row for each coordinate."""
    return np.stack(np.broadcast_arrays(*each_of(values)))


def _rows_of(mass: Any) -> list[list[Any]]:
    """A mass matrix as rows, for any number of coordinates."""
    return [list(row) for row in mass] if isinstance(mass, (tuple, list)) else [[mass]]
