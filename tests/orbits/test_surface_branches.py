"""Branches of orbits that pass surfaces: what they show does not depend on the asked range, the
step, or the side from which a surface is declared; a touch across which forces are continuous is no
event of a branch.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus
from saltus.flow import continuous_surfaces, program


@dataclass(frozen=True, kw_only=True)
class Backlash(saltus.ContactModel):
    """Two inertias with a play between them, of a stiffness and a damping beyond it."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[Any] = (
        saltus.Surface(name="a", coordinate={"y": 1.0, "x": -1.0}, position=0.25),
        saltus.Surface(name="b", coordinate={"x": 1.0, "y": -1.0}, position=0.25),
    )
    static: float = 0.15
    preload: float = 0.0

    def mass_matrix(self, q):
        return [[1.0, 0.0], [0.0, 0.5]]

    def force(self, t, q, v, load, sides):
        apart, rate = q[1] - q[0], v[1] - v[0]
        pushed = (1 + sides.a) / 2 * (8 * (apart - 0.25) + 0.1 * rate + self.preload)
        pulled = (1 + sides.b) / 2 * (8 * (apart + 0.25) + 0.1 * rate - self.preload)
        own = self.static + 0.4 * load.force(t) - 0.5 * q[0] - 0.1 * v[0] + 0.02 * v[1]
        other = -self.static - 0.2 * q[1] + 0.02 * v[0] - 0.06 * v[1]
        return own + pushed + pulled, other - pushed - pulled


@dataclass(frozen=True, kw_only=True)
class BacklashDeclaredAlike(Backlash):
    """The same play, with both surfaces of one sum."""

    surfaces: ClassVar[Any] = (
        saltus.Surface(name="a", coordinate={"y": 1.0, "x": -1.0}, position=0.25),
        saltus.Surface(name="b", coordinate={"y": 1.0, "x": -1.0}, position=-0.25, sign=-1),
    )


def system_at(frequency, model=None):
    load = saltus.Load(frequency=frequency, force=saltus.Harmonic(1.0))
    return saltus.System(model=model or Backlash(), load=load)


def branch_in(bounds, frequency=2.2, model=None, **more):
    orbit = saltus.find_orbit(system_at(frequency, model), x=0.0, y=0.0)
    return saltus.continue_orbit(orbit, "load.frequency", bounds, **more)


def shown(branch):
    return sorted((str(point.kind), round(point.parameter, 7)) for point in branch.special)


@pytest.mark.parametrize("top", [3.0, 2.95, 2.9])
def test_the_branch_of_a_backlash_reaches_both_asked_bounds(top):
    branch = branch_in((2.0, top))
    assert sorted(end.parameter for end in branch.ends) == [2.0, top]
    assert not branch.special
    assert not branch.missed


def test_a_surface_may_be_declared_from_either_side():
    one, other = (
        branch_in((2.0, 2.4), 2.2, model)
        for model in (Backlash(static=0.0), BacklashDeclaredAlike(static=0.0))
    )
    assert shown(one) == shown(other)
    assert [str(end) for end in one.ends] == [str(end) for end in other.ends]


def test_special_points_of_a_backlash_do_not_depend_on_the_asked_range():
    model = Backlash(static=0.0)
    wide = branch_in((1.3, 2.3), 2.2, model)
    fold = [point for point in shown(wide) if point[0] == "LP"]
    assert fold
    assert [str(end) for end in wide.ends] == ["bound 2.3", "bound 2.3"]
    for bounds in ((1.4, 2.4), (1.43, 2.23)):
        assert [point for point in shown(branch_in(bounds, 2.2, model)) if point in fold] == fold


def test_orbits_beyond_a_touch_of_a_backlash_repeat_themselves():
    """Those of the branch are orbits: a motion from each returns after a period."""
    branch = branch_in((1.4, 2.3), 2.2, Backlash(static=0.0))
    assert max(orbit.defect for orbit in branch.orbits[::7]) < 1e-9


@dataclass(frozen=True, kw_only=True)
class Stop(saltus.ContactModel):
    """Two masses; beyond the surface forces act on one or the other."""

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    surfaces: ClassVar[Any] = (saltus.Surface(name="stop", coordinate="x", position=0.5),)
    stiffness: float = 0.0
    damping: float = 0.0
    preload: float = 0.0
    other: float = 0.0

    def mass_matrix(self, q):
        return [[1.0, 0.1], [0.1, 0.5]]

    def force(self, t, q, v, load, sides):
        beyond = (1 + sides.stop) / 2
        push = self.stiffness * (q[0] - 0.5) + self.damping * v[0] * (1 + v[1] ** 2) + self.preload
        return load.force(t) - q[0] - beyond * push, -q[1] - beyond * self.other * v[1]


@pytest.mark.parametrize(
    ("numbers", "continuous"),
    [
        ({"stiffness": 3.0}, True),
        ({"damping": 0.2}, True),
        ({"stiffness": 3.0, "damping": 0.2}, True),
        ({"preload": 1e-9}, False),
        ({"stiffness": 3.0, "preload": 0.1}, False),
        ({"other": 0.1}, False),
    ],
)
def test_whether_a_force_is_continuous_across_a_surface_is_decided_on_its_expressions(
    numbers, continuous
):
    """The acceleration jumps for a preload, and for a damper on the other mass alone."""
    system = system_at(1.0, Stop(**numbers))
    run = program(system)
    values = dict(system.parameters)
    found = continuous_surfaces(run.trace, tuple(values[path] for path in run.trace.parameters))
    assert (found == frozenset({0})) == continuous


def test_a_parameter_that_is_varied_counts_with_all_of_its_values():
    system = system_at(1.0, Stop(stiffness=1.0))
    run = program(system)
    values = tuple(system.parameters[path] for path in run.trace.parameters)
    assert continuous_surfaces(run.trace, values, ("model.stiffness",)) == frozenset({0})
    assert continuous_surfaces(run.trace, values, ("model.preload",)) == frozenset()


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(20))
def test_branches_of_random_backlashes_do_not_depend_on_range_or_step(seed):
    rng = np.random.default_rng([43, seed])
    model = Backlash(static=float(rng.uniform(-0.3, 0.3)))
    start = float(rng.uniform(1.8, 2.6))
    wide = branch_in((start - 0.3, start + 0.3), start, model)
    for half, step in ((0.3, 0.03), (0.2, 0.1), (0.11, 0.1)):
        bounds = (start - half, start + half)
        branch = branch_in(bounds, start, model, step=step)
        assert all(end.reason.name in ("BOUND", "CLOSED") for end in branch.ends)
        inside = [p for p in shown(wide) if bounds[0] <= p[1] <= bounds[1]]
        assert set(shown(branch)) <= set(shown(wide))
        assert half < 0.3 or shown(branch) == inside
