"""What the living pages of this site show: for each what moves, the results laid over it, and the
motion with which it begins.
"""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

import saltus


@cache
def wall():
    """An impact oscillator: a mass on a spring hits a wall, with the branch of its orbits."""
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=1.0),
        load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.5)),
        impact=saltus.VelocityReduction(0.8),
    )
    branch = saltus.continue_orbit(saltus.find_orbit(system, x=0.0), "load.frequency", (0.6, 2.0))
    presets = {
        "two motions at one frequency": {"load.frequency": 1.4, "x": -2.0},
        "the quiet one of both": {"load.frequency": 1.4, "x": 0.0},
        "chaos": {"load.frequency": 0.715},
        "a wall without restitution": {"impact.e": 0.0},
    }
    settings = {"x": 0.0, "periods": 20, "title": "An impact oscillator", "presets": presets}
    return system, [branch], settings


@cache
def tristable():
    """The metainterface of Fig. 4c: three stable states under a constant load, and the curves
    between their basins.
    """
    beta0 = np.deg2rad(80)
    system = saltus.System(
        model=saltus.Metainterface(beta0=beta0, damping=0.1),
        load=saltus.Load(vertical=-1.5 / np.sin(beta0)),
    )
    between = saltus.separatrices(system, window=((-2.4, 2.4), (-1.2, 1.2)), step=0.1)
    return (
        system,
        between,
        {
            "theta": 0.0,
            "velocity": 0.8,
            "duration": 70.0,
            "title": "Three stable states of the metainterface",
        },
    )


@cache
def spectrum():
    """The response spectrum of Fig. 9b: its resonance, and the loops at low frequencies."""
    system = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=0.85, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    )
    found = saltus.response_spectrum(
        system, "load.frequency", (0.1, 3.75), effort="quick", window=((-4.0, 4.0), (-4.0, 4.0))
    )
    return (
        system,
        [found],
        {"theta": 0.3, "periods": 40, "title": "A response spectrum and its orbits"},
    )


@cache
def block():
    """A slender block under one sine of ground acceleration, which may overturn it."""
    pulse = saltus.OneSine(amplitude=0.4, frequency=4.0, start=0.5, quantity="acceleration")
    system = saltus.System(
        model=saltus.RockingBlock(alpha=np.deg2rad(15)),
        load=saltus.Load(ground_horizontal=pulse),
        impact=saltus.VelocityReduction(e=0.9),
    )
    return system, [], {"theta": 0.0, "duration": 20.0, "title": "A rocking block under a pulse"}


@saltus.register
@dataclass(frozen=True, kw_only=True)
class Bilinear(saltus.OneContactModel):
    """An oscillator with one stiffness on each side of x = 0, the model of the page on pages."""

    stiffness: float = field(default=1.0, metadata=saltus.number_range(above=0.0))
    stop_stiffness: float = field(default=9.0, metadata=saltus.number_range(above=0.0))
    damping: float = field(default=0.05, metadata=saltus.number_range(at_least=0.0))

    coordinates = ("x",)
    channels = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        """x'' = F(t) - c x' - k x, k being that of the side."""
        stiffness = 0.5 * ((1 + side) * self.stop_stiffness + (1 - side) * self.stiffness)
        return load.force(t) - self.damping * velocity - stiffness * x


@cache
def bilinear():
    """A model of ten lines, with one branch of its resonance."""
    system = saltus.System(
        model=Bilinear(), load=saltus.Load(frequency=1.3, force=saltus.Harmonic(amplitude=0.5))
    )
    branch = saltus.continue_orbit(saltus.find_orbit(system, x=0.4), "load.frequency", (0.5, 2.5))
    return system, [branch], {"x": 0.4, "periods": 30, "title": "An oscillator of one's own"}


PAGES = {
    "wall": wall,
    "tristable": tristable,
    "spectrum": spectrum,
    "block": block,
    "bilinear": bilinear,
}


def write(name, folder):
    """Make one of the pages, and write it into a folder."""
    system, results, settings = PAGES[name]()
    return saltus.page(system, *results, path=Path(folder) / f"{name}.html", **settings)
