"""Pieces of branches are connected curves of orbits, box by box."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import saltus


def table(amplitude: float = 1.2) -> saltus.System:
    return saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=amplitude)),
        impact=saltus.VelocityReduction(0.5),
    )


@pytest.fixture(scope="module")
def proof() -> saltus.orbits.BranchProof:
    """Orbits of a ball on a table near the fold at a = pi / 3, on both of its sides."""
    orbit = saltus.find_orbit(table(), x=-1.0, velocity=-3.0)
    branch = saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=(1.0, 1.25))
    return saltus.prove(branch, step=1.0, order=24)


def test_a_branch_through_a_fold_is_one_curve(proof: saltus.orbits.BranchProof) -> None:
    """The fold lies at pi / 3: every box lies above it, less the box's own width, and both sides
    are reached by one piece that turns round once."""
    assert proof.proved.all()
    assert len(proof.pieces) == 1
    turns = proof.pieces[0].turns
    assert len(turns) == 2
    assert turns[0] == -turns[1]
    lows = np.array([box.low for box in proof.pieces[0].boxes])
    highs = np.array([box.high for box in proof.pieces[0].boxes])
    assert lows.min() <= np.pi / 3 <= highs.max()
    assert (highs > np.pi / 3).all()
    assert "turns round at least 1 time" in proof.statement


def test_stable_boxes_lie_on_one_side_of_the_fold(proof: saltus.orbits.BranchProof) -> None:
    decided = [box.stable for box in proof.pieces[0].boxes if box.stable is not None]
    assert True in decided
    assert False in decided
    changes = sum(a != b for a, b in itertools.pairwise(decided))
    assert changes == 1


def test_boxes_are_read_back_as_a_table(proof: saltus.orbits.BranchProof) -> None:
    data = proof.to_xarray()
    assert data.sizes["box"] == len(proof.pieces[0].boxes)
    assert (data.box_low < data.box_high).all()
    assert data.proved.all()
    assert data.attrs["proved_share"] == 1.0


def test_few_boxes_are_said_to_be_used_up() -> None:
    orbit = saltus.find_orbit(table(), x=-1.0, velocity=-3.0)
    branch = saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=(1.1, 1.3))
    proof = saltus.prove(branch, step=1.0, order=24, most_boxes=2)
    assert not proof.proved.all()
    assert "2 boxes were used up" in proof.statement
