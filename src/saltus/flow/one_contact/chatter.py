"""Chatter: impacts without loss that are too small and too many to be followed, by the averaged law of their speed.

The speeds v_s on the sides s are proportional to one speed v. The action v^2 sum v_s / abs(a_s) decays with the mean damping over
a cycle, sum g_s v_s / abs(a_s) / sum v_s / abs(a_s), under any load that presses both contacts. The phase of the impacts is lost.

Its compiled part goes into one module with that of `kernel.py`.
"""

from __future__ import annotations

import math

from saltus.flow.kernel.layout import GAUSS_NODES, GAUSS_WEIGHTS, ModelPart, Where, Work
from saltus.flow.kernel.memory_layout import State
from saltus.flow.kernel.roots import horner
from saltus.flow.one_contact.impacts import contact_accelerations, rate_of
from saltus.taylor import lean_jit

# --- compiled from here on -----------------------------------------------------------------------------------------------


@lean_jit
def chatter_sums(where, env, model, work, h, x, factor, t, origin):
    """The sums over the sides of g v / abs(a) and v / abs(a), with the damping g, for unit speed, at the share x of a step."""
    b, order = work[Work.CONTACT], where[Where.ORDER]
    damping, duration = 0.0, 0.0
    for i in range(where[Where.SIDES]):
        side = 1.0 - 2.0 * i
        pull = abs(horner(b[i], order, x * h))
        share = (1.0 if side == where[Where.SIDE] else factor) / pull
        damping += share * model[ModelPart.CONTACT_DAMPING](t + x * h, origin, side, env, where[Where.PIECE])
        duration += share
    return damping, duration


@lean_jit
def chatter_decay(where, state, env, model, work, h, origin):
    """Advance the chatter speed over a step: the action, v^2 times the duration sum v_s/abs(a_s), decays as the mean damping."""
    t, side = state[State.TIME], float(where[Where.SIDE])
    contact_accelerations(where, env, model, work, t, origin)
    next_side, after = model[ModelPart.RESET](
        t, origin, -state[State.CHATTER_SPEED] / rate_of(model, side), side, env, where[Where.PIECE]
    )
    factor = rate_of(model, next_side) * after / state[State.CHATTER_SPEED]
    decay = 0.0
    for j in range(GAUSS_NODES.size):
        damping, duration = chatter_sums(where, env, model, work, h, GAUSS_NODES[j], factor, t, origin)
        decay += GAUSS_WEIGHTS[j] * h * damping / duration
    _, before = chatter_sums(where, env, model, work, h, 0.0, factor, t, origin)
    _, after_step = chatter_sums(where, env, model, work, h, 1.0, factor, t, origin)
    state[State.CHATTER_SPEED] *= (math.exp(-decay) * before / after_step) ** (1.0 / 3.0)
