"""Orbits, mostly repelling ones, from near returns: motions in a transient or in chaos come back near to an earlier state.

The states of the nearest returns are improved by Newton's method on the stroboscopic section, all of them at once in lanes.
Those that converge are solved for as orbits with their impacts, each orbit once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import MotionError
from saltus.flow import RECURRENCE, last_states, motions_from
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.finding.from_motion import orbit_from
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import Signature
from saltus.orbits.verify import same_orbit
from saltus.systems import System, arguments_of, held_by_contacts, on_this_side, states_beside


@dataclass(frozen=True)
class NearReturnSettings:
    """Which states may lead to orbits, and how they are improved."""

    near: float = 0.15  # Newton's method is tried from returns nearer than this.
    guesses: int = 12  # The largest number of such returns for each period at each value; the nearest ones are taken.
    apart: float = 0.05  # The least distance between two of these returns.
    iterations: int = 8  # Steps of Newton's method on the section.
    longest: float = 0.3  # The longest of these steps: beyond it the map is far from linear.
    converged: float = 1e-7  # Distance of a state from its image below which it is taken to be on an orbit.
    same_state: float = 1e-5  # States at one value are on the same orbit if they are this near.
    still: float = 1e-6  # An orbit no larger than this is rest.
    # An orbit with a multiplier this near to 1 belongs to a continuum of orbits at one value of the parameter, such as those of a
    # mass that no wall and no spring holds, and has no branch. Near a fold a multiplier is as near to 1 only within 1e-14 of the
    # fold's parameter.
    isolated: float = 1e-7
    tol: float = 1e-11  # The error of a step.
    # With contacts or frictions and more state variables than this, derivatives are computed motion by motion, by the code that
    # branches need as well. The code for lanes would take longer to compile (minutes for four cells).
    in_lanes: int = 4


SETTINGS = NearReturnSettings()


def orbits_near_returns(
    system: System, path: str, values: np.ndarray, states: np.ndarray, known: list[np.ndarray], max_period: int
) -> list[PeriodicOrbit]:
    """Orbits of up to `max_period` forcing periods near which motions nearly return; orbits of a continuum are left out.

    Parameters
    ----------
    system, path
        What moves, and the parameter that is varied.
    values
        Its values, (n,).
    states
        Successive stroboscopic states of motions at each value, (n, motions, kept, d); nan where there are fewer.
    known
        For each value the states (k, d) at phase 0 of orbits that are known there, which are not returned again.
    """
    found: list[tuple[int, PeriodicOrbit]] = []
    known = [other.reshape(-1, system.dimension) for other in known]
    for period in range(1, min(max_period, states.shape[2] - 1) + 1):
        guesses = [_guesses(at_value, period) for at_value in states]
        rows = np.repeat(np.arange(len(values)), [len(at_value) for at_value in guesses])
        improved, good = _improved(system, path, values[rows], np.concatenate(guesses), period)
        for row, state in zip(rows[good].tolist(), improved[good], strict=True):
            if len(known[row]) and np.abs(known[row] - state).max(axis=1).min() < SETTINGS.same_state:
                continue
            known[row] = np.concatenate([known[row], state[None]])
            orbit = solved_near(system.with_({path: float(values[row])}), path, state, period)
            if orbit is not None and _is_isolated(orbit) and not any(same_orbit(orbit, o) for place, o in found if place == row):
                found.append((row, orbit))
    return [orbit for _, orbit in found]


def solved_near(system: System, path: str, state: np.ndarray, period: int) -> PeriodicOrbit | None:
    """The orbit of a system near a state at phase 0 that nearly repeats itself, to be followed along a parameter; or None."""
    try:
        start = arguments_of(system, on_this_side(system, state.copy()))
        orbit = orbit_from(equations_of(system, Signature((), 1), (path,)), start, period)
    except MotionError:
        return None
    return orbit if orbit is not None and orbit.admissible and orbit.amplitude > SETTINGS.still else None


def _is_isolated(orbit: PeriodicOrbit) -> bool:
    """Whether an orbit is isolated from other orbits at its value of the parameter."""
    return bool((np.abs(orbit.multipliers - 1.0) > SETTINGS.isolated).all())


def _guesses(states: np.ndarray, period: int) -> np.ndarray:
    """The states (k, d) at which motions (n, kept, d) nearly return after `period`, without repeating themselves; nearest
    first."""
    distance = np.abs(states[:, period:] - states[:, :-period]).max(axis=2).ravel()
    begin = states[:, :-period].reshape(-1, states.shape[-1])
    chosen = begin[:0]
    for i in np.flatnonzero(distance < SETTINGS.near)[np.argsort(distance[distance < SETTINGS.near])]:
        if len(chosen) >= SETTINGS.guesses:
            break
        again = len(chosen) and np.abs(begin[i] - chosen).max(axis=1).min() < SETTINGS.apart
        if distance[i] > RECURRENCE.near_return and not again:
            chosen = np.concatenate([chosen, begin[i : i + 1]])
    return chosen


def _improved(system: System, path: str, values: np.ndarray, states: np.ndarray, period: int) -> tuple[np.ndarray, np.ndarray]:
    """The states (n, d) after Newton's method for x = Phi(x), and the numbers of those that have converged."""
    states, active, good = states.copy(), np.arange(len(states)), np.zeros(len(states), dtype=bool)
    for _ in range(SETTINGS.iterations):
        if not active.size:
            break
        ends, slope = _mapped(system, path, values[active], states[active], period)
        apart = ends - states[active]
        sound = np.isfinite(slope).all(axis=(1, 2)) & np.isfinite(apart).all(axis=1)
        good[active] = sound & (np.abs(apart).max(axis=1) < SETTINGS.converged)
        going = sound & ~good[active]
        active, apart, slope = active[going], apart[going], slope[going]
        steps = [np.linalg.lstsq(np.eye(len(a)) - d, a, rcond=None)[0] for d, a in zip(slope, apart, strict=True)]
        step = np.array(steps).reshape(-1, states.shape[1])
        step = step / np.maximum(1.0, np.abs(step).max(axis=1, initial=0.0) / SETTINGS.longest)[:, None]
        states[active] = states_beside(system, states[active], step)
    return states, np.flatnonzero(good)


def _mapped(system: System, path: str, values: np.ndarray, states: np.ndarray, period: int) -> tuple[np.ndarray, np.ndarray]:
    """The states (n, d) `period` forcing periods later, and their derivatives to the states at the start, (n, d, d).

    A contact that is closed at the start stays closed: derivatives to its coordinate and velocity are 0.
    """
    if system.model.holds_coordinates and system.dimension > SETTINGS.in_lanes:
        return _mapped_singly(system, path, values, states, period)
    options: dict[str, Any] = {"periods": period, "sample": (), "tol": SETTINGS.tol, "sensitivities": ()}
    result = motions_from(system, states, parameters={path: values}, **options)
    return last_states(system, result), np.where(held_by_contacts(system, states)[:, None], 0.0, result["derivative"].values)


def _mapped_singly(
    system: System, path: str, values: np.ndarray, states: np.ndarray, period: int
) -> tuple[np.ndarray, np.ndarray]:
    """As `_mapped`, one motion after the other; nan where a motion cannot be followed or has no derivatives."""
    equations = equations_of(system, Signature((), period, section=0.0), (path,), SETTINGS.tol)
    held = held_by_contacts(system, states)
    ends, slopes = np.full(states.shape, np.nan), np.full((*states.shape, states.shape[1]), np.nan)
    for i, (value, state) in enumerate(zip(values, states, strict=True)):
        evaluation = equations.evaluate(state, np.array([value]))
        if evaluation is not None:
            ends[i], slopes[i] = state + evaluation.residual, np.where(held[i], 0.0, evaluation.here[0])
    return ends, slopes
