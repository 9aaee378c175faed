"""The start of an orbit can be handed to what follows motions, as it is."""

from __future__ import annotations

import numpy as np
import pytest
from shared_systems import forced, walled

import saltus


def stops() -> saltus.System:
    return saltus.System(
        model=saltus.TwoStops(stiffness=0.2, damping=0.1),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.8)),
        impact=saltus.NewtonImpact(e=0.7),
    )


STARTS = {
    "one contact": (forced(H=0.2), {"theta": 0.1}),
    "wall": (walled(), {"x": 0.0}),
    "several contacts": (stops(), {"x": 0.1}),
    "friction": (
        saltus.System(
            model=saltus.BeltOscillator(kinetic=0.4, static=0.4, damping=0.1, belt_speed=0.0),
            load=saltus.Load(frequency=0.3, force=saltus.Harmonic(1.0)),
        ),
        {"x": 0.2},
    ),
}


@pytest.mark.parametrize("name", STARTS)
def test_a_search_and_a_motion_begin_on_an_orbit(name: str) -> None:
    """The orbit is found again, from any time on it, and its motion comes back to the start."""
    system, start = STARTS[name]
    orbit = saltus.find_orbit(system, **start)
    again = saltus.find_orbit(system, **orbit.start(), settle=0, period=orbit.period)
    assert saltus.orbits.same_orbit(orbit, again)
    motion = saltus.simulate(system, **orbit.start(), duration=0.37 * orbit.duration)
    later = dict(zip(system.model.coordinates, np.atleast_1d(motion.position), strict=True))
    velocity = motion.velocity if len(later) == 1 else tuple(motion.velocity)
    found = saltus.find_orbit(
        system, **later, velocity=velocity, time=motion.time, settle=0, period=orbit.period
    )
    np.testing.assert_allclose(found.section_state, orbit.section_state, rtol=0, atol=1e-9)


def test_a_start_at_a_time_is_the_state_at_that_time() -> None:
    """A quarter of a period later the linear oscillator is at another place of its orbit."""
    linear = saltus.System(
        model=saltus.TwoStops(stiffness=0.5, damping=0.2, left=-9.0, right=9.0),
        load=saltus.Load(frequency=1.3, force=saltus.Harmonic(0.8)),
        impact=saltus.NewtonImpact(e=0.7),
    )
    x = 0.8 / (0.5 - 1.3**2 + 0.26j)  # the complex amplitude: Im(x exp(i W t))
    at = 0.25 * linear.load.period
    turned = x * np.exp(1.3j * at)
    orbit = saltus.find_orbit(
        linear, x=turned.imag, velocity=1.3 * turned.real, time=at, settle=0, period=1
    )
    assert orbit.x == pytest.approx(x.imag, abs=1e-11)
    with pytest.raises(saltus.errors.ParameterError, match="time"):
        saltus.find_orbit(linear, x=0.0, time=np.nan)
    with pytest.raises(saltus.errors.ParameterError, match=r"side must be \+1 or -1"):
        saltus.find_orbit(linear, x=0.0, side=3)
