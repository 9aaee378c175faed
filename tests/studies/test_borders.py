"""The exact borders of stability charts: curves of folds, doublings and symmetry breakings that
chart and theory agree with.
"""

import functools
import importlib.util

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced

import saltus
from saltus import stability_chart
from saltus.errors import ParameterError
from saltus.orbits import continue_orbit, continue_special, find_orbit, follow_stable
from saltus.studies import Borders, bordered_chart, disagreements, with_borders, wrong_cells
from saltus.studies.chart.border_work import curve_dataset, explained, stability_loss
from saltus.studies.chart.changes import ChangeOutcome, Ways, changes_of, keys_of, read_chart, trace
from saltus.studies.chart.chart_study import sampled_ends
from saltus.studies.chart.motions import motion_type
from saltus.systems import System, VelocityReduction
from saltus.theory import high_frequency_onset, unloaded_fold

H, V = "load.horizontal.amplitude", "load.vertical"


@functools.cache
def chart():
    """A coarse chart about the corner where the onset meets the fold of deformed equilibria."""
    return stability_chart(
        forced(1.0), horizontal=np.linspace(0, 0.12, 9), vertical=np.linspace(-1.5, -0.5, 9), rows=9
    )


@functools.cache
def completed():
    return with_borders(forced(1.0), chart(), curves=8)


def borders():
    return completed()[1]


def at(curve, vertical):
    """The horizontal load on a curve at a vertical one."""
    order = np.argsort(curve["vertical"].values)
    return float(
        np.interp(vertical, curve["vertical"].values[order], curve["horizontal"].values[order])
    )


def of(kind, crossings, curves):
    found = [
        c
        for c in curves
        if c.attrs["kind"] == kind
        and c.attrs["impact_count"] == crossings
        and c.attrs["period"] == 1
    ]
    assert found
    return found[0]


def test_the_onset_is_the_known_fold():
    onset = of("LP", 2, borders().curves)
    # issue 5, between two points of the curve
    assert at(onset, -0.5) == pytest.approx(0.0219879514, rel=1e-4)
    assert onset["residual"].values.max() < 1e-9


def test_the_other_border_starts_at_the_fold_of_deformed_equilibria():
    fold = of("LP", 0, borders().curves)
    first = int(np.argmin(fold["horizontal"].values))
    vertical, theta = unloaded_fold(np.deg2rad(80))
    assert fold["horizontal"].values[first] == pytest.approx(0.0, abs=1e-12)
    assert fold["vertical"].values[first] == pytest.approx(vertical, abs=1e-9)
    assert fold["amplitude"].values[first] == pytest.approx(theta, abs=1e-6)


def test_chart_and_curves_agree():
    whole, found = completed()
    left = disagreements(whole, found)
    assert left.attrs["changes"] > 20
    assert left.sizes["change"] == 0
    # all were looked into
    assert left.attrs["located"] + left.attrs["harmless"] == left.attrs["changes"]


def test_what_nothing_explains_is_a_disagreement():
    """Without what simulation knows of the changes, those at the onset are explained by its curve,
    and by nothing without it.
    """
    whole, found = completed()
    onset = of("LP", 2, found.curves)
    with_it, without = (
        disagreements(whole, Borders(curves))
        for curves in ([onset], [c for c in found.curves if c is not onset])
    )
    assert without.sizes["change"] > 5
    near = [
        abs(float(x) - at(onset, float(y)))
        for x, y in zip(without["horizontal"], without["vertical"], strict=True)
    ]
    assert min(near) < float(chart()["horizontal"][1])
    assert with_it.attrs["on_curves"] > 5
    assert with_it.sizes["change"] == with_it.attrs["changes"] - with_it.attrs["on_curves"]


def test_a_motion_that_the_chart_lacks_is_a_disagreement():
    wrong = completed()[0].copy(deep=True)
    place = {"vertical": 7, "horizontal": 5}
    for name in wrong.data_vars:
        if name.startswith("motion_") and wrong[name].dtype.kind == "f":
            wrong[name][place] = np.nan
    wrong["count"][place] = 0
    left = disagreements(wrong, borders())
    assert left.sizes["change"] >= 4  # seen from every side
    assert abs(left["vertical"] - wrong["vertical"][7]).max() < 0.13
    # and a curve through cells without any motion is one too
    empty = wrong.copy(deep=True)
    empty["motion_amplitude"][:] = np.nan
    empty["count"][:] = 0
    unseen = disagreements(empty, borders())
    assert unseen.sizes["change"] == 0
    assert unseen.sizes["unseen"] > 5


@pytest.mark.parametrize("W", [4.0, 6.0])
def test_the_onset_at_high_frequency_is_the_closed_form(W):
    system = forced(H=0.02, W=W)
    here = stability_chart(
        system, horizontal=[0.0005, 0.02], vertical=[-0.6, -0.5, -0.4], starts=6, least=1e-4
    )
    onset = of("LP", 2, with_borders(system, here, curves=1)[1].curves)
    for horizontal, vertical in zip(
        onset["horizontal"].values, onset["vertical"].values, strict=True
    ):
        closed = high_frequency_onset(
            W, beta0=np.deg2rad(80), vertical=float(vertical), damping=0.1, order=2
        )
        assert horizontal == pytest.approx(closed, rel=3 * W**-4)


def test_borders_are_kept_as_they_are():
    whole, found = completed()
    cells = read_chart(whole)
    tree = found.to_xarray(cells)
    kept = tree["ends"].to_dataset()
    assert [tuple(key) for key in kept["key"].values] == keys_of(cells, changes_of(cells))
    meanings = dict(
        zip(
            kept["outcome"].attrs["flag_values"],
            kept["outcome"].attrs["flag_meanings"].split(),
            strict=True,
        )
    )
    for key, outcome in zip(kept["key"].values, kept["outcome"].values, strict=True):
        assert (
            meanings[int(outcome)]
            == ChangeOutcome(int(found.endings[tuple(key)]["outcome"])).name.lower()
        )
    for i, curve in enumerate(found.curves):
        xr.testing.assert_identical(tree[f"curve_{i:02d}"].to_dataset(), curve)


def towards_the_onset():
    """The stable branch from Hhat = 0.04 down through the onset."""
    return follow_stable(find_orbit(forced(H=0.04), theta=0.3), H, 0.0215)


def test_the_point_where_stability_is_lost_is_found_from_its_stable_end():
    orbit = find_orbit(forced(H=0.2), theta=0.3)
    for target in (0.06, 0.25):
        branch = follow_stable(orbit, H, target)
        assert branch.points[-1].parameter == target
        assert "no loss" in stability_loss(branch)
    special = stability_loss(towards_the_onset())
    assert special.kind == "LP"
    assert special.parameter == pytest.approx(0.0219879514, abs=1e-10)
    unstable = towards_the_onset().points[-1].orbit
    assert (
        stability_loss(follow_stable(unstable, H, 0.023))
        == "the orbit is not stable to its multipliers"
    )


def test_the_stable_part_of_a_branch_is_that_of_the_whole_one():
    """Its last point but one is stable; no special point of the whole branch lies before the one
    that it ends at.
    """
    part = towards_the_onset()
    whole = continue_orbit(find_orbit(forced(H=0.04), theta=0.3), H, (0.0215, 0.04))
    assert not part.points[-1].orbit.stable
    assert all(point.orbit.stable for point in part.points[:-2])
    assert [s.kind for s in part.special] == ["LP"]
    assert part.special[0].parameter == pytest.approx(
        next(s.parameter for s in whole.special if s.kind == "LP"), rel=1e-12
    )


def test_the_ends_that_simulation_finds_are_those_of_continuation():
    """Every end is enclosed between its two cells; a sample of them, solved for as orbits, lies in
    the enclosures.
    """
    whole, found = completed()
    cells = read_chart(whole)
    ends = found.to_xarray(cells)["ends"].to_dataset()
    located = np.isfinite(ends["horizontal"].values)
    assert located.sum() > 20
    onset, near = of("LP", 2, found.curves), 0
    for i in np.flatnonzero(located):
        row, column, _, to_row, to_column = ends["key"].values[i]
        place = [float(ends[name][i]) for name in ("horizontal", "vertical")]
        for value, axis, ends_at in zip(
            place,
            (cells.horizontal, cells.vertical),
            ((column, to_column), (row, to_row)),
            strict=True,
        ):
            low, high = sorted(axis[list(ends_at)])
            assert low - 1e-12 <= value <= high + 1e-12
        if (
            row == to_row
            and place[1] > -1.1
            and float(ends["amplitude"][i]) > 0.15
            and place[0] < 0.05
        ):
            near += 1
            off = (float(ends["uncertainty"][i]) + 0.02) * float(cells.horizontal[1])
            assert place[0] == pytest.approx(at(onset, place[1]), abs=off)
    assert near >= 3
    sample = sampled_ends(forced(1.0), (H, V), cells, found)
    assert np.isfinite(sample).sum() > 20
    assert np.nanmean(sample) > 0.95


def test_what_continuation_adds_to_a_chart_are_motions_that_repeat():
    """A chart that has lost some of its motions gets them back, in order, from those of their
    neighbours.
    """
    poor, inside = chart().copy(deep=True), (chart()["count"] > 0).values
    inside[:, :5], inside[:, 6:] = False, False  # one column of cells
    for name in poor.data_vars:
        if name.startswith("motion_"):
            poor[name].values[inside] = np.nan if poor[name].dtype.kind == "f" else 0
    poor["count"].values[inside] = 0
    whole, _ = with_borders(forced(1.0), poor, curves=0)
    assert whole.attrs["added_by_continuation"] >= inside.sum()
    both = (whole["count"].values > 0) & (chart()["count"].values > 0)
    assert both[inside].mean() > 0.8
    np.testing.assert_allclose(
        whole["amplitude"].values[both], chart()["amplitude"].values[both], rtol=1e-4
    )
    sizes = whole["motion_amplitude"].values
    assert (np.diff(np.where(np.isfinite(sizes), sizes, -1.0), axis=2) <= 0).all()
    np.testing.assert_array_equal(np.isfinite(sizes).sum(axis=2), whole["count"].values)
    for row, column in np.argwhere(inside & (whole["count"].values > 0)):
        cell = whole.isel(vertical=row, horizontal=column)
        system = forced(1.0).with_({H: float(cell["horizontal"]), V: float(cell["vertical"])})
        for i in range(int(cell["count"])):
            theta, velocity = (float(cell[f"motion_{name}"][i]) for name in ("theta", "velocity"))
            end = saltus.simulate(
                system,
                theta=theta,
                velocity=velocity,
                periods=int(cell["motion_period"][i]),
                dense=False,
            )
            assert end.theta == pytest.approx(theta, abs=1e-7)


def way(horizontal, goal):
    """The way of the motion at V = -0.5 from one horizontal load to another."""
    orbit = follow_stable(find_orbit(forced(H=0.04), theta=0.3), H, horizontal).points[-1].orbit
    motion = np.zeros(1, motion_type(2))
    motion["state"], motion["period"], motion["impact_count"] = orbit.state, 1, 2
    motion["amplitude"] = motion["other"] = orbit.amplitude
    start, end = ({H: np.array([value]), V: np.array([-0.5])} for value in (horizontal, goal))
    return Ways(forced(1.0), start, end, motion, periods=240, max_period=6, tol=1e-10)


def test_the_end_of_a_motion_is_enclosed_about_the_fold():
    (found,) = trace(way(0.03, 0.02), 1e-3)
    assert ChangeOutcome(found["outcome"]) is ChangeOutcome.JUMP
    low, high = (0.03 - 0.01 * share for share in (found["next"]["share"], found["settled"]))
    assert low <= 0.0219879514 <= high  # issue 5
    assert high - low < 0.01 / 8


def test_a_motion_that_goes_on_is_told_with_its_state():
    (found,) = trace(way(0.06, 0.09), 1e-3)
    # whether the neighbour has it is not for simulation to say
    assert ChangeOutcome(found["outcome"]) is ChangeOutcome.MISSED
    theta, velocity = found["last"]["state"]
    orbit = find_orbit(forced(H=0.09), theta=theta, velocity=velocity, settle=0)
    assert orbit.stable
    assert orbit.amplitude == pytest.approx(found["last"]["amplitude"], rel=1e-7)


def test_a_motion_that_more_than_doubles_between_two_cells_is_followed_to_its_end_by_short_steps():
    """At Omega = 0.75, from V = -0.32 to -0.30: continuation of the orbit says where it goes."""
    here = forced(0.075, 0.75).with_({V: -0.32})
    orbit = find_orbit(here, theta=-0.00157792, velocity=0.04253646)
    there = follow_stable(orbit, V, -0.30).points[-1]
    assert there.parameter == -0.30
    assert there.orbit.amplitude > 2 * orbit.amplitude
    motion = np.zeros(1, motion_type(2))
    motion["state"], motion["period"], motion["impact_count"] = orbit.state, 1, 2
    motion["amplitude"] = motion["other"] = orbit.amplitude
    start, end = ({H: np.array([0.075]), V: np.array([value])} for value in (-0.32, -0.30))
    (found,) = trace(Ways(here, start, end, motion, periods=180, max_period=6, tol=1e-10), 1e-3)
    assert ChangeOutcome(found["outcome"]) is ChangeOutcome.MISSED
    assert found["last"]["amplitude"] == pytest.approx(there.orbit.amplitude, rel=1e-6)


def test_a_motion_that_goes_on_into_a_cell_that_has_it_changes_nothing():
    whole, found = completed()
    kinds = {ChangeOutcome(int(ending["outcome"])) for ending in found.endings.values()}
    assert ChangeOutcome.MISSED not in {
        ChangeOutcome(int(outcome))
        for outcome in found.to_xarray(read_chart(whole))["ends"]["outcome"].values
    }
    assert kinds >= {ChangeOutcome.JUMP}


def test_a_curve_explains_only_what_ends_on_it():
    cells = read_chart(chart())
    changes = changes_of(cells)
    onset = of("LP", 2, borders().curves)
    known = explained(cells, changes, [onset])
    assert known.any()
    assert not known.all()
    other = onset.copy()
    other.attrs = {**onset.attrs, "period": 5}
    assert not explained(cells, changes, [other]).any()
    far = onset.assign(amplitude=onset["amplitude"] * 10)
    assert not explained(cells, changes, [far]).any()


def test_a_curve_is_told_in_the_order_of_the_charts_axes():
    locus = continue_special(
        stability_loss(towards_the_onset()), V, bounds=(-0.6, -0.4), first_bounds=(0.02, 0.04)
    )
    told = curve_dataset(locus, [H, V])
    turned = curve_dataset(locus, [V, H])
    np.testing.assert_array_equal(told["vertical"], turned["horizontal"])
    assert told["vertical"].values.max() < 0 < told["horizontal"].values.min()


def test_a_chart_is_read_in_any_order_of_its_dimensions():
    turned = chart().transpose("motion", "horizontal", "vertical")
    one, other = read_chart(chart()), read_chart(turned)
    for name in ("motions", "family", "monostable"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert (
        disagreements(turned, borders()).sizes["change"]
        == disagreements(chart(), borders()).sizes["change"]
    )


def test_a_chart_read_lazily_gets_its_motions_too():
    bare = chart().chunk() if importlib.util.find_spec("dask") else chart()
    whole, _ = with_borders(forced(1.0), bare, curves=0)
    same, _ = with_borders(forced(1.0), chart(), curves=0)
    assert whole.attrs["added_by_continuation"] > 0
    np.testing.assert_array_equal(whole["count"].values, same["count"].values)


@pytest.mark.parametrize("curves", [-1, 2.5])
def test_a_number_of_curves_without_meaning_is_refused(curves):
    with pytest.raises(ParameterError, match="curves must"):
        with_borders(forced(1.0), chart(), curves=curves)


@pytest.mark.parametrize(
    ("changes", "there"),
    [
        ({}, True),
        ({"model.beta0": np.deg2rad(100)}, False),
        ({"model.stiffness_ratio": 2.0}, False),
        ({"load.horizontal.mean": 0.01}, False),
    ],
)
def test_the_quasi_static_border_is_there_only_where_its_closed_form_holds(changes, there):
    tree = bordered_chart(
        forced(1.0).with_(changes),
        curves=0,
        horizontal=[0.001, 0.002],
        vertical=[-0.3, -0.2],
        starts=1,
        periods=3,
    )
    assert ("static" in tree.children) is there
    assert {"chart", "borders", "disagreements"} <= set(tree.children)


@pytest.mark.thorough
def test_motions_that_rest_in_each_period_are_followed_too():
    """Impacts with loss: the motions are held for a part of each period, and end all the same."""
    system = System(model=forced(1.0).model, load=forced(1.0).load, impact=VelocityReduction(0.6))
    here = stability_chart(
        system, horizontal=np.linspace(0.02, 0.5, 9), vertical=[-0.4, -0.2], starts=6
    )
    whole, found = with_borders(system, here, curves=0)
    left = disagreements(whole, found)
    assert left.attrs["located"] > 2
    assert left.sizes["change"] <= 0.2 * left.attrs["changes"]


def test_borders_that_were_interrupted_go_on_to_the_same_bytes(tmp_path):
    """The work on borders is in the chart's store: what is there is not computed again, and what is
    lost is.
    """
    options = {
        "horizontal": np.linspace(0, 0.06, 5),
        "vertical": np.linspace(-0.9, -0.5, 3),
        "starts": 6,
        "curves": 2,
    }
    whole = bordered_chart(forced(1.0), **options, store=tmp_path / "chart.zarr")
    files = sorted((tmp_path / "chart.zarr" / "parts").iterdir())
    assert {file.name.split("_")[0] for file in files} == {"ends", "curves"}
    kept = {file: file.read_bytes() for file in files}
    for file in files[::2]:
        file.unlink()
    untouched = {file: file.stat().st_mtime_ns for file in files[1::2]}
    again = bordered_chart(forced(1.0), **options, store=tmp_path / "chart.zarr")
    assert {file: file.read_bytes() for file in files} == kept
    assert all(file.stat().st_mtime_ns == when for file, when in untouched.items())
    xr.testing.assert_identical(whole["borders"].to_dataset(), again["borders"].to_dataset())
    xr.testing.assert_identical(
        whole["disagreements"].to_dataset(), again["disagreements"].to_dataset()
    )


def test_a_chart_that_has_lost_its_motions_is_wrong_where_there_are_some():
    """By more and other starts on a finer grid: few cells of a whole chart, and of an emptied one
    all that had motions.
    """
    whole = completed()[0]
    good = wrong_cells(forced(1.0), whole, cells=30)
    assert good["checked_cells"] == 30
    assert good["wrong_rest"] == 0
    assert good["wrong_share"] <= 0.1
    assert good["wrong_share_low"] <= good["wrong_share"] < good["wrong_share_high"] < 1.0
    empty = whole.copy(deep=True)
    empty["motion_amplitude"][:] = np.nan
    empty["count"][:] = empty["outcome"][:] = 0
    bad = wrong_cells(forced(1.0), empty, cells=81)
    filled = int((whole["outcome"] != 0).sum())
    assert filled <= bad["wrong_rest"] == bad["wrong_cells"] <= filled + 5
    assert filled > 40
    assert bad["wrong_motions"] >= filled - 2


def test_one_lost_motion_makes_one_wrong_cell():
    whole = completed()[0].copy(deep=True)
    row, column = np.argwhere((whole["count"] == 1).values & (whole["amplitude"] > 0.1).values)[0]
    before = wrong_cells(forced(1.0), whole, cells=81)
    whole["motion_amplitude"][row, column] = np.nan
    after = wrong_cells(forced(1.0), whole, cells=81)
    assert after["wrong_motions"] == before["wrong_motions"] + 1
    assert after["wrong_rest"] == before["wrong_rest"]
