"""The shapes of pulses, loads that begin and end.

A pulse is not smooth where it begins and where it ends. These two instants are breakpoints of the
motion, as the samples of a record are, so that no step of an integration crosses them. In an
ensemble each motion has its own breakpoints.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from saltus.errors import ParameterError
from saltus.number_ranges import number_range
from saltus.systems.loads.signals import DURATION, RATE, Transient


def in_other_units(
    pulse: Transient,
    by_time: Callable[..., Any],
    by_rate: Callable[..., Any],
    unit: float,
    factor: float,
) -> Transient:
    """The pulse with its times and rates converted by the unit of time, and `factor` times as
    high.
    """
    of = {"time": by_time, "rate": by_rate}
    fields = {
        f.name: of[f.metadata["converts"]]
        for f in dataclasses.fields(pulse)
        if f.metadata.get("converts") in of
    }
    changed = {name: convert(getattr(pulse, name), unit) for name, convert in fields.items()}
    return dataclasses.replace(pulse, **changed, amplitude=factor * pulse.amplitude)


# the largest argument u: beyond it (2 u^2 - 1) exp(-u^2) is below 1e-19, less than rounding of the
# load
RICKER_REACH = 7.0
# Each function is the derivative of the one before.
SINUSOIDS: tuple[Callable[[Any], Any], ...] = (
    np.sin,
    np.cos,
    lambda x: -np.sin(x),
    lambda x: -np.cos(x),
)


def sinusoid(rate: Any, phase: Any, since: Any, n: int) -> Any:
    """The n-th derivative of sin(rate since + phase), or for n = -1 and -2 its integrals from 0."""
    if n >= 0:
        return rate**n * SINUSOIDS[n % 4](rate * since + phase)
    if n == -1:
        return (np.cos(phase) - np.cos(rate * since + phase)) / rate
    return (np.sin(phase) - np.sin(rate * since + phase)) / (rate * rate) + np.cos(
        phase
    ) / rate * since


@dataclass(frozen=True, kw_only=True)
class HalfSine(Transient):
    """amplitude sin(frequency s) for 0 <= s <= pi / frequency, s the time since `start`.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    frequency
        The angular frequency of the sine, above 0.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.HalfSine(amplitude=2.0, frequency=np.pi))
    >>> float(load.force(0.5)), float(load.force(1.5))  # it is over at 1
    (2.0, 0.0)
    """

    frequency: float = field(metadata=RATE)

    @property
    def length(self) -> Any:
        """pi / frequency."""
        return math.pi / self.frequency

    def shape(self, since: Any, n: int) -> Any:
        """amplitude sin(frequency s), differentiated or integrated."""
        return self.amplitude * sinusoid(self.frequency, 0.0, since, n)


@dataclass(frozen=True, kw_only=True)
class OneSine(HalfSine):
    """amplitude sin(frequency s) for one period, 0 <= s <= 2 pi / frequency; of acceleration, a
    forward pulse of the velocity.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    frequency
        The angular frequency of the sine, above 0.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.OneSine(amplitude=2.0, frequency=np.pi))
    >>> round(float(load.force(1.5)), 12), float(load.force(2.5))  # it is over at 2
    (-2.0, -0.0)
    """

    @property
    def length(self) -> Any:
        """2 pi / frequency."""
        return 2.0 * math.pi / self.frequency


@dataclass(frozen=True, kw_only=True)
class OneCosine(OneSine):
    """amplitude cos(frequency s) for one period; it jumps where it begins and where it ends.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    frequency
        The angular frequency of the cosine, above 0.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.OneCosine(amplitude=2.0, frequency=np.pi))
    >>> round(float(load.force(1.0)), 12), float(load.force(2.5))
    (-2.0, 0.0)
    """

    def shape(self, since: Any, n: int) -> Any:
        """amplitude cos(frequency s), differentiated or integrated."""
        return self.amplitude * sinusoid(self.frequency, 0.5 * math.pi, since, n)


@dataclass(frozen=True, kw_only=True)
class MavroeidisPapageorgiou(Transient):
    """The near-fault pulse of Mavroeidis and Papageorgiou (2003), BSSA 93(3), their velocity pulse:

        amplitude / 2 (1 + cos(frequency r / gamma)) cos(frequency r + phase),    r from -h to h, h
        = pi gamma / frequency

    r is the time since its middle and `gamma` > 1 says how many oscillations it has. As a ground
    motion it is a `velocity`, or an `acceleration` if `quantity` says so. It begins and ends with
    the value 0.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "velocity" or "acceleration".
    frequency
        The angular frequency of the carrier, above 0.
    gamma
        How many oscillations it has, above 1.
    phase
        The phase of the carrier at the middle of the pulse, rad.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.MavroeidisPapageorgiou(amplitude=2.0, frequency=np.pi, gamma=2.0))
    >>> round(float(load.force(2.0)), 12)  # its middle is pi gamma / frequency after the start
    2.0
    """

    frequency: float = field(metadata=RATE)
    gamma: float = field(metadata=number_range(above=1.0))
    phase: float = field(default=0.0, metadata=number_range(unit="rad"))
    moving: ClassVar[tuple[str, ...]] = ("start", "frequency", "gamma")
    quantities: ClassVar[tuple[str, ...]] = ("force", "velocity", "acceleration")

    @property
    def length(self) -> Any:
        """2 pi gamma / frequency."""
        return 2.0 * math.pi * self.gamma / self.frequency

    def shape(self, since: Any, n: int) -> Any:
        """The product of cosines as a sum of three sinusoids, differentiated or integrated."""
        # the phase of the carrier, written as a sine, at the start
        begin = self.phase - math.pi * self.gamma + 0.5 * math.pi
        carrier = sinusoid(self.frequency, begin, since, n)
        above = sinusoid(self.frequency * (1.0 + 1.0 / self.gamma), begin - math.pi, since, n)
        below = sinusoid(self.frequency * (1.0 - 1.0 / self.gamma), begin + math.pi, since, n)
        return 0.5 * self.amplitude * (carrier + 0.5 * (above + below))


@dataclass(frozen=True, kw_only=True)
class Ricker(Transient):
    """The symmetric Ricker wavelet amplitude (1 - 2 u^2) exp(-u^2), u = frequency (s - 7 (2 /
    frequency)) / 2.

    Its peak is `7 (2 / frequency)` after `start`: before the start and after the end, abs(u) > 7,
    it is below 1e-19 of the amplitude and taken as 0. As a ground acceleration it leaves the ground
    where it was, at rest.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    frequency
        The angular frequency of the wavelet, at which its spectrum peaks, above 0.

    Examples
    --------
    >>> pulse = saltus.Load(force=saltus.Ricker(amplitude=2.0, frequency=2.0))
    >>> float(pulse.force(7.0))  # its peak is 14 / frequency after the start
    2.0
    """

    frequency: float = field(metadata=RATE)

    @property
    def length(self) -> Any:
        """28 / frequency."""
        return 4.0 * RICKER_REACH / self.frequency

    def shape(self, since: Any, n: int) -> Any:
        """-(amplitude / 2) (2 / frequency)^2 times the derivative of order n + 2 of exp(-u^2) by s,
        in Hermite polynomials.
        """
        u = 0.5 * self.frequency * since - RICKER_REACH
        below = 0.0
        hermite = 1.0
        for m in range(n + 2):
            below, hermite = hermite, 2.0 * u * hermite - 2.0 * m * below
        factor = -0.5 * (-1.0) ** n * self.amplitude * (0.5 * self.frequency) ** n
        return factor * hermite * np.exp(-(u * u))


@dataclass(frozen=True, kw_only=True)
class Pulse(Transient):
    """A rectangular pulse: `amplitude` for 0 <= s < duration, s the time since `start`, else 0.

    Pulses that repeat themselves are a `Square` or a `Table`.

    Parameters
    ----------
    amplitude
        What it is while it lasts, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    duration
        How long it lasts, above 0.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.Pulse(amplitude=2.0, start=1.0, duration=0.5))
    >>> float(load.force(0.9)), float(load.force(1.2)), float(load.force(1.6))
    (0.0, 2.0, 0.0)
    """

    duration: float = field(metadata=DURATION)
    moving: ClassVar[tuple[str, ...]] = ("start", "duration")

    @property
    def length(self) -> Any:
        """`duration`."""
        return self.duration

    def shape(self, since: Any, n: int) -> Any:
        """amplitude s^(-n) / (-n)!, or 0 for derivatives."""
        return constant_shape(self.amplitude, since, n)


def constant_shape(amplitude: Any, since: Any, n: int) -> Any:
    """A constant, or its integrals from 0; derivatives are 0."""
    powers = {-2: 0.5 * since * since, -1: since, 0: 1.0}
    return amplitude * powers.get(n, 0.0)


# how long a step lasts: longer than any motion
FOR_EVER = 1e150


@dataclass(frozen=True, kw_only=True)
class Step(Transient):
    """0 before `start`, and `amplitude` from there on.

    Parameters
    ----------
    amplitude
        The height of the step, in units of the quantity.
    start
        The dimensionless time of the step.
    quantity
        What it is: "force", or of a ground channel "acceleration".

    Examples
    --------
    >>> load = saltus.Load(force=saltus.Step(amplitude=2.0, start=1.0))
    >>> float(load.force(0.9)), float(load.force(1.0)), float(load.force(99.0))
    (0.0, 2.0, 2.0)
    """

    moving: ClassVar[tuple[str, ...]] = ("start",)

    @property
    def length(self) -> Any:
        """Longer than any motion."""
        return FOR_EVER

    @property
    def settled(self) -> Any:
        """`start`."""
        return self.start

    def shape(self, since: Any, n: int) -> Any:
        """amplitude s^(-n) / (-n)!, or 0 for derivatives."""
        return constant_shape(self.amplitude, since, n)


@dataclass(frozen=True, kw_only=True)
class Ramp(Transient):
    """amplitude s / duration for 0 <= s <= duration, and `amplitude` for ever after.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    duration
        How long it rises, above 0.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.Ramp(amplitude=2.0, duration=4.0))
    >>> float(load.force(1.0)), float(load.force(9.0))
    (0.5, 2.0)
    """

    duration: float = field(metadata=DURATION)
    holds: ClassVar[bool] = True
    moving: ClassVar[tuple[str, ...]] = ("start", "duration")

    @property
    def length(self) -> Any:
        """`duration`."""
        return self.duration

    def shape(self, since: Any, n: int) -> Any:
        """amplitude s^(1 - n) / (1 - n)! / duration."""
        slope = self.amplitude / self.duration
        powers = {-2: since * since * since / 6.0, -1: 0.5 * since * since, 0: since, 1: 1.0}
        return slope * powers.get(n, 0.0)


@dataclass(frozen=True, kw_only=True)
class Chirp(Transient):
    """amplitude sin(frequency s + (end_frequency - frequency) s^2 / (2 duration)) for 0 <= s <=
    duration: a linear sweep.

    As a ground acceleration its velocity and its displacement are no elementary functions; models
    and impact laws that read these are refused.

    Parameters
    ----------
    amplitude
        What the shape is multiplied by, in units of the quantity.
    start
        The dimensionless time at which it begins.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    frequency
        The angular frequency at the start, above 0.
    end_frequency
        The angular frequency at the end, above 0.
    duration
        How long it lasts, above 0.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.Chirp(amplitude=1.0, frequency=1.0, end_frequency=3.0, duration=10.0))
    >>> round(float(load.force(2.0) - np.sin(2.0 + 0.2 * 2.0)), 12)  # the phase s + (3 - 1) s^2 / (2 10)
    0.0
    """

    frequency: float = field(metadata=RATE)
    end_frequency: float = field(metadata=RATE)
    duration: float = field(metadata=DURATION)
    moving: ClassVar[tuple[str, ...]] = ("start", "duration")

    @property
    def length(self) -> Any:
        """`duration`."""
        return self.duration

    def shape(self, since: Any, n: int) -> Any:
        """The sine of the swept phase, or its first two derivatives."""
        growth = (self.end_frequency - self.frequency) / self.duration
        phase = (self.frequency + 0.5 * growth * since) * since
        rate = self.frequency + growth * since
        if n < 0:
            raise ParameterError(
                "the velocity of a ground with the acceleration of a Chirp is not an elementary "
                "function; use a Record"
            )
        if n == 2:
            return self.amplitude * (growth * np.cos(phase) - rate * rate * np.sin(phase))
        return self.amplitude * (np.sin(phase) if n == 0 else rate * np.cos(phase))
