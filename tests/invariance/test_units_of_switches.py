"""Switches in a force do not depend on the units of length and time."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus


@dataclass(frozen=True, kw_only=True)
class TwoMasses(saltus.ContactModel):
    """Two masses on springs, with a buffer between them that pushes from a clearance on."""

    stiffness: float = 1.0
    coupling: float = 2.0
    damping: float = 0.05
    buffer: float = 3.0
    clearance: float = 0.02
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        depth = x - y - self.clearance
        push = self.coupling * (x - y) + np.where(depth > 0.0, self.buffer * depth, 0.0)
        own = self.stiffness * x + self.damping * u
        return load.force(t) - own - push, push - self.stiffness * y - self.damping * v


def end_and_events(time, length):
    """The end of a motion and the instants of its events, in the units in which it is given."""
    model = TwoMasses(
        stiffness=1.0 / time**2,
        coupling=2.0 / time**2,
        damping=0.05 / time,
        buffer=3.0 / time**2,
        clearance=0.02 * length,
    )
    load = saltus.Load(frequency=1.1 / time, force=saltus.Harmonic(0.8 * length / time**2))
    start = {"x": 0.1 * length, "y": 0.0, "velocity": (0.2 * length / time, 0.0)}
    motion = saltus.simulate(saltus.System(model=model, load=load), **start, periods=30)
    instants = [event.time / time for event in motion.events]
    return np.array([motion.x, motion.y]) / length, np.array(instants)


@pytest.mark.parametrize("time", [1e-9, 1e-6, 1e-3, 1e6])
@pytest.mark.parametrize("length", [1e-6, 1e6])
def test_a_switch_in_a_force_knows_no_units(time, length):
    end, instants = end_and_events(1.0, 1.0)
    assert len(instants) > 50
    end_here, instants_here = end_and_events(time, length)
    assert len(instants_here) == len(instants)
    np.testing.assert_allclose(end_here, end, atol=1e-12)
    np.testing.assert_allclose(instants_here, instants, atol=1e-11)
