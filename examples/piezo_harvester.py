"""
A harvester with a voltage
==========================

A mass on a shaken base hits a stop; its piezoelectric voltage, a coordinate of first order, feeds a
resistance."""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Harvester(saltus.ContactModel):
    """x'' + c x' + x + k u = -zeta'' before a stop at 0.6, and u' = k x' - u / R."""

    coordinates = ("x", "voltage")
    first_order = ("voltage",)
    channels = ("ground",)
    contacts = (saltus.Contact(name="stop", coordinate="x", position=0.6, sign=-1),)
    coupling: float = 0.3
    resistance: float = 1.4

    def force(self, t, q, velocity, load):
        (x, u), v = q, velocity[0]
        return -x - 0.05 * v - self.coupling * u - load.ground.acceleration(
            t
        ), self.coupling * v - u / self.resistance


load = saltus.Load(frequency=0.7, ground=saltus.Harmonic(0.2))
system = saltus.System(model=Harvester(), load=load, impact=saltus.NewtonImpact(0.7))
orbit = saltus.find_orbit(system, x=0.0, voltage=0.0)
branch = saltus.continue_orbit(orbit, "load.frequency", (0.7, 1.4))
power = [
    float(saltus.energies(each).power.sel(part="first_order.voltage")) for each in branch.orbits
]
frequency = np.array([each.frequency for each in branch.orbits])
plt.plot(frequency, power, "o-", ms=3)
plt.gca().set(xlabel=r"frequency $\Omega$", ylabel="mean electric power")


def linear(W):
    """Amplitudes of x and of u without impacts: U / X = i k W R / (1 + i W R)."""
    ratio = 0.3j * W / (1j * W + 1 / 1.4)
    X = 0.2 * W**2 / (1 - W**2 + 0.05j * W + 0.3 * ratio)
    return np.abs(X), np.abs(ratio * X)


# Until the orbit grazes the stop its power is abs(U)^2 / (2 R), and it grazes it where abs(X) is
# 0.6. The orbit that grazes is left out: a rounding of its state by 1e-17 makes it hit with the
# square root of that, 1e-8 of its speed.
grazing = next(point for point in branch.special if point.kind == "GR")
free = frequency < grazing.parameter
error = np.abs(np.array(power)[free] / (linear(frequency[free])[1] ** 2 / 2.8) - 1).max()
print(
    f"power of {free.sum()} orbits without impacts: that of the formula to {error:.1e}; special "
    f"points {branch.special}"
)
assert error < 1e-10
assert abs(linear(grazing.parameter)[0] - 0.6) < 1e-9
