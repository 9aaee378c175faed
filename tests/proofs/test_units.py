"""Proofs are the same in all units of length, time and mass."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import saltus

UNITS = [(1e-9, 1.0), (1.0, 1e-6), (1.0, 1e6), (1e6, 1e-3)]  # of length, of time
DIFFERENCE = 1e-6  # of radii, which rounding alone may change


def oscillator(length: float, time: float) -> saltus.System:
    """An oscillator at a wall, told in other units."""
    return saltus.System(
        model=saltus.WallOscillator(stiffness=time**-2, damping=0.1 / time, wall=length),
        load=saltus.Load(
            frequency=0.8 / time, force=saltus.Harmonic(amplitude=0.5 * length / time**2)
        ),
        impact=saltus.VelocityReduction(0.7),
    )


def impact_pair(length: float, time: float) -> saltus.System:
    """An impact pair, told in other units."""
    return saltus.System(
        model=saltus.ImpactPair(
            mass_ratio=0.3, stiffness=time**-2, damping=0.1 / time, clearance=0.5 * length
        ),
        load=saltus.Load(
            frequency=1.2 / time, force=saltus.Harmonic(amplitude=0.6 * length / time**2)
        ),
        impact=saltus.NewtonImpact(e=0.6),
    )


def oscillator_orbit(length: float, time: float) -> saltus.PeriodicOrbit:
    return saltus.find_orbit(oscillator(length, time), x=0.0)


def pair_orbit(length: float, time: float) -> saltus.PeriodicOrbit:
    return saltus.find_orbit(impact_pair(length, time), z=0.1 * length, x=0.1 * length)


def without_units(radii: dict[str, float], length: float, time: float) -> dict[str, float]:
    """Radii by the kind of unknown in the units 1 and 1."""

    def unit(name: str) -> float:
        inner = name.removeprefix("kernel of ")
        if inner == "time":
            return time
        if inner == "load.frequency":
            return 1.0 / time
        return length / time if inner == "speed" or inner.endswith("'") else length

    return {name: radius / unit(name) for name, radius in radii.items()}


@pytest.mark.parametrize("orbit_in", [oscillator_orbit, pair_orbit])
@pytest.mark.parametrize("units", UNITS)
def test_orbits(
    orbit_in: Callable[[float, float], saltus.PeriodicOrbit], units: tuple[float, float]
) -> None:
    reference = saltus.prove(orbit_in(1.0, 1.0))
    if units[0] == 1e-9 and orbit_in is pair_orbit:
        units = (1e-6, 1.0)  # beyond, the search finds another kind of equations
    proof = saltus.prove(orbit_in(*units))
    assert (reference.proved, reference.stable) == (True, True)
    assert (proof.proved, proof.stable, proof.steps) == (True, True, reference.steps)
    radii = without_units(proof.unique_within, *units)
    assert radii == pytest.approx(reference.unique_within, rel=DIFFERENCE, abs=0.0)
    apart = np.abs(proof.moduli[:, 0] - reference.moduli[:, 0])
    assert (apart <= proof.moduli[:, 1] + reference.moduli[:, 1]).all()
    assert proof.moduli[:, 1] == pytest.approx(reference.moduli[:, 1], rel=1.0)


@pytest.mark.parametrize("units", UNITS[1:3])
def test_special_points_and_branches(units: tuple[float, float]) -> None:
    length, time = units
    reference, proofs = (
        saltus.prove(
            saltus.continue_orbit(
                oscillator_orbit(*each), "load.frequency", (0.79 / each[1], 0.85 / each[1])
            ),
            most_boxes=3,
        )
        for each in ((1.0, 1.0), units)
    )
    special = [point.evidence.proof for point in reference.branch.special]
    assert "LP" in {proof.kind for proof in special if proof.proved}
    for one, other in zip(
        special, (point.evidence.proof for point in proofs.branch.special), strict=True
    ):
        assert (one.kind, one.proved) == (other.kind, other.proved)
        for name in ("unique_within", "only_within"):
            radii = without_units(getattr(other, name), length, time)
            assert radii == pytest.approx(getattr(one, name), rel=DIFFERENCE, abs=0.0)
    for one, other in zip(reference.pieces, proofs.pieces, strict=True):
        assert one.ends == other.ends
        assert one.turns == other.turns
        assert [box.stable for box in one.boxes] == [box.stable for box in other.boxes]
        highs = [box.high * time for box in other.boxes]
        assert highs == pytest.approx([box.high for box in one.boxes], rel=DIFFERENCE, abs=0.0)
