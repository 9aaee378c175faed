"""Friction that falls with the speed: steady sliding beside stick-slip
====================================================================

The friction of a mass on a belt falls with the sliding speed, as Stribeck has it. Sliding on while
the mass stands nearly still is stable where its damping exceeds the fall, c > (mu_s - mu_k) / v_s
exp(-w / v_s), and beside it is a large cycle in which the mass sticks and slips. Under a small
force both are orbits: that of stick-slip is locked to the force between two folds, and drifts
outside of them.
"""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Belt(saltus.ContactModel):
    """x'' + c x' + x = F(t) + mu(u), u = abs(x' - w)."""

    damping: float = 0.05
    speed: float = 0.8
    fall: float = 0.2  # v_s

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def frictions(self):
        given = {
            "kinetic": 0.15,
            "static": 0.3,
            "ground_speed": self.speed,
            "stribeck_speed": self.fall,
        }
        return (saltus.Friction(name="belt", coordinate="x", **given),)

    def force(self, t, x, velocity, load):
        return load.force(t) - x - self.damping * velocity


system = saltus.System(model=Belt(), load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.01)))
slides, sticks = (
    saltus.find_orbit(system, x=x, velocity=v) for x, v in ((0.15, 0.3), (-0.25, 0.72))
)
branch = saltus.continue_orbit(sticks, "load.frequency", (0.9, 1.1))
folds = sorted(point.parameter for point in branch.special)
found = saltus.find_attractors(system, window=((-1.5, 1.5), (-1.5, 1.5)), starts=128)
swept = saltus.frequency_sweep(
    system, np.linspace(0.98, 1.02, 9), periods=300, x=-0.25, velocity=0.72
)
print(
    slides,
    sticks,
    saltus.classify(system, x=-0.25, velocity=0.72),
    f"folds at {folds}",
    found,
    sep="\n",
)
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
for motion, name in ((slides.motion(), "slides"), (sticks.motion(), "sticks and slips")):
    left.plot(*motion.at(np.linspace(motion.start, motion.time, 800)), label=name)
left.set(xlabel="$x$", ylabel="$x'$")
left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
right.plot(branch.parameters, branch.amplitudes, "r--")
right.plot(branch.parameters, np.where(branch.stable, branch.amplitudes, np.nan), "b-")
right.plot(swept["value"], swept["amplitude"].values.T, "k.")
right.legend(
    ["unstable", "stable", "sweep"],
    loc="lower center",
    bbox_to_anchor=(0.5, 1.0),
    ncols=3,
    frameon=False,
)
right.set(xlabel="frequency of the force", ylabel="amplitude")
# Liouville: areas shrink by the integral of c + mu'(u) over the orbit, which slides backwards
motion = slides.motion()
time = np.linspace(motion.start, motion.time, 2001)
_, velocity = motion.at(time)
shrinks = np.trapezoid(0.05 - 0.15 / 0.2 * np.exp((velocity - 0.8) / 0.2), time)
assert abs(np.prod(slides.multipliers).real - np.exp(-shrinks)) < 1e-10
