"""References for the closed forms: SciPy's DOP853 restarted at each impact, and the linearised
equation.
"""

import math
from dataclasses import dataclass, field

from scipy.integrate import solve_ivp

TOLERANCE = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


@dataclass
class Record:
    impact_times: list = field(default_factory=list)
    before: list = field(default_factory=list)
    after: list = field(default_factory=list)
    peaks: list = field(default_factory=list)
    time: float = 0.0
    state: tuple = ()


def integrate(system, theta, velocity=0.0, *, impacts=10**9, until=1e3, acceleration=None):
    """Impacts, peaks and the last state of a motion, from the model's acceleration or another (tau,
    theta, velocity, side).
    """
    if acceleration is None:

        def acceleration(t, th, v, s):
            return system.model.acceleration(t, th, v, s, system.load)

    side, out = (
        (1 if theta > 0 or (theta == 0 and velocity > 0) else -1),
        Record(state=(theta, velocity)),
    )
    while out.time < until:

        def flow(t, y, side=side):
            return [y[1], acceleration(t, y[0], y[1], side)]

        def contact(t, y, side=side, start=out.time):
            return side * y[0] if t > start else 1.0

        def peak(t, y, side=side):
            return side * y[1]

        contact.terminal, contact.direction, peak.direction = True, -1, -1
        arc = solve_ivp(flow, (out.time, until), out.state, events=(contact, peak), **TOLERANCE)
        out.peaks += [y[0] for y in arc.y_events[1]]
        if not arc.t_events[0].size:
            out.time, out.state = until, tuple(arc.y[:, -1])
            break
        out.time, before = float(arc.t_events[0][0]), float(arc.y_events[0][0][1])
        after = float(
            system.impact.velocity_after(system.model, out.time, before, side, -side, system.load)
        )
        out.impact_times.append(out.time)
        out.before.append(before)
        out.after.append(after)
        side, out.state = -side, (0.0, after)
        if len(out.before) >= impacts:
            break
    return out


def linear_acceleration(system):
    """`gov_eqn_constant_loading_lin`, with a constant H, written out anew."""
    model, load = system.model, system.load
    b, v, h = model.beta0, load.vertical(0), load.horizontal(0)

    def acceleration(t, theta, velocity, side):
        k, mass, c = (
            (model.stiffness_ratio, 1 + model.mass_ratio, model.dissipation_ratio)
            if side > 0
            else (1.0, 1.0, 1.0)
        )
        push = h * (math.sin(b) + side * theta * math.cos(b)) + side * v * (
            math.cos(b) - side * theta * math.sin(b)
        )
        return (push - c * model.damping * velocity - k * theta) / mass

    return acceleration
