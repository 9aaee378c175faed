"""The ends and the samples of the trajectories of an ensemble, read from the arrays that the lanes
have written.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.lanes.inputs import Inputs
from saltus.flow.lanes.options import EnsembleOptions, Sample
from saltus.flow.motion.events import Stop
from saltus.flow.motion.sensitivities import state_slopes
from saltus.flow.motion.simulate import simulate
from saltus.flow.programs.lane_threads import Ends, Jobs
from saltus.systems import System, arguments_of
from saltus.taylor import FREQUENCY

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
    Status.PASSED: Stop.PASSED,
    Status.UNORDERED: Stop.NOT_UNIQUE,
    Status.NO_STATE: Stop.NOT_FINITE,
}  # by the driver's reason; a motion that is DONE at rest ends with Stop.REST
NUMBERS = {stop: number for number, stop in enumerate(Stop)}  # in a dataset


@dataclass(frozen=True, eq=False)
class EnsembleResult:
    """The results of an ensemble, with a row for each trajectory, whatever the ensemble's shape."""

    system: System
    inputs: Inputs
    options: EnsembleOptions
    jobs: Jobs
    ends: Ends
    device: str = ""  # the card that has followed the motions

    @property
    def rows(self) -> int:
        """The number of coordinates, including those of the tangent's columns."""
        return int(self.jobs.states.shape[1] // 2)

    @property
    def last(self) -> np.ndarray:
        """The states at the end, coordinates and then velocities, (n, d); behind them the sides of
        relays, if the model has some.
        """
        own = len(self.system.in_gap_coordinates.model.coordinates)
        states = np.concatenate(
            [self.ends.states[:, :own], self.ends.states[:, self.rows : self.rows + own]], axis=1
        )
        states = self._in_own_coordinates(self.time, states)
        if not self.system.model.relays:
            return states
        return np.concatenate([states, self.ends.sides], axis=1)

    def _in_own_coordinates(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """States (n, d) at times (n,) in the coordinates of `system`, from those of
        `system.in_gap_coordinates`.
        """
        if (inner := self.system.in_gap_coordinates) is self.system:
            return states
        twin = self.inputs.with_numbers(inner)
        own = len(inner.model.coordinates)
        given = twin.model.own_states(times, states[:, :own].T, states[:, own:].T, twin.load)
        return np.asarray(np.concatenate(given)).T

    @property
    def held(self) -> np.ndarray:
        """Which trajectories are held at the contact at the end, at rest or in chatter, (n,)."""
        mode = self.ends.rows["mode"]
        return np.asarray((mode == Mode.REST) | (mode == Mode.CHATTER))

    @property
    def side(self) -> np.ndarray:
        """The side of the contact at the end, 0 at rest; of a model with several parts 1 if the
        motion is not at rest, (n,).
        """
        side = self.ends.rows["side"]
        several = self.system.model.holds_coordinates
        return np.where(self.held, 0, np.ones_like(side) if several else side)

    @property
    def time(self) -> np.ndarray:
        """The dimensionless time at the end, (n,)."""
        length = self.jobs.rows["period_length"]
        local = self.ends.rows["time"]
        return np.asarray(self.ends.rows["period"] * length + local)

    @property
    def elapsed(self) -> np.ndarray:
        """The time from the start to the end, counted within their forcing periods, (n,)."""
        return np.asarray(self.ends.rows["time"] - self.jobs.rows["start_time"])

    @property
    def whole_periods(self) -> np.ndarray:
        """The number of the forcing period in which a trajectory ended less that in which it began,
        (n,).
        """
        return np.asarray(self.ends.rows["period"] - self.jobs.rows["first_period"])

    @property
    def periods(self) -> np.ndarray | None:
        """The forcing periods from the start to the end, (n,); None without a forcing."""
        length = self.jobs.rows["period_length"]
        return self.whole_periods + self.elapsed / length if (length > 0).all() else None

    @cached_property
    def stops(self) -> np.ndarray:
        """Why each ended, the number of a `Stop`, (n,)."""
        reasons = self.ends.rows["status"]
        numbers = np.full(reasons.shape, -1, dtype=np.int8)
        for reason, stop in STOPS.items():
            numbers[reasons == reason] = NUMBERS[stop]
        numbers[(reasons == Status.DONE) & (self.ends.rows["mode"] == Mode.REST)] = NUMBERS[
            Stop.REST
        ]
        # steps that shrink to nothing mean a singularity that the model names
        if self.system.model.singularity:
            numbers[reasons == Status.STALLED] = NUMBERS[Stop.SINGULAR]
        return numbers

    def stopped(self, *stops: Stop) -> np.ndarray:
        """Which ended for one of these reasons, (n,)."""
        return np.isin(self.stops, [NUMBERS[stop] for stop in stops])

    @property
    def recurrence_period(self) -> np.ndarray:
        """The forcing periods after which each repeats itself, 0 where it has not settled, (n,)."""
        return np.where(self.ends.rows["status"] == Status.SETTLED, self.ends.rows["detail"], 0)

    @cached_property
    def samples(self) -> dict[Sample, np.ndarray]:
        """The samples of the last forcing periods, in the order of time, (n, kept, columns); nan
        where there were fewer.
        """
        kept = self.ends.samples.shape[1]
        done = self.ends.rows["periods_done"]
        order = (done[:, None] + np.arange(kept)) % kept  # the oldest first
        samples = np.take_along_axis(self.ends.samples, order[:, :, None], axis=1)
        samples[np.arange(kept)[None, :] < (kept - done)[:, None]] = np.nan
        found = {}
        column = 0
        for kind in (kind for kind in Sample if kind in self.options.sample):
            width = len(kind.columns(len(self.system.in_gap_coordinates.model.coordinates)))
            found[kind] = samples[:, :, column : column + width]
            column += width
        if Sample.STATE in found and self.system.in_gap_coordinates is not self.system:
            length = self.jobs.rows["period_length"]
            begun = self.jobs.rows["first_period"]
            whole = [
                (begun + done - back) * length + self.jobs.rows["start_time"]
                for back in range(kept - 1, 0, -1)
            ]
            states = [
                self._in_own_coordinates(t, found[Sample.STATE][:, i])
                for i, t in enumerate([*whole, self.time])
            ]
            found[Sample.STATE] = np.stack(states, axis=1)
        if Sample.STATE in found and self.system.model.relays:  # their sides are behind all else
            found[Sample.STATE] = np.concatenate(
                [found[Sample.STATE], samples[:, :, column:]], axis=2
            )
        return found

    def extrema_later(self, periods: np.ndarray, kept: int) -> np.ndarray:
        """The largest and the least of all own coordinates in each of the next forcing periods, as
        many as are given (n,) and `kept` at most, (n, kept, 2); nan before. Lanes record those of
        the coordinates that contacts hold one by one.
        """
        extrema = np.full((len(periods), kept, 2), np.nan)
        last = self.last
        size = len(periods)
        length = np.broadcast_to(self.jobs.rows["period_length"], size)
        for row, count in enumerate(np.minimum(periods, kept).tolist()):
            numbers = {
                path: float(np.broadcast_to(a, size)[row])
                for path, a in self.inputs.parameters.items()
            }
            system = self.system.with_(numbers)
            state = arguments_of(self.system, last[row])
            if count > 0:
                motion = simulate(
                    system, **state, duration=count * float(length[row]), tol=self.options.tol
                )
                # of the forcing periods
                ends = np.minimum(motion.start + np.arange(count + 1) * length[row], motion.time)
                found = motion.extrema_between(ends)
                extrema[row, kept - count :] = np.stack(
                    [found[:, :, 1].max(axis=1), found[:, :, 0].min(axis=1)], axis=1
                )
        return extrema

    @cached_property
    def derivatives(self) -> np.ndarray:
        """The derivatives of the end state to the initial one and to the parameters that were asked
        for, (n, d, d + parameters).

        The time at the start is fixed, and so is the time at the end, with two exceptions. If
        periods were asked for and the motion ends after n of them, its end, start + n 2 pi / W,
        moves with the frequency W. If it ends at a margin, the end moves with the margin.
        """
        paths = self.options.paths or ()
        ends = self.ends
        own = len(self.system.in_gap_coordinates.model.coordinates)
        rows = self.rows
        q = ends.states[:, own:rows].reshape(-1, 2 * own + len(paths), own)
        v = ends.states[:, rows + own :].reshape(-1, 2 * own + len(paths), own)
        derivatives = np.concatenate([q, v], axis=2).transpose(0, 2, 1).copy()
        rates = ends.rates[:, :own]
        shifts = ends.rates[:, own:]
        # their derivatives to parameters are not asked for
        if (inner := self.system.in_gap_coordinates) is not self.system:
            twin = self.inputs.with_numbers(inner)
            model = twin.model
            load = twin.load
            begin = list(self.inputs.values.values())
            given = len(self.system.model.coordinates)
            start = [np.broadcast_to(x, len(derivatives)) for x in begin[: 2 * given]]
            here = ends.states[:, :own].T, ends.states[:, rows : rows + own].T
            into = state_slopes(
                model.gap_values, self.inputs.values["time"], (start[:given], start[given:]), load
            )
            derivatives = state_slopes(model.own_values, self.time, here, load) @ derivatives @ into
            shifts = (shifts[:, None] @ into)[:, 0]
            second = model.own_values(
                self.time, load, *([*x] if own > 1 else x[0] for x in (*here, rates.T))
            )[2]
            rates = np.column_stack(
                np.broadcast_arrays(self.time, *(second if given > 1 else [second]))
            )[:, 1:]
            own = given
        slope = np.concatenate([self.last[:, own:], rates], axis=1)
        limited = ends.rows["status"] == Status.LIMITED
        # the instant at which a margin is reached without speed has no derivative
        with np.errstate(invalid="ignore"):
            derivatives[limited] += slope[limited, :, None] * shifts[limited, None, :]
        if self.options.periods is not None and FREQUENCY in paths:
            at_period_end = np.isin(ends.rows["status"], (Status.DONE, Status.SETTLED))
            moving = at_period_end & (ends.rows["mode"] == Mode.ARC)
            length = self.jobs.rows["period_length"]
            span = self.whole_periods * length + self.elapsed
            shift = np.where(moving, -span * length / (2.0 * np.pi), 0.0)  # of the end, -span / W
            derivatives[:, :, 2 * own + paths.index(FREQUENCY)] += np.where(
                moving[:, None], shift[:, None] * slope, 0.0
            )
        return derivatives
