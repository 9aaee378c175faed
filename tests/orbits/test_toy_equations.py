"""A dry run: a kind of equations of orbits that is made here, by the contract alone, from
`find_orbit` to a plot.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

import saltus
from saltus.continuation import CurveEnd, Cut, End

# whose name pytest would take for that of a test
from saltus.continuation import TestFunction as Function
from saltus.flow import SegmentColumn
from saltus.orbits import PeriodicOrbit, Signature, orbits_of
from saltus.orbits.contract.equations import MotionToRead, OrbitEquations, OrbitEvaluation, Solution
from saltus.orbits.equations.kinds import KINDS

FREQUENCY, STEP = "load.frequency", 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring(saltus.Model):
    """x'' + c x' + x = F sin(Omega t)."""

    damping: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        return load.force(t) - self.damping * velocity - x


def spring(frequency: float = 0.7) -> saltus.System:
    return saltus.System(
        model=Spring(), load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=0.5))
    )


@dataclass(eq=False)
class BalanceEvaluation(OrbitEvaluation):
    """Multipliers are those of the free oscillation, whatever the unknowns are."""

    flow: np.ndarray

    def monodromy(self) -> np.ndarray:
        return self.flow


class HarmonicBalance(OrbitEquations):
    """x = a cos(Omega t) + b sin(Omega t): the balance of both harmonics, whose coefficients are
    the unknowns.
    """

    size = 2

    @classmethod
    def solves(cls, system: saltus.System, signature: Signature) -> bool:
        return isinstance(system.model, Spring)

    @classmethod
    def read(
        cls, base: OrbitEquations, motion: MotionToRead
    ) -> tuple[OrbitEquations, np.ndarray] | None:
        if not isinstance(base, cls):
            return None
        quarter = motion.duration / (4.0 * motion.periods)
        guess = [float(motion.once.at(motion.once.start + time)[0]) for time in (0.0, quarter)]
        return base.with_signature(Signature((), motion.periods)), np.array(guess)

    def _residual(self, unknowns: np.ndarray, values: np.ndarray) -> np.ndarray:
        system = self.system_at(values)
        (a, b), w, c = unknowns, self.frequency(values), system.model.damping
        return np.array(
            [
                (1.0 - w**2) * a + c * w * b,
                (1.0 - w**2) * b - c * w * a - system.parameters["load.force.amplitude"],
            ]
        )

    def evaluate(
        self,
        unknowns: np.ndarray,
        values: np.ndarray,
        with_extremes: bool = False,
        *,
        later: np.ndarray | None = None,
    ) -> BalanceEvaluation | None:
        w, c = self.frequency(values), self.system_at(values).model.damping
        here = np.array([[1.0 - w**2, c * w], [-c * w, 1.0 - w**2]])[None]
        columns = [
            (self._residual(unknowns, values + h) - self._residual(unknowns, values - h))
            / (2.0 * STEP)
            for h in STEP * np.eye(len(self.paths))
        ]
        parameters = np.array(columns).T.reshape(2, len(self.paths))
        extremes = np.full((int(with_extremes), SegmentColumn.LEAST_MARGIN + 1), np.inf)
        amplitude = math.hypot(*unknowns)
        extremes[:, [SegmentColumn.HIGHEST, SegmentColumn.LOWEST, SegmentColumn.CROSSINGS]] = (
            amplitude,
            -amplitude,
            0.0,
        )
        flow = expm(2.0 * math.pi * self.signature.span / w * np.array([[0.0, 1.0], [-1.0, -c]]))
        residual = self._residual(unknowns, values)
        return BalanceEvaluation(
            residual, here, np.zeros_like(here), parameters, np.empty((0, 0)), extremes, flow
        )

    def start(self, solution: Solution) -> dict[str, Any]:
        return {
            "x": float(solution.unknowns[0]),
            "velocity": float(solution.unknowns[1] * self.frequency(solution.values)),
        }

    def impacts(self, solution: Solution) -> tuple[np.ndarray, np.ndarray]:
        return np.empty(0), np.empty(0)

    def halves(self, solution: Solution, mirrored: bool) -> np.ndarray | None:
        return None

    def nearest(self, unknowns: np.ndarray, values: np.ndarray, other: Any) -> np.ndarray | None:
        return unknowns

    def barrier(self, point: Any) -> Function:
        return Function("none", lambda point: 1.0)

    def beyond(self, cut: Cut, points: list[Any]) -> End:
        return End(CurveEnd.NO_STEP, cut.point.parameter)

    def curve_barrier(self, kind: str, point: Any) -> Function:
        return self.barrier(point)


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """The one entry that a new kind needs; models of one's own are registered so that files with
    them can be read.
    """
    KINDS.insert(0, HarmonicBalance)
    saltus.register(Spring)
    yield
    KINDS.remove(HarmonicBalance)


def exact(frequency: float) -> float:
    """The amplitude of the steady oscillation."""
    return 0.5 / abs(complex(1.0 - frequency**2, 0.1 * frequency))


def test_it_is_found_followed_written_read_and_drawn(tmp_path: Any) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    orbit = saltus.find_orbit(spring(), x=0.3)
    assert isinstance(orbit.equations, HarmonicBalance)
    assert orbit.amplitude == pytest.approx(exact(0.7), rel=1e-13)
    assert orbit.defect < 1e-12  # by direct simulation
    assert np.abs(orbit.multipliers) == pytest.approx(
        [math.exp(-0.1 * math.pi / 0.7)] * 2, rel=1e-12
    )
    assert orbit.stable
    branch = saltus.continue_orbit(
        orbit, FREQUENCY, (0.4, 1.6), functions={"half": lambda found: found.amplitude - 1.0}
    )
    assert [end.parameter for end in branch.ends] == [0.4, 1.6]
    assert branch.amplitudes == pytest.approx(
        [exact(value) for value in branch.parameters], rel=1e-12
    )
    assert [str(point.kind) for point in branch.special] == ["half", "half"]
    assert [exact(point.parameter) for point in branch.special] == pytest.approx(
        [1.0, 1.0], abs=1e-10
    )
    data = branch.to_xarray()
    again = orbits_of(data)
    assert [found.amplitude for found in again] == [found.amplitude for found in branch.orbits]
    assert all(isinstance(found.equations, HarmonicBalance) for found in again)
    drawn = saltus.plot(data).figure
    drawn.savefig(tmp_path / "branch.png")
    assert (tmp_path / "branch.png").stat().st_size > 1000
    pyplot.close("all")


def test_it_says_the_same_as_the_equations_of_saltus() -> None:
    own = saltus.find_orbit(spring(), x=0.3)
    KINDS.remove(HarmonicBalance)
    usual = saltus.find_orbit(spring(), x=0.3)
    KINDS.insert(0, HarmonicBalance)
    assert type(usual.equations) is not type(own.equations)
    assert own.state == pytest.approx(usual.state, abs=1e-12)
    assert np.sort_complex(own.multipliers) == pytest.approx(
        np.sort_complex(usual.multipliers), abs=1e-11
    )


def test_it_can_be_pickled_and_solved_at_other_parameters() -> None:
    orbit = saltus.find_orbit(spring(), x=0.3, parameters=(FREQUENCY,))
    moved = PeriodicOrbit.near(orbit.equations, orbit.solution.unknowns, np.array([1.2]))
    assert moved is not None
    assert moved.amplitude == pytest.approx(exact(1.2), rel=1e-12)
    assert replace(moved, solution=moved.solution).frequency == 1.2
