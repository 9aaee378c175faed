"""How trajectories in lanes end: rest beside the end of a forcing period, captured chatter, impacts
without end.
"""

import math

import numpy as np
import pytest
from shared_systems import forced

import saltus
from saltus.errors import MotionError
from saltus.flow import EventKind, stop_names
from saltus.systems import EnergyRestitution, Harmonic, Load, Metainterface, System, WallOscillator


@pytest.mark.parametrize("late", [1e-6, 1e-8, 1e-10, -1e-8])
@pytest.mark.parametrize("begin", [0.0, 1.0])
def test_an_accumulation_that_ends_beside_a_forcing_period_has_the_scalar_kernels_impacts(
    late, begin
):
    """It is followed to the end only where the motion itself ends first.

    How many bounces are followed depends on the natural time of the load, so the reference has a
    period of nearly the same length, in which the accumulation does not end beside a period's end.
    """
    system = forced(H=0.0, V=-0.5, e=0.8)
    motion = saltus.simulate(system, theta=0.3, duration=100.0)
    rest = next(event.time for event in motion.events if event.kind == EventKind.REST)
    elsewhere = system.with_({"load.frequency": 2 * math.pi / (0.9 * rest)})
    motion = saltus.simulate(elsewhere, theta=0.3, duration=100.0)
    turned = system.with_({"load.frequency": 2 * math.pi / (rest - late)})
    for periods in (1, 2, 3):
        arguments = {"theta": 0.3, "time": begin, "periods": periods}
        alone, lane = (
            saltus.simulate(turned, **arguments),
            saltus.simulate_many(turned, **arguments),
        )
        assert int(lane.impact_count) == len(alone.impacts)
        assert str(stop_names(lane).values) == alone.stop.value
        if periods > 1:
            assert len(alone.impacts) == len(motion.impacts)


def test_impacts_too_slow_to_be_followed_are_captured_at_once():
    system = forced(H=0.05, e=1.0)
    threshold = float(saltus.capture_speed(system))
    speeds = np.array([1e-7, 1e-6, 1e-5, 1e-4, 0.9 * threshold])
    ends = saltus.simulate_many(system, theta=0.0, velocity=speeds, periods=50, until="rest")
    assert set(stop_names(ends).values) == {"captured"}
    assert (ends.time[speeds > 1e-5] == 0.0).all()
    assert float(ends.time.max()) <= 2 * np.pi  # where they are averaged, within a forcing period
    nothing = saltus.simulate_many(
        system.with_({"load.horizontal.amplitude": 0.2}),
        theta=0.0,
        velocity=speeds,
        periods=1,
        until="rest",
    )
    assert "captured" not in set(stop_names(nothing).values)  # the load lifts it off


ENDLESS = System(
    model=Metainterface(
        beta0=0.4429827242737341,
        damping=0.2602560980696822,
        stiffness_ratio=1.8254485259571052,
        mass_ratio=1.3436539496829922,
        dissipation_ratio=2.8601002257869395,
    ),
    load=Load(
        frequency=3.4771832381847445,
        vertical=Harmonic(0.03305397886533096, mean=-1.162448976094278, phase=1.0),
        lower_horizontal=Harmonic(-0.2259789911137646, phase=0.7),
        ground_horizontal=Harmonic(0.015505069440030161),
    ),
    impact=EnergyRestitution(1.0),
)


@pytest.mark.thorough
def test_impacts_that_shrink_as_one_over_their_number_end_in_both_kernels():
    """Where the ground moves, T+ = T- takes from two impacts a share of the speed in proportion to
    the speed.
    """
    with pytest.raises(MotionError, match="accumulate too slowly"):
        saltus.simulate(
            ENDLESS,
            theta=0.0,
            velocity=0.000539313800157078,
            time=-15.526170929713356,
            periods=1,
            dense=False,
        )
    ends = saltus.simulate_many(
        ENDLESS, theta=0.0, velocity=0.000539313800157078, time=-15.526170929713356, periods=1
    )
    assert str(stop_names(ends).values) == "unresolved"


@pytest.mark.parametrize("frequency", [None, 1e-6])
def test_a_long_ordinary_motion_has_as_many_impacts_as_it_needs(frequency):
    """A ball that loses nothing, x'' = 1 towards the wall, speed v: an impact every 2 v, more than
    a million of them.
    """
    speed, count = 0.01, 1_200_000
    system = System(
        model=WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=Load(frequency=frequency, force=1.0),
    )
    ends = saltus.simulate_many(
        system, x=0.0, velocity=-speed, duration=2 * speed * (count + 0.5), tol=1e-9
    )
    assert str(stop_names(ends).values) == "horizon"
    assert int(ends.impact_count) == count
    assert float(ends.x) == pytest.approx(-(speed**2) / 2, abs=1e-8)
