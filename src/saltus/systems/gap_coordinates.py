"""A model with several contacts in coordinates of its gaps: sums of coordinates that contacts keep
take the places of terms.

The gap between two bodies, y - x, becomes a coordinate, and that over a table which shakes, x -
zeta(t), too. Each contact then holds one coordinate, as all that follows motions needs it, and
where a wall moves its position stays constant.

A sum that follows from those of other parts, as the last gap of a row of balls between two walls,
takes no place. It is a further coordinate s of first order behind all others, whose rate follows
from theirs. While its contact is closed a reaction acts along it on the others, which stay on the
surface s = p (`dependent_sums`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np

from saltus.errors import ParameterError
from saltus.systems.contracts.contact_model import (
    Contact,
    ContactModel,
    Friction,
    Relay,
    Surface,
    called_part,
    solved_motion,
)
from saltus.systems.contracts.model import Jet, as_given, derivatives_along, each_of, less, weighted
from saltus.systems.gap_places import (
    CLOSED_BELOW,
    INVERSE,
    TURNS,
    GapPlaces,
    Part,
    columns_of,
    inverse,
    placed,
    places_of,
    terms_of,
)
from saltus.systems.loads.load import Load


class InGapCoordinates(ContactModel):
    """A model in which sums z = A q + h(q) + m(t) that its contacts keep on one side take the place
    of coordinates q:

        T' M T z'' = T' (r - M a) + the reactions,    T = dq/dz,    a = q'' where z'' = 0.

    Functions h read coordinates that follow without them, so that all follow one after the other;
    derivatives of them are exact (`Jet`). Each contact then holds one coordinate, and its position
    stays constant where a wall moves. Its classes are made of a model's own by
    `in_gap_coordinates`, with the same numbers under the same names. Sums s = B q + n(t) that
    follow from z are coordinates of first order behind them,

        s' = B q' + n' + (B q + n - s),

    of which the last term is 0 but for rounding, and keeps it from adding up.
    """

    __slots__ = ()

    gap_places: ClassVar[GapPlaces]
    own_class: ClassVar[Any]  # the class of the model that the user gave

    def __reduce__(self) -> Any:
        return in_gap_coordinates, (self.as_given(),)

    def as_given(self) -> Any:
        """The model as the user gave it."""
        return self.own_class(**{name: getattr(self, name) for name in fields_of(self.own_class)})

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts, each of which holds one of the coordinates."""
        return self._on_coordinates(super().contacts, self.gap_places.contacts)

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces, each of one of the coordinates, or a function."""
        given = super().surfaces
        found = iter(self._on_coordinates(placed(given), self.gap_places.surfaces))
        return tuple(part if part.function is not None else next(found) for part in given)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The frictions, each along one of the coordinates.

        Raises
        ------
        ParameterError
            One that has no place of its own, as it had no force, has got a force.
        """
        found = []
        for k, (part, (i, s)) in enumerate(
            zip(super().frictions, self.gap_places.frictions, strict=True)
        ):
            if k in self.gap_places.left_out:
                _check_left_out(part)
            ground_speed = part.ground_speed if s > 0 else -part.ground_speed
            found.append(replace(part, coordinate=self.coordinates[i], ground_speed=ground_speed))
        return tuple(found)

    @property
    def left_out(self) -> tuple[Friction, ...]:
        """The frictions without force that have no place of their own, as the user gave them."""
        given = super().frictions
        return tuple(given[k] for k in self.gap_places.left_out)

    def _on_coordinates(self, parts: Any, places: tuple[tuple[int, int], ...]) -> tuple[Any, ...]:
        """Contacts or surfaces of single coordinates."""
        return tuple(
            replace(
                part,
                coordinate=self.coordinates[i],
                sign=s * part.sign,
                position=part.position if s > 0 else -part.position,
            )
            for part, (i, s) in zip(parts, places, strict=True)
        )

    @property
    def images(self) -> tuple[str, ...]:
        """The coordinates: mirror images that swap some are not looked for."""
        return self.coordinates

    @property
    def stops(self) -> tuple[str, ...]:  # type: ignore[override]
        """Those of the model as it was given, and where functions that stand for coordinates
        turn.
        """
        return (*super().stops, *(name + TURNS for _, name in self.gap_places.stands))

    def gap_sums(self) -> tuple[list[list[Any]], list[dict[str, Any]], list[dict[str, Any]]]:
        """A as rows, behind them B, and for each the coefficients of load channels in m(t), n(t)
        and of functions in h(q).
        """
        names = columns_of(super().coordinates, self.gap_places.stands)
        rows = [
            [float(i == j) for j in range(len(names))] for i in range(len(self.gap_places.names))
        ]
        moving, nonlinear = ([dict[str, Any]() for _ in rows] for _ in range(2))
        parts: list[Part] = [*super().contacts, *placed(super().surfaces), *super().frictions]
        places = self.gap_places.contacts + self.gap_places.surfaces + self.gap_places.frictions
        first = len(parts) - len(self.gap_places.frictions)
        left_out = [first + k for k in self.gap_places.left_out]
        for number, (part, (i, sign)) in enumerate(zip(parts, places, strict=True)):
            takes_place = sign > 0 and number not in left_out
            if takes_place and (i in self.gap_places.order or i >= len(names)):
                given = terms_of(part)
                rows[i] = [given.get(name, 0.0) for name in names]
                moving[i] = {
                    name: factor for name, factor in given.items() if name in self.channels
                }
                nonlinear[i] = {
                    name: factor
                    for name, factor in given.items()
                    if name not in (*names, *self.channels)
                }
        return rows, moving, nonlinear

    @property
    def dependent(self) -> int:
        """How many of the coordinates, the last ones, are sums that follow from the others."""
        return len(self.gap_places.names) - len(self.own_class.coordinates)

    @property
    def is_nonlinear(self) -> bool:
        """Whether a sum has functions of coordinates among its terms, so that T depends on them."""
        return bool(self.gap_places.stands) or any(needed for _, needed in self.gap_places.solved)

    @property
    def has_moving_walls(self) -> bool:
        """Whether a sum has a displacement of the ground among its terms."""
        return any(self.gap_sums()[1])

    def walls_at(self, t: Any, load: Any, order: int = 0) -> list[Any]:
        """m(t) or one of its first two derivatives."""
        rates = (
            lambda channel: channel(t),
            lambda channel: channel.velocity(t),
            lambda channel: channel.acceleration(t),
        )
        return [
            weighted(list(m.values()), [rates[order](getattr(load, name)) for name in m])
            for m in self.gap_sums()[1]
        ]

    def _each(self, values: Any, own: bool = False) -> list[Any]:
        """The values of all coordinates, or of the user's own; those of a single one may be an
        array of any shape.
        """
        return (
            each_of(values)
            if len(self.own_class.coordinates if own else self.coordinates) > 1
            else [values]
        )

    def own_values(self, t: Any, load: Any, *given: Any) -> list[Any]:
        """The user's coordinates and as many of their derivatives as are given of those of this
        model, two at most.
        """
        moved = [
            less(self._each(values), self.walls_at(t, load, order))
            for order, values in enumerate(given)
        ]
        if not self.is_nonlinear:
            back = self._back()
            return [as_given([weighted(row, values) for row in back]) for values in moved]
        return derivatives_along(self._solved, moved)

    def gap_values(self, t: Any, load: Any, *given: Any) -> list[Any]:
        """The inverse of `own_values`."""
        found = [
            self._each(values)
            for values in derivatives_along(
                self._summed, [self._each(values, True) for values in given]
            )
        ]
        moved = [[-m for m in self.walls_at(t, load, order)] for order in range(len(found))]
        return [as_given(less(values, m)) for values, m in zip(found, moved, strict=True)]

    def _summed(self, q: list[Any]) -> list[Any]:
        """A q + h(q)."""
        rows, _, nonlinear = self.gap_sums()
        u = list(q)
        stands = dict(self.gap_places.stands)
        for place, name in stands.items():
            u[place] = self._function(name, q)
        added = [
            weighted(list(terms.values()), [self._function(name, q) for name in terms])
            for terms in nonlinear
        ]
        return [weighted((*row, 1.0), (*u, more)) for row, more in zip(rows, added, strict=True)]

    def _solved(self, sums: list[Any]) -> list[Any]:
        """The coordinates q of which A q + h(q) are these sums."""
        rows, _, nonlinear = self.gap_sums()
        back = inverse(rows, self.gap_places.order)
        stands = dict(self.gap_places.stands)
        q = [0.0] * len(sums)
        for place, needed in self.gap_places.solved:
            row, q[place] = back[place], weighted(back[place], sums)
            for name in needed:
                factor = weighted(row, [terms.get(name, 0.0) for terms in nonlinear])
                q[place] = q[place] - factor * self._function(name, q)
            if place in stands:
                q[place] = getattr(self, stands[place] + INVERSE)(q[place])
        return q

    def _function(self, name: str, q: list[Any]) -> Any:
        """The value of a function of the model at its own coordinates."""
        return getattr(self, name)(as_given(q))

    def _back(self) -> list[list[Any]]:
        """A^-1 as rows, with zeros behind them for dependent sums."""
        rows = self.gap_sums()[0]
        left = [0.0] * self.dependent
        return [
            [*row, *left] for row in inverse(rows[: len(rows) - len(left)], self.gap_places.order)
        ]

    def own_slopes(self, t: Any, theta: Any, load: Any) -> list[list[Any]]:
        """T = dq/dz as rows."""
        if not self.is_nonlinear:
            return self._back()
        z = less(self._each(theta), self.walls_at(t, load))
        size = range(len(self.coordinates))
        columns = [self._solved([Jet(x, float(i == k)) for i, x in enumerate(z)]) for k in size]
        return [[column[j].first for column in columns] for j in size]

    def own_states(
        self, t: Any, position: Any, velocity: Any, load: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and velocities of the model as it was given, a row for each coordinate."""
        q, v = self.own_values(t, load, _values(position), _values(velocity))
        return _stacked(q), _stacked(v)

    def gap_states(
        self, t: Any, position: Any, velocity: Any, load: Any, units: tuple[float, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of `own_states`, in which what contacts hold up to rounding is held exactly.

        `units` are the natural ones of lengths and speeds (`units_of_gaps`).
        """
        places, rates = self.gap_values(t, load, _values(position), _values(velocity))
        for place, name in self.gap_places.stands:
            there, back = (
                self._each(x, True)[place]
                for x in (_values(position), self.own_values(t, load, places)[0])
            )
            # rounding grows without bound beside the turn
            if not np.all(np.abs(back - there) <= 1e-6 * (units[0] or 1.0)):
                raise ParameterError(
                    f"a state lies beyond where {name}{TURNS}, as its {name}{INVERSE} leads "
                    "elsewhere",
                    name,
                )
        terms = (
            _stacked([*self._each(values, True), *self.walls_at(t, load, order), unit])
            for order, (values, unit) in enumerate(
                zip((_values(position), _values(velocity)), units, strict=True)
            )
        )
        return self.closed_exactly(
            *np.split(_stacked([*self._each(places), *self._each(rates)]), 2), *terms
        )

    def closed_exactly(
        self, q: np.ndarray, v: np.ndarray, *terms: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and velocities of this model, changed in place: what contacts hold up to
        rounding is held exactly.

        Rounding is a share of natural units and of the largest term of a sum: of `q`, `v` and,
        where they are given, of `terms` of coordinates and of velocities.
        """
        length, speed = (
            np.maximum(np.abs(values).max(axis=0), np.abs(more).max(axis=0))
            for values, more in zip((q, v), terms or (q, v), strict=True)
        )
        for contact in self.contacts:
            place = self.coordinates.index(contact.coordinate)
            at = np.asarray(contact.position, dtype=float)
            there = np.abs(q[place] - at) <= CLOSED_BELOW * np.maximum(length, np.abs(at))
            still = there & (np.abs(v[place]) <= CLOSED_BELOW * speed)
            q[place], v[place] = np.where(there, at, q[place]), np.where(still, 0.0, v[place])
        return q, v

    def mass_matrix(self, theta: Any, t: Any = 0.0, load: Any = None) -> Any:
        """T' M T, with rows of the unit matrix for dependent sums; without a load where no wall has
        moved.
        """
        load = load or Load()
        (q,) = self.own_values(t, load, theta)
        slopes = self.own_slopes(t, theta, load)
        columns = list(zip(*slopes, strict=True))
        first = len(slopes)
        right = [[weighted(row, column) for column in columns] for row in self._own_mass(q)]  # M T
        rows = [
            [weighted(column, [row[j] for row in right]) for j in range(len(columns))]
            for column in columns
        ]
        rows[first:] = [
            [float(i == j) for j in range(len(columns))] for i in range(first, len(columns))
        ]
        return as_given([as_given(row) for row in rows])

    def _own_mass(self, q: Any) -> list[list[Any]]:
        """The mass matrix of the model as it was given, as rows; the unit matrix of the contract
        has the size of this one.
        """
        size = len(self.own_class.coordinates)
        return [row[:size] for row in _rows_of(super().mass_matrix(q))[:size]]

    def force(self, t: Any, theta: Any, velocity: Any, load: Any, *sides: Any) -> Any:
        """T' (r - M a), where a is q'' for z'' = 0, and the rates of dependent sums."""
        q, v, carried = self.own_values(
            t, load, theta, velocity, as_given([0.0] * len(self.coordinates))
        )
        pushed = self._each(super().force(t, q, v, load, *sides), True)
        mass = self._own_mass(q)
        pushed = less(pushed, [weighted(row, self._each(carried, True)) for row in mass])
        found = [
            weighted(column, pushed)
            for column in zip(*self.own_slopes(t, theta, load), strict=True)
        ]
        found[len(found) - self.dependent :] = [
            rate + left for left, rate, _ in self._of_sums(t, theta, velocity, load)
        ]
        return as_given(found)

    def value_of_function(
        self, surface: Surface | Relay, t: Any, q: Any, v: Any, load: Any, name: str | None = None
    ) -> Any:
        """The value of a surface's function, of the model's own coordinates."""
        own, rates = self.own_values(t, load, q, v)
        return super().value_of_function(surface, t, own, rates, load, name)

    def _of_sums(self, t: Any, theta: Any, velocity: Any, load: Any) -> list[tuple[Any, Any, Any]]:
        """For each dependent sum s its rounding B q + n - s, its rate B q' + n', and B q_0'' +
        n''.
        """
        if not self.dependent:
            return []
        first = len(self.coordinates) - self.dependent
        z = self._each(theta)
        found = self.gap_values(
            t, load, *self.own_values(t, load, theta, velocity, as_given([0.0] * len(z)))
        )
        return [
            (s - z[first + i], rate, bend)
            for i, (s, rate, bend) in enumerate(zip(*(x[first:] for x in found), strict=True))
        ]

    def dependent_sums(
        self, t: Any, theta: Any, velocity: Any, load: Any
    ) -> list[tuple[list[Any], Any]]:
        """For each dependent sum its row B T of the other coordinates' accelerations, and the value
        b that B T z'' has while its contact is closed, where q_0'' is q'' for z'' = 0:

            b = -B q_0'' - n''.

        Terms that let the rounding of the sum and of its rate die out would press on the contact:
        where nothing else does, they would decide whether it stays closed.
        """
        found = self._of_sums(t, theta, velocity, load)
        return [(row, -bend) for row, (_, _, bend) in zip(self.sum_rows(), found, strict=True)]

    def completed(
        self, t: Any, load: Any, state: np.ndarray, held: Sequence[int] = ()
    ) -> np.ndarray:
        """A state (2 n,) with the dependent sums that follow from its other coordinates, and their
        rates.

        Coordinates at the places `held` are at their nearest contacts, sums among them without a
        rate: the others are moved there by the shortest way, except for those that are held.
        Numbers may be complex, for derivatives.
        """
        first = len(self.coordinates) - self.dependent
        found = state.copy()
        q, v = np.split(found, 2)
        at = dict[int, Any]()
        q[first:], v[first:] = self._sums_and_rates(t, load, found)
        for place in held:
            beside = [
                each.position
                for each in self.contacts
                if each.coordinate == self.coordinates[place]
            ]
            at[place] = min(beside, key=lambda position, place=place: abs(position - q[place]))  # type: ignore[misc]
            q[place] = at[place] if place < first else q[place]
        q[first:], v[first:] = self._sums_and_rates(t, load, found)
        if sums := [place for place in held if place >= first]:
            free = [place for place in range(first) if place not in at]
            rows = np.array(self.sum_rows())[np.ix_([place - first for place in sums], free)]
            moved = rows.T @ np.linalg.solve(
                rows @ rows.T, np.array([[at[place] - q[place], -v[place]] for place in sums])
            )
            q[free], v[free] = q[free] + moved[:, 0], v[free] + moved[:, 1]
            q[first:], v[first:] = self._sums_and_rates(t, load, found)
        return found

    def forces_along(
        self, t: Any, q: Any, v: Any, load: Any, closed: Sequence[np.ndarray]
    ) -> dict[int, Any]:
        """The reactions along dependent sums, by their places, at instants (n, m), in each row of
        which contacts are closed.
        """
        pairs = [*zip(self.contacts, closed, strict=True)]
        held = (
            [shut for each, shut in pairs if each.coordinate == name] for name in self.coordinates
        )
        free = [1.0 - np.any([np.zeros(len(t), dtype=bool), *own], axis=0)[:, None] for own in held]
        return solved_motion(self, t, q, v, load, free).along

    def close_in(self, t: Any, load: Any, state: np.ndarray, chosen: Sequence[int]) -> bool:
        """Whether these contacts leave less and less room between them: a sum of their gaps with
        positive weights does not depend on the state, and falls."""
        first = len(self.coordinates) - self.dependent
        signs = np.array([self.contacts[i].sign for i in chosen])
        places = [self.coordinates.index(self.contacts[i].coordinate) for i in chosen]
        rows = (
            signs[:, None]
            * np.vstack([np.eye(first), np.array(self.sum_rows())[:, :first]])[places]
        )
        weights = np.linalg.svd(rows.T)[2][-1]
        rates = signs * np.split(self.completed(t, load, state), 2)[1][places]
        opposed = (
            min(weights.max(), -weights.min()) < 0.0 and np.abs(weights @ rows).max() < CLOSED_BELOW
        )
        return bool(opposed and (weights @ rates) * weights.sum() < 0.0)

    def _sums_and_rates(self, t: Any, load: Any, state: np.ndarray) -> list[list[Any]]:
        """Dependent sums and their rates, as they follow from the other coordinates of a state."""
        q, v = (tuple(half.tolist()) for half in np.split(state, 2))
        found = self._of_sums(t, q, v, load)
        first = len(q) - self.dependent
        return [
            [q[first + i] + left for i, (left, _, _) in enumerate(found)],
            [rate for _, rate, _ in found],
        ]

    def sum_rows(self) -> list[list[Any]]:
        """B T as rows."""
        columns = list(zip(*self._back(), strict=True))
        return [
            [weighted(row, column) for column in columns]
            for row in self.gap_sums()[0][len(columns) - self.dependent :]
        ]

    def normal_forces(self, t: Any, theta: Any, velocity: Any, load: Any) -> tuple[Any, ...]:
        """Those of the model as it was given."""
        q, v = self.own_values(t, load, theta, velocity)
        return super().normal_forces(t, q, v, load)

    def after_impact(self, contact: str, theta: Any, velocity: Any) -> Any:
        """That of the model as it was given; none has one where a wall moves, as it would not be
        told its velocity.
        """
        if not self.jumps:
            return tuple(theta[len(self.moving) :])
        after = super().after_impact(contact, *self.own_values(0.0, None, theta, velocity))
        return (*each_of(after), *each_of(theta)[len(self.coordinates) - self.dependent :])

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """That of the model as it was given."""
        q, v = self.own_values(t, load, theta, velocity)
        return super().kinetic_energy(t, q, v, side, load)

    def margins(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Any
    ) -> dict[str, Any]:
        """Those of the model as it was given, and slopes of what stands for coordinates, whose
        inverses end where it turns.
        """
        q, v, a = self.own_values(t, load, theta, velocity, acceleration)
        found = dict(super().margins(t, q, v, a, side, load))
        for place, name in self.gap_places.stands:
            jets = [Jet(x, float(i == place)) for i, x in enumerate(self._each(q, True))]
            # so that no rounding leads beyond its inverse
            found[name + TURNS] = self._function(name, jets).first - 2.0**-18
        return found


@cache
def fields_of(kind: type) -> tuple[str, ...]:
    """The names of the fields of a dataclass; none of any other class."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()


def in_gap_coordinates(model: Any) -> Any:
    """A model in coordinates of which each contact holds one; itself, if each of its contacts holds
    one already.

    Raises
    ------
    ParameterError
        A sum follows from others beside frictions or functions in gaps, or in a `Structure`, or
        closes only where others do.
    """
    places = places_of(model)
    if places is None:
        return model
    kind: Any = type(model)
    if taken := {
        name for name in (*vars(InGapCoordinates), "own_class") if name not in dir(ContactModel)
    } & {*dir(kind)}:
        raise ParameterError(
            f"{kind.__name__} has a part named {min(taken)}, which is also the name of a gap's "
            f"coordinate: rename it",
            "model",
        )
    made = object.__new__(_class_in(kind, places))  # its numbers have been checked
    for name in fields_of(kind):
        object.__setattr__(made, name, getattr(model, name))
    if made.dependent:
        _check_dependent(made)
    return made


@cache
def _class_in(cls: Any, places: GapPlaces) -> Any:
    """The class of a model in coordinates of its gaps: a subclass with the same fields."""
    body: dict[str, Any] = {
        "__slots__": (),
        "__doc__": f"{cls.__name__} in coordinates of its gaps.",
        "__module__": __name__,
    }
    body |= {"gap_places": places, "own_class": cls, "coordinates": places.names}
    body["first_order"] = (*cls.first_order, *places.names[len(cls.coordinates) :])
    return type(cls.__name__ + IN_GAPS, (InGapCoordinates, cls), body)


# behind the name of a model's class, the name of its class in these coordinates
IN_GAPS = "InGapCoordinates"


def _check_left_out(friction: Friction) -> None:
    """Refuse a force of a friction that was left out, where its coefficients are numbers."""
    numbers = [x for x in (friction.kinetic, friction.most) if isinstance(x, (int, float))]
    if any(numbers):
        raise ParameterError(
            f"{called_part(friction)} has no coordinate of its own beside what contacts keep, as its"
            " coefficients were 0: it cannot get a force here",
            "model",
        )


def _check_dependent(model: InGapCoordinates) -> None:
    """Refuse a contact whose gap is a sum of those of others, or minus such a sum, so that it
    closes only together with all of them.

    Raises
    ------
    ParameterError
        The error names all of them.
    """
    names = model.coordinates
    walls = model.gap_sums()[1]
    rows = dict(zip(names[len(names) - model.dependent :], model.sum_rows(), strict=True))
    fixed = [contact for contact in model.contacts if not walls[names.index(contact.coordinate)]]
    for contact in (each for each in fixed if each.coordinate in rows):
        for sign in (1.0, -1.0):
            others = []
            left = -float(contact.position)
            largest = abs(left)
            for name, factor in zip(names, rows[contact.coordinate], strict=True):
                beside = [
                    c
                    for c in fixed
                    if c.coordinate == name and sign * contact.sign * c.sign * float(factor) > 0.0
                ]
                others += beside[:1] if float(factor) else []
                term = (
                    float(factor) * float(beside[0].position)
                    if beside
                    else math.inf
                    if float(factor)
                    else 0.0
                )
                left += term
                largest = max(largest, abs(term))
            if math.isfinite(left) and abs(left) <= CLOSED_BELOW * largest:
                raise ParameterError(
                    f"the contact {contact.name!r} closes where "
                    f"{' and '.join(c.name for c in others)} do, and only there: "
                    + ("leave it out" if sign > 0.0 else "they leave no room between them"),
                    "model",
                )


def _values(given: Any) -> Any:
    """A number or an array for each coordinate, as `_as_given`."""
    return as_given([*np.atleast_1d(given)] if isinstance(given, np.ndarray) else each_of(given))


def _stacked(values: Any) -> np.ndarray:
    """A row for each coordinate."""
    return np.stack(np.broadcast_arrays(*each_of(values)))


def _rows_of(mass: Any) -> list[list[Any]]:
    """A mass matrix as rows, for any number of coordinates."""
    return [list(row) for row in mass] if isinstance(mass, (tuple, list)) else [[mass]]
