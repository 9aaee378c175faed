"""A rimless wheel: legs that swap, and the slope on which it stops
================================================================

At each strike the next spoke takes over, and the speed falls by cos(2 a): the state is reset.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Wheel(saltus.ContactModel):
    half_angle: float = 0.4
    slope: float = 0.1
    coordinates: ClassVar = ("angle",)
    surfaces: ClassVar = (saltus.Surface(name="strike", function="low", after_event="next_spoke"),)

    def low(self, t, angle, velocity, load):
        return angle - self.slope - self.half_angle

    def next_spoke(self, t, angle, velocity, load):
        return angle - 2.0 * self.half_angle, np.cos(2.0 * self.half_angle) * velocity

    def force(self, t, angle, velocity, load, sides):
        return np.sin(angle)


orbit = saltus.find_orbit(saltus.System(model=Wheel()), angle=-0.3, velocity=0.5)
branch = saltus.continue_orbit(orbit, "model.slope", (0.05, 0.2))
print(f"multiplier {orbit.multipliers[0].real:.12f}, cos^2(2 a) = {math.cos(0.8) ** 2:.12f}")
print(branch.ends[0])
plt.plot(branch.parameters, [found.period for found in branch.orbits])
plt.gca().set(xlabel="slope", ylabel="time of a step")
assert abs(orbit.multipliers[0] - math.cos(0.8) ** 2) < 1e-10
