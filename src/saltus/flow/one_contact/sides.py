"""The side of the contact on which a state moves on: one rule for single motions and for lanes.

Its compiled part goes into one module with that of `lanes/driver.py`; `motion/simulate.py` calls it as plain Python.
"""

from __future__ import annotations

from saltus.flow.kernel.layout import Geometry, Mode
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def side_of_state(sides, position, velocity, geometry):
    """The mode and the side of a state: from the gap; at the contact from the velocity; at rest there the mode CONTACT decides.

    The mode is BEYOND if the state lies on no side of the contact. A motion that starts at the contact with a velocity that
    closes the gap of every side is on an ARC that begins with its impact.
    """
    if sides == 0:
        return Mode.ARC, 1
    into, open_side, pressed = 0, 0, False
    for i in range(sides):
        side, rate = 1 - 2 * i, geometry[Geometry.RATE_UP + i]
        gap = rate * (position - geometry[Geometry.CONTACT])
        if gap > 0.0 and open_side == 0:
            open_side = side
        pressed = pressed or gap < 0.0
        if rate * velocity > 0.0 and into == 0:
            into = side
    if open_side != 0:
        return Mode.ARC, open_side
    if pressed:
        return Mode.BEYOND, 1
    if velocity == 0.0:
        return Mode.CONTACT, 1
    return (Mode.CONTACT, into) if into != 0 else (Mode.ARC, 1)
