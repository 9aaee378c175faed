"""One step of the scalar flow: its Taylor series, its length, and its records.

Its compiled part goes into one module with that of `one_contact/kernel.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.kernel.contact_layout import PartColumn
from saltus.flow.kernel.layout import (
    CANCELLED,
    DEFECT,
    GAP,
    INSTANT,
    LEAST_SHARE,
    PAIR_GAP,
    PENETRATED,
    ROUGHER,
    SAFETY,
    SHORTEST,
    SLOW,
    SMALLEST,
    STANDS,
    EventCode,
)
from saltus.flow.kernel.memory import ModeArrays, StateArrays, StepArrays
from saltus.flow.kernel.roots import NOISE, both_sums, horner
from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------


@jit
def step_arrays(numbers):
    """The arrays of a step."""
    dof = numbers.dof
    order = numbers.order
    margins = max(numbers.margin_count, 1)
    count = order + 2
    # one piece of memory for each shape: lanes ask for them at every slow impact
    rows = np.zeros((3 * dof + margins + 4, count))
    pairs = np.zeros((3 * dof + margins + 1, 2))
    return StepArrays(
        rows[:dof],
        rows[dof : 2 * dof],
        rows[2 * dof : 3 * dof],
        rows[3 * dof],
        rows[3 * dof + 4 :],
        np.zeros((numbers.workspace_rows, order + 6)),
        rows[3 * dof + 1],
        rows[3 * dof + 2 : 3 * dof + 4],
        (
            pairs[:dof],
            pairs[dof : 2 * dof],
            pairs[2 * dof : 3 * dof],
            pairs[3 * dof],
            pairs[3 * dof + 1 :],
        ),
    )


@jit
def state_arrays(numbers, state):
    """The parts of the state."""
    dof = numbers.dof
    return StateArrays(state, state[:dof], state[dof : 2 * dof], state[2 * dof :])


@lean_jit
def columns_at_event(motion, kind, detail, t, side):
    """Transform the tangent's columns at an event, and put the shifts of the event into the
    state.
    """
    motion.tangent(kind, detail, t, motion.origin, side, motion.env, motion.piece, motion.state)


@lean_jit
def expand(motion, t, side, order):
    """Expand the state in its Taylor series at time `t`; returns the size of the model's own part
    of the state (`state_size`).

    The velocities of coordinates of first order follow from the state, and are put into it; as
    their accelerations are derivatives of these, they need order 1 at least.
    """
    q = motion.coordinate_series
    v = motion.velocity_series
    a = motion.acceleration_series
    g = motion.gap_series
    m = motion.margin_series
    w = motion.recurrences
    if motion.first_order > 0:
        order = max(order, 1)
    for i in range(motion.dof):
        q[i, 0], v[i, 0] = motion.coordinates[i], motion.velocities[i]
    motion.series(t, motion.origin, side, motion.env, motion.piece, q, v, a, g, m, w, order)
    if motion.first_order > 0:
        for i in range(motion.dof):
            motion.velocities[i] = v[i, 0]
    return state_size(motion, 0, motion.own)


@lean_jit
def state_size(motion, first, last):
    """The size of the rows from `first` to `last` of the state, to which the error of a step is
    relative: a speed, so that it depends on units of length and time as a speed does.

    It is the largest of the velocities and of sqrt(abs(q a)), which is the amplitude of the
    velocity of an oscillation about 0, at its ends too. Where all of these are 0, or far below the
    rounding of what one step gives, it is the largest acceleration; and SMALLEST if that is, too.
    """
    q = motion.coordinate_series
    v = motion.velocity_series
    a = motion.acceleration_series
    size = 0.0
    largest = 0.0
    second = 0.0
    third = 0.0
    for i in range(first, last):
        pull = abs(a[i, 0])
        size = max(size, abs(v[i, 0]), math.sqrt(abs(q[i, 0])) * math.sqrt(pull))
        largest = max(largest, pull)
        second = max(second, abs(v[i, 2]))
        third = max(third, abs(v[i, 3]))
    rates = max(largest, second, third)
    if size > STANDS * rates:
        return size
    # of a motion that a huge rate changes, the derivatives are as large in any units: the rate from
    # each to the next is then one
    pushed = size * second < STANDS * largest * largest
    jerked = size * third * third < STANDS * second * second * second
    if size > 0.0 and not (pushed or jerked):
        return size
    return largest if largest > STANDS * rates else SMALLEST


@lean_jit
def growth(coefficients, first, last, size):
    """The largest log(abs(c_k) / size) / k for first <= k <= last: minus the log of the radius of
    convergence by these terms.
    """
    largest = -np.inf
    for k in range(first, last + 1):
        term = 0.0
        for i in range(coefficients.shape[0]):
            term = max(term, abs(coefficients[i, k]))
        if term > 0.0:
            largest = max(largest, math.log(term / size) / k)
    return largest


@lean_jit
def grow_faster(coefficients, first, last, size, rate):
    """Whether `growth` exceeds a rate, found without the many logarithms of it."""
    factor = math.exp(rate)
    lowest = size * math.exp(first * rate)
    for i in range(coefficients.shape[0]):
        bound = lowest
        for k in range(first, last + 1):
            if abs(coefficients[i, k]) > bound:
                return True
            bound *= factor
    return False


# `surely_slower` looks at series of this order at least, and allows for this much rounding; the
# other factors are not above those by which `step_size` lets earlier terms exceed the last ones.
LONG_SERIES = 18
BY_ROUNDING = 1.0 - 1e-9
BY_PAIR = BY_ROUNDING * math.exp(PAIR_GAP * (1.0 - 3.0 / LONG_SERIES))
BY_SECOND_PAIR = BY_ROUNDING * math.exp(2.0 * PAIR_GAP * (1.0 - 5.0 / LONG_SERIES))
BY_HALF = BY_ROUNDING * math.exp(GAP * (LONG_SERIES - 6.0))
PER_TERM = math.exp(GAP)


@lean_jit
def surely_slower(coefficients, order, largest):
    """Whether `grow_faster` is certainly false wherever `step_size` asks it, as it mostly is: found
    by products, from the last terms to the earlier ones, instead of an exponential for each.
    """
    if order < LONG_SERIES or not largest > -np.inf:
        return False
    inverse = math.exp(-largest)
    level = 0.0
    for i in range(coefficients.shape[0]):
        at_end = abs(coefficients[i, order]) * inverse
        level = max(level, at_end, abs(coefficients[i, order - 1]))
    level *= inverse
    square = inverse * inverse
    pair = level * BY_PAIR
    second_pair = level * square * BY_SECOND_PAIR
    upper = level * square * square * BY_HALF
    for _ in range(LONG_SERIES, order):
        upper *= PER_TERM
    narrower = inverse / PER_TERM
    for i in range(coefficients.shape[0]):
        # so that what is not a number is not slower
        if not (
            abs(coefficients[i, order - 2]) <= pair
            and abs(coefficients[i, order - 3]) <= pair * inverse
            and abs(coefficients[i, order - 4]) <= second_pair
            and abs(coefficients[i, order - 5]) <= second_pair * inverse
        ):
            return False
        bound = upper
        for k in range(order - 6, order // 2 - 1, -1):
            if not abs(coefficients[i, k]) <= bound:
                return False
            bound *= narrower
    return True


@lean_jit
def log_of_tolerance(motion):
    """The logarithm of the tolerance, which is computed once."""
    if motion.log_tolerance == 0.0:
        motion.log_tolerance = math.log(motion.tolerance)
    return motion.log_tolerance


@lean_jit
def step_size(coefficients, order, size, log_tol):
    """The step h at which the last two terms of the series are tol, relative to `size`.

    By symmetry both terms may be far too small: for x'' = -x^3 from x = 0 only every fourth
    coefficient is not 0, and near x = 0 the others are small. The growth of the series is then
    taken from earlier coefficients: the pair before, the one before that, or the upper half.
    """
    at_end = growth(coefficients, order, order, size)
    before_end = growth(coefficients, order - 1, order - 1, size)
    step = min(log_tol / order - at_end, log_tol / (order - 1) - before_end)
    largest = max(at_end, before_end)
    if not surely_slower(coefficients, order, largest):
        for pair in range(1, 3):
            k = order - 2 * pair
            if grow_faster(coefficients, k - 1, k, size, largest + pair * PAIR_GAP / order):
                step = min(step, log_tol / order - growth(coefficients, k - 1, k, size))
        half = order // 2
        if grow_faster(coefficients, half, order - 2, size, largest + GAP):
            step = min(step, log_tol / order - growth(coefficients, half, order - 2, size))
    return SAFETY * math.exp(step) if step < 700.0 else np.inf


@lean_jit
def leaps(motion, t, side, h, size, terms):
    """Whether a step passes a feature of the acceleration that its series cannot show. Such is the
    bend of a saturated tanh, whose coefficients are below rounding far away from it.

    It is noticed because the model's acceleration at the end of the step then differs from that of
    the series, by more than the rounding of its largest `terms`: these cancel at a release from
    rest, where the size of the state is rounding too.
    """
    q = motion.coordinate_series
    v = motion.velocity_series
    a = motion.acceleration_series
    w = motion.recurrences
    q_end, v_end, a_end, g_end, m_end = motion.step_end
    order = motion.order
    for i in range(motion.dof):
        q_end[i, 0], v_end[i, 0] = horner(q[i], order, h), horner(v[i], order, h)
    motion.series(
        t + h,
        motion.origin,
        side,
        motion.env,
        motion.piece,
        q_end,
        v_end,
        a_end,
        g_end,
        m_end,
        w,
        0,
    )
    defect = 0.0
    for i in range(motion.own - motion.first_order):
        defect = max(defect, abs(a_end[i, 0] - horner(a[i], order, h)))
    for i in range(motion.own - motion.first_order, motion.own):
        defect = max(defect, abs(v_end[i, 0] - horner(v[i], order, h)))
    return defect > DEFECT * motion.tolerance * size / h + CANCELLED * terms


@lean_jit
def move(motion, tau, count):
    """Take `count` coordinates and their velocities at `tau` from the series of a step; returns
    whether the model's own part of them is finite.
    """
    q = motion.coordinate_series
    v = motion.velocity_series
    order = motion.order
    finite = True
    for i in range(count):
        motion.coordinates[i], motion.velocities[i] = both_sums(q[i], v[i], order, tau)
        if i < motion.own:
            finite = (
                finite
                and math.isfinite(motion.coordinates[i])
                and math.isfinite(motion.velocities[i])
            )
    return finite


@lean_jit
def record_event(motion, kind, detail, t, before, after):
    """Append an event: (period, kind, side, detail) and (local time, velocity before, velocity
    after, shifts).
    """
    labels = motion.event_labels
    values = motion.event_values
    i = motion.recorded_events
    side = 0 if kind == EventCode.REST else motion.side
    labels[i, 0] = motion.period
    labels[i, 1] = kind
    labels[i, 2] = side
    labels[i, 3] = detail
    values[i, 0] = t
    values[i, 1] = before
    values[i, 2] = after
    for j in range(motion.columns):
        values[i, 3 + j] = math.nan  # until `record_shift` sets it
    motion.recorded_events = i + 1


@lean_jit
def record_shift(motion):
    """Record with the last event its shift along each column, which `tangent` has put into the
    state.
    """
    for j in range(motion.columns):
        motion.event_values[motion.recorded_events - 1, 3 + j] = motion.shifts[j]


@lean_jit
def forget(motion):
    """Set the tangent to nan: there are no derivatives from here on."""
    for i in range(motion.own, motion.dof):
        motion.coordinates[i] = motion.velocities[i] = math.nan
    for j in range(motion.columns):
        motion.shifts[j] = math.nan


@lean_jit
def column_step(motion):
    """The longest step that the series of the tangent's columns allow, each relative to its own
    size.
    """
    v = motion.velocity_series
    step = np.inf
    own = motion.own
    order = motion.order
    log_tol = math.log(ROUGHER * motion.tolerance)
    for first in range(own, motion.dof, own):
        size = state_size(motion, first, first + own)
        if size < np.inf:
            step = min(step, step_size(v[first : first + own], order, size, log_tol))
    return step


@lean_jit
def record_step(motion, side, t, h):
    """Append a step of the dense output: its start, its length, and the series of as many
    coordinates as the buffer has rows for: the model's own, or those of the tangent's columns
    too."""
    if motion.dense == 0:
        return
    labels = motion.step_labels
    spans = motion.step_spans
    coefficients = motion.step_series
    i = motion.recorded_steps
    labels[i, 0] = motion.period
    labels[i, 1] = side
    spans[i, 0] = t
    spans[i, 1] = h
    for d in range(coefficients.shape[1]):
        for k in range(motion.order + 2):
            coefficients[i, d, k] = motion.coordinate_series[d, k]
    motion.recorded_steps = i + 1


@lean_jit
def move_columns(motion, sign):
    """Take the columns to the event, whose instant moves (sign +1), or back from it to a fixed time
    (-1): u + v dt, z + a dt.
    """
    own = motion.own
    a = motion.acceleration_series
    for j in range(motion.columns):
        shift = sign * motion.shifts[j]
        for i in range(own):
            place = own * (1 + j) + i
            if shift != 0.0:
                motion.coordinates[place] += shift * motion.velocities[i]
                motion.velocities[place] += shift * a[i, 0]


@lean_jit
def clear_shifts(motion):
    """Set the shifts of the event to 0, after the columns have been taken back from it."""
    for j in range(motion.columns):
        motion.shifts[j] = 0.0


@lean_jit
def set_corner_shifts(motion):
    """Put the shifts of a corner of the load into the state: it has a phase, and so moves with the
    frequency W alone, by -time / W."""
    clear_shifts(motion)
    length = motion.period_length
    motion.shifts[motion.corner_column - 1] = (
        -(motion.origin + motion.time) * length / (2.0 * math.pi)
    )


@lean_jit
def columns_to_corner(motion, side):
    """Take the columns to a corner of the load that the motion has just come to, whose instant
    moves with the frequency."""
    set_corner_shifts(motion)
    piece = motion.piece
    time = motion.time
    motion.piece = piece - 1
    if motion.piece == 0:  # from the end of the forcing period; the table has two of them
        motion.piece = motion.breaks.size // 2
        time += motion.period_length
    expand(motion, time, side, 0)
    move_columns(motion, 1.0)
    motion.piece = piece


@lean_jit
def columns_from_corner(motion, side):
    """Take the columns back from a corner to a fixed time, behind it."""
    expand(motion, motion.time, side, 0)
    move_columns(motion, -1.0)
    clear_shifts(motion)


@lean_jit
def breakpoint_time(motion, piece):
    """The time of a breakpoint, as counted from the present forcing period."""
    at = motion.breaks[piece]
    return at * motion.period_length if motion.repeats > 0 else at - motion.origin


@lean_jit
def next_target(motion, t_end):
    """The time up to which the next step may go: the end of the forcing period, or a breakpoint of
    the records before.
    """
    breaks = motion.breaks
    before = motion.piece
    while motion.piece < breaks.size and breakpoint_time(motion, motion.piece) <= motion.time:
        motion.piece += 1
    motion.new_piece = 1 if motion.piece != before else 0
    if motion.piece < breaks.size:
        return min(t_end, breakpoint_time(motion, motion.piece))
    return t_end


@lean_jit
def piece_end(motion):
    """The time of the next breakpoint of the records, inf behind the last one."""
    if motion.piece < motion.breaks.size:
        return breakpoint_time(motion, motion.piece)
    return np.inf


@lean_jit
def natural_speed(motion):
    """The speed of the largest pull at an impact so far in the natural time; where nothing pulls,
    or there is no natural time, that of the fastest impact.
    """
    speed = motion.pull * motion.natural_time
    return speed if speed > 0.0 else motion.fastest


@lean_jit
def slow_share(motion):
    """The speed of an impact as a share of the fastest one so far, where an impact takes all of the
    speed. The end of an accumulation is looked for below it; where it takes less, as much less.

    It has no unit, and what does not act on the impacts does not change it.
    """
    return max(SLOW * math.sqrt(motion.tolerance), LEAST_SHARE)


@lean_jit
def time_scale(motion):
    """The natural time, or without one what an impact takes to fall: 0 before the first one."""
    if motion.natural_time > 0.0:
        return motion.natural_time
    return motion.fastest / motion.pull if motion.pull > 0.0 else 0.0


@lean_jit
def change_rate(a):
    """The relative rate at which an acceleration changes, from the first three coefficients of its
    series: those that follow from the load's frequency, a damping or a stiffness alike.
    """
    if a[1] == 0.0 and a[2] == 0.0:
        return 0.0
    if a[0] == 0.0:
        return np.inf
    return abs(a[1] / a[0]) + math.sqrt(2.0 * abs(a[2] / a[0]))


@lean_jit
def shortest_step(motion):
    """The step below which the acceleration counts as singular."""
    if motion.natural_time > 0.0:
        return SHORTEST * motion.natural_time
    scale = time_scale(motion)
    # an impact without a pull but for rounding takes for ever to fall
    end = motion_end(motion)
    return SHORTEST * (min(scale, end) if scale > 0.0 else end)


@lean_jit
def note_impact(motion, speed, pull):
    """Note the speed and the acceleration at an impact for the natural scales."""
    motion.fastest = max(motion.fastest, abs(speed))
    motion.pull = max(motion.pull, abs(pull))


# Instants of events at one instant differ by so many roundings of their times.
UNTOLD = 64.0


@lean_jit
def is_away(motion, gap, place, position, tau):
    """Whether the distance of a coordinate from a position, at the end of a step, is more than the
    rounding of the terms of their sums.
    """
    share = PENETRATED + 10.0 * motion.tolerance
    series = motion.coordinate_series[place]
    # mostly the distance is far less than the rounding of one of the terms
    if abs(gap) <= share * max(abs(position), abs(series[0]), abs(series[1]) * tau):
        return False
    terms = 0.0
    for k in range(motion.order, -1, -1):
        terms = terms * tau + abs(series[k])
    # a gap that opens from rest has an acceleration of 0 up to the rounding of what pressed, and no
    # time is told from another one below its rounding
    span = max(tau, UNTOLD * INSTANT * max(time_scale(motion), abs(motion.time)))
    terms += abs(position) + max(motion.press, motion.pull) * span * span
    return abs(gap) > share * terms


@lean_jit
def motion_end(motion):
    """The time at which the motion ends, as counted from the present forcing period."""
    if motion.until_smooth > 0:
        return motion.horizon
    return (motion.last_period - motion.period) * motion.period_length + motion.end


# Structures in eigenmodes (`systems/structures/eigenmodes.py`).

# The share of the tolerance up to which a mode is taken as dead where derivatives are asked for.
DEAD = 1e-4


@jit
def mode_arrays(numbers, table):
    """The series of eigenmodes, with two rows for what drives one of them; those of their inputs,
    and of the derivatives of these to the parameters of the tangent's columns; and the columns and
    their rates in eigenmodes.
    """
    rows = 0
    inputs = 0
    states = 0
    if table.size > 0:
        states = 2 * numbers.own
        rows = states + 2
        pushed = max(numbers.columns - states, 0)
        inputs = int(table[0] * table[1]) * (1 + pushed)
    columns = np.zeros((2 * numbers.columns if rows > 0 else 0, states))
    return ModeArrays(
        np.zeros((rows, numbers.order + 2)),
        np.zeros(inputs),
        columns[: numbers.columns],
        columns[numbers.columns :],
        np.zeros(2),
    )


@lean_jit
def drive_mode(motion, factors, row, order, column):
    """Put the series of what drives a row of the eigenmodes into a row, without what is constant
    until the next event, which is returned; `factors` is the place of the first input's.

    It drives the motion if `column` is -1, else that column of the tangent: the derivatives of the
    inputs to its parameter.
    """
    table = motion.eigenmodes
    driven = motion.mode_series[row]
    inputs = motion.input_series
    channels = int(table[0])
    spacing = int(table[1])
    series = channels * spacing * (1 + column - 2 * motion.own) if column >= 0 else 0
    held = motion.own * (1 + column)
    for k in range(order + 2):
        driven[k] = 0.0
    for c in range(channels):
        factor = table[factors + c]
        for k in range(order + 2):
            driven[k] += factor * inputs[series + c * spacing + k]
    constant = table[factors + channels] if column < 0 else 0.0
    for i in range(motion.local):
        constant += table[factors + channels + 1 + i] * motion.coordinates[held + i]
    return constant


@lean_jit
def measured_from_rest(motion, values, j, width, one, two):
    """Measure an eigenmode from where the constants `one` and `two` that drive it hold it, if it
    has losses; otherwise let them drive it.

    The fast ones are nearly there, and reactions would be small differences of their large values.
    """
    series = motion.mode_series
    driven = 2 * motion.own
    real = motion.eigenmodes[values + 2 * j]
    imaginary = motion.eigenmodes[values + 2 * j + 1]
    if not real < 0.0:
        series[driven, 0] += one
        series[driven + 1, 0] += two
        return
    square = real * real + imaginary * imaginary
    series[j, 0] += (real * one + imaginary * two) / square
    if width == 2:
        series[j + 1, 0] += (real * two - imaginary * one) / square


@lean_jit
def one_mode(motion, place, j, order, allowed):
    """The series of a real eigenmode from its value, which begins it: the polynomial of
    `systems/structures/eigenmodes.py` if it is on that to within what is allowed. Its eigenvalue is at a place
    of the table."""
    y = motion.mode_series[j]
    f = motion.mode_series[2 * motion.own]
    value = motion.eigenmodes[place]
    start = y[0]
    if value < 0.0:
        following = 0.0
        inverse = 1.0 / value
        for k in range(order + 1, -1, -1):
            following = inverse * ((k + 1) * following - f[k])
            y[k] = following
        if abs(start - y[0]) <= allowed:
            return
    y[0] = start
    for k in range(order + 1):
        y[k + 1] = (value * y[k] + f[k]) * motion.eigenmodes[2 + k]


@lean_jit
def two_modes(motion, place, j, order, allowed):
    """The same of a complex eigenmode, whose imaginary part is in the next row."""
    series = motion.mode_series
    table = motion.eigenmodes
    driven = 2 * motion.own
    y = series[j]
    z = series[j + 1]
    f = series[driven]
    g = series[driven + 1]
    real = table[place]
    imaginary = table[place + 1]
    start = y[0]
    other = z[0]
    if real < 0.0:
        square = real * real + imaginary * imaginary
        one = 0.0
        two = 0.0
        a = real / square
        b = imaginary / square
        for k in range(order + 1, -1, -1):
            p = (k + 1) * one - f[k]
            r = (k + 1) * two - g[k]
            one = a * p + b * r
            two = a * r - b * p
            y[k] = one
            z[k] = two
        real_change = start - y[0]
        imaginary_change = other - z[0]
        # a page has a root, and no `hypot`
        if math.sqrt(real_change**2 + imaginary_change**2) <= allowed:
            return
    y[0] = start
    z[0] = other
    for k in range(order + 1):
        inverse = table[2 + k]
        y[k + 1] = (real * y[k] - imaginary * z[k] + f[k]) * inverse
        z[k + 1] = (real * z[k] + imaginary * y[k] + g[k]) * inverse


@lean_jit
def in_mode(motion, rows, states):
    """A row of the eigenvectors' inverse times the state, and the sum of the absolute values."""
    total = 0.0
    absolute = 0.0
    table = motion.eigenmodes
    for i in range(states // 2):
        one = table[rows + i] * motion.coordinates[i]
        two = table[rows + states // 2 + i] * motion.velocities[i]
        total += one + two
        absolute += abs(one) + abs(two)
    return total, absolute


@lean_jit
def add_modes(motion, factors, states, order, series):
    """Fill a series with a sum of eigenmodes; four of them at a time, so that the series is read and
    written a quarter as often.
    """
    table = motion.eigenmodes
    for k in range(order + 2):
        series[k] = 0.0
    j = 0
    while j + 4 <= states:
        one = table[factors + j]
        two = table[factors + j + 1]
        three = table[factors + j + 2]
        four = table[factors + j + 3]
        if one != 0.0 or two != 0.0 or three != 0.0 or four != 0.0:
            first = motion.mode_series[j]
            second = motion.mode_series[j + 1]
            third = motion.mode_series[j + 2]
            fourth = motion.mode_series[j + 3]
            for k in range(order + 2):
                total = series[k] + one * first[k]
                total = total + two * second[k]
                total = total + three * third[k]
                series[k] = total + four * fourth[k]
        j += 4
    while j < states:
        one = table[factors + j]
        mode = motion.mode_series[j]
        for k in range(order + 2):
            series[k] += one * mode[k]
        j += 1


@lean_jit
def closed_rows(motion):
    """The closed contacts and, behind them, the surfaces on whose side +1 the motion is, as bits:
    the number of a block of the eigenmodes' table.
    """
    count = motion.contacts.shape[0]
    bits = 0
    for i in range(count):
        bits |= motion.contacts[i, PartColumn.STATE] << i
    for k in range(motion.sided.shape[0]):  # the rows of surfaces
        bits |= (1 if motion.sided[k, PartColumn.STATE] > 0 else 0) << (count + k)
    return bits


@lean_jit
def inputs_of_modes(motion):
    """The number of inputs of eigenmodes: channels, 1, and the local displacements."""
    return int(motion.eigenmodes[0]) + 1 + motion.local


@lean_jit
def places_of_modes(motion):
    """The places in the eigenmodes' table of the present block: its eigenvalues, the reaches of its
    modes, the inverse of the eigenvectors, these, the factors of the inputs, and the reactions by
    eigenmodes and by inputs.
    """
    own = motion.own
    count = motion.contacts.shape[0]
    states = 2 * own
    given = inputs_of_modes(motion)
    length = states * (3 + states + own + given + count) + count * given
    values = 2 + int(motion.eigenmodes[1]) + closed_rows(motion) * length
    reach = values + 2 * states
    inverse = reach + states
    vectors = inverse + states * states
    inputs = vectors + own * states
    reactions = inputs + states * given
    return values, reach, inverse, vectors, inputs, reactions, reactions + count * states


@lean_jit
def in_modes(motion, t, order):
    """Fill the series of the coordinates, their rates and the reactions of closed contacts; returns
    the size of the state.
    """
    table = motion.eigenmodes
    own = motion.own
    count = motion.contacts.shape[0]
    size = 0.0
    states = 2 * own
    given = inputs_of_modes(motion)
    values, reach, inverse, vectors, inputs, reactions, by_inputs = places_of_modes(motion)
    bits = closed_rows(motion)
    for i in range(own):
        size = max(size, abs(motion.coordinates[i]), abs(motion.velocities[i]))
    motion.load_series(
        t,
        motion.origin,
        1.0,
        motion.env,
        motion.piece,
        motion.input_series,
        motion.recurrences,
        order + 1,
    )
    # equations of orbits are solved to rounding, and jump where a mode is taken as dead
    share = DEAD if motion.columns > 0 else 1.0
    allowed = share * motion.tolerance * max(size, SMALLEST)
    j = 0
    while j < states:
        width = 1 if table[values + 2 * j + 1] == 0.0 else 2
        enough = allowed / (table[reach + j] + SMALLEST)
        constant = 0.0
        other = 0.0
        for i in range(width):
            other = constant
            constant = drive_mode(motion, inputs + (j + i) * given, states + i, order, -1)
            motion.mode_series[j + i, 0], terms = in_mode(
                motion, inverse + (j + i) * states, states
            )
            enough = max(enough, NOISE * terms)
        if width == 1:
            measured_from_rest(motion, values, j, width, constant, 0.0)
        else:
            measured_from_rest(motion, values, j, width, other, constant)
        if width == 1:
            one_mode(motion, values + 2 * j, j, order, enough)
        else:
            two_modes(motion, values + 2 * j, j, order, enough)
        j += width
    for i in range(own):
        q = motion.coordinate_series[i]
        v = motion.velocity_series[i]
        a = motion.acceleration_series[i]
        add_modes(motion, vectors + i * states, states, order, q)
        for k in range(order + 1):
            v[k] = (k + 1) * q[k + 1]
        for k in range(order):
            a[k] = (k + 1) * v[k + 1]
        q[0] = motion.coordinates[i]
        v[0] = motion.velocities[i]
    for i in range(count):
        if bits >> i & 1:
            add_modes(motion, reactions + i * states, states, order, motion.margin_series[i])
            constant = drive_mode(motion, by_inputs + i * given, states, order, -1)
            motion.mode_series[states, 0] += constant
            for k in range(order + 2):
                motion.margin_series[i, k] += motion.mode_series[states, k]
    return state_size(motion, 0, own)
