"""The attractors on which the motions from given states end, and the times after which they stay near these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.attractors.attractor import SAME_STATE, UNDECIDED, Target
from saltus.attractors.kind import AttractorKind
from saltus.flow import Recurrence, find_recurrence
from saltus.orbits import before_impacts
from saltus.progress import Progress, silent
from saltus.systems import System


@dataclass(frozen=True)
class LabellingSettings:
    """How motions are followed until their label is known."""

    # Number of forcing periods of the first stage; after each stage settled motions are labelled. Later stages are longer.
    stage: int = 48
    last: int = 64  # A motion that does not settle is on a sampled set if the median distance of so many last states is small.
    # The largest number of stroboscopic states that are kept at once: 67 MB, and as much again for arrays computed from them.
    most_states: int = 1 << 22
    fewest: int = 256  # The least number of motions that are followed together.


SETTINGS = LabellingSettings()


@dataclass(frozen=True)
class Labelling:
    """The labels of states by the attractors on which their motions end."""

    system: System  # with a forcing period
    targets: tuple[Target, ...]
    periods: int  # the most forcing periods of each motion
    within: float  # the distance from an attractor from which on a motion has reached it
    tol: float

    def of(self, states: np.ndarray, progress: Progress = silent) -> tuple[np.ndarray, np.ndarray]:
        """The labels of states (n, d), UNDECIDED where no label is certain, and the times to reach the attractors, (n,) each.

        A state at a contact that moves into it is taken just before the impact.
        """
        states = before_impacts(self.system, states)
        label, time = np.empty(len(states), dtype=np.int16), np.empty(len(states))
        size = max(SETTINGS.fewest, SETTINGS.most_states // self.periods)
        for start in range(0, len(states), size):
            part = slice(start, start + size)
            label[part], time[part] = self._together(states[part])
            progress(min(1.0, (start + size) / len(states)), "cells")
        return label, time

    def _together(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Labels and times of states that fit into memory together, in stages: settled motions are not followed further."""
        label, time = np.full(len(states), UNDECIDED, dtype=np.int16), np.full(len(states), np.nan)
        rows, history, done = np.arange(len(states)), states[:, None], 0
        while rows.size and done < self.periods:
            span = min(max(SETTINGS.stage, done // 2), self.periods - done)
            ends = find_recurrence(self.system, history[:, -1], span, tol=self.tol).after(done, history)
            done += span
            label[rows] = self._labels(ends, at_the_end=done == self.periods)
            time[rows] = self._times(label[rows], ends)
            on = ends.unsettled & (label[rows] == UNDECIDED)
            rows, history = rows[on], ends.states[on]
        return label, time

    def _labels(self, ends: Recurrence, at_the_end: bool) -> np.ndarray:
        """The labels of motions; unsettled motions are compared with the sampled sets at the end only."""
        label = np.full(len(ends), UNDECIDED, dtype=np.int16)
        for target in self.targets:
            if target.kind is AttractorKind.REST:
                label[self._rests(target, ends)] = target.label
            elif target.kind is AttractorKind.PERIODIC:
                label[_on_orbit(target, ends)] = target.label
            elif at_the_end:
                rows = np.flatnonzero(ends.unsettled & (label == UNDECIDED))
                if rows.size:
                    apart = np.median(target.distance(ends.states[rows, -SETTINGS.last :]), axis=1)
                    label[rows[apart < target.grain]] = target.label
        return label

    def _rests(self, target: Target, ends: Recurrence) -> np.ndarray:
        """Which motions are at rest for good in the state of an attractor, (n,); a model with one contact has one such state."""
        here = target.distance(ends.last) < SAME_STATE * max(1.0, float(np.abs(target.states).max()))
        return np.asarray(here & (ends.rest | (ends.period == 1)) if self.system.model.held else ends.rest)

    def _times(self, label: np.ndarray, ends: Recurrence) -> np.ndarray:
        """The forcing periods after which each motion stays near its attractor for as long as it is followed; nan if undecided.

        `ends.states` begins with the initial states; it has nan for periods that a motion did not need.
        """
        time = np.full(len(label), np.nan)
        for target in self.targets:
            rows = np.flatnonzero(label == target.label)
            if not rows.size:
                continue
            states = ends.states[rows]
            known = np.isfinite(states[:, :, 0])
            far = known & (target.distance(states) > max(self.within, target.grain))
            last = far.shape[1] - 1 - np.argmax(far[:, ::-1], axis=1)
            passed = np.cumsum(known, axis=1, dtype=np.int32)[np.arange(len(rows)), last]
            time[rows] = np.minimum(np.where(far.any(axis=1), passed, 0), ends.periods[rows])
        return time


def _on_orbit(target: Target, ends: Recurrence) -> np.ndarray:
    """Which motions have settled on an orbit, or were near it during its last two periods and nearer in the second, (n,)."""
    last, q = ends.states[:, -1], len(target.states)
    near = SAME_STATE * np.maximum(1.0, np.abs(last).max(axis=1))
    here: np.ndarray = (target.distance(last) < near) & (ends.periodic | ends.unsettled)
    rows = np.flatnonzero(here & ends.unsettled)
    rounds = target.distance(ends.states[rows, -2 * q :])
    before, after = rounds[:, :q].max(axis=1), rounds[:, q:].max(axis=1)
    here[rows] = (before < near[rows]) & (after < before) & (rounds.shape[1] == 2 * q)
    return here
