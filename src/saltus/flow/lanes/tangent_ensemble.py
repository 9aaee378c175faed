"""Ensembles of motions with the derivatives to their initial states, advanced in spans of time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.kernel.structures import limits_of, program
from saltus.flow.lanes.compiled_lanes import compile_everything
from saltus.flow.lanes.ensemble import compiled_lanes
from saltus.flow.lanes.lane_layout import EndLabel, JobLabel, JobNumber
from saltus.flow.lanes.threads import Jobs
from saltus.flow.lanes.wanted import Wanted
from saltus.systems import System
from saltus.taylor import record_tables


class Advanced(NamedTuple):
    """Motions at the end of a span."""

    states: np.ndarray  # (n, 6), as `TangentEnsemble.advance` takes them
    sound: np.ndarray  # (n,): whether the motion came to the end with a known phase, and all numbers are finite


class TangentEnsemble:
    """Motions of a system with one coordinate, each with parameters and a forcing period of its own."""

    def __init__(self, system: System, parameters: Mapping[str, np.ndarray], lengths: np.ndarray, tol: float) -> None:
        limits, places = limits_of(system, ()), list(system.parameters)
        wanted = Wanted(tol=tol, periods=None, limits=limits, sample=(), until=(), paths=())
        run = program(system, limits, ())
        self._lanes = compiled_lanes(system, run, wanted, 1)
        self._columns = {places.index(path): values for path, values in parameters.items()}
        self._lengths, self.held = lengths, system.model.holds_coordinates
        self._records = record_tables(system, run.trace.records, {})
        compile_everything(self.held)  # here, not in each thread that advances some of the motions

    def advance(self, rows: np.ndarray, states: np.ndarray, begin: np.ndarray, end: np.ndarray) -> Advanced:
        """Advance the motions of these numbers between two local times of a forcing period, (n,) each, on this thread.

        A state holds coordinate, its two derivatives, velocity, its two: (n, 6).
        """
        numbers, labels = np.zeros((rows.size, len(JobNumber))), np.zeros((rows.size, len(JobLabel)), dtype=np.int64)
        numbers[:, JobNumber.START_TIME], numbers[:, JobNumber.END_TIME] = begin, end
        numbers[:, JobNumber.PERIOD_LENGTH] = self._lengths[rows]
        columns = {c: values[rows] for c, values in self._columns.items()}
        ends = self._lanes.run(Jobs(states, numbers, labels, columns, self._records), 1)
        done = (ends.of(EndLabel.STATUS) == Status.DONE) & (ends.of(EndLabel.MODE) != Mode.CHATTER)
        return Advanced(ends.states, done & np.isfinite(ends.states).all(axis=1))
