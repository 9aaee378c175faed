"""Phase portraits: energy along motions, equilibria against theory, separatrices against
independent ones, and refusals.
"""

import functools
from dataclasses import dataclass

import numpy as np
import pytest
from reference_manifolds import manifold
from shared_systems import steady

from saltus import TwoLayer, phase_portrait
from saltus.attractors.phase_plane import equilibria
from saltus.errors import ParameterError
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Model,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.theory import critical_horizontal, total_energy
from saltus.theory import equilibria as known_equilibria

WINDOW = ((-2.5, 2.5), (-1.5, 1.5))


@functools.cache
def portrait(C=0.0, H=0.0, e=1.0):
    return phase_portrait(steady(C=C, H=H, e=e), window=WINDOW, duration=12.0, samples=300)


# --- motions -----------------------------------------------------------------


@pytest.mark.parametrize("H", [0.0, 0.05])
def test_an_undamped_motion_keeps_its_energy_through_impacts(H):
    data = portrait(H=H)
    energy = total_energy(
        steady(C=0.0, H=H),
        data["theta"].values,
        data["velocity"].values,
        np.where(data["theta"].values < 0, -1, 1),
    )
    drift = np.nanmax(energy, axis=1) - np.nanmin(energy, axis=1)
    assert drift.max() < 1e-10
    assert np.ptp(energy[:, 0]) > 0.5  # the motions are many
    # and cross the contact
    assert (np.diff(np.sign(data["theta"].values), axis=1) != 0).any(axis=1).sum() > 10


def test_a_damped_motion_only_loses_energy():
    data = portrait(C=0.1)
    energy = total_energy(
        steady(),
        data["theta"].values,
        data["velocity"].values,
        np.where(data["theta"].values < 0, -1, 1),
    )
    for row in energy:
        steps = np.diff(row[np.isfinite(row)])
        assert steps.max() < 1e-10
        assert steps.sum() < -1e-3


def test_an_impact_with_loss_is_drawn_as_a_jump():
    """Both velocities are there, v+ = e v-, with nan between them, at the same instant and
    place.
    """
    data = portrait(C=0.1, e=0.8)
    jumps = 0
    for time, place, velocity in zip(
        data["time"].values, data["theta"].values, data["velocity"].values, strict=True
    ):
        gaps = np.flatnonzero(np.isnan(place) & np.isfinite(time))
        jumps += len(gaps)
        np.testing.assert_array_equal(time[gaps - 1], time[gaps + 1])
        np.testing.assert_array_equal(place[gaps + 1], 0.0)
        np.testing.assert_allclose(velocity[gaps + 1], 0.8 * velocity[gaps - 1], rtol=1e-14)
    assert jumps > 20


def test_motions_begin_all_over_the_window_and_within_the_wall():
    system = System(
        model=WallOscillator(wall=0.5), load=Load(force=0.0), impact=VelocityReduction(0.9)
    )
    data = phase_portrait(system, window=((-3.0, 0.6), (0.0, 4.0)), duration=0.5, samples=10)
    starts = np.stack([data["x"].values[:, 0], data["velocity"].values[:, 0]], axis=1)
    spread = starts[starts[:, 1] != 0.0]
    assert len(spread) == 24
    assert (spread[:, 0] < 0.5).all()
    assert ((spread >= [-3.0, 0.0]) & (spread <= [0.6, 4.0])).all()
    quarters = {(x > -1.25, v > 2.0) for x, v in spread}
    assert len(quarters) == 4


def test_given_starts_are_those_that_are_followed():
    data = phase_portrait(
        steady(C=0.0), window=WINDOW, starts=[(0.3, 0.1), (-1.0, 0.0)], duration=1.0, samples=5
    )
    np.testing.assert_array_equal(data["theta"].values[:, 0], [0.3, -1.0])
    np.testing.assert_array_equal(data["velocity"].values[:, 0], [0.1, 0.0])
    np.testing.assert_allclose(data["time"].values[:, -1], 1.0)


# --- equilibria --------------------------------------------------------------


@pytest.mark.parametrize(
    ("H", "V", "C", "beta0"),
    [
        (0, -1.5, 0, 80),
        (0.05, -1.5, 0.1, 80),
        (0.4, -0.5, 0.1, 80),
        (0, 0.5, 0.1, 80),
        (0.1, -2, 0.3, 60),
        (0, -0.5, 3, 80),
    ],
)
def test_equilibria_are_those_of_theory(H, V, C, beta0):
    system = steady(V, C, H=H, beta0=np.deg2rad(beta0))
    found = equilibria(system, ((-3.4, 3.4), (-1.0, 1.0)))
    known = [one for one in known_equilibria(system) if abs(one.theta) < 3.4]
    assert len(found) == len(known) > 0
    for one, other in zip(found, known, strict=True):
        assert one.place == pytest.approx(other.theta, abs=1e-13)
        assert one.stable == other.stable
        assert (one.side == 0) == (other.theta == 0.0)
        if other.eigenvalues is None:
            assert one.eigenvalues is None
        else:
            np.testing.assert_allclose(one.eigenvalues, other.eigenvalues, rtol=1e-9, atol=1e-10)
            assert one.saddle == (other.eigenvalues[0].real > 0 > other.eigenvalues[1].real)


def test_the_portrait_holds_the_equilibria_of_theory():
    data, known = (
        portrait(0.1, 0.05),
        [one for one in known_equilibria(steady(H=0.05)) if abs(one.theta) < 2.5],
    )
    np.testing.assert_allclose(data["equilibrium"], [one.theta for one in known], atol=1e-13)
    np.testing.assert_array_equal(data["stable"], [one.stable for one in known])
    assert int(data["stable"].sum()) == 3
    assert int((~data["stable"]).sum()) == 2
    contact = data["equilibrium"].values == 0.0
    assert np.isnan(data["eigenvalue_real"].values[contact]).all()
    assert np.isfinite(data["eigenvalue_real"].values[~contact]).all()


def test_the_contact_is_an_equilibrium_up_to_the_critical_load():
    """V cos(beta0) = -abs(H) sin(beta0): beyond it rest is pushed open."""
    critical = critical_horizontal(np.deg2rad(80), -0.5)
    window = ((-0.05, 0.05), (-0.1, 0.1))
    for factor, held in ((0.999, True), (1.001, False)):
        places = [one.place for one in equilibria(steady(-0.5, 0.0, H=factor * critical), window)]
        assert (0.0 in places) is held


def test_a_wall_holds_what_is_pushed_against_it():
    def found(force):
        system = System(
            model=WallOscillator(stiffness=2.0, damping=0.3, wall=0.5), load=Load(force=force)
        )
        return equilibria(system)

    free, held = found(0.8), found(1.2)
    assert [(one.place, one.side, one.stable) for one in held] == [(0.5, 0, True)]
    assert [(one.side, one.stable) for one in free] == [(1, True)]
    assert free[0].place == pytest.approx(0.4, abs=1e-14)  # F / k
    roots = np.roots([1.0, 0.3, 2.0])
    np.testing.assert_allclose(
        sorted(free[0].eigenvalues, key=np.imag), sorted(roots, key=np.imag), atol=1e-10
    )


def test_a_rocking_block_has_its_two_overturning_saddles():
    system = System(model=RockingBlock(alpha=0.3), impact=VelocityReduction(0.9))
    points = equilibria(system, ((-0.5, 0.5), (-1.0, 1.0)))
    np.testing.assert_allclose([one.place for one in points], [-0.3, 0.0, 0.3], atol=1e-14)
    assert [one.stable for one in points] == [False, True, False]
    # theta'' = alpha - theta, to first order
    np.testing.assert_allclose(points[0].eigenvalues, [1.0, -1.0], atol=1e-10)


@dataclass(frozen=True, kw_only=True)
class DoubleWell(Model):
    """x'' = x - x^3 - d x': equilibria at -1, 0 and 1, all on points of a symmetric grid."""

    damping: float = 0.1
    coordinates = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return x - x * x * x - self.damping * velocity


def test_equilibria_on_the_points_of_the_grid_are_found():
    points = equilibria(System(model=DoubleWell()), ((-2.0, 2.0), (-1.0, 1.0)))
    np.testing.assert_allclose([one.place for one in points], [-1.0, 0.0, 1.0], atol=1e-14)
    assert [one.saddle for one in points] == [False, True, False]
    np.testing.assert_allclose(
        points[1].eigenvalues, np.sort(np.roots([1.0, 0.1, -1.0]))[::-1], atol=1e-10
    )


# --- separatrices ------------------------------------------------------------


def test_undamped_separatrices_have_the_energy_of_their_saddle():
    system, data = steady(C=0.0, H=0.05), portrait(H=0.05)
    saddles = [
        one.energy
        for one in known_equilibria(system)
        if one.eigenvalues and not one.stable and abs(one.theta) < 2.5
    ]
    theta, velocity = data["separatrix_theta"].values, data["separatrix_velocity"].values
    energy = total_energy(system, theta, velocity, np.where(theta < 0, -1, 1))
    assert data.sizes["separatrix"] == 2 * len(saddles) == 4
    for row, own in zip(energy, np.repeat(saddles, 2), strict=True):
        np.testing.assert_allclose(row[np.isfinite(row)], own, atol=1e-9)


@pytest.mark.thorough
def test_damped_separatrices_are_those_of_the_paper_module():
    """`saltus_paper.figures.manifolds` integrates backward by SciPy, with events of its own."""
    system, data = steady(H=0.05), portrait(0.1, 0.05)
    saddles = [
        one
        for one in known_equilibria(system)
        if one.eigenvalues and not one.stable and abs(one.theta) < 2.5
    ]
    compared = 0
    for saddle in saddles:
        for outward in (True, False):
            curve = manifold(
                system,
                saddle,
                stable=True,
                outward=outward,
                span=15.0,
                bound=2.0,
                crossings=1,
                step=0.02,
            )
            near = min(_distance(curve, data, i) for i in range(data.sizes["separatrix"]))
            assert near < 5e-5  # between chords of 0.02 of time
            compared += len(curve.theta)
    assert compared > 500


def _distance(curve, data, i):
    """The largest distance of a curve's points from the chords of a separatrix."""
    x, v = data["separatrix_theta"].values[i], data["separatrix_velocity"].values[i]
    points = np.stack([x, v], axis=1)[np.isfinite(x)]
    a, step = points[:-1], np.diff(points, axis=0)
    asked = np.stack([curve.theta, curve.velocity], axis=1)[:, None]
    share = np.clip(
        ((asked - a) * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-300), 0.0, 1.0
    )
    return np.linalg.norm(asked - a - share[..., None] * step, axis=2).min(axis=1).max()


def test_where_impacts_cannot_be_undone_there_are_no_separatrices_and_it_is_said():
    system = System(
        model=Metainterface(beta0=1.4), load=Load(vertical=-1.5), impact=EnergyRestitution(0.8)
    )
    data = phase_portrait(system, window=WINDOW, starts=[(0.3, 0.0)], duration=1.0, samples=5)
    assert data.sizes["separatrix"] == 0
    assert data.attrs["no_separatrices"] == "EnergyRestitution cannot be followed backward"


# --- refusals ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"window": ((1.0, -1.0), (-1.0, 1.0))}, "window must be"),
        ({"window": 3.0}, "window must be"),
        ({"window": ((0.0, np.nan), (-1.0, 1.0))}, "window must be"),
        ({"duration": 0.0}, "duration must lie in"),
        ({"duration": "long"}, "duration must be a number"),
        ({"samples": 1}, "samples must lie in"),
        ({"samples": 2.5}, "samples must be a whole number"),
        ({"seed": -1}, "seed must lie in"),
        ({"starts": []}, "starts must be states"),
        ({"starts": [(0.1,)]}, "starts must be states"),
        ({"starts": [(0.1, np.inf)]}, "starts must be states"),
        ({"starts": 3}, "starts must be states"),
    ],
)
def test_arguments_without_meaning_are_refused_before_anything_moves(
    changes, sentence, monkeypatch
):
    monkeypatch.setattr(
        "saltus.studies.portrait.simulate",
        lambda *args, **options: pytest.fail("it began to compute"),
    )
    with pytest.raises(ParameterError, match=sentence):
        phase_portrait(steady(C=0.0), **changes)


def test_what_has_no_phase_plane_is_refused():
    varying = steady(C=0.0).with_({})
    varying = System(
        model=varying.model,
        load=Load(frequency=1.0, horizontal=Harmonic(amplitude=0.1), vertical=-0.5),
    )
    with pytest.raises(
        ParameterError, match=r"load\.horizontal varies, so there is no phase plane"
    ):
        phase_portrait(varying)
    with pytest.raises(ParameterError, match="one coordinate, and this one has theta_1, theta_2"):
        phase_portrait(System(model=TwoLayer(beta0=1.4), load=Load(vertical=-0.5)))
    wall = System(model=WallOscillator(wall=0.5))
    with pytest.raises(
        ParameterError,
        match=r"starts must lie where the system can be, and \[2.0, 0.0\] is beyond the contact",
    ):
        phase_portrait(wall, starts=[(0.0, 0.0), (2.0, 0.0)])
    with pytest.raises(
        ParameterError, match=r"window must reach to where x can be, .* is beyond the contact"
    ):
        phase_portrait(wall, window=((1.0, 2.0), (-1.0, 1.0)))
