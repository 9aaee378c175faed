"""Records of samples inside a kernel: their piecewise polynomials, expanded about a time.

This part is compiled together with the lanes; `memory.py` runs the same functions while it writes the code of one motion.
"""

from __future__ import annotations

from saltus.taylor.kernel_functions import jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@jit
def anchor(breaks, piece):
    """The time that a record's piece counts from."""
    return breaks[max(piece - 1, 0)]


@jit
def own_records(tables, trajectory):
    """The breakpoints and the table of one trajectory; all trajectories share one of each if no breakpoint depends on it."""
    breaks, table = tables
    i = min(trajectory, breaks.shape[0] - 1)
    return breaks[i], table[i]


@jit
def expand_record(coefficients, start, t, row):
    """Taylor coefficients at `t` of a record's piece, given in powers of the time since `start`."""
    width = coefficients.size
    for k in range(width):
        row[k] = coefficients[k]
    for k in range(width - 1):  # repeated synthetic division: p(x + t - start)
        for j in range(width - 2, k - 1, -1):
            row[j] += (t - start) * row[j + 1]
