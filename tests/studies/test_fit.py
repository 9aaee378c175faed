"""Numbers found from measured motions: calibrated by synthetic records, beside differences, and
where data say nothing.
"""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares

import saltus
from saltus.errors import ParameterError

TRUE = {"model.damping": 0.1, "impact.e": 0.9, "model.beta0": np.deg2rad(80)}
BOUNDS = {"model.damping": (0.0, 0.5), "impact.e": (0.6, 1.0), "model.beta0": (1.1, 1.56)}
CELL = saltus.System(
    model=saltus.Metainterface(beta0=TRUE["model.beta0"], damping=TRUE["model.damping"]),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(TRUE["impact.e"]),
)
SECONDS = 12.0  # 3 s at a unit of time of 0.25 s


def record(system=CELL, sigma=0.01, count=300, seed=0, duration=SECONDS, quantity="theta", **start):
    """Noisy samples of a motion, from theta = 0.3 by default."""
    times = np.linspace(0.0, duration, count)
    begin = {"theta": 0.3} | start
    motion = saltus.simulate(system, **begin, duration=duration)
    clean = motion.at(times)[0 if quantity == "theta" else 1]
    noise = sigma * np.random.default_rng(seed).normal(size=count)
    return saltus.Measurement(
        start=begin, time=times, values={quantity: clean + noise}, sigma=sigma
    )


def far(system=CELL):
    """The first guess: with these numbers the motion has another number of impacts."""
    return system.with_({"model.damping": 0.3, "impact.e": 0.7, "model.beta0": 1.2})


def test_damping_restitution_and_angle_of_the_metainterface_are_found_from_three_noisy_seconds():
    found = saltus.fit(far(), record(), BOUNDS)
    assert found.degrees == 297
    assert found.chi2 == pytest.approx(297, abs=4 * math.sqrt(2 * 297))
    for name, value in TRUE.items():
        assert found.errors[name] < 0.05
        assert found.values[name] == pytest.approx(value, abs=4 * found.errors[name])
        assert found.system.get(name) == found.values[name]
    assert not found.remarks


def test_the_result_is_that_of_finite_differences_and_needs_fewer_motions():
    """SciPy's own differences of `simulate`, from the exact result on, stay there."""
    data = record(count=100)
    found = saltus.fit(CELL, data, BOUNDS, starts=1)
    asked = []

    def residuals(x):
        asked.append(x)
        motion = saltus.simulate(
            CELL.with_(dict(zip(BOUNDS, x, strict=True))), theta=0.3, duration=SECONDS
        )
        return (motion.at(data.time)[0] - data.values["theta"]) / data.sigma

    start = np.array(list(TRUE.values()))
    other = least_squares(
        residuals, start, x_scale=[0.1, 0.1, 0.1], xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    assert list(found.values.values()) == pytest.approx(other.x.tolist(), rel=1e-5)
    assert found.chi2 == pytest.approx(2 * other.cost, rel=1e-9)
    errors = np.sqrt(np.diag(np.linalg.inv(other.jac.T @ other.jac)))
    assert list(found.errors.values()) == pytest.approx(errors.tolist(), rel=1e-3)


def test_the_likelihood_and_its_gradient_agree_with_differences_and_with_the_normal_distribution():
    data = record(count=50)
    found = saltus.fit(CELL, data, BOUNDS, starts=1)
    x = np.add(list(found.values.values()), [0.01, -0.01, 0.005])
    size, gradient = found.log_likelihood(x)
    motion = saltus.simulate(
        CELL.with_(dict(zip(BOUNDS, x, strict=True))), theta=0.3, duration=SECONDS
    )
    expected = stats.norm.logpdf(data.values["theta"], motion.at(data.time)[0], data.sigma).sum()
    assert size == pytest.approx(expected, rel=1e-9)
    for i, step in enumerate(1e-6 * np.eye(3)):
        difference = (found.log_likelihood(x + step)[0] - found.log_likelihood(x - step)[0]) / 2e-6
        assert gradient[i] == pytest.approx(difference, rel=1e-5, abs=1e-2)
    assert found.log_likelihood({**found.values, "impact.e": 1.1})[0] == -math.inf


def test_impact_times_alone_give_the_restitution_of_a_ball_by_their_closed_form():
    """From h under F = 1: t1 = sqrt(2 h), then flights of 2 e^n t1; least squares over e, whose
    error is sigma over |dt/de|.
    """
    h, e, sigma = 2.0, 0.8, 0.01
    first = math.sqrt(2 * h)
    times = first * np.array([1.0, 1 + 2 * e, 1 + 2 * e + 2 * e**2])
    ball = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, wall=0.0),
        load=saltus.Load(force=1.0),
        impact=saltus.VelocityReduction(0.5),
    )
    data = saltus.Measurement(start={"x": -h}, impacts=times, impact_sigma=sigma)
    found = saltus.fit(ball, data, {"impact.e": (0.1, 1.0)})
    assert found.values["impact.e"] == pytest.approx(e, abs=1e-10)
    # without bounds
    assert saltus.fit(ball, data, ["impact.e"]).values["impact.e"] == pytest.approx(e, abs=1e-10)
    slopes = first * np.array([0.0, 2.0, 2 + 4 * e])
    assert found.errors["impact.e"] == pytest.approx(sigma / np.linalg.norm(slopes), rel=1e-8)
    both = saltus.fit(
        ball.with_({"impact.e": e}), data, {"load.force": (0.5, 2.0), "start.x": (-4.0, -1.0)}
    )
    # all times go with sqrt(2 h / F)
    assert both.values["start.x"] / both.values["load.force"] == pytest.approx(-h, rel=1e-9)
    (sentence,) = both.remarks
    assert "the data do not tell" in sentence
    assert "load.force" in sentence
    assert "start.x" in sentence
    assert math.isinf(both.errors["start.x"])


def test_several_records_share_the_system_and_have_starts_and_loads_of_their_own():
    other = {"load.frequency": 1.3}
    second = record(CELL.with_(other), seed=2, theta=0.2)
    second = saltus.Measurement(
        start={"theta": 0.0},
        time=second.time,
        values=second.values,
        sigma=second.sigma,
        changes=other,
    )
    first = saltus.Measurement(
        start={"theta": 0.25}, time=record().time, values=record().values, sigma=0.01
    )
    found = saltus.fit(CELL, [first, second], {"impact.e": (0.6, 1.0), "start.theta": (0.05, 0.5)})
    assert list(found.values) == ["impact.e", "start.theta[0]", "start.theta[1]"]
    for name, value in (("impact.e", 0.9), ("start.theta[0]", 0.3), ("start.theta[1]", 0.2)):
        assert found.values[name] == pytest.approx(value, abs=4 * found.errors[name])


def test_velocities_accelerations_and_own_quantities_are_fitted_with_exact_derivatives():
    """Samples without noise give the numbers to rounding, whatever is measured; the noise is
    estimated as nothing.
    """
    times = np.linspace(0.0, SECONDS, 80) + 0.01
    motion = saltus.simulate(CELL, theta=0.3, duration=SECONDS + 0.1)
    q, v = motion.at(times)
    acceleration = CELL.model.acceleration(times, q, v, np.sign(q), CELL.load)
    for name, values in (
        ("velocity", v),
        ("acceleration", acceleration),
        ("force", q**2 + 0.1 * v),
    ):
        data = saltus.Measurement(start={"theta": 0.3}, time=times, values={name: values})
        functions = {"force": lambda t, q, v: q**2 + 0.1 * v}
        found = saltus.fit(
            CELL.with_({"impact.e": 0.87}), data, {"impact.e": (0.6, 1.0)}, functions=functions
        )
        assert found.values["impact.e"] == pytest.approx(0.9, abs=1e-8)


def test_a_number_without_influence_is_named():
    data = record(count=60, duration=0.5, theta=0.5, sigma=1e-5)  # before the first impact
    found = saltus.fit(CELL, data, {"impact.e": (0.6, 1.0), "model.damping": (0.0, 0.5)}, starts=1)
    assert math.isinf(found.errors["impact.e"])
    assert any(
        sentence.startswith("the data say nothing of impact.e") for sentence in found.remarks
    )
    assert np.isfinite(found.errors["model.damping"])


@pytest.mark.parametrize("sigma", [None, 0.01])
def test_data_in_other_units_are_said_to_be_missed(sigma):
    """Angles in thousandths of a radian: no number makes the motion a thousand times as large."""
    data = record(count=60, duration=3.0, sigma=1e-4)
    data = saltus.Measurement(
        start=data.start, time=data.time, values={"theta": 1e3 * data.values["theta"]}, sigma=sigma
    )
    found = saltus.fit(CELL, data, {"impact.e": (0.6, 1.0)}, starts=1)
    assert "explains next to nothing of theta" in found.remarks[0]
    assert "units" in found.remarks[0]
    if sigma is None:  # what is missed counts as noise, beside which all numbers look alike
        assert not any("the data say nothing" in sentence for sentence in found.remarks)


def test_noise_above_the_signal_is_not_said_to_be_missed():
    data = record(count=60, duration=3.0, sigma=3.0)
    found = saltus.fit(CELL, data, {"impact.e": (0.6, 1.0)}, starts=1)
    assert not any("next to nothing" in sentence for sentence in found.remarks)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"parameters": {"model.dampin": None}}, "damping"),
        ({"parameters": {"impact.e": (1.0, 0.5)}}, "bounds of impact.e must be"),
        ({"parameters": {"start.x": None}}, "there is no start.x"),
        ({"data": 3.0}, "data must be a Measurement|not iterable"),
        (
            {"data": saltus.Measurement(start={"theta": 0.3}, time=[1.0], values={"force": [0.1]})},
            "no quantity 'force'",
        ),
        ({"data": saltus.Measurement(start={"x": 0.3}, impacts=[1.0])}, "start has 'x'"),
    ],
)
def test_what_has_no_meaning_is_refused(change, sentence):
    given = {"data": record(count=5, duration=1.0), "parameters": {"impact.e": (0.6, 1.0)}} | change
    with pytest.raises((ParameterError, TypeError), match=sentence):
        saltus.fit(CELL, given["data"], given["parameters"])


@pytest.mark.parametrize("times", [np.array("a"), np.empty((0, 2)), [[1], [1, 2]]])
@pytest.mark.parametrize("name", ["time", "impacts"])
def test_times_of_another_shape_are_refused(name, times):
    measured = {"time": [0.0, 1.0], "values": {"theta": [0.3, 0.2]}, "impacts": [0.5]}
    with pytest.raises(ParameterError, match=f"{name} must be increasing numbers"):
        saltus.Measurement(start={"theta": 0.3}, **measured | {name: times})


def calibration(cases, count, seed):
    """Simulation-based calibration: numbers drawn from a prior, a record with noise of each, and
    where the true numbers lie in the distribution that the fit gives: ranks in [0, 1], which are
    uniform if the errors are right."""
    rng, ranks = np.random.default_rng(seed), []
    for case in range(cases):
        drawn = dict(
            zip(BOUNDS, rng.uniform([0.08, 0.8, 1.3], [0.2, 0.95, 1.45]).tolist(), strict=True)
        )
        truth = CELL.with_(drawn)
        found = saltus.fit(CELL, record(truth, count=count, seed=[seed, case]), BOUNDS)
        deviation = (np.array(list(drawn.values())) - list(found.values.values())) / list(
            found.errors.values()
        )
        ranks.append(stats.norm.cdf(deviation))
    return np.array(ranks)


def test_a_few_synthetic_records_are_covered_as_their_errors_say():
    ranks = calibration(10, 100, 3)
    assert 0.4 < (np.abs(ranks - 0.5) < 0.34).mean() < 0.95  # 68 % of 30
    assert (np.abs(ranks - 0.5) < 0.4999).all()


@pytest.mark.thorough
def test_two_hundred_synthetic_records_have_uniform_ranks_and_intervals_that_cover_at_their_level():
    ranks = calibration(200, 150, 11)
    for column in ranks.T:
        assert stats.kstest(column, "uniform").pvalue > 0.005
        for level in (0.5, 0.683, 0.954):
            covered = int((np.abs(column - 0.5) < level / 2).sum())
            low, high = stats.binom.ppf([0.002, 0.998], 200, level)
            assert low <= covered <= high
