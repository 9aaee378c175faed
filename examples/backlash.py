"""
Backlash between two masses
===========================

Two equal masses whose spring acts only where they are farther apart than the backlash. A motion
passes the surfaces y - x = b and y - x = -b, on whose sides the equations differ; free motions have
a closed form. With a load and damping orbits are followed."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Backlash(saltus.ContactModel):
    """x'' = p - k x - c x' + F and y'' = -p - c y', with p = K (r - b) for r = y - x > b, K (r + b)
    for r < -b, else 0.
    """

    room: float = 0.25  # b
    mesh: float = 8.0  # K
    stiffness: float = 0.0  # k
    damping: float = 0.0  # c

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def surfaces(self):
        right = saltus.Surface(name="right", coordinate={"y": 1.0, "x": -1.0}, position=self.room)
        return right, saltus.Surface(
            name="left", coordinate={"x": 1.0, "y": -1.0}, position=self.room
        )

    def force(self, t, q, velocity, load, sides):
        # 1 beyond the surface, else 0
        apart, right, left = q[1] - q[0], (1 + sides.right) / 2, (1 + sides.left) / 2
        pull = self.mesh * (right * (apart - self.room) + left * (apart + self.room))
        first = pull - self.stiffness * q[0] - self.damping * velocity[0] + load.force(t)
        return first, -pull - self.damping * velocity[1]


free = saltus.simulate(
    saltus.System(model=Backlash()), x=0.0, y=0.0, velocity=(-0.5, 0.5), duration=12.0
)
period = free.events.times[4] - free.events.times[0]
# a swing of the frequency sqrt(2 K), and 2 b twice with the speed 1
exact = 2 * np.pi / np.sqrt(2 * 8.0) + 4 * 0.25
print(f"period {period:.13f}, closed form {exact:.13f}")

load = saltus.Load(frequency=1.2, force=saltus.Harmonic(0.4))
driven = saltus.System(model=Backlash(stiffness=1.0, damping=0.1), load=load)
branch = saltus.continue_orbit(
    saltus.find_orbit(driven, x=0.0, y=0.0), "load.frequency", (0.8, 1.6)
)
figure, (ax, response) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
times = np.linspace(0.0, free.time, 500)
(x, y), _ = free.at(times)
ax.plot(times, y - x)
ax.axhspan(-0.25, 0.25, color="0.9")
ax.set(xlabel=r"$\tau$", ylabel="y - x")
saltus.plot(branch, ax=response)

assert abs(period - exact) < 1e-11
assert max(point.orbit.defect for point in branch.special) < 1e-9
