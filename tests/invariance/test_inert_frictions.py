"""Frictions whose coefficients are 0 change nothing: not a motion, nor what is found with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus

SLIDING = saltus.Friction(name="rub", coordinate="s", kinetic=0.1, static=0.13)


@dataclass(frozen=True, kw_only=True)
class Pile(saltus.ContactModel):
    """A body b on a body a that bounces on a floor, and a body s with friction beside them."""

    coordinates: ClassVar[tuple[str, ...]] = ("a", "b", "s")
    channels: ClassVar[tuple[str, ...]] = ("force", "side")
    thickness: float = 0.1
    coefficient: float = 0.0  # of frictions that belong to `Inert` alone

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="floor", coordinate="a", position=0.0),
            saltus.Contact(
                name="on",
                coordinate={"b": 1.0, "a": -1.0},
                position=self.thickness,
                restitution=0.3,
            ),
        )

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (SLIDING,)

    def normal_forces(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return tuple(1.0 for _ in self.frictions)

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.7]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return load.force(t) - 1.0, -0.5, load.side(t) - 0.3 * q[2]


class Inert(Pile):
    """The same with frictions along both gaps, one of them on ground that moves."""

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        mu = self.coefficient
        return (
            saltus.Friction(name="guide", coordinate="a", kinetic=mu),
            SLIDING,
            saltus.Friction(
                name="between",
                coordinate={"b": 1.0, "a": -1.0},
                kinetic=mu,
                static=mu,
                ground_speed=0.2,
            ),
        )


class WithoutPlaces(Pile):
    """The same with frictions along b and along a sum, which contacts leave no place."""

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        mu = self.coefficient
        return (
            saltus.Friction(name="along", coordinate="b", kinetic=mu, ground_speed=0.1),
            SLIDING,
            saltus.Friction(name="both", coordinate={"b": 1.0, "a": 1.0}, kinetic=mu),
        )


class Roofed(Pile):
    """The pile under a roof, so that a gap follows from the others, without any friction."""

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        roof = saltus.Contact(name="roof", coordinate="b", sign=-1, position=2.0)
        return (*super().contacts, roof)

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return ()


class RoofedInert(Roofed):
    """The same with a friction without force, and one in a contact."""

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (
            saltus.Friction(name="guide", coordinate="b", kinetic=self.coefficient),
            saltus.Friction(name="in", coordinate="s", contact="floor", kinetic=0.0),
        )


def drawn(seed: int, *kinds: type[Pile]) -> tuple[saltus.System, saltus.System, dict[str, Any]]:
    u = np.random.default_rng(seed).uniform
    thickness = u(0.1, 0.5)
    load = saltus.Load(
        frequency=u(0.7, 3.0),
        force=saltus.Harmonic(u(0.5, 2.5)),
        side=saltus.Harmonic(u(0.05, 0.5), phase=0.4),
    )
    law = saltus.NewtonImpact(e=u(0.0, 0.8))
    plain, inert = (
        saltus.System(model=kind(thickness=thickness), load=load, impact=law)
        for kind in kinds or (Pile, Inert)
    )
    return plain, inert, {"a": 0.3, "b": 0.3 + 2.0 * thickness, "s": 0.0}


def events_of(system: saltus.System, start: dict[str, Any]) -> list[tuple[float, str, str]]:
    motion = saltus.simulate(system, periods=5, velocity=(0.0, 0.0, 0.0), **start)
    return [(event.time, str(event.contact), str(event.kind)) for event in motion.events]


def compare(seed: int, *kinds: type[Pile]) -> int:
    plain, inert, start = drawn(seed, *kinds)
    events, same = events_of(plain, start), events_of(inert, start)
    assert [what for _, *what in events] == [what for _, *what in same]
    times = [time for time, *_ in events]
    assert [time for time, *_ in same] == pytest.approx(times, abs=1e-9)
    return len(events)


def test_motions_of_piles() -> None:
    """In each some impacts accumulate, in most on both contacts at one instant."""
    assert sum(compare(seed) for seed in range(12)) > 100


@pytest.mark.parametrize("kinds", [(Pile, WithoutPlaces), (Roofed, RoofedInert)])
def test_motions_of_piles_whose_contacts_leave_frictions_no_place(kinds: Any) -> None:
    """They were refused."""
    assert sum(compare(seed, *kinds) for seed in range(6)) > 50


def test_answers_beside_frictions_without_place() -> None:
    plain, inert, start = drawn(3, Pile, WithoutPlaces)
    starts = {name: np.array([value, value + 0.1]) for name, value in start.items()}
    ends = [saltus.simulate_many(system, periods=5, **starts) for system in (plain, inert)]
    for name in ("a", "b", "s", "impact_count"):
        assert ends[0][name].values == pytest.approx(ends[1][name].values, abs=1e-9)
    said = [saltus.classify(system, **start) for system in (plain, inert)]
    assert said[0].kind == said[1].kind
    motion = saltus.simulate(inert, periods=3, **start)
    assert abs(saltus.energies(motion).attrs["defect"]) < 1e-9
    assert all(motion.sliding[name] == 2 for name in motion.sliding if name != "rub")


@pytest.mark.parametrize("kind", [WithoutPlaces, RoofedInert])
def test_a_friction_without_place_gets_no_force(kind: type[Pile]) -> None:
    _, inert, start = drawn(3, Pile, kind)
    path = "model.coefficient"
    asked: dict[str, Any] = {"duration": 1.0, **start}
    with pytest.raises(saltus.ParameterError, match="each sum must be a coordinate of its own"):
        inert.with_({path: 0.1})
    with pytest.raises(saltus.ParameterError, match="cannot get a force here"):
        inert.in_gap_coordinates.with_({path: 0.1})
    with pytest.raises(saltus.ParameterError, match="each sum must be a coordinate of its own"):
        saltus.simulate_many(inert, parameters={path: np.array([0.0, 0.1])}, **asked)
    with pytest.raises(saltus.ParameterError, match=f"{path} cannot be varied here"):
        saltus.sensitivities(inert, parameters=[path], **asked)


def test_accumulations_of_a_pile_do_not_depend_on_the_time_asked_for() -> None:
    """Two that run into one another: a step to a later end is 1e8 times as long as a bounce."""
    plain, _, start = drawn(507)
    ends = [
        [
            (event.contact, event.kind, pytest.approx(event.time, abs=1e-12))
            for event in saltus.simulate(plain, velocity=(0.0,) * 3, **start, duration=end).events
            if event.time < 1.2319
        ]
        for end in (1.2319, 1.24, 3.0, 8.0)
    ]
    assert len(ends[0]) > 20
    assert all(events == ends[0] for events in ends[1:])


@pytest.mark.parametrize(
    ("coefficient", "seed"), [(0.02, 5), (0.02, 16), (0.02, 46), (0.1, 11), (0.1, 47), (0.3, 3)]
)
def test_piles_rest_on_frictions_along_their_gaps(coefficient: float, seed: int) -> None:
    """A body bounces while the other one rests on it, or is about to hit it: the friction along its
    gap turns with each bounce.
    """
    plain, _, start = drawn(seed)
    model = Inert(thickness=plain.model.thickness, coefficient=coefficient)
    rubbed = saltus.System(model=model, load=plain.load, impact=plain.impact)
    motion = saltus.simulate(rubbed, velocity=(0.0,) * 3, **start, periods=5)
    assert [event for event in motion.events if event.kind == "held" and "floor" in event.contact]
    assert saltus.energies(motion, periods=5).defect < 1e-10
    a, b, _ = motion.at(np.linspace(0.0, motion.time, 500))[0]
    assert min(a.min(), (b - a).min() - model.thickness) > -1e-12


@pytest.mark.thorough
@pytest.mark.parametrize("first", range(100, 600, 50))
def test_motions_of_many_piles(first: int) -> None:
    for seed in range(first, first + 50):
        compare(seed)


def test_lanes() -> None:
    for seed in range(3):
        plain, inert, start = drawn(seed)
        starts = {name: np.array([value, value + 0.1]) for name, value in start.items()}
        rest = (np.zeros(2), np.zeros(2), np.zeros(2))
        ends = [
            saltus.simulate_many(system, periods=5, velocity=rest, **starts)
            for system in (plain, inert)
        ]
        for name in ("a", "b", "s"):
            assert ends[0][name].values == pytest.approx(ends[1][name].values, abs=1e-9)
        assert (ends[0]["impact_count"].values == ends[1]["impact_count"].values).all()


def test_a_derivative_to_a_coefficient_of_0_is_one_sided() -> None:
    """That of a small coefficient, up to its size; the friction is not left out then."""
    system = drawn(1)[1]
    start = {"a": 0.3, "b": 1.5, "s": 0.0, "velocity": (0.1, -0.2, 0.3), "duration": 0.3}
    path = "model.coefficient"
    here = saltus.sensitivities(system, parameters=[path], **start)
    beside = saltus.sensitivities(system.with_({path: 1e-6}), parameters=[path], **start)
    assert here.parameters == pytest.approx(beside.parameters, abs=1e-5)
    assert np.abs(here.parameters).max() > 0.01


@dataclass(frozen=True, kw_only=True)
class Rubbing(saltus.ContactModel):
    """x'' + x = F + friction."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    coefficient: float = 0.0

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return (saltus.Friction(name="rub", coordinate="x", kinetic=self.coefficient),)

    def normal_forces(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return (1.0,)

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) - x


def test_lanes_that_vary_a_coefficient_from_0_on() -> None:
    load = saltus.Load(frequency=0.7, force=saltus.Harmonic(0.5))
    system = saltus.System(model=Rubbing(), load=load)
    values = np.array([0.0, 0.05])
    ends = saltus.simulate_many(
        system, parameters={"model.coefficient": values}, x=0.3, velocity=0.1, periods=3
    )
    for i, value in enumerate(values.tolist()):
        one = system.with_({"model.coefficient": value})
        motion = saltus.simulate(one, x=0.3, velocity=0.1, periods=3)
        assert float(ends["x"][i]) == pytest.approx(motion.position, abs=1e-9)
        assert bool(len(motion.events)) == (value > 0.0)


def test_coefficients_of_an_ensemble_beside_sums() -> None:
    _, inert, start = drawn(3)
    path = "model.coefficient"
    coefficients = np.array([0.0, 0.05, 0.1])
    asked: dict[str, Any] = {"velocity": (0.0, 0.0, 0.0), "duration": 2.0, **start}
    many = saltus.simulate_many(inert, parameters={path: coefficients}, **asked)
    for i, coefficient in enumerate(coefficients):
        one = saltus.simulate(inert.with_({path: float(coefficient)}), **asked)
        found = [float(many[name][i]) for name in ("a", "b", "s")]
        assert found == pytest.approx(one.final_state[:3], abs=1e-12)
