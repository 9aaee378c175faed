"""
A ball on a shaking table
=========================

The gap between a ball and a table that shakes is x - a sin(t). The bounce with one impact a period
is born where the table can give back what the impacts take, and loses its stability by a doubling
of its period; both have closed forms."""

import math
from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Ball(saltus.ContactModel):
    """x'' = -1 over a table at the height zeta(t)."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)
    contacts: ClassVar[tuple[saltus.Contact, ...]] = (
        saltus.Contact(name="table", coordinate={"x": 1.0, "ground": -1.0}),
    )

    def force(self, t, x, velocity, load):
        return -1.0


E, AMPLITUDE = 0.6, 1.0
born = math.pi * (1 - E) / (1 + E)
doubled = math.hypot(born, 2 * (1 + E**2) / (1 + E) ** 2)
load = saltus.Load(frequency=1.0, ground=saltus.Harmonic(amplitude=AMPLITUDE))
system = saltus.System(model=Ball(), load=load, impact=saltus.NewtonImpact(e=E))

phase = math.acos(born / AMPLITUDE)  # of the impacts, at which the table has the speed `born`
height = AMPLITUDE * math.sin(phase)
motion = saltus.simulate(
    system, x=height, velocity=math.pi, time=phase, duration=6 * math.pi - phase
)
orbit = saltus.find_orbit(system, x=motion.x, velocity=motion.velocity)
branch = saltus.continue_orbit(orbit, "load.ground.amplitude", (0.7, 1.6))
places = {str(point.kind): point.parameter for point in branch.special}
print(f"born at {places['LP']:.12f}, doubled at {places['PD']:.12f}")

times = np.linspace(motion.start, motion.time, 600)
figure, (ax, diagram) = plt.subplots(1, 2, figsize=(7, 3.6), layout="constrained")
ax.plot(times, motion.at(times)[0], label="ball")
ax.plot(times, load.ground(times), "0.6", label="table")
ax.set(xlabel=r"$\tau$", ylabel="height", ylim=(None, 7.5))
ax.legend(loc="upper center")
saltus.plot(branch, ax=diagram)

assert abs(places["LP"] - born) < 1e-10
assert abs(places["PD"] - doubled) < 1e-10
