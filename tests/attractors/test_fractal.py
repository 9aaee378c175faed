"""Measures of basins against closed forms: half planes, a Cantor set, noise, sectors, the basins of
Newton's method.
"""

import math

import numpy as np
import pytest

from saltus.attractors.basins.fractal import basin_entropy, uncertainty_exponent, wada
from saltus.errors import ParameterError


def newton(n: int) -> np.ndarray:
    """Which cube root of 1 Newton's method finds from each point of a square: three basins with one
    common boundary.
    """
    x = np.linspace(-1.5, 1.5, n) + 0.0071
    z = x[None, :] + 1j * x[:, None]
    for _ in range(60):
        z = z - (z**3 - 1.0) / (3.0 * z**2)
    return np.argmin(np.abs(z[..., None] - np.exp(2j * math.pi * np.arange(3) / 3.0)), axis=-1)


def sectors(n: int) -> np.ndarray:
    """Three sectors of 120 degrees, which meet in one point."""
    x = np.linspace(-1.0, 1.0, n) + 0.0013
    return np.floor(
        (np.arctan2(x[:, None], x[None, :]) + math.pi) / (2.0 * math.pi / 3.0 + 1e-9)
    ).astype(int)


def cantor(generations: int) -> np.ndarray:
    """A line of 3^g cells, the removed thirds labelled by turns: its boundary is the middle-thirds
    Cantor set.
    """
    labels = np.zeros(1, dtype=int)
    for generation in range(generations):
        third = len(labels)
        middle = np.full(third, 1 + generation % 2)
        labels = np.concatenate([labels, middle, labels])
    return labels


def test_the_entropy_of_a_half_plane_is_counted_by_hand() -> None:
    labels = np.zeros((100, 100), dtype=int)
    labels[:, 52:] = 1  # in one of the 20 columns of boxes: 2 of 5 cells on one side
    found = basin_entropy(labels, box=5)
    mixed = -(0.4 * math.log(0.4) + 0.6 * math.log(0.6))
    assert found.boundary == pytest.approx(mixed, rel=1e-12)
    assert found.entropy == pytest.approx(mixed / 20.0, rel=1e-12)
    assert (found.boxes, found.boundary_boxes) == (400, 20)
    assert not found.fractal


def test_the_entropy_of_noise_is_that_of_its_labels() -> None:
    labels = np.random.default_rng(0).integers(0, 4, (400, 400))
    found = basin_entropy(labels, box=20)
    # Miller's bias of 400 samples
    assert found.entropy == pytest.approx(math.log(4.0) - 3.0 / (2.0 * 400), abs=2e-4)
    assert found.fractal


def test_undecided_boxes_and_incomplete_ones_are_left_out() -> None:
    labels = np.zeros((23, 23), dtype=int)
    labels[0, 0] = -1
    labels[22, :] = 7
    found = basin_entropy(labels, box=5)
    assert (found.boxes, found.boundary_boxes, found.entropy) == (15, 0, 0.0)
    assert math.isnan(found.boundary)


@pytest.mark.parametrize("turned", [False, True], ids=["straight", "diagonal"])
def test_the_exponent_of_a_smooth_boundary_is_1(turned: bool) -> None:
    i, j = np.indices((256, 256))
    found = uncertainty_exponent((j > i) if turned else (j > 120))
    assert found.alpha == pytest.approx(1.0, abs=0.03 if turned else 1e-12)
    assert found.dimension == pytest.approx(1.0, abs=0.03)


def test_the_exponent_of_a_cantor_set_is_its_codimension() -> None:
    found = uncertainty_exponent(cantor(10), distances=[1, 3, 9, 27, 81])
    assert found.alpha == pytest.approx(1.0 - math.log(2.0) / math.log(3.0), abs=0.02)
    assert found.error < 0.02


def test_the_exponent_of_noise_is_0() -> None:
    labels = np.random.default_rng(1).integers(0, 2, (256, 256))
    assert uncertainty_exponent(labels).alpha == pytest.approx(0.0, abs=0.01)


def test_one_basin_has_no_exponent() -> None:
    assert math.isnan(uncertainty_exponent(np.zeros((64, 64), dtype=int)).alpha)


def test_undecided_cells_make_no_cell_uncertain() -> None:
    labels = np.zeros((64, 64), dtype=int)
    labels[30, 30] = -1
    assert not uncertainty_exponent(labels).shares.any()
    assert wada(labels).boundary_cells == 0


def test_newtons_basins_are_wada_and_sectors_are_not() -> None:
    found = wada(newton(400))
    assert found.verdict == "wada"
    parted = wada(sectors(400))
    assert parted.verdict == "not wada"
    # each of the three rays is a boundary two cells wide, and all basins are within 5 cells only
    # next to the centre
    assert parted.shares[-1] < 5 * 2 * 5 / parted.boundary_cells * 3


def test_two_basins_are_never_wada() -> None:
    assert wada(np.random.default_rng(2).integers(0, 2, (64, 64))).verdict == "not wada"


def test_newtons_basins_are_fractal_by_the_exponent_too() -> None:
    found = uncertainty_exponent(newton(512))
    assert found.alpha < 0.75
    assert not found.alpha + 3.0 * found.error > 1.0


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: basin_entropy(np.zeros((3, 3), int)), "no box of 5"),
        (lambda: basin_entropy([[0.5]]), "whole numbers"),
        (lambda: uncertainty_exponent(np.zeros((20, 20), int)), "finer grid"),
        (lambda: wada(np.zeros((2, 2, 2), int)), "one or two dimensions"),
        (lambda: wada(np.zeros((9, 9), int), radius=0), "radius"),
    ],
)
def test_senseless_grids_are_refused(call, says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        call()
