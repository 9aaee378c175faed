"""Curves of special points in two parameters: borders at which the number of orbits, or the
stability of orbits, changes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.checks import check_bounds, check_count, check_step
from saltus.continuation import STEPS, Continuation, Cut, End, TestFunction, both_ways
from saltus.errors import ParameterError
from saltus.orbits.beyond.conditions import Condition, Singular, Slow, curve_tests
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.beyond.special_point import OrbitEnd, SpecialKind, SpecialPoint
from saltus.orbits.beyond.symmetry import divide, half, keeps_symmetry
from saltus.orbits.beyond.vanishing import (
    Vanishing,
    other_witnesses,
    pair_on_circle,
    witness_vanishes,
)
from saltus.orbits.branches.branch_continuation import STEP
from saltus.orbits.branches.branch_events import OrbitEvents
from saltus.orbits.branches.special_curve import (
    ConditionedCurve,
    SpecialCurve,
    SpecialCurvePoint,
    without_condition,
)
from saltus.orbits.contract.equations import OrbitEquations
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES
from saltus.progress import Progress, silent
from saltus.systems import check_path, check_system

FOLLOWED = (
    SpecialKind.LP,
    SpecialKind.PD,
    SpecialKind.BPC,
    SpecialKind.NS,
    SpecialKind.GR,
    SpecialKind.SW,
)
# The witness of a change of events is at most this at an orbit beside it, in natural units.
VANISHES = 1e-3
# a parameter without bounds is followed up to its value times this, and down to its value divided
# by this
TENFOLD = 10.0


@dataclass
class CurveEvents(OrbitEvents):
    """The events along a curve of special points of a kind."""

    kind: str

    def interrupted(
        self, run: Continuation, point: SpecialCurvePoint, ahead: SpecialCurvePoint
    ) -> End | None:
        """The end where the system refuses the parameters."""
        try:
            ahead.curve.equations.system_at(ahead.parameters)
        except ParameterError as refusal:
            return End(OrbitEnd.REFUSED, point.parameter, detail=str(refusal))
        return None

    def barrier(self, point: Any) -> TestFunction:
        """Another grazing, or another change of the events of an orbit with several contacts or
        friction.
        """
        barrier: TestFunction = point.orbit.equations.curve_barrier(self.kind, point)
        return barrier

    def cut(self, point: SpecialCurvePoint, ahead: SpecialCurvePoint) -> Cut | End | None:
        """The cut where the orbit's events change, with the codimension-two point there; without a
        special point where only an event comes to its section."""
        found = super().cut(point, ahead)
        if not isinstance(found, Cut) or found.special is None or isinstance(point.condition, Slow):
            return found
        if isinstance(point.condition, Vanishing) and point.condition.number >= 0:
            return Cut(found.point, replace(found.special, kind=_second_change(found.point)))
        zero = replace(found.special, point=without_condition(found.point))
        before = without_condition(point)
        there = point.orbit.equations.change(zero, before)
        if isinstance(there, End):
            return there
        if there.special is None:
            return Cut(found.point, None)
        grazes = there.special.kind == SpecialKind.GR or there.special.kind.endswith("-GR")
        kind = SpecialKind[f"{self.kind}_GR" if grazes else f"{self.kind}_SW"]
        return Cut(found.point, replace(found.special, kind=kind))

    def across(self, run: Continuation, cut: Cut) -> SpecialCurvePoint | End:
        """The end at another change of events; or, where an event comes to the section, the same
        point at another section, from which the curve goes on."""
        if cut.special is None:
            return _from_another_section(cut.point) or End(OrbitEnd.NO_SECTION, cut.point.parameter)
        reason = (
            OrbitEnd.MEETS_CHANGE if cut.special.kind.endswith("SW") else OrbitEnd.MEETS_GRAZING
        )
        return End(reason, cut.point.parameter, cut.special.kind)

    def ended(self, run: Continuation, ahead: Any, cut: Cut | None) -> End | None:
        """The end of an orbit that has shrunk to rest, unless the step ends at another grazing."""
        return super().ended(run, ahead, cut) if cut is None else None

    def tests(self, point: SpecialCurvePoint) -> Iterable[TestFunction]:
        follows_a_witness = isinstance(point.condition, Vanishing)
        return [] if follows_a_witness else curve_tests(self.kind, point.orbit.symmetric)


def continue_special(
    special: SpecialPoint,
    path: str,
    bounds: tuple[float, float] | None = None,
    *,
    first_bounds: tuple[float, float] | None = None,
    step: float = STEP,
    most_points: int = STEPS.most_points,
    progress: Progress = silent,
) -> SpecialCurve:
    """The curve of LP, PD, BPC, NS, GR or SW through a special point of a branch, in the branch's
    parameter and a second one.

    It is followed both ways, through cusps, until it closes, reaches a bound, meets another grazing
    or cannot go on. At a PD or BPC the curve has the orbits that lose their stability, not those
    that are born there.

    Parameters
    ----------
    special
        Where to begin, one of `branch.special`.
    path
        Dotted path of the second parameter, such as "load.horizontal.amplitude".
    bounds
        Its least and largest value; by default from a tenth to ten times its present value (from -1
        to 1 if that is 0).
    first_bounds
        The bounds of the branch's own parameter; by default as far to both sides as the branch's
        range was wide, but not below a tenth of its present value.
    step
        The longest step, in the norm of `OrbitCurve`.
    most_points
        The number of points in each direction after which the curve ends, with this as its reason.
    progress
        Called with the share of the first range that has been seen and the values of both
        parameters.

    Raises
    ------
    ParameterError
        The special point is of another kind; the parameter is unknown, or the branch's own; the
        bounds exclude the point; or the second parameter breaks the symmetry that a BPC, a PD or a
        grazing of a symmetric orbit needs.

    Examples
    --------
    >>> fold = next(point for point in branch.special if point.kind == "LP")
    >>> curve = saltus.continue_special(fold, "load.horizontal.amplitude", (0.15, 0.6))
    >>> next(str(point.kind) for point in curve.special)  # the two folds meet in a cusp
    'CP'
    """
    check_step(step)
    check_count("most_points", most_points, 1)
    if special.kind not in FOLLOWED:
        raise ParameterError(
            f"curves are followed from {', '.join(FOLLOWED)}, not from {special.kind}", "special"
        )
    changes = special.kind in (SpecialKind.GR, SpecialKind.SW)
    if changes and special.orbit.equations.touched(special) is None:
        raise ParameterError(
            "of orbits with friction, surfaces, dependent gaps, loads with corners or impacts that"
            f" die away curves are followed of LP, PD, BPC and NS, not of {special.kind}; continue"
            " an orbit at several values of the second parameter instead",
            "special",
        )
    if special.kind == SpecialKind.GR and special.orbit.equations.passes_contact:
        raise ParameterError(
            "this GR is not a singularity, as neither the velocity nor the acceleration changes "
            "at the contact; choose an LP, PD or BPC",
            "special",
        )
    first_path = special.orbit.equations.paths[0]
    system = special.orbit.system
    check_system(system, "continue_special", several_contacts=True, switches=True)
    if path == first_path:
        raise ParameterError(
            f"the branch already runs along {path}; name another parameter to follow its"
            f" {special.kind} in",
            "path",
        )
    check_path(system, path)
    limits = _limits(special, system.parameters[path], bounds, first_bounds)
    start = _start(special, (first_path, path), limits)
    bounds_of = {first_path: limits[0], path: limits[1]}
    steps = replace(STEPS, longest=step, most_points=most_points)
    course = both_ways(start, lambda: CurveEvents(special.kind), bounds_of, steps, progress)
    return SpecialCurve(**vars(course), kind=special.kind, paths=(first_path, path))


def _limits(
    special: SpecialPoint, value: float, bounds: Any, first_bounds: Any
) -> list[tuple[float, float]]:
    """The bounds of both parameters, which must include the point."""
    own = special.parameter
    width = 3.0 * special.point.curve.scales[0]
    low = own - width
    high = own + width
    if first_bounds is None:
        first_bounds = (
            (max(low, own / TENFOLD), high)
            if own > 0
            else (low, min(high, own / TENFOLD) if own < 0 else high)
        )
    if bounds is None:
        bounds = sorted((value / TENFOLD, value * TENFOLD)) if value else (-1.0, 1.0)
    limits = [check_bounds(first_bounds, "first_bounds"), check_bounds(bounds)]
    for (low, high), inside, name in zip(limits, (own, value), ("first", "second"), strict=True):
        if not low <= inside <= high:
            raise ParameterError(
                f"the special point has {inside:g} as its {name} parameter, outside ({low:g},"
                f" {high:g}); widen it"
            )
    return limits


def _start(
    special: SpecialPoint, paths: tuple[str, str], limits: list[tuple[float, float]]
) -> SpecialCurvePoint:
    """The special point as a point of its curve."""
    scales = tuple((high - low) / 3.0 for low, high in limits)
    orbit, condition = _defined(special, paths, scales)
    curve = ConditionedCurve(orbit.equations, scales, condition=condition)
    exact = curve.along_condition(orbit)
    if exact is None:
        raise ParameterError(
            f"Newton's method does not find this {special.kind} again, or the motion beside it"
            " cannot be followed; locate it on its branch with a smaller step, or choose another"
        )
    return exact


def _from_another_section(point: SpecialCurvePoint) -> SpecialCurvePoint | None:
    """The same point with the section at a phase farther from all events, to be followed in the
    same direction as before.
    """
    condition = point.condition
    equations = point.orbit.equations
    orbit = equations.at_another_section(point.orbit)
    if orbit is None:
        return None
    scales = point.curve.scales
    moved = (
        Singular.near(orbit, condition.closing)
        if isinstance(condition, Singular)
        else pair_on_circle(orbit, scales)
    )
    curve = ConditionedCurve(orbit.equations, scales, condition=moved)
    there = curve.along_condition(orbit)
    k = len(point.parameters)
    if there is None:
        return None
    ahead = float(there.tangent[-k:] @ (curve.weights[-k:] ** 2 * point.tangent[-k:])) > 0.0
    turned: SpecialCurvePoint = there if ahead else there.turned()
    return turned


def _second_change(point: SpecialCurvePoint) -> SpecialKind:
    """The kind of a point at which, along a curve of changes of an orbit's events, another witness
    vanishes.
    """
    assert isinstance(point.condition, Vanishing)
    own = point.orbit.equations.witnesses(point.solution)[point.condition.number]
    others = other_witnesses(point)
    least = min(others, key=lambda witness: abs(witness.value), default=own)
    kinds = {2: SpecialKind.GR_GR, 1: SpecialKind.SW_GR, 0: SpecialKind.SW_SW}
    return kinds[int(own.grazes) + int(least.grazes)]


def _changing(
    special: SpecialPoint, paths: tuple[str, str], scales: tuple[float, ...]
) -> tuple[PeriodicOrbit, Condition | Vanishing]:
    """The orbit of a change of events with several contacts, and the condition that its witness
    vanishes. Where two events come together the witness is one of the orbits on the other side.

    Raises
    ------
    ParameterError
        There is none on either side.
    """
    system = special.orbit.system
    beyond = special.orbit.equations.beyond(Cut(special.point, special), [])
    for point in (special.point, beyond):
        if not isinstance(point, OrbitPoint):
            continue
        equations = equations_of(system, point.orbit.signature, paths)
        values = np.array([point.parameter, system.parameters[paths[1]]])
        orbit = _evaluated(equations, point.orbit.solution.unknowns, values)
        known = orbit.equations.witnesses(orbit.solution)
        numbers = [
            i
            for i, witness in enumerate(known)
            if witness.grazes == (special.kind == SpecialKind.GR)
            and not witness.what.startswith("time between")
        ]
        number = min(numbers, key=lambda i: abs(known[i].value), default=None)
        if number is not None and abs(known[number].value) < VANISHES:
            return orbit, witness_vanishes(orbit, scales, number)
    raise ParameterError(
        f"at this {special.kind} two events coincide, and curves of such points are not followed "
        f"yet;"
        " continue an orbit at several values of the second parameter instead",
        "special",
    )


def _defined(
    special: SpecialPoint, paths: tuple[str, str], scales: tuple[float, ...]
) -> tuple[PeriodicOrbit, Condition | Vanishing]:
    """The orbit as a solution of the problem along both parameters, and the condition of its
    special point.
    """
    kind = special.kind
    old = special.orbit.equations
    unknowns = special.orbit.solution.unknowns
    system = special.orbit.system
    values = np.array([special.parameter, special.orbit.system.parameters[paths[1]]])
    symmetric = keeps_symmetry(system, paths[0]) and keeps_symmetry(system, paths[1])
    if old.signature.symmetric and not symmetric and kind != SpecialKind.LP:
        raise ParameterError(
            f"{paths[1]} takes away the mirror symmetry on which this {kind} rests; change it a"
            " little, follow the branch again, and continue the special points into which this one"
            " splits"
        )
    if kind in (SpecialKind.GR, SpecialKind.SW):
        if system.model.holds_coordinates:
            return _changing(special, paths, scales)
        touched = old.touched(special)
        assert touched is not None, "refused before"
        signature, unknowns = touched
        orbit = _evaluated(equations_of(system, signature, paths), unknowns, values)
        return orbit, Slow(orbit.equations, _first_without_speed(orbit.equations, unknowns))
    equations = equations_of(system, old.signature, paths)
    if old.passes_contact and not equations.passes_contact:
        raise ParameterError(
            f"{paths[1]} makes the contact a singularity, which it is not at"
            f" {system.parameters[paths[1]]:g}; change it a little, follow the branch again, and"
            f" continue the {kind} from there"
        )
    if kind == SpecialKind.LP and old.signature.symmetric and not symmetric:
        equations, unknowns = equations.over_full_period(unknowns)
    orbit = _evaluated(equations, unknowns, values)
    if kind == SpecialKind.PD:
        orbit = divide(orbit) or orbit
    elif kind == SpecialKind.BPC and not old.signature.symmetric:
        halved = half(orbit) if symmetric else None
        if halved is None:
            raise ParameterError(
                "this BPC is a crossing of branches without a symmetry, which does not persist "
                "along a curve"
            )
        orbit = halved
    if kind == SpecialKind.NS:
        return orbit, pair_on_circle(orbit, scales)
    return orbit, Singular.near(orbit, 1.0 if kind == SpecialKind.LP else -1.0)


def _evaluated(
    equations: OrbitEquations, unknowns: np.ndarray, values: np.ndarray
) -> PeriodicOrbit:
    orbit = PeriodicOrbit.known(equations, unknowns, values)
    if orbit is None:
        raise ParameterError(
            "the motion of the special point cannot be followed; locate it again on its branch"
        )
    return orbit


def _first_without_speed(equations: OrbitEquations, unknowns: np.ndarray) -> int:
    """The number of the impact without speed; of a pair, the first one."""
    phases = unknowns[::2]
    speeds = unknowns[1::2]
    slow = int(np.argmin(np.abs(speeds)))
    before = phases[slow] - phases[slow - 1] + (equations.closing if slow == 0 else 0.0)
    is_second = len(speeds) > 1 and max(abs(before), abs(speeds[slow - 1])) < TOLERANCES.pair
    return (slow - 1) % len(speeds) if is_second else slow
