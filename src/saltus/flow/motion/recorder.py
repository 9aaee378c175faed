"""The records of a motion while it is computed: all of its steps, the states at given times, or its events alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import LIMITS, free_memory
from saltus.errors import MotionError
from saltus.flow.kernel.memory import EventBuffers, StepBuffers
from saltus.flow.kernel.memory_layout import EventCode
from saltus.flow.motion.events import ContactEvents, MotionEvents
from saltus.flow.motion.motion import Samples
from saltus.flow.motion.request import MotionRequest
from saltus.flow.motion.validity import DenseOutput, Validity, ValidityCheck


@dataclass(frozen=True)
class RecorderSettings:
    """How much of a motion is kept."""

    steps: int = 10_000_000  # The largest number of steps of a motion that is kept whole; they take about 2 GB.
    events: int = 20_000_000  # The largest number of events that are kept.
    rate: int = 1_000_000  # The most impacts in a unit of time: more are an accumulation that is not resolved.
    burst: int = 20_000  # With several contacts, impacts between two checks of their rate: each takes a pass of the kernel.
    buffer: int = 4096  # The steps, and events, that one call of the kernel may record.


MOST = RecorderSettings()


class Recorder:
    """Takes the contents of the kernel's buffers whenever these are full.

    With `sample_times` the dense output of each buffer is sampled, checked for validity and dropped, so that memory holds only
    the samples and the events.
    """

    def __init__(self, request: MotionRequest, order: int, columns: int) -> None:
        kept = request.dense or request.sample_times is not None
        dof, size = len(request.system.model.coordinates), MOST.buffer if kept else 8
        self._own, rows = dof, dof * (1 + columns) if request.dense and request.sample_times is None else dof
        self.steps = StepBuffers(np.empty((size, 2), dtype=np.int64), np.empty((size, 2)), np.empty((size, rows, order + 2)))
        model = request.system.model
        self._contacts = [contact.name for contact in model.contacts]
        self._frictions = [friction.name for friction in model.frictions]
        self._several = model.holds_coordinates
        self._width = 1 + 2 * dof + len(self._contacts) if self._several else 3  # the numbers of an event before its shifts
        self.events = EventBuffers(np.empty((MOST.buffer, 4), dtype=np.int64), np.empty((MOST.buffer, self._width + columns)))
        self.total = 0  # events so far
        self._kept = 0  # steps so far
        self._length, self._times = float(request.clock.length), request.sample_times
        self._pieces: list[DenseOutput] = []
        self._events: list[tuple[np.ndarray, ...]] = []
        self._samples: list[tuple[np.ndarray, ...]] = []
        self._next = 0  # index of the first sample time that is still to come
        self._check = ValidityCheck(request.system)

    def take(self, numbers: Any) -> None:
        """Empty the buffers."""
        labels, spans, series = (a[: numbers["recorded_steps"]].copy() for a in self.steps)
        if labels.size:
            self._add(DenseOutput(labels[:, 0] * self._length + spans[:, 0], spans[:, 1], labels[:, 1], series))
        self._events.append(tuple(a[: numbers["recorded_events"]].copy() for a in self.events))
        self.total += int(numbers["recorded_events"])
        numbers["recorded_steps"] = numbers["recorded_events"] = 0

    def _add(self, piece: DenseOutput) -> None:
        if self._times is None:
            self._pieces.append(piece)
            self._kept += piece.start.size
            if self._kept > MOST.steps:
                raise MotionError(
                    f"more than {MOST.steps} steps before time {piece.end:.6g}, too many to be kept; give times=... to keep "
                    "the states at those times instead, or dense=False to keep the events alone"
                )
            self._check_memory(piece)
            return
        self._sample(piece, int(np.searchsorted(self._times, piece.end, side="left")))
        self._check.add(piece)
        self._pieces = [piece]

    def _check_memory(self, piece: DenseOutput) -> None:
        """Refuse to keep more steps than there is room for; at the end all of them are copied once. Steps of stiff motions are so
        short that the number of forcing periods says nothing about it."""
        size = self._kept / piece.start.size * sum(a.nbytes for a in (piece.start, piece.length, piece.side, piece.series))
        free = free_memory() if size > LIMITS.any_machine else np.inf
        if size > LIMITS.memory * free:
            raise MotionError(
                f"the steps before time {piece.end:.6g} take {size / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB are left; "
                "give times=... to keep the states at those times instead, or dense=False to keep the events alone"
            )

    def _sample(self, piece: DenseOutput, stop: int) -> None:
        assert self._times is not None
        times = self._times[self._next : stop]
        self._samples.append((times, *piece.states(times)))
        self._next = max(stop, self._next)

    def last_hit(self) -> list[int]:
        """The contacts, by number, that the impacts in the last buffer closed."""
        labels = self._events[-1][0]
        bits = np.bitwise_or.reduce(labels[labels[:, 1] == EventCode.IMPACT, 2], initial=0)
        return [i for i in range(len(self._contacts)) if bits >> i & 1]

    def all_events(self) -> MotionEvents:
        """All events of the motion."""
        labels, values = (np.concatenate([chunk[i] for chunk in self._events]) for i in (0, 1))
        times, values = labels[:, 0] * self._length + values[:, 0], values[:, : self._width]
        if self._several:
            return ContactEvents(times, labels, values, self._contacts, self._frictions)
        return MotionEvents(times, labels, values)

    def event_shifts(self) -> np.ndarray:
        """The shift of each event along each column of the tangent, (events, columns); nan where it is not known."""
        return np.concatenate([values[:, self._width :] for _, values in self._events])

    def dense(self) -> tuple[DenseOutput | None, DenseOutput | None]:
        """The dense output of the motion, and of its columns, the coordinates of one after those of the other; None
        if it was not kept."""
        if self._times is not None or not self._pieces:
            return None, None
        fields = ("start", "length", "side", "series")
        start, length, side, series = (np.concatenate([getattr(piece, name) for piece in self._pieces]) for name in fields)
        own, columns = series[:, : self._own], series[:, self._own :]
        return DenseOutput(start, length, side, own), DenseOutput(start, length, side, columns) if columns.size else None

    def samples(self, end: float, position: np.ndarray, velocity: np.ndarray, side: int) -> Samples | None:
        """The states at the sample times up to the end, for which the given state is used; None if no samples were asked for."""
        if self._times is None:
            return None
        stop = int(np.searchsorted(self._times, end + 1e-15 * abs(end), side="right"))
        if not self._pieces:  # it has no length
            one = np.ones(stop)
            return Samples(self._times[:stop], np.outer(position, one), np.outer(velocity, one), side * one)
        self._sample(self._pieces[-1], stop)
        samples = Samples(*(np.concatenate([chunk[i] for chunk in self._samples], axis=-1) for i in range(4)))
        last = samples.time >= end  # known exactly, and after an impact there
        samples.position[:, last], samples.velocity[:, last] = position[:, None], velocity[:, None]
        samples.side[last] = side
        return samples

    def validity(self, duration: float) -> Validity:
        """The validity of the motion, from the steps that were sampled and dropped."""
        return self._check.result(duration)
