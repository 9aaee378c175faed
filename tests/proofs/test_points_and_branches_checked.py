"""A proof of a special point or of a branch that was changed is noticed by `check`, which computes all
anew.
"""

from __future__ import annotations

import copy
import json
import runpy
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from test_certificates import changed, changed_entry

import saltus
from saltus.orbits.proofs.branch_proof import BranchProof
from saltus.orbits.proofs.special_proof import SpecialProof

# What a proof does not say: how long it took, what it was asked for, and what it was computed with.
NOT_SAID = {"seconds", "special", "shooting", "zero", "branch", "radii", "steps", "reasons"}


def ball_branch(bounds: tuple[float, float]) -> saltus.Branch:
    """A ball on a shaken table, whose orbits are born at pi / 3."""
    system = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=1.2)),
        impact=saltus.VelocityReduction(0.5),
    )
    orbit = saltus.find_orbit(system, x=-1.0, velocity=-3.0)
    return saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=bounds)


@pytest.fixture(scope="module")
def branch_proof() -> BranchProof:
    """Through the fold, with nodes that are set anew."""
    return saltus.prove(ball_branch((1.03, 1.21)), step=1.0, order=24)


@pytest.fixture(scope="module")
def grazing() -> SpecialProof:
    """An oscillator that begins to touch its wall."""
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=1.0),
        load=saltus.Load(frequency=0.8, force=saltus.Harmonic(amplitude=0.2)),
        impact=saltus.VelocityReduction(0.7),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", bounds=(0.78, 0.92))
    return saltus.prove(branch.special[0], step=1.0, order=24)


@pytest.fixture(scope="module", params=["LP", "GR"])
def proof(
    request: pytest.FixtureRequest, branch_proof: BranchProof, grazing: SpecialProof
) -> SpecialProof:
    if request.param == "GR":
        return grazing
    point = next(point for point in branch_proof.branch.special if point.kind == "LP")
    return point.evidence.proof


def test_a_special_proof_that_was_not_changed_is_confirmed(proof: SpecialProof) -> None:
    assert proof.proved
    assert proof.check()
    assert json.loads(json.dumps(proof.certificate)) == proof.certificate


def test_a_grazing_lies_where_the_amplitude_is_that_of_the_wall(grazing: SpecialProof) -> None:
    """(1 - w^2)^2 + (c w)^2 = F^2 at the wall 1, below the resonance."""
    with mp.workdps(40):
        c, force = mp.mpf(0.1), mp.mpf(0.2)
        exact = mp.findroot(lambda w: (1 - w**2) ** 2 + (c * w) ** 2 - force**2, 0.9)
        middle, radius = map(mp.mpf, map(float, grazing.parameter))
        assert abs(middle - exact) <= radius < 1e-13


def test_each_field_of_a_special_proof_that_is_changed_is_noticed(proof: SpecialProof) -> None:
    names = [entry.name for entry in fields(proof) if entry.name not in NOT_SAID]
    passed = [
        name for name in names if replace(proof, **{name: changed(getattr(proof, name))}).check()
    ]
    assert passed == []


def test_each_entry_of_a_special_certificate_that_is_changed_is_noticed(
    proof: SpecialProof,
) -> None:
    passed = []
    for name, value in proof.certificate.items():
        other = replace(proof)
        other.certificate[name] = changed_entry(copy.deepcopy(value))
        if other.check():
            passed.append(name)
    assert passed == []


def test_boxes_of_a_special_point_that_promise_more_are_noticed(proof: SpecialProof) -> None:
    narrow = replace(proof.zero, radius=1e-6 * proof.zero.radius)
    parameter = proof.parameter * np.array([1.0, 1e-6])
    assert not replace(proof, zero=narrow, parameter=parameter).check()
    wide = replace(proof.zero, unique=3.0 * proof.zero.unique)
    radii = {name: 3.0 * radius for name, radius in proof.unique_within.items()}
    assert not replace(proof, zero=wide, unique_within=radii).check()


def test_a_special_point_of_another_kind_or_system_is_noticed(proof: SpecialProof) -> None:
    point = proof.special
    other = "PD" if point.kind == "LP" else "LP"
    assert not replace(proof, special=replace(point, kind=other), kind=other).check()


def test_a_pin_that_a_vector_of_zeros_meets_is_noticed(branch_proof: BranchProof) -> None:
    """With the goal 0 every orbit of the branch would be a fold, with the kernel vector 0."""
    point = next(point for point in branch_proof.branch.special if point.kind == "LP")
    proof = point.evidence.proof
    shooting = copy.copy(proof.shooting)
    shooting.pins = [(shooting.pins[0][0], 0.0)]
    assert not replace(proof, shooting=shooting).check()
    row = np.zeros(shooting.size)
    row[0] = 1.0  # the time of an impact, and no part of the kernel vector
    shooting.pins = [(row, float(proof.zero.middle[0]))]
    assert not replace(proof, shooting=shooting).check()


@pytest.mark.parametrize("kind", ["LP", "GR"])
def test_the_program_on_flint_verifies_a_special_point(
    kind: str, branch_proof: BranchProof, grazing: SpecialProof
) -> None:
    """And not one whose parameter is 1e-9 away."""
    pytest.importorskip("flint")
    program: Any = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "check_certificate.py"))
    fold = next(point for point in branch_proof.branch.special if point.kind == "LP")
    proof = grazing if kind == "GR" else fold.evidence.proof
    claims = program["verified"](json.loads(json.dumps(proof.certificate)))
    assert {"existence", "uniqueness", "gaps"} <= set(claims)
    assert all(claims.values())
    moved = copy.deepcopy(proof.certificate)
    moved["middle"][-1] = (float.fromhex(moved["middle"][-1]) + 1e-9).hex()
    assert not program["check"](moved)


# --- branches --------------------------------------------------------------------


def with_box(proof: BranchProof, number: int, **changes: Any) -> BranchProof:
    """A proof with another box in its first piece."""
    piece = proof.pieces[0]
    boxes = list(piece.boxes)
    boxes[number] = replace(boxes[number], **changes)
    return replace(proof, pieces=(replace(piece, boxes=tuple(boxes)), *proof.pieces[1:]))


def test_a_branch_that_was_not_changed_is_confirmed(branch_proof: BranchProof) -> None:
    assert branch_proof.proved.all()
    assert len(branch_proof.pieces[0].guesses) > 1
    assert branch_proof.check()


@pytest.mark.parametrize("name", ["low", "high", "stable", "turn", "least_speed", "nodes"])
def test_what_is_said_of_a_box_is_checked(branch_proof: BranchProof, name: str) -> None:
    box = branch_proof.pieces[0].boxes[1]
    assert not with_box(branch_proof, 1, **{name: changed(getattr(box, name))}).check()


@pytest.mark.parametrize(
    ("name", "factor"),
    [("radius", 0.02), ("tangent", 1.001), ("half", 1.5), ("middle", 1.0 + 1e-6)],
)
def test_another_tube_is_noticed(branch_proof: BranchProof, name: str, factor: float) -> None:
    tube = branch_proof.pieces[0].boxes[1].tube
    other = replace(tube, **{name: factor * getattr(tube, name)})
    assert not with_box(branch_proof, 1, tube=other).check()


def test_boxes_that_do_not_meet_are_noticed(branch_proof: BranchProof) -> None:
    """With one box left out, with another order, with a start that lies elsewhere, or with points that
    the piece does not reach."""
    piece = branch_proof.pieces[0]
    boxes = piece.boxes
    start = boxes[2].start
    changes: list[dict[str, Any]] = [
        {"boxes": (*boxes[:2], *boxes[3:])},
        {"boxes": (boxes[1], boxes[0], *boxes[2:])},
        {
            "boxes": (
                *boxes[:2],
                replace(boxes[2], start=type(start)(start.middle + 1e-6, start.radius)),
                *boxes[3:],
            )
        },
        {"boxes": boxes[:-2]},
        {"boxes": ()},
        {"guesses": piece.guesses[:1]},
    ]
    for change in changes:
        assert not replace(branch_proof, pieces=(replace(piece, **change),)).check()


def test_other_words_about_a_branch_are_noticed(branch_proof: BranchProof) -> None:
    proved = branch_proof.proved.copy()
    proved[0] = not proved[0]
    assert not replace(branch_proof, proved=proved).check()
    assert not replace(branch_proof, path="load.force").check()
    assert not replace(branch_proof, assumptions=()).check()
    special = list(branch_proof.branch.special)
    at = next(i for i, point in enumerate(special) if point.kind == "LP")
    false = replace(special[at].evidence.proof, parameter=np.array([1.0471, 1e-9]))
    special[at] = replace(special[at], evidence=replace(special[at].evidence, proof=false))
    branch = replace(branch_proof.branch, special=tuple(special))
    assert not replace(branch_proof, branch=branch).check()


def test_a_proof_of_another_special_point_is_noticed(branch_proof: BranchProof) -> None:
    special = list(branch_proof.branch.special)
    at = next(i for i, point in enumerate(special) if point.kind == "LP")
    special[at] = replace(special[at], point=branch_proof.branch.points[0])
    branch = replace(branch_proof.branch, special=tuple(special))
    assert not replace(branch_proof, branch=branch).check()
