"""The boundary-value problem of a periodic orbit with a given signature, and its derivatives (see docs/method.md).

The unknowns of an orbit with impacts are, for each impact i, its phase phi_i = Omega t_i and the speed v_i at which the gap
closes. Segment i is the smooth motion on its side from impact i, with the velocity that the reset gives, to impact i+1, whatever
the sign of the gap w between them; the last segment ends with the first impact of the next period. The equations of each segment
are

    w(t_{i+1}) / (t_{i+1} - t_i) = 0,        -w'(t_{i+1}) - v_{i+1} = 0,

which are regular also at v_i = 0, where the signature changes. The unknowns of an orbit without impacts are its state at phase 0,
and the equation says that the state a period later is the same. Orbits of a system whose contact is no singularity
(`flow/one_contact/regularity.py`) have this equation too, whatever sides they pass through; grazing is then nothing special.
The equations of a symmetric orbit cover half a period, after which it is its mirror image.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from saltus.errors import ParameterError
from saltus.flow import (
    STRUCTURE_SIZES,
    ContactRegularity,
    SegmentColumn,
    SegmentValue,
    Where,
    contact_regularity,
    load_segments,
    program,
    taylor_order,
)
from saltus.orbits.signature import Signature
from saltus.systems import System, contact_images, numbers
from saltus.taylor import FREQUENCY, record_table

ORBIT_TOLERANCE = 1e-14  # of the segments' steps: the orbits are then exact to rounding


@dataclass(frozen=True)
class OrbitEvaluation:
    """The problem at one point: the residual and its derivatives, one block for each segment, and extremes along the segments.

    Block row i of the Jacobian has `here[i]` in the columns of the unknowns of segment i, and `there[i]` in those of the next
    one.
    """

    residual: np.ndarray  # (n d,)
    here: np.ndarray  # (n, d, d)
    there: np.ndarray  # (n, d, d)
    parameters: np.ndarray  # (n d, parameters)
    ends: np.ndarray
    extremes: np.ndarray  # (n, 4 + margins): extrema within each segment, by `HUMP`, ... of `segments.py`; empty if not asked for

    def jacobian(self, closing: float = 1.0) -> np.ndarray:
        """The derivatives to the unknowns; with `closing` -1 for perturbations that change their sign each (half) period."""
        matrix = np.zeros((len(self.residual), len(self.residual)))
        self._fill(matrix, closing)
        return matrix

    def _fill(self, matrix: np.ndarray, closing: float) -> None:
        """Write the derivatives to the unknowns, block by block, into the first columns of a matrix of zeros."""
        n, d, _ = self.here.shape
        width = matrix.shape[1]
        flat, step = matrix.reshape(-1), d * (width + 1)
        for i in range(d):
            for j in range(d):
                flat[i * width + j :: step][:n] = self.here[:, i, j]
                flat[i * width + j + d :: step][: n - 1] = self.there[:-1, i, j]
        matrix[-d:, :d] += closing * self.there[-1]

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
        """The product of the segments' maps: from the first unknowns to those a (half) period later; inf at a grazing."""
        chain = np.eye(self.here.shape[1])
        with np.errstate(all="ignore"):
            try:
                maps = -np.linalg.solve(self.there, self.here)
            except np.linalg.LinAlgError:
                return np.full_like(chain, np.inf)
            for segment in maps:
                chain = segment @ chain
        return chain


class Segments(NamedTuple):
    """Smooth segments, in the form that the flow's `follow_segments` takes."""

    spans: np.ndarray  # (n, 3): when each segment begins and ends, and the speed of the impact with which it begins
    sides: np.ndarray  # (n, 2): the side before the impact with which it begins (0 without impact), and the side along it
    states: np.ndarray  # (n, 2 d): its first state, if it begins without an impact


class FollowedSegments(NamedTuple):
    """The results of the flow's `follow_segments`."""

    ends: np.ndarray
    columns: np.ndarray  # the derivatives of the ends
    extremes: np.ndarray
    rates: np.ndarray  # the sign of the gap's derivative to the coordinate, on each side


class OneContactEquations:
    """The equations of one signature of a system, as functions of the unknowns and of the parameters at `paths`."""

    stray: float = math.inf  # see `EquationCurve`
    rounded: float = 0.0  # the largest residual that rounding may leave; above 0 for problems with very large multipliers

    def __init__(self, system: System, signature: Signature, paths: tuple[str, ...] = (), tol: float = ORBIT_TOLERANCE) -> None:
        if system.load.frequency is None:
            raise ParameterError(
                "a load without a frequency has no forcing period, so no periodic orbits to find; give one", "load.frequency"
            )
        self.system, self.signature, self.paths, self.tol = system, signature, paths, tol
        self._run = _ready(system, paths)
        if self._run.trace.records:
            raise ParameterError(
                "a load with a Record or a pulse is not periodic, so it has no periodic orbits; use Harmonic signals"
            )
        names = [path for path, _ in numbers(system)]
        self._values = np.array([value for _, value in numbers(system)])
        self._places = [names.index(path) for path in paths]
        self._frequency = names.index(FREQUENCY)
        self._where = np.zeros(len(Where), dtype=np.int64)
        self._where[Where.ORDER] = taylor_order(tol)
        self._where[STRUCTURE_SIZES] = self._run.structure.sizes
        self._settings, self._records = np.array([0.0, 0.0, tol]), record_table(system, [])

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the arguments only: compiled code is loaded again in the process that reads them."""
        return type(self), (self.system, self.signature, self.paths, self.tol)

    @cached_property
    def passes_contact(self) -> bool:
        """Whether the contact is no singularity for any values of the parameters at `paths`, so that orbits pass through it."""
        if self.signature.sides or not self.system.model.has_one_contact:
            return False
        values = self._values.copy()
        values[self._places] = 0.0  # The answer holds for all of them, and is then computed once.
        return contact_regularity(self._run.trace, tuple(values), self.paths) is ContactRegularity.CONTINUOUS

    @property
    def values(self) -> np.ndarray:
        """The parameters of the system itself."""
        return self._values[self._places]

    @property
    def own(self) -> int:
        """Degrees of freedom."""
        return int(self._where[Where.OWN])

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return 2 * (len(self.signature.sides) or self.own)

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
        return float(values[self.paths.index(FREQUENCY)] if FREQUENCY in self.paths else self._values[self._frequency])

    def at(self, values: np.ndarray) -> System:
        """The system with the given parameters.

        Raises
        ------
        ParameterError
            Where it refuses them.
        """
        return self.system.with_({path: float(value) for path, value in zip(self.paths, values, strict=True)})

    def with_signature(self, signature: Signature) -> OneContactEquations:
        """The problem of another signature."""
        return type(self)(self.system, signature, self.paths, self.tol)

    @cached_property
    def images(self) -> tuple[int, ...]:
        """The number of the mirror image of each contact and friction; none where there is no such symmetry."""
        return contact_images(self.system.model, self.system.impact) or ()

    @cached_property
    def halved(self) -> OneContactEquations:
        """The problem of the orbits that are their own images, over half a period: symmetric orbits if the period is odd, else
        orbits of half the period."""
        own, odd = self.signature, bool(self.signature.period % 2)
        period = own.period if odd else own.period // 2
        sides, events = own.sides[: len(own.sides) // 2], own.events[: len(own.events) // 2]
        return self.with_signature(replace(own, sides=sides, events=events, period=period, symmetric=odd))

    def impacts(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> tuple[np.ndarray, np.ndarray]:
        """The phases of the impacts, and the speeds at which the gap closes before them."""
        return (unknowns[::2], unknowns[1::2]) if self.signature.sides else (np.empty(0), np.empty(0))

    def touching_speed(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> float:
        """The least speed of the impacts at which the map loses its derivative if the speed vanishes; inf without such
        impacts."""
        return float(self.impacts(unknowns, evaluation)[1].min(initial=math.inf))

    def pressing(self, unknowns: np.ndarray, evaluation: OrbitEvaluation) -> float:
        """A quantity that is negative if a contact that the equations take for closed would open; inf without closed contacts."""
        return math.inf

    def half_way(self, unknowns: np.ndarray, values: np.ndarray, evaluation: OrbitEvaluation) -> np.ndarray | None:
        """For an orbit without impacts, the difference of its image from itself; None where the motion cannot be followed."""
        found = self.halved.evaluate(unknowns, values)
        return None if found is None else found.residual

    def repeated(self, unknowns: np.ndarray) -> np.ndarray:
        """The unknowns of an orbit with impacts that goes round twice in the time that the equations of the doubled orbit
        cover."""
        later = unknowns.copy()
        later[::2] += self.closing
        return np.concatenate([unknowns, later])

    def alternating(self, direction: np.ndarray) -> np.ndarray:
        """A perturbation of the unknowns as one of the `repeated` unknowns, with the other sign in the second round."""
        return np.concatenate([direction, -direction])

    def evaluate(
        self, unknowns: np.ndarray, values: np.ndarray, with_extremes: bool = False, *, later: np.ndarray | None = None
    ) -> OrbitEvaluation | None:
        """The equations at a point, or None where the motion cannot be followed.

        `later` are the unknowns asked for at the end of the period, if they differ from those at its beginning.
        """
        frequency, later = self.frequency(values), unknowns if later is None else later
        if not frequency > 0.0:
            return None
        segments = self._segments(unknowns, later, frequency)
        followed = self.follow_segments(segments, values, with_extremes)
        if followed is None:
            return None
        if not self.signature.sides:
            return self._shooting(later, frequency, followed)
        following = np.empty(len(segments.spans))
        following[:-1], following[-1] = unknowns[3::2], later[1]
        return self._crossing(following, frequency, segments, followed)

    def carried(self, state: np.ndarray, begin: float, end: float, values: np.ndarray) -> np.ndarray | None:
        """The state at phase `end` of the smooth motion without impacts from a state at phase `begin`."""
        frequency = self.frequency(values)
        spans, sides = np.array([[begin / frequency, end / frequency, 0.0]]), np.array([[0, *self._along()]])
        followed = self.follow_segments(Segments(spans, sides, state.reshape(1, -1)), values)
        return None if followed is None else followed.ends[0, SegmentValue.FIRST_STATE : SegmentValue.FIRST_STATE + 2 * self.own]

    def follow_segments(self, segments: Segments, values: np.ndarray, with_extremes: bool = False) -> FollowedSegments | None:
        """The smooth motion along segments, with its extremes if asked for; None where a segment cannot be followed."""
        parameters = self._values.copy()
        parameters[self._places] = values
        env, model = self._run.structure.prepare(parameters, self._records)
        n, own = len(segments.spans), self.own
        ends, columns = np.zeros((n, SegmentValue.FIRST_STATE + 6 * own)), np.zeros((n, 4 * own, self._where[Where.COLUMNS]))
        extremes = np.zeros((n if with_extremes else 0, SegmentColumn.LEAST_MARGIN + max(1, self._where[Where.MARGINS])))
        done = load_segments()[0](self._where, self._settings, env, model, *segments, ends, columns, extremes)
        return None if done < n else FollowedSegments(ends, columns, extremes, np.sign(model[4][1:]))

    def _segments(self, unknowns: np.ndarray, later: np.ndarray, frequency: float) -> Segments:
        """The segments between the impacts, the last one up to the first impact of the next period."""
        n = len(self.signature.sides)
        if not n:
            spans = np.array([[0.0, self.closing / frequency, 0.0]])
            return Segments(spans, self._sides, unknowns.reshape(1, -1).copy())
        spans = np.empty((n, 3))
        spans[:, 0] = unknowns[::2]
        spans[:-1, 1], spans[-1, 1] = unknowns[2::2], later[0] + self.closing
        spans[:, :2] /= frequency
        spans[:, 2] = unknowns[1::2]
        return Segments(spans, self._sides, np.zeros((n, 2)))

    @cached_property
    def _sides(self) -> np.ndarray:
        """The sides before and along each segment, (n, 2)."""
        sides, along = self.signature.sides, self._along()
        return np.array(list(zip(sides or (0,), along, strict=True)), dtype=np.int64)

    @cached_property
    def _rate_of(self) -> np.ndarray:
        """The place of each segment's side in `FollowedSegments.rates`, (n,)."""
        return np.where(self._sides[:, 1] > 0, 0, 1)

    def _along(self) -> tuple[int, ...]:
        """The side of each segment; 0 stands for all sides, where the contact is passed through."""
        return (0,) if self.passes_contact else self.signature.along()

    def _shooting(self, later: np.ndarray, frequency: float, followed: FollowedSegments) -> OrbitEvaluation:
        own, sign = self.own, -1.0 if self.signature.symmetric else 1.0
        ends, columns, extremes, _ = followed
        state = ends[0, SegmentValue.FIRST_STATE : SegmentValue.FIRST_STATE + 2 * own]
        rates = ends[0, SegmentValue.FIRST_STATE + own : SegmentValue.FIRST_STATE + 3 * own]
        parameters = sign * columns[0, : 2 * own, 2 * own :]
        if FREQUENCY in self.paths:
            parameters[:, self.paths.index(FREQUENCY)] -= sign * rates * self.closing / frequency**2
        here, there = sign * columns[:, : 2 * own, : 2 * own], -np.eye(2 * own)[None]
        return OrbitEvaluation(sign * state - later, here, there, parameters, ends, extremes)

    def _crossing(
        self, following: np.ndarray, frequency: float, segments: Segments, followed: FollowedSegments
    ) -> OrbitEvaluation:
        """The equations of the impacts at the ends of the segments, at which the gap closes with the speeds `following`."""
        spans, (ends, columns, extremes, rates) = segments.spans, followed
        n, count = len(spans), len(self.paths)
        sign = rates[self._rate_of]
        residual, here, there = np.empty((n, 2)), np.empty((n, 2, 2)), np.empty((n, 2, 2))
        parameters = np.empty((n, 2, count))
        place = self.paths.index(FREQUENCY) if FREQUENCY in self.paths else -1
        load_segments()[1](spans, sign, following, frequency, place, ends, columns, residual, here, there, parameters)
        return OrbitEvaluation(residual.ravel(), here, there, parameters.reshape(2 * n, count), ends, extremes)


def _ready(system: System, paths: tuple[str, ...]) -> Any:
    """The compiled program of a system with derivatives to the parameters at `paths`, and with all of the model's margins."""
    return program(system, system.model.margin_names(system.load), paths)
