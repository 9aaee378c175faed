"""The integrity of basins: of shapes whose measures are known, and the distance from a separatrix
whose energy is known.
"""

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import minimize_scalar

import saltus
from saltus.errors import ParameterError


def picture(label, across, up, states):
    """A dataset as `basins_of_attraction` makes it: two attractors, 1 with these states."""
    section = {
        f"section_{name}": (("attractor", "state"), [column, np.full(len(column), np.nan)])
        for name, column in states.items()
    }
    data = {"label": (("velocity", "x"), label), **section}
    return xr.Dataset(
        data, {"x": across, "velocity": up, "attractor": [1, 2]}, {"plane": ["x", "velocity"]}
    )


def disc(n=201, radius=0.6, middle=(0.1, -0.05), state=(0.3, -0.05)):
    across, up = np.linspace(-1.0, 1.0, n), np.linspace(-0.9, 0.9, n)
    inside = np.hypot(across[None, :] - middle[0], up[:, None] - middle[1]) < radius
    return picture(np.where(inside, 1, 2), across, up, {"x": [state[0]], "velocity": [state[1]]})


def test_a_disc_has_its_area_its_radius_and_the_distance_of_its_attractor():
    found = saltus.basin_integrity(disc()).sel(attractor=1)
    assert float(found.area) == pytest.approx(np.pi * 0.36, rel=2e-3)
    assert float(found.factor) == pytest.approx(0.6, abs=0.015)
    assert found.centre.values == pytest.approx([0.1, -0.05], abs=0.02)
    assert float(found.distance) == pytest.approx(0.4, abs=0.015)
    assert np.isnan(found.distance_from_curve)


def test_grids_converge_to_the_measures_of_the_disc():
    errors = [
        abs(float(saltus.basin_integrity(disc(n)).sel(attractor=1).factor) - 0.6) for n in (51, 401)
    ]
    assert errors[1] < errors[0] / 4


def test_the_distance_from_a_circle_is_exact_from_few_of_its_points():
    """Forty points of a circle of radius 1: chords would be wrong by 3e-3, the curve through the
    points is right to 1e-7.
    """
    angle = np.linspace(0.0, 2 * np.pi, 40)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    broken = np.concatenate([circle[:20], [[np.nan, np.nan]], circle[19:]])
    found = saltus.basin_integrity(disc(state=(0.25, 0.1)), [broken]).sel(attractor=1)
    assert float(found.distance_from_curve) == pytest.approx(1 - np.hypot(0.25, 0.1), abs=2e-7)


def test_the_distance_of_rest_from_the_separatrices_of_a_tristable_cell_is_that_of_their_energy():
    """Without loss v^2 / 2 + V(theta) is that of the saddle all along its separatrix."""
    cell = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80)), load=saltus.Load(vertical=-1.5)
    )
    curves = saltus.separatrices(cell, window=((-2.0, 2.0), (-2.0, 2.0)), step=0.1)
    states = [np.stack([curve.theta, curve.velocity], axis=1) for curve in curves]
    saddle = max(curve.saddle for curve in curves)
    barrier = saltus.theory.potential_energy(cell, saddle)

    def away(theta):
        return np.hypot(
            theta, np.sqrt(2 * max(barrier - saltus.theory.potential_energy(cell, theta), 0.0))
        )

    expected = minimize_scalar(
        away, bounds=(0.0, saddle), method="bounded", options={"xatol": 1e-12}
    ).fun
    found = saltus.basin_integrity(disc(state=(0.0, 0.0)), states).sel(attractor=1)
    # it begins 1e-6 beside the saddle
    assert float(found.distance_from_curve) == pytest.approx(expected, abs=1e-6)


def test_a_basin_that_is_the_whole_grid_is_bounded_by_it_alone():
    data = disc(radius=9.0)
    found = saltus.basin_integrity(data)
    assert np.isinf(found.distance[0])
    assert float(found.factor[0]) == pytest.approx(0.9045, abs=1e-3)
    assert float(found.area[1]) == 0.0


def test_another_dataset_and_another_shape_are_refused():
    with pytest.raises(ParameterError, match="basins must be the dataset of basins_of_attraction"):
        saltus.basin_integrity(xr.Dataset())
    with pytest.raises(ParameterError, match=r"curves must be arrays of states, \(n, 2\)"):
        saltus.basin_integrity(disc(), [np.zeros(3)])
