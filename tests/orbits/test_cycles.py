"""Cycles of systems on which nothing acts that varies with time: their period is an unknown."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus
from saltus import BeltOscillator, ContactModel, System


@dataclass(frozen=True, kw_only=True)
class VanDerPol(ContactModel):
    """x'' = mu (1 - x^2) x' - x."""

    mu: float = 1.0
    coordinates: ClassVar = ("x",)
    channels: ClassVar = ()

    def force(self, t, x, velocity, load):
        return self.mu * (1.0 - x * x) * velocity - x


saltus.register(VanDerPol)


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


def test_what_is_no_cycle_is_refused_in_a_sentence():
    with pytest.raises(saltus.MotionError, match="comes to an equilibrium, which is no cycle"):
        saltus.find_orbit(System(model=VanDerPol(mu=-0.5)), x=0.5)
    with pytest.raises(saltus.MotionError, match="comes to rest for good, which is no cycle"):
        saltus.find_orbit(System(model=BeltOscillator(belt_speed=0.0)), x=0.5)
    with pytest.raises(saltus.ParameterError, match="period must lie in"):
        saltus.find_orbit(System(model=VanDerPol()), x=0.5, period=0)
    with pytest.raises(saltus.ParameterError, match=r"load\.frequency is not a number"):
        saltus.continue_orbit(
            saltus.find_orbit(System(model=VanDerPol()), x=0.5), "load.frequency", (0.1, 1.0)
        )


def difference_multipliers(orbit, step=1e-6):
    """The eigenvalues but 1 of the map over a period, by central differences of the motion."""
    start = orbit.start()
    names = orbit.system.model.coordinates
    state = np.array([*(start[name] for name in names), *np.atleast_1d(start["velocity"])])
    count = len(names)

    def later(state):
        velocity = state[count] if count == 1 else tuple(state[count:])
        motion = saltus.simulate(
            orbit.system,
            **dict(zip(names, state[:count].tolist(), strict=True)),
            velocity=velocity,
            duration=orbit.period,
            tol=1e-14,
        )
        return motion.final_state

    columns = [
        (later(state + step * axis) - later(state - step * axis)) / (2.0 * step)
        for axis in np.eye(len(state))
    ]
    values = np.linalg.eigvals(np.array(columns).T)
    return np.delete(values, np.argmin(np.abs(values - 1.0)))


def test_multipliers_are_those_of_differences(van_der_pol, belt):
    for orbit in (van_der_pol, belt):
        assert np.abs(difference_multipliers(orbit) - orbit.multipliers).max() < 1e-7
