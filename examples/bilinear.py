"""
A bilinear oscillator of your own
=================================

x'' + k(x) x = F, with k = 1 for x > 0 and k = K for x < 0: a crack that opens and closes, a mooring
line, a cable. Its free period is pi (1 + 1 / sqrt(K)), whatever its amplitude.
"""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Bilinear(saltus.OneContactModel):
    """side +1 where x > 0, side -1 where x < 0; nothing jumps at x = 0 but the stiffness."""

    stiff: float = 4.0  # K
    damping: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        """x''."""
        stiffness = (1 + self.stiff) / 2 + side * (1 - self.stiff) / 2
        return load.force(t) - self.damping * velocity - stiffness * x


free = saltus.simulate(saltus.System(model=Bilinear(stiff=4.0)), x=1.0, duration=20.0)
crossings = free.impacts.time
print(f"free period {crossings[2] - crossings[0]:.13f}, closed form {np.pi * 1.5:.13f}")

load = saltus.Load(frequency=1.0, force=saltus.Harmonic(0.1))
forced = saltus.System(model=Bilinear(stiff=4.0, damping=0.05), load=load)
branch = saltus.continue_orbit(saltus.find_orbit(forced, x=0.1), "load.frequency", (0.4, 4.0))
figure, ax = plt.subplots()
ax.plot(branch.parameters, branch.amplitudes)
ax.axvline(2 / 1.5, color="k", linestyle=":", label=r"bilinear frequency $2\sqrt{K}/(1+\sqrt{K})$")
ax.set(xlabel=r"frequency $\Omega$", ylabel="largest |x|")
ax.legend()

assert abs(crossings[2] - crossings[0] - np.pi * 1.5) < 1e-12
assert abs(branch.parameters[np.argmax(branch.amplitudes)] - 2 / 1.5) < 0.02
