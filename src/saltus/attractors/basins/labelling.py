"""Which attractor motions end on, state by state, and how long they take to come near: what basins are made of."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from saltus.attractors.attractor import NEAR, REST, UNDECIDED, Target
from saltus.flow import Recurrence, find_recurrence
from saltus.systems import System

MOST_STATES = 1 << 22  # states at phase 0 kept at once: 67 MB, and as much again for what is made of them
STAGE = 48  # forcing periods after which motions that have settled are told from those that go on, longer later
LAST = 64  # strobes of a motion that does not settle which must lie on a sampled set


def label_states(
    system: System,
    targets: Iterable[Target],
    states: np.ndarray,
    periods: int,
    within: float,
    tol: float,
    say: Callable[[float], object] = lambda _: None,
) -> tuple[np.ndarray, np.ndarray]:
    """The labels of states (n, 2), UNDECIDED where none is borne out, and the times to reach the attractors, (n,) each."""
    targets = tuple(targets)
    label, time = np.empty(len(states), dtype=np.int16), np.empty(len(states))
    size = max(256, MOST_STATES // periods)
    for start in range(0, len(states), size):
        part = slice(start, start + size)
        label[part], time[part] = _block(system, targets, states[part], periods, within, tol)
        say(min(1.0, (start + size) / len(states)))
    return label, time


def _block(
    system: System, targets: tuple[Target, ...], states: np.ndarray, periods: int, within: float, tol: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same for as many states as fit into the memory, in stages: those that have settled go no further."""
    label, time = np.full(len(states), UNDECIDED, dtype=np.int16), np.full(len(states), np.nan)
    rows, history, done = np.arange(len(states)), states[:, None], 0
    while rows.size and done < periods:
        span = min(max(STAGE, done // 2), periods - done)
        ends = find_recurrence(system, history[:, -1], span, tol=tol).after(done, history)
        done += span
        label[rows] = _labelled(targets, ends, sampled=done == periods)
        time[rows] = _times(targets, label[rows], ends, within)
        on = ends.unsettled & (label[rows] == UNDECIDED)
        rows, history = rows[on], ends.states[on]
    return label, time


def _labelled(targets: tuple[Target, ...], ends: Recurrence, sampled: bool) -> np.ndarray:
    """The labels of motions by their ends; with `sampled`, those that do not settle may lie on a set known by its points."""
    label = np.full(len(ends.period), UNDECIDED, dtype=np.int16)
    for target in targets:
        if target.kind == "rest":
            label[ends.rest] = REST
        elif target.kind == "periodic":
            label[_on_cycle(target, ends)] = target.label
        elif sampled:
            rows = np.flatnonzero(ends.unsettled & (label == UNDECIDED))
            if rows.size:
                apart = np.median(target.distance(ends.states[rows, -LAST:]), axis=1)
                label[rows[apart < target.grain]] = target.label
    return label


def _on_cycle(target: Target, ends: Recurrence) -> np.ndarray:
    """Which motions have settled on a cycle, or were near it for two rounds, and nearer in the second, (n,)."""
    last, q = ends.states[:, -1], len(target.strobes)
    near = NEAR * np.maximum(1.0, np.abs(last).max(axis=1))
    here: np.ndarray = (target.distance(last) < near) & ((ends.period > 0) | ends.unsettled)
    rows = np.flatnonzero(here & ends.unsettled)
    rounds = target.distance(ends.states[rows, -2 * q :])
    before, after = rounds[:, :q].max(axis=1), rounds[:, q:].max(axis=1)
    here[rows] = (before < near[rows]) & (after < before) & (rounds.shape[1] == 2 * q)
    return here


def _times(targets: tuple[Target, ...], label: np.ndarray, ends: Recurrence, within: float) -> np.ndarray:
    """Forcing periods after which each motion stays near its attractor, up to its end; nan where undecided.

    The strobes begin with the initial state; nan stands for periods that were not needed.
    """
    time = np.full(len(label), np.nan)
    for target in targets:
        rows = np.flatnonzero(label == target.label)
        if not rows.size:
            continue
        strobes = ends.states[rows]
        known = np.isfinite(strobes[:, :, 0])
        far = known & (target.distance(strobes) > max(within, target.grain))
        last = far.shape[1] - 1 - np.argmax(far[:, ::-1], axis=1)
        passed = np.cumsum(known, axis=1, dtype=np.int32)[np.arange(len(rows)), last]
        time[rows] = np.minimum(np.where(far.any(axis=1), passed, 0), ends.periods[rows])
    return time
