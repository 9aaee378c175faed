"""Surfaces that are functions of the state, and switches that formulas have by themselves: motions
and derivatives, against closed forms and an independent integrator.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import Contact, Friction, NewtonImpact, Surface
from saltus.errors import MotionError, ParameterError, TraceError
from saltus.flow import sensitivities, simulate
from saltus.systems import ContactModel, Harmonic, Load, System

DAMPED = 0.05


@dataclass(frozen=True, kw_only=True)
class Thrown(ContactModel):
    """A ball with quadratic drag above a floor, as a textbook writes it."""

    drag: float = 0.02
    gravity: float = 9.81

    coordinates: ClassVar[tuple[str, ...]] = ("height",)
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="floor", coordinate="height"),)

    def force(self, t, height, velocity, load):
        return -self.gravity - self.drag * velocity * abs(velocity)


def test_quadratic_drag_has_the_closed_form_of_its_bounces():
    """Up: v = tan, to H = ln(1 + k v^2 / g) / (2 k); down: v = tanh, so that the speed at the floor
    is sqrt(g / k (1 - exp(-2 k H)))."""
    k, g, e = 0.02, 9.81, 0.8
    motion = simulate(
        System(model=Thrown(drag=k, gravity=g), impact=NewtonImpact(e)),
        height=0.0,
        velocity=25.0,
        duration=20.0,
    )
    time, speed, expected = 0.0, 25.0, []
    for _ in range(6):
        root = math.sqrt(g * k)
        time += math.atan(speed * math.sqrt(k / g)) / root
        expected.append(("crossing", time))
        height = math.log1p(k * speed**2 / g) / (2.0 * k)
        time += math.acosh(math.exp(k * height)) / root
        expected.append(("impact", time))
        speed = e * math.sqrt(-g / k * math.expm1(-2.0 * k * height))
    found = [(str(event.kind), event.time) for event in motion.events[:12]]
    assert [kind for kind, _ in found] == [kind for kind, _ in expected]
    assert np.allclose([t for _, t in found], [t for _, t in expected], rtol=0.0, atol=1e-12)
    assert motion.events[0].contact == "height_velocity"


@dataclass(frozen=True, kw_only=True)
class QuarterCar(ContactModel):
    """A car on a spring and a damper with two slopes over a road that moves."""

    stiffness: float = 4.0
    bump: float = 0.2
    rebound: float = 0.9

    coordinates: ClassVar[tuple[str, ...]] = ("y",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)
    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="rebound", function="stretching"),)

    def stretching(self, t, y, velocity, load):
        return velocity - load.ground.velocity(t)

    def force(self, t, y, velocity, load, sides):
        slope = self.bump + (self.rebound - self.bump) * (1.0 + sides.rebound) / 2.0
        rate = velocity - load.ground.velocity(t)
        return -self.stiffness * (y - load.ground(t)) - slope * rate


@dataclass(frozen=True, kw_only=True)
class TracedCar(QuarterCar):
    """The same, whose force has the switch itself."""

    surfaces: ClassVar[tuple[Surface, ...]] = ()

    def force(self, t, y, velocity, load):
        rate = velocity - load.ground.velocity(t)
        slope = np.where(rate > 0.0, self.rebound, self.bump)
        return -self.stiffness * (y - load.ground(t)) - slope * rate


@dataclass(frozen=True, kw_only=True)
class BoucWen(ContactModel):
    """A mass with hysteresis, as Bouc and Wen write it."""

    memory: float = 0.5

    coordinates: ClassVar[tuple[str, ...]] = ("x", "z")
    first_order: ClassVar[tuple[str, ...]] = ("z",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, q, velocity, load):
        x, z = q
        v = velocity[0]
        rate = v - self.memory * abs(v) * z - self.memory * v * abs(z)
        return load.force(t) - 0.1 * v - 0.2 * x - z, rate


@dataclass(frozen=True, kw_only=True)
class Rubbing(ContactModel):
    """A rotor in a soft stator, whose gap is a function of two coordinates, with a damper that
    never pulls."""

    clearance: float = 0.4
    stiffness: float = 30.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, q, velocity, load):
        x, y = q
        radius = np.sqrt(x * x + y * y)
        rate = (x * velocity[0] + y * velocity[1]) / radius
        pressed = np.maximum(radius - self.clearance, 0.0)
        push = np.maximum(self.stiffness * pressed + 2.0 * rate * pressed, 0.0) / radius
        drive = load.force(t)
        return (
            drive - x - 0.1 * velocity[0] - push * x,
            0.7 * drive - y - 0.1 * velocity[1] - push * y,
        )


def by_dop853(field, functions, start, end):
    """The state at the end and the instants of crossings by SciPy's DOP853, from one zero of a
    function to the next; `field(t, s, sides)`."""
    state = np.array(start, dtype=float)
    t = 0.0
    sides = [1.0 if function(0.0, state) >= 0.0 else -1.0 for function in functions]
    times = []

    def events_of(after):
        """An event for each function, which is not at its zero at the start."""
        found = []
        for number, function in enumerate(functions):
            event = lambda t, s, function=function: function(t, s)  # noqa: E731
            event.terminal = True
            event.direction = -sides[number]
            found.append(event)
        return found

    while t < end:
        run = solve_ivp(
            lambda t, s: field(t, s, sides),
            (t, end),
            state,
            "DOP853",
            events=events_of(t),
            rtol=1e-13,
            atol=1e-14,
            max_step=0.05,
        )
        t, state = run.t[-1], run.y[:, -1]
        if run.status == 1:
            number = next(i for i, hits in enumerate(run.t_events) if len(hits))
            sides[number] *= -1.0
            times.append(t)
    return state, np.array(times)


def crossings(motion):
    return np.array([event.time for event in motion.events if str(event.kind) == "crossing"])


CAR = System(model=QuarterCar(), load=Load(frequency=1.3, ground=Harmonic(0.4)))
TRACED_CAR = dataclasses.replace(CAR, model=TracedCar())
BOUC = System(model=BoucWen(), load=Load(frequency=1.0, force=Harmonic(1.0)))
ROTOR = System(model=Rubbing(), load=Load(frequency=0.8, force=Harmonic(1.0)))


def test_a_damper_with_two_slopes_over_a_road():
    w, a = 1.3, 0.4

    def field(t, s, sides):
        rate = s[1] - a * w * math.cos(w * t)
        slope = 0.9 if sides[0] > 0.0 else 0.2
        return [s[1], -4.0 * (s[0] - a * math.sin(w * t)) - slope * rate]

    end = 30.0
    state, times = by_dop853(field, [lambda t, s: s[1] - a * w * math.cos(w * t)], [0.3, 0.2], end)
    for system in (CAR, TRACED_CAR):
        motion = simulate(system, y=0.3, velocity=0.2, duration=end)
        assert np.allclose([motion.position, motion.velocity], state, rtol=0.0, atol=1e-10)
        assert np.allclose(crossings(motion), times, rtol=0.0, atol=1e-10)


def test_hysteresis_of_bouc_and_wen_from_rest():
    def field(t, s, sides):
        x, v, z = s
        return [
            v,
            math.sin(t) - 0.1 * v - 0.2 * x - z,
            v - 0.5 * sides[0] * v * z - 0.5 * v * sides[1] * z,
        ]

    end = 40.0
    state, times = by_dop853(field, [lambda t, s: s[1], lambda t, s: s[2]], [0.0, 0.0, 0.0], end)
    motion = simulate(BOUC, x=0.0, z=0.0, velocity=0.0, duration=end)
    found = [motion.position[0], motion.velocity[0], motion.position[1]]
    assert np.allclose(found, state, rtol=0.0, atol=1e-10)
    assert np.allclose(crossings(motion), times, rtol=0.0, atol=1e-10)


def test_a_rotor_in_a_soft_stator_that_never_pulls():
    def push(s, sides):
        radius = math.hypot(s[0], s[1])
        rate = (s[0] * s[2] + s[1] * s[3]) / radius
        pressed = radius - 0.4 if sides[0] > 0.0 else 0.0
        return (30.0 + 2.0 * rate) * pressed / radius if sides[1] > 0.0 else 0.0

    def field(t, s, sides):
        drive, back = math.sin(0.8 * t), push(s, sides)
        return [
            s[2],
            s[3],
            drive - s[0] - 0.1 * s[2] - back * s[0],
            0.7 * drive - s[1] - 0.1 * s[3] - back * s[1],
        ]

    end = 25.0
    start = [0.1, -0.15, 0.0, 0.2]
    # it never pulls here, so that the second switch has no zero of its own
    state, times = by_dop853(
        field,
        [lambda t, s: math.hypot(s[0], s[1]) - 0.4, lambda t, s: 1.0],
        start,
        end,
    )
    motion = simulate(ROTOR, x=start[0], y=start[1], velocity=start[2:], duration=end)
    found = [*motion.position, *motion.velocity]
    assert np.allclose(found, state, rtol=0.0, atol=2e-10)
    hits = [t for t in crossings(motion) if np.abs(times - t).min() < 1e-9]
    assert len(hits) >= len(times) > 5


def ends(system, start, end):
    motion = simulate(system, **start, duration=end)
    return np.concatenate([np.atleast_1d(motion.position), np.atleast_1d(motion.velocity)])


@pytest.mark.parametrize(
    ("system", "start", "paths", "end"),
    [
        (CAR, {"y": 0.3, "velocity": 0.2}, ("model.rebound", "load.ground.amplitude"), 9.0),
        (TRACED_CAR, {"y": 0.3, "velocity": 0.2}, ("model.bump", "load.frequency"), 9.0),
        (BOUC, {"x": 0.1, "z": 0.05, "velocity": 0.2}, ("model.memory", "load.frequency"), 9.0),
        (
            System(model=Thrown(), impact=NewtonImpact(0.8)),
            {"height": 0.5, "velocity": 3.0},
            ("model.drag", "impact.e"),
            2.5,
        ),
    ],
)
def test_derivatives_are_those_of_neighbouring_motions(system, start, paths, end):
    found = sensitivities(system, **start, parameters=paths, duration=end)
    for number, path in enumerate(paths):
        value, step = system.get(path), 1e-4

        def at(shift, path=path, value=value):
            return ends(system.with_(**{path: value + shift}), start, end)

        slope = (8.0 * (at(step) - at(-step)) - at(2.0 * step) + at(-2.0 * step)) / (12.0 * step)
        own = found.parameters[:, number]
        moving = np.ones(len(slope), dtype=bool)
        if system.model.first_order:
            moving[-1] = False
        assert np.allclose(own[moving], slope[moving], rtol=1e-7, atol=1e-8), path


@dataclass(frozen=True, kw_only=True)
class Plain(ContactModel):
    """A mass on a spring between a wall and nothing."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="wall", coordinate="x", position=0.4, sign=-1),
    )

    def force(self, t, x, velocity, load):
        return load.force(t) - x - 0.1 * velocity


@dataclass(frozen=True, kw_only=True)
class Inert(Plain):
    """The same, with a switch that changes nothing."""

    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="none", function="speed"),)

    def speed(self, t, x, velocity, load):
        return velocity - 0.1 * load.force(t)

    def force(self, t, x, velocity, load, sides):
        return super().force(t, x, velocity, load) + 0.0 * sides.none


def test_a_switch_without_effect_changes_no_motion():
    load = Load(frequency=0.9, force=Harmonic(0.6))
    plain, inert = (
        simulate(
            System(model=model, load=load, impact=NewtonImpact(0.7)),
            x=0.0,
            velocity=0.0,
            duration=60.0,
        )
        for model in (Plain(), Inert())
    )
    assert len(inert.impacts) == len(plain.impacts) > 4
    assert np.allclose(inert.impacts.time, plain.impacts.time, rtol=0.0, atol=1e-10)
    assert math.isclose(inert.position, plain.position, abs_tol=1e-10)
    # one side follows the other, and at an impact the velocity jumps from one to the other
    assert len(crossings(inert)) > 10


@dataclass(frozen=True, kw_only=True)
class Signed(ContactModel):
    """A mass under a force with the sign of its velocity."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, x, velocity, load):
        return load.force(t) - 0.2 * x - 0.3 * np.sign(velocity)


@dataclass(frozen=True, kw_only=True)
class Rubbed(ContactModel):
    """The same as `Signed`, by a friction."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    frictions: ClassVar[tuple[Friction, ...]] = (Friction(name="rub", coordinate="x", kinetic=0.3),)

    def force(self, t, x, velocity, load):
        return load.force(t) - 0.2 * x


@dataclass(frozen=True, kw_only=True)
class Controlled(ContactModel):
    """A double integrator under a force that jumps with the sign of x' + rate x."""

    rate: float = 0.7
    force_size: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, x, velocity, load):
        return load.force(t) - self.force_size * np.sign(velocity + self.rate * x)


@pytest.mark.parametrize("start", [{"x": 0.0, "velocity": 0.0}, {"x": 0.2, "velocity": 1.0}])
@pytest.mark.parametrize(
    "signal", [Harmonic(0.7), saltus.Record([0, 1, 2, 3, 60], [0, 1, -1, 0.5, 0.4])]
)
def test_a_force_with_the_sign_of_the_velocity_is_dry_friction(start, signal):
    load = Load(frequency=1.1, force=signal)
    signed = simulate(System(model=Signed(), load=load), **start, duration=25.0)
    rubbed = simulate(System(model=Rubbed(), load=load), **start, duration=25.0)
    assert math.isclose(signed.position, rubbed.position, abs_tol=1e-10)
    assert math.isclose(signed.velocity, rubbed.velocity, abs_tol=1e-10)
    for kind in ("stick", "slip"):
        # the friction's events at the start and its rests are no events of a surface
        times = [
            [e.time for e in motion.events if str(e.kind) == kind and e.time > 0.0]
            for motion in (signed, rubbed)
        ]
        assert np.allclose(*times, rtol=0.0, atol=1e-9)


def test_derivatives_while_it_sticks_are_those_of_dry_friction():
    load = Load(frequency=1.1, force=Harmonic(0.7))
    path = "load.force.amplitude"
    found = [
        sensitivities(
            System(model=model, load=load), x=0.2, velocity=1.0, parameters=(path,), duration=23.0
        )
        for model in (Signed(), Rubbed())
    ]
    assert str(found[0].motion.events[-1].kind) in {"stick", "slip", "crossing"}
    assert np.allclose(found[0].state, found[1].state, rtol=0.0, atol=1e-9)
    assert np.allclose(found[0].parameters, found[1].parameters, rtol=0.0, atol=1e-9)


def test_a_motion_slides_along_a_function_as_filippov_has_it():
    """Once on x' = -rate x it stays there, x = x_0 exp(-rate t), while the force can hold it."""
    system = System(model=Controlled(), load=Load(force=0.2))
    motion = simulate(system, x=1.0, velocity=0.0, duration=12.0)
    stick = next(event for event in motion.events if str(event.kind) == "stick")
    assert [str(event.kind) for event in motion.events] == ["stick"]
    # until then x'' = 0.2 - 1: x' + 0.7 x = 0.7 - 0.8 t - 0.28 t^2
    time = (-0.8 + math.sqrt(0.8**2 + 4.0 * 0.28 * 0.7)) / (2.0 * 0.28)
    assert math.isclose(stick.time, time, abs_tol=1e-13)
    place = 1.0 - 0.4 * time**2
    expected = place * math.exp(-0.7 * (12.0 - time))
    assert math.isclose(motion.position, expected, abs_tol=1e-13)
    assert math.isclose(motion.velocity, -0.7 * expected, abs_tol=1e-13)


@dataclass(frozen=True, kw_only=True)
class Thermostat(ContactModel):
    """A heater that is on below a temperature, which is a coordinate of first order."""

    coordinates: ClassVar[tuple[str, ...]] = ("warmth",)
    first_order: ClassVar[tuple[str, ...]] = ("warmth",)
    surfaces: ClassVar[tuple[Surface, ...]] = (
        Surface(name="low", coordinate="warmth", position=19.0),
    )

    def force(self, t, warmth, velocity, load, sides):
        return -0.1 * (warmth - 10.0) + 3.0 * (1.0 - sides.low) / 2.0


def test_a_thermostat_without_memory_stays_at_its_temperature():
    """On, the temperature is 40 - 22 exp(-t / 10), which is 19 at 10 log(22 / 21)."""
    motion = simulate(System(model=Thermostat()), warmth=18.0, duration=50.0)
    assert [(str(event.kind), event.contact) for event in motion.events] == [("stick", "low")]
    assert math.isclose(motion.events[0].time, 10.0 * math.log(22.0 / 21.0), abs_tol=1e-13)
    assert math.isclose(motion.position, 19.0, abs_tol=1e-13)


@dataclass(frozen=True, kw_only=True)
class Copied(ContactModel):
    """`Thrown`, with a copy of its velocity as a coordinate of first order, whose surface it passes
    at impacts too."""

    coordinates: ClassVar[tuple[str, ...]] = ("height", "rate")
    first_order: ClassVar[tuple[str, ...]] = ("rate",)
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="floor", coordinate="height"),)
    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="up", coordinate="rate"),)

    def force(self, t, q, velocity, load, sides):
        pull = -9.81 - 0.02 * sides.up * q[1] ** 2
        return pull, pull

    def after_impact(self, contact, q, velocity):
        return (-0.8 * q[1],)


def test_a_coordinate_of_first_order_jumps_through_a_surface_at_an_impact():
    law = NewtonImpact(0.8)
    copied = simulate(
        System(model=Copied(), impact=law), height=1.0, velocity=(0.0, 0.0), rate=0.0, duration=4.0
    )
    thrown = simulate(System(model=Thrown(), impact=law), height=1.0, velocity=0.0, duration=4.0)
    assert len(copied.impacts) == len(thrown.impacts) > 3
    assert np.allclose(copied.impacts.time, thrown.impacts.time, rtol=0.0, atol=1e-12)
    assert math.isclose(copied.position[0], thrown.position, abs_tol=1e-12)


def test_a_function_between_sides_that_lead_away_is_refused():
    @dataclass(frozen=True, kw_only=True)
    class Away(ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)

        def force(self, t, x, velocity, load):
            return np.sign(velocity)

    with pytest.raises(MotionError, match="is not unique"):
        simulate(System(model=Away()), x=0.0, velocity=0.0, duration=1.0)


def test_orbits_that_slide_are_refused_in_one_sentence():
    @dataclass(frozen=True, kw_only=True)
    class Declared(Signed):
        surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="rub", function="speed"),)

        def speed(self, t, x, velocity, load):
            return velocity

        def force(self, t, x, velocity, load, sides):
            return load.force(t) - 0.2 * x - 0.3 * sides.rub

    system = System(model=Declared(), load=Load(frequency=1.1, force=Harmonic(0.5)))
    with pytest.raises(MotionError, match="slides along a surface"):
        saltus.find_orbit(system, x=0.0)


@dataclass(frozen=True, kw_only=True)
class Bodies(ContactModel):
    """Two bodies that hit, with drag and a damper with two slopes."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="between", coordinate={"y": 1.0, "x": -1.0}),
    )
    surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="fast", function="speed"),)

    def speed(self, t, q, velocity, load):
        return velocity[1] - 0.5 * velocity[0]

    def force(self, t, q, velocity, load, sides):
        damped = (0.3 + 0.2 * sides.fast) * self.speed(t, q, velocity, load)
        drag = 0.1 * velocity[0] * abs(velocity[0])
        return load.force(t) - q[0] - drag + 0.5 * damped, -0.5 * q[1] - damped


@dataclass(frozen=True, kw_only=True)
class InGap(ContactModel):
    """The same, written with the gap z = y - x in the place of y."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "z")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="between", coordinate="z"),)

    def mass_matrix(self, q):
        return [[2.0, 1.0], [1.0, 1.0]]

    def force(self, t, q, velocity, load):
        (x, z), (u, w) = q, velocity
        speed = w + 0.5 * u
        damped = np.where(speed > 0.0, 0.5, 0.1) * speed
        on_x = load.force(t) - x - 0.1 * u * abs(u) + 0.5 * damped
        on_y = -0.5 * (x + z) - damped
        return on_x + on_y, on_y


def test_functions_of_bodies_that_touch_are_those_of_their_own_coordinates():
    load, law = Load(frequency=1.2, force=Harmonic(1.0)), NewtonImpact(0.6)
    own = simulate(
        System(model=Bodies(), load=load, impact=law),
        x=0.0,
        y=0.5,
        velocity=(0.0, 0.0),
        duration=20.0,
    )
    gap = simulate(
        System(model=InGap(), load=load, impact=law),
        x=0.0,
        z=0.5,
        velocity=(0.0, 0.0),
        duration=20.0,
    )
    assert len(own.impacts) == len(gap.impacts) > 3
    assert [event.kind for event in own.events] == [event.kind for event in gap.events]
    assert np.allclose(own.position, [gap.position[0], sum(gap.position)], rtol=0.0, atol=1e-11)


def test_ensembles_have_the_motions_of_each():
    starts = np.linspace(-0.5, 0.8, 5)
    for system in (CAR, TRACED_CAR):
        together = saltus.simulate_many(system, y=starts, velocity=0.1, periods=6)
        for number, start in enumerate(starts):
            alone = simulate(system, y=float(start), velocity=0.1, periods=6)
            assert float(together.y[number]) == alone.position
            assert float(together.velocity[number]) == alone.velocity


def test_a_page_refuses_it_in_one_sentence():
    with pytest.raises(ParameterError, match="a page cannot show surfaces yet"):
        saltus.page(TRACED_CAR, y=0.1, periods=2)


def test_a_surface_needs_a_method():
    @dataclass(frozen=True, kw_only=True)
    class Without(ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        surfaces: ClassVar[tuple[Surface, ...]] = (Surface(name="s", function="missing"),)

        def force(self, t, x, velocity, load, sides):
            return -x

    with pytest.raises(ParameterError, match="the surface 's' needs a method missing"):
        System(model=Without())
    with pytest.raises(ParameterError, match="leave its position out"):
        Surface(name="s", function="missing", position=1.0)
    with pytest.raises(ParameterError, match="got neither"):
        Surface(name="s")


def test_a_mass_matrix_has_no_switches():
    @dataclass(frozen=True, kw_only=True)
    class Heavy(ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        contacts: ClassVar[tuple[Contact, ...]] = (
            Contact(name="wall", coordinate="x", position=-1.0),
        )

        def mass_matrix(self, q):
            return 1.0 + abs(q)

        def force(self, t, x, velocity, load):
            return -x

    with pytest.raises(TraceError, match="absolute in its mass matrix"):
        System(model=Heavy())


def swinging(force):
    """A motion of x'' = force(x, x') from x = 1."""

    @dataclass(frozen=True, kw_only=True)
    class Nested(saltus.ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        channels: ClassVar[tuple[str, ...]] = ()

        def force(self, t, x, velocity, load):
            return force(x, velocity)

    return saltus.simulate(saltus.System(model=Nested()), x=1.0, velocity=-0.1, duration=9.0)


def test_a_switch_of_a_value_that_jumps_is_refused():
    """It passes 0 without a root, where the inner sign changes."""
    with pytest.raises(TraceError, match="depends on a value that jumps"):
        swinging(lambda x, v: -x - 0.2 * np.sign(x - 0.1 * np.sign(v)))


@pytest.mark.parametrize(
    ("nested", "plain"),
    [
        (
            lambda x, v: -x - 0.2 * v * np.where(np.sign(v) * x > 0.0, 1.0, 0.0),
            lambda x, v: -x - 0.2 * v * np.where(v * x > 0.0, 1.0, 0.0),
        ),
        (lambda x, v: -x - 0.3 * np.sign(np.sign(v)), lambda x, v: -x - 0.3 * np.sign(v)),
        (lambda x, v: -x - 0.3 * np.sign(v * abs(v)), lambda x, v: -x - 0.3 * np.sign(v)),
        (lambda x, v: -x - 0.3 * np.sign(abs(v) * v), lambda x, v: -x - 0.3 * np.sign(v)),
        (
            lambda x, v: -x - 0.3 * np.where(v * abs(v) > 0.0, 1.0, -1.0),
            lambda x, v: -x - 0.3 * np.sign(v),
        ),
        (lambda x, v: -x - 0.3 * np.sign(x * abs(x)), lambda x, v: -x - 0.3 * np.sign(x)),
        (lambda x, v: -x + 0.3 * np.sign(0.0 - 3.0 * v), lambda x, v: -x - 0.3 * np.sign(v)),
    ],
)
def test_signs_within_signs_have_the_switches_of_the_plain_form(nested, plain):
    one = swinging(nested)
    other = swinging(plain)
    kinds = [str(event.kind) for event in one.events]
    assert kinds == [str(event.kind) for event in other.events]
    assert len(kinds) > 1
    instants = [event.time for event in one.events]
    np.testing.assert_allclose(instants, [event.time for event in other.events], rtol=1e-12)
    assert one.x == pytest.approx(other.x, abs=1e-12)


@pytest.mark.parametrize(
    ("law", "function"),
    [
        (lambda x, v: -0.3 * np.sign(v), lambda x, v: v),
        (lambda x, v: -0.3 * np.sign(v), lambda x, v: -v),
        (lambda x, v: -0.3 * v * abs(v), lambda x, v: v),
        (lambda x, v: -3.0 * np.maximum(x - 0.2, 0.0), lambda x, v: x - 0.2),
        (lambda x, v: -0.3 * np.sign(x), lambda x, v: 3.0 * x),
    ],
)
def test_a_formula_may_have_the_switch_of_a_declared_surface(law, function):
    """It moves as without the surface, whose side is not read."""

    @dataclass(frozen=True, kw_only=True)
    class Both(saltus.ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        channels: ClassVar[tuple[str, ...]] = ()
        surfaces: ClassVar[tuple] = (saltus.Surface(name="own", function="value"),)

        def value(self, t, x, velocity, load):
            return function(x, velocity)

        def force(self, t, x, velocity, load, sides):
            return -x + law(x, velocity)

    motion = saltus.simulate(saltus.System(model=Both()), x=1.0, velocity=-0.1, duration=9.0)
    alone = swinging(lambda x, v: -x + law(x, v))
    assert motion.x == pytest.approx(alone.x, abs=1e-12)
    assert len(motion.events) == len(alone.events) > 1


def test_a_surface_whose_function_is_no_number_is_refused():
    @dataclass(frozen=True, kw_only=True)
    class Empty(saltus.ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        channels: ClassVar[tuple[str, ...]] = ()
        surfaces: ClassVar[tuple] = (saltus.Surface(name="slow", function="limit"),)

        def limit(self, t, x, velocity, load):
            return None

        def force(self, t, x, velocity, load, sides):
            return -x - 0.1 * sides.slow

    with pytest.raises(ParameterError, match=r"limit of Empty, .*must return one number, got None"):
        saltus.simulate(saltus.System(model=Empty()), x=1.0, duration=1.0)
