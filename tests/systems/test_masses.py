"""Masses of one's own classes are checked when a system is made."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

import saltus


@dataclass(frozen=True, kw_only=True)
class Two(saltus.ContactModel):
    """Two masses with a coupling in the mass matrix."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    first: float = 1.0
    second: float = 0.5
    coupling: float = 0.0

    def mass_matrix(self, q: Any) -> Any:
        return [[self.first, self.coupling], [self.coupling, self.second]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return -q[0], -q[1]


class One(Two):
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def mass_matrix(self, q: Any) -> Any:
        return self.first

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        return -q


class Turned(Two):
    """Without inertia at x = 0.21, where sizes are counted, alone."""

    def mass_matrix(self, q: Any) -> Any:
        return [[self.first + (q[0] - 0.21) ** 2, 0.0], [0.0, self.second]]


@pytest.mark.parametrize("kind", [One, Two])
@pytest.mark.parametrize("mass", [-1.0, 0.0, math.nan, math.inf])
def test_a_mass_that_is_none_is_refused(kind: Any, mass: float) -> None:
    with pytest.raises(saltus.ParameterError, match=r"mass_matrix must be positive definite"):
        saltus.System(model=kind(first=mass))


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e9])
def test_a_matrix_is_definite_in_all_units(unit: float) -> None:
    """[[m, c], [c, M]] is for c^2 < m M."""
    most = math.sqrt(0.5) * unit
    saltus.System(model=Two(first=unit, second=0.5 * unit, coupling=0.999 * most))
    with pytest.raises(saltus.ParameterError, match=r"mass_matrix must be positive definite"):
        saltus.System(model=Two(first=unit, second=0.5 * unit, coupling=1.001 * most))


def test_a_matrix_that_is_singular_at_one_place_alone_is_taken() -> None:
    saltus.System(model=Turned(first=0.0))


def test_other_systems_and_lanes_are_checked_too() -> None:
    system = saltus.System(model=Two())
    with pytest.raises(saltus.ParameterError, match=r"-1 for y on its diagonal"):
        system.with_({"model.second": -1.0})
    with pytest.raises(saltus.ParameterError, match=r"-1 for y on its diagonal"):
        saltus.simulate_many(
            system, parameters={"model.second": [1.0, -1.0]}, x=[0.1, 0.1], y=[0.0, 0.0], duration=1
        )
