"""Two blocks on rough ground that move alike: their events come at one instant, each with its own
derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

import saltus
from saltus.orbits.beyond.symmetry import full_period
from saltus.systems.loads.load import reversed_load

DAMPING, COUPLING, FRICTION, FREQUENCY = 0.1, 0.5, 0.2, 0.7


@dataclass(frozen=True, kw_only=True)
class TwoBlocks(saltus.ContactModel):
    """x'' = F - x - C x' - k (x - y) + f_x, and y likewise; the mirror swaps them."""

    damping: float = DAMPING
    coupling: float = COUPLING
    friction: float = FRICTION

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    images: ClassVar[tuple[str, ...]] = ("y", "x")

    @property
    def frictions(self) -> tuple[saltus.Friction, ...]:
        return tuple(
            saltus.Friction(
                name=f"ground_{c}", coordinate=c, kinetic=self.friction, ground_speed=0.0
            )
            for c in "xy"
        )

    def force(self, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
        (x, y), (v, w), force = theta, velocity, load.force(t)
        apart = self.coupling * (x - y)
        return force - x - self.damping * v - apart, force - y - self.damping * w + apart

    def mirror(self, load: saltus.Load) -> saltus.Load:
        return reversed_load(load, "force")


@pytest.fixture(scope="module")
def orbit() -> saltus.PeriodicOrbit:
    """The motion in step, in which both turn round at one instant twice a period and never
    stick.
    """
    load = saltus.Load(frequency=FREQUENCY, force=saltus.Harmonic(amplitude=1.0))
    return saltus.find_orbit(
        saltus.System(model=TwoBlocks(), load=load), x=0.2, y=-0.1, velocity=(0.1, 0.0)
    )


def map_of_mode(orbit: saltus.PeriodicOrbit, stiffness: float) -> np.ndarray:
    """Of the sum or of the difference of both blocks, in closed form: a linear oscillator, whose
    speed is multiplied by the ratio of the accelerations after and before each turn."""
    motion = orbit.motion(tol=1e-14)
    turns = sorted({round(event.time, 9): event.time for event in motion.events}.values())
    assert len(turns) == 2
    smooth, total, time = np.array([[0.0, 1.0], [-stiffness, -DAMPING]]), np.eye(2), motion.start
    for turn in turns:
        pull = float(orbit.system.load.force(turn)) - float(motion.at(turn)[0][0])
        before = np.sign(motion.at(turn - 1e-3)[1][0])
        ratio = (pull + FRICTION * before) / (pull - FRICTION * before)
        total, time = np.diag([1.0, ratio]) @ expm(smooth * (turn - time)) @ total, turn
    return expm(smooth * (motion.start + 2 * pi / FREQUENCY - time)) @ total


def test_multipliers_of_blocks_in_step_are_those_of_their_sum_and_difference(
    orbit: saltus.PeriodicOrbit,
) -> None:
    """Over half a period with the mirror image, and over the full one."""
    expected = np.concatenate(
        [np.linalg.eigvals(map_of_mode(orbit, k)) for k in (1.0, 1.0 + 2.0 * COUPLING)]
    )
    assert orbit.symmetric
    for found in (orbit, full_period(orbit)):
        apart = np.abs(found.multipliers[:, None] - expected)
        assert apart.min(axis=0).max() < 1e-9
        assert apart.min(axis=1).max() < 1e-9


@pytest.mark.parametrize(("frequency", "friction"), [(0.3, 0.4), (FREQUENCY, FRICTION)])
def test_nothing_happens_along_a_branch_of_blocks_in_step(
    frequency: float, friction: float
) -> None:
    """With sticking and without, whose events rounding puts in one order or the other."""
    load = saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=1.0))
    system = saltus.System(model=TwoBlocks(friction=friction), load=load)
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, x=0.2, y=-0.1, velocity=(0.1, 0.0)),
        "load.frequency",
        (0.9 * frequency, 1.1 * frequency),
    )
    assert [end.parameter for end in branch.ends] == pytest.approx(
        [0.9 * frequency, 1.1 * frequency]
    )
    assert not branch.special
    assert max(orbit.defect for orbit in branch.orbits) < 1e-11
