"""Linear complementarity problems of contacts: of a few solved by trying all sets of acting contacts, of many by exchanges.

An exchange adds the rows of which the inequality is violated to those that act, or takes them away. All of them are exchanged as
long as fewer and fewer are violated, and else the first one alone. With the first one alone the method ends at the only solution
of a problem with a positive definite matrix (Murty 1974).

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.layout import MOST_TRIED, VIOLATED
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
def exchanged(bits, wrong, least):
    """The bits after an exchange of those in `wrong`, and how few of them there have been."""
    count, left = 0, wrong
    while left:
        left &= left - 1
        count += 1
    return bits ^ (wrong if count < least else wrong & -wrong), min(count, least)


@lean_jit
def by_exchange(matrix, right, size, rounding, block, z):
    """As `complementary`, by exchanges: whether a solution is found, and the bits of the rows that act."""
    bits, least = 0, size + 1
    for _ in range(size * size):
        if not acting(matrix, right, size, bits, block, z):
            return False, 0
        wrong = 0
        for i in range(size):
            left = -z[i] * abs(matrix[i, i])
            if not bits >> i & 1:
                left = -right[i]
                for j in range(size):
                    left -= matrix[i, j] * z[j]
            wrong |= 1 << i if left > rounding else 0
        if not wrong:
            return True, bits
        bits, least = exchanged(bits, wrong, least)
    return False, 0


@lean_jit
def complementary(matrix, right, size, block, tried, z):
    """Find z with 0 <= z _|_ right + matrix z >= 0; returns whether there is one, and the bits of the rows that act (z > 0).

    The first set of acting rows that violates no inequality is taken; if all violate some, the set with the smallest violation,
    as long as that may be rounding.
    """
    found, least, scale = 0, np.inf, 0.0
    for i in range(size):
        scale = max(scale, abs(right[i]))
    if size > MOST_TRIED:
        return by_exchange(matrix, right, size, VIOLATED * scale, block, z)
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
    return least <= VIOLATED * scale, found
