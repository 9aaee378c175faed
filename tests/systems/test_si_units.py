"""SI data and dimensionless numbers: both ways, and erratum 13."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import saltus
from saltus import HalfSine, InelasticImpact, PhysicalBlock, PhysicalCell, TwoLayer, UnitCell
from saltus.errors import ParameterError
from saltus.systems import (
    Harmonic,
    Load,
    Metainterface,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
)

positive = st.floats(1e-3, 1e3)
physical_cells = st.builds(
    PhysicalCell,
    length=positive,
    upper_mass=positive,
    upper_stiffness=positive,
    lower_mass=positive,
    lower_stiffness=positive,
    upper_damping=positive,
    lower_damping=positive,
)
CELL = PhysicalCell(
    length=0.1, upper_mass=0.2, upper_stiffness=3.0, lower_mass=0.05, upper_damping=0.01
)


@settings(deadline=None)
@given(physical_cells, positive)
def test_the_units_belong_together(cell, value):
    units = cell.units
    # a phase is the same in both
    assert value / units["frequency"] * (2.0 / units["time"]) == pytest.approx(2.0 * value)
    assert units["force"] * units["displacement"] == pytest.approx(units["energy"])
    assert units["velocity"] * units["time"] == pytest.approx(units["displacement"])
    assert units["acceleration"] * units["time"] == pytest.approx(units["velocity"])


@settings(deadline=None)
@given(physical_cells)
def test_a_cell_is_recovered_from_its_dimensionless_model(cell):
    for model in (cell.metainterface(1.2), cell.two_layer(1.2)):
        back = PhysicalCell.from_model(
            model,
            length=cell.length,
            upper_mass=cell.upper_mass,
            upper_stiffness=cell.upper_stiffness,
        )
        for name in ("lower_mass", "lower_stiffness", "upper_damping", "lower_damping"):
            assert getattr(back, name) == pytest.approx(getattr(cell, name), rel=1e-12)


@settings(deadline=None)
@given(physical_cells, positive, positive, positive)
def test_erratum_13_dimensionless_numbers_do_not_depend_on_the_units(cell, metre, kilogram, second):
    """Measured in other units of length, mass and time, C, H and tau keep their values; the printed
    ones do not.
    """
    moment, drag = kilogram * metre**2 / second**2, kilogram * metre**2 / second
    other = PhysicalCell(
        length=cell.length * metre,
        upper_mass=cell.upper_mass * kilogram,
        lower_mass=cell.lower_mass * kilogram,
        upper_stiffness=cell.upper_stiffness * moment,
        lower_stiffness=cell.lower_stiffness * moment,
        upper_damping=cell.upper_damping * drag,
        lower_damping=cell.lower_damping * drag,
    )
    assert other.ratios == pytest.approx(cell.ratios, rel=1e-12)
    assert other.units["time"] / second == pytest.approx(cell.units["time"], rel=1e-12)
    assert other.units["force"] / (kilogram * metre / second**2) == pytest.approx(
        cell.units["force"], rel=1e-12
    )

    def printed(c):
        return c.upper_damping / (c.upper_mass * c.length**2), math.sqrt(
            c.upper_mass / c.upper_stiffness
        )

    assert printed(other)[0] * second == pytest.approx(printed(cell)[0])  # a rate, not a number
    # not 1 over a time
    assert printed(other)[1] * metre / second == pytest.approx(printed(cell)[1])


def test_erratum_13_damping_and_force_follow_from_the_equation_in_seconds():
    """M2 l^2 theta'' + C2 theta' + K2 theta = l H_2 sin(beta0 - theta), with t = T tau, divided by
    K2.
    """
    mass, length, stiffness, drag, push, t = sp.symbols("M2 l K2 C2 H2 t", positive=True)
    tau = sp.Symbol("tau")
    unit = sp.sqrt(mass * length**2 / stiffness)
    theta = sp.Function("theta")
    second, first = sp.diff(theta(t / unit), t, 2), sp.diff(theta(t / unit), t)
    equation = (mass * length**2 * second + drag * first).doit().subs(
        t, unit * tau
    ).doit() / stiffness
    equation = sp.expand(equation)
    assert sp.simplify(equation.coeff(sp.diff(theta(tau), tau, 2)) - 1) == 0
    damping = sp.simplify(equation.coeff(sp.diff(theta(tau), tau)))
    numbers = {
        mass: CELL.upper_mass,
        length: CELL.length,
        stiffness: CELL.upper_stiffness,
        drag: CELL.upper_damping,
    }
    assert CELL.ratios["damping"] == pytest.approx(float(damping.subs(numbers)), rel=1e-14)
    assert 1.7 / CELL.units["force"] == pytest.approx(
        float((push * length / stiffness).subs({**numbers, push: 1.7})), rel=1e-14
    )
    # as printed
    assert abs(float((drag / (mass * length**2)).subs(numbers)) / CELL.ratios["damping"] - 1) > 1


def test_defaults_are_equal_layers_without_a_lower_mass():
    cell = PhysicalCell(length=0.1, upper_mass=0.2, upper_stiffness=3.0, upper_damping=0.01)
    model = UnitCell(alpha0=0.5, beta0=1.2, physical=cell).metainterface()
    assert isinstance(model, Metainterface)
    assert (model.stiffness_ratio, model.mass_ratio, model.dissipation_ratio) == (1.0, 0.0, 1.0)
    assert cell.units["time"] == pytest.approx(math.sqrt(0.2 * 0.01 / 3.0))
    assert isinstance(UnitCell(alpha0=0.5, beta0=1.2, physical=cell).two_layer(), TwoLayer)


def test_loads_are_converted_and_back_and_keep_what_they_mean():
    seconds = np.linspace(0.0, 0.4, 9)
    si = Load(
        frequency=25.0,  # rad/s
        horizontal=Harmonic(amplitude=12.0, mean=1.0, phase=0.3, order=2) + 0.5,  # N
        vertical=-20.0,
        ground_horizontal=Record(seconds, np.sin(9 * seconds), quantity="acceleration"),  # m/s^2
        ground_vertical=Record(seconds, np.cos(9 * seconds), quantity="velocity", scale=0.1),  # m/s
    )
    load = CELL.load(si)
    t = 0.13
    tau = t / CELL.units["time"]
    assert load.horizontal(tau) == pytest.approx(si.horizontal(t) / CELL.units["force"])
    assert load.vertical(tau) == pytest.approx(-20.0 * 0.1 / 3.0)
    rate = CELL.length / CELL.units["time"]
    for name in ("ground_horizontal", "ground_vertical"):
        mine, theirs = getattr(load, name), getattr(si, name)
        assert mine(tau) == pytest.approx(theirs(t) / CELL.length, rel=1e-12)
        assert mine.velocity(tau) == pytest.approx(theirs.velocity(t) / rate, rel=1e-12)
        assert mine.acceleration(tau) == pytest.approx(
            theirs.acceleration(t) * CELL.units["time"] / rate, rel=1e-12
        )
    back = CELL.load_in_si(load)
    assert back.frequency == pytest.approx(25.0)
    assert back.horizontal(t) == pytest.approx(si.horizontal(t))
    assert back.ground_vertical.acceleration(t) == pytest.approx(si.ground_vertical.acceleration(t))


def test_the_model_moves_as_the_cell_does_in_si():
    """theta'' of the dimensionless model is T^2 times that of the equation in SI, lower layer open,
    with everything acting.
    """
    model = CELL.metainterface(1.2)
    load = CELL.load(Load(horizontal=7.0, vertical=-11.0, lower_horizontal=2.0, lower_vertical=3.0))
    theta, rate = 0.4, 5.0  # rad, rad/s
    length, mass = CELL.length, CELL.upper_mass + CELL.lower_mass
    moment = length * (9.0 * math.sin(1.2 + theta) - 8.0 * math.cos(1.2 + theta))
    second = (moment - 0.01 * rate - 3.0 * theta) / (mass * length**2)  # rad/s^2
    found = model.acceleration(0.0, theta, rate * CELL.units["time"], 1, load)
    assert found == pytest.approx(second * CELL.units["time"] ** 2, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": 0.0}, r"length must lie in \(0, inf\), got 0.0"),
        ({"upper_stiffness": -1.0}, "upper_stiffness must lie in"),
        ({"lower_mass": -0.1}, "lower_mass must lie in"),
        ({"upper_mass": math.inf}, "upper_mass must lie in"),
        ({"lower_damping": 0.1}, "upper_damping is 0"),
    ],
)
def test_impossible_data_are_refused(change, message):
    with pytest.raises(ParameterError, match=message):
        PhysicalCell(**{"length": 0.1, "upper_mass": 0.2, "upper_stiffness": 3.0, **change})


BLOCK = PhysicalBlock(half_width=0.4, half_height=1.6, gravity=9.81)


def test_a_block_in_si_units_moves_as_the_equation_of_its_angular_momentum():
    """(4/3) R^2 theta'' = -g R sin(s alpha - theta) - a R cos(s alpha - theta) in seconds, by
    DOP853, with Housner's loss.
    """
    pulse = HalfSine(amplitude=4.0, frequency=5.0, quantity="acceleration", start=0.2)
    system = BLOCK.system(Load(ground_horizontal=pulse))
    motion = saltus.simulate(system, theta=0.0, duration=3.0 * BLOCK.frequency)
    radius, alpha = math.hypot(0.4, 1.6), math.atan2(0.4, 1.6)

    def ground(t):
        return 4.0 * math.sin(5.0 * (t - 0.2)) if 0.2 <= t <= 0.2 + math.pi / 5.0 else 0.0

    def rates(t, state):
        lean = side * alpha - state[0]
        return [state[1], -0.75 / radius * (9.81 * math.sin(lean) + ground(t) * math.cos(lean))]

    def contact(t, state):
        return state[0] if t > begin + 1e-6 else side

    # it leaves the ground where a = g tan(alpha), on the side away from the acceleration
    begin, side, state, times = (
        0.2 + math.asin(9.81 * math.tan(alpha) / 4.0) / 5.0,
        -1,
        [0.0, 0.0],
        [],
    )
    for end in (0.2 + math.pi / 5.0, 3.0, 3.0):
        contact.terminal = True
        found = solve_ivp(
            rates,
            (begin, end),
            state,
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
            events=contact,
            max_step=0.01,
        )
        begin, state = found.t[-1], found.y[:, -1]
        if found.status == 1:
            times.append(begin)
            state, side = [0.0, state[1] * (1.0 - 1.5 * math.sin(alpha) ** 2)], -side
    assert len(times) >= 1
    assert motion.impacts.time[: len(times)] / BLOCK.frequency == pytest.approx(times, abs=1e-8)
    assert system.impact == InelasticImpact()


def test_a_load_of_a_block_comes_back_from_its_dimensionless_form():
    record = Record([0.0, 0.1, 0.3], [0.0, 2.0, 0.0], quantity="acceleration")
    si = Load(frequency=3.0, ground_horizontal=[record, Harmonic(0.02)], ground_vertical=record)
    back = BLOCK.load_in_si(BLOCK.load(si))
    assert back.frequency == pytest.approx(3.0)
    for t in (0.05, 0.2):
        assert back.ground_horizontal.acceleration(t) == pytest.approx(
            si.ground_horizontal.acceleration(t)
        )
    # 1 is the gravity
    assert BLOCK.load(si).ground_vertical.acceleration(0.1 * BLOCK.frequency) == pytest.approx(
        2.0 / 9.81
    )
    with pytest.raises(
        ParameterError, match=r"PhysicalBlock has no unit of force for load.horizontal"
    ):
        BLOCK.load(Load(horizontal=1.0))


def test_a_block_loses_what_housner_says_unless_it_is_told_otherwise():
    alpha = BLOCK.alpha
    impacts = saltus.simulate(
        System(model=RockingBlock(alpha=alpha)), theta=0.5 * alpha, duration=10.0
    ).impacts
    kept = impacts.velocity_after / impacts.velocity_before
    assert kept == pytest.approx(
        np.full(len(impacts), math.sqrt(saltus.theory.housner_restitution(alpha)))
    )
    free = BLOCK.system(Load(), impact=VelocityReduction(1.0))
    assert free.impact == VelocityReduction(1.0) == System(model=Metainterface(beta0=1.4)).impact
