"""Orbits, branches and attractors of models with more gaps than coordinates, against the same
models with one gap for each coordinate, closed forms and differences of motions."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

import saltus
from saltus import Contact, ContactModel, NewtonImpact
from saltus.flow import simulate
from saltus.orbits import PeriodicOrbit, Signature, equations_of
from saltus.systems import (
    Harmonic,
    Load,
    System,
    arguments_of,
    before_impacts,
    initial_states,
    on_this_side,
    states_beside,
)


@dataclass(frozen=True, kw_only=True)
class Stops(ContactModel):
    """x'' = force - 0.1 x' - x between stops, whose second gap is written as that of 2 x."""

    width: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    kept: ClassVar[tuple] = ({"x": 2.0}, 2.0)

    @property
    def contacts(self):
        q, factor = self.kept
        right = Contact(name="right", coordinate=q, sign=-1, position=factor * self.width)
        return Contact(name="left", coordinate="x", position=-self.width), right

    def force(self, t, x, velocity, load):
        return load.force(t) - 0.1 * velocity - x


@dataclass(frozen=True, kw_only=True)
class Plain(Stops):
    """The same with two gaps of x itself, none of which depends on another."""

    kept: ClassVar[tuple] = ("x", 1.0)


def between(model, amplitude):
    return System(
        model=model, load=Load(frequency=0.7, force=Harmonic(amplitude)), impact=NewtonImpact(e=0.8)
    )


def test_an_orbit_has_the_multipliers_of_two_stops_of_one_coordinate():
    """Two of them, and none of the dependent gap."""
    plain, orbit = (
        saltus.find_orbit(between(model, 0.68), x=0.9, velocity=-0.2)
        for model in (Plain(), Stops())
    )
    assert len(orbit.multipliers) == 2
    np.testing.assert_allclose(orbit.multipliers, plain.multipliers[:2], rtol=0, atol=1e-11)


def test_orbits_branches_and_special_points_are_those_of_two_stops_of_one_coordinate():
    """Two multipliers, and none of the dependent gap; both end at their own image, a BPC."""
    found = []
    for model in (Plain(), Stops()):
        orbit = saltus.find_orbit(between(model, 0.68), x=0.9, velocity=-0.2)
        found.append(
            (orbit, saltus.continue_orbit(orbit, "load.force.amplitude", bounds=(0.68, 0.73)))
        )
    (plain, branch), (orbit, other) = found
    assert len(orbit.multipliers) == 2
    assert orbit.residual < 1e-13
    np.testing.assert_allclose(orbit.multipliers, plain.multipliers[:2], rtol=0, atol=1e-11)
    np.testing.assert_allclose(orbit.section_state, plain.section_state, rtol=0, atol=1e-12)
    assert [str(p.kind) for p in other.special] == [str(p.kind) for p in branch.special]
    assert [str(p.kind) for p in other.special] == ["BPC"]
    for one, two in zip(other.special, branch.special, strict=True):
        assert one.parameter == pytest.approx(two.parameter, abs=1e-7)


def test_motions_of_a_window_end_on_the_attractors_of_two_stops_of_one_coordinate():
    plain, system = (between(model, 0.6) for model in (Plain(), Stops()))
    window = [(-1.0, 1.0), (-1.5, 1.5)]
    for one, two in zip(
        *(saltus.find_attractors(each, window=window, starts=32) for each in (plain, system)),
        strict=True,
    ):
        assert one.starts == two.starts
        assert abs(two.orbit.multipliers[0]) == pytest.approx(
            abs(one.orbit.multipliers[0]), abs=1e-9
        )
    verdicts = [saltus.classify(each, x=0.3, velocity=0.2) for each in (plain, system)]
    assert [str(verdict.kind) for verdict in verdicts] == ["periodic", "periodic"]
    sweeps = [
        saltus.frequency_sweep(each, [0.68, 0.7, 0.72], periods=200, x=0.1)
        for each in (plain, system)
    ]
    np.testing.assert_allclose(sweeps[1].amplitude, sweeps[0].amplitude, rtol=0, atol=1e-9)
    np.testing.assert_allclose(sweeps[1].x, sweeps[0].x, rtol=0, atol=1e-8)


@dataclass(frozen=True, kw_only=True)
class Ball(ContactModel):
    """x'' = -g between a table that shakes and a ceiling that does not."""

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


def thrown(frequency=2.0, amplitude=0.5, e=0.6):
    return System(
        model=Ball(),
        load=Load(frequency=frequency, ground=Harmonic(amplitude)),
        impact=NewtonImpact(e=e),
    )


def test_a_ball_that_hits_table_and_ceiling_once_a_period_follows_its_parabolas():
    """Its impact times by their equations; the product of its multipliers is e^4, as each impact
    contracts areas by e^2.
    """
    system, e = thrown(), 0.6
    orbit = saltus.find_orbit(system, x=1.5, velocity=1.0)

    def apart(unknowns):
        hit, flight, speed = unknowns
        x, w = 0.5 * math.sin(2.0 * hit), math.cos(2.0 * hit)
        back = -e * (speed - 0.3 * flight)
        fall = math.pi - flight
        landed = 2.5 + back * fall - 0.15 * fall**2 - x
        return (
            x + speed * flight - 0.15 * flight**2 - 2.5,
            landed,
            (1.0 + e) * w - e * (back - 0.3 * fall) - speed,
        )

    table, ceiling = (orbit.motion().events[k].time for k in range(2))
    speed = float(orbit.motion().events[0].velocity_after[0])
    exact, _, solved, _ = fsolve(
        apart, (table, ceiling - table, speed), xtol=1e-14, full_output=True
    )
    assert solved == 1
    np.testing.assert_allclose((table, ceiling - table, speed), exact, rtol=0, atol=1e-12)
    assert float(np.prod(orbit.multipliers).real) == pytest.approx(e**4, rel=1e-11)
    slope, step = np.empty((2, 2)), 1e-6
    for j in range(2):
        ends = []
        for sign in (step, -step):
            x, v = orbit.section_state + sign * np.eye(2)[j]
            ends.append(simulate(system, x=x, velocity=v, periods=1, tol=1e-14).final_state)
        slope[:, j] = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(
        np.sort(np.linalg.eigvals(slope)), np.sort(orbit.multipliers.real), rtol=0, atol=1e-8
    )


def parabolas(amplitude, t, v):
    """The next time at which a ball leaves the table, and its velocity then, with one impact at the
    ceiling in between.
    """
    x = amplitude * math.sin(2.0 * t)
    rise = (v - math.sqrt(v**2 - 0.6 * (2.5 - x))) / 0.3
    back = -0.6 * (v - 0.3 * rise)
    later = (
        t
        + rise
        + brentq(
            lambda s: 2.5 + back * s - 0.15 * s**2 - amplitude * math.sin(2.0 * (t + rise + s)),
            0.5,
            3.0,
            xtol=1e-15,
        )
    )
    w = 2.0 * amplitude * math.cos(2.0 * later)
    return later, 1.6 * w - 0.6 * (back - 0.3 * (later - t - rise))


def test_the_doubling_of_a_ball_between_table_and_ceiling_is_that_of_its_parabolas():
    orbit = saltus.find_orbit(thrown(), x=1.5, velocity=1.0)
    branch = saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=(0.495, 0.53))
    (doubling,) = [point for point in branch.special if str(point.kind) == "PD"]
    hit = orbit.motion().events[0]
    begin = hit.time % math.pi, float(hit.velocity_after[0])

    def flips(amplitude):
        fixed = fsolve(
            lambda y: np.subtract(parabolas(amplitude, *y), y) - (math.pi, 0.0), begin, xtol=1e-12
        )
        columns = [
            np.subtract(parabolas(amplitude, *(fixed + s)), parabolas(amplitude, *(fixed - s)))
            / 2e-6
            for s in 1e-6 * np.eye(2)
        ]
        return np.linalg.det(np.array(columns).T + np.eye(2))

    assert doubling.parameter == pytest.approx(brentq(flips, 0.5, 0.53, xtol=1e-12), abs=1e-7)
    np.testing.assert_allclose(doubling.orbit.multipliers, [-1.0, -(0.6**4)], rtol=0, atol=1e-7)


def test_exponents_of_a_ball_under_a_ceiling_are_those_of_its_orbit():
    """Two, and none of the dependent gap."""
    orbit = saltus.find_orbit(thrown(), x=1.5, velocity=1.0)
    found = saltus.lyapunov_spectrum(
        thrown(), **arguments_of(thrown(), orbit.section_state), periods=32, transient=0
    )
    np.testing.assert_allclose(
        found.values, np.log(np.abs(orbit.multipliers)) / math.pi, rtol=0, atol=1e-5
    )
    assert float(found.values.sum()) == pytest.approx(4.0 * math.log(0.6) / math.pi, rel=1e-8)


@dataclass(frozen=True, kw_only=True)
class Pair(ContactModel):
    """Two masses on springs that are pressed together for a part of the time, between walls that
    neither of them reaches.
    """

    length: float = 40.0
    mass: float = 2.0

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        left = Contact(name="left", coordinate="x", position=-self.length)
        right = Contact(name="right", coordinate="y", sign=-1, position=self.length)
        return left, right, self.pressed

    @property
    def pressed(self):
        return Contact(name="between", coordinate={"y": 1.0, "x": -1.0})

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, self.mass]]

    def force(self, t, q, v, load):
        return load.force(t) - q[0] - 0.2 * v[0], -1.0 - 2.0 * q[1] - 0.1 * v[1]


@dataclass(frozen=True, kw_only=True)
class Free(Pair):
    """The same without the walls, so that their gap is a coordinate."""

    @property
    def contacts(self):
        return (self.pressed,)


def pair(model, e=0.3):
    return System(
        model=model, load=Load(frequency=1.0, force=Harmonic(1.5)), impact=NewtonImpact(e=e)
    )


def test_an_orbit_whose_dependent_gap_is_closed_at_its_section_has_the_multipliers_of_one_without_walls():
    free, orbit = (
        saltus.find_orbit(pair(model), x=-0.6, y=0.3, velocity=(0.0, 0.0))
        for model in (Free(), Pair())
    )
    assert "held" in [str(event.kind) for event in orbit.motion().events]
    np.testing.assert_allclose(orbit.section_state, free.section_state, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        np.sort(np.abs(orbit.multipliers)), np.sort(np.abs(free.multipliers)), rtol=0, atol=1e-10
    )


@pytest.mark.parametrize(
    ("system", "paths", "start", "section"),
    [
        (
            thrown(),
            ("load.frequency", "load.ground.amplitude", "model.height", "impact.e"),
            (1.5, 1.0),
            0.7,
        ),
        (
            pair(Pair()),
            ("load.frequency", "model.mass", "load.force.amplitude"),
            (-0.6, 0.3, 0.0, 0.0),
            2.4,
        ),
    ],
    ids=["open", "closed"],
)
def test_derivatives_of_the_equations_of_an_orbit_are_those_of_differences(
    system, paths, start, section
):
    """With the dependent gap open at the section, and with it closed there."""
    equations = equations_of(system, Signature((), 1, section=section), paths)
    motion = simulate(system, **arguments_of(system, np.array(start)), duration=40.0 * math.tau)
    q, v = motion.at((39.0 * math.tau + section) / equations.frequency(equations.values))
    guess = np.concatenate(
        system.to_gaps(section / system.load.frequency, np.atleast_1d(q), np.atleast_1d(v))
    )
    orbit, step = PeriodicOrbit.near(equations, guess, equations.values, iterations=25), 1e-6
    unknowns, found = orbit.solution.unknowns, orbit.solution.evaluation
    closed = {*equations.held(unknowns, equations.system)} & {*equations.following}
    assert bool(closed) == (section == 2.4)

    def compare(columns, shifts):
        for j, (moved, raised) in enumerate(shifts):
            places = [(unknowns + s * moved, equations.values + s * raised) for s in (step, -step)]
            ahead, behind = (equations.evaluate(*place).residual for place in places)
            np.testing.assert_allclose(
                columns[:, j], (ahead - behind) / (2.0 * step), rtol=1e-7, atol=1e-8
            )

    compare(found.parameters, [(0.0 * unknowns, row) for row in np.eye(len(paths))])
    if not closed:  # a state off the surface of a closed contact is put onto it
        chosen = [i for i in range(len(unknowns)) if i not in equations.following]
        compare(found.jacobian()[:, chosen], [(row, 0.0) for row in np.eye(len(unknowns))[chosen]])


def test_states_of_a_window_lie_on_this_side_of_dependent_gaps():
    """Those beyond are reflected, those beside a closed one keep it closed, and those that hit it
    are moved back.
    """
    system = pair(Pair(length=2.0))
    window = saltus.systems.check_window(
        [(-2.0, 2.0), (-2.0, 2.0), (-1.0, 1.0), (-1.0, 1.0)], system
    )
    states = initial_states(system, 200, window, seed=0)
    assert (states[:, 1] - states[:, 0] > -1e-12).all()
    assert (np.abs(states[:, :2]) <= 2.0 + 1e-12).all()
    # some begin with the dependent contact closed
    assert (np.abs(states[:, 1] - states[:, 0]) < 1e-12).any()
    np.testing.assert_allclose(
        on_this_side(system, np.array([[1.0, 0.5, 0.3, 0.1]])),
        [[0.5, 1.0, 0.3, 0.1]],
        rtol=0,
        atol=1e-12,
    )
    beside = states_beside(system, np.array([0.5, 0.5, 0.2, 0.2]), np.array([0.1, 0.0, 0.1, 0.0]))
    np.testing.assert_allclose(beside, [0.55, 0.55, 0.25, 0.25], rtol=0, atol=1e-12)
    (moved,) = before_impacts(system, np.array([[0.5, 0.5, 0.4, 0.0]]))
    assert 0.0 < moved[1] - moved[0] < 1e-11
