"""Motions in plain Python are those of the compiled kernels, of which they execute the text."""

from __future__ import annotations

import inspect
import sys

import numpy as np
import pytest
from what_works.model_classes import NAMES, model_class, system_of

import saltus
import saltus.debug

DURATION = 6.0


@pytest.mark.parametrize("name", NAMES)
def test_a_motion_in_plain_python_is_the_compiled_one(name: str) -> None:
    system = system_of(name)
    start = model_class(name).whole_start
    compiled = saltus.simulate(system, **start, duration=DURATION)
    pauses = list(saltus.debug.step_through(system, **start, duration=DURATION))
    plain = pauses[-1].motion
    assert plain.stop == compiled.stop
    assert plain.time == pytest.approx(compiled.time, rel=1e-12)
    size = 1.0 + np.abs(compiled.final_state).max()
    np.testing.assert_allclose(plain.final_state, compiled.final_state, rtol=0, atol=1e-11 * size)
    assert [event.kind for event in plain.events] == [event.kind for event in compiled.events]
    # a pause at every instant of an event
    shown = np.array([pause.event.time for pause in pauses if pause.event is not None])
    np.testing.assert_allclose(np.unique(shown), np.unique(plain.events.times), rtol=1e-12)


def test_a_pause_says_in_words_what_the_kernel_knows() -> None:
    belt = saltus.System(model=saltus.BeltOscillator(belt_speed=0.1))
    (pause,) = [
        pause
        for pause in saltus.debug.step_through(belt, x=0.0, velocity=0.05, duration=2.0)
        if pause.event is not None
    ]
    words = str(pause)
    assert f"time {pause.motion.time:.12g}: {pause.event.kind} of belt, after" in words
    assert "closed: nothing; belt sticks" in words
    assert f"x = {pause.motion.x:.12g}, x' = 0.1" in words
    assert pause.memory.sided.shape[0] == 1
    assert "solver_numbers" in dir(pause.memory)


def test_a_debugger_stops_where_the_kernel_enters_a_function(monkeypatch) -> None:
    stops = []

    def stopped() -> None:
        kernel = inspect.currentframe().f_back.f_back
        stops.append((kernel.f_code.co_filename, kernel.f_lineno))

    monkeypatch.setattr(sys, "breakpointhook", stopped)
    system = saltus.System(model=saltus.WallOscillator(wall=0.5), impact=saltus.NewtonImpact(0.5))
    asked = {"x": 0.0, "velocity": 1.0, "duration": 6.0}
    motion = saltus.simulate(system, **asked)
    for _ in saltus.debug.step_through(system, **asked, break_in="impact"):
        pass
    assert len(stops) == len(motion.impacts) > 0
    path, line = stops[0]
    with open(path, encoding="utf-8") as file:  # of the sources, at the call
        assert "impact(motion" in file.read().splitlines()[line - 1]
    early = motion.impacts.time[0] + 1e-9
    list(
        saltus.debug.step_through(
            system, **asked, break_in="impact", when=lambda memory: memory.time < early
        )
    )
    assert len(stops) == len(motion.impacts) + 1
    with pytest.raises(saltus.ParameterError, match=r"no function 'impakt'.*impact"):
        saltus.debug.step_through(system, **asked, break_in="impakt")
