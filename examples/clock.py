"""A clock: a pendulum that is pushed along its velocity, between two stops
========================================================================

With x'' - 0.1 x' + x = 0 between x = -1 and x = 1, each impact takes what the pushes have given. The
beat is an unknown: it follows as one root from the growing spiral between the stops.
"""

from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import saltus


class Clock(saltus.ContactModel):
    coordinates: ClassVar = ("x",)
    contacts: ClassVar = (
        saltus.Contact(name="tick", coordinate="x", position=1.0, sign=-1),
        saltus.Contact(name="tock", coordinate="x", position=-1.0),
    )

    def force(self, t, x, velocity, load):
        return -x + 0.1 * velocity


def speed_missing(beat, e=0.8, push=0.05):
    """How much the last speed of the spiral from -1 to 1 in this time is more than v / e."""
    w, grown = np.sqrt(1.0 - push**2), np.exp(push * beat)
    cos, sin = np.cos(w * beat), np.sin(w * beat) / w
    v = (1.0 / grown + cos - push * sin) / sin
    return grown * (v * cos + sin + push * v * sin) - v / e


clock = saltus.System(model=Clock(), impact=saltus.NewtonImpact(0.8))
cycle = saltus.find_orbit(clock, x=0.0, velocity=1.5)
assert abs(cycle.period - 2.0 * brentq(speed_missing, 1.0, 2.0, xtol=1e-15)) < 1e-12
saltus.plot(cycle, figure=plt.figure(layout="constrained"))
plt.show()
