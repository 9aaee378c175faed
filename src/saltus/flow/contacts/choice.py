"""The decision which of the contacts that are at rest at their positions stay closed.

Its compiled part goes into one module with that of `kernel.py`; the words of `motion` are those of `flow/kernel/memory.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.frictions import choose_slides, hold_frictions, slides_so
from saltus.flow.contacts.impacts import contact_position, gap_series, hold_coordinates
from saltus.flow.contacts.layout import TIED, ContactColumn
from saltus.flow.kernel.roots import leading
from saltus.flow.kernel.steps import expand
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def holds(motion, candidates):
    """Whether the first non-zero Taylor coefficients of the guards confirm the choice of closed contacts among the candidates;
    notes how many coefficients before them are 0."""
    order, g, count = motion.order, motion.gap_series, motion.contacts.shape[0]
    for i in range(count):
        if not candidates >> i & 1:
            continue
        known = motion.contacts[i, ContactColumn.RELEASED]
        if motion.contacts[i, ContactColumn.CLOSED] == 1:
            k = leading(motion.margin_series[i], known, order)
            if k < order and motion.margin_series[i, k] < 0.0:
                return False
        else:
            gap_series(motion, i, contact_position(motion, i), order, g)
            k = leading(g, 2 + known, order)
            if k == order or g[k] < 0.0:
                return False
        motion.contacts[i, ContactColumn.SKIP] = k
    return True


@lean_jit
def choose_closed(motion, candidates, still, t):
    """Decide which of the candidates, which are at rest at their positions, stay closed; False if no choice is consistent.

    The choice fulfils 0 <= reaction _|_ second derivative of the gap >= 0; where both are 0, their first non-zero derivatives
    decide likewise. It is decided together which of the frictions in `still`, which have the speed of their ground, stick: all
    that can.
    """
    count = motion.contacts.shape[0]
    for number in range((1 << count) * 3 ** motion.frictions.shape[0]):
        choice = number & ((1 << count) - 1)  # the bits of those that open
        if choice & ~candidates or not choose_slides(motion, still, number >> count):
            continue
        for i in range(count):
            if candidates >> i & 1:
                motion.contacts[i, ContactColumn.CLOSED] = 1 - (choice >> i & 1)
        hold_coordinates(motion)
        hold_frictions(motion)
        expand(motion, t, 1.0, motion.order)
        agrees = holds(motion, candidates)
        if agrees and slides_so(motion, count, still):
            return True
    return False


@lean_jit
def note_ties(motion, candidates, t):
    """Note for all candidates whose reaction is 0 within rounding that it is known to be 0, as for a contact that is released.

    Cells of a chain that move alike release their contacts at one instant, but with different rounding errors.
    """
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1:
            motion.contacts[i, ContactColumn.CLOSED] = 1
    hold_coordinates(motion)
    expand(motion, t, 1.0, 2)
    for i in range(motion.contacts.shape[0]):
        if candidates >> i & 1 and abs(motion.margin_series[i, 0]) <= TIED:
            motion.contacts[i, ContactColumn.RELEASED] = 1
