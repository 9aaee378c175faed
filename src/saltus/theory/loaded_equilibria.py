"""Equilibria under constant loads, their stability, and when a small disturbance of theta = 0
diverges.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from saltus.systems import System
from saltus.theory.layer import Layer, layers

# moments below this share of a layer's scale count as zero, such as V cos(beta0) at pi/2
MOMENT_ROUNDING = 4e-15


class Stability(Enum):
    """Whether a small disturbance of an equilibrium grows.

    Examples
    --------
    >>> saltus.theory.undeformed_stability(tristable).name
    'STABLE'
    """

    STABLE = "stable"
    UNSTABLE = "unstable"
    FOLD = "fold"  #: P' = P'' = 0: two equilibria meet


@dataclass(frozen=True, slots=True)
class LoadedEquilibrium:
    """A state of rest under constant loads.

    Attributes
    ----------
    theta
        The coordinate, rad.
    stability
        Whether small disturbances stay small.
    energy
        P(theta) - P(0), over K2.
    curvature
        P''(theta); None at theta = 0, where P has a corner.
    eigenvalues
        The eigenvalues of the linearised motion, the faster growing one first; None at theta = 0.
    within_line
        Whether abs(theta) <= pi - beta0, the straight line.

    Examples
    --------
    >>> [state.stable for state in saltus.theory.equilibria(tristable)]
    [True, False, True, False, True]
    """

    theta: float
    stability: Stability
    energy: float
    curvature: float | None
    eigenvalues: tuple[complex, complex] | None
    within_line: bool

    @property
    def stable(self) -> bool:
        """Whether it is stable."""
        return self.stability is Stability.STABLE


def equilibria(system: System) -> tuple[LoadedEquilibrium, ...]:
    """Every equilibrium of the full equation within the kinematic limit 2 (pi - beta0), by
    increasing theta.

    They are the zeros of P'(theta) (`pot_balance0`), stable where P'' > 0, and theta = 0 while the
    loads hold both layers closed or push both open. Between the zeros of P'', known in closed form,
    P' is monotone, so none can be missed.

    Parameters
    ----------
    system
        A metainterface under constant loads.

    Raises
    ------
    ParameterError
        Another model, a smoothed sign, or a load that varies in time.

    Examples
    --------
    >>> [round(state.theta, 6) for state in saltus.theory.equilibria(tristable)]
    [-1.422524, -0.549847, 0.0, 0.549847, 1.422524]
    """
    lower, upper = layers(system)
    found = [_deformed(lower, x) for x in zeros_of_slope(lower)] + [
        _deformed(upper, x) for x in zeros_of_slope(upper)
    ]
    undeformed = undeformed_stability(system)
    if undeformed is not None:
        found.append(LoadedEquilibrium(0.0, undeformed, 0.0, None, None, True))
    return tuple(sorted(found, key=lambda e: e.theta))


def undeformed_stability(system: System) -> Stability | None:
    """Stability of theta = 0 (`stabeunstabletrivial`), or None where it is no equilibrium.

    With H = 0 it is stable for V cos(beta0) < 0 and unstable for V cos(beta0) > 0; in general,
    stable if the loads close both layers. If they push one open and the other closed the system
    leaves, and theta = 0 is no equilibrium. At V cos(beta0) = 0 the curvature decides, k^P + V
    sin(beta0).

    Parameters
    ----------
    system
        A metainterface under constant loads.

    Examples
    --------
    >>> saltus.theory.undeformed_stability(tristable).name
    'STABLE'
    """
    lower, upper = layers(system)
    closing = (slope_sign(lower), slope_sign(upper))
    if min(closing) > 0:
        return Stability.STABLE
    pushes = [layer.push(0.0) > MOMENT_ROUNDING * layer.scale for layer in (lower, upper)]
    return None if pushes[0] != pushes[1] else Stability.UNSTABLE


def zeros_of_slope(layer: Layer) -> Iterator[float]:
    """The openings 0 < x <= 2 (pi - beta0) where P'(x) = 0, increasing; a double zero is given
    once.
    """
    from scipy.optimize import brentq

    nodes = [0.0, *layer.inflections(), layer.kinematic_limit]
    signs = [slope_sign(layer), *(_sign(layer.slope(x), layer) for x in nodes[1:])]
    for (a, b), (before, after) in zip(pairwise(nodes), pairwise(signs), strict=True):
        if before * after < 0:
            start = (
                a if a > 0 or _sign(layer.slope(0.0), layer) else _past_contact(layer, b, before)
            )
            yield float(brentq(layer.slope, start, b, xtol=1e-15, rtol=1e-15))
        elif after == 0:
            yield b


def slope_sign(layer: Layer) -> int:
    """The sign of P' at small openings: that of the first of P', P'', ... that is not zero at x =
    0.

    P''' is the push, and if P', P'' and P''' vanish the next derivative is the stiffness, above 0.
    """
    for value in (layer.slope(0.0), layer.curvature(0.0)):
        if sign := _sign(value, layer):
            return sign
    return 1


def _sign(value: float, layer: Layer) -> int:
    return 0 if abs(value) <= MOMENT_ROUNDING * layer.scale else (1 if value > 0 else -1)


def _past_contact(layer: Layer, end: float, sign: int) -> float:
    """A small opening beyond the zero at x = 0, at which P' has the `sign` that it has at small
    openings.
    """
    x = end / 2
    while layer.slope(x) * sign <= 0:
        x /= 2
    return x


def _deformed(layer: Layer, x: float) -> LoadedEquilibrium:
    curvature = float(layer.curvature(x))
    stability = Stability.STABLE if curvature > 0 else Stability.UNSTABLE
    if x in layer.inflections():
        stability = Stability.FOLD
    within = x <= math.pi - layer.beta0
    return LoadedEquilibrium(
        layer.side * x,
        stability,
        float(layer.potential(x)),
        curvature,
        layer.eigenvalues(curvature),
        within,
    )


@dataclass(frozen=True, slots=True)
class Divergence:
    """The initial theta(0), at rest, from which the linearised motion does not return to theta = 0
    (bullets after `minmin`).

    Attributes
    ----------
    from_rest
        Whether it diverges from every small theta(0) of at least one sign: theta = 0 is then
        unstable.
    above
        It diverges from every theta(0) above this one; None if never.
    below
        It diverges from every theta(0) below this one; None if never.

    Examples
    --------
    >>> saltus.theory.divergence(linear).from_rest
    False
    """

    from_rest: bool
    above: float | None
    below: float | None


def linear_equilibria(system: System) -> tuple[LoadedEquilibrium, ...]:
    """The equilibria of `gov_eqn_constant_loading_lin`, by increasing theta: theta_B, 0 and
    theta_A, where they exist:

        theta_A = V cos(beta0) / (k + V sin(beta0)) > 0,   theta_B = -V cos(beta0) / (1 + V
        sin(beta0)) < 0   (`non-trivial`)

    with P(theta) - P(0) = -(V cos(beta0))^2 / (2 (k^P + V sin(beta0))), so each is stable just
    where theta = 0 is not. For V cos(beta0) < 0, both exist where V sin(beta0) < -max(1, k), one of
    them where V sin(beta0) < -min(1, k) (`minmin`, errata 15). They approximate the equilibria of
    the full equation only for beta0 close to pi/2. A constant H is included.

    Parameters
    ----------
    system
        A metainterface under constant loads.

    Raises
    ------
    ParameterError
        Another model, a smoothed sign, or a load that varies in time.

    Examples
    --------
    >>> len(saltus.theory.linear_equilibria(linear))
    1
    """
    found = [e for layer in layers(system) if (e := _linear_equilibrium(layer)) is not None]
    undeformed = undeformed_stability(system)
    if undeformed is not None:
        found.append(LoadedEquilibrium(0.0, undeformed, 0.0, None, None, True))
    return tuple(sorted(found, key=lambda e: e.theta))


def divergence(system: System) -> Divergence:
    """The divergence conditions under small rotations (bullets after `minmin`), any k, m and
    constant loads.

    If the loads push a layer open at theta = 0 (V cos(beta0) > 0) the motion diverges from every
    disturbance to its side. If they hold it closed (V cos(beta0) < 0) the motion diverges if k^P +
    V sin(beta0) < 0 and theta(0) lies beyond theta_A or theta_B. At beta0 = pi/2 both are 0: the
    motion diverges from theta(0) > 0 for V < -k, from theta(0) < 0 for V < -1.

    Parameters
    ----------
    system
        A metainterface under constant loads.

    Raises
    ------
    ParameterError
        Another model, a smoothed sign, or a load that varies in time.

    Examples
    --------
    >>> saltus.theory.divergence(linear)
    Divergence(from_rest=False, above=None, below=None)
    """
    lower, upper = layers(system)
    above = _threshold(lower)
    below = _threshold(upper)
    return Divergence(0.0 in (above, below), above, None if below is None else -below)


def _threshold(layer: Layer) -> float | None:
    """The opening beyond which the layer diverges or settles open; 0 if it does so from every
    opening, None if from none.
    """
    if slope_sign(layer) < 0:
        return 0.0
    kappa = float(layer.curvature(0.0))
    push = float(layer.push(0.0))
    return push / kappa if kappa < -MOMENT_ROUNDING * layer.scale else None


def _linear_equilibrium(layer: Layer) -> LoadedEquilibrium | None:
    kappa = float(layer.curvature(0.0))
    push = float(layer.push(0.0))
    if min(abs(kappa), abs(push)) <= MOMENT_ROUNDING * layer.scale or push / kappa < 0:
        return None
    x = push / kappa
    stability = Stability.STABLE if kappa > 0 else Stability.UNSTABLE
    return LoadedEquilibrium(
        layer.side * x,
        stability,
        -(push**2) / (2 * kappa),
        kappa,
        layer.eigenvalues(kappa),
        x <= math.pi - layer.beta0,
    )
