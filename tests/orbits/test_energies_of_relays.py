"""Energies of motions with relays and resets: closed forms, and balances that close."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from machines_with_memory import Servo

from saltus import (
    Contact,
    ContactModel,
    Harmonic,
    Load,
    NewtonImpact,
    Relay,
    Surface,
    System,
    energies,
    find_orbit,
    simulate,
)


@dataclass(frozen=True, kw_only=True)
class Wheel(ContactModel):
    """A wheel of spokes without a rim that rolls down a slope, from spoke to spoke."""

    half_angle: float = 0.4
    slope: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("angle",)
    surfaces: ClassVar[tuple[Surface, ...]] = (
        Surface(name="strike", function="strike", after_event="next_spoke"),
    )

    def strike(self, t, angle, velocity, load):
        return angle - self.slope - self.half_angle

    def next_spoke(self, t, angle, velocity, load):
        return angle - 2.0 * self.half_angle, np.cos(2.0 * self.half_angle) * velocity

    def force(self, t, angle, velocity, load, sides):
        return np.sin(angle)


@dataclass(frozen=True, kw_only=True)
class Cart(ContactModel):
    """Two masses, of which one is heavier where it is farther out, with two relays, one of which
    kicks as it goes on, a reset of both and a floor."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (
        Contact(name="floor", coordinate="y", position=-0.4),
    )
    surfaces: ClassVar[tuple[Relay | Surface, ...]] = (
        Relay(name="motor", on="is_high", off="is_low"),
        Relay(name="valve", on="is_back", off="is_out", after_event="opened"),
        Surface(name="wall", coordinate="x", position=0.6, after_event="bounced"),
    )

    def is_high(self, t, q, velocity, load):
        return q[0] + 0.1 * velocity[0] - 0.2

    def is_low(self, t, q, velocity, load):
        return -0.2 - q[0] - 0.1 * velocity[0]

    def is_back(self, t, q, velocity, load):
        return -0.1 - q[0]

    def is_out(self, t, q, velocity, load):
        return q[0] - 0.3

    def opened(self, t, q, velocity, load):
        return q, (velocity[0], velocity[1] + 0.2)

    def bounced(self, t, q, velocity, load):
        return (q[0], q[1] + 0.1), (-0.7 * velocity[0], velocity[1] + 0.1 * velocity[0])

    def mass_matrix(self, q):
        return [[1.0 + 0.3 * q[1] ** 2, 0.1], [0.1, 0.8]]

    def force(self, t, q, velocity, load, sides):
        (x, y), (u, v) = q, velocity
        drive = load.force(t)
        both = 0.1 * (1.0 + sides.motor) * (1.0 + sides.valve)
        return (
            drive - 2.0 * x - 0.1 * u - 0.4 * sides.motor + both,
            0.5 * drive - 1.7 * y - 0.05 * v - 0.3 * sides.valve * (1.0 + 0.2 * v),
        )


def parts_of(balance):
    return dict(zip(balance.part.values.tolist(), balance.energy.values.tolist(), strict=True))


def test_a_servo_loses_what_its_relay_supplies():
    """On over -2 w and off over 2 w, with a force that is 2 less while on: 4 w in a round."""
    orbit = find_orbit(
        System(model=Servo(width=0.2), load=Load()), y=0.1, velocity=0.3, relays={"drive": True}
    )
    balance = energies(orbit)
    parts = parts_of(balance)
    assert parts["relay.drive"] == pytest.approx(0.8, abs=1e-12)
    assert parts["damping"] == pytest.approx(0.8, abs=1e-12)
    assert str(balance.role.values[list(parts).index("relay.drive")]) == "supplied"
    assert abs(balance.defect) < 1e-12


def test_a_wheel_loses_at_each_strike_what_the_slope_gives():
    """2 sin(slope) sin(half angle), the height that a step goes down."""
    orbit = find_orbit(System(model=Wheel(), load=Load()), angle=-0.3, velocity=0.9)
    balance = energies(orbit)
    parts = parts_of(balance)
    height = 2.0 * math.sin(0.1) * math.sin(0.4)
    assert parts["reset.strike"] == pytest.approx(height, abs=1e-12)
    assert parts["potential"] == pytest.approx(-height, abs=1e-12)
    assert abs(balance.defect) < 1e-12


def test_the_balance_of_a_machine_with_relays_resets_and_impacts_closes():
    system = System(
        model=Cart(), load=Load(frequency=1.3, force=Harmonic(0.8)), impact=NewtonImpact(0.6)
    )
    motion = simulate(system, x=0.1, y=0.0, relays={"motor": True, "valve": False}, periods=8)
    balance = energies(motion, periods=8)
    parts = parts_of(balance)
    wanted = {"relay.motor", "relay.valve", "relay.together", "reset.wall", "impact.floor"}
    assert wanted < set(parts)
    assert min(abs(parts[name]) for name in wanted - {"relay.together"}) > 1e-3
    assert abs(balance.defect) < 1e-12
