"""A small response spectrum from end to end: what it finds, what it proves of every point, and that
a seed is all its chance.
"""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced
from study_cases import AMPLITUDE, FREQUENCY

import saltus
from saltus import bifurcation_diagram, response_spectrum
from saltus.orbits import orbits_of
from saltus.orbits.orbit import solve

# speed or gap below which an orbit grazes: rounding then decides whether there is an impact
TOUCHING = 1e-9

# Folds and the grazing of the period-3 loop at H = 1, and folds at H = 0.5, by codes that share
# nothing with this one
LOOP = {
    "LP": [2.1304272516, 2.3228679307, 3.0430772685, 3.0513452905, 3.1064546343],
    "GR": [2.4548757753],
}
HALF = [0.848485265597, 0.908810732539]


def special(branch, kind):
    return np.sort(branch["special_parameter"].values[branch["kind"].values == kind])


def largest_multiplier(branch):
    return np.hypot(branch["multiplier_real"], branch["multiplier_imag"]).max("multiplier").values


def touches(branch):
    return np.minimum(np.abs(branch["slowest"]), np.abs(branch["clearance"])).values < TOUCHING


def orbits_at(branch, value):
    """The orbits of a branch at a value of the parameter, solved between the points of its dataset
    alone.
    """
    found = []
    for a, b in pairwise(orbits_of(branch)):
        start, end = a.solution.values[0], b.solution.values[0]
        if a.signature != b.signature or (start - value) * (end - value) > 0 or start == end:
            continue
        share = (value - start) / (end - start)
        guess = a.solution.unknowns + share * (b.solution.unknowns - a.solution.unknowns)
        solution = solve(a.equations, guess, np.array([value]))
        assert solution is not None
        found.append(type(a)(a.equations, solution))
    return found


# --- what is found -----------------------------------------------------------


def test_a_main_branch_and_the_detached_loop_of_period_3(branches):
    assert [int(branch["period"][0]) for branch in branches] == [1, 3]
    main, loop = branches
    assert list(main.attrs["ends"]) == ["bound 2", "bound 2.6"]
    assert list(main.attrs["end_reasons"]) == ["bound", "bound"]
    assert loop.attrs["closed"] == 1
    assert np.unique(loop["impact_count"]).tolist() == [2, 6]


def test_the_loop_has_the_folds_and_the_grazing_of_independent_codes(branches):
    loop = branches[1]
    assert special(loop, "LP") == pytest.approx(LOOP["LP"], abs=2e-10)
    assert special(loop, "GR")[0] == pytest.approx(LOOP["GR"][0], abs=2e-10)


def test_a_loop_is_followed_beyond_the_range_to_where_it_closes(branches):
    main, loop = branches
    assert loop["parameter"].max() > 10.0
    assert np.array_equal(loop["unknowns"][0], loop["unknowns"][-1], equal_nan=True)
    assert main["parameter"].min() == 2.0
    assert main["parameter"].max() == 2.6


# --- what is proved of every point -------------------------------------------


def test_no_point_is_inadmissible(branches):
    for branch in branches:
        assert branch["slowest"].min() > -TOUCHING
        assert branch["clearance"].min() > -TOUCHING
        assert all(orbit.admissible for orbit in orbits_of(branch))
        assert branch["residual"].max() < 1e-10


def test_every_stable_point_stays_where_it_is_for_20_periods(branches):
    for branch in branches:
        stable = branch["stable"].values.astype(bool)
        assert stable.any()
        assert branch["kept"].values[stable].max() < 1e-8
        assert np.isnan(branch["kept"].values[~stable]).all()


def test_every_point_repeats_itself_as_well_as_it_repels(branches):
    """The event-driven flow over a period multiplies the roundings of the orbit by its largest
    multiplier, or a little more.
    """
    for branch in branches:
        smooth = ~touches(branch)
        assert smooth.sum() > 0.9 * smooth.size
        expected = 1e-10 * np.maximum(1.0, largest_multiplier(branch)[smooth])
        assert (branch["defect"].values[smooth] < expected).all()


def test_stable_means_multipliers_inside_the_unit_circle(branches):
    for branch in branches:
        # exactly at a special point it is not stable
        inside = (largest_multiplier(branch) < 1.0 - 1e-9) & ~touches(branch)
        assert (branch["stable"].values.astype(bool) == inside).all()


def test_the_multipliers_obey_the_law_of_the_determinant(branches):
    """exp(-C q T): the damping of both layers is C, and no impact takes energy."""
    for branch in branches:
        values = branch["multiplier_real"].values + 1j * branch["multiplier_imag"].values
        law = np.exp(-0.1 * branch["period"] * 2 * np.pi / branch["parameter"]).values
        # beside a grazing rounding takes digits of the smaller one; at it the larger is infinite
        moderate = largest_multiplier(branch) < 100.0
        assert moderate.sum() > 0.9 * moderate.size
        assert values[moderate].prod(axis=1) == pytest.approx(law[moderate], rel=1e-8)


def test_every_dot_of_the_simulation_lies_on_a_stable_branch(spectrum, branches):
    dots = spectrum["attractors"]
    assert dots.sizes["dot"] >= 5
    assert set(dots["period"].values.tolist()) == {1, 3}
    for value, amplitude, periods in zip(
        dots["parameter"].values, dots["amplitude"].values, dots["period"].values, strict=True
    ):
        orbits = [
            orbit
            for branch in branches
            for orbit in orbits_at(branch, value)
            if orbit.stable and orbit.period == periods
        ]
        assert min(abs(orbit.amplitude - amplitude) for orbit in orbits) < 1e-6


def test_every_motion_of_the_search_is_accounted_for(spectrum):
    assert spectrum.attrs["starts"] == 16
    assert spectrum["search"]["searched"].values.tolist() == [2.2, 2.4]
    ended = spectrum["search"]["unsettled"] + spectrum["search"]["at_rest"]
    assert (ended >= 0).all()
    assert (ended < 16).all()
    assert spectrum.attrs["left"] >= 0
    assert spectrum["bands"].sizes["band"] == 0
    assert spectrum["unplaced"].sizes["dot"] == 0
    assert spectrum["attractors"]["placed"].values.all()


def test_what_share_of_the_states_is_missed_is_estimated_by_a_sample(spectrum):
    attrs = spectrum.attrs
    assert attrs["missed_share"] == attrs["missed"] / attrs["sample"]
    assert attrs["missed_low"] <= attrs["missed_share"] <= attrs["missed_high"]
    assert 0.0 < attrs["missed_high"] - attrs["missed_low"] < 0.1


# --- chance, and what is asked -----------------------------------------------


def small(**options):
    return response_spectrum(
        forced(H=0.5),
        FREQUENCY,
        (0.8, 1.0),
        **{"max_period": 1, "values": [0.9], "starts": 8} | options,
    )


def test_the_same_seed_gives_the_same_numbers_and_another_one_the_same_motions():
    first, again, other = small(), small(), small(seed=7)
    xr.testing.assert_identical(first, again)
    for spectrum in (first, other):
        branch = saltus.branch_of(spectrum, 0)
        assert spectrum["branches"].sizes["branch"] == 1
        assert special(branch, "LP") == pytest.approx(HALF, abs=1e-10)


def test_progress_grows_to_one_and_says_what_is_done():
    heard = []
    small(progress=lambda share, what: heard.append((share, what)))
    shares = np.array([share for share, _ in heard])
    assert (np.diff(shares) >= 0).all()
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    # What branches report is passed on only if they take longer than what is beside them.
    said = {what.split(",")[0] for _, what in heard if not what.startswith("following")}
    assert said == {
        "searching",
        "looking for chaos",
        "estimating what is missing",
        "confirming",
        "done",
    }


def test_where_everything_rests_there_is_no_branch():
    """Far below the onset, H = 0.0219879514 at Omega = 1, all motions end at rest."""
    tree = bifurcation_diagram(
        forced(1.0), AMPLITUDE, (0.0, 0.01), max_period=2, values=[0.005], starts=8
    )
    assert tree["branches"].sizes.get("branch", 0) == tree["points"].sizes["point"] == 0
    assert tree["attractors"].sizes["dot"] == 0
    assert int(tree["search"]["at_rest"][0]) == 8
