"""Symmetric orbits of two bodies that the mirror swaps: the gap between them stays, so that the
image of a state in coordinates of gaps is no swap of these.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from shared_systems import Row

import saltus


def pushed(model, amplitude, frequency):
    return saltus.System(
        model=model,
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude)),
        impact=saltus.NewtonImpact(e=0.7),
    )


@pytest.fixture(scope="module")
def hitting():
    """An orbit of two bodies that hit each other twice in a period."""
    system = pushed(Row(walls=False, length=0.02, bend=0.3), 0.2, 0.7)
    return saltus.find_orbit(system, a=0.005, b=0.015, velocity=(0.0, 0.0))


def after_a_period(system, state):
    a, b, *velocity = state.tolist()
    motion = saltus.simulate(system, a=a, b=b, velocity=tuple(velocity), periods=1, tol=1e-14)
    return motion.final_state


def test_an_orbit_of_two_bodies_that_hit_each_other_closes_on_its_image(hitting):
    assert hitting.symmetric
    assert len(hitting.motion().events) == 2
    state = hitting.section_state
    np.testing.assert_allclose(after_a_period(hitting.system, state), state, rtol=0, atol=1e-11)
    # the image is that of the other body
    motion = hitting.motion()
    times = motion.time - hitting.system.load.period * np.array([0.6, 0.1])
    (a, b), velocities = (np.array(values) for values in motion.at(times))
    np.testing.assert_allclose(b[1] - 0.01, 0.01 - a[0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(velocities[1, 1], -velocities[0, 0], rtol=0, atol=1e-11)


def test_its_multipliers_are_differences_of_motions(hitting):
    state, step = hitting.section_state, 1e-6
    slope = np.empty((4, 4))
    for j in range(4):
        ends = [
            after_a_period(hitting.system, state + sign * np.eye(4)[j]) for sign in (step, -step)
        ]
        slope[:, j] = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(slope)),
        np.sort_complex(hitting.multipliers),
        rtol=0,
        atol=1e-7,
    )


def test_it_is_proved(hitting):
    assert saltus.prove(hitting).proved


def test_bodies_that_do_not_touch_have_the_orbits_of_each_between_walls():
    """The gap between them follows from the others, and stays open."""
    both, apart = (
        saltus.find_orbit(pushed(Row(between=between), 0.3, 1.1), a=0.5, b=1.5, velocity=(0.1, 0.0))
        for between in (True, False)
    )
    assert both.symmetric
    assert apart.symmetric
    np.testing.assert_allclose(
        np.sort_complex(both.multipliers), np.sort_complex(apart.multipliers), rtol=0, atol=1e-10
    )


@dataclass(frozen=True, kw_only=True)
class Between(saltus.ContactModel):
    """A body m between a and b, which the mirror swaps: m - factor a and m - factor b are gaps."""

    factor: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("a", "b", "m")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self):
        low, high = ({"m": 1.0, name: -self.factor} for name in "ab")
        return (
            saltus.Contact(name="low", coordinate=low, position=-0.2),
            saltus.Contact(name="high", coordinate=high, position=0.2, sign=-1),
        )

    def force(self, t, q, velocity, load):
        a, b, m = q
        return (
            0.1 * (m - a) - a - 0.1 * velocity[0],
            0.1 * (m - b) - b - 0.1 * velocity[1],
            load.force(t) - 0.5 * m - 0.1 * velocity[2] + 0.1 * (a + b - 2.0 * m),
        )


def test_a_factor_of_a_gap_moves_the_image_along_a_branch():
    """Every orbit closes; where gaps would take the places of other coordinates the branch ends."""
    system = saltus.System(
        model=Between(),
        load=saltus.Load(frequency=1.1, force=saltus.Harmonic(0.5)),
        impact=saltus.NewtonImpact(e=0.5),
    )
    orbit = saltus.find_orbit(system, a=0.0, b=0.0, m=0.0, velocity=(0.0, 0.0, 0.1))
    assert orbit.symmetric
    branch = saltus.continue_orbit(orbit, "model.factor", bounds=(0.95, 1.05))
    assert branch.orbits[0].system.model.factor == 0.95
    for member in (branch.orbits[0], branch.orbits[len(branch.orbits) // 2], branch.orbits[-1]):
        state = member.section_state
        a, b, m, *velocity = state.tolist()
        motion = saltus.simulate(
            member.system, a=a, b=b, m=m, velocity=tuple(velocity), periods=1, tol=1e-14
        )
        np.testing.assert_allclose(motion.final_state, state, rtol=0, atol=1e-10)
    assert "outgrows" in str(branch.ends[1])
