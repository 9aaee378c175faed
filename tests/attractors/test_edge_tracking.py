"""The saddles between basins, found by tracking the edge, and the curves that a picture of basins
brings with it.
"""

import numpy as np
import pytest
import xarray
from scipy.spatial import cKDTree
from shared_systems import forced, steady

import saltus
from saltus.attractors.attractor_search import Attractors, find_attractors
from saltus.attractors.basins.basin_cells import Labelling
from saltus.attractors.basins.grid import basins_of_attraction, clipped, edge_saddles, edges
from saltus.systems import Window

SYSTEM = forced(W=0.88)
GRID = np.linspace(-2.5, 2.5, 31)


@pytest.fixture(scope="module")
def found() -> Attractors:
    return find_attractors(SYSTEM, starts=32)


@pytest.fixture(scope="module")
def picture(found: Attractors) -> xarray.Dataset:
    return basins_of_attraction(SYSTEM, theta=GRID, velocity=GRID, found=found, curves=True)


def label(found: Attractors, states: np.ndarray) -> np.ndarray:
    return Labelling(found.system, found.targets, 500, 1e-2, 1e-11).of(states)[0]


@pytest.mark.thorough
def test_the_edge_is_between_two_ends_as_near_as_rounding_lets_it_be(
    found: Attractors, picture: xarray.Dataset
) -> None:
    low, high = edges(lambda states: label(found, states), picture["label"].values, GRID, GRID)
    assert len(low) == 12
    assert np.abs(high - low).max() < 1e-13
    assert (label(found, low) != label(found, high)).all()


@pytest.mark.thorough
def test_it_leads_to_the_saddle_of_the_branch(found: Attractors, picture: xarray.Dataset) -> None:
    low, high = edges(lambda states: label(found, states), picture["label"].values, GRID, GRID)
    (saddle,) = edge_saddles(SYSTEM, low, high)
    branch = saltus.continue_orbit(found.of(1).orbit, "load.frequency", (0.8, 1.0))
    (expected,) = (orbit for orbit in branch.at(0.88) if not orbit.stable)
    assert saddle.amplitude == pytest.approx(expected.amplitude, rel=1e-9)


@pytest.mark.thorough
def test_a_picture_brings_the_curves_where_its_basins_meet(picture: xarray.Dataset) -> None:
    labels = picture["label"].values
    rows, columns = np.nonzero(labels[:, 1:] != labels[:, :-1])
    edge = np.stack([0.5 * (GRID[columns] + GRID[columns + 1]), GRID[rows]], axis=1)
    curve = np.stack(
        [picture["boundary_theta"].values, picture["boundary_velocity"].values], axis=1
    )
    assert cKDTree(curve[np.isfinite(curve).all(axis=1)]).query(edge)[0].max() < GRID[1] - GRID[0]


def test_under_a_constant_load_they_are_separatrices() -> None:
    picture = basins_of_attraction(steady(), theta=GRID, velocity=GRID, curves=True)
    start = np.array([picture["boundary_theta"].values[0], picture["boundary_velocity"].values[0]])
    assert (
        abs(
            float(steady().model.acceleration(0.0, start[0], 0.0, np.sign(start[0]), steady().load))
        )
        < 1e-5
    )
    assert abs(start[1]) < 1e-5


def test_one_basin_has_no_curves() -> None:
    picture = basins_of_attraction(forced(), theta=GRID[::6], velocity=GRID[::6], curves=True)
    assert picture["boundary_theta"].size == 0


def test_curves_are_cut_at_the_window() -> None:
    line = np.stack([np.linspace(-4.0, 4.0, 81), np.zeros(81)], axis=1)
    shown = clipped([line, line], Window(((-1.0, 1.0), (-1.0, 1.0))))
    assert np.nanmax(np.abs(shown)) == pytest.approx(1.5)
    gaps = np.isnan(shown[:, 0])
    assert gaps.sum() == 2
    assert not (gaps[1:] & gaps[:-1]).any()
