"""The special points of a branch do not depend on units of length, time and mass, on 1e-13 of
rounding, on the asked range, on where the branch is begun, and on how a contact is written.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from branching_systems import KINDS, Case, Units, random_case

import saltus
from saltus.errors import SaltusError

UNITS = (
    Units(length=1e-9),
    Units(length=1e6),
    Units(time=1e-6),
    Units(time=1e6),
    Units(mass=1e6),
    Units(mass=1e-9),
    Units(length=1e-9, time=1e-6, mass=1e-9),
    Units(length=1e-3, time=1e3, mass=1e-6),
)
RANGE = (0.8, 1.25)  # of the frequency, as shares of that of the first orbit
SAME = 1e-9
# An absorber whose branch has eleven special points, and a backlash with a family that ends at its
# parent: both once had other points in other units.
ELEVEN = Case(
    "absorber",
    (
        *(0.20111356023015864, 0.06975279742414717, 0.33588198293076227),
        *(0.87113253693503, 0.25072382723727793, 0.6755820088130386, 1.0),
    ),
)
FAMILY = Case(
    "backlash",
    (
        *(0.9925869959033216, 0.12122766573745021, -0.004663460525667601),
        *(1.0735795147296985, 0.4420367132471509, 0.5, 1.0),
    ),
)


@dataclass(frozen=True)
class BranchAnswer:
    """What is discrete about an orbit, its branch and its motion; and their numbers."""

    discrete: Any
    numbers: np.ndarray


def answer(case: Case, span: tuple[float, float] = RANGE, verdict: bool = False) -> BranchAnswer:
    """The orbit at the start, its branch over a range of frequencies, and the verdict on the
    motion, in units of the case."""
    low, high = (share * case.frequency for share in span)
    try:
        orbit = saltus.find_orbit(case.system, **case.start)
        branch = saltus.continue_orbit(orbit, "load.frequency", (low, high))
        judged = saltus.classify(case.system, **case.start) if verdict else None
    except SaltusError as refused:
        return BranchAnswer(type(refused).__name__, np.zeros(0))
    kinds = tuple(str(point.kind) for point in branch.special)
    ends = tuple(str(end.reason.code) for end in branch.ends)
    facts = orbit.period, orbit.impact_count, orbit.stable, orbit.symmetric, orbit.admissible
    said = None if judged is None else (str(judged.kind), judged.period)
    return BranchAnswer(
        (facts, kinds, ends, said),
        np.array(
            [
                *(point.parameter * case.units.time for point in branch.special),
                *np.sort(np.abs(orbit.multipliers)),
            ]
        ),
    )


def in_other_words(case: Case, units: tuple[Units, ...] = UNITS) -> Iterator[Case]:
    """The same case in other units, and with other rounding."""
    for other in units:
        yield case.in_units(other)
    yield replace(case, rounded=3)


def check(case: Case, units: tuple[Units, ...] = UNITS, **options: Any) -> None:
    """The answers in other words are the same."""
    expected = answer(case, **options)
    for other in in_other_words(case, units):
        found = answer(other, **options)
        name = f"{case.kind} in {other.units.name}, rounded {other.rounded}"
        assert found.discrete == expected.discrete, name
        assert np.abs(found.numbers - expected.numbers).max(initial=0.0) < SAME, name


def test_an_absorber_has_the_same_special_points_in_other_units() -> None:
    units = (Units(length=1e-9), Units(time=1e-6, mass=1e6))
    expected = answer(ELEVEN, (0.99, 1.02))
    assert len(expected.discrete[1]) == 5
    check(ELEVEN, units, span=(0.99, 1.02))


def test_a_family_has_no_fold_at_its_parent_in_any_units() -> None:
    for case in in_other_words(FAMILY, (Units(length=2.0), Units(length=1e-3, time=1e-3))):
        _, kinds, ends, _ = answer(case, (0.97, 1.02)).discrete
        assert kinds == ("PD", "PD")
        assert ends == ("bound", "image")


@pytest.mark.parametrize(("kind", "seed"), [("wall", 0), ("stops", 4), ("pair", 1), ("chain", 3)])
def test_a_branch_has_the_same_special_points_in_other_units(kind: str, seed: int) -> None:
    check(random_case(kind, seed), (Units(length=1e-9, time=1e-6, mass=1e6), Units(time=1e6)))


@pytest.mark.parametrize("time", [1.0, 1e-6])
def test_one_contact_has_the_same_special_points_as_one_of_several(time: float) -> None:
    """A wall as a model of its own and as the one contact of a `ContactModel`."""
    k, c, high, frequency, amplitude, e = 1.0, 0.1, 1.0, 1.2, 0.5, 0.8
    units = Units(time=time)
    several = Case("wall", (k, c, high, frequency, amplitude, e, 1.0), units)
    alone = saltus.System(
        model=saltus.WallOscillator(stiffness=k / time**2, damping=c / time, wall=high),
        load=saltus.Load(frequency=several.frequency, force=saltus.Harmonic(amplitude / time**2)),
        impact=saltus.NewtonImpact(e=e),
    )
    found = []
    for system in (several.system, alone):
        orbit = saltus.find_orbit(system, x=0.0)
        branch = saltus.continue_orbit(orbit, "load.frequency", (0.6 / time, 3.0 / time))
        found.append(sorted((str(p.kind), p.parameter * time) for p in branch.special))
    assert [kind for kind, _ in found[0]] == [kind for kind, _ in found[1]]
    for (_, one), (_, other) in zip(*found, strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def begun_elsewhere(case: Case) -> None:
    """A narrower range has the special points of the wider one that lie in it, and the branch that
    is begun at one of its orbits beyond a special point has the same ones."""
    orbit = saltus.find_orbit(case.system, **case.start)
    bounds = tuple(share * case.frequency for share in RANGE)
    branch = saltus.continue_orbit(orbit, "load.frequency", bounds)
    places = [(str(point.kind), point.parameter / case.frequency) for point in branch.special]
    for share in (0.1, 0.9):
        there = branch.orbits[int(share * len(branch.orbits))]
        if there.grazes:
            continue
        again = saltus.continue_orbit(there, "load.frequency", bounds)
        assert sorted(str(point.kind) for point in again.special) == sorted(
            kind for kind, _ in places
        )
    narrow = saltus.continue_orbit(
        orbit, "load.frequency", (0.95 * case.frequency, 1.05 * case.frequency)
    )
    for point in narrow.special:
        kind, place = str(point.kind), point.parameter / case.frequency
        assert any(kind == k and abs(place - p) < 1e-8 for k, p in places), (kind, place)


@pytest.mark.parametrize(("kind", "seed"), [("wall", 3), ("pair", 3)])
def test_a_branch_is_the_same_begun_elsewhere(kind: str, seed: int) -> None:
    begun_elsewhere(random_case(kind, seed))


def test_a_branch_begun_at_the_end_of_a_family_is_its_parents() -> None:
    """There an orbit of two periods is one of a single period, gone round twice."""
    case = random_case("wall", 7)
    orbit = saltus.find_orbit(case.system, **case.start)
    bounds = (0.99 * case.frequency, 1.01 * case.frequency)
    family = saltus.continue_orbit(orbit, "load.frequency", (0.8 * case.frequency, bounds[1]))
    place = next(i for i, end in enumerate(family.ends) if str(end.reason.code) == "image")
    last = family.orbits[-place]
    parent = saltus.continue_orbit(
        last, "load.frequency", (last.frequency * 0.99, last.frequency * 1.01)
    )
    assert 2 * parent.orbits[0].period == orbit.period
    assert [str(point.kind) for point in parent.special] == ["PD"]
    assert parent.special[0].parameter == pytest.approx(last.frequency, abs=1e-10)


def test_a_torus_between_the_last_point_of_a_step_and_a_grazing_is_found() -> None:
    """The pair of multipliers that leaves the circle there has become real, and one of them has
    no bound, at the grazing itself: no value on either side showed it."""
    case = random_case("chain", 60)
    orbit = saltus.find_orbit(case.system, **case.start)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.43, case.frequency))
    graze, torus = sorted(branch.special, key=lambda point: point.parameter)[:2]
    assert [str(graze.kind), str(torus.kind)] == ["GR", "NS"]
    assert torus.parameter - graze.parameter < 2e-4
    # the pair by differences of motions over one period
    system = case.system.with_({"load.frequency": torus.parameter})
    start = torus.orbit.start()
    state = np.array([start["x"], start["y"], *start["velocity"]])
    steps = 1e-6 * np.eye(4)
    ends = [
        np.subtract(
            *(
                saltus.simulate(
                    system,
                    x=at[0],
                    y=at[1],
                    velocity=tuple(at[2:]),
                    time=start["time"],
                    periods=torus.orbit.period,
                ).final_state
                for at in (state + step, state - step)
            )
        )
        / 2e-6
        for step in steps
    ]
    pair = np.linalg.eigvals(np.array(ends).T)
    assert np.sort(np.abs(pair))[-2:] == pytest.approx([1.0, 1.0], abs=1e-4)
    assert abs(pair.imag).max() > 0.1
    # from beyond it
    beyond = min(branch.orbits, key=lambda each: abs(each.frequency - torus.parameter + 5e-5))
    again = saltus.continue_orbit(beyond, "load.frequency", (0.4328, 0.434))
    assert [point.parameter for point in again.special if str(point.kind) == "NS"] == pytest.approx(
        [torus.parameter], abs=1e-9
    )


MODELS = int(os.environ.get("SALTUS_MODELS", "6"))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(MODELS))
@pytest.mark.parametrize("kind", KINDS)
def test_branches_and_verdicts_are_the_same_in_all_units(kind: str, seed: int) -> None:
    check(random_case(kind, seed), verdict=True)


@pytest.mark.parametrize(
    "begun_and_asked",
    [
        pytest.param(((None, (1.0, 1.04)), (1.038, (1.0, 1.04))), id="one range"),
        pytest.param(
            ((None, (0.9, 1.2)), (None, (1.0, 1.04)), (1.038, (0.9, 1.2))),
            id="two ranges",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_a_branch_ends_at_one_place_where_grazings_accumulate(begun_and_asked: Any) -> None:
    """Begun beyond the grazings and among them."""
    case = random_case("absorber", 9)
    found = []
    for frequency, bounds in begun_and_asked:
        numbers = list(case.numbers)
        numbers[3] = frequency or 1.039
        begun = replace(case, numbers=tuple(numbers))
        orbit = saltus.find_orbit(begun.system, **begun.start)
        branch = saltus.continue_orbit(orbit, "load.frequency", bounds)
        end = next(end for end in branch.ends if str(end.reason.code) == "accumulates")
        inside = sorted((p.parameter, str(p.kind)) for p in branch.special if p.parameter < 1.04)
        found.append((end.parameter, inside))
    for parameter, inside in found[1:]:
        assert parameter == pytest.approx(found[0][0], abs=1e-10)
        assert [kind for _, kind in inside] == [kind for _, kind in found[0][1]]


@pytest.mark.thorough
@pytest.mark.parametrize("case", [ELEVEN, FAMILY], ids=["eleven", "family"])
def test_long_branches_are_the_same_in_all_units(case: Case) -> None:
    check(case)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(MODELS))
@pytest.mark.parametrize("kind", KINDS)
def test_branches_are_the_same_begun_elsewhere(kind: str, seed: int) -> None:
    try:
        saltus.find_orbit(random_case(kind, seed).system, **random_case(kind, seed).start)
    except SaltusError:
        pytest.skip("no orbit")
    begun_elsewhere(random_case(kind, seed))
