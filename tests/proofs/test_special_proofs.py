"""Special points are enclosed where closed forms and independent codes put them."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import saltus


@pytest.fixture(scope="module")
def readme_branch() -> saltus.Branch:
    """The README's branch near its folds."""
    system = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    )
    orbit = saltus.find_orbit(system, theta=0.3)
    return saltus.continue_orbit(orbit, "load.frequency", bounds=(0.26, 1.1))


def test_folds_breakings_and_grazings_are_proved(readme_branch: saltus.Branch) -> None:
    """Each within 1e-9 of where the branch found it; the folds of two independent codes (residual
    1e-15) lie inside: 0.848485265597 and 0.908810732539."""
    proofs = {}
    for point in readme_branch.special:
        if point.kind in ("LP", "GR", "BPC"):
            proof = saltus.prove(point)
            assert proof.proved, (point, proof.reason)
            assert abs(proof.parameter[0] - point.parameter) < 1e-9
            assert proof.parameter[1] < 1e-12
            proofs[round(point.parameter, 6)] = proof
    assert abs(proofs[0.848485].parameter[0] - 0.848485265597) < 6e-13
    assert abs(proofs[0.908811].parameter[0] - 0.908810732539) < 6e-13
    assert {proof.kind for proof in proofs.values()} == {"LP", "GR", "BPC"}
    assert all(proof.only_within for proof in proofs.values() if proof.kind != "GR")


def test_a_ball_on_a_table_is_born_and_doubles_at_its_closed_forms() -> None:
    """With g = W = 1 and e = 1/2 the orbit of period 1 is born at a = pi (1 - e) / (1 + e), and
    doubles at a^2 = (pi (1 - e) / (1 + e))^2 + (2 (1 + e^2) / (1 + e)^2)^2."""
    system = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=1.2)),
        impact=saltus.VelocityReduction(0.5),
    )
    orbit = saltus.find_orbit(system, x=-1.0, velocity=-3.0)
    branch = saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=(0.9, 1.7))
    with mp.workdps(40):
        born = mp.pi / 3
        exact = {
            "LP": born,
            "PD": mp.sqrt(born**2 + (2 * mp.mpf(5) / 4 / (mp.mpf(9) / 4)) ** 2),
        }
        kinds = set()
        for point in branch.special:
            if point.kind not in exact:
                continue
            proof = saltus.prove(point)
            assert proof.proved, proof.reason
            off = abs(mp.mpf(float(proof.parameter[0])) - exact[point.kind])
            assert off <= mp.mpf(float(proof.parameter[1]))
            assert proof.parameter[1] < 1e-12
            kinds.add(str(point.kind))
        assert kinds == {"LP", "PD"}


def test_a_smooth_oscillator_s_fold_is_proved() -> None:
    """Orbits without impacts have their state at phase 0 as the unknown of a section."""

    system = saltus.System(
        model=saltus.WallOscillator(damping=0.05, wall=50.0),
        load=saltus.Load(frequency=0.5, force=saltus.Harmonic(amplitude=0.2)),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    proof = saltus.prove(orbit)
    assert proof.proved
    with mp.workdps(30):
        modulus = mp.exp(-mp.mpf(0.05) * 2 * mp.pi)
        for middle, radius in proof.moduli:
            assert abs(mp.mpf(float(middle)) - modulus) <= mp.mpf(float(radius))
    assert proof.least_speed == np.inf


def test_kinds_that_are_not_proved_say_so(readme_branch: saltus.Branch) -> None:
    margins = [p for p in readme_branch.special if p.kind not in ("LP", "GR", "BPC", "PD", "NS")]
    assert margins
    proof = saltus.prove(margins[0])
    assert proof.proved is None
    assert "not proved yet" in proof.reason


def test_special_points_of_two_stops_are_proved() -> None:
    """Several contacts: the same equations by the same variation of segments."""
    system = saltus.System(
        model=saltus.TwoStops(left=-1.0, right=1.0, damping=0.05),
        load=saltus.Load(frequency=1.6, force=saltus.Harmonic(amplitude=2.0)),
        impact=saltus.NewtonImpact(e=0.8),
    )
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.2), "load.frequency", bounds=(1.0, 3.0)
    )
    proofs = [saltus.prove(p) for p in branch.special if p.kind in ("LP", "PD", "BPC", "GR")]
    assert proofs
    for proof in proofs:
        assert proof.proved, (proof.kind, proof.reason)
        assert abs(proof.parameter[0] - proof.special.parameter) < 1e-8
