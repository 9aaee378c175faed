"""The exact borders of stability charts: curves of folds, doublings and symmetry breakings that chart and theory agree with."""

import functools
import importlib.util
import types

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced

import saltus
from saltus.errors import ParameterError
from saltus.orbits import continue_orbit, continue_special, find_orbit, follow_stable
from saltus.studies import Borders, bordered_chart, disagreements, stability_chart, with_borders
from saltus.studies.chart import follow as chart_follow
from saltus.studies.chart.border_curves import curve_dataset, explained
from saltus.studies.chart.borders import first_borders
from saltus.studies.chart.changes import changes_of, keys_of, read_chart
from saltus.studies.chart.follow import ChangeOutcome, Follower, lost
from saltus.systems import System, VelocityReduction
from saltus.theory import high_frequency_onset, unloaded_fold

H, V = "load.horizontal.amplitude", "load.vertical"


@functools.cache
def chart():
    """A coarse chart about the corner where the onset meets the fold of deformed equilibria."""
    return stability_chart(forced(1.0), horizontal=np.linspace(0, 0.12, 9), vertical=np.linspace(-1.5, -0.5, 9), rows=9)


@functools.cache
def borders():
    return first_borders(forced(1.0), chart(), 8).borders


def at(curve, vertical):
    """The horizontal load on a curve at a vertical one."""
    order = np.argsort(curve["vertical"].values)
    return float(np.interp(vertical, curve["vertical"].values[order], curve["horizontal"].values[order]))


def of(kind, crossings, curves):
    found = [c for c in curves if c.attrs["kind"] == kind and c.attrs["impact_count"] == crossings and c.attrs["period"] == 1]
    assert found
    return found[0]


def test_the_onset_is_the_known_fold():
    onset = of("LP", 2, borders().curves)
    assert at(onset, -0.5) == pytest.approx(0.0219879514, rel=1e-4)  # issue 5, between two points of the curve
    assert onset["residual"].values.max() < 1e-9


def test_the_other_border_starts_at_the_fold_of_deformed_equilibria():
    fold = of("LP", 0, borders().curves)
    first = int(np.argmin(fold["horizontal"].values))
    vertical, theta = unloaded_fold(np.deg2rad(80))
    assert fold["horizontal"].values[first] == pytest.approx(0.0, abs=1e-12)
    assert fold["vertical"].values[first] == pytest.approx(vertical, abs=1e-9)
    assert fold["amplitude"].values[first] == pytest.approx(theta, abs=1e-6)


def test_chart_and_curves_agree():
    left = disagreements(chart(), borders())
    assert left.attrs["changes"] > 20
    assert left.sizes["change"] == 0


def test_what_a_missing_curve_explained_is_a_disagreement():
    onset = of("LP", 2, borders().curves)
    others = Borders([curve for curve in borders().curves if curve is not onset], borders().endings)
    left = disagreements(chart(), others)
    step = float(chart()["horizontal"][1])
    assert left.sizes["change"] >= 5
    assert left["beside_rest"].any()
    near = [abs(float(x) - at(onset, float(y))) for x, y in zip(left["horizontal"], left["vertical"], strict=True)]
    assert max(near) < 2 * step


def test_a_motion_that_the_chart_lacks_is_a_disagreement():
    wrong = chart().copy(deep=True)
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
    here = stability_chart(system, horizontal=[0.0005, 0.02], vertical=[-0.6, -0.5, -0.4], starts=6, least=1e-4)
    onset = of("LP", 2, first_borders(system, here, 1).borders.curves)
    for horizontal, vertical in zip(onset["horizontal"].values, onset["vertical"].values, strict=True):
        closed = high_frequency_onset(W, beta0=np.deg2rad(80), vertical=float(vertical), damping=0.1, order=2)
        assert horizontal == pytest.approx(closed, rel=3 * W**-4)


def test_borders_are_kept_as_they_are():
    tree = borders().to_xarray()
    kept = tree["ends"].to_dataset()
    assert [tuple(key) for key in kept["key"].values] == list(borders().endings)
    assert kept["outcome"].values.tolist() == [str(ending.outcome) for ending in borders().endings.values()]
    np.testing.assert_array_equal(kept["amplitude"], [ending.amplitude for ending in borders().endings.values()])
    for i, curve in enumerate(borders().curves):
        xr.testing.assert_identical(tree[f"curve_{i:02d}"].to_dataset(), curve)


def towards_the_onset():
    """The stable branch from Hhat = 0.04 down through the onset."""
    return follow_stable(find_orbit(forced(H=0.04), theta=0.3), H, 0.0215)


def test_the_point_where_stability_is_lost_is_found_from_its_stable_end():
    orbit = find_orbit(forced(H=0.2), theta=0.3)
    for target in (0.06, 0.25):
        branch = follow_stable(orbit, H, target)
        assert branch.points[-1].parameter == target
        assert "no loss" in lost(branch)
    special = lost(towards_the_onset())
    assert special.kind == "LP"
    assert special.parameter == pytest.approx(0.0219879514, abs=1e-10)
    unstable = towards_the_onset().points[-1].orbit
    assert lost(follow_stable(unstable, H, 0.023)) == "the orbit is not stable to its multipliers"


def test_the_stable_part_of_a_branch_is_that_of_the_whole_one():
    """Its last point but one is stable; no special point of the whole branch lies before the one that it ends at."""
    part = towards_the_onset()
    whole = continue_orbit(find_orbit(forced(H=0.04), theta=0.3), H, (0.0215, 0.04))
    assert not part.points[-1].orbit.stable
    assert all(point.orbit.stable for point in part.points[:-2])
    assert [s.kind for s in part.special] == ["LP"]
    assert part.special[0].parameter == pytest.approx(next(s.parameter for s in whole.special if s.kind == "LP"), rel=1e-12)


def test_every_end_without_a_curve_is_a_special_point_between_its_cells():
    """Without any curve: what is known of each change is known from continuation between its two cells alone."""
    whole, alone = with_borders(forced(1.0), chart(), curves=0)
    cells = read_chart(whole)
    assert alone.curves == []
    assert set(alone.endings) == set(keys_of(cells, changes_of(cells)))
    left = disagreements(whole, alone)
    assert left.sizes["change"] == left.attrs["on_curves"] == 0
    onset, found = of("LP", 2, borders().curves), 0
    for (row, column, _, to_row, to_column), ending in alone.endings.items():
        assert ending.outcome.is_explained
        if ending.outcome is ChangeOutcome.SPECIAL_POINT:
            for value, axis, ends_at in ((ending.horizontal, cells.horizontal, (column, to_column)),
                                         (ending.vertical, cells.vertical, (row, to_row))):  # fmt: skip
                low, high = sorted(axis[list(ends_at)])
                assert low <= value <= high
        if ending.special_kind == "LP" and row == to_row and ending.vertical > -1.1 and ending.amplitude > 0.15:
            found += 1
            assert ending.horizontal == pytest.approx(at(onset, ending.vertical), rel=1e-3)
    assert found >= 3


def test_what_continuation_adds_to_a_chart_are_motions_that_repeat():
    """A chart that has lost some of its motions gets them back, in order, from those of their neighbours."""
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
    np.testing.assert_allclose(whole["amplitude"].values[both], chart()["amplitude"].values[both], rtol=1e-4)
    sizes = whole["motion_amplitude"].values
    assert (np.diff(np.where(np.isfinite(sizes), sizes, -1.0), axis=2) <= 0).all()
    np.testing.assert_array_equal(np.isfinite(sizes).sum(axis=2), whole["count"].values)
    for row, column in np.argwhere(inside & (whole["count"].values > 0)):
        cell = whole.isel(vertical=row, horizontal=column)
        system = forced(1.0).with_({H: float(cell["horizontal"]), V: float(cell["vertical"])})
        for i in range(int(cell["count"])):
            theta, velocity = (float(cell[f"motion_{name}"][i]) for name in ("theta", "velocity"))
            end = saltus.simulate(system, theta=theta, velocity=velocity, periods=int(cell["motion_period"][i]), dense=False)
            assert end.theta == pytest.approx(theta, abs=1e-7)


def test_a_motion_that_goes_on_where_the_chart_has_none_is_told():
    cells = read_chart(chart())
    follower = Follower(forced(1.0), (H, V), cells)
    changes = changes_of(cells)
    inside = next(
        i for i, (row, column) in enumerate(cells.place) if cells.horizontal[column] > 0.08 and cells.vertical[row] > -0.9
    )
    target = cells.place[inside] + (0, 1)
    end = type(changes)(np.array([inside]), cells.place[[inside]], target[None])
    assert follower.follow(end)[0].outcome.is_change is False
    without = read_chart(
        chart().assign(motion_amplitude=chart()["motion_amplitude"].where(chart()["horizontal"] < cells.horizontal[target[1]]))
    )
    other = Follower(forced(1.0), (H, V), without)
    motion = cells.motions[inside]
    same = int(np.flatnonzero(without.motions == motion)[0])
    assert other.follow(type(changes)(np.array([same]), end.source, end.target))[0].outcome is ChangeOutcome.MISSED


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
    locus = continue_special(lost(towards_the_onset()), V, bounds=(-0.6, -0.4), first_bounds=(0.02, 0.04))
    told = curve_dataset(locus, [H, V])
    turned = curve_dataset(locus, [V, H])
    np.testing.assert_array_equal(told["vertical"], turned["horizontal"])
    assert told["vertical"].values.max() < 0 < told["horizontal"].values.min()


def test_a_chart_is_read_in_any_order_of_its_dimensions():
    turned = chart().transpose("motion", "horizontal", "vertical")
    one, other = read_chart(chart()), read_chart(turned)
    for name in ("motions", "family", "monostable"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert disagreements(turned, borders()).sizes["change"] == disagreements(chart(), borders()).sizes["change"]


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
        forced(1.0).with_(changes), curves=0, horizontal=[0.001, 0.002], vertical=[-0.3, -0.2], starts=1, periods=3
    )
    assert ("static" in tree.children) is there
    assert {"chart", "borders", "disagreements"} <= set(tree.children)


def test_ends_of_orbits_that_rest_are_special_points_too():
    """Impacts with loss: families end where a rest has no duration left (CH) or a release is only touched (RL)."""
    system = System(model=forced(1.0).model, load=forced(1.0).load, impact=VelocityReduction(0.6))
    here = stability_chart(system, horizontal=np.linspace(0.02, 0.5, 9), vertical=[-0.4, -0.2], starts=6)
    _, found = with_borders(system, here, curves=0)
    assert {"CH", "RL"} & {ending.special_kind for ending in found.endings.values()}
    endings = found.endings.values()
    assert all((ending.outcome is ChangeOutcome.SPECIAL_POINT) == bool(np.isfinite(ending.horizontal)) for ending in endings)


def test_an_unstable_orbit_whose_special_point_was_not_located_is_no_motion(monkeypatch):
    unstable = towards_the_onset().points[-1].orbit
    cells = read_chart(chart())
    changes = changes_of(cells)
    goal = float(
        cells.horizontal[changes.target[0, 1]]
        if changes.source[0, 0] == changes.target[0, 0]
        else cells.vertical[changes.target[0, 0]]
    )

    class Lost:
        points = (types.SimpleNamespace(orbit=unstable, parameter=goal),)
        special, ends, missed = (), ("start", "is no longer stable"), ("LP between",)

    monkeypatch.setattr(chart_follow, "follow_stable", lambda *_: Lost())
    follower = Follower(forced(1.0), (H, V), cells)
    ending, special = follower.follow(changes.only(np.arange(len(changes)) == 0))
    assert special is None
    assert ending.outcome is ChangeOutcome.UNKNOWN
    assert ending.reason == "the orbit is not stable to its multipliers"
    assert follower.missed == []
