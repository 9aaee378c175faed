"""The comparison of orbits and motions with the branches of a diagram."""

import numpy as np
from shared_systems import forced

from saltus import continue_orbit, find_orbit
from saltus.studies.diagram.branch_set import PlacedBranch
from saltus.studies.diagram.simulated import SETTINGS, followed, simulate_from

FREQUENCY = "load.frequency"


def test_a_branch_holds_its_own_orbits_beside_its_narrow_peak():
    """The primary resonance at Hhat = 0.2 (Fig.

    9a), whose amplitude changes by 0.05 rad within 1e-4 of the frequency.
    """
    branch = continue_orbit(
        find_orbit(forced(0.2, 2.08925), theta=0.05, velocity=0.05), FREQUENCY, (0.1, 3.75)
    )
    placed = PlacedBranch(branch)
    # the last one is where a diagram met it
    values = np.append(np.linspace(0.8305, 0.8325, 41), 0.8320974845378502)
    found = [(orbit, value) for value in values.tolist() for orbit in branch.at(value)]
    assert len(found) >= len(values)
    assert all(placed.holds(orbit, value) for orbit, value in found)


def test_stable_parts_end_at_the_special_points_where_stability_is_lost():
    """Motions are begun just beyond the ends: beyond a point at which an orbit doubles, and not
    short of it.
    """
    branch = continue_orbit(
        find_orbit(forced(0.2, 2.08925), theta=0.05, velocity=0.05), FREQUENCY, (0.7, 2.2)
    )
    placed = PlacedBranch(branch)
    ends, stable = placed.stable_ends, branch.stable
    assert np.isin(branch.parameters[ends], [special.parameter for special in branch.special]).all()
    assert len(ends) == np.count_nonzero(stable[:-1] != stable[1:])
    assert not stable[ends].any()
    assert (stable[ends - 1] != stable[ends + 1]).all()


def test_chaotic_motions_that_return_by_chance_are_soon_given_up():
    """Chance rarely lets a chaotic motion return ever nearer: few of those taken as slow are
    followed to the last round.
    """
    system, counts, n, periods = forced(0.2, 0.38), [], 200, 100
    states = np.random.default_rng(5).uniform(-0.1, 0.1, (n, 2))

    def follow(values, begun, asked, progress):
        counts.append(len(values))
        return followed(system, FREQUENCY, values, begun, asked)

    motions = simulate_from(system, FREQUENCY, np.full(n, 0.38), states, periods, follow=follow)
    assert motions.unsettled.mean() > 0.9
    assert counts[0] == n
    assert 0 < sum(counts[1:]) < 0.5 * SETTINGS.patience * counts[1]
