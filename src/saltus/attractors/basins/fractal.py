"""Measures of a grid of labels for fractal basin boundaries: basin entropy, uncertainty exponent,
Wada property.

None of them sees structure that is finer than a cell of the grid.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors.attractor import UNDECIDED
from saltus.checks import Numbers, answered, check_count, check_size, real_array
from saltus.errors import ParameterError
from saltus.result import Result, result_dataset

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class FractalSettings:
    """The numbers by which a grid of labels is judged."""

    radius: int = 5  # Within this number of cells, a cell of a Wada boundary must meet all labels.
    # Larger shares of uncertain cells are not fitted: strips along the boundary overlap then.
    most_uncertain: float = 0.5
    # Basins have the Wada property if at least this share of the boundary cells meets all labels.
    agrees: float = 0.9
    fails: float = 0.5  # They do not have it if at most this share does.


FRACTAL = FractalSettings()


@dataclass(frozen=True)
class BasinEntropy:
    """Basin entropy of a grid cut into boxes (Daza et al., Sci. Rep. 6 (2016) 31416).

    Attributes
    ----------
    entropy
        S_b: the mean over all boxes of sum_j p_j ln(1 / p_j), p_j the share of label j in the box.
    boundary
        S_bb: the mean over the boxes with more than one label; nan where there are none.
    boxes
        How many boxes were counted.
    boundary_boxes
        How many of them hold more than one label.
    box
        How many cells a box has along a side.

    Examples
    --------
    >>> halves = np.repeat([np.arange(64) > 31], 64, axis=0).astype(int)
    >>> saltus.attractors.basin_entropy(halves).fractal
    False
    """

    entropy: float
    boundary: float
    boxes: int
    boundary_boxes: int
    box: int

    @property
    def fractal(self) -> bool:
        """Whether S_bb > ln 2, which shows that the boundary is fractal; S_bb of a fractal boundary
        may also be smaller.
        """
        return self.boundary > math.log(2.0)


@answered
def basin_entropy(labels: Numbers, box: int = 5) -> BasinEntropy:
    """The basin entropy of a grid of labels, in one or two dimensions, in boxes of `box` cells a
    side.

    Incomplete boxes at the far edges, and boxes with an undecided cell (-1), are left out. The
    criterion S_bb > ln 2 is for boundaries that separate two labels almost everywhere, so that few
    boxes hold three.

    Parameters
    ----------
    labels
        Whole numbers, a label for each cell of a grid, (n,) or (rows, columns); -1 is undecided.
    box
        How many cells a box has along a side.

    Raises
    ------
    ParameterError
        A grid smaller than a box.

    Examples
    --------
    >>> halves = np.repeat([np.arange(64) > 31], 64, axis=0).astype(int)
    >>> bool(saltus.attractors.basin_entropy(halves).boundary < np.log(2))  # no sign of a fractal boundary
    True
    """
    grid = _labels(labels)
    check_count("box", box, 2)
    if min(grid.shape) < box:
        raise ParameterError(
            f"a grid of {grid.shape} cells has no box of {box}; take a finer grid or a smaller box",
            "box",
        )
    cut = grid[tuple(slice(0, n - n % box) for n in grid.shape)]
    boxes = _boxes(cut, box)
    boxes = boxes[(boxes != UNDECIDED).all(axis=1)]
    entropy = np.zeros(len(boxes))
    mixed = np.zeros(len(boxes), dtype=int)
    for label in np.unique(boxes):
        share = (boxes == label).mean(axis=1)
        entropy -= share * np.log(np.where(share > 0.0, share, 1.0))
        mixed += share > 0.0
    edge = mixed > 1
    mean = float(entropy.mean()) if len(boxes) else math.nan
    return BasinEntropy(
        mean,
        float(entropy[edge].mean()) if edge.any() else math.nan,
        len(boxes),
        int(edge.sum()),
        int(box),
    )


def _boxes(grid: np.ndarray, box: int) -> np.ndarray:
    """The cells of each box in a row."""
    if grid.ndim == 1:
        return grid.reshape(-1, box)
    rows = grid.shape[0] // box
    columns = grid.shape[1] // box
    return grid.reshape(rows, box, columns, box).swapaxes(1, 2).reshape(-1, box * box)


@dataclass(frozen=True, eq=False)
class UncertaintyExponent(Result):
    """The exponent alpha in f(eps) ~ eps^alpha, f the share of states with a different end within a
    distance eps of them (Grebogi et al., Phys. Lett. A 99 (1983) 415).

    Attributes
    ----------
    alpha
        1 for a smooth boundary, towards 0 the more fractal it is; nan without a boundary.
    error
        The standard error of the fit.
    distances
        The distances eps, in cells.
    shares
        The share f of uncertain cells at each of them.
    cells
        The dimensions of the grid, 1 or 2.

    Examples
    --------
    >>> halves = np.repeat([np.arange(64) > 31], 64, axis=0).astype(int)
    >>> round(float(saltus.attractors.uncertainty_exponent(halves).dimension), 2)  # of a line
    1.0
    """

    alpha: float
    error: float
    distances: np.ndarray
    shares: np.ndarray
    cells: int

    @property
    def dimension(self) -> float:
        """The dimension of the boundary, D - alpha."""
        return self.cells - self.alpha

    def to_xarray(self) -> xarray.Dataset:
        """`share` over `distance`, with `alpha`, its `error` and the `dimension` as attributes."""
        columns = {
            "share": (
                "distance",
                self.shares,
                "1",
                "states with a different end within the distance",
            )
        }
        facts: dict[str, Any] = {
            "alpha": self.alpha,
            "error": self.error,
            "dimension": self.dimension,
        }
        return result_dataset(
            "uncertainty_exponent", columns, {"distance": self.distances}, **facts
        )


@answered
def uncertainty_exponent(
    labels: Numbers, distances: Iterable[int] | None = None
) -> UncertaintyExponent:
    """The uncertainty exponent of a grid of labels, in one or two dimensions.

    A cell is uncertain at eps if a cell with another label lies within eps cells of it along each
    axis; undecided cells do not count. Cells nearer to the edge of the grid than the largest eps
    are left out. The slope of ln f over ln eps is fitted, with its standard error. The distances
    are 1, 2, 3, 4, 6, 8, ... up to 1/16 of the grid. Those count at which f is below 0.5, or over
    all if fewer than three of them are.

    Parameters
    ----------
    labels
        Whole numbers, a label for each cell of a grid, (n,) or (rows, columns); -1 is undecided.
    distances
        The distances eps, in cells.

    Raises
    ------
    ParameterError
        A grid too small for three distances; distances that are no whole numbers.

    Examples
    --------
    >>> halves = np.repeat([np.arange(64) > 31], 64, axis=0).astype(int)
    >>> round(float(saltus.attractors.uncertainty_exponent(halves).alpha), 2)  # of a smooth boundary
    1.0
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    grid = _labels(labels)
    reach = _distances(grid, distances)
    inner = tuple(slice(int(reach[-1]), n - int(reach[-1])) for n in grid.shape)
    known = grid != UNDECIDED
    high = np.where(known, grid, grid.min())
    low = np.where(known, grid, grid.max() + 1)
    high = np.where(known, high, UNDECIDED)
    shares = np.array(
        [
            ((maximum_filter(high, 2 * int(k) + 1) > minimum_filter(low, 2 * int(k) + 1)) & known)[
                inner
            ].sum()
            / max(int(known[inner].sum()), 1)
            for k in reach
        ]
    )
    alpha, error = _slope(reach, shares)
    return UncertaintyExponent(alpha, error, reach, shares, grid.ndim)


def _distances(grid: np.ndarray, given: Iterable[int] | None) -> np.ndarray:
    largest = min(grid.shape) // 16
    steps = [k for p in range(20) for k in (2**p, 3 * 2 ** (p - 1)) if k == int(k) and k <= largest]
    reach = np.unique(np.array(steps if given is None else list(given), dtype=float))
    if (
        len(reach) < 3
        or not np.equal(reach, np.round(reach)).all()
        or reach[0] < 1
        or 4 * reach[-1] > min(grid.shape)
    ):
        raise ParameterError(
            "the exponent needs at least three distances, whole numbers of cells up to a quarter"
            f" of the grid {grid.shape}; got {reach.tolist()}: take a finer grid, 64 cells a side"
            " or more",
            "distances",
        )
    return reach.astype(int)


def _slope(reach: np.ndarray, shares: np.ndarray) -> tuple[float, float]:
    """The slope of ln f over ln eps and its standard error."""
    used = (shares > 0.0) & (shares < FRACTAL.most_uncertain)
    if used.sum() < 3:
        used = shares > 0.0
    if used.sum() < 3:
        return math.nan, math.nan
    x = np.log(reach[used])
    y = np.log(shares[used])
    x = x - x.mean()
    slope = float(x @ y / (x @ x))
    residual = y - y.mean() - slope * x
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / (x @ x)))


class WadaVerdict(StrEnum):
    """Whether basins have the Wada property."""

    WADA = "wada"
    NOT_WADA = "not wada"
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False)
class Wada(Result):
    """The share of a boundary that lies near all basins (after Daza et al., Sci. Rep. 5 (2015)
    16579).

    Attributes
    ----------
    labels
        The labels of the grid.
    radii
        The radii of the neighbourhoods, in cells.
    shares
        The share of the boundary cells that have all labels within each of these radii.
    boundary_cells
        How many cells lie at a boundary.

    Examples
    --------
    >>> thirds = np.repeat([np.arange(63) // 21], 63, axis=0)
    >>> saltus.attractors.wada(thirds).labels
    (0, 1, 2)
    """

    labels: tuple[int, ...]
    radii: np.ndarray
    shares: np.ndarray
    boundary_cells: int

    @property
    def verdict(self) -> WadaVerdict:
        """The verdict by the share at the largest radius; fewer than three basins do not have the
        Wada property.
        """
        share = self.shares[-1] if len(self.shares) else 0.0
        if len(self.labels) < 3 or share <= FRACTAL.fails:
            return WadaVerdict.NOT_WADA
        return WadaVerdict.WADA if share >= FRACTAL.agrees else WadaVerdict.UNDECIDED

    def to_xarray(self) -> xarray.Dataset:
        """`share` over `radius`, with the verdict as an attribute."""
        columns = {
            "share": (
                "radius",
                self.shares,
                "1",
                "boundary cells that have all labels within the radius",
            )
        }
        facts: dict[str, Any] = {
            "labels": list(self.labels),
            "verdict": str(self.verdict),
            "boundary_cells": self.boundary_cells,
        }
        return result_dataset(
            "wada",
            columns,
            {"radius": self.radii},
            **facts,
            agrees=FRACTAL.agrees,
            fails=FRACTAL.fails,
        )

    @property
    def resolution(self) -> str:
        """The resolution of the test, in a sentence."""
        return (
            f"a boundary cell meets all {len(self.labels)} basins if each has a cell within"
            f" {int(self.radii[-1])} cells of it: basins that part there on a finer scale look like"
            " Wada ones, and threads finer than a cell are not seen"
        )


@answered
def wada(labels: Numbers, radius: int = FRACTAL.radius) -> Wada:
    """Whether every point on the boundary of one basin is on the boundaries of all basins, as far
    as a grid of labels shows it.

    Boundary cells have a neighbour, along an axis or diagonally, with another label. Around each of
    them a neighbourhood grows, up to `radius` cells, until it contains all labels. If the basins
    have the Wada property, nearly all neighbourhoods do in the end; if three basins meet at single
    points only, nearly none does. Undecided cells (-1) count as no label.

    Parameters
    ----------
    labels
        Whole numbers, a label for each cell of a grid, (n,) or (rows, columns); -1 is undecided.
    radius
        The largest radius of the neighbourhoods, in cells.

    Raises
    ------
    ParameterError
        Labels that are no grid, a radius below 1.

    Examples
    --------
    >>> thirds = np.repeat([np.arange(63) // 21], 63, axis=0)
    >>> float(saltus.attractors.wada(thirds).shares[0])  # no cell of the boundary sees all three stripes
    0.0
    """
    from scipy.ndimage import distance_transform_cdt, maximum_filter, minimum_filter

    grid = _labels(labels)
    check_count("radius", radius, 1)
    known = [int(label) for label in np.unique(grid) if label != UNDECIDED]
    radii = np.arange(1, int(radius) + 1)
    if len(known) < 2:
        return Wada(tuple(known), radii, np.zeros(len(radii)), 0)
    low = np.where(grid == UNDECIDED, grid.max() + 1, grid)
    boundary = (maximum_filter(grid, 3) > minimum_filter(low, 3)) & (grid != UNDECIDED)
    farthest = np.max(
        [distance_transform_cdt(grid != label, "chessboard")[boundary] for label in known], axis=0
    )
    shares = np.array([(farthest <= r).mean() for r in radii])
    return Wada(tuple(known), radii, shares, int(boundary.sum()))


def _labels(labels: Any) -> np.ndarray:
    """The labels as an array of whole numbers, of one or two dimensions."""
    check_size(labels, "labels")
    try:
        array = real_array(labels)
        grid = array.astype(int)
    except (TypeError, ValueError, OverflowError):
        array = np.empty((0, 0))
        grid = np.empty((0, 0), dtype=int)
    if grid.ndim not in (1, 2) or not grid.size or not np.array_equal(array, grid):
        raise ParameterError(
            "labels must be whole numbers over one or two dimensions, got an array of shape"
            f" {np.shape(labels)}",
            "labels",
        )
    return grid
