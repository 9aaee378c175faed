"""Gaps that are no linear functions of the coordinates: corners on planes and curved walls, against
SciPy and closed forms.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import Contact, ContactModel, Friction, Load, NewtonImpact, Surface, System
from saltus.flow import sensitivities, simulate, simulate_many
from saltus.systems.contracts.model import SLOPES, Jet
from saltus.taylor.rules import FUNCTIONS


@dataclass(frozen=True, kw_only=True)
class FallingBlock(ContactModel):
    """A block of mass 1 that falls on one of its corners, which lies at the height y -
    depth(tilt).
    """

    half_width: float = 0.4
    half_height: float = 0.7
    inertia: float = 0.2
    drag: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "tilt")
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="corner", coordinate={"y": 1.0, "depth": -1.0}),
    )

    def depth(self, q):
        return self.half_height * np.cos(q[2]) + self.half_width * np.sin(q[2])

    def mass_matrix(self, q):
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, self.inertia]]

    def force(self, t, q, velocity, load):
        return -self.drag * velocity[0], -1.0 - self.drag * velocity[1], -self.drag * velocity[2]

    def kinetic_energy(self, t, q, velocity, side, load):
        return 0.5 * (velocity[0] ** 2 + velocity[1] ** 2 + self.inertia * velocity[2] ** 2)


START = {"x": 0.0, "y": 2.0, "tilt": 0.3, "velocity": (0.1, 0.0, 0.4)}


def by_scipy(mass, force, gap, slope, e, state, duration):
    """The motion of M q'' = f with impacts at gap(t, q) = 0, whose derivatives `slope` gives: the
    state and the times.
    """
    n, t, times = len(state) // 2, 0.0, []

    def rate(t, s):
        return np.concatenate([s[n:], np.linalg.solve(mass(s[:n]), force(t, s[:n], s[n:]))])

    def touches(t, s):
        return gap(t, s[:n])

    touches.terminal, touches.direction = True, -1
    while True:
        run = solve_ivp(
            rate,
            (t, duration),
            state,
            method="DOP853",
            rtol=2e-13,
            atol=1e-14,
            events=touches,
            max_step=0.02,
        )
        t, state = run.t[-1], run.y[:, -1].copy()
        if run.status == 0:
            return state, times
        times.append(t)
        assert len(times) < 50
        by_q, by_t = slope(t, state[:n])
        pushed = np.linalg.solve(mass(state[:n]), by_q)
        state[n:] -= (1.0 + e) * (by_q @ state[n:] + by_t) / (by_q @ pushed) * pushed


def block_by_scipy(model, e, state, duration):
    a, b = model.half_height, model.half_width
    return by_scipy(
        lambda q: np.diag([1.0, 1.0, model.inertia]),
        lambda t, q, v: np.array([0.0, -1.0, 0.0]) - model.drag * v,
        lambda t, q: q[1] - a * np.cos(q[2]) - b * np.sin(q[2]),
        lambda t, q: (np.array([0.0, 1.0, a * np.sin(q[2]) - b * np.cos(q[2])]), 0.0),
        e,
        np.array(state),
        duration,
    )


BLOCK = System(model=FallingBlock(drag=0.05), impact=NewtonImpact(e=0.5))


@pytest.mark.parametrize("e", [0.5, 0.9])
def test_a_block_that_falls_on_its_corner_moves_as_scipy_has_it(e):
    motion = simulate(BLOCK.with_(impact=NewtonImpact(e=e)), **START, duration=5.0)
    state, times = block_by_scipy(BLOCK.model, e, [0.0, 2.0, 0.3, 0.1, 0.0, 0.4], 5.0)
    assert len(times) > 2
    np.testing.assert_allclose(motion.impacts.time, times, rtol=0, atol=1e-11)
    np.testing.assert_allclose(motion.final_state, state, rtol=0, atol=1e-11)


def test_events_have_the_velocities_of_the_own_coordinates_without_the_dense_motion_too():
    motion, short = (simulate(BLOCK, **START, duration=5.0, dense=dense) for dense in (True, False))
    assert short.dense is None
    np.testing.assert_array_equal(short.impacts.velocity_before, motion.impacts.velocity_before)
    for event in motion.events:
        (_, _, tilt), before = motion.at(np.nextafter(event.time, -np.inf))
        np.testing.assert_allclose(event.velocity_before, before, rtol=0, atol=1e-12)
        # of the gap, along M^-1 of which velocities jump
        slope = np.array([0.0, 1.0, 0.7 * np.sin(tilt) - 0.4 * np.cos(tilt)])
        jump = np.subtract(event.velocity_after, event.velocity_before)
        np.testing.assert_allclose(
            jump, event.impulse[0] * slope / [1.0, 1.0, 0.2], rtol=0, atol=1e-12
        )
        assert slope @ event.velocity_after == pytest.approx(
            -0.5 * slope @ event.velocity_before, abs=1e-12
        )


def test_a_corner_that_is_held_stays_on_its_plane_and_keeps_the_energy():
    system = System(model=FallingBlock(), impact=NewtonImpact(e=0.0))
    motion = simulate(system, x=0.0, y=1.0, tilt=2.1, velocity=(0.1, 0.0, 0.0), duration=4.0)
    assert (len(motion.events), motion.closed) == (1, ("corner",))
    times = np.linspace(motion.impacts.time[0], motion.time, 400)
    q, v = motion.at(times)
    assert np.ptp(q[2]) > 4.0
    gap = q[1] - 0.7 * np.cos(q[2]) - 0.4 * np.sin(q[2])
    rate = v[1] + (0.7 * np.sin(q[2]) - 0.4 * np.cos(q[2])) * v[2]
    assert max(abs(gap).max(), abs(rate).max()) < 1e-14
    assert np.ptp(0.5 * (v[0] ** 2 + v[1] ** 2 + 0.2 * v[2] ** 2) + q[1]) < 1e-13
    np.testing.assert_allclose(v[0], 0.1, rtol=0, atol=1e-14)  # smooth: nothing pushes it along


PATHS = ("model.half_width", "model.inertia", "impact.e")


def differences(system, begin, paths, end, step=1e-5):
    """The derivatives of `end(system, start)` to the start and to parameters by differences of the
    fourth order.
    """

    def along(move):
        one, two = (end(*move(step)) - end(*move(-step)) for step in (step, 2 * step))
        return (8.0 * one - two) / (12.0 * step)

    starts = [along(lambda h, u=unit: (system, begin + h * u)) for unit in np.eye(len(begin))]
    return np.array(
        [
            *starts,
            *(along(lambda h, p=p: (system.with_({p: system.get(p) + h}), begin)) for p in paths),
        ]
    ).T


def start_of(x):
    return {"x": x[0], "y": x[1], "tilt": x[2], "velocity": tuple(x[3:])}


BEGIN = np.array([0.0, 2.0, 0.3, 0.1, 0.0, 0.4])


@pytest.mark.parametrize("duration", [pytest.param(2.5, marks=pytest.mark.thorough), 5.0])
def test_derivatives_are_those_of_differences(duration):
    found = sensitivities(BLOCK, **START, duration=5.0, parameters=PATHS)
    wanted = differences(
        BLOCK,
        BEGIN,
        PATHS,
        lambda system, x: simulate(system, **start_of(x), duration=duration).final_state,
    )
    np.testing.assert_allclose(found.at(duration), wanted, rtol=0, atol=2e-9)
    if duration == 5.0:
        np.testing.assert_allclose(
            np.hstack([found.state, found.parameters]), wanted, rtol=0, atol=2e-9
        )
        times = differences(
            BLOCK,
            BEGIN,
            PATHS,
            lambda system, x: simulate(system, **start_of(x), duration=5.0).impacts.time,
        )
        np.testing.assert_allclose(found.event_times, times, rtol=0, atol=2e-9)


def test_many_motions_are_those_one_by_one():
    heights = np.linspace(1.5, 2.5, 7)
    many = simulate_many(
        BLOCK, x=0.0, y=heights, tilt=0.3, velocity=(0.1, 0.0, 0.4), duration=5.0, sensitivities=()
    )
    for i, y in enumerate(heights):
        one = sensitivities(BLOCK, **START | {"y": y}, duration=5.0)
        np.testing.assert_allclose(many.tilt.values[i], one.motion.tilt, rtol=0, atol=1e-12)
        np.testing.assert_allclose(many.derivative.values[i], one.state, rtol=1e-11, atol=1e-11)


@dataclass(frozen=True, kw_only=True)
class RoughBlock(FallingBlock):
    """The same on a rough plane: the corner lies at x - shift(tilt)."""

    friction: float = 0.3

    @property
    def frictions(self):
        return (
            Friction(
                name="sole",
                coordinate={"x": 1.0, "shift": -1.0},
                kinetic=self.friction,
                contact="corner",
            ),
        )

    def shift(self, q):
        return self.half_width * np.cos(q[2]) - self.half_height * np.sin(q[2])


def test_a_block_whose_corner_sticks_turns_about_it():
    """The impact turns what is left into spin about the corner: with I_c = I + a^2 + b^2, I_c w+ =
    I w- + r x v-.
    """
    system = System(model=RoughBlock(friction=0.5), impact=NewtonImpact(e=0.0))
    motion = simulate(system, x=0.0, y=1.2, tilt=0.45, velocity=(0.0, 0.0, 0.3), duration=1.8)
    (hit,) = motion.events
    (_, _, tilt), _ = motion.at(hit.time)
    # the centre from it
    across, above = 0.4 * np.cos(tilt) - 0.7 * np.sin(tilt), 0.7 * np.cos(tilt) + 0.4 * np.sin(tilt)
    about = 0.2 + 0.4**2 + 0.7**2
    moment = 0.2 * hit.velocity_before[2] + (
        across * hit.velocity_before[1] - above * hit.velocity_before[0]
    )
    np.testing.assert_allclose(hit.velocity_after[2], moment / about, rtol=0, atol=1e-12)
    times = np.linspace(hit.time, motion.time, 50)
    q, v = motion.at(times)
    assert np.ptp(q[0] - 0.4 * np.cos(q[2]) + 0.7 * np.sin(q[2])) < 1e-14
    assert np.ptp(0.5 * about * v[2] ** 2 + q[1]) < 1e-13


@dataclass(frozen=True, kw_only=True)
class TwoCorners(FallingBlock):
    """The same with both corners: the tilt follows from the difference of their heights."""

    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="left", coordinate={"y": 1.0, "height": -1.0, "lean": 1.0}),
        Contact(name="right", coordinate={"y": 1.0, "height": -1.0, "lean": -1.0}),
    )

    def height(self, q):
        return self.half_height * np.cos(q[2])

    def lean(self, q):
        return self.half_width * np.sin(q[2])

    def lean_inverse(self, value):
        s = value / self.half_width
        return np.arctan(s / np.sqrt(1.0 - s * s))


def test_a_block_with_two_corners_moves_as_with_one_until_the_other_one_hits_and_comes_to_rest_on_both():
    begin = {"x": 0.0, "y": 1.2, "tilt": 0.1, "velocity": (0.1, 0.0, 0.1)}
    flat = [
        model(drag=0.05, half_width=0.8, half_height=0.4) for model in (TwoCorners, FallingBlock)
    ]
    motion, one = (
        simulate(System(model=model, impact=NewtonImpact(e=0.5)), **begin, duration=20.0)
        for model in flat
    )
    first, second = motion.events[:2]
    assert (first.contact, second.contact) == ("right", "left")
    np.testing.assert_allclose(
        motion.at(second.time - 1e-9), one.at(second.time - 1e-9), rtol=0, atol=1e-12
    )
    before, after = motion.at(second.time - 1e-12), motion.at(second.time)
    assert abs(before[0][1] - 0.4 * np.cos(before[0][2]) + 0.8 * np.sin(before[0][2])) < 1e-11
    rate = [v[1] + (0.4 * np.sin(q[2]) + 0.8 * np.cos(q[2])) * v[2] for q, v in (before, after)]
    assert rate[1] == pytest.approx(-0.5 * rate[0], abs=1e-10)
    assert motion.closed == ("left", "right")
    np.testing.assert_allclose(
        [motion.y, motion.tilt, *motion.velocity[1:]], [0.4, 0.0, 0.0, 0.0], rtol=0, atol=1e-13
    )


def test_a_block_with_two_corners_that_turns_on_its_side_ends_there_by_name():
    """There the tilt does not follow from the heights of the corners any more; free fall with a
    constant spin before it.
    """
    system = System(model=TwoCorners(), impact=NewtonImpact(e=0.5))
    motion = simulate(system, x=0.0, y=50.0, tilt=0.3, velocity=(0.1, 0.0, 0.7), duration=9.0)
    assert (str(motion.stop), motion.limit) == ("limit", "lean turns")
    # the slope ends at 2^-18, not at 0
    assert motion.time == pytest.approx((math.pi / 2 - 0.3) / 0.7, abs=5e-5)
    for tilt in (2.0, 2.0 * math.pi):
        with pytest.raises(saltus.ParameterError, match="a state lies beyond where lean turns"):
            simulate(system, x=0.0, y=50.0, tilt=tilt, duration=1.0)
    many = simulate_many(
        system, x=0.0, y=50.0, tilt=[0.3, -0.3], velocity=(0.1, 0.0, 0.7), duration=2.0
    )
    assert many.tilt.values[1] == pytest.approx(1.1, abs=1e-12)
    np.testing.assert_allclose(many.time, [motion.time, 2.0], rtol=0, atol=1e-6)


@dataclass(frozen=True, kw_only=True)
class Bob(ContactModel):
    """A pendulum over a floor, in the coordinate of its angle: its height is 1 - cos(angle)."""

    floor: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("angle",)

    @property
    def contacts(self):
        return (Contact(name="floor", coordinate={"height": 1.0}, position=self.floor),)

    def height(self, angle):
        return 1.0 - np.cos(angle)

    def force(self, t, angle, velocity, load):
        return -np.sin(angle)


class HighBob(Bob):
    """The same on the side of positive angles."""

    def height_inverse(self, height):
        return 2.0 * np.arctan(np.sqrt(height / (2.0 - height)))


def test_a_pendulum_over_a_floor_returns_after_its_time_between_two_angles():
    """From rest at A to the floor at a without loss: the integral of 1 / sqrt(2 (cos x - cos A)),
    an elliptic one.
    """
    from scipy.special import ellipk, ellipkinc

    k, floor = math.sin(0.75), math.acos(0.8)
    down = ellipk(k**2) - ellipkinc(math.asin(math.sin(floor / 2) / k), k**2)
    motion = simulate(
        System(model=HighBob(), impact=NewtonImpact(e=1.0)), angle=1.5, duration=7 * down
    )
    np.testing.assert_allclose(
        motion.impacts.time,
        down * np.array([1.0, 3.0, 5.0, 7.0])[: len(motion.impacts)],
        rtol=0,
        atol=1e-12,
    )
    assert len(motion.impacts) >= 3
    speeds = motion.impacts.velocity_after[:3, 0]
    np.testing.assert_allclose(speeds, math.sqrt(2 * (0.8 - math.cos(1.5))), rtol=0, atol=1e-12)
    energy = 0.5 * motion.at(6.5 * down)[1] ** 2 - np.cos(motion.at(6.5 * down)[0])
    assert energy == pytest.approx(-math.cos(1.5), abs=1e-13)


@dataclass(frozen=True, kw_only=True)
class Bead(ContactModel):
    """A body of mass 1 over the curved ground y = c (1 - cos(x)) + zeta(t), which moves up and
    down.
    """

    depth: float = 0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("ground",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="ground", coordinate={"y": 1.0, "valley": -1.0, "ground": -1.0}),
    )

    def valley(self, q):
        return self.depth * (1.0 - np.cos(q[0]))

    def force(self, t, q, velocity, load):
        return -0.1 * velocity[0], -1.0 - 0.1 * velocity[1]


def test_a_body_over_curved_ground_that_moves_is_that_of_scipy():
    load = Load(frequency=2.5, ground=saltus.Harmonic(amplitude=0.25, phase=0.3))
    system = System(model=Bead(), load=load, impact=NewtonImpact(e=0.7))
    motion = simulate(system, x=0.8, y=0.9, velocity=(0.3, 0.0), duration=8.0)
    state, times = by_scipy(
        lambda q: np.eye(2),
        lambda t, q, v: np.array([0.0, -1.0]) - 0.1 * v,
        lambda t, q: q[1] - 0.3 * (1.0 - np.cos(q[0])) - load.ground(t),
        lambda t, q: (np.array([-0.3 * np.sin(q[0]), 1.0]), -load.ground.velocity(t)),
        0.7,
        np.array([0.8, 0.9, 0.3, 0.0]),
        8.0,
    )
    assert len(times) > 4
    np.testing.assert_allclose(motion.impacts.time, times, rtol=0, atol=1e-10)
    np.testing.assert_allclose(motion.final_state, state, rtol=0, atol=1e-10)


def test_a_body_that_slides_in_a_curved_valley_swings_as_its_own_equation_has_it():
    """(1 + f'^2) x'' = -(f' f'' x'^2 + f'), f = c (1 - cos x), while the contact is closed; without
    damping.
    """
    model = type(
        "Free", (Bead,), {"force": lambda self, t, q, velocity, load: (0.0 * q[0], -1.0)}
    )()
    motion = simulate(
        System(model=model, impact=NewtonImpact(e=0.0)),
        x=0.8,
        y=0.3 * (1.0 - math.cos(0.8)),
        duration=20.0,
    )

    def rate(t, s):
        slope, bend = 0.3 * np.sin(s[0]), 0.3 * np.cos(s[0])
        return [s[1], -(slope * bend * s[1] ** 2 + slope) / (1.0 + slope**2)]

    run = solve_ivp(rate, (0.0, 20.0), [0.8, 0.0], method="DOP853", rtol=2e-13, atol=1e-14)
    assert motion.closed == ("ground",)
    np.testing.assert_allclose([motion.x, motion.velocity[0]], run.y[:, -1], rtol=0, atol=1e-10)
    q, v = motion.at(np.linspace(0.0, 20.0, 100))
    assert abs(q[1] - 0.3 * (1.0 - np.cos(q[0]))).max() < 1e-14
    assert np.ptp(0.5 * (v**2).sum(axis=0) + q[1]) < 1e-13


@pytest.mark.thorough
def test_a_body_in_a_valley_that_shakes_swings_at_half_the_frequency():
    """Parametrically, held on the ground: of its four multipliers two are 0, and two have the
    product exp(-c T).
    """
    load = Load(frequency=1.0, ground=saltus.Harmonic(amplitude=0.85))
    system = System(model=Bead(), load=load, impact=NewtonImpact(e=0.5))
    motion = simulate(system, x=0.3, y=2.0, velocity=(0.0, 0.0), periods=400)
    orbit = saltus.find_orbit(system, x=motion.x, y=motion.y, velocity=motion.velocity)
    assert (orbit.period, orbit.stable) == (2, True)
    sizes = np.sort(abs(orbit.multipliers))
    np.testing.assert_allclose(
        sizes, [0.0, 0.0, *2 * [math.exp(-0.1 * 2.0 * math.pi)]], rtol=0, atol=1e-9
    )
    verdict = saltus.classify(system, x=0.3, y=2.0)
    assert (str(verdict.kind), verdict.period) == ("periodic", 2)


@dataclass(frozen=True, kw_only=True)
class OverSoftGround(ContactModel):
    """A body over curved ground that gives way, with the stiffness k along its height over it."""

    stiffness: float = 30.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    surfaces: ClassVar[tuple[Surface, ...]] = (
        Surface(name="ground", coordinate={"y": 1.0, "valley": -1.0}),
    )

    def valley(self, q):
        return 0.3 * (1.0 - np.cos(q[0]))

    def force(self, t, q, velocity, load, sides):
        pressed = 0.5 * (1.0 - sides.ground) * self.stiffness * (self.valley(q) - q[1])
        return -0.3 * np.sin(q[0]) * pressed, pressed - 1.0


def test_a_surface_may_be_curved():
    motion = simulate(
        System(model=OverSoftGround()), x=0.8, y=0.9, velocity=(0.3, 0.0), duration=8.0
    )

    def rate(t, s):
        push = 30.0 * max(0.3 * (1.0 - math.cos(s[0])) - s[1], 0.0)
        return [s[2], s[3], -0.3 * math.sin(s[0]) * push, push - 1.0]

    def crosses(t, s):
        return s[1] - 0.3 * (1.0 - math.cos(s[0]))

    crosses.terminal, t, state, crossings = True, 0.0, np.array([0.8, 0.9, 0.3, 0.0]), 0
    while t < 8.0:
        # past the surface
        begin = solve_ivp(rate, (t, t + 1e-3), state, method="DOP853", rtol=2e-13, atol=1e-14)
        run = solve_ivp(
            rate,
            (t + 1e-3, 8.0),
            begin.y[:, -1],
            method="DOP853",
            rtol=2e-13,
            atol=1e-14,
            events=crosses,
        )
        t, state, crossings = run.t[-1], run.y[:, -1], crossings + run.status
    assert len(motion.events) == crossings > 4
    np.testing.assert_allclose(motion.final_state, state, rtol=0, atol=1e-10)


# --- walls that move, and mass matrices that depend on the coordinate they move ---


@dataclass(frozen=True, kw_only=True)
class InARing(ContactModel):
    """A body in polar coordinates, coupled, in a ring that grows and shrinks: r <= 1 + zeta(t)."""

    spring: float = 1.0
    radius: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("r", "phi")
    channels: ClassVar[tuple[str, ...]] = ("ground",)

    @property
    def contacts(self):
        return (
            Contact(
                name="ring", coordinate={"r": 1.0, "ground": -1.0}, position=self.radius, sign=-1
            ),
        )

    def mass_matrix(self, q):
        return [[1.0, 0.2 * q[0]], [0.2 * q[0], q[0] ** 2]]

    def force(self, t, q, velocity, load):
        turning = (
            0.3 * np.cos(q[1])
            - 2.0 * q[0] * velocity[0] * velocity[1]
            - 0.05 * q[0] ** 2 * velocity[1]
        )
        return q[0] * velocity[1] ** 2 - 0.1 * velocity[0] - self.spring * q[0] + 0.5, turning


RING = System(
    model=InARing(),
    load=Load(frequency=1.3, ground=saltus.Harmonic(amplitude=0.2, phase=0.4)),
    impact=NewtonImpact(e=0.8),
)
IN_RING = np.array([0.7, 0.2, 0.6, 1.0])


def ring(system, x, duration=12.0):
    return simulate(system, r=x[0], phi=x[1], velocity=(x[2], x[3]), duration=duration)


def test_a_wall_that_moves_may_move_the_mass_matrix():
    wall, motion = RING.load.ground, ring(RING, IN_RING)
    state, times = by_scipy(
        lambda q: np.array(InARing().mass_matrix(q)),
        lambda t, q, v: np.array(InARing().force(t, q, v, None)),
        lambda t, q: 1.0 + wall(t) - q[0],
        lambda t, q: (np.array([-1.0, 0.0]), wall.velocity(t)),
        0.8,
        IN_RING,
        12.0,
    )
    assert len(times) > 4
    np.testing.assert_allclose(motion.impacts.time, times, rtol=0, atol=1e-11)
    np.testing.assert_allclose(motion.final_state, state, rtol=0, atol=1e-11)


def test_derivatives_know_that_the_mass_matrix_moves():
    paths = ("impact.e", "load.ground.amplitude", "load.frequency", "model.radius")
    x = IN_RING
    found = sensitivities(
        RING, r=x[0], phi=x[1], velocity=(x[2], x[3]), duration=12.0, parameters=paths
    )
    wanted = differences(RING, x, paths, lambda system, x: ring(system, x).final_state, step=1e-4)
    np.testing.assert_allclose(
        np.hstack([found.state, found.parameters]), wanted, rtol=0, atol=2e-8
    )


def test_many_motions_with_a_mass_matrix_that_moves():
    starts = np.linspace(0.5, 0.9, 9)
    many = simulate_many(RING, r=starts, phi=0.2, velocity=(0.6, 1.0), duration=12.0)
    ones = [ring(RING, [r, 0.2, 0.6, 1.0]).phi for r in starts]
    np.testing.assert_allclose(many.phi.values, ones, rtol=0, atol=1e-11)


# --- what is refused ---------------------------------------------------------


def block_with(**parts: Any) -> ContactModel:
    return dataclasses.make_dataclass(
        "Made", [], bases=(FallingBlock,), namespace=parts, frozen=True, kw_only=True
    )()


def contact(**terms: float) -> tuple[Contact, ...]:
    return (Contact(name="corner", coordinate=terms),)


REFUSED = {
    "'dept', none of x, y, tilt and no function dept": {"contacts": contact(y=1.0, dept=-1.0)},
    "keeps depth, and needs a coordinate of its own.*give the model depth_inverse": {
        "contacts": contact(depth=1.0)
    },
    "keeps tilt_minus_depth, and needs a coordinate of its own": {
        "contacts": contact(tilt=1.0, depth=-1.0)
    },
    "of Made must have coefficients that are numbers": {"contacts": contact(y=1.0, depth=0.0)},
    "Made.depth fails: TraceError: np.arcsin of coordinates": {
        "depth": lambda self, q: np.arcsin(q[2])
    },
    "use NumPy's functions, not math's": {"depth": lambda self, q: math.cos(q[2])},
    "Made.depth must return a number": {"depth": lambda self, q: np.sqrt(-1.0 - q[2] ** 2)},
    "Made.lean_inverse must give the coordinate at which lean has a value": {
        "contacts": (
            *FallingBlock.contacts,
            Contact(name="right", coordinate={"y": 1.0, "depth": -1.0, "lean": 1.0}),
        ),
        "lean": lambda self, q: -np.sin(q[2]),
        "lean_inverse": lambda self, value: -np.arctan(value),
    },
    "has a part named own_values": {"own_values": 1.0},
    "'right' keeps y_minus_depth_minus_tip, and needs a coordinate": {
        "contacts": (
            *FallingBlock.contacts,
            Contact(name="right", coordinate={"y": 1.0, "depth": -1.0, "tip": -1.0}),
        ),
        "tip": lambda self, q: np.sin(q[2]),
    },
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_gaps_without_meaning_are_refused_when_the_system_is_made(sentence):
    with pytest.raises(saltus.ParameterError, match=sentence):
        System(model=block_with(**REFUSED[sentence]))


# --- derivatives along curves ------------------------------------------------


@pytest.mark.parametrize("name", SLOPES)
def test_first_and_second_derivatives_along_a_curve_are_those_of_differences(name):
    function, at = (
        getattr(np, name),
        [lambda s: 0.7 + 0.4 * s - 0.3 * s**2, lambda s: 1.9 - 0.6 * s + 0.2 * s**2],
    )
    jets = [Jet(0.7, 0.4, -0.6), Jet(1.9, -0.6, 0.4)][: function.nin]
    found = function(*jets)
    beside = [
        float(function(*(curve(s) for curve in at[: function.nin])))
        for s in np.array([-2, -1, 0, 1, 2]) * 1e-2
    ]
    first = np.dot([1, -8, 0, 8, -1], beside) / 0.12
    second = np.dot([-1, 16, -30, 16, -1], beside) / 12e-4
    np.testing.assert_allclose(
        [found.value, found.first, found.second], [beside[2], first, second], rtol=1e-6, atol=1e-7
    )


def test_slopes_are_those_of_the_traced_functions():
    for function in FUNCTIONS.values():
        y = function.numpy(0.37)
        assert SLOPES[function.numpy.__name__][0](0.37, y) == pytest.approx(
            function.slope(0.37, y), rel=1e-15
        )
