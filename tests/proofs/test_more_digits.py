"""Orbits and folds whose equations are nearly singular are proved with more digits, by FLINT."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import saltus
from saltus.bounds import Ball, krawczyk, precise
from saltus.bounds.precise import precise_residual
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.orbit_proof import shooting_of


def table(amplitude: float) -> saltus.System:
    """A ball under an acceleration of 1 on a table, e = 1/2."""
    return saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=amplitude)),
        impact=saltus.VelocityReduction(0.5),
    )


def beside_the_fold(share: float) -> tuple[PeriodicOrbit, mp.mpf]:
    """The orbit of period 1 at a share beyond the fold a = pi / 3, with its exact phase: the ball
    leaves the table with the speed pi, so that cos(phase) = -pi / (3 a)."""
    amplitude = float(np.pi / 3 * (1.0 + share))
    base = saltus.find_orbit(table(1.2), x=-1.0, velocity=-3.0)
    with mp.workdps(40):
        phase = 2 * mp.pi - mp.acos(-mp.pi / 3 / mp.mpf(amplitude))
    equations = type(base.equations)(table(amplitude), base.signature)
    unknowns = np.array([float(phase), 4.0 * np.pi / 3.0])
    orbit = PeriodicOrbit.known(equations, unknowns, base.solution.values)
    assert orbit is not None
    return orbit, phase


def test_an_orbit_beside_its_fold_is_proved_and_contains_its_closed_form() -> None:
    """At 1e-14 beyond the fold the condition is 1e8, and a multiplier is 1 - 4e-7."""
    pytest.importorskip("flint")
    orbit, phase = beside_the_fold(1e-14)
    proof = saltus.prove(orbit, step=1.0, order=24)
    assert proof.proved, proof.reason
    assert proof.stable
    middle, radius = proof.impact_times[0]
    with mp.workdps(40):
        assert abs(mp.mpf(float(middle)) - phase) <= mp.mpf(float(radius))
    assert radius < 1e-15
    assert "the balls of FLINT contain what they stand for" in proof.assumptions
    assert proof.check()


def test_without_the_extra_the_reason_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(krawczyk, "has_flint", lambda: False)
    proof = saltus.prove(beside_the_fold(1e-14)[0], step=1.0, order=24)
    assert proof.proved is None
    assert proof.reason.endswith('more digits may prove it: pip install ".[prove]"')


def test_the_residual_of_many_digits_lies_in_that_of_doubles() -> None:
    """Of a symmetric orbit, of two coordinates, and of one without impacts."""
    pytest.importorskip("flint")
    metainterface = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    )
    pair = saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.3, damping=0.1, clearance=0.5),
        load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.6)),
        impact=saltus.NewtonImpact(e=0.6),
    )
    smooth = saltus.System(
        model=saltus.WallOscillator(damping=0.05, wall=50.0),
        load=saltus.Load(frequency=0.5, force=saltus.Harmonic(amplitude=0.2)),
    )
    for system, start in (
        (metainterface, {"theta": 0.3}),
        (pair, {"z": 0.1, "x": 0.1}),
        (smooth, {"x": 0.0}),
    ):
        orbit = saltus.find_orbit(system, **start)
        made = orbit.equations.segments_to_prove(orbit.solution)
        shooting = shooting_of(orbit, made, path="load.frequency", pins=[])
        row = np.zeros(shooting.size)
        row[-1] = 1.0
        shooting.pins = [(row, 0.25)]
        x = shooting.x0 * (1.0 + 1e-6)
        at = Ball(x)
        doubles = shooting.system_rows(shooting.enclose(at), at)[0]
        finer = precise_residual(shooting, x)
        assert finer is not None
        apart = np.abs(finer.middle - doubles.middle)
        assert (apart <= doubles.radius + finer.radius).all()
        assert (finer.radius <= 5e-16 * np.abs(finer.middle) + 1e-24).all()
        assert np.abs(finer.middle).max() > 1e-8


@pytest.mark.parametrize("name", sorted(precise.FUNCTIONS))
def test_functions_of_balls_are_those_of_mpmath(name: str) -> None:
    """Each function of the table of tapes, at one point, to 30 digits."""
    flint = pytest.importorskip("flint")
    exact = {
        "add": lambda u, w: u + w,
        "sub": lambda u, w: u - w,
        "mul": lambda u, w: u * w,
        "div": lambda u, w: u / w,
        "pow": lambda u, w: u**w,
        "maximum": max,
        "minimum": min,
        "greater": lambda u, w: u > w,
        "greater_equal": lambda u, w: u >= w,
        "less": lambda u, w: u < w,
        "less_equal": lambda u, w: u <= w,
        "where": lambda c, u, w: u if c else w,
    }
    arguments = {"where": (1.0, 0.7, 1.3)}.get(name, (0.7, 1.3) if name in exact else (0.7,))
    with mp.workdps(40):
        function = exact.get(name) or getattr(mp, name)
        expected = mp.mpf(function(*map(mp.mpf, arguments)))
        value = precise.FUNCTIONS[name](*map(flint.arb, arguments))
        assert abs(mp.mpf(value.mid().str(40, radius=False)) - expected) < 1e-14


@pytest.mark.parametrize(
    "name", ["sin", "cos", "exp", "log", "sqrt", "atan", "sinh", "cosh", "tanh"]
)
def test_series_of_functions_are_those_of_mpmath(name: str) -> None:
    flint = pytest.importorskip("flint")
    with mp.workdps(40):
        expected = mp.taylor(getattr(mp, name), mp.mpf(0.7), 8)
        found = precise.FUNCTIONS[name](flint.arb_series([flint.arb(0.7), 1], prec=9)).coeffs()
        for coefficient, exact in zip(found, expected, strict=True):
            assert abs(mp.mpf(coefficient.mid().str(40, radius=False)) - exact) < 1e-13


def test_beside_a_fold_a_proof_of_another_stability_is_not_given() -> None:
    """Two orbits lie 4e-8 on both sides of the phase pi. One that is asked for between them solves its
    equations in doubles, is not stable, and Newton's method leads from it to the stable one.
    """
    pytest.importorskip("flint")
    near, phase = beside_the_fold(6e-16)
    between = np.array([np.pi + 0.002 * (float(phase) - np.pi), 4.0 * np.pi / 3.0])
    orbit = PeriodicOrbit.known(near.equations, between, near.solution.values)
    assert orbit is not None
    assert not orbit.stable
    assert saltus.prove(near, step=1.0, order=24).stable
    proof = saltus.prove(orbit, step=1.0, order=24)
    assert proof.proved is None
    assert proof.stable is None
    assert "which of two orbits was meant is not decided" in proof.reason
