"""Small free vibrations under a constant vertical load: frequencies, period, decay by impacts.

The upright cell is here too, and the onset of the motion under a fast horizontal load, a closed
form that the paper lacks (errata 28).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import Numbers, check_number
from saltus.errors import ParameterError
from saltus.systems import System
from saltus.theory.arguments import check_shapes, numbers
from saltus.theory.layer import Layer, layers, metainterface
from saltus.theory.loaded_equilibria import MOMENT_ROUNDING


@dataclass(frozen=True, slots=True)
class Vibration:
    """The small vibration of one open layer about its own (virtual) centre (`gov_beta_reduced`).

    Attributes
    ----------
    frequency
        The apparent angular frequency Omega_0.
    damping_ratio
        mu.
    centre
        theta of the linearised equilibrium.

    Examples
    --------
    >>> constant = saltus.System(model=system.model, load=saltus.Load(vertical=-0.5))
    >>> lower, upper = saltus.theory.vibrations(constant)
    >>> lower.frequency == upper.frequency
    True
    """

    frequency: float
    damping_ratio: float
    centre: float


def vibrations(system: System) -> tuple[Vibration, Vibration]:
    """Omega_0 and mu on the lower layer (p = 1) and on the upper one (p = 2) (`fre_freq_xi`):

        Omega_0 = sqrt(kappa / M),   mu = C_p / (2 sqrt(M kappa)),   kappa = k^P + V sin(beta0),  M
        = (1+m)^P,  C_p = c^P C

    A constant H adds -s H cos(beta0) to kappa.

    Parameters
    ----------
    system
        A metainterface under constant loads.

    Raises
    ------
    ParameterError
        kappa <= 0, where the layer does not vibrate; another model, or a load that varies in time.

    Examples
    --------
    >>> constant = saltus.System(model=system.model, load=saltus.Load(vertical=-0.5))
    >>> [round(vibration.frequency, 7) for vibration in saltus.theory.vibrations(constant)]
    [0.7124578, 0.7124578]
    """
    return vibration(layers(system)[0]), vibration(layers(system)[1])


def vibration(layer: Layer) -> Vibration:
    """Omega_0, mu and the centre of one layer, as in `vibrations`."""
    kappa = float(layer.curvature(0.0))
    if kappa <= 0:
        name = "lower" if layer.side > 0 else "upper"
        raise ParameterError(
            f"the {name} layer does not vibrate: its linear stiffness k + V sin(beta0) = "
            f"{kappa:.6g} must be above 0",
            "load.vertical",
        )
    frequency = math.sqrt(kappa / layer.mass)
    centre = layer.side * float(layer.push(0.0)) / kappa
    return Vibration(frequency, layer.damping / (2 * math.sqrt(layer.mass * kappa)), centre)


def linear_period(theta0: Numbers, *, beta0: float, vertical: float) -> Any:
    """T0(theta0) of the symmetric undamped system (`t-beta`; k = 1, m = C = 0, e = 1), any shape:

        T0 = 4 / sqrt(kappa) arccos(1 / (1 - kappa abs(theta0) / (V cos(beta0)))),   kappa = 1 + V
        sin(beta0)

    continued to kappa <= 0, where it is an arccosh and grows without bound as abs(theta0) nears the
    saddle of `non-trivial`.

    Parameters
    ----------
    theta0
        The opening at the start, at rest, rad; any shape.
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    vertical
        The constant load V.

    Raises
    ------
    ParameterError
        V cos(beta0) > 0 (theta = 0 is then unstable, `stabeunstabletrivial`), or theta0 at or past
        the saddle.

    Examples
    --------
    >>> motion = saltus.simulate(tristable, theta=1e-4, duration=1.0)
    >>> round(float(motion.impacts.time[0] / (saltus.theory.linear_period(1e-4, beta0=np.deg2rad(80), vertical=-1.5) / 4)), 4)
    1.0
    """
    kappa, closing = _linear(beta0, vertical)
    size = np.abs(numbers("theta0", theta0))
    if closing <= MOMENT_ROUNDING:
        if closing < -MOMENT_ROUNDING or kappa <= 0:
            raise ParameterError(
                "no vibration about theta = 0, stable only for V cos(beta0) below 0, got "
                f"{-closing:.6g}",
                "vertical",
            )
        period = np.full_like(size, 2 * math.pi / math.sqrt(kappa))
        return period if period.ndim else float(period)
    stretch = kappa * size / closing  # the argument of arccos is 1 / (1 + stretch)
    if np.any(stretch <= -1):
        raise ParameterError(
            f"abs(theta0) must be below the saddle at {closing / -kappa:.6g} rad: beyond it the "
            "motion diverges",
            "theta0",
        )
    tangent = np.sqrt(np.abs(stretch) * (2 + stretch))
    if kappa > 0:
        period = 4 / math.sqrt(kappa) * np.arctan(tangent)
    elif kappa < 0:
        period = 4 / math.sqrt(-kappa) * np.log1p((tangent - stretch) / (1 + stretch))
    else:
        period = 4 * np.sqrt(2 * size / closing)
    return period if period.ndim else float(period)


def short_period(theta0: Numbers, *, beta0: float, vertical: float) -> Any:
    """T0 for abs(theta0) << abs(V cos(beta0) / (1 + V sin(beta0))) (`t-beta_exp`), any shape:

        T0 = 4 sqrt(2 abs(theta0)) / sqrt(-V cos(beta0)), the next factor being 1 + 5/12 kappa
        abs(theta0) / (V cos(beta0))

    Parameters
    ----------
    theta0
        The opening at the start, at rest, rad; any shape.
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    vertical
        The constant load V.

    Raises
    ------
    ParameterError
        V cos(beta0) >= 0.

    Examples
    --------
    >>> short = saltus.theory.short_period(1e-6, beta0=1.4, vertical=-0.5)
    >>> round(float(short / saltus.theory.linear_period(1e-6, beta0=1.4, vertical=-0.5)), 4)
    1.0
    """
    closing = _linear(beta0, vertical)[1]
    if closing <= MOMENT_ROUNDING:
        raise ParameterError(
            f"this expansion needs V cos(beta0) below 0, got {-closing:.6g}", "vertical"
        )
    return 4 * np.sqrt(2 * np.abs(numbers("theta0", theta0))) / math.sqrt(closing)


def upright_period(theta0: Numbers, *, beta0: float, vertical: float) -> Any:
    """T0 for beta0 close to pi/2 (`t-beta_exp2`), any shape; its error is of order (pi/2 -
    beta0)^2:

        T0 = 4 / sqrt(1+V) arccos(1 / (1 - (1+V) / V abs(theta0) / (pi/2 - beta0)))

    Parameters
    ----------
    theta0
        The opening at the start, at rest, rad; any shape.
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    vertical
        The constant load V.

    Raises
    ------
    ParameterError
        V (pi/2 - beta0) >= 0, V = -1, or theta0 at or past the saddle V (pi/2 - beta0) / (1+V).

    Examples
    --------
    >>> upright = saltus.theory.upright_period(1e-9, beta0=1.57, vertical=-0.5)
    >>> round(float(upright / saltus.theory.short_period(1e-9, beta0=1.57, vertical=-0.5)), 3)
    1.0
    """
    check_number("beta0", beta0, above=0.0, below=math.pi, unit="rad")
    check_number("vertical", vertical)
    closing = -vertical * (math.pi / 2 - beta0)
    kappa = 1 + vertical
    if closing <= 0 or kappa == 0:
        raise ParameterError(
            "this expansion needs V (pi/2 - beta0) below 0 and V other than -1, got V = "
            f"{vertical!r}",
            "vertical",
        )
    stretch = kappa * np.abs(numbers("theta0", theta0)) / closing
    if np.any(stretch <= -1):
        raise ParameterError(
            f"abs(theta0) must be below the saddle at {closing / -kappa:.6g} rad: beyond it the "
            "motion diverges",
            "theta0",
        )
    angle = (
        np.arccos(1 / (1 + stretch)) / math.sqrt(kappa)
        if kappa > 0
        else np.arccosh(1 / (1 + stretch)) / math.sqrt(-kappa)
    )
    return 4 * angle


def decayed_amplitude(cycle: Numbers, *, theta0: float, e: float) -> Any:
    """Amplitude theta_D of the n-th cycle, from peak to peak (`approx1`, errata 8): e^(4 (n-1))
    theta0, n = 1, 2, ...

    The paper prints e^(4n). Each impact multiplies the energy by e^2; small amplitudes are
    proportional to the energy.

    Parameters
    ----------
    cycle
        n, a number or an array of them.
    theta0
        The opening at the start, at rest, rad.
    e
        The factor of the velocity at an impact.

    Raises
    ------
    ParameterError
        e out of (0, 1], or n below 1.

    Examples
    --------
    >>> float(saltus.theory.decayed_amplitude(2, theta0=1.0, e=0.5))  # e^4
    0.0625
    """
    check_number("theta0", theta0)
    return theta0 * _factor(cycle, e) ** 4


def decayed_period(cycle: Numbers, *, period: float, e: float) -> Any:
    """Duration T_D of the n-th cycle, from peak to peak (`reduced_period`): e^(2 (n-1)) (1+e)^2 T0
    / 4, n = 1, 2, ...

    Counted from impact to impact instead, the first lasts (1 + 2e) T0 / 4 from the start (errata
    8).

    Parameters
    ----------
    cycle
        n, a number or an array of them.
    period
        T0(theta0) without losses.
    e
        The factor of the velocity at an impact.

    Raises
    ------
    ParameterError
        e out of (0, 1], n below 1, or a period that is not above 0.

    Examples
    --------
    >>> float(saltus.theory.decayed_period(1, period=4.0, e=0.5))
    2.25
    """
    check_number("period", period, above=0.0)
    factor = _factor(cycle, e)
    return (1 + e) ** 2 / 4 * period * factor**2


def final_time(*, period: float, e: float) -> float:
    """The time at which small vibrations end (`finaltime`): (1+e) / (4 (1-e)) T0(theta0), the sum
    of all `decayed_period`.

    Parameters
    ----------
    period
        T0(theta0) without losses.
    e
        The factor of the velocity at an impact.

    Raises
    ------
    ParameterError
        e out of [0, 1): without losses the vibration goes on for ever; a period that is not above
        0.

    Examples
    --------
    >>> saltus.theory.final_time(period=4.0, e=0.5)  # (1 + e) / (1 - e) quarters of the period
    3.0
    """
    check_number("period", period, above=0.0)
    check_number("e", e, at_least=0.0, below=1.0)
    return (1 + e) / (4 * (1 - e)) * period


def _factor(cycle: Any, e: float) -> Any:
    """e^(n-1)."""
    check_number("e", e, above=0.0, at_most=1.0)
    return e ** (numbers("cycle", cycle, at_least=1.0) - 1)


def _linear(beta0: float, vertical: float) -> tuple[float, float]:
    """kappa = 1 + V sin(beta0) and -V cos(beta0)."""
    check_number("beta0", beta0, above=0.0, below=math.pi, unit="rad")
    check_number("vertical", vertical)
    return 1 + vertical * math.sin(beta0), -vertical * math.cos(beta0)


def pendulum_acceleration(system: System, tau: Numbers, theta: Numbers, velocity: Numbers) -> Any:
    """theta'' of the symmetric system at beta0 = pi/2 (`gov_eqn_special`), any shape and any loads:

        theta'' + C theta' + theta = cos(theta) (H - zeta'') - sin(theta) (V - nu'')

    The sign of theta drops out: sin(abs(theta) + pi/2) = cos(theta) and sgn(theta) cos(abs(theta) +
    pi/2) = -sin(theta), so that with e = 1 an impact changes nothing.

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
    model = metainterface(system)
    load = system.load
    if abs(model.beta0 - math.pi / 2) > 1e-15 or (
        model.stiffness_ratio,
        model.mass_ratio,
        model.dissipation_ratio,
    ) != (1, 0, 1):
        raise ParameterError(
            f"the pendulum needs beta0 = pi/2 and equal layers (k = c = 1, m = 0), got {model!r}",
            "model.beta0",
        )
    if any(name.startswith("lower_") for name in load.channels):
        raise ParameterError(
            "the pendulum takes forces on the upper mass only; drop load.lower_horizontal and "
            "load.lower_vertical",
            "load",
        )
    tau, theta, velocity = (
        numbers(name, value)
        for name, value in (("tau", tau), ("theta", theta), ("velocity", velocity))
    )
    check_shapes(tau=tau, theta=theta, velocity=velocity)
    across = load.horizontal(tau) - load.ground_horizontal.acceleration(tau)
    along = load.vertical(tau) - load.ground_vertical.acceleration(tau)
    return (
        np.cos(theta) * across
        - np.sin(theta) * along
        - model.damping * np.asarray(velocity)
        - theta
    )


def high_frequency_onset(
    frequency: Numbers, *, beta0: float, vertical: float, damping: float, order: int = 1
) -> Any:
    """Hhat_LP, the least amplitude of H = Hhat sin(Omega tau) under which a period-1 motion exists
    beside theta = 0, any shape.

        order 1:  Hhat_LP = Hcr C pi^3 / (24 Omega),   Hcr = abs(V / tan(beta0)); relative error
        O(Omega^-2) order 2:  the same times 1 + [(pi^2/5 - 1) kappa - (12 - pi^2)/4 A / tan(beta0)
        + (1/2 - pi^2/10) C^2] / Omega^2,
                  kappa = 1 + V sin(beta0), A = -V cos(beta0); relative error O(Omega^-4)

    for the symmetric system (k = c = 1, m = 0, e = 1). Derivation. With u = Omega tau + phase and
    theta = x / Omega^2, to leading order x'' = h sin(u + phi) - A sgn(x) - (C / Omega) x', h = Hhat
    sin(beta0). With h and C / Omega small the motion consists of parabolas x = A u (pi - u) / 2 of
    duration pi, locked to half a forcing period, and phi is set by the energy balance over one:

        work of the load        integral of h sin(u + phi) x' du       = 2 h A sin(phi)
        loss in the dampers     (C / Omega) integral of x'^2 du        = (C / Omega) A^2 pi^3 / 12

    so sin(phi) = A C pi^3 / (24 Omega h), which has two solutions (one stable) for h above the
    value at sin(phi) = 1, where they meet in the fold; A / sin(beta0) is Hcr. Order 2 is the same
    balance on the arcs of x'' = -A - (kappa / Omega^2) x, whose period is held at 2 pi; with the
    parametric term Hhat cos(beta0) abs(theta) of the load; and with the damped parabola solved
    exactly, h = A J sqrt(1 + d^2) / (2 cosh(pi d / 2)), J = (pi cosh(pi d / 2) - 2 sinh(pi d / 2) /
    d) / d, d = C / Omega.

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
        V cos(beta0) >= 0 or C <= 0 (no onset), Omega^2 <= max(kappa, C^2) (not fast), an order not
        1 or 2.

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
        raise ParameterError(
            f"the onset needs a stable undeformed state, V cos(beta0) below 0, got {-closing:.6g}",
            "vertical",
        )
    slowest = math.sqrt(max(stiffness, damping**2))
    if not np.all(frequency > slowest):
        raise ParameterError(
            f"the onset is for high frequency, far above {slowest:.6g} here, got {frequency!r}",
            "frequency",
        )
    if order not in (1, 2):
        raise ParameterError(f"order must be 1 or 2, got {order!r}", "order")
    onset = closing / math.sin(beta0) * damping * math.pi**3 / (24 * frequency)
    if order == 2:
        stiff = (math.pi**2 / 5 - 1) * stiffness
        parametric = (12 - math.pi**2) / 4 * closing / math.tan(beta0)
        damped = (1 / 2 - math.pi**2 / 10) * damping**2
        onset = onset * (1 + (stiff - parametric + damped) / frequency**2)
    return onset[()]
