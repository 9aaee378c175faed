"""Brake squeal: a cycle without a load, and the Hopf point of which it is born
============================================================================

A mass on a spring rubs on a disc whose friction falls with the sliding speed. On a slow disc it
sticks and slips. On a faster one an equilibrium attracts, too, and a cycle that only slips lies
between the two. Nothing forces the mass: the period is an unknown.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt

import saltus


@dataclass(frozen=True, kw_only=True)
class Brake(saltus.ContactModel):
    """x'' + 0.1 x' + x = mu(u), u = abs(x' - speed), mu = 0.2 + 0.3 exp(-u / 0.5)."""

    speed: float = 0.3
    coordinates: ClassVar = ("x",)
    channels: ClassVar = ()

    @property
    def frictions(self):
        falling = {"kinetic": 0.2, "static": 0.5, "stribeck_speed": 0.5}
        return (saltus.Friction(name="disc", coordinate="x", ground_speed=self.speed, **falling),)

    def force(self, t, x, velocity, load):
        return -x - 0.1 * velocity


cycle = saltus.find_orbit(saltus.System(model=Brake()), x=1.0)
branch = saltus.continue_orbit(cycle, "model.speed", (0.05, 2.0))
hopf = 0.5 * math.log(0.3 / (0.5 * 0.1))  # where the damping equals the fall of the friction
assert abs(branch.ends[1].parameter - hopf) < 1e-8, branch.ends
saltus.plot(branch, ax=plt.gca())
plt.show()
