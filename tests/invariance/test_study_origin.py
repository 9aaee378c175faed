"""What studies answer does not depend on the origin of a coordinate: a wall, a spring and all starts
are moved alike.

Amplitudes are measured from the origin, so that extrema are compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.attractors import equilibria

ORIGINS = [3.0, -0.7, 250.0]
origins = pytest.mark.parametrize("origin", ORIGINS)


@saltus.register
@dataclass(frozen=True, kw_only=True)
class WallFromOrigin(saltus.OneContactModel):
    """An oscillator at a wall, whose spring is relaxed at the origin."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    sides: ClassVar[tuple[int, ...]] = (1,)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    origin: float = 0.0

    @property
    def contact(self) -> Any:
        return self.origin - 0.3

    def gap(self, x: Any, side: Any) -> Any:
        return x - self.contact

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return side, -impact.velocity_after(self, t, velocity, side, side, load)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        return load.force(t) - (x - self.origin) - 0.1 * velocity


def wall(origin: float = 0.0, amplitude: float = 0.5) -> saltus.System:
    load = saltus.Load(frequency=1.1, force=saltus.Harmonic(amplitude))
    return saltus.System(
        model=WallFromOrigin(origin=origin), load=load, impact=saltus.VelocityReduction(0.8)
    )


@saltus.register
@dataclass(frozen=True, kw_only=True)
class StopsFromOrigin(saltus.ContactModel):
    """A mass on a spring between two stops, near to which it has two stable motions."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    origin: float = 0.0

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (
            saltus.Contact(name="left", coordinate="x", position=self.origin - 0.8),
            saltus.Contact(name="right", coordinate="x", position=self.origin + 1.0, sign=-1),
        )

    def mass_matrix(self, x: Any) -> Any:
        return 1.0

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) - 0.5 * (x - self.origin) - 0.1 * velocity


def stops(origin: float = 0.0) -> saltus.System:
    load = saltus.Load(frequency=1.1, force=saltus.Harmonic(0.8))
    return saltus.System(
        model=StopsFromOrigin(origin=origin), load=load, impact=saltus.NewtonImpact(e=0.7)
    )


both = pytest.mark.parametrize("make", [wall, stops])
Make = Callable[..., saltus.System]


@dataclass(frozen=True, kw_only=True)
class Bistable(WallFromOrigin):
    """x'' = y - y^3 - 0.1 x', with the distance y from the origin; a contact at -1 / 2 lets it
    pass."""

    sides: ClassVar[tuple[int, ...]] = (1, -1)
    channels: ClassVar[tuple[str, ...]] = ()

    @property
    def contact(self) -> Any:
        return self.origin - 0.5

    def gap(self, x: Any, side: Any) -> Any:
        return side * (x - self.contact)

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        y = x - self.origin
        return y - y**3 - 0.1 * velocity


def bistable(origin: float = 0.0) -> saltus.System:
    return saltus.System(model=Bistable(origin=origin), impact=saltus.VelocityReduction(1.0))


@origins
def test_equilibria(origin: float) -> None:
    one, other = (
        equilibria(bistable(at), window=((at - 3.0, at + 3.0), (-1.0, 1.0))) for at in (0.0, origin)
    )
    assert [round(rest.place, 12) for rest in one] == [-1.0, 0.0, 1.0]
    assert [rest.place - origin for rest in other] == pytest.approx(
        [rest.place for rest in one], abs=1e-12
    )
    assert [rest.stable for rest in other] == [rest.stable for rest in one]


@origins
@both
def test_orbits_and_branches(make: Make, origin: float) -> None:
    branches = [
        saltus.continue_orbit(saltus.find_orbit(make(at), x=at + 0.1), "load.frequency", (0.9, 1.3))
        for at in (0.0, origin)
    ]
    one, other = ([(p.kind, p.parameter) for p in branch.special] for branch in branches)
    assert [kind for kind, _ in other] == [kind for kind, _ in one]
    assert [value for _, value in other] == pytest.approx([v for _, v in one], rel=1e-8)
    assert [end.reason for end in branches[1].ends] == [end.reason for end in branches[0].ends]


@origins
@both
def test_attractors_and_basins(make: Make, origin: float) -> None:
    known = []
    for at in (0.0, origin):
        system = make(at)
        window = ((at - 0.3, at + 0.8), (-1.0, 1.0))
        found = saltus.find_attractors(system, starts=24, window=window, seed=3)
        basins = saltus.basins_of_attraction(system, window=window, points=8)
        known.append(
            (
                [(str(a.kind), a.period) for a in found],
                basins["attractor"].values.tolist(),
            )
        )
    assert known[0] == known[1]


@origins
def test_the_default_window_of_a_search_moves_with_the_wall(origin: float) -> None:
    one, other = (saltus.find_attractors(wall(at), starts=24) for at in (0.0, origin))
    low, high = np.asarray(one.window[0]), np.asarray(other.window[0])
    assert high - origin == pytest.approx(low, abs=1e-9)
    assert [(str(a.kind), a.period) for a in other] == [(str(a.kind), a.period) for a in one]


@origins
@both
def test_sweeps_and_charts(make: Make, origin: float) -> None:
    sweeps = [
        saltus.frequency_sweep(make(at), np.linspace(0.9, 1.3, 5), x=at + 0.1, periods=60)
        for at in (0.0, origin)
    ]
    for name in ("largest_x", "smallest_x"):
        assert sweeps[1][name].values - origin == pytest.approx(sweeps[0][name].values, abs=1e-7)
    charts = [
        saltus.stability_chart(
            make(at),
            horizontal=np.linspace(0.8, 1.4, 4),
            vertical=np.linspace(0.2, 0.8, 3),
            paths=("load.frequency", "load.force.amplitude"),
            starts=6,
        )
        for at in (0.0, origin)
    ]
    for name in ("outcome", "period"):
        assert charts[1][name].values.tolist() == charts[0][name].values.tolist(), name


@origins
@both
def test_exponents_and_verdicts(make: Make, origin: float) -> None:
    verdicts = [saltus.classify(make(at), x=at + 0.1) for at in (0.0, origin)]
    assert verdicts[1].kind is verdicts[0].kind
    assert verdicts[1].period == verdicts[0].period
    spectra = [saltus.lyapunov_spectrum(make(at), x=at + 0.1, periods=200) for at in (0.0, origin)]
    assert np.asarray(spectra[1].values) == pytest.approx(np.asarray(spectra[0].values), abs=1e-3)
