"""Impacts without loss (e = 1) near contact: the averaged law of numerics.md against resolved
impacts and closed forms.

Between impacts at speed v the motion on side s lasts 2 v_s / abs(a_s). Per unit of time the speed
gains the share a_s' / (3 a_s) from shared_systems import forced, BETA80 from the change of the pull
a_s, and loses the share g_s / 3 to the damping g_s. Averaged over both sides, with v_s = f_s v
where the impact law changes the speed by a fixed factor there and back, the action J = v^3 sum f_s
/ abs(a_s) decays at the rate (sum g_s f_s / abs(a_s)) / (sum f_s / abs(a_s)).
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from shared_systems import BETA80, forced

from saltus.flow import EventKind, simulate
from saltus.flow.kernel.layout import CHATTER_SPEED, Mode, Status
from saltus.flow.kernel.memory import EventBuffers, StepBuffers
from saltus.flow.motion.kernel_state import KernelState
from saltus.flow.motion.simulate import MotionRequest
from saltus.flow.programs.compiled import program
from saltus.systems import EnergyRestitution, Harmonic, Load, System, WallOscillator


def pulls(numbers, t):
    """abs(a_+) and abs(a_-), the contact accelerations of the two sides."""
    b, m = numbers.get("beta0", BETA80), numbers.get("m", 0.0)
    across = (
        numbers.get("mean", 0.0)
        + numbers["H"] * math.sin(numbers["W"] * t + numbers.get("phase", 0.0))
    ) * math.sin(b)
    along = numbers["V"] * math.cos(b)
    return -(across + along) / (1 + m), across - along


def law(numbers, v0, t, lower_factor=1.0):
    """Speed on the upper side at t from v0 at 0; on the lower side it is `lower_factor` times
    that.
    """
    damping = (numbers["C"] * numbers.get("c", 1.0) / (1 + numbers.get("m", 0.0)), numbers["C"])

    def sums(s):
        lower, upper = pulls(numbers, s)
        return lower_factor / lower, 1 / upper

    def rate(s):
        lower, upper = sums(s)
        return (damping[0] * lower + damping[1] * upper) / (lower + upper)

    decay = quad(rate, 0, t, epsabs=1e-14, epsrel=1e-13, limit=200)[0]
    return v0 * (math.exp(-decay) * sum(sums(0)) / sum(sums(t))) ** (1 / 3)


def averaged_speed(system, v0, duration, contact=0.0):
    """The speed of the kernel's CHATTER mode after a time, from its own state (a motion at contact
    reports 0).
    """
    run = program(system)
    arguments = {
        "velocity": v0,
        "periods": None,
        "duration": duration,
        "tol": 1e-14,
        "time": 0.0,
        "side": None,
    }
    coordinates = {system.model.coordinates[0]: contact}
    request = MotionRequest(
        system=system, coordinates=coordinates, stop_at=(), dense=False, **arguments
    )
    now = KernelState(request, run)
    steps = StepBuffers(
        np.empty((64, 2), dtype=np.int64),
        np.empty((64, 2)),
        np.empty((64, 1, now.numbers.order + 2)),
    )
    events = EventBuffers(np.empty((64, 4), dtype=np.int64), np.empty((64, 3)))
    assert now.advance(run, steps, events) == Status.DONE
    assert now.numbers.mode == Mode.CHATTER
    return now.numbers.chatter_speed


SYMMETRIC = {"C": 0.1, "V": -0.5, "H": 0.05, "W": 0.3}
UNEQUAL = {
    "C": 0.2,
    "m": 0.6,
    "c": 1.7,
    "k": 1.4,
    "V": -0.8,
    "H": 0.09,
    "mean": 0.02,
    "W": 0.5,
    "phase": 1.0,
}
CONSERVATIVE = {"C": 0.0, "V": -0.5, "H": 0.06, "W": 0.2}


def worst_relative_error(numbers, v0, duration, lower_factor=1.0, impact=None):
    """Of the law against the impacts that the kernel resolves, all those that leave the upper
    side.
    """
    motion = simulate(
        forced(**numbers, impact=impact), theta=0.0, velocity=-v0, duration=duration, tol=1e-15
    )
    upper = motion.impacts.side < 0
    assert motion.phase_known
    assert upper.sum() > 100
    pairs = list(
        zip(motion.impacts.time[upper], motion.impacts.velocity_before[upper], strict=True)
    )[::10]
    return max(abs(v / law(numbers, v0, t, lower_factor) - 1) for t, v in pairs)


@pytest.mark.parametrize("numbers", [SYMMETRIC, UNEQUAL, CONSERVATIVE])
def test_the_law_is_met_by_the_resolved_impacts_with_an_error_that_halves_with_the_speed(numbers):
    errors = [worst_relative_error(numbers, v0, 10.0) for v0 in (1e-3, 5e-4, 2.5e-4)]
    assert errors[0] < 2e-2
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.1)
    assert errors[2] / errors[1] == pytest.approx(0.5, abs=0.1)


def test_the_law_holds_for_a_conservative_impact_that_changes_the_speed_between_unequal_masses():
    numbers = {"C": 0.0, "m": 0.8, "V": -0.8, "H": 0.1, "W": 0.3}
    errors = [
        worst_relative_error(
            numbers, v0, 10.0, lower_factor=1 / math.sqrt(1.8), impact=EnergyRestitution(1.0)
        )
        for v0 in (1e-3, 5e-4)
    ]
    assert errors[0] < 2e-2
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.1)


def test_the_averaged_speed_follows_the_closed_form_of_symmetric_layers():
    t, C, V, H, W = 17.0, 0.1, -0.5, 0.07, 0.21
    A, b = abs(V) * math.cos(BETA80), math.sin(BETA80)
    h0, h = 0.2 * H * b, H * math.sin(W * t + math.asin(0.2)) * b
    speed = averaged_speed(forced(C=C, V=V, H=H, W=W, phase=math.asin(0.2)), 8e-6, t)
    expected = 8e-6 * ((A**2 - h**2) / (A**2 - h0**2)) ** (1 / 3) * math.exp(-C * t / 3)
    assert speed == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("duration", [0.3, 4.0, 23.0])
def test_the_averaged_speed_follows_the_law_for_unequal_layers(duration):
    assert averaged_speed(forced(**UNEQUAL), -9e-6, duration) == pytest.approx(
        law(UNEQUAL, 9e-6, duration), rel=1e-9
    )


@pytest.mark.parametrize("start", [-1, 1])
def test_the_averaged_speed_follows_the_law_where_the_impact_changes_the_speed(start):
    numbers, factor = (
        {"C": 0.15, "m": 0.8, "c": 0.6, "V": -0.8, "H": 0.1, "W": 0.3},
        {-1: 1.0, 1: 1 / math.sqrt(1.8)}[start],
    )
    system = forced(**numbers, impact=EnergyRestitution(1.0))
    expected = law(numbers, 5e-6 / factor, 9.0, lower_factor=1 / math.sqrt(1.8)) * factor
    assert averaged_speed(system, start * 5e-6, 9.0) == pytest.approx(expected, rel=1e-9)


def test_without_damping_and_under_constant_loads_the_speed_stays():
    assert averaged_speed(forced(H=0.0, C=0.0, V=-0.5), 3e-6, 40.0) == pytest.approx(
        3e-6, rel=1e-13
    )


def test_resolved_impacts_decay_into_chatter_once_they_are_too_small():
    motion = simulate(forced(H=0.0, C=1.0, V=-1.5), theta=0.0, velocity=2e-4, duration=15.0)
    (event,) = [e for e in motion.events if e.kind is EventKind.CHATTER]
    assert not motion.phase_known
    slow = CHATTER_SPEED * 1.5 * math.cos(BETA80)  # the pull for the time 1 / Omega = 1
    assert abs(event.velocity_after) == pytest.approx(slow, rel=1e-2)
    # exp(-C t / 3), and v^2 is small
    assert event.time == pytest.approx(3 * math.log(2e-4 / slow), rel=1e-2)
    assert (motion.theta, motion.velocity, motion.side) == (0.0, 0.0, 0)
    assert motion.rest_time is None


def test_chatter_is_released_when_the_load_says_and_its_phase_is_said_to_be_lost():
    H, W = 0.2, 0.5
    motion = simulate(forced(H=H, W=W), theta=0.0, velocity=5e-6, duration=4.0)
    released = math.asin(0.5 * math.cos(BETA80) / (H * math.sin(BETA80))) / W
    kinds = [e.kind for e in motion.events]
    assert kinds[:2] == [EventKind.CHATTER, EventKind.RELEASE]
    assert motion.events[1].time == pytest.approx(released, abs=1e-13)
    assert not motion.phase_known
    assert motion.theta > 0


def test_chatter_never_starts_where_an_impact_loses_speed():
    motion = simulate(forced(H=0.0, e=0.999, C=0.5), theta=0.0, velocity=1e-4, duration=30.0)
    assert motion.phase_known
    assert motion.rest_time is not None


@pytest.mark.parametrize("C", [0.0, 0.2])
def test_on_a_wall_the_action_is_the_cube_of_the_speed_over_the_pull(C):
    """One side only: v^3 / abs(a) decays at the rate C, whether averaged or resolved."""
    W, load = 0.3, Harmonic(amplitude=0.4, mean=1.0)
    wall = System(
        model=WallOscillator(stiffness=0.0, damping=C, wall=0.7), load=Load(frequency=W, force=load)
    )

    def expected(v0, t):
        return v0 * ((1.0 + 0.4 * np.sin(W * t)) * np.exp(-C * t)) ** (1 / 3)

    assert averaged_speed(wall, -7e-6, 11.0, contact=0.7) == pytest.approx(
        expected(7e-6, 11.0), rel=1e-11
    )
    errors = []
    for v0 in (2e-3, 1e-3):
        crossings = simulate(wall, x=0.7, velocity=-v0, duration=8.0, tol=1e-15).impacts
        errors.append(np.abs(crossings.velocity_before / expected(v0, crossings.time) - 1).max())
        assert len(crossings) > 1000
    assert errors[0] < 1e-2
    # every flight starts alike: no term of order v
    assert errors[1] / errors[0] == pytest.approx(0.25, abs=0.03)


def test_chatter_does_not_begin_where_the_contact_hardly_holds_and_ends_where_its_speed_has_grown():
    """The averaged law needs contact accelerations that change slowly over two impacts; near a
    release they do not.
    """
    beta0 = math.radians(80)
    loose = 0.5 / math.tan(beta0) * (1 - 1e-7)  # H just below Hcr, and falling
    system = forced(C=0.0, V=-0.5, H=loose, W=0.5, phase=math.pi / 2)
    resolved = simulate(system, theta=0.0, velocity=1.01e-5, duration=5.0)
    below = simulate(system, theta=0.0, velocity=9.9e-6, duration=5.0)
    assert resolved.phase_known
    assert below.phase_known
    speeds = [np.abs(m.impacts.velocity_after[-10:]).max() for m in (below, resolved)]
    assert speeds[0] == pytest.approx(speeds[1] * 9.9 / 10.1, rel=0.2)
    growing = forced(C=0.0, V=-0.5, H=0.98 * loose, W=0.05, phase=math.pi / 2)
    pull = 0.5 * math.cos(beta0) + 0.98 * loose * math.sin(beta0)
    slow = CHATTER_SPEED * pull / 0.05
    motion = simulate(growing, theta=0.0, velocity=0.99 * slow, duration=30.0)
    assert [e.kind for e in motion.events][:2] == [EventKind.CHATTER, EventKind.IMPACT]
    assert not motion.phase_known
    assert motion.chatter_speed is None
    grown = abs(motion.impacts.velocity_before[0])
    assert 2.0 * slow < grown < 4.0 * slow  # noticed at the end of a step
