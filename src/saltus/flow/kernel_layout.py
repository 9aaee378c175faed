"""The numbers that the kernel and its callers share: modes, reasons, events, places in its arrays, and its thresholds.

This text is compiled together with the kernel (see `kernel.py`).
"""

from __future__ import annotations

import numpy as np

# --- compiled from here on -----------------------------------------------------------------------------------------------

ARC, CONTACT, REST, CHATTER = 0, 1, 2, 3  # modes
DONE, FULL, PAUSED, NOT_UNIQUE, NO_IMPACT, NOT_FINITE, STALLED, LIMITED, VISITED = range(9)  # why `advance` returns
IMPACT, GRAZING, RESTING, RELEASE, CHATTERING, LIMIT = 0, 1, 2, 3, 4, 5  # events
RESET_SLOPES = 6  # for `tangent`: the derivatives of the reset alone, at a fixed instant of impact
AFTER_IMPACTS, AT_ONCE, NEVER_AGAIN = 0, 1, 2  # how rest comes about, for `tangent`: never again for states beside it,
AT_A_ROOT, AT_A_JUMP, AT_NONE = 0, 1, 2  # and a release: where the contact acceleration has a simple root, or jumps through 0
TRIPLE = 1  # a grazing that leaves no speed, in place of a touch
PERIOD, MODE, SIDE, SKIP, PIECE, STEPS = 0, 1, 2, 3, 4, 5  # in `where`,
EVENTS, LAST, ORDER, DENSE, FORCED, HELD = 6, 7, 8, 9, 10, 11
DOF, STOPS, ROWS, SIDES = 12, 13, 14, 15  # and the structure's: coordinates, margins, workspace rows, sides of the contact,
STEEP = 16  # whether it has functions whose bends a series may not see
VISIT = 17  # whether `advance` returns VISITED as soon as a smooth motion is all there is (see `driver.py`)
OWN, COLUMNS = 18, 19  # the model's own coordinates, and the columns of a tangent: DOF = OWN (1 + COLUMNS) are followed
WHERE = 20  # the length of `where`
TIME, SPEED, STATE = 0, 1, 2  # in `state`: local time, chatter speed, then DOF coordinates, DOF velocities, COLUMNS shifts
LENGTH, END, TOLERANCE = 0, 1, 2  # in `settings`: the forcing period, the local time at the end, the tolerance,
HORIZON = 3  # and in a visit, which ends before its motion may, the local time at which that does

SAFETY = 0.9  # of a step: its error is then a tenth of tol, and 1000 periods add up to a drift in energy below 1e-12
GAP = 0.65  # in the log of the radius between the last terms and those before: 0.6 for a sine, more where they vanish
DEFECT = 100.0  # between a series and the equation at the end of a step, in tol size / h: sound steps stay below 4
SHORTEST = 1e-9  # step, in units of time or of a shorter forcing period: below it the acceleration is singular
SMALLEST = 1e-6  # size below which a step's error is absolute, not relative
ZERO = 1e-14  # an acceleration at contact below this is zero: it is a difference of loads of order 1
ROUGHER = 100.0  # in tol: a column's series may end so much earlier than the motion's, whose steps then decide alone
EXACT = 1e-15  # at rest a small error of the load would decide whether a touch is a release, and there steps cost little
SLOW = 3.0  # in sqrt(tol): a faster impact is not tested for being the end of an accumulation
CHATTER_SPEED = 1e-5  # the averaged law is then wrong by 5e-5 of the speed; following on takes 1e5 impacts a unit of time
SLOWLY = 0.02  # the most that the contact accelerations may change over two impacts for the averaged law
TINY = 1e-60  # a speed so small that a limit is reached, and its square still a number
LOSSLESS = 1e-12  # a loss of speed over two impacts below this is rounding
BATCH = 100_000  # passes of the loop before the caller may look (Ctrl-C)
GAUSS_NODES = np.array([0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263])
GAUSS_WEIGHTS = np.array([0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269])
