"""An impact of one lane of a model with several contacts, where all lanes together cannot resolve
it.

Its compiled part goes into one module with that of `programs/lane_handoff.py`; the driver calls it through
a pointer.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contacts.impacts import (
    apply_impulses,
    closed_bits,
    fill_contact_matrices,
    impact_impulses,
    jump_first_order,
    lost_share,
    settle_contact,
)
from saltus.flow.contacts.lane_handoff import functions_of
from saltus.flow.contacts.lane_impacts import read_contacts, write_closed
from saltus.flow.kernel.memory import LaneImpactParts, MotionMemory
from saltus.flow.kernel.steps import state_arrays
from saltus.flow.lane_steps.function_types import CONTACTS_IMPACT
from saltus.flow.programs.lane_handoff import own_env
from saltus.taylor import by_reference, cached_jit

# --- compiled from here on ---------------------------------------------------


@cached_jit(CONTACTS_IMPACT)
def contacts_impact(lane, hit):
    """Apply the impact law to a lane at its new state, where the contacts in `hit` close; returns 1
    if that was enough.

    Otherwise it returns 0 and leaves the lane unchanged, for the scalar kernel to take over: where
    the law has no solution, where the remaining speeds are so small that an accumulation may end,
    and where everything is at rest.
    """
    (array, state, contacts, solver) = lane.impact_space
    own = lane.sizes.own
    env = own_env(lane)
    numbers = array[0]
    rates = solver.rates
    speed = np.inf
    numbers.dof, numbers.own, numbers.local, numbers.piece = own, own, lane.sizes.local, lane.piece
    numbers.first_order = lane.sizes.first_order
    numbers.time, numbers.origin = lane.new_time, lane.origin
    parts = LaneImpactParts(
        state_arrays(numbers, state), env, env[0], functions_of(lane), contacts, solver
    )
    motion = by_reference(MotionMemory(numbers, parts))
    for row in range(2 * own):  # velocities follow the positions in both memories
        state[row] = lane.new_position[row]
    read_contacts(lane, contacts)
    regular = fill_contact_matrices(motion)
    slow = lane.settings.slowest_impact * lane.fastest
    chosen = hit | closed_bits(motion)
    for i in range(contacts.shape[0]):
        if hit >> i & 1:
            speed = min(speed, -rates[i])
    solved, _ = impact_impulses(motion, chosen, rates)
    if not regular or not speed > 0.0 or not solved:
        return 0
    jump_first_order(motion, hit)
    apply_impulses(motion)
    free = own - lane.sizes.dependent
    for i in range(contacts.shape[0]):
        if chosen >> i & 1:
            settle_contact(motion, i, rates[i])
            if rates[i] == 0.0:
                free -= 1
            elif rates[i] <= slow * lost_share(motion, i):
                return 0
    if free == 0:
        return 0
    write_closed(lane, contacts)
    lane.new_speed = speed
    for row in range(2 * own):
        lane.after_position[row] = state[row]
    return 1
