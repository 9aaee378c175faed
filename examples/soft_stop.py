"""
A soft stop with two coordinates
================================

A mass with a soft stop, and a smaller one on a spring to it. The response touches the stop where
linear theory says, and bends to a fold, before which there are two attractors."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import saltus


@dataclass(frozen=True, kw_only=True)
class SoftStop(saltus.ContactModel):
    """x'' = F - x - 0.1 x' + p, less 20 (x - 1/2) + 0.3 x' beyond 1/2, and 0.2 y'' = -p with p =
    0.3 (y - x) + 0.02 (y' - x').
    """

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[tuple[saltus.Surface, ...]] = (
        saltus.Surface(name="stop", coordinate="x", position=0.5),
    )

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, 0.2]]

    def force(self, t, q, velocity, load, sides):
        pressed = (1 + sides.stop) / 2 * (20.0 * (q[0] - 0.5) + 0.3 * velocity[0])
        pull = 0.3 * (q[1] - q[0]) + 0.02 * (velocity[1] - velocity[0])
        return load.force(t) - q[0] - 0.1 * velocity[0] - pressed + pull, -pull


def beyond(w):
    """The amplitude of x by which the linear system would reach beyond the stop, at a frequency."""
    stiff, damp = np.array([[1.3, -0.3], [-0.3, 0.3]]), np.array([[0.12, -0.02], [-0.02, 0.02]])
    return (
        abs(np.linalg.solve(stiff - w**2 * np.diag([1.0, 0.2]) + 1j * w * damp, [0.3, 0.0])[0])
        - 0.5
    )


touched = [brentq(beyond, 0.5, 0.6, xtol=1e-15), brentq(beyond, 0.95, 1.05, xtol=1e-15)]
soft = saltus.System(model=SoftStop(), load=saltus.Load(frequency=0.9, force=saltus.Harmonic(0.3)))
branch = saltus.continue_orbit(saltus.find_orbit(soft, x=0.0, y=0.0), "load.frequency", (0.4, 1.3))
fold = max(point.parameter for point in branch.special if point.kind == "LP")
sweep = saltus.frequency_sweep(soft, np.linspace(0.9, 1.1, 41), x=0.0, y=0.0)
before = soft.with_({"load.frequency": 0.5 * (touched[1] + fold)})
window = ((-2.0, 0.5), (-2.0, 2.0), (-2.0, 2.0), (-2.0, 2.0))
verdict = saltus.classify(before, x=0.0, y=0.0)
found = saltus.find_attractors(before, starts=64, window=window)
basins = saltus.basins_of_attraction(
    before, found=found, x=np.linspace(-2, 0.5, 40), x_velocity=np.linspace(-2, 2, 40)
)
print(f"touches at {touched[1]:.12f}, fold at {fold:.12f}; {verdict}; {found}")

figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
saltus.plot(branch, ax=axes[0])
saltus.plot(basins, ax=axes[1])

# the first and the last orbit that cross the stop are next to those that linear theory touches it
# by
frequency = np.array([orbit.frequency for orbit in branch.orbits])
crossing = np.flatnonzero([len(orbit.motion().events) > 0 for orbit in branch.orbits])
assert frequency[crossing[0] - 1] <= touched[0] <= frequency[crossing[0]]
assert frequency[crossing[-1]] <= touched[1] <= frequency[crossing[-1] + 1]
up = sweep.sel(jump=sweep.jump_direction == "up")
assert up.jump_before - 1e-4 < fold < up.jump_after + 1e-4  # the experiment jumps at the fold
assert len(found) == 2
assert verdict.period == 1
