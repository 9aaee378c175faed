"""The closed contacts of a lane, for models with several contacts.

Its compiled part goes into one module with that of `contacts/lane_step.py`, and with that of `contacts_handoff.py`.
"""

from __future__ import annotations

from saltus.flow.contacts.layout import ContactColumn
from saltus.flow.kernel.memory_layout import LanePart
from saltus.flow.lanes.lane_layout import Size, Slot
from saltus.taylor import get, lean_jit, put

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def tell_closed(lane, at, m, contacts):
    """Tell the model's functions which coordinates of a lane are free; returns its closed contacts as bits."""
    closed = 0
    for d in range(at[LanePart.CONTACTS] - at[LanePart.FREE]):
        put(m, at[LanePart.FREE] + d, lane, 1.0)
    for i in range(contacts.shape[0]):
        if contacts[i, ContactColumn.CLOSED] == 1:
            closed |= 1 << i
            put(m, at[LanePart.FREE] + contacts[i, ContactColumn.COORDINATE], lane, 0.0)
    return closed


@lean_jit
def contacts_of(lane, sizes, at, m, contacts):
    """Fill the scalar kernel's `contacts` for a lane that moves smoothly; a gap that has just opened may still be 0.

    `WAITS` is kept: looking for the end of an accumulation too often could take as long as all its impacts.
    """
    closed = int(get(m, Slot.SIDE, lane)) - 1
    for i in range(contacts.shape[0]):
        coordinate = sizes[Size.CONTACTS + 1 + i]
        there = get(m, at[LanePart.POSITION] + coordinate, lane) == get(m, at[LanePart.CONTACTS] + i, lane)
        contacts[i, ContactColumn.COORDINATE], contacts[i, ContactColumn.CLOSED] = coordinate, closed >> i & 1
        contacts[i, ContactColumn.SKIP] = 1 if there and not closed >> i & 1 else 0
        contacts[i, ContactColumn.RELEASED] = 0
