"""
A model of your own: the Duffing oscillator
===========================================

A model of one's own: the Duffing oscillator, x'' + c x' + x + b x^3 = F(tau). duffing.toml runs it;
so does this script."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, slots=True, kw_only=True)
class Duffing(saltus.Model):
    """Smooth, so it has no sides; traced, so it runs as fast as the package's own models."""

    damping: float = 0.0  # c
    cubic: float = 1.0  # b

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        """x''."""
        return load.force(t) - self.damping * velocity - x - self.cubic * x**3


if __name__ == "__main__":
    motion = saltus.simulate(saltus.System(model=Duffing()), x=1.0, duration=100.0)
    energy = motion.velocity**2 / 2 + motion.x**2 / 2 + motion.x**4 / 4
    assert abs(energy - 0.75) < 1e-11, energy  # 1/2 + 1/4 at the start, and nothing is lost
    figure, ax = plt.subplots()
    ax.plot(*motion.at(np.linspace(0.0, 100.0, 5000)), linewidth=0.6)
    ax.set(xlabel="$x$", ylabel="$x'$", title="the energy is kept")
    print(f"x = {motion.x:.12f} at time 100, energy {energy:.15f}")
