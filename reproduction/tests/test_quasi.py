"""What the paper calls quasi-periodic: chaos between periodic motions, in data made small."""

import pytest
from picture_checks import check_provenance, clipped

from saltus_paper import FIGURES, ClaimVerdict


@pytest.mark.thorough
def test_the_band_at_the_smallest_load_is_resolved_and_the_picture_is_whole():
    figure = FIGURES["quasi"]
    data = figure.compute(windows={"a": (0.355, 0.405)}, count=11, starts=3)
    check_provenance("quasi", data)
    (claim,) = figure.claims(data)
    assert claim.verdict is ClaimVerdict.HOLDS
    assert clipped(figure.draw(data)) == []
    # without chaos the band is not explained
    data["a/bands"] = data["a/bands"].isel(band=slice(0, 0))
    assert figure.claims(data)[0].verdict is ClaimVerdict.DISAGREES
