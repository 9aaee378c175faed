"""Conservative motion between two unequal peaks: the bouncing-like motion of unequal layers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.checks import Numbers, check_number
from saltus.errors import ParameterError
from saltus.systems import System
from saltus.theory.arguments import check_shapes, numbers
from saltus.theory.layer import Layer, layers
from saltus.theory.loaded_equilibria import zeros_of_slope


@dataclass(frozen=True, slots=True)
class Peaks:
    """The two peaks of a periodic motion through theta = 0, and the speeds at theta = 0 on both
    sides.

    Attributes
    ----------
    theta_min
        The peak on the upper side, rad, below 0.
    theta_max
        The peak on the lower side, rad, above 0.
    lower_speed
        abs(theta') at theta = 0 on the lower side.
    upper_speed
        abs(theta') at theta = 0 on the upper side.
    period
        The period of the whole oscillation, by quadrature.

    Examples
    --------
    >>> peaks = saltus.theory.peaks(tristable, 0.1)
    >>> round(peaks.theta_min + peaks.theta_max, 12)  # equal layers: as far to both sides
    0.0
    """

    theta_min: float
    theta_max: float
    lower_speed: float
    upper_speed: float
    period: float

    @property
    def ratio(self) -> float:
        """The peak ratio P_R = min(theta_max / abs(theta_min), abs(theta_min) / theta_max)."""
        low, high = sorted((self.theta_max, -self.theta_min))
        return low / high


def peaks(system: System, theta0: float) -> Peaks:
    """Both peaks of the undamped motion from theta0, at rest, under constant loads (`pot_balance`,
    errata 6 and 7).

    The motion starts on the side of theta0's sign. The speed at theta = 0 follows from P(theta0) =
    M v^2 / 2, the system's impact law gives the speed on the other side, and the other peak is
    where M v^2 / 2 = P again; with m = 0 and e = 1 this is

        k theta_max^2 / 2 - V sin(beta0 + theta_max) = theta_min^2 / 2 - V sin(beta0 +
        abs(theta_min))

    With m > 0 and e = 1 one impact changes the energy and the next one changes it back; with r = 1
    each keeps it.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta0
        The opening at the start, at rest, rad.

    Raises
    ------
    ParameterError
        Damping; an impact law under which the motion does not repeat itself; a theta0 that is 0 or
        from which theta = 0 is not reached; a peak beyond the kinematic limit; a load that varies
        in time.

    Examples
    --------
    >>> round(saltus.theory.peaks(tristable, 0.1).theta_max, 12)
    0.1
    """
    check_number("theta0", theta0)
    lower, upper = layers(system)
    if lower.damping or upper.damping:
        raise ParameterError(
            "peak ratios are for undamped motion; set model.damping to 0, got "
            f"{system.get('model.damping')!r}",
            "model.damping",
        )
    here, there = (lower, upper) if theta0 > 0 else (upper, lower)
    speed = _fall_speed(here, abs(theta0))
    other_speed = _after_impact(system, speed, here.side)
    if not math.isclose(_after_impact(system, other_speed, there.side), speed, rel_tol=1e-12):
        raise ParameterError(
            f"{system.impact!r} loses energy, so the motion does not repeat; use e = 1 or r = 1",
            "impact",
        )
    other = turning_point(there, there.mass * other_speed**2 / 2)
    period = 2 * (fall_time(here, abs(theta0)) + fall_time(there, other))
    if here is lower:
        return Peaks(-other, theta0, speed, other_speed, period)
    return Peaks(theta0, other, other_speed, speed, period)


def turning_point(layer: Layer, energy: float) -> float:
    """The opening x > 0 at which a motion that leaves contact with this kinetic energy turns back:
    the first P(x) = energy.

    Raises
    ------
    ParameterError
        Energy <= 0, or so large that the layer passes its kinematic limit.
    """
    from scipy.optimize import brentq

    if not energy > 0:
        raise ParameterError(f"a layer opens only with kinetic energy above 0, got {energy!r}")
    nodes = [0.0, *zeros_of_slope(layer), layer.kinematic_limit]
    for a, b in pairwise(nodes):
        if layer.potential(b) >= energy:
            return float(
                brentq(
                    lambda x: layer.potential(x) - energy,
                    a,
                    b,
                    xtol=1e-300,
                    rtol=1e-15,
                    maxiter=5000,
                )
            )
    raise ParameterError(
        f"the motion passes the kinematic limit abs(theta) = {layer.kinematic_limit:.6g} rad; "
        "start lower",
        "theta0",
    )


def fall_time(layer: Layer, peak: float) -> float:
    """The time from rest at the opening `peak` to contact, without damping: the integral of dx /
    sqrt(2 (P(peak) - P(x)) / M).

    With x = peak (1 - u^2) the singularity at the peak is gone; the quadrature is good to about
    1e-13.
    """
    from scipy.integrate import quad

    def integrand(u: float) -> float:
        # P(peak) - P(peak - d) with d = peak u^2, by products of sines, so that nothing cancels
        # near u = 0
        d = peak * u * u
        middle = layer.beta0 + peak - d / 2
        half_chord = math.sin(d / 2) / d if d else 0.5
        pushes = layer.outward * math.sin(middle) + layer.vertical * math.cos(middle)
        drop_per_d = layer.stiffness * (peak - d / 2) - 2 * half_chord * pushes
        return 2 * math.sqrt(peak * layer.mass / (2 * drop_per_d))

    return float(quad(integrand, 0.0, 1.0, epsabs=1e-14, epsrel=1e-13, limit=200)[0])


def unloaded_peak_ratio(
    stiffness_ratio: Numbers, mass_ratio: Numbers = 0.0, *, energy_conserving: bool = False
) -> Any:
    """P_R without loads, any shape (`quasi-bounce-peak`, errata 7):

        min(sqrt(k), 1/sqrt(k))                  if the impact keeps the energy (r = 1), for every m
        min(sqrt((1+m)/k), sqrt(k/(1+m)))        if it keeps the velocity (e = 1)

    It vanishes for k -> 0 and for k -> infinity; with e = 1 also for m -> infinity.

    Parameters
    ----------
    stiffness_ratio
        k = K1 / K2.
    mass_ratio
        m = M1 / M2.
    energy_conserving
        Whether the impact keeps the energy (r = 1) and not the velocity (e = 1).

    Examples
    --------
    >>> float(saltus.theory.unloaded_peak_ratio(4.0, energy_conserving=True))  # 1 / sqrt(k) or its inverse
    0.5
    """
    _check_ratios(stiffness_ratio, mass_ratio)
    ratio = np.sqrt(
        (1 if energy_conserving else 1 + np.asarray(mass_ratio)) / np.asarray(stiffness_ratio)
    )
    return np.minimum(ratio, 1 / ratio)


def unloaded_half_periods(stiffness_ratio: Numbers, mass_ratio: Numbers = 0.0) -> tuple[Any, float]:
    """Durations without loads on the lower and on the upper side (`period_case1`): pi sqrt((1+m)/k)
    and pi, any shape.

    Parameters
    ----------
    stiffness_ratio
        k = K1 / K2.
    mass_ratio
        m = M1 / M2.

    Examples
    --------
    >>> lower, upper = saltus.theory.unloaded_half_periods(1.0)
    >>> float(lower), upper
    (3.141592653589793, 3.141592653589793)
    """
    _check_ratios(stiffness_ratio, mass_ratio)
    return math.pi * np.sqrt((1 + np.asarray(mass_ratio)) / np.asarray(stiffness_ratio)), math.pi


def unloaded_period(stiffness_ratio: Numbers, mass_ratio: Numbers = 0.0) -> Any:
    """T0(k, m) = pi (1 + sqrt((1+m)/k)) (`period_case2`), any shape; pi for k -> infinity,
    unbounded for k -> 0 or m -> infinity.

    It holds for e = 1 and for r = 1, since without loads the durations do not depend on the
    amplitude.

    Parameters
    ----------
    stiffness_ratio
        k = K1 / K2.
    mass_ratio
        m = M1 / M2.

    Examples
    --------
    >>> round(float(saltus.theory.unloaded_period(4.0) / np.pi), 12)  # (1 + 1 / sqrt(k)) half periods
    1.5
    """
    lower, upper = unloaded_half_periods(stiffness_ratio, mass_ratio)
    return lower + upper


def reciprocal(system: System, theta0: float) -> tuple[System, float]:
    """The system with the layers' roles exchanged, and the start that has the same peak ratio
    (`Prprop`):

        P_R(V, k), from theta0, equals P_R(V / k, 1 / k) from -theta0

    Constant forces on the upper mass only, m = 0. P and M are divided by k, which rescales time by
    sqrt(k) and leaves the angles.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta0
        The opening at the start, at rest, rad.

    Raises
    ------
    ParameterError
        m above 0, or forces on the lower mass, for which the exchange is not of this form.

    Examples
    --------
    >>> other, theta = saltus.theory.reciprocal(tristable, 0.1)
    >>> round(abs(theta), 12)  # equal layers: the same motion
    0.1
    """
    check_number("theta0", theta0)
    lower, upper = layers(system)
    if (
        lower.mass != upper.mass
        or lower.vertical != upper.vertical
        or lower.outward != -upper.outward
    ):
        raise ParameterError(
            "the reciprocity of the peak ratio is for m = 0 and forces on the upper mass only",
            "system",
        )
    k = lower.stiffness
    changes = {
        "model.stiffness_ratio": 1 / k,
        "load.vertical": upper.vertical / k,
        "load.horizontal": upper.outward / k,
    }
    return system.with_(changes), -float(theta0)


def _fall_speed(layer: Layer, peak: float) -> float:
    if peak == 0:
        raise ParameterError(
            "theta0 must not be 0: a motion with two peaks starts at one of them", "theta0"
        )
    if peak > layer.kinematic_limit:
        raise ParameterError(
            f"abs(theta0) must lie in (0, {layer.kinematic_limit:.6g}] rad, the kinematic limit, "
            f"got {peak!r}",
            "theta0",
        )
    start = float(layer.potential(peak))
    highest = max([0.0, *(float(layer.potential(x)) for x in zeros_of_slope(layer) if x < peak)])
    if start <= highest or layer.slope(peak) <= 0:
        raise ParameterError(
            f"a motion from theta0 = {layer.side * peak!r} at rest never reaches theta = 0",
            "theta0",
        )
    return math.sqrt(2 * start / layer.mass)


def _after_impact(system: System, speed: float, side: int) -> float:
    """The speed after an impact that ends `side`, of a motion that comes to the contact with the
    velocity -side speed.
    """
    return abs(
        float(
            system.impact.velocity_after(
                system.one_contact, 0.0, -side * speed, side, -side, system.load
            )
        )
    )


def _check_ratios(stiffness_ratio: Any, mass_ratio: Any) -> None:
    check_shapes(
        stiffness_ratio=numbers("stiffness_ratio", stiffness_ratio, above=0.0),
        mass_ratio=numbers("mass_ratio", mass_ratio, at_least=0.0),
    )
