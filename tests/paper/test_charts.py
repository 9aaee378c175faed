"""Figs. 14 and 15 from coarse charts: their data say what they are, their claims follow from them, their pictures are whole."""

import functools

import numpy as np
import pytest
import xarray as xr
from claim_verdicts import claims_of, verdicts
from picture_checks import check_provenance, clipped

from saltus.files import write_dataset
from saltus.paper import FIGURES, ClaimVerdict
from saltus.paper.figures.harmonic_loads import under_force
from saltus.paper.measures import chart_areas, chart_measures
from saltus.plots.chart import draw_stability_chart
from saltus.theory import high_frequency_onset, is_monostable, quasi_static_border, unloaded_fold

QUICK = {
    "d": {"beta0": 80.0, "damping": 0.1, "frequency": 1.0, "widest": 0.1},
    "f": {"beta0": 80.0, "damping": 0.1, "frequency": 4.0, "widest": 0.2},
}


@functools.cache
def data():
    return FIGURES["fig14"].compute(panels=QUICK, size=9, curves=3, starts=6)


@pytest.mark.thorough
def test_the_data_say_what_they_are_and_claims_follow_from_disk_too(tmp_path):
    figure = FIGURES["fig14"]
    check_provenance("fig14", data())
    claims = figure.claims(data())
    assert len({claim.id for claim in claims}) == len(claims) == 7
    write_dataset(tmp_path / "fig14.nc", data())
    with xr.open_datatree(tmp_path / "fig14.nc", engine="h5netcdf") as tree:
        stored = tree.load()
    assert figure.claims(stored) == claims
    assert clipped(figure.draw(stored)) == []


def test_claims_that_a_coarse_chart_bears_hold():
    verdicts = {claim.id: claim.verdict for claim in FIGURES["fig14"].claims(data())}
    for name in ("anticipates", "frequency", "onset"):
        assert verdicts[f"fig14-{name}"] is ClaimVerdict.AS_PRINTED
    assert verdicts["fig14-closed-form"] is ClaimVerdict.CORRECTED


def test_claims_fail_where_the_data_do_not_bear_them():
    wrong = data().copy(deep=True)
    for panel in wrong.children.values():
        panel["chart"]["count"] = panel["chart"]["count"] * 0
        panel["chart"]["unsettled"] = panel["chart"]["unsettled"] * 0
    verdicts = {claim.id: claim.verdict for claim in FIGURES["fig14"].claims(wrong)}
    for name in ("anticipates", "frequency", "second"):
        assert verdicts[f"fig14-{name}"] is ClaimVerdict.DISAGREES


def test_the_static_border_is_that_of_the_equilibria():
    for beta0 in (80.0, 60.0):
        system = under_force(beta0=beta0)
        border = quasi_static_border(system, ("load.horizontal.amplitude", "load.vertical"), -2.0).to_xarray()
        vertical, true = border["vertical"].values, border["true"].values
        assert (true[vertical <= unloaded_fold(np.deg2rad(beta0))[0]] == 0.0).all()
        inside = (true > 1e-3) & (vertical < 0)
        assert is_monostable(np.deg2rad(beta0), true[inside] * 0.999, vertical[inside]).all()
        assert not is_monostable(np.deg2rad(beta0), true[inside] * 1.001, vertical[inside]).any()


def test_shares_lost_are_shares_of_cells():
    panel = data()["f"]
    here = chart_areas.chart_cells(panel)
    by_hand = [
        (int(panel["chart"]["count"].sel(vertical=v, horizontal=h)) > 0)
        for v in here.vertical
        for h in here.horizontal
        if is_monostable(np.deg2rad(80), h, v)
    ]
    assert chart_areas.lost(panel) == pytest.approx(np.mean(by_hand))
    assert here.vertical.max() < 0 < here.horizontal.min()


def test_the_onset_read_from_curves_is_the_closed_form_and_so_is_the_share():
    panel, rows = data()["f"], np.linspace(-1.3, -0.3, 7)
    closed = [high_frequency_onset(4.0, beta0=np.deg2rad(80), vertical=float(v), damping=0.1, order=2) for v in rows]
    np.testing.assert_allclose(chart_areas.onset(panel, rows), closed, rtol=0.02)
    share = chart_areas.lost_by_curves(panel)
    assert 0.93 < share < 1.0  # the onset is C pi^3 / (24 Omega) = 3.2 % of Hcr
    assert np.isnan(chart_areas.onset(panel, np.array([-3.0]))).all()


@pytest.mark.thorough
def test_statements_on_parameters_compare_charts_of_the_same_cells():
    reference = QUICK["d"] | {"widest": 0.04}
    quick = {"a": reference | {"beta0": 60.0}, "b": reference | {"damping": 0.05}, "reference": reference}
    made = FIGURES["fig15"].compute(panels=quick, size=9, curves=2, starts=4)
    claims = claims_of(chart_measures.over_parameters(made))
    assert claims["fig15-damping-domain"].verdict is ClaimVerdict.AS_PRINTED
    assert len(claims) == 5
    picture = FIGURES["fig15"].draw(made)
    assert clipped(picture) == []
    titles = [ax.get_title() for ax in picture.axes]
    assert sum("beta_0" in title for title in titles) == 2  # the reference is not drawn


def test_a_chart_on_its_own_is_drawn_whole():
    chart = data()["d/chart"].to_dataset()
    assert clipped(draw_stability_chart(chart)) == []
    single = chart.isel(vertical=[3])
    assert clipped(draw_stability_chart(single)) == []
    empty = chart.where(chart["horizontal"] < -1).fillna(0).assign(amplitude=chart["amplitude"] * np.nan)
    assert clipped(draw_stability_chart(empty)) == []


@pytest.mark.parametrize(("total", "looked", "agrees"), [(0, 0, False), (50, 0, False), (50, 50, False), (5000, 50, True)])
def test_agreement_is_never_one_on_nothing(total, looked, agrees):
    """No change at all, 50 that nobody has looked into, 50 of 50 without a special point; and 50 of 5000."""
    left = min(total, 50)
    differ = xr.Dataset(
        {"looked_into": ("change", np.arange(left) < looked), "beside_rest": ("change", np.zeros(left, dtype=bool))},
        attrs={"changes": total, "changes_beside_rest": min(total, 9), "on_curves": 0, "chaos_beside_rest": 0, "harmless": 0},
    )
    panel = xr.DataTree.from_dict({"chart": xr.Dataset(), "disagreements": differ})
    panel.attrs["frequency"] = 1.0
    one = chart_measures.agreement(xr.DataTree(children={"a": panel}))
    assert (verdicts({"fig14-agreement": one})["fig14-agreement"] is ClaimVerdict.AS_PRINTED) is agrees
