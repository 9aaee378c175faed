"""Linear complementarity problems of a few contacts, solved by trying all sets of acting contacts.

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.layout import VIOLATED
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def eliminate(block, size, columns):
    """Solve a linear system in place: the rows of `block` hold its matrix and its right-hand sides; False if it is singular."""
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(block[i, k]) > abs(block[pivot, k]):
                pivot = i
        if block[pivot, k] == 0.0:
            return False
        for j in range(columns):
            block[k, j], block[pivot, j] = block[pivot, j], block[k, j]
        for i in range(size):
            if i != k and block[i, k] != 0.0:
                factor = block[i, k] / block[k, k]
                for j in range(k, columns):
                    block[i, j] -= factor * block[k, j]
        for j in range(columns - 1, k - 1, -1):
            block[k, j] /= block[k, k]
    return True


@lean_jit
def invert(numbers, size, block, inverse):
    """The inverse of a matrix that is given by its rows; False if it is singular."""
    for i in range(size):
        for j in range(size):
            block[i, j] = numbers[i * size + j]
            block[i, size + j] = 1.0 if i == j else 0.0
    regular = eliminate(block, size, 2 * size)
    for i in range(size):
        for j in range(size):
            inverse[i, j] = block[i, size + j]
    return regular


@lean_jit
def acting(matrix, right, size, bits, block, z):
    """Find z such that right + matrix z = 0 in the rows in `bits`, with z = 0 in the other rows; False if there is none."""
    count = 0
    for i in range(size):
        z[i] = 0.0
        if bits >> i & 1:
            column = 0
            for j in range(size):
                if bits >> j & 1:
                    block[count, column] = matrix[i, j]
                    column += 1
            block[count, column] = -right[i]
            count += 1
    if not eliminate(block, count, count + 1):
        return False
    place = 0
    for i in range(size):
        if bits >> i & 1:
            z[i] = block[place, count]
            place += 1
    return True


@lean_jit
def complementary(matrix, right, size, block, tried, z):
    """Find z with 0 <= z _|_ right + matrix z >= 0; returns the bits of the rows that act (z > 0), or -1 if there is no solution.

    The first set of acting rows that violates no inequality is taken; if all violate some, the set with the smallest violation,
    as long as that may be rounding.
    """
    found, least, scale = -1, np.inf, 0.0
    for i in range(size):
        scale = max(scale, abs(right[i]))
    for bits in range(1 << size):
        if not acting(matrix, right, size, bits, block, tried):
            continue
        worst = 0.0
        for i in range(size):
            if bits >> i & 1:
                worst = max(worst, -tried[i] * abs(matrix[i, i]))
            else:
                left = right[i]
                for j in range(size):
                    left += matrix[i, j] * tried[j]
                worst = max(worst, -left)
        if worst < least:
            found, least = bits, worst
            for i in range(size):
                z[i] = tried[i]
        if worst <= 0.0:
            break
    return found if least <= VIOLATED * scale else -1
