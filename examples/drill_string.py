"""A drill string: the stick-slip of its bit, and the speed at which it ends
=========================================================================

A motor turns the top at a constant speed; pipe and bit are discs on torsional springs. Angles are
counted from the top, so that the rock turns backwards. The bit sticks and slips up to the speed at
which it only just comes to a stop; there it may turn steadily as well.
"""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt

import saltus


@dataclass(frozen=True, kw_only=True)
class DrillString(saltus.ContactModel):
    speed: float = 1.1
    coordinates: ClassVar = ("pipe", "bit")
    channels: ClassVar = ()

    @property
    def frictions(self):
        rock = {"kinetic": 0.5, "static": 1.0, "ground_speed": -self.speed}
        return (saltus.Friction(name="rock", coordinate="bit", **rock),)

    def force(self, t, q, velocity, load):
        (pipe, bit), (u, v) = q, velocity
        torque = 2.0 * (pipe - bit) + 0.05 * (u - v)
        return (-pipe - 0.05 * u - torque) / 0.5, torque


string = saltus.System(model=DrillString())
cycle = saltus.find_orbit(string, pipe=-0.3, bit=-0.5, velocity=(-0.9, -1.1))
branch = saltus.continue_orbit(cycle, "model.speed", (0.1, 2.0))
critical = branch.special[-1]
assert (str(critical.kind), round(critical.parameter, 8)) == ("GS", 1.18499080), branch
saltus.plot(branch, ax=plt.gca())
plt.show()
