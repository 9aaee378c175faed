"""The theorems about section 6: a draft of them, and folds of a branch by another method."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import saltus
from saltus_paper.claims.claim import ClaimVerdict
from saltus_paper.figures.harmonic_loads import FREQUENCY, under_force
from saltus_paper.figures.proofs import FIGURE


@pytest.fixture(scope="module")
def draft():
    part = FIGURE.at("quick")
    return part.compute(**part.parameters)


def test_the_claims_of_a_draft_hold(draft):
    claims = FIGURE.claims(draft)
    assert {claim.id for claim in claims} == {
        "proofs-folds",
        "proofs-loops",
        "proofs-anticipated",
    }
    assert {claim.verdict for claim in claims} == {ClaimVerdict.HOLDS}
    assert all("proved by interval arithmetic" in claim.evidence for claim in claims)


def test_the_branch_turns_round_where_its_folds_are_proved(draft):
    """The vertex of the parabola through a point of the branch and its neighbours, over arclength."""
    branch = saltus.continue_orbit(
        saltus.find_orbit(under_force(1.0, 1.0), theta=0.3), FREQUENCY, (0.7, 1.1)
    )
    places = np.array([point.orbit.frequency for point in branch.points])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(places))) != 0) + 1
    for fold in draft["folds_c"]["folds"]["parameter"].values:
        turn = turns[np.abs(places[turns] - fold).argmin()]
        three = branch.points[turn - 1 : turn + 2]
        steps = [
            np.linalg.norm(b.solution.unknowns - a.solution.unknowns) for a, b in pairwise(three)
        ]
        curved, slope, level = np.polyfit(
            [-steps[0], 0.0, steps[1]], places[turn - 1 : turn + 2], 2
        )
        assert level - slope**2 / (4.0 * curved) == pytest.approx(fold, abs=3e-4)


def test_a_theorem_that_was_not_proved_is_no_claim(draft):
    other = draft.copy(deep=True)
    table = other["folds_c"]["folds"].to_dataset()
    other["folds_c/folds"] = table.assign(proved=0 * table["proved"])
    (claim,) = [claim for claim in FIGURE.claims(other) if claim.id == "proofs-folds"]
    assert claim.verdict is ClaimVerdict.DISAGREES


def test_every_theorem_is_in_the_table(draft):
    told = FIGURE.table(draft)
    assert told.count("has a periodic orbit") == sum(
        group.sizes["theorem"]
        for panel in draft.children.values()
        for group in panel.children.values()
    )


def test_the_theorems_are_read_back_as_they_were_written(draft, tmp_path):
    saltus.save(tmp_path / "proofs.nc", draft)
    again = saltus.load(tmp_path / "proofs.nc")
    assert FIGURE.table(again) == FIGURE.table(draft)
    assert FIGURE.claims(again) == FIGURE.claims(draft)
