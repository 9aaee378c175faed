"""Equilibria of the linearised equation, and when a small disturbance of the undeformed state diverges."""

from __future__ import annotations

import math
from dataclasses import dataclass

from saltus.systems import System
from saltus.theory.layer import Layer, layers
from saltus.theory.loaded_equilibria import MOMENT_ROUNDING, LoadedEquilibrium, Stability, slope_sign, undeformed_stability


@dataclass(frozen=True, slots=True)
class Divergence:
    """The initial theta(0), at rest, from which the linearised motion does not return to theta = 0 (bullets after `minmin`).

    Attributes
    ----------
    from_rest
        Whether it diverges from every small theta(0) of at least one sign: theta = 0 is then unstable.
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
    """The equilibria of `gov_eqn_constant_loading_lin`, by increasing theta: theta_B, 0 and theta_A, where they exist:

        theta_A = V cos(beta0) / (k + V sin(beta0)) > 0,   theta_B = -V cos(beta0) / (1 + V sin(beta0)) < 0   (`non-trivial`)

    with P(theta) - P(0) = -(V cos(beta0))^2 / (2 (k^P + V sin(beta0))), so each is stable just where theta = 0 is not. For
    V cos(beta0) < 0, both exist where V sin(beta0) < -max(1, k), one of them where V sin(beta0) < -min(1, k) (`minmin`,
    errata 15). They approximate the equilibria of the full equation only for beta0 close to pi/2. A constant H is included.

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
    """The divergence conditions under small rotations (bullets after `minmin`), any k, m and constant loads.

    If the loads push a layer open at theta = 0 (V cos(beta0) > 0) the motion diverges from every disturbance to its side. If they
    hold it closed (V cos(beta0) < 0) the motion diverges if k^P + V sin(beta0) < 0 and theta(0) lies beyond theta_A or theta_B.
    At beta0 = pi/2 both are 0: the motion diverges from theta(0) > 0 for V < -k, from theta(0) < 0 for V < -1.

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
    above, below = _threshold(lower), _threshold(upper)
    return Divergence(0.0 in (above, below), above, None if below is None else -below)


def _threshold(layer: Layer) -> float | None:
    """The opening beyond which the layer diverges or settles open; 0 if it does so from every opening, None if from none."""
    if slope_sign(layer) < 0:
        return 0.0
    kappa, push = float(layer.curvature(0.0)), float(layer.push(0.0))
    return push / kappa if kappa < -MOMENT_ROUNDING * layer.scale else None


def _linear_equilibrium(layer: Layer) -> LoadedEquilibrium | None:
    kappa, push = float(layer.curvature(0.0)), float(layer.push(0.0))
    if min(abs(kappa), abs(push)) <= MOMENT_ROUNDING * layer.scale or push / kappa < 0:
        return None
    x = push / kappa
    stability = Stability.STABLE if kappa > 0 else Stability.UNSTABLE
    return LoadedEquilibrium(
        layer.side * x, stability, -(push**2) / (2 * kappa), kappa, layer.eigenvalues(kappa), x <= math.pi - layer.beta0
    )
