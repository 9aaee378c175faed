"""Verdicts, attractors, basins, sweeps and exponents of models with relays and resets."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import (
    ContactModel,
    Harmonic,
    Load,
    ParameterError,
    Relay,
    Surface,
    System,
    basins_of_attraction,
    classify,
    find_attractors,
    find_orbit,
    frequency_sweep,
    lyapunov_spectrum,
)


@dataclass(frozen=True, kw_only=True)
class Latched(ContactModel):
    """A mass on a spring under a load, which a relay pushes one way or the other."""

    damping: float = 0.3
    push: float = 0.2
    width: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[tuple[Relay, ...]] = (Relay(name="valve", on="high", off="low"),)

    def high(self, t, x, velocity, load):
        return x - self.width

    def low(self, t, x, velocity, load):
        return -self.width - x

    def force(self, t, x, velocity, load, sides):
        return load.force(t) - x - self.damping * velocity - self.push * sides.valve


@dataclass(frozen=True, kw_only=True)
class Room(ContactModel):
    """T' = -(T - 10) / 10, and 3 more while the heater is on: below 19 on, above 21 off."""

    power: float = 3.0

    coordinates: ClassVar[tuple[str, ...]] = ("T",)
    first_order: ClassVar[tuple[str, ...]] = ("T",)
    surfaces: ClassVar[tuple[Relay, ...]] = (Relay(name="heater", on="cold", off="warm"),)

    def cold(self, t, T, velocity, load):
        return 19.0 - T

    def warm(self, t, T, velocity, load):
        return T - 21.0

    def force(self, t, T, velocity, load, sides):
        return -(T - 10.0) / 10.0 + self.power * (1.0 + sides.heater) / 2.0


@dataclass(frozen=True, kw_only=True)
class Wheel(ContactModel):
    """A wheel of spokes without a rim that rolls down a slope of 0.1, with 0.8 between spokes."""

    coordinates: ClassVar[tuple[str, ...]] = ("angle",)
    surfaces: ClassVar[tuple[Surface, ...]] = (
        Surface(name="strike", function="strike", after_event="next_spoke"),
    )

    def strike(self, t, angle, velocity, load):
        return angle - 0.1 - 0.4

    def next_spoke(self, t, angle, velocity, load):
        return angle - 0.8, np.cos(0.8) * velocity

    def force(self, t, angle, velocity, load, sides):
        return np.sin(angle)


FREQUENCY = 0.8
ROUND = 2.0 * math.pi / FREQUENCY
SHAKEN = Load(frequency=FREQUENCY, force=Harmonic(0.5))
# half of the damping: the areas of the plane of states shrink with the damping, and the relay's
# jumps of the acceleration leave them
DECAY = -0.15


def test_a_room_ends_on_the_cycle_of_its_closed_form():
    room = System(model=Room(), load=Load())
    verdict = classify(room, T=20.0, relays={"heater": True})
    assert str(verdict.kind) == "periodic"
    assert verdict.period == pytest.approx(10.0 * math.log(21.0 / 19.0 * 11.0 / 9.0), rel=1e-11)
    (cycle,) = find_attractors(room, window=((18.0, 22.0),), starts=2)
    assert cycle.period == pytest.approx(verdict.period, rel=1e-12)
    assert (cycle.lowest, cycle.highest) == pytest.approx((19.0, 21.0), abs=1e-9)
    swept = frequency_sweep(
        room, [3.0, 3.5], path="model.power", T=20.0, relays={"heater": True}
    ).period.values
    assert swept[0, 0] == pytest.approx(verdict.period, rel=1e-11)
    # 10 + 10 p on: (a - 19) / (a - 21) with a = 45
    assert swept[0, 1] == pytest.approx(10.0 * math.log(26.0 / 24.0 * 11.0 / 9.0), rel=1e-11)


def test_a_wheel_rolls_on_the_cycle_of_its_closed_form():
    verdict = classify(System(model=Wheel(), load=Load()), angle=-0.3, velocity=0.9)
    share = math.cos(0.8) ** 2
    assert str(verdict.kind) == "periodic"
    assert verdict.evidence["largest_multiplier"] == pytest.approx(share, rel=1e-8)
    (velocity,) = [abs(event.velocity_after[0]) for event in verdict.orbit.motion().events][:1]
    gain = 4.0 * math.sin(0.1) * math.sin(0.4)
    assert velocity == pytest.approx(math.sqrt(share * gain / (1.0 - share)), rel=1e-10)


def test_a_mass_that_a_relay_pushes_settles_with_the_rate_of_its_damping():
    system = System(model=Latched(), load=SHAKEN)
    start = {"x": 0.1, "relays": {"valve": True}}
    orbit = find_orbit(system, **start)
    verdict = classify(system, **start)
    assert str(verdict.kind) == "periodic"
    assert verdict.period == 1
    assert verdict.evidence["largest_multiplier"] == pytest.approx(math.exp(DECAY * ROUND))
    again = saltus.simulate(system, **verdict.state, periods=1)
    assert again.position == pytest.approx(verdict.state["x"], abs=1e-9)
    exponents = lyapunov_spectrum(system, **start, periods=64, transient=20)
    assert exponents.values == pytest.approx([DECAY, DECAY], abs=1e-4)
    assert exponents.stroboscopic == pytest.approx(DECAY, abs=2e-2)
    swept = frequency_sweep(system, [FREQUENCY, 0.81], **start)
    assert swept.amplitude.values[:, 0] == pytest.approx(orbit.amplitude, rel=1e-8)


@pytest.mark.parametrize("push", [0.2, 0.0])
def test_two_attractors_differ_by_the_side_of_a_relay(push):
    """With thresholds that no motion reaches, each side has its linear response about -push s."""
    system = System(model=Latched(push=push, width=2.0), load=SHAKEN)
    found = find_attractors(system, window=((-0.5, 0.5), (-0.5, 0.5)), starts=8)
    assert [attractor.starts for attractor in found] == [4, 4]
    size = 0.5 / math.hypot(1.0 - FREQUENCY**2, 0.3 * FREQUENCY)
    for attractor in found:
        side = attractor.states[0, 2]
        assert abs(side) == 1.0
        middle = -push * side
        assert attractor.highest == pytest.approx(middle + size, abs=1e-8)
        assert attractor.lowest == pytest.approx(middle - size, abs=1e-8)
    labels = {}
    for on in (True, False):
        cells = basins_of_attraction(
            system, found=found, x=[-0.2, 0.2], velocity=[-0.1, 0.1], relays={"valve": on}
        )
        (labels[on],) = set(np.unique(cells.label.values))
    assert labels == {member.states[0, 2] > 0.0: member.label for member in found}


def test_what_does_not_follow_relays_says_so():
    system = System(model=Latched(), load=SHAKEN)
    with pytest.raises(ParameterError, match="does not say whether the relay 'valve' is on"):
        classify(system, x=0.0)
    with pytest.raises(ParameterError, match=r"give relays=\{'valve': True\}, or False"):
        basins_of_attraction(system, x=[-0.2, 0.2], velocity=[-0.1, 0.1])
    for asked, words in [
        (lambda: saltus.lyapunov_many(system, x=0.0), "lyapunov_many does not follow relays"),
        (
            lambda: saltus.response_spectrum(system, bounds=(0.7, 0.8)),
            "a diagram does not follow relays",
        ),
        (
            lambda: saltus.stability_chart(
                system,
                horizontal={"load.frequency": [0.7, 0.8]},
                vertical={"load.force.amplitude": [0.4, 0.5]},
            ),
            "does not follow relays",
        ),
        (lambda: saltus.page(system), "does not follow relays"),
    ]:
        with pytest.raises(ParameterError, match=words):
            asked()


@pytest.mark.parametrize("side", [0.5, 0.0, 2.0])
def test_a_further_start_has_each_relay_on_one_of_its_sides(side):
    system = System(model=Latched(), load=SHAKEN)
    with pytest.raises(ParameterError, match=rf"also .* \(valve\) .* 1 or -1, got {side:g}"):
        find_attractors(system, starts=1, also=[[0.0, 0.0, 1.0], [0.0, 0.0, side]])
