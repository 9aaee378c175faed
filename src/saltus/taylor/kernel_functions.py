"""The decorators of a kernel's functions in the files that hold them, where they compile nothing.

Such a file is text that kernels are made of (`compiled_part`), below a header with the decorators of the same names in
`private_numba.py`, which compile. Imported as it stands it gives its constants, and its functions as plain Python.
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
