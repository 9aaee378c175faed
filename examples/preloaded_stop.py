"""
A preloaded stop behind a gap
=============================

A mass on a spring meets, at x = d, a second spring that is pressed together by P beforehand: a
model of 12 lines, its response spectrum as a picture and as a table for a spreadsheet. Impacts
begin where the linear motion reaches d.
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

import saltus


@dataclass(frozen=True, kw_only=True)
class PreloadedStop(saltus.OneContactModel):
    stiff: float = 10.0
    preload: float = 0.5
    contact: float = 1.0  # d
    damping: float = 0.1
    coordinates = ("x",)
    channels = ("force",)

    def gap(self, x, side):
        return side * (x - self.contact)

    def acceleration(self, t, x, velocity, side, load):
        return (
            load.force(t)
            - self.damping * velocity
            - x
            - (1 + side) / 2 * (self.preload + self.stiff * (x - self.contact))
        )


load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=0.3))
spectrum = saltus.response_spectrum(
    saltus.System(model=PreloadedStop(), load=load), bounds=(0.7, 1.6), values=[0.8, 1.0, 1.3]
)
saltus.plot(spectrum, ax=plt.gca())
saltus.to_csv("spectrum.csv", spectrum)
first = spectrum["special"].special_parameter.values[spectrum["special"].kind.values == "GR"].min()
# amplitude 1: (1 - u)^2 + c^2 u = F^2, u = Omega^2
grazing = np.sqrt(min(np.roots([1.0, 0.1**2 - 2, 1 - 0.3**2]).real))
print(f"impacts begin at Omega = {first:.9f}, the linear motion reaches the stop at {grazing:.9f}")
assert abs(first - grazing) < 1e-9
