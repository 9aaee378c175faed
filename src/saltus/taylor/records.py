"""Records of samples inside a kernel: pieces of polynomials, expanded or evaluated at a time.

This text is compiled together with the functions of each structure (see `compile.py`).
"""

from __future__ import annotations

from saltus.taylor.private_numba import jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def anchor(breaks, piece):
    """The time that a record's piece counts from."""
    return breaks[max(piece - 1, 0)]


@jit
def expand_record(coefficients, start, t, row):
    """Taylor coefficients at `t` of a record's piece, given in powers of the time since `start`."""
    width = coefficients.size
    for k in range(width):
        row[k] = coefficients[k]
    for k in range(width - 1):  # repeated synthetic division: p(x + t - start)
        for j in range(width - 2, k - 1, -1):
            row[j] += (t - start) * row[j + 1]


@jit
def record_value(coefficients, start, t):
    """A record's piece at `t`."""
    value = 0.0
    for k in range(coefficients.size - 1, -1, -1):
        value = value * (t - start) + coefficients[k]
    return value
