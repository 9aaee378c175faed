"""The smoothed equation beside the exact one: the study against SciPy, and its claims on data that
would contradict them.
"""

import math
from functools import cache

import numpy as np
import pytest
from claim_verdicts import verdicts
from picture_checks import check_provenance, clipped
from scipy.integrate import solve_ivp

from saltus_paper import FIGURES, ClaimVerdict
from saltus_paper.figures import smoothing

BETA0 = math.radians(80.0)


@cache
def data():
    return FIGURES["smoothing"].compute(count=33)


@cache
def smoothed(sharpness):
    return smoothing._branch(sharpness)


def rate(t, y, frequency, sign):
    """`gov_eqn_theta` with any sign function, written again."""
    size = BETA0 + sign(y[0]) * y[0]
    return [
        y[1],
        math.sin(size) * 0.5 * math.sin(frequency * t)
        - 0.5 * sign(y[0]) * math.cos(size)
        - 0.1 * y[1]
        - y[0],
    ]


def settled(frequency, sharpness, state, periods=60):
    """max abs(theta) over the last three of so many periods of the smoothed equation by SciPy."""

    def sign(theta):
        return math.tanh(sharpness * theta / 2)

    period = 2 * math.pi / frequency
    run = solve_ivp(
        rate,
        (0, periods * period),
        state,
        args=(frequency, sign),
        method="DOP853",
        rtol=1e-9,
        atol=1e-11,
        max_step=0.1,
    )
    late = run.t > (periods - 3) * period
    return float(abs(run.y[0][late]).max())


@pytest.mark.parametrize(
    ("frequency", "sharpness"),
    [
        (0.6, 50.0),
        *(
            pytest.param(*each, marks=pytest.mark.thorough)
            for each in [(0.275, 50.0), (0.6, 200.0)]
        ),
    ],
)
def test_smoothed_branches_are_those_of_an_independent_integrator(frequency, sharpness):
    (orbit,) = (orbit for orbit in smoothed(sharpness).at(frequency) if orbit.stable)
    assert settled(frequency, sharpness, tuple(map(float, orbit.state))) == pytest.approx(
        orbit.amplitude, abs=2e-3
    )


@pytest.mark.thorough
def test_a_sharp_smoothing_leaves_the_hump_of_a_blunt_one_as_the_exact_motion_does():
    (orbit,) = (orbit for orbit in smoothed(50.0).at(0.28) if orbit.stable)
    sharp = settled(0.28, 20000.0, tuple(map(float, orbit.state)))
    exact = smoothing._confirmed({50.0: smoothed(50.0)}, 11)  # 0.28 is the first of its frequencies
    assert float(exact["frequency"][0]) == pytest.approx(0.28)
    for amplitude in (sharp, float(exact["settled"][0])):  # both wander there, a little differently
        assert 0.01 < amplitude - orbit.amplitude < 0.05


def test_exact_evaluations_count_from_impact_to_impact():
    count, theta, velocity = smoothing._integrated(math.inf, 1e-10)
    exact = smoothing.simulate(
        smoothing._system(None), theta=0.3, velocity=0.0, periods=20, tol=1e-14
    )
    assert (theta, velocity) == pytest.approx((exact.theta, exact.velocity), abs=1e-8)
    assert count > 1000


@pytest.mark.thorough
def test_every_claim_of_the_study_holds():
    found = verdicts(FIGURES["smoothing"].measure(data()))
    ours = {id for id, verdict in found.items() if verdict is ClaimVerdict.HOLDS}
    assert ours == {"smoothing-primary", "smoothing-order", "smoothing-grazings", "smoothing-work"}
    assert {
        id for id, verdict in found.items() if verdict is ClaimVerdict.AS_PRINTED
    } == found.keys() - ours


@pytest.mark.thorough
def test_the_data_says_where_it_comes_from_and_no_picture_is_clipped():
    check_provenance("smoothing", data())
    assert clipped(FIGURES["smoothing"].draw(data())) == []


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("group", "variable", "change", "id"),
    [
        ("broken", "stable", lambda x: 0 * x, "abstract-branch-point"),
        ("confirmed", "settled", lambda x: x + 0.01, "smoothing-confirmed"),
        ("features", "complete", lambda x: x & False, "smoothing-limit-cycle"),
        ("features", "regular", lambda x: x + np.arange(len(x)), "smoothing-order"),
        ("features", "knot", lambda x: x + 1e-4 * np.arange(len(x)), "smoothing-primary"),
        ("features", "special", lambda x: x[:1].values + 0 * x, "smoothing-grazings"),
        ("work", "error", lambda x: x[::-1].values + 0 * x, "smoothing-work"),
    ],
)
def test_data_that_contradicts_a_claim_makes_it_disagree(group, variable, change, id):
    wrong = data().copy(deep=True)
    wrong[group][variable] = change(wrong[group][variable])
    assert verdicts(FIGURES["smoothing"].measure(wrong))[id] is ClaimVerdict.DISAGREES
