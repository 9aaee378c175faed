"""The equations of an orbit with several contacts, from the segments that have been followed: the
chain rule from event to event.

For few coordinates NumPy's calls would take many times longer than what they compute. The compiled
part is a module of its own, with the layout of the segments' results.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.kernel.contact_layout import SegmentEnd
from saltus.taylor import cached_jit, jit

# --- compiled from here on ---------------------------------------------------


@jit
def chained(factor, matrix, product):
    """Write the product of two matrices into the first rows of a third one."""
    for i in range(factor.shape[0]):
        for j in range(matrix.shape[1]):
            product[i, j] = 0.0
        for k in range(factor.shape[1]):
            share = factor[i, k]
            if share != 0.0:
                for j in range(matrix.shape[1]):
                    product[i, j] += share * matrix[k, j]


@jit
def add_phases(end, column, span, frequency, phase, place, at_end):
    """Add to derivatives at a segment's end those to the phases of its start and its end, in the
    columns from `phase` on. Those to the frequency, at fixed phases, are in the column `place`.
    Negative columns are none.
    """
    own = column.shape[0] // 2
    for i in range(2 * own + 1):
        if i == 2 * own:
            by_start = end[SegmentEnd.BY_START]
            by_end = end[SegmentEnd.BY_END]
        else:
            by_start = 0.0
            for j in range(2 * own):
                by_start -= column[i, j] * end[SegmentEnd.NUMBERS + 2 * own + j]
            by_end = end[SegmentEnd.NUMBERS + 6 * own + i]
        if phase >= 0:
            at_end[i, phase] += by_start / frequency
            at_end[i, phase + 1] += by_end / frequency
        if place >= 0:
            at_end[i, place] -= by_start / frequency * span[0] + by_end / frequency * span[1]


@cached_jit(
    "void(Tuple((i8[::1], f8[::1], f8[::1], f8[:, ::1], f8[::1], f8, i8)), "
    "Tuple((f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1])), "
    "Tuple((f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])))"
)
def contact_equations(request, followed, equations):
    """The residual of an orbit's equations and its derivatives to the unknowns, to those a period
    later, and to the parameters; these arrays are 0 before.

    `request` begins with the places of the free coordinates and velocities in the state at the
    start. The times of the segments' ends, (n + 1,), and the state asked for at the end follow.
    The state at the end is turned by a matrix, (2 own, 2 own), and moved by a vector, as the mirror
    image is that closes an orbit. The frequency and its place among the parameters, or -1, are
    last. `followed` is what `follow_contact_segments` fills.
    """
    free, times, asked, image, shift, frequency, place = request
    ends, columns, maps, _ = followed
    residual, here, there, by_parameters = equations
    own = asked.size // 2
    count = by_parameters.shape[1]
    first = free.size
    events = residual.size - first
    # columns: the state at the start, the phases, the first one a period later, the parameters
    later = first + events
    slope = np.zeros((2 * own + count, later + 1 + count))
    at_end = np.zeros((2 * own + 1, later + 1 + count))
    for k in range(first):
        slope[free[k], k] = 1.0
    for j in range(count):
        slope[2 * own + j, later + 1 + j] = 1.0
    for s in range(ends.shape[0]):
        chained(columns[s], slope, at_end)
        phase = first + s if events > 0 else -1
        column = later + 1 + place if place >= 0 else -1
        add_phases(ends[s], columns[s], times[s : s + 2], frequency, phase, column, at_end)
        slope[: 2 * own] = at_end[: 2 * own]
        if events > 0:
            residual[s] = ends[s, SegmentEnd.GUARD]
            here[s] = at_end[2 * own, :later]
            there[s, first] = at_end[2 * own, later]
            by_parameters[s] = at_end[2 * own, later + 1 :]
            chained(maps[s], slope, at_end)
            slope[: 2 * own] = at_end[: 2 * own]
    after = SegmentEnd.NUMBERS + (8 if events > 0 else 4) * own
    for k in range(first):
        row = events + k
        turned = 0.0
        there[row, k] = -1.0
        for source in range(2 * own):
            factor = image[free[k], source]
            if factor == 0.0:
                continue
            turned += factor * ends[-1, after + source]
            for j in range(later):
                here[row, j] += factor * slope[source, j]
            if events > 0:
                there[row, first] += factor * slope[source, later]
            for j in range(count):
                by_parameters[row, j] += factor * slope[source, later + 1 + j]
        residual[row] = turned + shift[free[k]] - asked[free[k]]
