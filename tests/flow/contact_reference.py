"""Both layers event by event with SciPy's DOP853, for comparison: modes as in the paper's Table 1,
impacts case by case.

Openings x1 = theta_1, x2 = -theta_2; the equations are those of `eomnl` in the openings, written
out, with a layer held by dropping its row; an impact is solved case by case, without any search.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

LOWER, UPPER = 0, 1


class Layers:
    """The system of a `TwoLayer` under vertical and horizontal loads, with Newton's law and a
    transfer.
    """

    def __init__(self, system):
        self.model, self.load = system.model, system.load
        self.e, self.transfer = system.impact.e, system.impact.transfer

    def mass(self, x):
        angle = 2 * self.model.beta0 + x[0] + x[1]
        return np.array([[1 + self.model.mass_ratio, math.cos(angle)], [math.cos(angle), 1.0]])

    def right(self, t, x, v):
        m, load = self.model, self.load
        b1, b2, angle = m.beta0 + x[0], m.beta0 + x[1], 2 * m.beta0 + x[0] + x[1]
        zeta = load.ground_horizontal.acceleration(t)
        a2, v2 = load.horizontal(t) - zeta, load.vertical(t)
        a1 = a2 - m.mass_ratio * zeta
        r1 = (
            a1 * math.sin(b1)
            + v2 * math.cos(b1)
            - m.dissipation_ratio * m.damping * v[0]
            - m.stiffness_ratio * x[0]
        )
        r2 = -a2 * math.sin(b2) + v2 * math.cos(b2) - m.damping * v[1] - x[1]
        return np.array([r1 + math.sin(angle) * v[1] ** 2, r2 + math.sin(angle) * v[0] ** 2])

    def acceleration(self, t, x, v, opened):
        mass, right, a = self.mass(x), self.right(t, x, v), np.zeros(2)
        if all(opened):
            return np.linalg.solve(mass, right)
        for i in (LOWER, UPPER):
            if opened[i]:
                a[i] = right[i] / mass[i, i]
        return a

    def reaction(self, t, x, v, opened, i):
        return float(self.mass(x)[i] @ self.acceleration(t, x, v, opened) - self.right(t, x, v)[i])

    def impact(self, x, v, hit, closed):
        """v+ after layer `hit` has closed with v[hit] < 0; the other one, if closed, is at rest."""
        mass, other, after = self.mass(x), 1 - hit, v.copy()
        after[hit] = -self.e[hit] * v[hit]
        # no impulse on the other
        after[other] = v[other] - mass[hit, other] * (after[hit] - v[hit]) / mass[other, other]
        if closed[other]:
            after[other] = max(after[other], -self.transfer * v[hit])
        return after


def follow(system, x, v, end, tol=1e-12):
    """The openings and velocities at the end, and the events (kind, layer, time)."""
    layers, t, events = Layers(system), 0.0, []
    x, v = np.array(x, dtype=float), np.array(v, dtype=float)
    opened = choose(layers, t, x, v)
    while t < end:
        solution = arc(layers, t, x, v, opened, end, tol)
        t, x, v = solution.t[-1], solution.y[:2, -1].copy(), solution.y[2:, -1].copy()
        if solution.status == 0:
            break
        which = next(i for i in range(4) if solution.t_events[i].size)
        layer = which % 2
        if which < 2:
            x[layer] = 0.0
            events.append(("impact", layer, t))
            v = layers.impact(x, v, layer, [not o for o in opened])
            v = np.where(np.abs(v) < 1e-15, 0.0, v)
            before = opened
            opened = choose(layers, t, x, v)
            if before[layer] and opened[layer] and v[layer] == 0.0:
                events.append(("release", layer, t))
        else:
            events.append(("release", layer, t))
            opened = [o or i == layer for i, o in enumerate(opened)]
    return x, v, events


def choose(layers, t, x, v):
    """Which layers are open: those away from contact or leaving it; one at rest there opens if it
    is pulled away.
    """
    opened = [bool(x[i] > 0.0 or v[i] > 0.0) for i in (LOWER, UPPER)]
    for i in (LOWER, UPPER):
        if not opened[i] and layers.reaction(t, x, v, opened, i) < 0.0:
            opened[i] = True
    return opened


def arc(layers, t, x, v, opened, end, tol):
    """A smooth motion to the first closing of an open layer or the first zero of a closed one's
    reaction.
    """

    def rate(s, y):
        return np.concatenate([y[2:], layers.acceleration(s, y[:2], y[2:], opened)])

    def closing(i):
        return lambda s, y: y[i] if opened[i] else 1.0

    def letting_go(i):
        return lambda s, y: 1.0 if opened[i] else layers.reaction(s, y[:2], y[2:], opened, i)

    guards = [closing(LOWER), closing(UPPER), letting_go(LOWER), letting_go(UPPER)]
    for guard in guards:
        guard.terminal, guard.direction = True, -1
    held = np.array(opened, dtype=float)
    start = np.concatenate([x * held, v * held])
    return solve_ivp(
        rate, (t, end), start, method="DOP853", rtol=tol, atol=1e-14, events=guards, max_step=0.02
    )
