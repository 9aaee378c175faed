"""Derivatives by differences, for residuals that are to be independent of the formulas in the
code.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def derivative(function: Callable[[float], Any], x: float = 0.0, h: float = 1e-3) -> Any:
    """The derivative at x from points about it, with an error of fourth order in their distance
    h.
    """
    return (
        8 * (function(x + h) - function(x - h)) - (function(x + 2 * h) - function(x - 2 * h))
    ) / (12 * h)
