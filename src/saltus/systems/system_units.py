"""The natural units of a system: a length for each coordinate and a time, in which its motions have
numbers near 1.

Thresholds and default steps that must not depend on the units of a user are numbers times these.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from saltus.systems.contracts.contact_model import Surface, mass_rows, normal_forces, sides_for
from saltus.systems.contracts.model import Jet, each_of
from saltus.systems.loads.load import DeclaredLoad, Load, LoadOnSides

if TYPE_CHECKING:
    from saltus.systems.system import System

# Instants at which a load is looked at. Mean squares over so many equal parts of a period are exact
# for harmonics up to the third, whatever the phase.
INSTANTS = 8
# A load that moves d by a smaller share of it than this has no part in the unit.
FARTHEST = 1e-7
TOLD = 2.0**-50  # a smaller share of a distance is its rounding
TINY = float(np.finfo(float).tiny)
SWING = 2.0 * math.sqrt(2.0)  # the range of a sine, in units of the root of its mean square
# A distance that is this share of the largest one is rounding.
ROUNDING = 1e-12
# What is left of the forces on the other coordinates where these act linearly.
SOLVED = 1e-6
MOST_STEPS = 6  # Newton's steps to there, of which one is enough without surfaces
# A load that is slow without end: its frequency is this share of its own.
SLOWER = 2.0**-40
# What moves by itself in a larger share of the time of a load moves with it.
MOVED_BY_LOAD = 1e-3
ANGLES = ("rad", "deg")  # units of coordinates that have their own natural unit


@dataclass(frozen=True, eq=False)
class NaturalUnits:
    """The natural units of a system, each a number in the units of its user.

    1. They scale as what they measure: where all lengths of a system are L times as large and all
       times s times, `lengths` are L times and `time` is s times as large, up to rounding. They are
       not rounded themselves; `powers_of_two` are, for those who scale numbers by them exactly.
    2. They do not depend on the order of contacts and coordinates, on the origin of a coordinate
       along which a contact holds, on a shift of the load by a phase, or on friction of 0. Nor do
       they depend on contacts that are farther away than another one or than the load moves what it
       pulls off.
    3. `time` is 1 / Omega of the load, or shorter where an angle moves by 1 rad in less; without a
       load it is sqrt(d / a) of the distance d and the acceleration a below, or that of the
       stiffness alone. `lengths` are the range through which the load moves the equilibrium, or
       through which the inertia of the mass lets it move: that of d = max(abs(J), Omega^2)^-1 a,
       where a is the acceleration at rest at a contact and J = da/dq. Under a constant load it is d
       itself, the distance of the equilibrium from the contact. The contact is the one with the
       smallest unit. A coordinate that is an angle has the unit 1 rad. The amplitude of a mode of
       mass 1 has the unit of length times the root of a mass, the mean of the displacements' masses.
    4. Where there is no such distance, friction gives one, then the positions of contacts, then a
       ground that moves. What has none at all is 1: the system itself has no unit then.
    5. They are all finite and above 0.

    Attributes
    ----------
    lengths
        The unit of each coordinate, (n,).
    time
        The unit of time.
    masses
        The inertia of each coordinate, (n,): the entry of the mass matrix, 1 where there is none.
    own_time
        The time in which the system moves by itself, sqrt(d / a), at most `time`.
    free_time
        The time of its free oscillation, 1 / sqrt(abs(J)), or `time` without a stiffness.
    has_time
        Whether the system has a time; if not, `time` is 1 in the units of its user.
    has_length
        Whether it has a length, likewise.
    displacements
        How many of the coordinates are displacements or angles; the amplitudes of modes are behind
        them.
    """

    lengths: np.ndarray
    time: float
    masses: np.ndarray
    own_time: float
    free_time: float
    has_time: bool = True
    has_length: bool = True
    displacements: int | None = None

    @cached_property
    def length(self) -> float:
        """The largest unit of a displacement."""
        return float(self.lengths[: self.displacements].max())

    @cached_property
    def speed(self) -> float:
        """The unit of speed."""
        return self.length / self.time

    @cached_property
    def acceleration(self) -> float:
        """The unit of acceleration, and of a force on the mass 1."""
        return self.length / self.time**2

    @cached_property
    def speeds(self) -> np.ndarray:
        """The unit of the velocity of each coordinate, (n,)."""
        return self.lengths / self.time

    @cached_property
    def forces(self) -> np.ndarray:
        """The unit of the force along each coordinate, (n,)."""
        return np.asarray(self.masses * self.lengths / self.time**2)

    @cached_property
    def force(self) -> float:
        """The largest unit of a force along a displacement."""
        return float(self.forces[: self.displacements].max())

    @cached_property
    def state(self) -> np.ndarray:
        """The units of a state, coordinates and then velocities, (2 n,)."""
        return np.concatenate([self.lengths, self.speeds])

    @cached_property
    def perturbation(self) -> np.ndarray:
        """The units of a perturbation of a state, (2 n,): in these the free oscillation of one
        coordinate is a circle, on which its length does not oscillate."""
        return np.concatenate([self.lengths, self.lengths / self.free_time])

    @property
    def powers_of_two(self) -> NaturalUnits:
        """These units rounded to the nearest powers of 2, so that scaling by them is exact."""
        lengths, masses = (np.exp2(np.round(np.log2(x))) for x in (self.lengths, self.masses))
        times = (self.time, self.own_time, self.free_time)
        time, own_time, free_time = map(_power_of_two, times)
        return NaturalUnits(
            lengths,
            time,
            masses,
            own_time,
            free_time,
            self.has_time,
            self.has_length,
            self.displacements,
        )


def natural_units(system: System) -> NaturalUnits:
    """The natural units of a system, in its own coordinates; they are found once.

    Parameters
    ----------
    system
        What moves: as it was given, or `in_gap_coordinates`, whose coordinates are others.
    """
    rate = 0.0 if system.load.frequency is None else float(system.load.frequency)
    found: NaturalUnits = system._remembered(natural_units, lambda: _found(system, rate))
    return found


def units_of_gaps(system: System) -> tuple[float, float]:
    """The natural units of lengths and speeds, of which rounding of gaps is a share; 0 where there
    are none."""
    units = natural_units(system)
    length = units.length if units.has_length else 0.0
    return length, length / units.time


def time_without_period(system: System) -> float:
    """The natural time of a system on which nothing acts with the frequency of its load, or that
    has none, 0 if the system itself has no time; inf where something does."""
    load = system.load
    if load.frequency is None:
        units = natural_units(system)
        return units.time if units.has_time else 0.0
    if any(signal.periodic for signal in load.channels.values()):
        return math.inf
    alone = replace(system, load=Load(frequency=None, **load.channels))
    model = system.model
    still = [0.0] * len(model.coordinates)
    declared = DeclaredLoad(alone.load, model)
    if _acceleration(model, 0.0, still, model.every_side[0], declared) is None:
        return math.inf  # the model reads the frequency itself
    return time_without_period(alone)


def slowest_own_time(system: System) -> float:
    """The time in which a system moves by itself where its load is slow without end; inf for what
    moves with its load alone."""
    load = system.load
    rate = 0.0 if load.frequency is None else float(load.frequency)
    if rate == 0.0:
        return natural_units(system).own_time
    own_time = _found(system, rate * SLOWER).own_time
    return own_time if own_time * rate * SLOWER < MOVED_BY_LOAD else math.inf


def _power_of_two(value: float) -> float:
    return math.ldexp(1.0, round(math.log2(value)))


def _found(system: System, rate: float) -> NaturalUnits:
    """The natural units, where the load goes on with this frequency in place of its own."""
    model = system.model
    load = DeclaredLoad(system.load, model)
    instants = instants_of(system.load)
    nearest: np.ndarray | None = None
    stiffest = 0.0
    quickest = 0.0
    moving = len(model.moving)
    push = np.zeros(len(model.coordinates))
    with np.errstate(all="ignore"):
        for place, outward in _places(model, load, instants):
            found = _held_away(model, load, place, outward, rate, instants)
            if found is None:
                continue
            stiffest = max(stiffest, found.stiffness)
            quickest = max(quickest, found.rate)
            # coordinates of first order have other units
            compared = slice(moving or None)
            near = np.linalg.norm(found.distance[compared])
            if near > 0.0 and (nearest is None or near < np.linalg.norm(nearest[compared])):
                nearest = found.distance
                push = found.acceleration
        # sums that follow from displacements are such, too
        of_own = len(push) - getattr(model, "dependent", 0)
        first_order = (np.arange(len(push)) >= moving) & (np.arange(len(push)) < of_own)
        angular = np.array([model.unit_of(name) in ANGLES for name in model.coordinates])
        angular &= np.arange(len(push)) < moving
        # a slow load leaves angles to move by themselves within a radian
        own_rate = math.sqrt(float(np.abs(push).max(where=angular, initial=0.0)))
        known = _time(
            max(rate, own_rate if rate > 0.0 else 0.0),
            None if nearest is None else nearest[:moving],
            push[:moving],
            stiffest,
        )
        time = known or 1.0
        if nearest is None:
            nearest = _other_length(system, load, time)
    largest = float(np.max(nearest[:moving], where=~angular[:moving], initial=0.0))
    lengths = np.where(first_order & (nearest > 0.0), nearest, largest)
    lengths = np.where(angular, 1.0, lengths)
    sound = np.isfinite(lengths) & (lengths > 0.0)
    own_time = min(time, 1.0 / quickest) if quickest > 0.0 and not angular.any() else time
    free_time = 1.0 / math.sqrt(stiffest) if stiffest > 0.0 else time
    lengths = np.where(sound, lengths, 1.0) * _scales(model)
    return NaturalUnits(
        lengths,
        time,
        _masses(model),
        own_time,
        free_time,
        known > 0.0,
        bool(sound.any()),
        _displacements(model),
    )


def _displacements(model: Any) -> int:
    """How many of the coordinates are no amplitudes of modes."""
    return int(getattr(model, "local_count", len(model.coordinates)))


def _scales(model: Any) -> np.ndarray:
    """The amplitude of each coordinate (n,) that counts as a displacement of 1: for a mode of mass 1
    the root of a mass, else 1."""
    scales = np.ones(len(model.coordinates))
    count = _displacements(model)
    if count < len(scales):
        scales[count:] = math.sqrt(float(_masses(model)[:count].mean()))
    return scales


def _places(model: Any, load: Any, instants: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The coordinates (n,) nearest to 0 at which one of its contacts or surfaces is reached; 0
    without any. And the direction (n,) in which the contact opens, 0 where both sides are free.

    A surface across which nothing changes is left out.
    """
    names = model.coordinates
    if model.has_one_contact:
        at = float(model.contact)
        beside = at + max(1.0, abs(at))
        opens = [np.sign(float(model.gap(beside, side))) for side in model.every_side]
        yield np.array([at]), np.array([opens[0] if len(set(opens)) == 1 else 0.0])
        return
    places = 0
    for part in (*model.contacts, *model.surfaces):
        if not _is_sum(part, names):
            continue
        terms = (
            {part.coordinate: 1.0} if isinstance(part.coordinate, str) else dict(part.coordinate)
        )
        row = np.array([float(terms.get(name, 0.0)) for name in names])
        place = row * (float(part.position) / float(row @ row))
        if isinstance(part, Surface) and _is_inert(model, place, load, instants):
            continue
        places += 1
        yield _held_equilibrium(model, load, place, row, instants), row * part.sign
    if not places:
        yield np.zeros(len(names)), np.zeros(len(names))


def _held_equilibrium(
    model: Any, load: Any, place: np.ndarray, row: np.ndarray, instants: np.ndarray
) -> np.ndarray:
    """The place (n,) at which a contact holds a system in equilibrium, on the plane of its sum
    through another place; that one where the other coordinates do not act linearly.

    Where the others are does not depend on the origin from which they are measured then.
    """
    count = len(model.moving)
    if count == 1 or not hasattr(model, "mass_matrix"):
        return place
    try:
        masses = np.array(mass_rows(model, tuple(place.tolist())), dtype=float)[:count, :count]
    except Exception:  # a user's own code may raise anything
        return place
    scales = _scales(model)[:count]
    # a reaction l along the sum: M (a + J dq) = l row, with row dq = 0
    scaled = masses * scales[:, None] * scales
    normal = row[:count] * scales

    def pushed(at: np.ndarray) -> np.ndarray | None:
        """M a in the mean over the instants."""
        pushes = []
        for t in instants:
            for beside in _on_both_sides(model, float(t), at, load):
                value = _acceleration(model, float(t), at.tolist(), model.every_side[0], beside)
                if value is None:
                    return None
                pushes.append(value[:count] / scales)
        return np.asarray(scaled @ np.mean(pushes, axis=0))

    size = float(np.linalg.norm(normal))
    if not size > 0.0:
        return place
    along = normal / size
    held = place.copy()
    push = pushed(held)
    begun = 0.0 if push is None else float(np.linalg.norm(push - along * (along @ push)))
    for _ in range(MOST_STEPS):  # surfaces make it linear in parts
        slopes = _slopes_beside(model, held, load)[0][:count, :count]
        stiffness = scaled @ (slopes * scales / scales[:, None])
        if push is None or not (np.isfinite(push).all() and np.isfinite(stiffness).all()):
            return place
        border = along * (float(np.abs(stiffness).max(initial=0.0)) or 1.0)
        matrix = np.block([[stiffness, -border[:, None]], [border[None], np.zeros((1, 1))]])
        try:
            solution = np.linalg.lstsq(matrix, -np.append(push, 0.0), rcond=ROUNDING)[0]
        except np.linalg.LinAlgError:  # numbers whose squares overflow
            return place
        held[:count] += solution[:count] * scales
        if np.count_nonzero(row) == 1:  # on a surface to the last digit
            held = np.where(row != 0.0, place, held)
        push = pushed(held)
        if push is None:
            return place
        if np.linalg.norm(push - along * (along @ push)) <= SOLVED * begun:
            return held
    return place


def _is_sum(part: Any, names: tuple[str, ...]) -> bool:
    """Whether a contact or a surface is of a sum of coordinates, and of ground displacements."""
    if part.coordinate is None:
        return False
    terms = [part.coordinate] if isinstance(part.coordinate, str) else list(part.coordinate)
    return any(name in names for name in terms) and all(
        name in names or name.startswith("ground") for name in terms
    )


def instants_of(load: Load) -> np.ndarray:
    """Instants over a period of a load; over the longest of its records and pulses without one."""
    span = load.period
    if span is None:
        span = 0.0
        for signal in load.channels.values():
            for term in getattr(signal, "terms", (signal,)):
                if term.once:
                    times = np.ravel(getattr(term, "time", 0.0))
                    end = getattr(term, "settled", 0.0)
                    span = max(span, float(times[-1]), float(end))
    return np.arange(INSTANTS) * (span / INSTANTS) if span > 0.0 else np.zeros(1)


class Held(NamedTuple):
    """What holds a system away from its equilibrium at a place."""

    distance: np.ndarray  # d, (n,)
    acceleration: np.ndarray  # a in the mean of squares over a period, (n,)
    stiffness: float  # the largest one there
    rate: float  # sqrt(a / d) of all that acts


def _held_away(
    model: Any,
    load: Any,
    place: np.ndarray,
    outward: np.ndarray,
    rate: float,
    instants: np.ndarray,
) -> Held | None:
    """d and a of the docstring of `NaturalUnits` at a place; None where the model has no
    accelerations.
    """
    pushes = []
    scales = _scales(model)
    for t in instants:
        for beside in _on_both_sides(model, float(t), place, load):
            for side in model.every_side:
                value = _acceleration(model, float(t), place.tolist(), side, beside)
                if value is not None:
                    pushes.append(value / scales)
    if not pushes:
        return None
    moving = len(model.moving)
    accelerations = np.array(pushes)[:, :moving]
    moved = np.zeros_like(accelerations)
    stiffness = 0.0
    softest, *_ = all_slopes = _slopes_beside(model, place, load)
    for slopes in all_slopes:
        own = (slopes * scales / scales[:, None])[:moving, :moving]
        left, sizes, right = np.linalg.svd(own)
        # bodies that nothing holds have a stiffness of rounding, which would put them infinitely far
        sizes = np.where(sizes > ROUNDING * sizes.max(initial=0.0), sizes, 0.0)
        stiffness = max(stiffness, float(sizes.max(initial=0.0)))
        shares = np.maximum(sizes, rate**2)
        along = accelerations @ left
        along = np.divide(along, shares, out=np.zeros_like(along), where=shares > 0.0) @ right
        # the softer side of a stop is the one through which a system moves, in its mirror image too
        if np.linalg.norm(along) > np.linalg.norm(moved):
            moved = along
            softest = slopes
    distance = _mean(moved)
    acceleration = _mean(np.array(pushes))
    squared = float(np.linalg.norm(acceleration[:moving])) / max(
        float(np.linalg.norm(distance)), TINY
    )
    swing = SWING * _mean(moved - moved.mean(axis=0))
    # a contact from which all is pulled away may be any distance away
    away = float(outward @ np.mean(pushes, axis=0)) > 0.0
    swings = np.linalg.norm(swing) > (TOLD if away else FARTHEST) * np.linalg.norm(distance)
    following = _following(softest, moved, np.array(pushes)[:, moving:], rate)
    if swings:
        distance = swing
        following = following - following.mean(axis=0)
    behind = (SWING if swings else 1.0) * _mean(following)
    if not moving:  # their rates are squared, as those of oscillations are
        stiffness = float(np.abs(np.diag(softest)).max()) ** 2
    return Held(np.append(distance, behind), acceleration, stiffness, math.sqrt(squared))


def _following(
    slopes: np.ndarray, moved: np.ndarray, rates: np.ndarray, frequency: float
) -> np.ndarray:
    """How far the coordinates of first order are moved at each instant (..., n), by what acts on
    them and by the others, which are `moved`; 0 where that is rounding.

    Each has a unit of its own, so that no size of several of them is taken.
    """
    first = moved.shape[1]
    own = np.diag(slopes)[first:]
    beside = slopes[first:, first:] - np.diag(own)
    speeds = np.maximum(np.abs(own), frequency)
    driven = rates - moved @ slopes[first:, :first].T
    size = np.abs(rates) + np.abs(moved) @ np.abs(slopes[first:, :first]).T
    found = np.zeros_like(driven)
    terms = np.zeros_like(driven)
    for _ in own:  # one may drive another one
        found = -np.divide(driven - found @ beside.T, speeds, out=found * 0.0, where=speeds > 0.0)
        terms = np.divide(
            size + terms @ np.abs(beside).T, speeds, out=terms * 0.0, where=speeds > 0.0
        )
    return np.where(np.abs(found) > ROUNDING * terms, found, 0.0)


def _masses(model: Any) -> np.ndarray:
    """The entries of the mass matrix, (n,), where all coordinates are 0."""
    size = len(model.coordinates)
    if not hasattr(model, "mass_matrix"):
        return np.ones(size)
    try:
        rows = mass_rows(model, 0.0 if size == 1 else (0.0,) * size)
        masses = np.abs([float(rows[i][i]) for i in range(size)])
    except Exception:  # a user's own code may raise anything
        return np.ones(size)
    return np.where(np.isfinite(masses) & (masses > 0.0), masses, 1.0)


def _mean(values: np.ndarray) -> np.ndarray:
    """The root of the mean squares over the first axis."""
    largest = float(np.abs(values).max(initial=0.0))
    return np.asarray(largest * np.sqrt(((values / (largest or 1.0)) ** 2).mean(axis=0)))


def _on_both_sides(model: Any, t: float, place: np.ndarray, load: Any) -> list[Any]:
    """The load with the sides of the surfaces at a place; twice, as the place may lie on one of
    them.
    """
    if not model.surfaces:
        return [load]
    q = float(place[0]) if len(place) == 1 else tuple(place.tolist())
    try:
        still = 0.0 if len(place) == 1 else (0.0,) * len(place)
        both = [sides_for(model, t, q, still, load, below)[0] for below in (False, True)]
    except Exception:  # a user's own code may raise anything
        return [load]
    return [LoadOnSides(load, sides) for sides in both]


def _slopes_beside(model: Any, place: np.ndarray, load: Any) -> list[np.ndarray]:
    """The slopes at a place, on each side of a surface that it lies on."""
    return [
        _slopes(model, place, model.every_side[0], beside)
        for beside in _on_both_sides(model, 0.0, place, load)
    ]


def _is_inert(model: Any, place: np.ndarray, load: Any, instants: np.ndarray) -> bool:
    """Whether nothing changes across the surface on which a place lies, at rest."""
    slopes = _slopes_beside(model, place, load)
    if not (slopes[0] == slopes[-1]).all():
        return False
    for t in instants:
        above, *below = (
            _acceleration(model, float(t), place.tolist(), model.every_side[0], beside)
            for beside in _on_both_sides(model, float(t), place, load)
        )
        if above is None or any(push is None or (push != above).any() for push in below):
            return False
    return True


def _acceleration(model: Any, t: float, q: list[Any], side: int, load: Any) -> np.ndarray | None:
    """The accelerations at rest (n,), without contacts and frictions; None where there are none."""
    try:
        single = len(q) == 1
        still = [0.0] * len(q)
        value = model.acceleration(
            t, q[0] if single else tuple(q), 0.0 if single else tuple(still), side, load
        )
        numbers = np.array([float(x) for x in each_of(value)])
    except Exception:  # a user's own code may raise anything
        return None
    return numbers if len(numbers) == len(q) and np.isfinite(numbers).all() else None


def _slopes(model: Any, place: np.ndarray, side: int, load: Any) -> np.ndarray:
    """J = da/dq at rest, (n, n), 0 where it is not known."""
    size = len(place)
    still = 0.0 if size == 1 else (0.0,) * size
    # all columns at once, or those of many coordinates would take seconds
    q = [Jet(x, row) for x, row in zip(place.tolist(), np.eye(size), strict=True)]
    slopes = np.zeros((size, size))
    try:
        value = model.acceleration(0.0, q[0] if size == 1 else tuple(q), still, side, load)
        for i, x in enumerate(each_of(value)):
            if isinstance(x, Jet):
                slopes[i] = x.first
    except Exception:  # a user's own code may raise anything
        return np.zeros((size, size))
    return np.where(np.isfinite(slopes), slopes, 0.0)


def _time(rate: float, distance: np.ndarray | None, push: np.ndarray, stiffness: float) -> float:
    """The unit of time, from the load, a distance and its acceleration, or a stiffness; 0 without
    any of them."""
    if rate > 0.0:
        return 1.0 / rate
    squared = 1.0 / stiffness if stiffness > 0.0 else 0.0
    if distance is not None and push.any():
        squared = float(np.linalg.norm(distance) / np.linalg.norm(push))
    time = math.sqrt(squared)
    return time if 0.0 < time < math.inf else 0.0


def _other_length(system: System, load: Any, time: float) -> np.ndarray:
    """A length (n,) of a system that nothing holds away from its equilibrium; 0 if it has none."""
    model = system.model
    still = np.zeros(len(model.coordinates))
    lengths = list[float]()
    try:
        pressed: Any = still.tolist() if len(still) > 1 else 0.0
        normals = normal_forces(model, 0.0, pressed, pressed, load)
        holding = [
            abs(float(friction.kinetic) * float(normal))
            for friction, normal in zip(model.frictions, normals, strict=True)
        ]
        lengths.append(max(holding, default=0.0) * time**2)
    except Exception:  # a user's own code may raise anything
        lengths.clear()
    lengths.append(
        min((abs(float(c.position)) for c in model.contacts if float(c.position)), default=0.0)
    )
    lengths.append(max((abs(float(f.ground_speed)) * time for f in model.frictions), default=0.0))
    known = [length for length in lengths if 0.0 < length < math.inf]
    return np.full(len(still), known[0] if known else 0.0)
