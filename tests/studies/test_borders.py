"""The exact borders of stability charts: curves of folds, doublings and symmetry breakings that chart and theory agree with."""

import functools

import numpy as np
import pytest
import xarray as xr
from study_cases import forced

from saltus.orbits import continue_orbit, continue_special, find_orbit
from saltus.studies.borders import Borders, curve_dataset, disagreements, exact_borders, lost
from saltus.studies.chart import stability_chart
from saltus.studies.chart_ends import ends_of, explained, read
from saltus.theory import high_frequency_onset, unloaded_fold

H, V = "load.horizontal.amplitude", "load.vertical"


@functools.cache
def chart():
    """A coarse chart about the corner where the onset meets the fold of deformed equilibria."""
    return stability_chart(forced(), horizontal=np.linspace(0, 0.12, 9), vertical=np.linspace(-1.5, -0.5, 9), rows=9)


@functools.cache
def borders():
    return exact_borders(forced(), chart(), most=8)


def at(curve, vertical):
    """The horizontal load on a curve at a vertical one."""
    order = np.argsort(curve["vertical"].values)
    return float(np.interp(vertical, curve["vertical"].values[order], curve["horizontal"].values[order]))


def of(kind, crossings, curves):
    found = [c for c in curves if c.attrs["kind"] == kind and c.attrs["crossings"] == crossings and c.attrs["periods"] == 1]
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
    others = Borders([curve for curve in borders().curves if curve is not onset], borders().ends)
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
    onset = of("LP", 2, exact_borders(system, here, most=1).curves)
    for horizontal, vertical in zip(onset["horizontal"].values, onset["vertical"].values, strict=True):
        closed = high_frequency_onset(W, beta0=np.deg2rad(80), vertical=float(vertical), damping=0.1, order=2)
        assert horizontal == pytest.approx(closed, rel=3 * W**-4)


def test_borders_are_kept_whole(tmp_path):
    again = Borders.from_xarray(borders().to_xarray())
    assert again.ends == borders().ends
    for one, two in zip(borders().curves, again.curves, strict=True):
        xr.testing.assert_identical(one, two)
    assert disagreements(chart(), again).identical(disagreements(chart(), borders()))


def onset_branch():
    """The branch through the onset, from its stable end at Hhat = 0.04."""
    return continue_orbit(find_orbit(forced(H=0.04), theta=0.3), H, (0.0215, 0.04))


def test_the_point_where_stability_is_lost_is_found_from_its_stable_end():
    branch = continue_orbit(find_orbit(forced(H=0.2), theta=0.3), H, (0.06, 0.2))
    assert "no loss" in lost(branch)  # stable from bound to bound
    assert "no loss" in lost(branch, backwards=True)
    special = lost(onset_branch(), backwards=True)
    assert special.kind == "LP"
    assert special.parameter == pytest.approx(0.0219879514, abs=1e-10)
    assert lost(onset_branch()) == "the orbit is not stable to its multipliers"


def test_a_curve_explains_only_what_ends_on_it():
    cells = read(chart())
    ends = ends_of(cells)
    onset = of("LP", 2, borders().curves)
    known = explained(cells, ends, [onset])
    assert known.any()
    assert not known.all()
    other = onset.copy()
    other.attrs = {**onset.attrs, "periods": 5}
    assert not explained(cells, ends, [other]).any()
    far = onset.assign(amplitude=onset["amplitude"] * 10)
    assert not explained(cells, ends, [far]).any()


def test_a_curve_is_told_in_the_order_of_the_charts_axes():
    locus = continue_special(lost(onset_branch(), backwards=True), V, bounds=(-0.6, -0.4), first_bounds=(0.02, 0.04))
    told = curve_dataset(locus, [H, V])
    turned = curve_dataset(locus, [V, H])
    np.testing.assert_array_equal(told["vertical"], turned["horizontal"])
    assert told["vertical"].values.max() < 0 < told["horizontal"].values.min()
