"""The contract of parts: what in a model holds, stops, rubs, switches or resets a motion.

A contact, a friction, a surface, a switch, a relay is a *part*. Between events all parts keep their
states, and the motion is smooth. Each part has a row of whole numbers in one table
(`PartColumn` in `flow/kernel/contact_layout.py`), contacts first (`motion.contacts`), then those
with two sides (`motion.sided`), and answers these questions. The answers of each kind are listed by
the same numbers in its own file: contacts in `closings.py`, frictions in `frictions.py`, surfaces in
`surfaces.py`, functions and relays in `functions.py`. A reset is no part, but what happens at zero
of a surface (`resets.py`).

1. **Row**: which columns does it use, and what is it traced to (`Trace.sided`, whose `marks` are further columns)?
2. **Guard**: which series is not negative on its present side, and 0 at its event
   (`guard_series`)?
3. **State**: a `Touch` or a `Side`; what do the model's functions read of it (`hold_sides`)?
4. **Multiplier**: what holds it at 0 of the guard, and between which bounds?
5. **Step**: which series bound the length of a step (`sided_step_size`)?
6. **Zero**: where in the step is its first event (`first_sided`)?
7. **What happens at zero**: what is set exactly, and what jumps (`reach_guard`, `contact_impact`,
   `reset_state`)?
8. **What continues**: which states are possible behind an event, and which one is taken
   (`undecided`, then `decide_contacts` in `kernel.py`)?
9. **Record**: which event does a change of its state leave (`record_sides`)?
10. **Derivatives**: how does its instant move with the tangent's columns, and what do they become
    (`reach_guard`, `tangent.py`)?
11. **Start**: which state has it at the start (`ContactState` in `flow/motion/kernel_state.py`;
    lanes `lane_step.py`; pages `web/page/run.js`)? One that the state does not tell is *remembered*.

The class of a surface in a model answers some of them in Python (`Surface` and `Relay` in
`systems/contracts/contact_model.py`): `kind` and `marks` for 1, `guard` and `methods` for 2, with
the `sign` of its side for 3, `remembered` and `start_side` for 11. Tracing, checks, orbits and
starts ask these and no class.

Outside the kernel the mode of a step has two bits for each part with sides (`side_bits`), which
`modes_of` in `flow/motion/events.py` reads.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of
`flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.rows import row_series
from saltus.flow.kernel.contact_layout import (
    FrictionImpact,
    PartColumn,
    Reached,
    Side,
    first_flag,
    guard_level,
    is_function,
    is_surface,
)
from saltus.taylor import lean_jit

# --- compiled from here on ---------------------------------------------------


@lean_jit
def hold_sides(motion):
    """Tell the model's functions, through `env`, in which direction each friction slides, and that
    sticking coordinates are not free."""
    first = first_flag(motion)
    for k in range(motion.sided.shape[0]):
        slides = motion.sided[k, PartColumn.STATE]
        motion.parameters[first - 2 - motion.sided.shape[0] + k] = (
            1.0 * slides if slides != Side.OFF else 0.0
        )
        if slides != Side.HELD or is_function(motion, k):
            continue
        if motion.multipliers > 0:
            idle = motion.sided[k, PartColumn.IDLE]
            motion.parameters[first - 2 - motion.sided.shape[0] + k] = 2.0 * idle
            if idle == 0:
                motion.parameters[first + motion.contacts.shape[0] + k] = 0.0
        else:
            motion.parameters[first + motion.sided[k, PartColumn.COORDINATE]] = 0.0


@lean_jit
def guard_series(motion, k, direction, order, g):
    """The Taylor coefficients of a friction's sliding speed along a direction, or of the distance
    from a surface on a side.
    """
    v = motion.velocity_series[motion.sided[k, PartColumn.COORDINATE]]
    if is_function(motion, k):
        v = motion.margin_series[motion.contacts.shape[0] + 2 * k]
    elif is_surface(motion, k):
        v = motion.coordinate_series[motion.sided[k, PartColumn.COORDINATE]]
    elif motion.multipliers > 0:
        v = motion.margin_series[row_series(motion, motion.contacts.shape[0] + k)]
    for i in range(order + 1):
        g[i] = direction * v[i]
    g[0] -= direction * guard_level(motion, k)


@lean_jit
def side_bits(motion, count):
    """The direction of each friction plus 1 (0, 1 or 2; 3 of an open contact), in two bits each,
    behind the bits of `count` contacts."""
    bits = 0
    for k in range(motion.sided.shape[0]):
        bits |= (1 + motion.sided[k, PartColumn.STATE]) << (count + 2 * k)
    return bits


@lean_jit
def states_before(motion):
    """The directions of all frictions plus 1, as the base-4 digits of a number."""
    number = 0
    for k in range(motion.sided.shape[0] - 1, -1, -1):
        number = 4 * number + 1 + motion.sided[k, PartColumn.STATE]
    return number


@lean_jit
def any_reached(motion):
    """Whether the guard of any friction has just reached 0."""
    found = False
    for k in range(motion.sided.shape[0]):
        found = found or motion.sided[k, PartColumn.REACHED] != Reached.NO
    return found


@lean_jit
def is_to_read(motion, k):
    """Whether the side of a function is to be chosen: it has just been reached, or may have
    jumped."""
    row = motion.sided[k]
    found = row[PartColumn.REACHED] != Reached.NO or row[PartColumn.STRUCK] == FrictionImpact.JUMPED
    return found and is_function(motion, k)
