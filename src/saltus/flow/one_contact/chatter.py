"""Chatter: impacts without loss that are too small and too many to be followed, by the averaged law of their speed.

The speeds v_s on the sides s are proportional to one speed v. The action v^2 sum v_s / abs(a_s) decays with the mean damping over
a cycle, sum g_s v_s / abs(a_s) / sum v_s / abs(a_s), under any load that presses both contacts. The phase of the impacts is lost.

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import math

from saltus.flow.kernel.layout import GAUSS_NODES, GAUSS_WEIGHTS
from saltus.flow.kernel.roots import horner
from saltus.flow.one_contact.impacts import contact_accelerations, rate_of
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def chatter_sums(motion, h, x, factor, t):
    """The sums over the sides of g v / abs(a) and v / abs(a), with the damping g, for unit speed, at the share x of a step."""
    b, order = motion.pull_series, motion.order
    damping, duration = 0.0, 0.0
    for i in range(motion.sides):
        side = 1.0 - 2.0 * i
        pull = abs(horner(b[i], order, x * h))
        share = (1.0 if side == motion.side else factor) / pull
        damping += share * motion.contact_damping(t + x * h, motion.origin, side, motion.env, motion.piece)
        duration += share
    return damping, duration


@lean_jit
def chatter_decay(motion, h):
    """Advance the chatter speed over a step: the action, v^2 times the duration sum v_s/abs(a_s), decays as the mean damping."""
    t, side = motion.time, float(motion.side)
    contact_accelerations(motion, t)
    next_side, after = motion.reset(
        t, motion.origin, -motion.chatter_speed / rate_of(motion, side), side, motion.env, motion.piece
    )
    factor = rate_of(motion, next_side) * after / motion.chatter_speed
    decay = 0.0
    for j in range(GAUSS_NODES.size):
        damping, duration = chatter_sums(motion, h, GAUSS_NODES[j], factor, t)
        decay += GAUSS_WEIGHTS[j] * h * damping / duration
    _, before = chatter_sums(motion, h, 0.0, factor, t)
    _, after_step = chatter_sums(motion, h, 1.0, factor, t)
    motion.chatter_speed *= (math.exp(-decay) * before / after_step) ** (1.0 / 3.0)
