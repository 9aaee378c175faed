"""The six motions: both layers with Newton's law of impact and no transfer, which Siconos has
too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

import saltus

Numbers = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Case:
    """One motion, from the openings theta_1 and -theta_2 and their rates."""

    about: str
    opening: tuple[float, float]
    velocity: tuple[float, float] = (0.0, 0.0)
    duration: float = 10.0
    e: tuple[float, float]
    beta0: float = 80.0  # degrees
    damping: float = 0.1
    stiffness_ratio: float = 1.0
    mass_ratio: float
    dissipation_ratio: float = 1.0
    vertical: float = -0.5
    horizontal: float = 0.0
    frequency: float = 1.0
    ground: float = 0.0

    @property
    def system(self) -> saltus.System:
        """For saltus."""
        names = ("damping", "stiffness_ratio", "mass_ratio", "dissipation_ratio")
        return saltus.System(
            model=saltus.TwoLayer(
                beta0=math.radians(self.beta0), **{name: getattr(self, name) for name in names}
            ),
            load=saltus.Load(
                frequency=self.frequency,
                vertical=self.vertical,
                horizontal=saltus.Harmonic(amplitude=self.horizontal),
                ground_horizontal=saltus.Harmonic(amplitude=self.ground),
            ),
            impact=saltus.NewtonImpact(e=self.e),
        )

    @property
    def numbers(self) -> Numbers:
        """For layers.c, in the order of its places."""
        of_model = (self.damping, self.stiffness_ratio, self.mass_ratio, self.dissipation_ratio)
        return (
            math.radians(self.beta0),
            *of_model,
            self.vertical,
            self.horizontal,
            self.frequency,
            self.ground,
        )

    def task(self, steps: int, rounds: int) -> dict[str, Any]:
        """What march.py is asked for."""
        asked = {
            "opening": self.opening,
            "velocity": self.velocity,
            "numbers": self.numbers,
            "e": self.e,
        }
        return asked | {"duration": self.duration, "steps": steps, "rounds": rounds}

    def end(self, tol: float) -> np.ndarray:
        """Openings and rates at the end, by saltus."""
        motion = self.motion(tol)
        (x, y), (v, w) = motion.position, motion.velocity
        return np.array([x, -y, v, -w])

    def motion(self, tol: float) -> saltus.Motion:
        """The motion, by saltus."""
        (x, y), (v, w) = self.opening, self.velocity
        return saltus.simulate(
            self.system, theta=(x, -y), velocity=(v, -w), duration=self.duration, tol=tol
        )


CASES = (
    Case(
        about="small loads, one layer at a time",
        opening=(0.12, 0.0),
        e=(0.0, 0.0),
        mass_ratio=0.01,
        horizontal=0.1,
    ),
    Case(
        about="the closed layer is let go",
        opening=(0.2, 0.0),
        e=(0.2, 0.1),
        mass_ratio=0.2,
        horizontal=0.5,
        stiffness_ratio=0.7,
        dissipation_ratio=1.4,
    ),
    Case(
        about="both bounce, and come to rest",
        opening=(0.3, 0.4),
        velocity=(0.0, 0.6),
        e=(0.5, 0.5),
        mass_ratio=1.0,
    ),
    Case(
        about="heavy lower mass under a moving ground",
        opening=(0.2, 0.3),
        velocity=(0.1, 0.0),
        e=(0.3, 0.6),
        mass_ratio=4.0,
        stiffness_ratio=0.6,
        horizontal=0.4,
        frequency=1.7,
        ground=0.2,
    ),
    Case(
        about="nothing is lost",
        opening=(0.3, 0.4),
        velocity=(0.0, 0.2),
        e=(1.0, 1.0),
        mass_ratio=0.7,
        damping=0.0,
        duration=6.0,
    ),
    Case(
        about="rest and release in turn",
        opening=(0.1, 0.1),
        e=(0.5, 0.5),
        mass_ratio=0.5,
        beta0=60.0,
        horizontal=0.9,
    ),
)
