"""A system that rests at its contact and is shaken: what becomes of it under a pulse or a record of
any size and frequency.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from saltus.attractors import Equilibrium, equilibria
from saltus.errors import ParameterError, shown
from saltus.flow import simulate_many, stop_names
from saltus.systems import Box, Constant, Record, System, Transient, check_system

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class OverturningSettings:
    """How long motions are followed, and how borders are found."""

    # motions go on for so many times 1 / lambda after the load, with the rate lambda of the saddle
    free: float = 40.0
    # of the interval between two cells of the map that differ: then Newton's method converges
    halvings: int = 24
    samples: int = 500  # at which a motion is compared with the saddle after the load
    # a motion comes near to the saddle within this share of its distance from the contact
    near: float = 0.3
    iterations: int = 12  # of Newton's method from the halved interval
    converged: float = 1e-13  # of the amplitude: the last step of Newton's method
    # share of the frequency over which the slope of a border is taken, for its tangent alone
    difference: float = 1e-6
    # share of the range of amplitudes within which a start lies on the lines through the points of
    # a border
    same: float = 2e-3
    tol: float = 1e-14  # the error of one step of the motions on a border


OVERTURNING = OverturningSettings()


@dataclass(frozen=True)
class Shaken:
    """A system that rests at its contact and is shaken by one pulse or record, whose amplitude and
    frequency are varied.
    """

    system: System
    channel: str
    saddles: tuple[Equilibrium, ...]

    @classmethod
    def of(cls, system: System, window: Box | None = None) -> Shaken:
        """The system with its one load that varies, and its saddles once this is over."""
        check_system(system, "overturning", coordinates=1)
        varied = [
            name
            for name, signal in system.load.channels.items()
            if not isinstance(signal, Constant)
        ]
        if len(varied) != 1 or not isinstance(system.load.channels[varied[0]], (Transient, Record)):
            raise ParameterError(
                "overturning needs a load with one pulse or record, such as"
                f" ground_horizontal=HalfSine(...), besides constants; got {shown(system.load)}",
                "load",
            )
        signal = system.load.channels[varied[0]]
        if not isinstance(signal, Record) and not hasattr(signal, "frequency"):
            raise ParameterError(
                f"a {type(signal).__name__} has no frequency; take a pulse that has one",
                f"load.{varied[0]}",
            )
        rest = system.with_({f"load.{varied[0]}": 0.0})
        saddles = tuple(place for place in equilibria(rest, window) if place.saddle)
        if not saddles or not system.model.stops:
            raise ParameterError(
                f"{type(system.model).__name__} cannot overturn: it has {len(saddles)} unstable"
                f" equilibria in the window and {len(system.model.stops)} margins that stop a"
                " motion",
                "system",
            )
        return cls(system, varied[0], saddles)

    @property
    def signal(self) -> Any:
        """The pulse or the record."""
        return self.system.load.channels[self.channel]

    @property
    def path(self) -> str:
        """The path of the amplitude of a pulse, or of the scale of a record."""
        return f"load.{self.channel}.{'scale' if isinstance(self.signal, Record) else 'amplitude'}"

    @property
    def start(self) -> dict[str, Any]:
        """The state at the start: at rest at the contact."""
        return {self.system.model.coordinates[0]: float(self.system.model.contact)}

    @property
    def rate(self) -> float:
        """The slowest rate lambda at which motions leave a saddle."""
        return min(place.eigenvalues[0].real for place in self.saddles if place.eigenvalues)

    def under(self, frequency: float, amplitude: float | None = None) -> System:
        """The system under the pulse of this frequency and amplitude, or under the record, times
        the amplitude, so many times faster.
        """
        signal: Any = self.signal
        if isinstance(signal, Record):
            signal = replace(
                signal,
                time=signal.time / frequency,
                scale=signal.scale * (1.0 if amplitude is None else amplitude),
            )
        else:
            signal = replace(
                signal,
                frequency=frequency,
                amplitude=signal.amplitude if amplitude is None else amplitude,
            )
        return self.system.with_({f"load.{self.channel}": signal})

    def end(self, frequency: float) -> float:
        """The time at which the load is over."""
        return end_of(self.under(frequency).load.channels[self.channel])

    def duration(self, frequencies: np.ndarray) -> float:
        """For how long motions under all these loads are followed."""
        return max(map(self.end, frequencies)) + OVERTURNING.free / self.rate

    def scaled(self, factors: np.ndarray) -> Outcomes:
        """What becomes of motions under the load as it is, made larger by these factors, (n,)."""
        value = float(self.system.get(self.path))
        duration = end_of(self.signal) + OVERTURNING.free / self.rate
        return Outcomes.of(
            simulate_many(
                self.system,
                duration=duration,
                parameters={self.path: factors * value},
                **self.start,
            )
        )

    def outcomes(self, frequency: np.ndarray, amplitude: np.ndarray) -> Outcomes:
        """What becomes of motions with these frequencies and amplitudes, (n,) each; of a record
        they are factors.
        """
        if not isinstance(self.signal, Record):
            columns = {f"load.{self.channel}.frequency": frequency, self.path: amplitude}
            duration = self.duration(np.unique(frequency))
            return Outcomes.of(
                simulate_many(self.system, duration=duration, parameters=columns, **self.start)
            )
        found = [np.empty(frequency.shape, dtype) for dtype in (np.int8, int, "U10")]
        for value in np.unique(frequency):
            own = frequency == value
            ends = simulate_many(
                self.under(float(value)),
                duration=self.duration(np.array([value])),
                parameters={self.path: amplitude[own] * self.signal.scale},
                **self.start,
            )
            for array, values in zip(found, Outcomes.of(ends), strict=True):
                array[own] = values
        return Outcomes(*found)


def end_of(signal: Any) -> float:
    """The time at which a pulse or a record is over."""
    return float(signal.time[-1] if isinstance(signal, Record) else signal.settled)


class Outcomes(NamedTuple):
    """What became of motions, (n,) each."""

    overturned: np.ndarray  # the side to which it has overturned, 0 where it stands
    impacts: np.ndarray  # until then
    stop: np.ndarray  # why it ended, a word of `Stop`

    @classmethod
    def of(cls, ends: xarray.Dataset) -> Outcomes:
        """The outcomes of an ensemble."""
        stop = stop_names(ends).values
        fallen = np.where(stop == "limit", ends["side"].values, 0).astype(np.int8)
        return cls(fallen, ends["impact_count"].values, stop)

    @property
    def kinds(self) -> np.ndarray:
        """A number for each way to overturn, by the side and the impacts before, and 0 for all that
        stands, (n,).
        """
        return np.asarray(self.overturned * (1 + self.impacts))
