"""The attractors of a system: found from a window of initial states, certified, counted, and joined with the known orbits."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.attractor import REST, UNDECIDED, Attractor, Attractors
from saltus.attractors.kind import AttractorKind
from saltus.attractors.registry import NoLabel, Registry
from saltus.attractors.stroboscopic_section import with_clock
from saltus.checks import check_count, check_number, check_reached, check_starts, check_states
from saltus.errors import ParameterError
from saltus.flow import RECURRENCE, find_recurrence
from saltus.orbits import Branch, PeriodicOrbit, before_impacts, initial_states
from saltus.progress import Progress, part_of, silent
from saltus.public_functions import checked_by
from saltus.systems import System
from saltus.window import Box, check_window


@dataclass(frozen=True)
class FindAttractorsSettings:
    """How long motions are followed before their attractors are determined."""

    first: int = 400  # All motions are followed for this many forcing periods.
    second: int = 4000  # Those that have not settled by then are followed for this many more.
    kept: int = 256  # Number of last stroboscopic states of a motion that are compared with attractors that do not repeat.
    verdicts: int = 8  # The largest number of unsettled motions that are classified, as each takes seconds.


SETTINGS = FindAttractorsSettings()


def _check(
    system: System, window: Any, starts: int, max_period: int, seed: int, known: Any, also: Any, tol: float, progress: object
) -> None:
    with_clock(system)
    further = check_states("also", also, system.dimension)
    for place, coordinate in enumerate(system.model.coordinates):
        check_reached(system.model, coordinate, further[:, place], "also")
    check_starts(starts)
    check_count("max_period", max_period, 1, RECURRENCE.compiled_max_period)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_window(window, system)
    check_count("seed", seed, 0)
    _known(system, known)


@checked_by(_check)
def find_attractors(
    system: System,
    *,
    window: Box | None = None,
    starts: int = 256,
    max_period: int = 16,
    seed: int = 0,
    known: Iterable[PeriodicOrbit | Branch] | PeriodicOrbit | Branch = (),
    also: Any = (),
    tol: float = 1e-11,
    progress: Progress = silent,
) -> Attractors:
    """The attractors on which motions from a window of initial states at phase 0 end, each certified, with its share of the
    motions.

    Rest is certified by proof (`capture_speed`, or no load that ever pulls); a periodic orbit by its own equations, solved to
    rounding, with multipliers inside the unit circle; a set on which motions never settle by the verdict of `classify`, if areas
    of states shrink. Other motions are undecided; they are counted, with the reasons. In a symmetric system the mirror image of
    an attractor is another attractor, unless it is the same set, and is added even if no start leads to it. Under a constant
    load the equilibria are found, as orbits of period 1.

    Parameters
    ----------
    system
        What moves, under a load with a frequency or a constant one.
    window
        Bounds of the states, ((least, largest coordinate), (least, largest velocity)), covered evenly by initial states; with
        several coordinates a pair for each of them, then for each velocity. By default half widths are 1.5 around the contact,
        or around 0 without one. With several contacts the starts take turns as to which contacts are closed.
    starts
        The number of initial states.
    max_period
        The longest period of an orbit, at most 16.
    seed
        The seed by which the grid of initial states is shifted.
    known
        Orbits, or branches with orbits at the system's parameter, of which the stable ones count as attractors too.
    also
        Further initial states (n, d), coordinates and velocities, which do not count in the shares. A state at a contact that
        moves into it is taken just before the impact.
    tol
        The error of a step, as for `simulate_many`.
    progress
        Called with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        A load that never repeats, known orbits of another system, numbers without meaning.

    Examples
    --------
    >>> found = saltus.find_attractors(system, starts=16)
    >>> [attractor.period for attractor in found]
    [1]
    """
    clock, further, area = with_clock(system), check_states("also", also, system.dimension), check_window(window, system)
    progress(0.0, "motions")
    states, registry = initial_states(clock, starts, area, seed), Registry(clock)
    for orbit in _known(system, known):
        registry.add_orbit(orbit)
    begun = np.concatenate([states, before_impacts(clock, further)])
    labels = _assigned(registry, begun, max_period, tol, progress)
    registry.add_images()
    final = final_labels(registry.members)
    counts = np.bincount(labels[:starts][labels[:starts] >= 0], minlength=len(registry.members))
    ends = np.array([final.get(int(label), UNDECIDED) for label in labels], dtype=int)
    members = [member.labelled(final, starts=int(counts[member.label]), of=starts) for member in registry.members]
    members.sort(key=lambda member: member.label)
    progress(1.0, "attractors")
    return Attractors(system, tuple(members), states, ends[:starts], ends[starts:], area, seed, tol, tuple(registry.reasons))


def _assigned(registry: Registry, states: np.ndarray, max_period: int, tol: float, progress: Progress) -> np.ndarray:
    """The label in the registry of the attractor on which each motion ends; below 0 where that is undecided."""
    options: dict[str, Any] = {"max_period": max_period, "kept": SETTINGS.kept, "tol": tol}
    ends = find_recurrence(registry.system, states, SETTINGS.first, **options, progress=part_of(progress, 0.0, 0.3))
    labels = registry.assign(ends)
    left = np.flatnonzero(labels == NoLabel.OPEN)
    if not left.size:
        return labels
    begin = ends.states[left, -1]
    ends = find_recurrence(registry.system, begin, SETTINGS.second, **options, progress=part_of(progress, 0.3, 0.7))
    later = registry.assign(ends)
    registry.assign_unsettled(ends, later)
    for turn in range(SETTINGS.verdicts):
        waiting = np.flatnonzero(later == NoLabel.OPEN)
        if not waiting.size:
            break
        later[waiting[0]] = registry.judge(ends.states[waiting[0], -1], max_period)
        registry.assign_unsettled(ends, later)
        progress(0.7 + 0.3 * turn / SETTINGS.verdicts, "verdicts")
    if (later == NoLabel.OPEN).any():
        periods = SETTINGS.first + SETTINGS.second
        registry.reasons.append(f"{int((later == NoLabel.OPEN).sum())} motions do not settle in {periods} forcing periods")
    labels[left] = np.where(later == NoLabel.OPEN, NoLabel.FAILED, later)
    return labels


def final_labels(members: list[Attractor]) -> dict[int, int]:
    """The final labels by the labels of a registry, in an order that does not depend on the search: rest, then orbits by period,
    amplitude and sign, then others.

    With several contacts there may be more than one state of rest; 0 is the one with the least coordinates.
    """

    def rank(member: Attractor) -> tuple[float, ...]:
        if member.kind is AttractorKind.REST:
            return -1.0, *map(float, member.states[0])
        if member.orbit is None:
            return 1.0, 0.0, round(member.amplitude, 2), -round(float(member.states[:, 0].mean()), 2)
        return 0.0, float(member.period), round(member.amplitude, 6), -round(member.highest, 6)

    ordered = sorted(members, key=rank)
    first = REST if ordered and ordered[0].kind is AttractorKind.REST else REST + 1
    return {member.label: i for i, member in enumerate(ordered, first)}


def _known(system: System, known: Any) -> list[PeriodicOrbit]:
    """The stable orbits among those that are known, and among those of known branches at the system's parameter."""
    orbits: list[PeriodicOrbit] = []
    for item in [known] if isinstance(known, (PeriodicOrbit, Branch)) else known:
        if isinstance(item, Branch):
            orbits += item.at(float(system.get(item.path)))
        elif isinstance(item, PeriodicOrbit):
            orbits.append(item)
        else:
            raise ParameterError(f"known must be periodic orbits or branches, got {item!r}", "known")
    for orbit in orbits:
        theirs = orbit.system.parameters
        unlike = [
            p for p, x in system.parameters.items() if not math.isclose(theirs.get(p, math.nan), x, rel_tol=1e-9, abs_tol=1e-12)
        ]
        if unlike or type(orbit.system.model) is not type(system.model):
            raise ParameterError(
                f"a known orbit belongs to another system; it differs in {', '.join(unlike) or 'its model'}", "known"
            )
    return [orbit for orbit in orbits if orbit.stable]
