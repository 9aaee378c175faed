"""The free vibration of the linearised, piecewise-linear equation, impact by impact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_count, check_number
from saltus.errors import ParameterError
from saltus.systems import System
from saltus.theory.layer import Layer, layers
from saltus.theory.small_vibrations import vibration


@dataclass(frozen=True, slots=True)
class Arc:
    """One smooth arc in the opening x of a layer, t counted from its start (`linsol_theta1`):

        x(t) = centre + e^(-decay t) [(start - centre) cos(w t) + (velocity + decay (start -
        centre)) / w sin(w t)]

    It is evaluated as start (...) + velocity (...) + centre (1 - ...), which is accurate also for
    short t.
    """

    layer: Layer
    centre: float
    decay: float  # mu Omega_0
    frequency: float  # w = sqrt(1 - mu^2) Omega_0
    start: float
    velocity: float

    def position(self, t: Any) -> Any:
        """x(t)."""
        sine = np.sin(self.frequency * t)
        ratio = self.decay / self.frequency
        shrink = np.exp(-self.decay * t)
        lost = -np.expm1(-self.decay * t) + shrink * (
            2 * np.sin(self.frequency * t / 2) ** 2 - ratio * sine
        )
        return (
            self.start * (1 - lost)
            + self.velocity * shrink * sine / self.frequency
            + self.centre * lost
        )

    def speed(self, t: Any) -> Any:
        """x'(t)."""
        sine = np.sin(self.frequency * t)
        cosine = np.cos(self.frequency * t)
        pull = (self.centre - self.start) * (self.frequency + self.decay**2 / self.frequency)
        return np.exp(-self.decay * t) * (
            self.velocity * (cosine - self.decay / self.frequency * sine) + pull * sine
        )

    def impact_time(self) -> float | None:
        """The first t > 0 with x(t) = 0, or None if the layer stays open for good.

        x' is zero every pi / w; the first minimum is the lowest one, so that x has no zero at all
        if it has none before it.
        """
        from scipy.optimize import brentq

        half = math.pi / self.frequency
        top = 0.0
        if self.velocity > 0:
            pull = (self.centre - self.start) * (self.frequency + self.decay**2 / self.frequency)
            top = (
                math.atan2(self.velocity, self.velocity * self.decay / self.frequency - pull)
                / self.frequency
            )
        bottom = top + half
        if self.position(bottom) >= 0:
            return None
        most = LIMITS.halvings
        t = float(brentq(self.position, top, bottom, xtol=1e-300, rtol=1e-15, maxiter=most))
        return t - float(self.position(t) / self.speed(t))


@dataclass(frozen=True, slots=True)
class LinearMotion:
    """A motion of the piecewise-linear equation; call it for theta(tau) and theta'(tau).

    Attributes
    ----------
    impact_times
        (n,): the times tau_*^[i] of the impacts.
    velocity_before
        (n,): theta' just before each.
    velocity_after
        (n,): theta' just after.
    arcs
        The motion between impacts: the first arc begins at 0, each other one at an impact; an
        impact that stops the motion begins no arc.
    end
        The time up to which it is known: the next impact, or infinity if none follows.

    Examples
    --------
    >>> constant = saltus.System(model=system.model, load=saltus.Load(vertical=-0.5))
    >>> motion = saltus.theory.linear_motion(constant, 0.1, 3)
    >>> [round(float(number), 12) for number in motion(0.0)]
    [0.1, 0.0]
    """

    impact_times: np.ndarray
    velocity_before: np.ndarray
    velocity_after: np.ndarray
    arcs: tuple[Arc, ...]
    end: float

    def __call__(self, tau: Any) -> tuple[Any, Any]:
        """theta and theta' at `tau`, any shape, from 0 to `end`; just after an impact the velocity
        is the one after it.

        Raises
        ------
        ParameterError
            A time before 0 or after `end`.
        """
        tau = np.asarray(tau, dtype=float)
        if np.any((tau < 0) | (tau > self.end)):
            raise ParameterError(
                f"tau must lie in [0, {self.end:.6g}], where this motion was computed; ask for "
                "more impacts",
                "tau",
            )
        theta = np.empty_like(tau)
        velocity = np.empty_like(tau)
        index = np.searchsorted(self.impact_times, tau, side="right")
        for i in np.unique(index):
            here = index == i
            if i < len(self.arcs):
                arc = self.arcs[i]
                local = tau[here] - (self.impact_times[i - 1] if i else 0.0)
                theta[here] = arc.layer.side * arc.position(local)
                velocity[here] = arc.layer.side * arc.speed(local)
            else:
                theta[here] = velocity[here] = 0.0
        return theta[()], velocity[()]


def linear_motion(system: System, theta0: float, impacts: int) -> LinearMotion:
    """The solution of `gov_eqn_constant_loading_lin` from theta0, at rest, through so many impacts
    (`linsol_theta1`).

    Any k, m, c, e or r and either sign of theta0; a constant H acts through s H sin(beta0) and the
    stiffness -s H cos(beta0).

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta0
        The opening at the start, at rest, rad.
    impacts
        How many impacts.

    Raises
    ------
    ParameterError
        theta0 = 0, a layer that is not subcritical (mu < 1 and k^P + V sin(beta0) > 0), no impacts
        asked for, a load that varies in time.

    Examples
    --------
    >>> constant = saltus.System(model=system.model, load=saltus.Load(vertical=-0.5))
    >>> times = saltus.simulate(constant, theta=1e-5, duration=10.0).impacts.time
    >>> bool(np.allclose(times[:2], saltus.theory.linear_motion(constant, 1e-5, 2).impact_times, rtol=1e-4))
    True
    """
    check_number("theta0", theta0)
    check_count("impacts", impacts, 1, 100_000)  # the arc of each is kept as an object
    if theta0 == 0:
        raise ParameterError(f"theta0 must not be 0, where nothing moves, got {theta0!r}", "theta0")
    by_side = {layer.side: layer for layer in layers(system)}
    side = 1 if theta0 > 0 else -1
    arcs = [_arc(by_side[side], abs(theta0), 0.0)]
    times = [0.0]
    before: list[float] = []
    after: list[float] = []
    while (t := arcs[-1].impact_time()) is not None and len(before) < impacts:
        times.append(times[-1] + t)
        before.append(side * float(arcs[-1].speed(t)))
        after.append(
            float(
                system.impact.velocity_after(
                    system.one_contact, times[-1], before[-1], side, -side, system.load
                )
            )
        )
        side = -side
        if after[-1] == 0:
            t = None
            break
        arcs.append(_arc(by_side[side], 0.0, abs(after[-1])))
    end = math.inf if t is None else times[-1] + t
    return LinearMotion(np.array(times[1:]), np.array(before), np.array(after), tuple(arcs), end)


def _arc(layer: Layer, start: float, velocity: float) -> Arc:
    vib = vibration(layer)
    if vib.damping_ratio >= 1:
        raise ParameterError(
            "the damping must be subcritical (mu < 1) for vibrations, got mu = "
            f"{vib.damping_ratio:.6g}",
            "model.damping",
        )
    decay = vib.damping_ratio * vib.frequency
    frequency = math.sqrt(1 - vib.damping_ratio**2) * vib.frequency
    return Arc(layer, layer.side * vib.centre, decay, frequency, start, velocity)
