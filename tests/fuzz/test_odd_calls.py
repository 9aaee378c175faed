"""Odd values for which a random campaign once found a traceback: each is answered by a sentence."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sympy

import saltus
from saltus.errors import MotionError, ParameterError

WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1, wall=0.3),
    load=saltus.Load(frequency=2.6, force=saltus.Harmonic(0.5)),
    impact=saltus.NewtonImpact(e=0.5),
)
CELL = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.3), vertical=-0.5),
)
FREE = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(vertical=-0.5))
PLACE, RATE = sympy.symbols("x v")

LOADS = ("load.horizontal.amplitude", "load.vertical")
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
    "theta rows": lambda: saltus.simulate(CELL, theta=[[1, 2], [3]]),
    "theta load": lambda: saltus.classify(CELL, theta=CELL.load),
    "time rows": lambda: saltus.Measurement(
        start={"theta": 0.3}, time=[[1, 2], [3]], values={"theta": [0.3, 0.2]}
    ),
    "time text": lambda: saltus.lyapunov_spectrum(CELL, theta=0.3, time="x"),
    "fps": lambda: saltus.animate(saltus.simulate(CELL, theta=0.3, periods=1), "a.gif", fps=1e-9),
    "tau": lambda: THEORY.energy_factor(CELL, velocity=0.3, side=1, e=0.9, tau=ODD["nan"]),
    "theta0 nan": lambda: THEORY.short_period(ODD["nan"], beta0=1.4, vertical=-0.5),
    "side nan": lambda: THEORY.total_energy(FREE, theta=0.1, velocity=0.1, side=ODD["nan"]),
    "force nan": lambda: saltus.from_sympy(
        coordinates=[PLACE], velocities=[RATE], force=[sympy.nan], parameters={}
    ),
    "coordinates": lambda: saltus.frequency_sweep(CELL, values=[1.0, 1.1], coordinates=[]),
    "model.beta0 list": lambda: THEORY.amplitude_limits(CELL, {"model.beta0": ["a"]}),
    "model.damping nan": lambda: THEORY.amplitude_limits(CELL, {"model.damping": math.nan}),
    "theta shapes": lambda: THEORY.total_energy(FREE, theta=[0.1, 0.2], velocity=[0.1, 0.2, 0.3]),
    "lowest nan": lambda: THEORY.quasi_static_border(CELL, LOADS, lowest=ODD["nan"]),
    "physical list": lambda: saltus.UnitCell(alpha0=0.3, beta0=1.4, physical=ODD["list"]),
    "physical nan": lambda: saltus.UnitCell(alpha0=0.3, beta0=1.4, physical=ODD["nan"]),
    "velocity fast": lambda: saltus.simulate(CELL, theta=0.1, velocity=1e9, duration=10.0),
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


def test_limits_take_lists() -> None:
    line, closed = THEORY.amplitude_limits(CELL, {"model.beta0": [1.0, 1.5]})
    assert line.value == pytest.approx([math.pi - 1.0, math.pi - 1.5])
    assert closed.value == pytest.approx([2.0 * (math.pi - 1.0), 2.0 * (math.pi - 1.5)])


@pytest.mark.parametrize("theta0", [1e-9, 1e-30, 1e-300])
def test_the_linear_motion_from_a_tiny_angle_falls_freely(theta0: float) -> None:
    # beside the moment 0.5 cos(1.4) that pulls it back all other forces are tiny
    fall = math.sqrt(2.0 * theta0 / (0.5 * math.cos(1.4)))
    times = THEORY.linear_motion(FREE, theta0=theta0, impacts=2).impact_times
    assert times == pytest.approx([fall, 3.0 * fall], rel=1e-3)


@pytest.mark.parametrize("amplitude", [1e-9, -2e-9])
def test_a_free_orbit_beside_its_contact_falls_freely(amplitude: float) -> None:
    fall = math.sqrt(2.0 * abs(amplitude) / (0.5 * math.cos(1.4)))
    started = time.process_time()
    orbit = saltus.free_orbit(FREE, amplitude=amplitude)
    assert orbit.period == pytest.approx(4.0 * fall, rel=1e-6)
    assert orbit.turning == pytest.approx(-amplitude, rel=1e-6)
    assert time.process_time() - started < 10.0


def test_a_free_orbit_too_near_its_contact_is_refused() -> None:
    with pytest.raises(MotionError, match="impacts are averaged"):
        saltus.free_orbit(FREE, amplitude=1e-20)


def test_a_motion_that_would_take_far_too_many_steps_is_refused_early() -> None:
    with pytest.raises(MotionError, match=r"would take some \de\+\d\d steps"):
        saltus.simulate(CELL, theta=0.1, velocity=5e5, duration=1e4)


@pytest.mark.parametrize("write", [saltus.to_mat, saltus.to_csv, saltus.save])
def test_a_folder_is_no_file_to_write(write: Callable[..., Any], tmp_path: Path) -> None:
    suffix = {"to_mat": ".mat", "to_csv": ".csv", "save": ".nc"}[write.__name__]
    path = tmp_path / f"motion{suffix}"
    path.mkdir()
    with pytest.raises(ParameterError, match="cannot be written"):
        write(path, saltus.simulate(CELL, theta=0.3, periods=1))
