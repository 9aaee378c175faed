"""The change of velocity and energy at an impact: the restitution of inelastic contact, and the
relation of r and e.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from saltus.checks import Numbers, check_number
from saltus.errors import ParameterError
from saltus.systems import EnergyRestitution, System
from saltus.theory.arguments import check_shapes, check_side, numbers
from saltus.theory.layer import metainterface


@dataclass(frozen=True, slots=True)
class InelasticContact:
    """A frictionless, perfectly inelastic impact that ends one side.

    Attributes
    ----------
    factor
        theta'+ / theta'-, 0 where the motion stops.
    restitution
        r = T+ / T- on a ground at rest.
    impulses
        The impulses of the constraints theta_1 >= 0 and theta_2 <= 0 divided by theta'-, the two
        rows of M [[theta']].

    Examples
    --------
    >>> contact = saltus.theory.inelastic_contact(np.deg2rad(80), 0.0, 1)
    >>> round(float(contact.factor + np.cos(np.deg2rad(160))), 12)
    0.0
    """

    factor: float
    restitution: float
    impulses: tuple[float, float]


def inelastic_contact(beta0: float, mass_ratio: float, side: int) -> InelasticContact:
    """The impact that ends `side` (+1: from lower to upper) from the momentum balance M0 [[theta']]
    = impulses (errata 25).

    M0 = [[1+m, -cos(2 beta0)], [-cos(2 beta0), 1]] is M of `eomnl` at theta = 0. The layer that
    arrives is stopped by its constraint; the one that is not hit has no impulse on it, and its row
    gives its velocity:

        lower to upper:  theta'+ = -cos(2 beta0) theta'-           for every m
        upper to lower:  theta'+ = -cos(2 beta0) / (1+m) theta'-

    Both keep the share r = cos^2(2 beta0) / (1+m) of the energy. Ground velocities are continuous,
    so they drop out of the jump. For pi/4 < beta0 < 3 pi/4 the other layer opens; otherwise its
    constraint acts too, and both layers stop (factor 0).

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    mass_ratio
        m = M1 / M2.
    side
        The side that the impact ends.

    Raises
    ------
    ParameterError
        beta0 out of (0, pi), m below 0, a side other than +1 and -1.

    Examples
    --------
    >>> round(saltus.theory.inelastic_contact(np.deg2rad(80), 0.0, 1).factor, 6)  # -cos(2 beta0)
    0.939693
    """
    check_number("beta0", beta0, above=0.0, below=math.pi, unit="rad")
    check_number("mass_ratio", mass_ratio, at_least=0.0)
    if side not in (1, -1):
        raise ParameterError(f"side must be +1 (lower) or -1 (upper), got {side!r}", "side")
    coupling = -math.cos(2 * beta0)
    matrix = ((1 + mass_ratio, coupling), (coupling, 1.0))
    hit, free = (0, 1) if side > 0 else (1, 0)
    factor = max(coupling / matrix[free][free], 0.0)
    jump = [0.0, 0.0]
    jump[hit] = -1.0
    jump[free] = factor
    impulses = tuple(row[0] * jump[0] + row[1] * jump[1] for row in matrix)
    return InelasticContact(
        factor, factor**2 * matrix[free][free] / matrix[hit][hit], (impulses[0], impulses[1])
    )


def energy_factor(system: System, velocity: float, side: int, e: float, tau: float = 0.0) -> float:
    """r = T+ / T- of an impact that ends `side` at tau with theta'- = velocity, theta'+ = e theta'-
    (`rest_def_vel`, errata 5).

    T is the model's kinetic energy, with the ground velocities and the mass that moves on each
    side; in the paper's formula the vertical ground velocity has the same sign on both sides. On a
    ground at rest r = e^2 / (1+m)^s; with m = 0 this is e^2, as in `rest_def_red`.

    Parameters
    ----------
    system
        A model with a kinetic energy.
    velocity
        The velocity theta'- before the impact.
    side
        The side that the impact ends, +1 or -1.
    e
        The factor of the velocity at an impact, at least 0; unequal masses or a moving ground may
        bring it above 1.
    tau
        The dimensionless time of the impact.

    Raises
    ------
    ParameterError
        T- = 0; a model without kinetic energy; e below 0; another side.

    Examples
    --------
    >>> float(saltus.theory.energy_factor(tristable, 0.3, 1, 0.9))  # e^2 on a ground at rest
    0.81
    """
    check_side(side)
    check_number("velocity", velocity)
    check_number("e", e, at_least=0.0)
    check_number("tau", tau)
    before = float(
        system.model.kinetic_energy(tau, system.model.contact, velocity, side, system.load)
    )
    if before == 0:
        raise ParameterError(
            "r = T+ / T- has no meaning where the kinetic energy before the impact is 0", "velocity"
        )
    return (
        float(
            system.model.kinetic_energy(tau, system.model.contact, e * velocity, -side, system.load)
        )
        / before
    )


def velocity_factor(
    system: System, velocity: float, side: int, r: float, tau: float = 0.0
) -> float:
    """e = theta'+ / theta'- of an impact that ends `side` with T+ = r T- (`rest_def`): the inverse
    of `energy_factor`.

    Parameters
    ----------
    system
        A model with a kinetic energy.
    velocity
        The velocity theta'- before the impact.
    side
        The side that the impact ends, +1 or -1.
    r
        The share of the kinetic energy that the impact leaves.
    tau
        The dimensionless time of the impact.

    Raises
    ------
    ParameterError
        velocity = 0, r outside (0, 1], another side, or an equation without a solution (errata 26),
        with the instant and the velocity.

    Examples
    --------
    >>> round(float(saltus.theory.velocity_factor(tristable, 0.3, 1, 0.81)), 12)  # sqrt(r) on a ground at rest
    0.9
    """
    check_side(side)
    check_number("velocity", velocity)
    check_number("tau", tau)
    if velocity == 0:
        raise ParameterError("e = theta'+ / theta'- has no meaning at velocity 0", "velocity")
    after = float(
        EnergyRestitution(r).velocity_after(
            system.one_contact, tau, velocity, side, -side, system.load
        )
    )
    if math.isnan(after):
        raise ParameterError(
            f"no velocity of the same sign keeps r = {r!r} of the energy at tau = {tau!r} from "
            f"theta' = {velocity!r}",
            "r",
        )
    return after / velocity


def energy_jump(
    system: System, velocity: Numbers, side: int, e: Numbers, tau: Numbers = 0.0
) -> Any:
    """[[T]] over K2 at an impact of the metainterface that ends `side`, theta'+ = e theta'-; it
    broadcasts (errata 5):

        from lower:  -[(1+m-e^2) v^2 + 2 v ((1+m-e) sin(beta0) zeta' + (1+m+e) cos(beta0) nu')] / 2
        from upper:  -[(1-(1+m) e^2) v^2 + 2 v ((1-(1+m) e) sin(beta0) zeta' - (1+(1+m) e)
        cos(beta0) nu')] / 2

    The energy decreases where this is below 0. With nu' other than 0 it changes even at e = 1, m =
    0.

    Parameters
    ----------
    system
        A metainterface.
    velocity
        The velocity theta'- before the impact.
    side
        The side that the impact ends, +1 or -1.
    e
        The factor of the velocity at an impact.
    tau
        The dimensionless time of the impact.

    Raises
    ------
    ParameterError
        Another model; e outside [0, 1]; another side.

    Examples
    --------
    >>> round(float(saltus.theory.energy_jump(tristable, 0.1, 1, 0.5)), 12)  # -(1 - e^2) / 2 theta'^2
    -0.00375
    """
    model = metainterface(system)
    check_side(side)
    velocity, e, tau = (
        numbers("velocity", velocity),
        numbers("e", e, at_least=0.0, at_most=1.0),
        numbers("tau", tau),
    )
    check_shapes(velocity=velocity, e=e, tau=tau)
    zeta = system.load.ground_horizontal.velocity(tau)
    nu = system.load.ground_vertical.velocity(tau)
    before, after = (1 + model.mass_ratio, 1.0) if side > 0 else (1.0, 1 + model.mass_ratio)
    across = (before - after * e) * math.sin(model.beta0) * zeta
    along = side * (before + after * e) * math.cos(model.beta0) * nu
    return (-((before - after * e * e) * velocity**2 + 2 * velocity * (across + along)) / 2)[()]
