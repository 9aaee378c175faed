"""Releases from rest of models whose steps are checked: at the instant of a release all terms of an
acceleration cancel, and what remains is rounding.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import Contact, Harmonic, Load, System, VelocityReduction


def by_exponential(v):
    """tanh by a function whose steps are not checked."""
    return 1.0 - 2.0 / (np.exp(2.0 * v) + 1.0)


@dataclass(frozen=True, kw_only=True)
class Pressed(saltus.OneContactModel):
    """A mass that a force presses on x = 0 from both sides."""

    damping: float = 0.3
    pressure: float = 0.31
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    saturated: ClassVar = staticmethod(np.tanh)

    def acceleration(self, t, x, velocity, side, load):
        damping = self.damping * self.saturated(3.0 * velocity)
        return load.force(t) - damping - side * self.pressure * np.sqrt(4.0 + x * x) - 0.1 * x


class PressedByExponential(Pressed):
    """The same, written otherwise."""

    saturated: ClassVar = staticmethod(by_exponential)


@dataclass(frozen=True, kw_only=True)
class OnWall(saltus.ContactModel):
    """Two masses on springs, of which one is pressed on a wall at 0."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts: ClassVar[tuple[Contact, ...]] = (Contact(name="wall", coordinate="x"),)
    saturated: ClassVar = staticmethod(np.tanh)

    def force(self, t, q, velocity, load):
        (x, y), (u, v) = q, velocity
        damping = 0.3 * self.saturated(3.0 * u)
        push = load.force(t) - 0.31 * np.sqrt(4.0 + x * x) - damping - 0.2 * (x - y)
        return push, 0.2 * (x - y) - y - 0.1 * v


class OnWallByExponential(OnWall):
    """The same, written otherwise."""

    saturated: ClassVar = staticmethod(by_exponential)


PAIRS = {"one contact": (Pressed, PressedByExponential), "wall": (OnWall, OnWallByExponential)}
FREQUENCIES = np.linspace(0.3, 3.0, 7)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("pair", PAIRS)
def test_a_release_goes_on_however_a_function_is_written(pair, restitution):
    ends = [
        saltus.simulate_many(
            System(
                model=model(),
                load=Load(frequency=1.0, force=Harmonic(1.0)),
                impact=(VelocityReduction if pair == "one contact" else saltus.NewtonImpact)(
                    restitution
                ),
            ),
            parameters={"load.frequency": FREQUENCIES},
            **dict.fromkeys(model.coordinates, 0.0),
            periods=6,
        )
        for model in PAIRS[pair]
    ]
    for one in ends:
        assert (one.stop == 0).all()
    velocity = "velocity" if pair == "one contact" else "x_velocity"
    assert (ends[0].impact_count == ends[1].impact_count).all()
    np.testing.assert_allclose(ends[0].x, ends[1].x, atol=1e-9)
    np.testing.assert_allclose(ends[0][velocity], ends[1][velocity], atol=1e-9)
