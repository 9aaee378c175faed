"""A step of all lanes of a model with several contacts: the smooth motion up to the first closing of a gap, and impacts.

Its compiled part goes into one module with that of `lanes/driver.py`, in the place of `one_contact/lane_step.py`, and with
those of `lanes/contact_steps.py` and `lanes/lane_impacts.py`. Lanes move together as long as all closed contacts certainly push
and at most one gap closes. Releases, contacts that close together, slow impacts and rest are left to the scalar kernel, and so
are all events of motions with a tangent. The scalar kernel does all steps of motions with frictions.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.layout import ContactColumn, FrictionColumn
from saltus.flow.contacts.solver_memory import solver_arrays
from saltus.flow.kernel.layout import Mode
from saltus.flow.kernel.memory import MOTION
from saltus.flow.kernel.memory_layout import SERIES_LENGTH, LanePart
from saltus.flow.lanes.contact_steps import free_step, of_free, one_free_step, one_is_free, pass_ends_of_free
from saltus.flow.lanes.contacts_of_lane import tell_closed
from saltus.flow.lanes.lane_impacts import resolve_impacts
from saltus.flow.lanes.lane_layout import Code, Flag, Helper, JobArray, LaneArray, LaneLabel, Size, Slot
from saltus.flow.lanes.lane_steps import commit
from saltus.flow.lanes.sampling import LONGEST_RECURRENCE, pass_ends, record_others, record_range
from saltus.taylor import (
    WIDTH,
    bits,
    first_lane,
    inline_jit,
    jit,
    lane_count,
    lean_jit,
    load,
    mask,
    put,
    select,
    splat,
    vector_lane,
)

# --- compiled from here on -----------------------------------------------------------------------------------------------


COST_OF_SEVERAL = 3  # The time of a step with the series of all coordinates, in units of that with the series of one.


@jit
def lane_arrays(sizes, at):
    """Arrays with a row for each lane, in the places of `LaneArray`."""
    own, count, frictions = sizes[Size.OWN], sizes[Size.CONTACTS], sizes[Size.FRICTIONS]
    return (
        np.zeros((WIDTH, 8), dtype=np.int64),
        np.zeros((WIDTH, 2)),
        np.zeros((WIDTH, at[LanePart.RECORDS] - at[LanePart.CONSTANTS])),
        np.zeros((WIDTH, own * own + count * count + count + frictions)),
        np.zeros((WIDTH, 2 * LONGEST_RECURRENCE, 2 * own)),
        np.zeros((WIDTH, LONGEST_RECURRENCE + 1), dtype=np.int64),
        np.zeros((WIDTH, count + frictions, ContactColumn.WAITS + 1), dtype=np.int64),
    )


@jit
def lane_space(sizes, at):
    """Room for two polynomials of one lane, and for an impact: a record MOTION, `state`, `contacts` and the solver's arrays."""
    own, count, frictions = sizes[Size.OWN], sizes[Size.CONTACTS], sizes[Size.FRICTIONS]
    return (
        np.zeros(SERIES_LENGTH + 2),
        np.zeros(SERIES_LENGTH + 2),
        np.zeros(1, dtype=MOTION),
        np.zeros(2 * own),
        np.zeros((count, ContactColumn.WAITS + 1), dtype=np.int64),
        solver_arrays(own, count, 0, frictions),
    )


@lean_jit
def begin_contact(lane, code, sizes, at, m, lanes, env, state, piece):
    """Tell a lane where its contacts are; returns the mode in which a motion begins, and 1 plus the bits of closed contacts."""
    own, count = sizes[Size.OWN], sizes[Size.CONTACTS]
    solved, contacts = lanes[LaneArray.GEOMETRY][lane], lanes[LaneArray.CONTACTS][lane]
    code[Code.GEOMETRY](env, piece, m, solved)  # any state will do: positions depend on parameters alone
    mode = Mode.ARC
    for i in range(count):
        coordinate, position = sizes[Size.CONTACTS + 1 + i], solved[own * own + count * count + i]
        put(m, at[LanePart.CONTACTS] + i, lane, position)
        sign = sizes[Size.CONTACTS + 1 + count + i]
        gap, rate = sign * (state[coordinate] - position), sign * state[state.size // 2 + coordinate]
        contacts[i, ContactColumn.COORDINATE] = coordinate
        contacts[i, ContactColumn.CLOSED] = 1 if gap == 0.0 and rate == 0.0 else 0
        contacts[i, ContactColumn.SKIP], contacts[i, ContactColumn.RELEASED] = 1 if gap == 0.0 else 0, 0
        contacts[i, ContactColumn.WAITS] = 0
        if not (gap > 0.0 or (gap == 0.0 and rate >= 0.0)):
            mode = Mode.BEYOND
        elif gap == 0.0 and mode == Mode.ARC:
            mode = Mode.CONTACT
    for k in range(sizes[Size.FRICTIONS]):
        coordinate, row = sizes[Size.CONTACTS + 1 + 2 * count + k], contacts[count + k]
        rate = state[state.size // 2 + coordinate] - solved[own * own + count * count + count + k]
        row[FrictionColumn.COORDINATE], row[FrictionColumn.SKIP] = coordinate, 0
        row[FrictionColumn.SLIDES] = 1 if rate > 0.0 else -1 if rate < 0.0 else 0
        row[FrictionColumn.MARGIN] = row[FrictionColumn.REACHED] = 0
        mode = Mode.CONTACT if mode == Mode.ARC else mode
    lanes[LaneArray.LABELS][lane, LaneLabel.LEAVE_BY] = 1 if mode == Mode.CONTACT else 0  # derivatives are then one-sided
    return mode, 1 + tell_closed(lane, at, m, contacts[:count])


@inline_jit
def step_all(code, scalar, sizes, at, m, flags, settings, limits, helpers, lanes, jobs, tables, space):
    """One step, either of all lanes in which exactly one coordinate is free, or of all other lanes: of those that are more
    numerous relative to the cost of their step.

    The choice changes no motion, as the other lanes only wait. Returns bits for the scalar kernel, bits captured, and bits past
    the end of their forcing period.
    """
    alive, one = flags[Flag.BUSY] & ~flags[Flag.SCALAR], False
    if sizes[Size.ONE_FREE] > 0:
        with_one = alive & one_is_free(sizes, at, m)
        one = lane_count(alive & ~with_one) <= COST_OF_SEVERAL * lane_count(with_one)
        alive = with_one if one else alive & ~with_one
    if one:
        hit, sound, h, tau, bend, which = one_free_step(code, sizes, at, m, settings, limits, alive, helpers, space)
    else:
        hit, sound, h, tau, bend, which = free_step(code, sizes, at, m, settings, limits, alive, helpers, space)
    hit &= sound & alive
    resolved, moved, waiting = 0, alive & sound & ~hit, 0
    if hit and sizes[Size.COLUMNS] == 0:  # impacts with a tangent are left to the scalar kernel
        resolved = resolve_impacts(code, sizes, at, m, settings, hit, which)
        waiting = hit & ~resolved
    while waiting:
        lane = first_lane(waiting)
        waiting &= waiting - 1
        impact = helpers[Helper.IMPACT]
        which_one = 1 << int(vector_lane(which, lane))
        if impact(lane, which_one, scalar, sizes, at, m, settings, lanes, jobs[JobArray.PARAMETERS], tables, space):
            resolved |= 1 << lane
    moved |= resolved
    past = moved & bits(load(m, Slot.NEW_TIME) > load(m, Slot.PERIOD_END))
    if past and sizes[Size.ENDS_ASKED] > 0:
        if one:
            pass_ends_of_free(m, at, sizes, h, bend, which, past, helpers, space)
        else:
            pass_ends(m, at, sizes, h, bend, past, helpers, space[0], space[1])
    if sizes[Size.EXTREMA] > 0:
        record_step(m, at, sizes, one, h, bend, tau, which, past, moved, helpers, space)
    commit(at, m, moved, resolved, load(m, Slot.NEW_SPEED))
    return alive & ~moved, 0, past


@inline_jit
def record_step(m, at, sizes, one, h, bend, tau, which, past, moved, helpers, space):
    """Record the extrema of all coordinates up to the new state; in lanes `past` the end of a period, from this end."""
    after, positions, velocities = mask(past), at[LanePart.NEW_POSITION], at[LanePart.NEW_VELOCITY]
    begin = select(after, load(m, Slot.PERIOD_END) - load(m, Slot.NOW), splat(0.0))
    if one:  # held coordinates are constant, and the records of the period begin with them
        v_begin = select(after, of_free(m, sizes, at[LanePart.ENDED_VELOCITY], which), load(m, Slot.FREE_VELOCITY))
        x, v = of_free(m, sizes, positions, which), of_free(m, sizes, velocities, which)
        record_range(m, at, 0, sizes, h, bend, begin, v_begin, tau, x, v, moved, helpers, space[0], space[1])
    else:
        v_begin, x, v = load(m, at[LanePart.ENDED_VELOCITY]), load(m, positions), load(m, velocities)
        v_begin = select(after, v_begin, load(m, at[LanePart.VELOCITY]))
        record_range(m, at, 0, sizes, h, bend, begin, v_begin, tau, x, v, moved, helpers, space[0], space[1])
        record_others(m, at, sizes, h, past, tau, moved, helpers, space[0], space[1])
