"""The attractors of a system: found from a window of initial states, certified, counted, and joined
with the known orbits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from saltus.attractors.attractor import (
    LAST_STATES,
    REST,
    SAME_STATE,
    UNDECIDED,
    Attractor,
    Attractors,
    Target,
)
from saltus.attractors.classification import classify
from saltus.attractors.judgement import Reason, reason_cycle, reason_unforced
from saltus.attractors.stroboscopic_section import (
    certify_cycle,
    cycle_states,
    section_of,
    section_states,
    solved_orbit,
    stays_at_rest,
    with_clock,
)
from saltus.checks import check_count, check_number, check_starts, check_states, checked_by
from saltus.errors import ParameterError
from saltus.flow import (
    RECURRENCE,
    Ending,
    Recurrence,
    check_device,
    driven_range,
    extrema_names,
    find_recurrence,
    motions_from,
    on_device,
    relays_in_turns,
    simulate,
    stroboscopic,
)
from saltus.orbits import Branch, PeriodicOrbit, is_symmetric
from saltus.progress import Progress, part_of, silent
from saltus.systems import (
    Box,
    System,
    arguments_of,
    before_impacts,
    check_reached,
    check_window,
    driven_displacements,
    image_of,
    initial_states,
    middle_of,
    natural_units,
    rest_state,
    size_with_sides,
    state_with_sides,
    units_with_sides,
)


@dataclass(frozen=True)
class AttractorSearchSettings:
    """How long motions are followed before their attractors are determined, and how they are
    assigned to these.
    """

    first: int = 400  # All motions are followed for this many forcing periods.
    # Those that have not settled by then are followed for this many more, and so may be those to be
    # judged.
    second: int = 4000
    # Number of last stroboscopic states of a motion that are compared with attractors that do not
    # repeat.
    kept: int = 256
    # The largest number of unsettled motions that are classified, as each takes seconds.
    verdicts: int = 8
    sample: int = 2048  # Number of stroboscopic states that represent a set that does not repeat.
    # If the sum of the exponents is above minus this, areas of the state plane do not shrink, and
    # the set attracts nothing.
    lossless: float = 1e-6  # in natural units
    # The largest distance, in units of SAME_STATE, between an orbit and the states of the motions
    # that settle on it.
    beside: float = 100.0


SETTINGS = AttractorSearchSettings()
WAITING = UNDECIDED - 1  # the label of motions that may still be assigned to an attractor


@dataclass
class KnownAttractors:
    """The attractors of a system with a forcing period; the label of each is its place in the
    list.
    """

    system: System
    members: list[Attractor] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)  # why motions are undecided

    @property
    def _units(self) -> np.ndarray:
        return units_with_sides(self.system)

    def _cycle(self, states: np.ndarray) -> Target:
        return Target(0, Ending.PERIODIC, states, self._units)

    def _near(self, states: np.ndarray) -> float:
        """The distance in natural units below which two of these states are one."""
        return float(SAME_STATE * np.max(self._cycle(np.atleast_2d(states)).size(states)))

    def assign(self, ends: Recurrence) -> np.ndarray:
        """The label of the attractor on which each motion ends, or WAITING or UNDECIDED, (n,)."""
        labels = np.full(len(ends), WAITING)
        for row in np.flatnonzero(ends.rest):
            labels[row] = self.add_rest(rest_state(self.system, ends.last[row]))
        if ends.ended.any():
            labels[ends.ended] = UNDECIDED
            self.reasons.append(
                f"{int(ends.ended.sum())} motions are ended by a margin of the model or cannot "
                "go on"
            )
        for period in np.unique(ends.period[ends.periodic]):
            rows = np.flatnonzero(ends.period == period)
            while rows.size:
                states = ends.states[rows[0], -period:]
                cycle = self._cycle(states)
                here = cycle.distance(ends.states[rows, -1]) < self._near(states)
                here[0] = True
                labels[rows[here]] = self._settled(states)
                rows = rows[~here]
        return labels

    def _settled(self, states: np.ndarray) -> int:
        """The label of the orbit on whose states motions have settled; UNDECIDED where its
        equations have no stable solution.
        """
        known = self.label_of(states)
        if known is not None:
            return known
        if len(states) == 1 and stays_at_rest(self.system, states[-1]):
            return self.add_rest(states[-1])
        where = f"at {_shown(states[-1])}"
        cycle = reason_cycle(self.system, states[-1])
        if cycle is not None:
            return self.on_cycle(states[-1], cycle)
        orbit = solved_orbit(self.system, states[-1], len(states))
        far = SETTINGS.beside * self._near(states)
        if orbit is None or self._cycle(states).distance(section_of(orbit)) > far:
            return self._fail(
                f"motions repeat themselves every {len(states)} periods {where}, but no orbit "
                "solves its equations there"
            )
        if not orbit.stable:
            largest = np.abs(orbit.multipliers).max()
            return self._fail(
                f"motions stay on an orbit of period {orbit.period} {where} with a multiplier of "
                f"modulus {largest:.6g}"
            )
        return self.add_orbit(orbit, states[-orbit.period :])

    def _fail(self, reason: str) -> int:
        self.reasons.append(reason)
        return UNDECIDED

    def add_rest(self, state: np.ndarray) -> int:
        """The label of rest in a state (d,)."""
        for member in self.members:
            near = member.target.distance(state) < self._near(state)
            if member.kind is Ending.REST and near:
                return member.label
        evidence = (
            "proved: captured at the contact for all later loads, or at rest where no "
            "load ever pulls"
        )
        model = self.system.model
        weights = np.array([model.weights_of(name) for name in driven_displacements(self.system)])
        places = weights @ state[: len(model.coordinates)]
        held = float(places.min()), float(places.max())
        # contacts may hold it to a wall that moves
        if self.system.in_gap_coordinates is not self.system:
            held = self._range_from(arguments_of(self.system, state), periods=1)
        return self._add(Ending.REST, state[None], held, evidence)

    def _range_from(self, start: dict[str, Any], periods: int) -> tuple[float, float]:
        """The least and the largest value of the displacement that the load drives, over so many
        forcing periods."""
        motion = simulate(self.system, **start, periods=periods, tol=1e-10)
        return driven_range(motion)

    def add_orbit(self, orbit: PeriodicOrbit, states: np.ndarray | None = None) -> int:
        """The label of a stable orbit."""
        if orbit.system.load.period is None:
            return self.add_cycle(orbit)
        if states is None:
            states = section_states(self.system, section_of(orbit)[None], orbit.period)[0]
        known = self.label_of(states)
        if known is not None:
            return known
        largest = np.abs(orbit.multipliers).max()
        evidence = (
            f"orbit of period {orbit.period}: residual {orbit.residual:.1g}, largest "
            f"multiplier {largest:.6g}"
        )
        return self._add(Ending.PERIODIC, states, (orbit.lowest, orbit.highest), evidence, orbit)

    def on_cycle(self, state: np.ndarray, otherwise: Reason) -> int:
        """The label of the cycle on which a motion from a state (d,) settles; UNDECIDED where it
        settles on none that attracts, for the reason `otherwise`.
        """
        found = certify_cycle(self.system, state)
        if found.orbit is None or not found.sound:
            return self._fail(f"at {_shown(state)}: {otherwise.sentence}")
        return self.add_cycle(found.orbit)

    def add_cycle(self, orbit: PeriodicOrbit) -> int:
        """The label of a stable cycle without a load."""
        states = cycle_states(orbit)
        for member in self.members:
            if member.target.curve and np.median(member.target.distance(states)) < (
                member.target.grain
            ):
                return member.label
        largest = np.abs(orbit.multipliers).max(initial=0.0)
        evidence = (
            f"cycle of period {orbit.period:.9g}: residual {orbit.residual:.1g}, largest "
            f"multiplier {largest:.6g}"
        )
        extrema = (orbit.lowest, orbit.highest)
        return self._add(Ending.PERIODIC, states, extrema, evidence, orbit, curve=True)

    def _add(
        self,
        kind: Ending,
        states: np.ndarray,
        extrema: tuple[float, float],
        evidence: str,
        orbit: PeriodicOrbit | None = None,
        curve: bool = False,
    ) -> int:
        low, high = extrema
        target = Target(len(self.members), kind, states, self._units, curve)
        self.members.append(
            Attractor(target, high, low, orbit, starts=0, of=0, mirror=UNDECIDED, evidence=evidence)
        )
        return target.label

    def label_of(self, states: np.ndarray) -> int | None:
        """The label of the orbit, or of rest, with these states at phase 0; None if it is not
        known.
        """
        for member in self.members:
            if (
                not member.target.dense
                and (member.target.distance(states) < self._near(states)).all()
            ):
                return member.label
        return None

    def assign_unsettled(self, ends: Recurrence, labels: np.ndarray) -> None:
        """Label the unsettled motions that move on a known sampled attractor, or within SAME_STATE
        of a known orbit.
        """
        for i in np.flatnonzero(labels == WAITING):
            last = ends.states[i, -LAST_STATES:]
            for target in (member.target for member in self.members):
                apart = target.distance(last)
                if (
                    np.median(apart) < target.grain
                    if target.dense
                    else apart[-len(target.states) :].max() < self._near(last[-1:])
                ):
                    labels[i] = target.label
                    break

    def judge(self, state: np.ndarray, max_period: int) -> int:
        """Classify a motion that does not settle, from a state (d,): the label of its attractor, or
        UNDECIDED if it has none.
        """
        start = arguments_of(self.system, state)
        longest = max(max_period, 16)
        verdict = classify(self.system, **start, periods=SETTINGS.second, max_period=longest)
        if verdict.kind is Ending.REST:
            end = state_with_sides(self.system, verdict.state)
            return self.add_rest(rest_state(self.system, end))
        if verdict.orbit is not None and verdict.kind is Ending.PERIODIC:
            return self.add_orbit(verdict.orbit)
        where = f"from {_shown(state)}"
        if verdict.kind is Ending.UNDECIDED or verdict.exponents is None:
            return self._fail(f"{where}: {verdict.reason}")
        lossless = SETTINGS.lossless / natural_units(self.system).time
        if float(verdict.exponents.values.sum()) > -lossless:
            return self._fail(
                f"{where}: {verdict.kind}, but areas do not shrink, so nothing attracts"
            )
        # lanes record the extrema of other coordinates
        several = len(self.system.model.coordinates) > 1
        several = several or self.system.in_gap_coordinates is not self.system
        sampled = ("state",) if several else ("state", "extrema")
        sample = motions_from(
            self.system, state[None], periods=SETTINGS.sample, sample=sampled, last="all", tol=1e-10
        )
        if several:
            low, high = self._range_from(start, SETTINGS.sample)
        else:
            high, low = (
                float(sample[f"overall_{name}"].values[0])
                for name in extrema_names(self.system.model.coordinates)
            )
        return self._add(
            verdict.kind, stroboscopic(self.system, sample)[0], (low, high), verdict.reason
        )

    def add_images(self) -> None:
        """Add the mirror image of every attractor of a system with that symmetry: it is an
        attractor as well.
        """
        # symmetries of distances, of relays and of resets are not looked for
        model = self.system.model
        others = model.has_multipliers or model.relays or model.resets
        if others or not is_symmetric(self.system):
            return
        for label in range(len(self.members)):
            image = (
                self._image(self.members[label])
                if self.members[label].mirror == UNDECIDED
                else None
            )
            if image is not None:
                for one, other in ((label, image), (image, label)):
                    self.members[one] = replace(self.members[one], mirror=other)

    def _image(self, member: Attractor) -> int | None:
        """The label of the mirror image of an attractor."""
        if member.target.curve:
            image = image_of(self.system, member.states[:1])[0]
            found = certify_cycle(self.system, image)
            return self.add_cycle(found.orbit) if found.orbit is not None and found.sound else None
        states = image_of(self.system, section_states(self.system, member.states, 0.5)[:, 0])
        if member.target.dense:
            for other in (known.target for known in self.members if known.target.dense):
                if np.median(other.distance(states)) < other.grain:
                    return other.label
            middle = middle_of(self.system)
            if len(self.system.model.coordinates) > 1 or middle is None:
                start = arguments_of(self.system, states[-1])
                extrema = self._range_from(start, SETTINGS.sample)
            else:
                extrema = (2.0 * middle - member.highest, 2.0 * middle - member.lowest)
            evidence = f"mirror image of a {member.kind} one: {member.evidence}"
            return self._add(member.kind, states, extrema, evidence)
        known_label = self.label_of(states)
        if known_label is not None:
            return known_label
        orbit = solved_orbit(self.system, states[-1], len(states))
        return self.add_orbit(orbit) if orbit is not None and orbit.stable else None


def _shown(state: np.ndarray) -> str:
    return f"({', '.join(f'{value:.6g}' for value in state)})"


def _further(system: System, also: Any) -> np.ndarray:
    """The further states (n, d), with the sides of relays behind them."""
    size = size_with_sides(system)
    if size > system.dimension and np.shape(also)[-1:] == (size,):
        states = check_states("also", also, size)
        sides = states[:, system.dimension :]
        wrong = sides[~np.isin(sides, (-1.0, 1.0))]
        if wrong.size:
            names = ", ".join(relay.name for relay in system.model.relays)
            raise ParameterError(
                f"also must have the sides of relays ({names}) behind its coordinates and"
                f" velocities, each 1 or -1, got {wrong[0]:g}",
                "also",
            )
        return states
    return relays_in_turns(system, check_states("also", also, system.dimension))


def _check(
    system: System,
    window: Any,
    starts: int,
    max_period: int,
    seed: int,
    known: Any,
    also: Any,
    tol: float,
    device: Any,
    progress: object,
) -> None:
    check_device(device, system)
    with_clock(system)
    further = _further(system, also)
    for place, coordinate in enumerate(system.model.coordinates):
        check_reached(system.model, coordinate, further[:, place], "also")
    check_starts(starts)
    check_count("max_period", max_period, 1, RECURRENCE.compiled_max_period)
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_window(window, system)
    check_count("seed", seed, 0)
    _known(system, known)


@checked_by(_check)
@on_device
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
    device: str = "cpu",
    progress: Progress = silent,
) -> Attractors:
    """The attractors on which motions from a window of initial states at phase 0 end, each
    certified, with its share of the motions.

    Rest is certified by proof (`capture_speed`, or no load that ever pulls); a periodic orbit by
    its own equations, solved to rounding, with multipliers inside the unit circle; a set on which
    motions never settle by the verdict of `classify`, if areas of states shrink. Other motions are
    undecided; they are counted, with the reasons. In a symmetric system the mirror image of an
    attractor is another attractor, unless it is the same set, and is added even if no start leads
    to it. Under a constant load the equilibria are found, as orbits of period 1.

    Parameters
    ----------
    system
        What moves, under a load with a frequency or a constant one.
    window
        Bounds of the states, ((least, largest coordinate), (least, largest velocity)), covered
        evenly by initial states; with several coordinates a pair for each of them, then for each
        velocity. By default half widths are 1.5 natural units around the contact, or around 0
        without one; of angles 1.5 rad, and 1.5 of their rates. With several contacts the starts take turns as to which contacts are closed, and with relays
        as to which of these are on.
    starts
        The number of initial states.
    max_period
        The longest period of an orbit, at most 16.
    seed
        The seed by which the grid of initial states is shifted.
    known
        Orbits, or branches with orbits at the system's parameter, of which the stable ones count as
        attractors too.
    also
        Further initial states (n, d), coordinates and velocities, which do not count in the shares.
        A state at a contact that moves into it is taken just before the impact.
    tol
        The error of a step, as for `simulate_many`.
    device
        Where the motions are followed, as for `simulate_many`.
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
    clock = with_clock(system)
    further = _further(clock, also)
    area = check_window(window, system)
    progress(0.0, "motions")
    states = relays_in_turns(clock, initial_states(clock, starts, area, seed))
    found = KnownAttractors(clock)
    for orbit in _known(system, known):
        found.add_orbit(orbit)
    begun = np.concatenate([states, before_impacts(clock, further)])
    labels = _assigned(found, begun, max_period, tol, progress)
    found.add_images()
    final = final_labels(found.members)
    counts = np.bincount(labels[:starts][labels[:starts] >= 0], minlength=len(found.members))
    ends = np.array([final.get(int(label), UNDECIDED) for label in labels], dtype=int)
    members = [
        member.labelled(final, starts=int(counts[member.label]), of=starts)
        for member in found.members
    ]
    members.sort(key=lambda member: member.label)
    progress(1.0, "attractors")
    return Attractors(
        system,
        tuple(members),
        states,
        ends[:starts],
        ends[starts:],
        area,
        seed,
        tol,
        tuple(found.reasons),
    )


def _assigned(
    found: KnownAttractors, states: np.ndarray, max_period: int, tol: float, progress: Progress
) -> np.ndarray:
    """The label among the known attractors on which each motion ends; below 0 where that is
    undecided.
    """
    options: dict[str, Any] = {"max_period": max_period, "kept": SETTINGS.kept, "tol": tol}
    ends = find_recurrence(
        found.system, states, SETTINGS.first, **options, progress=part_of(progress, 0.0, 0.3)
    )
    labels = found.assign(ends)
    left = np.flatnonzero(labels == WAITING)
    if not left.size:
        return labels
    begin = ends.states[left, -1]
    ends = find_recurrence(
        found.system, begin, SETTINGS.second, **options, progress=part_of(progress, 0.3, 0.7)
    )
    later = found.assign(ends)
    found.assign_unsettled(ends, later)
    unforced = reason_unforced(found.system)
    for _ in range(SETTINGS.verdicts):
        waiting = np.flatnonzero(later == WAITING)
        if unforced is None or not waiting.size:
            break
        later[waiting[0]] = found.on_cycle(ends.states[waiting[0], -1], unforced)
        found.assign_unsettled(ends, later)
    if unforced is not None and (later == WAITING).any():
        number = int((later == WAITING).sum())
        found.reasons.append(f"of {number} motions: {unforced.sentence}")
        later[later == WAITING] = UNDECIDED
    for turn in range(SETTINGS.verdicts):
        waiting = np.flatnonzero(later == WAITING)
        if not waiting.size:
            break
        later[waiting[0]] = found.judge(ends.states[waiting[0], -1], max_period)
        found.assign_unsettled(ends, later)
        progress(0.7 + 0.3 * turn / SETTINGS.verdicts, "verdicts")
    if (later == WAITING).any():
        periods = SETTINGS.first + SETTINGS.second
        found.reasons.append(
            f"{int((later == WAITING).sum())} motions do not settle in {periods} forcing periods"
        )
    labels[left] = np.where(later == WAITING, UNDECIDED, later)
    return labels


def final_labels(members: list[Attractor]) -> dict[int, int]:
    """The final labels by the labels of the known ones, in an order that does not depend on the
    search: rest, then orbits by period, amplitude and sign, then others.

    With several contacts there may be more than one state of rest; 0 is the one with the least
    coordinates.
    """

    def rank(member: Attractor) -> tuple[float, ...]:
        if member.kind is Ending.REST:
            return -1.0, *map(float, member.states[0])
        if member.orbit is None:
            return (
                1.0,
                0.0,
                round(member.amplitude, 2),
                -round(float(member.states[:, 0].mean()), 2),
            )
        return 0.0, float(member.period), round(member.amplitude, 6), -round(member.highest, 6)

    ordered = sorted(members, key=rank)
    first = REST if ordered and ordered[0].kind is Ending.REST else REST + 1
    return {member.label: i for i, member in enumerate(ordered, first)}


def _known(system: System, known: Any) -> list[PeriodicOrbit]:
    """The stable orbits among those that are known, and among those of known branches at the
    system's parameter.
    """
    orbits: list[PeriodicOrbit] = []
    for item in [known] if isinstance(known, (PeriodicOrbit, Branch)) else known:
        if isinstance(item, Branch):
            orbits += item.at(float(system.get(item.path)))
        elif isinstance(item, PeriodicOrbit):
            orbits.append(item)
        else:
            raise ParameterError(
                f"known must be periodic orbits or branches, got {item!r}", "known"
            )
    for orbit in orbits:
        theirs = orbit.system.parameters
        unlike = [
            p
            for p, x in system.parameters.items()
            if not math.isclose(theirs.get(p, math.nan), x, rel_tol=1e-9, abs_tol=1e-12)
        ]
        if unlike or type(orbit.system.model) is not type(system.model):
            raise ParameterError(
                "a known orbit belongs to another system; it differs in "
                f"{', '.join(unlike) or 'its model'}",
                "known",
            )
    return [orbit for orbit in orbits if orbit.stable]
