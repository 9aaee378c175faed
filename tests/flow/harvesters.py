"""Models with coordinates of first order, for several test files, and their motions by SciPy's
DOP853.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import saltus


@dataclass(frozen=True, kw_only=True)
class Piezo(saltus.ContactModel):
    """x'' + c x' + x + k u = -zeta'' before a stop, u' = k x' - u / R with the voltage u over a
    load resistance.
    """

    coordinates = ("x", "voltage")
    first_order = ("voltage",)
    channels = ("ground",)
    damping: float = 0.05
    coupling: float = 0.3
    resistance: float = 1.4
    stop: float = 0.6

    @property
    def contacts(self) -> tuple[saltus.Contact, ...]:
        return (saltus.Contact(name="stop", coordinate="x", position=self.stop, sign=-1),)

    def force(self, t: Any, theta: Any, velocity: Any, load: Any) -> Any:
        (x, u), v = theta, velocity[0]
        return -x - self.damping * v - self.coupling * u - load.ground.acceleration(
            t
        ), self.coupling * v - u / self.resistance


@dataclass(frozen=True, kw_only=True)
class SwitchedPiezo(Piezo):
    """An impact turns the voltage and adds to it in proportion to its speed."""

    kept: float = -0.8
    gain: float = 0.1

    def after_impact(self, contact: str, theta: Any, velocity: Any) -> Any:
        return self.kept * theta[1] + self.gain * velocity[0]


@dataclass(frozen=True, kw_only=True)
class Lorenz(saltus.Model):
    """Three coordinates of first order alone."""

    coordinates = ("x", "y", "z")
    first_order = ("x", "y", "z")
    sigma: float = 10.0
    rho: float = 28.0
    beta: float = 8.0 / 3.0

    def acceleration(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        x, y, z = theta
        return self.sigma * (y - x), x * (self.rho - z) - y, x * y - self.beta * z


def shaken(model: Piezo, amplitude: float = 0.2) -> saltus.System:
    load = saltus.Load(frequency=1.05, ground=saltus.Harmonic(amplitude=amplitude))
    return saltus.System(model=model, load=load, impact=saltus.NewtonImpact(0.7))


def by_dop853(
    system: saltus.System, state: tuple[float, float, float], end: float
) -> tuple[np.ndarray, list[float]]:
    """(x, u, x') at the end, and the times of the impacts."""
    model: Any = system.model
    ground = replace(system.load.channels["ground"])

    def rates(t: float, y: Any) -> list[float]:
        push = -ground.derivative(t, system.load.frequency, 2)
        return [
            y[2],
            model.coupling * y[2] - y[1] / model.resistance,
            -y[0] - model.damping * y[2] - model.coupling * y[1] + push,
        ]

    def gap(t: float, y: Any) -> float:
        return float(model.stop - y[0])

    gap.terminal, gap.direction = True, -1  # type: ignore[attr-defined]
    t, y, times = 0.0, np.array(state), list[float]()
    while True:
        found = solve_ivp(
            rates, (t, end), y, method="DOP853", rtol=3e-14, atol=1e-15, events=gap, max_step=0.2
        )
        y = found.y[:, -1]
        if found.status != 1:
            return y, times
        t = float(found.t[-1])
        times.append(t)
        jumped = model.after_impact("stop", (y[0], y[1]), (y[2], None))
        y = np.array([model.stop, np.atleast_1d(jumped)[0], -system.impact.e * y[2]])
