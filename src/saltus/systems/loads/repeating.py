"""Loads that are given by their corners and repeat themselves with the forcing period: square
waves, triangles, saws and tables.

Between two corners such a load is a polynomial of the phase. Its corners are known instants, at
which a step of the motion ends exactly, as at the samples of a record. Their phases are fixed, so
that they move in time with the frequency of the load.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np

from saltus.checks import LIMITS, notice_degrees
from saltus.errors import ParameterError, shown
from saltus.number_ranges import number_range, settle_numbers
from saltus.systems.loads.signals import QUANTITIES, QUANTITY_ORDER, Setting, Signal, samples_of

# Corners nearer than this share of the forcing period are one.
SAME_CORNER = 1e-12
# The mean of a ground's acceleration or velocity that counts as 0, as a share of its size.
NO_DRIFT = 1e-12


@dataclass(frozen=True)
class Pieces:
    """A periodic piecewise polynomial: `coefficients[k]` are those of the powers of the phase since
    corner k, in rad; `corners` are shares of the period from 0 on, the first of them 0.
    """

    corners: np.ndarray  # (n,)
    coefficients: np.ndarray  # (n, degree + 1)

    @property
    def degree(self) -> int:
        """The degree of the polynomials."""
        return int(self.coefficients.shape[1]) - 1

    @property
    def lengths(self) -> np.ndarray:
        """The phases between the corners, rad."""
        return math.tau * np.diff(np.append(self.corners, 1.0))

    def at(self, phase: Any) -> Any:
        """The values at phases, of which a corner belongs to the piece behind it."""
        share = np.asarray(phase, dtype=float) / math.tau % 1.0
        share = np.where(share >= 1.0, 0.0, share)
        k = np.searchsorted(self.corners, share, side="right") - 1
        since = math.tau * (share - self.corners[k])
        value = np.zeros(np.shape(share))
        for power in range(self.degree, -1, -1):
            value = value * since + self.coefficients[k, power]
        return value[()]

    @property
    def ends(self) -> np.ndarray:
        """The values at the ends of the pieces."""
        powers = self.lengths[:, None] ** np.arange(self.degree + 1)
        return np.asarray((self.coefficients * powers).sum(axis=1))

    @property
    def jumps(self) -> bool:
        """Whether the value jumps at any corner, by more than rounding."""
        steps = np.abs(np.roll(self.coefficients[:, 0], -1) - self.ends)
        return bool((steps > 1e-9 * max(np.abs(self.coefficients[:, 0]).max(), 1e-300)).any())

    @property
    def kinks(self) -> np.ndarray:
        """The corners at which the polynomial changes, which not all need be: (m,) shares."""
        changed = []
        for k, corner in enumerate(self.corners):
            before = np.polynomial.Polynomial(self.coefficients[k - 1])
            moved = before(np.polynomial.Polynomial([self.lengths[k - 1], 1.0])).coef
            apart = np.resize([*moved, *np.zeros(self.degree + 1)], self.degree + 1)
            size = np.abs(self.coefficients).max(axis=0, initial=1e-300)
            if (np.abs(apart - self.coefficients[k]) > 1e-9 * size.max()).any():
                changed.append(float(corner))
        return np.array(changed)

    @property
    def mean(self) -> float:
        """The mean over a period."""
        integrals = self.lengths[:, None] ** np.arange(1, self.degree + 2)
        parts = self.coefficients * integrals / np.arange(1, self.degree + 2)
        return float(parts.sum() / math.tau)

    def derivative(self) -> Pieces:
        """The derivative by the phase; jumps are left out."""
        if self.degree == 0:
            return Pieces(self.corners, np.zeros_like(self.coefficients))
        return Pieces(self.corners, self.coefficients[:, 1:] * np.arange(1, self.degree + 1))

    def integral(self) -> Pieces:
        """The integral by the phase of a function with the mean 0, itself with the mean 0."""
        raised = self.coefficients / np.arange(1, self.degree + 2)
        whole = Pieces(self.corners, np.column_stack([np.zeros(len(raised)), raised]))
        starts = np.concatenate([[0.0], np.cumsum(whole.ends)[:-1]])
        whole = Pieces(self.corners, np.column_stack([starts, raised]))
        return Pieces(self.corners, np.column_stack([starts - whole.mean, raised]))


class Repeating(Signal):
    """A signal that is piecewise a polynomial of the phase and repeats itself with the forcing
    period: `scale` times its shape, and a mean.

    Contract: a subclass gives `shape()`, its `Pieces`, which no number of the system changes;
    `half_a_period_later()` and `backward()`; and `factors()`, the numbers (factor, mean) by which
    the value is factor shape + mean. `quantity` is that of the signal: a force, or of a ground
    channel an acceleration or a displacement.
    """

    __slots__ = ()
    periodic: ClassVar[bool] = True
    repeats: ClassVar[bool] = True
    quantity: str

    def shape(self) -> Pieces:
        """The shape, of which the value is a multiple."""
        raise NotImplementedError

    def factors(self) -> tuple[Any, Any]:
        """What the shape is multiplied by, and what is added."""
        raise NotImplementedError

    @property
    def corners(self) -> np.ndarray:
        """Its corners, as shares of the forcing period."""
        return self.shape().kinks

    @property
    def constant_part(self) -> float:
        """Its mean over a forcing period."""
        factor, mean = self.factors()
        return float(factor * self.shape().mean + mean)

    @property
    def jumps(self) -> bool:
        """Whether it jumps at any corner: a force, or the acceleration of a ground."""
        level = 0 if self.quantity == "force" else 2 - QUANTITY_ORDER[self.quantity]
        return self.pieces(level).jumps

    def half_a_period_later(self) -> Repeating:
        """The signal as it is half a period later."""
        raise NotImplementedError

    def backward(self) -> Repeating:
        """The signal with the time reversed."""
        raise NotImplementedError

    def pieces(self, level: int) -> Pieces:
        """The derivative of the shape by the phase of an order, or for -1 and -2 its integrals."""
        found = self.shape()
        for _ in range(level):
            found = found.derivative()
        for _ in range(-level):
            found = found.integral()
        return found

    @property
    def structure_key(self) -> Any:
        """What a trace depends on besides the numbers."""
        return type(self), self.quantity, self.shape().degree

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """The value, or a derivative of it: frequency^n times that by the phase."""
        n = order - QUANTITY_ORDER[self.quantity]
        factor, mean = self.factors()
        value = (
            t.repeating(self, n, frequency)
            if hasattr(t, "repeating")
            else self.pieces(n).at(np.asarray(t, dtype=float) * frequency)
        )
        for _ in range(abs(n)):
            value = value * frequency if n > 0 else value / frequency
        return factor * value + mean if n == 0 else factor * value

    def _check_quantity(self, moves: bool) -> None:
        """Refuse a quantity that is none, one whose ground would jump, and one whose ground would
        drift away; `moves` says whether the mean of the signal is not 0.
        """
        name = type(self).__name__
        if not isinstance(self.quantity, str) or self.quantity not in QUANTITIES:
            raise ParameterError(
                f"quantity must be one of {', '.join(QUANTITIES)}, got {shown(self.quantity)}",
                "quantity",
            )
        order = QUANTITY_ORDER[self.quantity]
        shape = self.shape()
        if self.quantity in ("velocity", "displacement"):
            smooth = shape
            for level in range(2 - order):
                if smooth.jumps:
                    what = ("displacement", "velocity")[order + level]
                    raise ParameterError(
                        f"the {what} of a ground with this {name} of {self.quantity} jumps at its"
                        " corners: give its acceleration, or a cubic Table of its displacement",
                        "quantity",
                    )
                smooth = smooth.derivative()
        lopsided = bool(abs(shape.mean) > NO_DRIFT * np.abs(shape.coefficients).max())
        if order > 0 and (moves or lopsided):
            advice = "give it the mean 0"
            if lopsided:
                advice = "give a Table whose values have the mean 0 over a period"
            raise ParameterError(
                f"a ground with this {self.quantity} drifts away, as the mean of the {name} over a "
                f"period is not 0: {advice}",
                "mean" if hasattr(self, "mean") else "values",
            )


def _corners(points: list[tuple[float, tuple[float, ...]]], phase: float) -> Pieces:
    """Pieces from (share of the period, coefficients by the share since then), where the signal is
    ahead by a phase.
    """
    ahead = phase / math.tau
    shares = np.array([share - ahead for share, _ in points]) % 1.0
    shares[shares > 1.0 - SAME_CORNER] = 0.0
    shares[shares < SAME_CORNER] = 0.0
    order = np.argsort(shares, kind="stable")
    width = max(len(given) for _, given in points)
    table = np.zeros((len(points), width))
    for row, (_, given) in zip(table, points, strict=True):
        row[: len(given)] = given
    shares, table = shares[order], table[order]
    if shares[0] > 0.0:  # the piece that goes on over the end of the period
        since = 1.0 - shares[-1]
        moved = np.polynomial.Polynomial(table[-1])(np.polynomial.Polynomial([since, 1.0])).coef
        shares = np.insert(shares, 0, 0.0)
        table = np.insert(table, 0, np.resize([*moved, *[0.0] * width], width), axis=0)
    return Pieces(shares, table / math.tau ** np.arange(width))


@lru_cache(maxsize=256)
def _wave(kind: str, phase: float, duty: float) -> Pieces:
    """The shapes of the waves, of amplitude 1."""
    points: dict[str, list[tuple[float, tuple[float, ...]]]] = {
        "Square": [(0.0, (1.0,)), (duty, (-1.0,))],
        "Triangle": [(0.25, (1.0, -4.0)), (0.75, (-1.0, 4.0))],
        "Sawtooth": [(0.0, (-1.0, 2.0))],
    }
    return _corners(points[kind], phase)


@dataclass(frozen=True)
class Wave(Repeating):
    """What square waves, triangles and saws share: mean + amplitude w(Omega tau + phase)."""

    amplitude: float = field(metadata=number_range())
    mean: float = field(default=0.0, metadata=number_range())
    phase: float = field(default=0.0, metadata=number_range(unit="rad"))
    quantity: str = "force"

    def __post_init__(self) -> None:
        settle_numbers(self, "amplitude", "mean", "phase")
        notice_degrees("phase", self.phase)
        object.__setattr__(self, "phase", Setting(self.phase))
        self._check_quantity(self.mean != 0.0)

    def shape(self) -> Pieces:
        """The wave of amplitude 1."""
        duty = float(getattr(self, "duty", 0.5))
        return _wave(type(self).__name__, float(self.phase), duty)

    def half_a_period_later(self) -> Wave:
        """The wave as it is half a period later."""
        return dataclasses.replace(self, phase=float(self.phase) + math.pi)

    def backward(self) -> Wave:
        """w(-u) = -w(u), as of a sine: the wave with the other amplitude and phase."""
        factor = 1.0 if self.quantity == "velocity" else -1.0
        mean = -factor * self.mean
        return dataclasses.replace(
            self, amplitude=factor * self.amplitude, mean=mean, phase=-float(self.phase)
        )

    def factors(self) -> tuple[Any, Any]:
        """The amplitude and the mean."""
        return self.amplitude, self.mean


@dataclass(frozen=True)
class Square(Wave):
    """A square wave: mean + amplitude in the first `duty` of each forcing period, and mean -
    amplitude in the rest.

    With the duty 1/2 it has the sign of a sine. It jumps at fixed phases, where a step of the
    motion ends exactly. `phase` and `duty` are settings: they can be replaced, but are no
    parameters of branches and derivatives.

    Parameters
    ----------
    amplitude
        Half of the height of its jumps.
    mean
        The middle between its two values.
    phase
        The phase by which it is ahead, rad.
    quantity
        What it is: "force", or of a ground channel "acceleration".
    duty
        The share of the period in which it is above its middle, between 0 and 1.

    Raises
    ------
    ParameterError
        A duty that is no share; a ground that would drift away, or whose velocity would jump.

    Examples
    --------
    >>> load = saltus.Load(frequency=np.pi, force=saltus.Square(amplitude=2.0, duty=0.25))
    >>> float(load.force(0.4)), float(load.force(0.6)), float(load.force(2.4))
    (2.0, -2.0, 2.0)
    """

    duty: float = field(default=0.5, metadata=number_range(above=0.0, below=1.0))

    def __post_init__(self) -> None:
        settle_numbers(self, "duty")
        object.__setattr__(self, "duty", Setting(self.duty))
        Wave.__post_init__(self)

    def backward(self) -> Square:
        """The wave that is above its middle in the `duty` before a phase."""
        return dataclasses.replace(self, phase=math.tau * self.duty - float(self.phase))


@dataclass(frozen=True)
class Triangle(Wave):
    """A triangle wave: linear between mean - amplitude and mean + amplitude, as a sine rises and
    falls.

    Parameters
    ----------
    amplitude
        The height of its corners above the mean.
    mean
        The mean.
    phase
        The phase by which it is ahead, rad; it is a setting, as of a `Square`.
    quantity
        What it is: "force", or of a ground channel "velocity" or "acceleration".

    Examples
    --------
    >>> load = saltus.Load(frequency=np.pi, force=saltus.Triangle(amplitude=2.0))
    >>> [round(float(load.force(t)), 12) for t in (0.0, 0.25, 0.5, 1.5)]
    [0.0, 1.0, 2.0, -2.0]
    """


@dataclass(frozen=True)
class Sawtooth(Wave):
    """A sawtooth wave: it rises from mean - amplitude to mean + amplitude in each forcing period,
    and jumps back at its end.

    Parameters
    ----------
    amplitude
        Half of the height of its jumps; a negative one makes it fall and jump up.
    mean
        The mean.
    phase
        The phase by which it is ahead, rad; it is a setting, as of a `Square`.
    quantity
        What it is: "force", or of a ground channel "acceleration".

    Examples
    --------
    >>> load = saltus.Load(frequency=np.pi, force=saltus.Sawtooth(amplitude=2.0))
    >>> [round(float(load.force(t)), 12) for t in (0.0, 0.5, 1.5, 2.0)]
    [-2.0, -1.0, 1.0, -2.0]
    """


TABLE_CURVES = ("linear", "previous", "cubic")


@dataclass(frozen=True, eq=False)
class Table(Repeating):
    """A load that repeats itself, by its values at times over one forcing period.

    The time from the first to the last sample is one forcing period. The times may so be in any
    unit, such as shares of the period from 0 to 1. A time that is given twice is a jump,
    from the first of its two values to the second. A load that happens once is a `Record`, which
    takes doubled times too.

    Parameters
    ----------
    times
        The times, not decreasing, (n,); the first to the last one is one period.
    values
        The values, (n,); where the last one differs from the first, the load jumps at the end of
        the period.
    periodic
        Whether it repeats itself; a table that does not is refused: it is a `Record`.
    interpolation
        What is between the samples: "linear"; "previous", steps; or "cubic", a periodic spline.
    quantity
        What it is: "force", or for a ground channel "displacement", "velocity" or "acceleration".
    scale
        The factor by which every value is multiplied.

    Raises
    ------
    ParameterError
        Times that decrease, lengths that differ, a spline through jumps; a ground that would jump
        or drift away.

    Examples
    --------
    >>> table = saltus.Table([0.0, 0.5, 0.5, 1.0], [0.0, 2.0, -2.0, 0.0])
    >>> load = saltus.Load(frequency=np.pi, force=table)
    >>> float(load.force(0.5)), float(load.force(1.0)), float(load.force(3.5))
    (1.0, -2.0, -1.0)
    """

    times: np.ndarray
    values: np.ndarray
    periodic: bool = True  # type: ignore[misc]
    interpolation: str = "linear"
    quantity: str = "force"
    scale: float = field(default=1.0, metadata=number_range())

    def __post_init__(self) -> None:
        if self.periodic is not True:
            raise ParameterError(
                "a table that does not repeat itself is a Record(times, values), in which a time"
                f" given twice is a jump, got periodic={shown(self.periodic)}",
                "periodic",
            )
        if self.interpolation not in TABLE_CURVES:
            raise ParameterError(
                f"interpolation of a Table must be {' or '.join(TABLE_CURVES)}, got"
                f" {shown(self.interpolation)}",
                "interpolation",
            )
        settle_numbers(self, "scale")
        times, values = (
            samples_of("table", name, getattr(self, name)) for name in ("times", "values")
        )
        if times.shape != values.shape or times.size < 2:
            raise ParameterError(
                f"a Table needs as many values as times, at least 2, got {times.size} times and"
                f" {values.size} values",
                "values",
            )
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise ParameterError("times and values of a Table must be finite numbers", "values")
        if max(np.abs(times).max(), np.abs(values).max()) > LIMITS.value:
            raise ParameterError(
                f"times and values of a Table must be at most {LIMITS.value:g} in size", "times"
            )
        steps = np.diff(times)
        if (steps < 0.0).any() or not times[-1] > times[0]:
            bad = int(np.argmax(steps < 0.0)) + 1
            raise ParameterError(
                f"times of a Table must not decrease, but sample {bad} has {times[bad]:g} after"
                f" {times[bad - 1]:g}",
                "times",
            )
        near = (steps > 0.0) & (steps < SAME_CORNER * (times[-1] - times[0]))
        thrice = (steps[1:] == 0.0) & (steps[:-1] == 0.0)
        if near.any() or thrice.any():
            bad = int(np.argmax(near)) if near.any() else int(np.argmax(thrice))
            raise ParameterError(
                f"samples {bad} and {bad + 1} of a Table are too near in time; a jump is two"
                " samples at one time",
                "times",
            )
        if self.interpolation == "cubic" and ((steps == 0.0).any() or values[0] != values[-1]):
            raise ParameterError(
                "a cubic Table is a periodic spline, so it needs times that increase and a last"
                " value equal to the first; take interpolation='linear' for jumps",
                "interpolation",
            )
        if self.interpolation == "cubic" and times.size < 4:
            raise ParameterError("a cubic Table needs at least 4 samples", "times")
        times.setflags(write=False)
        values.setflags(write=False)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)
        self._check_quantity(False)

    @cached_property
    def _pieces(self) -> Pieces:
        """The table as piecewise polynomials."""
        share = (self.times - self.times[0]) / (self.times[-1] - self.times[0])
        ahead = -math.tau * float(self.times[0] / (self.times[-1] - self.times[0]))
        if self.interpolation == "cubic":
            from scipy.interpolate import CubicSpline

            curve = CubicSpline(share, self.values, bc_type="periodic")
            rows = curve.c[::-1].T
        else:
            slopes = np.zeros(share.size - 1)
            wide = np.diff(share) > 0.0
            if self.interpolation == "linear":
                slopes[wide] = np.diff(self.values)[wide] / np.diff(share)[wide]
            rows = np.column_stack([self.values[:-1], slopes])[wide]
            share = np.append(share[:-1][wide], 1.0)
            if self.interpolation == "previous":
                rows = rows[:, :1]
        points = [(float(at), tuple(row.tolist())) for at, row in zip(share, rows, strict=False)]
        return _corners(points, ahead)

    def shape(self) -> Pieces:
        """The table itself."""
        return self._pieces

    def factors(self) -> tuple[Any, Any]:
        """The scale; nothing is added."""
        return self.scale, 0.0

    def to_table(self) -> dict[str, Any]:
        """Its fields as a file has them."""
        given = {"times": self.times.tolist(), "values": self.values.tolist()}
        named = {name: getattr(self, name) for name in ("interpolation", "quantity", "scale")}
        return given | named

    def backward(self) -> Table:
        """The table read from its end, with steps as linear pieces between doubled times."""
        times = self.times
        values = self.values
        if self.interpolation == "previous":
            times = np.repeat(times, 2)[1:-1]
            values = np.repeat(values[:-1], 2)
        curve = "linear" if self.interpolation == "previous" else self.interpolation
        sign = -1.0 if self.quantity == "velocity" else 1.0
        return dataclasses.replace(
            self, times=-times[::-1], values=sign * values[::-1], interpolation=curve
        )

    def half_a_period_later(self) -> Table:
        """The table as it is half a period later."""
        ahead = 0.5 * float(self.times[-1] - self.times[0])
        return dataclasses.replace(self, times=self.times - ahead)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Table)
            and (self.quantity, self.scale, self.interpolation)
            == (other.quantity, other.scale, other.interpolation)
            and np.array_equal(self.times, other.times)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        own = (self.quantity, self.scale, self.interpolation)
        return hash((*own, self.times.tobytes(), self.values.tobytes()))

    def __repr__(self) -> str:
        span = f"{self.times.size} samples in [{self.times[0]:g}, {self.times[-1]:g}]"
        return (
            f"Table({span}, interpolation={self.interpolation!r}, quantity={self.quantity!r},"
            f" scale={self.scale!r})"
        )
