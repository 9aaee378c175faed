"""Capture at rest: what is proved holds on the exact flow, reaches the barriers that closed forms
give, and is not empty.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from shared_systems import BETA80, forced
from xarray import DataArray

from saltus import InelasticImpact, TwoLayer
from saltus.bounds import capture as module
from saltus.bounds.capture import capture_speed
from saltus.errors import ParameterError
from saltus.flow import EventKind, simulate
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    ImpactLaw,
    Load,
    Metainterface,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)
from saltus.theory import Stability, equilibria

BASE = forced(C=0.1, V=-0.5, H=0.02, W=1.0)
LIFT = 0.5 / math.tan(BETA80)  # Hcr of BASE


# --- barriers under constant loads -------------------------------------------


def barrier_speeds(system):
    """By side: the speed at theta = 0 that reaches the nearest unstable equilibrium without
    damping.
    """
    unstable = [e for e in equilibria(system) if e.stability is Stability.UNSTABLE]
    lower = min((e for e in unstable if e.theta > 0), key=lambda e: e.theta)
    upper = max((e for e in unstable if e.theta < 0), key=lambda e: e.theta)
    return math.sqrt(2 * lower.energy / (1 + system.model.mass_ratio)), math.sqrt(2 * upper.energy)


def constant(C=0.1, e=1.0, H=0.0, **unequal):
    model = Metainterface(beta0=BETA80, damping=C, **unequal)
    return System(model=model, load=Load(horizontal=H, vertical=-1.5), impact=VelocityReduction(e))


@pytest.mark.parametrize("e", [1.0, 0.8])
@pytest.mark.parametrize(
    "numbers", [{}, {"H": 0.03}, {"H": -0.02, "mass_ratio": 0.1, "stiffness_ratio": 1.05}]
)
def test_under_constant_loads_the_whole_basin_below_the_barrier_is_captured(numbers, e):
    system = constant(e=e, **numbers)
    speed = float(capture_speed(system))
    assert 0.93 < speed / min(barrier_speeds(system)) <= 1
    harmonic = Harmonic(amplitude=0.0, mean=numbers.get("H", 0.0))
    assert (
        float(
            capture_speed(
                system.with_({"load": Load(frequency=1.0, horizontal=harmonic, vertical=-1.5)})
            )
        )
        == speed
    )


def test_just_above_the_barrier_a_motion_leaves_and_just_below_it_does_not():
    system = constant(C=1e-4)
    barrier, speed = min(barrier_speeds(system)), float(capture_speed(system))
    times = np.linspace(0, 60, 400)
    turning = max(e.theta for e in equilibria(system) if e.stability is Stability.UNSTABLE)
    assert (
        np.abs(
            simulate(system, theta=0.0, velocity=1.01 * barrier, duration=60.0).at(times)[0]
        ).max()
        > 1.1 * turning
    )
    below = simulate(system, theta=0.0, velocity=speed, duration=60.0)
    assert np.abs(below.at(times)[0]).max() < turning
    assert np.abs(below.impacts.velocity_after).max() <= speed


def test_a_rocking_block_is_captured_below_the_speed_that_overturns_it():
    """theta'' = -sin(alpha - theta): the barrier at theta = alpha is 1 - cos(alpha) high."""
    alpha = 0.3
    for impact in (InelasticImpact(), VelocityReduction(0.9)):
        speed = float(capture_speed(System(model=RockingBlock(alpha=alpha), impact=impact)))
        expected = math.sqrt(2 * (1 - math.cos(alpha)))
        assert 0.93 * expected < speed <= expected


def test_a_ball_on_a_table_is_captured_from_any_speed_that_was_looked_at():
    table = System(
        model=WallOscillator(stiffness=0.0, wall=0.0),
        load=Load(force=1.0),
        impact=VelocityReduction(0.9),
    )
    assert float(capture_speed(table)) > 3.0


# --- the exact flow ----------------------------------------------------------


def random_cases(rng, n, factors, most=0.95):
    """Parameters of metainterfaces that are held at rest through the whole period, with unequal
    layers and a second harmonic.
    """
    V, beta0, phase = -rng.uniform(0.2, 2.0, n), rng.uniform(1.0, 1.5, n), rng.uniform(0, 6, n)
    amplitude = -V / np.tan(beta0) * rng.uniform(0, most, n)
    return {
        "load.vertical": V,
        "model.beta0": beta0,
        "load.horizontal.amplitude": 0.8 * amplitude,
        "load.horizontal.mean": 0.2 * amplitude,
        "load.horizontal.phase": phase,
        "load.frequency": rng.uniform(0.2, 3.0, n),
        "model.damping": rng.uniform(0.02, 0.3, n),
        "model.mass_ratio": rng.choice([0.0, 0.4], n),
        "model.dissipation_ratio": rng.uniform(0.5, 2.0, n),
        "model.stiffness_ratio": rng.uniform(0.5, 2.0, n),
        "impact.e": rng.choice(factors, n),
    }


def one(parameters, i):
    return BASE.with_({path: float(values[i]) for path, values in parameters.items()})


@pytest.mark.thorough
def test_motions_that_lose_speed_at_impacts_come_to_rest_from_below_the_threshold_and_stay():
    """500 random systems, each from a random side and phase; slow flights take many periods, so
    their time is scaled.
    """
    rng = np.random.default_rng(21)
    cases = random_cases(rng, 500, (0.3, 0.6, 0.8, 0.9))
    speeds = capture_speed(BASE, cases)
    assert (speeds > 0).all()
    for i, speed in enumerate(speeds):
        system = one(cases, i)
        start = {
            "theta": 0.0,
            "velocity": float(rng.choice([-1, 1]) * speed),
            "time": float(rng.uniform(0, 40)),
        }
        motion = simulate(
            system,
            duration=60.0 + 40.0 * speed / (1 - system.impact.e),
            tol=1e-9,
            dense=False,
            **start,
        )
        assert motion.rest_time is not None, system
        assert all(e.kind in (EventKind.IMPACT, EventKind.REST) for e in motion.events), system


def action(system, crossings):
    """v^3 sum 1/abs(a_s) just after every impact, from the contact accelerations of the model."""
    pulls = []
    for s in (1, -1):
        pulls.append(-s * system.model.acceleration(crossings.time, 0.0, 0.0, s, system.load))
    return np.abs(crossings.velocity_after) ** 3 * (1 / pulls[0] + 1 / pulls[1])


def test_without_loss_at_impacts_the_action_of_captured_motions_falls_from_period_to_period():
    rng = np.random.default_rng(22)
    cases = random_cases(rng, 120, (1.0,), most=0.7)
    speeds, tested = capture_speed(BASE, cases), 0
    assert (speeds > 0).all()
    for i in np.flatnonzero(speeds > 1e-3):
        system = one(cases, i)
        periods, start = 3, float(rng.uniform(0, 10))
        length = system.load.period
        motion = simulate(
            system,
            theta=0.0,
            velocity=float(speeds[i]),
            time=start,
            duration=periods * length,
            tol=1e-10,
            dense=False,
        )
        time, J = motion.impacts.time, action(system, motion.impacts)
        assert all(e.kind in (EventKind.IMPACT, EventKind.CHATTER) for e in motion.events)
        if len(time) < 30 or EventKind.CHATTER in [e.kind for e in motion.events]:
            continue
        means = [
            np.log(J[(time >= start + k * length) & (time < start + (k + 1) * length)]).mean()
            for k in range(periods)
        ]
        assert means[0] > means[1] > means[2], system
        tested += 1
    assert tested > 50


def leaves(system, speed, phases=12, duration=80.0):
    """Whether some motion that starts at contact with that speed is as fast or faster at the end,
    or away.
    """
    for time in np.linspace(0, system.load.period, phases, endpoint=False):
        for side in (1, -1):
            start = {"theta": 0.0, "velocity": side * speed, "time": float(time)}
            crossings = simulate(system, duration=duration, tol=1e-8, dense=False, **start).impacts
            if len(crossings) == 0 or np.abs(crossings.velocity_after[-10:]).max() >= speed:
                return True
    return False


@pytest.mark.parametrize(
    ("H", "V", "e", "factor"), [(0.05, -1.5, 1.0, 5), (0.15, -1.5, 1.0, 25), (0.2, -1.8, 0.8, 20)]
)
def test_the_threshold_is_within_a_factor_of_where_motions_do_leave(H, V, e, factor):
    system = forced(H=H, V=V, e=e)
    speed = float(capture_speed(system))
    assert not leaves(system, speed)
    assert leaves(system, factor * speed)


# --- where nothing can be proved, and other loads and laws -------------------


@pytest.mark.parametrize(
    "system",
    [
        forced(H=1.01 * LIFT, e=0.5),  # lifts the system off once a period
        forced(H=0.0, V=0.5, e=0.5),  # pushes both layers open
        forced(H=0.0, C=0.0),  # nothing takes energy
        forced(C=0.0, H=0.02),
        forced(mean=0.05, H=0.04, e=0.3),
        System(model=TwoLayer(beta0=1.3), load=Load(vertical=-0.5)),  # two contacts
        System(
            model=Metainterface(beta0=1.3),
            load=Load(frequency=1.0, vertical=-0.5, ground_horizontal=Harmonic(0.01)),
            impact=EnergyRestitution(0.8),  # slow impacts have no solution on a moving ground
        ),
    ],
)
def test_nothing_is_claimed_where_nothing_holds(system):
    assert float(capture_speed(system)) == 0.0


def test_typical_systems_are_captured_from_speeds_worth_having():
    H = np.array([0.0, 0.2, 0.4, 0.6, 0.8]) * LIFT
    lossy = capture_speed(BASE, {"load.horizontal.amplitude": H, "impact.e": 0.8})
    lossless = capture_speed(BASE, {"load.horizontal.amplitude": H})
    assert (lossy > [1.0, 2e-2, 1e-2, 4e-3, 1e-3]).all()
    assert (lossless > [1.0, 1e-2, 5e-3, 2e-3, 5e-4]).all()


@pytest.mark.parametrize("e", [1.0, 0.8])
def test_what_is_proved_between_two_loads_holds_under_those_between(e):
    """Along ways through the plane of amplitude and mean load: nearly the speeds of their ends, and
    motions never leave again.
    """
    rng, n, system = np.random.default_rng(3), 200, BASE.with_({"impact.e": e})
    start = {
        "load.horizontal.amplitude": rng.uniform(0.0, 1.2, n) * LIFT,
        "load.vertical": rng.uniform(-1.0, -0.4, n),
    }
    end = {path: values + rng.uniform(-0.005, 0.005, n) for path, values in start.items()}
    speeds = module.proved_speeds(system, start, end)
    ends = np.array([module.proved_speeds(system, columns) for columns in (start, end)])
    assert (speeds[(ends > 0).all(axis=0)] > 0.0).mean() > 0.9
    assert (speeds[(ends == 0).any(axis=0)] == 0.0).all()
    share = rng.uniform(0.0, 1.0, n)
    between = {path: values + share * (end[path] - values) for path, values in start.items()}
    for i in rng.choice(np.flatnonzero(speeds > 0), 12, replace=False):
        here = system.with_({path: float(values[i]) for path, values in between.items()})
        motion = simulate(
            here, theta=0.0, velocity=-0.999 * speeds[i], time=rng.uniform(0.0, 7.0), duration=60.0
        )
        assert EventKind.RELEASE not in [event.kind for event in motion.events]
        assert abs(motion.impacts.velocity_before[-1]) < speeds[i] * (1.0 if e == 1.0 else 1e-3)


def test_nothing_is_proved_between_two_records():
    time = np.linspace(0.0, 30.0, 61)
    load = Load(horizontal=Record(time, 0.02 * np.sin(1.7 * time), "force"), vertical=-0.5)
    system = System(
        model=Metainterface(beta0=BETA80, damping=0.1), load=load, impact=VelocityReduction(0.5)
    )
    scales = {"load.horizontal.scale": np.array([0.5, 1.0])}
    assert (module.proved_speeds(system, scales) > 0.0).all()
    assert (module.proved_speeds(system, scales, scales) == 0.0).all()


def test_a_record_that_presses_enough_is_captured_and_one_that_lifts_is_not():
    time = np.linspace(0.0, 30.0, 61)
    record = Record(time, 0.02 * np.sin(1.7 * time), "force")
    system = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=Load(horizontal=record, vertical=-0.5),
        impact=VelocityReduction(0.5),
    )
    speed = float(capture_speed(system))
    assert speed > 0.1
    for start in (0.0, 3.3, 20.0):
        motion = simulate(system, theta=0.0, velocity=-speed, time=start, duration=60.0)
        assert motion.rest_time is not None
        assert EventKind.RELEASE not in [e.kind for e in motion.events]
    scales = capture_speed(system, {"load.horizontal.scale": np.array([0.5, 1.0, 4.0, 5.0])})
    assert scales[0] > scales[1] == speed > scales[2]
    assert scales[3] == 0.0
    assert float(capture_speed(system.with_({"impact.e": 1.0}))) == 0.0


def test_a_ground_that_shakes_a_block_and_a_driven_wall_are_captured():
    block = System(
        model=RockingBlock(alpha=0.3),
        load=Load(frequency=2.0, ground_horizontal=Harmonic(0.02)),
        impact=VelocityReduction(0.85),
    )
    wall = System(
        model=WallOscillator(stiffness=0.4, damping=0.05, wall=-0.5),
        load=Load(frequency=1.4, force=Harmonic(0.15, phase=0.4)),
        impact=VelocityReduction(1.0),
    )
    speed = float(capture_speed(block))
    assert speed > 5e-3
    for time in np.linspace(0, np.pi, 6):
        assert (
            simulate(block, theta=0.0, velocity=speed, time=float(time), duration=30.0).rest_time
            is not None
        )
    speed = float(capture_speed(wall))
    assert speed > 5e-4
    crossings = simulate(wall, x=-0.5, velocity=-speed, duration=100.0, dense=False).impacts
    last = np.abs(crossings.velocity_after[crossings.time > 100 - wall.load.period])
    assert last.max() < 0.7 * speed


@dataclass(frozen=True)
class Softening(ImpactLaw):
    """v+ = v- / (1 + loss v-^2): no loss in the limit of slow impacts; with a negative loss fast
    impacts gain.
    """

    loss: float

    def velocity_after(self, model, t, velocity, side, next_side, load):
        return velocity / (1 + self.loss * velocity * velocity)


def test_a_law_that_depends_on_the_speed_is_bounded_over_the_speeds_that_it_meets():
    lossy, gaining = (BASE.with_({"impact": Softening(loss)}) for loss in (2.0, -2.0))
    assert 1e-3 < float(capture_speed(lossy)) <= float(capture_speed(BASE))
    assert float(capture_speed(gaining)) == 0.0


# --- the interface -----------------------------------------------------------


def test_many_parameter_sets_at_once_are_each_as_alone(monkeypatch):
    cases = random_cases(np.random.default_rng(23), 12, (1.0, 0.9, 0.5))
    together = capture_speed(BASE, cases)
    alone = [float(capture_speed(one(cases, i))) for i in range(12)]
    assert together == pytest.approx(alone, rel=1e-12)
    monkeypatch.setattr(module, "CAPTURE", replace(module.CAPTURE, batch=5))
    assert capture_speed(BASE, cases) == pytest.approx(together, rel=1e-12)


def test_parameters_broadcast_by_shape_or_by_name():
    damping, amplitude = np.array([0.05, 0.1]), np.array([0.0, 0.01, 0.02])
    speeds = capture_speed(
        BASE, {"model.damping": damping[:, None], "load.horizontal.amplitude": amplitude}
    )
    assert speeds.shape == (2, 3)
    assert capture_speed(BASE).shape == ()
    named = {
        "model.damping": DataArray(damping, dims="C"),
        "load.horizontal.amplitude": DataArray(amplitude, dims="H"),
    }
    np.testing.assert_array_equal(capture_speed(BASE, named).transpose("C", "H"), speeds)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"model.dampin": 0.1}, r"no parameter 'model.dampin'; did you mean 'model.damping'"),
        ({"load.horizontal.order": np.array([1.0, 1.5])}, r"load.horizontal.order must be whole"),
        ({"model.beta0": 80.0}, r"got 80.0 \(degrees\?\)"),
        ({"impact.e": np.array([0.5, np.nan])}, "impact.e must be finite"),
        ({"impact.e": "high"}, "impact.e must be a number"),
        (
            {"impact.e": np.ones(2), "model.damping": np.ones(3)},
            r"impact.e \(2,\), model.damping \(3,\)",
        ),
        (0, "parameters must be arrays by dotted path"),
        ([0.1], "parameters must be arrays by dotted path"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(parameters, message):
    with pytest.raises(ParameterError, match=message):
        capture_speed(BASE, parameters)
    with pytest.raises(ParameterError, match="takes a System"):
        capture_speed(BASE.model)
