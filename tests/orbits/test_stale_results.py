"""Results know what they are of: another equation, another version or damaged numbers are refused,
with what differs.
"""

from dataclasses import dataclass
from typing import ClassVar

import pytest

import saltus
from saltus import OneContactModel
from saltus import result as results
from saltus.errors import ParameterError
from saltus.orbits import orbits_of
from saltus.systems import Harmonic, Load, System, VelocityReduction, WallOscillator, register
from saltus.taylor import equations_of

STIFFNESS = 1.0


@dataclass(frozen=True, kw_only=True)
class Hinged(OneContactModel):
    """x'' + c x' + k x + s / 5 = force, with a constant of the module as its stiffness k."""

    damping: float = 0.1

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        return load.force(t) - self.damping * velocity - STIFFNESS * x - 0.2 * side


def system():
    return System(model=Hinged(), load=Load(frequency=1.5, force=Harmonic(amplitude=1.0)))


@pytest.fixture(scope="module")
def branch():
    register(Hinged)
    orbit = saltus.find_orbit(system(), x=0.5)
    return saltus.continue_orbit(orbit, "load.frequency", (1.45, 1.55)).to_xarray()


def test_what_is_as_it_was_is_read_back(branch):
    assert max(orbit.residual for orbit in orbits_of(branch)) < 1e-11


def test_a_changed_constant_of_the_module_is_seen(branch, monkeypatch):
    monkeypatch.setitem(globals(), "STIFFNESS", 1.1)
    with pytest.raises(
        ParameterError, match=r"the acceleration of Hinged has changed since; compute it again"
    ):
        orbits_of(branch)


def test_a_constant_that_changes_in_a_session_is_seen_by_the_next_motion(monkeypatch):
    def end():
        return saltus.simulate(system(), x=0.5, periods=3).x

    before = end()
    monkeypatch.setitem(globals(), "STIFFNESS", 1.5)
    changed = end()
    assert abs(changed - before) > 1e-3
    monkeypatch.undo()
    assert end() == before


def test_another_class_of_the_same_name_is_seen(branch, monkeypatch):
    @dataclass(frozen=True, kw_only=True)
    class Other(Hinged):
        def reset(self, t, velocity, side, load, impact):
            return -side, 0.5 * velocity

    Other.__name__ = "Hinged"
    monkeypatch.setitem(saltus.systems.MODELS, "Hinged", Other)
    with pytest.raises(ParameterError, match=r"the reset of Hinged has changed since"):
        orbits_of(branch)


def test_another_version_of_the_results_is_seen(branch, monkeypatch):
    monkeypatch.setattr(results, "RESULT_VERSION", results.RESULT_VERSION + 1)
    with pytest.raises(
        ParameterError,
        match=r"it is by saltus [\d.]+, whose results are of version \d+, and here of \d+",
    ):
        orbits_of(branch)


def test_numbers_that_are_no_orbit_are_refused(branch):
    damaged = branch.copy(deep=True)
    damaged["unknowns"][2, 0] += 1e-6
    with pytest.raises(
        ParameterError,
        match=r"what is kept at load.frequency = .* is not an orbit \(its residual is",
    ):
        orbits_of(damaged)


def test_a_digest_names_the_part_that_differs():
    one = equations_of(system())

    def differ(**parts):
        other = equations_of(System(**{"model": Hinged(), "load": system().load} | parts))
        return {part for part in one if one[part] != other[part]}

    assert not differ(impact=VelocityReduction(0.9))  # a number, which the system's JSON has
    assert differ(load=Load(frequency=1.5)) == {"acceleration"}
    assert differ(
        model=WallOscillator(), load=Load(frequency=1.5, force=Harmonic(amplitude=1.0))
    ) > {"acceleration", "reset"}
