"""Loads: a base frequency and one signal for each channel that a model reads."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from saltus.errors import ParameterError, TraceError, near
from saltus.number_ranges import number_range, ranges_of, settled
from saltus.systems.loads.signals import Record, Signal, as_signal, scaled


class Channel:
    """One channel of a load at work: `channel(t)` is its value, `.velocity(t)` and
    `.acceleration(t)` its derivatives.

    `t` is the dimensionless time tau: a number, an array, or the symbolic time of a traced model.

    Parameters
    ----------
    signal
        The signal of the channel; None is 0.
    frequency
        The base frequency of the load, or None.

    Examples
    --------
    >>> [channel for channel in system.model.channels if channel in system.load.channels]
    ['horizontal', 'vertical']
    """

    __slots__ = ("_frequency", "_signal")

    def __init__(self, signal: Signal | None, frequency: Any) -> None:
        self._signal = signal
        self._frequency = frequency

    def __repr__(self) -> str:
        return "a load channel (call it with the time, as in load.horizontal(t))"

    def _derivative(self, t: Any, order: int) -> Any:
        return 0.0 if self._signal is None else self._signal.derivative(t, self._frequency, order)

    def __call__(self, t: Any) -> Any:
        """The value at `t` (a force, or a displacement of the ground)."""
        return self._derivative(t, 0)

    def velocity(self, t: Any) -> Any:
        """The first derivative at `t`.

        Parameters
        ----------
        t
            The time.
        """
        return self._derivative(t, 1)

    def acceleration(self, t: Any) -> Any:
        """The second derivative at `t`.

        Parameters
        ----------
        t
            The time.
        """
        return self._derivative(t, 2)


# what results are asked for, by which a load is told from them: no channel has such a name
OF_RESULTS = {"to_xarray", "to_pandas", "attrs", "data_vars", "dims"}


@dataclass(frozen=True, init=False, repr=False)
class Load:
    """The loads on a system: `Load(frequency=Omega, horizontal=Harmonic(amplitude=H),
    vertical=-0.5)`.

    A channel is a number, a `Harmonic`, a `Record`, a `Table`, a pulse such as `HalfSine` or
    `Step`, or a wave with corners such as `Square`. It may be a sum of these, written as one or as
    a list; a channel that is not named is 0. Channels that begin with `ground` are displacements of
    the ground (zeta, nu), all others forces. Frozen.

    The paper's loads: (i) `loadpatha`, `Load(frequency=W, horizontal=Harmonic(amplitude=H),
    vertical=-0.5)`; (ii) `loadpathaa`, `Load(frequency=W, ground_horizontal=Harmonic(amplitude=z),
    vertical=-0.5)`; (iii) `loadpathb`, `Load(frequency=W, horizontal=Harmonic(amplitude=H),
    vertical=Harmonic(mean=-0.5, amplitude=0.25, phase=pi/2))`.

    Parameters
    ----------
    frequency
        The base angular frequency Omega > 0 of every harmonic, or None for a load without a period.
    channels
        A `Signal`, a number or a list of them for each channel by its name, such as
        horizontal=-0.5.

    Raises
    ------
    ParameterError
        A harmonic without a frequency, a record or a pulse of the wrong quantity.

    Examples
    --------
    >>> load = saltus.Load(frequency=2.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5)
    >>> load.period / np.pi, load.vertical(0.0)
    (1.0, -0.5)
    """

    frequency: float | None = field(metadata=number_range(above=0.0))
    channels: dict[str, Signal]

    def __init__(
        self,
        *,
        frequency: float | None = None,
        **channels: Signal | float | list[Any] | tuple[Any, ...],
    ) -> None:
        signals = {name: as_signal(value, f"load.{name}") for name, value in channels.items()}
        if frequency is not None:
            frequency = settled("load.frequency", frequency, ranges_of(Load)["frequency"])
            if not 2.0 * math.pi / frequency < 1e300:
                raise ParameterError(
                    f"load.frequency must make a finite forcing period, got {frequency!r}",
                    "load.frequency",
                )
        for name, signal in signals.items():
            if signal.periodic and frequency is None:
                raise ParameterError(
                    f"load.{name} repeats itself, so load.frequency must be given", f"load.{name}"
                )
            _check_quantity(name, signal)
        repeating = [name for name, signal in signals.items() if signal.repeats]
        passing = [name for name, signal in signals.items() if signal.once]
        if repeating and passing:
            raise ParameterError(
                f"load.{passing[0]} happens once and load.{repeating[0]} repeats itself between"
                " corners, which are not followed together: write the second one as a Record over"
                " the time of the motion, or as harmonics",
                f"load.{passing[0]}",
            )
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "channels", signals)

    def __getattr__(self, name: str) -> Channel:
        # IPython, pickle and copy probe for names like these, and a load that was refused has neither
        # of its fields
        if name in OF_RESULTS or name in ("channels", "frequency") or name.startswith("_"):
            raise AttributeError(name)
        return Channel(self.channels.get(name), self.frequency)

    def __hash__(self) -> int:
        return hash(
            (self.frequency, tuple(sorted(self.channels.items(), key=lambda item: item[0])))
        )

    def __repr__(self) -> str:
        parts = [] if self.frequency is None else [f"frequency={self.frequency!r}"]
        for name, signal in self.channels.items():
            value = (
                getattr(signal, "value", signal) if type(signal).__name__ == "Constant" else signal
            )
            parts.append(f"{name}={value!r}")
        return f"Load({', '.join(parts)})"

    @property
    def period(self) -> float | None:
        """The forcing period 2 pi / Omega, or None for a load without a base frequency."""
        return None if self.frequency is None else 2.0 * math.pi / self.frequency

    @property
    def jumps(self) -> bool:
        """Whether any channel jumps at corners that repeat themselves."""
        return any(signal.jumps for signal in self.channels.values())

    @property
    def corners(self) -> np.ndarray:
        """The corners that repeat themselves, as shares of the forcing period from 0 on."""
        own = [signal.corners for signal in self.channels.values()]
        return np.unique(np.concatenate([np.empty(0), *own]))


def corners_between(load: Load, start: float, end: float) -> np.ndarray:
    """The times of a load's corners between two times."""
    shares = load.corners
    if not shares.size or load.period is None:
        return np.empty(0)
    periods = np.arange(math.floor(start / load.period), math.ceil(end / load.period) + 1)
    times = load.period * (periods[:, None] + shares).ravel()
    return np.asarray(times[(start < times) & (times < end)])


class DeclaredLoad:
    """A load as its model may read it: it has only the channels that the model declares, and a
    misspelt name is not read as 0.
    """

    def __init__(self, load: Any, model: Any) -> None:
        self._load = load
        self._model = model

    def __getattr__(self, name: str) -> Any:
        channels = self._model.channels
        if name not in (*channels, "frequency", "period"):
            raise TraceError(
                f"{type(self._model).__name__} reads load.{name}, which is not one of its "
                f"channels; "
                f"{near(name, channels)}"
            )
        return getattr(self._load, name)


def _check_quantity(name: str, signal: Signal) -> None:
    terms: Any = getattr(signal, "terms", (signal,))
    for term in terms:
        if (term.once or term.repeats) and (term.quantity == "force") == name.startswith("ground"):
            wanted = (
                "displacement, velocity or acceleration" if name.startswith("ground") else "force"
            )
            kind = "record" if isinstance(term, Record) else type(term).__name__
            raise ParameterError(
                f"load.{name} takes a {kind} of {wanted}, got quantity={term.quantity!r}",
                f"load.{name}",
            )


def reversed_load(load: Load, *endings: str) -> Load:
    """A load in which the channels whose names have one of these endings, such as "horizontal",
    have the other sign.
    """
    signals = {
        name: scaled(signal, -1.0) if name.endswith(endings) else signal
        for name, signal in load.channels.items()
    }
    return Load(frequency=load.frequency, **signals)


class Sides(dict[str, Any]):
    """The sides of a model's surfaces, +1 or -1, by their names: `sides.stop` or
    `sides["stop"]`.
    """

    def __getattr__(self, name: str) -> Any:
        if name not in self:
            raise ParameterError(f"no surface {name!r}; {near(name, self)}", "sides")
        return self[name]


class LoadOnSides:
    """A load together with the sides on which the equations are asked for."""

    def __init__(self, load: Any, sides: Sides) -> None:
        self._load = load
        self.sides = sides

    def __getattr__(self, name: str) -> Any:
        return getattr(self._load, name)
