"""The compiled code of the lanes: one driver for all models, and three functions of each structure."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

from saltus.flow import contact_side, kernel_layout, memory_layout, roots
from saltus.flow import function_types as scalar_types
from saltus.flow.compiled import kernel_module
from saltus.flow.ensemble import (
    driver,
    forcing_periods,
    function_types,
    lane_layout,
    lane_steps,
    sampling,
    scalar_fallback,
    scalar_handoff,
)
from saltus.flow.ensemble.lane_functions import Slots, lane_functions_text, slots_of
from saltus.taylor import (
    Trace,
    compiled_part,
    digest,
    entry_point,
    generated_header,
    is_compiled,
    lane_vectors,
    load_module,
    module_name,
    pointer,
    records,
)

_WRITTEN_BY = digest(*(inspect.getsource(module) for module in (scalar_types, function_types, lane_vectors)))
_SIGNATURES = f"""
from saltus.flow.ensemble.function_types import *
from saltus.taylor.lane_vectors import *
from saltus.taylor.private_numba import cached_jit, inline_jit, jit, lean_jit, pointed_jit
# types and vectors of {_WRITTEN_BY}
"""


@cache
def load_driver() -> Callable[..., None]:
    """The driver of all lanes, `run_lanes` of `driver.py`; it works without Python's lock."""
    return entry_point(load_module("lanes", _driver_text()).run_lanes)


def _driver_text() -> str:
    return _text(memory_layout, kernel_layout, lane_layout, contact_side, records, lane_steps, sampling, forcing_periods, driver)


def _text(*modules: ModuleType) -> str:
    """One source of the compiled parts of several files, for vectors of this machine's width."""
    return generated_header(_SIGNATURES) + "".join(compiled_part(module) for module in modules)


def compile_driver_aside() -> subprocess.Popen[bytes] | None:
    """Where the driver is not on disk yet, a process that compiles it, as this one has much else to compile; else None."""
    if load_driver.cache_info().currsize or is_compiled(module_name("lanes", _driver_text())):
        return None
    try:
        found = f"import sys; sys.path[:] = {sys.path!r}; "  # as this process has come to know it
        return subprocess.Popen([sys.executable, "-c", f"{found}from {__name__} import load_driver; load_driver()"])
    except OSError:
        return None


@cache
def load_helpers() -> tuple[Any, ...]:
    """What the driver calls for one lane: `lane_root`, `turning_range` and `scalar_motion`."""
    module = load_module("lane_helpers", _text(kernel_layout, lane_layout, roots, scalar_fallback, scalar_handoff))
    return tuple(pointer(getattr(module, name)) for name in ("lane_root", "turning_range", "scalar_motion"))


def load_lane_functions(trace: Trace) -> tuple[Slots, tuple[Any, ...]]:
    """A structure's memory and its functions for lanes."""
    module = load_module("lane", generated_header(_SIGNATURES) + lane_functions_text(trace))
    return slots_of(trace), tuple(pointer(getattr(module, f"lane_{name}")) for name in ("series", "impact", "field"))


@cache
def load_advance() -> Any:
    """The scalar kernel, which the driver calls for one lane."""
    return pointer(kernel_module().advance)


def compile_everything() -> None:
    """Compile the driver, its helpers and the scalar kernel, or load them where they are on disk."""
    load_driver()
    load_helpers()
    load_advance()


def compile_beside(driver: subprocess.Popen[bytes]) -> None:
    """Compile what the driver needs while another process compiles the driver, and wait for that."""
    load_helpers()
    load_advance()
    driver.wait()
