"""The energy balance of a motion: the work of each load, the losses in damping, frictions and
impacts, and the stored energy.

Averages over time, at Gauss's points of its steps, and the transmissibility that experimenters
measure are here too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered, check_count
from saltus.errors import ParameterError, near
from saltus.flow import EventKind, Motion, RowValues, modes_of
from saltus.orbits.free_orbits import FreeOrbit
from saltus.orbits.orbit import PeriodicOrbit
from saltus.result import result_dataset
from saltus.systems import (
    ContactModel,
    Load,
    LoadOnSides,
    Sides,
    System,
    check_system,
    mass_and_force,
    sides_for,
)

if TYPE_CHECKING:
    import xarray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(
    16
)  # Gauss's rule in each step: exact for polynomials up to degree 31, and a step's Taylor series has order 23 at most
Followed = Motion | PeriodicOrbit | FreeOrbit
Response = Callable[[np.ndarray, Any, Any], Any]


def _slopes(nodes: np.ndarray) -> np.ndarray:
    """The matrix that takes the values of a polynomial at the nodes to its slopes there, by the
    barycentric formula.
    """
    one = np.eye(nodes.size)
    apart = nodes[:, None] - nodes + one
    products = np.prod(apart, axis=1)
    matrix = products[:, None] / products / apart * (1.0 - one)
    return np.asarray(matrix - np.diag(matrix.sum(axis=1)))


SLOPES = _slopes(NODES)


@dataclass(frozen=True)
class SampledPart:
    """A motion between two times, sampled at Gauss's points of its steps: states are (coordinates,
    n), all else is (n,).
    """

    motion: Motion
    begin: float
    end: float
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    side: np.ndarray
    weight: np.ndarray
    # whether all relays count as off, in the forces, whatever their sides are
    relays_off: bool = False
    # the relay that is none the less on where it is
    but_for: str = ""

    @property
    def system(self) -> System:
        return self.motion.system

    @property
    def length(self) -> float:
        return self.end - self.begin

    def integral(self, values: Any) -> float:
        """The integral over time, of several rows their sum."""
        return float(np.sum(self.weight * values))

    def mean(self, values: Any) -> float:
        """The mean over time."""
        return self.integral(values) / self.length

    def rate(self, values: np.ndarray) -> np.ndarray:
        """The derivatives in time of values (..., n), by the polynomial through Gauss's points of
        each step.
        """
        steps = np.reshape(values, (*values.shape[:-1], -1, NODES.size))
        half = self.weight.reshape(-1, NODES.size)[:, :1] / WEIGHTS[0]
        return np.reshape(steps @ SLOPES.T / half, values.shape)


@answered
def transmissibility(
    of: Followed, channel: str, response: Response | None = None, *, periods: int | None = None
) -> float:
    """The ratio of the standard deviations over time of a response and of the load that drives it,

        T = sigma(r) / sigma(u),    sigma(f)^2 = (1/D) int (f - mean f)^2 dt,

    for the channel u of the load (its value: a force, or a displacement of the ground) and the
    response r, over one period of an orbit or the last forcing periods of a motion, of duration D.
    For harmonic functions it is the ratio of their amplitudes.

    Parameters
    ----------
    of
        An orbit, or a motion that was kept densely.
    channel
        The name of a channel of the load, such as "horizontal".
    response
        r(t, position, velocity) of arrays, such as the force on the ground k x + c x', or x plus
        the ground's displacement; by default the first coordinate. With several coordinates
        positions and velocities are arrays (coordinates, n).
    periods
        How many of the last forcing periods of a motion are used, by default 1; under a load
        without a frequency all of it.

    Raises
    ------
    ParameterError
        The channel does not vary, the motion was not kept densely or is too short, or the response
        does not return numbers.

    Examples
    --------
    >>> spring = saltus.System(
    ...     model=saltus.WallOscillator(damping=0.1, wall=9.0), load=saltus.Load(frequency=2.0, force=saltus.Harmonic(1.0))
    ... )
    >>> orbit = saltus.find_orbit(spring, x=0.0)
    >>> round(saltus.transmissibility(orbit, "force") * np.hypot(1 - 2.0**2, 0.1 * 2.0), 9)  # x over force
    np.float64(1.0)
    """
    course = course_of(of, periods)
    model = course.system.model
    load = course.system.load
    if channel not in load.channels:
        raise ParameterError(
            f"the load has no channel {channel!r}; {near(channel, load.channels)}", "channel"
        )
    single = len(model.coordinates) == 1
    state = (
        (course.position[0], course.velocity[0]) if single else (course.position, course.velocity)
    )
    answer = course.position[0] if response is None else response(course.time, *state)
    try:
        values = np.broadcast_to(np.asarray(answer, dtype=float), course.time.shape)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            "response must return a number for each time, position and velocity", "response"
        ) from None
    driving = _deviation(
        course,
        np.broadcast_to(
            load.channels[channel].derivative(course.time, load.frequency), course.time.shape
        ),
    )
    if driving == 0.0:
        raise ParameterError(f"load.{channel} does not vary, so nothing is transmitted", "channel")
    return _deviation(course, values) / driving


def _deviation(course: SampledPart, values: Any) -> float:
    return math.sqrt(max(course.mean((values - course.mean(values)) ** 2), 0.0))


def course_of(of: Followed, periods: int | None) -> SampledPart:
    """An orbit's period, or the last periods of a motion."""
    if not isinstance(of, Followed):
        hint = "give saltus.find_orbit(system, ...) or saltus.simulate(system, ...)"
        raise ParameterError(
            f"of must be an orbit or a motion, got a {type(of).__name__}; {hint}", "of"
        )
    if periods is not None:
        check_count("periods", periods, 1)
    if isinstance(of, Motion):
        motion = of
        length = of.system.load.period
        begin = (
            of.start if length is None else of.time - length * (1 if periods is None else periods)
        )
        end = of.time
    else:
        motion, begin, end = _round(of)
    if (
        motion.dense is None
        or begin < motion.start - 1e-9 * max(abs(motion.start), abs(motion.time))
        or not end > begin
    ):
        raise ParameterError(
            "the motion must have dense output over so many forcing periods; simulate it for "
            "longer",
            "periods",
        )
    dense = motion.dense
    first = np.clip(dense.start, begin, end)
    length_left = np.clip(np.minimum(dense.start + dense.length, end) - first, 0.0, None)
    # else a node could not be told from the end of the step
    used = first + 0.5 * (1.0 + NODES[0]) * length_left > first
    middle = (first + 0.5 * length_left)[used]
    half = 0.5 * length_left[used]
    time = (middle[:, None] + half[:, None] * NODES).reshape(-1)
    position, velocity, side = dense.states(time)
    position, velocity = (
        np.array(rows) for rows in motion.system.from_gaps(time, position, velocity)
    )
    return SampledPart(
        motion, begin, end, time, position, velocity, side, (half[:, None] * WEIGHTS).reshape(-1)
    )


def _round(orbit: PeriodicOrbit | FreeOrbit) -> tuple[Motion, float, float]:
    """A motion on an orbit, and one period of it that neither begins nor ends at an impact or where
    the state is reset.
    """
    if isinstance(orbit, FreeOrbit):
        motion = orbit.motion()
        return motion, motion.start, motion.time
    motion = orbit.motion(2 * orbit.signature.period)
    jumps = sorted([*motion.impacts.time.tolist(), *_resets(motion)])
    edges = [time for time in jumps if time > motion.start + 1e-9 * orbit.duration]
    begin = 0.5 * (edges[0] + motion.start) if edges else motion.start
    return motion, begin, begin + orbit.duration


SUPPLIED = "supplied"
DISSIPATED = "dissipated"
STORED = "stored"
Parts = dict[tuple[str, str], float]  # the energy of each part, by its role and its name


@answered
def energies(of: Followed, *, periods: int | None = None) -> xarray.Dataset:
    """The energies of a motion by their parts: what is supplied is dissipated or stored,

        sum of supplied = sum of dissipated + change of the kinetic and of the potential energy.

    With the generalised force f = M q'' it is, over a time D,

        v f = sum over channels c of v [f_c - f_0] + v f_d + v f_0,    f_d = [f(t, q, v) - f(t, q,
        -v)] / 2,

    f_0 being the part of f without loads that is even in v, f_c that with the channel c alone. The
    work of a load is int v (f_c - f_0) dt; damping takes -int v f_d dt; an impact takes [v- M- v- -
    v+ M+ v+] / 2; the potential energy changes by -int [v f_0 + v M' v / 2] dt. A friction of the
    force F on a ground of speed w takes int F (w - v) dt, of which the ground supplies int F w dt.
    Velocities are relative to the ground: of a ground that moves by a channel the force of inertia
    does the work.

    A coordinate of first order, such as a voltage, takes -int v [f_0 - f_0'] dt, with f_0' the
    forces where it is 0, which the potential energy has then. Over a period of an orbit that is the
    electric energy which a harvester delivers.

    What a relay does is int v (f_0 - f_0'') dt, with f_0'' the forces where it is off. Where a
    surface resets the state, [v- M- v- - v+ M+ v+] / 2 is taken. That a reset moves a coordinate
    does no work, and the potential energy is that of the way between resets.

    Parameters
    ----------
    of
        An orbit, or a motion that was kept densely.
    periods
        How many of the last forcing periods of a motion are used, by default 1; under a load
        without a frequency all of it.

    Returns
    -------
    xarray.Dataset
        Over `part`: `energy` and `power`, the energy over the time, and the `role`: supplied
        (`load.force`, `load.together` of channels that act on one another, `ground.belt`; of what
        multipliers hold `wall.table` of a contact that moves by itself, and in impacts
        `ground.impacts`; of forces that are not determined those of least squares),
        `relay.motor` of a relay is supplied too. Others are
        dissipated (`damping`, `friction.belt`, `impact.left`, `impact` of a single contact,
        `first_order.voltage`, `reset.strike` of a surface with an `after_event`) or stored (`kinetic`, `potential`). A contact that is not struck has
        no part: what all take together is the sum where `part.str.startswith("impact")`, of no
        parts 0. The attribute `defect` is what is missing in the sum by rounding, `duration` is D.
        Of loads on a metainterface the unit is that of K2.

    Raises
    ------
    ParameterError
        The motion was not kept densely or is too short; or the model gives neither its kinetic
        energy nor its mass matrix; or walls that move do work at its contacts.

    Examples
    --------
    >>> balance = saltus.energies(orbit)
    >>> [str(name) for name in balance.part.values]
    ['load.horizontal', 'load.vertical', 'damping', 'impact', 'kinetic', 'potential']
    >>> bool(abs(balance.defect) < 1e-12)
    True
    """
    course = course_of(of, periods)
    check_system(
        course.system,
        "energies",
        several_contacts=True,
        multipliers=True,
        switches=True,
        resets=True,
        relays=True,
    )
    _refuse_moving_walls(course.system)
    parts = _parts(course)
    roles, names = zip(*parts, strict=True)
    energy = np.array(list(parts.values()))
    signs = np.array([{SUPPLIED: 1.0, DISSIPATED: -1.0, STORED: -1.0}[role] for role in roles])
    columns: dict[str, tuple[Any, ...]] = {
        "energy": ("part", energy, "1", "energy that is supplied, dissipated or stored"),
        "power": ("part", energy / course.length, "1", "mean power"),
        "role": ("part", list(roles), "1", "supplied, dissipated or stored"),
    }
    facts = {"duration": course.length, "defect": float(np.sum(signs * energy))}
    return result_dataset(
        "energies", columns, {"part": list(names)}, course.system, tol=course.motion.tol, **facts
    )


def _refuse_moving_walls(system: System) -> None:
    """Refuse motions on which walls that move do work, in the coordinates in which they do."""
    inner: Any = system.in_gap_coordinates
    if inner is not system and any(inner.model.gap_sums()[1]):
        raise ParameterError(
            "moving walls do work at contacts, which cannot be separated: give a motion of"
            " system.in_gap_coordinates, whose energies are relative to the ground",
            "of",
        )


@answered
def mean_dissipated_power(of: Followed, *, periods: int | None = None) -> float:
    """The energy that damping, friction and impacts dissipate, divided by the time: the dissipated
    parts of `energies`,

        P = (1/D) { sum over impacts [v- M- v- - v+ M+ v+] / 2 - int v f_d dt + sum over frictions
        int F (w - v) dt },

    over one period of an orbit or the last forcing periods of a motion, of duration D. On a
    periodic orbit P equals the mean power that the load and moving grounds supply. For load (i) its
    unit is that of K2 over the unit of time.

    Parameters
    ----------
    of
        An orbit, or a motion that was kept densely.
    periods
        How many of the last forcing periods of a motion are used, by default 1; under a load
        without a frequency all of it.

    Raises
    ------
    ParameterError
        As for `energies`.

    Examples
    --------
    >>> spring = saltus.System(
    ...     model=saltus.WallOscillator(damping=0.1, wall=9.0), load=saltus.Load(frequency=2.0, force=saltus.Harmonic(1.0))
    ... )
    >>> orbit = saltus.find_orbit(spring, x=0.0)
    >>> expected = 0.1 * (2.0 * orbit.amplitude) ** 2 / 2  # c v^2 over a period
    >>> round(float(saltus.mean_dissipated_power(orbit) / expected), 6)
    1.0
    """
    course = course_of(of, periods)
    taken = sum(energy for (role, _), energy in _parts(course).items() if role == DISSIPATED)
    return taken / course.length


def _parts(course: SampledPart) -> Parts:
    """The energies by their parts, those of the loads first."""
    load = course.system.load
    v = _moving(course, course.velocity)
    mass = _mass(course, course.time, course.position, course.side)
    forth, back = (_force(course, load, mass, w) for w in (v, -v))
    own = _even_force(course, Load(frequency=load.frequency), mass)
    parts: Parts = {}
    left = (forth + back) / 2 - own
    for name, signal in load.channels.items():
        alone = _even_force(course, Load(frequency=load.frequency, **{name: signal}), mass) - own
        parts[SUPPLIED, f"load.{name}"] = course.integral(v * alone)
        left = left - alone
    if len(load.channels) > 1 and np.abs(left).max(initial=0.0) > 1e-12 * np.abs(forth).max(
        initial=0.0
    ):
        parts[SUPPLIED, "load.together"] = course.integral(v * left)
    parts |= _friction_parts(course, mass, forth)
    without_relays = course
    if course.system.model.relays:
        without_relays = replace(course, relays_off=True)
        done, own = _relay_parts(without_relays, own, mass)
        parts |= done
    if course.system.model.first_order:
        taken, own = _first_order_parts(without_relays, own, mass)
        parts |= taken
    parts[DISSIPATED, "damping"] = -course.integral(v * (forth - back) / 2)
    parts |= _impact_parts(course)
    parts |= _reset_parts(course)
    parts[STORED, "kinetic"] = _kinetic(course, -1) - _kinetic(course, 0)
    growing = np.einsum("in,ijn,jn->n", v, course.rate(mass), v) / 2
    parts[STORED, "potential"] = -course.integral(np.sum(v * own, axis=0) + growing)
    return parts


def _relay_parts(
    course: SampledPart, own: np.ndarray, mass: np.ndarray
) -> tuple[Parts, np.ndarray]:
    """What each relay supplies by the forces that it changes while it is on, and the forces where
    all of them are off, as they are in `course`.
    """
    relays = course.system.model.relays
    load = Load(frequency=course.system.load.frequency)
    v = _moving(course, course.velocity)
    without = _even_force(course, load, mass)
    parts = Parts()
    left = own - without
    for relay in relays:
        alone = _even_force(replace(course, but_for=relay.name), load, mass) - without
        parts[SUPPLIED, f"relay.{relay.name}"] = course.integral(v * alone)
        left = left - alone
    if len(relays) > 1 and np.abs(v * left).max(initial=0.0) > 1e-12 * np.abs(v * own).max(
        initial=0.0
    ):
        parts[SUPPLIED, "relay.together"] = course.integral(v * left)
    return parts, without


def _resets(motion: Motion) -> dict[float, list[str]]:
    """The surfaces that reset the state of a motion, by the instants at which they do."""
    found: dict[float, list[str]] = {}
    resetting = motion.system.model.resets
    for event in motion.events if resetting else ():
        if event.kind is EventKind.CROSSING:
            names = [
                name for name in resetting if name in str(getattr(event, "contact", "")).split("+")
            ]
            if names:
                found.setdefault(event.time, []).extend(names)
    return found


def _reset_parts(course: SampledPart) -> Parts:
    """What resets take of the kinetic energy, by the names of their surfaces; at the instant of an
    impact beside what this takes.
    """
    parts = Parts()
    within = {
        time: names
        for time, names in _resets(course.motion).items()
        if course.begin < time <= course.end
    }
    if not within:
        return parts
    impacts = course.motion.events.impacts(EventKind.HELD).time
    taken = dict.fromkeys(within, 0.0)
    if np.isin(impacts, list(within)).any():
        late = impacts[(impacts > course.begin) & (impacts <= course.end)]
        for time, (_, lost, supplied) in zip(late.tolist(), _impact_losses(course), strict=True):
            if time in taken:
                taken[time] += lost - supplied
    for time, names in within.items():
        before, after = (
            _kinetic_at(course, instant) for instant in (np.nextafter(time, -math.inf), time)
        )
        name = f"reset.{'+'.join(sorted(set(names)))}"
        lost = before - after - taken[time]
        parts[DISSIPATED, name] = parts.get((DISSIPATED, name), 0.0) + lost
    return parts


def _moving(course: SampledPart, velocity: np.ndarray) -> np.ndarray:
    """Velocities (coordinates, n), 0 for those of first order, which have no inertia and on which
    no force does work.
    """
    count = len(course.system.model.moving)
    return (
        np.concatenate([velocity[:count], 0.0 * velocity[count:]])
        if count < len(velocity)
        else velocity
    )


def _first_order_parts(
    course: SampledPart, own: np.ndarray, mass: np.ndarray
) -> tuple[Parts, np.ndarray]:
    """What each coordinate of first order takes by the forces that it changes, and the forces where
    all of them are 0.
    """
    model = course.system.model
    load = Load(frequency=course.system.load.frequency)
    v = _moving(course, course.velocity)
    count = len(model.moving)
    parts = Parts()

    def forces(kept: int) -> np.ndarray:
        position = course.position.copy()
        position[[i for i in range(count, len(position)) if i != kept]] = 0.0
        return _even_force(replace(course, position=position), load, mass)

    without = forces(-1)
    left = own - without
    for i, name in enumerate(model.first_order):
        alone = forces(count + i) - without
        parts[DISSIPATED, f"first_order.{name}"] = -course.integral(v * alone)
        left = left - alone
    if len(model.first_order) > 1 and np.abs(v * left).max(initial=0.0) > 1e-12 * np.abs(
        v * own
    ).max(initial=0.0):
        parts[DISSIPATED, "first_order.together"] = -course.integral(v * left)
    return parts, without


def _friction_parts(course: SampledPart, mass: np.ndarray, force: np.ndarray) -> Parts:
    """What the grounds of frictions supply, where they move, and what the frictions take."""
    system = course.system
    parts = Parts()
    if not isinstance(system.model, ContactModel):
        return parts
    if not (system.contact_model.frictions or system.model.has_multipliers):
        return parts
    if system.model.has_multipliers:
        return parts | _row_parts(course)
    inner = system.in_gap_coordinates
    load = system.load
    velocity = course.velocity
    state = _state(course.position, velocity)
    touching = inner.contact_model
    normals = system.contact_model.normal_forces(course.time, *state, load)
    # what makes a coordinate stick
    holding = np.einsum("ijn,jn->in", mass, course.rate(course.velocity)) - force
    if inner is not system:  # each friction and each contact acts along one of its coordinates
        made: Any = touching
        place, rate = made.gap_values(course.time, load, *state)
        columns = zip(*made.own_slopes(course.time, place, load), strict=True)
        holding = [
            sum(share * each for share, each in zip(column, holding, strict=True))
            for column in columns
        ]
        velocity = np.array(rate if isinstance(rate, tuple) else (rate,))
    slides = modes_of(touching, course.side)[1]
    for friction, normal, slide in zip(touching.frictions, normals, slides, strict=True):
        i = touching.coordinates.index(friction.coordinate)
        ground = friction.ground_speed
        for contact in (each for each in touching.contacts if each.name == friction.contact):
            normal = np.where(
                slide == 2,
                0.0,
                contact.sign * holding[touching.coordinates.index(contact.coordinate)],
            )
        way = np.where(slide == 2, 0, slide)
        acting = np.where(slide == 0, holding[i], -friction.slipping(velocity[i], way) * normal)
        if ground:
            parts[SUPPLIED, f"ground.{friction.name}"] = course.integral(acting * ground)
        parts[DISSIPATED, f"friction.{friction.name}"] = course.integral(
            acting * (ground - velocity[i])
        )
    return parts


def _row_parts(course: SampledPart) -> Parts:
    """What contacts and frictions that multipliers hold supply, where they move by themselves,
    between impacts and in these, and what the frictions take."""
    values = RowValues(course.system)
    states = np.concatenate([course.position, course.velocity]).T
    accelerations = course.rate(course.velocity).T
    rates = values.along(course.time, states)[1]
    drifts = values.drifts_along(course.time, states)
    carried = values.carried_along(course.time, states, accelerations, course.side)
    model = course.system.contact_model
    names = [contact.name for contact in model.contacts]
    names += [friction.name for friction in model.frictions]
    parts = Parts()
    for row, name in enumerate(names):
        if row >= values.count:
            parts[DISSIPATED, f"friction.{name}"] = -course.integral(
                carried[:, row] * rates[:, row]
            )
        if drifts[:, row].any():
            own = f"wall.{name}" if row < values.count else f"ground.{name}"
            parts[SUPPLIED, own] = -course.integral(carried[:, row] * drifts[:, row])
    return parts


def _impact_parts(course: SampledPart) -> Parts:
    """What impacts take, by the contacts that they close."""
    parts: Parts = {}
    for name, lost, supplied in _impact_losses(course):
        parts[DISSIPATED, name] = parts.get((DISSIPATED, name), 0.0) + lost
        if supplied:
            moved = SUPPLIED, "ground.impacts"
            parts[moved] = parts.get(moved, 0.0) + supplied
    return parts


def _impact_losses(course: SampledPart) -> Iterator[tuple[str, float, float]]:
    """The name of each impact's part, the energy that it takes, and what contacts and frictions that
    multipliers hold supply in it, where they move by themselves; what impacts accumulate
    to, which are too slow to be followed, is taken by the last one that is, or where a contact is
    held from then on."""
    system = course.system
    impacts = course.motion.events.impacts(EventKind.HELD)
    late = (impacts.time > course.begin) & (impacts.time <= course.end)
    if not late.any():
        return
    times = impacts.time[late]
    side = impacts.side[late].astype(float)
    both = (
        np.reshape(v[late], (times.size, -1)).T
        for v in (impacts.velocity_before, impacts.velocity_after)
    )
    before, after = (_moving(course, v) for v in both)
    names = ["impact"] * times.size
    beyond = side
    if isinstance(system.model, ContactModel):
        places = course.motion._states(times)[0]
        called = [contact.name for contact in system.contact_model.contacts]
        names = [
            "impact." + "+".join(c for i, c in enumerate(called) if int(bits) >> i & 1)
            for bits in side
        ]
    else:
        places = np.full((1, times.size), float(system.model.contact))
        # rest begins there
        after[
            :, course.motion._states(0.5 * (times + np.append(times[1:], course.end)))[2] == 0
        ] = 0.0
        reset = system.one_contact.reset
        given = zip(times, before[0], side, strict=True)
        beyond = np.array(
            [reset(t, v, s, system.load, system.impact)[0] for t, v, s in given], dtype=float
        )
    first, second = (_mass(course, times, places, s) for s in (side, beyond))
    lost = (
        np.einsum("in,ijn,jn->n", before, first, before)
        - np.einsum("in,ijn,jn->n", after, second, after)
    ) / 2
    supplied = np.zeros_like(lost)
    if system.model.has_multipliers:
        values = RowValues(system)
        for number, time in enumerate(times.tolist()):
            change = after[:, number] - before[:, number]
            supplied[number] = values.supplied_at(time, places[:, number], change)
    yield from zip(names, (lost + supplied).tolist(), supplied.tolist(), strict=True)


def _kinetic(course: SampledPart, place: int) -> float:
    """The kinetic energy at the beginning (0) or at the end (-1) of the course."""
    return _kinetic_at(course, (course.begin, course.end)[place])


def _kinetic_at(course: SampledPart, instant: float) -> float:
    """The kinetic energy at an instant; where the state jumps, after it."""
    time = np.array([instant])
    q, v, side = course.motion._states(time)
    v = _moving(course, v)
    return (
        float(
            np.einsum("in,ijn,jn->n", v, _mass(course, time, q, np.where(side == 0, 1, side)), v)[0]
        )
        / 2
    )


def _even_force(course: SampledPart, load: Load, mass: np.ndarray) -> np.ndarray:
    """The part of the generalised force under a load that is even in the velocity, (coordinates,
    n).
    """
    forth, back = (_force(course, load, mass, v) for v in (course.velocity, -course.velocity))
    return np.asarray((forth + back) / 2)


def _force(course: SampledPart, load: Load, mass: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """The generalised force f = M q'' without reactions and frictions at a velocity, (coordinates,
    n).
    """
    model = course.system.model
    state = _state(course.position, velocity)
    if isinstance(model, ContactModel):
        if model.relays:
            load = _with_relays(course, load, state)
        return _rows(mass_and_force(model, course.time, *state, load)[1], course.time)
    answer = model.acceleration(
        course.time, *state, np.where(course.side == 0, 1.0, course.side), load
    )
    return np.asarray(
        np.einsum(
            "ijn,jn->in",
            mass,
            _rows(answer if isinstance(answer, tuple) else [answer], course.time),
        )
    )


def _with_relays(course: SampledPart, load: Any, state: tuple[Any, Any]) -> Any:
    """A load together with the sides of surfaces: of relays those that the motion remembers, of
    others those of the state.
    """
    model: Any = course.system.model
    found = dict(sides_for(model, course.time, *state, load)[0])
    remembered = modes_of(model, course.side)[2]
    for surface, side in zip(model.surfaces, remembered, strict=True):
        if surface in model.relays:
            off = course.relays_off and surface.name != course.but_for
            found[surface.name] = np.full(course.time.shape, -1.0) if off else 1.0 * side
    return LoadOnSides(load, Sides(found))


def _state(position: np.ndarray, velocity: np.ndarray) -> tuple[Any, Any]:
    """Coordinates and velocities as a model takes them: arrays for a single coordinate, tuples of
    arrays for several.
    """
    return (tuple(position), tuple(velocity)) if len(position) > 1 else (position[0], velocity[0])


def _rows(values: Any, times: np.ndarray) -> np.ndarray:
    return np.array(
        [np.broadcast_to(np.asarray(value, dtype=float), times.shape) for value in values]
    )


def _mass(course: SampledPart, time: np.ndarray, position: np.ndarray, side: Any) -> np.ndarray:
    """The mass matrix, (coordinates, coordinates, n): the model's own or, as the kinetic energy T
    is quadratic in the velocity, T(e_i + e_j) - T(e_i) - T(e_j) + T(0)."""
    model = course.system.model
    load = course.system.load
    still = np.zeros_like(position)
    if isinstance(model, ContactModel):
        return np.array(
            [
                _rows(row, time)
                for row in mass_and_force(model, time, *_state(position, still), load)[0]
            ]
        )
    one = np.eye(len(position))[:, :, None] + still
    side = np.where(np.asarray(side) == 0, 1.0, side)

    def energy(velocity: np.ndarray) -> Any:
        return model.kinetic_energy(time, *_state(position, velocity), side, load)

    none = energy(still)
    return np.array(
        [_rows([energy(a + b) - energy(a) - energy(b) + none for b in one], time) for a in one]
    )
