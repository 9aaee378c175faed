"""Where multipliers jump, and where the equations are degenerate: no LP, BPC or PD is named by the
sign of a determinant alone. The equations are made here, by the contract of `OrbitEquations`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.continuation import CurveEnd, CurveMissed, Cut, End

# whose name pytest would take for that of a test
from saltus.continuation import TestFunction as Function
from saltus.flow import SegmentColumn
from saltus.orbits import Signature
from saltus.orbits.contract.equations import MotionToRead, OrbitEquations, OrbitEvaluation, Solution
from saltus.orbits.equations.kinds import KINDS

FREQUENCY = "load.frequency"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pushed(saltus.Model):
    """x'' + 0.1 w x' + w^2 x = F sin(Omega t), of which the equations below take no more than the
    units.
    """

    rate: float = 1.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        return load.force(t) - 0.1 * self.rate * velocity - self.rate**2 * x


@dataclass(eq=False)
class GivenEvaluation(OrbitEvaluation):
    """Equations with the multipliers that are given."""

    flow: np.ndarray

    def monodromy(self) -> np.ndarray:
        return self.flow


class Given(OrbitEquations):
    """x = 1 is a fixed point with the multiplier m(p); the second unknown is the root h of
    (p_0 - p) / p_0, as the duration of an excursion that vanishes at p_0. Without p_0 it is 1.

    In both equations p is the frequency of the load.
    """

    size = 2
    multiplier: Callable[[float], float] = staticmethod(lambda p: 0.3)
    vanishes: float | None = None

    @classmethod
    def solves(cls, system: saltus.System, signature: Signature) -> bool:
        return isinstance(system.model, Pushed)

    @classmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        given = base.with_signature(Signature((), motion.periods))
        return given, np.array([1.0, cls._duration(base.frequency(base.values))])

    @classmethod
    def _duration(cls, value: float) -> float:
        return 1.0 if cls.vanishes is None else math.sqrt(max(0.0, 1.0 - value / cls.vanishes))

    def evaluate(
        self,
        unknowns: np.ndarray,
        values: np.ndarray,
        with_extremes: bool = False,
        *,
        later: np.ndarray | None = None,
    ) -> GivenEvaluation | None:
        value = self.frequency(values)
        x, h = unknowns
        multiplier = type(self).multiplier(value)
        slope = 0.0 if self.vanishes is None else 1.0 / self.vanishes
        left = 1.0 if self.vanishes is None else 1.0 - value * slope
        residual = np.array([(multiplier - 1.0) * (x - 1.0), h**2 - left])
        here = np.diag([multiplier, 2.0 * h])[None]
        there = np.diag([-1.0, 0.0])[None]
        parameters = np.array([[0.0], [slope]])[:, : len(self.paths)]
        extremes = np.full((int(with_extremes), SegmentColumn.LEAST_MARGIN + 1), np.inf)
        extremes[:, [SegmentColumn.HIGHEST, SegmentColumn.LOWEST, SegmentColumn.CROSSINGS]] = (
            x,
            -x,
            0.0,
        )
        flow = np.diag([multiplier, 0.0])
        return GivenEvaluation(residual, here, there, parameters, np.empty((0, 0)), extremes, flow)

    def start(self, solution: Solution) -> dict[str, Any]:
        return {"x": 1.0, "velocity": 0.0}

    def impacts(self, solution: Solution) -> tuple[np.ndarray, np.ndarray]:
        return np.empty(0), np.empty(0)

    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        return None

    def nearest(self, unknowns: np.ndarray, values: np.ndarray, other: Any) -> np.ndarray | None:
        return unknowns

    def barrier(self, point: Any) -> Function:
        return Function("SW", lambda other: float(other.place[1]), 1e-15)

    def beyond(self, cut: Cut, points: list[Any]) -> End:
        return End(CurveEnd.NO_STEP, cut.point.parameter)

    def curve_barrier(self, kind: str, point: Any) -> Function:
        return self.barrier(point)


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    KINDS.insert(0, Given)
    yield
    KINDS.remove(Given)


def followed(
    monkeypatch: pytest.MonkeyPatch,
    multiplier: Callable[[float], float],
    vanishes: float | None = None,
    unit: float = 1.0,
) -> saltus.Branch:
    """The branch of these equations over the frequencies 0.5 to 1.5, in units of frequency in which
    these have the value `unit`."""
    scaled = lambda value: multiplier(value / unit)  # noqa: E731
    monkeypatch.setattr(Given, "multiplier", staticmethod(scaled))
    monkeypatch.setattr(Given, "vanishes", None if vanishes is None else vanishes * unit)
    load = saltus.Load(frequency=0.7 * unit, force=saltus.Harmonic(amplitude=0.5 * unit**2))
    orbit = saltus.find_orbit(saltus.System(model=Pushed(rate=unit), load=load), x=1.0)
    assert isinstance(orbit.equations, Given)
    return saltus.continue_orbit(orbit, FREQUENCY, (0.5 * unit, 1.5 * unit))


def listed(branch: saltus.Branch) -> list[str]:
    return [str(point.kind) for point in branch.special]


@pytest.mark.parametrize("vanishes", [0.9, 1.0, 1.1, 1.25])
@pytest.mark.parametrize("unit", [1.0, 1e3, 1e-6])
def test_where_equations_degenerate_rounding_names_no_special_point(
    monkeypatch: pytest.MonkeyPatch, vanishes: float, unit: float
) -> None:
    """h is 0 at the change: the determinants and the parameter's part of the tangent are 0 there,
    and their signs are rounding. No multiplier is near to 1 or -1.
    """
    branch = followed(monkeypatch, lambda p: 0.3, vanishes, unit)
    assert listed(branch) == ["SW"]
    assert branch.special[0].parameter == pytest.approx(vanishes * unit, rel=1e-10)
    assert not branch.missed


@pytest.mark.parametrize("beyond", [-1.55, 1.55])
def test_a_jump_of_multipliers_is_no_special_point(
    monkeypatch: pytest.MonkeyPatch, beyond: float
) -> None:
    """The stability changes there, and the branch says so."""
    branch = followed(monkeypatch, lambda p: 0.3 if p < 1.1 else beyond)
    assert not branch.special
    (missed,) = branch.missed
    assert missed.reason is CurveMissed.JUMP
    assert missed.first[0] < 1.1 <= missed.last[0] < missed.first[0] + 1e-8
    assert branch.orbits[0].stable
    assert not branch.orbits[-1].stable


def test_a_window_of_other_multipliers_is_no_special_point(monkeypatch: pytest.MonkeyPatch) -> None:
    branch = followed(monkeypatch, lambda p: -1.55 if abs(p - 1.1) < 0.08 else 0.3)
    assert not branch.special
    assert [missed.reason for missed in branch.missed] == [CurveMissed.JUMP] * 2
    assert [missed.last[0] for missed in branch.missed] == pytest.approx([1.02, 1.18], abs=1e-8)


def test_a_multiplier_that_passes_steeply_is_a_special_point(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From 0.4 to -1.6 within 2e-3 of the parameter."""
    branch = followed(monkeypatch, lambda p: -0.6 - np.clip(1e3 * (p - 1.1), -1.0, 1.0))
    assert listed(branch) == ["PD"]
    assert branch.special[0].parameter == pytest.approx(1.1004, abs=1e-12)
    assert not branch.missed


@pytest.mark.parametrize("near", [1e-3, 1e-6])
@pytest.mark.parametrize("vanishes", [1.1, 1.2, 1.3])
def test_a_special_point_just_before_a_change_is_found(
    monkeypatch: pytest.MonkeyPatch, near: float, vanishes: float
) -> None:
    """Whatever the sign of the determinant is at the change, where rounding may have turned it
    round once more.
    """
    place = vanishes - near
    slope = 1e3
    branch = followed(monkeypatch, lambda p: -1.0 - slope * (p - place), vanishes)
    assert listed(branch) == ["BPC", "PD", "SW"]
    # the multiplier is 1, then -1
    expected = [place - 2.0 / slope, place, vanishes]
    assert [point.parameter for point in branch.special] == pytest.approx(expected, abs=1e-10)
    assert not branch.missed
