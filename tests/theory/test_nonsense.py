"""Closed forms refuse what has no meaning in one sentence with the argument's name, and never give
a number for it.
"""

import math

import numpy as np
import pytest

from saltus import EnergyRestitution, Load, Metainterface, ParameterError, System, theory

CELL = System(model=Metainterface(beta0=1.3), load=Load(vertical=-0.5))
NAN = math.nan


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: theory.fold_horizontal(1.3, NAN), "vertical"),
        (lambda: theory.fold_horizontal(1.3, [-1.2, NAN]), "vertical"),
        (lambda: theory.fold_curve(1.3, NAN), "opening"),
        (lambda: theory.critical_horizontal(1.3, NAN), "vertical"),
        (lambda: theory.is_monostable(1.3, NAN, -0.5), "horizontal"),
        (lambda: theory.is_monostable(1.3, 0.1, NAN), "vertical"),
        (lambda: theory.is_monostable(1.3, [0.1, 0.2], [-0.5, -0.6, -0.7]), "horizontal"),
        (lambda: theory.equivalent_angle(1.3, NAN), "ground_amplitude"),
        (lambda: theory.energy_jump(CELL, 1.0, 1, -3.0), "e"),
        (lambda: theory.energy_jump(CELL, 1.0, 1, 1.5), "e"),
        (lambda: theory.energy_jump(CELL, NAN, 1, 0.5), "velocity"),
        (lambda: theory.energy_jump(CELL, 1.0, 3, 0.5), "side"),
        (lambda: theory.energy_factor(CELL, 1.0, 0, 0.5), "side"),
        (lambda: theory.energy_factor(CELL, 1.0, 1, -2.0), "e"),
        (lambda: theory.energy_factor(CELL, NAN, 1, 0.5), "velocity"),
        (lambda: theory.velocity_factor(CELL, 1.0, 1, 2.0), "r"),
        (lambda: theory.velocity_factor(CELL, 1.0, 2, 0.5), "side"),
        (lambda: theory.velocity_factor(CELL, NAN, 1, 0.5), "velocity"),
        (lambda: theory.final_time(period=-1.0, e=0.5), "period"),
        (lambda: theory.final_time(period=NAN, e=0.5), "period"),
        (lambda: theory.decayed_period(2, period=-1.0, e=0.5), "period"),
        (lambda: theory.decayed_period(NAN, period=1.0, e=0.5), "cycle"),
        (lambda: theory.decayed_period(2, period=NAN, e=0.5), "period"),
        (lambda: theory.decayed_amplitude(2, theta0=NAN, e=0.5), "theta0"),
        (lambda: theory.linear_period(NAN, beta0=1.3, vertical=-0.5), "theta0"),
        (lambda: theory.rocking_period(NAN, alpha=0.3), "theta0"),
        (lambda: theory.rocking_energy_jump(NAN, alpha=0.3, e=0.5), "velocity"),
        (
            lambda: theory.rocking_energy_decreases(1.0, alpha=0.3, e=0.5, ground_velocity=NAN),
            "ground_velocity",
        ),
        (lambda: theory.unloaded_peak_ratio(NAN), "stiffness_ratio"),
        (
            lambda: theory.unloaded_period([[1.0, 2.0], [3.0, 4.0]], [1.0, 2.0, 3.0]),
            "stiffness_ratio",
        ),
        (lambda: theory.unloaded_peak_ratio(np.broadcast_to(1.0, 10**12)), "stiffness_ratio"),
        (lambda: theory.unloaded_peak_ratio(range(10**9)), "stiffness_ratio"),
        (lambda: theory.unloaded_period(10**400), "stiffness_ratio"),
        (lambda: theory.critical_horizontal(1.3, "5"), "vertical"),
        (lambda: theory.open_layer(CELL, 10**400), "side"),
        (lambda: theory.open_layer(CELL, 0), "side"),
        (lambda: theory.reciprocal(CELL, NAN), "theta0"),
        (lambda: EnergyRestitution(r=1.1), "r"),
    ],
)
def test_it_is_refused_by_its_name(call, argument):
    with pytest.raises(ParameterError, match=f"(?s)^[^\n]*{argument}[^\n]*$") as refused:
        call()
    assert refused.value.parameter == argument
    assert len(str(refused.value)) < 400


def test_a_small_integer_does_not_wrap_around():
    assert theory.reciprocal(CELL, np.uint8(3))[1] == -3.0
    # sqrt(1 / k) and 1 half periods
    assert theory.unloaded_period(np.uint8(4)) == pytest.approx(math.pi / 2 + math.pi)


def test_unequal_masses_may_bring_the_factor_of_the_velocity_above_1():
    """T = (1+m) v^2 / 2 before and v^2 / 2 after: at r = 1 the velocity grows by sqrt(1+m)."""
    heavy = System(model=Metainterface(beta0=1.3, mass_ratio=3.0))
    assert theory.energy_factor(heavy, -1.0, 1, 2.0) == pytest.approx(1.0)
