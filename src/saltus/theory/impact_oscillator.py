"""Periodic orbits of the impact oscillator with one impact in q forcing periods: speeds, folds and
multipliers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems import Harmonic, System, WallOscillator

# samples in the shorter of the load's and the free period, by which the maxima of an orbit are
# found
SAMPLES_PER_TURN = 64


@dataclass(frozen=True)
class WallOrbits:
    """The orbits of x'' + c x' + k x = mean + A sin(Omega tau + phase), v+ = -e v-, with one impact
    in q forcing periods.

    From here on x is counted from mean / k, so that the wall is at `wall`. Phi is the free flow
    over q T, T = 2 pi / Omega, D = det Phi = e^(-c q T), tr its trace, and Delta = det(1 - Phi) = 1
    - tr + D. The steady response is periodic by itself, so that the free part y of the motion must
    satisfy y- = Phi [y- - (0, (1 + e) v)]; it is linear in the speed v before the impact:

        y- = v (alpha, beta),     alpha = -(1 + e) Phi_12 / Delta,     beta = (1 + e) (D - Phi_22) /
        Delta

    The steady response at the impact has the rest of the position and of the velocity, P = wall -
    alpha v and Q = (1 - beta) v. With gamma = (1 - beta) / Omega the square of the load's amplitude
    is a quadratic in v:

        A^2 = Z^2 [(wall - alpha v)^2 + gamma^2 v^2],     Z = abs(k - Omega^2 + i c Omega)

    The multipliers are those of Phi S, with S = [[-e, 0], [(a+ + e a-) / v, -e]] at the impact, a-
    and a+ the accelerations before and after it: lambda^2 - trace lambda + e^2 D = 0, where a+ + e
    a- = (1 + e) (F - k wall) makes trace linear in 1 / v:

        trace = -e tr + alpha Delta {Omega^2 wall / v - [c (1 - beta) - (k - Omega^2) alpha]}

    Attributes
    ----------
    stiffness
        k.
    damping
        c, with c^2 < 4 k.
    wall
        The wall less the mean's displacement, d - mean / k.
    frequency
        Omega.
    restitution
        e.
    period
        q, in forcing periods.
    phase
        The phase of the load, rad.
    centre
        The mean's displacement, mean / k.

    Examples
    --------
    >>> family = saltus.theory.wall_orbits(wall)
    >>> round(float(family.amplitude(family.speeds(8.0)[-1])), 9)
    8.0
    """

    stiffness: float
    damping: float
    wall: float
    frequency: float
    restitution: float
    period: int
    phase: float = 0.0
    centre: float = 0.0

    @property
    def duration(self) -> float:
        """The duration of an orbit, q T."""
        return 2 * math.pi * self.period / self.frequency

    @property
    def determinant(self) -> float:
        """The product of the multipliers, e^2 D."""
        return self.restitution**2 * math.exp(-self.damping * self.duration)

    @property
    def impedance(self) -> complex:
        """k - Omega^2 + i c Omega, whose modulus is Z."""
        return complex(self.stiffness - self.frequency**2, self.damping * self.frequency)

    @property
    def grazing_amplitude(self) -> float:
        """GR: A at v = 0, where the steady response touches the wall, Z abs(wall)."""
        return abs(self.impedance) * abs(self.wall)

    @property
    def fold_speed(self) -> float | None:
        """LP: v = alpha wall / (alpha^2 + gamma^2), where dA/dv = 0; None without a fold.

        A is there Z abs(gamma wall) / sqrt(alpha^2 + gamma^2), below GR.
        """
        alpha = self._slopes[0]
        gamma = self._slopes[2]
        return _positive(alpha * self.wall, alpha**2 + gamma**2)

    @property
    def doubling_speed(self) -> float | None:
        """PD: the v at which trace = -1 - e^2 D, a multiplier -1; None if there is none."""
        constant, over_speed = self._trace
        return _positive(over_speed, -1 - self.determinant - constant)

    def amplitude(self, speed: Any) -> Any:
        """A of the orbit whose impact has the speed v >= 0, any shape; admissible or not.

        Parameters
        ----------
        speed
            v just before the impact.
        """
        alpha, _, gamma = self._slopes
        return (
            abs(self.impedance)
            * np.hypot(self.wall - alpha * np.asarray(speed), gamma * np.asarray(speed))[()]
        )

    def speeds(self, amplitude: float) -> tuple[float, ...]:
        """The speeds v > 0 of all orbits under the amplitude A, increasing: none, one, or two
        (between LP and GR).

        Parameters
        ----------
        amplitude
            A of the force.
        """
        alpha, _, gamma = self._slopes
        response = abs(amplitude) / abs(self.impedance)
        square = alpha**2 + gamma**2
        inside = square * response**2 - (gamma * self.wall) ** 2
        if inside < 0:
            return ()
        larger = alpha * self.wall + math.copysign(math.sqrt(inside), alpha * self.wall)
        product = (self.wall - response) * (self.wall + response)
        roots = {larger / square} | ({product / larger} if larger != 0 else set())
        return tuple(sorted(v for v in roots if v > 0))

    def multipliers(self, speed: float) -> np.ndarray:
        """Both multipliers of the orbit whose impact has the speed v > 0, complex, the larger one
        first.

        Parameters
        ----------
        speed
            v just before the impact.
        """
        constant, over_speed = self._trace
        half = (constant + over_speed / speed) / 2
        root = np.sqrt(complex(half**2 - self.determinant))
        larger = half + root if half >= 0 else half - root
        return np.array([larger, self.determinant / larger if larger else 0.0], dtype=complex)

    def orbit(self, speed: float) -> WallOrbit:
        """The orbit whose impact has the speed v > 0.

        Parameters
        ----------
        speed
            v just before the impact.

        Raises
        ------
        ParameterError
            A speed that is not positive.
        """
        if not speed > 0:
            raise ParameterError(
                f"an orbit with an impact needs a speed above 0, got {speed!r}; at 0 it grazes"
            )
        return WallOrbit(self, float(speed))

    @cached_property
    def _flow(self) -> tuple[float, ...]:
        return tuple(float(x) for x in free_flow(self.duration, self.stiffness, self.damping))

    @cached_property
    def _delta(self) -> float:
        w = math.sqrt(self.stiffness - self.damping**2 / 4)
        shrink = math.exp(-self.damping * self.duration / 2)
        return (1 - shrink) ** 2 + 4 * shrink * math.sin(w * self.duration / 2) ** 2

    @cached_property
    def _slopes(self) -> tuple[float, float, float]:
        """alpha, beta and gamma."""
        _, phi12, _, phi22 = self._flow
        ratio = (1 + self.restitution) / self._delta
        beta = ratio * (math.exp(-self.damping * self.duration) - phi22)
        return -ratio * phi12, beta, (1 - beta) / self.frequency

    @cached_property
    def _trace(self) -> tuple[float, float]:
        """The constant and the factor of 1 / v in the trace."""
        phi11, _, _, phi22 = self._flow
        alpha, beta, _ = self._slopes
        pull = self.damping * (1 - beta) - self.impedance.real * alpha
        scaled = alpha * self._delta
        return -self.restitution * (
            phi11 + phi22
        ) - scaled * pull, scaled * self.frequency**2 * self.wall


@dataclass(frozen=True)
class WallOrbit:
    """One of `WallOrbits`, admissible or not: its impact, its load, its multipliers, and the motion
    between two impacts.

    Attributes
    ----------
    family
        The orbits to which it belongs.
    speed
        v > 0, just before the impact.

    Examples
    --------
    >>> family = saltus.theory.wall_orbits(wall)
    >>> round(family.orbit(family.speeds(8.0)[-1]).amplitude, 9)
    8.0
    """

    family: WallOrbits = field(repr=False)
    speed: float

    @property
    def amplitude(self) -> float:
        """A > 0 of the load."""
        return float(self.family.amplitude(self.speed))

    @property
    def impact_time(self) -> float:
        """tau of one impact, in [0, 2 pi / Omega); for q = 2, 3, ...

        there are q orbits, shifted by whole forcing periods.
        """
        family = self.family
        position, velocity = self._steady
        # phase by which the response lags a cosine
        behind = math.atan2(family.impedance.imag, family.impedance.real)
        crest = math.atan2(-velocity / family.frequency, position) + behind
        return float((crest + math.pi / 2 - family.phase) % (2 * math.pi) / family.frequency)

    @property
    def multipliers(self) -> np.ndarray:
        """Both multipliers over q forcing periods, complex, (2,)."""
        return self.family.multipliers(self.speed)

    @property
    def stable(self) -> bool:
        """Whether both multipliers lie inside the unit circle."""
        return bool(np.all(np.abs(self.multipliers) < 1))

    @property
    def admissible(self) -> bool:
        """Whether x < d all the time between two impacts; if not, the solution is no motion."""
        return self.clearance > 0

    @cached_property
    def clearance(self) -> float:
        """d - x at the highest maximum between impacts, infinite if there is none; at 0 the orbit
        grazes, below 0 it is not admissible.

        Maxima are found among samples, `SAMPLES_PER_TURN` in the shorter of the load's and the free
        period.
        """
        from scipy.optimize import brentq

        family = self.family
        turns = family.duration * max(family.frequency, math.sqrt(family.stiffness)) / (2 * math.pi)
        after = np.linspace(0, family.duration, SAMPLES_PER_TURN * math.ceil(turns) + 1)[1:]
        rising = self._between(after)[1] > 0
        tops = np.flatnonzero(rising[:-1] & ~rising[1:])
        maxima = [
            brentq(lambda s: self._between(s)[1], after[i], after[i + 1], xtol=1e-14) for i in tops
        ]
        heights = [float(self._between(s)[0]) for s in maxima]
        return family.wall - max(heights) if heights else math.inf

    def state(self, tau: Any) -> tuple[Any, Any]:
        """x and x' at tau, any shape, of the orbit with an impact at `impact_time`; at an impact,
        x' is the velocity after it.

        Parameters
        ----------
        tau
            The dimensionless time, any shape.
        """
        x, velocity = self._between(
            (np.asarray(tau, dtype=float) - self.impact_time) % self.family.duration
        )
        return x + self.family.centre, velocity

    @property
    def _steady(self) -> tuple[float, float]:
        """P and Q: position and velocity of the steady response at the impact."""
        alpha, beta, _ = self.family._slopes
        return self.family.wall - alpha * self.speed, (1 - beta) * self.speed

    def _between(self, since: Any) -> tuple[Any, Any]:
        """x - mean / k and x' at the times `since` an impact."""
        family = self.family
        (position, velocity) = self._steady
        free_x = family.wall - position
        free_v = -family.restitution * self.speed - velocity
        phi11, phi12, phi21, phi22 = free_flow(since, family.stiffness, family.damping)
        cosine = np.cos(family.frequency * since)
        sine = np.sin(family.frequency * since)
        x = position * cosine + velocity / family.frequency * sine + phi11 * free_x + phi12 * free_v
        return (
            x,
            velocity * cosine
            - family.frequency * position * sine
            + phi21 * free_x
            + phi22 * free_v,
        )


def wall_orbits(system: System, period: int = 1) -> WallOrbits:
    """The orbits of an impact oscillator with one impact in `period` forcing periods; the system's
    amplitude does not matter.

    Parameters
    ----------
    system
        A `WallOscillator` under one harmonic force.
    period
        In forcing periods, from 1 on.

    Raises
    ------
    ParameterError
        Another model, a force that is not one harmonic of order 1, damping that is not below
        critical, a period below 1, or another law than v+ = -e v- at impacts. Also a resonance
        without damping, at which no speed or every speed is a solution.

    Examples
    --------
    >>> len(saltus.theory.wall_orbits(wall).speeds(8.0))
    1
    """
    model = system.model
    load = system.load
    if not isinstance(model, WallOscillator):
        raise ParameterError(
            f"wall_orbits is for a WallOscillator, got {type(model).__name__}", "system"
        )
    force = load.channels.get("force")
    if not isinstance(force, Harmonic) or force.order != 1 or load.frequency is None:
        raise ParameterError(
            f"wall_orbits needs load.force to be one Harmonic of order 1, got {force!r}",
            "load.force",
        )
    if not model.damping**2 < 4 * model.stiffness:
        most = 2 * math.sqrt(model.stiffness)
        raise ParameterError(
            (
                f"wall_orbits needs damping below critical, 2 sqrt(k) = {most:.6g}, got "
                f"{model.damping!r}"
            ),
            "model.damping",
        )
    whole = not isinstance(period, bool) and period >= 1 and math.isfinite(period)
    if not whole or period != int(period):
        raise ParameterError(
            f"period must be a whole number of forcing periods, at least 1, got {period!r}",
            "period",
        )
    factors = [
        float(system.impact.velocity_after(model, t, v, 1, 1, load)) / v
        for t, v in ((0.0, 1.0), (1.0, 0.125))
    ]
    if not math.isclose(*factors, rel_tol=1e-12):
        raise ParameterError(
            f"wall_orbits needs an impact law v+ = -e v- with a constant e, got {system.impact!r}",
            "impact",
        )
    centre = force.mean / model.stiffness
    orbits = WallOrbits(
        stiffness=model.stiffness,
        damping=model.damping,
        wall=model.wall - centre,
        frequency=load.frequency,
        restitution=factors[0],
        period=int(period),
        phase=force.phase,
        centre=centre,
    )
    if (
        orbits._delta < 1e-20
        or math.hypot(orbits._slopes[0], orbits._slopes[2]) < 1e-10
        or orbits.impedance == 0
    ):
        raise ParameterError(
            (
                "without damping a resonance leaves the speed of the impact open; give the model "
                "some damping"
            ),
            "model.damping",
        )
    return orbits


def free_flow(t: Any, stiffness: float, damping: float) -> tuple[Any, Any, Any, Any]:
    """Phi_11, Phi_12, Phi_21, Phi_22 of the free flow of x'' + c x' + k x = 0, c^2 < 4 k, over the
    times t, any shape.
    """
    w = math.sqrt(stiffness - damping**2 / 4)
    shrink = np.exp(-damping * np.asarray(t, dtype=float) / 2)
    cosine = shrink * np.cos(w * t)
    sine = shrink * np.sin(w * t) / w
    return cosine + damping / 2 * sine, sine, -stiffness * sine, cosine - damping / 2 * sine


def _positive(numerator: float, denominator: float) -> float | None:
    ratio = numerator / denominator if denominator != 0 else math.inf
    return ratio if 0 < ratio < math.inf else None
