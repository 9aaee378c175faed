"""Lyapunov exponents of a motion, through saltation at every impact, and two independent checks of
them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.lyapunov.growth import (
    LYAPUNOV,
    Estimate,
    average,
    check_run,
    first_frame,
    period_length,
    resolution,
    span_count,
    uncertainty,
)
from saltus.bounds import Interval, Leaves, enclose, reads
from saltus.checks import Speeds, check_number
from saltus.flow import (
    EventKind,
    Motion,
    Stop,
    end_of,
    sensitivities,
    simulate,
    start_with_sides,
)
from saltus.progress import Progress, part_of, silent
from saltus.result import Result, result_dataset
from saltus.systems import System, arguments_of, natural_units, states_beside
from saltus.taylor import Expr, differentiate, substitute, trace

if TYPE_CHECKING:
    import xarray

VELOCITY = Expr("velocity", (), 0)


class Contraction:
    """ln det of the flow's derivative along a motion of a system with one coordinate.

    ln det Phi = sum over impacts of ln(R_v v+ / v-) + sum over sides s of (da/dv)_s T_s, where
    R(v-) is the law of impact and T_s the time on the side; for the metainterface (da/dv)_s = -C
    c^P / (1 + m)^P, and R_v v+ / v- = e^2 (numerics.md, section 5). It is independent of the
    derivatives that are carried along the motion.
    """

    def __init__(self, system: System) -> None:
        traced = trace(system)
        self._leaves = Leaves([Interval(value) for value in system.parameters.values()], [])
        sides = system.model.every_side
        damping = {
            s: substitute(differentiate(traced.acceleration[0], VELOCITY), {Expr("side"): float(s)})
            for s in sides
        }
        after = traced.velocity_after
        self._slopes = {}
        if after is not None:
            self._slopes = {
                s: differentiate(substitute(after, {Expr("side"): float(s)}), VELOCITY)
                for s in sides
            }
        known = not any(
            reads(d, "time", "coordinate", "velocity", "record") for d in damping.values()
        )
        known &= not any(reads(slope, "record") for slope in self._slopes.values())
        # whether da/dv is constant on each side
        self.known = known and system.model.has_state_plane
        linear = {
            s: d for s, d in self._slopes.items() if not reads(d, "time", "velocity", "record")
        }
        self._factors = {s: _middle(enclose([d], self._leaves)[0]) for s, d in linear.items()}
        self._rates = (
            {s: _middle(enclose([d], self._leaves)[0]) for s, d in damping.items()}
            if self.known
            else {}
        )

    def along(self, motion: Motion) -> float:
        """ln det from the start of a motion to its end; -inf if it rests in between, NaN if da/dv
        is not constant on a side.
        """
        if not self.known:
            return float("nan")
        if len(motion.events.of(EventKind.REST)):
            return float("-inf")
        impacts = motion.impacts
        bounds = np.concatenate([[motion.start], impacts.time, [motion.time]])
        sides = np.append(impacts.side, motion.side)
        total = sum(
            rate * np.diff(bounds)[sides == side].sum() for side, rate in self._rates.items()
        )
        for side in set(impacts.side.tolist()):
            here = impacts.side == side
            before = impacts.velocity_before[here]
            after = impacts.velocity_after[here]
            with np.errstate(divide="ignore"):
                total += np.log(
                    np.abs(self._slope(int(side), impacts.time[here], before) * after / before)
                ).sum()
        return float(total)

    def _slope(self, side: int, time: np.ndarray, before: np.ndarray) -> Any:
        """R_v at impacts with these velocities."""
        if side in self._factors:
            return self._factors[side]
        (slope,) = enclose(
            [self._slopes[side]],
            Leaves(self._leaves.parameters, [], Interval(time), speed=Interval(before)),
        )
        return _middle(slope)


def impact_factor(system: System, parameters: Mapping[str, np.ndarray]) -> np.ndarray:
    """The product over the sides of abs(dv+/dv-) of impacts without speed, for arrays of
    parameters: if it is below 1, impacts lead to rest.

    Its shape is () or that of the arrays; it is NaN if the impact law has no slope there, and 0 if
    contacts or frictions hold a coordinate.
    """
    traced = trace(system)
    if traced.velocity_after is None:
        return np.zeros(()) if traced.reactions else np.ones(())
    values = [
        Interval(np.asarray(parameters.get(path, value), dtype=float))
        for path, value in system.parameters.items()
    ]
    product = np.ones(())
    for side in system.model.every_side:
        slope = differentiate(
            substitute(traced.velocity_after, {Expr("side"): float(side)}), VELOCITY
        )
        product = product * np.abs(_middle(enclose([slope], Leaves(values, []))[0]))
    return product


def _middle(bounds: Interval) -> np.ndarray:
    """The value of an expression of exact numbers, whose bounds differ by rounding only."""
    middle: np.ndarray = 0.5 * (bounds.lo + bounds.hi)
    return middle


def separation_growth(
    system: System, state: np.ndarray, periods: int, length: float, progress: Progress = silent
) -> np.ndarray:
    """ln(distance after a period / distance before) for each period, (periods,); -inf once both
    states are the same.

    After each period the second state is moved along the line to the first one, back to the
    distance of 1e-7 in natural units (Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980) 9). The two may
    lie on different sides of the contact, or have different numbers of impacts. Of several
    contacts, those that are closed in the first state are closed in the second.
    """
    here = state
    units = natural_units(system).perturbation
    own = len(units)  # behind it are the sides of relays
    away = units * (LYAPUNOV.distance / np.sqrt(own))
    growth = np.full(periods, -np.inf)
    for p in range(periods):
        beside = states_beside(system, here, away)
        following = _mapped(system, here, length)
        before = float(np.linalg.norm((beside - here)[:own] / units))
        apart = (_mapped(system, beside, length) - following)[:own]
        distance = float(np.linalg.norm(apart / units))
        if distance == 0.0 or before == 0.0:
            break
        growth[p] = np.log(distance / before)
        here = following
        away = apart * (LYAPUNOV.distance / distance)
        progress((p + 1) / periods, "two trajectories")
    return growth


def _mapped(system: System, state: np.ndarray, length: float) -> np.ndarray:
    """The state a period later."""
    start = arguments_of(system, state)
    return end_of(simulate(system, **start, duration=length, tol=LYAPUNOV.tolerance, dense=False))


@dataclass(frozen=True, eq=False)
class Exponents(Result):
    """The exponents of a motion, per unit of dimensionless time, largest first.

    They are -inf if the motion comes to rest with a loss at impacts: motions beside it reach the
    same rest in a finite time. They are NaN if the motion has no derivative or ends; `note` then
    says why.

    Attributes
    ----------
    values
        (2 n,): the exponents, for n coordinates; of one of first order there is one alone.
    errors
        (2 n,): half widths of 95 % intervals, see `averages.uncertainty`.
    halves
        (2, 2 n): the same exponents from the first and from the second half of the run.
    half_errors
        (2, 2 n): half widths of 95 % intervals of the exponents from the halves.
    divergence
        The mean of ln det per unit of time, from impacts and the time on each side; NaN if it does
        not follow from these alone.
    stroboscopic
        The stroboscopic map's largest exponent over the forcing period, from two trajectories; or
        NaN.
    stroboscopic_error
        The half width of its 95 % interval.
    periods
        The forcing periods (units of time under constant loads) that were averaged over.
    duration
        The same in dimensionless time.
    largest_condition
        The largest condition number of the derivatives over a span of the run.
    state
        The state at the end of the run, at phase 0, as arguments of `simulate`.
    note
        Why the exponents are not finite.
    unit
        The natural unit of time.

    Examples
    --------
    >>> exponents = saltus.lyapunov_spectrum(system, theta=0.3, periods=200)
    >>> round(float(exponents.values.sum()), 9)  # the sum is -C
    -0.1
    """

    values: np.ndarray
    errors: np.ndarray
    halves: np.ndarray
    half_errors: np.ndarray
    divergence: float
    stroboscopic: float
    stroboscopic_error: float
    periods: int
    duration: float
    largest_condition: float
    state: dict[str, Any]
    note: str | None
    unit: float = 1.0

    @property
    def at_half(self) -> np.ndarray:
        """(2 n,): the running estimate at half the time."""
        return np.asarray(self.halves[0])

    @property
    def sum_defect(self) -> float:
        """The difference between the sum of the exponents and the mean divergence, which should be
        equal.
        """
        return (
            abs(float(self.values.sum()) - self.divergence)
            if np.isfinite(self.values).all()
            else math.nan
        )

    @property
    def agrees(self) -> bool:
        """Whether the stroboscopic map has the same largest exponent, to within both error bars."""
        allowed = math.hypot(float(self.errors[0]), self.stroboscopic_error)
        allowed += LYAPUNOV.accuracy / self.unit
        return abs(float(self.values[0]) - self.stroboscopic) <= allowed

    @property
    def resolution(self) -> float:
        """2 ln(t) / t after a time t: regular motion, whose perturbations may grow like t^2, may
        show an exponent up to this.
        """
        return float(resolution(self.duration, self.unit))

    @property
    def positive(self) -> bool:
        """Whether the largest exponent is above 0 by more than its error and the resolution, over
        the run and both halves.
        """
        largest = Estimate(
            self.values[0], self.errors[0], self.halves[:, 0], self.half_errors[:, 0]
        )
        return bool(largest.positive(self.duration, self.unit))

    def to_xarray(self) -> xarray.Dataset:
        """`exponent`, its `error` and those of both halves over `index`, and the checks."""
        per_time = "per unit of dimensionless time"
        columns: dict[str, tuple[Any, ...]] = {
            "exponent": (
                "index",
                self.values,
                "1",
                f"Lyapunov exponents, {per_time}, largest first",
            ),
            "error": ("index", self.errors, "1", "half width of the 95 % interval of the exponent"),
            "at_half": (
                "index",
                self.halves[0],
                "1",
                "the exponents from the first half of the run",
            ),
            "later_half": (
                "index",
                self.halves[1],
                "1",
                "the exponents from the second half of the run",
            ),
            "divergence": (
                (),
                self.divergence,
                "1",
                f"mean divergence, {per_time}, which is the sum of the exponents",
            ),
            "stroboscopic": (
                (),
                self.stroboscopic,
                "1",
                "the largest exponent from two trajectories",
            ),
            "stroboscopic_error": (
                (),
                self.stroboscopic_error,
                "1",
                "half width of its 95 % interval",
            ),
            "resolution": (
                (),
                self.resolution,
                "1",
                "2 ln(t) / t, what growth by the square of the time would give",
            ),
        }
        facts: dict[str, Any] = {
            "periods": self.periods,
            "duration": self.duration,
            "note": self.note or "",
        }
        return result_dataset("exponents", columns, **facts)

    def __repr__(self) -> str:
        values = ", ".join(
            f"{x:.5g} +- {e:.1g}" for x, e in zip(self.values, self.errors, strict=True)
        )
        known = (
            f", sum - divergence = {self.values.sum() - self.divergence:.1e}"
            if np.isfinite(self.divergence)
            else ""
        )
        note = f", {self.note}" if self.note else known
        return (
            f"Exponents({values}; stroboscopic {self.stroboscopic:.5g}; {self.periods} "
            f"periods{note})"
        )


# arguments of `lyapunov_spectrum` beside the state
NAMES = ("relays", "periods", "transient", "tol", "two_trajectories", "progress")


def lyapunov_spectrum(
    system: System,
    *,
    velocity: Speeds = 0.0,
    relays: Mapping[str, bool] | None = None,
    periods: int = 1000,
    transient: int = 200,
    tol: float = 1e-12,
    two_trajectories: bool = True,
    progress: Progress = silent,
    **coordinates: float,
) -> Exponents:
    """All Lyapunov exponents of a motion, lambda_i = lim ln(R_ii) / t, where Phi = Q R over the
    time t.

    The derivatives Phi of the exact flow, with the saltation of every impact, are carried over
    spans of a forcing period, each no longer than 6.5 units of time. They are made orthonormal
    after each span. Averages over the periods are weighted (`averages.weights`), so that exponents
    of periodic and quasi-periodic motions, and of equilibria, converge faster than any power of the
    time. Exponents are -inf for the directions in which closed contacts and sticking frictions hold
    the motion.

    The result contains two checks. The sum of the exponents must equal the mean divergence, which
    is computed from the impacts and from the times on each side; with several contacts or frictions
    it is not known. And the stroboscopic map must have the same largest exponent. It is computed
    from a second trajectory, which starts at a distance of 1e-7 from the motion and is moved back
    to it after every period.

    Parameters
    ----------
    system
        What moves, under constant or harmonic loads. Under constant loads a unit of time is taken
        as the period.
    velocity, coordinates
        The state at the start, at phase 0.
    relays
        Whether each `Relay` of the model is on at the start, as `simulate` takes it.
    periods
        The number of forcing periods over which to average, at least 32.
    transient
        The number of forcing periods before these.
    tol
        The error that one step may make.
    two_trajectories
        Whether to compute the stroboscopic map's exponent, which takes about half of the work.
    progress
        Called with the fraction done and what is being done.

    Raises
    ------
    ParameterError
        An argument without meaning; a load by records, which has no period.
    MotionError
        As for `simulate`.

    Examples
    --------
    >>> exponents = saltus.lyapunov_spectrum(system, theta=0.3, periods=200)
    >>> exponents.values.round(3)  # half of -C each, as the multipliers are complex
    array([-0.05, -0.05])
    """
    check_run("lyapunov_spectrum", system, periods, transient, tol)
    run = _Run(system, periods)
    begin = coordinates.pop("time", 0.0)  # as `PeriodicOrbit.start` gives it
    check_number("time", begin)
    start = arguments_of(system, start_with_sides(system, velocity, relays, coordinates, NAMES))
    span = transient * run.length + (-begin) % run.length  # up to phase 0
    motion = simulate(system, **start, time=begin, duration=span, tol=tol, dense=False)
    run.state = arguments_of(system, end_of(motion))
    run.note = _lost(motion)
    share = 0.6 if two_trajectories else 1.0
    run.stretch_frames(tol, part_of(progress, 0.0, share))
    growth = np.full(LYAPUNOV.batches, np.nan)
    if two_trajectories and run.note is None:
        growth = separation_growth(
            system, end_of(motion), periods, run.length, part_of(progress, share, 1.0)
        )
    progress(1.0, "exponents")
    return run.exponents(growth)


class _Run:
    """A run: the logarithms of the stretches and of the determinant of every period."""

    def __init__(self, system: System, periods: int) -> None:
        self.system = system
        self.length = period_length(system)
        self.stretch = np.full((periods, system.dimension - len(system.model.first_order)), np.nan)
        self.areas = np.full(periods, np.nan)
        self.condition = 1.0
        self.state: dict[str, Any] = {}
        self.note: str | None = None

    def stretch_frames(self, tol: float, progress: Progress) -> None:
        """Follow the motion period after period, as long as it has derivatives."""
        contraction = Contraction(self.system)
        frame = first_frame(self.stretch.shape[1])
        begin = self.state
        for p in range(len(self.areas) if self.note is None else 0):
            self.stretch[p] = 0.0
            self.areas[p] = 0.0
            for j in range(span_count(self.length, natural_units(self.system).own_time)):
                frame = self._advance(p, j, frame, contraction, tol)
                if self.note is not None:
                    self.state = begin
                    return
            progress((p + 1) / len(self.areas), "derivatives")

    def _advance(
        self, p: int, j: int, frame: np.ndarray, contraction: Contraction, tol: float
    ) -> np.ndarray:
        """Go on over span j of period p; returns the frame at its end, orthonormal again."""
        span = self.length / span_count(self.length, natural_units(self.system).own_time)
        found = sensitivities(
            self.system, **self.state, time=j * span, duration=span, tol=tol, dense=False
        )
        self.note = _lost(found.motion) or found.undefined
        if self.note is not None:
            self.stretch[:] = np.nan
            return frame
        # behind them are the velocities of coordinates of first order, which follow from the rest
        count = len(frame)
        units = natural_units(self.system).perturbation[:count]
        derivatives = found.state[:count, :count] * units / units[:, None]
        if not derivatives.any():
            self.note = (
                "the motion rests at contact, and so do all beside it: nothing is left "
                "of where they began"
            )
            self.stretch[:] = -np.inf
            return frame
        frame, upper = np.linalg.qr(derivatives @ frame)
        with np.errstate(divide="ignore"):
            lengths = np.abs(np.diag(upper))
            # lengths in directions held by contacts and frictions are 0, up to rounding
            if self.system.model.holds_coordinates:
                lengths[lengths < LYAPUNOV.rounding * lengths.max()] = 0.0
            self.stretch[p] += np.log(lengths)
        self.areas[p] += contraction.along(found.motion)
        self.condition = max(self.condition, float(np.linalg.cond(derivatives)))
        self.state = arguments_of(self.system, end_of(found.motion))
        return np.asarray(frame)

    def exponents(self, growth: np.ndarray) -> Exponents:
        """The averages over the run, and over the growth of the distance of two trajectories in
        each period.
        """
        found = Estimate.of(self.stretch / self.length)
        return Exponents(
            values=found.value,
            errors=found.error,
            halves=found.halves,
            half_errors=found.half_errors,
            divergence=float(average(self.areas / self.length)),
            stroboscopic=float(average(growth / self.length)),
            stroboscopic_error=float(uncertainty(growth / self.length)),
            periods=len(self.areas),
            duration=len(self.areas) * self.length,
            largest_condition=self.condition,
            state=self.state,
            note=self.note,
            unit=natural_units(self.system).time,
        )


def _lost(motion: Motion) -> str | None:
    """Why a motion has no finite exponents; None if it has."""
    if motion.stop is Stop.LIMIT:
        return (
            f"the motion ends at time {motion.time:.6g}, where its margin {motion.limit} reaches 0"
        )
    if not motion.phase_known:
        return (
            "impacts that lose nothing became too small to be followed, and the phase of the "
            "motion is lost"
        )
    return None
