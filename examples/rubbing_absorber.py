"""A mass that slides and hops on a ledge: an absorber with friction in its contact
================================================================================

A mass lies on a tilted ledge of a structure z, on a spring along it. Friction holds it back with
the reaction of the ledge itself: it slides both ways, and where the structure swings far enough it
takes off, falls back and hits with friction. Orbits, their branch over the frequency, verdicts,
sweeps and attractors are those of any model; what friction takes balances the force.
"""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Ledge(saltus.ContactModel):
    mass: float = 0.1
    friction: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("z", "x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (saltus.Contact(name="ledge", coordinate="y"),)

    @property
    def frictions(self):
        return (
            saltus.Friction(name="rub", coordinate="x", kinetic=self.friction, contact="ledge"),
        )

    def mass_matrix(self, q):
        m, along, across = self.mass, self.mass * ALONG, -self.mass * ACROSS
        return [[1.0 + m, along, across], [along, m, 0.0], [across, 0.0, m]]

    def force(self, t, q, velocity, load):
        spring = load.force(t) - q[0] - 0.05 * velocity[0]
        return spring, -0.3 * self.mass * ACROSS - 0.05 * q[1], -0.3 * self.mass * ALONG


ALONG, ACROSS = np.cos(0.5), np.sin(0.5)  # of the tilt of the ledge; the weight is 0.3
load = saltus.Load(frequency=0.9, force=saltus.Harmonic(0.05))
system = saltus.System(model=Ledge(), load=load, impact=saltus.NewtonImpact(e=0.4))
slides, hops = (
    saltus.find_orbit(system.with_({"load.frequency": w}), z=0.0, x=0.0, y=0.0) for w in (0.9, 1.0)
)
branch = saltus.continue_orbit(slides, "load.frequency", (0.85, 0.99))
swept = saltus.frequency_sweep(system, np.linspace(0.86, 1.0, 8), periods=300, z=0.0, x=0.0, y=0.0)
print(
    slides,
    hops,
    saltus.classify(system, z=0.0, x=0.0, y=0.0),
    saltus.find_attractors(system, starts=24),
    sep="\n",
)
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
# the last one is used below
for motion, name in ((hops.motion(), "slides and hops"), (slides.motion(), "slides")):
    times = np.linspace(motion.start, motion.time, 20001)
    position, velocity = motion.at(times)
    left.plot(position[1], velocity[1], label=name)
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
# mu R abs(x'), R by Newton's law
rubs = 0.02 * (0.3 * ALONG - ACROSS * np.gradient(velocity[0], times)) * np.abs(velocity[1])
assert (
    abs(saltus.energies(slides).energy.sel(part="friction.rub") - np.trapezoid(rubs, times)) < 1e-7
)
