"""The compiled code of the lanes: one driver for all models, and three functions of each structure."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any

from saltus.flow.contacts import complementarity, lane_handoff, lane_impacts, scalar_impact, solver_memory
from saltus.flow.contacts import impacts as contact_impacts
from saltus.flow.contacts import lane_step as contacts_step
from saltus.flow.contacts import layout as contact_layout
from saltus.flow.kernel import function_types as scalar_types
from saltus.flow.kernel import layout as kernel_layout
from saltus.flow.kernel import memory as kernel_memory
from saltus.flow.kernel import memory_layout, roots, steps
from saltus.flow.kernel.compiled import contacts_module, kernel_module
from saltus.flow.lanes import (
    driver,
    forcing_periods,
    function_types,
    gap_roots,
    handoff,
    lane_steps,
    memory,
    sampling,
)
from saltus.flow.lanes.lane_functions import lane_functions, memory_plan
from saltus.flow.lanes.memory import MemoryPlan
from saltus.flow.one_contact import lane_handoff as one_contact_handoff
from saltus.flow.one_contact import lane_step, sides
from saltus.taylor import (
    WIDTH,
    Trace,
    check_size,
    compiled_part,
    digest,
    entry_point,
    is_compiled,
    lane_memory,
    lane_vectors,
    load_functions,
    load_module,
    load_tables,
    module_name,
    pointer,
    source_of,
    vectors,
)

_TYPES = (scalar_types, kernel_memory, function_types, memory, vectors, lane_memory, lane_vectors)
_WRITTEN_BY = digest(*(source_of(module) for module in _TYPES))
_SIGNATURES = f"""import math

import numpy as np

from saltus.flow.kernel.memory import *
from saltus.flow.lanes import function_types
from saltus.flow.lanes.function_types import *
from saltus.flow.lanes.memory import Closing, Stretch, Gap, Step
from saltus.taylor.lane_memory import one
from saltus.taylor.lane_vectors import *
from saltus.taylor.numba_types import by_reference
from saltus.taylor.private_numba import cached_jit, inline_jit, jit, lean_jit, pointed_jit
# types and vectors of {_WRITTEN_BY}, for {WIDTH} lanes
"""
_OF_CONTACTS = "shared, RUN_LANES, LANE_ROOT, SCALAR_MOTION, CONTACTS_IMPACT = function_types.CONTACTS\n"


@cache
def load_driver(several: bool = False) -> Callable[..., None]:
    """The driver of all lanes, `run_lanes` of `driver.py`, for models with one or several contacts; it releases Python's lock."""
    return entry_point(load_module("lanes", _driver_text(several)).run_lanes)


def _driver_text(several: bool) -> str:
    step = (contact_layout, lane_impacts, contacts_step) if several else (lane_step,)
    common = (memory_layout, kernel_layout, memory, sides, load_tables, lane_steps, gap_roots, sampling)
    return _text(several, *common, *step, forcing_periods, driver)


def _text(several: bool, *modules: ModuleType) -> str:
    """One source of the compiled parts of several files, for vectors of this machine's width."""
    header = _SIGNATURES + (_OF_CONTACTS if several else "")
    return header + "".join(compiled_part(module) for module in modules)


@cache
def compile_driver_aside(several: bool) -> subprocess.Popen[bytes] | None:
    """A process that compiles the driver while this one compiles the rest; None if the driver is already on disk.

    Further calls return the same process, which may have ended since.
    """
    if is_compiled(module_name("lanes", _driver_text(several))):
        return None
    try:
        found = f"import sys; sys.path[:] = {sys.path!r}; "  # the other process finds packages where this one does
        call = f"{found}from {__name__} import load_driver; load_driver({several})"
        return subprocess.Popen([sys.executable, "-c", call])
    except OSError:
        return None


@cache
def load_helpers(several: bool = False) -> tuple[Any, ...]:
    """The functions that the driver calls for one lane, in the order of `Helpers`."""
    names = ["first_root_of", "turning_range", "scalar_motion"]
    parts = [memory_layout, kernel_layout, memory, load_tables, roots]
    if several:
        names.append("contacts_impact")
        parts += [steps, contact_layout, solver_memory, complementarity, contact_impacts, lane_impacts, lane_handoff]
        parts += [handoff, scalar_impact]
    else:
        parts += [one_contact_handoff, handoff]
    module = load_module("lane_helpers", _text(several, *parts))
    return tuple(pointer(getattr(module, name)) for name in names)


def load_lane_functions(trace: Trace) -> tuple[MemoryPlan, tuple[Any, ...]]:
    """The memory that a structure needs, and its functions for lanes.

    Raises
    ------
    TraceError
        Compiling them would take minutes.
    """
    check_size(trace, lanes=True)
    return memory_plan(trace), tuple(load_functions("lane", lane_functions(trace)).values())


@cache
def load_advance(several: bool = False) -> Any:
    """The scalar kernel, which the driver calls for one lane."""
    return pointer(contacts_module().advance if several else kernel_module().advance)


def compile_everything(several: bool = False) -> None:
    """Compile the driver, its helpers and the scalar kernel, or load them from disk if they are there."""
    load_driver(several)
    load_helpers(several)
    load_advance(several)


def compile_beside(driver: subprocess.Popen[bytes], several: bool) -> None:
    """Compile the helpers and the scalar kernel while another process compiles the driver, and wait for that process."""
    load_helpers(several)
    load_advance(several)
    driver.wait()
