"""A motion as the points of a curve: dense samples, with both velocities at every impact and a break where they differ."""

from __future__ import annotations

from typing import Any

import numpy as np


def curve(motion: Any, start: float, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(tau, theta, theta') of a motion from `start` to its end, arrays (n,); NaN marks a jump of the velocity."""
    impacts = motion.impacts
    instants = np.asarray(impacts.time, dtype=float)
    before, after = np.asarray(impacts.velocity_before, float), np.asarray(impacts.velocity_after, float)
    jump = np.where(before == after, 0.0, np.nan)
    times = np.setdiff1d(np.linspace(start, motion.time, samples), instants)
    theta, velocity = (np.asarray(a, dtype=float) for a in motion.at(times))
    tau = np.concatenate([times, np.repeat(instants, 3)])
    order = np.argsort(tau, kind="stable")
    contact = np.column_stack([0 * before, jump, 0 * before]).ravel()
    speeds = np.column_stack([before, before + jump, after]).ravel()
    return tau[order], np.concatenate([theta, contact])[order], np.concatenate([velocity, speeds])[order]


def padded(rows: list[np.ndarray]) -> np.ndarray:
    """Curves of unequal lengths as one array (curve, point), NaN after the end of each."""
    table = np.full((len(rows), max(map(len, rows), default=0)), np.nan)
    for i, row in enumerate(rows):
        table[i, : len(row)] = row
    return table
