"""A proof or a certificate that was changed is noticed: by `check`, which computes all anew, and by the
program on FLINT alone.
"""

from __future__ import annotations

import copy
import json
import runpy
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import saltus
from saltus.orbits.orbit import PeriodicOrbit

DOCS = Path(__file__).parents[2] / "docs"
# What a proof does not say of the orbit: how long it took, what it was asked for, and what it was
# computed with, of which the boxes and equations are changed below.
NOT_SAID = {"seconds", "orbit", "made", "shooting", "zero"}


@pytest.fixture(scope="module")
def pair_proof() -> saltus.OrbitProof:
    """Three impacts of an impact pair, over few long steps."""
    system = saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.3, damping=0.1, clearance=0.5),
        load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.6)),
        impact=saltus.NewtonImpact(e=0.6),
    )
    return saltus.prove(saltus.find_orbit(system, z=0.1, x=0.1), step=1.2, order=20)


@pytest.fixture(scope="module")
def resting_proof() -> saltus.OrbitProof:
    """An oscillator that comes to rest at its wall."""
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=1.0),
        load=saltus.Load(frequency=0.6, force=saltus.Harmonic(amplitude=2.0, mean=2.0)),
        impact=saltus.VelocityReduction(0.4),
    )
    return saltus.prove(saltus.find_orbit(system, x=0.0), step=1.2, order=20)


@pytest.fixture(scope="module", params=["pair", "rest"])
def proof(
    request: pytest.FixtureRequest,
    pair_proof: saltus.OrbitProof,
    resting_proof: saltus.OrbitProof,
) -> saltus.OrbitProof:
    return {"pair": pair_proof, "rest": resting_proof}[request.param]


@pytest.fixture(scope="module")
def program() -> dict[str, Any]:
    pytest.importorskip("flint")
    return runpy.run_path(str(DOCS / "check_certificate.py"))


def changed(value: Any) -> Any:
    """Another value of the same kind."""
    if isinstance(value, bool) or value is None:
        return not value
    if isinstance(value, np.ndarray):
        return value * (1.0 + 1e-3) + 1e-3 if value.size else np.ones((1, 2))
    if isinstance(value, dict):
        return {**value, "time": 2.0 * value.get("time", 1.0)}
    if isinstance(value, tuple):
        return (*value, "the moon is full")
    return f"{value} or not" if isinstance(value, str) else value * 1.5 + 1.0


def changed_entry(value: Any) -> Any:
    """Another entry of a certificate; numbers are hexadecimal."""
    if isinstance(value, dict):
        name = next(iter(value), "more")
        return {**value, name: changed_entry(value.get(name, "0x1p0"))}
    if isinstance(value, list):
        return [changed_entry(value[0]), *value[1:]] if value else ["more"]
    if isinstance(value, str) and "0x" in value:
        return (float.fromhex(value) * (1.0 + 1e-3) + 1e-3).hex()
    return changed(value)


def test_a_proof_that_was_not_changed_is_confirmed(proof: saltus.OrbitProof) -> None:
    assert proof.proved
    assert proof.check()
    assert json.loads(json.dumps(proof.certificate)) == proof.certificate
    assert proof.check()


def test_each_field_of_a_proof_that_is_changed_is_noticed(proof: saltus.OrbitProof) -> None:
    names = [entry.name for entry in fields(proof) if entry.name not in NOT_SAID]
    passed = [
        name for name in names if replace(proof, **{name: changed(getattr(proof, name))}).check()
    ]
    assert passed == []


def test_each_entry_of_a_certificate_that_is_changed_is_noticed(proof: saltus.OrbitProof) -> None:
    passed = []
    for name, value in proof.certificate.items():
        other = replace(proof)
        other.certificate[name] = changed_entry(copy.deepcopy(value))
        if other.check():
            passed.append(name)
    assert passed == []


@pytest.mark.parametrize(("box", "factor"), [("radius", 0.5), ("unique", 2.0)])
def test_boxes_that_promise_more_are_noticed(
    pair_proof: saltus.OrbitProof, box: str, factor: float
) -> None:
    """All that is told of the box is changed with it."""
    zero = replace(pair_proof.zero, **{box: factor * getattr(pair_proof.zero, box)})
    other = replace(pair_proof, zero=zero)
    if box == "radius":
        narrow = np.array([1.0, factor])
        other = replace(
            other,
            impact_times=other.impact_times * narrow,
            impact_speeds=other.impact_speeds * narrow,
        )
    else:
        wide = {name: factor * radius for name, radius in other.unique_within.items()}
        other = replace(other, unique_within=wide)
    assert not other.check()


def test_a_moved_middle_is_noticed(pair_proof: saltus.OrbitProof) -> None:
    """A hundredth of the smallest box in which it is unique, much more than its radius."""
    middle = pair_proof.zero.middle
    for place in range(len(middle)):
        moved = middle.copy()
        moved[place] += 1e-2 * pair_proof.zero.unique[place]
        assert not replace(pair_proof, zero=replace(pair_proof.zero, middle=moved)).check()


def test_another_system_or_gaps_left_out_are_noticed(pair_proof: saltus.OrbitProof) -> None:
    system = pair_proof.orbit.system.with_({"model.damping": 0.1001})
    other = saltus.find_orbit(system, z=0.1, x=0.1)
    assert not replace(pair_proof, orbit=other).check()
    shooting = copy.copy(pair_proof.shooting)
    shooting.segments = [replace(segment, gaps=()) for segment in shooting.segments]
    assert not replace(pair_proof, shooting=shooting).check()


@pytest.mark.parametrize("unknown", range(6))
def test_an_orbit_that_was_moved_is_refuted_whatever_was_moved(
    pair_proof: saltus.OrbitProof, unknown: int
) -> None:
    """The coordinate that a contact holds is an unknown of the orbit, and none of its proof."""
    orbit = pair_proof.orbit
    unknowns = orbit.solution.unknowns.copy()
    unknowns[unknown] += 1e-3
    moved = PeriodicOrbit.known(orbit.equations, unknowns, orbit.solution.values)
    assert moved is None or saltus.prove(moved).proved is False


# --- the program on FLINT alone ------------------------------------------------

Change = Callable[[dict[str, Any]], None]


def at(path: tuple[Any, ...], change: Callable[[Any], Any]) -> Change:
    """A change of the entry at a path; numbers are changed as such."""

    def applied(certificate: dict[str, Any]) -> None:
        owner: Any = certificate
        for part in path[:-1]:
            owner = owner[part]
        value = owner[path[-1]]
        hexadecimal = isinstance(value, str)
        new = change(float.fromhex(value) if hexadecimal else value)
        owner[path[-1]] = float(new).hex() if hexadecimal else new

    return applied


def each(name: str, factor: float) -> Change:
    """Every number of a list times a factor."""

    def applied(certificate: dict[str, Any]) -> None:
        certificate[name] = [(factor * float.fromhex(x)).hex() for x in certificate[name]]

    return applied


QUICK: dict[str, Change] = {
    "a time is moved by 1e-9": at(("middle", 0), lambda x: x + 1e-9),
    "radii are smaller": each("radius", 1e-9),
    "another frequency": at(("parameters", "middle", 6), lambda x: x + 1e-9),
    "stability is turned": at(("stable",), lambda x: not x),
    "a step is left out": lambda certificate: certificate["steps"].pop(),
}
THOROUGH: dict[str, Change] = {
    "a speed is negative": at(("middle", 1), lambda x: -x),
    "a state is moved by 1e-9": at(("middle", -1), lambda x: x + 1e-9),
    "radii are 0": each("radius", 0.0),
    "radii are no numbers": each("radius", float("nan")),
    "it is said to be unique in a wide box": each("unique", 100.0),
    "it is said to be unique in a narrower box than its own": each("unique", 1e-12),
    "another damping": at(("parameters", "middle", 2), lambda x: x + 1e-9),
    "negative radii of parameters": at(("parameters", "radius", 2), lambda x: -1.0),
    "another number is the frequency": at(("parameters", "frequency"), lambda x: 0),
    "another period": at(("span",), lambda x: 2.0 * x),
    "steps of low order": at(("order",), lambda x: 4),
    "a gap of another sign": at(("segments", 0, "gaps", 0, "sign"), lambda x: -x),
    "a gap that begins as at a release": at(("segments", 0, "gaps", 0, "start"), lambda x: 3),
    "fewer events": at(("events",), lambda x: 1),
    "a larger modulus": at(("moduli", 0, 0), lambda x: x + 1e-6),
    "narrow moduli": at(("moduli", 0, 1), lambda x: 1e-18),
    "a larger least speed": at(("least_speed",), lambda x: 1.01 * x),
    "another law of impact": lambda certificate: certificate["segments"][0].update(
        start=certificate["segments"][1]["start"]
    ),
}


def is_verified(program: dict[str, Any], certificate: dict[str, Any]) -> bool:
    """Whether the program verifies all; where a Taylor step has no enclosure it ends with words."""
    try:
        return bool(program["check"](certificate))
    except SystemExit:
        return False


def test_the_program_verifies_each_claim(program: dict[str, Any], proof: saltus.OrbitProof) -> None:
    claims = program["verified"](json.loads(json.dumps(proof.certificate)))
    assert {"existence", "uniqueness", "gaps", "speeds", "stability"} <= set(claims)
    assert ("rests" in claims) == bool(len(proof.rests_by))
    assert all(claims.values())


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.thorough) for name in THOROUGH)]
)
def test_the_program_notices_a_change(
    program: dict[str, Any], pair_proof: saltus.OrbitProof, name: str
) -> None:
    certificate = copy.deepcopy(pair_proof.certificate)
    (QUICK | THOROUGH)[name](certificate)
    assert certificate != pair_proof.certificate
    assert not is_verified(program, certificate)


def test_the_program_notices_a_rest_that_is_over_too_early(
    program: dict[str, Any], resting_proof: saltus.OrbitProof
) -> None:
    """Before the last impact that was resolved."""
    certificate = copy.deepcopy(resting_proof.certificate)
    last = float.fromhex(certificate["middle"][2 * certificate["rests"][0]["last"]])
    certificate["rests"][0]["over"] = last.hex()
    claims = program["verified"](certificate)
    assert not claims.pop("rests")
    assert all(claims.values())
