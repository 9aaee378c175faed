"""The arrays in which impacts and closed contacts are solved for.

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.memory import SolverArrays
from saltus.taylor import jit, lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def zeros(count):
    """An array of zeros, made in a function of its own because numba would compile `np.zeros` anew at each call of it."""
    return np.zeros(count)


@jit
def rows_of_zeros(rows, columns):
    """An array of zeros with two indices."""
    return np.zeros((rows, columns))


@jit
def solver_arrays(own, count, columns, frictions):
    """The arrays in which impacts are solved for, for so many columns of a tangent."""
    most, numbers = max(2 * own, count + 1), own * own + count * count + count + frictions
    return SolverArrays(
        zeros(numbers),
        rows_of_zeros(own, own),
        rows_of_zeros(count, count),
        rows_of_zeros(max(own, count), most),
        rows_of_zeros(count, count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(count),
        zeros(columns * numbers),
        zeros(own),
        zeros(columns),
        rows_of_zeros(columns, count),
    )


@lean_jit
def copy_all(given, target):
    """Copy an array into another one; numba's assignment of slices would take seconds to compile."""
    for i in range(given.size):
        target[i] = given[i]
