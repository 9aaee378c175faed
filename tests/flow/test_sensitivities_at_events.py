"""Derivatives through rest, release, margins and records; and where there are none, the result says
why.
"""

import importlib.util
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from flow_references import SHARED_PATHS
from shared_systems import BETA80, forced

import saltus
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Model,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)

pytestmark = pytest.mark.thorough  # many structures of their own

WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # central differences of order 8


def difference(value, step=1e-3):
    """Of order 8, of a function of the change."""
    return sum(w * (value(n * step) - value(-n * step)) for n, w in WEIGHTS.items()) / step


def changed(system, path, by):
    return system.with_({path: system.get(path) + by})


def event_times(motion):
    return np.array([event.time for event in motion.events])


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_a_ball_s_rest_moves_as_its_geometric_series_says(e):
    """It rests at t = f (1 + 2 e / (1 - e)), f = sqrt(2 (d - x) / F) the fall: dt/dx = -t / (2 (d -
    x)), dt/dF = -t / (2 F).
    """
    drop, force = 0.4, 0.7
    ball = System(
        model=WallOscillator(stiffness=0.0, wall=1.0),
        load=Load(force=force),
        impact=VelocityReduction(e),
    )
    paths = ("load.force", "model.wall", *(["impact.e"] if e else []))
    result = saltus.sensitivities(ball, x=1.0 - drop, duration=30.0, parameters=paths)
    fall = math.sqrt(2 * drop / force)
    end = fall * (1 + 2 * e / (1 - e))
    assert result.motion.rest_time == pytest.approx(end, rel=1e-14)
    rest = result.event_times[-1]
    # A speed at the start brings the first impact forward, and changes its speed in second order
    # only.
    expected = [
        -end / (2 * drop),
        -1 / force,
        -end / (2 * force),
        end / (2 * drop),
        2 * fall / (1 - e) ** 2,
    ]
    at_wall = [j for j, path in enumerate(("", "", *paths)) if path == "model.wall"]
    # from dx = 1, rounded, over speeds down to 1e-6
    np.testing.assert_allclose(rest[at_wall], end / (2 * drop), rtol=1e-8)
    others = np.delete(np.arange(len(rest)), at_wall)
    np.testing.assert_allclose(rest[others], np.array(expected)[others], rtol=1e-11)
    np.testing.assert_array_equal(result.state, 0.0)
    np.testing.assert_array_equal(
        result.parameters, [[0.0, 1.0, *([0.0] if e else [])], [0.0] * len(paths)]
    )
    assert result.determinant == 0.0


@pytest.mark.parametrize("impact", [VelocityReduction(0.6), EnergyRestitution(0.5)])
def test_the_end_of_an_accumulation_on_unequal_layers_moves_as_its_differences_do(impact):
    system = forced(H=0.0, m=0.5, k=1.2, c=0.8, impact=impact, C=0.2)
    law = "impact.e" if isinstance(impact, VelocityReduction) else "impact.r"
    paths = ("load.vertical", "model.beta0", "model.mass_ratio", law)
    result = saltus.sensitivities(system, theta=0.3, velocity=0.1, duration=40.0, parameters=paths)
    rest = result.event_times[-1]

    def rest_time(system=system, theta=0.3, velocity=0.1):
        return saltus.simulate(
            system, theta=theta, velocity=velocity, duration=40.0, tol=1e-15
        ).rest_time

    expected = [
        difference(lambda d: rest_time(theta=0.3 + d)),
        difference(lambda d: rest_time(velocity=0.1 + d)),
        *(difference(lambda d, p=path: rest_time(changed(system, p, d))) for path in paths),
    ]
    np.testing.assert_allclose(rest, expected, rtol=2e-9)


def test_a_release_moves_with_the_load_that_holds_it():
    """Rest ends where H sin(W t) = abs(V) / tan(beta0); what came before the rest does not
    matter.
    """
    H, W, V = 0.25, 0.05, -0.5
    system = forced(e=0.3, H=H, W=W, C=0.3, V=V)
    result = saltus.sensitivities(system, theta=0.05, duration=20.0, parameters=SHARED_PATHS)
    kinds = [event.kind for event in result.motion.events]
    release = kinds.index("release")
    level = -V / math.tan(BETA80)
    time = math.asin(level / H) / W
    assert result.motion.events[release].time == pytest.approx(time, rel=1e-13)
    by_level = 1 / (W * math.sqrt(H**2 - level**2))
    by_angle = V / math.sin(BETA80) ** 2 * by_level
    expected = [
        0,
        0,
        -level / H * by_level,
        -1 / W,
        -time / W,
        -by_level / math.tan(BETA80),
        by_angle,
        0,
    ]
    np.testing.assert_allclose(result.event_times[release], expected, rtol=1e-11, atol=1e-12)
    np.testing.assert_array_equal(result.state, 0.0)
    assert result.determinant == 0.0

    def end(system):
        motion = saltus.simulate(system, theta=0.05, duration=20.0, tol=1e-15)
        return np.array([motion.theta, motion.velocity])

    for j, path in enumerate(SHARED_PATHS):
        step = 1e-4 if path == "load.frequency" else 1e-3
        np.testing.assert_allclose(
            result.parameters[:, j],
            difference(lambda d, p=path: end(changed(system, p, d)), step),
            rtol=1e-8,
            atol=1e-9,
        )


def test_a_release_by_a_jump_of_the_load_has_its_time():
    """Where a record rises to the level that lifts it off, its scale moves the release; where it
    jumps there, it does not.
    """
    record = Record([0.0, 2.0, 4.0], [0.0, 0.4, 0.4], quantity="force")
    system = System(
        model=Metainterface(beta0=BETA80, damping=0.1),
        load=Load(horizontal=record, vertical=-0.5),
        impact=VelocityReduction(0.5),
    )
    result = saltus.sensitivities(
        system, theta=0.0, duration=3.5, parameters=("load.horizontal.scale", "load.vertical")
    )
    times = event_times(result.motion)
    level = 0.5 / math.tan(BETA80)  # 0.2 t = level
    assert times[1] == pytest.approx(level / 0.2, rel=1e-13)
    np.testing.assert_allclose(
        result.event_times[1], [0, 0, -level / 0.2, -1 / math.tan(BETA80) / 0.2], rtol=1e-11
    )
    late = System(
        model=system.model,
        load=Load(
            horizontal=Record([1.0, 2.0, 4.0], [0.4, 0.4, 0.4], quantity="force"), vertical=-0.5
        ),
        impact=system.impact,
    )
    jumped = saltus.sensitivities(
        late, theta=0.0, duration=3.5, parameters=("load.horizontal.scale", "load.vertical")
    )
    assert event_times(jumped.motion)[1] == 1.0
    np.testing.assert_array_equal(jumped.event_times[1], 0.0)


GROUND_PATHS = ("load.ground_horizontal.scale", "model.mass_ratio", "impact.r")


def test_records_of_the_ground_in_an_energy_law_and_in_a_release():
    """R(v-, t) reads the ground's velocity, the release its acceleration: their time derivatives
    are the next rows.
    """
    time = np.linspace(0.0, 12.0, 61)
    ground = Record(
        time, 0.3 * np.sin(1.1 * time) * (1 - np.cos(0.5 * time)), quantity="acceleration"
    )
    model = Metainterface(beta0=BETA80, damping=0.1, mass_ratio=0.3)
    system = System(
        model=model,
        load=Load(ground_horizontal=ground, vertical=-0.5),
        impact=EnergyRestitution(0.8),
    )
    result = saltus.sensitivities(
        system, theta=0.6, velocity=0.1, duration=9.0, parameters=GROUND_PATHS, tol=1e-14
    )
    assert len(result.motion.impacts) >= 2

    def values(system=system, theta=0.6):
        motion = saltus.simulate(system, theta=theta, velocity=0.1, duration=9.0, tol=1e-15)
        return np.array([motion.theta, motion.velocity, *event_times(motion)])

    expected = [difference(lambda d: values(theta=0.6 + d))]
    expected += [
        difference(lambda d, p=path: values(changed(system, p, d))) for path in GROUND_PATHS
    ]
    computed = np.vstack([np.hstack([result.state, result.parameters]), result.event_times])[
        :, [0, 2, 3, 4]
    ]
    np.testing.assert_allclose(computed.T, expected, rtol=1e-8, atol=1e-8)


def test_a_release_under_a_record_of_acceleration_reads_the_record_s_slope():
    """The lower side lifts off where 0.1 t scale = abs(V) / (tan(beta0) (1 + m)), whatever impacts
    do.
    """
    ground = Record([0.0, 5.0, 6.0], [0.0, -0.5, 0.0], quantity="acceleration")
    system = System(
        model=Metainterface(beta0=BETA80),
        load=Load(ground_horizontal=ground, vertical=-0.5),
        impact=EnergyRestitution(0.25),
    )
    result = saltus.sensitivities(system, theta=0.0, duration=2.0, parameters=GROUND_PATHS)
    time = 0.5 / math.tan(BETA80) / 0.1
    assert event_times(result.motion)[1] == pytest.approx(time, rel=1e-13)
    np.testing.assert_allclose(result.event_times[1], [0, 0, -time, -time, 0], rtol=1e-11)


def test_a_margin_stops_the_motion_where_it_is_and_moves_with_everything():
    block = System(
        model=RockingBlock(alpha=0.3), load=Load(frequency=2.0, ground_horizontal=Harmonic(0.3))
    )
    paths = ("load.ground_horizontal.amplitude", "load.frequency", "model.alpha")
    result = saltus.sensitivities(
        block, theta=0.28, velocity=0.2, periods=40, parameters=paths, tol=1e-14
    )
    assert result.motion.stop == "limit"
    # it stops at pi / 2, wherever it started
    assert np.abs(np.hstack([result.state[0], result.parameters[0]])).max() < 1e-12

    def end(system=block, velocity=0.2):
        motion = saltus.simulate(system, theta=0.28, velocity=velocity, periods=40, tol=1e-15)
        return np.array([motion.velocity, motion.time])

    expected = [
        difference(lambda d: end(velocity=0.2 + d)),
        *(difference(lambda d, p=p: end(changed(block, p, d))) for p in paths),
    ]
    computed = [np.hstack([result.state[1], result.parameters[1]])[1:], result.event_times[-1][1:]]
    np.testing.assert_allclose(np.transpose(computed), expected, rtol=1e-9)


def test_a_margin_of_the_acceleration_moves_too():
    system = forced(H=0.5)
    result = saltus.sensitivities(
        system, theta=0.3, periods=9, stop_at="reaction", parameters=("load.vertical",), tol=1e-14
    )
    assert result.motion.limit == "reaction"

    def end(system=system, theta=0.3):
        return saltus.simulate(system, theta=theta, periods=9, stop_at="reaction", tol=1e-15).time

    expected = [
        difference(lambda d: end(theta=0.3 + d)),
        difference(lambda d: end(changed(system, "load.vertical", d))),
    ]
    np.testing.assert_allclose(result.event_times[-1][[0, 2]], expected, rtol=1e-8)


def duffing():
    """The class of examples/duffing.py."""
    path = Path(__file__).parents[2] / "examples" / "duffing.py"
    spec = importlib.util.spec_from_file_location("duffing_example", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Duffing


def test_a_model_of_one_s_own_has_sensitivities_unasked():
    system = System(
        model=duffing()(damping=0.1, cubic=0.7),
        load=Load(frequency=1.2, force=Harmonic(0.4)),
        impact=VelocityReduction(),
    )
    paths = ("model.damping", "model.cubic", "load.force.amplitude", "load.frequency")
    result = saltus.sensitivities(system, x=1.0, periods=4, parameters=paths, tol=1e-14)
    assert result.determinant == pytest.approx(math.exp(-0.1 * result.motion.time), abs=1e-12)

    def end(system=system, x=1.0):
        motion = saltus.simulate(system, x=x, periods=4, tol=1e-15)
        return np.array([motion.x, motion.velocity])

    np.testing.assert_allclose(result.state[:, 0], difference(lambda d: end(x=1.0 + d)), rtol=1e-9)
    expected = np.transpose(
        [difference(lambda d, p=path: end(changed(system, p, d))) for path in paths]
    )
    np.testing.assert_allclose(result.parameters, expected, rtol=1e-9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Power(Model):
    """x'' = -x^n for x > 0, n a parameter."""

    exponent: float = 2.5
    coordinates = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return -((2.0 + x) ** self.exponent)


def test_an_exponent_is_a_parameter_like_another():
    def end(exponent):
        motion = saltus.simulate(
            System(model=Power(exponent=exponent)), x=0.5, duration=0.6, tol=1e-15
        )
        return np.array([motion.x, motion.velocity])

    result = saltus.sensitivities(
        System(model=Power()), x=0.5, duration=0.6, parameters=("model.exponent",)
    )
    np.testing.assert_allclose(
        result.parameters[:, 0], difference(lambda d: end(2.5 + d)), rtol=1e-9
    )


def test_chatter_takes_the_derivative_and_says_so():
    result = saltus.sensitivities(
        forced(H=0.0, C=1.0, V=-1.5),
        theta=0.0,
        velocity=2e-4,
        duration=15.0,
        parameters=SHARED_PATHS,
    )
    assert not result.motion.phase_known
    assert "phase is lost" in result.undefined
    assert np.isnan(result.state).all()
    assert np.isnan(result.parameters).all()
    assert math.isnan(result.determinant)
    last = len(result.motion.impacts) - 1
    assert np.isfinite(result.event_times[: last + 1]).all()  # of the impacts before
    assert np.isnan(result.event_times[last + 1]).all()


def test_rest_without_loss_has_no_derivative_to_the_state_but_to_the_loads():
    """Beside the state at rest every motion chatters for ever; at rest the loads alone say when it
    is released.
    """
    H, W = 0.2, 0.5
    system = forced(H=H, W=W)
    result = saltus.sensitivities(system, theta=0.0, duration=4.0, parameters=SHARED_PATHS)
    assert "impacts lose nothing" in result.undefined
    assert np.isnan(result.state).all()

    def end(H):
        motion = saltus.simulate(forced(H=H, W=W), theta=0.0, duration=4.0, tol=1e-15)
        return np.array([motion.theta, motion.velocity])

    np.testing.assert_allclose(result.parameters[:, 0], difference(lambda d: end(H + d)), rtol=1e-8)
    assert np.isnan(result.event_times[1, :2]).all()
    level = 0.5 / math.tan(BETA80)
    assert result.event_times[1, 2] == pytest.approx(
        -level / H / (W * math.sqrt(H**2 - level**2)), rel=1e-11
    )


@pytest.mark.parametrize("wall", [1.0, 1.0 + 1e-14])
def test_a_grazing_is_reported_and_leaves_no_nan(wall):
    """x = -cos t touches the wall at pi; on this side of the touch nothing happens to the
    derivative.
    """
    load = Load(frequency=1.0, force=Harmonic(amplitude=1.0, phase=math.pi / 2))
    system = System(
        model=WallOscillator(stiffness=0.0, wall=wall), load=load, impact=VelocityReduction(0.8)
    )
    result = saltus.sensitivities(
        system, x=-1.0, duration=5.0, parameters=("model.wall",), tol=1e-15
    )
    touches = [*result.grazings, *result.motion.impacts.time]
    for touch in touches:
        assert touch == pytest.approx(math.pi, abs=1e-6)
    assert len(touches) > 0 or wall > 1.0
    assert result.undefined is not None or np.isfinite(result.state).all()
    if not len(result.motion.impacts):
        np.testing.assert_allclose(result.state, [[1.0, 5.0], [0.0, 1.0]], rtol=1e-13)
        np.testing.assert_array_equal(result.parameters, 0.0)


def test_derivatives_beyond_the_range_of_numbers_are_said_to_be():
    @dataclass(frozen=True, slots=True, kw_only=True)
    class Unstable(Model):
        """x'' = x at rest at 0."""

        rate: float = 1.0
        coordinates = ("x",)

        def acceleration(self, t, x, velocity, side, load):
            return self.rate * x

    result = saltus.sensitivities(System(model=Unstable()), x=0.0, duration=800.0)
    assert (result.motion.x, result.motion.velocity) == (0.0, 0.0)
    assert "range of numbers" in result.undefined


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (("load.freqency",), "did you mean 'load.frequency'"),
        (
            ("load.horizontal",),
            "load.horizontal is not a number.*amplitude|load.horizontal is not a number.*mean",
        ),
        (("load.horizontal.order",), "whole number"),
        (("model.smoothing",), "not a number"),
        (("model.beta0", "model.beta0"), "once"),
        (("theta",), "no parameter 'theta'"),
        ((3,), "parameters must be the names of parameters, such as .*, got"),
        (3, "parameters must be the names of parameters, such as .*, got 3"),
    ],
)
def test_a_path_to_no_number_is_refused_with_the_near_ones(parameters, message):
    with pytest.raises(saltus.ParameterError, match=message):
        saltus.sensitivities(forced(H=0.5), theta=0.3, duration=1.0, parameters=parameters)


def test_one_path_may_stand_alone_and_none_is_the_state_alone():
    one = saltus.sensitivities(forced(H=0.5), theta=0.3, duration=1.0, parameters="load.frequency")
    assert one.parameter_paths == ("load.frequency",)
    none = saltus.sensitivities(forced(H=0.5), theta=0.3, duration=1.0)
    assert none.parameters.shape == (2, 0)
    assert none.state.shape == (2, 2)
    # columns of parameters lengthen no step, but their loops may round sums in another order
    np.testing.assert_allclose(none.state, one.state, rtol=1e-13)
