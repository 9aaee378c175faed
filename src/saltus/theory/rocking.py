"""The free rigid rocking block: its periods, and the change of energy at an impact (paper, appendix
A).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.checks import Numbers, check_number
from saltus.errors import ParameterError
from saltus.theory.arguments import check_shapes, numbers


def rocking_period(theta0: Numbers, *, alpha: float) -> Any:
    """Exact period of free rocking from theta0, at rest, without losses, in units of 1/p, any
    shape:

        p T0 = 4 u R_F(c^2 s^2, s^2 (c^2 + u^2), u^2 + c^2 s^2),
        u^2 = sin(alpha - theta0/2) sin(theta0/2),   c = cos(alpha/2),   s = sin((alpha - theta0)/2)

    with R_F Carlson's symmetric elliptic integral: alpha - theta is an inverted pendulum
    (`EOM&Rock`). It equals Legendre's F(chi | cos^2((alpha - theta0)/2)) with tan(chi) = u / (c s),
    but does not lose digits as theta0 approaches alpha.

    Parameters
    ----------
    theta0
        The opening at the start, at rest, rad; any shape.
    alpha
        The slenderness angle of the block, rad.

    Raises
    ------
    ParameterError
        abs(theta0) >= alpha, from where the block overturns.

    Examples
    --------
    >>> exact = saltus.theory.rocking_period(0.005, alpha=0.01)
    >>> round(float(exact / (4 * np.arccosh(2.0))), 4)  # half-way to overturning, a slender block
    1.0
    """
    from scipy.special import elliprf

    size = _amplitude(theta0, alpha)
    u2 = np.sin(alpha - size / 2) * np.sin(size / 2)
    c2 = math.cos(alpha / 2) ** 2
    s2 = np.sin((alpha - size) / 2) ** 2
    return 4 * np.sqrt(u2) * elliprf(c2 * s2, s2 * (c2 + u2), u2 + c2 * s2)


def short_rocking_period(theta0: Numbers, *, alpha: float) -> Any:
    """p T0 = 4 sqrt(2 abs(theta0) / sin(alpha)), for abs(theta0) << alpha (appendix A), any shape,
    in units of 1/p.

    Parameters
    ----------
    theta0
        The opening at the start, at rest, rad; any shape.
    alpha
        The slenderness angle of the block, rad.

    Raises
    ------
    ParameterError
        abs(theta0) >= alpha.

    Examples
    --------
    >>> round(float(saltus.theory.short_rocking_period(1e-6, alpha=0.3) / saltus.theory.rocking_period(1e-6, alpha=0.3)), 4)
    1.0
    """
    return 4 * np.sqrt(2 * _amplitude(theta0, alpha) / math.sin(alpha))


def slender_rocking_period(theta0: Numbers, *, alpha: float) -> Any:
    """p T0 = 4 arccosh(1 / (1 - abs(theta0) / alpha)), for slender blocks (Housner 1963), any
    shape, in units of 1/p.

    It holds for small alpha and every abs(theta0) < alpha, not only close to alpha as the paper
    says (errata 17); its relative error is of order alpha^2.

    Parameters
    ----------
    theta0
        The opening at the start, at rest, rad; any shape.
    alpha
        The slenderness angle of the block, rad.

    Raises
    ------
    ParameterError
        abs(theta0) >= alpha.

    Examples
    --------
    >>> round(float(saltus.theory.slender_rocking_period(0.005, alpha=0.01) / (4 * np.arccosh(2.0))), 12)
    1.0
    """
    return 4 * np.arccosh(1 / (1 - _amplitude(theta0, alpha) / alpha))


def rocking_energy_jump(
    velocity: Numbers, *, alpha: float, e: float, ground_velocity: Numbers = 0.0
) -> Any:
    """[[T]] at an impact with theta'+ = e theta'-, over (4/3) M R^2 p^2 (appendix A, errata 10: the
    term zeta'^2 cancels):

        [[T]] = -(1 - e) / 2 {(1 + e) theta'^2 + 2 theta' zeta' cos(alpha)}

    Parameters
    ----------
    velocity
        theta'- in the time p t, any shape.
    alpha
        The slenderness angle of the block, rad.
    e
        The factor of the velocity at an impact.
    ground_velocity
        zeta' in the same time, zeta = 3 U_h / (4 R); it broadcasts.

    Examples
    --------
    >>> round(float(saltus.theory.rocking_energy_jump(0.1, alpha=0.3, e=0.5)), 12)  # -(1 - e^2) / 2 theta'^2
    -0.00375
    """
    _check(alpha, e)
    velocity, ground_velocity = (
        numbers("velocity", velocity),
        numbers("ground_velocity", ground_velocity),
    )
    check_shapes(velocity=velocity, ground_velocity=ground_velocity)
    return (
        -(1 - e) / 2 * ((1 + e) * velocity**2 + 2 * velocity * ground_velocity * math.cos(alpha))
    )[()]


def rocking_energy_decreases(
    velocity: Numbers, *, alpha: float, e: float, ground_velocity: Numbers = 0.0
) -> Any:
    """Whether an impact with e < 1 lowers the kinetic energy (appendix A): if at least one of two
    conditions holds (errata 12):

        theta' zeta' > 0,   or   abs(zeta') < (1 + e) / (2 cos(alpha)) abs(theta')

    Broadcasts; arrays of bool.

    Parameters
    ----------
    velocity
        theta'- in the time p t, any shape.
    alpha
        The slenderness angle of the block, rad.
    e
        The factor of the velocity at an impact.
    ground_velocity
        zeta' in the same time, zeta = 3 U_h / (4 R); it broadcasts.

    Examples
    --------
    >>> bool(saltus.theory.rocking_energy_decreases(0.1, alpha=0.3, e=0.9))
    True
    """
    _check(alpha, e)
    velocity, ground_velocity = (
        numbers("velocity", velocity),
        numbers("ground_velocity", ground_velocity),
    )
    check_shapes(velocity=velocity, ground_velocity=ground_velocity)
    slow_ground = np.abs(ground_velocity) < (1 + e) / (2 * math.cos(alpha)) * np.abs(velocity)
    return ((e < 1) & ((velocity * ground_velocity > 0) | slow_ground))[()]


def housner_restitution(alpha: float) -> float:
    """r = (1 - (3/2) sin^2(alpha))^2, the share of the energy kept if the angular momentum about
    the new corner is conserved (Housner 1963).

    The factor of the velocity is 1 - (3/2) sin^2(alpha), above 0 for sin^2(alpha) < 2/3.

    Parameters
    ----------
    alpha
        The slenderness angle of the block, rad.

    Raises
    ------
    ParameterError
        sin^2(alpha) >= 2/3, where the block would have to bounce back.

    Examples
    --------
    >>> round(float(saltus.theory.housner_restitution(np.arcsin(0.5))), 12)  # (1 - 3/8)^2
    0.390625
    """
    _check(alpha, 1.0)
    factor = 1 - 1.5 * math.sin(alpha) ** 2
    if factor <= 0:
        raise ParameterError(
            f"alpha must be below {math.asin(math.sqrt(2 / 3)):.6g} rad for the block to rock "
            f"on, got {alpha!r}",
            "alpha",
        )
    return factor**2


def _amplitude(theta0: Any, alpha: float) -> Any:
    _check(alpha, 1.0)
    size = np.abs(numbers("theta0", theta0))
    if not np.all(size < alpha):
        raise ParameterError(
            f"abs(theta0) must be below alpha = {alpha:.6g} rad, or the block overturns; got "
            f"{theta0!r}",
            "theta0",
        )
    return size


def _check(alpha: float, e: float) -> None:
    check_number("alpha", alpha, above=0.0, below=math.pi / 2, unit="rad")
    check_number("e", e, at_least=0.0, at_most=1.0)
