"""Contacts of a distance and frictions of a rate, which multipliers hold in a model's own
coordinates: beside DOP853 from event to event, statics, and the same contacts of coordinates.
"""

import itertools
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import Contact, Friction, Harmonic, Load, NewtonImpact, PoissonImpact, System
from saltus.errors import MotionError, ParameterError, TraceError
from saltus.flow.motion.events import modes_of
from saltus.taylor import trace


@dataclass(frozen=True, kw_only=True)
class Block(saltus.ContactModel):
    """A block of mass 1 on a shaken plane: two corners hit it and rub on it."""

    width: float = 0.5
    height: float = 0.8
    mu: float = 0.45
    static: float | None = None

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "tilt")
    channels: ClassVar[tuple[str, ...]] = ("push",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="left", distance="left"),
        Contact(name="right", distance="right"),
    )

    @property
    def frictions(self):
        return tuple(
            Friction(
                name=f"{name} foot",
                rate=f"{name}_slip",
                contact=name,
                kinetic=self.mu,
                static=self.static,
            )
            for name in ("left", "right")
        )

    def corner(self, tilt, side):
        """The place of a corner from the centre, along the plane and above it."""
        c, s = np.cos(tilt), np.sin(tilt)
        return side * self.width * c + self.height * s, side * self.width * s - self.height * c

    def left(self, t, q, load):
        return q[1] + self.corner(q[2], -1.0)[1]

    def right(self, t, q, load):
        return q[1] + self.corner(q[2], 1.0)[1]

    def left_slip(self, t, q, velocity, load):
        return velocity[0] - velocity[2] * self.corner(q[2], -1.0)[1]

    def right_slip(self, t, q, velocity, load):
        return velocity[0] - velocity[2] * self.corner(q[2], 1.0)[1]

    @property
    def inertia(self):
        return (self.width**2 + self.height**2) / 3.0

    def mass_matrix(self, q):
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, self.inertia]]

    def force(self, t, q, velocity, load):
        return load.push(t), -1.0, 0.0

    # for the reference, by hand

    def mass(self, q):
        return np.diag([1.0, 1.0, self.inertia])

    def opening(self, i, t, q):
        return q[1] + self.corner(q[2], (-1, 1)[i])[1]

    def contact_row(self, i, t, q, v):
        """W, b, and d/dt (W v + b) without accelerations."""
        x, y = self.corner(q[2], (-1, 1)[i])
        return np.array([0.0, 1.0, x]), 0.0, -(v[2] ** 2) * y

    def friction_row(self, i, t, q, v):
        x, y = self.corner(q[2], (-1, 1)[i])
        return np.array([1.0, 0.0, -y]), 0.0, -(v[2] ** 2) * x


@dataclass(frozen=True, kw_only=True)
class Rotor(saltus.ContactModel):
    """A rotor in a circular stator, in which it hits and rubs with a turning surface."""

    mu: float = 0.3
    stiffness: float = 0.2
    damping: float = 0.1
    gravity: float = 0.9
    surface: float = -0.3
    room: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("pull_x", "pull_y")
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="stator", distance="clearance"),)

    @property
    def frictions(self):
        return (Friction(name="rub", rate="rub_speed", contact="stator", kinetic=self.mu),)

    def clearance(self, t, q, load):
        return self.room - np.sqrt(q[0] * q[0] + q[1] * q[1])

    def rub_speed(self, t, q, velocity, load):
        r = np.sqrt(q[0] * q[0] + q[1] * q[1])
        return (q[0] * velocity[1] - q[1] * velocity[0]) / r + self.surface

    def force(self, t, q, v, load):
        return (
            load.pull_x(t) - self.damping * v[0] - self.stiffness * q[0],
            load.pull_y(t) - self.damping * v[1] - self.stiffness * q[1] - self.gravity,
        )

    def mass(self, q):
        return np.eye(2)

    def opening(self, i, t, q):
        return self.room - np.hypot(*q)

    def contact_row(self, i, t, q, v):
        r = np.hypot(*q)
        return -q / r, 0.0, -(v @ v - (q @ v) ** 2 / r**2) / r

    def friction_row(self, i, t, q, v):
        r = np.hypot(*q)
        w = np.array([-q[1], q[0]]) / r
        return w, self.surface, -(w @ v) * (q @ v) / r**2


def block(e=0.3, shake=0.6, frequency=2.2, **numbers):
    load = Load(frequency=frequency, push=Harmonic(shake))
    return System(model=Block(**numbers), load=load, impact=NewtonImpact(e=e))


def rotor(e=0.5, speed=0.7, unbalance=1.5, **numbers):
    pull = unbalance * speed**2
    load = Load(frequency=speed, pull_x=Harmonic(pull), pull_y=Harmonic(pull, phase=-math.pi / 2.0))
    return System(model=Rotor(**numbers), load=load, impact=NewtonImpact(e=e))


# --- an independent integration, from event to event ---


def pushes_of(model, closed, slides, t, q, v):
    """The rows that are held, their bends, the columns of their forces, and what they are of."""
    rows = []
    for i in np.flatnonzero(closed):
        w, _, bend = model.contact_row(i, t, q, v)
        push = w.copy()
        if slides[i] in (1, -1):
            push = push - model.mu * slides[i] * model.friction_row(i, t, q, v)[0]
        rows.append((w, bend, push, ("normal", i)))
    for i in np.flatnonzero(closed):
        if slides[i] == 0:
            w, _, bend = model.friction_row(i, t, q, v)
            rows.append((w, bend, w, ("along", i)))
    return rows


def solved(system, mode, t, q, v):
    """The accelerations, and the reactions; where rows depend on one another those of least norm."""
    model = system.model
    rows = pushes_of(model, *mode, t, q, v)
    mass = model.mass(q)
    free = np.linalg.solve(mass, np.array(model.force(t, q, v, system.load)))
    if not rows:
        return free, {}
    a = np.array([row[0] for row in rows])
    b = np.array([row[2] for row in rows]).T
    bends = np.array([row[1] for row in rows])
    forces = np.linalg.lstsq(a @ np.linalg.solve(mass, b), -bends - a @ free, rcond=1e-9)[0]
    return free + np.linalg.solve(mass, b @ forces), dict(
        zip([row[3] for row in rows], forces, strict=True)
    )


def guards(system, mode, t, q, v):
    """What must not be negative in a mode."""
    model = system.model
    closed, slides = mode
    forces = solved(system, mode, t, q, v)[1]
    found = []
    stuck = [i for i in np.flatnonzero(closed) if slides[i] == 0]
    for i, shut in enumerate(closed):
        found.append(forces["normal", i] if shut else model.opening(i, t, q))
        if shut and slides[i] in (1, -1):
            w, drift, _ = model.friction_row(i, t, q, v)
            found.append(slides[i] * (w @ v + drift))
    if stuck:  # of several that depend on one another the sum is known
        most = sum(model.mu * forces["normal", i] for i in stuck)
        along = sum(forces["along", i] for i in stuck)
        found += [most - along, most + along]
    return found


def struck(system, closed, hit, t, q, v, e):
    """The velocities after an impact by Newton's law and Coulomb's, the only ones."""
    model = system.model
    mass = model.mass(q)
    chosen = sorted({*np.flatnonzero(closed), *hit})
    solutions = []
    for ways in itertools.product((None, 0, 1, -1), repeat=len(chosen)):
        rows, columns, targets = [], [], []
        for i, way in zip(chosen, ways, strict=True):
            if way is None:
                continue
            w, drift, _ = model.contact_row(i, t, q, v)
            along, slides, _ = model.friction_row(i, t, q, v)
            rows.append(w)
            columns.append(w - (way * model.mu * along if way else 0.0))
            targets.append(-(1.0 + e) * min(w @ v + drift, 0.0) if i in hit else -(w @ v + drift))
            if way == 0:
                rows.append(along)
                columns.append(along)
                targets.append(-(along @ v + slides))
        if len(rows) > len(v) or (rows and np.linalg.svd(np.array(rows))[1][-1] < 1e-9):
            continue  # others stop the same by fewer impulses
        after = v
        impulses = np.zeros(0)
        if rows:
            a, b = np.array(rows), np.array(columns).T
            impulses = np.linalg.solve(a @ np.linalg.solve(mass, b), np.array(targets))
            after = v + np.linalg.solve(mass, b @ impulses)
        good, place = True, 0
        for i, way in zip(chosen, ways, strict=True):
            w, drift, _ = model.contact_row(i, t, q, v)
            along, slides, _ = model.friction_row(i, t, q, v)
            if way is None:
                least = -e * min(w @ v + drift, 0.0) if i in hit else 0.0
                good = good and w @ after + drift >= least - 1e-10
                continue
            normal = impulses[place]
            good = good and normal >= -1e-12
            place += 1
            if way == 0:
                good = good and abs(impulses[place]) <= model.mu * normal + 1e-12
                place += 1
            else:
                good = good and way * (along @ after + slides) >= -1e-10
        if good and not any(np.allclose(after, other, atol=1e-9) for other in solutions):
            solutions.append(after)
    (after,) = solutions
    return after


def compared(system, motion, e, events):
    """The largest differences of instants, coordinates and velocities from DOP853's, event by event,
    which finds its own instants. At the end of an accumulation it begins anew."""
    model = system.model
    n = len(model.coordinates)
    dense = motion.dense
    found = list(motion.events)[:events]
    instants = sorted({event.time for event in found})
    worst = np.zeros(3)
    mode = _mode(model, dense, 0)
    state = np.concatenate([dense.series[0, :n, 0], dense.series[0, :n, 1]])
    t = 0.0
    for instant in instants:
        here = [event for event in found if event.time == instant]
        kinds = {str(event.kind) for event in here}
        step = int(np.searchsorted(dense.start, instant))
        if step == len(dense.start):
            break
        told = np.concatenate([dense.series[step, :n, 0], dense.series[step, :n, 1]])
        if "held" in kinds:  # the motion goes on from the last impact that was followed
            step = int(np.searchsorted(dense.start, instant, side="right")) - 1
            state = np.concatenate([dense.series[step, :n, 0], dense.series[step, :n, 1]])
            t, mode = dense.start[step], _mode(model, dense, step)
            continue

        def rate(t, y, mode=mode):
            return np.concatenate([y[n:], solved(system, mode, t, y[:n], y[n:])[0]])

        if instant - t > 1e-12:
            before = guards(
                system,
                mode,
                t + 0.5 * (instant - t),
                *np.split(_at(rate, t, state, t + 0.5 * (instant - t)), 2),
            )
            assert min(before) > -1e-12
            reached = _at(rate, t, state, instant)
            values = np.array(guards(system, mode, instant, *np.split(reached, 2)))
            assert values.min() > -1e-9
            if kinds != {"rest"}:
                which = int(np.argmin(np.abs(values)))
                span = 1e-4 * (instant - t)
                ends = [
                    guards(
                        system,
                        mode,
                        instant + s,
                        *np.split(_at(rate, instant, reached, instant + s), 2),
                    )[which]
                    for s in (-span, span)
                ]
                slope = (ends[1] - ends[0]) / (2.0 * span)
                if abs(slope) > 1e-3:  # else a touch, or a jump to the next guard
                    shift = -values[which] / slope
                    worst[0] = max(worst[0], abs(shift))
                    reached = _at(rate, instant, reached, instant + shift)
            state = reached
        q, v = np.split(state, 2)
        impacts = [event for event in here if str(event.kind) == "impact"]
        if impacts:
            names = [contact.name for contact in model.contacts]
            hit = {names.index(name) for event in impacts for name in event.contact.split(" and ")}
            v = struck(system, mode[0], hit, instant, q, v, e)
            state = np.concatenate([q, v])
        t, mode = instant, _mode(model, dense, step)
        following = [str(event.kind) for event in motion.events if event.time > instant][:1]
        if impacts and following == ["held"]:
            continue  # what is told is behind the accumulation
        worst[1] = max(worst[1], np.abs(state[:n] - told[:n]).max())
        worst[2] = max(worst[2], np.abs(state[n:] - told[n:]).max())
    return worst


def _at(rate, begin, state, end):
    if begin == end:
        return state
    run = solve_ivp(rate, (begin, end), state, method="DOP853", rtol=1e-13, atol=1e-14)
    return run.y[:, -1]


def _mode(model, dense, step):
    closed, slides, _ = modes_of(model, dense.side[step : step + 1])
    shut = [bool(closed[0] >> i & 1) for i in range(len(model.contacts))]
    return np.array(shut), [int(each[0]) for each in slides]


def impacts_of(motion):
    return [event for event in motion.events if str(event.kind) == "impact"]


def on_left_corner(system, up):
    y = up - system.model.corner(0.25, -1.0)[1]
    return {"x": 0.0, "y": float(y), "tilt": 0.25, "velocity": (0.1, 0.0, -0.1)}


@pytest.mark.parametrize(
    ("e", "numbers"),
    [
        (0.3, {}),
        (0.3, {"mu": 0.3, "shake": 0.55, "frequency": 1.6}),
        (0.0, {"mu": 0.9, "shake": 1.2, "frequency": 2.5}),
        (0.5, {"mu": 0.25, "shake": 0.3}),
    ],
)
def test_a_block_with_two_corners_that_rub_moves_as_dop853_says(e, numbers):
    system = block(e=e, **numbers)
    motion = saltus.simulate(system, duration=15.0, **on_left_corner(system, 0.05))
    instants, places, speeds = compared(system, motion, e, 60)
    assert instants < 1e-11
    assert places < 1e-12
    assert speeds < 1e-9  # after the slowest impacts


@pytest.mark.parametrize(
    "numbers",
    [
        {},
        {"mu": 0.5, "surface": 0.05, "speed": 0.9, "unbalance": 1.0, "gravity": 1.0},
    ],
)
def test_a_rotor_that_hits_and_rubs_in_its_stator_moves_as_dop853_says(numbers):
    system = rotor(**numbers)
    motion = saltus.simulate(system, x=0.3, y=0.2, velocity=(0.5, -0.4), duration=30.0)
    assert len(motion.impacts) > 40
    assert compared(system, motion, 0.5, 100).max() < 1e-11


def test_a_rotor_that_has_let_go_of_its_stator_is_stepped_by_the_series_of_its_gap():
    """The first three coefficients of the gap are 0 there, of some starts exactly."""
    numbers = {"mu": 0.6293829672843559, "stiffness": 0.8606462200111049}
    numbers |= {"gravity": 0.47367040302442964, "surface": 0.3612973297837059}
    system = rotor(e=0.0, speed=1.0698769464801137, unbalance=1.7424553485435414, **numbers)
    start = {"x": 0.3, "y": 0.2, "velocity": (0.6447743879181587, -0.16328568241045838)}
    motion = saltus.simulate(system, **start, duration=3.0)
    kinds = [str(event.kind) for event in motion.events]
    assert kinds == ["impact", "slip", "release", "impact"]
    assert compared(system, motion, 0.0, 10).max() < 1e-11


@pytest.mark.parametrize("e", [1.0, 0.5])
def test_a_rotor_without_friction_keeps_its_angular_momentum(e):
    model = Rotor(mu=0.0, stiffness=1.0, damping=0.0, gravity=0.0, surface=0.0)
    system = System(model=model, impact=NewtonImpact(e=e))
    motion = saltus.simulate(system, x=0.3, y=0.2, velocity=(1.5, 0.9), duration=60.0)
    q, v = np.array(motion.position), np.array(motion.velocity)
    assert len(motion.impacts) > 10
    assert abs(q[0] * v[1] - q[1] * v[0] - (0.3 * 0.9 - 0.2 * 1.5)) < 1e-13
    if e == 1.0:
        energy = 0.5 * (0.3**2 + 0.2**2 + 1.5**2 + 0.9**2)
        assert abs(0.5 * (q @ q + v @ v) - energy) < 1e-12


# --- the woodpecker toy of Glocker, with the numbers of Siconos' example ---

ROD, SLEEVE, LENGTH, TO_SLEEVE, TO_BIRD = 0.0025, 0.0031, 0.0058, 0.010, 0.015
BEAK_HEIGHT, BEAK = 0.02, 0.0201
SLEEVE_MASS, BIRD_MASS, SLEEVE_INERTIA, BIRD_INERTIA = 0.0003, 0.0045, 5.0e-9, 7.0e-7
SPRING, GRAVITY = 0.0056, 9.81


@dataclass(frozen=True, kw_only=True)
class Woodpecker(saltus.ContactModel):
    """A sleeve that slides down a rod, and a bird on a spring, whose beak hits the rod."""

    mu: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("y", "sleeve", "bird")
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="beak", distance="beak", restitution=0.5),
        Contact(name="lower", distance="lower"),
        Contact(name="upper", distance="upper"),
    )

    @property
    def frictions(self):
        rates = {"beak": "beak_rate", "lower": "sleeve_rate", "upper": "sleeve_rate"}
        return tuple(
            Friction(name=f"{name} rub", rate=rate, contact=name, kinetic=self.mu)
            for name, rate in rates.items()
        )

    def beak(self, t, q, load):
        return (TO_SLEEVE + TO_BIRD - BEAK - ROD) - BEAK_HEIGHT * q[2]

    def lower(self, t, q, load):
        return (SLEEVE - ROD) + LENGTH * q[1]

    def upper(self, t, q, load):
        return (SLEEVE - ROD) - LENGTH * q[1]

    def beak_rate(self, t, q, velocity, load):
        return velocity[0] + TO_SLEEVE * velocity[1] + (TO_BIRD - BEAK) * velocity[2]

    def sleeve_rate(self, t, q, velocity, load):
        return velocity[0] + SLEEVE * velocity[1]

    def mass_matrix(self, q):
        b, m, g = BIRD_MASS, TO_SLEEVE, TO_BIRD
        return [
            [b + SLEEVE_MASS, b * m, b * g],
            [b * m, SLEEVE_INERTIA + b * m**2, b * m * g],
            [b * g, b * m * g, BIRD_INERTIA + b * g**2],
        ]

    def force(self, t, q, velocity, load):
        turn = SPRING * (q[1] - q[2])
        weight = BIRD_MASS * GRAVITY
        return (
            -(BIRD_MASS + SLEEVE_MASS) * GRAVITY,
            -weight * TO_SLEEVE - turn,
            -weight * TO_BIRD + turn,
        )


def test_a_woodpecker_comes_to_its_cycle():
    """The period and the multiplier are those of Newton's method on the return map in another
    program, which was compared with DOP853 over 150 events."""
    system = System(model=Woodpecker(), impact=NewtonImpact(e=0.0))
    start = {"y": 0.0, "sleeve": -(SLEEVE - ROD) / LENGTH, "bird": -0.2788}
    motion = saltus.simulate(system, **start, velocity=(-0.3411, 0.0, -7.4583), duration=12.0)
    pecks = np.array([each.time for each in impacts_of(motion) if each.contact == "beak"])
    one, two, three = np.diff(pecks)[-3:]
    ratio = (three - two) / (two - one)
    period = three + (three - two) * ratio / (1.0 - ratio)
    assert abs(period - 0.145976065143752) < 1e-12
    earlier = np.diff(pecks)[20:40]
    steps = np.diff(earlier)
    assert abs(steps[-1] / steps[-2] + 0.839155653) < 1e-5
    in_a_cycle = [each for each in motion.events if pecks[-3] <= each.time < pecks[-2]]
    assert {str(each.kind) for each in in_a_cycle} == {"impact", "release", "stick", "slip"}


def test_the_cycle_of_a_woodpecker_is_an_orbit_whose_height_falls():
    """Nothing depends on the height, which is left out of what returns. Period and multiplier are
    those of the test above."""
    system = System(model=Woodpecker(), impact=NewtonImpact(e=0.0))
    start = {"y": 0.0, "sleeve": -(SLEEVE - ROD) / LENGTH, "bird": -0.2788}
    orbit = saltus.find_orbit(
        system, **start, velocity=(-0.3411, 0.0, -7.4583), settle=3.0, period=0.146
    )
    assert abs(orbit.period - 0.145976065143752) < 1e-13
    assert orbit.stable
    assert abs(orbit.multipliers[0] + 0.839155653) < 1e-8
    assert np.abs(orbit.multipliers[1:]).max() < 1e-12
    motion = orbit.motion()
    fallen = motion.at(motion.time)[0][0] - motion.at(motion.start)[0][0]
    settled = saltus.simulate(system, **start, velocity=(-0.3411, 0.0, -7.4583), duration=12.0)
    pecks = [each.time for each in impacts_of(settled) if each.contact == "beak"]
    assert fallen == pytest.approx(np.diff(settled.at(pecks[-2:])[0][0])[0], rel=1e-5)


# --- statics, and the same contacts of coordinates ---


@pytest.mark.parametrize("static", [None, 0.6])
def test_a_block_on_both_feet_slips_where_the_push_is_what_both_can_carry(static):
    """The feet stick together along one line, so that their shares are not known: their sum is."""
    system = block(mu=0.3, static=static)
    quiet = System(
        model=system.model,
        load=Load(frequency=0.5, push=Harmonic(1.0)),
        impact=system.impact,
    )
    motion = saltus.simulate(quiet, x=0.0, y=0.8, tilt=0.0, velocity=(0.0, 0.0, 0.0), duration=3.0)
    slips = [each.time for each in motion.events if str(each.kind) == "slip"]
    most = 0.3 if static is None else static
    np.testing.assert_allclose(slips[0], math.asin(most) / 0.5, rtol=1e-13)


@dataclass(frozen=True, kw_only=True)
class Row(saltus.ContactModel):
    """Two balls between walls under a load, with gaps that are sums or distances."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("push",)

    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="left", distance="first"),
        Contact(name="between", distance="second"),
        Contact(name="right", distance="third"),
    )

    def first(self, t, q, load):
        return q[0] + 1.0

    def second(self, t, q, load):
        return q[1] - q[0] - 0.3

    def third(self, t, q, load):
        return 1.2 - q[1]

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, 0.7]]

    def force(self, t, q, velocity, load):
        return load.push(t) - 0.1 * velocity[0] - q[0], 0.4 * load.push(t) - 2.0 * q[1]


class RowOfSums(Row):
    """The same in coordinates of gaps."""

    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="left", coordinate="x", position=-1.0),
        Contact(name="between", coordinate={"y": 1.0, "x": -1.0}, position=0.3),
        Contact(name="right", coordinate="y", position=1.2, sign=-1),
    )


@pytest.mark.parametrize("e", [0.9, 0.4, 0.0])
def test_distances_that_are_sums_move_as_sums(e):
    load = Load(frequency=1.3, push=Harmonic(1.5))
    start = {"x": -0.2, "y": 0.5, "velocity": (0.3, -0.4), "duration": 20.0}
    one, other = (
        saltus.simulate(System(model=kind(), load=load, impact=NewtonImpact(e=e)), **start)
        for kind in (Row, RowOfSums)
    )
    assert len(one.impacts) == len(other.impacts) > 10
    assert [(each.kind, each.contact) for each in one.events] == [
        (each.kind, each.contact) for each in other.events
    ]
    np.testing.assert_allclose(
        [each.time for each in one.events], [each.time for each in other.events], atol=1e-9
    )
    np.testing.assert_allclose(one.position, other.position, atol=1e-9)


@dataclass(frozen=True, kw_only=True)
class Ball(saltus.ContactModel):
    """A ball that falls on a table, which may shake."""

    coordinates: ClassVar[tuple[str, ...]] = ("y",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="table", distance="height"),)

    def height(self, t, q, load):
        return q - load.ground(t)

    def force(self, t, q, velocity, load):
        return -1.0


def test_a_ball_bounces_to_rest_in_the_time_of_a_geometric_series():
    system = System(model=Ball(), impact=NewtonImpact(e=0.6))
    motion = saltus.simulate(system, y=2.0, velocity=0.0, duration=20.0)
    assert abs(motion.rest_time - 2.0 * (1.0 + 0.6) / (1.0 - 0.6)) < 1e-12
    assert (motion.y, motion.velocity) == (0.0, 0.0)


def test_a_ball_on_a_shaken_table_leaves_it_where_the_table_falls_as_fast():
    """Z w^2 sin(w t) = 1 for a table at Z sin(w t)."""
    shaken = Load(frequency=2.0, ground=Harmonic(0.5))
    system = System(model=Ball(), load=shaken, impact=NewtonImpact(e=0.0))
    motion = saltus.simulate(system, y=0.0, velocity=1.0, duration=2.0)
    releases = [each.time for each in motion.events if str(each.kind) == "release"]
    np.testing.assert_allclose(releases[0], math.asin(1.0 / (0.5 * 4.0)) / 2.0, rtol=1e-12)


def test_a_ball_flies_far_over_a_shaken_table():
    """Its own series ends, but that of its distance from the table does not."""
    shaken = Load(frequency=1.0, ground=Harmonic(1.3))
    system = System(model=Ball(), load=shaken, impact=NewtonImpact(e=0.9))
    motion = saltus.simulate(system, y=1.0, velocity=3.0, duration=14.0)

    def distance(t, state):
        return state[0] - 1.3 * np.sin(t)

    distance.terminal = True
    distance.direction = -1
    flight = solve_ivp(
        lambda t, state: [state[1], -1.0],
        (0.0, 14.0),
        [1.0, 3.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        max_step=0.5,
        events=distance,
    )
    np.testing.assert_allclose(motion.impacts.time[0], flight.t_events[0][0], rtol=1e-12)


# --- derivatives ---


def differences(system, start, path, duration, step=1e-6):
    """The central difference of the state at the end, along a number of the system."""
    ends = []
    for moved in (step, -step):
        other = system.with_({path: system.get(path) + moved})
        motion = saltus.simulate(other, **start, duration=duration)
        ends.append(np.append(motion.position, motion.velocity))
    return (ends[0] - ends[1]) / (2.0 * step)


FEET = block(e=0.0, mu=0.9, shake=1.2, frequency=2.5)
STATOR = rotor(e=0.0)
IN_STATOR = {"x": 0.3, "y": 0.2, "velocity": (0.5, -0.4)}


@pytest.mark.parametrize("path", ["model.mu", "model.height", "load.push.amplitude"])
def test_derivatives_of_a_block_are_those_of_differences(path):
    """Impacts of a corner while the other one is closed, which lets it go, and slips."""
    start = on_left_corner(FEET, 0.05)
    found = saltus.sensitivities(FEET, parameters=[path], **start, duration=6.0)
    assert [str(each.kind) for each in found.motion.events].count("impact") == 3
    expected = differences(FEET, start, path, 6.0)
    np.testing.assert_allclose(found.parameters[:, 0], expected, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("path", ["model.mu", "model.room", "model.surface", "impact.e"])
def test_derivatives_of_a_rotor_are_those_of_differences(path):
    """It hits, turns round, sticks, slips and is released, twice."""
    system = rotor(e=0.5) if path == "impact.e" else STATOR
    duration = 3.0 if path == "impact.e" else 9.0
    found = saltus.sensitivities(system, parameters=[path], **IN_STATOR, duration=duration)
    kinds = {str(each.kind) for each in found.motion.events}
    assert kinds >= ({"impact"} if path == "impact.e" else {"impact", "stick", "slip", "release"})
    expected = differences(system, IN_STATOR, path, duration)
    np.testing.assert_allclose(found.parameters[:, 0], expected, rtol=1e-7, atol=1e-8)


def test_derivatives_to_the_state_are_those_of_differences():
    found = saltus.sensitivities(STATOR, **IN_STATOR, duration=6.0)
    state = np.array([0.3, 0.2, 0.5, -0.4])
    for i in range(4):
        ends = []
        for step in (1e-6, -1e-6):
            x, y, u, v = state + step * np.eye(4)[i]
            motion = saltus.simulate(STATOR, x=x, y=y, velocity=(u, v), duration=6.0)
            ends.append(np.append(motion.position, motion.velocity))
        expected = (ends[0] - ends[1]) / 2e-6
        np.testing.assert_allclose(found.state[:, i], expected, rtol=1e-7, atol=1e-8)
    # the sticking rotor forgets all but where it is on the stator
    assert np.linalg.matrix_rank(found.state, tol=1e-9) < 4


def test_derivatives_of_the_time_to_rest_are_those_of_its_closed_form():
    """It is sqrt(2 h) (1 + e) / (1 - e) for a fall from h."""
    system = System(model=Ball(), impact=NewtonImpact(e=0.5))
    found = saltus.sensitivities(system, parameters=["impact.e"], y=2.0, velocity=0.0, duration=9.0)
    rest = [str(each.kind) for each in found.motion.events].index("held")
    by_height = 0.5 * 3.0  # 3 / sqrt(2 h)
    by_loss = 2.0 * 2.0 / 0.5**2
    np.testing.assert_allclose(found.event_times[rest, [0, 2]], [by_height, by_loss], rtol=1e-8)
    np.testing.assert_allclose(found.state, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("system", "start", "path", "duration"),
    [
        (rotor(e=0.3), IN_STATOR, "model.mu", 7.0),
        (block(e=0.3), on_left_corner(block(e=0.3), 0.05), "model.mu", 3.0),
        (
            System(
                model=Ball(),
                load=Load(frequency=2.0, ground=Harmonic(0.05)),
                impact=NewtonImpact(e=0.5),
            ),
            {"y": 0.5, "velocity": 0.3},
            "load.ground.amplitude",
            9.0,
        ),
    ],
)
def test_derivatives_through_accumulations_are_those_of_differences(system, start, path, duration):
    found = saltus.sensitivities(system, parameters=[path], **start, duration=duration)
    assert "held" in {str(each.kind) for each in found.motion.events}
    expected = differences(system, start, path, duration)
    np.testing.assert_allclose(found.parameters[:, 0], expected, rtol=1e-6, atol=1e-8)


# --- rows, and what is refused ---


def test_rows_are_the_derivatives_of_gaps_and_speeds():
    """Entries of the trace beside complex steps of the model's own methods."""
    from saltus.flow.programs.compiled import contact_rows_at, program

    system = rotor()
    model = system.model
    run = program(system, ())
    q, v = np.array([0.3, -0.5]), np.array([0.7, 0.2])
    entries, drifts, gaps = contact_rows_at(run, 0.3, 0.0, np.concatenate([q, v]))
    contact, friction = np.column_stack([entries, drifts])
    (gap,) = gaps
    step = 1e-30j
    for i, e in enumerate(np.eye(2)):
        assert abs(contact[i] - model.clearance(0.3, q + step * e, None).imag / 1e-30) < 1e-15
        assert abs(friction[i] - model.rub_speed(0.3, q, v + step * e, None).imag / 1e-30) < 1e-15
    assert abs(gap - model.clearance(0.3, q, None)) < 1e-15
    assert abs(friction[:2] @ v + friction[2] - model.rub_speed(0.3, q, v, None)) < 1e-15
    assert contact[2] == 0.0


@dataclass(frozen=True, kw_only=True)
class Feet(saltus.ContactModel):
    """A body on three feet in a row, of which two carry it in many ways."""

    coefficients: tuple[float, ...] = (0.1, 0.3, 0.2)

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "tilt")
    contacts: ClassVar[tuple[Contact, ...]] = tuple(
        Contact(name=name, distance=name) for name in ("left", "middle", "right")
    )

    @property
    def frictions(self):
        return tuple(
            Friction(name=f"{contact.name} rub", rate="slip", contact=contact.name, kinetic=mu)
            for contact, mu in zip(self.contacts, self.coefficients, strict=True)
        )

    def left(self, t, q, load):
        return q[1] - q[2]

    def middle(self, t, q, load):
        return q[1]

    def right(self, t, q, load):
        return q[1] + q[2]

    def slip(self, t, q, velocity, load):
        return velocity[0] + 0.5 * velocity[2]

    def mass_matrix(self, q):
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.4]]

    def force(self, t, q, velocity, load):
        return 0.0 * q[0], -1.0, 0.0


def test_three_feet_slide_to_rest_where_their_shares_do_not_matter():
    system = System(model=Feet(coefficients=(0.2, 0.2, 0.2)), impact=NewtonImpact(e=0.0))
    motion = saltus.simulate(system, x=0.0, y=0.0, tilt=0.0, velocity=(1.0, 0.0, 0.0), duration=9.0)
    assert abs(motion.x - 1.0 / (2.0 * 0.2)) < 1e-12
    assert abs(motion.rest_time - 1.0 / 0.2) < 1e-12


def test_three_feet_whose_shares_matter_are_refused():
    system = System(model=Feet(), impact=NewtonImpact(e=0.0))
    with pytest.raises(
        MotionError, match="depends on reactions that rigid bodies do not determine"
    ):
        saltus.simulate(system, x=0.0, y=0.0, tilt=0.0, velocity=(1.0, 0.0, 0.0), duration=9.0)
    standing = saltus.simulate(
        system, x=0.0, y=0.0, tilt=0.0, velocity=(0.0, 0.0, 0.0), duration=3.0
    )
    np.testing.assert_allclose(standing.position, 0.0, atol=1e-12)


class Pressed(Ball):
    """A ball between a table that rises and a ceiling."""

    contacts = (
        Contact(name="table", distance="height"),
        Contact(name="ceiling", distance="room"),
    )

    def room(self, t, q, load):
        return 1.2 - q


@pytest.mark.parametrize("e", [0.6, 0.0])
def test_a_ball_that_a_table_crushes_at_a_ceiling_is_refused_by_name(e):
    load = Load(frequency=1.0, ground=Harmonic(1.5))
    system = System(model=Pressed(), load=load, impact=NewtonImpact(e=e))
    when = f"{math.asin(1.2 / 1.5):.9g}"  # when the table is as high
    with pytest.raises(MotionError, match=f"'table' and 'ceiling' at time {when}"):
        saltus.simulate(system, y=0.6, velocity=0.0, duration=3.0)


def test_other_verbs_refuse_distances_in_one_sentence():
    system = rotor()
    for verb in (
        lambda: saltus.to_jax(system, periods=1),
        lambda: saltus.orbits.is_symmetric(system),
        lambda: saltus.page(system, x=0.3, y=0.2, velocity=(0.0, 0.0), path="none.html"),
    ):
        with pytest.raises(ParameterError, match="does not follow contacts of a distance"):
            verb()


def test_derivatives_of_ensembles_are_refused_in_one_sentence():
    with pytest.raises(ParameterError, match="one motion at a time"):
        saltus.simulate_many(
            rotor(), x=[0.3], y=[0.2], velocity=(0.0, 0.0), periods=1, sensitivities=()
        )


def test_parts_with_both_or_neither_are_refused():
    with pytest.raises(ParameterError, match="got neither"):
        Contact(name="wall")
    with pytest.raises(ParameterError, match="got both"):
        Friction(name="rub", coordinate="x", rate="slip", kinetic=0.1)
    with pytest.raises(ParameterError, match="leave its position out"):
        Contact(name="wall", distance="height", position=1.0)


def test_a_distance_that_is_no_method_is_refused():
    class Lost(Ball):
        contacts = (Contact(name="table", distance="hight"),)

    with pytest.raises(ParameterError, match=r"needs a method hight\(t, q, load\) of Lost"):
        System(model=Lost(), impact=NewtonImpact(e=0.5))


def test_a_rate_that_is_not_linear_is_refused():
    class Bent(Rotor):
        def rub_speed(self, t, q, velocity, load):
            return velocity[0] * velocity[0]

    with pytest.raises(TraceError, match="must be linear in the velocities"):
        System(model=Bent(), impact=NewtonImpact(e=0.5))


def test_a_start_beyond_a_distance_is_refused():
    with pytest.raises(ParameterError, match="lies beyond the contact 'stator'"):
        saltus.simulate(rotor(), x=1.3, y=0.0, velocity=(0.0, 0.0), periods=1)


def test_poissons_law_with_two_corners_gives_no_energy():
    load = Load(frequency=2.2, push=Harmonic(0.0))
    system = System(model=Block(mu=0.3), load=load, impact=PoissonImpact(e=0.5))
    motion = saltus.simulate(system, duration=6.0, **on_left_corner(system, 0.3))
    energy = []
    for event in impacts_of(motion):
        v = np.array([event.velocity_before, event.velocity_after])
        energy.append(0.5 * (v**2 @ np.array([1.0, 1.0, system.model.inertia])))
    energies = np.array(energy)
    assert len(energies) > 5
    assert np.all(energies[:, 1] <= energies[:, 0] * (1.0 + 1e-12))


def test_the_order_of_contacts_decides_nothing():
    class Turned(Block):
        contacts = Block.contacts[::-1]

        @property
        def frictions(self):
            return super().frictions[::-1]

    load = Load(frequency=2.2, push=Harmonic(0.6))
    one, other = (
        saltus.simulate(system, duration=12.0, **on_left_corner(system, 0.05))
        for system in (
            System(model=kind(), load=load, impact=NewtonImpact(e=0.3)) for kind in (Block, Turned)
        )
    )
    assert len(one.impacts) == len(other.impacts)
    np.testing.assert_allclose(one.position, other.position, atol=1e-11)


def test_the_trace_has_a_row_for_each_part():
    traced = trace(block())
    assert traced.multipliers == 4
    assert len(traced.rows) == 4 * 4 + 2


@dataclass(frozen=True, kw_only=True)
class Slider(saltus.ContactModel):
    """A mass on a belt with a soft stop: no contact, a friction of a rate, and a surface."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("push",)
    surfaces: ClassVar[tuple[saltus.Surface, ...]] = (
        saltus.Surface(name="stop", coordinate="x", position=0.2),
    )
    frictions: ClassVar[tuple[Friction, ...]] = (
        Friction(name="belt", rate="slip", kinetic=0.2, static=0.3, ground_speed=0.2),
    )

    def slip(self, t, q, velocity, load):
        return velocity[0]

    def force(self, t, q, velocity, load, sides):
        push = load.push(t) - q[0] - 2.0 * (1.0 + sides.stop) * (q[0] - 0.2)
        return push + 0.3 * q[1], -2.0 * q[1] + 0.3 * q[0]


class SliderOfCoordinate(Slider):
    frictions = (Friction(name="belt", coordinate="x", kinetic=0.2, static=0.3, ground_speed=0.2),)


def test_a_friction_of_a_rate_beside_a_surface_moves_as_that_of_a_coordinate():
    load = Load(frequency=0.9, push=Harmonic(0.4))
    one, other = (
        saltus.simulate(
            System(model=kind(), load=load), x=0.1, y=0.0, velocity=(0.0, 0.1), duration=30.0
        )
        for kind in (Slider, SliderOfCoordinate)
    )
    assert {str(each.kind) for each in one.events} >= {"stick", "slip", "crossing"}
    assert [each.kind for each in one.events] == [each.kind for each in other.events]
    np.testing.assert_allclose(
        [each.time for each in one.events], [each.time for each in other.events], rtol=1e-12
    )
    np.testing.assert_allclose(one.position, other.position, atol=1e-12)
