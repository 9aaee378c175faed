"""Motions on which nothing acts that varies: a cycle has no forcing period, and its own period is
found.
"""

import math

import numpy as np
import pytest

import saltus
from saltus.attractors.attractor import Target
from saltus.attractors.basins.basin_cells import _on_orbit
from saltus.attractors.judgement import Reason, judge
from saltus.attractors.stroboscopic_section import is_unforced
from saltus.flow import Ending, Recurrence

# From the end of a stick the slip is a half circle and a line: the period of the cycle in closed
# form, for a static friction of 0.3, a kinetic one of 0.2 and a belt of speed 0.1.
CYCLE = 2.0 + 1.5 * math.pi


def belt(**load) -> saltus.System:
    model = saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1)
    return saltus.System(model=model, load=saltus.Load(**load))


@pytest.mark.parametrize(
    "load",
    [
        {},
        {"frequency": 1.0},
        {"frequency": 1.0, "force": saltus.Harmonic(0.0)},
        {"frequency": 2.0 * math.pi / CYCLE},  # the cycle repeats itself with this clock
    ],
    ids=["no clock", "a clock", "a load of 0", "a clock of the cycle's period"],
)
def test_a_cycle_is_found_whatever_the_clock_is(load):
    system = belt(**load)
    motion = saltus.simulate(system, x=0.25, velocity=0.1, duration=100.0)
    slips = motion.events.of(saltus.EventKind.SLIP).times
    assert np.diff(slips)[1:] == pytest.approx(CYCLE, abs=1e-9)
    verdict = saltus.classify(system, x=0.25, velocity=0.1, periods=64, transient=20)
    assert (verdict.kind, verdict.cause) == (Ending.PERIODIC, Reason.CYCLE)
    assert verdict.period == pytest.approx(CYCLE, abs=1e-12)
    assert verdict.orbit.multipliers == pytest.approx([0.0], abs=1e-12)
    found = saltus.find_attractors(system, starts=32)
    assert [attractor.period for attractor in found] == pytest.approx([CYCLE], abs=1e-12)
    # without damping a mass that is always slower than the belt goes round a circle of its own
    radius = np.hypot(found.states[:, 0] - 0.2, found.states[:, 1])
    slower = radius < 0.1 - 1e-9
    assert (found.assigned == np.where(slower, -1, 1)).all()
    assert 0 < found.undecided == slower.sum()
    assert all("round a cycle, which has no forcing period" in text for text in found.reasons)


def test_an_equilibrium_and_a_cycle_beside_it_have_their_basins():
    """With damping the circle about the equilibrium that touches the belt's speed shrinks: what
    is inside it comes to rest, what is outside of the cycle settles on that."""
    model = saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1, damping=0.05)
    system = saltus.System(model=model)
    window = ((0.05, 0.4), (-0.15, 0.05))
    data = saltus.basins_of_attraction(system, window=window, points=5)
    assert data["attractor_period"].values[0] == 1.0
    x, velocity = np.meshgrid(data["x"].values, data["velocity"].values)
    for place, speed, label in zip(
        x.ravel().tolist(), velocity.ravel().tolist(), data["label"].values.ravel(), strict=True
    ):
        motion = saltus.simulate(system, x=place, velocity=speed, duration=400.0)
        sticks = motion.events.of(saltus.EventKind.STICK).times
        assert label == (2 if (sticks > 300.0).any() else 1)


def test_the_judge_of_charts_and_diagrams_says_the_same():
    system = belt(frequency=1.0, force=saltus.Harmonic(0.0))
    states = np.array([[[0.25, 0.1]], [[0.2, 0.0]]])
    found = judge(system, states, {"load.force.amplitude": np.array([0.0, 0.0])})
    assert (found.ending == Ending.UNDECIDED).all()
    assert (found.reason == Reason.SELF_EXCITED).all()


def test_an_equilibrium_under_a_constant_load_is_found_as_before():
    model = saltus.WallOscillator(stiffness=4.0, damping=0.4, wall=2.0)
    system = saltus.System(model=model, load=saltus.Load(force=3.0))
    verdict = saltus.classify(system, x=0.1)
    assert verdict.kind is Ending.PERIODIC
    assert repr(verdict).startswith("Verdict(equilibrium: it comes to the equilibrium at 0.75")
    (attractor,) = saltus.find_attractors(system, starts=8)
    assert "1: equilibrium, amplitude=0.75" in repr(attractor)  # F / k
    assert verdict.orbit.highest == pytest.approx(0.75, abs=1e-9)  # 3 / 4
    assert [a.period for a in saltus.find_attractors(system, starts=4)] == [1]


def test_a_load_that_varies_by_little_forces():
    assert is_unforced(belt(frequency=2.0))
    assert not is_unforced(belt(frequency=2.0, force=saltus.Harmonic(1e-9)))


def test_a_word_that_no_state_has_is_refused_in_one_sentence():
    with pytest.raises(saltus.ParameterError, match="has no coordinate 'duration'"):
        saltus.lyapunov_spectrum(belt(), x=0.1, duration=200.0)


@pytest.mark.parametrize("kept", [49, 100, 122, 150])
def test_a_basin_waits_for_two_periods_of_a_long_orbit(kept):
    """An orbit of 61 periods on a circle, and a motion that comes nearer to it by a factor of 0.9
    in each round; with fewer states than two rounds nothing is said yet."""
    period = 61
    angles = 2.0 * np.pi * np.arange(period) * 7 / period
    orbit = np.column_stack([np.cos(angles), np.sin(angles)])
    away = 1e-7 * 0.9 ** (np.arange(kept) // period)
    states = orbit[np.arange(kept) % period] * (1.0 + away[:, None])
    ends = Recurrence(
        np.array([Ending.UNDECIDED]),
        np.array([0]),
        np.array([kept]),
        states[None, -1],
        states[None],
    )
    here = _on_orbit(Target(1, Ending.PERIODIC, orbit), ends)
    assert here.tolist() == [kept >= 2 * period]
