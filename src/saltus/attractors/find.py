"""The attractors of a system: found from a window of initial states, certified, counted, and joined with the known orbits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from saltus.attractors.attractor import REST, UNDECIDED, Attractors
from saltus.attractors.registry import FAILED, OPEN, Collection
from saltus.attractors.stroboscopic_section import with_clock
from saltus.checks import Rectangle, check_count, check_number, check_states, check_window, checked_by
from saltus.errors import ParameterError
from saltus.flow import find_recurrence
from saltus.orbits import Branch, PeriodicOrbit, initial_states
from saltus.systems import System

FIRST, SECOND = 400, 4000  # forcing periods in which motions may settle; those that have not then get the second
KEPT = 256  # strobes of them that are kept
MOST_VERDICTS = 8  # of motions that never settle: each takes seconds


def _check(
    system: System, window: Any, starts: int, max_period: int, seed: int, known: Any, also: Any, tol: float, progress: object
) -> None:
    with_clock(system)
    check_states("also", also)
    check_count("starts", starts, 1)
    check_count("max_period", max_period, 1, 16)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_window(window, system)
    check_count("seed", seed, 0)
    _known(system, known)


@checked_by(_check)
def find_attractors(
    system: System,
    *,
    window: Rectangle | None = None,
    starts: int = 256,
    max_period: int = 16,
    seed: int = 0,
    known: Iterable[PeriodicOrbit | Branch] | PeriodicOrbit | Branch = (),
    also: Any = (),
    tol: float = 1e-11,
    progress: Callable[[float], object] | None = None,
) -> Attractors:
    """The attractors on which motions from a window of initial states at phase 0 end, each certified, with its share of them.

    Rest is one by proof (`capture_speed`, or no load that ever pulls); a cycle, by its own equations, solved to rounding, with
    multipliers inside the unit circle; what never settles, by the verdict of `classify`, if areas shrink. What none bears out is
    undecided, and counted, with reasons. The mirror image of an attractor of a symmetric system is another one, unless it is its
    own, and is added even where no start leads to it. Under a constant load the equilibria are found, as cycles of period 1.

    Args:
        system: what moves: any model of one coordinate, under a load with a frequency or a constant one.
        window: of the state plane, ((least, largest coordinate), (least, largest velocity)), covered evenly by initial states; by
            default that of half widths 1.5 around the contact, or around 0 without one.
        starts: how many.
        max_period: the longest period of a cycle, at most 16.
        seed: shifts the states.
        known: stable orbits, or branches of which those at the system's parameter are taken, that count as attractors too.
        also: further initial states (n, 2), which do not count in the shares.
        tol: the error of a step, as for `simulate_many`.
        progress: called with the fraction done, first when all arguments have been checked.

    Raises:
        ParameterError: several coordinates, a load that never repeats, known orbits of another system, numbers without meaning.
    """
    clock, further = with_clock(system), check_states("also", also)
    area = check_window(window, system)
    given = _known(system, known)
    say = progress or (lambda _: None)
    say(0.0)
    states = initial_states(clock, starts, area, seed)
    collection = Collection(clock)
    for orbit in given:
        collection.add_orbit(orbit)
    places = _places(collection, np.concatenate([states, further]), max_period, tol, say)
    collection.add_images()
    label_of = order(collection)
    counts = np.bincount(places[:starts][places[:starts] >= 0], minlength=len(collection.targets))
    ends = np.array([label_of.get(int(place), UNDECIDED) for place in places], dtype=int)
    members = collection.members(label_of, counts, starts)
    say(1.0)
    return Attractors(system, members, states, ends[:starts], ends[starts:], area, seed, tol, tuple(collection.reasons))


def _places(
    collection: Collection, states: np.ndarray, max_period: int, tol: float, say: Callable[[float], object]
) -> np.ndarray:
    """The place in the collection of the attractor on which each motion ends; below 0 where that is undecided."""
    options: dict[str, Any] = {"max_period": max_period, "kept": KEPT, "tol": tol}
    ends = find_recurrence(collection.system, states, FIRST, **options, progress=lambda done, _: say(0.3 * done))
    places = collection.take(ends)
    left = np.flatnonzero(places == OPEN)
    if not left.size:
        return places
    last = ends.states[left, -1]
    ends = find_recurrence(collection.system, last, SECOND, **options, progress=lambda done, _: say(0.3 + 0.4 * done))
    later = collection.take(ends)
    collection.belonging(ends, later)
    for turn in range(MOST_VERDICTS):
        waiting = np.flatnonzero(later == OPEN)
        if not waiting.size:
            break
        later[waiting[0]] = collection.judge(ends, int(waiting[0]), max_period)
        collection.belonging(ends, later)
        say(0.7 + 0.3 * turn / MOST_VERDICTS)
    if (later == OPEN).any():
        collection.reasons.append(f"{int((later == OPEN).sum())} motions do not settle in {FIRST + SECOND} forcing periods")
    places[left] = np.where(later == OPEN, FAILED, later)
    return places


def order(collection: Collection) -> dict[int, int]:
    """Labels by place, the same for the same set: rest is 0, then cycles by period, amplitude and sign, then the others."""

    def rank(place: int) -> tuple[float, ...]:
        orbit, (low, high) = collection.orbits[place], collection.ranges[place]
        if orbit is None:
            return 1.0, 0.0, round(max(high, -low), 2), -round(float(collection.targets[place].strobes[:, 0].mean()), 2)
        return 0.0, float(orbit.period), round(max(high, -low), 6), -round(high, 6)

    moving = [place for place, target in enumerate(collection.targets) if target.kind != "rest"]
    labels = {place: i + 1 for i, place in enumerate(sorted(moving, key=rank))}
    return labels | {place: REST for place, target in enumerate(collection.targets) if target.kind == "rest"}


def _known(system: System, known: Any) -> list[PeriodicOrbit]:
    """The stable ones of known orbits, and of branches where they are at the system's parameter."""
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
            raise ParameterError(f"a known orbit belongs to another system; it differs in {', '.join(unlike) or 'its model'}")
    return [orbit for orbit in orbits if orbit.stable]
