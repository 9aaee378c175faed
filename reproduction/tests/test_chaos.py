"""The statements on chaos are judged by bands and exponents alone: made by hand, they decide as
they must.
"""

import numpy as np
import pytest
import xarray as xr
from claim_verdicts import claims_of, verdicts
from spectrum_cases import branch, diagram

from saltus.flow import Ending
from saltus_paper import ClaimVerdict
from saltus_paper.figures.harmonic_loads import under_force
from saltus_paper.measures import chaos_measures


def panel(*spans, wandering=(), bounds=(0.0, 3.0), stable=True, others=()):
    """A diagram with one branch over its whole range, bands at `spans`, and chaos or transients at
    the values `wandering`.
    """
    tree = diagram(branch(bounds, [0.5, 0.6], [stable, stable]), *others, bounds=bounds)
    low, high = (np.array([span[i] for span in spans], float) for i in (0, 1))
    marks = np.full(len(spans), "cascade", dtype="U16")
    columns = {
        "low": low,
        "high": high,
        "exponent": np.full(len(spans), 0.1),
        "low_edge": marks,
        "high_edge": marks,
    }
    tree["bands"] = xr.DataTree(
        xr.Dataset({name: ("band", values) for name, values in columns.items()})
    )
    values = np.linspace(*bounds, 31)
    chaotic = np.array([any(a <= v <= b for a, b in spans) for v in values])
    wanders = chaotic | np.isin(np.round(values, 6), np.round(wandering, 6))
    table = {
        "exponent": np.where(wanders, 0.1, np.nan),
        "error": np.where(wanders, 0.01, np.nan),
        "verdict": np.where(chaotic, Ending.CHAOTIC, Ending.TRANSIENT),
    }
    tree["exponents"] = xr.DataTree(
        xr.Dataset({k: ("value", v) for k, v in table.items()}, {"value": values})
    )
    tree.attrs["system"] = under_force().to_json()
    return tree


def test_what_the_paper_calls_quasi_periodic_is_chaos_by_erratum_22_or_nothing():
    small, large = panel((0.36, 0.39)), panel((1.0, 1.8))
    found = verdicts(chaos_measures.force_spectra({0.2: small, 3.0: large}))
    assert found["fig09-quasi-periodic"] is ClaimVerdict.CORRECTED
    empty = verdicts(chaos_measures.force_spectra({0.2: panel(), 3.0: large}))
    assert empty["fig09-quasi-periodic"] is ClaimVerdict.DISAGREES


@pytest.mark.parametrize(
    ("spans", "verdict"),
    [
        ({"c": [], "e": [(1.0, 1.2)], "f": [(1.0, 1.6)]}, ClaimVerdict.AS_PRINTED),
        ({"c": [], "e": [(1.0, 1.6)], "f": [(1.0, 1.2)]}, ClaimVerdict.DISAGREES),  # it narrows
        # more at a small load
        ({"c": [(1.0, 1.9)], "e": [(1.0, 1.2)], "f": [(1.0, 1.6)]}, ClaimVerdict.DISAGREES),
        ({"c": [], "e": [], "f": [(1.0, 1.6)]}, ClaimVerdict.DISAGREES),
    ],
)
def test_chaos_widens_with_the_load(spans, verdict):
    amplitudes = {"c": 1.0, "e": 2.0, "f": 3.0}
    panels = {load: panel(*spans[name]) for name, load in amplitudes.items()}
    assert verdicts(chaos_measures.force_spectra(panels))["fig09-chaos"] is verdict


@pytest.mark.parametrize(
    ("stable", "verdict"), [(True, ClaimVerdict.AS_PRINTED), (False, ClaimVerdict.DISAGREES)]
)
def test_a_band_is_pierced_by_a_stable_motion_alone(stable, verdict):
    one = chaos_measures.pierced(panel((1.0, 1.5), stable=stable), load=3.0)
    assert verdicts({"fig09-pierced": one}) == {"fig09-pierced": verdict}


def transients(settled=(5, 20, 60), returned=0):
    """How many motions at a high frequency have settled after ever more periods, and how many of
    these wander again.
    """
    columns = {
        "settled": ("horizon", list(settled)),
        "motions": ((), 96),
        "returned": ((), returned),
    }
    return xr.Dataset(columns, {"periods": ("horizon", [500, 2000, 8000])})


@pytest.mark.parametrize(
    ("small", "large", "settled", "there", "transient"),
    [
        (panel(), panel((2.0, 2.5)), transients(), True, False),  # all of it lasts
        (panel(), panel(wandering=(2.0, 2.1)), transients(), False, True),  # none of it lasts
        # hardly any of it lasts
        (panel(), panel((2.0, 2.05), wandering=(2.0, 2.1, 2.2, 2.3)), transients(), True, True),
        # nothing settles
        (panel(), panel(wandering=(2.0, 2.1)), transients((5, 5, 5)), False, False),
        (panel(), panel(wandering=(2.0, 2.1)), transients(returned=1), False, False),
        (panel(wandering=(2.0, 2.1)), panel(wandering=(2.0,)), transients(), False, True),
        (panel(), panel(wandering=(0.4,)), transients(), False, False),  # at low frequency alone
    ],
)
def test_chaos_at_high_frequency_is_there_and_most_of_it_a_transient(
    small, large, settled, there, transient
):
    found = verdicts(chaos_measures.ground_spectra({0.25: small, 0.5: large}, settled))
    assert found["fig10-chaos"] is (ClaimVerdict.AS_PRINTED if there else ClaimVerdict.DISAGREES)
    assert found["fig10-transients"] is (
        ClaimVerdict.HOLDS if transient else ClaimVerdict.DISAGREES
    )


@pytest.mark.parametrize(
    ("frequencies", "first", "verdict"),
    [
        ({"a": 2.0, "b": 4.0}, (1.0, 2.0), ClaimVerdict.AS_PRINTED),
        ({"a": 2.0, "b": 4.0}, (2.0, 1.0), ClaimVerdict.DISAGREES),
        # what does not last begins nowhere
        ({"a": 2.0, "b": 4.0}, (1.0, None), ClaimVerdict.UNDECIDED),
    ],
)
def test_chaos_begins_at_larger_loads_for_larger_frequencies(frequencies, first, verdict):
    spans = [[] if start is None else [(start, start + 0.3)] for start in first]
    panels = {
        frequency: panel(*span) for frequency, span in zip(frequencies.values(), spans, strict=True)
    }
    assert verdicts({"fig12-shift": chaos_measures.shifts(panels)}) == {"fig12-shift": verdict}


@pytest.mark.parametrize(
    ("two", "three", "verdict"),
    [
        ([(1.0, 1.4)], [(1.0, 2.0)], ClaimVerdict.AS_PRINTED),
        # erratum 37, and only at Hhat = 2
        ([(0.8, 0.9), (1.0, 1.4)], [(1.0, 2.0)], ClaimVerdict.CORRECTED),
        ([(0.5, 0.9)], [(1.0, 2.0)], ClaimVerdict.DISAGREES),
    ],
)
def test_erratum_37_chaos_lies_at_the_printed_frequencies_in_every_panel(two, three, verdict):
    panels = {0.2: panel(), 2.0: panel(*two), 3.0: panel(*three)}
    assert verdicts(chaos_measures.force_spectra(panels))["fig09-chaos-range"] is verdict


@pytest.mark.parametrize(
    ("spans", "verdict"),
    [
        ([(1.0, 1.2), (2.0, 2.2)], ClaimVerdict.AS_PRINTED),
        # a narrow window parts no regions
        ([(1.0, 1.1), (1.15, 1.2), (2.0, 2.2)], ClaimVerdict.AS_PRINTED),
        ([(0.2, 0.4), (1.0, 1.2), (2.0, 2.2)], ClaimVerdict.CORRECTED),  # erratum 37
        ([(1.0, 1.2)], ClaimVerdict.DISAGREES),
        ([], ClaimVerdict.DISAGREES),
    ],
)
def test_erratum_37_two_regions_of_chaos_are_two_and_parted_by_stable_motions(spans, verdict):
    assert (
        verdicts(chaos_measures.force_diagrams({1.0: panel(*spans)}))["fig11-two-regions"]
        is verdict
    )


def test_motions_between_two_regions_of_chaos_must_be_large():
    small = panel((1.0, 1.2), (2.0, 2.2), others=[branch([2.5, 3.0], [2.0, 2.0], [1, 1])])
    assert (
        verdicts(chaos_measures.force_diagrams({1.0: small}))["fig11-two-regions"]
        is ClaimVerdict.DISAGREES
    )


@pytest.mark.parametrize(
    ("edges", "verdict"),
    [
        ([("fold", "crisis"), ("unknown", "crisis")] * 2, ClaimVerdict.AS_PRINTED),
        (
            [("fold", "cascade"), ("cascade", "grazing"), ("cascade", "cascade")] * 2,
            ClaimVerdict.DISAGREES,
        ),
        # 3 of 4: two more windows may turn it round
        ([("fold", "crisis"), ("fold", "cascade")], ClaimVerdict.UNDECIDED),
        ([("unknown", "unknown"), ("undecided", "unknown")], ClaimVerdict.UNDECIDED),
    ],
)
def test_chaos_is_a_collision_where_orbits_meet_at_most_edges_about_the_resonance(edges, verdict):
    """The edges of so many bands between Omega = 1 and 2; another band, beyond, does not count."""
    spans = [(low, low + 0.05) for low in np.linspace(1.0, 1.9, len(edges))]
    tree = panel(*spans, (2.5, 2.6))
    lower, upper = (
        ("band", list(kinds)) for kinds in zip(*edges, ("cascade", "cascade"), strict=True)
    )
    tree["bands"] = xr.DataTree(tree["bands"].to_dataset().assign(low_edge=lower, high_edge=upper))
    assert (
        verdicts(chaos_measures.force_spectra({0.2: panel(), 3.0: tree}))["fig09-collision"]
        is verdict
    )


ROUTES = {
    "both": (("cascade", "grazing"), ("grazing", "crisis")),
    "cascades": (("cascade", "crisis"), ("cascade", "fold")),
    "later": (("cascade", "crisis"), ("grazing", "fold")),
}


@pytest.mark.parametrize(
    ("slow", "fast", "verdict"),
    [
        (ROUTES["both"], ROUTES["both"], ClaimVerdict.AS_PRINTED),
        # no grazing leads to chaos in one of them
        (ROUTES["both"], ROUTES["cascades"], ClaimVerdict.CORRECTED),
        (ROUTES["both"], ROUTES["later"], ClaimVerdict.CORRECTED),  # nor to the first chaos here
        (ROUTES["cascades"], ROUTES["cascades"], ClaimVerdict.DISAGREES),  # nor anywhere
        # nor a cascade
        (ROUTES["both"], (("unknown", "grazing"), ("fold", "fold")), ClaimVerdict.DISAGREES),
    ],
)
def test_erratum_39_the_route_to_chaos_is_what_happens_at_the_edges_of_bands(slow, fast, verdict):
    panels = {}
    for frequency, edges in ((0.5, slow), (1.0, fast)):
        tree = panel((1.0, 1.2), (2.0, 2.2))
        table = (
            tree["bands"]
            .to_dataset()
            .assign(
                low_edge=("band", [e[0] for e in edges]), high_edge=("band", [e[1] for e in edges])
            )
        )
        tree["bands"] = xr.DataTree(table)
        panels[frequency] = tree
    claim = claims_of(chaos_measures.force_diagrams(panels))["fig11-route"]
    assert claim.verdict is verdict
    assert "fold" in claim.evidence
