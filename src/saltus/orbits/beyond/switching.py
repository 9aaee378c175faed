"""The signatures that an orbit with several contacts may have beyond a point at which one of its
events appears or is lost.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from saltus.continuation import NEWTON, End
from saltus.flow import SegmentEnd, SegmentExtremes, SegmentPlan
from saltus.orbits.beyond.grazing import admissible_direction, ends_at_another, repeats
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.beyond.special_point import OrbitEnd, SpecialKind
from saltus.orbits.beyond.symmetry import full_point, half_point
from saltus.orbits.signature import TOLERANCES, ModeChange, Signature
from saltus.systems import System

AFTER_RELEASE = 3  # power of the time with which the gap grows after a release
# Distances along a branch at which orbits are looked for where an excursion from a closed contact
# begins: its speeds grow as the distance cubed.
BEGUN = (1e-4, 1e-3, 1e-2)
# The guard of an excursion of no duration, by how many times the shortest one that is resolved.
AT_BEGIN = 10.0
MOST_TOGETHER = 2  # the most events of several contacts that may change at one point
MOST_TOUCHES = 8  # the most contacts that are touched at once, each with an impact beyond


@dataclass(frozen=True)
class Timed:
    """An event and its phase."""

    event: ModeChange
    phase: float

    def leaving(self, closed: int) -> Timed:
        """The same event with these contacts closed after it."""
        return replace(self, event=replace(self.event, closed=closed))


@dataclass(frozen=True, eq=False)
class Switching:
    """An orbit at which an event appears or is lost."""

    point: OrbitPoint
    equations: Any  # `ContactsEquations`
    evaluation: Any
    events: tuple[Timed, ...]

    @classmethod
    def of_point(cls, point: OrbitPoint) -> Switching:
        """A point of a curve, with its equations and its events."""
        equations: Any = point.orbit.equations
        evaluation = point.solution.evaluation
        phases = equations.split(point.solution.unknowns)[1].tolist()
        return cls(
            point, equations, evaluation, tuple(map(Timed, equations.signature.events, phases))
        )

    @cached_property
    def no_force(self) -> float:
        """A reaction that is smaller, in natural units, is 0: the rounding of elastic forces."""
        return max(TOLERANCES.touch, NEWTON.converged * float(self.equations.elastic_forces))

    @cached_property
    def at_once(self) -> float:
        """Two events whose phases are nearer happen at once: an excursion that is not longer is
        lost in rounding.
        """
        lost: float = self.equations.lost_excursion(self.point)
        return max(TOLERANCES.switching, lost)

    def other_signatures(self) -> Iterator[list[Timed]]:
        """The events that the orbit may have on the other side, the likely ones first."""
        yield from self._together(False)
        yield from self._without_pull()
        yield from self._without_speed()
        yield from self._touching()
        # these may be together all along the branch, as those of cells that move alike
        yield from self._together(True)

    def _together(self, independent: bool) -> Iterator[list[Timed]]:
        """The events beyond a point at which two successive events have come together, of contacts
        that act on one another or do not."""
        events = list(self.events)
        n = len(self.events)
        symmetric = self.equations.signature.symmetric
        for i in range(n if n > 1 else 0):
            j = (i + 1) % n
            if symmetric and j == 0:
                # the second event lies in the other half: `from_next_event` makes them neighbours
                continue
            first = events[i]
            second = events[j]
            apart = second.phase - first.phase + (self.equations.closing if j == 0 else 0.0)
            if abs(apart) > self.at_once:
                continue
            one = first.event
            other = second.event
            if independent != self.equations.is_independent(one.contact, other.contact):
                continue
            if one.contact != other.contact:
                before = self._before(i)
                # the impact on the other contact opens this one
                yield _changed(events, {i: None, j: second})
                swapped = (
                    before ^ (1 << other.contact)
                    if not other.is_impact or other.closed >> other.contact & 1
                    else before
                )
                yield _changed(
                    events,
                    {
                        i: replace(second, phase=first.phase).leaving(swapped),
                        j: first.leaving(other.closed),
                    },
                )
            elif (
                one.is_impact
            ):  # it is closed for no time, or opens without speed and closes at once
                yield _changed(events, {i: first.leaving(other.closed), j: None})
            else:
                yield _changed(events, {i: None, j: None})

    def _before(self, i: int) -> int:
        """The contacts that are closed before an event."""
        event = self.events[i - 1].event
        return (
            event.image(self.equations.images)
            if i == 0 and self.equations.signature.symmetric
            else event
        ).closed

    def _without_pull(self) -> Iterator[list[Timed]]:
        """The events beyond a point at which a contact closes with no reaction or opens with no
        acceleration, or at which its reaction has vanished at the end of a segment."""
        events = list(self.events)
        seen = self.evaluation.seen
        for s in range(len(events)):
            here = events[s]
            if abs(seen[s, SegmentExtremes.PULL]) < self.no_force:
                contact = int(seen[s, SegmentExtremes.PULL + 1])
                changed = here.event.closed ^ (1 << contact)
                again = ModeChange(
                    bool(here.event.closed >> contact & 1), contact, here.event.closed
                )
                yield [
                    *events[:s],
                    here.leaving(changed),
                    replace(here, event=again),
                    *events[s + 1 :],
                ]
            if abs(seen[s, SegmentExtremes.TAIL]) < self.no_force:
                contact = int(seen[s, SegmentExtremes.TAIL + 1])
                following = events[(s + 1) % len(events)]
                phase = following.phase + (self.equations.closing if s + 1 == len(events) else 0.0)
                release = ModeChange(False, contact, here.event.closed & ~(1 << contact))
                yield [*events[: s + 1], Timed(release, phase), *events[s + 1 :]]

    def _without_speed(self) -> Iterator[list[Timed]]:
        """The events without an impact that has lost its speed."""
        for i in self.slow_impacts():
            yield _changed(list(self.events), {i: None})

    def slow_impacts(self) -> list[int]:
        """The places of impacts that have lost their speed and change no closed contact."""
        return [
            i
            for i, timed in enumerate(self.events)
            if timed.event.is_impact
            and abs(self.evaluation.ends[i - 1, SegmentEnd.RATE])
            < TOLERANCES.touch * self.equations.natural.speed
            and timed.event.closed == self._before(i)
        ]

    def with_touch(self) -> list[Timed] | None:
        """The events with an impact at a touch of a contact that has none yet; None without one."""
        events = list(self.events)
        seen = self.evaluation.seen
        frequency = self.equations.frequency(self.point.solution.values)
        touched = np.flatnonzero(np.abs(seen[:, SegmentExtremes.GAP]) < TOLERANCES.touch)
        for s in touched.tolist():
            contact = int(seen[s, SegmentExtremes.GAP + 2])
            phase = float(seen[s, SegmentExtremes.GAP + 1]) * frequency
            is_known = any(
                timed.event.contact == contact
                and abs((timed.phase - phase + np.pi) % (2.0 * np.pi) - np.pi)
                < TOLERANCES.switching
                for timed in events
            )
            if not is_known:
                closed = int(self.equations.plan[s, SegmentPlan.ALONG])
                new = Timed(ModeChange(True, contact, closed), phase)
                at = s + 1 if events else 0
                return [*events[:at], new, *events[at:]]
        return None

    def _touching(self) -> Iterator[list[Timed]]:
        """The events with an additional impact where a gap touches 0, or with a release and an
        impact where a reaction does.
        """
        events = list(self.events)
        seen = self.evaluation.seen
        frequency = self.equations.frequency(self.point.solution.values)
        for place in (SegmentExtremes.GAP, SegmentExtremes.FORCE):
            s = int(np.argmin(seen[:, place]))
            is_force = place == SegmentExtremes.FORCE
            if abs(seen[s, place]) > (self.no_force if is_force else TOLERANCES.touch):
                continue
            contact = int(seen[s, place + 2])
            closed = int(self.equations.plan[s, SegmentPlan.ALONG])
            phase = float(seen[s, place + 1]) * frequency
            at = s + 1 if events else 0
            new = [Timed(ModeChange(True, contact, closed), phase)]
            if is_force:
                if bounces(self.equations.system, contact):
                    # the contact would bounce to rest after each closing, for which there are no
                    # equations yet
                    continue
                new = [Timed(ModeChange(False, contact, closed & ~(1 << contact)), phase), *new]
            yield [*events[:at], *new, *events[at:]]

    def equations_with(self, events: list[Timed]) -> tuple[Any, np.ndarray] | None:
        """The problem with these events and its unknowns at this orbit; None where its motion
        cannot be followed.
        """
        closed = int(self.equations.plan[0, SegmentPlan.ALONG])
        changes = tuple(timed.event for timed in events)
        period = self.equations.signature.period
        symmetric = self.equations.signature.symmetric
        signature = Signature((), period, symmetric, events=changes, closed=0 if events else closed)
        other = self.equations.with_signature(signature)
        phases = np.array([timed.phase for timed in events])
        state = self._state_after(events[0]) if events else self._state_at(0.0)
        return None if state is None else (other, other.joined(state, phases))

    def _state_after(self, first: Timed) -> np.ndarray | None:
        """The state of the orbit just after the first of the events of the other side."""
        n = 2 * self.equations.own
        for timed, end in zip(self.events, self.evaluation.ends, strict=False):
            same = (timed.event.is_impact, timed.event.contact) == (
                first.event.is_impact,
                first.event.contact,
            )
            if same and abs(timed.phase - first.phase) <= self.at_once:
                return np.asarray(end[SegmentEnd.NUMBERS : SegmentEnd.NUMBERS + n])
        return self._state_at(first.phase)

    def _state_at(self, phase: float) -> np.ndarray | None:
        """The state at a phase of an orbit without events; for an orbit with a single event, the
        state at the next phase 0.
        """
        frequency = self.equations.frequency(self.point.solution.values)
        n = 2 * self.equations.own
        begin = self.events[0].phase if self.events else 0.0
        end = phase if not self.events else 2.0 * np.pi * np.ceil(begin / (2.0 * np.pi))
        closed = int(self.equations.plan[0, SegmentPlan.ALONG])
        start = self.evaluation.ends[0, SegmentEnd.NUMBERS :][:n]
        state: np.ndarray | None = self.equations.carried_along(
            start, closed, np.array([begin, end]) / frequency, self.point.solution.values
        )
        return state


def from_next_event(point: OrbitPoint) -> OrbitPoint:
    """The same symmetric orbit in the equations of the half that begins with its second event."""
    here = Switching.of_point(point)
    phases = [timed.phase for timed in here.events]
    events = (
        *here.equations.signature.events[1:],
        here.equations.signature.events[0].image(here.equations.images),
    )
    equations = here.equations.with_signature(replace(here.equations.signature, events=events))
    place = SegmentEnd.NUMBERS + 8 * equations.own
    state = here.evaluation.ends[0, place : place + 2 * equations.own]
    curve = point.curve.with_equations(equations)
    found = curve.known(
        equations.joined(state, np.array([*phases[1:], phases[0] + equations.closing])),
        point.parameters,
    )
    assert found is not None, "an orbit can be followed from each of its events"
    turned: OrbitPoint = curve.along_kernel(found)
    return turned


Cycle = tuple[ModeChange, ...]


def cycle_of(signature: Signature) -> Cycle:
    """The events in cyclic order, the same for signatures that differ only in the event with which
    their lists begin.
    """
    events = signature.events
    return min((events[i:] + events[:i] for i in range(len(events))), key=repr, default=())


def begins_excursion(point: OrbitPoint) -> bool:
    """Whether a point has an excursion of no duration after a release: its multipliers and its
    tangent then have no meaning.
    """
    equations: Any = point.orbit.equations
    if not equations.signature.events:
        return False
    phases = equations.split(point.solution.unknowns)[1]
    apart = np.diff(np.append(phases, phases[:1] + equations.closing))
    return bool(
        (apart[equations.plan[:, SegmentPlan.POWER] == AFTER_RELEASE] < TOLERANCES.switching).any()
    )


def _changed(events: list[Timed], new: dict[int, Timed | None]) -> list[Timed]:
    """Events with some of them replaced, or left out."""
    both = [new.get(i, timed) for i, timed in enumerate(events)]
    return [timed for timed in both if timed is not None]


def contact_change(point: OrbitPoint) -> SpecialKind:
    """The kind of the point at which an event appears or is lost: GR for a grazing, SW for a
    release or a closing.
    """
    orbit = point.orbit
    here = Switching.of_point(point)
    joined = next(iter(here._together(False)), None) is not None
    natural = orbit.equations.natural
    grazes = min(orbit.slowest / natural.speed, orbit.clearance / natural.length)
    return SpecialKind.SW if joined or orbit.pressing <= grazes else SpecialKind.GR


def bounces(system: System, contact: int) -> bool:
    """Whether an impact on a contact has a restitution."""
    return float(system.impact.restitution_matrix(system.model)[contact][contact]) > 0.0


def other_events_side(point: OrbitPoint) -> OrbitPoint | End:
    """The point of the branch beyond one at which an event appears or is lost, with the direction
    in which it goes on; or why there is none."""
    return _beyond_both_halves(point) if point.orbit.symmetric else _with_other_events(point)


def _with_other_events(point: OrbitPoint, known: tuple[Cycle, ...] = ()) -> OrbitPoint | End:
    """`other_events_side`: the first of the possible signatures that this orbit solves and that has
    admissible orbits beyond.

    Symmetry may let several events change at once; these are then changed one after the other, at
    most `MOST_TOGETHER`.
    """
    here = Switching.of_point(point)
    end = End(OrbitEnd.TWO_AT_ONCE, point.parameter)
    covered = point.orbit.equations.covered(point.solution)
    if not known and covered is None:
        # several impacts that appear or are lost at once belong together, as both of a symmetric
        # orbit: with one of them alone the branch would be left
        alike = _with_all_impacts(point)
        together = None if alike is None else _admissible(alike)
        if together is not None:
            return together
    known = (*known, cycle_of(point.orbit.signature))
    for events in here.other_signatures():
        begun = _begun(here, events, known)
        if begun is None:
            continue
        if covered is not None and repeats(begun.orbit.signature, covered):
            end = ends_at_another(point, covered)
            continue
        end = End(OrbitEnd.NO_DIRECTION, point.parameter)
        ahead = _admissible(begun, here.at_once > TOLERANCES.switching) or (
            _with_other_events(begun, known) if len(known) < MOST_TOGETHER else None
        )
        if isinstance(ahead, OrbitPoint):
            return ahead
    return end


def _begun(here: Switching, events: list[Timed], known: tuple[Cycle, ...]) -> OrbitPoint | None:
    """The orbit of a switching in the equations with other events, which are none of those known;
    None where it does not solve them."""
    found = here.equations_with(events)
    if found is None or cycle_of(found[0].signature) in known:
        return None
    curve = here.point.curve.with_equations(found[0])
    solved = curve.known(found[1], here.point.parameters)
    if solved is None:
        return None
    if not found[0].units.vanish(solved.evaluation.residual, _tolerances(*found)):
        return None
    begun: OrbitPoint = curve.along_kernel(solved)
    return begun


def _tolerances(equations: Any, unknowns: np.ndarray) -> np.ndarray:
    """How far the equations (m,) may be from 0 at an orbit at which events have come together; the
    guard of an excursion of no duration is the rounding of elastic forces there.
    """
    phases = equations.split(unknowns)[1]
    apart = np.diff(np.append(phases, phases[:1] + equations.closing))
    released = equations.plan[: len(phases), SegmentPlan.POWER] == AFTER_RELEASE
    tolerances = np.full(equations.size, TOLERANCES.switching)
    begins = np.flatnonzero(released & (np.abs(apart) < TOLERANCES.switching))
    tolerances[begins] = max(TOLERANCES.switching, AT_BEGIN * equations.resolution)
    return tolerances


def _with_all_impacts(point: OrbitPoint) -> OrbitPoint | None:
    """The orbit in the equations without all of the impacts that have lost their speed, or with one
    at each touch; None if there is one alone, or none."""
    here = Switching.of_point(point)
    slow = here.slow_impacts()
    if len(slow) > 1:
        return _begun(here, _changed(list(here.events), dict.fromkeys(slow)), ())
    number = 0
    while number < MOST_TOUCHES and (events := here.with_touch()) is not None:
        begun = None if slow else _begun(here, events, ())
        if begun is None:
            return None
        here = Switching.of_point(begun)
        number += 1
    return here.point if number > 1 else None


def families_beside(point: OrbitPoint) -> list[tuple[str, int]]:
    """At an orbit at which several impacts appear or are lost at once, those with which alone
    orbits begin there: "with" or "without" each, and the number of its contact. They are no
    symmetric orbits where the branch's are.

    Parameters
    ----------
    point
        The point of the branch.
    """
    full = full_point(point) if point.orbit.symmetric else point
    here = Switching.of_point(full)
    events = list(here.events)
    slow = here.slow_impacts()
    all_touched = None if slow else _with_all_impacts(full)
    if len(slow) > 1:
        choices = [("without", events[i].event.contact, _changed(events, {i: None})) for i in slow]
    elif all_touched is not None:
        new = [
            timed
            for timed in Switching.of_point(all_touched).events
            if all(abs(timed.phase - other.phase) > TOLERANCES.switching for other in events)
        ]
        choices = [
            ("with", timed.event.contact, sorted([*events, timed], key=lambda one: one.phase))
            for timed in new
        ]
    else:
        return []
    found = []
    for change, contact, other in choices:
        begun = _begun(here, other, ())
        if begun is not None and _admissible(begun) is not None:
            found.append((change, contact))
    return found


def _beyond_both_halves(point: OrbitPoint) -> OrbitPoint | End:
    """`other_events_side` of a symmetric orbit: first both halves change alike, then, over the full
    period, one after the other, which may break the symmetry."""
    for start in (
        (point, from_next_event(point)) if len(point.orbit.signature.events) > 1 else (point,)
    ):
        ahead = _with_other_events(start)
        if not isinstance(ahead, End):
            return ahead
    ahead = _with_other_events(full_point(point))
    return ahead if isinstance(ahead, End) else half_point(ahead)


def _admissible(start: OrbitPoint, is_lost: bool = False) -> OrbitPoint | None:
    """The first point of a branch with other events; `is_lost` where an excursion ends that is
    still too long: its orbits have a pull at `start`, and only those somewhat ahead have none.
    """
    if is_lost or begins_excursion(start):
        return admissible_direction(start, BEGUN, begun=True)
    return admissible_direction(start)
