"""Impacts of several contacts, and accumulations of them.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

import math

import numpy as np

from saltus.flow.contacts.complementarity import acting, complementary, invert, push, tell_instant
from saltus.flow.contacts.held_rows import fill_rows, hold_rows, row_step
from saltus.flow.contacts.rows import pull_of, row_series, told_rate
from saltus.flow.kernel.contact_layout import (
    EXCESS,
    FINISHED,
    MOST_EXCESS,
    MOST_FROZEN_IMPACTS,
    UNCOUPLED,
    VANISHED,
    NoPress,
    PartColumn,
    Reached,
    Side,
    Touch,
    contact_position,
    first_flag,
    is_function,
    is_surface,
    jumping,
    restitution,
)
from saltus.flow.kernel.layout import EXACT, LEAST_LOSS, Mode
from saltus.flow.kernel.steps import column_step, leaps, log_of_tolerance, slow_share, step_size
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def hold_coordinates(motion):
    """Tell the model's functions, through `env`, which coordinates are free."""
    if motion.multipliers > 0:
        hold_rows(motion)
        return
    first = first_flag(motion)
    for i in range(motion.local):
        motion.parameters[first + i] = 1.0
    for i in range(motion.contacts.shape[0]):
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            motion.parameters[first + motion.contacts[i, PartColumn.COORDINATE]] = 0.0


@lean_jit
def closed_bits(motion):
    """The contacts that are closed, as bits."""
    bits = 0
    for i in range(motion.contacts.shape[0]):
        bits |= motion.contacts[i, PartColumn.STATE] << i
    return bits


@lean_jit
def gap_series(motion, i, position, order, g):
    """The Taylor coefficients of a contact's gap."""
    if motion.multipliers > 0:
        row_gap_series(motion, i, order, g)
    else:
        coordinate_series(motion, i, order, g)
        g[0] -= motion.signs[i] * position


@lean_jit
def row_gap_series(motion, i, order, g):
    """`gap_series` of a contact with a row."""
    series = motion.margin_series[row_series(motion, i)]
    for k in range(order + 1):
        g[k] = series[k]


@lean_jit
def coordinate_series(motion, i, order, g):
    """`gap_series` of a contact that holds a coordinate, at the position 0."""
    sign = motion.signs[i]
    series = motion.coordinate_series[motion.contacts[i, PartColumn.COORDINATE]]
    for k in range(order + 1):
        g[k] = sign * series[k]


@lean_jit
def measure_gap(motion, i):
    """Set the gap of a contact that is kept beside the coordinate."""
    place = motion.contacts[i, PartColumn.COORDINATE]
    gap = motion.coordinates[place] - contact_position(motion, i)
    motion.open_gaps[i] = motion.signs[i] * gap
    motion.contacts[i, PartColumn.EXCESS] = 0


@lean_jit
def keep_gap(motion, i):
    """Keep the digits of a gap that the difference of the coordinate and the position does not have
    for the next call of the kernel."""
    position = contact_position(motion, i)
    difference = motion.coordinates[motion.contacts[i, PartColumn.COORDINATE]] - position
    excess = (motion.open_gaps[i] - motion.signs[i] * difference) / (EXCESS * abs(position))
    if abs(excess) < MOST_EXCESS:
        motion.contacts[i, PartColumn.EXCESS] = int(excess)
    else:
        measure_gap(motion, i)


@lean_jit
def open_gap_series(motion, i, order, g):
    """`gap_series` at the start of a step, with the gap that is kept beside the coordinate: it has
    all of its digits where the position is far from 0.
    """
    if motion.multipliers > 0:
        row_gap_series(motion, i, order, g)
    else:
        coordinate_series(motion, i, order, g)
        g[0] = motion.open_gaps[i]


@lean_jit
def contact_step_size(motion, t, target, size, with_columns):
    """The step that the series of the free coordinates and of the reactions allow, and those of the
    tangent's columns if they are followed in them."""
    order = motion.order
    log_tol = log_of_tolerance(motion)
    natural = step_size(motion.velocity_series[: motion.own], order, size, log_tol)
    if with_columns and motion.columns > 0:
        natural = min(natural, column_step(motion))
    resting = motion.mode == Mode.REST
    sharp = math.log(min(motion.tolerance, EXACT)) if resting else log_tol
    for i in range(motion.contacts.shape[0]):
        row = motion.contacts[i]
        if row[PartColumn.STATE] == Touch.CLOSED and row[PartColumn.IDLE] == 0:
            r = motion.margin_series[i : i + 1]
            reaction = max(press_of(motion, i), abs(r[0, 0]))
            if reaction > 0.0:
                natural = min(natural, step_size(r, order, reaction, sharp))
    terms = max(motion.press, motion.pull)
    if motion.multipliers > 0:
        natural = row_step(motion, natural, target - t)
    while motion.checked > 0 and leaps(motion, t, 1.0, min(natural, target - t), size, terms):
        natural = 0.5 * min(natural, target - t)
    return natural


@lean_jit
def fill_contact_matrices(motion):
    """Fill `NUMBERS`, `INVERSE`, `COUPLING`, `GAPS` and `RATES` of `solver` at the present state;
    False if the mass matrix is singular."""
    if motion.multipliers > 0:
        return fill_rows(motion)
    count = motion.contacts.shape[0]
    signs = motion.signs
    tell_instant(motion)
    motion.matrices(motion.env, motion.piece, motion.state, motion.solver_numbers)
    regular = invert(
        motion.solver_numbers, motion.local, motion.first_order, motion.block, motion.inverse
    )
    for i in range(count):
        a = motion.contacts[i, PartColumn.COORDINATE]
        for j in range(count):
            b = motion.contacts[j, PartColumn.COORDINATE]
            motion.coupling[i, j] = signs[i] * signs[j] * motion.inverse[a, b]
        motion.gaps[i] = signs[i] * (motion.coordinates[a] - contact_position(motion, i))
        motion.rates[i] = signs[i] * motion.velocities[a]
    for i in range(count):
        for j in range(count):
            most = abs(motion.coupling[i, i] * motion.coupling[j, j])
            if i != j and motion.coupling[i, j] * motion.coupling[i, j] <= UNCOUPLED * most:
                motion.coupling[i, j] = 0.0
    return regular


@lean_jit
def reduce_to(motion, chosen):
    """Copy the coupling of the contacts in `chosen` to the first rows of `REDUCED`; returns the
    number of these contacts.
    """
    row = 0
    count = motion.contacts.shape[0]
    for i in range(count):
        if chosen >> i & 1:
            column = 0
            for j in range(count):
                if chosen >> j & 1:
                    motion.reduced[row, column] = motion.coupling[i, j]
                    column += 1
            row += 1
    return row


@lean_jit
def impact_impulses(motion, chosen, rates):
    """Find the impulses J of the contacts in `chosen`: 0 <= J _|_ v+ + E v- >= 0 with v+ = v- + G
    J.

    `rates` holds v- of all contacts, and afterwards v+. For a contact that acts v+ is set to -E v-,
    so that a rate of 0 is exactly 0. Returns whether there is a solution, and the contacts that act
    as bits.
    """
    size = reduce_to(motion, chosen)
    row = 0
    after = motion.tried
    count = motion.contacts.shape[0]
    for i in range(count):
        if chosen >> i & 1:
            motion.right[row] = rates[i]
            for j in range(count):
                if chosen >> j & 1:
                    motion.right[row] += restitution(motion, i, j) * rates[j]
            row += 1
    solved, bits = complementary(
        motion.reduced, motion.right, size, motion.block, motion.tried, motion.impulses
    )
    if not solved:
        return False, 0
    acts = 0
    row = 0
    for i in range(count):
        if chosen >> i & 1:
            acts |= (bits >> row & 1) << i
            row += 1
    # spread them from the chosen to all contacts, the last one first
    for i in range(count - 1, -1, -1):
        if chosen >> i & 1:
            row -= 1
            motion.impulses[i] = motion.impulses[row]
        if not acts >> i & 1:
            motion.impulses[i] = 0.0
    for i in range(count):
        after[i] = rates[i]
        if acts >> i & 1:
            after[i] = 0.0
            for j in range(count):
                if chosen >> j & 1:
                    after[i] -= restitution(motion, i, j) * rates[j]
        else:
            for j in range(count):
                after[i] += motion.coupling[i, j] * motion.impulses[j]
            if chosen >> i & 1:
                after[i] = max(after[i], 0.0)
    for i in range(count):
        rates[i] = after[i] + 0.0
    return True, acts


@lean_jit
def jump_place(motion, i, k):
    """The place in `NUMBERS` of a coordinate of first order, by its number, after an impact on a
    contact.
    """
    local = motion.local
    count = motion.contacts.shape[0]
    return local * local + count * count + count + motion.first_order * i + k


@lean_jit
def jump_first_order(motion, hit):
    """Let the coordinates of first order jump at an impact of the contacts in `hit`, of several by
    the last; the matrices must be those before it."""
    for i in range(motion.contacts.shape[0]):
        for k in range(motion.first_order if hit >> i & 1 else 0):
            motion.coordinates[motion.own - motion.first_order + k] = motion.solver_numbers[
                jump_place(motion, i, k)
            ]


@lean_jit
def apply_impulses(motion):
    """Add the effect of the impulses to the velocities."""
    for i in range(motion.local):
        for j in range(motion.contacts.shape[0]):
            gain = motion.inverse[i, motion.contacts[j, PartColumn.COORDINATE]] * motion.signs[j]
            motion.velocities[i] += gain * motion.impulses[j]


@lean_jit
def record_contact_event(motion, kind, which, t):
    """Append an event: (period, kind, bits of contacts, 0) and (local time, velocities before and
    after, impulses).

    The velocities before are those of the state at this call; `fill_after` completes the event.
    """
    labels = motion.event_labels
    values = motion.event_values
    i = motion.recorded_events
    own = motion.own
    labels[i, 0] = motion.period
    labels[i, 1] = kind
    labels[i, 2] = which
    labels[i, 3] = 0
    values[i, 0] = t
    for k in range(own):
        values[i, 1 + k] = values[i, 1 + own + k] = jumping(motion, k)
    for k in range(motion.contacts.shape[0]):
        values[i, 1 + 2 * own + k] = 0.0
    for j in range(motion.columns):
        # until `note_shifts` sets them
        values[i, 1 + 2 * own + motion.contacts.shape[0] + j] = math.nan
    motion.recorded_events = i + 1


@lean_jit
def fill_after(motion):
    """Complete the last event by the velocities after it and the impulses."""
    values = motion.event_values
    own = motion.own
    i = motion.recorded_events - 1
    for k in range(own):
        values[i, 1 + own + k] = jumping(motion, k)
    for k in range(motion.contacts.shape[0]):
        values[i, 1 + 2 * own + k] = motion.impulses[k]


@lean_jit
def settle_contact(motion, i, rate):
    """Put the coordinate of a contact that takes part in an impact exactly at its position, with
    the rate after the impact.
    """
    coordinate = motion.contacts[i, PartColumn.COORDINATE]
    if motion.multipliers > 0:  # a closed one is kept at 0 as all that is held
        motion.contacts[i, PartColumn.IDLE] = 0
    else:
        motion.coordinates[coordinate] = contact_position(motion, i)
        motion.velocities[coordinate] = motion.signs[i] * rate + 0.0
        for j in range(motion.contacts.shape[0]):
            if motion.contacts[j, PartColumn.COORDINATE] == coordinate:
                measure_gap(motion, j)
    motion.contacts[i, PartColumn.STATE] = 1 if rate == 0.0 else 0
    motion.contacts[i, PartColumn.SKIP] = 1
    motion.contacts[i, PartColumn.REACHED] = Reached.NO


@lean_jit
def closed_pulls(motion, near, b, x, u, pull):
    """The second derivatives of the gaps in `near`, where contacts at rest at 0 are closed if their
    reaction pushes; returns the contacts that are at rest, as bits."""
    still = 0
    row = 0
    count = motion.contacts.shape[0]
    for i in range(count):
        if near >> i & 1 and x[i] == 0.0 and u[i] == 0.0:
            still |= 1 << i
    size = reduce_to(motion, still)
    for i in range(count):
        if still >> i & 1:
            motion.right[row] = b[i]
            row += 1
    solved, bits = complementary(
        motion.reduced, motion.right, size, motion.block, motion.tried, motion.impulses
    )
    for i in range(count):
        pull[i], row = b[i], 0
        for j in range(count):
            if still >> j & 1:
                pull[i] += motion.coupling[i, j] * motion.impulses[row] if solved else 0.0
                row += 1
    row = 0
    for i in range(count):
        if still >> i & 1:
            if solved and bits >> row & 1:
                pull[i] = 0.0
            row += 1
    return still


@lean_jit
def time_to_close(x, u, a):
    """The time at which x + u t + a t^2 / 2 falls to 0 from above; infinite if it never does.

    It is 0 for a gap of 0 that is closing: such a gap has become smaller than the least number, by
    impacts that square it each time.
    """
    if x == 0.0 and u < 0.0:
        return 0.0
    if x == 0.0:
        return -2.0 * u / a if a < 0.0 and u > 0.0 else np.inf
    square = u * u - 2.0 * a * x
    if square < 0.0 or (a >= 0.0 and u >= 0.0):
        return np.inf
    return 2.0 * x / (math.sqrt(square) - u)


@lean_jit
def frozen_accumulation(motion, near, beside, limit):
    """The time in which the contacts in `near` lose all speed by impacts, if the accelerations stay
    constant.

    Each gap then follows parabolas between its impacts. No other contact in `beside` may close
    meanwhile. If they do not lose their speed within `limit`, minus the number of impacts that were
    followed is returned. Which of the contacts stay closed is decided later.
    """
    time = 0.0
    first = 0.0
    b = motion.pulls
    pull = motion.falling_pulls
    count = motion.contacts.shape[0]
    x = motion.falling_gaps
    u = motion.falling_rates
    for i in range(count):
        x[i], u[i] = motion.gaps[i], motion.rates[i]
        if beside >> i & 1 and not near >> i & 1:
            limit = min(limit, 0.1 * time_to_close(x[i], u[i], b[i]))
        first = max(first, abs(u[i]) if near >> i & 1 else 0.0)
    for followed in range(MOST_FROZEN_IMPACTS):
        still = closed_pulls(motion, near, b, x, u, pull)
        flight = np.inf
        for i in range(count):
            if near >> i & 1 and not (still >> i & 1 and pull[i] <= 0.0):
                flight = min(flight, time_to_close(x[i], u[i], pull[i]))
        if flight == np.inf:
            return (
                time
                if still == near and max_rate(u, pull, near, still, count) == 0.0
                else -1.0 - followed
            )
        time += flight
        if not time <= limit:
            return -1.0 - followed
        height = 0.0
        hit = still
        for i in range(count):
            if near >> i & 1:
                height = max(height, abs(u[i]) * flight)
        for i in range(count):
            if near >> i & 1 and not (still >> i & 1 and pull[i] <= 0.0):
                x[i], u[i] = (
                    x[i] + flight * (u[i] + 0.5 * flight * pull[i]),
                    u[i] + flight * pull[i],
                )
                if x[i] <= 1e-12 * height and u[i] < 0.0:
                    x[i], hit = 0.0, hit | 1 << i
        solved, _ = impact_impulses(motion, hit, u)
        if not solved:
            return -1.0 - followed
        done = True
        for i in range(count):
            if x[i] == 0.0 and u[i] <= VANISHED * first:
                u[i] = 0.0
            if near >> i & 1 and u[i] * u[i] + 2.0 * abs(b[i]) * x[i] > (FINISHED * first) ** 2:
                done = False
        if done:
            return time
    return -1.0 * MOST_FROZEN_IMPACTS


@lean_jit
def max_rate(u, pull, near, still, count):
    """The largest of the speeds of the contacts in `near` and of the accelerations with which
    resting ones open.
    """
    largest = 0.0
    for i in range(count):
        if near >> i & 1:
            largest = max(largest, abs(u[i]))
            if still >> i & 1:
                largest = max(largest, pull[i])
    return largest


@lean_jit
def near_contacts(motion, slow):
    """The contacts that may take part in an accumulation with speeds up to `slow`, as bits; 0 if
    none of them bounces.
    """
    near = 0
    bounces = False
    for i in range(motion.contacts.shape[0]):
        x = motion.gaps[i]
        u = motion.rates[i]
        b = motion.pulls[i]
        if abs(u) <= slow and x * max(abs(b), motion.pull) <= slow * slow:
            near |= 1 << i
            bounces = bounces or u > 0.0
    return near if bounces else 0


@lean_jit
def smaller_set(motion, near):
    """The contacts in `near` whose gap is 0, for an accumulation on a smaller scale; 0 if these are
    all of `near`.
    """
    smaller = 0
    for i in range(motion.contacts.shape[0]):
        if near >> i & 1 and motion.gaps[i] == 0.0:
            smaller |= 1 << i
    return smaller if smaller != near else 0


@lean_jit
def bring_to_rest(motion, near):
    """Stop the contacts in `near` by impulses on these alone, and close them."""
    count = motion.contacts.shape[0]
    row = 0
    size = reduce_to(motion, near)
    for i in range(count):
        if near >> i & 1:
            motion.right[row] = motion.rates[i]
            row += 1
    acting(motion.reduced, motion.right, size, -1, motion.block, motion.tried)
    row = 0
    for i in range(count):
        motion.impulses[i] = 0.0
        if near >> i & 1:
            motion.impulses[i] = motion.tried[row]
            row += 1
    for a in range(motion.local):
        for j in range(count):
            motion.velocities[a] += push(motion, a, j) * motion.impulses[j]
    keep_sums(motion, near)
    for i in range(count):
        if near >> i & 1:
            settle_contact(motion, i, 0.0)


@lean_jit
def keep_sums(motion, near):
    """Move the widest open gap of each dependent sum (`InGapCoordinates`), so that the sum follows
    from the others once the contacts in `near` are at their positions.

    An accumulation ends before all of its gaps are 0, and what is left of them must not stay as a
    difference of the sum and its terms.
    """
    local = motion.local
    for d in range(local - motion.first_order, local):
        lacking = 0.0
        for i in range(motion.contacts.shape[0]):
            if near >> i & 1:
                place = motion.contacts[i, PartColumn.COORDINATE]
                moved = contact_position(motion, i) - motion.coordinates[place]
                lacking += motion.solver_numbers[d * local + place] * moved
        widest = -1
        room = 0.0
        for i in range(motion.contacts.shape[0]):
            place = motion.contacts[i, PartColumn.COORDINATE]
            shut = near >> i & 1 or motion.contacts[i, PartColumn.STATE] == Touch.CLOSED
            if shut or place >= local - motion.first_order:
                continue
            if motion.solver_numbers[d * local + place] != 0.0 and motion.open_gaps[i] > room:
                widest = i
                room = motion.open_gaps[i]
        if widest >= 0 and abs(lacking) < room:
            place = motion.contacts[widest, PartColumn.COORDINATE]
            moved = -lacking / motion.solver_numbers[d * local + place]
            motion.coordinates[place] += moved
            motion.open_gaps[widest] += motion.signs[widest] * moved


@lean_jit
def slow_impacts(motion):
    """The speed of an impact below which the end of an accumulation may be near, for a contact that
    loses all of it; below this times `lost_share` for any.
    """
    return slow_share(motion) * motion.fastest


@lean_jit
def lost_share(motion, i):
    """The share of its speed that a contact loses at an impact without friction, at least
    LEAST_LOSS.

    Impacts of a speed u accumulate no sooner than after 2 u / b divided by it, with the acceleration
    b: the end of faster ones need not be looked for.
    """
    return max(LEAST_LOSS, 1.0 - restitution(motion, i, i))


@lean_jit
def contact_mobility(motion, i):
    """The acceleration of a contact's gap by a force of 1 on it."""
    if motion.multipliers > 0:
        entry = motion.mobilities[i]
        return entry if entry > 0.0 else 1.0
    return mobility(motion, motion.contacts[i, PartColumn.COORDINATE])


@lean_jit
def friction_mobility(motion, k):
    """The acceleration along a friction or a surface by a force of 1 along it."""
    row = motion.sided[k]
    if motion.multipliers > 0 and not is_surface(motion, k):
        entry = motion.mobilities[motion.contacts.shape[0] + k]
        return entry if entry > 0.0 else 1.0
    return mobility(motion, row[PartColumn.COORDINATE])


@lean_jit
def mobility(motion, coordinate):
    """The acceleration of a coordinate by a force of 1 on it, which makes an acceleration of a
    reaction."""
    entry = motion.inverse[coordinate, coordinate]
    return entry if entry > 0.0 else 1.0


@lean_jit
def press_of(motion, i):
    """The natural size of a contact's reaction."""
    return motion.press / contact_mobility(motion, i)


@lean_jit
def note_press(motion):
    """Note what presses on contacts at the start of a step, for the natural scales."""
    for i in range(motion.contacts.shape[0]):
        if motion.multipliers > 0:
            press = abs(pull_of(motion, i))
        else:
            coordinate = motion.contacts[i, PartColumn.COORDINATE]
            press = abs(motion.acceleration_series[coordinate, 0])
        if motion.contacts[i, PartColumn.STATE] == Touch.CLOSED:
            reaction = abs(motion.margin_series[i, 0])
            press = max(press, reaction * contact_mobility(motion, i))
        motion.press = max(motion.press, press)


@lean_jit
def note_rubs(motion):
    """Note what presses on frictions and surfaces at the start of a step, and sliding speeds, for
    the natural scales."""
    for k in range(motion.sided.shape[0]):
        inert = motion.sided[k, PartColumn.PRESSED] == NoPress.INERT
        if inert or is_function(motion, k):
            continue
        if motion.multipliers > 0 and not is_surface(motion, k):
            press = abs(pull_of(motion, motion.contacts.shape[0] + k))
            speed = abs(motion.slide_rates[k])
        else:
            coordinate = motion.sided[k, PartColumn.COORDINATE]
            press = abs(motion.acceleration_series[coordinate, 0])
            speed = abs(motion.velocities[coordinate])
        motion.swiftest = max(motion.swiftest, speed)
        if motion.sided[k, PartColumn.STATE] == Side.HELD:
            row = motion.contacts.shape[0] + 2 * k
            margin = max(abs(motion.margin_series[row, 0]), abs(motion.margin_series[row + 1, 0]))
            press = max(press, margin * friction_mobility(motion, k))
        motion.press = max(motion.press, press)


@lean_jit
def only_open(contacts):
    """Whether the only guards known to be 0 are the gaps of contacts that have just opened."""
    known = True
    for i in range(contacts.shape[0]):
        known = known and contacts[i, PartColumn.SKIP] <= 1 - contacts[i, PartColumn.STATE]
    return known


@lean_jit
def bounces_slowly(motion):
    """Whether a contact has just impacted so slowly that its next one may end an accumulation."""
    slow = slow_impacts(motion)
    for i in range(motion.contacts.shape[0] if motion.multipliers == 0 else 0):
        row = motion.contacts[i]
        if row[PartColumn.STATE] == Touch.OPEN and row[PartColumn.SKIP] == 1:
            rate = motion.signs[i] * motion.velocities[row[PartColumn.COORDINATE]]
            if 0.0 < rate <= slow * lost_share(motion, i):
                return True
    return False


@lean_jit
def is_smooth(motion):
    """Whether a motion without friction, and not in eigenmodes, is on a smooth arc, with no guards
    known to be 0 but those of `only_open`. Between slow impacts it is not: lanes would give each of
    them back."""
    together = motion.sided.shape[0] == 0 and motion.eigenmodes.size == 0
    smooth = motion.mode == Mode.ARC and together and only_open(motion.contacts)
    return smooth and not bounces_slowly(motion)


@lean_jit
def undecide(motion, opened):
    """Close those contacts in `opened` again that are at rest: which of them stay closed is decided
    later.
    """
    for i in range(motion.contacts.shape[0]):
        if opened >> i & 1 and motion.multipliers > 0:
            if told_rate(motion, i) == 0.0:
                motion.contacts[i, PartColumn.STATE] = Touch.CLOSED
        elif (
            opened >> i & 1 and motion.velocities[motion.contacts[i, PartColumn.COORDINATE]] == 0.0
        ):
            motion.contacts[i, PartColumn.STATE] = Touch.CLOSED
