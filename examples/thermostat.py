"""A thermostat: a heater that remembers whether it is on
======================================================

Below 19 degrees the heater goes on, above 21 off; between the two it stays as it is, as a relay.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Thermostat(saltus.ContactModel):
    coordinates: ClassVar = ("T",)
    first_order: ClassVar = ("T",)
    surfaces: ClassVar = (saltus.Relay(name="heater", on="too_cold", off="too_warm"),)

    def too_cold(self, t, T, velocity, load):
        return 19.0 - T

    def too_warm(self, t, T, velocity, load):
        return T - 21.0

    def force(self, t, T, velocity, load, sides):
        return -(T - 10.0) / 10.0 + 3.0 * (1.0 + sides.heater) / 2.0


motion = saltus.simulate(saltus.System(model=Thermostat()), T=15.0, duration=20.0)
period = 10.0 * math.log(21 / 19) + 10.0 * math.log(11 / 9)
switched = [event.time for event in motion.events]
print(f"the heater goes off every {switched[2] - switched[0]:.12f}, in closed form {period:.12f}")
times = np.linspace(0.0, 20.0, 800)
plt.plot(times, motion.at(times)[0])
plt.gca().set(xlabel="time", ylabel="temperature")
assert abs(switched[2] - switched[0] - period) < 1e-12
