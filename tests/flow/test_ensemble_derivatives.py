"""What an ensemble's derivative to the frequency holds fixed, by differences of motions that
`simulate` follows on their own.
"""

import numpy as np
import pytest
from shared_systems import forced

import saltus
from saltus.flow import stop_names

pytestmark = pytest.mark.thorough  # many structures of their own

STEP = 2e-4
STATES = np.array([[0.3, 0.1], [-0.5, 0.2], [0.6, -0.1]])


def by_differences(system, theta, velocity, time, span):
    """d(theta, theta')/dW of the state after `span` = {"periods": n} or {"duration": t}, its error
    of the order STEP^4.
    """
    ends = []
    for offset in (-2, -1, 1, 2):
        other = system.with_({"load.frequency": system.load.frequency + offset * STEP})
        motion = saltus.simulate(
            other, theta=theta, velocity=velocity, time=time, **span, tol=1e-15, dense=False
        )
        ends.append([motion.theta, motion.velocity])
    a, b, c, d = np.array(ends)
    return (a - 8 * b + 8 * c - d) / (12 * STEP)


@pytest.mark.parametrize("time", [0.0, 1.7, -30.2])
@pytest.mark.parametrize(
    ("C", "H", "e", "span", "until", "stop", "held"),
    [
        (0.1, 0.3, 1.0, {"periods": 2}, (), "horizon", "periods"),
        (0.1, 0.3, 1.0, {"periods": 1.4}, (), "horizon", "periods"),
        (0.1, 0.3, 1.0, {"duration": 9.0}, (), "horizon", "duration"),
        (0.5, 0.3, 1.0, {"periods": 100}, "settled", "settled", "periods"),
        (0.5, 0.3, 1.0, {"duration": 700.0}, "settled", "settled", "duration"),
    ],
)
def test_the_start_is_fixed_and_the_end_moves_only_with_the_periods_asked_for(
    C, H, e, span, until, stop, held, time
):
    """Asked for periods, the state after as many of them, settled or not; asked for a duration, at
    that time.
    """
    system = forced(H, C=C, e=e, beta0=1.4)
    ensemble = saltus.simulate_many(
        system,
        theta=STATES[:, 0],
        velocity=STATES[:, 1],
        time=time,
        **span,
        until=until,
        sensitivities="load.frequency",
        tol=1e-14,
    )
    found = ensemble.derivative.sel(column="load.frequency").values
    assert set(stop_names(ensemble).values) == {stop}
    for i, (theta, velocity) in enumerate(STATES):
        length = {
            "periods": float(ensemble.periods[i]),
            "duration": float(ensemble.time[i]) - time,
        }[held]
        expected = by_differences(system, theta, velocity, time, {held: length})
        assert found[i] == pytest.approx(expected, rel=1e-5, abs=1e-6)
        other = "duration" if held == "periods" else "periods"
        span_of_other = {
            "periods": float(ensemble.periods[i]),
            "duration": float(ensemble.time[i]) - time,
        }[other]
        different = by_differences(system, theta, velocity, time, {other: span_of_other})
        # the two conventions are not the same
        assert found[i] != pytest.approx(different, rel=1e-3, abs=1e-4)
