"""The onset of the non-trivial motion under a fast horizontal load: a closed form that the paper lacks (errata 28)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.checks import check_number
from saltus.errors import ParameterError
from saltus.public_functions import Numbers


def high_frequency_onset(frequency: Numbers, *, beta0: float, vertical: float, damping: float, order: int = 1) -> Any:
    """Hhat_LP, the least amplitude of H = Hhat sin(Omega tau) under which a period-1 motion exists beside theta = 0, any shape.

        order 1:  Hhat_LP = Hcr C pi^3 / (24 Omega),   Hcr = abs(V / tan(beta0)); relative error O(Omega^-2)
        order 2:  the same times 1 + [(pi^2/5 - 1) kappa - (12 - pi^2)/4 A / tan(beta0) + (1/2 - pi^2/10) C^2] / Omega^2,
                  kappa = 1 + V sin(beta0), A = -V cos(beta0); relative error O(Omega^-4)

    for the symmetric system (k = c = 1, m = 0, e = 1). Derivation. With u = Omega tau + phase and theta = x / Omega^2, to leading
    order x'' = h sin(u + phi) - A sgn(x) - (C / Omega) x', h = Hhat sin(beta0). With h and C / Omega small the motion consists of
    parabolas x = A u (pi - u) / 2 of duration pi, locked to half a forcing period, and phi is set by the energy balance over one:

        work of the load        integral of h sin(u + phi) x' du       = 2 h A sin(phi)
        loss in the dampers     (C / Omega) integral of x'^2 du        = (C / Omega) A^2 pi^3 / 12

    so sin(phi) = A C pi^3 / (24 Omega h), which has two solutions (one stable) for h above the value at sin(phi) = 1, where they
    meet in the fold; A / sin(beta0) is Hcr. Order 2 is the same balance on the arcs of x'' = -A - (kappa / Omega^2) x, whose
    period is held at 2 pi; with the parametric term Hhat cos(beta0) abs(theta) of the load; and with the damped parabola solved
    exactly, h = A J sqrt(1 + d^2) / (2 cosh(pi d / 2)), J = (pi cosh(pi d / 2) - 2 sinh(pi d / 2) / d) / d, d = C / Omega.

    The amplitude there is theta = A pi^2 / (8 Omega^2), which must be small against 1.

    Parameters
    ----------
    frequency
        Omega, any shape.
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    vertical
        The constant load V.
    damping
        C, above 0.
    order
        1 or 2, of the expansion.

    Raises
    ------
    ParameterError
        V cos(beta0) >= 0 or C <= 0 (no onset), Omega^2 <= max(kappa, C^2) (not fast), an order not 1 or 2.

    Examples
    --------
    >>> onset = saltus.theory.high_frequency_onset(4.0, beta0=1.4, vertical=-0.5, damping=0.1)
    >>> round(float(onset / (0.5 / np.tan(1.4) * 0.1 * np.pi**3 / 96)), 12)
    1.0
    """
    check_number("beta0", beta0, above=0.0, below=math.pi, unit="rad")
    check_number("damping", damping, above=0.0)
    frequency, stiffness, closing = (
        np.asarray(frequency, dtype=float),
        1 + vertical * math.sin(beta0),
        -vertical * math.cos(beta0),
    )
    if closing <= 0:
        raise ParameterError(f"the onset needs a stable undeformed state, V cos(beta0) below 0, got {-closing:.6g}", "vertical")
    slowest = math.sqrt(max(stiffness, damping**2))
    if not np.all(frequency > slowest):
        raise ParameterError(f"the onset is for high frequency, far above {slowest:.6g} here, got {frequency!r}", "frequency")
    if order not in (1, 2):
        raise ParameterError(f"order must be 1 or 2, got {order!r}", "order")
    onset = closing / math.sin(beta0) * damping * math.pi**3 / (24 * frequency)
    if order == 2:
        stiff = (math.pi**2 / 5 - 1) * stiffness
        parametric = (12 - math.pi**2) / 4 * closing / math.tan(beta0)
        damped = (1 / 2 - math.pi**2 / 10) * damping**2
        onset = onset * (1 + (stiff - parametric + damped) / frequency**2)
    return onset[()]
