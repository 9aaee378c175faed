"""Diagrams under the paper's other loads: a moving ground, two harmonics, an amplitude of either
sign.
"""

import math

import numpy as np
import pytest
from shared_systems import forced, under
from study_cases import AMPLITUDE, FREQUENCY

import saltus
from saltus import bifurcation_diagram, branch_tables, response_spectrum
from saltus.orbits import orbits_of
from saltus.systems import Harmonic

pytestmark = pytest.mark.thorough  # structures of their own for each load


def branches_of(tree):
    return [branch for _, branch in branch_tables.branches_of(tree)]


def test_a_moving_ground_is_the_force_omega_squared_zeta():
    """Load (ii) against load (i) with H = Omega^2 zeta (erratum 14), orbit by orbit."""
    zeta = 0.5
    ground = under(ground_horizontal=Harmonic(amplitude=zeta), vertical=-0.5)
    (branch,) = branches_of(
        response_spectrum(ground, FREQUENCY, (0.8, 1.2), max_period=1, values=[1.0], starts=6)
    )
    assert branch["kept"].max() < 1e-8
    orbits = orbits_of(branch)
    for orbit in orbits[:: len(orbits) // 4]:
        theta, velocity = orbit.state
        force = forced(H=orbit.frequency**2 * zeta, W=orbit.frequency)
        same = saltus.find_orbit(force, theta=theta, velocity=velocity, period=1, settle=0)
        assert same.amplitude == pytest.approx(orbit.amplitude, abs=1e-11)
        assert np.poly(same.multipliers) == pytest.approx(np.poly(orbit.multipliers), abs=1e-9)


@pytest.mark.parametrize("value", [1.1, 1.28])
def test_two_harmonics_break_the_symmetry_and_a_bubble_is_one_branch(value):
    """Load (iii) at H = 1: the period doubles at one frequency and halves at another, and the
    doubled orbits are one branch.

    At 1.1 the search settles on a doubled orbit, whose ends lead to those that repel; at 1.28 on
    one of these, stable there.
    """
    both = under(
        horizontal=Harmonic(amplitude=1.0),
        vertical=Harmonic(mean=-0.5, amplitude=0.25, phase=math.pi / 2),
    )
    branches = branches_of(
        response_spectrum(both, FREQUENCY, (0.85, 1.3), max_period=2, values=[value], starts=8)
    )
    single, bubble = sorted(branches, key=lambda branch: int(branch["period"][1]))
    assert not single["symmetric"].any()
    doublings = np.sort(single["special_parameter"].values[single["kind"].values == "PD"])
    assert len(doublings) == 2
    ends = np.sort([float(bubble["parameter"][0]), float(bubble["parameter"][-1])])
    assert ends == pytest.approx(doublings, abs=1e-9)
    for branch in branches:
        firm = (
            np.hypot(branch["multiplier_real"], branch["multiplier_imag"]).max("multiplier").values
            < 0.999
        )
        assert branch["kept"].values[firm & (branch["stable"].values == 1)].max() < 1e-8


def test_an_amplitude_of_the_other_sign_is_the_mirrored_load():
    """H and -H are the same load half a forcing period apart, and lead to the same orbits."""
    ranges = ((0.3, 0.6), (-0.6, -0.3))
    trees = [
        bifurcation_diagram(forced(1.0), AMPLITUDE, r, max_period=1, values=[np.mean(r)], starts=6)
        for r in ranges
    ]
    (one,), (other,) = map(branches_of, trees)
    for at, there in ((0, -1), (-1, 0)):
        assert float(one["parameter"][at]) == -float(other["parameter"][there])
        for name in ("amplitude", "slowest"):
            assert float(one[name][at]) == pytest.approx(float(other[name][there]), abs=1e-12)
        poly = [
            np.poly(b["multiplier_real"][k].values + 1j * b["multiplier_imag"][k].values)
            for b, k in ((one, at), (other, there))
        ]
        assert poly[0] == pytest.approx(poly[1], abs=1e-11)


def test_from_no_load_on_the_onset_is_a_fold_and_what_is_too_small_to_see_is_counted():
    """Beyond the fold at H = 0.0219879514 the unstable orbits shrink to rest through endless
    grazings, near Hcr = 0.088.
    """
    tree = bifurcation_diagram(
        forced(1.0), AMPLITUDE, (0.0, 0.15), max_period=1, values=[0.12], starts=6
    )
    branches = branches_of(tree)
    main = max(branches, key=lambda branch: branch.sizes["point"])
    folds = main["special_parameter"].values[main["kind"].values == "LP"]
    assert folds.min() == pytest.approx(0.0219879514, abs=1e-10)
    assert float(main["parameter"].min()) == pytest.approx(folds.min(), abs=1e-6)
    assert "accumulates" in main.attrs["end_reasons"]
    assert any("near 0.09" in end for end in main.attrs["ends"])
    small = main["special_amplitude"].values < 0.01 * float(main["amplitude"].max())
    assert tree.attrs["left"] == np.count_nonzero(small & (main["kind"].values == "BPC")) > 0
    # not begun at a motion that was simulated
    switched = [branch for branch in branches if branch.attrs["origin"] != "start"]
    assert switched
    assert all(branch["amplitude"].max() > 0.01 * main["amplitude"].max() for branch in switched)
