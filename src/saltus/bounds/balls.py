"""Balls, midpoint and radius, as arrays; rigorous products, sums and linear systems of them.

A ball stands for all real numbers within `radius` of `middle`.
Every operation encloses the exact result for all numbers of its operands: it adds a bound of its
own rounding to the radius.
Assumed are IEEE doubles, rounded to nearest; sums may be taken in any order and with fused
multiply-adds (as BLAS does).
A radius that is NaN or infinite encloses nothing, and no comparison with it holds.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Above 2^-53, the relative rounding of one operation, by more than its own products.
EPS = 2.3e-16
# Above the rounding of the few operations with which a radius itself is computed.
UP = 1.0 + 1e-14
TINY = 1e-290  # above what underflow loses
# The rows from which on zeros of shooting equations are left out.
SPARSE_FROM = 120
# 2 pi less the double nearest to it is 2.449e-16 (Payne and Hanek's digits:
# 6.283185307179586476...)
TWO_PI_RADIUS = 2.5e-16


class Ball:
    """Real numbers within `radius` of `middle`; both are arrays of one shape."""

    __slots__ = ("middle", "radius")
    __array_ufunc__ = None

    def __init__(self, middle: Any, radius: Any = 0.0) -> None:
        self.middle = np.asarray(middle, dtype=float)
        radius = np.asarray(radius, dtype=float)
        if radius.shape != self.middle.shape:
            radius = np.broadcast_to(radius, self.middle.shape).copy()
        self.radius = radius

    def __add__(self, other: Any) -> Ball:
        right = as_ball(other)
        middle = self.middle + right.middle
        return Ball(middle, (self.radius + right.radius + EPS * np.abs(middle)) * UP)

    def __neg__(self) -> Ball:
        return Ball(-self.middle, self.radius)

    def __sub__(self, other: Any) -> Ball:
        return self + -as_ball(other)

    def __rsub__(self, other: Any) -> Ball:
        return as_ball(other) - self

    def __mul__(self, other: Any) -> Ball:
        right = as_ball(other)
        middle = self.middle * right.middle
        spread = np.abs(self.middle) * right.radius
        spread = spread + self.radius * (np.abs(right.middle) + right.radius)
        return Ball(middle, (spread + EPS * np.abs(middle)) * UP + TINY)

    def __radd__(self, other: Any) -> Ball:
        return self.__add__(other)

    def __rmul__(self, other: Any) -> Ball:
        return self.__mul__(other)

    def __truediv__(self, other: Any) -> Ball:
        right = as_ball(other)
        with np.errstate(all="ignore"):
            middle = self.middle / right.middle
            spread = self.radius + np.abs(middle) * right.radius
            below = np.abs(right.middle) - right.radius
            radius = (spread / below + 2.0 * EPS * np.abs(middle)) * UP + TINY
        # A divisor that may be 0 encloses nothing.
        return Ball(middle, np.where(below > 0.0, radius, np.nan))

    def __getitem__(self, key: Any) -> Ball:
        return Ball(self.middle[key], self.radius[key])

    def reshape(self, *shape: int) -> Ball:
        """The same balls in another shape."""
        return Ball(self.middle.reshape(*shape), self.radius.reshape(*shape))

    def scaled(self, factors: np.ndarray) -> Ball:
        """Times powers of two, which leave no rounding."""
        return Ball(self.middle * factors, self.radius * factors)

    @property
    def transposed(self) -> Ball:
        """With the last two axes exchanged."""
        return Ball(np.swapaxes(self.middle, -1, -2), np.swapaxes(self.radius, -1, -2))

    @property
    def column(self) -> Ball:
        """With one more axis, of length 1, at the end."""
        return Ball(self.middle[..., None], self.radius[..., None])

    @property
    def low(self) -> np.ndarray:
        """A lower bound of every number."""
        return np.asarray(
            (self.middle - self.radius) - EPS * np.abs(self.middle) - EPS * self.radius
        )

    @property
    def high(self) -> np.ndarray:
        """An upper bound of every number."""
        return np.asarray(
            (self.middle + self.radius) + EPS * np.abs(self.middle) + EPS * self.radius
        )

    @property
    def magnitude(self) -> np.ndarray:
        """An upper bound of every modulus."""
        return np.asarray((np.abs(self.middle) + self.radius) * UP)

    def sqrt(self) -> Ball:
        """The square root; of a ball that is not above 0 it encloses nothing."""
        with np.errstate(all="ignore"):
            root = np.sqrt(self.middle)
            below = np.sqrt(self.middle - self.radius)  # NaN where the ball reaches below 0
            radius = (self.radius / (root + below) + 2.0 * EPS * root) * UP
        return Ball(root, np.where(self.middle > self.radius, radius, np.nan))

    def inside(self, middle: np.ndarray, radius: np.ndarray) -> bool:
        """Whether every ball lies in the interior of middle +- radius."""
        distance = np.abs(self.middle - middle) * UP + self.radius + EPS * np.abs(middle)
        return bool((distance * UP < radius).all())


def as_ball(value: Any) -> Ball:
    """A number or an array becomes a ball without radius."""
    return value if isinstance(value, Ball) else Ball(value)


def product(left: Ball, right: Ball) -> Ball:
    """The product of matrices of balls.

    The rounding of BLAS is within gamma_n, in any order of its sums.
    """
    if right.middle.ndim == 2 and min(right.middle.shape) >= SPARSE_FROM and left.middle.ndim == 2:
        return _sparse_product(left, right)
    n = left.middle.shape[-1]
    sizes = np.abs(right.middle)
    rounding = (n + 2) * EPS * sizes
    spread = np.abs(left.middle) @ (right.radius + rounding)
    spread = spread + left.radius @ (sizes + right.radius)
    radius = spread * (1.0 + (n + 4) * EPS) * UP + (n + 1) * TINY
    return Ball(left.middle @ right.middle, radius)


def _sparse_product(left: Ball, right: Ball) -> Ball:
    """The same with a sparse right matrix, as that of shooting equations, whose row of blocks is
    the motion over one step: N^2 operations for N unknowns.

    What is left out are products with exact zeros; n is the number of the others in a sum.
    """
    from scipy import sparse

    entries = sparse.csc_array((right.middle != 0.0) | (right.radius != 0.0))
    n = int(np.diff(entries.indptr).max())
    middle = sparse.csc_array(right.middle)
    sizes = abs(middle)
    rounding = (n + 2) * EPS * sizes
    outer = sparse.csc_array(right.radius) + rounding
    spread = np.abs(left.middle) @ outer
    if left.radius.any():
        spread = spread + left.radius @ (sizes + outer)
    return Ball(left.middle @ middle, spread * (1.0 + (n + 4) * EPS) * UP + (n + 1) * TINY)


def powers_of_two(sizes: np.ndarray) -> np.ndarray:
    """The powers of two nearest to some sizes, by which numbers are scaled without rounding."""
    return np.asarray(np.exp2(np.round(np.log2(sizes))))


def nearly_inverse(matrix: np.ndarray) -> np.ndarray | None:
    """A matrix near the inverse; by elimination of blocks where it is large, N^2 operations for
    shooting equations. None where it is singular.

    Nothing is taken for granted of its accuracy.
    """
    try:
        if len(matrix) < SPARSE_FROM:
            return np.asarray(np.linalg.inv(matrix))
        from scipy import sparse
        from scipy.sparse.linalg import splu

        return np.asarray(splu(sparse.csc_matrix(matrix)).solve(np.eye(len(matrix))))
    except (np.linalg.LinAlgError, RuntimeError):
        return None


def solve(matrix: Ball, right: Ball) -> Ball | None:
    """An enclosure of X with `matrix` X = `right`, for all matrices of the ball.

    With R near the inverse and X0 near the solution, |X - X0| <= C + E (C_max / (1 - |E|)) where
    C = |R (right - matrix X0)| and E = |I - R matrix| (Rump, Acta Numerica 19, 2010, section 10).

    Returns
    -------
    Ball | None
        None where |E| < 1 could not be shown, so that a matrix of the ball may be singular.
    """
    size = len(matrix.middle)
    inverse = nearly_inverse(matrix.middle)
    if inverse is None:
        return None
    nearly = inverse @ right.middle
    rest = product(Ball(inverse), right - product(matrix, Ball(nearly))).magnitude
    defect = (Ball(np.eye(size)) - product(Ball(inverse), matrix)).magnitude
    rows = defect.sum(axis=1) * (1.0 + size * EPS) * UP
    norm = float(rows.max())
    if not norm < 1.0:
        return None
    error = rest + rows[:, None] * (rest.max(axis=0) / (1.0 - norm) * UP)
    return Ball(nearly, error * UP * UP)
