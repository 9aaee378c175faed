"""The tangent's columns of a linear structure, carried between events by its propagator.

While its contacts do not change, a structure obeys x' = A x + B u, and its columns z obey

    z' = A z + B u_c,

where u_c are the derivatives of the inputs u to the column's parameter; for the columns of the
state at the start they are 0. In the eigenvectors of A (`systems/structures/eigenmodes.py`) the columns of the
state are exact after any time T, exp(lambda T) y. Those of parameters are taken from step to step
of the motion: a polynomial p of the degree of the inputs' series solves p' = lambda p + f exactly,
so that

    y(h) = p(h) + exp(lambda h) (y(0) - p(0)).

Neither limits a step, however fast a mode is. Where lambda h is small, p has large terms that
cancel, and y is its own Taylor series instead.

Its compiled part goes into one module with that of `kernel.py`, and of `segments.py`.
"""

from __future__ import annotations

import math

from saltus.flow.kernel.contact_layout import PartColumn
from saltus.flow.kernel.layout import ROUGHER
from saltus.flow.kernel.steps import drive_mode, inputs_of_modes, places_of_modes
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------

# A mode is followed by its Taylor series of order n up to lambda h = n / 10: the terms that it
# leaves out are below the rounding of y there, and those of the polynomial are not yet too large.
SHORT = 0.1
# A step that is too long for an input becomes as long as it may be, a little less for certain; a
# bound that is far from that is taken in turns.
SHORTENED = 0.95
LEAST_SHORTENED = 0.1
MOST_SHORTENED = 20
SERIES_TERMS = 22  # of exp(z) where abs(z) < 1
# Columns that are full of numbers are taken in fours: each number of the eigenvectors is read once
# for all of them, and their sums do not wait for each other.
ABREAST = 4
FEW = 4  # numbers of a column that are not 0


@lean_jit
def filled_numbers(motion, j):
    """How many numbers of a column are not 0."""
    first = motion.own * (1 + j)
    count = 0
    for i in range(motion.own):
        if motion.coordinates[first + i] != 0.0:
            count += 1
        if motion.velocities[first + i] != 0.0:
            count += 1
    return count


@lean_jit
def sparse_into_modes(motion, inverse, j):
    """Express a column in eigenmodes, of which nearly all numbers are 0."""
    own = motion.own
    states = 2 * own
    table = motion.eigenmodes
    column = motion.mode_columns[j]
    first = own * (1 + j)
    for i in range(own):
        position = motion.coordinates[first + i]
        velocity = motion.velocities[first + i]
        if position != 0.0:
            for row in range(states):
                column[row] += table[inverse + row * states + i] * position
        if velocity != 0.0:
            for row in range(states):
                column[row] += table[inverse + row * states + own + i] * velocity


@lean_jit
def full_into_modes(motion, inverse, j):
    """Express `ABREAST` columns from j on in eigenmodes."""
    own = motion.own
    states = 2 * own
    first = own * (1 + j)
    # views, as a sum of numbers as index costs more than the product
    q_one = motion.coordinates[first : first + own]
    q_two = motion.coordinates[first + own : first + 2 * own]
    q_three = motion.coordinates[first + 2 * own : first + 3 * own]
    q_four = motion.coordinates[first + 3 * own : first + 4 * own]
    v_one = motion.velocities[first : first + own]
    v_two = motion.velocities[first + own : first + 2 * own]
    v_three = motion.velocities[first + 2 * own : first + 3 * own]
    v_four = motion.velocities[first + 3 * own : first + 4 * own]
    for row in range(states):
        place = inverse + row * states
        by_position = motion.eigenmodes[place : place + own]
        by_velocity = motion.eigenmodes[place + own : place + states]
        one = 0.0
        two = 0.0
        three = 0.0
        four = 0.0
        for i in range(own):
            share = by_position[i]
            one += share * q_one[i]
            two += share * q_two[i]
            three += share * q_three[i]
            four += share * q_four[i]
            share = by_velocity[i]
            one += share * v_one[i]
            two += share * v_two[i]
            three += share * v_three[i]
            four += share * v_four[i]
        motion.mode_columns[j, row] = one
        motion.mode_columns[j + 1, row] = two
        motion.mode_columns[j + 2, row] = three
        motion.mode_columns[j + 3, row] = four


@lean_jit
def columns_into_modes(motion):
    """Express the tangent's columns in the eigenmodes of the present block."""
    states = 2 * motion.own
    _, _, inverse, _, _, _, _ = places_of_modes(motion)
    for j in range(motion.columns):
        for row in range(states):
            motion.mode_columns[j, row] = 0.0
            motion.mode_rates[j, row] = 0.0
    j = 0
    while j < motion.columns:
        # most numbers are 0 where columns begin as unit vectors
        if j + ABREAST <= motion.columns and filled_numbers(motion, j) > FEW:
            full_into_modes(motion, inverse, j)
            j += ABREAST
        else:
            sparse_into_modes(motion, inverse, j)
            j += 1


@lean_jit
def input_step(motion, order, longest):
    """The longest step, up to `longest`, at which the last two terms of the series of the inputs'
    derivatives to parameters are below the tolerance, relative to the largest term.
    """
    spacing = int(motion.eigenmodes[1])
    tol = ROUGHER * motion.tolerance
    step = longest
    for place in range(int(motion.eigenmodes[0]) * spacing, motion.input_series.size, spacing):
        for _ in range(MOST_SHORTENED):
            size = 0.0
            last = 0.0
            power = 1.0
            for k in range(order + 1):
                term = abs(motion.input_series[place + k]) * power
                if k < order - 1:
                    size = max(size, term)
                else:
                    last = max(last, term)
                power *= step
            if not last > tol * size:
                break
            step *= SHORTENED * max((tol * size / last) ** (1.0 / order), LEAST_SHORTENED)
    return step


@lean_jit
def push_real(motion, value, j, row, order, h):
    """Take a real mode of column j along a step, with what drives it in the first row behind the
    modes' series.
    """
    f = motion.mode_series[2 * motion.own]
    start = motion.mode_columns[j, row]
    total = 0.0
    rate = 0.0
    if abs(value * h) > SHORT * order:
        p = 0.0
        inverse = 1.0 / value
        for k in range(order, -1, -1):
            p = inverse * ((k + 1) * p - f[k])
            rate = rate * h + total
            total = total * h + p
        left = math.exp(value * h) * (start - p)
        total += left
        rate += value * left
    else:
        y = motion.mode_series[0]
        y[0] = start
        for k in range(order + 1):
            y[k + 1] = (value * y[k] + f[k]) * motion.eigenmodes[2 + k]
        for k in range(order + 1, -1, -1):
            rate = rate * h + total
            total = total * h + y[k]
    motion.mode_columns[j, row] = total
    motion.mode_rates[j, row] = rate


@lean_jit
def push_complex(motion, real, imaginary, j, row, order, h):
    """The same of a complex mode, whose imaginary part is in the next row."""
    f = motion.mode_series[2 * motion.own]
    g = motion.mode_series[2 * motion.own + 1]
    one = motion.mode_columns[j, row]
    two = motion.mode_columns[j, row + 1]
    square = real * real + imaginary * imaginary
    total = 0.0
    rate = 0.0
    other = 0.0
    other_rate = 0.0
    if math.sqrt(square) * abs(h) > SHORT * order:
        p = 0.0
        r = 0.0
        a = real / square
        b = imaginary / square
        for k in range(order, -1, -1):
            by_real = (k + 1) * p - f[k]
            by_imaginary = (k + 1) * r - g[k]
            p = a * by_real + b * by_imaginary
            r = a * by_imaginary - b * by_real
            rate = rate * h + total
            total = total * h + p
            other_rate = other_rate * h + other
            other = other * h + r
        decay = math.exp(real * h)
        cosine = decay * math.cos(imaginary * h)
        sine = decay * math.sin(imaginary * h)
        left = cosine * (one - p) - sine * (two - r)
        left_other = cosine * (two - r) + sine * (one - p)
        total += left
        other += left_other
        rate += real * left - imaginary * left_other
        other_rate += real * left_other + imaginary * left
    else:
        y = motion.mode_series[0]
        z = motion.mode_series[1]
        y[0] = one
        z[0] = two
        for k in range(order + 1):
            inverse = motion.eigenmodes[2 + k]
            y[k + 1] = (real * y[k] - imaginary * z[k] + f[k]) * inverse
            z[k + 1] = (real * z[k] + imaginary * y[k] + g[k]) * inverse
        for k in range(order + 1, -1, -1):
            rate = rate * h + total
            total = total * h + y[k]
            other_rate = other_rate * h + other
            other = other * h + z[k]
    motion.mode_columns[j, row] = total
    motion.mode_columns[j, row + 1] = other
    motion.mode_rates[j, row] = rate
    motion.mode_rates[j, row + 1] = other_rate


@lean_jit
def push_columns(motion, order, h):
    """Take the columns of parameters along a step of the motion, whose series are known; those of
    its modes are overwritten.
    """
    states = 2 * motion.own
    given = inputs_of_modes(motion)
    table = motion.eigenmodes
    values, _, _, _, inputs, _, _ = places_of_modes(motion)
    for j in range(states, motion.columns):
        row = 0
        while row < states:
            real = table[values + 2 * row]
            imaginary = table[values + 2 * row + 1]
            width = 1 if imaginary == 0.0 else 2
            for i in range(width):
                constant = drive_mode(motion, inputs + (row + i) * given, states + i, order, j)
                motion.mode_series[states + i, 0] += constant
            if width == 1:
                push_real(motion, real, j, row, order, h)
            else:
                push_complex(motion, real, imaginary, j, row, order, h)
            row += width


@lean_jit
def carries_columns(motion):
    """Whether propagators carry the columns of a motion: not where their series are recorded."""
    recorded = motion.dense > 0 and motion.step_series.shape[1] > motion.own
    return motion.columns > 0 and motion.eigenmodes.size > 0 and not recorded


@lean_jit
def carry_on(motion, h):
    """Carry the columns of a motion along a step, in eigenmodes; `settle` puts them into the
    state.
    """
    if motion.carried[0] == 0.0:
        columns_into_modes(motion)
        motion.carried[0] = 1.0
        motion.carried[1] = 0.0
    push_columns(motion, motion.order, h)
    motion.carried[1] += h


@lean_jit
def carry_columns(motion, span):
    """Take the columns of the state at the start, in eigenmodes, along a time."""
    states = 2 * motion.own
    table = motion.eigenmodes
    values, _, _, _, _, _, _ = places_of_modes(motion)
    row = 0
    while row < states:
        real = table[values + 2 * row]
        imaginary = table[values + 2 * row + 1]
        decay = math.exp(real * span)
        if imaginary == 0.0:
            for j in range(states):
                motion.mode_columns[j, row] *= decay
                motion.mode_rates[j, row] = real * motion.mode_columns[j, row]
            row += 1
            continue
        cosine = decay * math.cos(imaginary * span)
        sine = decay * math.sin(imaginary * span)
        for j in range(states):
            one = motion.mode_columns[j, row]
            two = motion.mode_columns[j, row + 1]
            y = cosine * one - sine * two
            z = cosine * two + sine * one
            motion.mode_columns[j, row] = y
            motion.mode_columns[j, row + 1] = z
            motion.mode_rates[j, row] = real * y - imaginary * z
            motion.mode_rates[j, row + 1] = real * z + imaginary * y
        row += 2


@lean_jit
def column_from_modes(motion, place, i, j):
    """Put the i-th displacement of a column and its rate back into the state."""
    states = 2 * motion.own
    shape = motion.eigenmodes[place : place + states]
    column = motion.mode_columns[j]
    rates = motion.mode_rates[j]
    position = 0.0
    velocity = 0.0
    for row in range(states):
        position += shape[row] * column[row]
        velocity += shape[row] * rates[row]
    motion.coordinates[motion.own * (1 + j) + i] = position
    motion.velocities[motion.own * (1 + j) + i] = velocity


@lean_jit
def pair_from_modes(motion, place, i, j):
    """The same of two columns, whose sums do not wait for each other."""
    states = 2 * motion.own
    shape = motion.eigenmodes[place : place + states]
    column = motion.mode_columns[j]
    rates = motion.mode_rates[j]
    next_column = motion.mode_columns[j + 1]
    next_rates = motion.mode_rates[j + 1]
    position = 0.0
    velocity = 0.0
    next_position = 0.0
    next_velocity = 0.0
    for row in range(states):
        position += shape[row] * column[row]
        velocity += shape[row] * rates[row]
        next_position += shape[row] * next_column[row]
        next_velocity += shape[row] * next_rates[row]
    first = motion.own * (1 + j) + i
    motion.coordinates[first] = position
    motion.velocities[first] = velocity
    motion.coordinates[first + motion.own] = next_position
    motion.velocities[first + motion.own] = next_velocity


@lean_jit
def columns_from_modes(motion):
    """Put the columns back into the state; those of coordinates that contacts hold do not
    change.
    """
    own = motion.own
    states = 2 * own
    _, _, _, vectors, _, _, _ = places_of_modes(motion)
    held = motion.parameters.size - motion.local
    for j in range(0, motion.columns, 2):
        for i in range(own):
            if i < motion.local and motion.parameters[held + i] == 0.0:
                continue
            place = vectors + i * states
            if j + 1 < motion.columns:
                pair_from_modes(motion, place, i, j)
            else:
                column_from_modes(motion, place, i, j)


@lean_jit
def begin_remainders(motion, contact, power, slopes):
    """Note what the series of the columns of parameters have in front of the terms from the p-th
    power on, at the start of an excursion: they begin at 0, with an acceleration.
    """
    place = motion.contacts[contact, PartColumn.COORDINATE]
    for j in range(2 * motion.own, motion.columns):
        if power == 3:
            slopes[j] = 0.5 * motion.acceleration_series[motion.own * (1 + j) + place, 0]


@lean_jit
def parameter_remainders(motion, contact, span, slopes):
    """The displacement of a contact's coordinate in the columns of parameters at the end of an
    excursion, without the first p terms of its series.
    """
    place = motion.contacts[contact, PartColumn.COORDINATE]
    for j in range(2 * motion.own, motion.columns):
        slopes[j] = motion.coordinates[motion.own * (1 + j) + place] - slopes[j] * span * span


@lean_jit
def complex_remainder(real, imaginary, power):
    """exp(z) without the first p terms of its series, of a complex z."""
    if math.sqrt(real * real + imaginary * imaginary) < 1.0:
        one = 0.0
        two = 0.0
        for k in range(SERIES_TERMS, power - 1, -1):  # 1 + z / (k + 1) (1 + ...)
            factor = 1.0 / (k + 1)
            one, two = (
                1.0 + factor * (real * one - imaginary * two),
                factor * (real * two + imaginary * one),
            )
        for k in range(power):
            factor = 1.0 / (k + 1)
            one, two = (
                factor * (real * one - imaginary * two),
                factor * (real * two + imaginary * one),
            )
        return one, two
    one = math.exp(real) * math.cos(imaginary) - 1.0
    two = math.exp(real) * math.sin(imaginary)
    term = 1.0
    other = 0.0
    for k in range(1, power):
        term, other = (
            (real * term - imaginary * other) / k,
            (real * other + imaginary * term) / k,
        )
        one -= term
        two -= other
    return one, two


@lean_jit
def state_remainders(motion, contact, power, span, slopes):
    """The same for the columns of the state at the start, which are in eigenmodes as at the start:
    exp(lambda T) without the first p terms of its series for each of them.
    """
    own = motion.own
    states = 2 * own
    table = motion.eigenmodes
    values, _, _, vectors, _, _, _ = places_of_modes(motion)
    place = vectors + motion.contacts[contact, PartColumn.COORDINATE] * states
    for j in range(states):
        slopes[j] = 0.0
    row = 0
    while row < states:
        real = table[values + 2 * row]
        imaginary = table[values + 2 * row + 1]
        one, two = complex_remainder(real * span, imaginary * span, power)
        width = 1 if imaginary == 0.0 else 2
        for j in range(states):
            y = motion.mode_columns[j, row]
            z = motion.mode_columns[j, row + 1] if width == 2 else 0.0
            slopes[j] += table[place + row] * (one * y - two * z)
            if width == 2:
                slopes[j] += table[place + row + 1] * (one * z + two * y)
        row += width
