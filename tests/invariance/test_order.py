"""The order in which frictions and coordinates are declared decides nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus

JOINT = saltus.Friction(name="joint", coordinate={"y": 1.0, "x": -1.0}, kinetic=0.6, static=1.0)
GROUND = saltus.Friction(name="ground", coordinate="x", kinetic=0.5, static=0.7)


@dataclass(frozen=True, kw_only=True)
class Stack(saltus.ContactModel):
    """A block y rides on a block x that slides to a stop under a pull on y."""

    pull: float = 0.9

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    frictions = (JOINT, GROUND)

    def normal_forces(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return 1.0, 1.0

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return 0.0, -self.pull


@dataclass(frozen=True, kw_only=True)
class Swapped(Stack):
    frictions = Stack.frictions[::-1]


@pytest.mark.parametrize("kind", [Stack, Swapped])
def test_a_joint_that_can_hold_goes_on_holding(kind: type) -> None:
    """The ground, which holds 0.7, cannot hold the pull of 0.9, while the joint holds 1.0: both
    slide together, with 1 / 2 (0.5 + 0.9) against the motion and 1 / 2 (0.9 - 0.5) back.
    """
    motion = saltus.simulate(
        saltus.System(model=kind()), x=0.0, y=0.0, velocity=(0.7, 0.7), duration=2.0
    )
    assert [(str(event.kind), event.contact) for event in motion.events] == [("reversal", "ground")]
    assert motion.events[0].time == pytest.approx(0.7 / 0.7, abs=1e-13)
    np.testing.assert_allclose(motion.velocity, [-0.2, -0.2], rtol=0, atol=1e-13)
    assert motion.validity.ties == 0


@dataclass(frozen=True)
class RandomStack:
    """Numbers of bodies on a line, with frictions on the ground and between neighbours."""

    mass: np.ndarray
    stiffness: np.ndarray
    coupling: np.ndarray
    amplitude: np.ndarray
    velocity: np.ndarray
    frequency: float
    frictions: tuple[tuple[int, int, float, float], ...]  # place, place or -1, kinetic, static

    @classmethod
    def of(cls, rng: np.random.Generator) -> RandomStack:
        """One with as many frictions as bodies, all of them with static above kinetic."""
        size = int(rng.integers(2, 4))
        pairs = [(i, i - 1) for i in range(size)]  # of the first one -1: the ground
        frictions = []
        for i, other in pairs:
            kinetic = float(rng.uniform(0.2, 0.8))
            frictions.append((i, other, kinetic, kinetic * float(rng.uniform(1.1, 1.8))))
        return cls(
            rng.uniform(0.5, 2.0, size),
            rng.uniform(0.0, 1.2, size),
            rng.uniform(0.0, 1.0, size) * (rng.random(size) < 0.4),
            rng.uniform(0.2, 1.6, size),
            rng.choice([0.0, 0.7, -0.4], size),
            float(rng.uniform(0.5, 1.5)),
            tuple(frictions),
        )

    def system(self, places: tuple[int, ...], order: tuple[int, ...]) -> saltus.System:
        """With coordinates and frictions declared in these orders."""

        def force(_: Any, t: Any, q: Any, v: Any, load: Any) -> Any:
            at = {place: q[i] for i, place in enumerate(places)}
            pull = {
                i: load.force(t) * float(self.amplitude[i]) - float(self.stiffness[i]) * at[i]
                for i in places
            }
            for i in range(1, len(places)):
                back = float(self.coupling[i]) * (at[i] - at[i - 1])
                pull[i] = pull[i] - back
                pull[i - 1] = pull[i - 1] + back
            return tuple(pull[i] for i in places)

        frictions = []
        for k in order:
            one, other, kinetic, static = self.frictions[k]
            along = {f"x{one}": 1.0} | ({f"x{other}": -1.0} if other >= 0 else {})
            frictions.append(
                saltus.Friction(name=f"rub_{k}", coordinate=along, kinetic=kinetic, static=static)
            )
        parts = {
            "coordinates": tuple(f"x{i}" for i in places),
            "channels": ("force",),
            "frictions": tuple(frictions),
            "force": force,
            "mass_matrix": lambda _, q: [
                [float(self.mass[i]) * (i == j) for j in places] for i in places
            ],
            "normal_forces": lambda *_: (1.0,) * len(frictions),
            "__module__": __name__,
        }
        model = dataclass(frozen=True)(type("Bodies", (saltus.ContactModel,), parts))()
        load = saltus.Load(frequency=self.frequency, force=saltus.Harmonic(amplitude=1.0))
        return saltus.System(model=model, load=load)

    def answer(self, places: tuple[int, ...], order: tuple[int, ...]) -> tuple[Any, ...]:
        """Events, and state and its derivatives by the bodies, of one motion."""
        system = self.system(places, order)
        found = saltus.sensitivities(
            system,
            velocity=tuple(float(self.velocity[i]) for i in places),
            duration=15.0,
            **{f"x{i}": 0.0 for i in places},
        )
        motion = found.motion
        names = [(round(event.time, 7), str(event.kind), event.contact) for event in motion.events]
        names = [row for row in names if row[1] != "rest"]
        size = len(places)
        back = np.argsort(places)
        both = [*back, *(size + back)]
        state = np.append(motion.position, motion.velocity)[both]
        return sorted(names), state, found.state[np.ix_(both, both)]


def differences(seed: int) -> tuple[int, float]:
    """How many events a random stack has, and how much it differs in other orders."""
    rng = np.random.default_rng([seed, 43])
    stack = RandomStack.of(rng)
    size = len(stack.mass)
    straight = tuple(range(size))
    events, state, slopes = stack.answer(straight, straight)
    worst = 0.0
    for places in (straight, straight[::-1]):
        others, other_state, other_slopes = stack.answer(places, straight[::-1])
        assert others == events, seed
        worst = max(worst, float(np.abs(other_state - state).max()))
        assert np.array_equal(np.isnan(other_slopes), np.isnan(slopes)), seed
        worst = max(worst, float(np.nanmax(np.abs(other_slopes - slopes), initial=0.0)))
    return len(events), worst


def test_motions_and_derivatives_do_not_depend_on_the_order_of_frictions_and_coordinates() -> None:
    count = 0
    for seed in range(3):
        events, worst = differences(seed)
        count += events
        assert worst < 1e-8, seed
    assert count > 20


@pytest.mark.thorough
def test_many_motions_do_not_depend_on_the_order_of_frictions_and_coordinates() -> None:
    for seed in range(3, 60):
        assert differences(seed)[1] < 1e-8, seed
