"""Orbits, branches and attractors under loads that jump and repeat themselves."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import Load, Model, Square, System, Table, Triangle, VelocityReduction, WallOscillator


@dataclass(frozen=True, kw_only=True)
class Duffing(Model):
    """x'' = F - 0.2 x' - x - x^3."""

    coordinates: ClassVar = ("x",)
    channels: ClassVar = ("force",)

    def acceleration(self, t, x, v, side, load):
        return load.force(t) - 0.2 * v - x - x**3


def wall(**changes):
    force = changes.get("force", Square(0.8, duty=0.25))
    return System(
        model=WallOscillator(wall=0.3, damping=0.1),
        load=Load(frequency=changes.get("frequency", 1.2), force=force),
        impact=VelocityReduction(0.7),
    )


def test_the_square_wave_duffing_has_the_published_special_points():
    """COCO's bang-bang example (Dankowicz and Schilder, Recipes for Continuation, 2013)."""
    system = System(model=Duffing(), load=Load(frequency=1.1, force=Square(26.0)))
    assert saltus.orbits.is_symmetric(system)
    orbit = saltus.find_orbit(system, x=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.5))
    found = sorted((str(point.kind), point.parameter) for point in branch.special)
    wanted = [
        ("BPC", 0.85439927),
        ("BPC", 1.07596791),
        ("LP", 0.81948777),
        ("LP", 1.11097075),
    ]
    assert [kind for kind, _ in found] == [kind for kind, _ in wanted]
    for (_, value), (_, published) in zip(found, wanted, strict=True):
        assert value == pytest.approx(published, abs=5e-9)


@pytest.mark.parametrize("force", [Square(2.0), Square(2.0, phase=0.7), Triangle(2.0)])
def test_the_orbit_of_a_linear_oscillator_is_its_fourier_series(force):
    """x = sum of H(n Omega) F_n: F_n = 4 A / (pi n), or 8 A / (pi n)^2 with the sign of the corner,
    of odd n.
    """
    frequency, damping = 0.7, 0.3
    system = System(
        model=WallOscillator(wall=50.0, damping=damping), load=Load(frequency=frequency, force=force)
    )  # fmt: skip
    orbit = saltus.find_orbit(system, x=0.0)
    motion = orbit.motion()
    time = motion.start + 0.37
    n = np.arange(1, 200001, 2)
    amplitude = (
        8 * 2.0 / (math.pi * n) ** 2 * (-1.0) ** ((n - 1) // 2)
        if isinstance(force, Triangle)
        else 4 * 2.0 / (math.pi * n)
    )
    phase = n * (frequency * time + float(force.phase))
    response = 1 / (1 - (n * frequency) ** 2 + 1j * damping * n * frequency)
    expected = np.sum(amplitude * np.imag(response * np.exp(1j * phase)))
    assert float(motion.at(time)[0]) == pytest.approx(expected, abs=1e-10)
    decay = math.exp(-damping * math.pi / frequency)
    assert np.abs(orbit.multipliers) == pytest.approx(decay, abs=1e-10)


def test_a_branch_passes_the_corner_that_an_impact_comes_to():
    """At SW the impact is at the jump; on both sides the orbits are those of motions that settle."""
    branch = saltus.continue_orbit(
        saltus.find_orbit(wall(frequency=1.55), x=0.0), "load.frequency", (1.5, 1.67)
    )
    (special,) = branch.special
    assert special.kind == "SW"
    motion = special.orbit.motion()
    (impact,) = motion.events
    share = impact.time * special.parameter / math.tau % 1.0
    assert share == pytest.approx(0.25, abs=1e-9)
    for frequency in (1.62, 1.65):
        settled = saltus.find_orbit(wall(frequency=frequency), x=0.0)
        (orbit,) = branch.at(frequency)
        assert orbit.multipliers == pytest.approx(settled.multipliers, abs=1e-9)


def test_multipliers_are_those_of_differences():
    system = wall()
    orbit = saltus.find_orbit(system, x=0.0)
    start = orbit.start()
    h = 1e-6
    columns = []
    for name in ("x", "velocity"):
        ends = [
            saltus.simulate(system, **{**start, name: start[name] + d}, periods=1)
            for d in (h, -h)
        ]  # fmt: skip
        columns.append(
            [(ends[0].x - ends[1].x) / (2 * h), (ends[0].velocity - ends[1].velocity) / (2 * h)]
        )
    found = np.sort_complex(np.linalg.eigvals(np.array(columns).T))
    assert found == pytest.approx(np.sort_complex(orbit.multipliers), abs=1e-7)


def test_attractors_exponents_and_energies_of_an_impact_oscillator_under_pulses():
    system = wall(force=Table([0.0, 1.0, 1.0, 4.0], [0.8, 0.8, -0.8, -0.8]))
    orbit = saltus.find_orbit(wall(), x=0.0)
    attractors = saltus.find_attractors(system, starts=8)
    assert [each.highest for each in attractors] == pytest.approx([orbit.highest], abs=1e-9)
    largest = math.log(abs(orbit.multipliers[0])) * 1.2 / math.tau
    exponents = saltus.lyapunov_spectrum(system, x=0.0, periods=60)
    assert exponents.values == pytest.approx([largest, largest], abs=1e-4)
    energy = saltus.energies(orbit)["energy"].to_series()
    lost = energy.drop(["load.force", "kinetic", "potential"]).sum()
    assert energy["load.force"] == pytest.approx(lost, abs=1e-12)


def test_curves_of_folds_and_symmetry_breakings_pass_those_of_other_branches():
    """At another amplitude the curve has the values that a branch there has.

    Perturbations of a BPC come back with the other sign: their derivative to the frequency needs
    the rates at the start of the motion, not those at its end."""
    system = System(model=Duffing(), load=Load(frequency=1.1, force=Square(26.0)))
    orbit = saltus.find_orbit(system, x=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.5))
    other = system.with_({"load.force.amplitude": 25.0})
    there = saltus.continue_orbit(saltus.find_orbit(other, x=0.0), "load.frequency", (0.8, 1.5))
    for kind in ("LP", "BPC"):
        special = max(
            (point for point in branch.special if point.kind == kind),
            key=lambda point: point.parameter,
        )
        expected = max(point.parameter for point in there.special if point.kind == kind)
        curve = saltus.continue_special(special, "load.force.amplitude", (24.9, 26.1))
        (found,) = curve.at("load.force.amplitude", 25.0)
        assert found.frequency == pytest.approx(expected, abs=1e-8)


def test_a_grazing_at_the_instant_of_a_jump_is_one():
    """At its damped frequency an oscillator under a square wave turns by half a turn between jumps, at
    which it rests: its amplitude is (1 + E) / (1 - E) that of the force, E = exp(-c pi / (2 Omega)).
    """
    damping = 0.2
    frequency = math.sqrt(1.0 - damping**2 / 4.0)
    decay = math.exp(-damping * math.pi / (2.0 * frequency))
    system = System(
        model=WallOscillator(wall=(1.0 + decay) / (1.0 - decay), damping=damping),
        load=Load(frequency=frequency, force=Square(0.9)),
        impact=VelocityReduction(0.5),
    )
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.0), "load.force.amplitude", (0.8, 1.1)
    )
    (point,) = (each for each in branch.special if str(each.kind) == "GR")
    assert point.parameter == pytest.approx(1.0, abs=1e-10)
