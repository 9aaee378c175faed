"""The contract of the equations of a periodic orbit: what a kind of equations gives, and what
follows from it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from saltus.continuation import (
    ONES,
    Bounds,
    Cut,
    End,
    TestFunction,
    Units,
    Zero,
    arithmetic,
)
from saltus.errors import ParameterError, SaltusError
from saltus.flow import Motion, SegmentFollower, program, simulate
from saltus.orbits.segments.segments import CannotProve, OrbitSegments
from saltus.orbits.signature import Signature
from saltus.systems import (
    Mirror,
    NaturalUnits,
    System,
    has_half_the_period,
    mirror_of,
    natural_units,
    numbers,
)
from saltus.taylor import FREQUENCY, record_table

# upper limit of distances of an orbit from a change, which are infinite where nothing comes near to
# one
FARTHEST = 1.0
# the largest difference of the halves of an orbit that repeats itself after half a period, as a
# share of its size
HALVES_ALIKE = 1e-5
ORBIT_TOLERANCE = 1e-14  # of the segments' steps: the orbits are then exact to rounding


@dataclass(eq=False)  # setting frozen fields would take as long as filling them
class OrbitEvaluation:
    """The equations at one point: the residual and its derivatives, one block for each segment, and
    extremes along the segments.

    Block row i of the Jacobian has `here[i]` in the columns of the unknowns of segment i, and
    `there[i]` in those of the next one.
    """

    residual: np.ndarray  # (n d,)
    here: np.ndarray  # (n, d, d)
    there: np.ndarray  # (n, d, d)
    parameters: np.ndarray  # (n d, parameters)
    ends: np.ndarray
    # (n, 4 + margins): extrema within each segment, by `SegmentColumn`; empty if not asked for
    extremes: np.ndarray

    def jacobian(self, closing: float = 1.0) -> np.ndarray:
        """The derivatives to the unknowns; with `closing` -1 for perturbations that change their
        sign each (half) period.
        """
        matrix = np.zeros((len(self.residual), len(self.residual)))
        self._fill(matrix, closing)
        return matrix

    def _fill(self, matrix: np.ndarray, closing: float) -> None:
        """Write the derivatives to the unknowns into the first columns of a matrix of zeros."""
        arithmetic().fill_blocks(self.here, self.there, closing, matrix)

    @cached_property
    def _all(self) -> np.ndarray:
        size, count = self.parameters.shape
        matrix = np.zeros((size, size + count))
        self._fill(matrix, 1.0)
        matrix[:, size:] = self.parameters
        return matrix

    def derivatives(self) -> np.ndarray:
        """The derivatives to the unknowns and the parameters."""
        return self._all

    def monodromy(self) -> np.ndarray:
        """The product of the segments' maps: from the first unknowns to those a (half) period
        later; inf at a grazing.
        """
        chain = np.empty(self.here.shape[1:])
        if not arithmetic().product_of_maps(self.here, self.there, chain):
            chain[:] = np.inf
        return chain

    def area_factor(self) -> float | None:
        """The determinant of the monodromy matrix, as the product of those of the segments' maps,
        which keeps its digits where one multiplier is large; None for other than two multipliers.
        """
        if self.here.shape[-1] != 2:
            return None
        return arithmetic().product_of_areas(self.here, self.there)


@dataclass(frozen=True)
class Solution:
    """A point that solves the equations, with the equations as evaluated there."""

    unknowns: np.ndarray
    values: np.ndarray  # of the parameters
    evaluation: OrbitEvaluation
    iterations: int
    units: Units = ONES  # the natural units of the unknowns and of the residuals

    @property
    def residual(self) -> float:
        """The largest residual, in natural units."""
        return self.units.residual(self.evaluation.residual)


class Witness(NamedTuple):
    """A quantity of an orbit that vanishes where its events change."""

    what: str  # such as "gap of stop"
    grazes: bool  # whether the change is then a grazing, else a switching
    value: float  # in natural units


class Restart(NamedTuple):
    """Where a branch begins beyond the end of another one, if only a motion tells its orbits."""

    state: dict[str, Any]  # at phase 0, as `simulate` takes it
    values: list[np.ndarray]  # of the parameters at which an orbit is looked for, tried in turn


class MotionToRead:
    """A motion over some forcing periods from a state at phase 0, from which orbits of that many
    periods are read.
    """

    def __init__(
        self, system: System, state: dict[str, Any], periods: int, length: float | None = None
    ) -> None:
        self.system = system
        self.state = state
        self.periods = periods
        self.length = length  # of a round of a cycle, which has no forcing period

    @property
    def duration(self) -> float:
        """How long these periods last."""
        period = self.system.load.period if self.length is None else self.length
        assert period is not None
        return self.periods * period

    @cached_property
    def once(self) -> Motion:
        """The motion over these periods."""
        return simulate(self.system, **self.state, **self._lasting(1))

    @cached_property
    def twice(self) -> Motion:
        """The motion over twice as many, so that its events can be counted from any of them on, at
        the tolerance of orbits.
        """
        return simulate(self.system, **self.state, **self._lasting(2), tol=10.0 * ORBIT_TOLERANCE)

    def _lasting(self, times: int) -> dict[str, Any]:
        if self.length is None:
            return {"periods": times * self.periods}
        return {"duration": times * self.duration}


class OrbitEquations(ABC):
    """The equations F(unknowns, parameters) = 0 of the orbits of one signature of a system, with
    the parameters at `paths`.

    They are those of `given.in_gap_coordinates`, the `system`, whose contacts hold single
    coordinates; so are `start` and all states. `PeriodicOrbit` shows them in the coordinates of the
    system that was `given`.

    A new kind of equations is a subclass in a file of its own and one entry in `KINDS`
    (`kinds.py`). It gives

    1. **for which orbits it is**: `solves`, whether it has equations for a signature of a system;
       and `read`, the equations and
       a guess of their unknowns along a motion;
    2. **the equations**: `size`, the number of unknowns, and `evaluate`, an `OrbitEvaluation` with
       the residual, its derivatives
       (from which multipliers follow) and the extremes along the orbit;
    3. **a state to start from**: `start`, as `simulate` takes it;
    4. **its impacts**: `impacts`, phases and speeds;

    and, where they differ from what stands here,

    5. **F alone**: `residual`; **halving and repeating**: `halves`, both halves of a period as
      unknowns of the equations over one half, by which orbits that are their own images are known;
      `repeated` and `alternating`, the unknowns, and a perturbation, of an orbit that goes round
      twice;
    6. **renumbering**: `nearest`, the unknowns of an orbit counted as those of another one;
       `has_events_of`, if the equations do not list events; `at_section_of` and
       `at_another_section`, if the state is given at a section that moves;
    7. **what bounds a step**: `barrier`, a test function that is negative where the equations do
       not hold, and `accepts`;
    8. **what lies beyond a change**: `change`, which special point the zero of the barrier is;
       `beyond`, the point with which
       the branch goes on; `born_at`, whether it ends there because its parent bears it; `also_at`,
       a further special point there, and `note`, what it is besides; `first_step` after it, and `stalled`, what stops a branch
       where no step leads on;
    9. **curves of special points**: `curve_barrier`, and `touched`, the equations with the impact
       that a grazing begins with.

    10. **proof**: `segments_to_prove` and, at a grazing, `touching_segments`: the segments of an
       orbit with their events as expressions, from which it is proved (`proofs/`).

    A kind whose orbits have more to tell than their signature and unknowns say adds fields to
    `Signature`, which has the columns in datasets (`signature_columns`) and reads them back.

    From these everything else follows: finding (`finding/`), branches, their special points and
    switching (`branches/`), curves in two parameters, datasets and files, plots. Nobody asks of
    which kind an orbit's equations are.
    """

    # whether the contact is no singularity, so that orbits pass through it; see `ContactRegularity`
    passes_contact: bool = False
    corrector_radius: float = math.inf  # see `EquationCurve`
    # the largest residual that rounding may leave; above 0 where multipliers are very large
    residual_floor: float = 0.0
    # whether the period is that of a load; it is an unknown of a cycle
    has_forcing: bool = True

    def __init__(
        self,
        system: System,
        signature: Signature,
        paths: tuple[str, ...] = (),
        tol: float = ORBIT_TOLERANCE,
    ) -> None:
        if system.load.frequency is None and self.has_forcing:
            raise ParameterError(
                "a load without a frequency has no forcing period, and so no periodic orbits; "
                "give it a frequency",
                "load.frequency",
            )
        self.given = system
        self.signature = signature
        self.paths = paths
        self.tol = tol
        self.system = system = system.in_gap_coordinates
        self._run: Any = program(system, system.model.margin_names(system.load), paths)
        # whether the load has corners, at which the motion is not smooth between its events
        self.has_corners: bool = self._run.trace.repeats
        if self._run.trace.records and not self.has_corners:
            raise ParameterError(
                "a load with a Record or a pulse is not periodic, so it has no periodic orbits; "
                "use Harmonic signals, waves with corners such as Square, or a Table"
            )
        names = [path for path, _ in numbers(system)]
        self._values = np.array([value for _, value in numbers(system)])
        self._places = [names.index(path) for path in paths]
        self._frequency = names.index(FREQUENCY) if self.has_forcing else -1
        self._follower = SegmentFollower(self._run, tol)
        self._records = record_table(system, [])

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the arguments only: compiled code is loaded again in the process that
        reads them.
        """
        return type(self), (self.given, self.signature, self.paths, self.tol)

    # --- 1. for which orbits it is -------------------------------------------

    @classmethod
    @abstractmethod
    def solves(cls, system: System, signature: Signature) -> bool:
        """Whether these are the equations of the orbits of a signature."""

    @classmethod
    @abstractmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        """The equations with the signature of a motion that nearly repeats itself, along the paths
        of `base`, and their unknowns along it; None if its orbit has equations of another kind.

        Raises
        ------
        MotionError
            The motion leads to no orbit.
        """

    # --- 2. the equations ----------------------------------------------------

    @property
    @abstractmethod
    def size(self) -> int:
        """The number of unknowns."""

    def residual(self, unknowns: np.ndarray, values: np.ndarray) -> np.ndarray | None:
        """F alone, up to rounding, where that takes far less time than with its derivatives; else
        None, or without a motion.
        """
        return None

    @abstractmethod
    def evaluate(
        self,
        unknowns: np.ndarray,
        values: np.ndarray,
        with_extremes: bool = False,
        *,
        later: np.ndarray | None = None,
    ) -> OrbitEvaluation | None:
        """The equations at a point, or None where the motion cannot be followed.

        `later` are the unknowns asked for at the end of the period, if they differ from those at
        its beginning.
        """

    # --- 3. and 4. a state to start from, and the impacts --------------------

    @abstractmethod
    def start(self, solution: Solution) -> dict[str, Any]:
        """The arguments of `simulate` that start a motion on the orbit; without `time`, or at time
        0, they are its state at phase 0."""

    @abstractmethod
    def impacts(self, solution: Solution) -> tuple[np.ndarray, np.ndarray]:
        """The phases of the impacts, and the speeds at which the gap closes before them; of an
        accumulation, those that are resolved."""

    def counted_impacts(self, solution: Solution) -> int:
        """The number of impacts in the time that the equations cover, without those of
        accumulations.
        """
        return len(self.impacts(solution)[0])

    def rests(self, solution: Solution) -> np.ndarray:
        """The times in one period of an orbit at which it leaves rest at a contact and comes to
        rest again, (n, 2).
        """
        return np.empty((0, 2))

    def touching_speed(self, solution: Solution) -> float:
        """The least speed of the impacts at which the map loses its derivative if the speed
        vanishes; inf without such impacts."""
        return float(min(self.impacts(solution)[1].tolist(), default=math.inf))

    def pressing(self, solution: Solution) -> float:
        """A quantity, in natural units. It is negative if a contact that the equations take for
        closed would open, or if one that they take for open is passed at the section; inf without
        either."""
        return math.inf

    def witnesses(self, solution: Solution) -> list[Witness]:
        """The quantities of an orbit one of which vanishes at a change of its events, always in the
        same order; none where the equations do not know them one by one.
        """
        return []

    # --- 5. halving and repeating --------------------------------------------

    @abstractmethod
    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        """The unknowns of both halves of a period, each as unknowns of the `halved` equations, (2,
        n); None where the signature rules out that they are alike, or implies it. `mirrored` says
        whether the system has the mirror symmetry."""

    def repeated(self, unknowns: np.ndarray) -> np.ndarray:
        """The unknowns of an orbit that goes round twice in the time that the equations of the
        doubled orbit cover.
        """
        return unknowns

    def alternating(self, direction: np.ndarray) -> np.ndarray:
        """A perturbation of the unknowns as one of the `repeated` unknowns, with the other sign in
        the second round.
        """
        return direction

    def counted_twice(self, solution: Solution) -> tuple[OrbitEquations, np.ndarray] | None:
        """The equations of an orbit of which each round counts as two, and its unknowns; None where
        a load says what a round is.
        """
        return None

    def shorter_period(self, solution: Solution, within: float) -> int | None:
        """The forcing periods of a shorter orbit that this one repeats, up to `within`; None if the
        equations exclude it.
        """
        return None

    def covered(self, solution: Solution) -> int | None:
        """The forcing periods of a shorter orbit that an orbit at a grazing repeats, but for which
        of its touches are impacts; None if it repeats none.
        """
        return None

    # --- 6. renumbering ------------------------------------------------------

    @abstractmethod
    def nearest(self, unknowns: np.ndarray, values: np.ndarray, other: Any) -> np.ndarray | None:
        """The unknowns of an orbit, counted such that they are nearest to those of the point
        `other` of a branch; None if the two cannot be compared so."""

    def has_events_of(self, solution: Solution, other: Solution) -> bool:
        """Whether an orbit has the same events as another one of such equations: always, where the
        equations list them.
        """
        return True

    def at_section_of(self, point: Any, other: Any) -> Any:
        """A point with its state given at the section of another point or, if the equations have no
        section, with its unknowns counted as those of that point.
        """
        unknowns = self.nearest(point.solution.unknowns, point.solution.values, other)
        if unknowns is None or np.array_equal(unknowns, point.solution.unknowns):
            return point
        found = other.curve.known(unknowns, point.parameters)
        return point if found is None else other.curve.with_tangent(found, other.tangent) or point

    def at_another_section(self, orbit: Any) -> Any:
        """An orbit with its section farther from all events; None if the equations have no section,
        or there is no better one.
        """
        return None

    # --- 7. what bounds a step -----------------------------------------------

    @abstractmethod
    def barrier(self, point: Any) -> TestFunction:
        """A test function that is negative where the equations of a point do not hold."""

    def accepts(self, ahead: Any, cut: Callable[[], Cut | End | None]) -> bool:
        """Whether a step to a point, which may be cut, has stayed on its branch."""
        return True

    # --- 8. what lies beyond a change ----------------------------------------

    def change(self, zero: Zero, point: Any) -> Cut | End:
        """The cut at a zero of the barrier ahead of a point, with its kind of special point, or
        without one if nothing changes but how the orbit is given. An end if the orbits beyond
        belong to another branch."""
        return Cut(zero.point, zero)

    @abstractmethod
    def beyond(self, cut: Cut, points: list[Any]) -> Any:
        """The point with which the branch of `points` goes on beyond a cut, or the end."""

    def born_at(self, cut: Cut, points: list[Any]) -> Zero | None:
        """The special point of the parent's branch if a family ends at a cut because it is born
        there; else None.
        """
        return None

    def located_beyond(self, cut: Cut, following: Any) -> Zero | None:
        """The special point of a cut, located among the orbits beyond it, of which `following` is
        the first; None where it is not known better from there.
        """
        return None

    def also_at(self, cut: Cut, following: Any) -> Zero | None:
        """A further special point at a cut, from the first point beyond; None if there is none."""
        return None

    def size_of(self, orbit: Any) -> float:
        """How large an orbit is: 0 where it has shrunk to rest."""
        return float(orbit.size)

    # an orbit of a smaller size, in natural units, has shrunk to rest
    least_size: float = 1e-7

    def relays_meet(self, points: list[Any]) -> float | None:
        """The parameter at which the two functions of a relay meet that keeps a cycle alive, which
        has nearly shrunk to nothing; None of other orbits."""
        return None

    def birth(self, points: list[Any]) -> float | None:
        """The parameter at which the orbits of a branch, which has shrunk, are born of an
        equilibrium; None if they are not.
        """
        return None

    def connection(self, points: list[Any]) -> float | None:
        """The parameter at which the orbits of a branch come to an equilibrium in the midst of
        their round, so that they last ever longer: a homoclinic connection, or one of several
        equilibria. None if they do not.
        """
        return None

    def lost_ahead(self, point: Any) -> Zero | None:
        """The special point ahead at which an orbit that has nearly shrunk to rest is lost; None if
        it shrinks without one.
        """
        return None

    def first_step(self, point: Any, ahead: Any) -> float:
        """The longest first step beyond a cut at `point`, from the first orbit `ahead` of it."""
        return math.inf

    def stalled(
        self, point: Any, step: float, points: list[Any], bounds: Bounds
    ) -> Cut | End | None:
        """The cut or the end at a point from which no step leads on; None if the equations do not
        know why.
        """
        return None

    def note(self, kind: str, point: Any) -> str:
        """What a special point of a kind is besides, in words; empty if it is nothing else."""
        return self._of_half_the_period(point) if kind == "BPC" else ""

    def _of_half_the_period(self, point: Any) -> str:
        """Whether a branch point is a period doubling in a system whose equations repeat themselves
        after half a forcing period, in words."""
        orbit = point.orbit
        if (
            orbit.symmetric
            or not self.signature.period % 2
            or not has_half_the_period(orbit.system)
        ):
            return ""
        motion = orbit.motion()
        middle = np.concatenate(
            [np.atleast_1d(part) for part in motion.at(motion.start + 0.5 * orbit.duration)]
        )
        begin = np.concatenate([np.atleast_1d(part) for part in motion.at(motion.start)])
        size = np.abs(begin).max() + np.abs(middle).max()
        if np.abs(middle - begin).max() > HALVES_ALIKE * size:
            return ""
        return (
            "the load acts alike half a forcing period later, as through its square, so that this "
            "is a period doubling of an orbit of half the period"
        )

    # --- 9. curves of special points -----------------------------------------

    @abstractmethod
    def curve_barrier(self, kind: str, point: Any) -> TestFunction:
        """The barrier along a curve of special points of a kind."""

    def touched(self, special: Zero) -> tuple[Signature, np.ndarray] | None:
        """Of the two signatures that meet at a grazing, the one with more impacts, and the orbit's
        unknowns in it; None if curves of grazings are not followed."""
        return None

    # --- 10. proof -----------------------------------------------------------

    def segments_to_prove(self, solution: Solution) -> OrbitSegments | CannotProve:
        """The segments of an orbit, with their events as expressions, or why this kind of orbit
        cannot be proved yet.
        """
        return CannotProve(
            "orbits with sticking, with rests among several contacts or two sides, with dependent "
            "gaps, or with coordinates that follow their events are not proved yet"
        )

    def touching_segments(self, point: Any) -> OrbitSegments | CannotProve:
        """The same of the orbit at a grazing, with the touch as an event without a jump."""
        return CannotProve("grazings of this kind of orbit are not proved yet")

    # --- what follows --------------------------------------------------------

    @cached_property
    def natural(self) -> NaturalUnits:
        """The natural units of the system, in which thresholds are numbers."""
        return natural_units(self.system)

    @cached_property
    def units(self) -> Units:
        """The natural units of the unknowns and of the residuals; those of a state at a section,
        if a kind has no others.
        """
        return Units(self.natural.state, self.natural.state, self.is_phase)

    @cached_property
    def is_phase(self) -> np.ndarray:
        """Which unknowns are phases of the load, (n,); the others are coordinates and
        velocities.
        """
        return np.zeros(self.size, dtype=bool)

    def stretch(self, solution: Solution) -> float:
        """How much larger than natural an orbit is, at least 1: the largest of its velocities among
        the unknowns, in natural units."""
        moving = self.is_velocity & ~self.is_phase
        found = np.abs(solution.unknowns / self.units.unknowns)
        return float(found.max(where=moving, initial=1.0))

    @cached_property
    def is_velocity(self) -> np.ndarray:
        """Which unknowns are velocities, (n,)."""
        return np.arange(self.size) >= self.own

    def in_units(self, rows: np.ndarray) -> np.ndarray:
        """Derivatives of the residuals to the unknowns, and to parameters behind them, (m, n + k),
        as those of numbers in natural units."""
        n = self.size
        scaled = rows / np.reshape(self.units.residuals, (-1, 1))
        scaled[:, :n] *= self.units.unknowns
        return scaled

    @property
    def values(self) -> np.ndarray:
        """The parameters of the system itself."""
        return self._values[self._places]

    @property
    def model_paths(self) -> tuple[str, ...]:
        """The paths that lead to numbers of the system."""
        return self.paths

    @property
    def own(self) -> int:
        """Degrees of freedom."""
        return self._follower.own

    @cached_property
    def following(self) -> np.ndarray:
        """The places of unknowns that follow from the others, velocities of coordinates of first
        order and dependent sums: 0.
        """
        moving = 2 * self.own - len(self.system.model.first_order)
        own = self.own
        return np.array(
            [*range(own - self.system.dependent, own), *range(moving, 2 * own)], dtype=int
        )

    @property
    def margins(self) -> tuple[str, ...]:
        """The model's margins, in the order of `extremes`."""
        return tuple(self._run.limits)

    @cached_property
    def closing(self) -> float:
        """The phase that the equations cover."""
        return 2.0 * math.pi * self.signature.span

    def frequency(self, values: np.ndarray) -> float:
        """The forcing frequency at the given parameters."""
        place = self._place_of_frequency
        return float(self._values[self._frequency] if place < 0 else values[place])

    @cached_property
    def _place_of_frequency(self) -> int:
        """The place of the forcing frequency among the parameters; -1 if it is none of them."""
        return self.paths.index(FREQUENCY) if FREQUENCY in self.paths else -1

    def frequency_of(self, solution: Solution) -> float:
        """The frequency of an orbit's rounds, of which its signature counts the period: that of the
        load.
        """
        return self.frequency(solution.values)

    def period_of(self, solution: Solution) -> float:
        """The period of an orbit as it is shown: in forcing periods, or the time of a cycle."""
        return self.signature.period

    def lasting(self, solution: Solution, rounds: float) -> dict[str, Any]:
        """The arguments of `simulate` for a motion of so many rounds, the forcing periods."""
        return {"periods": rounds}

    def family(self, solution: Solution) -> tuple[OrbitEquations, np.ndarray, np.ndarray]:
        """The equations of the orbits of all energies along their period, with the unknowns and the
        period of one of them.

        Raises
        ------
        ParameterError
            The period is that of the load.
        """
        raise ParameterError(
            'the period of a forced orbit is that of its load: follow it along "load.frequency"',
            "path",
        )

    @property
    def multiplier_count(self) -> int:
        """The number of an orbit's multipliers."""
        model = self.given.model
        return 2 * len(model.coordinates) - len(model.first_order)

    def return_map(self, evaluation: OrbitEvaluation) -> np.ndarray:
        """The map whose eigenvalues are the multipliers, but for those that contacts make 0."""
        chain = evaluation.monodromy()
        following = self.following
        if not following.size:  # of most orbits; the copies take longer than the eigenvalues
            return chain
        return np.delete(np.delete(chain, following, axis=0), following, axis=1)

    def system_at(self, values: np.ndarray) -> System:
        """The system with the given parameters.

        Raises
        ------
        ParameterError
            Where it refuses them, or where gaps take the places of other coordinates than in these
            equations.
        """
        system = self.given_at(values).in_gap_coordinates
        if not _same_places(system.model, self.system.model):
            names = ", ".join(system.model.coordinates)
            raise ParameterError(
                f"a factor in a contact's sum outgrows another one, and gaps are {names} from here"
                " on: begin the branch anew behind it"
            )
        return system

    def keeps_gaps(self, values: np.ndarray) -> bool:
        """Whether the given parameters are accepted and gaps take the places of the same
        coordinates, where a parameter is a factor in their sums."""
        if not self._moves_gaps:
            return True
        try:
            self.system_at(values)
        except SaltusError:
            return False
        return True

    @cached_property
    def _moves_gaps(self) -> bool:
        """Whether a parameter is a factor in the sums of gaps."""
        model: Any = self.system.model
        if self.system is self.given or not hasattr(model, "gap_sums"):
            return False
        for path in self.paths:
            value = float(self.given.get(path))
            try:
                # a share of the value, as its unit is not known; of 0 any number is beside it
                beside = self.given.with_({path: value * (1.0 + 1e-3) if value else 1e-3})
            except SaltusError:  # on one side of a limit of the parameter
                continue
            other: Any = beside.in_gap_coordinates.model
            if not _same_places(other, model) or other.gap_sums()[0] != model.gap_sums()[0]:
                return True
        return False

    def given_at(self, values: np.ndarray) -> System:
        """The system as the user gave it, with the given parameters; an orbit's states are given in
        its coordinates.
        """
        return self.given.with_(
            {path: float(value) for path, value in zip(self.paths, values, strict=True)}
        )

    def with_signature(self, signature: Signature) -> Self:
        """The equations of the same kind for another signature."""
        return type(self)(self.given, signature, self.paths, self.tol)

    @cached_property
    def mirror(self) -> Mirror | None:
        """The mirror symmetry of its system; None without one."""
        return mirror_of(self.system)

    @property
    def images(self) -> tuple[int, ...]:
        """The number of the mirror image of each contact, friction and surface; none where there is
        no such symmetry.
        """
        return () if self.mirror is None else self.mirror.parts

    def image_of(self, states: np.ndarray) -> np.ndarray:
        """The mirror images of states (..., 2 coordinates); sums that follow from others are 0 in
        them, as in the unknowns."""
        assert self.mirror is not None, "asked for where the symmetry is known alone"
        images = self.mirror.of(states)
        images[..., self._sums] = 0.0
        return images

    def turned(self, directions: np.ndarray) -> np.ndarray:
        """The mirror images of differences of states (..., 2 coordinates)."""
        assert self.mirror is not None, "asked for where the symmetry is known alone"
        images = self.mirror.turned(directions)
        images[..., self._sums] = 0.0
        return images

    @cached_property
    def _sums(self) -> np.ndarray:
        """The places of sums that follow from other coordinates, and of their rates."""
        first = self.own - self.system.dependent
        return np.array([*range(first, self.own), *range(self.own + first, 2 * self.own)], int)

    @cached_property
    def halved(self) -> Self:
        """The equations of the orbits that are their own images, over half a period: symmetric
        orbits if the period is odd, else orbits of half the period."""
        return self.with_signature(self.signature.halved())

    def over_full_period(self, unknowns: np.ndarray) -> tuple[Self, np.ndarray]:
        """The equations of the full period of a symmetric orbit, and the orbit's unknowns in
        them.
        """
        return self.with_signature(self.signature.over_full_period(self.images)), self.repeated(
            unknowns
        )


def _same_places(one: Any, other: Any) -> bool:
    """Whether gaps take the places of the same coordinates in two models; their names may differ,
    as those of y - x and y - 1.1 x do."""
    places = [getattr(model, "gap_places", None) for model in (one, other)]
    unnamed = [part and replace(part, names=()) for part in places]
    return bool(unnamed[0] == unnamed[1])
