"""What studies answer without a window, a duration or a least amplitude does not depend on the
units of length and time: their defaults and thresholds are in natural units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.attractors import equilibria, unstable_manifold
from saltus.orbits import defects

UNITS = [(1e-9, 1.0), (1.0, 1e-6), (1e6, 1e6), (1e-6, 1e6)]  # lengths and times
units = pytest.mark.parametrize(("length", "time"), UNITS)


def wall(
    length: float = 1.0,
    time: float = 1.0,
    *,
    amplitude: float = 0.5,
    frequency: float = 1.1,
    place: float = 0.3,
    damping: float = 0.1,
    e: float = 0.8,
) -> saltus.System:
    """An oscillator at a wall, in units in which lengths are `length` and times are `time`."""
    model = saltus.WallOscillator(
        stiffness=1.0 / time**2, damping=damping / time, wall=place * length
    )
    force = saltus.Harmonic(amplitude * length / time**2)
    return saltus.System(
        model=model,
        load=saltus.Load(frequency=frequency / time, force=force),
        impact=saltus.VelocityReduction(e),
    )


def stops(length: float = 1.0, time: float = 1.0) -> saltus.System:
    """An oscillator between two stops, near to which it has two stable motions."""
    model = saltus.TwoStops(
        stiffness=0.5 / time**2, damping=0.1 / time, left=-0.8 * length, right=length
    )
    load = saltus.Load(frequency=1.1 / time, force=saltus.Harmonic(0.8 * length / time**2))
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.7))


@dataclass(frozen=True, kw_only=True)
class Bistable(saltus.OneContactModel):
    """x'' = r^2 (x - x^3 / L^2) - d r x' on both sides of a place at -L / 2 that it passes."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    sides: ClassVar[tuple[int, ...]] = (1, -1)
    length: float = 1.0
    rate: float = 1.0

    @property
    def contact(self) -> Any:
        return -0.5 * self.length

    def gap(self, x: Any, side: Any) -> Any:
        return side * (x + 0.5 * self.length)

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        return self.rate**2 * (x - x**3 / self.length**2) - 0.1 * self.rate * velocity


def bistable(length: float = 1.0, time: float = 1.0) -> saltus.System:
    model = Bistable(length=length, rate=1.0 / time)
    return saltus.System(model=model, impact=saltus.VelocityReduction(1.0))


@units
def test_phase_portraits(length: float, time: float) -> None:
    one, other = (
        saltus.phase_portrait(system, samples=60) for system in (bistable(), bistable(length, time))
    )
    assert one.sizes["equilibrium"] == 3
    assert one.sizes["separatrix"] == 2
    assert other["equilibrium"].values / length == pytest.approx(one["equilibrium"].values)
    assert other["stable"].values.tolist() == one["stable"].values.tolist()
    assert other["time"].values / time == pytest.approx(one["time"].values, nan_ok=True)
    for name, unit in (("x", length), ("velocity", length / time)):
        assert other[name].values / unit == pytest.approx(one[name].values, abs=1e-7, nan_ok=True)


@units
def test_separatrices(length: float, time: float) -> None:
    one, other = (saltus.separatrices(system) for system in (bistable(), bistable(length, time)))
    assert [str(curve.end) for curve in other] == [str(curve.end) for curve in one]
    for first, second in zip(one, other, strict=True):
        assert second.time / time == pytest.approx(first.time, rel=1e-9)
        assert second.theta / length == pytest.approx(first.theta, abs=1e-6, nan_ok=True)


@dataclass(frozen=True, kw_only=True)
class Turning(saltus.OneContactModel):
    """An angle in the field of two magnets, in any unit of time."""

    coordinates: ClassVar[tuple[str, ...]] = ("angle",)
    units: ClassVar[tuple[str, ...]] = ("rad",)
    sides: ClassVar[tuple[int, ...]] = (1, -1)
    channels: ClassVar[tuple[str, ...]] = ("moment",)
    rate: float = 1.0

    def gap(self, angle: Any, side: Any) -> Any:
        return side * angle

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return -side, impact.velocity_after(self, t, velocity, side, -side, load)

    def acceleration(self, t: Any, angle: Any, velocity: Any, side: Any, load: Any) -> Any:
        own = self.rate**2 * (side - 1.5 * angle)
        return load.moment(t) - own - 0.2 * self.rate * velocity


@pytest.mark.parametrize("time", [1e-6, 1e3])
def test_an_angle_in_any_unit_of_time(time: float) -> None:
    def turning(time: float = 1.0) -> saltus.System:
        load = saltus.Load(frequency=1.3 / time, moment=saltus.Harmonic(1.4 / time**2))
        model = Turning(rate=1.0 / time)
        return saltus.System(model=model, load=load, impact=saltus.VelocityReduction(0.8))

    one, other = (
        saltus.find_attractors(system, starts=24) for system in (turning(), turning(time))
    )
    assert np.asarray(other.window)[1] * time == pytest.approx(np.asarray(one.window)[1])
    assert [(str(a.kind), a.period, a.share) for a in other] == [
        (str(a.kind), a.period, a.share) for a in one
    ]
    still = saltus.Load(moment=0.0)
    found = [
        [rest.place for rest in equilibria(system.with_({"load": still}))]
        for system in (turning(), turning(time))
    ]
    assert len(found[0]) == 3  # beyond +-2, which a window in the wrong unit does not change
    assert found[1] == pytest.approx(found[0], abs=1e-12)


def saddle(length: float = 1.0, time: float = 1.0) -> saltus.PeriodicOrbit:
    """An orbit of two periods beyond its doubling."""
    family = saltus.theory.wall_orbits(wall(amplitude=0.5, frequency=2.6, e=0.5, damping=0.05), 2)
    speed = 1.02 * family.doubling_speed
    known = family.orbit(speed)
    if abs(known.multipliers).max() < 1.0:
        known = family.orbit(0.98 * family.doubling_speed)
    x, velocity = known.state(0.0)
    system = wall(
        length, time, amplitude=float(known.amplitude), frequency=2.6, e=0.5, damping=0.05
    )
    start = {"x": float(x) * length, "velocity": float(velocity) * length / time}
    return saltus.find_orbit(system, **start, period=2, settle=0)


@units
@pytest.mark.parametrize("manifold", [saltus.stable_manifold, unstable_manifold])
def test_manifolds(manifold: Any, length: float, time: float) -> None:
    one, other = (
        manifold(orbit, periods=6, step=0.05) for orbit in (saddle(), saddle(length, time))
    )
    assert [str(branch.end) for branch in other.branches] == [
        str(branch.end) for branch in one.branches
    ]
    for first, second in zip(one.branches, other.branches, strict=True):
        scaled = second.states / [length, length / time]
        begin = first.states[:8]
        assert np.abs(scaled[:8] - begin).max() < 1e-8
        assert np.nanmax(np.abs(scaled), axis=0) == pytest.approx(
            np.nanmax(np.abs(first.states), axis=0), rel=0.05
        )


@units
def test_distances_of_orbits_from_themselves(length: float, time: float) -> None:
    """They are rounding in natural units; 1e-6 of an orbit's size is not."""
    orbit = saddle(length, time)
    assert orbit.defect < 1e-11
    assert defects([orbit])[0] < 1e-11
    system = orbit.system.with_(
        {"load.force.amplitude": orbit.system.get("load.force.amplitude") * (1.0 + 1e-6)}
    )
    start = orbit.start()
    del start["time"]
    other = saltus.find_orbit(system, x=orbit.state[0], velocity=orbit.state[1], period=2, settle=0)
    apart = np.abs(np.subtract(other.state, orbit.state)) / [length, length / time]
    assert apart.max() > 1e-8


@units
@pytest.mark.parametrize("make", [wall, stops])
def test_charts(make: Any, length: float, time: float) -> None:
    one, other = (
        saltus.stability_chart(
            make(L, T),
            horizontal=np.linspace(0.8, 1.4, 4) / T,
            vertical=np.linspace(0.2, 0.8, 3) * L / T**2,
            paths=("load.frequency", "load.force.amplitude"),
            starts=6,
        )
        for L, T in ((1.0, 1.0), (length, time))
    )
    for name in ("count", "outcome", "rest", "tiny", "unsettled", "period"):
        assert other[name].values.tolist() == one[name].values.tolist(), name
    assert other["amplitude"].values / length == pytest.approx(one["amplitude"].values, rel=1e-8)


@pytest.mark.parametrize("time", [2.0**-10, 1e-6, 1e6])
def test_a_chart_of_two_stops_whose_neighbours_lend_their_motions(time: float) -> None:
    """Steps of states were compared with amplitudes, their speeds too: in short units of time a
    motion of period 3 was found from a neighbour, in long ones not."""

    def made(time: float = 1.0) -> Any:
        model = saltus.TwoStops(
            stiffness=0.107889 / time**2, damping=0.06645 / time, left=-1.144242, right=0.820196
        )
        load = saltus.Load(frequency=1.38854 / time, force=saltus.Harmonic(0.550498 / time**2))
        return saltus.stability_chart(
            saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.6992)),
            horizontal=1.38854 * np.linspace(0.8, 1.3, 4) / time,
            vertical=0.550498 * np.linspace(0.6, 1.2, 3) / time**2,
            paths=("load.frequency", "load.force.amplitude"),
            starts=6,
        )

    one, other = made(), made(time)
    for name in ("count", "outcome", "rest", "unsettled", "period"):
        assert other[name].values.tolist() == one[name].values.tolist(), name
    speeds = one["motion_slowest"].values / time
    assert other["motion_slowest"].values == pytest.approx(speeds, nan_ok=True, rel=1e-6)


@units
@pytest.mark.parametrize("make", [wall, stops])
def test_attractors_along_a_parameter(make: Any, length: float, time: float) -> None:
    one, other = (
        saltus.attractors_along(
            make(L, T), "load.frequency", np.linspace(0.9, 1.2, 4) / T, starts=16
        )
        for L, T in ((1.0, 1.0), (length, time))
    )
    assert dict(other.sizes) == dict(one.sizes)
    assert other["kind"].values.tolist() == one["kind"].values.tolist()


@units
@pytest.mark.parametrize("make", [wall, stops])
def test_response_spectra(make: Any, length: float, time: float) -> None:
    """Starts at each value are drawn from its digits, which other units change: branches and
    special points do not."""
    one, other = (
        saltus.response_spectrum(make(L, T), bounds=(0.9 / T, 1.3 / T), effort="quick", starts=6)
        for L, T in ((1.0, 1.0), (length, time))
    )
    assert other["branches"].sizes == one["branches"].sizes
    found, expected = other["special"], one["special"]
    assert found["kind"].values.tolist() == expected["kind"].values.tolist()
    for name, unit in (("special_parameter", 1.0 / time), ("special_amplitude", length)):
        assert found[name].values / unit == pytest.approx(expected[name].values, rel=1e-9)
    assert other["unplaced"].sizes == one["unplaced"].sizes
    assert other["bands"].sizes == one["bands"].sizes
    # an orbit beside a grazing misses itself by the root of rounding
    assert float(np.median(other["points"]["defect"].values)) < 1e-13
