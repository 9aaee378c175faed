"""Relays, which remember their side, and resets of the state at events: motions and derivatives,
against closed forms and an independent integrator.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from machines_with_memory import Neuron, RimlessWheel, Servo, Thermostat
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import saltus
from saltus import Contact, NewtonImpact, Relay, Surface
from saltus.errors import MotionError, ParameterError
from saltus.flow import sensitivities, simulate
from saltus.systems import ContactModel, Harmonic, Load, System


@dataclass(frozen=True, kw_only=True)
class AntiWindup(ContactModel):
    """An integrator that is held at 1 as long as its input pushes on."""

    coordinates: ClassVar[tuple[str, ...]] = ("out",)
    first_order: ClassVar[tuple[str, ...]] = ("out",)
    channels: ClassVar[tuple[str, ...]] = ("input",)
    surfaces: ClassVar[tuple[Relay, ...]] = (Relay(name="held", on="full", off="falls"),)

    def full(self, t, out, velocity, load):
        return out - 1.0

    def falls(self, t, out, velocity, load):
        return -load.input(t)

    def force(self, t, out, velocity, load, sides):
        return load.input(t) * (1.0 - sides.held) / 2.0


def times_of(motion):
    return np.array([event.time for event in motion.events])


def test_a_thermostat_has_the_period_of_its_closed_form():
    """On: 40 - (40 - T) exp(-t / 10); off: 10 + (T - 10) exp(-t / 10)."""
    motion = simulate(System(model=Thermostat()), T=18.0, duration=50.0)
    rises, falls = 10.0 * math.log(21.0 / 19.0), 10.0 * math.log(11.0 / 9.0)
    expected = [10.0 * math.log(22.0 / 19.0)]
    while expected[-1] < 50.0:
        expected.append(expected[-1] + (falls if len(expected) % 2 else rises))
    found = times_of(motion)
    assert np.allclose(found, expected[: len(found)], rtol=0.0, atol=1e-12)
    assert expected[len(found)] > 50.0
    assert {event.contact for event in motion.events} == {"heater"}
    assert motion.sides == {"heater": 1 if len(found) % 2 == 0 else -1}


def test_a_start_between_the_thresholds_has_the_side_that_it_is_given():
    system = System(model=Thermostat())
    for on, end in ((True, 40.0 - 20.0 * math.exp(-0.03)), (False, 10.0 + 10.0 * math.exp(-0.03))):
        motion = simulate(system, T=20.0, duration=0.3, relays={"heater": on})
        assert motion.position == pytest.approx(end, abs=1e-13)
        again = simulate(system, T=motion.position, duration=1.0, relays=motion.sides)
        whole = simulate(system, T=20.0, duration=1.3, relays={"heater": on})
        assert again.position == pytest.approx(whole.position, abs=1e-13)


def test_a_neuron_fires_with_its_period():
    """tau ln(I / (I - 1)); the derivatives are those of u = I (1 - exp(-t / tau)) after the last
    of n spikes at n P."""
    drive, tau, end = 1.3, 2.0, 25.0
    motion = simulate(System(model=Neuron()), u=0.0, duration=end)
    period = tau * math.log(drive / (drive - 1.0))
    count = int(end / period)
    expected = period * np.arange(1, count + 1)
    assert np.allclose(times_of(motion), expected, rtol=0.0, atol=1e-12)
    assert motion.position == pytest.approx(
        drive * (1.0 - math.exp(-(end - count * period) / tau)), abs=1e-12
    )
    found = sensitivities(
        System(model=Neuron()), u=0.0, duration=end, parameters=["model.drive", "model.tau"]
    )
    share = math.exp(-(end - count * period) / tau)
    by_drive = tau * (1.0 / drive - 1.0 / (drive - 1.0))  # dP/dI
    assert found.parameters[0, 0] == pytest.approx(
        1.0 - share - drive * share / tau * count * by_drive, rel=1e-10
    )
    assert found.parameters[0, 1] == pytest.approx(-drive * share * end / tau**2, rel=1e-10)
    # a start beside 0 fires earlier: dt = -exp(P / tau) / I du ... with each spike the same
    shift = -1.0 / drive
    assert found.state[0, 0] == pytest.approx(-drive * share / tau * tau * shift, rel=1e-10)
    assert np.allclose(found.event_times[:, 0], tau * shift, rtol=1e-10)


def test_a_rimless_wheel_settles_as_its_closed_form_says():
    """w^2 -> cos^2(2 a) (w^2 + 4 sin(g) sin(a)) with each spoke."""
    a, g = 0.4, 0.1
    system = System(model=RimlessWheel(half_angle=a, slope=g))
    gain = 4.0 * math.sin(g) * math.sin(a)
    share = math.cos(2.0 * a) ** 2
    settled = math.sqrt(share * gain / (1.0 - share))
    motion = simulate(system, angle=g - a, velocity=0.9, duration=12.0)
    squares = [0.81]
    for event in motion.events:
        squares.append(share * (squares[-1] + gain))
        (before,), (after,) = event.velocity_before, event.velocity_after
        assert after == pytest.approx(math.sqrt(squares[-1]), abs=1e-12)
        assert after == pytest.approx(math.cos(2.0 * a) * before, abs=1e-14)
    assert len(motion.events) > 5
    # over one step the derivative along the motion is 1, and the one across it the share
    start = {"angle": g - a, "velocity": settled}
    step = simulate(system, **start, duration=20.0).events[0].time
    found = sensitivities(system, **start, duration=step + 1e-9)
    assert sorted(np.linalg.eigvals(found.state).real) == pytest.approx([share, 1.0], abs=1e-7)


def test_a_servo_oscillates_with_the_half_period_of_its_matrix_exponential():
    """x(T) = -x(0) on one side of the relay, with y(0) at the threshold (Tsypkin)."""
    width = 0.2
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, -1.0], [0.0, 0.0, 0.0]])  # u is constant

    def start_of(half):
        whole = expm(matrix * half)
        return np.linalg.solve(np.eye(2) + whole[:2, :2], -whole[:2, 2])

    half = brentq(lambda t: start_of(t)[0] - width, 0.1, 10.0, xtol=1e-14)
    y, v = start_of(half)
    motion = simulate(
        System(model=Servo()), y=y, velocity=v, duration=8.5 * half, relays={"drive": True}
    )
    assert np.allclose(times_of(motion), half * np.arange(1, 9), rtol=0.0, atol=1e-11)


def test_an_integrator_is_held_at_its_limit():
    """out' = 2 cos(t): at 1 from pi / 6 to pi / 2, and then -1 + 2 sin(t)."""
    load = Load(frequency=1.0, input=Harmonic(2.0, phase=math.pi / 2.0))
    motion = simulate(
        System(model=AntiWindup(), load=load), out=0.0, duration=5.0, relays={"held": False}
    )
    assert np.allclose(times_of(motion), [math.pi / 6.0, math.pi / 2.0], rtol=0.0, atol=1e-12)
    assert motion.position == pytest.approx(2.0 * math.sin(5.0) - 1.0, abs=1e-12)
    assert motion.at(1.2)[0] == pytest.approx(1.0, abs=1e-14)


@dataclass(frozen=True, kw_only=True)
class Machine(ContactModel):
    """Two oscillators and a charge, with two relays, two resets and a stop."""

    stiffness: float = 2.0
    push: float = 0.6
    high: float = 0.3
    low: float = -0.2
    full: float = 0.5
    empty: float = -0.1
    lag: float = 0.8
    fires_at: float = 0.9
    wall: float = 0.8
    kick: float = 0.3
    loss: float = 0.2
    floor: float = -0.7

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "w")
    first_order: ClassVar[tuple[str, ...]] = ("w",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        return (Contact(name="floor", coordinate="y", position=self.floor),)

    @property
    def surfaces(self):
        return (
            Relay(name="motor", on="is_high", off="is_low"),
            Surface(name="fire", function="fire", after_event="fired"),
            Relay(name="valve", on="is_full", off="is_empty", after_event="opened"),
            Surface(name="wall", coordinate="x", position=self.wall, after_event="bounced"),
        )

    def is_high(self, t, q, v, load):
        return q[0] + 0.1 * v[0] - self.high

    def is_low(self, t, q, v, load):
        return self.low - q[0] - 0.1 * v[0]

    def is_full(self, t, q, v, load):
        return q[2] + 0.1 * load.force(t) - self.full

    def is_empty(self, t, q, v, load):
        return self.empty - q[2] - 0.1 * load.force(t)

    def fire(self, t, q, v, load):
        return q[2] + 0.3 * q[1] - self.fires_at

    def fired(self, t, q, v, load):
        x, y, w = q
        return (x, y, w - 1.0), (0.9 * v[0] + self.kick * w, v[1] + self.kick, v[2])

    def opened(self, t, q, v, load):
        x, y, w = q
        return (x, y, w), (v[0] + 0.1 * self.kick * load.force(t), v[1], v[2])

    def bounced(self, t, q, v, load):
        return q, ((self.loss - 1.0) * v[0], v[1] + 0.1 * v[0], v[2])

    def force(self, t, q, v, load, sides):
        x, y, w = q
        drive = load.force(t)
        return (
            drive - self.stiffness * x - 0.1 * v[0] - self.push * sides.motor + 0.2 * w,
            0.7 * drive - 1.7 * y - 0.05 * v[1] + 0.3 * sides.motor + 0.1 * sides.valve,
            self.lag * (x * x + y - w) + 0.5 - 0.4 * sides.valve,
        )


class Reference:
    """The same by SciPy's DOP853, from one event to the next, with no line of saltus."""

    def __init__(self, model, frequency, restitution):
        self.m, self.w, self.e = model, frequency, restitution

    def drive(self, t):
        return math.sin(self.w * t)

    def next_corner(self, t):
        """The next instant after t at which the load has a corner or jumps."""
        return math.inf

    def enter(self, t):
        """Go on with what the load is from a corner on."""

    def field(self, t, s, motor, valve):
        m, drive = self.m, self.drive(t)
        x, y, w, vx, vy = s
        return [
            vx,
            vy,
            m.lag * (x * x + y - w) + 0.5 - 0.4 * valve,
            drive - m.stiffness * x - 0.1 * vx - m.push * motor + 0.2 * w,
            0.7 * drive - 1.7 * y - 0.05 * vy + 0.3 * motor + 0.1 * valve,
        ]

    def set_by(self, t, s):
        """The function by which each relay goes on, and that by which it goes off."""
        m, place, level = self.m, s[0] + 0.1 * s[3], s[2] + 0.1 * self.drive(t)
        return (place - m.high, m.low - place), (level - m.full, m.empty - level)

    def guards(self, motor, valve):
        m = self.m
        return [
            (lambda t, s: self.set_by(t, s)[0][0 if motor < 0 else 1], 1),
            (lambda t, s: s[2] + 0.3 * s[1] - m.fires_at, 0),
            (lambda t, s: self.set_by(t, s)[1][0 if valve < 0 else 1], 1),
            (lambda t, s: s[0] - m.wall, 0),
            (lambda t, s: m.floor - s[1], 1),
        ]

    def run(self, start, motor, valve, end):
        m = self.m
        t, s = 0.0, np.array(start, dtype=float)
        sides = [1 if guard(0.0, s) >= 0.0 else -1 for guard, _ in self.guards(motor, valve)]
        events = []
        self.enter(t)
        while t < end:
            until = min(end, self.next_corner(t))
            guards = []
            for number, (guard, once) in enumerate(self.guards(motor, valve)):
                event = lambda t, s, guard=guard: guard(t, s)  # noqa: E731
                event.terminal = True
                event.direction = 1 if once else -sides[number]
                guards.append(event)
            run = solve_ivp(
                lambda t, s, motor=motor, valve=valve: self.field(t, s, motor, valve),
                (t, until),
                s,
                "DOP853",
                events=guards,
                rtol=1e-13,
                atol=1e-14,
                max_step=0.05,
            )
            t, s = run.t[-1], run.y[:, -1].copy()
            number = None
            if run.status != 1:
                if until == end:
                    break
                t = until
                self.enter(t)
            else:
                number = next(i for i, hits in enumerate(run.t_events) if len(hits))
                events.append((number, t))
            x, y, w, vx, vy = s
            if number is None:
                pass
            elif number == 0:
                motor = -motor
            elif number == 1:
                sides[1] = -sides[1]
                if sides[1] > 0:
                    s = np.array([x, y, w - 1.0, 0.9 * vx + m.kick * w, vy + m.kick])
            elif number == 2:
                valve = -valve
                if valve > 0:
                    s[3] = vx + 0.1 * m.kick * self.drive(t)
            elif number == 3:
                s[0] = m.wall
                s[3], s[4] = (m.loss - 1.0) * vx, vy + 0.1 * vx
            else:
                s[1], s[4] = m.floor, -self.e * vy
            # jumps may set relays too, and take the state across the other surface
            (on, off), (full, empty) = self.set_by(t, s)
            if number in (1, 3, 4, 2, None):
                before = motor, valve
                motor = 1 if on > 0.0 else -1 if off > 0.0 else motor
                valve = 1 if full > 0.0 else -1 if empty > 0.0 else valve
                events += [(k, t) for k in (0, 2) if (motor, valve)[k // 2] != before[k // 2]]
            if number is not None and (number != 1 or sides[1] > 0):
                value = s[2] + 0.3 * s[1] - m.fires_at
                sides[1] = 1 if value > 0.0 else -1
        return s, events


def random_machine(seed):
    draw = np.random.default_rng(seed).uniform
    return Machine(
        stiffness=draw(1.0, 4.0),
        push=draw(0.2, 1.0),
        high=draw(0.05, 0.4),
        low=draw(-0.4, 0.0),
        full=draw(0.3, 0.7),
        empty=draw(-0.4, 0.2),
        lag=draw(0.5, 2.0),
        fires_at=draw(0.8, 1.3),
        wall=draw(0.5, 1.1),
        kick=draw(-0.5, 0.5),
        loss=draw(0.0, 0.5),
        floor=draw(-0.9, -0.5),
    ), draw


NAMES = ["motor", "fire", "valve", "wall", "floor"]


def compared(seed, reference_of, load_of, end=15.0):
    """The names of the events of a random machine and of its reference, the largest difference of
    their instants, and that of the states at the end, relative to their size above 1."""
    model, draw = random_machine(seed)
    frequency, restitution = draw(0.6, 2.0), draw(0.3, 0.9)
    start = draw(-0.4, 0.4, 5)
    sides = {"motor": -1, "valve": -1}
    reference = reference_of(model, frequency, restitution)
    reference.enter(0.0)
    for name, (on, _) in zip(sides, reference.set_by(0.0, start), strict=True):
        sides[name] = 1 if on > 0.0 else -1
    state, events = reference.run(start, *sides.values(), end)
    system = System(
        model=model,
        load=Load(frequency=frequency, force=load_of(reference)),
        impact=NewtonImpact(restitution),
    )
    motion = simulate(
        system,
        x=start[0],
        y=start[1],
        w=start[2],
        velocity=(start[3], start[4]),
        duration=end,
        relays=sides,
    )
    found = np.array([*motion.position, *motion.velocity[:2]])
    names = [str(event.contact) for event in motion.events], [NAMES[k] for k, _ in events]
    apart = math.inf
    if names[0] == names[1]:
        apart = np.abs(times_of(motion) - [t for _, t in events]).max(initial=0.0)
    # of some machines kicks make speeds grow for ever
    return *names, apart, np.abs(found - state).max() / max(1.0, np.abs(state).max())


@pytest.mark.parametrize("first", range(0, 60, 10))
def test_random_machines_beside_dop853(first):
    for seed in range(first, first + 10):
        named, expected, late, apart = compared(seed, Reference, lambda _: Harmonic(1.0))
        assert named == expected, seed
        assert max(late, apart) < 1e-9, (seed, late, apart)


def ends(system, start, sides, end):
    motion = simulate(system, **start, relays=sides, duration=end)
    return np.array([*motion.position, *motion.velocity[:2]])


@pytest.mark.parametrize("seed", [0, 13, 34])
def test_derivatives_of_machines_are_those_of_differences(seed):
    """Richardson's differences over the state at the start, numbers of the relays, of the resets,
    and the frequency."""
    model, _ = random_machine(seed)
    system = System(
        model=model, load=Load(frequency=1.1, force=Harmonic(1.0)), impact=NewtonImpact(0.6)
    )
    start = {"x": 0.1, "y": -0.2, "w": 0.15, "velocity": (0.3, 0.2)}
    sides = {"motor": False, "valve": True}
    paths = ["model.high", "model.fires_at", "model.kick", "model.wall", "load.frequency"]
    found = sensitivities(system, **start, relays=sides, duration=6.0, parameters=paths)
    own = [0, 1, 2, 3, 4]
    columns = np.hstack([found.state[np.ix_(own, own)], found.parameters[own]])
    expected = np.zeros_like(columns)
    for column in range(10):
        ways = []
        for h in (1e-4, 5e-5):
            both = []
            for way in (h, -h):
                moved, twin = dict(start), system
                if column < 3:
                    moved["xyw"[column]] += way
                elif column < 5:
                    v = list(start["velocity"])
                    v[column - 3] += way
                    moved["velocity"] = tuple(v)
                else:
                    path = paths[column - 5]
                    twin = system.with_({path: system.get(path) + way})
                both.append(ends(twin, moved, sides, 6.0))
            ways.append((both[0] - both[1]) / (2.0 * h))
        expected[:, column] = (4.0 * ways[1] - ways[0]) / 3.0
    size = np.abs(expected).max(axis=0)
    assert (np.abs(columns - expected) <= 1e-7 * size).all()


@dataclass(frozen=True, kw_only=True)
class Reordered(Machine):
    """The same, declared in another order, with a relay and a surface that nothing reads."""

    @property
    def surfaces(self):
        inert = Relay(name="lamp", on="is_right", off="is_left")
        return (*super().surfaces[::-1], inert, Surface(name="mark", coordinate="y", position=0.1))

    def is_right(self, t, q, v, load):
        return q[1] - 0.2

    def is_left(self, t, q, v, load):
        return -0.1 - q[1]


def test_neither_order_nor_what_nothing_reads_changes_a_motion():
    model, _ = random_machine(7)
    start = {"x": 0.1, "y": -0.2, "w": 0.15, "velocity": (0.3, 0.2)}
    sides = {"motor": False, "valve": False}
    system = System(
        model=model, load=Load(frequency=1.1, force=Harmonic(1.0)), impact=NewtonImpact(0.6)
    )
    other = dataclasses.replace(system, model=Reordered(**dataclasses.asdict(model)))
    one = simulate(system, **start, relays=sides, duration=12.0)
    two = simulate(other, **start, relays=sides | {"lamp": False}, duration=12.0)
    assert np.allclose(one.final_state, two.final_state, rtol=0.0, atol=1e-12)
    told = [event for event in two.events if event.contact not in ("lamp", "mark")]
    assert [event.contact for event in told] == [event.contact for event in one.events]
    assert len(two.events) > len(told) > 10
    assert np.allclose([event.time for event in told], times_of(one), rtol=0.0, atol=1e-12)


def test_a_thermostat_in_other_units_is_the_same():
    """Temperatures a thousand times larger."""

    @dataclass(frozen=True, kw_only=True)
    class InMillikelvin(Thermostat):
        def force(self, t, temperature, velocity, load, sides):
            return -0.1 * (temperature - 1e4) + self.power * (1.0 + sides.heater) / 2.0

    small = simulate(System(model=Thermostat()), T=18.0, duration=30.0)
    large = simulate(
        System(model=InMillikelvin(power=3e3, below=1.9e4, above=2.1e4)), T=1.8e4, duration=30.0
    )
    assert np.allclose(times_of(large), times_of(small), rtol=0.0, atol=1e-12)
    assert large.position == pytest.approx(1e3 * small.position, rel=1e-13)


@dataclass(frozen=True, kw_only=True)
class Bouncing(ContactModel):
    """A ball whose bounces are resets, and that a reset may throw below a contact."""

    thrown_to: float = 0.5

    coordinates: ClassVar[tuple[str, ...]] = ("y",)
    channels: ClassVar[tuple[str, ...]] = ("clock",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="floor", coordinate="y", position=-1.0),
    )
    surfaces: ClassVar[tuple[Surface, ...]] = (
        Surface(name="table", coordinate="y", sign=-1, after_event="bounced"),
        Surface(name="late", function="late", after_event="thrown"),
    )

    def bounced(self, t, y, velocity, load):
        return y, -0.5 * velocity

    def late(self, t, y, velocity, load):
        return load.clock(t) - math.sin(0.75)

    def thrown(self, t, y, velocity, load):
        return 0.0 * y + self.thrown_to, velocity

    def force(self, t, y, velocity, load, sides):
        return -1.0


def test_what_has_no_one_way_to_go_on_is_refused():
    def ball(thrown_to):
        clock = Load(frequency=0.5, clock=Harmonic(1.0))
        return System(model=Bouncing(thrown_to=thrown_to), load=clock, impact=NewtonImpact(0.5))

    with pytest.raises(MotionError, match=r"resets of the state accumulate at time 4\.[45]"):
        # it is thrown to 0.5 at 1.5, falls for 1, and then bounces for 1, 1/2, 1/4, ...
        simulate(ball(0.5), y=0.5, duration=9.0)
    with pytest.raises(MotionError, match="leaves it beyond a contact"):
        simulate(ball(-2.0), y=0.5, duration=9.0)
    # the floor is reached with the speed that the ball is thrown onto it with
    motion = simulate(ball(-1.0), y=2.0, duration=1.6)
    assert [event.contact for event in motion.events] == ["late", "floor"]
    assert motion.velocity == pytest.approx(0.5 * 1.5 - 0.1, abs=1e-12)
    equal = Thermostat(below=20.0, above=20.0)
    with pytest.raises(MotionError, match=r"'heater'.*both"):
        simulate(System(model=equal), T=18.0, duration=50.0)


def test_arguments_that_say_nothing_are_refused():
    system = System(model=Thermostat())
    with pytest.raises(ParameterError, match="does not say whether the relay 'heater' is on"):
        simulate(system, T=20.0, duration=1.0)
    with pytest.raises(ParameterError, match="must be given as True or False"):
        simulate(system, T=20.0, duration=1.0, relays={"heater": 2.5})
    with pytest.raises(ParameterError, match="has heater"):
        simulate(system, T=20.0, duration=1.0, relays={"cooler": True})
    with pytest.raises(ParameterError, match="has no relays"):
        simulate(System(model=Neuron()), u=0.0, duration=1.0, relays={"heater": True})
    with pytest.raises(ParameterError, match="are both positive at the start"):
        simulate(System(model=Thermostat(below=21.0, above=19.0)), T=20.0, duration=1.0)


def test_parts_that_are_none_are_refused():
    def model_with(*surfaces, **methods):
        parts = {"surfaces": surfaces, "coordinates": ("x",), "force": lambda *_: 0.0} | methods
        return dataclass(frozen=True, kw_only=True)(type("Broken", (ContactModel,), parts))

    with pytest.raises(ParameterError, match="the relay 'r' needs a method up"):
        System(model=model_with(Relay(name="r", on="up", off="up"))())
    with pytest.raises(ParameterError, match="needs a method jump"):
        System(model=model_with(Surface(name="s", coordinate="x", after_event="jump"))())
    with pytest.raises(ParameterError, match="must return the coordinates and the velocities"):
        System(
            model=model_with(
                Surface(name="s", coordinate="x", after_event="jump"),
                jump=lambda self, t, q, velocity, load: (q, velocity, 1.0),
            )()
        )
    with pytest.raises(ParameterError, match="'s' of Broken has an after_event beside a sum"):
        System(
            model=model_with(
                Surface(name="s", coordinate={"x": 1.0, "y": -1.0}, after_event="jump"),
                coordinates=("x", "y"),
                force=lambda *_: (0.0, 0.0),
                jump=lambda self, t, q, velocity, load: (q, velocity),
            )()
        )
    with pytest.raises(ParameterError, match="on of a Relay must be a text"):
        Relay(name="r", on=1.0, off="down")


def test_other_questions_refuse_relays_and_resets_by_name():
    system = System(model=Neuron())
    with pytest.raises(ParameterError, match="has 'threshold'; simulate, simulate_many"):
        saltus.search_orbits(system, "model.drive", [2.0, 3.0])
    room = System(model=Thermostat())
    with pytest.raises(ParameterError, match="search_orbits does not follow relays so far"):
        saltus.search_orbits(room, "model.power", [2.0, 3.0])
    with pytest.raises(
        ParameterError, match="ensembles have no derivatives of motions with relays"
    ):
        saltus.simulate_many(room, T=[18.0, 18.5], duration=1.0, sensitivities=())


@pytest.mark.parametrize("seed", [2, 6, 17, 22])
def test_orbits_of_random_machines_have_the_multipliers_of_differences(seed):
    """Two relays, resets, a contact and a coordinate of first order."""
    model, draw = random_machine(seed)
    load = Load(frequency=draw(0.6, 2.0), force=Harmonic(1.0))
    machine = System(model=model, load=load, impact=saltus.NewtonImpact(draw(0.3, 0.9)))
    begin = {"x": 0.1, "y": 0.0, "w": 0.0, "relays": {"motor": False, "valve": False}}
    orbit = saltus.find_orbit(machine, **begin, settle=300, max_period=8)
    assert orbit.defect < 1e-12
    start = orbit.start()
    assert dict(zip(start["relays"], orbit.signature.relays, strict=True)) == {
        name: 1 if side else -1 for name, side in start["relays"].items()
    }

    def mapped(state):
        motion = saltus.simulate(
            machine,
            **dict(zip("xyw", state[:3].tolist(), strict=True)),
            velocity=tuple(state[3:].tolist()),
            time=start["time"],
            relays=start["relays"],
            periods=orbit.period,
        )
        return np.array([*motion.position, *motion.velocity[:2]])

    h = 1e-6
    state = np.array([*(start[name] for name in "xyw"), *start["velocity"]])
    columns = [(mapped(state + step) - mapped(state - step)) / (2.0 * h) for step in h * np.eye(5)]
    expected = np.poly(np.linalg.eigvals(np.stack(columns, axis=1)))
    assert np.poly(orbit.multipliers) == pytest.approx(expected, abs=1e-7)


def model_of(coordinates, surfaces, force, first_order=(), contacts=(), **methods):
    """A model of these parts; its methods may be functions of the state alone."""
    parts = {
        "coordinates": coordinates,
        "first_order": first_order,
        "surfaces": surfaces,
        "contacts": contacts,
        "force": lambda self, t, q, v, load, sides: force,
    }
    parts |= {
        name: lambda self, t, q, v, load, method=method: method(q, v)
        for name, method in methods.items()
    }
    return dataclass(frozen=True, kw_only=True)(type("Made", (ContactModel,), parts))()


@pytest.mark.parametrize("order", [1, -1])
def test_a_ball_in_a_corner_of_two_resets_is_turned_round_by_both(order):
    """From 0 with the velocity (1, 1) to the corner at (1, 1) and back: x = y = 2 - t."""
    walls = (
        Surface(name="w", coordinate="x", position=1.0, after_event="turn_x"),
        Surface(name="u", coordinate="y", position=1.0, after_event="turn_y"),
    )
    model = model_of(
        ("x", "y"),
        walls[::order],
        (0.0, 0.0),
        turn_x=lambda q, v: (q, (-v[0], v[1])),
        turn_y=lambda q, v: (q, (v[0], -v[1])),
    )
    motion = simulate(System(model=model), x=0.0, y=0.0, velocity=(1.0, 1.0), duration=3.0)
    assert {event.contact for event in motion.events} == {"w", "u"}
    assert np.allclose(times_of(motion), 1.0, rtol=0.0, atol=1e-15)
    assert np.allclose(motion.position, -1.0, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("height", [0.5, 0.7, 1.3, 2.9])
def test_a_reset_at_the_instant_of_an_impact_acts(height):
    """x = 1 is reached at sqrt(2 y0), when the ball falls onto the floor; behind it x = 2 - w t."""
    speed = 1.0 / math.sqrt(2.0 * height)
    model = model_of(
        ("x", "y"),
        (Surface(name="w", coordinate="x", position=1.0, after_event="turn"),),
        (0.0, -1.0),
        contacts=(Contact(name="floor", coordinate="y"),),
        turn=lambda q, v: (q, (-v[0], v[1])),
    )
    system = System(model=model, impact=NewtonImpact(0.5))
    motion = simulate(system, x=0.0, y=height, velocity=(speed, 0.0), duration=3.0)
    assert {event.contact for event in motion.events[:2]} == {"w", "floor"}
    assert motion.position[0] == pytest.approx(2.0 - 3.0 * speed, abs=1e-12)


def twin_resets(parts, order, first, second):
    return System(
        model=model_of(
            ("x", "y"),
            parts[::order],
            (0.0, 0.0),
            on=lambda q, v: q[0] - 1.0,
            off=lambda q, v: -q[0],
            first=first,
            second=second,
        )
    )


@pytest.mark.parametrize("order", [1, -1])
def test_resets_at_one_instant_act_both_or_are_refused(order):
    """Doubling x' and lifting y by 10 commute; doubling x' and adding 1 to it do not."""
    relays = (
        Relay(name="r", on="on", off="off", after_event="first"),
        Relay(name="s", on="on", off="off", after_event="second"),
    )
    surfaces = (
        Surface(name="r", coordinate="x", position=1.0, after_event="first"),
        Surface(name="s", function="on", after_event="second"),
    )
    for parts, sides in ((relays, {"r": False, "s": False}), (surfaces, None)):
        lift = lambda q, v: ((q[0], q[1] + 10.0), v)  # noqa: E731
        twice = lambda q, v: (q, (2.0 * v[0], v[1]))  # noqa: E731
        more = lambda q, v: (q, (v[0] + 1.0, v[1]))  # noqa: E731
        start = {"x": 0.0, "y": 0.0, "velocity": (1.0, 0.0), "duration": 3.0, "relays": sides}
        motion = simulate(twin_resets(parts, order, lift, twice), **start)
        assert len(motion.events) == 2
        assert motion.position == pytest.approx((5.0, 10.0), abs=1e-13)
        with pytest.raises(MotionError, match=r"at one instant at time 1, of '[rs]' and '[rs]'"):
            simulate(twin_resets(parts, order, more, twice), **start)


def test_resets_that_accumulate_at_their_threshold_are_refused():
    """u' = 1, and u = 1 is reset to 1 - d with a d that is halved each time: up to t = 2."""
    neuron = model_of(
        ("u", "d"),
        (Surface(name="fires", coordinate="u", position=1.0, after_event="fired"),),
        (1.0, 0.0),
        first_order=("u", "d"),
        fired=lambda q, v: ((1.0 - q[1], 0.5 * q[1]), v),
    )
    with pytest.raises(MotionError, match="resets of the state accumulate at time 2, at 'fires'"):
        simulate(System(model=neuron), u=0.0, d=0.5, duration=20.0)
    # two walls that come nearer with each reset: x goes 1, 1/2, 1, 1/4, ... up to t = 4
    walls = model_of(
        ("x", "d"),
        (
            Surface(name="up", function="above", after_event="turn"),
            Surface(name="down", function="below", after_event="turn"),
        ),
        (0.0, 0.0),
        above=lambda q, v: q[0] - q[1],
        below=lambda q, v: -q[0] - q[1],
        turn=lambda q, v: ((q[0], 0.5 * q[1]), (-v[0], v[1])),
    )
    with pytest.raises(MotionError, match=r"resets of the state accumulate at time (4|3\.99999)"):
        simulate(System(model=walls), x=0.0, d=1.0, velocity=(1.0, 0.0), duration=20.0)


def test_a_reset_that_leaves_its_own_function_lets_the_motion_pass():
    """x' is doubled at x = 1, once."""
    model = model_of(
        ("x",),
        (Surface(name="w", coordinate="x", position=1.0, after_event="kick"),),
        0.0,
        kick=lambda q, v: (q, 2.0 * v),
    )
    motion = simulate(System(model=model), x=0.0, velocity=1.0, duration=3.0)
    assert len(motion.events) == 1
    assert motion.position == pytest.approx(5.0, abs=1e-13)


def test_what_a_reset_returns_is_checked():
    def one(after):
        return System(
            model=model_of(
                ("x",),
                (Surface(name="w", coordinate="x", position=1.0, after_event="jump"),),
                0.0,
                jump=after,
            )
        )

    def go(system):
        return simulate(system, x=0.0, velocity=1.0, duration=3.0)

    with pytest.raises(ParameterError, match=r"Made\.jump must return the coordinates and the vel"):
        go(one(lambda q, v: None))
    for after in (
        lambda q, v: (q, np.sqrt(q - 2.0)),
        lambda q, v: (np.log(-q), v),
        lambda q, v: (1.0 / (q - 1.0), v),
    ):
        with pytest.raises(MotionError, match=r"Made\.jump, after_event of 'w', has no value"):
            go(one(after))
    both = model_of(
        ("x", "y"),
        (Surface(name="w", coordinate="x", position=1.0, after_event="jump"),),
        (0.0, 0.0),
        jump=lambda q, v: (0.5 * np.array(q), -np.array(v)),
    )
    motion = simulate(System(model=both), x=0.0, y=0.0, velocity=(1.0, 0.5), duration=2.0)
    assert motion.position == pytest.approx((-0.5, -0.25), abs=1e-13)


def test_a_relay_is_given_as_one_value_and_its_thresholds_lie_apart():
    system = System(model=Thermostat())
    with pytest.raises(ParameterError, match="must be given as True or False"):
        simulate(system, T=20.0, duration=1.0, relays={"heater": np.array([True, False])})
    # the heater goes off at 19 at the latest, and on below 20
    crossed = System(model=Thermostat(below=20.0, above=19.0))
    with pytest.raises(MotionError, match="'heater' is set to both sides: too_cold, by which"):
        simulate(crossed, T=18.0, duration=1.0)
    near = System(model=Thermostat(below=20.0, above=20.0 + 1e-9))
    with pytest.raises(
        MotionError, match=r"more than 20000 events .* set thresholds further apart"
    ):
        simulate(near, T=18.0, duration=1.0)
