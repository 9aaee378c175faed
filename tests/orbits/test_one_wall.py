"""One oscillator at a wall, written with one contact, with several, and as a structure of one row:
its orbits have the same branches.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus


@dataclass(frozen=True, kw_only=True)
class Wall(saltus.ContactModel):
    """m x'' + c x' + k x = f(t) below a wall."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)
    stiffness: float = 1.0
    damping: float = 0.1
    wall: float = 1.0

    @property
    def contacts(self):
        return (saltus.Contact(name="wall", coordinate="x", sign=-1, position=self.wall),)

    def force(self, t, x, v, load):
        return load.force(t) - self.stiffness * x - self.damping * v


def structure(stiffness, damping, wall):
    stop = saltus.Contact(name="stop", coordinate=0, position=wall, sign=-1)
    return saltus.Structure(
        mass=np.eye(1),
        stiffness=stiffness * np.eye(1),
        damping=damping * np.eye(1),
        contacts=[stop],
        forces={"force": 0},
    )


def forms(seed: int) -> tuple[dict[str, saltus.System], float]:
    """A random oscillator in its three forms, and the frequency of its load."""
    rng = np.random.default_rng([43, 6, seed])
    numbers = {
        "stiffness": 1.0,
        "damping": float(rng.uniform(0.02, 0.15)),
        "wall": float(rng.uniform(0.1, 0.8)),
    }
    frequency = float(rng.uniform(0.6, 2.6))
    e = float(rng.uniform(0.4, 0.9))
    signal = saltus.Harmonic(amplitude=float(rng.uniform(0.3, 0.8)), phase=np.pi / 2)
    load = saltus.Load(frequency=frequency, force=signal)
    models: dict[str, tuple[Any, Any]] = {
        "one contact": (saltus.WallOscillator(**numbers), saltus.VelocityReduction(e)),
        "several": (Wall(**numbers), saltus.NewtonImpact(e=e)),
        "structure": (structure(**numbers), saltus.NewtonImpact(e=e)),
    }
    systems = {
        name: saltus.System(model=model, load=load, impact=impact)
        for name, (model, impact) in models.items()
    }
    return systems, frequency


def branches(seed: int) -> dict[str, tuple[Any, ...] | None]:
    """What the branch of each form shows: its special points, and why it ends."""
    systems, frequency = forms(seed)
    shown: dict[str, tuple[Any, ...] | None] = {}
    for name, system in systems.items():
        try:
            orbit = saltus.find_orbit(system, **{system.model.coordinates[0]: 0.1})
        except saltus.MotionError:
            shown[name] = None
            continue
        bounds = (0.7 * frequency, 1.4 * frequency)
        branch = saltus.continue_orbit(orbit, "load.frequency", bounds)
        specials = sorted((str(p.kind), round(p.parameter, 7)) for p in branch.special)
        ends = sorted((e.reason.name, round(e.parameter or 0.0, 7)) for e in branch.ends)
        shown[name] = orbit.period, specials, ends
    return shown


def alike(seed: int) -> None:
    shown = branches(seed)
    assert shown["several"] == shown["one contact"]
    assert shown["structure"] == shown["one contact"]


@pytest.mark.parametrize("seed", [1, 3, 5, 15, 16, 23, 26, 29, 31, 32])
def test_a_wall_has_the_same_branches_in_each_of_its_forms(seed):
    alike(seed)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(40, 90))
def test_a_random_wall_has_the_same_branches_in_each_of_its_forms(seed):
    alike(seed)


def period_three(model, impact):
    signal = saltus.Harmonic(amplitude=0.3, phase=np.pi / 2)
    load = saltus.Load(frequency=0.9, force=signal)
    system = saltus.System(model=model, load=load, impact=impact)
    return saltus.find_orbit(system, x=0.2, velocity=0.0)


@pytest.mark.parametrize(
    ("model", "impact"),
    [
        (saltus.WallOscillator(damping=0.1, wall=1.0), saltus.VelocityReduction(0.8)),
        (Wall(damping=0.1), saltus.NewtonImpact(e=0.8)),
    ],
)
def test_where_an_orbit_of_period_one_grazes_those_of_period_three_keep_their_period(model, impact):
    """The linear motion of the amplitude F / sqrt((k - W^2)^2 + (c W)^2) = 1 grazes once a period.
    Families of period 3 with one and with two impacts meet there, and are one loop.
    """
    orbit = period_three(model, impact)
    assert (orbit.period, orbit.impact_count) == (3, 1)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.6, 1.6))
    assert branch.closed
    roots = np.roots([1.0, 0.1**2 - 2.0, 1.0 - 0.3**2])
    linear = np.sqrt(roots.real.min())
    grazing = [point for point in branch.special if point.kind == "GR"]
    assert len(grazing) == 2
    assert min(abs(point.parameter - linear) for point in grazing) < 1e-10
    assert {orbit.impact_count for orbit in branch.orbits} == {1, 2}
    assert {orbit.period for orbit in branch.orbits} == {3}


def test_a_branch_is_the_same_begun_with_one_or_with_two_impacts():
    model, impact = Wall(damping=0.1), saltus.NewtonImpact(e=0.8)
    branch = saltus.continue_orbit(period_three(model, impact), "load.frequency", (0.6, 1.6))
    expected = sorted((str(p.kind), round(p.parameter, 8)) for p in branch.special)
    for count in (1, 2):
        start = [o for o in branch.orbits if o.impact_count == count and not o.grazes][3]
        again = saltus.continue_orbit(start, "load.frequency", (0.6, 1.6))
        assert sorted((str(p.kind), round(p.parameter, 8)) for p in again.special) == expected
        assert again.closed
