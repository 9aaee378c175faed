"""The decorators of a kernel's functions, as seen by the files that contain these functions: they compile nothing.

The text of such a file becomes a part of generated kernels (`compiled_part`), whose header imports the decorators with the same
names from `private_numba.py`, which do compile. Imported directly, the file gives its constants, and its functions in plain
Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def jit(function: Any) -> Any:
    """A function that others of its kernel call."""
    return function


lean_jit = inline_jit = jit


def cached_jit(signature: Any, **options: Any) -> Callable[[Any], Any]:
    """A function of one signature that is called from outside its kernel."""
    return jit


def by_reference(given: Any) -> Any:
    """A tuple that functions are given by its address."""
    return given
