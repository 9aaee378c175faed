"""Motions in plain Python, for those who look into the kernels: `step_through`."""

from __future__ import annotations

from saltus.flow import Pause, step_through

__all__ = ["Pause", "step_through"]
