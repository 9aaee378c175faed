"""Oscillators on ground that moves, in coordinates relative to it: the same motions as under the
force of inertia.
"""

import itertools

import numpy as np
import pytest

import saltus

W, A = 1.3, 0.4
SHAKEN = saltus.Load(frequency=W, ground=saltus.Harmonic(A))
# F = -zeta'' for zeta = A sin(W t)
PUSHED = saltus.Load(frequency=W, force=saltus.Harmonic(A * W**2))


@pytest.mark.parametrize(
    ("model", "law"),
    [
        (saltus.WallOscillator(damping=0.1, wall=0.3), saltus.VelocityReduction(0.8)),
        (saltus.TwoStops(damping=0.1, left=-0.3, right=0.3), saltus.NewtonImpact(0.8)),
    ],
)
def test_a_shaken_oscillator_moves_as_under_the_force_of_inertia(model, law):
    shaken, pushed = (
        saltus.simulate(
            saltus.System(model=model, load=load, impact=law), x=0.0, periods=10, tol=1e-14
        )
        for load in (SHAKEN, PUSHED)
    )
    assert len(shaken.impacts) == len(pushed.impacts) > 5
    np.testing.assert_allclose(shaken.impacts.time, pushed.impacts.time, rtol=1e-11)
    assert shaken.x == pytest.approx(pushed.x, abs=1e-10)


def test_the_mass_of_a_shaken_impact_pair_flies_straight_between_impacts_and_momentum_is_kept_at_each():
    """y = z + x + zeta, the place of the mass in space, is linear in time while no wall pushes; an
    impact keeps (1) the momentum of case and mass, z' + mu y', and (2) turns the rate of x by the
    factor -e."""
    mu, e = 0.2, 0.7
    system = saltus.System(
        model=saltus.ImpactPair(mass_ratio=mu, damping=0.05, clearance=0.5),
        load=SHAKEN,
        impact=saltus.NewtonImpact(e),
    )
    motion = saltus.simulate(system, z=0.0, x=0.1, periods=6, tol=1e-14)
    edges = np.concatenate([[0.0], motion.impacts.time, [motion.time]])
    assert edges.size > 8
    for begin, end in itertools.pairwise(edges):
        times = np.linspace(begin + 1e-9, end - 1e-9, 7)
        z, x = motion.at(times)[0]
        flight = z + x + A * np.sin(W * times)
        line = np.polynomial.Polynomial.fit(times, flight, 1)
        np.testing.assert_allclose(flight, line(times), atol=1e-11)
    before, after = motion.impacts.velocity_before.T, motion.impacts.velocity_after.T
    np.testing.assert_allclose(after[1], -e * before[1], rtol=1e-12)
    momentum = [v[0] + mu * (v[0] + v[1]) for v in (before, after)]
    np.testing.assert_allclose(*momentum, rtol=1e-12, atol=1e-14)


def test_the_case_of_a_shaken_impact_pair_obeys_the_textbook_transmissibility_while_nothing_is_hit():
    """With the mass at rest in space the case is a linear oscillator on a moving base: z = A W^2 /
    abs(k - W^2 + i c W).
    """
    damping = 0.1
    pair = saltus.ImpactPair(mass_ratio=1e-3, damping=damping, clearance=50.0)
    motion = saltus.simulate(
        saltus.System(model=pair, load=SHAKEN, impact=saltus.NewtonImpact(0.5)),
        z=0.0,
        x=0.0,
        periods=60,
    )
    times = np.linspace(motion.time - 2 * np.pi / W, motion.time, 400)
    z = motion.at(times)[0][0]
    assert np.ptp(z) / 2 == pytest.approx(A * W**2 / abs(1 - W**2 + 1j * damping * W), rel=1e-3)


def test_the_mirror_of_a_shaken_oscillator_has_the_ground_reversed():
    system = saltus.System(
        model=saltus.TwoStops(), load=saltus.Load(frequency=W, ground=[saltus.Harmonic(A), 0.2])
    )
    mirrored = system.mirrored()
    assert mirrored.load.ground(0.4) == -system.load.ground(0.4)


def test_a_record_of_the_ground_is_one_of_displacement_velocity_or_acceleration():
    with pytest.raises(saltus.ParameterError, match="displacement, velocity or acceleration"):
        saltus.Load(ground=saltus.HalfSine(amplitude=1.0, frequency=2.0, quantity="force"))
