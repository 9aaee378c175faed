"""The facts that `saltus info` prints of a system: those of every model, then the closed forms of this one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from saltus.cli.fact_blocks import Block, Row, number
from saltus.cli.model_facts import MODEL_FACTS
from saltus.systems import Load, System

PHASES = 64  # Instants at which a load is compared with its mirror image: enough to see every harmonic below the 32nd.


def describe(system: System, start: float | None = None) -> Iterator[Block]:
    """What is known of `system`.

    Parameters
    ----------
    start
        The angle, rad, at which the free vibration starts whose period is given.
    """
    parameters: list[Row] = [(path, number(value)) for path, value in system.parameters.items()]
    yield Block("Parameters", [*parameters, ("impact law", type(system.impact).__name__)])
    yield Block("Load", _load(system))
    for model, closed_forms in MODEL_FACTS.items():
        if isinstance(system.model, model):
            yield from closed_forms(system, start)


def _load(system: System) -> list[Row]:
    period = system.load.period
    rows: list[Row] = [("forcing period 2 pi / Omega", "none: the load has no frequency" if period is None else number(period))]
    channels = ", ".join(system.load.channels) or "none"
    rows.append(("channels given", channels))
    rows.append(("channels that the model reads", ", ".join(system.model.channels) or "none"))
    rows.append(("symmetry", symmetry(system)))
    return rows


def symmetry(system: System) -> str:
    """Whether -theta moves as theta does: at once, half a forcing period later, or not at all."""
    mirrored = system.mirrored()
    if mirrored is None:
        return "none: the model has no mirror image under this load"
    shift = (system.load.period or 0.0) / 2
    if _equal(system.load, mirrored.load, 0.0):
        return "symmetric: the mirror image of a motion is a motion"
    if shift and _equal(system.load, mirrored.load, shift):
        return "symmetric: the mirror image of a motion, half a period later, is a motion"
    return "the model is symmetric, the load is not: the mirror image moves under the reversed load"


def _equal(load: Load, other: Load, shift: float) -> bool:
    """Whether `load` at t + shift is `other` at t in every channel."""
    span = load.period or max((_end(s) for s in _passing(load)), default=1.0)
    times = span * np.arange(PHASES) / PHASES
    for name in load.channels:
        order = 2 if name.startswith("ground_") else 0  # for the ground only the acceleration matters
        pairs = ((load, times + shift), (other, times))
        here, there = (np.broadcast_to(x.channels[name].derivative(t, x.frequency, order), times.shape) for x, t in pairs)
        if not np.allclose(here, there, rtol=1e-12, atol=1e-12 * (1 + np.abs(there).max())):
            return False
    return True


def _passing(load: Load) -> list[Any]:
    """The records and pulses of a load."""
    return [term for signal in load.channels.values() for term in getattr(signal, "terms", (signal,)) if term.once]


def _end(signal: Any) -> float:
    return float(signal.time[-1] if hasattr(signal, "time") else signal.start + signal.length)
