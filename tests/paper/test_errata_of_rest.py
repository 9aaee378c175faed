"""Our own errata of section 6: what is printed fails, and holds as corrected, by two kinds of evidence that can each fail."""

import pytest
import xarray as xr
from claim_verdicts import claims_of

from saltus.paper import ClaimVerdict
from saltus.paper.figures import fig13
from saltus.paper.figures.harmonic_loads import under_both
from saltus.paper.figures.load_diagrams import undeformed
from saltus.paper.measures.response_measures import border_of_rest
from saltus.theory import critical_horizontal


@pytest.fixture(scope="module")
def rest_under_both_loads():
    critical = float(critical_horizontal(1.3962634015954636, -0.5, 0.25))
    groups = {"undeformed": undeformed(under_both(), critical), "disturbed": fig13._disturbed(critical)}
    return xr.DataTree.from_dict({**groups, "a": xr.Dataset(attrs={"critical": critical})})


def judged(data):
    return claims_of({"fig13-critical": border_of_rest(data)})["fig13-critical"]


def test_erratum_35_rest_is_lost_where_the_ellipse_leaves_the_domain(rest_under_both_loads):
    claim = judged(rest_under_both_loads)
    assert (claim.verdict, claim.erratum) == (ClaimVerdict.CORRECTED, 35)
    assert "0.07635" in claim.headline
    assert "0.08816" in claim.headline


@pytest.mark.parametrize(
    ("moved", "verdict"),
    [
        ([1e-5, 1e-3, 1e-5], ClaimVerdict.AS_PRINTED),  # held below the printed amplitude
        ([1e-5, 1e-5, 1e-3], ClaimVerdict.UNDECIDED),  # held just above the corrected one, too
        ([1e-3, 1e-3, 1e-3], ClaimVerdict.UNDECIDED),  # lost before it
    ],
)
def test_erratum_35_needs_both_kinds_of_evidence(rest_under_both_loads, moved, verdict):
    disturbed = rest_under_both_loads["disturbed"].to_dataset().assign(moved=("case", moved))
    data = rest_under_both_loads.assign(disturbed=xr.DataTree(disturbed))
    assert judged(data).verdict is verdict
