"""
A load that jumps: Duffing's oscillator under a square wave
===========================================================

x'' + 0.2 x' + x + x^3 = A or -A in each half of the forcing period. This is the example "bangbang"
of COCO (Dankowicz and Schilder, Recipes for Continuation, 2013). Its branch folds twice, and its
symmetry breaks twice.
"""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class Duffing(saltus.Model):
    coordinates: ClassVar = ("x",)
    channels: ClassVar = ("force",)

    def acceleration(self, t, x, v, side, load):
        return load.force(t) - 0.2 * v - x - x**3


system = saltus.System(
    model=Duffing(), load=saltus.Load(frequency=1.1, force=saltus.Square(amplitude=26.0))
)
orbit = saltus.find_orbit(system, x=0.0)
branch = saltus.continue_orbit(orbit, "load.frequency", (0.8, 1.5))
print(branch)
saltus.plot(branch, ax=plt.gca())

published = {"BPC": [0.85439927, 1.07596791], "LP": [0.81948777, 1.11097075]}
for kind, values in published.items():
    found = sorted(point.parameter for point in branch.special if point.kind == kind)
    assert np.allclose(found, values, rtol=0.0, atol=5e-9)
