"""Lyapunov exponents of a motion, through saltation at every impact."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.attractors.lyapunov.area_contraction import Contraction
from saltus.attractors.lyapunov.averages import BATCHES, average, uncertainty
from saltus.attractors.lyapunov.renormalisation import check_run, first_frame, pieces_of
from saltus.attractors.lyapunov.two_trajectory import shadow_growth
from saltus.attractors.stroboscopic_section import check_periodic
from saltus.flow import Motion, Stop, sensitivities, simulate
from saltus.systems import System, check_system

SHADOW = 1e-5  # what a shadow at a distance of 1e-7, whose motion has errors of its own, may miss of an exponent


@dataclass(frozen=True, eq=False)
class Exponents:
    """The exponents of a motion, per unit of dimensionless time, largest first.

    They are -inf where the motion comes to rest with a loss at impacts: states beside it are at the same rest after a finite
    time. They are NaN where the motion has no derivative or ends; `note` then says why.
    """

    values: np.ndarray  # (2 n,) for n coordinates
    errors: np.ndarray  # (2 n,): half widths of 95 % intervals, see `averages.uncertainty`
    halves: np.ndarray  # (2, 2 n): the same exponents from the first and from the second half of the run alone
    half_errors: np.ndarray  # (2, 2 n)
    divergence: float  # the mean of ln det per unit of time, from impacts and the time on each side; NaN where not so simple
    stroboscopic: float  # the stroboscopic map's largest exponent over the forcing period, from a shadow; NaN where none ran
    stroboscopic_error: float
    periods: int  # forcing periods (units of time under constant loads) that were averaged over
    duration: float  # that in dimensionless time
    largest_condition: float  # of the derivatives over a piece of the run
    state: dict[str, Any]  # at the end of the run, at phase 0: arguments of `simulate`
    note: str | None  # why the exponents are not finite

    @property
    def at_half(self) -> np.ndarray:
        """(2 n,): the running estimate at half the time."""
        return np.asarray(self.halves[0])

    @property
    def sum_defect(self) -> float:
        """By how much the exponents miss the mean divergence, which they must add up to."""
        return abs(float(self.values.sum()) - self.divergence) if np.isfinite(self.values).all() else math.nan

    @property
    def agrees(self) -> bool:
        """Whether the stroboscopic map has the same largest exponent, to within both error bars."""
        allowed = math.hypot(float(self.errors[0]), self.stroboscopic_error) + SHADOW
        return abs(float(self.values[0]) - self.stroboscopic) <= allowed

    @property
    def resolution(self) -> float:
        """2 ln(t) / t after a time t: below it an exponent is not told from the growth by t^2 that a regular motion may have."""
        return resolution(self.duration)

    @property
    def positive(self) -> bool:
        """Whether the largest exponent is above 0 by more than its error and the resolution, in all and in both halves."""
        lower = [float(self.values[0] - self.errors[0]) - self.resolution]
        lower += [
            float(x - e) - resolution(self.duration / 2) for x, e in zip(self.halves[:, 0], self.half_errors[:, 0], strict=True)
        ]
        return bool(min(lower) > 0.0)

    def __repr__(self) -> str:
        values = ", ".join(f"{x:.5g} +- {e:.1g}" for x, e in zip(self.values, self.errors, strict=True))
        note = f", {self.note}" if self.note else f", sum - divergence = {self.values.sum() - self.divergence:.1e}"
        return f"Exponents({values}; stroboscopic {self.stroboscopic:.5g}; {self.periods} periods{note})"


def resolution(duration: float) -> float:
    """The largest rate that growth by the square of the time has over a run: 2 ln(t) / t."""
    return 2.0 * math.log(max(duration, math.e)) / duration


def lyapunov_spectrum(
    system: System,
    *,
    velocity: Any = 0.0,
    periods: int = 1000,
    transient: int = 200,
    tol: float = 1e-12,
    shadow: bool = True,
    progress: Callable[[float], object] | None = None,
    **coordinates: float,
) -> Exponents:
    """All Lyapunov exponents of a motion, lambda_i = lim ln(R_ii) / t, where Phi = Q R over the time t.

    The derivatives Phi of the exact flow, with the saltation of every impact, are carried over pieces of a forcing period, each
    no longer than 6.5 units of time, and made orthogonal after each. Averages over the periods are weighted
    (`averages.weights`), so that exponents of periodic and quasi-periodic motions, and of equilibria, converge faster than any
    power of the time.

    Two checks come along. The exponents must add up to the mean divergence, which is computed from the impacts and from the
    times on each side. And the stroboscopic map must have the same largest exponent, from a shadow that starts 1e-7 beside the
    motion and is moved back to that distance after every period.

    Args:
        system: what moves, under constant or harmonic loads. Under constant ones a unit of time stands for the period.
        velocity, coordinates: the state at the start, at phase 0.
        periods: over how many forcing periods to average, at least 32.
        transient: how many to let pass first.
        tol: the error that one step may make.
        shadow: False leaves out the stroboscopic map's exponent, and a half of the work.
        progress: called with the fraction done.

    Raises:
        ParameterError: an argument without meaning; a load by records, which has no period.
        MotionError: as for `simulate`.
    """
    check_system(system, "lyapunov_spectrum")
    check_periodic(system)
    check_run(periods, transient)
    state: dict[str, Any] = {**coordinates, "velocity": velocity}
    length, count = pieces_of(system)
    motion = simulate(system, **state, duration=transient * length, tol=tol, dense=False)
    note = _lost(motion)
    run = _Run(system, periods, length, count)
    if note is None:
        share = 0.6 if shadow else 1.0
        note = run.go(_state_of(motion), tol, None if progress is None else lambda done: progress(share * done))
    growth = None
    if shadow and note is None:
        growth = shadow_growth(
            system, _state_of(motion), periods, length, None if progress is None else lambda done: progress(0.6 + 0.4 * done)
        )
    if progress is not None:
        progress(1.0)
    return _exponents(run, growth, note, _state_of(motion))


class _Run:
    """What is gathered on the way: the logarithms of the stretch and of the determinant of every period."""

    def __init__(self, system: System, periods: int, length: float, count: int) -> None:
        self.system, self.length, self.count = system, length, count
        self.stretch = np.full((periods, 2 * len(system.model.coordinates)), np.nan)
        self.areas = np.full(periods, np.nan)
        self.condition = 1.0
        self.state: dict[str, Any] = {}

    def go(self, state: dict[str, Any], tol: float, progress: Callable[[float], object] | None) -> str | None:
        """Follow the motion period after period; returns why that was no use."""
        contraction, frame = Contraction(self.system), first_frame(self.stretch.shape[1])
        for p in range(len(self.areas)):
            self.stretch[p], self.areas[p] = 0.0, 0.0
            for j in range(self.count):
                span = self.length / self.count
                piece = sensitivities(self.system, **state, time=j * span, duration=span, tol=tol, dense=False)
                note = _lost(piece.motion) or piece.undefined
                if note is None and not piece.state.any():
                    note = "the motion rests at contact, and so do all beside it: nothing is left of where they began"
                    self.stretch[:] = -np.inf
                    return note
                if note is not None:
                    self.stretch[:] = np.nan
                    return note
                frame, upper = np.linalg.qr(piece.state @ frame)
                with np.errstate(divide="ignore"):
                    self.stretch[p] += np.log(np.abs(np.diag(upper)))
                self.areas[p] += contraction.along(piece.motion)
                self.condition = max(self.condition, float(np.linalg.cond(piece.state)))
                state = _state_of(piece.motion)
            if progress is not None and p % 16 == 15:
                progress((p + 1) / len(self.areas))
        self.state = state
        return None


def _exponents(run: _Run, growth: np.ndarray | None, note: str | None, state: dict[str, Any]) -> Exponents:
    rates, half = run.stretch / run.length, len(run.stretch) // 2
    parts = (rates[:half], rates[-half:])
    growth = np.full(BATCHES, np.nan) if growth is None else growth / run.length
    return Exponents(
        values=average(rates),
        errors=uncertainty(rates),
        halves=np.stack([average(part) for part in parts]),
        half_errors=np.stack([uncertainty(part) for part in parts]),
        divergence=float(average(run.areas / run.length)),
        stroboscopic=float(average(growth)),
        stroboscopic_error=float(uncertainty(growth)),
        periods=len(rates),
        duration=len(rates) * run.length,
        largest_condition=run.condition,
        state=run.state or state,
        note=note,
    )


def _lost(motion: Motion) -> str | None:
    """Why a motion has no exponents, or none that are finite."""
    if motion.stop is Stop.LIMIT:
        return f"the motion ends at time {motion.time:.6g}, where its margin {motion.limit} reaches 0"
    if not motion.phase_known:
        return "impacts that lose nothing became too small to be followed, and the phase of the motion is lost"
    return None


def _state_of(motion: Motion) -> dict[str, Any]:
    names = motion.system.model.coordinates
    return {**dict(zip(names, np.atleast_1d(motion.position).tolist(), strict=True)), "velocity": motion.velocity}
