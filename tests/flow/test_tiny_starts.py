"""A speed or a place that is far below the rounding of one step counts as 0."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import saltus

TINY = (1e-60, 1e-100, -8e-214, 1e-300, 5e-324)
LOAD = saltus.Load(frequency=1.1, force=saltus.Harmonic(0.5, phase=0.3))
UNLOADED = saltus.Load(frequency=1.1, force=saltus.Harmonic(0.5))  # its force is 0 at the start
SYSTEMS: dict[str, tuple[saltus.System, dict[str, float]]] = {
    "wall": (
        saltus.System(
            model=saltus.WallOscillator(damping=0.1, wall=0.3),
            load=LOAD,
            impact=saltus.NewtonImpact(e=0.8),
        ),
        {"x": 0.0},
    ),
    "unloaded": (
        saltus.System(
            model=saltus.WallOscillator(damping=0.1, wall=0.3),
            load=UNLOADED,
            impact=saltus.NewtonImpact(e=0.8),
        ),
        {"x": 0.0},
    ),
    "stops": (
        saltus.System(
            model=saltus.TwoStops(damping=0.1, left=-0.4, right=0.5),
            load=UNLOADED,
            impact=saltus.NewtonImpact(e=0.8),
        ),
        {"x": 0.0},
    ),
    "cell": (
        saltus.System(
            model=saltus.Metainterface(beta0=1.0),
            load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=0.2),
        ),
        {"theta": 0.2},
    ),
    "belt": (saltus.System(model=saltus.BeltOscillator()), {"x": 0.0}),
}


def begun(name: str, place: float, speed: float) -> tuple[saltus.System, dict[str, Any]]:
    system, start = SYSTEMS[name]
    places = {each: value + place for each, value in start.items()}
    return system, places | {"velocity": speed, "duration": 9.0}


@pytest.mark.parametrize("tiny", TINY)
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_tiny_start_is_one_at_rest(name: str, tiny: float) -> None:
    system, start = begun(name, 0.0, 0.0)
    rest = saltus.simulate(system, **start)
    for place, speed in ((0.0, tiny), (tiny, 0.0), (tiny, tiny)):
        motion = saltus.simulate(system, **begun(name, place, speed)[1])
        assert [str(event.kind) for event in motion.events] == [
            str(event.kind) for event in rest.events
        ]
        assert motion.final_state == pytest.approx(rest.final_state, abs=1e-11)
    assert len(rest.events) > 0


@pytest.mark.parametrize("name", ["wall", "unloaded", "stops", "cell"])
def test_tiny_starts_in_lanes_and_with_derivatives(name: str) -> None:
    system, start = begun(name, 0.0, 0.0)
    rest = saltus.sensitivities(system, **start)
    speeds = np.array([0.0, *TINY])
    ends = saltus.simulate_many(system, **(start | {"velocity": speeds}))
    for i, speed in enumerate(speeds):
        found = saltus.sensitivities(system, **(start | {"velocity": float(speed)}))
        assert found.state == pytest.approx(rest.state, abs=1e-8)
        assert float(ends["velocity"][i]) == pytest.approx(rest.motion.velocity, abs=1e-10)
