"""
A block that falls on its corners
=================================

The gap between a corner and the floor is no sum of coordinates. Both corners hit it in turn until
the block rests on them."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Block(saltus.ContactModel):
    """A block of mass 1 over a smooth floor, with its corners at the heights y - height(tilt) -+
    lean(tilt).
    """

    half_width: float = 0.8
    half_height: float = 0.4
    inertia: float = 0.8 / 3

    coordinates: ClassVar[tuple[str, ...]] = ("y", "tilt")
    contacts: ClassVar[tuple[saltus.Contact, ...]] = (
        saltus.Contact(name="left", coordinate={"y": 1.0, "height": -1.0, "lean": -1.0}),
        saltus.Contact(name="right", coordinate={"y": 1.0, "height": -1.0, "lean": 1.0}),
    )

    def height(self, q):
        return self.half_height * np.cos(q[1])

    def lean(self, q):
        return self.half_width * np.sin(q[1])

    def lean_inverse(self, value):  # by which the tilt follows from the heights of the corners
        return np.arctan(value / np.sqrt(self.half_width**2 - value * value))

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, self.inertia]]

    def force(self, t, q, velocity, load):
        return -1.0, 0.0 * q[1]


block = Block()
motion = saltus.simulate(
    saltus.System(model=block, impact=saltus.NewtonImpact(e=0.6)), y=1.6, tilt=0.3, duration=9.0
)
figure, (ax, bx) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
times = np.linspace(0.0, motion.time, 1500)
(y, tilt), _ = motion.at(times)
for name, sign, line in (("left", 1, "-"), ("right", -1, "--")):
    ax.plot(
        times,
        y - block.height((y, tilt)) - sign * block.lean((y, tilt)),
        line,
        label=f"{name} corner",
    )
ax.set(xlabel=r"$\tau$", ylabel="height over the floor")
ax.legend()
bx.plot(times, tilt, "0.3")
bx.set(xlabel=r"$\tau$", ylabel="tilt (rad)")
fall = np.sqrt(2 * (1.6 - block.height((0, 0.3)) - block.lean((0, 0.3))))
print(
    f"rest after {len(motion.impacts)} impacts, the first one off by "
    f"{motion.impacts.time[0] - fall:.1e}"
)
assert abs(motion.impacts.time[0] - fall) < 1e-13
assert (motion.y, motion.tilt, motion.closed) == (block.half_height, 0.0, ("left", "right"))
