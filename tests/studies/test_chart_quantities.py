"""Charts of models with several coordinates have the extrema of each of them."""

import numpy as np
import pytest

import saltus


@pytest.fixture(scope="module")
def chart():  # type: ignore[no-untyped-def]
    system = saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.05, clearance=1.0, damping=0.02),
        load=saltus.Load(frequency=0.94, force=saltus.Harmonic(0.05)),
        impact=saltus.NewtonImpact(0.6),
    )
    return saltus.stability_chart(
        system,
        horizontal=[0.93, 0.94],
        vertical=[0.05],
        paths=("load.frequency", "load.force.amplitude"),
        max_period=1,
        starts=4,
        functions={"middle": lambda motion: motion.extrema[0].mean()},
    )


def test_cells_have_the_amplitude_of_the_case(chart) -> None:  # type: ignore[no-untyped-def]
    """Beside an orbit that is found from its own start."""
    system = saltus.System.from_json(chart.attrs["system"])
    for value in (0.93, 0.94):
        here = system.with_({"load.frequency": value, "load.force.amplitude": 0.05})
        orbit = saltus.find_orbit(here, z=0.5, x=0.0, velocity=(0.0, 0.3))
        cell = chart.sel(horizontal=value, vertical=0.05).isel(motion=0)
        assert int(cell.motion_impact_count) == orbit.impact_count == 2
        largest = max(float(cell.motion_largest_z), -float(cell.motion_smallest_z))
        assert largest == pytest.approx(orbit.amplitude, abs=1e-7)
        assert float(cell.motion_largest_x) == pytest.approx(1.0, abs=1e-9)
        middle = 0.5 * (cell.motion_largest_z + cell.motion_smallest_z)
        assert float(cell.motion_middle) == pytest.approx(float(middle), abs=1e-12)


@pytest.mark.parametrize(("quantity", "label"), [(None, "z"), ("x", "x"), ("middle", "middle")])
def test_a_chart_draws_any_of_them(chart, quantity, label) -> None:  # type: ignore[no-untyped-def]
    axes = saltus.plot(chart, quantity=quantity)
    (bar,) = [ax for ax in axes.figure.axes if ax is not axes]
    assert label in bar.get_ylabel()
    values = axes.collections[0].get_array()
    name = quantity or "z"
    motions = chart.isel(motion=0)
    expected = (
        motions.motion_middle
        if name == "middle"
        else np.fmax(
            abs(motions[f"motion_largest_{name}"]), abs(motions[f"motion_smallest_{name}"])
        )
    )
    np.testing.assert_allclose(np.ravel(values)[:2], np.ravel(expected)[:2], rtol=1e-9, atol=1e-12)


def test_a_quantity_of_a_chart_that_there_is_not_is_refused(chart) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(saltus.ParameterError, match="middle"):
        saltus.plot(chart, quantity="w")
