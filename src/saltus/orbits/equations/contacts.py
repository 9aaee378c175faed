"""The boundary-value problem of a periodic orbit with several contacts, and its derivatives.

Its events are impacts of single contacts and releases. The unknowns are the state just after the
first event, without the coordinates that contacts then hold, and the phase of every event. The
equations say that each event's guard (the gap of an impact, the reaction of a release) is 0 at its
phase. They also say that the state after the first event of the next period equals the start.
Between events the signature says which contacts are closed, whatever the signs of gaps and
reactions. An orbit without events has the free coordinates and velocities at phase 0 as its
unknowns. A symmetric orbit is closed after half a period by its mirror image.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from saltus.continuation import NEWTON, Bounds, Cut, End, Evidence, TestFunction, Units, Zero
from saltus.errors import MotionError
from saltus.flow import (
    EventCode,
    EventKind,
    SegmentColumn,
    SegmentEnd,
    SegmentExtremes,
    SegmentPlan,
    load_contact_equations,
)
from saltus.orbits.beyond.events import refused_beyond
from saltus.orbits.beyond.orbit_curve import (
    GRAZING,
    OrbitPoint,
    curve_test,
    grazing,
    with_witness,
)
from saltus.orbits.beyond.special_point import OrbitEnd, SpecialKind
from saltus.orbits.beyond.switching import (
    AFTER_RELEASE,
    bounces,
    contact_change,
    families_beside,
    other_events_side,
)
from saltus.orbits.beyond.symmetry import full_point
from saltus.orbits.beyond.vanishing import other_room
from saltus.orbits.contract.equations import (
    MotionToRead,
    OrbitEquations,
    OrbitEvaluation,
    Solution,
    Witness,
)
from saltus.orbits.contract.event_sequence import STAYS, contact_blocks, read_signature
from saltus.orbits.contract.sampled_motion import ONE_INSTANT, excursions
from saltus.orbits.segments.contact_segments import contact_segments
from saltus.orbits.segments.segments import CannotProve, OrbitSegments
from saltus.orbits.signature import TOLERANCES, ModeChange, Signature
from saltus.systems import System, arguments_of, held_values, mass_rows

# power of the time with which the gap grows after an impact with e = 0; after a release it is
# `AFTER_RELEASE`
AFTER_IMPACT = 2
# An opened gap below this share of the natural length is rounding, at the instant at which it
# opens.
GAP_AT_REST = 1e-13
JUST_OPENED = 1e-4  # the share of the period within which such a gap may have minima by rounding
# the reactions of contacts, and the gaps beside impacts
PRESSING = [
    int(column)
    for column in (
        SegmentExtremes.FORCE,
        SegmentExtremes.PULL,
        SegmentExtremes.TAIL,
        SegmentExtremes.BESIDE,
    )
]
# where in a segment a motion is started; not in its middle, where symmetric orbits may touch a
# contact
START_SHARE = 0.4


@dataclass(eq=False)
class ContactsEvaluation(OrbitEvaluation):
    """The equations at one point; their derivatives are `here`, to the unknowns, and `there`, to
    the unknowns a period later.
    """

    # (n, ...): the extremes along each segment, in the columns of `SegmentExtremes`; empty if not
    # asked for
    seen: np.ndarray
    state_count: int  # how many of the unknowns are the state; the others are phases
    rates: np.ndarray  # of this state, to the phase, just after the first event

    def _fill(self, matrix: np.ndarray, closing: float) -> None:
        matrix[:, : len(matrix)] = self.here + closing * self.there

    def monodromy(self) -> np.ndarray:
        """The derivative of the state at the phase of the first event, just after it, to the state
        a period before; inf at a grazing.

        The equations say how the state and the phase at the first event follow from those of the
        period before. At a fixed phase, a perturbation of the state alone begins the same motion as
        at any other. An event that is later by d phi moves the state by the rates times -d phi.
        Without this the direction of the flow would be one multiplier more, which is 0.
        """
        count = self.state_count
        phases = self.here.shape[0] - count
        # the first rows are the guards of the later events, and of the first one a period later
        rows = max(phases - 1, 0)
        columns = count + 1 if phases else count
        with np.errstate(all="ignore"):
            try:
                chain = self.here[rows:, :count]
                if phases > 1:
                    later = self.here[:, count + 1 :]
                    inner = self.here[:rows, :count]
                    chain = chain - later[rows:] @ np.linalg.solve(later[:rows], inner)
                following = -np.linalg.solve(self.there[rows:, :columns], chain)
            except np.linalg.LinAlgError:
                return np.full((count, count), np.inf)
            if not phases:
                return np.asarray(following)
            return np.asarray(following[:count] - self.rates[:, None] * following[count])

    def area_factor(self) -> float | None:
        return None


# Excursions from contacts of cells that move alike are followed down to this duration, in radians
# of the load: there they end with a speed of some 1e-8.
SHORTEST_EXCURSION = 1e-4


class ContactsEquations(OrbitEquations):
    """The equations from event to event of a system with several contacts."""

    @classmethod
    def solves(cls, system: System, signature: Signature) -> bool:
        return signature.section is None and system.model.holds_coordinates

    @classmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        """None where there are no equations from event to event.

        These are models with frictions, dependent sums, contacts that multipliers hold or walls
        that move the mass matrix, and accumulations of impacts.
        """
        known: Any = base.system.contact_model if isinstance(base, cls) else None
        if (
            known is None
            or known.frictions
            or known.surfaces
            or known.has_switches
            or base.has_corners
            or base.system.dependent
            or known.has_multipliers
            or _has_moving_mass(known)
        ):
            return None
        if motion.twice.limit is not None or len(motion.twice.events.of(EventKind.HELD)):
            return None
        signature, first, phases = read_signature(
            motion.twice, motion.periods, base.frequency(base.values)
        )
        found = cls(base.given, signature, base.paths, base.tol)
        if not found.size:
            raise MotionError(STAYS)
        return found, found.joined(first, phases)

    @cached_property
    def plan(self) -> np.ndarray:
        """The segments (see `SegmentPlan`): from each event to the next one, the last event's to
        the first of the next period.
        """
        events = self.signature.events
        if not events:
            return no_event(self.signature.closed)
        following = (
            *events[1:],
            events[0].image(self.images) if self.signature.symmetric else events[0],
        )
        rows = [
            [
                e.closed,
                f.kind,
                f.contact,
                f.closed,
                self._power(e, f),
                e.contact if e.is_impact else -1,
            ]
            for e, f in zip(events, following, strict=True)
        ]
        return np.array(rows, dtype=np.int64)

    @cached_property
    def _blocks(self) -> list[int]:
        """The contacts on which each contact acts, as bits."""
        return contact_blocks(self.system)

    def is_independent(self, one: int, other: int) -> bool:
        """Whether two contacts do not act on one another."""
        return not self._blocks[one] >> other & 1

    @cached_property
    def _independent(self) -> np.ndarray:
        """(events,): whether the contacts of an event and of the next one do not act on one
        another.
        """
        return np.array(
            [
                self.is_independent(event.contact, int(row[SegmentPlan.CONTACT]))
                for event, row in zip(self.signature.events, self.plan, strict=False)
            ],
            dtype=bool,
        )

    def _power(self, begin: ModeChange, end: ModeChange) -> int:
        """The power of the time with which a contact opens, of a segment that begins with an event
        of this contact without speed afterwards and ends with an impact on it; else 0."""
        if begin.contact != end.contact or not end.is_impact:
            return 0
        if not begin.is_impact:
            return AFTER_RELEASE
        return 0 if bounces(self.system, begin.contact) else AFTER_IMPACT

    @cached_property
    def _free(self) -> np.ndarray:
        """The places of the free coordinates and velocities in the state at the start."""
        held = {
            self._run.trace.contact_coordinates[i]
            for i in range(len(self._run.trace.contact_coordinates))
            if self.plan[0, SegmentPlan.ALONG] >> i & 1
        }
        free = [i for i in range(self.own) if i not in held]
        moving = [i for i in free if i < self.own - len(self.system.model.first_order)]
        return np.array([*free, *(self.own + i for i in moving)], dtype=int)

    @property
    def size(self) -> int:
        return len(self._free) + len(self.signature.events)

    @cached_property
    def following(self) -> np.ndarray:
        return np.zeros(0, dtype=int)  # they are no unknowns

    @cached_property
    def units(self) -> Units:
        """State and phases; guards, which are gaps and reactions, and the state."""
        natural = self.natural
        state = natural.state[self._free]
        places = self._run.trace.contact_coordinates
        rows = self.plan[: len(self.signature.events)]
        # the gap is divided by a power of the time since the contact opened without speed
        guards = [
            (
                natural.lengths[places[contact]] / natural.time**power
                if kind == EventCode.IMPACT
                else natural.forces[places[contact]]
            )
            for kind, contact, power in zip(
                rows[:, SegmentPlan.KIND].tolist(),
                rows[:, SegmentPlan.CONTACT].tolist(),
                rows[:, SegmentPlan.POWER].tolist(),
                strict=True,
            )
        ]
        unknowns = np.append(state, np.ones(len(guards)))
        # forces, and gaps divided by a power of the time, are differences of elastic forces
        elastic = (rows[:, SegmentPlan.KIND] != EventCode.IMPACT) | (rows[:, SegmentPlan.POWER] > 0)
        terms = np.append(np.where(elastic, self.elastic_forces, 1.0), np.ones(len(state)))
        return Units(unknowns, np.append(guards, state), self.is_phase, terms=terms)

    @cached_property
    def elastic_forces(self) -> float:
        """The elastic forces of which a reaction is the difference, in natural units of force, at
        least 1: rounding is a share of them."""
        natural = self.natural
        return max(1.0, (natural.time / natural.free_time) ** 2)

    @cached_property
    def resolution(self) -> float:
        """The duration, in radians of the load, below which rounding hides an excursion: elastic
        forces leave an error in the acceleration at its begin, and the guard of a duration h has
        the error of a reaction divided by h.
        """
        return math.sqrt(NEWTON.converged * self.elastic_forces)

    @cached_property
    def is_phase(self) -> np.ndarray:
        return np.arange(self.size) >= len(self._free)

    @cached_property
    def is_velocity(self) -> np.ndarray:
        return np.append(self._free >= self.own, np.zeros(len(self.signature.events), dtype=bool))

    def split(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The state at the start, with 0 for coordinates and velocities that are held, and the
        phases of the events.
        """
        state = np.zeros(2 * self.own)
        state[self._free] = unknowns[: len(self._free)]
        return state, unknowns[len(self._free) :]

    def joined(self, state: np.ndarray, phases: np.ndarray) -> np.ndarray:
        """The unknowns made of a state (just after the first event, or at phase 0) and the events'
        phases.
        """
        return np.append(state[self._free], phases)

    def repeated(self, unknowns: np.ndarray) -> np.ndarray:
        return np.append(unknowns, unknowns[len(self._free) :] + self.closing)

    def alternating(self, direction: np.ndarray) -> np.ndarray:
        return np.append(direction, -direction[len(self._free) :])

    def impacts(self, solution: Solution) -> tuple[np.ndarray, np.ndarray]:
        chosen = self._impacts
        phases = solution.unknowns[len(self._free) :]
        # each ends the segment before
        return phases[chosen], -solution.evaluation.ends[chosen - 1, SegmentEnd.RATE]

    @cached_property
    def _impacts(self) -> np.ndarray:
        """The places of the impacts among the events."""
        return np.flatnonzero([event.is_impact for event in self.signature.events])

    def rests(self, solution: Solution) -> np.ndarray:
        resting = [event.closed != 0 for event in self.signature.events]
        times = self.split(solution.unknowns)[1] / self.frequency(solution.values)
        period = self.closing / self.frequency(solution.values)
        if self.signature.symmetric:  # the images of the events follow half a period later
            resting = resting + resting
            times = np.append(times, times + period)
            period = 2.0 * period
        return np.array(excursions(times.tolist(), resting, period)).reshape(-1, 2)

    def touching_speed(self, solution: Solution) -> float:
        rates = solution.evaluation.ends[self._with_speed, SegmentEnd.RATE]
        return -max(rates.tolist(), default=-math.inf)

    @cached_property
    def _with_speed(self) -> np.ndarray:
        """The segments that end with an impact that has a speed."""
        impacts = self.plan[:, SegmentPlan.KIND] == EventCode.IMPACT
        return np.flatnonzero(impacts & (self.plan[:, SegmentPlan.POWER] == 0))

    def pressing(self, solution: Solution) -> float:
        """The least of the reactions of closed contacts, the times between events, and the gaps of
        other contacts at impacts.

        Events at one instant of contacts that do not act on one another stay together along a
        branch, as those of cells that move alike: the time between them is rounding.
        """
        phases = solution.unknowns[len(self._free) :].tolist()
        following = [*phases[1:], *(phase + self.closing for phase in phases[:1])]
        together = ONE_INSTANT * self.closing
        apart = [
            later - phase
            for phase, later, independent in zip(
                phases, following, self._independent.tolist(), strict=True
            )
            if not (independent and abs(later - phase) <= together)
        ]
        evaluation: Any = solution.evaluation
        return float(min(evaluation.seen.take(PRESSING, axis=1).min(), *apart, math.inf))

    def covered(self, solution: Solution) -> int | None:
        signature = self.signature
        if signature.symmetric:
            return None
        phases = self.split(solution.unknowns)[1]
        ends = solution.evaluation.ends
        after = SegmentEnd.NUMBERS + 8 * self.own
        # the row of an event is the segment before it
        rows = (np.arange(len(phases)) - 1) % max(len(phases), 1)
        kept = [
            i
            for i, event in enumerate(signature.events)
            if not (
                event.is_impact
                and abs(ends[rows[i], SegmentEnd.RATE]) < TOLERANCES.touch * self.natural.speed
            )
        ]
        for periods in range(1, signature.period):
            if signature.period % periods or len(kept) * periods % signature.period:
                continue
            if not kept:
                begin = phases[0] if len(phases) else 0.0
                state = (
                    ends[rows[0], after : after + 2 * self.own]
                    if len(phases)
                    else self.split(solution.unknowns)[0]
                )
                span = np.array([begin, begin + math.tau * periods])
                closed = int(self.plan[0, SegmentPlan.ALONG])
                times = span / self.frequency(solution.values)
                later = self.carried_along(state, closed, times, solution.values)
                if later is None:
                    continue
                moved = np.abs((later - state) / self.natural.state).max()
                if moved < TOLERANCES.touching_state:
                    return periods
                continue
            part = len(kept) * periods // signature.period
            events = [signature.events[i] for i in kept]
            alike = events[part:] + events[:part] == events
            moved = np.roll(phases[kept], -part)
            moved[len(kept) - part :] += self.closing
            apart = np.abs(moved - phases[kept] - math.tau * periods).max()
            states = ends[rows[kept], after : after + 2 * self.own]
            moved_states = (np.roll(states, -part, axis=0) - states) / self.natural.state
            apart = max(apart, np.abs(moved_states).max())
            if alike and apart < TOLERANCES.grazing_orbits:
                return periods
        return None

    def nearest(
        self, unknowns: np.ndarray, values: np.ndarray, other: OrbitPoint
    ) -> np.ndarray | None:
        """Begun at another event, and shifted by whole forcing periods."""
        target = other.orbit.signature
        signature = self.signature
        n = len(signature.events)
        if not n:
            return unknowns if signature == target else None
        if (n, signature.period, signature.symmetric) != (
            len(target.events),
            target.period,
            target.symmetric,
        ):
            return None
        events = signature.events
        images = tuple(event.image(self.images) for event in events) if signature.symmetric else ()
        turns = [
            turn
            for turn in range(2 * n if signature.symmetric else n)
            if (events + (images or events) + events)[turn : turn + n] == target.events
        ]
        evaluation = self.evaluate(unknowns, values) if turns else None
        if evaluation is None:
            return None
        equations: Any = other.orbit.equations
        goal = other.solution.unknowns
        state, phases = self.split(unknowns)
        later = np.concatenate([phases + turn * self.closing for turn in range(3)])
        place = SegmentEnd.NUMBERS + 8 * self.own
        found = []
        for turn in turns:
            index = turn % n
            begin = evaluation.ends[index - 1, place : place + 2 * self.own] if index else state
            begin = self.image_of(begin) if turn >= n else begin
            begun = later[turn : turn + n]
            first = equations.split(goal)[1][0]
            begun = begun + math.tau * round((first - begun[0]) / math.tau)
            found.append(equations.joined(begin, begun))
        unknowns_apart = lambda one: float(np.abs((one - goal) / self.units.unknowns).max())  # noqa: E731
        best: np.ndarray = min(found, key=unknowns_apart)
        return best

    def barrier(self, point: OrbitPoint) -> TestFunction:
        return GRAZING

    def change(self, zero: Zero, point: OrbitPoint) -> Cut | End:
        at = full_point(zero.point) if zero.point.orbit.symmetric else zero.point
        return Cut(zero.point, with_witness(replace(zero, kind=contact_change(at))))

    def beyond(self, cut: Cut, points: list[OrbitPoint]) -> OrbitPoint | End:
        return other_events_side(cut.point)

    def note(self, kind: str, point: OrbitPoint) -> str:
        """At a grazing of several contacts at once, which other orbits begin there."""
        if kind not in (SpecialKind.GR, SpecialKind.SW):
            return super().note(kind, point)
        names = [contact.name for contact in self.system.contact_model.contacts]
        return ", ".join(
            f"orbits {change} an impact of {names[contact]} alone begin there as well"
            for change, contact in families_beside(point)
        )

    @cached_property
    def _excursions_of_cells(self) -> list[tuple[int, int]]:
        """The events at which a contact opens without speed and closes again, each with its number,
        between which contacts that do not act on it have events, as those of cells that move alike.
        """
        events = self.signature.events
        n = len(events)
        found = []
        for i, begin in enumerate(events):
            opens = not begin.is_impact or not (
                begin.closed >> begin.contact & 1 or bounces(self.system, begin.contact)
            )
            for step in range(1, n if opens else 0):
                other = events[(i + step) % n]
                if not self.is_independent(begin.contact, other.contact):
                    if step > 1 and other.contact == begin.contact and other.is_impact:
                        found.append((i, i + step))
                    break
        return found

    def _shortest_excursion_of_cells(self, point: OrbitPoint) -> float:
        """The least duration of such an excursion, in radians of the load."""
        if not self._excursions_of_cells or self.signature.symmetric:
            return math.inf
        phases = self.split(point.solution.unknowns)[1]
        both = np.append(phases, phases + self.closing)
        return float(min(both[last] - both[first] for first, last in self._excursions_of_cells))

    def accepts(self, ahead: OrbitPoint, cut: Callable[[], Cut | End | None]) -> bool:
        """Not where such an excursion is about to vanish: its speed is a power of its duration that
        the equations are scaled with for one contact alone, and would be rounding."""
        return self._shortest_excursion_of_cells(ahead) > SHORTEST_EXCURSION

    def lost_excursion(self, point: OrbitPoint) -> float:
        """The duration, in radians of the load, of an excursion that is too short to be resolved
        in a structure with stiff modes; 0 if there is none.

        Its guard is the gap divided by the duration cubed.
        """
        phases = self.split(point.solution.unknowns)[1]
        apart = np.diff(np.append(phases, phases[:1] + self.closing))
        released = self.plan[: len(phases), SegmentPlan.POWER] == AFTER_RELEASE
        shortest = float(apart[released].min(initial=math.inf))
        return shortest if shortest < self.resolution else 0.0

    def stalled(
        self, point: OrbitPoint, step: float, points: list[OrbitPoint], bounds: Bounds
    ) -> Cut | End | None:
        duration = self.lost_excursion(point)
        if duration > TOLERANCES.switching:
            return Cut(point, _vanishing_excursion(point, points, duration))
        if self._shortest_excursion_of_cells(point) < 2.0 * SHORTEST_EXCURSION:
            return End(OrbitEnd.TWO_AT_ONCE, point.parameter)
        if self._moves_gaps and (refused := refused_beyond(point, step, bounds)) is not None:
            return refused
        limit = point.orbit.motion().limit
        return None if limit is None else End(OrbitEnd.REFUSED, point.parameter, detail=limit)

    def curve_barrier(self, kind: str, point: Any) -> TestFunction:
        follows_a_change = kind in (SpecialKind.GR, SpecialKind.SW)
        value = other_room if follows_a_change else grazing
        return curve_test(SpecialKind[f"{kind}_GR"], value)

    def witnesses(self, solution: Solution) -> list[Witness]:
        natural = self.natural
        names = [contact.name for contact in self.system.contact_model.contacts]
        evaluation: Any = solution.evaluation
        seen = evaluation.seen
        phases = self.split(solution.unknowns)[1]
        events = self.signature.events
        found = list[Witness]()

        def at(s: int, column: int, after: int, what: str, grazes: bool) -> None:
            number = seen[s, column + after]
            name = names[int(number)] if np.isfinite(number) else ""
            found.append(Witness(f"{what} {name}", grazes, float(seen[s, column])))

        for s in range(len(seen)):
            at(s, SegmentExtremes.GAP, 2, "gap of", True)
            at(s, SegmentExtremes.FORCE, 2, "reaction of", False)
            at(s, SegmentExtremes.PULL, 1, "reaction after an event of", False)
            at(s, SegmentExtremes.TAIL, 1, "reaction before an event of", False)
            beside = float(seen[s, SegmentExtremes.BESIDE])
            found.append(Witness("gap at an impact of another contact", False, beside))
        for i, event in enumerate(events):
            slow = event.is_impact and self.plan[i - 1, SegmentPlan.POWER] == 0
            speed = -evaluation.ends[i - 1, SegmentEnd.RATE] if slow else math.inf
            what = f"speed at {names[event.contact]}"
            found.append(Witness(what, True, float(speed / natural.speed)))
        apart = np.diff(np.append(phases, phases[:1] + self.closing))
        for i, (event, duration) in enumerate(zip(events, apart.tolist(), strict=True)):
            following = events[(i + 1) % len(events)]
            what = f"time between {names[event.contact]} and {names[following.contact]}"
            alike = self._independent[i] and abs(duration) <= ONE_INSTANT * self.closing
            found.append(Witness(what, False, math.inf if alike else duration))
        return found

    def touched(self, special: Zero) -> tuple[Signature, np.ndarray] | None:
        """Its own signature: its equations hold on both sides of what vanishes."""
        return special.point.orbit.signature, special.point.solution.unknowns

    def segments_to_prove(self, solution: Solution) -> OrbitSegments | CannotProve:
        return self._to_prove(solution)

    def touching_segments(self, point: OrbitPoint) -> OrbitSegments | CannotProve:
        """An impact that has lost its speed becomes the touch, or the lowest minimum of a gap."""
        solution = point.solution
        _, phases = self.split(solution.unknowns)
        rates = -np.roll(solution.evaluation.ends[:, SegmentEnd.RATE], 1)[: phases.size]
        if phases.size and rates.min() < TOLERANCES.touch * self.natural.speed:
            return self._to_prove(solution, touching=int(np.argmin(rates)))
        return CannotProve("the grazing between the events of several contacts is not proved yet")

    def _to_prove(
        self, solution: Solution, touching: int | None = None
    ) -> OrbitSegments | CannotProve:
        state, phases = self.split(solution.unknowns)
        first = SegmentEnd.NUMBERS + 4 * self.own
        ends = solution.evaluation.ends[:, first : first + 2 * self.own]
        # segment i ends with event i + 1
        before = np.roll(ends, 1, axis=0) if phases.size else state[None]
        if phases.size and self.signature.symmetric:
            before[0] = self.image_of(before[0])
        return contact_segments(
            self.system_at(solution.values),
            self.signature,
            self.mirror,
            phases,
            before,
            self.frequency(solution.values),
            touching,
        )

    def evaluate(
        self,
        unknowns: np.ndarray,
        values: np.ndarray,
        with_extremes: bool = False,
        *,
        later: np.ndarray | None = None,
    ) -> ContactsEvaluation | None:
        frequency, later = self.frequency(values), unknowns if later is None else later
        given = (unknowns, values) if later is unknowns else (unknowns, later, values)
        if not (
            frequency > 0.0
            and all(map(math.isfinite, (x for one in given for x in one.tolist())))
            and self.keeps_gaps(values)
        ):
            return None
        state, phases = self.split(unknowns)
        end, last = (state, phases) if later is unknowns else self.split(later)
        times = np.array([0.0, self.closing])
        if phases.size:
            times = np.concatenate([phases, last[:1] + self.closing])
        times /= frequency
        followed = self._followed(self.plan, times, state, values, with_extremes)
        if followed is not None and with_extremes:
            self._leave_out_alike(followed[3], phases, frequency)
        return None if followed is None else self._assembled(end, times, frequency, *followed)

    def _leave_out_alike(self, seen: np.ndarray, phases: np.ndarray, frequency: float) -> None:
        """Leave out of the reactions between events at one instant those that vanish there because
        their own contacts, which do not act on the event's, are released or closed at this instant.
        """
        events = self.signature.events
        if not self._independent.any():
            return
        near = np.abs(phases[:, None] - phases) <= ONE_INSTANT * self.closing
        acting = [{events[j].contact for j in np.flatnonzero(row)} for row in near]
        first = acting[0]
        if self.signature.symmetric:
            first = {self.images[contact] for contact in first}
        following = [*acting[1:], first]
        own = [event.contact for event in events]
        for column, sets, at_event in (
            (SegmentExtremes.PULL, acting, own),
            (SegmentExtremes.TAIL, following, self.plan[:, SegmentPlan.CONTACT].tolist()),
        ):
            for s in np.flatnonzero(np.isfinite(seen[:, column])):
                contact = int(seen[s, column + 1])
                if contact in sets[s] and self.is_independent(contact, at_event[s]):
                    seen[s, column] = math.inf
        # what opens with another contact has no gap at the start of the segment behind both, where
        # rounding makes minima
        for s in np.flatnonzero(np.abs(seen[:, SegmentExtremes.GAP]) <= GAP_AT_REST):
            after = float(seen[s, SegmentExtremes.GAP + 1]) * frequency - phases[s]
            together = len(acting[s]) > 1 and after <= JUST_OPENED * self.closing
            if together and int(seen[s, SegmentExtremes.GAP + 2]) in acting[s]:
                seen[s, SegmentExtremes.GAP] = math.inf

    def carried_along(
        self, state: np.ndarray, closed: int, times: np.ndarray, values: np.ndarray
    ) -> np.ndarray | None:
        """The state at the second of two times, of the smooth motion from a state at the first,
        with these contacts closed.
        """
        followed = self._followed(no_event(closed), times, state, values, False)
        begin = SegmentEnd.NUMBERS + 4 * self.own
        return (
            None if followed is None else np.asarray(followed[0][0, begin : begin + 2 * self.own])
        )

    @cached_property
    def _units_of_extremes(self) -> np.ndarray:
        """The natural units of length, time and force, and the reaction in these units that is the
        rounding of elastic forces.
        """
        natural = self.natural
        rounding = NEWTON.converged * self.elastic_forces
        return np.array([natural.length, natural.time, natural.force, rounding])

    def _followed(
        self,
        plan: np.ndarray,
        times: np.ndarray,
        state: np.ndarray,
        values: np.ndarray,
        with_extremes: bool,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
        """The arrays that `follow_contact_segments` fills; None where a segment cannot be
        followed.
        """
        parameters = self._values.copy()
        parameters[self._places] = values
        run = self._run
        numbers = run.structure.prepare(parameters, self._records, run.data, run.model.eigenmodes)
        request = (plan, times, state, self._units_of_extremes)
        return self._follower.follow_contacts(numbers, request, with_extremes)

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
        """The residual and its derivatives, by the chain rule from segment to segment; `end` is the
        state asked for at the end.
        """
        own = self.own
        size = self.size
        count = len(self.paths)
        residual = np.zeros(size)
        here = np.zeros((size, size))
        there = np.zeros((size, size))
        parameters = np.zeros((size, count))
        closed_by = (*self._image, frequency, self._place_of_frequency)
        load_contact_equations()(
            (self._free, times, end, *closed_by),
            (ends, columns, maps, seen),
            (residual, here, there, parameters),
        )
        rates = ends[0, SegmentEnd.NUMBERS + 2 * own : SegmentEnd.NUMBERS + 4 * own]
        return ContactsEvaluation(
            residual,
            here,
            there,
            parameters,
            ends,
            self._extremes(seen),
            seen,
            len(self._free),
            rates[self._free] / frequency,
        )

    @cached_property
    def _image(self) -> tuple[np.ndarray, np.ndarray]:
        """The map of the state at the end that closes an orbit, as `contact_equations` takes it:
        that of a mirror image, or none."""
        if not self.signature.symmetric:
            return np.eye(2 * self.own), np.zeros(2 * self.own)
        assert self.mirror is not None, "asked for where the symmetry is known alone"
        return self.mirror.turn_of_state, self.mirror.of(np.zeros(2 * self.own))

    def _extremes(self, seen: np.ndarray) -> np.ndarray:
        """The extremes along the segments, in the columns that orbits with one contact use
        (`flow/one_contact/segments.py`).
        """
        extremes = np.full(
            (len(seen), SegmentColumn.LEAST_MARGIN + max(1, len(self.margins))), np.inf
        )
        extremes[:, SegmentColumn.HIGHEST] = seen[:, SegmentExtremes.TOP]
        extremes[:, SegmentColumn.LOWEST] = seen[:, SegmentExtremes.BOTTOM]
        extremes[:, SegmentColumn.LOWEST_GAP] = seen[:, SegmentExtremes.GAP] * self.natural.length
        extremes[:, SegmentColumn.LOWEST_GAP_TIME] = seen[:, SegmentExtremes.GAP + 1]
        extremes[:, SegmentColumn.CROSSINGS] = 0.0
        extremes[:, SegmentColumn.LEAST_MARGIN :] = seen[:, SegmentExtremes.MARGINS :]
        return extremes

    def start(self, solution: Solution) -> dict[str, Any]:
        """Within the longest segment; for an orbit without events, at phase 0."""
        state, phases = self.split(solution.unknowns)
        values = solution.values
        system = self.system_at(solution.values)
        if not phases.size:
            return {
                **arguments_of(system, self._with_held(state, self.signature.closed, values)),
                "time": 0.0,
            }
        times = np.append(phases, phases[0] + self.closing) / self.frequency(values)
        longest = int(np.argmax(np.diff(times)))
        begin = solution.evaluation.ends[
            longest, SegmentEnd.NUMBERS : SegmentEnd.NUMBERS + 2 * self.own
        ]
        part = times[longest] + np.array([0.0, START_SHARE]) * (times[longest + 1] - times[longest])
        there = self.carried_along(begin, int(self.plan[longest, SegmentPlan.ALONG]), part, values)
        assert there is not None, "an orbit's own segments can be followed"
        return {**arguments_of(system, there), "time": float(part[1])}

    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        signature = self.signature
        unknowns = solution.unknowns
        events = signature.events
        half = len(signature.events) // 2
        odd = signature.period % 2
        if signature.symmetric or signature.closed or (odd and not mirrored):
            return None
        if not events:
            found = self.halved.evaluate(unknowns, solution.values)
            return None if found is None else np.stack([unknowns, unknowns + found.residual])
        image = tuple(event.image(self.images) for event in events[:half]) if odd else events[:half]
        if len(events) % 2 or events[half:] != image:
            return None
        state, phases = self.split(unknowns)
        place = SegmentEnd.NUMBERS + 8 * self.own
        later = solution.evaluation.ends[half - 1, place : place + 2 * self.own]
        later = self.image_of(later) if odd else later
        first = self.joined(state, phases[:half])
        second = self.joined(later, phases[half:] - np.pi * signature.period)
        return np.stack([first, second])

    def _with_held(self, state: np.ndarray, closed: int, values: np.ndarray) -> np.ndarray:
        """A state put exactly onto the contacts that are closed, and onto those that it touches
        without speed, up to rounding.
        """
        for place, value in held_values(
            self.system_at(values), state, TOLERANCES.touch, closed, self.natural.state
        ).items():
            state[place] = value
        return state


def no_event(closed: int) -> np.ndarray:
    """The plan of one segment without an event at its end."""
    return np.array([[closed, -1, -1, closed, 0, -1]], dtype=np.int64)


def _has_moving_mass(model: Any) -> bool:
    """Whether the mass matrix depends on time, as a wall moves and M on what it moves."""
    size = len(model.coordinates)
    # any
    one, other = (
        mass_rows(model, x if size == 1 else tuple(x / (1 + i) for i in range(size)))
        for x in (0.13, 0.21)
    )
    return getattr(model, "has_moving_walls", False) and bool(np.not_equal(one, other).any())


def _vanishing_excursion(point: OrbitPoint, points: list[OrbitPoint], duration: float) -> Zero:
    """The change of events at which an excursion vanishes, from the last point at which it could be
    solved for: its duration falls as the root of the parameter's distance.
    """
    left = math.inf
    equations: Any = point.orbit.equations
    for before in reversed(points):
        if before.orbit.signature != point.orbit.signature:
            break
        longer = equations.lost_excursion(before)
        if longer > 1.1 * duration:
            passed = abs(point.parameter - before.parameter)
            left = passed * duration**2 / (longer**2 - duration**2)
            break
    evidence = Evidence(
        point.orbit.residual, (left,), duration, 0.0, duration, "duration of an excursion"
    )
    return Zero(SpecialKind.SW, point, evidence)
