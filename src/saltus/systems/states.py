"""States: read from arguments, spread evenly over windows, and those that a system can be in beside
its contacts.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from saltus.checks import LIMITS, as_numbers, check_number
from saltus.errors import ParameterError, near, shown
from saltus.systems.contracts.model import Model, ask
from saltus.systems.gap_coordinates import InGapCoordinates
from saltus.systems.gap_places import (
    CLOSED_BELOW,
    held_exactly,
    led,
    normal_of,
    pushed,
    reflected,
    terms_of,
)
from saltus.systems.system import System
from saltus.systems.system_units import ANGLES, natural_units, time_without_period

# The largest speed of an angle, in a natural time: steps take a third of a radian or so, so that a
# natural time then takes half a second.
TURNS = 1e6


def read_start(
    system: System,
    velocity: Any,
    coordinates: Mapping[str, Any],
    arguments: Iterable[str] = (),
    time: float = 0.0,
) -> np.ndarray:
    """A state, coordinates and then velocities, (d,), from `theta=0.3, velocity=0.1` as `simulate`
    takes them.

    Every coordinate must be given, by its name; those called theta_1, theta_2, ... may be given
    together, `theta=(0.3, 0.0)`. The velocity is a number with one coordinate, or as many numbers
    as there are coordinates; 0, the default, is 0 for all. Those of first order are left out, as
    their velocities follow from the state. For a system in coordinates of its gaps the coordinates
    of the model as it was given may be named instead, all of them.

    Parameters
    ----------
    system
        What moves.
    velocity, coordinates
        The state at the start.
    arguments
        The names of the other arguments of the function that reads it: a misspelt one arrives among
        the coordinates.
    time
        The time at the start.

    Raises
    ------
    ParameterError
        A name is no coordinate (the message has similar names), a coordinate is not given, or a
        value is no finite number.
    """
    model: Any = system.model
    if isinstance(model, InGapCoordinates):
        names = {*model.coordinates}
        given = {*coordinates}
        own_names = {*model.own_class.coordinates}
        if given & own_names - names or (own_names < names and given == own_names):
            own = system.with_(model=model.as_given())
            return np.concatenate(
                own.to_gaps(time, *np.split(read_start(own, velocity, coordinates, arguments), 2))
            )
    most = LIMITS.value
    in_order = model.coordinates
    positions = (
        coordinates.values()
        if tuple(coordinates) == in_order
        else _positions(system, coordinates, arguments)
    )
    values = [*positions, *_speeds(velocity, model)]
    for i, value in enumerate(values):
        if not (type(value) is float and abs(value) <= most):
            name = in_order[i] if i < len(in_order) else "velocity"
            if _is_sequence(value) and not _is_one(value):
                raise ParameterError(
                    f"{name} must be a finite number, got {shown(value, 40)}; for many starts at "
                    "once use simulate_many",
                    name,
                )
            check_number(name, _plain(value))
    # the natural time, which takes longer to find than a short motion, is no longer than the load's
    usual = TURNS * (system.load.frequency or TURNS**-0.5)
    if any(abs(speed) > usual for speed in values[len(in_order) :]):
        _check_turns(system, values[len(in_order) :])
    return system._with_rates(time, np.array(values, dtype=float))


def read_starts(
    system: System, velocity: Any, coordinates: Mapping[str, Any], arguments: Iterable[str] = ()
) -> tuple[list[Any], list[Any]]:
    """The coordinates and the velocities of many states: `read_start`, of which each number may be
    an array.

    With one coordinate `velocity` is a number or an array; with several it has one number or array
    for each of them.

    Raises
    ------
    ParameterError
        As `read_start`; numbers in arrays are not looked at.
    """
    names = system.model.coordinates
    positions = _positions(system, coordinates, arguments)
    speeds = _speeds(velocity, system.model, many=True)
    for name, value in (
        *zip(names, positions, strict=True),
        *(("velocity", speed) for speed in speeds),
    ):
        if not _is_sequence(value) and not hasattr(value, "dims"):
            check_number(name, _plain(value))
    return list(positions), list(speeds)


def _check_turns(system: System, speeds: Sequence[float]) -> None:
    """Refuse speeds of angles with which a motion takes for ever."""
    model = system.model
    most = TURNS / natural_units(system).time
    for name, speed in zip(model.coordinates, speeds, strict=True):
        if model.unit_of(name) in ANGLES and abs(speed) > most:
            raise ParameterError(
                f"velocity must be at most {most:.3g} in size for {name}, an angle, got"
                f" {speed:.7g}: the motion would turn by a million radians in a natural time, and"
                " take for ever",
                "velocity",
            )


def _positions(
    system: System, coordinates: Mapping[str, Any], arguments: Iterable[str]
) -> list[Any]:
    """The values of the coordinates in the model's order."""
    names = system.model.coordinates
    given = dict(coordinates)
    for together in [name for name in given if name not in names]:
        if names == tuple(f"{together}_{i + 1}" for i in range(len(names))):
            values = given.pop(together)
            if not _is_sequence(values) or len(values) != len(names):
                raise ParameterError(
                    f"{together} must have {len(names)} values, got {shown(values)}", together
                )
            given |= dict(zip(names, values, strict=True))
    for name in given:
        if name not in names:
            hint = near(name, names, {"velocity", *arguments} - {"coordinates"})
            raise ParameterError(
                f"{type(system.model).__name__} has no coordinate {shown(name)}; {hint}", name
            )
    for name in names:
        if name not in given:
            raise ParameterError(f"the state at the start needs {name}=...", name)
    return [given[name] for name in names]


def _speeds(velocity: Any, model: Model, many: bool = False) -> tuple[Any, ...]:
    """The velocities of all coordinates, of which each number may be an array if there are `many`;
    0 for those of first order, whose velocities may be given and are not read."""
    count = len(model.moving)
    none = (0.0,) * len(model.first_order)
    if type(velocity) is float and count == 1:
        return (velocity, *none)
    if count == 1 and (many or not _is_sequence(velocity)):
        return (velocity, *none)
    if _is_sequence(velocity) and len(velocity) in (count, count + len(none)):
        return (*velocity[:count], *none)
    if isinstance(velocity, (int, float)) and velocity == 0 and not isinstance(velocity, bool):
        return (0.0,) * count + none
    raise ParameterError(f"velocity must have {count} value(s), got {shown(velocity)}", "velocity")


def _is_sequence(value: Any) -> bool:
    """Whether a value has entries in an order; a DataArray has named dimensions, and is no
    sequence.
    """
    return isinstance(value, (tuple, list)) or (
        not hasattr(value, "dims") and isinstance(value, np.ndarray) and value.ndim > 0
    )


def _is_one(value: Any) -> bool:
    """Whether a sequence holds one number."""
    numbers = as_numbers(value)
    return numbers.size == 1


def _plain(value: Any) -> Any:
    """The number in an array without dimensions; anything else as it is."""
    return value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value


def arguments_of(system: System, state: Any) -> dict[str, Any]:
    """A state (coordinates, velocities) as `simulate` takes it; behind these it may have the sides
    of the model's relays.
    """
    names = system.model.coordinates
    moving = len(system.model.moving)
    numbers = [float(x) for x in state]
    velocity = tuple(numbers[len(names) : len(names) + moving])
    found: dict[str, Any] = {
        **dict(zip(names, numbers, strict=False)),
        "velocity": velocity[0] if moving == 1 else velocity,
    }
    sides = numbers[2 * len(names) :]
    if sides:
        relays = system.model.relays
        found["relays"] = {
            relay.name: side > 0.0 for relay, side in zip(relays, sides, strict=True)
        }
    return found


def state_of(system: System, arguments: Mapping[str, Any]) -> np.ndarray:
    """The inverse of `arguments_of`: coordinates, then velocities, (d,)."""
    velocity = np.append(arguments["velocity"], np.zeros(len(system.model.first_order)))
    return np.append([arguments[name] for name in system.model.coordinates], velocity)


def state_with_sides(system: System, arguments: Mapping[str, Any]) -> np.ndarray:
    """`state_of`, and behind it the side of each relay, +1 or -1, where the arguments have them."""
    sides = [1.0 if on in (True, 1) else -1.0 for on in arguments.get("relays", {}).values()]
    return np.append(state_of(system, arguments), sides)


def units_with_sides(system: System) -> np.ndarray:
    """The natural units of a state; two sides of a relay are two units apart, far more than what
    returns."""
    return np.append(natural_units(system).state, np.ones(len(system.model.relays)))


def size_with_sides(system: System) -> int:
    """The number of a state's variables, with the sides of relays behind them."""
    return system.dimension + len(system.model.relays)


def in_gaps(system: System, states: np.ndarray) -> np.ndarray:
    """States (..., d) at phase 0 as those of `system.in_gap_coordinates`."""
    if system.in_gap_coordinates is system:
        return states
    return _beside_sides(system, states, lambda own: led(system.to_gaps, own))


def from_gaps(system: System, states: np.ndarray) -> np.ndarray:
    """The inverse of `in_gaps`."""
    if system.in_gap_coordinates is system:
        return states
    own = 2 * len(system.in_gap_coordinates.model.coordinates)
    moved = led(system.from_gaps, states[..., :own])
    return np.concatenate([moved, states[..., own:]], axis=-1)


def _beside_sides(
    system: System, states: np.ndarray, move: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """States (..., d) that are moved; the sides of relays behind them stay."""
    own = system.dimension
    if states.shape[-1] == own:
        return move(states)
    return np.concatenate([move(states[..., :own]), states[..., own:]], axis=-1)


# the half width of the default window, in natural units: about the size of the motions in the paper
HALF_WIDTH = 1.5

Box = tuple[tuple[float, float], ...]  # bounds of each coordinate, then of each velocity


class Window(Box):
    """A box of the state space: the bounds of each coordinate, then of each velocity; a rectangle
    for one coordinate.
    """

    __slots__ = ()

    @property
    def centre(self) -> np.ndarray:
        """Its middle, (d,) for d state variables."""
        return np.asarray(np.asarray(self).mean(axis=1))

    @property
    def half(self) -> np.ndarray:
        """Its half widths, (d,)."""
        return 0.5 * np.diff(np.asarray(self), axis=1)[:, 0]

    def scaled(self, states: np.ndarray) -> np.ndarray:
        """States (..., d) in half widths from the middle."""
        return np.asarray((states - self.centre) / self.half)


def check_window(window: Any, system: System, half_width: float = HALF_WIDTH) -> Window:
    """A window of the states; for None the default window, with half widths of so many natural
    units around the contact, or around 0 without one.

    With several contacts the default window ends at these. With several coordinates both bounds of
    a state variable may be equal; it then has one value. Velocities of coordinates of first order
    are left out.

    Raises
    ------
    ParameterError
        Anything but a pair of bounds for each coordinate and each velocity; a window beyond the
        contacts.
    """
    names = system.model.coordinates
    if window is None:
        return _default_window(system, half_width)
    bounds = as_numbers(window, "window")
    moving = system.model.moving
    following = len(system.model.first_order)
    # velocities that follow from the state may have any bounds
    if following and bounds.shape == (2 * len(names) - following, 2):
        free = _default_half_widths(system, half_width)[-following:, None] * (-1.0, 1.0)
        bounds = np.concatenate([bounds, free])
    single = len(names) == 1
    sound = bounds.shape == (2 * len(names), 2) and (np.abs(bounds) <= LIMITS.value).all()
    if (
        not sound
        or not ((bounds[:, 0] < bounds[:, 1]) if single else (bounds[:, 0] <= bounds[:, 1])).all()
    ):
        meant = "((least, largest coordinate), (least, largest velocity))"
        if not single:
            whose = (
                "their velocities"
                if moving == names
                else f"the velocities of {', '.join(moving) or 'none'}"
            )
            meant = (
                f"{len(names) + len(moving)} pairs (least, largest), of {', '.join(names)}, then of"
                f" {whose},"
            )
        raise ParameterError(f"window must be {meant}, got {shown(window)}", "window")
    for contact in (each for each in system.model.contacts if each.coordinate in names):
        low, high = bounds[names.index(contact.coordinate)]
        if max(contact.gap(low), contact.gap(high)) < 0.0:
            raise ParameterError(
                f"window must reach to where {contact.coordinate} can be, and all of ({low:g},"
                f" {high:g}) is beyond the contact {contact.name} at {contact.position:g}",
                "window",
            )
    model: Any = system.model
    if len(model.sides) == 1:
        side = model.sides[0]
        low, high = bounds[0]
        if max(float(model.gap(x, side)) for x in (low, high)) < 0.0:
            raise ParameterError(
                f"window must reach to where {names[0]} can be, and all of ({low:g}, {high:g}) is "
                f"beyond the contact at {float(model.contact):g}",
                "window",
            )
    return Window(map(tuple, bounds.tolist()))


def unit_of_time(system: System) -> float:
    """The time in which default windows and spans are measured: 1 of a model without units of time,
    else the natural one."""
    if system.model.dimensionless:
        return 1.0
    time = time_without_period(system)
    return time if 0.0 < time < math.inf else natural_units(system).time


def _default_window(system: System, half_width: float) -> Window:
    """The window with half widths of so many natural units around the contact, or around 0 without
    one, cut off at the contacts.
    """
    model = system.model
    half = _default_half_widths(system, half_width).tolist()
    if model.sides:
        middle = float(model.contact)
        return Window(((middle - half[0], middle + half[0]), (-half[1], half[1])))
    bounds = {name: [-far, far] for name, far in zip(model.coordinates, half, strict=False)}
    for contact in (each for each in model.contacts if each.coordinate in model.coordinates):
        at = float(contact.position)
        pair = bounds[contact.coordinate]
        alone = sum(other.coordinate == contact.coordinate for other in model.contacts) == 1
        far = half[model.coordinates.index(contact.coordinate)]
        pair[:] = sorted((at, at + contact.sign * far)) if alone else pair
        pair[contact.sign < 0] = at
    return Window(
        [
            *((low, high) for low, high in bounds.values()),
            *((-fast, fast) for fast in half[len(bounds) :]),
        ]
    )


def _default_half_widths(system: System, half_width: float) -> np.ndarray:
    """The half widths of the default window, of coordinates and then of velocities, (2 n,), in
    natural units. An angle has the unit of 1 rad, also in a model without units of time.
    """
    units = natural_units(system)
    names = system.model.coordinates
    angular = np.array([system.model.unit_of(name) in ANGLES for name in names])
    speeds = np.where(angular & system.model.dimensionless, 1.0, units.speeds)
    return half_width * np.concatenate([np.where(angular, 1.0, units.lengths), speeds])


@cache
def even_steps(dimension: int) -> np.ndarray:
    """The steps of a sequence that covers a cube of d dimensions evenly: x^-1, ..., x^-d, with the
    root x of x^(d + 1) = x + 1."""
    root = 2.0
    for _ in range(200):  # each halves the error at least
        root = (1.0 + root) ** (1.0 / (dimension + 1))
    steps: np.ndarray = root ** -np.arange(1.0, dimension + 1.0)
    return steps


def initial_states(system: System, count: int, window: Window, seed: int) -> np.ndarray:
    """Initial states spread evenly over a window, (count, d), placed by `within_window`."""
    offset = np.random.default_rng(int(seed)).random(len(window))
    steps = even_steps(len(window))
    return within_window(
        system, 2.0 * ((offset + np.arange(1, count + 1)[:, None] * steps) % 1.0) - 1.0, window
    )


def within_window(
    system: System, points: np.ndarray, window: Window, shrunk: Any = 1.0
) -> np.ndarray:
    """The states (..., n, d) at points of the cube (-1, 1)^d, mapped to a window that is shrunk
    towards the contact by a factor.

    States beyond a contact are reflected at it. For a model with several contacts the states
    alternate, in pairs, between two kinds. All contacts are open, or some, but not all, coordinates
    are held at their nearest contacts, for each choice of coordinates whose contacts lie in the
    window. Without this no motion would begin with a closed contact, because such states have no
    share of the window's volume.
    """
    rest = rest_state(system)
    states = np.asarray((points * window.half + (window.centre - rest)) * shrunk + rest)
    states, inner = on_this_side(system, states), system.in_gap_coordinates
    if not system.model.contacts or system.model.has_multipliers:
        return states
    bounds = np.asarray(window)
    rows: Any = inner.model
    if inner is not system and rows.is_nonlinear:  # the box around the states
        there = in_gaps(system, states).reshape(-1, len(window))
        bounds = np.stack([there.min(axis=0), there.max(axis=0)], axis=1)
    elif inner is not system:  # the box around the window
        centre = in_gaps(system, window.centre)
        half = np.abs(np.kron(np.eye(2), np.array(rows.gap_sums()[0], dtype=float))) @ window.half
        bounds = np.stack([centre - half, centre + half], axis=1)
    return from_gaps(system, _held(inner, in_gaps(system, states), bounds))


def rest_state(system: System, last: np.ndarray | None = None) -> np.ndarray:
    """The state at the contacts without speed, (d,); a coordinate is 0 without contacts, and in the
    middle between two of them. With the last state of a motion, the state in which this motion
    rests, which may be any with several contacts or frictions."""
    model = system.model
    names = system.model.coordinates
    if last is not None and model.holds_coordinates:
        return last
    if (inner := system.in_gap_coordinates) is not system:
        return from_gaps(system, rest_state(inner))
    state = np.zeros(2 * len(names))
    if model.has_multipliers:
        return _above_distances(system, state, 1.0)
    if model.sides:
        state[0] = float(model.contact)
    for i, name in enumerate(names):
        positions = [
            float(contact.position) for contact in model.contacts if contact.coordinate == name
        ]
        state[i] = np.mean(positions) if positions else state[i]
    return state


def is_still(system: System, highest: np.ndarray, lowest: np.ndarray, within: float) -> np.ndarray:
    """Whether motions with these extrema stay within a distance of the position of one contact, or
    of 0 without contacts.
    """
    model = system.model
    places = [
        float(each.position) for each in model.contacts if each.coordinate in model.coordinates
    ]
    places = places or [float(model.contact) if model.sides else 0.0]
    return np.asarray(
        np.any(
            [
                np.maximum(np.abs(highest - place), np.abs(lowest - place)) <= within
                for place in places
            ],
            axis=0,
        )
    )


def on_this_side(system: System, states: np.ndarray) -> np.ndarray:
    """States (..., d), changed in place: those beyond a wall, or beyond one of several contacts,
    are reflected at it.
    """
    if (inner := system.in_gap_coordinates) is not system:
        states[...] = from_gaps(system, on_this_side(inner, in_gaps(system, states)))
        return states
    names = system.model.coordinates
    if system.model.has_multipliers:
        return _above_distances(system, states)
    if system.dependent:
        return reflected(system, states)
    if len(system.model.sides) == 1:
        wall = float(system.one_contact.contact)
        inward = system.one_contact.inward(system.model.sides[0])
        states[..., 0] = wall + inward * np.abs(states[..., 0] - wall)
    for contact in system.model.contacts:
        place = names.index(contact.coordinate)
        position = float(contact.position)
        states[..., place] = position + contact.sign * np.abs(states[..., place] - position)
    for contact in system.model.contacts:  # a reflection at one may lead beyond the opposite one
        place = names.index(contact.coordinate)
        position = float(contact.position)
        states[..., place] = position + contact.sign * np.maximum(
            contact.sign * (states[..., place] - position), 0.0
        )
    return states


# The most reflections of a state at the contacts that it is beyond: a few are enough where there is
# room.
REFLECTIONS = 100


def _above_distances(system: System, states: np.ndarray, share: float = 2.0) -> np.ndarray:
    """States (..., d) at phase 0, changed in place: those beyond contacts that multipliers hold are
    reflected at the farthest, along its row, until they are beyond none; or with a share of 1 moved
    onto it."""
    count = len(system.model.coordinates)
    found = states.reshape(-1, states.shape[-1])
    for _ in range(REFLECTIONS):
        position = found[:, :count].T.astype(complex)
        gaps = np.real(_distances(system, position))
        worst = gaps.argmin(axis=0)
        beyond = np.flatnonzero(gaps.min(axis=0, initial=math.inf) < 0.0)
        if not beyond.size:
            break
        rows = np.zeros((count, len(found)))
        for i in range(count):
            beside = position.copy()
            beside[i] += 1e-100j
            slopes = np.imag(_distances(system, beside)) / 1e-100
            rows[i] = slopes[worst, np.arange(len(found))]
        depth = gaps[worst, np.arange(len(found))]
        size = np.sum(rows * rows, axis=0)
        moved = -share * depth / np.where(size > 0.0, size, 1.0) * rows
        found[beyond, :count] += moved[:, beyond].T
    states[...] = found.reshape(states.shape)
    return states


def _distances(system: System, position: np.ndarray) -> np.ndarray:
    """The gaps of contacts that multipliers hold, or of coordinates beside these, at time 0 and
    positions (coordinates, n), (contacts, n)."""
    model: Any = system.model
    known = dict(zip(model.coordinates, position, strict=True))
    q = position[0] if len(position) == 1 else tuple(position)
    gaps = []
    for part in model.contacts:
        if part.distance is not None:
            gap = ask(model, part.distance, 0.0, q, system.load)
        else:
            kept = sum(
                factor
                * (
                    known[name]
                    if name in known
                    else getattr(system.load, name)(0.0)
                    if name in model.channels
                    else ask(model, name, q)
                )
                for name, factor in terms_of(part).items()
            )
            gap = part.sign * (kept - part.position)
        gaps.append(np.broadcast_to(gap, position.shape[1:]))
    return np.array(gaps).reshape(len(gaps), position.shape[1])


def states_beside(system: System, states: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """States (..., d) moved by shifts, such that closed contacts stay closed and no coordinate goes
    beyond a contact.

    Contacts that are then open by no more than rounding are closed.
    """
    if states.shape[-1] > system.dimension:  # the sides of relays stay
        by = shifts[..., : system.dimension]
        return _beside_sides(system, states, lambda own: states_beside(system, own, by))
    if (inner := system.in_gap_coordinates) is not system:
        begin = in_gaps(system, states)
        return from_gaps(
            system, states_beside(inner, begin, in_gaps(system, states + shifts) - begin)
        )
    if system.model.has_multipliers:
        return on_this_side(system, states + shifts)
    names = system.model.coordinates
    units = natural_units(system).state
    moved = on_this_side(system, states + shifts)
    held = held_by_contacts(system, states)
    for contact in system.model.contacts:
        place = names.index(contact.coordinate)
        least = np.maximum(
            np.abs(contact.gap(moved[..., place])) / units[place],
            np.abs(moved[..., len(names) + place]) / units[len(names) + place],
        )
        closed = held[..., place] & (np.asarray(contact.gap(states[..., place])) == 0.0) | (
            least < CLOSED_BELOW
        )
        moved[..., place] = np.where(closed, float(contact.position), moved[..., place])
        moved[..., len(names) + place] = np.where(closed, 0.0, moved[..., len(names) + place])
        held[..., [place, len(names) + place]] |= closed[..., None]
    return held_exactly(system, moved, held)


def before_impacts(system: System, states: np.ndarray) -> np.ndarray:
    """States (..., d) in which every coordinate that is at one of several contacts and moves into
    it is moved back from it by one rounding: the state just before the impact, which then happens
    at once. Sums of coordinates are moved back by more than the rounding within which they count as
    closed.
    """
    if states.shape[-1] > system.dimension:
        return _beside_sides(system, states, lambda own: before_impacts(system, own))
    if system.model.has_multipliers:
        return states.copy()
    inner = system.in_gap_coordinates
    moved = in_gaps(system, states).copy()
    names = inner.model.coordinates
    beside = (
        0.0
        if inner is system
        else 4.0
        * CLOSED_BELOW
        * np.maximum(np.abs(moved).max(axis=-1), np.abs(states).max(axis=-1))
    )
    for contact in inner.model.contacts:
        place = names.index(contact.coordinate)
        position = float(contact.position)
        into = (np.asarray(contact.gap(moved[..., place])) == 0.0) & (
            contact.sign * moved[..., len(names) + place] < 0.0
        )
        back = np.nextafter(position, position + contact.sign) + contact.sign * beside
        moved = pushed(inner, moved, place, np.where(into, back - moved[..., place], 0.0))
    return from_gaps(system, moved)


def held_by_contacts(system: System, states: np.ndarray) -> np.ndarray:
    """Which variables of states (..., d) belong to coordinates that are at rest at a contact, (...,
    d).
    """
    names = system.model.coordinates
    held = np.zeros(states.shape, dtype=bool)
    if system.model.has_multipliers:  # starts are taken onto what is held
        return held
    for contact in system.model.contacts:
        place = names.index(contact.coordinate)
        closed = (np.asarray(contact.gap(states[..., place])) == 0.0) & (
            states[..., len(names) + place] == 0.0
        )
        held[..., [place, len(names) + place]] |= closed[..., None]
    return held


def held_values(
    system: System, state: np.ndarray, within: float, closed: int = 0, units: Any = None
) -> dict[int, float]:
    """The variables of a state (d,) that are fixed, by their places, with their values: the
    coordinates and velocities that contacts hold, and the velocities of coordinates that stick, up
    to rounding; those of the contacts in `closed`, a bit each, in any case.

    Gaps and speeds are compared in the natural `units` of the state (d,), by default the system's.
    """
    found = dict[int, float]()
    units = natural_units(system).state if units is None else units
    names = system.model.coordinates
    for i, contact in enumerate(system.model.contacts):
        place = names.index(contact.coordinate)
        speed = len(names) + names.index(contact.coordinate)
        gap = abs(contact.gap(state[place])) / units[place]
        if closed >> i & 1 or max(gap, abs(state[speed]) / units[speed]) < within:
            found |= {place: float(contact.position), speed: 0.0}
    for friction in system.model.frictions:
        place = len(names) + names.index(friction.coordinate)
        ground_speed = float(friction.ground_speed)
        touching = all(
            names.index(c.coordinate) in found
            for c in system.model.contacts
            if c.name == friction.contact
        )
        if touching and abs(state[place] - ground_speed) / units[place] < within:
            found[place] = ground_speed
    return found


def _held(system: System, states: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """States (..., n, d) in which some coordinates are held at contacts, alternating as
    `within_window` says; not those where this leads beyond another contact, as it may with
    dependent sums."""
    names = system.model.coordinates
    turn = np.arange(states.shape[-2]) // 2
    reached: dict[int, list[float]] = {}
    for contact in system.model.contacts:
        place = names.index(contact.coordinate)
        position = float(contact.position)
        low, high = bounds[place]
        slowest, fastest = bounds[len(names) + place]
        if low <= position <= high and slowest <= 0.0 <= fastest:
            reached.setdefault(place, []).append(position)
    count = len(normal_of(system, 0))
    choices = [
        chosen for n in range(count) for chosen in itertools.combinations(sorted(reached), n)
    ]
    found = states.copy()
    held = np.zeros(states.shape, dtype=bool)
    for number, chosen in enumerate(choices):
        rows = turn % len(choices) == number
        for place in chosen:
            at = states[..., rows, place]
            positions = np.array(reached[place])
            found[..., rows, place] = positions[np.abs(at[..., None] - positions).argmin(axis=-1)]
            found[..., rows, len(names) + place] = 0.0
            held[..., rows, place] = True
    if count == len(names):
        return found
    found = held_exactly(system, found, held)
    gaps = [
        np.asarray(each.gap(found[..., names.index(each.coordinate)]))
        for each in system.model.contacts
    ]
    far = max(abs(float(each.position)) for each in system.model.contacts)
    rounding = CLOSED_BELOW * np.maximum(np.abs(found[..., : len(names)]).max(axis=-1), far)
    return np.where((np.min(gaps, axis=0) < -rounding)[..., None], states, found)


def check_reached(model: Model, coordinate: str, values: Any, name: str) -> None:
    """Refuse values of a coordinate that a contact does not let it reach.

    Raises
    ------
    ParameterError
        The error is of the argument `name` and has the first such value and the contact.
    """
    given = np.atleast_1d(values)
    gaps = {
        f"the contact {c.name!r}": (c.gap(given), c.position)
        for c in model.contacts
        if c.coordinate == coordinate
    }
    if model.has_one_contact and coordinate == model.coordinates[0]:
        gaps["the contact"] = np.where(model.reaches(coordinate, given), 0.0, -1.0), model.contact
    for contact, (gap, position) in gaps.items():
        if (beyond := given[np.asarray(gap) < 0.0]).size:
            where = f"{contact} at {coordinate} = {float(position):g}"
            raise ParameterError(
                f"{coordinate} = {beyond[0]:g} lies beyond {where}; leave such values out", name
            )
