"""The ends and the samples of the trajectories of an ensemble, read from the arrays that the lanes have written."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from saltus.flow.ensemble.inputs import Inputs
from saltus.flow.ensemble.lane_layout import EndLabel, EndNumber, JobLabel, JobNumber
from saltus.flow.ensemble.threads import Ends, Jobs
from saltus.flow.ensemble.wanted import Sample, Wanted
from saltus.flow.kernel_layout import Mode, Status
from saltus.flow.stops import Stop
from saltus.systems import System

STOPS = {
    Status.DONE: Stop.HORIZON,
    Status.LIMITED: Stop.LIMIT,
    Status.CAPTURED: Stop.CAPTURED,
    Status.SETTLED: Stop.SETTLED,
    Status.NOT_UNIQUE: Stop.NOT_UNIQUE,
    Status.NO_IMPACT: Stop.NO_IMPACT,
    Status.NOT_FINITE: Stop.NOT_FINITE,
    Status.STALLED: Stop.STALLED,
    Status.OUTSIDE: Stop.OUTSIDE,
    Status.UNRESOLVED: Stop.UNRESOLVED,
}  # by the driver's reason; a motion that is DONE at rest ends with Stop.REST
NUMBERS = {stop: number for number, stop in enumerate(Stop)}  # in a dataset


@dataclass(frozen=True, eq=False)
class EnsembleResult:
    """The results of an ensemble, with a row for each trajectory, whatever the ensemble's shape."""

    system: System
    inputs: Inputs
    wanted: Wanted
    jobs: Jobs
    ends: Ends

    @property
    def rows(self) -> int:
        """The number of coordinates, including those of the tangent's columns."""
        return int(self.jobs.states.shape[1] // 2)

    @property
    def last(self) -> np.ndarray:
        """The states at the end, coordinates and then velocities, (n, d)."""
        own = len(self.system.model.coordinates)
        return np.concatenate([self.ends.states[:, :own], self.ends.states[:, self.rows : self.rows + own]], axis=1)

    @property
    def held(self) -> np.ndarray:
        """Which trajectories are held at the contact at the end, at rest or in chatter, (n,)."""
        mode = self.ends.of(EndLabel.MODE)
        return np.asarray((mode == Mode.REST) | (mode == Mode.CHATTER))

    @property
    def time(self) -> np.ndarray:
        """The dimensionless time at the end, (n,)."""
        length, local = self.jobs.numbers[:, JobNumber.PERIOD_LENGTH], self.ends.numbers[:, EndNumber.TIME]
        return np.asarray(self.ends.of(EndLabel.PERIOD) * length + local)

    @property
    def elapsed(self) -> np.ndarray:
        """The time from the start to the end, counted within their forcing periods, (n,)."""
        return np.asarray(self.ends.numbers[:, EndNumber.TIME] - self.jobs.numbers[:, JobNumber.START_TIME])

    @property
    def whole_periods(self) -> np.ndarray:
        """The number of the forcing period in which a trajectory ended less that in which it began, (n,)."""
        return np.asarray(self.ends.of(EndLabel.PERIOD) - self.jobs.labels[:, JobLabel.FIRST_PERIOD])

    @property
    def periods(self) -> np.ndarray | None:
        """The forcing periods from the start to the end, (n,); None without a forcing."""
        length = self.jobs.numbers[:, JobNumber.PERIOD_LENGTH]
        return self.whole_periods + self.elapsed / length if (length > 0).all() else None

    @cached_property
    def stops(self) -> np.ndarray:
        """Why each ended, the number of a `Stop`, (n,)."""
        reasons = self.ends.of(EndLabel.STATUS)
        numbers = np.full(reasons.shape, -1, dtype=np.int8)
        for reason, stop in STOPS.items():
            numbers[reasons == reason] = NUMBERS[stop]
        numbers[(reasons == Status.DONE) & (self.ends.of(EndLabel.MODE) == Mode.REST)] = NUMBERS[Stop.REST]
        if self.system.model.singularity:  # steps that shrink to nothing mean a singularity that the model names
            numbers[reasons == Status.STALLED] = NUMBERS[Stop.SINGULAR]
        return numbers

    def stopped(self, *stops: Stop) -> np.ndarray:
        """Which ended for one of these reasons, (n,)."""
        return np.isin(self.stops, [NUMBERS[stop] for stop in stops])

    @property
    def recurrence_period(self) -> np.ndarray:
        """The forcing periods after which each repeats itself, 0 where it has not settled, (n,)."""
        return np.where(self.ends.of(EndLabel.STATUS) == Status.SETTLED, self.ends.of(EndLabel.DETAIL), 0)

    @cached_property
    def samples(self) -> dict[Sample, np.ndarray]:
        """The samples of the last forcing periods, in the order of time, (n, kept, columns); nan where there were fewer."""
        kept, done = self.ends.samples.shape[1], self.ends.of(EndLabel.PERIODS_DONE)
        order = (done[:, None] + np.arange(kept)) % kept  # the oldest first
        samples = np.take_along_axis(self.ends.samples, order[:, :, None], axis=1)
        samples[np.arange(kept)[None, :] < (kept - done)[:, None]] = np.nan
        found, column = {}, 0
        for kind in (kind for kind in Sample if kind in self.wanted.sample):
            width = len(kind.columns(len(self.system.model.coordinates)))
            found[kind] = samples[:, :, column : column + width]
            column += width
        return found
