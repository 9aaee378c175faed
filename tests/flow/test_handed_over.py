"""A copy of a system in which numbers alone are others remembers the key of its structure: its motions
are those of a system that is made anew.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import saltus
from saltus.taylor import structure_key

HARMONIC = saltus.Harmonic(0.5)


@dataclass(frozen=True, kw_only=True)
class Switched(saltus.OneContactModel):
    """A mass at a wall, of which a number decides whether it has a cubic spring."""

    cubic: float = 0.0
    stiff: Any = None
    twice: Any = None
    coordinates = ("x",)
    channels = ("force",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiff", self.cubic > 1.0)
        object.__setattr__(self, "twice", 2.0 * self.cubic)

    @property
    def sides(self) -> tuple[int, ...]:
        return (1,)

    @property
    def contact(self) -> float:
        return -1.0

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        spring = self.twice * x**3 if self.stiff else x
        return load.force(t) - spring - 0.1 * velocity

    def gap(self, x: Any, side: Any) -> Any:
        return 1.0 + x

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return side, -impact.e * velocity


def system(model: saltus.Model, **channels: Any) -> saltus.System:
    load = saltus.Load(frequency=1.3, **(channels or {"force": HARMONIC}))
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(0.7))


WALL = saltus.WallOscillator(damping=0.1)
PAIR = saltus.Structure(
    mass=np.eye(2),
    stiffness=[[2.0, -1.0], [-1.0, 1.5]],
    contacts=[saltus.Contact(name="wall", coordinate=1, position=0.4, sign=-1)],
    forces={"force": 1},
)
CHANGES = [
    (system(WALL), {"load.frequency": 1.1}),
    (system(WALL), {"load.force.amplitude": 0.6, "model.damping": 0.2, "impact.e": 0.4}),
    (system(WALL), {"load.force": 0.3}),
    (system(WALL), {"impact.e": 0}),
    (system(WALL, force=[HARMONIC, 0.2]), {"load.force.1": 0.1}),
    (system(WALL, force=0.2), {"load.force": 0.1}),
    (system(WALL), {"model": saltus.WallOscillator(damping=0.3), "load.frequency": 1.2}),
    (system(saltus.TwoStops()), {"model.stiffness": 1.2, "load.frequency": 1.2}),
    (system(PAIR), {"load.frequency": 1.2, "model.contacts.wall.position": 0.3}),
    (system(Switched(cubic=0.5)), {"model.cubic": 0.7}),
    (system(Switched(cubic=0.5)), {"model.cubic": 2.0}),
]


@pytest.mark.parametrize(("base", "changes"), CHANGES)
def test_a_copy_with_other_numbers_moves_as_one_that_is_made_anew(
    base: saltus.System, changes: dict[str, Any]
) -> None:
    start = dict.fromkeys(base.model.coordinates, 0.1)
    saltus.simulate(base, **start, periods=3)
    copy = base.with_(changes)
    fresh = saltus.System(
        model=copy.model,
        load=saltus.Load(frequency=copy.load.frequency, **copy.load.channels),
        impact=copy.impact,
    )
    one, other = (saltus.simulate(each, **start, periods=7) for each in (copy, fresh))
    assert structure_key(copy) == structure_key(fresh)
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.velocity, other.velocity)
    np.testing.assert_array_equal(one.impacts.time, other.impacts.time)
    # a copy of the copy, and the first one, are as they were
    again = saltus.simulate(copy.with_({"load.frequency": 1.3}).with_(changes), **start, periods=7)
    if "load.frequency" in changes:
        np.testing.assert_array_equal(one.position, again.position)
