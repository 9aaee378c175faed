"""The boundary-value problem of a periodic orbit with several contacts, and its derivatives.

Its events are impacts of single contacts and releases. The unknowns are the state just after the first event, without the
coordinates that contacts then hold, and the phase of every event. The equations say that each event's guard (the gap of an
impact, the reaction of a release) is 0 at its phase, and that the state after the first event of the next period is the one of
the start. Between events the signature says which contacts are closed, whatever the signs of gaps and reactions. An orbit without
events has the free coordinates and velocities at phase 0 as its unknowns. A symmetric orbit is closed after half a period by its
mirror image.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from saltus.flow import ContactColumn, EventCode, SegmentColumn, SegmentEnd, SegmentExtremes, SegmentPlan, load_contact_segments
from saltus.orbits.equations.one_contact import ORBIT_TOLERANCE, OneContactEquations, OrbitEvaluation
from saltus.orbits.equations.whole_motion import WholeMotionEquations
from saltus.orbits.signature import ModeChange, Signature
from saltus.orbits.tolerances import TOLERANCES
from saltus.systems import System, image_of
from saltus.taylor import FREQUENCY

AFTER_RELEASE, AFTER_IMPACT = 3, 2  # power of the time with which the gap grows after a release, and after an impact with e = 0
START_SHARE = 0.4  # where in a segment a motion is started; not in its middle, where symmetric orbits may touch a contact


@dataclass(frozen=True)
class ContactsEvaluation(OrbitEvaluation):
    """The problem at one point; its derivatives are `here`, to the unknowns, and `there`, to the unknowns a period later."""

    seen: np.ndarray  # (n, ...): the extremes along each segment, in the columns of `SegmentExtremes`; empty if not asked for
    state_count: int  # how many of the unknowns are the state; the others are phases

    def _fill(self, matrix: np.ndarray, closing: float) -> None:
        matrix[:, : len(matrix)] = self.here + closing * self.there

    def monodromy(self) -> np.ndarray:
        """The derivative of the map of the first event's phase, and the state after it, over a period; inf at a grazing."""
        count = self.state_count
        state = [*range(count + 1)] if self.here.shape[0] > count else [*range(count)]
        later = [*range(count + 1, self.here.shape[0])]
        rows = [*range(len(later), self.here.shape[0])]  # the first rows are the guards of the later events
        with np.errstate(all="ignore"):
            try:
                chain = self.here[np.ix_(rows, state)]
                if later:
                    inner = self.here[: len(later)]
                    chain = chain - self.here[np.ix_(rows, later)] @ np.linalg.solve(inner[:, later], inner[:, state])
                return np.asarray(-np.linalg.solve(self.there[np.ix_(rows, state)], chain))
            except np.linalg.LinAlgError:
                return np.full((len(state), len(state)), np.inf)


class ContactsEquations(OneContactEquations):
    """The equations of one signature of a system with several contacts."""

    @cached_property
    def plan(self) -> np.ndarray:
        """The segments (see `SegmentPlan`): from each event to the next one, the last event's to the first of the next period."""
        events = self.signature.events
        if not events:
            return no_event(self.signature.closed)
        following = (*events[1:], events[0].image(self.images) if self.signature.symmetric else events[0])
        rows = [
            [e.closed, f.kind, f.contact, f.closed, self._power(e, f), e.contact if e.is_impact else -1]
            for e, f in zip(events, following, strict=True)
        ]
        return np.array(rows, dtype=np.int64)

    def _power(self, begin: ModeChange, end: ModeChange) -> int:
        """The power of the time with which a contact opens, of a segment that begins with an event of this contact without speed
        afterwards and ends with an impact on it; else 0."""
        if begin.contact != end.contact or not end.is_impact:
            return 0
        if not begin.is_impact:
            return AFTER_RELEASE
        return 0 if bounces(self.system, begin.contact) else AFTER_IMPACT

    @cached_property
    def _free(self) -> np.ndarray:
        """The places of the free coordinates and velocities in the state at the start."""
        held = {self._run.trace.held[i] for i in range(len(self._run.trace.held)) if self.plan[0, SegmentPlan.ALONG] >> i & 1}
        free = [i for i in range(self.own) if i not in held]
        return np.array([*free, *(self.own + i for i in free)], dtype=int)

    @property
    def size(self) -> int:
        return len(self._free) + len(self.signature.events)

    def split(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The state at the start, with 0 for coordinates and velocities that are held, and the phases of the events."""
        state = np.zeros(2 * self.own)
        state[self._free] = unknowns[: len(self._free)]
        return state, unknowns[len(self._free) :]

    def joined(self, state: np.ndarray, phases: np.ndarray) -> np.ndarray:
        """The unknowns made of a state (just after the first event, or at phase 0) and the events' phases."""
        return np.append(state[self._free], phases)

    def repeated(self, unknowns: np.ndarray) -> np.ndarray:
        return np.append(unknowns, unknowns[len(self._free) :] + self.closing)

    def alternating(self, direction: np.ndarray) -> np.ndarray:
        return np.append(direction, -direction[len(self._free) :])

    def impacts(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> tuple[np.ndarray, np.ndarray]:
        chosen = np.array([event.is_impact for event in self.signature.events], dtype=bool)
        speeds = -np.roll(evaluation.ends[:, SegmentEnd.RATE], 1)[: len(chosen)]
        return self.split(unknowns)[1][chosen], speeds[chosen]

    def touching_speed(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> float:
        rows = (self.plan[:, SegmentPlan.KIND] == EventCode.IMPACT) & (self.plan[:, SegmentPlan.POWER] == 0)
        return float((-evaluation.ends[rows, SegmentEnd.RATE]).min(initial=math.inf))

    def pressing(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> float:
        """The least of the reactions of closed contacts, the times between events, and the gaps of other contacts at impacts."""
        assert isinstance(evaluation, ContactsEvaluation)
        phases = self.split(unknowns)[1]
        apart = np.diff(np.append(phases, phases[:1] + self.closing))
        forces = evaluation.seen[:, [SegmentExtremes.FORCE, SegmentExtremes.PULL, SegmentExtremes.TAIL, SegmentExtremes.BESIDE]]
        return float(min(forces.min(), apart.min(initial=math.inf)))

    def evaluate(
        self, unknowns: np.ndarray, values: np.ndarray, with_extremes: bool = False, *, later: np.ndarray | None = None
    ) -> ContactsEvaluation | None:
        frequency, later = self.frequency(values), unknowns if later is None else later
        if not (frequency > 0.0 and all(np.isfinite(numbers).all() for numbers in (unknowns, later, values))):
            return None
        state, phases = self.split(unknowns)
        end, last = self.split(later)
        times = (np.append(phases, last[0] + self.closing) if phases.size else np.array([0.0, self.closing])) / frequency
        followed = self._followed(self.plan, times, state, values, with_extremes)
        return None if followed is None else self._assembled(end, times, frequency, *followed)

    def carried_along(self, state: np.ndarray, closed: int, times: np.ndarray, values: np.ndarray) -> np.ndarray | None:
        """The state at the second of two times, of the smooth motion from a state at the first, with these contacts closed."""
        followed = self._followed(no_event(closed), times, state, values, False)
        begin = SegmentEnd.NUMBERS + 4 * self.own
        return None if followed is None else np.asarray(followed[0][0, begin : begin + 2 * self.own])

    def _followed(
        self, plan: np.ndarray, times: np.ndarray, state: np.ndarray, values: np.ndarray, with_extremes: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
        """The arrays that `follow_contact_segments` fills; None where a segment cannot be followed."""
        parameters = self._values.copy()
        parameters[self._places] = values
        env, model = self._run.structure.prepare(parameters, self._records)
        n, own, width = len(plan), self.own, 2 * self.own + len(self.paths)
        contacts = np.zeros((len(self._run.trace.held), len(ContactColumn)), dtype=np.int64)
        contacts[:, ContactColumn.COORDINATE] = self._run.trace.held
        ends, columns = np.zeros((n, SegmentEnd.NUMBERS + 10 * own)), np.zeros((n, 2 * own + 1, width))
        maps = np.zeros((n, 2 * own, width))
        seen = np.zeros((n if with_extremes else 0, SegmentExtremes.MARGINS + max(1, len(self.margins))))
        done = load_contact_segments()(
            self._where, self._settings, env, model, contacts, plan, times, state, ends, columns, maps, seen
        )
        return None if done < n else (ends, columns, maps, seen)

    def _assembled(
        self,
        end: np.ndarray,
        times: np.ndarray,
        frequency: float,
        ends: np.ndarray,
        columns: np.ndarray,
        maps: np.ndarray,
        seen: np.ndarray,
    ) -> ContactsEvaluation:
        """The residual and its derivatives, by the chain rule from segment to segment; `end` is the state asked for at the end.

        Columns are the state at the start, the phases, the phase of the first event a period later, and the parameters.
        """
        own, free, events = self.own, self._free, len(self.signature.events)
        first, count = len(free), len(self.paths)
        end_phase, parameters = first + events, first + events + 1
        slope = np.zeros((2 * own, parameters + count))
        slope[free, np.arange(first)] = 1.0
        guards, rows = np.zeros(events), np.zeros((events, slope.shape[1]))
        for s in range(len(ends)):
            start, stop = ends[s, SegmentEnd.NUMBERS :][2 * own : 4 * own], ends[s, SegmentEnd.NUMBERS :][6 * own : 8 * own]
            before = columns[s, :, : 2 * own] @ slope
            before[:, parameters:] += columns[s, :, 2 * own :]
            moved = np.append(-columns[s, :-1, : 2 * own] @ start, ends[s, SegmentEnd.BY_START])
            rates = np.append(stop, ends[s, SegmentEnd.BY_END])
            for place, time, by in ((first + s, times[s], moved), (first + s + 1, times[s + 1], rates)):
                if events:
                    before[:, place] += by / frequency
                if FREQUENCY in self.paths:
                    before[:, parameters + self.paths.index(FREQUENCY)] -= by * time / frequency
            if not events:
                slope = before[:-1]
                break
            guards[s], rows[s] = ends[s, SegmentEnd.GUARD], before[-1]
            slope = maps[s, :, : 2 * own] @ before[:-1]
            slope[:, parameters:] += maps[s, :, 2 * own :]
        last = SegmentEnd.NUMBERS + (8 if events else 4) * own
        after = ends[-1, last : last + 2 * own]
        if self.signature.symmetric:
            slope, after = image_of(self.system.model, slope.T).T, image_of(self.system.model, after)
        total = np.vstack([rows, slope[free]])
        here, there = total[:, :end_phase], np.zeros((first + events, first + events))
        there[events:, :first] = -np.eye(first)
        if events:
            there[:, first] = total[:, end_phase]
        residual = np.append(guards, (after - end)[free])
        return ContactsEvaluation(residual, here, there, total[:, parameters:], ends, self._extremes(seen), seen, first)

    def _extremes(self, seen: np.ndarray) -> np.ndarray:
        """The extremes along the segments, in the columns that orbits with one contact use (`flow/one_contact/segments.py`)."""
        extremes = np.full((len(seen), SegmentColumn.LEAST_MARGIN + max(1, len(self.margins))), np.inf)
        extremes[:, [SegmentColumn.HIGHEST, SegmentColumn.LOWEST]] = seen[:, [SegmentExtremes.TOP, SegmentExtremes.BOTTOM]]
        extremes[:, [SegmentColumn.LOWEST_GAP, SegmentColumn.LOWEST_GAP_TIME]] = seen[
            :, [SegmentExtremes.GAP, SegmentExtremes.GAP + 1]
        ]
        extremes[:, SegmentColumn.CROSSINGS] = 0.0
        extremes[:, SegmentColumn.LEAST_MARGIN :] = seen[:, SegmentExtremes.MARGINS :]
        return extremes

    def within(self, unknowns: np.ndarray, evaluation: OrbitEvaluation, values: np.ndarray) -> tuple[np.ndarray, float]:
        """A state within the longest segment, and its time; for an orbit without events, the state at phase 0."""
        state, phases = self.split(unknowns)
        if not phases.size:
            return self._with_held(state, self.signature.closed, values), 0.0
        times = np.append(phases, phases[0] + self.closing) / self.frequency(values)
        longest = int(np.argmax(np.diff(times)))
        begin = evaluation.ends[longest, SegmentEnd.NUMBERS : SegmentEnd.NUMBERS + 2 * self.own]
        part = times[longest] + np.array([0.0, START_SHARE]) * (times[longest + 1] - times[longest])
        there = self.carried_along(begin, int(self.plan[longest, SegmentPlan.ALONG]), part, values)
        assert there is not None, "an orbit's own segments can be followed"
        return there, float(part[1])

    def halves(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> np.ndarray | None:
        """The unknowns of both halves of a period, each as unknowns of the equations over one half, (2, n); None where the events
        of the halves differ."""
        events, half = self.signature.events, len(self.signature.events) // 2
        odd, own = self.signature.period % 2, self.own
        image = tuple(event.image(self.images) for event in events[:half]) if odd else events[:half]
        if len(events) % 2 or events[half:] != image:
            return None
        state, phases = self.split(unknowns)
        place = SegmentEnd.NUMBERS + 8 * own
        later = evaluation.ends[half - 1, place : place + 2 * own]
        later = image_of(self.system.model, later) if odd else later
        first, second = self.joined(state, phases[:half]), self.joined(later, phases[half:] - np.pi * self.signature.period)
        return np.stack([first, second])

    def _with_held(self, state: np.ndarray, closed: int, values: np.ndarray) -> np.ndarray:
        """A state put exactly onto the contacts that are closed, and onto those that it touches without speed, up to rounding."""
        for i, contact in enumerate(self.at(values).model.contacts):
            pair = [self._run.trace.held[i], self.own + self._run.trace.held[i]]
            if closed >> i & 1 or max(abs(contact.gap(state[pair[0]])), abs(state[pair[1]])) < TOLERANCES.touch:
                state[pair] = float(contact.position), 0.0
        return state


def bounces(system: System, contact: int) -> bool:
    """Whether an impact on a contact has a restitution."""
    return float(system.impact.restitution_matrix(system.model)[contact][contact]) > 0.0


def no_event(closed: int) -> np.ndarray:
    """The plan of one segment without an event at its end."""
    return np.array([[closed, -1, -1, closed, 0, -1]], dtype=np.int64)


def equations_of(
    system: System, signature: Signature, paths: tuple[str, ...] = (), tol: float = ORBIT_TOLERANCE
) -> OneContactEquations:
    """The problem of a signature: with one contact, with several, or, if the signature has a section, followed as one motion."""
    kind: type[OneContactEquations] = ContactsEquations if system.model.holds_coordinates else OneContactEquations
    return (kind if signature.section is None else WholeMotionEquations)(system, signature, paths, tol)
