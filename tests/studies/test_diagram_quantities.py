"""Diagrams of models with several coordinates have the amplitudes of each of them."""

import numpy as np
import pytest

import saltus


@pytest.fixture(scope="module")
def spectrum():  # type: ignore[no-untyped-def]
    system = saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.05, clearance=1.0, damping=0.02),
        load=saltus.Load(frequency=0.95, force=saltus.Harmonic(0.05)),
        impact=saltus.NewtonImpact(0.6),
    )
    return saltus.response_spectrum(
        system,
        bounds=(0.945, 0.955),
        effort="quick",
        max_period=1,
        values=[0.95],
        starts=4,
        repelling=0,
        switch=False,
        bands=False,
        functions={"middle": lambda motion: motion.extrema[0].mean()},
    )


def test_dots_and_branches_have_the_amplitude_of_the_case(spectrum) -> None:  # type: ignore[no-untyped-def]
    """Beside an orbit that is found from its own start; that of x is the clearance everywhere."""
    system = saltus.System.from_json(spectrum.attrs["system"]).with_({"load.frequency": 0.95})
    orbit = saltus.find_orbit(system, z=0.5, x=0.0, velocity=(0.0, 0.3))
    position, _ = orbit.motion().at(np.linspace(orbit.motion().start, orbit.motion().time, 20001))
    expected = np.abs(position[0]).max()
    dots = spectrum["attractors"]
    on_orbit = dots["impact_count"].values == 2
    np.testing.assert_allclose(dots["amplitude"].values[on_orbit], expected, atol=1e-7)
    np.testing.assert_allclose(dots["largest_x"].values[on_orbit], 1.0, rtol=1e-9)
    branch = saltus.branch_of(spectrum, 0)
    assert branch.amplitude.min() < expected < branch.amplitude.max()
    assert np.ptp(branch.amplitude.values) > 0.05
    np.testing.assert_allclose(branch.largest_x, 1.0, rtol=1e-9)
    middle = 0.5 * (dots["largest_z"].values + dots["smallest_z"].values)
    np.testing.assert_allclose(dots["middle"].values, middle, atol=1e-12)


@pytest.mark.parametrize("quantity", [None, "z", "middle"])
def test_a_diagram_draws_any_of_them(spectrum, quantity) -> None:  # type: ignore[no-untyped-def]
    axes = saltus.plot(spectrum, quantity=quantity)
    assert ("z" if quantity != "middle" else "middle") in axes[0].get_ylabel()


def test_a_quantity_of_a_diagram_that_there_is_not_is_refused(spectrum) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(saltus.ParameterError, match="amplitude_z"):
        saltus.plot(spectrum, quantity="w")
