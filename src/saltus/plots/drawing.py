"""How a function that draws a dataset refuses what it cannot draw: in one sentence with the argument's name."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, Concatenate, ParamSpec, TypeVar

from saltus.checks import check_number
from saltus.errors import ParameterError, SaltusError, shown
from saltus.plots.conventions import styled
from saltus.public_functions import answered

P = ParamSpec("P")
R = TypeVar("R")
NARROWEST, WIDEST = 10.0, 2000.0  # mm, of a picture: from a stamp to the widest poster


def drawing(draw: Callable[Concatenate[Any, P], R]) -> Callable[Concatenate[Any, P], R]:
    """A decorator of functions that draw a dataset in the conventions: arguments of a wrong kind are refused by their names.

    Users can change datasets: if one lacks something, or its arrays do not fit one another, the error of NumPy or Matplotlib is
    turned into a sentence.
    """
    name, drawn = next(iter(signature(draw).parameters)), styled(draw)

    @answered
    @wraps(draw)
    def inside(dataset: Any, /, *given: P.args, **named: P.kwargs) -> R:
        if not hasattr(dataset, "attrs") or not hasattr(dataset, "data_vars"):
            raise ParameterError(f"{name} must be a Dataset or a DataTree, got {shown(dataset)}", name)
        if named.get("width") is not None:
            check_number("width", named["width"], at_least=NARROWEST, at_most=WIDEST, unit="mm")
        try:
            return drawn(dataset, *given, **named)
        except (SaltusError, OSError, MemoryError):
            raise
        except Exception as error:
            said = " ".join(f"{type(error).__name__}: {error}".split())
            raise ParameterError(f"{name} cannot be drawn by {draw.__name__} ({said:.150})", name) from error

    return inside
