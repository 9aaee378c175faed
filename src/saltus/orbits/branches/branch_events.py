"""The events along a branch of orbits: special points, passages through grazings, and the ways in
which the branch ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from saltus.continuation import (
    Continuation,
    Corrected,
    Course,
    Cut,
    End,
    Events,
    Missed,
    Zero,
    located,
)
from saltus.errors import SaltusError
from saltus.flow import simulate
from saltus.orbits.beyond.orbit_curve import (
    FLIP,
    STEEPEST,
    OrbitPoint,
    Test,
    branch_tests,
    complex_pairs,
    grazing,
    has_critical_multiplier,
    may_pass,
    never_torus,
)
from saltus.orbits.beyond.special_point import (
    OrbitEnd,
    OrbitMissed,
    SpecialKind,
    SpecialPoint,
    UserFunction,
)
from saltus.orbits.beyond.symmetry import (
    beside_image,
    falls_onto_image,
    is_image,
    nearest,
    on_family,
    passes_image,
    repetition,
)
from saltus.orbits.branches.retrace import comes_along_itself
from saltus.orbits.contract.equations import Restart
from saltus.orbits.contract.event_sequence import remembered_at
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.finding.from_motion import orbit_from
from saltus.orbits.signature import TOLERANCES, Signature
from saltus.systems import arguments_of

Run = Continuation


@dataclass(frozen=True)
class BranchLimits:
    """When the continuation of a branch is given up, and how its events are told apart from
    rounding errors.
    """

    most_impacts: int = 120  # Orbits with more impacts in a period than this are not followed.
    # Grazings are taken to accumulate when this many in a row have each added impacts, and one of
    # the next two conditions holds.
    accumulating: int = 5
    # So do this many where the next change begins a rest, or no step succeeds: each lies nearer to
    # it than the one before, by this share at most.
    before_rest: int = 3
    nearer: float = 0.5
    # Either all of them lie within this share of the parameter's value,
    accumulation_width: float = 1e-3
    # or the amplitude has shrunk below this share of the largest one, with more impacts than
    # `shrunk_impacts`.
    shrunk: float = 1e-2
    shrunk_impacts: int = 60
    # An orbit grows without end if its amplitude exceeds this in natural units, and exceeds that of
    # the first orbit of the branch by this factor: a thousand of the longest steps lead there.
    largest: float = 1e2
    # A fold and a crossing of branches whose parameters differ by less than this, in the scale of
    # the branch, are one point.
    same_fold: float = 1e-8
    # How far a complex pair of multipliers may be from the unit circle at an NS; a pair farther
    # outside, where areas of the state plane never grow, is an error of saltus.
    impossible_pair: float = 1e-6
    # periods of an orbit for which a motion settles beyond a change; nearly all of its multipliers
    # are 0
    settling: int = 40
    # A gap or a speed of the first orbit beyond a rest, in natural units, that rounding leaves at
    # 0.
    rounding: float = 1e-13
    # Distances in both directions along the parent's branch, tried in turn until they enclose its
    # special point.
    reaches: tuple[float, ...] = tuple(10.0 ** np.arange(-8, -0.9))


SETTINGS = BranchLimits()


class OrbitEvents(Events):
    """The events along any curve of orbits."""

    def ended(self, run: Run, ahead: OrbitPoint, cut: Cut | None) -> End | None:
        """The end of an orbit that has shrunk to rest, or that grows without end."""
        size = ahead.orbit.size
        equations = ahead.orbit.equations
        length = equations.natural.length
        if size > SETTINGS.largest * max(length, run.points[0].orbit.size):
            return End(OrbitEnd.GROWS, ahead.parameter, detail=f"{size:.3g}")
        connected = equations.connection([*run.points, ahead])
        if connected is not None:
            return End(OrbitEnd.CONNECTION, connected)
        if not _has_shrunk(ahead):
            return None
        meet = equations.relays_meet([*run.points, ahead])
        if meet is not None:
            return End(OrbitEnd.RELAY_CHATTERS, meet)
        born = equations.birth(run.points)
        if born is not None:  # a branch turns back there, which is no fold
            _forget_where_it_turns(run, born)
            return End(OrbitEnd.EQUILIBRIUM, born)
        lost = equations.lost_ahead(ahead)
        if lost is None:
            return End(OrbitEnd.SHRINKS, ahead.parameter)
        inside = all(
            low <= value <= high
            for (low, high), value in zip(run.bounds.values(), lost.parameters, strict=True)
        )
        run.special += [lost] if inside else []
        return End(OrbitEnd.NO_PULL, lost.parameter, lost.kind) if inside else None

    def nearest(self, point: OrbitPoint, place: np.ndarray, other: OrbitPoint) -> np.ndarray | None:
        return nearest(point, place, other)

    def closing(self, first: OrbitPoint, ahead: OrbitPoint) -> OrbitPoint:
        """The first orbit of a closed branch, by its state at the section that the branch has when
        it returns to it.
        """
        found: OrbitPoint = first.curve.equations.at_section_of(first, ahead)
        return found


# orbits before one that has shrunk, among which a change of stability is its birth
LAST_ORBITS = 6


def _forget_where_it_turns(run: Run, born: float) -> None:
    """Drop what was found where a branch turns back at an equilibrium, at the parameter `born`:
    beyond it its orbits are the same once more, and those that have shrunk to it are the
    equilibrium within rounding.
    """
    while len(run.points) > 1 and _has_shrunk(run.points[-1]):
        run.points.pop()
    run.special[:] = [zero for zero in run.special if not _has_shrunk(zero.point)]
    near = max(abs(point.parameter - born) for point in run.points[-LAST_ORBITS:])
    run.missed[:] = [
        missed
        for missed in run.missed
        if max(abs(missed.first[-1] - born), abs(missed.last[-1] - born)) > near
    ]


def _has_shrunk(point: OrbitPoint) -> bool:
    equations = point.orbit.equations
    return equations.size_of(point.orbit) < equations.least_size * equations.natural.length


@dataclass
class BranchEvents(OrbitEvents):
    """The events along a branch."""

    functions: dict[str, UserFunction] = field(default_factory=dict)
    until: SpecialKind | None = None  # the kind of special point at which to end
    while_stable: bool = False  # whether to end beyond the loss of stability
    # The last step whose cut was computed: the cut decides first whether the step is accepted, then
    # where it ends.
    last_cut: tuple[OrbitPoint, OrbitPoint, Cut | End | None] | None = None
    values: list[float] = field(default_factory=list)  # the parameters of the points so far

    name = "branch"
    keeps_special = True  # so that a line through the points shows the fold

    def accepts(self, point: OrbitPoint, ahead: OrbitPoint) -> bool:
        """Whether a step may be taken: not if it has jumped onto the branch of the orbits that are
        their own images, nor if it begins at one grazing and has gone past the next one."""
        # the first point beyond a grazing: its unknowns are known without solving
        begun = point.iterations == 0
        skipped = begun and grazing(point) <= TOLERANCES.touch and grazing(ahead) < 0.0
        if not point.orbit.equations.accepts(ahead, lambda: self.cut(point, ahead)):
            return False
        return not skipped and not falls_onto_image(point, ahead)

    def barrier(self, point: OrbitPoint) -> Test:
        """The test function of grazings, or of other changes of an orbit's events."""
        return point.orbit.equations.barrier(point)

    def cut(self, point: OrbitPoint, ahead: OrbitPoint) -> Cut | End | None:
        """Where a step is cut: at a grazing, or where a release or a closing of one of several
        contacts appears or is lost.
        """
        if self.last_cut is None or self.last_cut[0] is not point or self.last_cut[1] is not ahead:
            self.last_cut = point, ahead, self._cut(point, ahead)
        return self.last_cut[2]

    def _cut(self, point: OrbitPoint, ahead: OrbitPoint) -> Cut | End | None:
        found = super().cut(point, ahead)
        if not isinstance(found, Cut) or found.special is None:
            return found
        changed: Cut | End = found.point.orbit.equations.change(found.special, point)
        return changed

    def unlocated(self, run: Run, point: OrbitPoint, ahead: OrbitPoint, end: End) -> Cut | End:
        """A cut at the last point, where the orbits' events change just beyond it. Multipliers grow
        without bound towards the change, so that no orbit nearer to it can be solved for."""
        step = point.curve.norm(ahead.place - point.place)
        found = point.orbit.equations.stalled(point, step, run.points, run.bounds)
        return found if isinstance(found, Cut) else end

    def interrupted(self, run: Run, point: OrbitPoint, ahead: OrbitPoint) -> End | None:
        """The end of a family that reaches orbits that are their own images: at the BPC or PD of
        the parent's branch at which the family is born."""
        if not passes_image(point, ahead):
            return None
        kind = SpecialKind.BPC if point.orbit.signature.period % 2 else SpecialKind.PD
        parent = parent_point(point, ahead)
        if parent is not None:
            last = on_family(point, parent.point)
            beside = None if last is None else beside_image(point, last)
            # between the last point and the end the family may have further special points
            if beside is not None:
                run.take(beside)
            _forget_turns(run, parent)
            run.points.append(last or parent.point)
            run.special.append(parent)
        return End(OrbitEnd.IMAGE, ahead.parameter if parent is None else parent.parameter, kind)

    def tests(self, point: OrbitPoint) -> Iterator[Test]:
        """All test functions but that of grazings."""
        return branch_tests(point, self.functions)

    def outside(self, point: OrbitPoint) -> int | None:
        """The number of multipliers outside the unit circle; None at a grazing."""
        if point.orbit.grazes:
            return None
        moduli = [abs(value) for value in point.orbit.multipliers.tolist()]
        return len([modulus for modulus in moduli if modulus > 1.0 + TOLERANCES.on_circle])

    def jumps_over(
        self, kind: str, point: OrbitPoint, ahead: OrbitPoint, zero: Zero | None
    ) -> bool:
        """Whether no multiplier passes through 1 or -1, as one does at LP, BPC and PD.

        Multipliers jump over such a value where an event appears or is lost. There the equations
        may be degenerate too, so that rounding decides the signs of their determinants.
        """
        if zero is not None:
            return not has_critical_multiplier(kind, zero.point.orbit)
        return not may_pass(kind, point.orbit, ahead.orbit)

    def distinct(self, found: list[Zero]) -> list[Zero]:
        """The special points, without crossings of branches that are only folds. Zeros of `torus`
        are left out at which no complex pair of multipliers has the modulus 1, or that lie where
        areas of states never grow."""
        folds = [zero.parameter for zero in found if zero.kind == SpecialKind.LP]

        def is_fold(zero: Zero) -> bool:
            crossing = zero.kind == SpecialKind.BPC and not zero.point.orbit.symmetric
            near = SETTINGS.same_fold * zero.point.curve.scales[0]
            return crossing and any(abs(zero.parameter - p) < near for p in folds)

        def impossible(zero: Zero) -> bool:
            orbit = zero.point.orbit
            on_circle = (np.abs(complex_pairs(orbit) - 1.0) < SETTINGS.impossible_pair).any()
            return zero.kind == SpecialKind.NS and (never_torus(orbit) or not on_circle)

        return [zero for zero in found if not is_fold(zero) and not impossible(zero)]

    def last(self, special: Zero) -> End | None:
        """The end at the first special point of the kind that is looked for."""
        return (
            End(OrbitEnd.FIRST, special.parameter, special.kind)
            if special.kind == self.until
            else None
        )

    def ended(self, run: Run, ahead: OrbitPoint, cut: Cut | None) -> End | None:
        """The end of an orbit that has shrunk to rest, has lost its stability, or has others beside
        it at the same parameters.
        """
        largest = complex_pairs(ahead.orbit).max(initial=0.0)
        if largest > 1.0 + SETTINGS.impossible_pair and never_torus(ahead.orbit):
            where = ahead.parameters
            modulus = f"{largest:.9g}"
            run.missed.append(
                Missed(OrbitMissed.IMPOSSIBLE_PAIR, SpecialKind.NS, where, where, modulus)
            )
        if self.while_stable and cut is None and not ahead.orbit.stable:
            return super().ended(run, ahead, cut) or End(OrbitEnd.UNSTABLE, ahead.parameter)
        self.values += [point.parameter for point in run.points[len(self.values) :]]
        if comes_along_itself(run.points, self.values):
            return End(OrbitEnd.ALONG_ITSELF, run.points[-2].parameter)
        # one point alone may be where branches cross
        if not any(point.orbit.isolated for point in run.points[-2:]):
            return End(OrbitEnd.NOT_ISOLATED, run.points[-2:][0].parameter)
        return super().ended(run, ahead, cut)

    def across(self, run: Run, cut: Cut) -> OrbitPoint | End:
        """The point with the signature of the other side of a grazing, at which the branch goes on;
        or why it ends.
        """
        graze = cut.special
        if graze is not None and any(_same_place(graze, earlier) for earlier in run.special[:-1]):
            run.special.pop()
            return End(OrbitEnd.COMES_BACK, graze.parameter)
        equations = cut.point.orbit.equations
        if (parent := equations.born_at(cut, run.points)) is not None:
            run.special.append(parent)
            return End(OrbitEnd.IMAGE, parent.parameter, parent.kind)
        following = equations.beyond(cut, run.points)
        if isinstance(following, End):
            return following
        if _begins_to_rest(cut, following):
            # the bounces behind so many grazings are too slow to be told from a rest
            limit = _limit_of_grazings(run, cut.point)
            if limit is not None:
                run.special.pop()
                count = cut.point.orbit.counted_impacts
                return End(OrbitEnd.ACCUMULATES, limit, detail=str(count))
        if cut.special is not None:
            run.special[-1] = equations.located_beyond(cut, following) or cut.special
        if (further := equations.also_at(cut, following)) is not None:
            run.special.append(further)
        count = following.orbit.counted_impacts
        value = following.parameter
        if (shorter := repetition(following)) is not None:
            return End(OrbitEnd.GRAZES_ANOTHER, value, detail=shorter)
        if not following.orbit.isolated:
            return End(OrbitEnd.NOT_ISOLATED, value)
        if count > SETTINGS.most_impacts:
            return End(OrbitEnd.MANY_IMPACTS, value, detail=str(SETTINGS.most_impacts))
        return (
            End(OrbitEnd.ACCUMULATES, value, detail=str(count))
            if _accumulate(run, following)
            else following
        )

    def first_step(self, points: Sequence[OrbitPoint]) -> float:
        before, ahead = points[-2:]
        return ahead.orbit.equations.first_step(before, ahead)

    def stalled(self, run: Run, point: OrbitPoint, step: float) -> Cut | End:
        """The end where even the shortest step fails: because the orbit repels too strongly, or for
        a reason that is not known.

        A whole motion may stall where its events change; there the branch may turn round: a cut.
        """
        found = point.orbit.equations.stalled(point, step, run.points, run.bounds)
        if found is not None:
            return found
        limit = _limit_of_grazings(run, point)
        if limit is not None and limit != point.parameter:
            return End(OrbitEnd.ACCUMULATES, limit, detail=str(point.orbit.counted_impacts))
        largest = point.orbit.largest_multiplier
        if largest > STEEPEST and not point.orbit.grazes:
            return End(OrbitEnd.REPELS, point.parameter, detail=f"{largest:.1g}")
        return super().stalled(run, point, step)


def restarted(restart: Restart, point: OrbitPoint) -> OrbitPoint | None:
    """The first point of the branch beyond the end of another one, found from a motion that settles
    there; None if it settles on no orbit.
    """
    equations = point.orbit.equations
    period = point.orbit.signature.period
    for values in restart.values:
        try:
            system = equations.given_at(values)
            motion = simulate(
                system, **restart.state, periods=SETTINGS.settling * period, dense=False
            )
            state = arguments_of(system, motion.final_state) | remembered_at(motion)
            base = equations_of(system, Signature((), 1), equations.paths, equations.tol)
            orbit = orbit_from(base, state, period)
            # once more from its own motion, which may have other events than one that has not
            # settled
            orbit = (
                None
                if orbit is None
                else orbit_from(
                    base,
                    arguments_of(system, orbit.section_state) | orbit.remembered,
                    orbit.signature.period,
                )
            )
        except SaltusError:
            continue
        # A gap below 0 by more than rounding, though by less than a touch, is an impact that is
        # left out: grazings accumulate here, and at none of them does the branch begin.
        if orbit is None or not orbit.admissible or orbit.room < -SETTINGS.rounding:
            continue
        solution = orbit.solution
        ahead = np.append(np.zeros(orbit.equations.size), values - point.parameters)
        found = Corrected(
            np.append(solution.unknowns, solution.values), solution.evaluation, solution.iterations
        )
        there: OrbitPoint | None = point.curve.with_equations(orbit.equations).with_tangent(
            found, ahead
        )
        if there is not None:
            return there
    return None


def _accumulate(run: Run, following: OrbitPoint) -> bool:
    """Whether grazings accumulate: the last ones have all added impacts, close to one value of the
    parameter or on the way to rest."""
    grazings = [s.point for s in run.special if s.kind == SpecialKind.GR][-SETTINGS.accumulating :]
    counts = [point.orbit.counted_impacts for point in (*grazings, following)]
    return _gather([point.parameter for point in grazings], counts, run.points, following)


def _begins_to_rest(cut: Cut, following: OrbitPoint) -> bool:
    """Whether an impact turns into a rest at a change that is no grazing."""
    is_switch = cut.special is not None and cut.special.kind == SpecialKind.SW
    return is_switch and following.orbit.releases.size > cut.point.orbit.releases.size


def _limit_of_grazings(run: Run, point: OrbitPoint) -> float | None:
    """The parameter at which grazings accumulate, the last of which lie behind `point`; None if
    they do not.

    Each grazing adds an impact to bounces that die away. The places of the grazings converge as a
    geometric series, whose limit is Aitken's extrapolation: there the bounces come to rest. Where
    `point` lies beyond this limit the series is too short, and `point` is nearer.
    """
    grazings = [s.point for s in run.special if s.kind == SpecialKind.GR][-SETTINGS.before_rest :]
    counts = [graze.orbit.counted_impacts for graze in grazings]
    counts.append(point.orbit.counted_impacts)
    if len(grazings) < SETTINGS.before_rest or not (np.diff(counts) > 0).all():
        return None
    places = np.array([graze.parameter for graze in grazings])
    distances = np.abs(places - point.parameter)
    if distances[0] == 0.0 or (distances[1:] > SETTINGS.nearer * distances[:-1]).any():
        return None
    steps = np.diff(places)[-2:]
    share = steps[1] / steps[0]
    if not 0.0 < share <= SETTINGS.nearer:
        return None
    ahead = steps[1] * share / (1.0 - share)
    return float(places[-1] + ahead) if abs(ahead) > distances[-1] else float(point.parameter)


def _gather(
    places: list[float], counts: list[int], points: Sequence[OrbitPoint], following: OrbitPoint
) -> bool:
    """Whether grazings at these places accumulate. `counts` are the impacts before each of them and
    beyond the last one, where `following` lies; `points` are those of the branch up to there.
    """
    if len(places) < SETTINGS.accumulating or not (np.diff(counts) > 0).all():
        return False
    if np.ptp(places) < SETTINGS.accumulation_width * abs(following.parameter):
        return True
    largest = max(point.orbit.size for point in points)
    small = following.orbit.size < SETTINGS.shrunk * largest
    return small and counts[-1] > SETTINGS.shrunk_impacts


BranchCourse = Course[OrbitPoint, SpecialPoint]


def ended_where_grazings_accumulate(course: BranchCourse, first: OrbitPoint) -> BranchCourse:
    """A branch that was followed from its point `first` both ways, with the ends at accumulations
    of grazings that it has from any of its points: where it is begun among these grazings, it was
    followed farther.
    """
    for backwards in (True, False):
        if course.ends[not backwards].reason is OrbitEnd.ACCUMULATES:
            course = _ended(course, first, backwards)
    return course


def _ended(course: BranchCourse, first: OrbitPoint, backwards: bool) -> BranchCourse:
    """`ended_where_grazings_accumulate` for the first or the last end."""
    way = slice(None, None, -1 if backwards else 1)
    points = course.points[way]
    special = course.special[way]
    # a point that is followed the other way keeps the array of its place
    index = {id(point.place): i for i, point in enumerate(points)}
    begun = index.get(id(first.place), len(points))
    passed = [
        (number, index[id(zero.point.place)])
        for number, zero in enumerate(special)
        if zero.kind == SpecialKind.GR and id(zero.point.place) in index
    ]
    for i in range(SETTINGS.accumulating - 1, len(passed)):
        number, last = passed[i]
        if not begun <= last < len(points) - 1 or last == 0:
            continue
        places = [at for _, at in passed[i + 1 - SETTINGS.accumulating : i + 1]]
        counts = [points[at - 1].orbit.counted_impacts for at in places]
        following = points[last + 1]
        counts.append(following.orbit.counted_impacts)
        parameters = [points[at].parameter for at in places]
        if _gather(parameters, counts, points[: last + 1], following):
            value = points[last].parameter
            end = End(OrbitEnd.ACCUMULATES, value, detail=str(counts[-1]))
            return replace(
                course,
                points=points[: last + 1][way],
                special=special[: number + 1][way],
                ends=(end, course.ends[1]) if backwards else (course.ends[0], end),
            )
    return course


def _same_place(a: Zero, b: Zero) -> bool:
    """Whether two grazings are one and the same, met from the same side."""
    one = a.point
    other = b.point
    same = (a.kind, one.orbit.signature) == (b.kind, other.orbit.signature)
    near = math.isclose(one.parameter, other.parameter, rel_tol=1e-10)
    return same and near and math.isclose(one.orbit.size, other.orbit.size, rel_tol=1e-9)


TURN = 10.0


def _forget_turns(run: Run, parent: Zero) -> None:
    """Forget the folds and crossings at which a family turns back along its images at its parent.

    There the equations are singular, so that rounding decides on which side of the parent these
    zeros are seen.
    """

    # a family leaves its parent as the root of the parameter
    apart = TURN * math.sqrt(SETTINGS.same_fold)

    def is_turn(zero: Zero) -> bool:
        near = SETTINGS.same_fold * zero.point.curve.scales[0]
        return (
            zero.kind in (SpecialKind.LP, SpecialKind.BPC)
            and abs(zero.parameter - parent.parameter) < near
            and is_image(zero.point, apart)
        )

    turns = [zero for zero in run.special if is_turn(zero)]
    run.special = [zero for zero in run.special if zero not in turns]
    own = {id(zero.point) for zero in turns}
    run.points = [point for point in run.points if id(point) not in own]


def parent_point(a: OrbitPoint, b: OrbitPoint) -> Zero | None:
    """The special point of the parent's branch at which a family is born, from a step a-b of the
    family that passes through it.

    The orbit there is its own image. The family's equations are singular at it; those of the
    parent, over half of the period, are not.
    """
    equations = a.curve.equations.halved
    first = a.halves
    last = b.halves
    assert first is not None
    assert last is not None
    units = equations.units.unknowns
    lengths = [float(np.linalg.norm((both[1] - both[0]) / units)) for both in (first, last)]
    share = lengths[0] / sum(lengths)
    between = (first + share * (last - first)).mean(axis=0)
    curve = a.curve.with_equations(equations)
    guess = np.append(between, a.parameter + share * (b.parameter - a.parameter))
    middle = curve.solve_at(guess, np.append(np.zeros(curve.equations.size), 1.0))
    if middle is None:
        return None
    test = FLIP[equations.signature.symmetric]
    least = 0.0
    for reach in (reach for reach in SETTINGS.reaches if reach > least):
        ends = [middle.beside(sign * reach) for sign in (-1.0, 1.0)]
        if ends[0] is None or ends[1] is None:
            continue
        before, after = (test.value(end) for end in ends)
        if before * after < 0.0:
            return located(test, ends[0], ends[1])
        if before != after:  # the zero lies about as far as that of the line through both
            least = reach * abs((before + after) / (after - before))
    return None
