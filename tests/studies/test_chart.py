"""Stability charts: their cells hold the stable motions that theory, Newton's method and the search
for orbits know.
"""

import functools

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced

from saltus import TwoStops, search_orbits, stability_chart
from saltus.errors import ParameterError
from saltus.orbits import find_orbit
from saltus.studies.chart.cells import beyond_limits, joined, seeds, starts
from saltus.studies.chart.changes import monostable
from saltus.studies.chart.motions import distinct, has_alike, motion_type
from saltus.systems import Harmonic, Load, Metainterface, System, VelocityReduction, check_window
from saltus.theory import equilibria, unloaded_fold

H, V = "load.horizontal.amplitude", "load.vertical"
ONSET = 0.0219879514  # Hhat of the fold at V = -0.5, Omega = 1 (issue 5)


@functools.cache
def row(W=1.0):
    """A row of cells at V = -0.5, closely about the onset at Omega = 1."""
    return stability_chart(
        forced(1.0, W=W),
        horizontal=[0.02, ONSET - 2e-4, ONSET + 2e-4, 0.024, 0.03, 0.04, 0.07, 0.2],
        vertical=[-0.5],
    )


def motions(cell):
    """Amplitude, period and state of each motion of a cell."""
    names = ("amplitude", "period", "theta", "velocity")
    return list(
        zip(*(cell[f"motion_{name}"].values[: int(cell["count"])] for name in names), strict=True)
    )


def test_motions_begin_at_the_fold():
    here = row()
    assert (here["count"].values[0] > 0).tolist() == (here["horizontal"].values > ONSET).tolist()
    assert monostable(here).values[0].tolist() == (here["horizontal"].values < ONSET).tolist()
    assert here["rest"].values[0, :7].all()
    assert not here["rest"].values[0, 7]  # beyond Hcr nothing is captured


@pytest.mark.parametrize("W", [1.0, 4.0])
def test_every_motion_is_a_stable_orbit_to_newtons_method(W):
    here = row(W)
    for i, horizontal in enumerate(here["horizontal"].values):
        system = forced(H=float(horizontal), W=W)
        for amplitude, period, theta, velocity in motions(here.isel(vertical=0, horizontal=i)):
            orbit = find_orbit(system, theta=theta, velocity=velocity, period=int(period), settle=0)
            assert orbit.stable
            assert orbit.period == period
            assert orbit.amplitude == pytest.approx(amplitude, rel=1e-6)


@pytest.mark.parametrize(("W", "horizontal"), [(1.0, 0.07), (1.0, 0.2), (4.0, 0.2), (4.0, 0.07)])
def test_a_cell_has_what_a_search_from_other_states_finds(W, horizontal):
    here = row(W).sel(horizontal=horizontal, vertical=-0.5)
    found = search_orbits(
        forced(H=horizontal, W=W),
        V,
        [-0.5],
        max_period=6,
        starts=60,
        window=((-2.0, 2.0), (-2.0, 2.0)),
        seed=7,
        repelling=0,
    )
    known = sorted(
        orbit.amplitude for orbit in found.orbits if orbit.stable and orbit.amplitude >= 1e-3
    )
    assert known
    own = [amplitude for amplitude, *_ in motions(here)]
    assert all(np.isclose(own, amplitude, rtol=1e-6).any() for amplitude in known)


def test_without_a_horizontal_load_motions_are_the_deformed_equilibria():
    fold = unloaded_fold(np.deg2rad(80))[0]
    vertical = [-1.9, -1.6, fold - 0.05, fold + 0.05, -1.0, -0.3]
    here = stability_chart(forced(1.0), horizontal=[0.0], vertical=vertical, starts=8)
    for i, load in enumerate(vertical):
        still = forced(1.0).with_({H: 0.0, V: load})
        still = type(still)(model=still.model, load=Load(vertical=load))
        known = [e.theta for e in equilibria(still) if e.stable and e.theta > 0]
        # and not twice as many: mirror images count once
        assert here["count"].values[i, 0] == len(known)
        np.testing.assert_allclose(
            here["motion_amplitude"].values[i, 0, : len(known)], known, rtol=1e-7
        )
        assert (here["motion_impact_count"].values[i] == 0).all()


def test_motions_are_followed_from_cell_to_cell_where_nothing_else_leads_to_them():
    horizontal = np.linspace(0.02, 0.1, 17)
    captured = ((-0.02, 0.02), (-0.02, 0.02))  # states that are captured below Hcr = 0.088
    options = {"vertical": [-0.5], "starts": 1, "window": captured}
    alone = [
        int(stability_chart(forced(1.0), horizontal=[value], **options)["count"][0, 0])
        for value in horizontal[:6]
    ]
    assert sum(alone) == 0
    together = stability_chart(forced(1.0), horizontal=horizontal, **options)
    assert ((together["count"].values[0] > 0) == (horizontal > ONSET)).all()


def test_a_motion_that_rests_for_a_part_of_each_period_is_a_motion():
    """At phase 0 it is held at the contact, but the load pulls it off again: it is no capture."""
    load = Load(frequency=0.1, horizontal=Harmonic(0.24), vertical=-0.8)
    system = System(
        model=Metainterface(beta0=np.radians(80.0), damping=0.5),
        load=load,
        impact=VelocityReduction(0.3),
    )
    orbit = find_orbit(system, theta=0.5)
    assert orbit.rest_share > 0.2
    chart = stability_chart(system, horizontal=[0.24], vertical=[-0.8], starts=4)
    assert not chart["rest"].any()
    assert (int(chart["count"][0, 0]), int(chart["period"][0, 0])) == (1, 1)
    assert float(chart["amplitude"][0, 0]) == pytest.approx(orbit.amplitude, rel=1e-8)


def test_smaller_motions_than_asked_for_do_not_count():
    options = {"horizontal": [0.06, 0.07, 0.08], "vertical": [-0.5]}
    all_, large = (stability_chart(forced(1.0), **options, least=least) for least in (1e-3, 0.03))
    sizes = all_["motion_amplitude"].values
    assert (large["count"].values == (sizes >= 0.03).sum(axis=2)).all()
    assert (all_["count"].values > large["count"].values).any()  # motions with 6 impacts
    assert (large["tiny"].values[all_["count"].values > large["count"].values] > 0).any()
    np.testing.assert_allclose(all_["smallest_amplitude"].values, np.nanmin(sizes, axis=2))
    np.testing.assert_allclose(all_["amplitude"].values, np.nanmax(sizes, axis=2))


def test_chaos_is_not_a_motion_that_counts():
    # the exponent is +0.03 there (issue 5)
    here = stability_chart(forced(1.0, W=0.38), horizontal=[0.2], vertical=[-0.5])
    assert here["unsettled"].values[0, 0] > 0
    assert not monostable(here).values.any()
    assert not here["rest"].values.any()


def test_chunks_stores_and_threads_change_nothing(tmp_path):
    options = {"horizontal": [0.03, 0.06, 0.2], "vertical": [-0.8, -0.5], "starts": 6}
    one = stability_chart(forced(1.0), **options)
    two = stability_chart(forced(1.0), **options, rows=1, store=tmp_path / "chart")
    for name in one.data_vars:
        xr.testing.assert_equal(one[name], two[name].load())
    assert two.attrs["system"] == one.attrs["system"] == forced(1.0).to_json()
    assert one.attrs["least"] == 1e-3
    assert one.attrs["path"] == [H, V]
    assert {variable.attrs["units"] for variable in one.data_vars.values()} == {"rad", "1"}


def test_any_two_parameters_make_a_plane():
    here = stability_chart(
        forced(H=0.03),
        horizontal=[0.05, 0.1, 0.2],
        vertical=[1.0, 1.2],
        paths=("model.damping", "load.frequency"),
        starts=8,
    )
    known = [find_orbit(forced(H=0.03).with_({"model.damping": 0.05}), theta=0.3).amplitude]
    assert here["amplitude"].values[0, 0] == pytest.approx(known[0], rel=1e-6)
    assert here["count"].values[0].tolist() == [1, 1, 0]


def test_limits_of_the_mechanism():
    here = stability_chart(forced(1.0), horizontal=[0.1], vertical=[-2.0, -0.5], starts=8)
    straight = np.pi - np.deg2rad(80)
    assert here["amplitude"].values[0, 0] > straight
    assert here["beyond_line"].values[:, 0].tolist() == [True, False]
    assert not here["beyond_kinematic"].values.any()
    far = np.array([np.nan, 1.8, 3.4, 3.5])
    assert beyond_limits(forced(1.0), {H: np.arange(4.0)}, far)["beyond_kinematic"].tolist() == [
        False,
        False,
        False,
        True,
    ]
    flags = beyond_limits(forced(1.0), {"model.beta0": np.deg2rad([80.0, 80.0, 60.0, 90.0])}, far)
    assert flags["beyond_line"].tolist() == [False, True, True, True]


def some(*rows):
    """Motions from (cell, period, impact_count, amplitude, other)."""
    return np.array(
        [(cell, 1, *row, 0.0, (0.0, float(i))) for i, (cell, *row) in enumerate(rows)],
        dtype=motion_type(2),
    )


def test_a_motion_and_its_mirror_image_are_one():
    found = distinct(
        some(
            (1, 1, 2, 0.5, 0.4),
            (0, 1, 2, 0.5, 0.4),
            (1, 1, 2, 0.5 + 1e-6, 0.4),
            (1, 1, 2, 0.5, 0.3),
            (1, 2, 4, 0.5, 0.4),
        )
    )
    assert found["cell"].tolist() == [0, 1, 1, 1]
    assert sorted(found["other"][1:]) == pytest.approx([0.3, 0.4, 0.4], abs=1e-5)
    assert sorted(found["period"][1:]) == [1, 1, 2]


def test_seeds_are_what_the_neighbours_have_and_the_cell_has_not():
    known = distinct(some((0, 1, 2, 0.5, 0.5), (1, 1, 2, 0.49, 0.49), (1, 1, 6, 0.1, 0.1)))
    cell, states = seeds(forced(), known, known, (2, 2))
    # the six impacts to the left and up, both motions up
    assert sorted(cell.tolist()) == [0, 2, 3, 3]
    assert sorted(states[:, 1].tolist()) == [0.0, 1.0, 2.0, 2.0]
    assert has_alike(known, np.array([0, 0, 1]), known[[1, 2, 2]], 0.1).tolist() == [
        True,
        False,
        True,
    ]


def test_a_seed_heads_on_in_a_straight_line_from_two_cells():
    known = distinct(some((0, 1, 2, 0.50, 0.5), (1, 1, 2, 0.51, 0.5)))
    known["state"] = [[0.30, 0.10], [0.32, 0.07]]
    cell, states = seeds(forced(), known, known, (1, 3))
    assert cell.tolist() == [2]
    np.testing.assert_allclose(states, [[0.34, 0.04]])
    known["state"][0] = [-0.3, 0.1]  # at another phase of several periods: no line to go on
    np.testing.assert_allclose(seeds(forced(), known, known, (1, 3))[1], [[0.32, 0.07]])


def test_a_seed_that_heads_beyond_a_stop_is_reflected_there():
    """Between stops at -1 and 1: from 0.90 and 0.98 to 1.06, which is 0.94."""
    known = distinct(some((0, 1, 2, 0.90, 0.5), (1, 1, 2, 0.98, 0.5)))
    known["state"] = [[0.90, 0.10], [0.98, 0.07]]
    stops = System(model=TwoStops(stiffness=0.0), load=Load(frequency=1.0))
    np.testing.assert_allclose(seeds(stops, known, known, (1, 3))[1], [[0.94, 0.04]])


def test_motions_that_come_together_go_on_as_one_that_stands_for_all():
    moving = np.zeros(5, motion_type(2))
    moving["cell"], moving["starts"], moving["amplitude"] = [3, 1, 3, 3, 1], [1, 2, 3, 4, 5], 0.5
    moving["state"] = [[0.5, 0.0], [0.5, 0.0], [0.5002, 0.0], [0.5004, 0.0], [0.6, 0.0]]
    left = joined(forced(), moving)
    assert left["cell"].tolist() == [1, 1, 3]
    assert left["starts"].tolist() == [2, 5, 8]
    moving["amplitude"] = 1e-3  # for small motions that is far
    assert len(joined(forced(), moving)) == 5


def test_starts_fill_the_window_and_what_is_close_to_the_contact():
    states = starts(forced(1.0), 12, check_window(((-2.0, 2.0), (-1.0, 1.0)), forced(1.0)), 3)
    assert (np.abs(states) <= [2.0, 1.0]).all()
    assert np.abs(states[::2, 0]).max() > 1.0
    assert np.abs(states[-1]).max() <= 0.02


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"horizontal": [0.2, 0.1]}, "horizontal must be numbers that rise"),
        ({"vertical": []}, "vertical must be numbers that rise"),
        ({"vertical": "many"}, "vertical must be numbers that rise"),
        ({"paths": (H, H)}, "two parameters"),
        ({"paths": (H, "load.vertikal")}, "vertikal"),
        ({"max_period": 17}, r"lie in \[1, 16\]"),
        ({"starts": 0}, "starts"),
        ({"least": 0.0}, "least"),
        ({"tol": 1e-3}, "tol"),
        ({"rows": 0}, "rows"),
        ({"periods": 0}, "periods"),
        ({"seed": -1}, "seed"),
        ({"window": (1.0, -1.0)}, "window"),
        ({"paths": ("model.beta0", V), "horizontal": [1.0, 4.0]}, "beta0"),
    ],
)
def test_what_has_no_meaning_is_refused(change, words):
    with pytest.raises(ParameterError, match=words):
        stability_chart(forced(1.0), **({"horizontal": [0.1], "vertical": [-0.5]} | change))


def test_systems_without_a_chart_are_refused():
    with pytest.raises(ParameterError, match="takes a System"):
        stability_chart("saltus")
    still = type(forced(1.0))(model=forced(1.0).model, load=Load(horizontal=0.1, vertical=-0.5))
    with pytest.raises(ParameterError, match="frequency"):
        stability_chart(still)


class Unregistered(TwoStops):
    """Two stops under a name that no other process knows."""


def test_a_model_of_ones_own_is_registered_before_its_chart_is_computed(capfd):
    """Its chunks failed one by one, twice each."""
    load = Load(frequency=1.0, force=Harmonic(0.5))
    system = System(model=Unregistered(), load=load)
    with pytest.raises(ParameterError, match=r"'Unregistered' is not known.*saltus\.register"):
        stability_chart(
            system,
            horizontal=[0.8, 1.0],
            vertical=[0.4, 0.5],
            paths=("load.frequency", "load.force.amplitude"),
        )
    assert capfd.readouterr().err == ""
