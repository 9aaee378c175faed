"""A block that creeps to where it sticks for good: one answer of all verbs, with a part beside it.

Under f cos(w t), pulled by a spring k to 0 and held by a dry friction F, it stands for good where
f + k abs(x) <= F. From the border of these places its slips are as the square of its distance e
from there: de/dn = -C e^2, so that e = 1 / (C n) after n periods. Nothing it passes is an orbit.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus

FORCE, LIMIT = 0.15, 0.2
BORDER = -(LIMIT - FORCE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Block(saltus.ContactModel):
    """x'' + x = f cos(w t) and a dry friction."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def frictions(self):
        return (saltus.Friction(name="ground", coordinate="x", kinetic=LIMIT, static=LIMIT),)

    def normal_forces(self, t, x, velocity, load):
        return (1.0,)

    def force(self, t, x, velocity, load):
        return load.force(t) - x


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside(Block):
    """The block, and an oscillator on which nothing acts."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")

    def normal_forces(self, t, q, velocity, load):
        return (1.0,)

    def force(self, t, q, velocity, load):
        return load.force(t) - q[0], -2.1 * q[1] - 0.4 * velocity[1]


CASES = [(Block, {}), (Beside, {"y": 0.0}), (Beside, {"y": 0.3})]


def loaded(kind, frequency):
    return saltus.System(
        model=kind(),
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=FORCE)),
    )


@pytest.mark.parametrize("frequency", [1.5])
@pytest.mark.parametrize(("kind", "more"), CASES)
def test_a_block_that_creeps_is_undecided_by_name_in_every_verb(kind, more, frequency):
    system = loaded(kind, frequency)
    verdict = saltus.classify(system, x=-0.06, **more)
    assert str(verdict.kind) == "undecided"
    assert "creeps to where it sticks for good" in verdict.reason
    with pytest.raises(saltus.MotionError, match="creeps to where it sticks for good"):
        saltus.find_orbit(system, x=-0.06, **more)
    sweep = saltus.frequency_sweep(system, [frequency, 1.0001 * frequency], x=-0.06, **more)
    assert set(np.ravel(sweep.outcome.values)) == {"undecided"}


def test_it_comes_to_the_border_as_one_over_n():
    """A slip that begins at e - a t^2 / 2 = 0 lasts 3 T, T = sqrt(2 e / a), and is 9 e T^2 / 4 long."""
    frequency = 0.7
    expected = 4.5 / (FORCE * frequency**2)
    inverse = []
    for periods in (1000, 2000):
        motion = saltus.simulate(loaded(Block, frequency), x=-0.06, periods=periods, dense=False)
        inverse.append(1.0 / (BORDER - motion.final_state[0]))
    assert (inverse[1] - inverse[0]) / 1000.0 == pytest.approx(expected, rel=1e-3)


def test_a_slow_orbit_of_a_block_is_none_that_creeps():
    """A multiplier that is 1 but for a small damping is no double root."""
    belt = saltus.System(
        model=saltus.BeltOscillator(damping=2e-5, belt_speed=50.0, kinetic=0.1, static=0.1),
        load=saltus.Load(frequency=0.7, force=saltus.Harmonic(amplitude=0.1)),
    )
    orbit = saltus.find_orbit(belt, x=0.1, settle=0, period=1)
    turn = 2.0 * math.pi / 0.7
    assert abs(orbit.multipliers[0]) == pytest.approx(math.exp(-1e-5 * turn), abs=1e-9)
    assert not orbit.creeps
    assert orbit.stable
