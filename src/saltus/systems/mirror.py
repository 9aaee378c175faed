"""The mirror symmetry of a system: declared by its model and checked, or found from its
equations.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from saltus.errors import ParameterError, SaltusError
from saltus.systems.contracts.contact_model import (
    ContactModel,
    mass_and_force,
    mass_rows,
    normal_forces,
)
from saltus.systems.contracts.model import IMAGE_ROUNDING, Model
from saltus.systems.gap_coordinates import InGapCoordinates
from saltus.systems.gap_places import placed, terms_of
from saltus.systems.loads.load import DeclaredLoad, Load
from saltus.systems.loads.repeating import Repeating
from saltus.systems.loads.signals import Constant, Harmonic, Signal, Sum, scaled
from saltus.systems.system_units import natural_units

if TYPE_CHECKING:
    from saltus.systems.system import System

# Coordinates that a mirror image may swap are looked for among all pairings up to this number; of
# more, the pairing of the first with the last one, of the second with the last but one, ... is
# tried alone.
MOST_PAIRED = 5
PROBES = 128  # states at which the equations of an image are compared
# An arbitrary time, gap and velocity, at which a declared mirror is tested, and the relative
# differences that rounding may make there.
PROBE = (0.3711, 0.2931, 0.6173)
DECLARED_ROUNDING = 1e-9
DECADES = 6.0  # their sizes lie so many powers of ten below and above the natural units
# Distances from a mirror's centre are looked at down to so many powers of ten below its value.
DIGITS = 4.0
ROUNDED_BY = 2.0**-49  # relative changes of places by which their rounding is known
# Parts of half a period at which walls that move are compared with their images, and of each piece
# between corners of the load: no harmonic has one value at all of them.
INSTANTS = 0.5 * (np.arange(8) * math.sqrt(2.0) % 1.0)
OF_PIECES = np.array([0.2, 0.5, 0.83])
INDEPENDENT = 1e-9  # parts whose directions differ by less have one direction
NEWTON_STEPS = 30  # most steps in which a mirror's centre is found
NEWTON_SHARE = 1e-4  # of a length, by which its derivatives are differences


@dataclass(frozen=True, eq=False)
class Mirror:
    """A mirror symmetry, under which c + R (q(t) - c) is a motion under the load `load` wherever
    q(t) is one of the system.

    In the coordinates of a model, R is the negative of a swap of some of them. Where gaps between
    bodies are coordinates, it is any matrix: the gap between two bodies that are swapped stays.

    Attributes
    ----------
    load
        The load of the mirror image.
    turn
        The matrix R, (coordinates, coordinates).
    parts
        The number of the image of each contact, then of each friction, then of each surface.
    centre
        The mirror's centre c, a value of each coordinate, with R c = -c.
    """

    load: Load
    turn: np.ndarray
    parts: tuple[int, ...]
    centre: tuple[float, ...]

    @property
    def is_about_origin(self) -> bool:
        """Whether the centre is at 0 in all coordinates."""
        return not any(self.centre)

    @property
    def middle(self) -> float | None:
        """The centre of all coordinates; None where they have different ones, or where an image is
        not the negative of one coordinate."""
        if len(set(self.centre)) > 1 or not is_swap(-self.turn):
            return None
        return self.centre[0]

    def of(self, states: np.ndarray) -> np.ndarray:
        """The images of states (..., 2 coordinates), coordinates and then velocities.

        Parameters
        ----------
        states
            The states.
        """
        images = self.turned(states)
        if not self.is_about_origin:
            images[..., : len(self.centre)] += 2.0 * np.array(self.centre)
        return images

    def turned(self, directions: np.ndarray) -> np.ndarray:
        """The images of differences of states (..., 2 coordinates).

        Parameters
        ----------
        directions
            The differences.
        """
        n = len(self.centre)
        halves = (directions[..., :n], directions[..., n:])
        return np.concatenate([half @ self.turn.T for half in halves], axis=-1)

    @cached_property
    def turn_of_state(self) -> np.ndarray:
        """R of coordinates and of velocities, (2 coordinates, 2 coordinates)."""
        return np.kron(np.eye(2), self.turn)


def is_swap(matrix: np.ndarray) -> bool:
    """Whether a matrix of 0 and 1 swaps numbers.

    Parameters
    ----------
    matrix
        The matrix, (n, n).
    """
    ones = matrix == 1.0
    return bool(
        (ones | (matrix == 0.0)).all() and (ones.sum(axis=0) == 1).all() and (ones == ones.T).all()
    )


@dataclass(frozen=True)
class _Swap:
    """A mirror symmetry in the coordinates of a model, 2 c - q(t) with some coordinates of q
    swapped: for each coordinate of an image, the index of the original one whose negative it is.
    """

    load: Load
    places: tuple[int, ...]
    parts: tuple[int, ...]
    centre: tuple[float, ...]

    def mirror(self) -> Mirror:
        """The same as a matrix."""
        turn = 0.0 - np.eye(len(self.places))[list(self.places)]
        return Mirror(self.load, turn, self.parts, self.centre)


def mirror_of(system: System) -> Mirror | None:
    """The mirror symmetry of a system, in its own coordinates; None without one. It is found once.

    A model may declare it (`Model.mirror`), about 0; else it is looked for, about any centre:
    contacts, frictions and surfaces must be images of one another, and the equations must be those
    of the image at many states of all sizes.

    Parameters
    ----------
    system
        What moves: as it was given, or `in_gap_coordinates`.

    Raises
    ------
    ParameterError
        A `mirror` of the model that is no such symmetry, as a test at one state shows.
    """
    found: Mirror | None = system._remembered(mirror_of, lambda: _mirror_of(system))
    return found


def _mirror_of(system: System) -> Mirror | None:
    model = system.model
    if isinstance(model, InGapCoordinates):
        own = system.with_(model=model.as_given())
        swap = _swap_of(own)
        return None if swap is None else _in_gaps(own, swap)
    swap = _swap_of(system)
    return None if swap is None else swap.mirror()


def middle_of(system: System) -> float | None:
    """The mirror's centre of all coordinates; None without one, or where they have different ones.

    Parameters
    ----------
    system
        What moves.
    """
    mirror = mirror_of(system)
    return None if mirror is None else mirror.middle


def image_of(system: System, states: np.ndarray) -> np.ndarray:
    """The mirror images of states (..., 2 coordinates) of a system that has the symmetry.

    Parameters
    ----------
    system
        The system.
    states
        Coordinates, and then velocities.
    """
    mirror = mirror_of(system)
    assert mirror is not None, "a system without mirror symmetry has no images"
    return mirror.of(states)


def is_its_image_later(system: System) -> bool:
    """Whether the image of every motion, half a forcing period later, is a motion under the same
    load, by the equations alone. Whether the loads are alike is for the caller to ask.

    Parameters
    ----------
    system
        What moves, with a mirror symmetry and under a load with a frequency.
    """
    swap = _swap_of(system)
    period = system.load.period
    assert swap is not None, "asked for a system with the symmetry alone"
    assert period is not None, "asked for a load with a frequency alone"
    parts = _images_of_parts(system, swap.places, system.load, swap.centre, 0.5 * period)
    if parts != swap.parts or declares_mirror(system.model):
        return parts == swap.parts
    return _moves_as_image(system, replace(swap, load=system.load), 0.5 * period)


def has_half_the_period(system: System) -> bool:
    """Whether the equations repeat themselves after half a forcing period, as under a load that
    acts through its square: what the load's frequency calls a period then is two.

    Parameters
    ----------
    system
        What moves.
    """
    period = system.load.period
    if period is None:
        return False
    inner = system.in_gap_coordinates
    model: Any = inner.model
    load = DeclaredLoad(inner.load, model)
    units = natural_units(inner)
    random = np.random.default_rng(4)
    n = len(model.coordinates)
    t = random.uniform(size=PROBES) * period
    q = random.normal(size=(n, PROBES)) * units.lengths[:, None]
    v = random.normal(size=(n, PROBES)) * units.speeds[:, None]
    frictions = len(model.frictions)
    try:
        with np.errstate(all="ignore"):
            for side in model.every_side:
                values = [
                    np.concatenate(
                        [
                            _rows(model.acceleration(time, _of(q), _of(v), side, load), n),
                            _rows(normal_forces(model, time, _of(q), _of(v), load), frictions),
                        ]
                    )
                    for time in (t, t + 0.5 * period)
                ]
                if not _alike(*values):
                    return False
    except (SaltusError, ArithmeticError, TypeError, ValueError, IndexError):
        return False
    return True


def _swap_of(system: System) -> _Swap | None:
    """The symmetry of a system in its own coordinates; it is found once."""

    def look() -> _Swap | None:
        found = _swap_found(system)
        walls_move = getattr(system.in_gap_coordinates.model, "has_moving_walls", False)
        if found is not None and walls_move and _in_gaps(system, found) is None:
            return None
        return found

    found: _Swap | None = system._remembered(_swap_of, look)
    return found


def _swap_found(system: System) -> _Swap | None:
    model = system.model
    if model.has_multipliers:  # images of distances and rates are not known
        return None
    if getattr(system.in_gap_coordinates.model, "is_nonlinear", False):
        return None  # nor those of functions of coordinates
    origin = (0.0,) * len(model.coordinates)
    if declares_mirror(model):
        load = model.mirror(system.load)
        if load is None:
            return None
        places = tuple(model.coordinates.index(name) for name in model.images)
        parts = _images_of_parts(system, places, load, origin)
        if parts is None:
            return None
        mirrored = system.with_(load=load)
        for side in model.every_side:
            _check_declared(system, mirrored, side)
        swap = _Swap(load, places, parts, origin)
        is_simple = not (model.surfaces or (isinstance(model, ContactModel) and model.jumps))
        return swap if is_simple or _moves_as_image(system, swap) else None
    for places in _pairings(model):
        for load in _loads(system.load):
            for centre in _centres(system, places, load):
                parts = _images_of_parts(system, places, load, centre)
                if parts is None:
                    continue
                swap = _Swap(load, places, parts, centre)
                if _moves_as_image(system, swap):
                    return swap
    return None


def _in_gaps(own: System, swap: _Swap) -> Mirror | None:
    """The symmetry of a system in the coordinates of its gaps, z = A q + m(t), from that in its own
    ones: R = -A P A^-1.

    Where m moves, it does so as its image: 2 c in z is A (2 c + P A^-1 m) + m' at all times. None
    where that changes, as between two walls of one coordinate that move towards each other.
    """
    model: Any = own.in_gap_coordinates.model
    mirror = swap.mirror()
    sums = np.array(model.gap_sums()[0])
    turned = sums @ mirror.turn  # of the own coordinates
    n = len(mirror.centre)
    if is_swap(-mirror.turn) and swap.places == tuple(range(n)):
        turn = 0.0 - np.eye(len(sums))  # what follows from others turns with them
    else:
        turn = np.zeros((len(sums), len(sums)))
        turn[:, :n] = turned @ np.linalg.inv(sums[:n])
        whole = np.rint(turn)
        turn = np.where(np.abs(turn - whole) <= IMAGE_ROUNDING, whole, turn)
    walls, images = (_walls(model, load, own) for load in (own.load, swap.load))
    twice = (2.0 * sums @ np.array(mirror.centre))[:, None] - turn @ walls + images
    centre = 0.5 * twice.mean(axis=1)
    size = np.abs(twice).max(axis=1) + np.abs(walls).max(axis=1)
    lengths = natural_units(own.in_gap_coordinates).lengths
    if (np.ptp(twice, axis=1) > IMAGE_ROUNDING * (lengths + size)).any():
        return None
    centre = np.where(np.abs(centre) <= IMAGE_ROUNDING * (lengths + size), 0.0, centre)
    return Mirror(swap.load, turn, swap.parts, tuple(centre.tolist()))


def _walls(model: Any, load: Load, own: System) -> np.ndarray:
    """m at some times over a period, (sums, times); half a period later it is at others of them."""
    declared = DeclaredLoad(load, own.model)
    columns = [model.walls_at(time, declared) for time in _instants(own).tolist()]
    return np.array(columns, dtype=float).T


def _instants(system: System) -> np.ndarray:
    """Times over a forcing period, or over natural times without one."""
    period = system.load.period
    span = natural_units(system).time if period is None else period
    corners = np.unique([0.0, *system.load.corners, 1.0])
    within = corners[:-1, None] + np.diff(corners)[:, None] * OF_PIECES
    return span * np.concatenate([INSTANTS, INSTANTS + 0.5, within.ravel()])


def declares_mirror(model: Model) -> bool:
    """Whether the class of a model has its own `mirror`.

    Parameters
    ----------
    model
        The model.
    """
    return bool(getattr(model, "own_class", type(model)).mirror is not Model.mirror)


def _pairings(model: Model) -> Iterator[tuple[int, ...]]:
    """Ways to swap coordinates, those that swap fewer first; those of first order are swapped
    among themselves."""
    n = len(model.coordinates)
    moving = len(model.moving)
    identity = tuple(range(n))
    yield identity
    if n > MOST_PAIRED:
        yield (*reversed(range(moving)), *reversed(range(moving, n)))
        return
    pairings = (
        places
        for places in itertools.permutations(range(n))
        if places != identity
        and all(places[places[i]] == i for i in range(n))
        and all((places[i] < moving) == (i < moving) for i in range(n))
    )
    yield from sorted(pairings, key=lambda places: sum(i != j for i, j in enumerate(places)))


def _loads(load: Load) -> Iterator[Load]:
    """Loads under which an image may move: the load half a period later, then each channel
    reversed unless it is the same half a period later, then all channels reversed."""
    later = {name: _half_a_period_later(signal) for name, signal in load.channels.items()}
    reversed_ = {name: scaled(signal, -1.0) for name, signal in load.channels.items()}
    kept = {
        name: signal if _has_even_orders_alone(signal) else reversed_[name]
        for name, signal in load.channels.items()
    }
    tried = list[dict[str, Signal]]()
    for signals in (later, kept, reversed_):
        if signals not in tried:
            tried.append(signals)
            yield Load(frequency=load.frequency, **signals)


def _has_even_orders_alone(signal: Signal) -> bool:
    if isinstance(signal, Constant):
        return True
    if isinstance(signal, Harmonic):
        return signal.order % 2 == 0 or not signal.amplitude
    terms = getattr(signal, "terms", ())
    return bool(terms) and all(_has_even_orders_alone(term) for term in terms)


def _half_a_period_later(signal: Signal) -> Signal:
    """The signal half a period later; signals that do not repeat themselves are reversed."""
    if isinstance(signal, Constant):
        return signal
    if isinstance(signal, Harmonic):
        return replace(signal, amplitude=(-1.0) ** signal.order * signal.amplitude)
    if isinstance(signal, Sum):
        return Sum(tuple(_half_a_period_later(term) for term in signal.terms))
    if isinstance(signal, Repeating):
        return signal.half_a_period_later()
    return scaled(signal, -1.0)


# --- the centre --------------------------------------------------------------


def _centres(system: System, places: tuple[int, ...], load: Load) -> Iterator[tuple[float, ...]]:
    """Centres about which a system may be its image: 0, then the middle of contacts and surfaces,
    and where these leave it open, the place where the forces are those of the image.
    """
    model: Any = system.model
    n = len(model.coordinates)
    origin = (0.0,) * n
    yield origin
    if model.has_one_contact:
        if float(model.contact):
            yield (float(model.contact),)
        return
    lengths = natural_units(system).lengths
    centre, free = _middle_of_parts(system, places, load, lengths)
    # parts have their middle as centre, whatever that of the others is, which takes long to find
    if _images_of_parts(system, places, load, tuple(centre.tolist())) is None:
        return
    if len(free):
        balanced = _balanced(system, places, load, centre, NEWTON_SHARE * free)
        if balanced is None:
            return
        centre = balanced
    centre = np.where(np.abs(centre) < IMAGE_ROUNDING * lengths, 0.0, centre)
    found = tuple(float(value) for value in centre)
    if found != origin:
        yield found


def _middle_of_parts(
    system: System, places: tuple[int, ...], load: Load, lengths: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A centre in the middle of all contacts, and surfaces, and of their images, (n,), and the
    directions in which they leave it open, (directions, n), in natural units.

    The plane u q = p of a part has the image (u P) q = 2 u c - p. The mean of all planes of one
    direction is that of their images.
    """
    order = list(places)
    n = len(order)
    # coordinates that are swapped have one centre
    directions = np.zeros((n, n))
    for i in range(n):
        directions[i, [i, order[i]]] = lengths[i]
    directions = directions[[i for i in range(n) if i <= order[i]]]
    model: Any = system.model
    equations = list[np.ndarray]()
    values = list[float]()
    for parts in (model.contacts, placed(model.surfaces)):
        planes = [_Plane.of(part, system, load) for part in parts]
        for plane in planes:
            alike, images = (
                [(other, factor) for other in planes if (factor := other.along(row)) is not None]
                for row in (plane.row, plane.row[order])
            )
            if not images:
                continue
            here = np.mean([factor * (other.position - other.image) for other, factor in alike])
            there = np.mean([factor * (other.position - other.wall) for other, factor in images])
            equations.append(2.0 * directions @ plane.row)
            values.append(float(here + there))
    if not equations:
        return np.zeros(n), directions
    matrix = np.array(equations)
    scale = np.linalg.norm(matrix, axis=1)
    used = np.abs(matrix).max(axis=0) > 0.0
    known = scale > 0.0  # a gap between two that are swapped stays, wherever the centre is
    matrix = matrix[known][:, used] / scale[known, None]
    shares = np.zeros(len(directions))
    if not used.any():
        return np.zeros(n), directions
    left, sizes, right = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(sizes > INDEPENDENT * sizes[0]))
    scaled = left[:, :rank].T @ (np.array(values)[known] / scale[known])
    shares[used] = right[:rank].T @ (scaled / sizes[:rank])
    open_ = np.concatenate([right[rank:] @ directions[used], directions[~used]])
    return shares @ directions, open_


@dataclass(frozen=True)
class _Plane:
    """The plane of a part, row q + m(t) = position."""

    row: np.ndarray
    lengths: np.ndarray  # of the coordinates, by which the entries of rows can be compared
    position: float
    walls: np.ndarray  # m at some times of a period
    images: np.ndarray  # m of the image's load, at times that may be later

    @classmethod
    def of(cls, part: Any, system: System, load: Load, later: float = 0.0) -> Self:
        """That of a contact or surface, or with the position 0 of a friction."""
        names = system.model.coordinates
        row = np.zeros(len(names))
        times = _instants(system)
        walls, images = np.zeros((2, len(times)))
        for name, factor in terms_of(part).items():
            if name in names:
                row[names.index(name)] = float(factor)
                continue
            for moved, signals, at in ((walls, system.load, times), (images, load, times + later)):
                channel = getattr(DeclaredLoad(signals, system.model), name)
                moved += float(factor) * np.array([float(channel(t)) for t in at.tolist()])
        position = float(getattr(part, "position", 0.0))
        return cls(row, natural_units(system).lengths, position, walls, images)

    @property
    def wall(self) -> float:
        """The mean of m."""
        return float(self.walls.mean())

    @property
    def image(self) -> float:
        """The mean of m of the image's load."""
        return float(self.images.mean())

    def is_in_image(
        self, other: _Plane, factor: float, centre: np.ndarray, is_placed: bool
    ) -> bool:
        """Whether 2 c - P q is on this plane under the image's load where q is on the other one,
        of whose sum -P q's sum here is the `factor`; of planes that are not placed, whether both
        move alike.
        """
        apart = self.images - factor * other.walls
        size = float(np.abs(self.images).max() + np.abs(factor * other.walls).max())
        if is_placed:
            position = self.position - factor * other.position
            apart = apart + 2.0 * float(self.row @ centre) - position
            size += abs(self.position) + abs(factor * other.position)
            size += 2.0 * float(np.abs(self.row) @ np.abs(centre))
        else:
            apart = apart - apart.mean()
        size += IMAGE_ROUNDING * float(np.abs(self.row) @ self.lengths)
        return bool(np.abs(apart).max() <= IMAGE_ROUNDING * size)

    def along(self, row: np.ndarray) -> float | None:
        """The factor of this plane's row that another row is; None where it is in another
        direction."""
        own = self.lengths * self.row
        other = self.lengths * row
        size = float(own @ own)
        if not size:
            return None
        factor = float(other @ own) / size
        apart = np.abs(other - factor * own).max()
        return factor if factor and apart <= IMAGE_ROUNDING * np.abs(other).max() else None


def _balanced(
    system: System, places: tuple[int, ...], load: Load, centre: np.ndarray, steps: np.ndarray
) -> np.ndarray | None:
    """A centre about which the forces of images are images of the forces, by Newton's method along
    `steps`, (steps, n); None where they cannot be evaluated."""
    model: Any = system.model
    n = len(places)
    units = natural_units(system)
    random = np.random.default_rng(3)
    period = system.load.period
    t = random.uniform(size=PROBES) * (units.time if period is None else period)
    q = random.normal(size=(n, PROBES)) * units.lengths[:, None]
    v = random.normal(size=(n, PROBES)) * units.speeds[:, None]
    own, turned = (DeclaredLoad(one, model) for one in (system.load, load))
    order = list(places)

    def unbalanced(middle: np.ndarray) -> np.ndarray:
        at = middle[:, None]
        force = _rows(model.acceleration(t, _of(at + q), _of(v), 1, own), n)
        image = _rows(model.acceleration(t, _of(at - q[order]), _of(-v[order]), 1, turned), n)
        return np.asarray(force[order] + image)

    try:
        with np.errstate(all="ignore"):
            last = math.inf
            for _ in range(NEWTON_STEPS):
                residual = unbalanced(centre).ravel()
                slopes = np.array([unbalanced(centre + step).ravel() - residual for step in steps])
                size = np.linalg.norm(slopes, axis=1)
                if not (np.isfinite(slopes).all() and np.isfinite(residual).all()):
                    return None
                # what no force depends on stays where it is
                moved = np.linalg.lstsq(slopes.T, -residual, rcond=IMAGE_ROUNDING)[0]
                moved = np.where(size > 0.0, moved, 0.0)
                centre = centre + moved @ steps
                largest = float(np.abs(moved).max(initial=0.0)) * NEWTON_SHARE
                if largest < IMAGE_ROUNDING and largest >= 0.5 * last:
                    break  # only rounding moves it
                last = largest
    # What cannot be evaluated at arrays, or is refused, has no symmetry that could be known.
    except (SaltusError, ArithmeticError, TypeError, ValueError, IndexError):
        return None
    return centre if np.isfinite(centre).all() else None


# --- contacts, frictions and surfaces ----------------------------------------


def _images_of_parts(
    system: System,
    places: tuple[int, ...],
    load: Load,
    centre: tuple[float, ...],
    later: float = 0.0,
) -> tuple[int, ...] | None:
    """The number of the mirror image, a time `later`, of each contact, friction and surface; None
    if one has no image or the laws differ."""
    model: Any = system.model
    if not (model.contacts or model.frictions or model.surfaces):
        return ()
    if any(surface.function is not None for surface in model.surfaces):
        return None  # images of functions are not looked for, nor those of relays
    if model.resets:
        return None  # nor those of resets
    order = list(places)
    middle = np.array(centre)

    def same(a: Any, b: Any, size: float) -> bool:
        rounding = IMAGE_ROUNDING * (abs(float(a)) + abs(float(b)) + IMAGE_ROUNDING * size)
        return abs(float(a) - float(b)) <= rounding

    def images_of(
        parts: Any, is_image: Callable[[Any, Any, float], bool], is_placed: bool = True
    ) -> list[int] | None:
        """Each of the parts has another image, on whose sum it depends by a factor that `is_image`
        is told; its plane is that of the image, or moves as that does."""
        planes = [_Plane.of(part, system, load, later) for part in parts]
        found = list[int]()
        for part, plane in zip(parts, planes, strict=True):
            alike = (
                number
                for number, (other, image) in enumerate(zip(parts, planes, strict=True))
                if number not in found
                and (factor := image.along(-plane.row[order])) is not None
                and plane.is_in_image(image, factor, middle, is_placed)
                and is_image(part, other, factor)
            )
            number = next(alike, None)
            if number is None:
                return None
            found.append(number)
        return found

    def is_image_of_contact(one: Any, other: Any, factor: float) -> bool:
        return bool(one.sign * factor * other.sign > 0.0)

    def is_image_of_surface(one: Any, other: Any, factor: float) -> bool:
        return True

    contacts = images_of(model.contacts, is_image_of_contact)
    surfaces = images_of(model.surfaces, is_image_of_surface)
    if contacts is None or surfaces is None:
        return None
    speed = natural_units(system).speed
    contact_names = [contact.name for contact in model.contacts]
    pressing = model.contacts if model.frictions else ()
    rows = [_Plane.of(contact, system, load).row for contact in pressing]
    sizes = [float(np.linalg.norm(row)) for row in rows]

    def is_image_of_friction(one: Any, other: Any, factor: float) -> bool:
        pressed = [
            contact_names.index(friction.contact) if friction.contact else None
            for friction in (one, other)
        ]
        image = None if pressed[0] is None else contacts[pressed[0]]
        stribeck = [friction.stribeck_speed for friction in (one, other)]
        # the reaction of an image on a sum with another factor is another one
        numbers = () if image is None or pressed[0] is None else (pressed[0], image)
        pressed_by = sizes[numbers[0]] / sizes[numbers[1]] if numbers else 1.0
        return (
            image == pressed[1]
            and same(abs(factor), 1.0, 0.0)
            and same(one.kinetic, pressed_by * other.kinetic, 0.0)
            and same(one.most, pressed_by * other.most, 0.0)
            and same(factor * one.ground_speed, other.ground_speed, speed)
            and (stribeck[0] is None) == (stribeck[1] is None)
            and (stribeck[0] is None or same(stribeck[0], stribeck[1], 0.0))
        )

    frictions = images_of(model.frictions, is_image_of_friction, is_placed=False)
    if frictions is None:
        return None
    count = len(contacts)
    if count:
        law = np.array(system.impact.restitution_matrix(model), dtype=float).reshape(count, count)
        if not np.allclose(law, law[np.ix_(contacts, contacts)], rtol=IMAGE_ROUNDING, atol=0.0):
            return None
    later = count + len(frictions)
    return (*contacts, *(count + i for i in frictions), *(later + i for i in surfaces))


# --- equations ---------------------------------------------------------------


def _moves_as_image(system: System, mirror: _Swap, later: float = 0.0) -> bool:
    """Whether the equations at images of states, a time `later`, are the images of those at the
    states, at many states of all sizes."""
    try:
        model = system.model
        twin = system.with_(load=mirror.load)
        model.check_load(mirror.load)
        with np.errstate(all="ignore"):
            return all(
                (-side in model.sides or not model.sides)
                and _is_image(system, twin, mirror, side, later)
                for side in model.every_side
            )
    # What cannot be evaluated at arrays, or is refused, has no symmetry that could be known.
    except (SaltusError, ArithmeticError, TypeError, ValueError, IndexError):
        return False


def _is_image(system: System, twin: System, mirror: _Swap, side: int, later: float) -> bool:
    model: Any = system.model
    n = len(model.coordinates)
    units = natural_units(system)
    random = np.random.default_rng(1)
    t, sizes, speeds = (random.uniform(size=PROBES) for _ in range(3))
    t = t * (units.time if system.load.period is None else system.load.period)
    around = np.array(mirror.centre)
    if model.has_one_contact and abs(around[0] - float(model.contact)) > (
        IMAGE_ROUNDING * max(units.length, abs(around[0]))
    ):
        return False  # the contact of an image is another one
    least = -DECADES * np.ones(PROBES)
    if any(mirror.centre):
        # distances from the centre are known up to its rounding alone
        share = float(np.max(np.abs(around) / units.lengths))
        least = np.maximum(least, math.log10(share) - DIGITS)
    q = random.normal(size=(n, PROBES)) * 10.0 ** (least + (DECADES - least) * sizes)
    v = random.normal(size=(n, PROBES)) * 10.0 ** (DECADES * (2.0 * speeds - 1.0))
    q = q * units.lengths[:, None]
    v = v * units.speeds[:, None]
    inward = float(model.inward(side)) if model.sides else 1.0
    if model.sides:
        q = inward * np.abs(q)
    places = list(mirror.places)
    load, image_load = (DeclaredLoad(one.load, model) for one in (system, twin))
    middle = around[:, None]
    there = (t, _of(middle + q), _of(v))
    image = (t + later, _of(middle - q[places]), _of(-v[places]))
    image_side = -side if model.sides else side
    # M and r say what M^-1 r does, which takes seconds for hundreds of coordinates
    by_force = isinstance(model, ContactModel)

    def force(at: Any, own_side: int, own_load: Any) -> np.ndarray:
        if by_force:
            return _rows(mass_and_force(model, at[0], at[1], at[2], own_load)[1], n)
        return _rows(model.acceleration(at[0], at[1], at[2], own_side, own_load), n)

    forces = [force(there, side, load), force(image, image_side, image_load)]
    # Far from the origin the places themselves have rounding, which may leave little of a force.
    ulps = ROUNDED_BY * random.choice([-1.0, 1.0], size=q.shape)
    moved = force((t, _of((middle + q) * (1.0 + ulps)), there[2]), side, load)
    rounding = np.where(np.isfinite(moved), np.abs(moved - forces[0]), 0.0)
    if not _alike(forces[0][places], -forces[1], rounding[places]):
        return False
    if isinstance(model, ContactModel):
        masses = [
            _square(mass_rows(model, at, time, own_load))
            for time, at, own_load in ((t, there[1], load), (t + later, image[1], image_load))
        ]
        if not _alike(masses[0][np.ix_(places, places)], masses[1]):
            return False
        count = len(model.contacts)
        pressing = _rows(normal_forces(model, *there, load), len(model.frictions))
        pressed = _rows(normal_forces(model, *image, image_load), len(model.frictions))
        frictions = [place - count for place in mirror.parts[count : count + len(model.frictions)]]
        if not _alike(pressing, pressed[frictions]):
            return False
        if model.jumps and not _jumps_are_images(model, mirror, there, image):
            return False
    elif model.sides:
        gaps = [_rows(model.gap(x, s), 1) for x, s in ((there[1], side), (image[1], image_side))]
        if not _alike(*gaps):
            return False
        for i in range(0, PROBES, PROBES // 8):
            speed = -inward * abs(float(v[0, i]))
            after = model.reset(float(t[i]), speed, side, load, system.impact)
            turned = model.reset(float(t[i]) + later, -speed, image_side, image_load, twin.impact)
            if after[0] != -turned[0] or not _alike(_rows(after[1], 1), -_rows(turned[1], 1)):
                return False
    if not model.margin_names(system.load):
        return True
    own, other = forces
    if by_force:
        own = _rows(model.acceleration(*there, side, load), n)
        other = _rows(model.acceleration(*image, image_side, image_load), n)
    return _margins_are_alike(
        model, (*there, _of(own), side, load), (*image, _of(other), image_side, image_load)
    )


def _jumps_are_images(model: Any, mirror: _Swap, there: Any, image: Any) -> bool:
    """Whether coordinates of first order jump as their images at the impacts of all contacts."""
    moving = len(model.moving)
    later = [place - moving for place in mirror.places[moving:]]
    for number, contact in enumerate(model.contacts):
        other = model.contacts[mirror.parts[number]]
        after = _rows(model.after_impact(contact.name, *there[1:]), len(later))
        turned = _rows(model.after_impact(other.name, *image[1:]), len(later))
        if not _alike(after[later], -turned):
            return False
    return True


def _margins_are_alike(model: Any, there: Any, image: Any) -> bool:
    """Whether each of the model's margins has the value of its image: half a period of an orbit
    that is its own image then has its least values."""
    own, other = model.margins(*there), model.margins(*image)
    return all(_alike(_rows(own[name], 1), _rows(other[name], 1)) for name in own)


def _alike(one: np.ndarray, other: np.ndarray, rounding: np.ndarray | None = None) -> bool:
    """Whether values (..., probes) are equal up to rounding of the largest one at each probe, and
    nearly everywhere up to their own.

    `rounding` is what comes from elsewhere. Probes that are not finite do not count, but half of
    them must be.
    """
    if not one.size:
        return True
    one, other = (values.reshape(-1, values.shape[-1]) for values in (one, other))
    sound = np.isfinite(one).all(axis=0) & np.isfinite(other).all(axis=0)
    if 2 * np.count_nonzero(sound) < len(sound):
        return False
    apart = np.abs(one - other)
    if rounding is not None:
        apart = np.maximum(apart - rounding, 0.0)
    apart = apart[:, sound]
    size = np.abs(one)[:, sound]
    # a value that is a small difference of large ones has their rounding
    by_own = np.count_nonzero(apart <= IMAGE_ROUNDING * size, axis=1)
    return bool(
        (apart <= IMAGE_ROUNDING * size.max(axis=0)).all()
        and (10 * by_own >= 9 * size.shape[1]).all()
    )


def _of(values: np.ndarray) -> Any:
    return values[0] if len(values) == 1 else tuple(values)


def _square(rows: list[list[Any]]) -> np.ndarray:
    """A matrix of numbers or arrays, (n, n, probes), or (n, n, 1) if all of it are numbers."""
    if all(isinstance(entry, (int, float)) for row in rows for entry in row):
        return np.array(rows, dtype=float)[..., None]
    return np.array([_rows(row, len(rows)) for row in rows])


def _rows(values: Any, count: int) -> np.ndarray:
    """Numbers or arrays of one or several coordinates as rows (count, probes)."""
    rows = values if isinstance(values, (tuple, list)) else [values]
    return np.array(
        [np.broadcast_to(np.asarray(row, dtype=float), PROBES) for row in rows]
    ).reshape(count, PROBES)


# --- declared ----------------------------------------------------------------


def _check_declared(system: System, mirrored: System, side: int) -> None:
    """Refuse a mirrored system in which the mirror image of a state does not move as the mirror
    image of the state's motion.

    Raises
    ------
    ParameterError
        The error names the class of the model.
    """
    model: Any = system.model
    t, distance, v = PROBE
    count = len(model.coordinates)
    places = [model.coordinates.index(name) for name in model.images]
    if count == 1:
        into = model.inward(side) if model.sides else 1.0
        at = [model.contact + into * distance]
    else:
        at = [distance / (1 + i) for i in range(count)]
    rates = [v / (1 + i) for i in range(count)]
    there = _each(
        model.acceleration(t, _scalar_or_tuple(at), _scalar_or_tuple(rates), side, system.load)
    )
    image = _each(
        model.acceleration(
            t,
            _scalar_or_tuple([-at[i] for i in places]),
            _scalar_or_tuple([-rates[i] for i in places]),
            -side,
            mirrored.load,
        )
    )
    pairs = [(there[i], x) for i, x in zip(places, image, strict=True)]
    names = [friction.coordinate for friction in model.frictions]
    pressing = normal_forces(model, t, _scalar_or_tuple(at), _scalar_or_tuple(rates), system.load)
    pressed = normal_forces(
        model,
        t,
        _scalar_or_tuple([-at[i] for i in places]),
        _scalar_or_tuple([-rates[i] for i in places]),
        mirrored.load,
    )
    pairs += [
        (pressing[names.index(model.images[model.coordinates.index(c)])], -n)
        for c, n in zip(names, pressed, strict=True)
    ]
    if model.sides:
        pairs.append((model.gap(at[0], side), -model.gap(-at[0], -side)))
        inward = -into * v
        one = model.reset(t, inward, side, system.load, system.impact)
        pairs += zip(one, model.reset(t, -inward, -side, mirrored.load, system.impact), strict=True)
    if any(abs(float(a) + float(b)) > DECLARED_ROUNDING * (1.0 + abs(float(a))) for a, b in pairs):
        raise ParameterError(
            f"{type(model).__name__}.mirror is not a symmetry of its equations: with the signs of"
            " coordinate, velocity and side turned, the load that it returns does not turn the"
            " sign of the acceleration; return None where there is none"
        )


def _scalar_or_tuple(values: list[Any]) -> Any:
    return values[0] if len(values) == 1 else tuple(values)


def _each(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (tuple, list)) else [value]
