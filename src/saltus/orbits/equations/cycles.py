"""Cycles of systems on which nothing acts that varies with time, x = Phi(x, T): their period is an
unknown.

The unknowns are the state at a section and the time of a round, of which the signature counts the
period. The section is the plane through a state of the orbit, far from its events, to which the
flow there is orthogonal in natural units: the last equation says that the state lies in it. The
motion Phi may have any events. The multiplier 1 of the flow's own direction is left out: the
multipliers are those of the return map of the section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from saltus.continuation import Units, Zero
from saltus.errors import MotionError, ParameterError
from saltus.flow import Motion, MotionRequest, state_rates
from saltus.orbits.contract.equations import (
    ORBIT_TOLERANCE,
    MotionToRead,
    OrbitEquations,
    Solution,
)
from saltus.orbits.contract.event_sequence import SETTINGS as EVENTS
from saltus.orbits.contract.event_sequence import (
    EventSequence,
    held_at,
    relays_at,
    relays_over_round,
    section_time,
)
from saltus.orbits.equations.whole_motion import WholeMotionEquations, WholeMotionEvaluation
from saltus.orbits.segments.segments import CannotProve, OrbitSegments
from saltus.orbits.signature import Signature
from saltus.systems import System
from saltus.taylor import ordered

# The parts of a step at whose ends the distance from a section is compared; a part at which it
# rises through 0 is halved so many times.
PARTS = 8
HALVINGS = 60
# How near to the ends of a step it is looked at, as a share of the step: the motion jumps there at
# some of them.
WITHIN = 1e-12
# The least cosine of the angle, in natural units, between the flow and the normal of its section: at
# a right angle of the two, where a branch would turn back, there is no return map.
LEAST_STRAIGHT = 0.5
# Along a branch whose period grows by a natural time while the parameter changes by this share of
# its range, the orbits pass an equilibrium if the state is as slow there, in natural units.
CONNECTED = 1e-7
SLOW = 1e-4
# the least ratio of the squares of sizes by which two orbits count as two
APART = 1.1
# Parameters leave that of a birth as a power of the size of the cycle. The square is generic; a
# damping that grows with the speed itself gives 1. Another power than 2 is taken if it misses a
# fourth orbit by a much smaller share.
POWERS = (2, 1, 3, 4)
CLEARLY = 0.01


class CycleEquations(WholeMotionEquations):
    """The equations x = Phi(x, T) of a cycle, with its period as an unknown."""

    has_forcing = False

    @classmethod
    def solves(cls, system: System, signature: Signature) -> bool:
        return system.load.frequency is None

    @classmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        """With a section chosen along the motion, which lasts twice a guess of the period."""
        twice = motion.twice
        if twice.limit is not None or not twice.phase_known:
            return None
        signature, state = _section_along(base, twice, motion.periods, motion.duration)
        return base.with_signature(signature), np.append(state, motion.duration / motion.periods)

    def section_along(self, motion: Motion, solution: Solution) -> tuple[Signature, np.ndarray]:
        signature, state = _section_along(self, motion, self.signature.period)
        return signature, np.append(state, solution.unknowns[-1])

    @cached_property
    def following(self) -> np.ndarray:
        """Coordinates on which nothing depends may drift along a cycle, too, as the height of a toy
        that slides down its rod.
        """
        drifting = drifting_coordinates(self._run.trace)
        return np.union1d(super().following, drifting).astype(int)

    @property
    def size(self) -> int:
        return 2 * self.own + 1

    @cached_property
    def units(self) -> Units:
        natural = self.natural
        return Units(
            np.append(natural.state, natural.time), np.append(natural.state, 1.0), self.is_phase
        )

    @cached_property
    def is_velocity(self) -> np.ndarray:
        places = np.arange(self.size)
        return np.asarray((places >= self.own) & (places < 2 * self.own))

    @property
    def multiplier_count(self) -> int:
        return super().multiplier_count - 1

    @cached_property
    def _plane(self) -> tuple[np.ndarray, np.ndarray]:
        """The state in the section and the derivatives of the distance from it, in natural
        units."""
        return tuple(np.split(np.array(self.signature.through), 2))  # type: ignore[return-value]

    def section_time(self, values: np.ndarray) -> float:
        return 0.0

    def frequency(self, values: np.ndarray) -> float:
        """There is none that the parameters tell."""
        return math.nan

    def frequency_of(self, solution: Solution) -> float:
        return 2.0 * math.pi / float(solution.unknowns[-1])

    def period_of(self, solution: Solution) -> float:
        return self.signature.period * float(solution.unknowns[-1])

    def lasting(self, solution: Solution, rounds: float) -> dict[str, Any]:
        return {"duration": rounds * float(solution.unknowns[-1])}

    def _lasting(self, unknowns: np.ndarray) -> dict[str, float | None]:
        return {"periods": None, "duration": self.signature.span * float(unknowns[-1])}

    def _may_solve(self, unknowns: np.ndarray, values: np.ndarray) -> bool:
        return bool(
            unknowns[-1] > 0.0 and np.isfinite(unknowns).all() and np.isfinite(values).all()
        )

    def held(self, unknowns: np.ndarray, system: System) -> dict[int, float]:
        return super().held(unknowns[: 2 * self.own], system)

    def start_state(self, unknowns: np.ndarray, system: System) -> np.ndarray:
        return super().start_state(unknowns[: 2 * self.own], system)

    def _apart(self, after: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        state, normal = self._plane
        distance = normal @ (unknowns[:-1] - state)
        return np.append(after - unknowns[:-1], distance)

    def _evaluation(
        self, motion: Motion, after: np.ndarray, unknowns: np.ndarray, slopes: np.ndarray
    ) -> WholeMotionEvaluation:
        state = super()._evaluation(motion, after, unknowns, slopes)
        n = len(after)
        rates = state_rates(motion)
        rates[self.following] = 0.0
        here = np.zeros((1, n + 1, n + 1))
        there = np.zeros((1, n + 1, n + 1))
        here[0, :n, :n] = state.here[0]
        here[0, :n, n] = self.signature.span * rates
        here[0, n, :n] = self._plane[1]
        there[0, :n, :n] = state.there[0]
        parameters = np.vstack([state.parameters, np.zeros((1, state.parameters.shape[1]))])
        return replace(state, here=here, there=there, parameters=parameters)

    def _seen_from_section(self, events: EventSequence, motion: Motion) -> EventSequence:
        """The section is moved, too, where the flow crosses it at a small angle."""
        flow = direction_at(motion, motion.start, self)
        units = self.natural.state
        straight = float((flow * units) @ (self._plane[1] * units))  # 1 at a right angle
        share = (straight - LEAST_STRAIGHT) / (1.0 - LEAST_STRAIGHT)
        least = EVENTS.section_distance
        slanted = least + (0.5 - least) * share
        return replace(events, section_distance=min(events.section_distance, slanted))

    def stretch(self, solution: Solution) -> float:
        """Also of coordinates of first order, by their rates."""
        rates = self._flow(solution.evaluation) / self.signature.span
        largest = np.abs(rates * self.natural.time / self.natural.state)[: self.own].max()
        return max(super().stretch(solution), float(largest))

    def _middle(self, state: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        return np.append(state, unknowns[-1])

    def _flow(self, evaluation: Any) -> np.ndarray:
        """The derivatives of the state after the motion to the time of a round."""
        n = 2 * self.own
        return np.asarray(evaluation.here[0, :n, n])

    def family(self, solution: Solution) -> tuple[OrbitEquations, np.ndarray, np.ndarray]:
        """The equations of the cycles of all energies along their period, with the unknowns and the
        period of one of them.
        """
        if self.system.dependent:
            raise ParameterError(
                "families of a system with more gaps than coordinates are not followed yet", "orbit"
            )
        equations = FamilyEquations(self.given, self.signature, (PERIOD,), self.tol)
        return equations, np.append(solution.unknowns[:-1], 0.0), solution.unknowns[-1:]

    def return_map(self, evaluation: Any) -> np.ndarray:
        n = 2 * self.own
        normal = self._plane[1]
        matrix = evaluation.here[0]
        flow = self._flow(evaluation)
        flow = flow / (normal @ flow)
        back = matrix[:n, :n] - np.outer(flow, normal @ matrix[:n, :n])
        kept = np.delete(np.arange(n), self.following)
        units = self.natural.state[kept]
        # an orthonormal basis of the section, in natural units
        basis = np.linalg.svd((normal[kept] * units)[None])[2][1:].T
        return np.asarray(basis.T @ (back[np.ix_(kept, kept)] * units / units[:, None]) @ basis)

    def alternating(self, direction: np.ndarray) -> np.ndarray:
        """The mean time of the two rounds stays."""
        return np.append(direction[:-1], 0.0)

    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        return None if self.signature.period % 2 else super().halves(solution, False)

    def counted_twice(self, solution: Solution) -> tuple[OrbitEquations, np.ndarray] | None:
        rounds = replace(self.signature, period=2 * self.signature.period)
        unknowns = np.append(solution.unknowns[:-1], 0.5 * solution.unknowns[-1])
        return self.with_signature(rounds), unknowns

    least_size = 1e-3  # the parameter of its birth is extrapolated from larger ones

    def size_of(self, orbit: Any) -> float:
        """The largest way of a coordinate, from its least to its largest value."""
        ways = np.ptp(orbit.followed.extrema, axis=1)
        return float((ways / self.natural.lengths).max() * self.natural.length)

    def relays_meet(self, points: list[Any]) -> float | None:
        if not self.signature.relays:
            return None
        known = {p.parameter: gap for p in points[-8:] if (gap := hysteresis_of(p.orbit.followed))}
        if len(known) < 2:
            return None
        (before, wide), (last, narrow) = list(known.items())[-2:]
        return float(last - narrow * (last - before) / (narrow - wide)) if narrow < wide else None

    def birth(self, points: list[Any]) -> float | None:
        """A parabola in a power of the size, through three orbits: smaller ones have an error of
        rounding by their size. The power is 2, or that which tells a fourth orbit much better.
        """
        parameters = {self.size_of(point.orbit): point.parameter for point in points[-8:]}
        sizes: list[float] = []
        for size in sorted(parameters):  # one orbit may be there at two sections
            smallest = self.least_size * self.natural.length
            if size > max([smallest, *(math.sqrt(APART) * other for other in sizes)]):
                sizes.append(size)
        if len(sizes) < 3:
            return float(points[-1].parameter)
        power = 2
        if len(sizes) > 3:
            fourth = sizes[3]
            misses = {
                power: abs(_extrapolated(parameters, sizes[:3], power, fourth) - parameters[fourth])
                for power in POWERS
            }
            best = min(POWERS, key=misses.__getitem__)
            power = best if misses[best] < CLEARLY * misses[2] else 2
        return _extrapolated(parameters, sizes[:3], power, 0.0)

    def connection(self, points: list[Any]) -> float | None:
        """Where p - p* falls as exp(-rate T), by the slopes between three orbits."""
        last = points[-1]
        near = CONNECTED * last.curve.scales[0]
        chosen = [last]  # half a natural time apart
        for point in reversed(points):
            if abs(point.parameter - last.parameter) > near:
                return None
            if chosen[-1].orbit.duration - point.orbit.duration > 0.5 * self.natural.time:
                chosen.append(point)
            if len(chosen) == 3:
                break
        if len(chosen) < 3 or slowest(last.orbit.followed, self) > SLOW:
            return None
        values = np.array([point.parameter for point in chosen])
        periods = np.array([point.orbit.duration for point in chosen])
        slope, slope_before = np.diff(values) / np.diff(periods)
        middle, middle_before = periods[:-1] + 0.5 * np.diff(periods)
        if not slope_before / slope > 1.0:
            return float(values[0])
        rate = math.log(slope_before / slope) / (middle - middle_before)
        return float(values[0] + slope * math.exp(-rate * (periods[0] - middle)) / rate)

    def lost_ahead(self, point: Any) -> Zero | None:
        return None

    def segments_to_prove(self, solution: Solution) -> OrbitSegments | CannotProve:
        return CannotProve("cycles without a load, whose period is an unknown, are not proved yet")

    def unknowns_at(
        self, target: Signature, unknowns: np.ndarray, values: np.ndarray, near: np.ndarray
    ) -> np.ndarray | None:
        """Where the orbit crosses the section of another signature in its direction, nearest to
        `near`."""
        if self.evaluate(unknowns, values) is None or self._latest is None:
            return None
        found = self._latest[1]
        if found is None:
            return None
        motion = found[0]
        state, normal = np.split(np.array(target.through), 2)
        crossings = passages(motion, state, normal)
        if not crossings.size:
            return None
        states = states_of(motion, crossings)
        states[:, self.following] = 0.0
        apart = np.abs((states - near[:-1]) / self.natural.state).max(axis=1)
        if target.relays:
            apart[(relays_at(motion, crossings) != target.relays).any(axis=1)] = math.inf
        if not np.isfinite(apart).any():
            return None
        return np.append(states[apart.argmin()], unknowns[-1])


PERIOD = "period"  # the path of a family's parameter


@dataclass(eq=False)
class FamilyEvaluation(WholeMotionEvaluation):
    """The equations of a family at one point, with the flow through its section."""

    flow: np.ndarray  # (n,): the derivatives of the residual to the period

    def jacobian(self, closing: float = 1.0) -> np.ndarray:
        """Perturbations that change their sign each round may move along the flow."""
        matrix = super().jacobian(closing)
        if closing < 0.0:
            matrix[: len(self.flow), -1] = self.flow
        return matrix


class FamilyEquations(CycleEquations):
    """The cycles of a system without loss, of which there is one for each energy, along their
    period: x = Phi(x, T) + d w, with T as the parameter and the unknowns x and d.

    As energy is kept one of the equations follows from the others. The number d in its place is 0:
    a push w along the gradient of the energy would change the energy in each round.
    """

    def __init__(
        self,
        system: System,
        signature: Signature,
        paths: tuple[str, ...] = (PERIOD,),
        tol: float = ORBIT_TOLERANCE,
    ) -> None:
        super().__init__(system, signature, (), tol)
        self.paths = paths

    @classmethod
    def solves(cls, system: System, signature: Signature) -> bool:
        return False  # they are those of a path alone

    @property
    def model_paths(self) -> tuple[str, ...]:
        return ()

    def given_at(self, values: np.ndarray) -> System:
        return self.given

    @cached_property
    def units(self) -> Units:
        state = self.natural.state
        return Units(np.append(state, 1.0), np.append(state, 1.0), self.is_phase)

    @cached_property
    def _push(self) -> np.ndarray:
        """w: (-a, v) at the section in natural units, along which an energy v^2 / 2 + V grows."""
        units = self.natural.state
        flow = self._plane[1] * units
        return np.asarray(np.append(-flow[self.own :], flow[: self.own]) * units)

    def frequency_of(self, solution: Solution) -> float:
        return 2.0 * math.pi / float(solution.values[-1])

    def period_of(self, solution: Solution) -> float:
        return self.signature.period * float(solution.values[-1])

    def lasting(self, solution: Solution, rounds: float) -> dict[str, Any]:
        return {"duration": rounds * float(solution.values[-1])}

    def _may_solve(self, unknowns: np.ndarray, values: np.ndarray) -> bool:
        return super()._may_solve(np.append(unknowns, values), values)

    def _request(
        self,
        system: System,
        unknowns: np.ndarray,
        values: np.ndarray,
        paths: tuple[str, ...] | None,
    ) -> tuple[MotionRequest, Any]:
        with_period = np.append(unknowns[:-1], values[-1])
        return super()._request(system, with_period, values[:0], paths)

    def _apart(self, after: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        return super()._apart(after + unknowns[-1] * self._push, unknowns)

    def _evaluation(
        self, motion: Motion, after: np.ndarray, unknowns: np.ndarray, slopes: np.ndarray
    ) -> WholeMotionEvaluation:
        found = super()._evaluation(motion, after, unknowns, slopes)
        n = len(after)
        by_period = found.here[0, :, n].copy()
        found.here[0, :n, n] = self._push
        known = {each.name: getattr(found, each.name) for each in fields(found)}
        return FamilyEvaluation(**known | {"parameters": by_period[:, None]}, flow=by_period[:n])

    def _flow(self, evaluation: Any) -> np.ndarray:
        return np.asarray(evaluation.flow)

    def family(self, solution: Solution) -> tuple[OrbitEquations, np.ndarray, np.ndarray]:
        return self, solution.unknowns, solution.values

    def counted_twice(self, solution: Solution) -> tuple[OrbitEquations, np.ndarray] | None:
        return None  # its parameter is the time of a round


def _extrapolated(
    parameters: dict[float, float], sizes: list[float], power: int, size: float
) -> float:
    """The parameter of the orbit of a size, on the polynomial in a power of the size through the
    orbits of some sizes."""
    value = 0.0
    for own in sizes:
        weight = math.prod(
            (size**power - other**power) / (own**power - other**power)
            for other in sizes
            if other != own
        )
        value += parameters[own] * weight
    return value


def drifting_coordinates(trace: Any) -> list[int]:
    """The coordinates on which no equation of a trace depends, though their rates may enter; none
    of a structure, whose modes are no expressions.
    """
    if trace.modes is not None:
        return []
    roots = [*trace.acceleration, *trace.reactions, *trace.contact_numbers]
    roots += [*trace.margins.values(), *trace.limits.values()]
    places = {node.value for node in ordered(roots) if node.op == "coordinate"}
    if not trace.rows:  # the gaps are coordinates themselves
        places |= {*trace.contact_coordinates}
        places |= {part.coordinate for part in trace.sided if part.is_surface}
    return [i for i in range(trace.dof - trace.first_order) if i not in places]


def _section_along(
    equations: OrbitEquations, motion: Motion, rounds: int, duration: float | None = None
) -> tuple[Signature, np.ndarray]:
    """The signature of a cycle with a section far from the events of a motion, and the state
    there.

    Raises
    ------
    MotionError
        The motion does not move there.
    """
    time = section_time(motion, duration)
    state = states_of(motion, np.array([time]))[0]
    normal = direction_at(motion, time, equations)
    state[equations.following] = 0.0
    through = (*state.tolist(), *normal.tolist())
    held = held_at(motion, time)
    relays: tuple[int, ...] = tuple(relays_at(motion, np.array([time]))[0].tolist())
    if duration is not None:  # the motion is no cycle yet
        relays = relays_over_round(motion, time, duration)
    return Signature((), rounds, closed=held, section=0.0, through=through, relays=relays), state


def direction_at(motion: Motion, time: float, equations: OrbitEquations) -> np.ndarray:
    """The derivatives, (2 n,), of the distance in natural units from the plane that the flow of a
    motion crosses orthogonally at a time.

    Raises
    ------
    MotionError
        The motion stands still there.
    """
    assert motion.dense is not None
    at = np.array([time])
    velocity = motion.dense.states(at)[1][:, 0]
    rates = np.append(velocity, motion.dense.accelerations(at)[:, 0])
    rates[equations.following] = 0.0
    scaled = rates / equations.natural.state
    size = float(np.linalg.norm(scaled))
    if not size > 0.0:
        raise MotionError(
            "the motion comes to an equilibrium, which is no cycle; start farther from it"
        )
    return np.asarray(scaled / size / equations.natural.state)


def slowest(motion: Motion, equations: OrbitEquations) -> float:
    """The least speed of a motion's state, in natural units and times."""
    dense = motion.dense
    assert dense is not None
    shares = np.linspace(0.0, 1.0, PARTS + 1).clip(WITHIN, 1.0 - WITHIN)
    times = (dense.start[:, None] + dense.length[:, None] * shares).ravel()
    rates = np.concatenate([dense.states(times)[1], dense.accelerations(times)])
    rates[equations.following] = 0.0
    natural = equations.natural
    return float(np.linalg.norm(rates.T / natural.state, axis=1).min() * natural.time)


def hysteresis_of(motion: Motion) -> float | None:
    """How far, where a relay is set by one of its functions, the other one is below 0: the mean over
    its events, of the relay with the least; None without such events."""
    system = motion.system
    model: Any = system.contact_model
    found = []
    events: Any = motion.events
    for number, relay in enumerate(model.relays):
        times = np.array([event.time for event in events if event.contact == relay.name])
        if not times.size:
            continue
        sides = relays_at(motion, times)[:, number]
        values = [
            -side * float(relay.guard(model, side, time, *motion.at(time), system.load))
            for time, side in zip(times.tolist(), sides, strict=True)
        ]
        found.append(-float(np.mean(values)))
    return min(found, default=None)


def states_of(motion: Motion, times: np.ndarray) -> np.ndarray:
    """The states of a motion at times (n,), (n, d)."""
    position, velocity = motion.at(times)
    return np.concatenate([np.atleast_2d(position), np.atleast_2d(velocity)]).T.copy()


def passages(motion: Motion, state: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The times at which a motion crosses the plane through a state in the direction of its normal
    (derivatives of the distance), between its events.
    """
    dense = motion.dense
    assert dense is not None
    share = np.linspace(0.0, 1.0, PARTS + 1).clip(WITHIN, 1.0 - WITHIN)
    times = dense.start[:, None] + dense.length[:, None] * share
    distances = (states_of(motion, times.ravel()) - state) @ normal
    distances = distances.reshape(times.shape)
    rises = (distances[:, :-1] < 0.0) & (distances[:, 1:] >= 0.0)
    low = times[:, :-1][rises]
    high = times[:, 1:][rises]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if not middle.size:
            break
        below = (states_of(motion, middle) - state) @ normal < 0.0
        low = np.where(below, middle, low)
        high = np.where(below, high, middle)
    return np.asarray(high)
