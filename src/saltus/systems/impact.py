"""Impact laws: the velocity just after an impact, and the change of energy (paper, section "Impact scenarios")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import settle_numbers
from saltus.errors import ParameterError
from saltus.systems.contact import Contact
from saltus.systems.load import Load
from saltus.systems.model import Model


class ImpactLaw:
    """The law by which the velocity and side before an impact give those after it, v-, s -> v+, s+, for any model.

    `velocity_after` is traced, and may use comparisons within NumPy's where, and maximum and minimum, besides what an
    acceleration may use.
    """

    __slots__ = ()

    def velocity_after(self, model: Model, t: Any, velocity: Any, side: Any, next_side: Any, load: Load) -> Any:
        """The velocity after an impact at `t` through which the motion passes from `side` to `next_side`.

        Both velocities are rates of the coordinate, and the result has the sign of `velocity`: where the motion bounces, the
        model's `reset` turns the sign.
        """
        raise NotImplementedError

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """E of the impacts of a model with contacts, 0 <= J _|_ v+ + E v- >= 0, rows and columns in the order of its contacts.

        J are the impulses, and v the rates of the gaps, at all contacts whose gap is 0.

        Raises
        ------
        ParameterError
            A law that has no meaning for several contacts.
        """
        raise ParameterError(
            f"{type(self).__name__} is no law for the contacts of a {type(model).__name__}; give NewtonImpact(e=...)", "impact"
        )


@dataclass(frozen=True, slots=True)
class VelocityReduction(ImpactLaw):
    """v+ = e v-, with a constant factor e in [0, 1] (paper, `vel_red`).

    In a model with several contacts the others of the group take over the speed if the model `transfers`; else each contact
    turns its own speed back.

    Parameters
    ----------
    e
        The factor of the velocity, in [0, 1].

    Examples
    --------
    >>> lossy = saltus.System(model=system.model, load=system.load, impact=saltus.VelocityReduction(e=0.8))
    >>> impacts = saltus.simulate(lossy, theta=0.3, periods=2).impacts
    >>> bool(np.allclose(impacts.velocity_after / impacts.velocity_before, 0.8))
    True
    """

    e: float = 1.0

    def __post_init__(self) -> None:
        settle_numbers(self, "e", at_least=0.0, at_most=1.0)

    def velocity_after(self, model: Model, t: Any, velocity: Any, side: Any, next_side: Any, load: Load) -> Any:
        """e v-."""
        return self.e * velocity

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """e at the contact that is hit or, if the model `transfers`, at the others of its group."""
        contacts = model.contacts
        return [[self.e if _passes(model, a, b) else 0.0 for a in contacts] for b in contacts]


def _passes(model: Model, a: Contact, b: Contact) -> bool:
    """Whether an impact at contact `a` gives its speed to `b`: another one of its group if the model `transfers`, else itself."""
    return a is not b and a.group == b.group if model.transfers else a is b


@dataclass(frozen=True, slots=True)
class EnergyRestitution(ImpactLaw):
    """T+ = r T-, with T the model's kinetic energy, ground velocities and unequal masses included (`rest_def`, errata 5, 26).

    T on the new side is a quadratic a v^2 + b v + c in the velocity. The root with the sign of v- is taken; if both have this
    sign, the one on the same side of the minimum -b / (2 a) as v-. At r = 1 this gives v+ = v- for m = 0 and nu' = 0. If no root
    has the sign of v- (small v- on a moving ground) the motion cannot go on, and is refused with the instant and the numbers.

    Parameters
    ----------
    r
        The share of the kinetic energy that an impact leaves, above 0.

    Examples
    --------
    >>> ball = saltus.System(model=saltus.WallOscillator(), impact=saltus.EnergyRestitution(r=0.25))
    >>> float(saltus.simulate(ball, x=-2.0, duration=3.0).impacts.velocity_after[0] / -(3**0.5))  # a quarter of the energy
    0.5000000000000006
    """

    r: float

    def __post_init__(self) -> None:
        settle_numbers(self, "r", above=0.0)

    def velocity_after(self, model: Model, t: Any, velocity: Any, side: Any, next_side: Any, load: Load) -> Any:
        """The root v+ of a v^2 + b v + c = r T(v-); NaN where there is none."""

        def after(v: Any) -> Any:
            return model.kinetic_energy(t, model.contact, v, next_side, load)

        c = after(0.0)
        a = (after(1.0) + after(-1.0)) / 2 - c
        b = (after(1.0) - after(-1.0)) / 2
        energy = self.r * model.kinetic_energy(t, model.contact, velocity, side, load)
        lowest = -b / (2 * a)
        square = (energy - c) / a + lowest * lowest
        reach = np.sqrt(np.maximum(square, 0.0))
        branch = np.where(velocity > lowest, 1.0, -1.0)
        nearer, other = lowest + branch * reach, lowest - branch * reach
        through = np.where(nearer * velocity > 0, nearer, other)
        return np.where(square >= 0, np.where(through * velocity > 0, through, np.nan), np.nan)


@dataclass(frozen=True, slots=True)
class InelasticImpact(ImpactLaw):
    """Frictionless, perfectly inelastic contact: the momentum balance of the layer that is not hit fixes v+ (errata 25).

    For the metainterface v+ = -cos(2 beta0) v- from lower to upper and -cos(2 beta0)/(1+m) v- back, whatever the ground does, for
    45 to 135 degrees; outside that range both contacts act and the motion stops. For the rocking block it is Housner's factor.

    Examples
    --------
    >>> inelastic = saltus.System(model=system.model, load=system.load, impact=saltus.InelasticImpact())
    >>> impacts = saltus.simulate(inelastic, theta=0.3, periods=1).impacts
    >>> float(impacts.velocity_after[0] / impacts.velocity_before[0] + np.cos(2 * system.model.beta0))
    0.0
    """

    def velocity_after(self, model: Model, t: Any, velocity: Any, side: Any, next_side: Any, load: Load) -> Any:
        """The model's `inelastic_factor` times v-."""
        return model.inelastic_factor(side) * velocity

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """All zeros: no contact gives speed back, and the balance of momentum determines the other velocities."""
        return [[0.0] * len(model.contacts) for _ in model.contacts]
