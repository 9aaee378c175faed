"""Which coordinates of a model the sums take the place of that its contacts, surfaces and frictions
keep, and states in these.

A sum that follows from those before it takes no place, and is a further coordinate. States beside
contacts keep it so.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems.contracts.contact_model import Contact, Friction, Surface
from saltus.systems.contracts.model import is_function, is_zero, reads_of
from saltus.systems.system_units import units_of_gaps

Part = Contact | Surface | Friction
# A contact is closed, up to rounding, if both its gap and its speed are smaller than this share of
# the terms of its sum, or of natural units.
CLOSED_BELOW = 1e-13
# behind the name of a model's function, its inverse, and the margin that ends this
INVERSE = "_inverse"
TURNS = " turns"
# of a friction that does nothing there
ANY_PLACE = (0, 1)


@dataclass(frozen=True)
class GapPlaces:
    """Which coordinates the gaps of a model take the place of."""

    # of the coordinates, in which the sum of a gap has the place of one of its terms; then
    # dependent sums
    names: tuple[str, ...]
    order: tuple[int, ...]  # the places of sums, in the order in which their terms are eliminated
    # the place of each contact's sum, and +1, or -1 if the coordinate is minus the sum
    contacts: tuple[tuple[int, int], ...]
    surfaces: tuple[tuple[int, int], ...]  # of each surface likewise, but those of functions
    frictions: tuple[tuple[int, int], ...]  # and of each friction
    # the coordinates in the order of solving, with the functions that each needs
    solved: tuple[tuple[int, tuple[str, ...]], ...]
    # places of coordinates, with the functions of them alone that stand for them
    stands: tuple[tuple[int, str], ...]
    # the frictions without force for whose sums there is no place: they name any coordinate
    left_out: tuple[int, ...] = ()


def terms_of(contact: Part) -> dict[str, Any]:
    """The coefficients of the coordinates and load channels in the sum that a contact keeps on one
    side of its position.
    """
    return (
        {contact.coordinate: 1.0}
        if isinstance(contact.coordinate, str)
        else dict(contact.coordinate)
    )


def placed(surfaces: Sequence[Surface]) -> list[Surface]:
    """The surfaces of coordinates, or sums of them; those of functions need no place."""
    return [surface for surface in surfaces if surface.function is None]


def places_of(model: Any) -> GapPlaces | None:
    """Which coordinates the sums of a model's contacts take the place of; None if each contact
    holds a single coordinate.

    Functions that stand for the coordinate on which they depend are tried only if there is no other
    way; then frictions without force are left out.
    """
    surfaces = placed(model.surfaces)
    parts: tuple[Part, ...] = (*model.contacts, *surfaces, *model.frictions)
    if all(isinstance(part.coordinate, str) for part in parts):
        return None
    reads = {
        name: reads_of(model, name)
        for part in parts
        for name in terms_of(part)
        if is_function(model, name)
    }
    stands = {
        places[0]: name
        for name, places in reads.items()
        if len(places) == 1 and hasattr(model, name + INVERSE)
    }
    held = (*model.contacts, *surfaces)
    acting = tuple(friction for friction in model.frictions if not has_no_force(friction))
    refusals = list[str]()
    for kept in (parts, (*held, *acting)) if len(acting) < len(model.frictions) else (parts,):
        for standing in ({}, stands) if stands else ({},):
            found = _placed(model, kept, reads, standing)
            if isinstance(found, GapPlaces):
                return _with_left_out(model, found)
            refusals.append(found)
    raise ParameterError(refusals[-1], "model")


def has_no_force(friction: Friction) -> bool:
    """Whether the coefficients of a friction are 0; they are numbers."""
    return float(friction.kinetic) == 0.0 and float(friction.most) == 0.0


def _with_left_out(model: Any, found: GapPlaces) -> GapPlaces:
    """Places of all frictions, of which those without force were left out if any was."""
    if len(found.frictions) == len(model.frictions):
        return found
    places = list(found.frictions)
    left_out = tuple(k for k, friction in enumerate(model.frictions) if has_no_force(friction))
    for k in left_out:
        places.insert(k, ANY_PLACE)
    return replace(found, frictions=tuple(places), left_out=left_out)


def _placed(
    model: Any, parts: Sequence[Part], reads: dict[str, tuple[int, ...]], stands: dict[int, str]
) -> GapPlaces | str:
    """The places of the sums of `parts`, or why there are none.

    Each sum takes that of the coordinate with the largest coefficient after the elimination of
    earlier sums, of several the last one. None of its functions reads this coordinate, and no part
    holds it alone.
    """
    names = columns_of(model.coordinates, tuple(stands.items()))
    columns = [*names, *(name for name in reads if name not in names)]
    called = list(names)
    found = dict[int, tuple[int, int]]()
    order = list[int]()
    alone = {part.coordinate for part in parts if isinstance(part.coordinate, str)}
    rows = {names.index(name): {name: 1.0} for name in alone if name in names}
    has_frictions = any(isinstance(part, Friction) for part in parts)
    reduced = dict[int, list[Fraction]]()
    for number, part in enumerate(parts):
        terms = {name: float(factor) for name, factor in terms_of(part).items()}
        turned = {name: -factor for name, factor in terms.items()}
        same = [
            (place, 1 if terms == row else -1)
            for place, row in rows.items()
            if row in (terms, turned)
        ]
        if not same:
            left = [Fraction(terms.get(name, 0.0)) for name in columns]
            for place, row in reduced.items():
                left = [a - left[place] * b for a, b in zip(left, row, strict=True)]
            read = {
                place
                for name in columns[len(names) :]
                if left[columns.index(name)]
                for place in reads[name]
            }
            free = [
                place
                for place in range(len(names))
                if left[place] and place not in rows and place not in read
            ]
            follows = not (free or reads or has_frictions or hasattr(model, "mode_equations"))
            if not (free or follows) or any(
                name in model.coordinates and name not in names for name in terms
            ):
                return _no_place(part, parts, reads)
            if follows:
                place = len(called)
                called.append(_called(part))
            else:
                place = max(free, key=lambda place: (abs(left[place]), place))
                reduced[place], called[place] = [a / left[place] for a in left], _called(part)
                order.append(place)
            rows[place], same = terms, [(place, 1)]
        found[number] = same[0]
    solved = _order_of_solving(
        names, [rows.get(place, {name: 1.0}) for place, name in enumerate(names)], order, reads
    )
    if solved is None:
        return _no_place(parts[-1], parts, reads)
    count = len(model.contacts)
    every = tuple(found.values())
    last = count + len(placed(model.surfaces))
    return GapPlaces(
        tuple(called),
        tuple(order),
        every[:count],
        every[count:last],
        every[last:],
        solved,
        tuple(stands.items()),
    )


def _order_of_solving(
    names: Sequence[str],
    rows: list[dict[str, float]],
    order: Sequence[int],
    reads: dict[str, tuple[int, ...]],
) -> tuple[tuple[int, tuple[str, ...]], ...] | None:
    """The coordinates in an order in which each follows from sums and from functions of those
    before it, or None.
    """
    back = inverse(
        [[Fraction(row.get(name, 0.0)) for name in names] for row in rows], order, Fraction(1)
    )
    shares = [
        {
            f: sum(t * Fraction(row.get(f, 0.0)) for t, row in zip(ts, rows, strict=True))
            for f in reads
        }
        for ts in back
    ]
    needed = [tuple(f for f, share in each.items() if share and f not in names) for each in shares]
    found = list[tuple[int, tuple[str, ...]]]()
    left = list(range(len(names)))
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
    kept = _called(part)
    names = [name for name in terms_of(part) if name in reads]
    what = f"the {type(part).__name__.lower()} {part.name!r} keeps {kept}"
    instead = ""
    if not isinstance(part, Surface):
        function = "distance" if isinstance(part, Contact) else "rate"
        instead = f"; or give it a {function}, a method of the model, in place of its sum"
    if names:
        return (
            f"{what}, and needs a coordinate of its own, with a constant coefficient and read by"
            " none of its functions: let it keep a coordinate where its gap is 0, or, if"
            f" {names[0]} is of one coordinate alone, give the model {names[0]}{INVERSE}(value),"
            f" the coordinate at which {names[0]} has this value{instead}"
        )
    return (
        f"{what}, which follows from what {others} keep, up to a displacement: beside frictions,"
        " and in a Structure, each sum must be a coordinate of its own; leave one out, or give"
        f" sums that are the same the same coefficients{instead}"
    )


def _called(contact: Part) -> str:
    """The name of a contact's sum, such as y_minus_x; with other coefficients than 1 and -1 it is
    called after the contact.
    """
    terms = {name: float(factor) for name, factor in terms_of(contact).items()}
    if any(abs(factor) != 1.0 for factor in terms.values()):
        return f"sum_at_{contact.name}"
    ranked = sorted(terms, key=lambda name: terms[name] < 0.0)  # positive terms first
    return "_".join(
        ("minus_" if terms[name] < 0.0 else "plus_") + name for name in ranked
    ).removeprefix("plus_")


def inverse(rows: list[list[Any]], order: Sequence[int], one: Any = 1.0) -> list[list[Any]]:
    """The inverse of a matrix whose rows are those of the unit matrix, except for those in
    `order`.
    """
    size = len(rows)
    left = [list(row) for row in rows]
    right = [[one * (i == j) for j in range(size)] for i in range(size)]
    for k in (*order, *(k for k in range(size) if k not in order)):
        pivot = left[k][k]
        if not (isinstance(pivot, float) and pivot == 1.0):
            left[k], right[k] = (
                [x / pivot for x in left[k]],
                [x if is_zero(x) else x / pivot for x in right[k]],
            )
        for i in range(size):
            factor = left[i][k]
            if i != k and not is_zero(factor):
                left[i] = [
                    x if is_zero(y) else x - factor * y
                    for x, y in zip(left[i], left[k], strict=True)
                ]
                right[i] = [
                    x if is_zero(y) else x - factor * y
                    for x, y in zip(right[i], right[k], strict=True)
                ]
    return right


# --- states (..., d) in coordinates of gaps, with sums that follow from the others ---


def led(leads: Callable[..., Any], states: np.ndarray) -> np.ndarray:
    """States (..., d) in other coordinates, at time 0."""
    found = np.concatenate(leads(0.0, *np.split(states.reshape(-1, states.shape[-1]).T, 2)))
    return np.asarray(found.T.reshape(*states.shape[:-1], len(found)))


def with_sums(system: Any, states: np.ndarray) -> np.ndarray:
    """States at phase 0 with the dependent sums that follow from their other coordinates."""
    model = system.model
    load = system.load
    units = units_of_gaps(system)
    return led(
        lambda t, q, v: model.gap_states(t, *model.own_states(t, q, v, load), load, units), states
    )


def normal_of(system: Any, place: int) -> np.ndarray:
    """The coefficients of the coordinates that depend on no others in the coordinate at a place,
    which may depend on them.
    """
    first = len(system.model.coordinates) - system.dependent
    return (
        np.eye(first)[place]
        if place < first
        else np.array(system.model.sum_rows()[place - first], dtype=float)
    )


def pushed(system: Any, states: np.ndarray, place: int, by: np.ndarray) -> np.ndarray:
    """States of which the coordinate at a place changes by these amounts, by the shortest way;
    their sums are not changed.
    """
    moved = states.copy()
    normal = normal_of(system, place)
    moved[..., : len(normal)] += by[..., None] * normal / (normal @ normal)
    return moved


def reflected(system: Any, states: np.ndarray) -> np.ndarray:
    """States, changed in place: each is reflected at the contact that it is farthest beyond until
    it is beyond none, which comes to an end where there is room (Motzkin and Schoenberg 1954)."""
    names = system.model.coordinates
    contacts = system.model.contacts
    found = with_sums(system, states).reshape(-1, 2 * len(names))
    places = [names.index(each.coordinate) for each in contacts]
    widths = np.array([np.linalg.norm(normal_of(system, place)) for place in places])
    far = max(abs(float(each.position)) for each in contacts)
    for _ in range(1000):  # a few are enough where there is room
        gaps = (
            np.stack(
                [each.gap(found[:, place]) for each, place in zip(contacts, places, strict=True)]
            )
            / widths[:, None]
        )
        rounding = CLOSED_BELOW * np.maximum(np.abs(found[:, places]).max(axis=1), far)
        if not (beyond := gaps < -rounding).any():
            break
        for i, place in enumerate(places):
            rows = beyond[i] & (gaps.argmin(axis=0) == i)
            found[rows] = pushed(
                system, found[rows], place, -2.0 * contacts[i].sign * gaps[i, rows] * widths[i]
            )
        found = with_sums(system, found)
    states[...] = found.reshape(states.shape)
    return states


def held_exactly(system: Any, states: np.ndarray, held: np.ndarray) -> np.ndarray:
    """States with the dependent sums that follow from the other coordinates, which are moved where
    a contact holds a sum.
    """
    if not system.dependent:
        return states
    found = with_sums(system, states)
    last = slice(len(system.model.coordinates) - system.dependent, len(system.model.coordinates))
    for at in map(tuple, np.argwhere(held[..., last].any(axis=-1))):
        # those that are held leave the sum no room
        with contextlib.suppress(np.linalg.LinAlgError):
            chosen = np.flatnonzero(held[at][: last.stop]).tolist()
            found[at] = system.model.completed(0.0, system.load, states[at], chosen)
    return found
