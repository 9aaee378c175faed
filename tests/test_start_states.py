"""Every function that takes the state at the start of a motion reads it in the same way and refuses
it in the same words.
"""

import numpy as np
import pytest

import saltus
from saltus.systems import arguments_of, read_start, read_starts, state_of

LOAD = saltus.Load(frequency=1.0, force=saltus.Harmonic(0.3))
ONE = saltus.System(
    model=saltus.WallOscillator(damping=0.2), load=LOAD, impact=saltus.VelocityReduction(0.5)
)
TWO = saltus.System(
    model=saltus.ImpactPair(damping=0.2), load=LOAD, impact=saltus.NewtonImpact(0.5)
)
LAYERS = saltus.System(
    model=saltus.TwoLayer(beta0=1.4, damping=0.2), load=saltus.Load(frequency=1.0, vertical=-0.2)
)

# Each with the shortest work that it accepts; a state that is read well is followed for a moment.
READERS = {
    "simulate": lambda system, **start: saltus.simulate(system, periods=1, **start),
    "sensitivities": lambda system, **start: saltus.sensitivities(
        system, parameters=("model.damping",), periods=1, **start
    ),
    "simulate_many": lambda system, **start: saltus.simulate_many(system, periods=1, **start),
    "find_orbit": lambda system, **start: saltus.find_orbit(system, settle=0, period=1, **start),
    "classify": lambda system, **start: saltus.classify(system, periods=96, transient=0, **start),
    "frequency_sweep": lambda system, **start: saltus.frequency_sweep(
        system, [1.0, 1.01], periods=2, **start
    ),
    "lyapunov_spectrum": lambda system, **start: saltus.lyapunov_spectrum(
        system, periods=32, transient=0, **start
    ),
}
# Under one coordinate an ensemble takes any array for the velocity, so that only the others refuse
# a pair of them.
REFUSED = [
    (ONE, {}, "the state at the start needs x=..."),
    (ONE, {"velocity": 0.1}, "the state at the start needs x=..."),
    (ONE, {"theta": 0.1}, "WallOscillator has no coordinate 'theta'; known here: x"),
    (ONE, {"x": 0.1, "y": 0.1}, "WallOscillator has no coordinate 'y'; "),
    (
        ONE,
        {"x": 0.1, "velocty": 0.1},
        "WallOscillator has no coordinate 'velocty'; did you mean 'velocity'?",
    ),
    (ONE, {"x": np.nan}, "x must be finite, got nan"),
    (ONE, {"x": -np.inf}, "x must be finite, got -inf"),
    (ONE, {"x": 10**400}, "x must be finite, got inf"),
    (ONE, {"x": 1e200}, "x must be at most 1e+100 in size, got 1e+200"),
    (ONE, {"x": "left"}, "x must be a finite number, got 'left'"),
    (ONE, {"x": None}, "x must be a finite number, got None"),
    (ONE, {"x": True}, "x must be a finite number, got True"),
    (ONE, {"x": 1j}, "x must be a finite number, got 1j"),
    (ONE, {"x": 0.1, "velocity": np.nan}, "velocity must be finite, got nan"),
    (ONE, {"x": 0.1, "velocity": "fast"}, "velocity must be a finite number, got 'fast'"),
    (TWO, {"x": 0.1}, "the state at the start needs z=..."),
    (TWO, {"z": 0.1}, "the state at the start needs x=..."),
    (TWO, {"z": 0.1, "x": 0.1, "velocity": 0.3}, "velocity must have 2 value(s), got 0.3"),
    (TWO, {"z": 0.1, "x": 0.1, "velocity": (0.3,)}, "velocity must have 2 value(s), got (0.3,)"),
    (
        TWO,
        {"z": 0.1, "x": 0.1, "velocity": [0.1, 0.2, 0.3]},
        "velocity must have 2 value(s), got [0.1, 0.2, 0.3]",
    ),
    (TWO, {"z": 0.1, "x": 0.1, "velocity": None}, "velocity must have 2 value(s), got None"),
    (TWO, {"z": 0.1, "x": 0.1, "velocity": False}, "velocity must have 2 value(s), got False"),
    (TWO, {"z": 0.1, "x": 0.1, "velocity": (0.0, np.inf)}, "velocity must be finite, got inf"),
    (TWO, {"z": 0.1, "x": "mid"}, "x must be a finite number, got 'mid'"),
    (LAYERS, {"theta": (0.1, 0.0, 0.0)}, "theta must have 2 values, got (0.1, 0.0, 0.0)"),
    (LAYERS, {"theta": 0.1}, "theta must have 2 values, got 0.1"),
]
TAKEN = [
    (ONE, {"x": 0.1}, [0.1, 0.0]),
    (ONE, {"x": 1, "velocity": -1}, [1.0, -1.0]),
    (ONE, {"x": np.float32(0.5), "velocity": np.int64(0)}, [0.5, 0.0]),
    (ONE, {"x": np.array(0.5), "velocity": np.array(0.25)}, [0.5, 0.25]),
    (TWO, {"z": 0.1, "x": 0.2}, [0.1, 0.2, 0.0, 0.0]),
    (TWO, {"x": 0.2, "z": 0.1, "velocity": 0}, [0.1, 0.2, 0.0, 0.0]),
    (TWO, {"z": 0.1, "x": 0.2, "velocity": (0.3, 0.4)}, [0.1, 0.2, 0.3, 0.4]),
    (TWO, {"z": 0.1, "x": 0.2, "velocity": [0.3, 0.4]}, [0.1, 0.2, 0.3, 0.4]),
    (TWO, {"z": 0.1, "x": 0.2, "velocity": np.array([0.3, 0.4])}, [0.1, 0.2, 0.3, 0.4]),
    (LAYERS, {"theta": (0.1, 0.0)}, [0.1, 0.0, 0.0, 0.0]),
    (LAYERS, {"theta": [0.1, -0.2], "velocity": (0.3, 0.4)}, [0.1, -0.2, 0.3, 0.4]),
]


@pytest.mark.parametrize("reader", READERS)
def test_a_bad_start_is_refused_in_the_same_words(reader):
    for system, start, sentence in REFUSED:
        with pytest.raises(saltus.ParameterError) as refused:
            READERS[reader](system, **start)
        assert str(refused.value).startswith(sentence), (start, str(refused.value))


@pytest.mark.parametrize(("system", "start", "state"), TAKEN)
def test_a_good_start_is_the_same_state(system, start, state):
    coordinates = {name: value for name, value in start.items() if name != "velocity"}
    velocity = start.get("velocity", 0.0)
    assert read_start(system, velocity, coordinates).tolist() == state
    positions, speeds = read_starts(system, velocity, coordinates)
    assert [float(value) for value in (*positions, *speeds)] == state
    assert saltus.simulate(system, duration=0.0, **start).final_state.tolist() == state
    many = saltus.simulate_many(system, duration=0.0, **start)
    names = system.model.coordinates
    assert [float(many[f"start_{name}"]) for name in names if f"start_{name}" in many] in (
        [],
        state[: len(names)],
    )


@pytest.mark.parametrize(("system", "start", "state"), TAKEN)
def test_a_state_and_the_arguments_of_simulate_are_each_others_inverse(system, start, state):
    arguments = arguments_of(system, np.array(state))
    assert state_of(system, arguments).tolist() == state
    velocity = arguments.pop("velocity")
    assert read_start(system, velocity, arguments).tolist() == state


def test_a_pair_of_velocities_is_no_state_of_one_coordinate():
    for reader in set(READERS) - {"simulate_many"}:
        with pytest.raises(
            saltus.ParameterError, match=r"velocity must have 1 value\(s\), got \(0.1, 0.2\)"
        ):
            READERS[reader](ONE, x=0.1, velocity=(0.1, 0.2))
    assert saltus.simulate_many(ONE, x=0.1, velocity=(0.1, 0.2), periods=1).sizes["trajectory"] == 2
