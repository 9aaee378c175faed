"""find_orbit on random systems and starts: an orbit that holds, or a refusal in one sentence;
nothing else, ever.
"""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from orbit_cases import FREQUENCY
from shared_systems import forced, walled

from saltus import MotionError, ParameterError, Record, find_orbit, simulate

pytestmark = pytest.mark.thorough  # many structures of their own

FEW = settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
# orbits that a test of ten examples must have seen: one that finds nothing has shown nothing
LEAST = 3
numbers = {
    "beta0": st.floats(0.5, 2.2),
    "C": st.floats(0.03, 0.5),
    "V": st.floats(-1.5, 0.3),
    "H": st.floats(0.05, 1.5),
    "W": st.floats(0.3, 4.0),
    "e": st.one_of(st.just(1.0), st.floats(0.3, 1.0)),
    "mean": st.one_of(st.just(0.0), st.floats(-0.3, 0.3)),
}


def check(orbit):
    """That it is what it says, by means of its own."""
    times = np.append(orbit.impact_times, orbit.impact_times[:1] + orbit.duration)
    growth = max(1.0, abs(orbit.multipliers[0]))
    assert orbit.defect < 1e-9 * growth
    assert orbit.residual < 1e-9
    assert orbit.admissible
    assert (orbit.speeds > 0.0).all()
    assert (np.diff(times) > 0.0).all()
    if orbit.releases.size:  # its impacts accumulate: tests/orbits/test_resting_orbits.py
        return
    motion = simulate(orbit.system, **orbit.start(), periods=orbit.period, tol=1e-13)
    assert motion.side != 0  # it does not rest
    if len(orbit.impact_times):
        inner = [
            t
            for t in motion.impacts.time
            if 1e-6 < t - orbit.impact_times[0] < orbit.duration - 1e-6
        ]
        assert len(inner) == len(orbit.impact_times) - 1


def outcome(system, **arguments):
    """The orbit, or None after a refusal in a sentence that says what to do."""
    try:
        return find_orbit(system, parameters=(FREQUENCY,), **arguments)
    except MotionError as refusal:
        sentence = str(refusal)
        assert "\n" not in sentence
        assert 20 < len(sentence) < 500
        assert any(
            word in sentence for word in ("try", "start", "reaches", "name", "choose", "give")
        ), sentence
        return None


def test_settled_motions_of_random_systems():
    seen = []

    @FEW
    @given(
        theta=st.floats(-2.0, 2.0),
        # speeds below 1e-30 beside forces of 1 are refused: steps shrink to nothing
        velocity=st.floats(-1.0, 1.0).map(lambda v: v if abs(v) > 1e-30 else 0.0),
        system=st.builds(forced, **numbers),
    )
    def settled(system, theta, velocity):
        orbit = outcome(system, theta=theta, velocity=velocity, settle=60, max_period=3)
        if orbit is not None:
            check(orbit)
            seen.append(orbit)

    settled()
    assert len(seen) >= LEAST


def test_orbits_near_random_states():
    """Newton's method from what is no orbit at all."""
    seen = []

    @FEW
    @given(
        st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.integers(1, 4), st.builds(forced, **numbers)
    )
    def near(theta, velocity, period, system):
        orbit = outcome(system, theta=theta, velocity=velocity, settle=0, period=period)
        if orbit is not None:
            check(orbit)
            assert period % orbit.period == 0
            seen.append(orbit)

    near()
    assert len(seen) >= LEAST


def test_impact_oscillators():
    seen = []
    oscillators = st.builds(
        walled,
        A=st.floats(0.05, 1.5),
        W=st.floats(0.4, 3.0),
        wall=st.floats(-0.4, 1.2),
        e=st.floats(0.3, 1.0),
    )

    @FEW
    @given(st.floats(-2.0, -0.5), st.floats(-1.0, 1.0), oscillators, st.sampled_from([0, 50]))
    def impacting(x, velocity, system, settle):
        orbit = outcome(system, x=x, velocity=velocity, settle=settle, max_period=3)
        if orbit is not None:
            check(orbit)
            seen.append(orbit)

    impacting()
    assert len(seen) >= LEAST


def test_chaos_is_refused_with_what_to_try():
    with pytest.raises(MotionError, match=r"not settled.*chaotic.*settle=0"):
        find_orbit(forced(H=2.0, W=1.2), theta=0.3, parameters=(FREQUENCY,))


def test_rest_is_refused_with_what_to_try():
    with pytest.raises(
        MotionError, match=r"the undeformed state, which is not an orbit.*start farther"
    ):
        find_orbit(forced(H=0.03), theta=0.05, parameters=(FREQUENCY,))


def test_what_loses_energy_under_a_constant_load_has_no_orbits():
    still = forced().with_({"load.frequency": None, "load.horizontal": 0.5})
    with pytest.raises(MotionError, match="no cycle"):
        find_orbit(still, theta=0.3)


def test_a_record_has_no_orbits():
    shaking = Record(time=np.linspace(0.0, 10.0, 41), value=np.sin(np.linspace(0.0, 10.0, 41)))
    with pytest.raises(ParameterError, match=r"Record or a pulse is not periodic.*Harmonic"):
        find_orbit(forced().with_({"load.horizontal": shaking}), theta=0.3)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"theta": 0.3, "period": 0}, "period"),
        ({"theta": 0.3, "period": 1.5}, "whole number"),
        ({"theta": 0.3, "settle": -1}, "settle"),
        ({"theta": 0.3, "max_period": 0}, "max_period"),
        ({"theta": 0.3, "max_period": True}, "max_period|number"),
        ({"theta": math.nan}, "theta"),
        ({"theta": "0.3"}, "theta"),
        ({"theta": 0.3, "velocity": math.inf}, "velocity"),
        ({"thetta": 0.3}, "theta"),
        ({}, "theta"),
        ({"theta": 0.3, "parameters": ("load.frequenzy",)}, "load.frequency"),
        ({"theta": 0.3, "parameters": ("model",)}, "model"),
    ],
)
def test_arguments_without_meaning_are_refused_in_a_sentence(arguments, sentence):
    with pytest.raises(ParameterError, match=sentence) as refusal:
        find_orbit(forced(), **({"parameters": (FREQUENCY,)} | arguments))
    assert "\n" not in str(refusal.value)
