"""More gaps than coordinates: rows of balls between two walls, a table that shakes under a ceiling;
against exact results.
"""

import dataclasses
import itertools
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_bodies import checked

import saltus
from saltus import Contact, ContactModel, NewtonImpact
from saltus.flow import sensitivities, simulate, simulate_many
from saltus.systems import Harmonic, Load, System


def row_between_walls(count):
    """Balls without size between walls at 0 and at a length, which nothing pulls."""
    names = tuple(f"x{i}" for i in range(count))

    def contacts(self):
        pairs = [
            Contact(name=f"{a}{b}", coordinate={b: 1.0, a: -1.0})
            for a, b in itertools.pairwise(names)
        ]
        left, right = (
            Contact(name="left", coordinate="x0"),
            Contact(name="right", coordinate=names[-1], sign=-1, position=self.length),
        )
        return left, *pairs, right

    def mass_matrix(self, q):
        return [[getattr(self, f"m{i}") * (i == j) for j in range(count)] for i in range(count)]

    numbers = [
        (name, float, dataclasses.field(default=1.0))
        for name in (*(f"m{i}" for i in range(count)), "length")
    ]
    space = {"coordinates": names, "contacts": property(contacts), "mass_matrix": mass_matrix}
    space["force"] = lambda self, t, q, velocity, load: [0.0 * x for x in q]
    return dataclasses.make_dataclass(
        "Row", numbers, bases=(ContactModel,), namespace=space, frozen=True, kw_only=True
    )


TEN = row_between_walls(10)


def test_ten_balls_between_two_walls_are_lines_that_are_reflected():
    """Equal balls without loss pass through one another: eleven gaps of ten coordinates."""
    random, time = np.random.default_rng(1), 60.0
    system = System(model=TEN(length=10.0), impact=NewtonImpact(e=1.0))
    begin, speeds = np.sort(random.uniform(0.0, 10.0, 10)), random.normal(size=10)
    motion = simulate(
        system,
        **dict(zip(TEN.coordinates, begin, strict=True)),
        velocity=tuple(speeds),
        duration=time,
    )
    unfolded = (begin + time * speeds) % 20.0
    lines, rates = np.where(unfolded <= 10.0, [unfolded, speeds], [20.0 - unfolded, -speeds])
    order = np.argsort(lines)
    assert len(motion.impacts) > 150
    np.testing.assert_allclose(motion.position, lines[order], rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.velocity, rates[order], rtol=0, atol=1e-13)
    hits = [event.time for event in motion.events if event.contact in ("left", "right")]
    met = [(k * 10.0 - x) / v for x, v in zip(begin, speeds, strict=True) for k in range(-60, 61)]
    np.testing.assert_allclose(
        hits, np.sort([t for t in met if 0.0 < t < time]), rtol=0, atol=1e-11
    )


def check_balances(row, random):
    """Momentum with the impulses of the walls, and energy with half the sum of J (1 - e) abs(v-);
    returns the number of impacts."""
    count = len(row.coordinates)
    masses, e, length = (
        random.uniform(0.2, 3.0, count),
        random.uniform(0.5, 1.0),
        random.uniform(1.0, 5.0),
    )
    model = row(**{f"m{i}": float(m) for i, m in enumerate(masses)}, length=float(length))
    begin, velocity = np.sort(random.uniform(0.0, length, count)), random.normal(size=count)
    system = System(model=model, impact=NewtonImpact(e=float(e)))
    motion = simulate(
        system,
        **dict(zip(row.coordinates, begin, strict=True)),
        velocity=tuple(velocity),
        duration=20.0,
    )
    times = np.linspace(0.0, 20.0, 100)
    position, rates = motion.at(times)
    assert (np.diff(position, axis=0, prepend=0.0, append=length) > -1e-12).all()
    given, lost = np.zeros(times.size), np.zeros(times.size)
    for event in (event for event in motion.events if event.kind == "impact"):
        closing = np.minimum(np.diff(event.velocity_before, prepend=0.0, append=0.0), 0.0)
        given += np.where(times >= event.time, event.impulse[0] - event.impulse[-1], 0.0)
        lost += np.where(times >= event.time, (1.0 - e) * np.dot(event.impulse, -closing) / 2, 0.0)
    # those lose more, in impacts that are not resolved
    if any(event.kind == "held" for event in motion.events):
        return 0
    np.testing.assert_allclose(masses @ rates, masses @ velocity + given, rtol=0, atol=1e-12)
    stored = masses @ rates**2 / 2
    np.testing.assert_allclose(stored + lost, stored[0], rtol=0, atol=1e-12 * max(1.0, stored[0]))
    return len(motion.impacts)


@pytest.mark.parametrize("seed", range(3))
def test_rows_of_unequal_masses_between_walls_keep_the_balances(seed):
    assert check_balances(TEN, np.random.default_rng(seed)) >= 10


# Of the rows below, by their numbers, the first that end in a collapse of four to eight balls.
COLLAPSES = (12, 27, 34, 52, 69, 681)


def test_balls_that_collapse_at_a_wall_stay_there_until_they_are_struck():
    """Nothing presses on them: the rounding of a sum, or of a coupling that is 0, must not open
    their contacts.
    """
    random = np.random.default_rng(11)
    rows = [row_between_walls(count) for count in range(2, 9)]
    for number in range(max(COLLAPSES) + 1):
        row = rows[number % len(rows)]
        count = len(row.coordinates)
        if number in COLLAPSES:
            check_balances(row, random)
        else:  # as many random numbers
            random.uniform(size=count + 2)
            random.uniform(size=count)
            random.normal(size=count)


@pytest.mark.thorough
def test_ten_thousand_rows_between_walls_keep_the_balances():
    """About one in three hundred is refused, with its contacts: balls that collapse beside others
    that still move.
    """
    impacts, refused = checked(
        [row_between_walls(count) for count in range(2, 9)],
        check_balances,
        np.random.default_rng(11),
    )
    assert impacts > 100_000
    assert refused <= 60


@dataclass(frozen=True, kw_only=True)
class Ball(ContactModel):
    """x'' = -g between a table that shakes and a ceiling that does not: two gaps of one
    coordinate.
    """

    gravity: float = 0.3
    height: float = 2.5

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)

    @property
    def contacts(self):
        table = Contact(name="table", coordinate={"x": 1.0, "ground": -1.0})
        return table, Contact(name="ceiling", coordinate="x", sign=-1, position=self.height)

    def force(self, t, x, velocity, load):
        return -self.gravity


def under_a_ceiling(amplitude, e, **numbers):
    return System(
        model=Ball(**numbers),
        load=Load(frequency=1.0, ground=Harmonic(amplitude)),
        impact=NewtonImpact(e=e),
    )


def by_dop853(system, x, v, end):
    """Times of the impacts, one after the other, with those that a table or a ceiling stops."""
    model, ground, e, t, times = system.model, system.load.ground, system.impact.e, 0.0, []

    def table(t, state):
        return state[0] - ground(t)

    def ceiling(t, state):
        return model.height - state[0]

    for event in (table, ceiling):
        event.terminal, event.direction = True, -1
    while True:
        given = {
            "method": "DOP853",
            "rtol": 1e-13,
            "atol": 1e-14,
            "max_step": 0.5,
            "events": (table, ceiling),
        }
        found = solve_ivp(lambda t, state: [state[1], -model.gravity], (t, end), (x, v), **given)
        if found.status == 0:
            return np.array(times)
        t, (x, v) = found.t[-1], found.y[:, -1]
        times.append(t)
        moves, clear = (ground.velocity(t), 1e-15) if found.t_events[0].size else (0.0, -1e-15)
        x, v = x + clear, moves - e * (v - moves)


def test_a_table_that_shakes_under_a_ceiling_is_followed_as_by_dop853():
    system = under_a_ceiling(1.3, 0.9)
    motion, times = (
        simulate(system, x=1.0, velocity=0.5, duration=14.0),
        by_dop853(system, 1.0, 0.5, 14.0),
    )
    assert {event.contact for event in motion.events} == {"table", "ceiling"}
    assert len(times) == len(motion.impacts) >= 8
    np.testing.assert_allclose(motion.impacts.time, times, rtol=0, atol=1e-11)


def test_a_ball_that_rests_on_a_table_under_a_ceiling_is_thrown_when_its_closed_form_says():
    """It is pressed while a sin(t) < g, flies up with v = a cos(t), and hits a ceiling that it
    reaches on its way.
    """
    system = under_a_ceiling(1.6, 0.6, gravity=1.0, height=1.75)
    motion = simulate(system, x=0.0, velocity=1.6, duration=2.0)
    rest, release, impact = motion.events
    assert [(e.kind, e.contact) for e in motion.events] == [
        ("rest", "table"),
        ("release", "table"),
        ("impact", "ceiling"),
    ]
    left, speed = math.asin(1.0 / 1.6), math.sqrt(1.6**2 - 1.0)
    assert rest.time == 0.0
    assert release.time == pytest.approx(left, abs=1e-12)
    flight = speed - math.sqrt(speed**2 - 2.0 * 0.75)  # from the height 1
    assert impact.time == pytest.approx(left + flight, abs=1e-12)
    x, v = motion.at(0.5)
    assert x == pytest.approx(1.6 * math.sin(0.5), abs=1e-14)
    assert v == pytest.approx(1.6 * math.cos(0.5), abs=1e-14)


@dataclass(frozen=True, kw_only=True)
class Pressed(ContactModel):
    """Two masses between two walls, one pushed by cos(t) and the other by -1/2: the gap between
    them depends on those at the walls."""

    length: float = 10.0
    mass: float = 2.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")

    @property
    def contacts(self):
        right = Contact(name="right", coordinate="y", sign=-1, position=self.length)
        return (
            Contact(name="left", coordinate="x"),
            right,
            Contact(name="between", coordinate={"y": 1.0, "x": -1.0}),
        )

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, self.mass]]

    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, q, velocity, load):
        return load.force(t), -0.5 + 0.0 * q[1]


PUSHED = System(
    model=Pressed(),
    load=Load(frequency=1.0, force=Harmonic(1.0, phase=math.pi / 2)),
    impact=NewtonImpact(e=0.0),
)
PARTED = math.acos(-0.25)  # the reaction (2 cos(t) + 1/2) / 3 vanishes


def pressed(t):
    """Positions and velocities of both masses, which start together at rest at 5."""
    s = min(t, PARTED)
    x = 5.0 + (1.0 - math.cos(s)) / 3.0 - s**2 / 12.0
    v = math.sin(s) / 3.0 - s / 6.0
    left = t - s
    one = x + v * left - math.cos(t) + math.cos(s) - math.sin(s) * left
    return (one, x + v * left - left**2 / 8.0), (v + math.sin(t) - math.sin(s), v - left / 4.0)


def test_masses_that_are_pressed_together_move_as_one_until_their_reaction_vanishes():
    motion = simulate(PUSHED, x=5.0, y=5.0, velocity=(0.0, 0.0), duration=3.0)
    (release,) = motion.events
    assert (release.kind, release.contact) == ("release", "between")
    assert release.time == pytest.approx(PARTED, abs=1e-12)
    for t in (0.5, 1.5, 2.5, 3.0):
        np.testing.assert_allclose(motion.at(t), pressed(t), rtol=0, atol=1e-13)
    assert simulate(PUSHED, x=5.0, y=5.0, velocity=(0.0, 0.0), duration=1.0).closed == ("between",)


def stack(ceiling):
    """Three balls of size 1 that fall on a floor and on one another; with a ceiling that none of
    them reaches, or without.
    """
    names = ("x0", "x1", "x2")
    above = [
        Contact(name=f"{a}{b}", coordinate={b: 1.0, a: -1.0}, position=1.0)
        for a, b in itertools.pairwise(names)
    ]
    given = [Contact(name="floor", coordinate="x0"), *above]
    given += [Contact(name="ceiling", coordinate="x2", sign=-1, position=50.0)] if ceiling else []
    space = {
        "coordinates": names,
        "contacts": tuple(given),
        "force": lambda self, t, q, velocity, load: [-1.0] * 3,
    }
    return dataclasses.make_dataclass(
        "Stack", [], bases=(ContactModel,), namespace=space, frozen=True
    )()


@pytest.mark.parametrize("e", [0.0, 0.3])
def test_balls_come_to_rest_under_a_ceiling_as_they_do_without_it(e):
    one, other = (
        System(model=stack(ceiling), impact=NewtonImpact(e=e)) for ceiling in (True, False)
    )
    assert one.in_gap_coordinates.model.dependent == 1
    start = {"x0": 1.0, "x1": 2.3, "x2": 3.6, "velocity": 0.0, "duration": 6.0}
    under, free = simulate(one, **start), simulate(other, **start)
    assert str(under.stop) == str(free.stop) == "rest"
    # the natural time of a system without a load depends on the ceiling, and with it, how many
    # impacts of the last accumulation are followed one by one
    alike = 40
    kinds = [[(e.kind, e.contact) for e in each.events[:alike]] for each in (under, free)]
    assert kinds[0] == kinds[1]
    times = [each.events.times[:alike] for each in (under, free)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-11)
    assert under.rest_time == pytest.approx(free.rest_time, abs=1e-9)
    np.testing.assert_allclose(under.position, [0.0, 1.0, 2.0], rtol=0, atol=1e-13)
    times = np.linspace(0.0, 6.0, 200)
    np.testing.assert_allclose(under.at(times), free.at(times), rtol=0, atol=1e-11)


def test_what_has_no_motion_is_refused_by_name():
    with pytest.raises(
        saltus.ParameterError,
        match=r"'between' closes where .* do, and only there: they leave no room",
    ):
        System(model=Pressed(length=0.0), impact=NewtonImpact(e=0.0))
    corner = (Contact(name="a", coordinate="x"), Contact(name="b", coordinate="y"))
    space = {
        "coordinates": ("x", "y"),
        "contacts": (*corner, Contact(name="c", coordinate={"x": 1.0, "y": 1.0})),
    }
    space["force"] = lambda self, t, q, velocity, load: [-1.0, -1.0]
    with pytest.raises(
        saltus.ParameterError, match="'c' closes where a and b do, and only there: leave it out"
    ):
        System(
            model=dataclasses.make_dataclass(
                "Corner", [], bases=(ContactModel,), namespace=space, frozen=True
            )()
        )
    with pytest.raises(
        saltus.ParameterError, match="whose contacts can all be closed, and here gaps depend"
    ):
        saltus.flow.load_releases(under_a_ceiling(1.3, 0.9))


@pytest.mark.parametrize("e", [0.6, 0.0])
def test_a_ball_that_a_table_crushes_at_a_ceiling_is_refused_when_the_room_is_gone(e):
    """The table reaches the ceiling at the height 1 where sin(t) = 1 / 1.3, however often the ball
    is hit before.
    """
    with pytest.raises(
        saltus.MotionError,
        match=r"crushed between the contacts 'table' and 'ceiling' at time 0\.877636419,",
    ):
        simulate(under_a_ceiling(1.3, e, height=1.0), x=0.5, duration=3.0)
    assert math.asin(1.0 / 1.3) == pytest.approx(0.877636419, abs=5e-10)


def test_a_row_that_collapses_at_a_wall_without_a_force_is_followed():
    """Gaps of 1e-12 that its accumulation closes leave reactions of no certain sign, which decide
    nothing.
    """
    random = np.random.default_rng(11)
    for i in range(247):
        count = 2 + i % 7
        random.uniform(size=count + 2)
        random.uniform(size=count)
        random.normal(size=count)
    assert check_balances(row_between_walls(4), random) == 0  # contacts are held


PATHS = ("model.gravity", "model.height", "load.ground.amplitude", "load.frequency", "impact.e")


def test_derivatives_beside_a_dependent_gap_are_those_of_differences():
    system, given, step = (
        under_a_ceiling(1.3, 0.9),
        {"x": 1.0, "velocity": 0.5, "duration": 8.0},
        1e-6,
    )
    found, columns = sensitivities(system, parameters=PATHS, **given), []
    assert {event.contact for event in found.motion.events} == {"table", "ceiling"}
    for j, path in enumerate(("x", "velocity", *PATHS)):
        ends = []
        for sign in (step, -step):
            moved = given | ({path: given[path] + sign} if j < 2 else {})
            twin = system if j < 2 else system.with_({path: system.get(path) + sign})
            ends.append(simulate(twin, **moved).final_state)
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    np.testing.assert_allclose(
        np.hstack([found.state, found.parameters]), np.array(columns).T, rtol=0, atol=1e-7
    )


def test_derivatives_of_masses_that_are_pressed_together_are_those_of_their_closed_form():
    """To the mass of the second one, by complex numbers in the closed form of a motion that is
    pressed all the time.
    """
    found = sensitivities(
        PUSHED, parameters=("model.mass",), x=5.0, y=5.0, velocity=(0.0, 0.0), duration=1.0
    )
    slope = -(1.0 - math.cos(1.0) - 0.25) / 9.0  # of (1 - cos(t) - t^2 / 4) / (1 + m)
    np.testing.assert_allclose(found.parameters[:2, 0], [slope, slope], rtol=0, atol=1e-13)


def test_lanes_with_a_dependent_gap_are_followed_as_one_by_one():
    system, x = under_a_ceiling(1.3, 0.9), np.linspace(0.2, 2.4, 9)
    many = simulate_many(system, x=x, velocity=0.2, duration=12.0, last=2, sample="state")
    for i in range(x.size):
        one = simulate(system, x=float(x[i]), velocity=0.2, duration=12.0)
        assert many.impact_count.values[i] == len(one.impacts)
        np.testing.assert_allclose(
            [many.x.values[i], many.velocity.values[i]], one.final_state, rtol=0, atol=1e-9
        )
        sampled = [many.sampled_x.values[i, 0], many.sampled_velocity.values[i, 0]]
        np.testing.assert_allclose(sampled, one.at(2.0 * math.pi), rtol=0, atol=1e-9)


def test_a_class_that_is_no_dataclass_may_keep_sums():
    """A model without numbers of its own works without the decorator in each kind of
    coordinates.
    """

    class Pair(ContactModel):
        coordinates = ("a", "b")
        contacts = (Contact(name="between", coordinate={"b": 1.0, "a": -1.0}),)

        def force(self, t, q, velocity, load):
            return 0.0 * q[0], 0.0 * q[1]

    motion = simulate(
        System(model=Pair(), impact=NewtonImpact(e=1.0)),
        a=0.0,
        b=1.0,
        velocity=(1.0, 0.0),
        duration=3.0,
    )
    np.testing.assert_allclose(
        [motion.a, motion.b, *motion.velocity], [1.0, 3.0, 0.0, 1.0], rtol=0, atol=1e-14
    )
