"""Motions through a grazing: the touch is reported or resolved, never missed, and the end state
follows it like a square root.
"""

import math

import numpy as np
import pytest
from shared_systems import forced

from saltus.flow import EventKind, simulate
from saltus.systems import Harmonic, Load, System, VelocityReduction, WallOscillator

# In this motion theta comes down to a minimum near contact on its own side, from above. V < 0: at
# contact both sides push back.
SYSTEM = forced(H=0.5, W=0.3)
DURATION = 6.0


def count(theta, system=SYSTEM, velocity=0.0):
    return len(simulate(system, theta=theta, velocity=velocity, duration=DURATION).impacts)


def find_grazing(low, high, system=SYSTEM):
    """Bisect the initial angle between numbers of crossings that differ by two; neighbouring
    doubles at the end.
    """
    at_low = count(low, system)
    assert count(high, system) != at_low
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return low, high
        if count(middle, system) == at_low:
            low = middle
        else:
            high = middle


@pytest.fixture(scope="module")
def grazing():
    """Two neighbouring initial angles, one without and one with the two crossings of the touch."""
    angles = np.linspace(0.2, 2.6, 97)
    counts = [count(a) for a in angles]
    at = next(i for i in range(96) if abs(counts[i + 1] - counts[i]) == 2)
    return find_grazing(angles[at], angles[at + 1])


def test_bisection_reaches_a_touch_between_neighbouring_doubles(grazing):
    few, many = sorted(
        (simulate(SYSTEM, theta=a, velocity=0.0, duration=DURATION) for a in grazing),
        key=lambda m: len(m.impacts),
    )
    assert len(many.impacts) - len(few.impacts) == 2
    fresh = [i for i, v in enumerate(many.impacts.velocity_before) if abs(v) < 1e-6]
    assert len(fresh) == 2
    assert fresh[1] == fresh[0] + 1
    # at most the square root of the working precision, or so
    assert np.diff(many.impacts.time[fresh])[0] < 1e-6
    assert few.theta == pytest.approx(many.theta, abs=1e-6)
    assert few.velocity == pytest.approx(many.velocity, abs=1e-6)


def test_the_dense_output_near_the_touch_stays_on_its_side(grazing):
    for angle in grazing:
        motion = simulate(SYSTEM, theta=angle, velocity=0.0, duration=DURATION, tol=1e-14)
        times = np.linspace(0.0, DURATION, 20001)
        position, _, side = motion.dense.states(times)
        assert (side * position[0]).min() > -1e-13


def test_the_end_state_leaves_its_smooth_continuation_like_a_square_root(grazing):
    """Beyond the touch by d the speed there is sqrt(2 a d): the time on the other side, and its
    effect, grow like sqrt(d).
    """
    without = min(grazing, key=count)
    outward = math.copysign(1.0, max(grazing, key=count) - without)
    before = [
        simulate(
            SYSTEM, theta=without - outward * d, velocity=0.0, duration=DURATION, tol=1e-15
        ).theta
        for d in (1e-7, 2e-7)
    ]
    at_touch = 2 * before[0] - before[1]
    departures = [
        abs(
            simulate(
                SYSTEM, theta=without + outward * d, velocity=0.0, duration=DURATION, tol=1e-15
            ).theta
            - at_touch
        )
        for d in (1e-8, 4e-8, 16e-8)
    ]
    assert departures[0] > 1e-6  # a smooth flow would move by 1e-8
    assert departures[1] / departures[0] == pytest.approx(2.0, rel=0.05)
    assert departures[2] / departures[1] == pytest.approx(2.0, rel=0.05)


def wall(distance):
    """x'' = cos t from x(0) = -1, v = 0: x = -cos t, which touches the wall at 1 at t = pi, 3 pi,
    ...
    """
    load = Load(frequency=1.0, force=Harmonic(amplitude=1.0, phase=math.pi / 2))
    return System(
        model=WallOscillator(stiffness=0.0, wall=distance), load=load, impact=VelocityReduction(0.8)
    )


def test_an_exact_touch_of_the_wall_is_reported_at_its_time_and_changes_nothing():
    motion = simulate(wall(1.0), x=-1.0, velocity=0.0, duration=5.0, tol=1e-15)
    near = [e for e in motion.events if e.kind in (EventKind.GRAZING, EventKind.IMPACT)]
    assert near
    for event in near:
        assert event.time == pytest.approx(math.pi, abs=1e-7)
        assert abs(event.velocity_before) < 1e-7
    assert motion.x == pytest.approx(-math.cos(5.0), abs=1e-7)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-11])
def test_just_through_the_touch_the_impact_speed_is_the_root_of_twice_the_depth(depth):
    motion = simulate(wall(1.0 - depth), x=-1.0, velocity=0.0, duration=4.0, tol=1e-15)
    speed = math.sqrt(2 * depth - depth**2)  # sin t where -cos t = 1 - depth
    assert motion.impacts.velocity_before[0] == pytest.approx(speed, rel=1e-9 + 1e-15 / depth)
    assert motion.impacts.time[0] == pytest.approx(
        math.pi - math.asin(speed), abs=1e-15 / speed + 1e-14
    )


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12, 1e-14])
def test_just_short_of_the_touch_there_is_no_impact(depth):
    motion = simulate(wall(1.0 + depth), x=-1.0, velocity=0.0, duration=5.0, tol=1e-15)
    assert len(motion.impacts) == 0
    assert motion.x == pytest.approx(-math.cos(5.0), abs=1e-13)


def test_touches_at_the_ends_of_periods_are_survived_for_any_phase():
    """The wall is touched once a period; the start is shifted, so that the touch falls anywhere in
    a step, and on its end.
    """
    for shift in [0.0, math.pi, math.pi - 1e-9, math.pi + 1e-9, *np.linspace(0, 2 * math.pi, 23)]:
        motion = simulate(
            wall(1.0),
            x=-math.cos(shift),
            velocity=math.sin(shift),
            time=shift,
            duration=4 * math.pi,
            tol=1e-14,
        )
        assert np.isfinite([motion.x, motion.velocity]).all()
        assert motion.x == pytest.approx(-math.cos(shift), abs=1e-5)


def test_a_repelling_contact_tears_the_flow_at_its_grazing_and_neither_hangs_nor_penetrates():
    """V > 0 pushes away on both sides: beyond the touch the motion does not come back."""
    system = forced(V=0.3, C=0.05, H=0.3, W=1.1)
    angles = np.linspace(0.1, 2.0, 60)
    finals = np.array(
        [simulate(system, theta=a, velocity=-0.5, duration=6.0).theta for a in angles]
    )
    assert (finals > 0).any()
    assert (finals < 0).any()
    at = int(np.argmax(np.sign(finals[1:]) != np.sign(finals[:-1])))
    low, high = angles[at], angles[at + 1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        motion = simulate(system, theta=middle, velocity=-0.5, duration=6.0)
        position, _, side = motion.dense.states(np.linspace(0.0, 6.0, 2001))
        assert (side * position[0]).min() > -1e-13
        low, high = (middle, high) if motion.theta * finals[at] > 0 else (low, middle)
