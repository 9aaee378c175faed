"""Cycles of systems on which nothing acts that varies with time: their period is an unknown."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from orbits.cycle_cases import (
    CASES,
    Clock,
    Lorenz,
    Piecewise,
    Roessler,
    Squealing,
    StoppedVanDerPol,
    TwoDuffing,
    VanDerPol,
    along_branch,
    difference_multipliers,
)
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

import saltus
from saltus import BeltOscillator, ContactModel, NewtonImpact, System


def stick_slip_period(kinetic, static, belt_speed):
    """The closed form of the cycle of x'' = -x + f on a belt: it sticks until x = mu_s and then goes
    round a circle about (mu_k, 0) in the plane of x and x' until it is as fast as the belt again.
    """
    swing = static - kinetic
    sticking = 2.0 * swing / belt_speed
    return sticking + 2.0 * math.pi - 2.0 * math.atan(swing / belt_speed)


@pytest.fixture(scope="module")
def van_der_pol():
    return saltus.find_orbit(System(model=VanDerPol()), x=0.5)


@pytest.fixture(scope="module")
def belt():
    return saltus.find_orbit(System(model=BeltOscillator()), x=0.25, velocity=0.1)


def test_the_stick_slip_cycle_has_its_closed_form(belt):
    assert stick_slip_period(0.2, 0.3, 0.1) == pytest.approx(2.0 + 1.5 * math.pi, abs=1e-15)
    assert belt.period == pytest.approx(2.0 + 1.5 * math.pi, abs=1e-13)
    assert belt.frequency == pytest.approx(2.0 * math.pi / belt.period, rel=1e-15)
    # the circle about 0.2 through x = 0.3 at the speed 0.1 of the belt
    assert belt.highest == pytest.approx(0.2 + math.hypot(0.1, 0.1), abs=1e-12)
    assert belt.lowest == pytest.approx(0.2 - math.hypot(0.1, 0.1), abs=1e-12)
    # sticking forgets where it began: one multiplier is left beside that of the flow
    assert belt.multipliers == pytest.approx([0.0], abs=1e-12)
    assert belt.stable
    assert belt.defect < 1e-13


def test_a_branch_of_stick_slip_cycles_has_the_closed_form_all_along(belt):
    branch = saltus.continue_orbit(belt, "model.belt_speed", (0.05, 0.5))
    values = branch.parameters
    assert values.min() == 0.05
    assert values.max() == 0.5
    periods = [orbit.period for orbit in branch.orbits]
    assert periods == pytest.approx(
        [stick_slip_period(0.2, 0.3, value) for value in values], abs=1e-11
    )
    assert branch.special == ()


def test_the_cycle_of_van_der_pol_is_that_of_an_independent_solver(van_der_pol):
    """The period 6.66328686 by DOP853 and a root of x' = 0; the multiplier by Liouville's formula:
    the exponential of the integral of the divergence along the cycle.
    """

    def right(_, y):
        return [y[1], (1.0 - y[0] ** 2) * y[1] - y[0], 1.0 - y[0] ** 2]

    def top(_, y):
        return y[1]

    top.direction = -1.0
    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
    settled = solve_ivp(right, (0.0, 200.0), [2.0, 0.0, 0.0], **options).y[:, -1]
    run = solve_ivp(right, (0.0, 20.0), settled, events=top, **options)
    times, states = run.t_events[0], run.y_events[0]
    assert van_der_pol.period == pytest.approx(times[1] - times[0], abs=1e-9)
    assert van_der_pol.period == pytest.approx(6.66328686, abs=5e-9)
    assert van_der_pol.highest == pytest.approx(states[0][0], abs=1e-9)
    factor = math.exp(states[1][2] - states[0][2])
    assert van_der_pol.multipliers == pytest.approx([factor], rel=1e-8)
    assert van_der_pol.residual < 1e-12


@pytest.mark.parametrize("mu", [-1.0, -0.3])
def test_a_cycle_that_repels_is_found_near_a_start(mu):
    """With mu < 0 time runs backwards: the same cycle repels, by the inverse multiplier."""
    forward = saltus.find_orbit(System(model=VanDerPol(mu=-mu)), x=0.5)
    start = forward.start()
    start["velocity"] = -start["velocity"]
    repelling = saltus.find_orbit(System(model=VanDerPol(mu=mu)), **start, settle=0)
    assert repelling.period == pytest.approx(forward.period, abs=1e-10)
    assert repelling.multipliers == pytest.approx(1.0 / forward.multipliers, rel=1e-7)
    assert not repelling.stable


def test_the_period_does_not_depend_on_the_start_or_a_guess_of_it(van_der_pol):
    system = System(model=VanDerPol())
    others = [
        saltus.find_orbit(system, x=-3.0, velocity=2.0),
        saltus.find_orbit(system, x=2.0, settle=0.0, period=6.5),
        saltus.find_orbit(system, x=2.0, settle=40.0),
        saltus.find_orbit(system, **van_der_pol.start()),
    ]
    for orbit in others:
        assert orbit.period == pytest.approx(van_der_pol.period, abs=1e-11)


def test_a_branch_of_cycles_is_kept_and_read_back(van_der_pol):
    branch = saltus.continue_orbit(van_der_pol, "model.mu", (0.9, 1.1))
    data = branch.to_xarray()
    assert data["period"].values == pytest.approx([orbit.period for orbit in branch.orbits])
    for orbit, known in zip(saltus.orbits.orbits_of(data), branch.orbits, strict=True):
        assert orbit.period == known.period
        assert orbit.multipliers == pytest.approx(known.multipliers, rel=1e-12)
    assert saltus.orbits.defects(branch.orbits[:3]).max() < 1e-10


def test_pages_of_cycles_branches_are_refused_in_a_sentence(belt, tmp_path):
    branch = saltus.continue_orbit(belt, "model.belt_speed", (0.095, 0.105), step=0.5)
    with pytest.raises(saltus.ParameterError, match="a page cannot show branches of cycles"):
        saltus.page(belt.system, branch, path=tmp_path / "page.html", x=0.1)


def test_what_is_no_cycle_is_refused_in_a_sentence():
    with pytest.raises(saltus.MotionError, match="comes to an equilibrium, which is no cycle"):
        saltus.find_orbit(System(model=VanDerPol(mu=-0.5)), x=0.5)
    # nearly no loss: the equilibrium solves the equations with half the natural period
    with pytest.raises(saltus.MotionError, match="finds an equilibrium near it alone"):
        saltus.find_orbit(System(model=VanDerPol(mu=-1e-8)), x=0.5)
    # without a push it settles on the swing that just touches: smaller ones are cycles, too
    idle = System(model=Clock(push=0.0), impact=NewtonImpact(0.5))
    with pytest.raises(saltus.MotionError, match=r"only touches a contact|finds no cycle near"):
        saltus.find_orbit(idle, x=0.0, velocity=2.0)
    assert "undecided" in str(saltus.classify(idle, x=0.0, velocity=2.0))
    with pytest.raises(saltus.MotionError, match="comes to rest for good, which is no cycle"):
        saltus.find_orbit(System(model=BeltOscillator(belt_speed=0.0)), x=0.5)
    with pytest.raises(saltus.ParameterError, match="period must lie in"):
        saltus.find_orbit(System(model=VanDerPol()), x=0.5, period=0)
    with pytest.raises(saltus.ParameterError, match=r"load\.frequency is not a number"):
        saltus.continue_orbit(
            saltus.find_orbit(System(model=VanDerPol()), x=0.5), "load.frequency", (0.1, 1.0)
        )


def test_multipliers_are_those_of_differences(van_der_pol, belt):
    for orbit in (van_der_pol, belt):
        assert np.abs(difference_multipliers(orbit) - orbit.multipliers).max() < 1e-7


@pytest.mark.parametrize("name", ["soft stop", "clock", "two masses"])
def test_branches_have_the_multipliers_of_differences(name):
    compared, worst = along_branch(name, seed=0)
    assert compared >= 3
    assert worst < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(4))
def test_many_branches_have_the_multipliers_of_differences(name, seed):
    compared, worst = along_branch(name, seed)
    assert compared >= 3
    assert worst < 1e-6


def test_a_cycle_of_first_order_is_that_of_an_independent_solver():
    """Example 9.2 of COCO (Dankowicz and Schilder, Recipes for Continuation, 2013): each crossing is
    an event of DOP853."""
    model = Piecewise()

    def right(left, _, x):
        return model.force(0.0, x, (), None, type("Sides", (), {"axis": -1.0 if left else 1.0}))

    def axis(_, x):
        return x[0]

    state, crossings = np.array([0.0, 1.0]), []
    axis.terminal = True
    for k in range(60):
        left = k % 2 == 1
        run = solve_ivp(
            lambda t, x, left=left: right(left, t, x),
            (0.0, 20.0),
            [-1e-13 if left else 1e-13, state[1]],
            method="DOP853",
            events=axis,
            rtol=1e-13,
            atol=1e-14,
        )
        state = run.y_events[0][0]
        crossings.append((run.t_events[0][0], state[1]))
    (right_time, low), (left_time, high) = crossings[-2:]
    orbit = saltus.find_orbit(System(model=model), x1=0.1, x2=1.2)
    assert orbit.period == pytest.approx(right_time + left_time, abs=1e-10)
    seen = sorted(event_state(orbit))
    assert seen == pytest.approx(sorted([low, high]), abs=1e-10)


def event_state(orbit):
    """The second coordinate at the events of one period."""
    motion = orbit.motion()
    return [float(motion.at(event.time)[0][1]) for event in motion.events]


def test_a_grazing_of_a_cycle_lies_where_the_free_one_touches(van_der_pol):
    system = System(model=StoppedVanDerPol(place=1.7), impact=NewtonImpact(0.7))
    orbit = saltus.find_orbit(system, x=0.2, velocity=0.9)
    assert orbit.impact_count == 1
    branch = saltus.continue_orbit(orbit, "model.place", (1.6, 2.3))
    (grazing,) = branch.special
    assert str(grazing.kind) == "GR"
    assert grazing.parameter == pytest.approx(van_der_pol.highest, abs=1e-9)
    assert branch.orbits[-1].impact_count == 0
    assert branch.orbits[-1].period == pytest.approx(van_der_pol.period, abs=1e-10)


def falling_friction(speed):
    """mu(u) of `Squealing`."""
    return 0.2 + 0.3 * np.exp(-speed / 0.5)


def test_a_branch_ends_at_the_equilibrium_of_which_its_cycles_are_born():
    """Where the damping equals the fall of the friction, c = 0.6 exp(-w / 0.5): a Hopf point."""
    orbit = saltus.find_orbit(System(model=Squealing(speed=1.1)), x=2.0)
    branch = saltus.continue_orbit(orbit, "model.speed", (1.0, 1.5))
    (change,) = branch.special
    assert str(change.kind) == "GS"
    slip = branch.at(1.2)[-1]
    branch = saltus.continue_orbit(slip, "model.speed", (0.5, 1.5))
    reasons = [str(end.reason) for end in branch.ends]
    born = next(end for end in branch.ends if end.reason is saltus.orbits.OrbitEnd.EQUILIBRIUM)
    assert born.parameter == pytest.approx(0.5 * math.log(6.0), abs=1e-8), reasons
    assert branch.missed == ()

    # the cycle that only slips touches the belt's speed where it gains a stick: from where static
    # friction lets go, it comes back to that speed just at that place
    def excess(speed):
        run = solve_ivp(
            lambda _, y: [y[1], -y[0] - 0.1 * y[1] + falling_friction(abs(speed - y[1]))],
            (0.0, 7.0),
            [0.5 - 0.1 * speed, speed - 1e-12],
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            dense_output=True,
        )
        return float(run.sol(np.linspace(5.0, 7.0, 4001))[1].max()) - speed

    assert excess(change.parameter + 1e-5) < -1e-7
    assert excess(change.parameter - 1e-5) > 1e-7


@dataclass(frozen=True, kw_only=True)
class Born(ContactModel):
    """x'' = -x + x' (mu - r^law) with r^2 = x^2 + x'^2: its cycle is the circle r^law = mu."""

    mu: float = 0.5
    law: ClassVar[int] = 1
    coordinates: ClassVar[tuple] = ("x",)
    channels: ClassVar[tuple] = ()

    def force(self, t, x, velocity, load):
        square = x * x + velocity * velocity
        return -x + velocity * (self.mu - square ** (0.5 * self.law))


@dataclass(frozen=True, kw_only=True)
class BornSlowly(Born):
    law: ClassVar[int] = 4


@pytest.mark.parametrize("law", [Born, BornSlowly])
@pytest.mark.parametrize("largest", [0.51, 1.0])
def test_births_of_other_laws_do_not_depend_on_the_asked_range(law, largest):
    orbit = saltus.find_orbit(System(model=law()), x=0.6)
    assert np.ptp(orbit.followed.extrema) == pytest.approx(2.0 * 0.5 ** (1.0 / law.law), rel=1e-9)
    branch = saltus.continue_orbit(orbit, "model.mu", (-0.2, largest))
    born = next(end for end in branch.ends if end.reason is saltus.orbits.OrbitEnd.EQUILIBRIUM)
    assert born.parameter == pytest.approx(0.0, abs=1e-9)
    # all of its points are cycles: the circle r^law = mu, and no equilibrium
    radii = np.array([0.5 * np.ptp(each.followed.extrema[0]) for each in branch.orbits])
    parameters = np.array([point.parameter for point in branch.points])
    assert radii.min() > 1e-4
    np.testing.assert_allclose(radii**law.law, parameters, rtol=1e-6, atol=1e-11)


@dataclass(frozen=True, kw_only=True)
class Saddle(ContactModel):
    """x'' = -x + x^2 + x' (mu - x): its cycle about 0 grows up to the saddle x = 1."""

    mu: float = 0.1
    coordinates: ClassVar[tuple] = ("x",)
    channels: ClassVar[tuple] = ()

    def force(self, t, x, velocity, load):
        return -x + x * x + velocity * (self.mu - x)


def test_a_branch_of_cycles_ends_at_a_homoclinic_connection():
    """Where both manifolds of the saddle meet, by an independent solver. The model has no event."""

    def first_stop(mu, way):
        """The place at which the way out of the saddle, or the way back into it, turns round."""
        rate = 0.5 * (mu - 1.0 + way * math.sqrt((mu - 1.0) ** 2 + 4.0))

        def turns(t, y):
            return y[1]

        turns.terminal = True
        turns.direction = way
        start = [1.0 - 1e-7, -1e-7 * rate]
        run = solve_ivp(
            lambda t, y: [y[1], -y[0] + y[0] ** 2 + y[1] * (mu - y[0])],
            (0.0, way * 200.0),
            start,
            "DOP853",
            events=turns,
            rtol=1e-13,
            atol=1e-14,
        )
        return run.y_events[0][0][0]

    expected = brentq(lambda mu: first_stop(mu, 1.0) - first_stop(mu, -1.0), 0.13, 0.14)
    orbit = saltus.find_orbit(System(model=Saddle(mu=0.13)), x=0.3)
    branch = saltus.continue_orbit(orbit, "model.mu", (0.13, 0.2))
    assert branch.special == ()
    end = branch.ends[1]
    assert end.reason is saltus.orbits.OrbitEnd.CONNECTION
    assert end.parameter == pytest.approx(expected, abs=1e-8)


def test_periods_double_where_a_multiplier_is_minus_1():
    orbit = saltus.find_orbit(System(model=Roessler()), x=1.0, y=1.0, z=0.1)
    branch = saltus.continue_orbit(orbit, "model.c", (2.4, 3.2))
    (doubling,) = branch.special
    assert str(doubling.kind) == "PD"
    assert min(abs(difference_multipliers(doubling.orbit) + 1.0)) < 1e-7
    (doubled,) = saltus.switch_branch(doubling, (2.4, 3.2))
    last = doubled.orbits[-1]
    assert last.signature.period == 2
    assert 1.99 < last.period / branch.at(3.2)[0].period < 2.01
    assert last.defect < 1e-10
    # beyond it the motion settles on the doubled orbit
    settled = saltus.find_orbit(last.system, x=1.0, y=1.0, z=0.1)
    assert settled.period == pytest.approx(last.period, abs=1e-9)
    # followed back from there it turns round in no fold: it meets its own image at the doubling
    back = saltus.continue_orbit(settled, "model.c", (2.4, 3.2))
    (born,) = back.special
    assert str(born.kind) == "PD"
    assert born.parameter == pytest.approx(doubling.parameter, rel=1e-9)
    assert {orbit.signature.period for orbit in back.orbits} == {2}
    parameters = [point.parameter for point in back.points]
    assert (np.diff(parameters) > 0.0).all() or (np.diff(parameters) < 0.0).all()


def test_a_symmetric_cycle_loses_its_symmetry_at_a_branch_point():
    """Near 313 (C. Sparrow, The Lorenz equations, 1982, section 4)."""
    orbit = saltus.find_orbit(System(model=Lorenz()), x=1.0, y=1.0, z=300.0)
    branch = saltus.continue_orbit(orbit, "model.r", (305.0, 352.0))
    (breaking,) = branch.special
    assert str(breaking.kind) == "BPC"
    assert breaking.parameter == pytest.approx(313.0, abs=0.1)
    ways = saltus.switch_branch(breaking, (300.0, 352.0))
    ends = [way.orbits[-1] for way in ways]
    assert [end.stable for end in ends] == [True, True]
    # mirror images of one another: x and y change their signs
    assert ends[0].extrema[0] == pytest.approx(-ends[1].extrema[0][::-1], abs=1e-6)
    assert abs(ends[0].extrema[0].sum()) > 1.0


@pytest.mark.parametrize("speed", [1.0, 1.9, 4.0])
def test_a_lossless_motion_between_stops_has_its_closed_form(speed):
    """x'' = -x between -0.8 and 1: two arcs of a circle of the radius of the start."""
    system = System(model=Clock(push=0.0), impact=NewtonImpact(1.0))
    orbit = saltus.find_orbit(system, x=0.2, velocity=speed)
    radius = math.hypot(0.2, speed)
    arcs = [math.asin(min(1.0, place / radius)) for place in (1.0, 0.8)]
    assert orbit.period == pytest.approx(2.0 * sum(arcs), abs=1e-11)
    assert orbit.multipliers == pytest.approx([1.0], abs=1e-8)
    assert not orbit.isolated
    with pytest.raises(saltus.ParameterError, match="not isolated"):
        saltus.continue_orbit(orbit, "model.place", (0.9, 1.1))


def test_the_family_of_a_lossless_motion_between_stops_has_its_closed_form():
    system = System(model=Clock(push=0.0), impact=NewtonImpact(1.0))
    orbit = saltus.find_orbit(system, x=0.2, velocity=1.9)
    branch = saltus.continue_orbit(orbit, "period", (1.0, 4.0))
    assert [end.parameter for end in branch.ends] == [1.0, 4.0]
    for found in branch.orbits:
        radius = math.hypot(0.8, max(found.speeds))  # the fastest impact is at the left stop
        arcs = [math.asin(place / radius) for place in (1.0, 0.8)]
        assert found.period == pytest.approx(2.0 * sum(arcs), abs=1e-11)
    forced = System(
        model=saltus.WallOscillator(damping=0.1, wall=9.0),
        load=saltus.Load(frequency=2.0, force=saltus.Harmonic(1.0)),
    )
    with pytest.raises(saltus.ParameterError, match="that of its load"):
        saltus.continue_orbit(saltus.find_orbit(forced, x=0.1), "period", (0.5, 2.0))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_families_of_two_coupled_masses_are_elliptic_functions(sign):
    """x'' = -w^2 x - x^3 of both masses in step, w = 1, and in turn, w^2 = 1 + 2 k: the period is
    4 K(m) / sqrt(w^2 + A^2) with m = A^2 / 2 / (w^2 + A^2)."""
    system = System(model=TwoDuffing())
    square = 1.0 if sign == 1 else 1.2
    orbit = saltus.find_orbit(system, x=0.5, y=0.5 * sign, settle=0.0)
    branch = saltus.continue_orbit(orbit, "period", (3.0, 7.0))
    for found in branch.orbits:
        total = square + found.highest**2
        period = 4.0 * ellipk(found.highest**2 / (2.0 * total)) / math.sqrt(total)
        # the equations become singular at the branch point and at amplitude 0
        if found.highest > 1e-2:
            assert found.period == pytest.approx(period, abs=1e-10)
            assert np.prod(found.multipliers) == pytest.approx(1.0, abs=1e-8)
    # at amplitude 0 the linear mode
    assert branch.ends[1].reason is saltus.orbits.OrbitEnd.EQUILIBRIUM
    assert branch.ends[1].parameter == pytest.approx(2.0 * math.pi / math.sqrt(square), abs=1e-8)
    # in turn the masses lose their symmetry where A^2 = 4 k / 3: there cn^2 - c solves Lame's
    # equation of a mass's difference from it
    special = [(str(point.kind), point.orbit.highest) for point in branch.special]
    assert [kind for kind, _ in special] == ([] if sign == 1 else ["BPC"])
    for _, highest in special:
        assert highest == pytest.approx(math.sqrt(4.0 * 0.1 / 3.0), abs=1e-9)


def test_a_family_is_read_back_and_others_have_none(van_der_pol):
    system = System(model=TwoDuffing())
    orbit = saltus.find_orbit(system, x=0.5, y=0.5, settle=0.0)
    branch = saltus.continue_orbit(orbit, "period", (5.7, 5.8))
    back = saltus.orbits.orbits_of(branch.to_xarray())
    assert [found.period for found in back] == branch.parameters.tolist()
    with pytest.raises(saltus.ParameterError, match="no others beside it with other periods"):
        saltus.continue_orbit(van_der_pol, "period", (6.0, 7.0))


def test_the_energies_of_cycles_close(belt, van_der_pol):
    for orbit in (belt, van_der_pol):
        balance = saltus.energies(orbit)
        assert abs(balance.defect) < 1e-12
        stored = balance.energy[balance.role == "stored"]
        assert np.abs(stored).max() < 1e-11
    # the belt gives its speed times the friction; the mass moves by nothing in a period
    balance = saltus.energies(belt)
    slides = belt.period - 2.0
    supplied = 0.1 * (0.2 * slides + (0.1 + 0.3) / 2.0 * 2.0)
    assert float(balance.energy.sel(part="ground.belt")) == pytest.approx(supplied, abs=1e-12)


@pytest.mark.parametrize(("rate", "length"), [(1e3, 1e-6), (1e-3, 1e3)])
def test_a_cycle_is_the_same_in_other_units(belt, rate, length):
    system = System(
        model=BeltOscillator(
            stiffness=rate**2, normal_force=rate**2 * length, belt_speed=0.1 * rate * length
        )
    )
    other = saltus.find_orbit(system, x=0.25 * length, velocity=0.1 * rate * length)
    assert other.period * rate == pytest.approx(belt.period, rel=1e-12)
    assert other.highest / length == pytest.approx(belt.highest, rel=1e-12)
    path = "model.belt_speed"
    one = saltus.continue_orbit(belt, path, (0.05, 0.3))
    scale = rate * length
    two = saltus.continue_orbit(other, path, (0.05 * scale, 0.3 * scale))
    assert len(two.special) == len(one.special)
    assert [end.reason for end in two.ends] == [end.reason for end in one.ends]
    assert two.at(0.2 * scale)[0].period * rate == pytest.approx(one.at(0.2)[0].period, rel=1e-11)


@pytest.mark.parametrize("place", [1e5, 1e9])
def test_a_wall_that_is_far_away_hides_no_cycle(place):
    """A motion of the size 2 is small beside its distance, which is the only length that is known
    before it is followed."""
    far = System(model=StoppedVanDerPol(mu=1.0, place=place), impact=NewtonImpact(0.5))
    orbit = saltus.find_orbit(far, x=0.5)
    assert orbit.period == pytest.approx(6.663286859323130, rel=1e-10)  # of the one without a wall
    with pytest.raises(saltus.MotionError, match="equilibrium"):
        saltus.find_orbit(far.with_({"model.mu": -0.5}), x=0.5)
