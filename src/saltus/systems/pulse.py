"""The base class of pulses, loads that begin and end. The shapes are in `pulses.py`.

A pulse is not smooth where it begins and where it ends: these two instants are breakpoints of the motion, as the samples of a
record are, so that no step of an integration crosses them. In an ensemble each motion has its own breakpoints.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from saltus.checks import settle_numbers
from saltus.errors import ParameterError
from saltus.systems.signals import QUANTITY_ORDER, Signal

TIME, RATE = {"converts": "time"}, {"converts": "rate"}  # the metadata of fields that units of time convert


@dataclass(frozen=True, kw_only=True)
class Pulse(Signal):
    """A load that begins at `start` and lasts for `length`; a pulse by itself is 0 before and after.

    `quantity` says which quantity it is: a `force`, or an `acceleration` of the ground. The ground then moves from rest, and goes
    on with the velocity that it has at the end of the pulse.

    Contract: a subclass gives `length` and `shape(since, n)`, the n-th derivative of the quantity at `since` after the start,
    or for n = -1 and -2 its integrals from the start; `moving` names the numbers on which the beginning or the end depends.
    """

    amplitude: float
    start: float = field(default=0.0, metadata=TIME)
    quantity: str = "force"
    once: ClassVar[bool] = True
    holds: ClassVar[bool] = False  # whether it keeps its last value after its end
    moving: ClassVar[tuple[str, ...]] = ("start", "frequency")
    quantities: ClassVar[tuple[str, ...]] = ("force", "acceleration")

    def __post_init__(self) -> None:
        if self.quantity not in self.quantities:
            raise ParameterError(
                f"quantity of a {type(self).__name__} must be one of {', '.join(self.quantities)}, got {self.quantity!r}",
                "quantity",
            )
        settle_numbers(self, "amplitude", "start")
        positive = [f.name for f in dataclasses.fields(self) if f.metadata in (TIME, RATE) and f.name != "start"]
        settle_numbers(self, *positive, above=0.0)
        if not (math.isfinite(self.length) and self.start + self.length > self.start):
            raise ParameterError(
                f"a {type(self).__name__} of the duration {self.length:g} does not end after its start", positive[0]
            )

    @property
    def length(self) -> Any:
        """The duration of the pulse."""
        raise NotImplementedError

    def shape(self, since: Any, n: int) -> Any:
        """The n-th derivative of the quantity at `since` after the start; for n = -1 and -2 the integrals from the start."""
        raise NotImplementedError

    def derivative(self, t: Any, frequency: Any, order: int = 0) -> Any:
        """The channel at `t`, or its derivative: the quantity, differentiated or integrated from rest."""
        n = order - QUANTITY_ORDER[self.quantity]
        since, within, after = t.pulse(self) if hasattr(t, "pulse") else self._clocks(np.asarray(t, dtype=float))
        if n > 0 or (n == 0 and not self.holds):
            return within * self.shape(since, n)
        value = self.shape(since, n)
        if n == -2:
            value = value + after * self.shape(self.length, -1)
        if n < 0 and self.holds:
            value = value + (after if n == -1 else 0.5 * after * after) * self.shape(self.length, 0)
        return value

    def _clocks(self, t: Any) -> tuple[Any, Any, Any]:
        """The time since the start, at most `length`; 1 within the span, else 0; the time since the end."""
        since, end = np.clip(t - self.start, 0.0, self.length), self.start + self.length
        return since[()], np.where((t >= self.start) & (t < end), 1.0, 0.0)[()], np.maximum(t - end, 0.0)[()]


def in_other_units(pulse: Pulse, by_time: Callable[..., Any], by_rate: Callable[..., Any], unit: float, factor: float) -> Pulse:
    """The pulse with its times and rates converted by the unit of time, and `factor` times as high."""
    of = {"time": by_time, "rate": by_rate}
    fields = {f.name: of[f.metadata["converts"]] for f in dataclasses.fields(pulse) if f.metadata.get("converts") in of}
    changed = {name: convert(getattr(pulse, name), unit) for name, convert in fields.items()}
    return dataclasses.replace(pulse, **changed, amplitude=factor * pulse.amplitude)
