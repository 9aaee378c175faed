"""Equilibria and separatrices do not depend on the units of length and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus


@dataclass(frozen=True, kw_only=True)
class Bistable(saltus.OneContactModel):
    """x'' = r^2 (x - x^3 / L^2) - d r x' beyond a wall at -3 L."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    sides: ClassVar[tuple[int, ...]] = (1,)
    length: float = 1.0
    rate: float = 1.0
    loss: float = 0.1

    @property
    def contact(self) -> Any:
        return -3.0 * self.length

    def gap(self, x: Any, side: Any) -> Any:
        return x + 3.0 * self.length

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return side, -impact.velocity_after(self, t, velocity, side, side, load)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        pull = x - x**3 / self.length**2
        return self.rate**2 * pull - self.loss * self.rate * velocity


@pytest.mark.parametrize(("length", "rate"), [(1.0, 1.0), (1e-6, 1.0), (1.0, 1e6), (1e5, 1e-5)])
@pytest.mark.parametrize("loss", [0.1, -0.1])
def test_eigenvalues_of_a_bistable_system(length: float, rate: float, loss: float) -> None:
    """At 0: -d/2 +- sqrt(d^2/4 + 1), at +-L: -d/2 +- sqrt(d^2/4 - 2), each times the rate."""
    system = saltus.System(
        model=Bistable(length=length, rate=rate, loss=loss), impact=saltus.NewtonImpact(e=0.5)
    )
    window = ((-2.0 * length, 2.0 * length), (-2.0 * length * rate, 2.0 * length * rate))
    rests = saltus.attractors.equilibria(system, window=window)
    assert [rest.place / length for rest in rests] == pytest.approx([-1.0, 0.0, 1.0], abs=1e-12)
    assert [rest.stable for rest in rests] == [loss > 0.0, False, loss > 0.0]
    for rest, stiffness in zip(rests, (-2.0, 1.0, -2.0), strict=True):
        root = np.sqrt(complex(0.25 * loss**2 + stiffness))
        expected = np.array([-0.5 * loss + root, -0.5 * loss - root])
        assert rest.eigenvalues is not None
        assert np.array(rest.eigenvalues) / rate == pytest.approx(expected, abs=1e-8)


class Passed(Bistable):
    """The same on both sides of a place that no motion here reaches."""

    sides: ClassVar[tuple[int, ...]] = (1, -1)

    def gap(self, x: Any, side: Any) -> Any:
        return side * (x + 3.0 * self.length)

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e4])
def test_a_separatrix_has_the_energy_of_its_saddle(length: float) -> None:
    """Without loss v^2 = x^2 - x^4 / (2 L^2), and it comes back to the saddle."""
    system = saltus.System(
        model=Passed(length=length, loss=0.0), impact=saltus.VelocityReduction(1.0)
    )
    window = ((-2.0 * length, 2.0 * length), (-2.0 * length, 2.0 * length))
    curve = saltus.separatrices(system, window=window)[0]
    x, v = curve.theta / length, curve.velocity / length
    assert v**2 == pytest.approx(x**2 - 0.5 * x**4, abs=1e-8)
    assert np.abs(x).max() == pytest.approx(np.sqrt(2.0), abs=1e-3)
    assert str(curve.end) == "saddle"
