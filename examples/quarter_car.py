"""
A quarter car with bump and rebound
===================================

A damper that is stiffer in rebound than in bump pulls the car down on a rough road: the mean of
its height is below that of the road."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt

import saltus


@dataclass(frozen=True, kw_only=True)
class QuarterCar(saltus.ContactModel):
    """y'' = -4 (y - r) - c (y' - r') over a road r, with c = 0.9 in rebound and 0.2 in bump."""

    coordinates: ClassVar[tuple[str, ...]] = ("y",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)
    surfaces: ClassVar = (saltus.Surface(name="rebound", function="stretching"),)

    def stretching(self, t, y, velocity, load):
        return velocity - load.ground.velocity(t)

    def force(self, t, y, velocity, load, sides):
        slope = 0.55 + 0.35 * sides.rebound
        return -4.0 * (y - load.ground(t)) - slope * (velocity - load.ground.velocity(t))


load = saltus.Load(frequency=3.0, ground=saltus.Harmonic(0.4))
orbit = saltus.find_orbit(saltus.System(model=QuarterCar(), load=load), y=0.0)
motion = orbit.motion()
assert orbit.stable
assert [str(event.kind) for event in motion.events] == ["crossing"] * 2
heights = motion.to_xarray().y
assert float(heights.max() + heights.min()) < 0.0
saltus.plot(motion, figure=plt.figure(layout="constrained"))
plt.show()
