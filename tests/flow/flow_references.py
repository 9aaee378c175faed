"""References for the flow: systems that share one structure, a 30-digit integrator, and heyoka.py
restarted at impacts.
"""

from dataclasses import dataclass, field

import mpmath as mp
import numpy as np
from shared_systems import BETA80

# Every set of paths compiles a tangent of its own, some seconds each: tests of `forced` that need
# some of these take all.
SHARED_PATHS = (
    *("load.horizontal.amplitude", "load.horizontal.phase", "load.frequency", "load.vertical"),
    *("model.beta0", "model.damping"),
)


def evaluate_steps(dense, samples=9):
    """Coordinate (degree of freedom 0) at fractions of every step of a dense output: shape (steps,
    samples).
    """
    tau = dense.length[:, None] * np.linspace(0.0, 1.0, samples)
    value = np.zeros_like(tau)
    for power in range(dense.series.shape[2] - 1, -1, -1):
        value = value * tau + dense.series[:, 0, power, None]
    return value


@dataclass
class PreciseMotion:
    """Impacts, as (time, side before, velocity before, velocity after), and the end state, in
    mpmath's numbers.
    """

    impacts: list = field(default_factory=list)
    time: object = None
    state: tuple = ()


class PreciseSystem:
    """`gov_eqn_theta_long` under H(t) = mean + H sin(W t + phase), a constant V; every number the
    double it is.

    Taylor series written out by hand for this equation, event by event; the root of each impact by
    bisection on every sixteenth of a step, then secants.
    """

    def __init__(
        self,
        *,
        beta0=BETA80,
        C=0.1,
        m=0.0,
        k=1.0,
        c=1.0,
        V=-0.5,
        H=0.0,
        mean=0.0,
        phase=0.0,
        W=1.0,
        factors=(1.0, 1.0),
    ):
        self.b, self.V, self.H, self.mean, self.phase, self.W = map(
            mp.mpf, (beta0, V, H, mean, phase, W)
        )
        self.mass = {1: 1 + mp.mpf(m), -1: mp.mpf(1)}
        self.damping = {1: mp.mpf(c) * mp.mpf(C), -1: mp.mpf(C)}
        self.stiffness = {1: mp.mpf(k), -1: mp.mpf(1)}
        # by the side before the impact
        self.factor = {1: mp.mpf(factors[0]), -1: mp.mpf(factors[1])}

    def series(self, t, x0, v0, side, order):
        """Taylor coefficients of theta (order + 1) and theta'."""
        x, v = [x0], [v0]
        sine, cosine = [mp.sin(side * x0 + self.b)], [mp.cos(side * x0 + self.b)]
        angle, weight = self.W * t + self.phase, self.H
        push = [self.mean + self.H * mp.sin(angle)]
        for n in range(order):
            force = mp.fdot(sine, reversed(push)) + side * self.V * cosine[n]
            v.append(
                (force - self.damping[side] * v[n] - self.stiffness[side] * x[n])
                / self.mass[side]
                / (n + 1)
            )
            x.append(v[n] / (n + 1))
            slopes = [j * x[j] for j in range(1, n + 2)]
            s_next = side * mp.fdot(slopes, reversed(cosine)) / (n + 1)
            cosine.append(-side * mp.fdot(slopes, reversed(sine)) / (n + 1))
            sine.append(s_next)
            weight = weight * self.W / (n + 1)
            push.append(weight * mp.sin(angle + (n + 1) * mp.pi / 2))
        return x, v

    def run(self, theta, velocity, until, *, impacts=10**9, order=28, tol="1e-27"):
        """The motion from time 0 until a time or a number of impacts."""
        out, t, x, v = PreciseMotion(), mp.mpf(0), mp.mpf(theta), mp.mpf(velocity)
        side, until, tol = (1 if x > 0 or (x == 0 and v > 0) else -1), mp.mpf(until), mp.mpf(tol)
        while t < until and len(out.impacts) < impacts:
            xs, vs = self.series(t, x, v, side, order)
            h = min(
                (tol / abs(vs[order])) ** (mp.mpf(1) / order),
                (tol / abs(vs[order - 1])) ** (mp.mpf(1) / (order - 1)),
                until - t,
            )
            gap = [side * a for a in (xs[1:] if x == 0 else xs)]
            root = _first_root(gap, h)
            tau = h if root is None else root
            t, x, v = t + tau, mp.polyval(xs[::-1], tau), mp.polyval(vs[::-1], tau)
            if root is not None:
                out.impacts.append((t, side, v, self.factor[side] * v))
                x, v, side = mp.mpf(0), self.factor[side] * v, -side
        out.time, out.state = t, (x, v)
        return out


def _first_root(coefficients, h, pieces=16):
    backwards = coefficients[::-1]
    values = [mp.polyval(backwards, h * i / pieces) for i in range(pieces + 1)]
    for i in range(pieces):
        if values[i + 1] <= 0:
            low, high = h * i / pieces, h * (i + 1) / pieces
            at_low, at_high = values[i], values[i + 1]
            for _ in range(60):  # Illinois: a secant that keeps its bracket
                middle = high - at_high * (high - low) / (at_high - at_low)
                at_middle = mp.polyval(backwards, middle)
                if at_middle * at_high < 0:
                    low, at_low = high, at_high
                else:
                    at_low /= 2
                high, at_high = middle, at_middle
                if abs(at_high) < mp.mpf(10) ** (3 - mp.mp.dps) or low == high:
                    return high
            raise AssertionError("the reference found no root")
    return None


def limit_of_impacts(impacts, side):
    """Where the impacts that leave `side` accumulate: their times extrapolated to speed 0
    (Neville's scheme).

    Under constant loads the time left is an analytic function of the speed, by Koenigs' theorem on
    the map of two impacts.
    """
    nodes = [(abs(v), t) for t, s, v, _ in impacts if s == side]
    speeds, table = [v for v, _ in nodes], [t for _, t in nodes]
    for level in range(1, len(table)):
        table = [
            (speeds[i + level] * table[i] - speeds[i] * table[i + 1])
            / (speeds[i + level] - speeds[i])
            for i in range(len(table) - 1)
        ]
    return table[0]
