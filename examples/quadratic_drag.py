"""
A ball with quadratic drag
==========================

The drag k v abs(v) of a textbook as it stands: the heights of the bounces follow from one another
in closed form."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Ball(saltus.ContactModel):
    """y'' = -g - k y' abs(y') above a floor."""

    drag: float = 0.02
    coordinates: ClassVar[tuple[str, ...]] = ("y",)
    contacts: ClassVar[tuple[saltus.Contact, ...]] = (saltus.Contact(name="floor", coordinate="y"),)

    def force(self, t, y, velocity, load):
        return -9.81 - self.drag * velocity * abs(velocity)


ball = saltus.System(model=Ball(), impact=saltus.NewtonImpact(0.8))
motion = saltus.simulate(ball, y=0.0, velocity=25.0, duration=12.0)
height = np.log1p(0.02 * 25.0**2 / 9.81) / (2 * 0.02)
speed = np.sqrt(-9.81 / 0.02 * np.expm1(-2 * 0.02 * height))
assert abs(motion.impacts.velocity_before[0, 0] + speed) < 1e-12
saltus.plot(motion, figure=plt.figure(layout="constrained"))
plt.show()
