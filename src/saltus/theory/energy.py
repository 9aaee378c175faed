"""Potential and total energy under constant loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.public_functions import Numbers
from saltus.systems import System
from saltus.theory.layer import Layer, layers


def potential_energy(system: System, theta: Numbers) -> Any:
    """P(theta) of `pot_balance0`, constant H and loads on the lower mass included, zero at theta = 0; any shape, over K2:

        P = k^P theta^2 / 2 + V [sin(beta0) - sin(beta0 + abs(theta))] + s H [cos(beta0 + abs(theta)) - cos(beta0)]

    where V, H stand for (1+v)^P V, (1+h)^P H, and s for the sign of theta.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta
        The coordinate, rad; any shape.

    Raises
    ------
    ParameterError
        Another model, a smoothed sign, or a load that varies in time.

    Examples
    --------
    >>> float(saltus.theory.potential_energy(tristable, 0.0))
    0.0
    """
    return _by_side(system, theta, Layer.potential, odd=False)


def potential_slope(system: System, theta: Numbers) -> Any:
    """dP/dtheta, minus the moment on the open layer; at theta = 0 the mean of its two one-sided values. Any shape.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta
        The coordinate, rad; any shape.

    Examples
    --------
    >>> state = saltus.theory.equilibria(tristable)[0]
    >>> round(abs(float(saltus.theory.potential_slope(tristable, state.theta))), 12)
    0.0
    """
    return _by_side(system, theta, Layer.slope, odd=True)


def total_energy(system: System, theta: Numbers, velocity: Numbers, side: Numbers | None = None) -> Any:
    """E = T + P over K2, with the kinetic energy of the moving layer, (1+m)^P theta'^2 / 2 on a ground at rest (`kin_eng`).

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta, velocity
        Numbers or arrays that broadcast, rad and rad per unit of tau.
    side
        +1 or -1 of the same shape; the sign of theta if not given.

    Raises
    ------
    ParameterError
        theta = 0 without `side` where the layers' masses differ: the moving mass is then not known.

    Examples
    --------
    >>> round(float(saltus.theory.total_energy(tristable, 0.0, 0.2)), 12)  # 0.2^2 / 2, at the contact
    0.02
    """
    theta, velocity = np.asarray(theta, dtype=float), np.asarray(velocity, dtype=float)
    lower, upper = layers(system)
    if side is None:
        if lower.mass != upper.mass and np.any((theta == 0) & (velocity != 0)):
            raise ParameterError(
                "side must be given where theta is 0, since the layers' masses differ; it says which one moves", "side"
            )
        side = np.where(theta < 0, -1, 1)
    kinetic = system.model.kinetic_energy(0.0, theta, velocity, np.asarray(side), system.load)
    energy = kinetic + potential_energy(system, theta)
    return energy if np.ndim(energy) else float(energy)


def _by_side(system: System, theta: Any, function: Any, odd: bool) -> Any:
    theta = np.asarray(theta, dtype=float)
    size = np.abs(theta)
    lower, upper = (function(layer, size) for layer in layers(system))
    value = np.where(theta > 0, lower, -upper if odd else upper)
    if odd:
        value = np.where(theta == 0, (lower - upper) / 2, value)
    return value if value.ndim else float(value)
