"""Validity of a motion: whether the real mechanism stays within its limits (errata 19, 20) and its assumptions (errata 21)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.flow.dense import evaluate

if TYPE_CHECKING:
    from saltus.flow.motion import Motion

SAMPLES = 12  # in each step, before the bisection: a step is shorter than a margin's own time scale
BISECTIONS = 50


@dataclass(frozen=True)
class Validity:
    """For each margin of the model: when it is first passed (or None), and the share of the motion's time spent beyond it."""

    first: dict[str, float | None]
    share: dict[str, float]

    @property
    def respected(self) -> bool:
        """Whether every margin stays positive throughout."""
        return all(time is None for time in self.first.values())

    def __str__(self) -> str:
        if not self.first:
            return "the model has no margins"
        return "; ".join(
            f"{name} " + ("respected" if t is None else f"passed first at {t:.6g}, {100 * self.share[name]:.3g} % of the time")
            for name, t in self.first.items()
        )


def check_validity(motion: Motion) -> Validity:
    """Evaluate the model's margins along the dense output; each change of sign is bisected to rounding.

    A margin that is passed and regained within a twelfth of one step may be missed. Rest is left out: nothing moves there.
    """
    names = _margins(motion, np.array([motion.start]), np.array([0]))
    dense = motion.dense
    if not names or dense is None or dense.start.size == 0:
        return Validity(dict.fromkeys(names), dict.fromkeys(names, 0.0))
    moving = np.flatnonzero((dense.side != 0) & (dense.length > 0))
    fraction = np.linspace(0.0, 1.0, SAMPLES + 1)
    step = np.repeat(moving, SAMPLES + 1)
    tau = (dense.length[moving, None] * fraction).ravel()
    values = _margins(motion, tau, step)
    first: dict[str, float | None] = {}
    share = {}
    for name in names:
        first[name], beyond = _beyond(motion, name, values[name], tau, step)
        share[name] = beyond / (motion.time - motion.start)
    return Validity(first, share)


def _beyond(motion: Motion, name: str, value: np.ndarray, tau: np.ndarray, step: np.ndarray) -> tuple[float | None, float]:
    """The first time at which a margin is negative, and for how long it is, from its samples on every step."""
    dense = motion.dense
    assert dense is not None
    left, right = np.arange(value.size - 1), np.arange(1, value.size)
    same = step[left] == step[right]
    left, right = left[same], right[same]
    out_left, out_right = value[left] < 0, value[right] < 0
    spent = np.where(out_left & out_right, tau[right] - tau[left], 0.0)
    starts = np.where(out_left, dense.start[step[left]] + tau[left], np.inf)
    mixed = np.flatnonzero(out_left != out_right)
    if mixed.size:
        low, high = tau[left[mixed]], tau[right[mixed]]
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            like_left = (_margins(motion, middle, step[left[mixed]])[name] < 0) == out_left[mixed]
            low, high = np.where(like_left, middle, low), np.where(like_left, high, middle)
        spent[mixed] = np.where(out_left[mixed], low - tau[left[mixed]], tau[right[mixed]] - low)
        crossing = dense.start[step[left[mixed]]] + low
        starts[mixed] = np.where(out_left[mixed], starts[mixed], crossing)
    first = starts.min() if starts.size else np.inf
    return (float(first) if np.isfinite(first) else None), float(spent.sum())


def _margins(motion: Motion, tau: np.ndarray, step: np.ndarray) -> dict[str, Any]:
    """The model's margins at the times `tau` after the starts of the given steps, from the steps' own series."""
    system, dense = motion.system, motion.dense
    if dense is None or dense.start.size == 0:
        zero = np.zeros(len(system.model.coordinates))
        state = [zero, zero, zero]
        t, side = np.asarray(motion.start), np.asarray(motion.side or 1)
    else:
        coefficients = dense.series[step]
        state = []
        for _ in range(3):
            state.append(evaluate(coefficients, tau))
            coefficients = coefficients[:, :, 1:] * np.arange(1, coefficients.shape[2])
        t, side = dense.start[step] + tau, np.where(dense.side[step] == 0, 1, dense.side[step])
    if len(system.model.coordinates) == 1:
        state = [x[0] for x in state]
    return system.model.margins(t, state[0], state[1], state[2], side, system.load)
