"""Eigenvalues of matrices of any size, without a wait for another processor core."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

# LAPACK works on several threads from about here on. They wait for each other at each of very many
# short products: where another program has one of the cores, 200 rows take 1.2 s, and 0.05 s on one
# thread.
MANY_ROWS = 32


@functools.cache
def _libraries() -> Any:
    """The libraries of linear algebra that this process has loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def eigenvalues(matrix: np.ndarray) -> np.ndarray:
    """The eigenvalues (n,) of a matrix (n, n), complex where it has pairs of them."""
    if len(matrix) < MANY_ROWS:
        return np.linalg.eigvals(matrix)
    with _libraries().limit(limits=1, user_api="blas"):
        return np.linalg.eigvals(matrix)
