"""
Hysteresis of Bouc and Wen
==========================

A mass on a hysteretic spring, z' = v - abs(v) z / 2 - v abs(z) / 2, as Bouc and Wen write it: its
absolute values are switches that the motion passes exactly."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt

import saltus


@dataclass(frozen=True, kw_only=True)
class BoucWen(saltus.ContactModel):
    """x'' = F - 0.1 x' - 0.2 x - z."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "z")
    first_order: ClassVar[tuple[str, ...]] = ("z",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def force(self, t, q, velocity, load):
        (x, z), v = q, velocity[0]
        return load.force(t) - 0.1 * v - 0.2 * x - z, v - 0.5 * abs(v) * z - 0.5 * v * abs(z)


load = saltus.Load(frequency=1.0, force=saltus.Harmonic(1.0))
system = saltus.System(model=BoucWen(), load=load)
orbit = saltus.find_orbit(system, x=0.0, z=0.0, velocity=0.0)
assert orbit.stable
loop = orbit.motion().to_xarray()
assert float(abs(loop.z).max()) < 1.0  # its strength
plt.plot(loop.x, loop.z)
plt.gca().set(xlabel="displacement $x$", ylabel="restoring force $z$")
plt.show()
