"""An oscillator with a soft stop, for tests of contacts that are passed: its spring, damper and
preload begin at x = edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from saltus import OneContactModel
from saltus.systems import Harmonic, Load, System, VelocityReduction


@dataclass(frozen=True, kw_only=True)
class SoftStop(OneContactModel):
    """x'' = force - c x' - k x, and beyond x = edge less: stop (x - edge) + damper x' + preload."""

    stiffness: float = 1.0
    damping: float = 0.1
    stop: float = 10.0
    damper: float = 0.0
    preload: float = 0.0
    edge: float = 0.5

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("force",)

    @property
    def contact(self) -> Any:
        return self.edge

    def gap(self, x: Any, side: Any) -> Any:
        return side * (self.edge - x)

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        beyond = (1 - side) / 2
        push = self.stop * (x - self.edge) + self.damper * velocity + self.preload
        return load.force(t) - self.damping * velocity - self.stiffness * x - beyond * push


def soft_stop(model=SoftStop, *, amplitude=0.5, frequency=0.8, mean=0.0, e=1.0, **numbers):
    """The forced oscillator."""
    load = Load(frequency=frequency, force=Harmonic(amplitude, mean))
    return System(model=model(**numbers), load=load, impact=VelocityReduction(e))


def variational_map(system, state, longest=np.inf):
    """The state after a forcing period and its derivative to the state, by DOP853 with a restart at
    every passage (e = 1).

    A passage and its end within one step, of at most `longest`, are not seen. The derivative is
    that of the variational equation, which has a kink at a passage by the damper alone.
    """
    model, load = system.model, system.load
    end, t = load.period, 0.0
    y = np.concatenate([state, [1.0, 0.0, 0.0, 1.0]])
    beyond = bool(state[0] > model.edge)

    def rate(t, y):
        x, v, *phi = y.tolist()  # a list of six numbers takes a third of the time of arrays
        push, damping = (
            (model.stop, model.damping + model.damper) if beyond else (0.0, model.damping)
        )
        a = load.force(t) - damping * v - model.stiffness * x - push * (x - model.edge)
        slope = model.stiffness + push
        return [
            v,
            a,
            phi[2],
            phi[3],
            -slope * phi[0] - damping * phi[2],
            -slope * phi[1] - damping * phi[3],
        ]

    def edge(t, y):
        return y[0] - model.edge

    edge.terminal = True
    while t < end:
        edge.direction = -1.0 if beyond else 1.0
        part = solve_ivp(
            rate,
            (t, end),
            y,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=edge,
            max_step=longest,
        )
        t, y = float(part.t[-1]), part.y[:, -1].copy()
        if part.status == 1:
            # dt = -u / v: z+ = z + (a_old - a_new) dt, and a_old - a_new = +-damper v
            kink = -model.damper if beyond else model.damper
            y[4:] = y[4:] - kink * y[2:4]
            beyond = not beyond
    return y[:2], y[2:].reshape(2, 2)
