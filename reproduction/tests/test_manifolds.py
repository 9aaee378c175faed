"""Separatrices of a portrait, and the reference that other tests compare the engine with, are
invariant under the exact flow.
"""

import numpy as np
import pytest
from reference_manifolds import manifold

from saltus import ParameterError
from saltus.attractors import separatrices
from saltus.flow import simulate
from saltus.systems import EnergyRestitution
from saltus.theory import equilibria, total_energy
from saltus_paper.figures.phase_portraits import (
    circled,
    closed,
    constant_load,
    loop_area,
    outward,
    portrait,
)

CASES = {
    "conservative": {},
    "impact loss": {"e": 0.8},
    "viscous": {"damping": 0.1},
    "soft": {"stiffness": 0.5},
}


def saddles(model):
    return [
        point for point in equilibria(model) if point.eigenvalues and point.eigenvalues[0].real > 0
    ]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("outward", [True, False])
def test_a_stable_manifold_is_carried_along_itself_by_the_flow(case, outward):
    model = constant_load(**CASES[case])
    branch = manifold(model, saddles(model)[-1], stable=True, outward=outward, span=24.0, bound=4.0)
    known = np.flatnonzero(np.isfinite(branch.theta) & (branch.theta != 0))
    late = known[branch.time[known] < -14]
    for far in late[[0, len(late) // 2, -1]]:
        near = known[np.searchsorted(-branch.time[known], -branch.time[far] - 8.0)]
        motion = simulate(
            model,
            theta=branch.theta[far],
            velocity=branch.velocity[far],
            duration=branch.time[near] - branch.time[far],
            tol=1e-13,
        )
        assert motion.theta == pytest.approx(branch.theta[near], abs=2e-8)
        assert motion.velocity == pytest.approx(branch.velocity[near], abs=2e-8)


def test_an_unstable_manifold_is_carried_along_itself_by_the_flow():
    model = constant_load(damping=0.1, e=0.9)
    branch = manifold(model, saddles(model)[0], stable=False, outward=False, span=22.0)
    near, far = np.searchsorted(branch.time, [17.0, 21.0])
    assert np.isfinite(branch.theta[[near, far]]).all()
    motion = simulate(
        model,
        theta=branch.theta[near],
        velocity=branch.velocity[near],
        duration=branch.time[far] - branch.time[near],
        tol=1e-13,
    )
    assert motion.theta == pytest.approx(branch.theta[far], abs=1e-9)


@pytest.mark.parametrize("stiffness", [0.5, 1.0, 1.1])
def test_without_losses_every_separatrix_keeps_the_energy_of_its_saddle_and_closes(stiffness):
    model = constant_load(stiffness=stiffness)
    for branch in separatrices(model, ((-4.0, 4.0), (-4.0, 4.0))):
        energy = total_energy(model, branch.theta, branch.velocity)
        assert np.ptp(energy) < 1e-9
    assert closed(portrait(model, [(0.3, 0.0)], 1.0, 4.0, 10)).all()


def test_a_symmetric_portrait_has_mirror_symmetric_separatrices():
    data = portrait(constant_load(damping=0.1), [(0.3, 0.0)], 1.0, 2.5, 10)
    theta, velocity = data["separatrix_theta"].values, data["separatrix_velocity"].values
    assert len(theta) == 4
    for one, two in ((0, 3), (1, 2)):
        np.testing.assert_allclose(theta[one], -theta[two], atol=1e-7)
        np.testing.assert_allclose(velocity[one], -velocity[two], atol=1e-7)
    assert data["separates"].values.all()
    assert not closed(data).any()


def test_impact_losses_leave_the_loops_and_open_the_rest():
    data = portrait(constant_load(e=0.8), [(0.3, 0.0)], 1.0, 2.55, 10)
    assert len(outward(data)) == 2
    assert data["separates"].values.tolist() == closed(data).tolist() == [False, True, True, False]


def test_only_saddles_have_separatrices():
    model = constant_load()
    with pytest.raises(ParameterError, match="not a saddle"):
        manifold(model, equilibria(model)[0], stable=True, outward=True)


def test_an_impact_law_that_cannot_be_reversed_is_refused():
    model = constant_load().with_({"impact": EnergyRestitution(0.8)})
    with pytest.raises(ParameterError, match="e > 0"):
        manifold(model, saddles(model)[0], stable=True, outward=True)


def test_the_loop_area_is_that_of_the_energy_level():
    model = constant_load()
    data = portrait(model, [(1.0, 0.0)], 5.0, 2.5, 50)
    saddle = saddles(model)[-1]
    theta = np.linspace(saddle.theta, 2.0, 400001)
    gap = np.array(saddle.energy - total_energy(model, theta, 0 * theta))
    inside = gap > 0
    expected = 2 * np.trapezoid(np.sqrt(2 * gap[inside]), theta[inside])
    assert loop_area(data, saddle.theta) == pytest.approx(expected, rel=3e-3)
    assert [len(found) for found in circled(data)] == [1]
