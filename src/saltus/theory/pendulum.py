"""The upright cell, beta0 = pi/2: a smooth inverted pendulum on a torsional spring."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.public_functions import Numbers
from saltus.systems import System
from saltus.theory.layer import metainterface


def pendulum_acceleration(system: System, tau: Numbers, theta: Numbers, velocity: Numbers) -> Any:
    """theta'' of the symmetric system at beta0 = pi/2 (`gov_eqn_special`), any shape and any loads:

        theta'' + C theta' + theta = cos(theta) (H - zeta'') - sin(theta) (V - nu'')

    The sign of theta drops out: sin(abs(theta) + pi/2) = cos(theta) and sgn(theta) cos(abs(theta) + pi/2) = -sin(theta),
    so that with e = 1 an impact changes nothing.

    Parameters
    ----------
    system
        A symmetric metainterface with beta0 = pi/2.
    tau
        The dimensionless time; any shape.
    theta
        The coordinate, rad; any shape.
    velocity
        theta'; any shape.

    Raises
    ------
    ParameterError
        beta0 other than pi/2, unequal layers, or forces on the lower mass.

    Examples
    --------
    >>> float(saltus.theory.pendulum_acceleration(linear, 0.0, 0.0, 0.0))
    0.0
    """
    model, load = metainterface(system), system.load
    if abs(model.beta0 - math.pi / 2) > 1e-15 or (model.stiffness_ratio, model.mass_ratio, model.dissipation_ratio) != (1, 0, 1):
        raise ParameterError(f"the pendulum needs beta0 = pi/2 and equal layers (k = c = 1, m = 0), got {model!r}", "model.beta0")
    if any(name.startswith("lower_") for name in load.channels):
        raise ParameterError(
            "the pendulum takes forces on the upper mass only; drop load.lower_horizontal and load.lower_vertical", "load"
        )
    across = load.horizontal(tau) - load.ground_horizontal.acceleration(tau)
    along = load.vertical(tau) - load.ground_vertical.acceleration(tau)
    return np.cos(theta) * across - np.sin(theta) * along - model.damping * np.asarray(velocity) - theta
