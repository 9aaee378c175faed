"""Small machines whose relays remember their side, or whose surfaces reset the state: each has a
closed form. Tests of motions, ensembles and orbits share them.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from saltus import Relay, Surface
from saltus.systems import ContactModel


@dataclass(frozen=True, kw_only=True)
class Thermostat(ContactModel):
    """A room that cools to 10 degrees in the time 10, and is heated below 19 and not above 21."""

    power: float = 3.0
    below: float = 19.0
    above: float = 21.0

    coordinates: ClassVar[tuple[str, ...]] = ("T",)
    first_order: ClassVar[tuple[str, ...]] = ("T",)
    surfaces: ClassVar[tuple[Relay, ...]] = (Relay(name="heater", on="too_cold", off="too_warm"),)

    def too_cold(self, t, temperature, velocity, load):
        return self.below - temperature

    def too_warm(self, t, temperature, velocity, load):
        return temperature - self.above

    def force(self, t, temperature, velocity, load, sides):
        return -0.1 * (temperature - 10.0) + self.power * (1.0 + sides.heater) / 2.0


@dataclass(frozen=True, kw_only=True)
class ThermostatInWeather(Thermostat):
    """The same room, which the weather heats too."""

    channels: ClassVar[tuple[str, ...]] = ("weather",)

    def force(self, t, temperature, velocity, load, sides):
        heat = self.power * (1.0 + sides.heater) / 2.0
        return -0.1 * (temperature - 10.0) + heat + load.weather(t)


@dataclass(frozen=True, kw_only=True)
class Servo(ContactModel):
    """A motor with friction that a relay with hysteresis drives back: y'' + y' = -u."""

    width: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("y",)
    surfaces: ClassVar[tuple[Relay, ...]] = (Relay(name="drive", on="above", off="below"),)

    def above(self, t, y, velocity, load):
        return y - self.width

    def below(self, t, y, velocity, load):
        return -self.width - y

    def force(self, t, y, velocity, load, sides):
        return -velocity - sides.drive


@dataclass(frozen=True, kw_only=True)
class PushedServo(Servo):
    """The same motor under a load: y'' + y' = -u + p(t)."""

    channels: ClassVar[tuple[str, ...]] = ("push",)

    def force(self, t, y, velocity, load, sides):
        return load.push(t) - velocity - sides.drive


@dataclass(frozen=True, kw_only=True)
class Neuron(ContactModel):
    """A neuron that integrates and fires: tau u' = I - u, and u = 1 is reset to 0."""

    drive: float = 1.3
    tau: float = 2.0

    coordinates: ClassVar[tuple[str, ...]] = ("u",)
    first_order: ClassVar[tuple[str, ...]] = ("u",)
    surfaces: ClassVar[tuple[Surface, ...]] = (
        Surface(name="threshold", coordinate="u", position=1.0, after_event="fired"),
    )

    def fired(self, t, u, velocity, load):
        return 0.0, velocity

    def force(self, t, u, velocity, load, sides):
        return (self.drive - u) / self.tau


@dataclass(frozen=True, kw_only=True)
class DrivenNeuron(Neuron):
    """The same neuron under an input: tau u' = I + i(t) - u, with tau = 1."""

    tau: float = 1.0

    channels: ClassVar[tuple[str, ...]] = ("input",)

    def force(self, t, u, velocity, load, sides):
        return (self.drive + load.input(t) - u) / self.tau


@dataclass(frozen=True, kw_only=True)
class RimlessWheel(ContactModel):
    """A wheel of spokes without a rim that rolls down a slope, from spoke to spoke: the angle of
    the spoke on the ground, from the vertical."""

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
