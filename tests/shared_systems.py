"""The systems that tests of several rooms share: few structures, each compiled once; what differs
is numbers.

Symbols are those of the paper: H and V the amplitude of the horizontal and the constant vertical
load, W = Omega, C, k, m, c, e.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from saltus import (
    BeltOscillator,
    Contact,
    ContactModel,
    EnergyRestitution,
    Harmonic,
    InelasticImpact,
    Load,
    Metainterface,
    Model,
    OneContactModel,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)

BETA80 = math.radians(80)


def forced(
    H=0.5,
    W=1.0,
    V=-0.5,
    C=0.1,
    e=1.0,
    *,
    beta0=BETA80,
    k=1.0,
    m=0.0,
    c=1.0,
    mean=0.0,
    phase=0.0,
    impact=None,
    smoothing=None,
):
    """Load (i) of the paper: a metainterface under mean + H sin(W t + phase) and a constant V, both
    on the upper mass.
    """
    return System(
        model=Metainterface(
            beta0=beta0,
            damping=C,
            stiffness_ratio=k,
            mass_ratio=m,
            dissipation_ratio=c,
            smoothing=smoothing,
        ),
        load=Load(
            frequency=W, horizontal=Harmonic(amplitude=H, mean=mean, phase=phase), vertical=V
        ),
        impact=impact or VelocityReduction(e),
    )


def under(*, C=0.1, smoothing=None, impact=None, W=1.0, **channels):
    """The symmetric metainterface under any channels."""
    return System(
        model=Metainterface(beta0=BETA80, damping=C, smoothing=smoothing),
        load=Load(frequency=W, **channels),
        impact=impact or VelocityReduction(),
    )


def steady(V=-1.5, C=0.1, e=1.0, *, H=0.0, beta0=BETA80):
    """The metainterface under constant loads."""
    return System(
        model=Metainterface(beta0=beta0, damping=C),
        load=Load(horizontal=H, vertical=V),
        impact=VelocityReduction(e),
    )


def shaken(zeta=0.3, nu=0.05, r=0.9, m=0.2, W=1.1):
    """Unequal layers on a ground that moves both ways, with a restitution of energy."""
    return System(
        model=Metainterface(
            beta0=BETA80, damping=0.1, stiffness_ratio=1.2, mass_ratio=m, dissipation_ratio=0.8
        ),
        load=Load(
            frequency=W,
            ground_horizontal=Harmonic(amplitude=zeta),
            ground_vertical=Harmonic(amplitude=nu, phase=0.4),
            vertical=-0.5,
        ),
        impact=EnergyRestitution(r),
    )


def walled(A=0.2, W=1.3, wall=1.0, e=0.8, *, k=1.0, c=0.1, mean=0.0, phase=math.pi / 2):
    """The impact oscillator under mean + A sin(W t + phase), a cosine."""
    return System(
        model=WallOscillator(stiffness=k, damping=c, wall=wall),
        load=Load(frequency=W, force=Harmonic(amplitude=A, mean=mean, phase=phase)),
        impact=VelocityReduction(e),
    )


def rocking(a=1.5, W=5.0, alpha=0.25):
    """A rocking block with Housner's impacts; the ground moves with the acceleration -a alpha sin(W
    t).
    """
    return System(
        model=RockingBlock(alpha=alpha),
        load=Load(frequency=W, ground_horizontal=Harmonic(amplitude=a * alpha / W**2)),
        impact=InelasticImpact(),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Hinge(OneContactModel):
    """A user's model: a cubic spring and a bias s f at x = `edge`, which the motion goes through,
    the gap in units of its own.
    """

    edge: float = 0.4
    cubic: float = 0.2
    damping: float = 0.1
    bias: float = -0.3

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("push",)

    @property
    def contact(self) -> Any:
        return self.edge

    def gap(self, x: Any, side: Any) -> Any:
        return 2.5 * side * (x - self.edge)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        far = x - self.edge
        return load.push(t) - self.damping * velocity - far - self.cubic * far**3 + side * self.bias


def hinged(push=0.6, W=0.9, edge=0.4, e=0.95, **numbers):
    """The user's model under a harmonic push."""
    return System(
        model=Hinge(edge=edge, **numbers),
        load=Load(frequency=W, push=Harmonic(amplitude=push)),
        impact=VelocityReduction(e),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair(Model):
    """A user's smooth model of two degrees of freedom: cubic springs, a coupling, a damper each."""

    coupling: float = 0.3
    cubic: float = 0.4
    damping: float = 0.15

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, position, velocity, side, load):
        (x, y), (u, v) = position, velocity
        pull = self.coupling * (x - y)
        return (
            load.force(t) - self.damping * u - x - self.cubic * x**3 - pull,
            -self.damping * v - 1.5 * y - self.cubic * y**3 + pull,
        )


def paired(force=0.5, W=1.2, **numbers):
    """The smooth pair under a harmonic force on the first mass."""
    return System(model=Pair(**numbers), load=Load(frequency=W, force=Harmonic(amplitude=force)))


class Falling(BeltOscillator):
    """The friction falls with the sliding speed, as in the forced oscillators of Popp and Stelter
    (Phil. Trans. R. Soc. A 332 (1990) 89), whose motions may be chaotic: mu N / (1 + 2 (x' -
    w)^2)."""

    def normal_forces(self, t, x, velocity, load):
        sliding = velocity - self.belt_speed
        return (self.normal_force / (1.0 + 2.0 * sliding * sliding),)


@dataclass(frozen=True, kw_only=True)
class Row(ContactModel):
    """Two alike bodies between two walls, which hit each other too: the mirror swaps them, and the
    gap between them stays. The last gap follows from the others.
    """

    length: float = 2.0
    second: float = 1.0
    between: bool = True
    walls: bool = True
    bend: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        walls = (
            Contact(name="low", coordinate="a"),
            Contact(name="high", coordinate="b", position=self.length, sign=-1),
        )
        middle = Contact(name="middle", coordinate={"b": 1.0, "a": -1.0})
        return (*walls[: 2 * self.walls], *(middle,) * self.between)

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0], [0.0, self.second]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        (a, b), push = q, load.force(t)
        low, high = a - 0.25 * self.length, b - 0.75 * self.length
        return (
            push - low - self.bend * low**2 - 0.1 * v[0],
            push - high + self.bend * high**2 - 0.1 * v[1],
        )
