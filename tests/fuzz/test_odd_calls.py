"""Odd values for which a random campaign once found a traceback: each is answered by a sentence."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import saltus
from saltus.errors import ParameterError

WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1, wall=0.3),
    load=saltus.Load(frequency=2.6, force=saltus.Harmonic(0.5)),
    impact=saltus.NewtonImpact(e=0.5),
)
THEORY = saltus.theory
ODD: dict[str, Any] = {"list": [1], "dict": {"a": 1}, "nan": math.nan, "inf": math.inf}
BOUNDS = (2.5, 2.6)
CALLS: dict[str, Callable[[], Any]] = {
    "e": lambda: THEORY.decayed_period(1, period=4.0, e=1e300),
    "swing": lambda: THEORY.critical_horizontal(0.5, -0.5, swing=1e300),
    "swing nan": lambda: THEORY.critical_horizontal(0.5, -0.5, swing=math.nan),
    "period": lambda: THEORY.wall_orbits(WALL, ODD["nan"]),
    "period inf": lambda: THEORY.wall_orbits(WALL, ODD["inf"]),
    "path": lambda: saltus.to_csv("", saltus.simulate(WALL, x=0.0, periods=1)),
    "special list": lambda: saltus.chaotic_bands(
        WALL, "load.frequency", BOUNDS, special=ODD["list"]
    ),
    "special dict": lambda: saltus.chaotic_bands(
        WALL, "load.frequency", BOUNDS, special=ODD["dict"]
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_an_odd_value_is_refused_by_name(name: str) -> None:
    with pytest.raises(ParameterError) as refused:
        CALLS[name]()
    assert name.split()[0] in str(refused.value)


def test_orbits_may_come_from_a_generator() -> None:
    orbit = saltus.find_orbit(WALL, x=0.0)
    given: Any = (orbit for _ in range(2))
    expected = saltus.orbits.defects([orbit, orbit])
    assert saltus.orbits.defects(given).tolist() == expected.tolist()
