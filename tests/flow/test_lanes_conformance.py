"""Every registered model runs through the scalar kernel, the lanes and the sensitivities, without
being told to any test.
"""

import dataclasses
import math
import re
import sys

import numpy as np
import pytest
from lane_cases import Curved, Duffing, end_state, motion_state
from shared_systems import Pair

import saltus
from saltus.flow import stop_names
from saltus.systems import Harmonic, Load, Model, System
from saltus.systems.serial import IMPACTS, MODELS

GUESSES = (0.4, 0.3, 0.9, 1.1)  # for a number without a default that a model may want


def build(model):
    """A model with its defaults, and for numbers without one the first of some guesses that it
    takes.
    """
    needed = [f.name for f in dataclasses.fields(model) if f.default is dataclasses.MISSING]
    return model(**dict.fromkeys(needed, GUESSES[0]))


def system_of(model):
    """Every channel harmonic, with an impact law that loses something where there are impacts."""
    channels = {
        name: Harmonic(amplitude=0.05 + 0.03 * i, mean=0.02 * i - 0.04, phase=0.5 * i)
        for i, name in enumerate(model.channels)
    }
    built = build(model)
    load = Load(frequency=1.3, **channels)
    return (
        System(model=built, load=load, impact=IMPACTS["VelocityReduction"](0.9))
        if built.sides
        else System(model=built, load=load)
    )


def states_of(system, n=24):
    """States on every side of the contact, or on the open side of several, by the gaps and by what
    stops the motion.
    """
    rng, model = np.random.default_rng(4), system.model
    own, found = len(model.coordinates), []
    for _ in range(100_000):
        position, velocity = 0.5 * rng.normal(size=own), 0.5 * rng.normal(size=own)
        place = float(position[0]) if own == 1 else tuple(position)
        speed = float(velocity[0]) if own == 1 else tuple(velocity)
        gaps = {side: float(model.gap(place, side)) for side in model.sides} if own == 1 else {}
        inside = [side for side, gap in gaps.items() if gap > 0]
        beyond = any(
            c.sign * (position[model.coordinates.index(c.coordinate)] - c.position) <= 0
            for c in model.contacts
        )
        if (gaps and not inside) or (model.holds_coordinates and beyond):
            continue
        side = inside[0] if inside else 1
        acceleration = model.acceleration(0.0, place, speed, side, system.load)
        margins = model.margins(0.0, place, speed, acceleration, side, system.load)
        if all(float(margins[name]) > 0.02 for name in model.stops):
            found.append((position, velocity))
        if len(found) == n:
            break
    positions, velocities = map(np.array, zip(*found, strict=True))
    rates = velocities[:, 0] if own == 1 else tuple(velocities.T)
    return {name: positions[:, i] for i, name in enumerate(model.coordinates)}, rates


def some_paths(system):
    """One number of the model, one of a channel, the frequency, and one of the impact law."""
    numbers = [path for path in system.parameters if not path.endswith(".order")]
    chosen = [
        next(p for p in numbers if p.startswith("model.")),
        next(p for p in numbers if p.endswith(".amplitude")),
    ]
    return tuple(
        dict.fromkeys(
            [
                *chosen,
                "load.frequency",
                *(p for p in numbers if p.startswith("impact.") and system.model.sides),
            ]
        )
    )


ONE_CONTACT = {
    name: model
    for name, model in MODELS.items()
    if model.__module__.startswith("saltus.")  # not what other tests register
    and model.contacts is Model.contacts
    and model.frictions is Model.frictions
}
CASES = {**ONE_CONTACT, "Duffing": Duffing, "Curved": Curved, "Pair": Pair}


@pytest.fixture(scope="module", params=list(CASES))
def ready(request):
    system = system_of(CASES[request.param])
    return system, *states_of(system)


def one(states, velocity, i):
    speed = (
        tuple(float(v[i]) for v in velocity) if isinstance(velocity, tuple) else float(velocity[i])
    )
    return {"velocity": speed, **{name: float(a[i]) for name, a in states.items()}}


def test_it_has_states_on_every_side(ready):
    system, states, _ = ready
    (first, *_) = states.values()
    assert len(first) == 24
    for side in system.model.sides:
        assert any(float(system.model.gap(float(x), side)) > 0 for x in first)


def test_lanes_are_the_scalar_kernel(ready):
    system, states, velocity = ready
    ensemble = saltus.simulate_many(system, **states, velocity=velocity, periods=1.4, tol=1e-14)
    stops = stop_names(ensemble).values
    for i, state in enumerate(end_state(ensemble, system)):
        motion = saltus.simulate(
            system, **one(states, velocity, i), periods=1.4, tol=1e-14, dense=False
        )
        assert (stops[i], int(ensemble.impact_count[i]), int(ensemble.side[i])) == (
            motion.stop,
            len(motion.impacts),
            motion.side,
        )
        np.testing.assert_allclose(state, motion_state(motion), rtol=0, atol=3e-12)


@pytest.mark.thorough
def test_derivatives_in_lanes_are_those_of_the_scalar_kernel(ready):
    system, states, velocity = ready
    paths, compared, periods = some_paths(system), 0, 0.1 if system.model.stops else 1.4
    ensemble = saltus.simulate_many(
        system, **states, velocity=velocity, periods=periods, tol=1e-14, sensitivities=paths
    )
    for i, derivative in enumerate(ensemble.derivative.values):
        result = saltus.sensitivities(
            system,
            parameters=paths,
            **one(states, velocity, i),
            periods=periods,
            tol=1e-14,
            dense=False,
        )
        expected = np.hstack([result.state, result.parameters])
        np.testing.assert_array_equal(np.isnan(derivative), np.isnan(expected))
        scale = np.maximum(np.nanmax(np.abs(expected), initial=1e-300, axis=0), 1.0)
        assert np.nanmax(np.abs(derivative - expected) / scale, initial=0.0) < 1e-9
        compared += 1
    assert compared >= 3
    assert list(ensemble.column.values[-len(paths) :]) == list(paths)


@pytest.mark.thorough
@pytest.mark.parametrize("impact", IMPACTS)
# a structure is no structure without its matrices; its lanes have tests of their own
@pytest.mark.parametrize("model", [name for name in MODELS if name != "Structure"])
def test_every_impact_law_runs_in_lanes_where_the_model_takes_it(model, impact):
    system = system_of(MODELS[model])
    law = IMPACTS[impact]
    needed = [f.name for f in dataclasses.fields(law) if f.default is dataclasses.MISSING]
    states, velocity = states_of(system, 12)
    try:
        system = system.with_({"impact": law(**dict.fromkeys(needed, 0.8))})
        expected = [
            saltus.simulate(system, **one(states, velocity, i), periods=1.0, tol=1e-14, dense=False)
            for i in range(12)
        ]
    except saltus.ParameterError as refused:
        message = re.escape(str(refused))
        with pytest.raises(saltus.ParameterError, match=message):
            saltus.simulate_many(
                system.with_({"impact": law(**dict.fromkeys(needed, 0.8))}),
                **states,
                velocity=velocity,
                periods=1.0,
            )
        return
    except saltus.MotionError:
        pytest.skip("some of its impacts have no solution; the random cases compare them")
    ensemble, compared = (
        saltus.simulate_many(system, **states, velocity=velocity, periods=1.0, tol=1e-14),
        0,
    )
    for i, motion in enumerate(expected):
        if np.abs(motion_state(motion)).max() > 100.0:
            # cells whose hinge has almost no mass in this position, where rounding is as large
            continue
        compared += 1
        assert int(ensemble.impact_count[i]) == len(motion.impacts)
        np.testing.assert_allclose(
            end_state(ensemble, system)[i], motion_state(motion), rtol=0, atol=3e-12
        )
    assert compared >= 6


def compiled_here():
    """The modules of generated code that this process has loaded; others may add files to the cache
    meanwhile.
    """
    return {name for name in sys.modules if name.startswith("saltus_")}


def test_numbers_that_change_compile_nothing(ready):
    system, states, velocity = ready
    saltus.simulate_many(system, **states, velocity=velocity, periods=0.1)
    before = compiled_here()
    for path, value in system.parameters.items():
        if not path.endswith(".order") and (system.model.sides or not path.startswith("impact.")):
            saltus.simulate_many(
                system, **states, velocity=velocity, periods=0.1, parameters={path: value * 0.99}
            )
    assert compiled_here() == before
    assert math.isfinite(system.load.frequency)
