"""The decision which of the contacts that are at rest at their positions stay closed.

Its compiled part goes into one module with that of `kernel.py`, whose docstring defines the arguments.
"""

from __future__ import annotations

from saltus.flow.contacts.frictions import choose_slides, hold_frictions, slides_so
from saltus.flow.contacts.impacts import contact_position, gap_series, hold_coordinates
from saltus.flow.contacts.layout import TIED, ContactColumn
from saltus.flow.kernel.layout import Where, Work
from saltus.flow.kernel.roots import leading
from saltus.flow.kernel.steps import expand
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def holds(where, model, contacts, work, solver, candidates):
    """Whether the first non-zero Taylor coefficients of the guards confirm the choice of closed contacts among the candidates;
    notes how many coefficients before them are 0."""
    order, g, own, count = where[Where.ORDER], work[Work.GAP], where[Where.OWN], contacts.shape[0]
    for i in range(count):
        if not candidates >> i & 1:
            continue
        known = contacts[i, ContactColumn.RELEASED]
        if contacts[i, ContactColumn.CLOSED] == 1:
            k = leading(work[Work.MARGINS][i], known, order)
            if k < order and work[Work.MARGINS][i, k] < 0.0:
                return False
        else:
            gap_series(model, contacts, work, i, contact_position(solver, own, count, i), order, g)
            k = leading(g, 2 + known, order)
            if k == order or g[k] < 0.0:
                return False
        contacts[i, ContactColumn.SKIP] = k
    return True


@lean_jit
def choose_closed(where, state, env, model, contacts, frictions, work, solver, candidates, still, t, origin):
    """Decide which of the candidates, which are at rest at their positions, stay closed; False if no choice is consistent.

    The choice fulfils 0 <= reaction _|_ second derivative of the gap >= 0; where both are 0, their first non-zero derivatives
    decide likewise. It is decided together which of the frictions in `still`, which have the speed of their ground, stick: all
    that can.
    """
    count = contacts.shape[0]
    for number in range((1 << count) * 3 ** frictions.shape[0]):
        choice = number & ((1 << count) - 1)  # the bits of those that open
        if choice & ~candidates or not choose_slides(frictions, still, number >> count):
            continue
        for i in range(count):
            if candidates >> i & 1:
                contacts[i, ContactColumn.CLOSED] = 1 - (choice >> i & 1)
        hold_coordinates(where, env, contacts)
        hold_frictions(where, env, frictions)
        expand(where, state, env, model, work, t, origin, 1.0, where[Where.ORDER])
        agrees = holds(where, model, contacts, work, solver, candidates)
        if agrees and slides_so(where, frictions, count, work, solver, still):
            return True
    return False


@lean_jit
def note_ties(where, state, env, model, contacts, work, candidates, t, origin):
    """Note for all candidates whose reaction is 0 within rounding that it is known to be 0, as for a contact that is released.

    Cells of a chain that move alike release their contacts at one instant, but with different rounding errors.
    """
    for i in range(contacts.shape[0]):
        if candidates >> i & 1:
            contacts[i, ContactColumn.CLOSED] = 1
    hold_coordinates(where, env, contacts)
    expand(where, state, env, model, work, t, origin, 1.0, 2)
    for i in range(contacts.shape[0]):
        if candidates >> i & 1 and abs(work[Work.MARGINS][i, 0]) <= TIED:
            contacts[i, ContactColumn.RELEASED] = 1
