"""Signals: how one load channel varies with time. A constant, a harmonic, a record of samples, a
sum, a pulse (whose shapes are in `pulses.py`), or what repeats itself between corners
(`repeating.py`).

A signal returns its value or its first or second derivative at a time `t`. This is a number, an
array, or the symbolic time with which a model is traced (an object with the methods `phase`,
`record`, `pulse` and `repeating`).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np

from saltus.checks import (
    LIMITS,
    check_number,
    check_size,
    notice_degrees,
)
from saltus.errors import ParameterError, shown
from saltus.number_ranges import number_range, settle_numbers


class Setting(float):
    """A number of a signal that belongs to its structure, such as a duty: it can be replaced, and
    is none of the numbers that have dotted paths and vary."""

    __slots__ = ()


class Signal:
    """The signal of a load channel.

    Contract: `derivative(t, frequency, order)` returns the value (order 0), or its first or second
    derivative with respect to the dimensionless time tau, at `t` (number, array or symbolic time);
    `frequency` is the base frequency Omega of the load, or None.
    """

    __slots__ = ()
    periodic: ClassVar[bool] = False  # needs a base frequency
    once: ClassVar[bool] = False  # happens once, so that nothing repeats itself under it
    # is given between corners, whose phases in the forcing period are fixed
    repeats: ClassVar[bool] = False

    @property
    def jumps(self) -> bool:
        """Whether it jumps at any of its corners that repeat themselves."""
        return False

    @property
    def corners(self) -> np.ndarray:
        """Its corners that repeat themselves, as shares of the forcing period."""
        return np.empty(0)

    @property
    def constant_part(self) -> float:
        """Its mean over a forcing period."""
        return 0.0

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """The `order`-th derivative with respect to tau at `t`."""
        raise NotImplementedError

    def __add__(self, other: Signal | float) -> Sum:
        return Sum(terms=(*_terms(self), *_terms(other)))

    def __radd__(self, other: float) -> Sum:
        return Sum(terms=(*_terms(other), *_terms(self)))


@dataclass(frozen=True, slots=True)
class Constant(Signal):
    """A channel that does not vary: value."""

    value: float = field(metadata=number_range())

    def __post_init__(self) -> None:
        settle_numbers(self)

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """`value`, or 0 for a derivative."""
        return self.value if order == 0 else 0.0


@dataclass(frozen=True, slots=True)
class Harmonic(Signal):
    """mean + amplitude sin(order Omega tau + phase), with the base frequency Omega of the load and
    an integer order.

    `Harmonic(amplitude=H)` is load (i) of the paper (`loadpatha`); a phase of pi/2 makes it a
    cosine (`loadpathb`).

    Parameters
    ----------
    amplitude
        The amplitude.
    mean
        The mean.
    phase
        The phase, rad.
    order
        Which multiple of the base frequency it has, from 1 on.

    Examples
    --------
    >>> load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=2.0, mean=1.0))
    >>> float(load.force(np.pi / 2))
    3.0
    """

    amplitude: float = field(metadata=number_range())
    mean: float = field(default=0.0, metadata=number_range())
    phase: float = field(default=0.0, metadata=number_range(unit="rad"))
    order: int = field(
        default=1, metadata=number_range(at_least=1, at_most=LIMITS.order, whole=True)
    )
    periodic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        settle_numbers(self)
        notice_degrees("phase", self.phase)

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """mean + amplitude sin(...), or -- differentiated -- amplitude (order Omega)^n sin(...

        + n pi/2).
        """
        rate = self.order * frequency
        argument = t.phase(rate, self.phase) if hasattr(t, "phase") else rate * t + self.phase
        if order == 0:
            return self.mean + self.amplitude * np.sin(argument)
        if order == 1:
            return self.amplitude * rate * np.cos(argument)
        return -(self.amplitude * rate * rate * np.sin(argument))


@dataclass(frozen=True, slots=True)
class Sum(Signal):
    """The sum of several signals; written `Harmonic(...) + Harmonic(...) + 0.5`, or as a list of
    them.
    """

    terms: tuple[Signal, ...]

    def __post_init__(self) -> None:
        if not isinstance(self.terms, (tuple, list)) or not self.terms:
            raise ParameterError(
                f"a Sum needs signals (Harmonic, Record, Constant), got {shown(self.terms)}"
            )
        terms = (part for term in self.terms for part in _terms(term))
        object.__setattr__(self, "terms", tuple(terms))

    @property
    def periodic(self) -> bool:  # type: ignore[override]
        """Whether any term needs the base frequency."""
        return any(term.periodic for term in self.terms)

    @property
    def once(self) -> bool:  # type: ignore[override]
        """Whether any term happens once."""
        return any(term.once for term in self.terms)

    @property
    def repeats(self) -> bool:  # type: ignore[override]
        """Whether any term is given between corners that repeat themselves."""
        return any(term.repeats for term in self.terms)

    @property
    def jumps(self) -> bool:
        """Whether any term jumps."""
        return any(term.jumps for term in self.terms)

    @property
    def corners(self) -> np.ndarray:
        """The corners of all terms."""
        return np.unique(np.concatenate([term.corners for term in self.terms]))

    @property
    def constant_part(self) -> float:
        """The sum of those of the terms."""
        return sum(term.constant_part for term in self.terms)

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """The sum of the terms' derivatives."""
        total = self.terms[0].derivative(t, frequency, order)
        for term in self.terms[1:]:
            total = total + term.derivative(t, frequency, order)
        return total


QUANTITIES = ("force", "displacement", "velocity", "acceleration")
# which derivative of its channel it is
QUANTITY_ORDER = {"force": 0, "displacement": 0, "velocity": 1, "acceleration": 2}


# what may be between the samples of a quantity
CURVES = {
    "force": ("linear",),
    "acceleration": ("linear",),
    "velocity": ("spline", "linear", "monotone"),
    "displacement": ("spline", "monotone"),
}
JUMPING_GROUND = (
    "; a ground that jumps is two motions: end the first one there, and begin the next one from its"
    " state over the ground in its new place"
)
# the share of the range of its samples by which a spline may leave it: those of sampled motions do
# so by some per cent, those through corners by more
SWING = 0.2


def _extremes(curve: Any) -> tuple[float, float]:
    """The least and the largest value of a piecewise cubic."""
    c, b, a = curve.c[-2], 2.0 * curve.c[-3], 3.0 * curve.c[-4]  # of its slope, c + b t + a t^2
    with np.errstate(all="ignore"):
        root = np.sqrt(np.where(b * b < 4.0 * a * c, np.nan, b * b - 4.0 * a * c))
        half = -0.5 * (b + np.copysign(root, b))
        places = np.stack([half / a, c / half])
        inside = (places > 0.0) & (places < np.diff(curve.x))
        turning = curve(np.where(inside, places, 0.0) + curve.x[:-1])
    values = np.append(turning[np.isfinite(turning)], curve(curve.x))
    return float(values.min()), float(values.max())


def samples_of(where: str, name: str, given: Any) -> np.ndarray:
    """The numbers of a list."""
    check_size(given, name)
    try:
        samples = np.array(given)
    except (TypeError, ValueError, OverflowError):
        samples = np.array(0.0)
    # complex numbers would lose their imaginary part, and masked ones would count
    if samples.ndim != 1 or samples.dtype.kind not in "fiub" or np.ma.is_masked(given):
        raise ParameterError(f"{where}: {name} must be a list of numbers, got {shown(given)}", name)
    return samples.astype(float)


@dataclass(frozen=True, eq=False)
class Record(Signal):
    """Samples over time, uniform or not: `Record(time, value, quantity=...)`, dimensionless like
    every load.

    * `force`: linear between samples; 0 before the first and after the last one.
      A time that is given twice is a jump, from the first of its values to the second.
    * `acceleration` (ground): linear between samples, also with jumps, integrated twice exactly
      from rest at the first sample.
    * `velocity`, `displacement` (ground): a cubic spline through the samples, so that the
      acceleration is continuous. Between samples that are corners, as of a trapezoid, a spline
      swings: one that leaves the range of its samples by more than 20 % is refused, and
      `interpolation` says what is meant.

    Outside its samples a ground record has no acceleration: the ground goes on with the velocity
    that it has there.

    Parameters
    ----------
    time
        The times of the samples, increasing, (n,).
    value
        The samples, (n,).
    quantity
        The quantity of the samples: "force", or for a ground channel "displacement", "velocity" or
        "acceleration".
    scale
        The factor by which every sample is multiplied.
    source
        The file that it came from.
    interpolation
        What is between samples of a velocity or a displacement: "spline"; "linear", of a velocity,
        whose accelerations are then constant between the samples; or "monotone", a cubic without
        extrema between the samples (Fritsch and Carlson's). By default a spline, if it stays near
        to its samples.

    Raises
    ------
    ParameterError
        Fewer than 2 samples (4 for a spline), lengths that differ, times that do not increase (but for
        jumps), NaN,
        a spline that leaves the range of its samples.

    Examples
    --------
    >>> load = saltus.Load(force=saltus.Record(time=[0.0, 1.0, 2.0], value=[0.0, 4.0, 0.0]))
    >>> float(load.force(0.25))
    1.0
    """

    time: np.ndarray
    value: np.ndarray
    quantity: str = "force"
    scale: float = field(default=1.0, metadata=number_range())
    once: ClassVar[bool] = True
    source: str = field(default="", compare=False)
    interpolation: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.quantity, str) or self.quantity not in QUANTITIES:
            raise ParameterError(
                f"quantity must be one of {', '.join(QUANTITIES)}, got {self.quantity!r}",
                "quantity",
            )
        settle_numbers(self, "scale")
        where = (
            f"record {self.source!r}" if isinstance(self.source, str) and self.source else "record"
        )
        time, value = (samples_of(where, name, getattr(self, name)) for name in ("time", "value"))
        if time.shape != value.shape:
            raise ParameterError(
                f"{where}: time and value must have one length, got {time.size} and {value.size}",
                "value",
            )
        self._check_interpolation(where)
        least = 4 if self._curve == "spline" else 2
        if time.size < least:
            raise ParameterError(
                f"{where}: a record of {self.quantity} needs at least {least} samples, got "
                f"{time.size}",
                "time",
            )
        if not (np.isfinite(time).all() and np.isfinite(value).all()):
            bad = int(np.argmin(np.isfinite(time) & np.isfinite(value)))
            raise ParameterError(
                f"{where}: sample {bad} is not a finite number (time {time[bad]}, value "
                f"{value[bad]})",
                "value",
            )
        largest = max(np.abs(time).max(), np.abs(value).max())
        if largest > LIMITS.value:
            raise ParameterError(
                f"{where}: times and values must be at most {LIMITS.value:g} in size, got "
                f"{largest:g}",
                "time",
            )
        steps = np.diff(time)
        follows = steps > 0.0
        if self._curve == "linear" and self.quantity in ("force", "acceleration"):
            # a time that is given twice is a jump
            follows |= (steps == 0.0) & (np.append(1.0, steps[:-1]) > 0.0)
            follows[[0, -1]] &= steps[[0, -1]] > 0.0
        if not follows.all():
            bad = int(np.argmin(follows)) + 1
            moves = time[bad] == time[bad - 1] and self.quantity in ("displacement", "velocity")
            hint = JUMPING_GROUND if moves else "; sort the file"
            raise ParameterError(
                f"{where}: times must increase, but sample {bad} has {time[bad]:g} after "
                f"{time[bad - 1]:g}{hint}",
                "time",
            )
        with np.errstate(over="ignore"):
            steep = np.abs(np.diff(value) / np.where(steps > 0.0, steps, 1.0))
        if not (steep <= LIMITS.value).all():
            bad = int(np.argmax(steep))
            raise ParameterError(
                f"{where}: samples {bad} and {bad + 1} are too near in time, "
                f"{np.diff(time)[bad]:g} apart",
                "time",
            )
        time.setflags(write=False)
        value.setflags(write=False)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "value", value)
        if self._curve == "spline" and not self.interpolation:
            self._check_range(where)

    @property
    def _curve(self) -> str:
        """What is between the samples."""
        plain = self.quantity in ("force", "acceleration")
        return self.interpolation or ("linear" if plain else "spline")

    def _check_interpolation(self, where: str) -> None:
        """Refuse an interpolation that the quantity does not have."""
        known = CURVES[self.quantity]
        if self.interpolation != "" and self.interpolation not in known:
            corners = self.quantity == "displacement" and self.interpolation == "linear"
            hint = ", as its corners would be jumps of the ground's velocity" * corners
            raise ParameterError(
                f"{where}: interpolation of a record of {self.quantity} must be "
                f"{' or '.join(known)}, got {shown(self.interpolation)}{hint}",
                "interpolation",
            )

    def _check_range(self, where: str) -> None:
        """Refuse a spline that leaves the range of its samples far behind."""
        low, high = self.value.min(), self.value.max()
        order = QUANTITY_ORDER[self.quantity]
        least, most = _extremes(self.polynomials[order])
        beyond = max(low - least, most - high)
        if beyond > SWING * (high - low) + 1e-9 * max(abs(low), abs(high)):
            linear = '"linear", ' * (self.quantity == "velocity")
            raise ParameterError(
                f"{where}: the spline through its samples of {self.quantity} in "
                f"[{low:g}, {high:g}] goes from {least:g} to {most:g}; for corners give "
                f'interpolation={linear}"monotone", and "spline" where that is meant',
                "interpolation",
            )

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Record)
            and (self.quantity, self.scale) == (other.quantity, other.scale)
            and self._curve == other._curve
            and np.array_equal(self.time, other.time)
            and np.array_equal(self.value, other.value)
        )

    def __hash__(self) -> int:
        return hash(
            (self.quantity, self.scale, self._curve, self.time.tobytes(), self.value.tobytes())
        )

    def __repr__(self) -> str:
        span = f"{self.time.size} samples in [{self.time[0]:g}, {self.time[-1]:g}]"
        curve = f", interpolation={self.interpolation!r}" if self.interpolation else ""
        return f"Record({span}, quantity={self.quantity!r}, scale={self.scale!r}{curve})"

    @classmethod
    def read(
        cls,
        path: Any,
        *,
        quantity: str | None = None,
        units: str | None = None,
        scale: float = 1.0,
        baseline: int | None = None,
        component: int = 1,
        time_scale: float = 1.0,
        source: str | None = None,
        interpolation: str = "",
    ) -> Record:
        """The record in a file: AT2, VT2 or DT2 of PEER, V2 of CSMIP or COSMOS, or text with two
        columns, time and value.

        Where the unit is known, times are s and values m/s^2, m/s, m or N; `PhysicalBlock.load` and
        `PhysicalCell.load` make a load of such records dimensionless. The numbers in a text whose
        `units` are not given are taken as they are.

        Parameters
        ----------
        path
            The path of the file.
        quantity
            The quantity of the samples. A V2 file has several, of which the acceleration is read
            unless another one is asked for; of a text without `units` it is a force by default.
        units
            The unit of the samples in the file: g, m/s2, cm/s2 (gal), mm/s2, m/s, cm/s, mm/s, m,
            cm, mm, N or kN; by default the one that the file names.
        scale
            The factor by which every sample is multiplied.
        baseline
            The degree of a polynomial in time that is fitted to the samples by least squares and
            subtracted: 0 subtracts their mean, 1 a straight line. By default nothing is subtracted.
        component
            Which of the components in a V2 file, from 1 on.
        time_scale
            The factor by which the times are multiplied.
        source
            The name of the record; by default its path.
        interpolation
            What is between the samples, as of a `Record`.

        Raises
        ------
        ParameterError
            No such file, a file of another format, a line that cannot be read, units that are not
            known or contradict the file.

        Examples
        --------
        >>> with open("HILL.AT2", "w") as file:
        ...     lines = ["PEER", "Hill, 1/1/2000, Foot, 90", "ACCELERATION TIME SERIES IN UNITS OF G", "NPTS= 3, DT= .01 SEC"]
        ...     print(*lines, " 0.0 .2E+00 -.1E+00", sep=chr(10), file=file)
        78
        >>> saltus.Record.read("HILL.AT2").value
        array([ 0.     ,  1.96133 , -0.980665])
        """
        from saltus.systems.files.record_files import read_record

        return cls(
            **read_record(path, quantity, units, baseline, component, time_scale, source),
            scale=scale,
            interpolation=interpolation,
        )

    @cached_property
    def polynomials(self) -> tuple[Any, Any, Any]:
        """The value and its first two derivatives as SciPy piecewise polynomials, `scale` left
        out.
        """
        from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

        if self._curve != "linear":
            kind = CubicSpline if self._curve == "spline" else PchipInterpolator
            curve = kind(self.time, self.value)
            base = PPoly(curve.c, curve.x)
        else:
            wide = np.diff(self.time) > 0.0  # the others are jumps
            slope = np.diff(self.value)[wide] / np.diff(self.time)[wide]
            # older SciPy needs times that can be written
            times = np.append(self.time[:-1][wide], self.time[-1])
            base = PPoly(np.vstack([slope, self.value[:-1][wide]]), times)
        if self.quantity == "acceleration":
            return base.antiderivative(2), base.antiderivative(1), base
        if self.quantity == "velocity":
            return base.antiderivative(1), base, base.derivative(1)
        return base, base.derivative(1), base.derivative(2)

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """The interpolated record, or its derivative, at `t`; outside the samples as the class
        says.
        """
        if hasattr(t, "record"):
            return t.record(self, order)
        t = np.asarray(t, dtype=float)
        first = self.time[0]
        last = self.time[-1]
        inside = self.polynomials[order](np.clip(t, first, last))
        beyond = (t < first) | (t > last)
        if self.quantity == "force" or order == 2:
            result = np.where(beyond, 0.0, inside)
        elif order == 1:
            result = inside
        else:
            drift = np.where(t < first, (t - first) * self.polynomials[1](first), 0.0)
            result = (
                inside + drift + np.where(t > last, (t - last) * self.polynomials[1](last), 0.0)
            )
        return self.scale * (result if result.ndim else float(result))


def as_signal(value: Any, name: str) -> Signal:
    """A signal from a number (a `Constant`), a signal (itself) or a list of them (their sum);
    anything else is refused.
    """
    if isinstance(value, Signal):
        return value
    if isinstance(value, (tuple, list)):
        if not value:
            raise ParameterError(
                f"{name} is an empty list; give at least one number, harmonic or record", name
            )
        return Sum(tuple(as_signal(item, f"{name}.{i}") for i, item in enumerate(value)))
    if not isinstance(value, (int, float, np.integer, np.floating)):
        samples = callable(value) or np.iterable(value)
        hint = "; samples are given as Record(time, value)" if samples else ""
        raise ParameterError(
            f"{name} must be a number, a Harmonic, a pulse or a Record, got {shown(value)}{hint}",
            name,
        )
    check_number(name, value)
    return Constant(float(value))


def _terms(given: Any) -> tuple[Signal, ...]:
    """The terms of a sum, or a signal as the only one."""
    signal = as_signal(given, "a term of a sum")
    return signal.terms if isinstance(signal, Sum) else (signal,)


def scaled(signal: Signal, factor: float) -> Signal:
    """`factor` times the signal, of the same kind."""
    if isinstance(signal, Constant):
        return Constant(factor * signal.value)
    if isinstance(signal, Harmonic):
        return Harmonic(factor * signal.amplitude, factor * signal.mean, signal.phase, signal.order)
    if isinstance(signal, Sum):
        return Sum(tuple(scaled(term, factor) for term in signal.terms))
    if signal.once or signal.repeats:
        kind: Any = signal
        # a record or a table has a scale
        names = [name for name in ("amplitude", "mean", "scale") if hasattr(signal, name)]
        changed = {name: factor * getattr(signal, name) for name in names}
        return cast(Signal, dataclasses.replace(kind, **changed))
    raise ParameterError(f"a {type(signal).__name__} cannot be scaled")


def vanishes(signal: Signal) -> bool:
    """Whether the signal is 0 at all times, judged by its numbers."""
    if isinstance(signal, Sum):
        return all(vanishes(term) for term in signal.terms)
    if hasattr(signal, "scale"):  # a record, or a table
        samples: Any = getattr(signal, "value", getattr(signal, "values", 0.0))
        return signal.scale == 0.0 or not np.any(samples)
    return all(getattr(signal, name, 0.0) == 0.0 for name in ("value", "amplitude", "mean"))


# the metadata of fields that units of time convert
TIME = {"converts": "time"}
DURATION = TIME | number_range(above=0.0)
RATE = {"converts": "rate"} | number_range(above=0.0)


@dataclass(frozen=True, kw_only=True)
class Transient(Signal):
    """A load that begins at `start` and lasts for `length`; a pulse by itself is 0 before and
    after.

    `quantity` says which quantity it is: a `force`, or an `acceleration` of the ground. The ground
    then moves from rest, and goes on with the velocity that it has at the end of the pulse.

    Contract: a subclass gives `length` and `shape(since, n)`, the n-th derivative of the quantity
    at `since` after the start, or for n = -1 and -2 its integrals from the start; `moving` names
    the numbers on which the beginning or the end depends.
    """

    amplitude: float = field(metadata=number_range())
    start: float = field(default=0.0, metadata=TIME | number_range())
    quantity: str = "force"
    once: ClassVar[bool] = True
    holds: ClassVar[bool] = False  # whether it keeps its last value after its end
    moving: ClassVar[tuple[str, ...]] = ("start", "frequency")
    quantities: ClassVar[tuple[str, ...]] = ("force", "acceleration")

    def __post_init__(self) -> None:
        if self.quantity not in self.quantities:
            moves = self.quantity in ("displacement", "velocity")
            raise ParameterError(
                f"quantity of a {type(self).__name__} must be one of "
                f"{', '.join(self.quantities)}, got {self.quantity!r}{JUMPING_GROUND * moves}",
                "quantity",
            )
        settle_numbers(self)
        timed = [f.name for f in dataclasses.fields(self) if "converts" in f.metadata]
        timed.sort(key="start".__eq__)  # the start is named last
        if not (math.isfinite(self.length) and self.start + self.length > self.start):
            raise ParameterError(
                f"a {type(self).__name__} of the duration {self.length:g} does not end after its "
                "start",
                timed[0],
            )

    @property
    def length(self) -> Any:
        """The duration of the pulse."""
        raise NotImplementedError

    @property
    def settled(self) -> Any:
        """The time from which on it is 0, or keeps its last value."""
        return self.start + self.length

    def shape(self, since: Any, n: int) -> Any:
        """The n-th derivative of the quantity at `since` after the start; for n = -1 and -2 the
        integrals from the start.
        """
        raise NotImplementedError

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """The channel at `t`, or its derivative: the quantity, differentiated or integrated from
        rest.
        """
        n = order - QUANTITY_ORDER[self.quantity]
        since, within, after = (
            t.pulse(self) if hasattr(t, "pulse") else self._clocks(np.asarray(t, dtype=float))
        )
        if n > 0 or (n == 0 and not self.holds):
            return within * self.shape(since, n)
        value = self.shape(since, n)
        if n == -2:
            value = value + after * self.shape(self.length, -1)
        if n < 0 and self.holds:
            value = value + (after if n == -1 else 0.5 * after * after) * self.shape(self.length, 0)
        return value

    def _clocks(self, t: Any) -> tuple[Any, Any, Any]:
        """The time since the start, at most `length`; 1 within the span, else 0; the time since the
        end.
        """
        since = np.clip(t - self.start, 0.0, self.length)
        end = self.start + self.length
        return (
            since[()],
            np.where((t >= self.start) & (t < end), 1.0, 0.0)[()],
            np.maximum(t - end, 0.0)[()],
        )
