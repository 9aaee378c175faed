"""Where the reduced model holds: shares of stable motions, and the closed layer's reaction by the
equations of both layers.
"""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from claim_verdicts import claims_of
from spectrum_cases import branch, diagram

import saltus
from saltus.branch_tables import branch_tables
from saltus_paper import ClaimVerdict
from saltus_paper.figures.closed_layer import closed_layer
from saltus_paper.figures.harmonic_loads import AMPLITUDE, under_force
from saltus_paper.measures.validity_measures import shares, validity


def panel(reaction, *, simulated=None, share=0.1):
    """A diagram of one stable branch over (0, 3), with the least reaction at 0, 1, 2, 3, and
    simulated motions that show it.
    """
    zeros = [
        ("reaction", k + a / (a - b), 1.0)
        for k, (a, b) in enumerate(pairwise(reaction))
        if a * b < 0
    ]
    tree = diagram(
        branch(
            range(4),
            np.ones(4),
            np.ones(4),
            margins={"reaction": reaction, "reach": np.ones(4)},
            special=zeros,
        )
    )
    least = np.array(reaction if simulated is None else simulated, float)
    columns = {
        "stored": np.array(reaction, float),
        "simulated": least,
        "share": np.where(least < 0, share, 0.0),
    }
    tree["closed_layer"] = xr.DataTree(
        xr.Dataset({name: ("motion", values) for name, values in columns.items()})
    )
    return tree


def test_shares_are_lengths_of_stable_lines_within_the_range_cut_at_the_zeros_of_the_margins():
    margins = {"reaction": [1, 1, -3, -3, -3], "reach": [1, 1, 1, 1, -1]}
    special = [("reaction", 1.25, 1.25), ("reach", 3.5, 3.5)]
    stable = branch(range(5), range(5), np.ones(5), margins=margins, special=special)
    unstable = branch([0, 3], [1, 1], [0, 0], margins={"reaction": [-1, -1], "reach": [-1, -1]})
    found = shares(diagram(stable, unstable, bounds=(0.5, 3.75)))
    assert found["violated"] == pytest.approx((3.75 - 1.25) / 3.25)
    assert found["beyond"] == pytest.approx(0.25 / 3.25)


@pytest.mark.parametrize(
    ("tree", "verdict"),
    [
        (panel([1, 1, 1, 1]), ClaimVerdict.AS_PRINTED),
        (panel([1, 1, -1, -1]), ClaimVerdict.CORRECTED),
        # simulation knows nothing of it
        (panel([1, 1, -1, -1], simulated=[1, 1, 1, 1]), ClaimVerdict.UNDECIDED),
        (panel([1, 1, -1, -1], simulated=[1, 1, -1, -2]), ClaimVerdict.UNDECIDED),
    ],
)
def test_that_the_closed_layer_stays_closed_fails_by_two_kinds_of_evidence(tree, verdict):
    claim = claims_of({"fig09-validity": validity("Fig. 9", {"a": tree})})["fig09-validity"]
    assert claim.verdict is verdict
    if verdict is ClaimVerdict.CORRECTED:
        assert claim.erratum == 21
        assert "50%" in claim.headline


def test_both_layers_equations_along_simulated_motions_give_the_margin_of_the_branch():
    orbit = saltus.find_orbit(under_force(amplitude=0.5), theta=0.3)
    found = saltus.continue_orbit(orbit, AMPLITUDE, (0.1, 1.2))
    tree = xr.DataTree.from_dict(
        {"/": xr.Dataset(attrs={"bounds": [0.1, 1.2]}), **branch_tables([found.to_xarray()])}
    )
    layer = closed_layer(tree)
    assert layer["simulated"].values == pytest.approx(layer["stored"].values, abs=1e-6)
    assert layer["simulated"].values.min() < -0.5 < 0.0 < layer["simulated"].values.max()
    assert ((layer["share"].values > 0) == (layer["simulated"].values < 0)).all()


def test_the_least_reaction_is_found_just_before_the_impact_with_which_a_period_ends():
    """There it is -3.044, and 3 % more wherever else: a period that begins at this impact shows it
    at its end alone.
    """
    system = under_force(0.5, amplitude=2.9794825434786647)
    orbit = saltus.find_orbit(
        system, theta=-0.14184655319090936, velocity=0.70495487203407, period=2
    )
    theta, velocity = orbit.motion().at(4 * np.pi)  # a forcing period later
    later = saltus.find_orbit(system, theta=theta, velocity=velocity, period=2)
    value = system.get(AMPLITUDE)
    found = saltus.continue_orbit(later, AMPLITUDE, (value - 1e-4, value + 1e-4))
    bounds = {"/": xr.Dataset(attrs={"bounds": [2.0, 4.0]})}
    layer = closed_layer(xr.DataTree.from_dict(bounds | branch_tables([found.to_xarray()])))
    assert layer["stored"].values == pytest.approx(-3.0444, abs=1e-3)
    assert layer["simulated"].values == pytest.approx(layer["stored"].values, rel=1e-6)
