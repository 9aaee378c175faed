"""Oscillators on a spring: at a wall, between two stops, as an impact pair, and on a moving
belt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.contracts.contact_model import Contact, ContactModel, Friction
from saltus.systems.contracts.model import IMAGE_ROUNDING, MarginKind, OneContactModel
from saltus.systems.impact_laws import ImpactLaw, InelasticImpact
from saltus.systems.loads.load import Load, reversed_load


@dataclass(frozen=True, slots=True, kw_only=True)
class WallOscillator(OneContactModel):
    """x'' + c x' + k x = F(tau) - zeta'', free while x < d; at the wall x = d the velocity turns
    round, v+ = -e v-.

    x is relative to the ground, to which spring, dashpot and wall are fixed, and which the channel
    `ground` displaces by zeta. The one mode ends with an impact at the wall and begins anew. It can
    rest at the wall while F - zeta'' - k d > 0.

    Parameters
    ----------
    stiffness
        k, at least 0.
    damping
        c, at least 0.
    wall
        d, the coordinate of the wall.

    Examples
    --------
    >>> ball = saltus.System(model=saltus.WallOscillator(stiffness=0.0, wall=0.0), load=saltus.Load(force=1.0))
    >>> saltus.simulate(ball, x=-2.0, duration=3.0).impacts.time  # the fall from a height of 2 under an acceleration of 1
    array([2.])
    """

    stiffness: float = field(default=1.0, metadata=number_range(at_least=0.0))
    damping: float = field(default=0.0, metadata=number_range(at_least=0.0))
    wall: float = field(default=1.0, metadata=number_range())

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force", "ground")

    def __post_init__(self) -> None:
        settle_numbers(self)

    @property
    def sides(self) -> tuple[int, ...]:
        """One side, as the wall turns every motion back."""
        return (1,)

    @property
    def contact(self) -> Any:
        """x = d."""
        return self.wall

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """x'' = F - zeta'' - c x' - k x."""
        return (
            load.force(t)
            - load.ground.acceleration(t)
            - self.damping * velocity
            - self.stiffness * x
        )

    def gap(self, x: Any, side: Any) -> Any:
        """d - x."""
        return self.wall - x

    def reset(self, t: Any, velocity: Any, side: Any, load: Load, impact: Any) -> tuple[Any, Any]:
        """The same side, with the velocity turned round."""
        return side, -impact.velocity_after(self, t, velocity, side, side, load)

    def kinetic_energy(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """v^2 / 2, of the motion relative to the ground."""
        return velocity * velocity / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoStops(ContactModel):
    """x'' + c x' + k x = F(tau) - zeta'' for d_1 <= x <= d_2: contacts `left` and `right`, with a
    law such as `NewtonImpact`.

    x is relative to the ground, to which spring, dashpot and stops are fixed, and which the channel
    `ground` displaces by zeta.

    Parameters
    ----------
    stiffness
        k, at least 0.
    damping
        c, at least 0.
    left
        d_1, the coordinate of the left stop.
    right
        d_2, the coordinate of the right stop, above d_1.

    Examples
    --------
    >>> [contact.name for contact in saltus.TwoStops(left=-1.0, right=2.0).contacts]
    ['left', 'right']
    """

    stiffness: float = field(default=1.0, metadata=number_range(at_least=0.0))
    damping: float = field(default=0.0, metadata=number_range(at_least=0.0))
    left: float = field(default=-1.0, metadata=number_range(below="right"))
    right: float = field(default=1.0, metadata=number_range())

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force", "ground")

    def __post_init__(self) -> None:
        settle_numbers(self)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """x >= d_1 and x <= d_2."""
        left = Contact(name="left", coordinate="x", position=self.left)
        return left, Contact(name="right", coordinate="x", sign=-1, position=self.right)

    def force(self, t: Any, x: Any, velocity: Any, load: Load) -> Any:
        """F - zeta'' - c x' - k x."""
        return (
            load.force(t)
            - load.ground.acceleration(t)
            - self.damping * velocity
            - self.stiffness * x
        )

    def mirror(self, load: Load) -> Load | None:
        """The load with the force and the ground reversed, for d_1 = -d_2; None otherwise."""
        same = math.isclose(-self.left, self.right, rel_tol=IMAGE_ROUNDING)
        return reversed_load(load, "force", "ground") if same else None

    def kinetic_energy(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """x'^2 / 2, of the motion relative to the ground."""
        return velocity * velocity / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpactPair(ContactModel):
    """An impact damper: a case on a spring, at z, and a mass in it at the distance x from the
    case's middle, |x| <= d:

        z'' + c z' + k z + mu (z'' + x'') = F(tau) - (1 + mu) zeta'',
        mu (z'' + x'') = -mu zeta'' while no wall pushes.

    z is relative to the ground, to which spring and dashpot are fixed, and which the channel
    `ground` displaces by zeta. The coordinates are those of T = (z'^2 + mu (z' + x')^2) / 2, so
    that an impact at a wall acts on x alone, and the balance of momentum gives the jump of z'.
    Contacts `left` at x = -d and `right` at x = d.

    Parameters
    ----------
    mass_ratio
        mu, the ratio of the mass to the case, above 0.
    stiffness
        k of the case, at least 0.
    damping
        c of the case, at least 0.
    clearance
        d, above 0.

    Examples
    --------
    >>> [contact.name for contact in saltus.ImpactPair(clearance=0.5).contacts]
    ['left', 'right']
    """

    mass_ratio: float = field(default=0.1, metadata=number_range(above=0.0))
    stiffness: float = field(default=1.0, metadata=number_range(at_least=0.0))
    damping: float = field(default=0.0, metadata=number_range(at_least=0.0))
    clearance: float = field(default=1.0, metadata=number_range(above=0.0))

    coordinates: ClassVar[tuple[str, ...]] = ("z", "x")
    channels: ClassVar[tuple[str, ...]] = ("force", "ground")

    def __post_init__(self) -> None:
        settle_numbers(self)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """x >= -d and x <= d."""
        left = Contact(name="left", coordinate="x", position=-self.clearance)
        return left, Contact(name="right", coordinate="x", sign=-1, position=self.clearance)

    def mass_matrix(self, q: Any) -> Any:
        """[[1 + mu, mu], [mu, mu]]."""
        return [[1.0 + self.mass_ratio, self.mass_ratio], [self.mass_ratio, self.mass_ratio]]

    def force(self, t: Any, q: Any, velocity: Any, load: Load) -> tuple[Any, Any]:
        """(F - (1 + mu) zeta'' - c z' - k z, -mu zeta'')."""
        ground = load.ground.acceleration(t)
        pushed = (
            load.force(t)
            - (1.0 + self.mass_ratio) * ground
            - self.damping * velocity[0]
            - self.stiffness * q[0]
        )
        return pushed, 0.0 * q[1] - self.mass_ratio * ground

    def mirror(self, load: Load) -> Load:
        """The load with the force and the ground reversed."""
        return reversed_load(load, "force", "ground")

    def kinetic_energy(self, t: Any, q: Any, velocity: Any, side: Any, load: Load) -> Any:
        """(z'^2 + mu (z' + x')^2) / 2, of the motion relative to the ground."""
        together = velocity[0] + velocity[1]
        return (velocity[0] * velocity[0] + self.mass_ratio * together * together) / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class BeltOscillator(ContactModel):
    """x'' + c x' + k x = F(tau) + f, a mass pressed with N(tau) on a belt of speed w; the friction
    f (named `belt`) is

        f = -mu_k N sign(x' - w) while it slides,    abs(f) <= mu_s N while it sticks, x' = w.

    A belt that stands still, w = 0, makes it an oscillator with Coulomb friction.

    Parameters
    ----------
    stiffness
        k, at least 0.
    damping
        c, at least 0.
    kinetic
        mu_k, at least 0.
    static
        mu_s, at least mu_k.
    normal_force
        N without the load's channel `normal`, above 0.
    belt_speed
        w, the speed of the belt.

    Examples
    --------
    >>> motion = saltus.simulate(saltus.System(model=saltus.BeltOscillator()), x=0.0, velocity=0.1, duration=5.0)
    >>> round(motion.events[0].time, 9), str(motion.events[0].kind)  # the spring pulls with mu_s N = 0.3 at x = 0.3
    (3.0, 'slip')
    """

    stiffness: float = field(default=1.0, metadata=number_range(at_least=0.0))
    damping: float = field(default=0.0, metadata=number_range(at_least=0.0))
    kinetic: float = field(default=0.2, metadata=number_range(at_least=0.0))
    static: float = field(default=0.3, metadata=number_range(at_least="kinetic"))
    normal_force: float = field(default=1.0, metadata=number_range(above=0.0))
    belt_speed: float = field(default=0.1, metadata=number_range())

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force", "normal")

    def __post_init__(self) -> None:
        settle_numbers(self)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The friction of the belt."""
        belt = Friction(
            name="belt",
            coordinate="x",
            kinetic=self.kinetic,
            static=self.static,
            ground_speed=self.belt_speed,
        )
        return (belt,)

    def normal_forces(self, t: Any, x: Any, velocity: Any, load: Load) -> tuple[Any, ...]:
        """N plus the load's `normal`."""
        return (self.normal_force + load.normal(t),)

    def force(self, t: Any, x: Any, velocity: Any, load: Load) -> Any:
        """F - c x' - k x."""
        return load.force(t) - self.damping * velocity - self.stiffness * x

    def mirror(self, load: Load) -> Load | None:
        """The load with the force reversed, if the belt stands still; None otherwise."""
        return reversed_load(load, "force") if self.belt_speed == 0.0 else None

    def kinetic_energy(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        """x'^2 / 2."""
        return velocity * velocity / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class RockingBlock(OneContactModel):
    """A rigid block rocking about its base corners, without bouncing (paper, `EOM&Rock`).

    With time scaled by p = sqrt(3 g / (4 R)), zeta = 3 U_h / (4 R) and nu = 3 U_v / (4 R), on the
    side s = +1 or -1:

        theta'' = -zeta'' cos(alpha - abs(theta)) - s (1 + nu'') sin(alpha - abs(theta))

    The block is assumed to stay on the ground: for nu'' < -1 it would leave it, which is not
    checked. A motion stops, `overturned`, when the block lies on its side: pi/2 - abs(theta) = 0.

    A system that is given no impact law has Housner's loss, `InelasticImpact`: each impact keeps 1
    - (3/2) sin(alpha)^2 of the velocity. `PhysicalBlock` makes the block and its loads from SI
    units.

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

    alpha: float = field(metadata=number_range(above=0.0, below=math.pi / 2, unit="rad"))

    units: ClassVar[tuple[str, ...]] = ("rad",)
    dimensionless: ClassVar[bool] = True
    channels: ClassVar[tuple[str, ...]] = ("ground_horizontal", "ground_vertical")
    margin_kinds: ClassVar[dict[str, MarginKind]] = {"overturned": MarginKind.LIMIT}
    stops: ClassVar[tuple[str, ...]] = ("overturned",)
    usual_impact: ClassVar[ImpactLaw] = InelasticImpact()

    def __post_init__(self) -> None:
        settle_numbers(self)

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """theta'' of `EOM&Rock` in the time p t."""
        tilt = self.alpha - abs(theta)
        weight = 1 + load.ground_vertical.acceleration(t)
        return -(load.ground_horizontal.acceleration(t) * np.cos(tilt)) - side * (
            weight * np.sin(tilt)
        )

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """T / ((4/3) M R^2 p^2) = [theta'^2 + (4/3)(zeta'^2 + nu'^2)
        + 2 theta' (zeta' cos(alpha - abs(theta)) + s nu' sin(alpha - abs(theta)))] / 2 (errata 10).
        """
        zeta = load.ground_horizontal.velocity(t)
        nu = load.ground_vertical.velocity(t)
        tilt = self.alpha - side * theta
        ground = zeta * np.cos(tilt) + side * nu * np.sin(tilt)
        return (velocity * velocity + (zeta * zeta + nu * nu) * (4 / 3) + 2 * velocity * ground) / 2

    def inelastic_factor(self, side: Any) -> Any:
        """1 - (3/2) sin(alpha)^2: angular momentum about the new corner is conserved (Housner
        1963); not below 0.
        """
        return np.maximum(1 - 1.5 * np.sin(self.alpha) * np.sin(self.alpha), 0.0)

    def margins(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Load
    ) -> dict[str, Any]:
        """`overturned`: pi/2 - abs(theta)."""
        return {"overturned": math.pi / 2 - side * theta}

    def mirror(self, load: Load) -> Load:
        """The load with the horizontal ground motion reversed."""
        return reversed_load(load, "ground_horizontal")
