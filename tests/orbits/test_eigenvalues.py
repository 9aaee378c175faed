"""Eigenvalues of small and of large matrices."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from saltus.orbits.eigenvalues import MANY_ROWS, eigenvalues


def blas_threads() -> list[int]:
    return [library["num_threads"] for library in threadpool_info()]


@pytest.mark.parametrize("size", [6, MANY_ROWS, 90])
def test_a_turned_triangle_has_the_eigenvalues_of_its_diagonal(size: int) -> None:
    rng = np.random.default_rng(size)
    diagonal = np.linspace(-1.0, 1.0, size)
    triangle = np.diag(diagonal) + np.triu(rng.uniform(-0.01, 0.01, (size, size)), 1)
    turn = np.linalg.qr(rng.standard_normal((size, size)))[0]
    threads = blas_threads()
    assert np.sort_complex(eigenvalues(turn @ triangle @ turn.T)) == pytest.approx(
        diagonal, abs=1e-11
    )
    assert blas_threads() == threads  # what a user has chosen stays
