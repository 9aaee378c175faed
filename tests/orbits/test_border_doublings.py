"""Where multipliers jump: branches of a mass on a belt whose friction falls with the speed, which
double at grazing-slidings.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from shared_systems import Falling

import saltus
from saltus.orbits import OrbitEnd, solved_near

FREQUENCY = "load.frequency"


def rubbed(frequency: float) -> saltus.System:
    """Chaotic at other frequencies."""
    model = Falling(kinetic=0.4, static=0.4, belt_speed=0.5)
    return saltus.System(
        model=model, load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=0.5))
    )


def settled(frequency: float) -> tuple[float, float]:
    """The state on which motions end."""
    motion = saltus.simulate(rubbed(frequency), x=0.3, velocity=0.1, periods=400, dense=False)
    return motion.x, motion.velocity


def apart(frequency: float, periods: int) -> float:
    """By how much the motion on which others end differs from itself so many periods later."""
    x, velocity = settled(frequency)
    later = saltus.simulate(rubbed(frequency), x=x, velocity=velocity, periods=periods, dense=False)
    return abs(later.x - x) + abs(later.velocity - velocity)


def branch_through(
    frequency: float, periods: int, bounds: tuple[float, float], **numbers: float
) -> saltus.Branch:
    """The branch of the orbit on which motions end."""
    orbit = solved_near(rubbed(frequency), FREQUENCY, np.array(settled(frequency)), periods)
    assert orbit is not None
    return saltus.continue_orbit(orbit, FREQUENCY, bounds, **numbers)


@pytest.fixture(scope="module")
def parent() -> saltus.Branch:
    """Orbits of two periods, stable at first, through the birth of those of four."""
    return branch_through(0.595, 2, (0.594, 0.6))


def listed(branch: saltus.Branch) -> list[tuple[str, float]]:
    """The special points of the branch's own orbits."""
    period = branch.orbits[len(branch.orbits) // 2].period
    return [
        (str(point.kind), point.parameter)
        for point in branch.special
        if point.orbit.period == period
    ]


@pytest.fixture(scope="module")
def in_small_steps() -> list[tuple[str, float]]:
    """The special points of the orbits of four periods, from their birth over a fold to their
    end.
    """
    branch = branch_through(0.597, 4, (0.5, 0.8), step=0.02)
    assert max(orbit.defect for orbit in branch.orbits[1:-1:16]) < 1e-9
    return listed(branch)


@pytest.mark.thorough
@pytest.mark.parametrize("frequency", [0.5984, 0.599, 0.6])
def test_from_wherever_it_is_begun_a_branch_has_the_special_points_of_small_steps(
    frequency: float, in_small_steps: list[tuple[str, float]]
) -> None:
    """At a grazing-sliding at which it turns round it ended where its steps had shrunk to nothing,
    or not, and had a PD and a BPC of both sides' multipliers, or not. It ends where it meets orbits
    of two periods, and goes on along none of these."""
    branch = branch_through(frequency, 4, (0.5, 0.8))
    assert [end.reason for end in branch.ends] == [OrbitEnd.IMAGE] * 2
    found = listed(branch)
    assert [kind for kind, _ in found] == [kind for kind, _ in in_small_steps]
    assert [place for _, place in found] == pytest.approx(
        [place for _, place in in_small_steps], abs=1e-9
    )
    steps = [
        after.curve.norm(after.place - before.place) for before, after in pairwise(branch.points)
    ]
    assert max(steps) < 1.3 * 0.1  # no jump: the longest step, and what corrections add to it


def test_a_doubling_at_a_jump_is_where_the_slopes_of_direct_motions_lie_on_both_sides_of_minus_1(
    parent: saltus.Branch,
) -> None:
    """Of the map of two periods, of which a stick leaves one slope that is not 0.

    Beside it motions end on two and on four.
    """
    (point,) = (point for point in parent.special if point.kind == "PD")
    assert apart(point.parameter - 1e-4, 2) < 1e-9
    assert apart(point.parameter + 1e-4, 4) < 1e-9
    assert apart(point.parameter + 1e-4, 2) > 1e-4
    assert point.evidence.before * point.evidence.after < 0.0
    start = point.orbit.start()

    def slope(side: float) -> float:
        first, change, size = (
            np.array([start["x"], start["velocity"]]),
            np.array([1.0, 0.3]),
            side * 1e-6,
        )
        # the second round grows by the slope, as the first one leaves nothing but its direction
        for _ in range(2):
            here, there = (
                saltus.simulate(
                    point.orbit.system,
                    x=x,
                    velocity=v,
                    time=start["time"],
                    periods=2,
                    tol=1e-14,
                    dense=False,
                )
                for x, v in (first, first + size * change)
            )
            later = np.array([there.x - here.x, there.velocity - here.velocity]) / size
            ratio, change = float(later @ change / (change @ change)), later / np.abs(later).max()
        return ratio

    assert min(slope(1.0), slope(-1.0)) < -1.0 < max(slope(1.0), slope(-1.0))


@pytest.mark.thorough
def test_what_is_born_there_is_what_direct_motions_end_on(parent: saltus.Branch) -> None:
    """The doubled orbit, and not the orbit itself gone round twice."""
    (point,) = (point for point in parent.special if point.kind == "PD")
    (born,) = saltus.switch_branch(point, (0.59, 0.602))
    (orbit,) = (orbit for orbit in born.at(0.599) if orbit.stable)
    x, velocity = settled(0.599)
    times = np.arange(4) * orbit.system.load.period
    there = [
        saltus.simulate(
            orbit.system, **orbit.start(), duration=10 * 4 * times[1] - orbit.start()["time"] + time
        )
        for time in times
    ]
    assert min(abs(motion.x - x) + abs(motion.velocity - velocity) for motion in there) < 1e-8
    first = born.points[1].orbit
    assert first.defect < 1e-9
    assert abs(first.solution.values[0] - point.parameter) < 1e-5
