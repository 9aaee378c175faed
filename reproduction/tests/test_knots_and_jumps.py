"""The motions behind a spectrum: a knot's two motions exist and differ, and past a loop's folds
motions leave it.
"""

import numpy as np
import pytest

from saltus import response_spectrum
from saltus.flow import simulate, simulate_many
from saltus_paper.figures import harmonic_loads, knots_and_jumps, response_panels
from saltus_paper.measures.spectrum_features import detached, main_branch

KNOT = 0.84881863  # Omega at Hhat = 0.5


@pytest.fixture(scope="module")
def resonance():
    """The primary resonance at Hhat = 0.5."""
    system = harmonic_loads.under_force(amplitude=0.5)
    return response_spectrum(
        system, harmonic_loads.FREQUENCY, (0.75, 1.0), max_period=1, values=[0.8, 0.95], starts=4
    )


@pytest.fixture(scope="module")
def island():
    """The detached loop of period 3 at Hhat = 0.5."""
    system = harmonic_loads.under_force(amplitude=0.5)
    return response_spectrum(
        system,
        harmonic_loads.FREQUENCY,
        (2.4, 3.0),
        max_period=3,
        values=[2.7],
        starts=16,
        window=response_panels.WINDOW,
        repelling=0,
        switch=False,
    )


def test_two_motions_that_simulation_settles_on_share_the_knots_amplitude_and_differ(resonance):
    (value,) = knots_and_jumps.knots(resonance)["parameter"].values
    assert value == pytest.approx(KNOT, abs=1e-7)
    rng = np.random.default_rng(1)
    ends = simulate_many(
        harmonic_loads.under_force(frequency=value, amplitude=0.5),
        theta=rng.uniform(-2, 2, 24),
        velocity=rng.uniform(-2, 2, 24),
        periods=400,
        sample=("extrema",),
    )
    moving = np.abs(ends["theta"].values) + np.abs(ends["velocity"].values) > 1e-3
    sizes = ends["largest_theta"].values.reshape(24, -1)[moving, -1]
    states = np.unique(np.round(np.stack([ends["theta"], ends["velocity"]])[:, moving], 6), axis=1)
    assert states.shape[1] == 2
    assert np.ptp(sizes) < 1e-9
    assert knots_and_jumps.knots(resonance)["amplitude"].values == pytest.approx(
        sizes.mean(), abs=1e-9
    )


def test_the_motions_of_a_knot_are_those_of_the_system(resonance):
    knots = knots_and_jumps.knots(resonance)
    theta = knots["theta"].values[0]
    assert np.abs(theta[:, 0] - theta[:, -1]).max() < 1e-10  # periodic
    # symmetric: its own mirror image half a period later
    assert np.abs(theta[:, 180:] + theta[:, :181]).max() < 1e-10
    assert float(knots["apart"].values[0]) > 1
    first, second = np.rad2deg(knots["peak"].values[0])
    assert abs(first - second) > 90


def test_an_orbit_from_the_dataset_is_on_its_branch(resonance):
    branch = main_branch(resonance)
    index = int(np.abs(branch["parameter"].values - 0.8).argmin())  # below both folds
    value = float(branch["parameter"][index])
    orbit = knots_and_jumps.orbit_at(branch, index, value)
    assert orbit.amplitude == pytest.approx(float(branch["amplitude"][index]), abs=1e-12)
    assert orbit.defect < 1e-10
    assert knots_and_jumps.orbit_at(branch, index, value + 1e-4).frequency == value + 1e-4


def test_no_knot_without_two_stable_arms(resonance):
    branch = main_branch(resonance)
    unstable = resonance.copy(deep=True)
    unstable["points"]["stable"] = resonance["points"]["stable"] * 0
    assert knots_and_jumps.knots(unstable).sizes["knot"] == 0
    assert branch["stable"].values.any()


def test_past_the_folds_of_a_loop_motions_jump(island):
    names = [
        name
        for name, branch in detached(island)
        if branch.attrs["end_reasons"] == ["closed", "closed"]
    ]
    jumps = knots_and_jumps.jumps(island)
    closed = np.isin(jumps["branch"].values, names)
    assert jumps["fold"].values[closed] == pytest.approx([2.539297, 2.914701], abs=2e-6)
    assert (np.abs(jumps["after"] - jumps["before"]).values > 0.25).all()


def test_between_its_folds_the_loop_attracts_what_starts_near_it(island):
    _, branch = next(
        (n, b) for n, b in detached(island) if b.attrs["end_reasons"] == ["closed", "closed"]
    )
    stable = np.flatnonzero(branch["stable"].values)
    index = int(stable[np.argmin(np.abs(branch["parameter"].values[stable] - 2.7))])
    orbit = knots_and_jumps.orbit_at(branch, index, float(branch["parameter"][index]))
    start = orbit.start()
    disturbed = {**start, "velocity": start["velocity"] * (1 + 1e-3)}
    late = simulate(orbit.system, **disturbed, periods=600).impacts.velocity_before[-6:]
    assert np.abs(late) == pytest.approx(np.full(6, orbit.speeds[0]), abs=1e-8)
