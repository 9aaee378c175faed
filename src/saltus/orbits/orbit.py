"""A periodic orbit: its impacts, amplitude, multipliers and margins, and its check by direct
simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import LIMITS, check_count, with_answers
from saltus.continuation import NEWTON, newton
from saltus.errors import MotionError
from saltus.flow import (
    Extreme,
    Motion,
    SegmentColumn,
    Validity,
    displacements_of,
    quantity_of,
    simulate,
)
from saltus.orbits.contract.equations import OrbitEquations, OrbitEvaluation, Solution
from saltus.orbits.contract.event_sequence import remembered_at
from saltus.orbits.eigenvalues import eigenvalues
from saltus.orbits.signature import TOLERANCES, Signature
from saltus.progress import html_table
from saltus.result import Result, function_for
from saltus.systems import (
    System,
    arguments_of,
    driven_displacements,
    natural_units,
    state_of,
)

if TYPE_CHECKING:
    import xarray

# enough from a guess near the orbit; a motion that has not quite settled needs more
NEWTON_ITERATIONS = 12


@with_answers
@dataclass(frozen=True, eq=False)
class PeriodicOrbit(Result):
    """A periodic orbit of the exact system, solved to rounding.

    Phases and speeds are those of one period of the orbit, q forcing periods, in the order of the
    impacts.

    Attributes
    ----------
    equations
        The equations that it solves: those of a system, with given parameters and a given sequence
        of impacts.
    solution
        The solution of these equations.

    Examples
    --------
    >>> orbit.period, orbit.signature.impact_count, orbit.stable
    (1, 2, True)
    >>> bool(orbit.defect < 1e-12)  # its distance from itself after a period of direct simulation
    True
    """

    equations: OrbitEquations
    solution: Solution

    @classmethod
    def near(
        cls,
        equations: OrbitEquations,
        unknowns: np.ndarray,
        values: np.ndarray,
        iterations: int = NEWTON_ITERATIONS,
    ) -> PeriodicOrbit | None:
        """The orbit near a guess at fixed parameters, or None where Newton's method does not
        converge.

        Parameters
        ----------
        equations
            The equations.
        unknowns
            A guess of their unknowns, (n,).
        values
            The parameters' values.
        iterations
            How many steps of Newton's method at most.
        """
        found = solve(equations, unknowns, values, iterations)
        return None if found is None else PeriodicOrbit(equations, found)

    @classmethod
    def known(
        cls, equations: OrbitEquations, unknowns: np.ndarray, values: np.ndarray
    ) -> PeriodicOrbit | None:
        """The orbit whose unknowns are known: nothing is solved. None where its motion cannot be
        followed.

        Parameters
        ----------
        equations
            The equations.
        unknowns
            Their unknowns, (n,).
        values
            The parameters' values.
        """
        evaluation = equations.evaluate(unknowns, values, with_extremes=True)
        return (
            None
            if evaluation is None
            else PeriodicOrbit(
                equations, Solution(unknowns, values, evaluation, 0, equations.units)
            )
        )

    @cached_property
    def system(self) -> System:
        """The system, with the orbit's parameters."""
        return self.equations.given_at(self.solution.values)

    @property
    def signature(self) -> Signature:
        """Sides before the impacts, forcing periods, symmetry."""
        return self.equations.signature

    @property
    def period(self) -> Any:
        """q, the number of forcing periods after which the orbit repeats itself; of a cycle of a
        system without a load that varies, the time after which it does.
        """
        return self.equations.period_of(self.solution)

    @property
    def symmetric(self) -> bool:
        """Whether it is its own mirror image after half a period."""
        return self.signature.symmetric

    @property
    def frequency(self) -> float:
        """Omega of the load; of a cycle without one, 2 pi by the time of one of its rounds."""
        return self.equations.frequency_of(self.solution)

    @property
    def duration(self) -> float:
        """The time of its period, q 2 pi / Omega."""
        return 2.0 * math.pi * self.signature.period / self.frequency

    @cached_property
    def _impacts(self) -> tuple[np.ndarray, np.ndarray]:
        """The phases and speeds of the impacts in one period; those of an orbit with rests follow
        its first release.
        """
        phases, speeds = self.equations.impacts(self.solution)
        if self.symmetric:
            phases, speeds = (
                np.concatenate([phases, phases + self.equations.closing]),
                np.tile(speeds, 2),
            )
        if not self.releases.size:
            return phases, speeds
        first = self.releases[0] * self.frequency
        phases = first + (phases - first) % (2.0 * math.pi * self.signature.period)
        order = np.argsort(phases, kind="stable")
        return phases[order], speeds[order]

    @property
    def _phases(self) -> np.ndarray:
        return self._impacts[0]

    @cached_property
    def impact_times(self) -> np.ndarray:
        """The times of the impacts, from phase 0 of the load's period in which the first one lies,
        (n,).
        """
        times: np.ndarray = (self._phases - 2.0 * math.pi * self._shift) / self.frequency
        return times

    @property
    def impact_count(self) -> int:
        """The number of impacts in one of its periods; of an accumulation, those that are
        resolved.
        """
        return int(self._phases.size)

    @property
    def counted_impacts(self) -> int:
        """The number of impacts in one of its periods, without those of accumulations, whose number
        depends on rounding.
        """
        return self.equations.counted_impacts(self.solution) * (2 if self.symmetric else 1)

    @property
    def _shift(self) -> float:
        counted = self._phases.size and not self.releases.size
        return math.floor(self._phases[0] / (2.0 * math.pi)) if counted else 0.0

    @property
    def speeds(self) -> np.ndarray:
        """The speeds at which the gap closes, just before the impacts, (n,)."""
        return self._impacts[1]

    @property
    def sides(self) -> np.ndarray:
        """The sides before the impacts, (n,)."""
        sides = np.array(self.signature.sides, dtype=int)
        return np.concatenate([sides, -sides]) if self.symmetric else sides

    @cached_property
    def _excursions(self) -> np.ndarray:
        """The releases and the rests after them, (n, 2), from the release on that is earliest in
        the forcing period.
        """
        found = self.equations.rests(self.solution)
        period = self.duration / self.signature.period
        if not found.size:
            return found
        within = found[:, 0] % period
        begin = found[int(np.argmin(within))]
        turned = (found[:, 0] - begin[0]) % self.duration
        turned[turned > self.duration - TOLERANCES.release * period] = 0.0
        order = np.argsort(turned, kind="stable")
        first = within.min() + turned[order]
        return np.column_stack([first, first + (found[:, 1] - found[:, 0])[order]])

    @property
    def releases(self) -> np.ndarray:
        """The times at which it leaves rest at a contact, from phase 0 of the load's period in
        which the first one lies, (n,).
        """
        return self._excursions[:, 0]

    @property
    def rests(self) -> np.ndarray:
        """The times at which it comes to rest at a contact, each after the release of the same
        index, (n,).
        """
        return self._excursions[:, 1]

    @property
    def rest_durations(self) -> np.ndarray:
        """How long each rest lasts, (n,)."""
        releases = self.releases
        durations: np.ndarray = np.append(releases[1:], releases[:1] + self.duration) - self.rests
        return durations

    @property
    def rest_share(self) -> float:
        """The share of its period for which it rests at a contact, of several at one at least."""
        if not self.releases.size:  # it rests all the time, or never
            contacts = (1 << len(self.system.model.contacts)) - 1  # not the frictions behind them
            closed = [event.closed for event in self.signature.events] or [self.signature.closed]
            return float(all(bits & contacts for bits in closed))
        return float(self.rest_durations.sum() / self.duration)

    @property
    def residual(self) -> float:
        """The largest residual of its equations."""
        return self.solution.residual

    @cached_property
    def _extremes(self) -> np.ndarray:
        return self.solution.evaluation.extremes

    @cached_property
    def extrema(self) -> np.ndarray:
        """The least and the largest value of each coordinate over its period, (n, 2); nan where the
        motion cannot be followed by direct simulation.
        """
        try:
            return self._own_extrema
        except MotionError:
            return np.full((len(self.equations.given.model.coordinates), 2), np.nan)

    @cached_property
    def _own_extrema(self) -> np.ndarray:
        return self.motion().extrema

    @cached_property
    def _middle(self) -> float | None:
        """The centre of a symmetric orbit, 0 for others; None if the centres of its coordinates
        differ."""
        if not self.symmetric:
            return 0.0
        mirror = self.equations.mirror
        return None if mirror is None else mirror.middle

    @cached_property
    def reach(self) -> tuple[float, float]:
        """The least and the largest value of any coordinate, by which orbits are told apart. It is
        no quantity of its own where coordinates have different meanings.
        """
        if self._in_others or self._middle is None:
            return float(self._own_extrema[:, 0].min()), float(self._own_extrema[:, 1].max())
        top = max(self._extremes[:, SegmentColumn.HIGHEST].tolist())
        bottom = min(self._extremes[:, SegmentColumn.LOWEST].tolist())
        if not self.symmetric:
            return bottom, top
        high = max(top, 2.0 * self._middle - bottom)
        return 2.0 * self._middle - high, high

    @property
    def size(self) -> float:
        """The largest absolute value of any coordinate, as `reach` has it."""
        return max(map(abs, self.reach))

    @cached_property
    def _driven_range(self) -> tuple[float, float]:
        """The least and the largest value of the displacement that the load drives; nan where the
        motion cannot be followed by direct simulation."""
        ranges = [self.ranges[name] for name in driven_displacements(self.equations.given)]
        return min(low for low, _ in ranges), max(high for _, high in ranges)

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """The least and the largest value over its period of each coordinate and each named point;
        nan where the motion cannot be followed by direct simulation.
        """
        given = self.equations.given
        if len(given.model.coordinates) == 1:
            return {given.model.coordinates[0]: self.reach}
        names = displacements_of(given)
        try:
            motion = self.motion()
        except MotionError:
            return dict.fromkeys(names, (math.nan, math.nan))
        return {name: motion.range_of(name) for name in names}

    @property
    def highest(self) -> float:
        """The largest value of the coordinate; of several, of the one that the load drives."""
        return self._driven_range[1]

    @property
    def lowest(self) -> float:
        """The least value of the coordinate; of several, of the one that the load drives."""
        return self._driven_range[0]

    @property
    def amplitude(self) -> float:
        """The largest absolute value of the coordinate; of several, of the one that the load drives.
        `quantity` has that of another one.
        """
        return max(map(abs, self._driven_range))

    def quantity(self, which: str | Callable[[Motion], Any] = "amplitude") -> float:
        """A quantity of its motion over its period.

        Parameters
        ----------
        which
            "amplitude", "highest" or "lowest" of the coordinate that the load drives;
            "amplitude_x", "largest_x" or "smallest_x" of a coordinate or a named point x, of which
            "x" alone is the amplitude; or a function of a motion.

        Raises
        ------
        ParameterError
            There is no such quantity.

        Examples
        --------
        >>> orbit.quantity("largest_theta") == orbit.highest
        True
        """
        asked = quantity_of(self.equations.given, which)
        if isinstance(asked, Extreme) and set(asked.displacements) <= set(self.ranges):
            return asked.over(self.ranges)
        return asked.of(self.motion())

    @cached_property
    def clearance(self) -> float:
        """The gap at its lowest minimum between impacts, inf without a minimum; if it is negative
        this is no real motion.
        """
        return float(min(self._extremes[:, SegmentColumn.LOWEST_GAP].tolist()))

    @property
    def crossings(self) -> int:
        """How often it passes through a contact that is no singularity, in one of its periods; 0
        for orbits with impacts.
        """
        return int(self._extremes[:, SegmentColumn.CROSSINGS].sum()) * (2 if self.symmetric else 1)

    @property
    def shallowest(self) -> float:
        """The least depth of its passages beyond a contact that is no singularity, on either side;
        inf without passages.
        """
        return float(self._extremes[:, SegmentColumn.SHALLOWEST].min())

    @cached_property
    def slowest(self) -> float:
        """The least speed of an impact, inf without impacts; if it is negative this is no real
        motion.
        """
        speeds = self.equations.impacts(self.solution)[1]
        return float(min(speeds.tolist(), default=math.inf))

    @cached_property
    def pressing(self) -> float:
        """With several contacts the least of the reactions of closed ones and the times between
        events, in natural units; inf with one contact. If it is negative this is no real motion."""
        return self.equations.pressing(self.solution)

    @property
    def room(self) -> float:
        """How far it is from not being a motion, in natural units: the least of `clearance`,
        `slowest` and `pressing`. Below 0 it is none.
        """
        natural = self.equations.natural
        return min(self.clearance / natural.length, self.slowest / natural.speed, self.pressing)

    @property
    def admissible(self) -> bool:
        """Whether it is a motion of the system: every impact has a positive speed, events are in
        order, and gaps are open.
        """
        phases = self._phases
        in_order = (
            np.diff(np.append(phases, phases[:1] + 2.0 * math.pi * self.signature.period))
            > -TOLERANCES.touch
        )
        return self.room > -TOLERANCES.touch and bool(in_order.all())

    @cached_property
    def margins(self) -> dict[str, float]:
        """The least value of each of the model's margins; a negative one is passed, see
        `MarginKind` (errata 20, 21).
        """
        least = self._extremes[:, SegmentColumn.LEAST_MARGIN :].min(axis=0)
        return dict(zip(self.equations.margins, map(float, least), strict=False))

    @cached_property
    def multipliers(self) -> np.ndarray:
        """The Floquet multipliers, complex: two for each coordinate, one for each coordinate of
        first order.

        They are sorted by falling modulus.
        Of equal ones, up to rounding, the larger real part comes first, and of a complex pair the
        one above the real axis.
        A contact that is closed for a part of the period makes some 0.
        A cycle without a load has one fewer: that of its own direction is always 1 and left out.
        They are inf where the orbit has an impact without speed: motions beside it without this
        impact have other ones.
        """
        count = self.equations.multiplier_count
        chain = self.equations.return_map(self.solution.evaluation)
        if self._has_touch or not np.isfinite(chain).all():
            return np.full(count, complex(np.inf))
        if count == len(chain) == 2:
            a, b = _eigenvalues_of_two(chain)
            return _two_by_falling_modulus(*((a * a, b * b) if self.symmetric else (a, b)))
        values = np.zeros(count, dtype=complex)  # 0 for what contacts hold where the state is given
        values[: len(chain)] = eigenvalues(chain)
        return by_falling_modulus(values**2 if self.symmetric else values)

    @cached_property
    def _has_touch(self) -> bool:
        """Whether one of its impacts has no speed, so that its equations have no derivative
        there.
        """
        speed = abs(self.equations.touching_speed(self.solution))
        return (
            not self.equations.passes_contact
            and speed < TOLERANCES.touch * self.equations.natural.speed
        )

    @property
    def grazes(self) -> bool:
        """Whether it touches the contact without speed, so that the map has no derivative there and
        multipliers have no meaning.

        False where the contact is no singularity (`ContactRegularity.CONTINUOUS`): multipliers then
        keep their meaning.
        """
        near = TOLERANCES.touch * self.equations.natural.length
        return self._has_touch or (not self.equations.passes_contact and abs(self.clearance) < near)

    @property
    def isolated(self) -> bool:
        """Whether no others lie beside it at the same parameters: there a multiplier is 1 and the
        equations leave a way free.

        Beside a symmetric orbit there may be others that are not symmetric: two multipliers are 1
        then, as where a mass flies freely, while it is one at a loss of the symmetry.
        """
        near = sum(abs(value - 1.0) < TOLERANCES.isolated for value in self.multipliers.tolist())
        evaluation = self.solution.evaluation
        if not near:
            return True
        matrices = [evaluation.derivatives()]
        if self.symmetric and near > 1:
            matrices.append(evaluation.jacobian(-1.0))
        return not any(_free(self.equations.in_units(matrix))[0].size for matrix in matrices)

    @cached_property
    def creeps(self) -> bool:
        """Whether it is where a motion creeps to sticking for good: within its own accuracy lies one
        that sticks for good, which has the multiplier 1.

        The motion may stand anywhere beyond. Towards the border of these places it comes as 1/n in
        n periods, and no orbit on its way is one: the return map has a double root there, which
        rounding leaves as an orbit whose multiplier is below 1 by the root of rounding.
        """
        equations = self.equations
        if not equations.system.model.frictions or self.symmetric or not equations.has_forcing:
            return False
        if not (np.abs(self.multipliers - 1.0) < TOLERANCES.creeping).any():
            return False
        evaluation = self.solution.evaluation
        _, lengths, right = np.linalg.svd(equations.in_units(evaluation.jacobian()))
        left_over = np.abs(evaluation.residual / equations.units.residuals).max()
        away = TOLERANCES.doubt * max(left_over, np.finfo(float).eps) / max(lengths[-1], left_over)
        for way in (away, -away):
            place = self.solution.unknowns + way * right[-1] * equations.units.unknowns
            beside = equations.evaluate(place, self.solution.values)
            if beside is not None and _sticks(equations.return_map(beside)):
                return True
        return False

    @property
    def stable(self) -> bool:
        """Whether it does not graze or creep and all multipliers lie inside the unit circle by more
        than rounding: not at an LP or PD.
        """
        inside = bool((np.abs(self.multipliers) < 1.0 - TOLERANCES.on_circle).all())
        return inside and not self.grazes and not self.creeps

    def start(self) -> dict[str, Any]:
        """The arguments of `simulate` that start a motion on the orbit: just after its first impact
        or, without impacts, at phase 0; with several contacts or with rests, between two events."""
        start = self.equations.start(self.solution)
        if not self._in_others:
            return start
        inner = state_of(self.system.in_gap_coordinates, start)
        own = np.concatenate(self.system.from_gaps(start.get("time", 0.0), *np.split(inner, 2)))
        return arguments_of(self.system, own) | {
            name: value for name, value in start.items() if name in ("time", "relays")
        }

    @property
    def _in_others(self) -> bool:
        """Whether the contacts of its system keep sums of coordinates, so that the equations are
        those of other coordinates.
        """
        return self.equations.system is not self.equations.given

    @property
    def followed(self) -> Motion:
        """One period of its motion in the coordinates of its equations."""
        start = self.equations.start(self.solution)
        lasting = self.equations.lasting(self.solution, self.signature.period)
        return simulate(self.system.in_gap_coordinates, **start, **lasting, tol=1e-13)

    def motion(self, periods: float | None = None, tol: float = 1e-13) -> Motion:
        """The exact motion on the orbit, from `start`.

        Parameters
        ----------
        periods
            How many forcing periods, of a cycle without a load how many rounds; by default one
            period of the orbit.
        tol
            The error that one step may make.
        """
        rounds = self.signature.period if periods is None else periods
        lasting = self.equations.lasting(self.solution, rounds)
        return simulate(self.system, **self.start(), **lasting, tol=tol)

    @cached_property
    def defect(self) -> float:
        """The distance between its state and the one a period later, by direct simulation, as the
        largest difference of a state variable in its natural unit; inf if the motion has another number of impacts, or cannot be followed, as where an event appears
        or is lost. If the orbit grazes, rounding decides whether the motion has an impact there,
        and the defect is the square root of rounding.
        """
        try:
            motion = self.motion()
        except MotionError:
            return math.inf
        start = self.start()
        begin = np.array([start[name] for name in self.system.model.coordinates])
        units = natural_units(self.system).state
        if self.signature.sides:  # the motion ends at an impact: before or after it
            moved = np.atleast_1d(motion.position) - begin
            ends = [
                float(np.abs(np.append(moved, np.abs(motion.velocity) - np.abs(v)) / units).max())
                for v in (start["velocity"], self.speeds[0])
            ]
            return (
                min(ends)
                if self.grazes or abs(len(motion.impacts) - self.signature.impact_count) <= 1
                else math.inf
            )
        return self.defect_after(1)

    def defect_after(self, rounds: int) -> float:
        """The distance between its state and the one after several of its periods, as `defect`, for
        orbits that do not start at an impact.

        Parameters
        ----------
        rounds
            The number of its periods.
        """
        check_count("rounds", rounds, 1, LIMITS.periods // self.signature.period)
        start = self.start()
        motion = self.motion(rounds * self.signature.period)
        apart = np.subtract(motion.final_state, state_of(self.system, start))
        apart /= natural_units(self.system).state
        return float(np.abs(apart[: len(apart) - len(self.system.model.first_order)]).max())

    @cached_property
    def state(self) -> tuple[Any, Any]:
        """Coordinate and velocity at phase 0 of the load, the stroboscopic section; of a cycle
        without a load, at its start."""
        start = self.start()
        if not start.get("time", 0.0):
            position, velocity = np.split(
                self.system._with_rates(0.0, state_of(self.system, start)), 2
            )
            return (
                (float(position[0]), float(velocity[0]))
                if len(position) == 1
                else (position, velocity)
            )
        period = 2.0 * math.pi / self.frequency
        ahead = max(1, math.ceil(start["time"] / period)) * period - start["time"]
        motion = simulate(self.system, **start, duration=ahead, tol=1e-13, dense=False)
        return motion.position, motion.velocity

    @property
    def remembered(self) -> dict[str, Any]:
        """The argument `relays` of `simulate` at phase 0, where `state` is; nothing for a model
        without relays."""
        if not self.signature.relays:
            return {}
        start = self.start()
        period = 2.0 * math.pi / self.frequency
        time = start.get("time", 0.0)
        ahead = (math.ceil(time / period) * period - time) if time else 0.0
        motion = simulate(self.system, **start, duration=ahead, tol=1e-13, dense=False)
        return remembered_at(motion)

    @property
    def largest_multiplier(self) -> float:
        """The modulus of its largest multiplier; 0 of the cycle of a single coordinate of first
        order, which has none."""
        return float(np.abs(self.multipliers[:1]).max(initial=0.0))

    @property
    def section_state(self) -> np.ndarray:
        """`state` as one array: coordinates, then velocities, (d,)."""
        return np.append(*self.state)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name in ("equations", "solution"):
            raise AttributeError(name)
        if name == "velocity" or name in self.system.model.coordinates:
            position, velocity = self.state
            values = np.atleast_1d(position)
            return (
                velocity
                if name == "velocity"
                else float(values[self.system.model.coordinates.index(name)])
            )
        raise AttributeError(f"a PeriodicOrbit has no {name!r}{function_for(name, 'orbit')}")

    @cached_property
    def validity(self) -> Validity:
        """Which margins of the model its motion respects, and for what share of the time (errata
        20, 21).
        """
        return self.motion().validity

    def to_xarray(self) -> xarray.Dataset:
        """One period of it over `time`, its `multiplier_real` and `multiplier_imag`, and its
        numbers as attributes.
        """
        data = self.motion().to_xarray()
        for part in ("real", "imag"):
            values = getattr(self.multipliers, part)
            data[f"multiplier_{part}"] = (
                "multiplier",
                values,
                {"units": "1", "long_name": f"Floquet multipliers, {part}"},
            )
        numbers = {
            "period": self.period,
            "symmetric": int(self.symmetric),
            "stable": int(self.stable),
            "residual": self.residual,
        }
        data.attrs |= {
            "title": "periodic orbit computed by saltus",
            "kind": "periodic_orbit",
        } | numbers
        return data

    def _repr_html_(self) -> str:
        names = ("period", "duration", "frequency", "amplitude", "symmetric", "stable", "residual")
        facts = {name: getattr(self, name) for name in names} | {"impacts": self.impact_count}
        multipliers = ", ".join(f"{value:.6g}" for value in self.multipliers)
        return html_table(
            f"Orbit of {type(self.system.model).__name__}", facts | {"multipliers": multipliers}
        )

    def __repr__(self) -> str:
        kind = "symmetric " if self.symmetric else ""
        # a cycle of one coordinate of first order has none
        largest = [f"largest multiplier {value:.6g}" for value in self.multipliers[:1]]
        return (
            f"PeriodicOrbit({kind}period {self.period:.9g}, {self.impact_count} impacts,"
            f" amplitude={self.amplitude:.9g}, {'stable' if self.stable else 'unstable'},"
            f" {(largest or ['no multipliers'])[0]}, residual={self.residual:.1g})"
        )


def _eigenvalues_of_two(matrix: np.ndarray) -> tuple[complex, complex]:
    """The eigenvalues of a matrix (2, 2), to rounding of its size; NumPy's function for any matrix
    takes ten times as long.
    """
    (a, b), (c, d) = matrix.tolist()
    half = 0.5 * (a - d)
    scale = max(abs(half), abs(b), abs(c))
    square = half / scale * half + b / scale * c if scale else 0.0
    root = math.sqrt(scale) * math.sqrt(abs(square))
    if square < 0.0:
        mean = d + half
        return complex(mean, root), complex(mean, -root)
    larger = half + math.copysign(root, half)
    # the differences of both from d have the product -b c
    return complex(d + larger), complex(d - (b / larger * c if larger else 0.0))


def by_falling_modulus(values: np.ndarray) -> np.ndarray:
    """Complex numbers in an order that no rounding changes but among equal ones: by falling
    modulus, then by falling real part, and of a complex pair the one above the real axis first.

    Moduli are equal up to `TOLERANCES.same_modulus` of the larger one.
    """
    if len(values) == 2:  # of most orbits; sorting would take longer than their eigenvalues
        return _two_by_falling_modulus(*values.tolist())
    moduli = np.abs(values)
    order = np.argsort(-moduli, kind="stable")
    falling = moduli[order]
    smaller = falling[1:] < (1.0 - TOLERANCES.same_modulus) * falling[:-1]
    group = np.empty(len(values), dtype=int)
    group[order] = np.append(0, np.cumsum(smaller))[: len(values)]
    # + 0.0 takes the sign of zeros away
    return np.asarray(values[np.lexsort((-values.imag, -values.real, group))] + 0.0)


def _two_by_falling_modulus(a: complex, b: complex) -> np.ndarray:
    larger = max(abs(a), abs(b))
    turned = abs(a) < abs(b)
    if not min(abs(a), abs(b)) < (1.0 - TOLERANCES.same_modulus) * larger:
        turned = (a.real, a.imag) < (b.real, b.imag)
    return np.array([b, a] if turned else [a, b], dtype=complex) + 0.0


def solve(
    equations: OrbitEquations,
    unknowns: np.ndarray,
    values: np.ndarray,
    iterations: int = NEWTON_ITERATIONS,
) -> Solution | None:
    """The orbit near a first guess at fixed parameters, or None where Newton's method does not
    converge. Directions that the equations leave free, as where a mass that nothing holds may stand
    anywhere, keep what they are."""

    def evaluate(place: np.ndarray, thorough: bool) -> OrbitEvaluation | None:
        return equations.evaluate(place, values, with_extremes=thorough)

    units = equations.units

    def linear(found: OrbitEvaluation, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        matrix = found.jacobian()
        left, right = _free(equations.in_units(matrix))
        tied = np.reshape(units.residuals, (-1, 1)) * (left @ right) / units.unknowns
        return matrix + tied, -found.residual

    found = newton(evaluate, linear, unknowns, iterations, units=units)
    if found is None:
        return None
    return Solution(found.place, values, found.evaluation, found.iterations, units)


def _sticks(chain: np.ndarray) -> bool:
    """Whether a return map keeps one direction as it is, to rounding alone."""
    if not np.isfinite(chain).all():
        return False
    apart = np.abs(eigenvalues(chain) - 1.0)
    return bool(apart.min(initial=math.inf) < TOLERANCES.kept)


def _free(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The equations (m, k) that a matrix (m, n) does not decide up to rounding, and the directions
    (k, n) that it leaves free.
    """
    left, lengths, right = np.linalg.svd(
        np.nan_to_num(matrix, posinf=0.0, neginf=0.0), full_matrices=False
    )
    free = lengths <= NEWTON.converged * lengths[0]
    return left[:, free], right[free]
