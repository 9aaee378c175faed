"""A tuple of numbers in one field of a model or law, each with a dotted path of its own."""

from __future__ import annotations

from typing import Any


class Factors(tuple[Any, ...]):
    """A tuple of numbers of a system, which a trace replaces by symbols: `impact.e.0`, `impact.e.1`, ..."""

    __slots__ = ()
