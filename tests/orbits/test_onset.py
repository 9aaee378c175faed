"""The onset of the non-trivial motion under a fast load (errata 28): the fold of the branch against
the closed form.
"""

import math
from functools import cache

import numpy as np
import pytest

import saltus
from saltus.systems import Harmonic, Load, Metainterface, System
from saltus.theory import high_frequency_onset

BETA, VERTICAL, DAMPING = math.radians(80), -0.5, 0.1
AMPLITUDE = "load.horizontal.amplitude"


def closed_form(frequency, order=1):
    return float(
        high_frequency_onset(frequency, beta0=BETA, vertical=VERTICAL, damping=DAMPING, order=order)
    )


def parabola(frequency, load):
    """theta and theta' at tau = 0 of the leading-order motion, x = A u (pi - abs(u)) / 2, on its
    upper branch.
    """
    angle = math.pi - math.asin(closed_form(frequency) / load)
    closing = -VERTICAL * math.cos(BETA)
    theta = -closing * angle * (math.pi - angle) / 2 / frequency**2
    return theta, closing * (math.pi / 2 - angle) / frequency


@cache
def branch_at(frequency):
    onset = closed_form(frequency, order=2)
    load = 1.2 * onset
    theta, velocity = parabola(frequency, load)
    system = System(
        model=Metainterface(beta0=BETA, damping=DAMPING),
        load=Load(frequency=frequency, horizontal=Harmonic(amplitude=load), vertical=VERTICAL),
    )
    orbit = saltus.find_orbit(system, theta=theta, velocity=velocity, period=1, settle=0)
    return saltus.continue_orbit(orbit, AMPLITUDE, (0.5 * onset, 1.3 * onset))


def fold(frequency):
    folds = [s for s in branch_at(frequency).special if s.kind == "LP"]
    assert len(folds) == 1
    return folds[0]


def test_at_the_papers_highest_frequency():
    """0.0029359 by shooting, from which the closed form 0.00285 differs by its O(Omega^-2)."""
    assert fold(4.0).parameter == pytest.approx(0.0029359, abs=5e-8)


@pytest.mark.parametrize(("order", "power"), [(1, 2), (2, 4)])
def test_the_fold_approaches_the_closed_form_at_its_order(order, power):
    frequencies = (6.0, 9.0, 13.5)
    errors = [abs(closed_form(w, order) / fold(w).parameter - 1) for w in frequencies]
    rates = np.diff(np.log(errors)) / np.diff(np.log(frequencies))
    assert rates == pytest.approx([-power, -power], abs=0.15)


@pytest.mark.parametrize("frequency", [6.0, 13.5])
def test_at_the_fold_the_motion_is_the_parabola_and_below_it_there_is_none(frequency):
    branch, point = branch_at(frequency), fold(frequency)
    height = -VERTICAL * math.cos(BETA) * math.pi**2 / (8 * frequency**2)
    assert point.orbit.amplitude == pytest.approx(height, rel=3 / frequency**2)
    assert point.orbit.symmetric
    assert point.orbit.signature.impact_count == 2
    assert np.abs(point.orbit.multipliers - 1).min() < 1e-6
    assert branch.parameters.min() > point.parameter * (1 - 1e-9)
    assert branch.stable.any()
    assert not branch.stable.all()
