"""The one way in which saltus compiles: numba, without Python's exceptions for division, and with fused multiply-adds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

jit: Callable[[Any], Any] = njit(error_model="numpy", fastmath={"contract", "nsz"})
cached_jit: Callable[[Any], Any] = njit(error_model="numpy", fastmath={"contract", "nsz"}, cache=True)
