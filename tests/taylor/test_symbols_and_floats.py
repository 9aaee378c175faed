"""A model whose Python is another one for symbols than for numbers is refused."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.systems.contracts.model import Jet

HARMONIC = saltus.Load(frequency=1.0, force=saltus.Harmonic(0.5))


@dataclass(frozen=True, kw_only=True)
class Spring(saltus.ContactModel):
    """x'' = F - k x before a stop."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    stiffness: float = 2.0
    kind: int = 1

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (saltus.Contact(name="stop", coordinate="x", position=-1.0),)

    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) - self.stiffness * x


class ByKind(Spring):
    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        more = 3.0 if isinstance(self.kind, Real) else 1.0
        return load.force(t) - more * self.stiffness * x


class ByState(Spring):
    def force(self, t: Any, x: Any, velocity: Any, load: Any) -> Any:
        return load.force(t) - self.stiffness * (x if type(x) is float else 2.0 * x)


class ByMass(Spring):
    def mass_matrix(self, x: Any) -> Any:
        return self.stiffness if isinstance(self.stiffness, float) else 1.0


class ByPosition(Spring):
    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        at = -1.0 if isinstance(self.stiffness, float) else -2.0
        return (saltus.Contact(name="stop", coordinate="x", position=at),)


@dataclass(frozen=True, kw_only=True)
class Smooth(saltus.Model):
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    stiffness: float = 2.0

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        k = self.stiffness if isinstance(self.stiffness, float) else 1.0
        return load.force(t) - k * x


@pytest.mark.parametrize("kind", [ByKind, ByState, ByMass, ByPosition, Smooth])
def test_a_branch_on_a_type_is_refused(kind: Any) -> None:
    with pytest.raises(saltus.SaltusError, match=r"other equations for symbols than for numbers"):
        saltus.System(model=kind(), load=HARMONIC)


def test_the_size_of_the_system_does_not_matter() -> None:
    """Nothing is refused for rounding: lengths and times from 1e-9 to 1e9."""
    for length, rate in ((1e-9, 1e6), (1e9, 1e-6), (1.0, 1.0)):

        class Fresh(Spring):  # each class is compared once
            pass

        force = saltus.Harmonic(0.5 * length * rate**2)
        load = saltus.Load(frequency=rate, force=force)
        saltus.System(model=Fresh(stiffness=2.0 * rate**2), load=load)


def test_absolute_values_have_derivatives() -> None:
    """abs(x^3) at -2 along x' = 1: -3 x^2 and -6 x."""
    x = Jet(-2.0, 1.0, 0.0)
    cubed = np.absolute(x * x * x)
    assert (cubed.value, cubed.first, cubed.second) == (8.0, -12.0, 12.0)
