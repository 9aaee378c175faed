"""Lyapunov exponents against linear theory, the multipliers of orbits, the mean divergence, and
each other's methods.
"""

import math
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced, paired, walled
from verdict_cases import spread

import saltus
from saltus import ParameterError, lyapunov_many, lyapunov_spectrum
from saltus.attractors.lyapunov.growth import LYAPUNOV, span_count
from saltus.attractors.lyapunov.spectrum import Contraction, impact_factor
from saltus.flow import Ending
from saltus.systems import natural_units
from saltus.theory import equilibria


@pytest.mark.parametrize(("damping", "stiffness"), [(0.1, 1.0), (0.3, 4.0), (3.0, 1.0)])
def test_they_are_exact_below_the_wall_of_a_piecewise_linear_oscillator(damping, stiffness):
    """The real parts of the roots of s^2 + c s + k, a pair in two of the cases."""
    expected = np.sort(np.roots([1.0, damping, stiffness]).real)[::-1]
    found = lyapunov_spectrum(
        walled(c=damping, k=stiffness, wall=20.0), x=0.1, periods=400, transient=10
    )
    np.testing.assert_allclose(found.values, expected, rtol=0, atol=5e-9)
    assert (np.abs(found.values - expected) <= found.errors + 5e-9).all()
    assert found.stroboscopic == pytest.approx(expected[0], abs=1e-7)
    assert found.agrees
    assert found.divergence == pytest.approx(-damping, abs=1e-12)
    assert found.note is None


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain(saltus.Model):
    """Two equal masses, each with a spring and a damper c to the ground, and a spring and a damper
    d between them.
    """

    stiffness: float = 2.0
    damping: float = 0.1
    between: float = 0.2

    coordinates = ("left", "right")
    channels = ("force",)

    def acceleration(self, t, q, v, side, load):
        pull = self.stiffness * (q[1] - q[0]) + self.between * (v[1] - v[0])
        return load.force(t) - q[0] + pull - self.damping * v[0], -pull - q[1] - self.damping * v[1]


@pytest.mark.thorough
def test_they_are_exact_with_two_coordinates():
    """The masses together have s^2 + c s + 1, against each other s^2 + (c + 2 d) s + 1 + 2 k: real
    parts -c/2, -(c + 2 d)/2.
    """
    force = saltus.Load(frequency=1.7, force=saltus.Harmonic(amplitude=0.2))
    system = saltus.System(model=Chain(), load=force)
    expected = np.array([-0.05, -0.05, -0.25, -0.25])
    found = lyapunov_spectrum(
        system, left=0.1, right=0.0, velocity=(0.0, 0.1), periods=400, transient=5
    )
    np.testing.assert_allclose(found.values, expected, rtol=0, atol=1e-6)
    assert found.values.sum() == pytest.approx(-0.6, abs=1e-9)
    assert found.stroboscopic == pytest.approx(expected[0], abs=1e-5)


@pytest.mark.parametrize("frequency", [None, 1.3])
def test_they_are_the_eigenvalues_of_a_damped_pendulum_at_rest(frequency):
    """At the deformed equilibrium under constant loads, whose eigenvalues `theory` has; with and
    without a clock.
    """
    model = saltus.Metainterface(beta0=math.radians(80), damping=0.1)
    constant = saltus.System(model=model, load=saltus.Load(vertical=0.5))
    system = constant if frequency is None else forced(0.0, frequency, V=0.5)
    equilibrium = next(q for q in equilibria(constant) if q.stable and q.theta > 0)
    found = lyapunov_spectrum(system, theta=equilibrium.theta, periods=300, transient=0)
    np.testing.assert_allclose(found.values, np.real(equilibrium.eigenvalues), rtol=0, atol=1e-8)
    assert found.duration == pytest.approx(
        300
        * (
            natural_units(system).powers_of_two.time
            if frequency is None
            else 2 * math.pi / frequency
        )
    )


def test_on_an_orbit_they_are_the_logarithms_of_its_multipliers():
    """Near the fold at Hhat = 0.02199 the multipliers are real and unequal; they come from the
    orbit's own equations.
    """
    near = saltus.find_orbit(forced(0.0225, 1.0), theta=-2.5, velocity=-0.5).state
    orbit = saltus.find_orbit(forced(0.0221, 1.0), theta=near[0], velocity=near[1])
    theta, velocity = orbit.state
    found = lyapunov_spectrum(
        orbit.system, theta=theta, velocity=velocity, periods=200, transient=0
    )
    expected = np.log(np.abs(orbit.multipliers)) / (2 * math.pi)
    assert expected[0] - expected[1] > 0.05
    np.testing.assert_allclose(found.values, expected, rtol=0, atol=1e-7)
    assert found.stroboscopic == pytest.approx(expected[0], abs=1e-5)


@pytest.mark.parametrize(("frequency", "amplitude"), [(1.6, 3.0), (0.38, 0.2)])
def test_in_chaos_they_add_up_to_minus_the_damping_and_the_map_has_the_same_largest_one(
    frequency, amplitude
):
    """Both are means over a chaotic motion, and bars are about two standard errors: they differ by
    two bars for one motion of ten thousand. Over 200 periods bars alone are a third of an exponent.
    """
    found = lyapunov_spectrum(forced(amplitude, frequency), theta=0.3, periods=1600, transient=100)
    assert found.values.sum() == pytest.approx(-0.1, abs=1e-8)
    assert found.sum_defect < 1e-8
    assert found.largest_condition < 1e6
    assert found.positive
    bar = math.hypot(found.errors[0], found.stroboscopic_error)
    assert abs(found.stroboscopic - found.values[0]) < 2.0 * bar
    assert bar < 0.25 * found.values[0]  # bars are not endless


def test_with_unequal_layers_and_losses_they_add_up_to_the_mean_divergence():
    """The divergence is that of the crossings: 2 ln e an impact, -C c / (1 + m) on the lower side,
    -C on the upper one.
    """
    system = forced(3.0, 1.6, e=0.95, m=0.3, k=1.4, c=2.0)
    found = lyapunov_spectrum(system, theta=0.5, periods=64, transient=50)
    assert found.sum_defect < 1e-8
    assert found.divergence < -0.11
    motion = saltus.simulate(system, theta=0.5, duration=40.0)
    crossings = motion.impacts
    bounds = np.concatenate([[0.0], crossings.time, [40.0]])
    sides = np.append(crossings.side, motion.side)
    lower, upper = (np.diff(bounds)[sides == s].sum() for s in (1, -1))
    expected = 2 * len(crossings) * math.log(0.95) - 0.1 * (2.0 / 1.3 * lower + upper)
    assert Contraction(system).along(motion) == pytest.approx(expected, abs=1e-12)


@pytest.mark.thorough
def test_the_sum_of_the_exponents_is_the_divergence_of_random_systems():
    rng, checked = np.random.default_rng(8), 0
    for _ in range(30):
        numbers = {
            "C": rng.uniform(0.0, 0.3),
            "e": rng.choice([1.0, rng.uniform(0.6, 1.0)]),
            "k": rng.uniform(0.5, 2.0),
            "m": rng.uniform(0.0, 1.0),
            "c": rng.uniform(0.0, 2.0),
        }
        system = forced(W=rng.uniform(0.3, 3.0), H=rng.uniform(0.5, 4.0), **numbers)
        found = lyapunov_spectrum(
            system, theta=rng.uniform(-1, 1), periods=48, transient=20, two_trajectories=False
        )
        if found.note is None:
            assert found.sum_defect < 1e-8
            checked += 1
    assert checked > 20


def test_the_contraction_of_an_impact_that_depends_on_the_ground_is_that_of_its_slope():
    """T+ = r T-, with a moving ground: (v+ dv+/dv-) / v- by differences of the law itself."""
    system = saltus.System(
        model=saltus.Metainterface(beta0=math.radians(80), damping=0.1),
        load=saltus.Load(
            frequency=1.0, ground_horizontal=saltus.Harmonic(amplitude=0.1), vertical=-0.5
        ),
        impact=saltus.EnergyRestitution(0.9),
    )
    motion = saltus.simulate(system, theta=0.6, duration=8.0)
    law, model, load = system.impact, system.model, system.load
    expected = -0.1 * 8.0
    for t, s, v, after in zip(
        *(
            getattr(motion.impacts, n)
            for n in ("time", "side", "velocity_before", "velocity_after")
        ),
        strict=True,
    ):
        step = 1e-5
        ends = [float(law.velocity_after(model, t, v + d, s, -s, load)) for d in (-step, step)]
        expected += math.log((ends[1] - ends[0]) / (2 * step) * after / v)
    assert len(motion.impacts) > 1
    assert Contraction(system).along(motion) == pytest.approx(expected, abs=1e-7)


def test_the_lanes_have_the_same_exponents_as_the_single_motion():
    """A settled motion, one in the transient and one with a period in many pieces, under losses and
    unequal layers.
    """
    systems = [forced(0.5, w, e=0.95, m=0.3) for w in (0.15, 0.7, 1.0)]
    assert span_count(systems[0].load.period, natural_units(systems[0]).own_time) > 1
    many = lyapunov_many(
        systems[0],
        {"load.frequency": [0.15, 0.7, 1.0]},
        theta=0.9,
        periods=40,
        transient=10,
        tol=1e-12,
    )
    for i, system in enumerate(systems):
        one = lyapunov_spectrum(system, theta=0.9, periods=40, transient=10, two_trajectories=False)
        np.testing.assert_allclose(many.exponent[i], one.values, rtol=0, atol=1e-7)
        np.testing.assert_allclose(many.error[i], one.errors, rtol=1e-4, atol=1e-9)
        np.testing.assert_allclose(
            [many.at_half[i], many.later_half[i]], one.halves, rtol=0, atol=1e-7
        )


def test_the_values_that_are_known_of_the_three_chaotic_motions():
    """Issue text: about +0.03, +0.12 and +0.2 per unit of time."""
    where = {"load.frequency": [0.38, 1.2, 1.6], "load.horizontal.amplitude": [0.2, 2.0, 3.0]}
    found = lyapunov_many(forced(1.0, 1.0), where, theta=0.3, periods=400)
    assert found.positive.all()
    assert (found.period == 0).all()
    known = np.array([0.03, 0.12, 0.2])
    assert (np.abs(found.exponent[:, 0] - known) < 0.15 * known + found.error[:, 0]).all()
    np.testing.assert_allclose(found.exponent.sum("index"), -0.1, rtol=0, atol=1e-8)


@pytest.mark.parametrize("frequency", [1.0, 1.1])
def test_chaos_and_a_periodic_motion_coexist_at_large_amplitude(frequency):
    """Hhat = 3, as the paper's piercing of the chaotic band says; after 1200 periods, from 24
    states.
    """
    states = spread(24)
    found = lyapunov_many(
        forced(3.0, frequency),
        theta=states[:, 0],
        velocity=states[:, 1],
        periods=200,
        transient=1000,
        tol=1e-10,
    )
    chaotic = found.positive & (found.period == 0)
    assert chaotic.sum() >= 3
    assert (found.period > 0).sum() >= 3
    assert (found.exponent[:, 0].where(found.period > 0, -1.0) < -0.01).all()


def test_error_bars_hold_between_independent_motions_on_one_attractor():
    """The exponents of 64 motions scatter about their common mean within their bars in 95 of 100
    cases; 85 at the least here.
    """
    states = spread(64, 1.0)
    found = lyapunov_many(
        forced(3.0, 1.6),
        theta=states[:, 0],
        velocity=states[:, 1],
        periods=200,
        transient=100,
        tol=1e-10,
    )
    apart = np.abs(found.exponent[:, 0] - found.exponent[:, 0].mean())
    assert (apart < found.error[:, 0]).mean() > 0.85
    scatter = float(found.exponent[:, 0].std())
    assert 1.0 < float(found.error[:, 0].mean()) / scatter < 4.0


def test_growth_by_shear_alone_is_not_taken_for_chaos():
    """Without damping, on a torus, derivatives grow in proportion to the time; in a longer run the
    exponent falls.
    """
    system = forced(0.05, 1.3, C=0.0)
    short, long = (
        lyapunov_spectrum(system, theta=0.5, periods=n, transient=100, two_trajectories=False)
        for n in (64, 400)
    )
    assert short.values[0] > 0.0
    assert long.values[0] < 0.5 * short.values[0]
    assert not short.positive
    assert not long.positive
    assert long.values.sum() == pytest.approx(0.0, abs=1e-8)


def test_rest_with_a_loss_at_impacts_leaves_nothing():
    found = lyapunov_spectrum(forced(0.05, 0.5, e=0.5), theta=0.1, periods=32, transient=20)
    assert np.isneginf(found.values).all()
    assert (found.errors == 0.0).all()
    assert "rests at contact" in found.note
    many = lyapunov_many(
        forced(0.05, 0.5), {"impact.e": [0.5, 1.0]}, theta=0.1, periods=32, transient=100
    )
    assert np.isneginf(many.exponent[0]).all()
    assert (many.ending == Ending.REST).all()


def test_impacts_that_lose_nothing_have_no_exponents_at_rest():
    """The motion nears rest as exp(-C t / 3), but its phase is lost, and rest itself has no
    derivative.
    """
    for theta in (0.1, 0.0):
        found = lyapunov_spectrum(forced(0.05, 0.5), theta=theta, periods=32, transient=150)
        assert np.isnan(found.values).all()
        assert "lose nothing" in found.note
        assert math.isnan(found.sum_defect)
    many = lyapunov_many(forced(0.05, 0.5), theta=[0.1, 0.05], periods=32, transient=100)
    assert np.isnan(many.exponent).all()


def test_a_periodic_rest_has_exponents_of_minus_infinity():
    """A loss at impacts, and a load that pulls the system off its contact once in a while: it has
    rested before each release.
    """
    found = lyapunov_spectrum(forced(0.12, 0.05, e=0.3), theta=0.05, periods=32, transient=2)
    assert np.isneginf(found.values).all()


def test_results_are_labelled_and_do_not_depend_on_what_else_is_computed():
    amplitudes = xr.DataArray([0.4, 0.5, 3.0], dims="amplitude")
    starts = xr.DataArray([0.3, 0.9], dims="theta0")
    found = lyapunov_many(
        forced(1.0, 1.0),
        {"load.horizontal.amplitude": amplitudes},
        theta=starts,
        periods=32,
        transient=5,
    )
    assert found.exponent.dims == ("theta0", "amplitude", "index")
    assert all("units" in variable.attrs for variable in found.data_vars.values())
    assert saltus.System.from_json(found.attrs["system"]) == forced(1.0, 1.0)
    alone = lyapunov_many(forced(3.0, 1.0), theta=[0.9], periods=32, transient=5)
    np.testing.assert_array_equal(found.exponent[1, 2], alone.exponent[0])


@pytest.mark.thorough
def test_threads_do_not_get_in_each_others_way_in_a_fresh_process():
    """Where nothing has been compiled or loaded before."""
    script = (
        "import numpy as np, saltus\nfrom saltus import lyapunov_many\nload ="
        " saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5),"
        " vertical=-0.5)\nsystem = saltus.System(model=saltus.Metainterface(beta0=1.4,"
        " damping=0.1), load=load)\nfound = lyapunov_many(system, theta=np.linspace(0.3, 0.9, 40),"
        " periods=32, transient=0)\nassert abs(found.exponent.sum('index') + 0.1).max() < 1e-8\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_progress_goes_from_nothing_to_all():
    for follow in (lyapunov_many, lyapunov_spectrum):
        told = []
        follow(
            forced(0.5, 1.0),
            theta=0.3,
            periods=64,
            transient=5,
            progress=lambda done, _, told=told: told.append(done),
        )
        assert told == sorted(told)
        assert told[-1] == 1.0


def test_the_factor_of_impacts_is_that_of_the_law():
    arrays = {"impact.e": np.array([0.5, 1.0])}
    np.testing.assert_allclose(impact_factor(forced(0.5, 1.0), arrays), [0.25, 1.0])
    inelastic = forced(0.5, 1.0).with_(
        {"impact": saltus.InelasticImpact(), "model.mass_ratio": 0.3}
    )
    assert float(impact_factor(inelastic, {})) == pytest.approx(
        math.cos(math.radians(160)) ** 2 / 1.3
    )


def test_pieces_are_short():
    for length in (0.5, 6.4, 6.6, 63.0):
        assert length / span_count(length) <= LYAPUNOV.longest_span


RECORD = saltus.Record([0.0, 1.0], [0.0, 1.0])


@pytest.mark.parametrize("follow", [lyapunov_spectrum, lyapunov_many])
@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"periods": 31}, "periods must"),
        ({"periods": 40.5}, "periods must be a whole number"),
        ({"transient": -1}, "transient must"),
        (
            {
                "system": saltus.System(
                    model=saltus.Metainterface(beta0=1.4), load=saltus.Load(horizontal=RECORD)
                )
            },
            "is a Record",
        ),
        ({"theta": math.nan}, "theta must be"),
        ({"phi": 0.3}, "no coordinate 'phi'"),
        ({"tol": 1.0}, "tol must"),
    ],
)
def test_they_refuse_what_has_no_meaning(follow, changes, match):
    arguments = {"system": forced(0.5, 1.0), "theta": 0.3} | changes
    with pytest.raises(ParameterError, match=match):
        follow(arguments.pop("system"), **arguments)


def test_lanes_refuse_two_coordinates():
    with pytest.raises(ParameterError, match="one coordinate"):
        lyapunov_many(paired(), x=0.1, y=-0.1, velocity=(0.0, 0.0))
