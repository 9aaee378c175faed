"""Cells of a chart whose motions settle too slowly to be seen to settle."""

from __future__ import annotations

import numpy as np
import pytest
from shared_systems import forced

import saltus
from saltus.attractors import approached_orbit
from saltus.flow import Ending

LOAD = "load.horizontal.amplitude"


@pytest.mark.parametrize(("horizontal", "vertical"), [(0.21, -1.52), (0.23, -1.50)])
def test_a_motion_that_settles_slowly_beside_a_doubling_is_in_its_cell(
    horizontal: float, vertical: float
) -> None:
    """With its amplitude by Newton's method from another start: its multiplier is between -1 and
    -0.997, so that it has not settled after the periods of a chart."""
    system = forced(W=1.5, V=vertical, H=horizontal)
    orbit = saltus.find_orbit(system, theta=1.45)
    assert orbit.stable
    assert -1.0 < orbit.multipliers[0].real < -0.997
    chart = saltus.stability_chart(system, horizontal=[horizontal], vertical=[vertical])
    assert chart["verdict"].values.ravel().tolist() == [Ending.PERIODIC]
    assert float(chart["amplitude"].item()) == pytest.approx(orbit.amplitude, rel=1e-6)
    assert int(chart["unsettled"].item()) == 0


def test_an_orbit_is_approached_only_if_it_attracts_and_the_motion_comes_nearer() -> None:
    """By its multiplier m the motion's distance falls as abs(m)^n; beside an orbit that repels, and
    far away from one that attracts, nothing is found."""
    slow = forced(W=1.5, V=-1.52, H=0.21)
    orbit = saltus.find_orbit(slow, theta=1.45)
    beside = np.add(orbit.section_state, [0.02, 0.0])
    found = approached_orbit(slow, beside, 4, 0.1)
    assert found is not None
    np.testing.assert_allclose(found.section_state, orbit.section_state, rtol=0, atol=1e-9)
    assert approached_orbit(slow, beside, 4, 0.001) is None
    beyond = slow.with_({LOAD: 0.22})
    x, velocity = orbit.state
    repelling = saltus.find_orbit(beyond, theta=x, velocity=velocity, settle=0, period=1)
    assert repelling.multipliers[0].real < -1.0
    assert approached_orbit(beyond, repelling.section_state, 1, 0.1) is None
