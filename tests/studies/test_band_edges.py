"""What happens at the edges of a band of chaos, from the branches beside it; each kind where theory
says what it must be.
"""

from dataclasses import replace

import numpy as np
import pytest
from shared_systems import forced

from saltus import continue_orbit, find_orbit
from saltus.orbits import SpecialKind, switch_branch
from saltus.studies.diagram.bands import EdgeKind, band_origins, explained, turning_points
from saltus.studies.diagram.chaos_search import BandSearch
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import CHAOS
from saltus.studies.diagram.simulated import simulate_from

FREQUENCY, BOUNDS = "load.frequency", (0.36, 0.402)


@pytest.fixture(scope="module")
def branches():
    """At Hhat = 0.2: the orbits of one forcing period, unsymmetric ones among them, and those of
    two and four.
    """
    orbit = find_orbit(forced(0.2, 0.361), theta=0.05, velocity=0.0, period=1)
    found = [continue_orbit(orbit, FREQUENCY, BOUNDS)]
    for kind in (SpecialKind.BPC, SpecialKind.PD, SpecialKind.PD):
        special = next(point for point in found[-1].special if point.kind == kind)
        found += switch_branch(special, BOUNDS, both=False)[:1]
    return found


@pytest.fixture(scope="module")
def bands(branches):
    values = np.linspace(*BOUNDS, 15)
    states = np.random.default_rng(3).uniform(-0.2, 0.2, (15 * 4, 2))
    system, settings = forced(0.2), replace(CHAOS, step=0.02, fine_step=0.01, edge=2e-3)
    begun = simulate_from(system, FREQUENCY, np.repeat(values, 4), states, 300)
    search = BandSearch(DiagramWork(system, FREQUENCY), BOUNDS, settings)
    search.look(begun, band_origins(branches))
    return explained(system, search.bands, branches).bands


def test_the_branches_turn_where_the_cascade_of_period_doublings_begins(branches):
    doublings = sorted(
        point.parameter for point in turning_points(branches) if point.kind == SpecialKind.PD
    )
    ratio = (doublings[-1] - doublings[-2]) / (doublings[-2] - doublings[-3])
    assert len(doublings) >= 3
    assert 2.0 < ratio < 20.0  # towards 4.669 (Feigenbaum)


@pytest.mark.thorough
def test_chaos_begins_where_the_stable_orbit_grazes(branches, bands):
    """Below the grazing, which continuation locates to 1e-10, the motion has period 1; above it is
    chaotic at once.
    """
    grazing = min(
        point.parameter for point in turning_points(branches) if point.kind == SpecialKind.GR
    )
    lower = bands[0].lower
    assert lower.kind is EdgeKind.GRAZING
    assert lower.special == grazing
    assert lower.outer <= grazing <= lower.inner


@pytest.mark.thorough
def test_the_other_end_of_the_chaos_is_a_cascade(branches, bands):
    upper = max(bands, key=lambda band: band.high - band.low).upper
    doublings = [
        point.parameter for point in turning_points(branches) if point.kind == SpecialKind.PD
    ]
    assert upper.kind is EdgeKind.CASCADE
    assert upper.special in doublings
    assert upper.special > upper.inner
