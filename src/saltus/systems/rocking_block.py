"""The rigid rocking block (paper, appendix A)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from saltus.checks import RADIANS, settle_numbers
from saltus.systems.impact_laws import ImpactLaw, InelasticImpact
from saltus.systems.load import Load, reversed_load
from saltus.systems.model import MarginKind, OneContactModel


@dataclass(frozen=True, slots=True, kw_only=True)
class RockingBlock(OneContactModel):
    """A rigid block rocking about its base corners, without bouncing (paper, `EOM&Rock`).

    With time scaled by p = sqrt(3 g / (4 R)), zeta = 3 U_h / (4 R) and nu = 3 U_v / (4 R), on the side s = +1 or -1:

        theta'' = -zeta'' cos(alpha - abs(theta)) - s (1 + nu'') sin(alpha - abs(theta))

    The block is assumed to stay on the ground: for nu'' < -1 it would leave it, which is not checked.
    A motion stops, `overturned`, when the block lies on its side: pi/2 - abs(theta) = 0.

    A system that is given no impact law has Housner's loss, `InelasticImpact`: each impact keeps 1 - (3/2) sin(alpha)^2 of the
    velocity. `PhysicalBlock` makes the block and its loads from SI units.

    Parameters
    ----------
    alpha
        The slenderness angle, rad, in (0, pi/2).

    Examples
    --------
    >>> block = saltus.System(model=saltus.RockingBlock(alpha=0.25), impact=saltus.VelocityReduction(1.0))  # without a loss
    >>> motion = saltus.simulate(block, theta=0.1, duration=10.0)
    >>> period = motion.impacts.time[2] - motion.impacts.time[0]
    >>> float(period / saltus.theory.rocking_period(0.1, alpha=0.25))
    0.9999999999999871
    """

    alpha: float = field(metadata=RADIANS)

    units: ClassVar[tuple[str, ...]] = ("rad",)
    channels: ClassVar[tuple[str, ...]] = ("ground_horizontal", "ground_vertical")
    margin_kinds: ClassVar[dict[str, MarginKind]] = {"overturned": MarginKind.LIMIT}
    stops: ClassVar[tuple[str, ...]] = ("overturned",)
    usual_impact: ClassVar[ImpactLaw] = InelasticImpact()

    def __post_init__(self) -> None:
        settle_numbers(self, "alpha", above=0.0, below=math.pi / 2)

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """theta'' of `EOM&Rock` in the time p t."""
        tilt = self.alpha - abs(theta)
        weight = 1 + load.ground_vertical.acceleration(t)
        return -(load.ground_horizontal.acceleration(t) * np.cos(tilt)) - side * (weight * np.sin(tilt))

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """T / ((4/3) M R^2 p^2) = [theta'^2 + (4/3)(zeta'^2 + nu'^2)
        + 2 theta' (zeta' cos(alpha - abs(theta)) + s nu' sin(alpha - abs(theta)))] / 2 (errata 10).
        """
        zeta, nu = load.ground_horizontal.velocity(t), load.ground_vertical.velocity(t)
        tilt = self.alpha - side * theta
        ground = zeta * np.cos(tilt) + side * nu * np.sin(tilt)
        return (velocity * velocity + (zeta * zeta + nu * nu) * (4 / 3) + 2 * velocity * ground) / 2

    def inelastic_factor(self, side: Any) -> Any:
        """1 - (3/2) sin(alpha)^2: angular momentum about the new corner is conserved (Housner 1963); not below 0."""
        return np.maximum(1 - 1.5 * np.sin(self.alpha) * np.sin(self.alpha), 0.0)

    def margins(self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Load) -> dict[str, Any]:
        """`overturned`: pi/2 - abs(theta)."""
        return {"overturned": math.pi / 2 - side * theta}

    def mirror(self, load: Load) -> Load:
        """The load with the horizontal ground motion reversed."""
        return reversed_load(load, "ground_horizontal")
