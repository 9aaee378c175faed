"""The questions of a study besides a motion: a table for each, whose keys are the arguments of the functions that answer it."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from types import SimpleNamespace
from typing import Any, get_type_hints

from saltus.config.readers import Reader, read_table, read_values, read_values_or_number, reader_of
from saltus.config.source import Source
from saltus.errors import ParameterError
from saltus.flow import state_names
from saltus.systems import System

QUESTIONS: dict[str, tuple[str, ...]] = {
    "phase_portrait": ("studies:phase_portrait",),
    "response_spectrum": ("studies:response_spectrum", "studies:bifurcation_diagram"),
    "bifurcation_diagram": ("studies:bifurcation_diagram",),
    "frequency_sweep": ("studies:frequency_sweep",),
    "attractors": ("attractors:find_attractors",),
    "basins": ("attractors:basins_of_attraction",),
    "stability_chart": ("studies:stability_chart", "studies:bordered_chart"),
}  # The first function that takes all the given keys answers; a function with open-ended options passes them to the other.
NOT_IN_FILES = ("system", "store", "workers", "scheduler")  # these come from the rest of the file or the command line


@dataclass(frozen=True, kw_only=True)
class Ask:
    """One question: its kind, which is the name of its table, and the arguments given in it."""

    kind: str
    options: dict[str, Any]

    @property
    def function(self) -> Any:
        """The function that answers it."""
        for function in functions_of(self.kind):
            arguments = inspect.signature(function).parameters
            if any(a.kind is a.VAR_KEYWORD for a in arguments.values()) or set(self.options) <= set(arguments):
                return function
        raise ParameterError(f"no function answers {self.kind} with {', '.join(self.options)}")


def functions_of(kind: str) -> list[Callable[..., Any]]:
    """The functions in the table of questions."""
    places = [place.split(":") for place in QUESTIONS[kind]]
    return [getattr(import_module(f"saltus.{room}"), name) for room, name in places]


def keys_of(kind: str, coordinates: tuple[str, ...] = ()) -> dict[str, Reader]:
    """The keys that the table of a question may have, with their readers: the arguments of types that a file can give.

    Parameters
    ----------
    coordinates
        The names of the coordinates; the state variables of such a model stand for an open-ended argument.
    """
    keys: dict[str, Reader] = {}
    for function in functions_of(kind):
        hints = _hints(function)
        for argument in inspect.signature(function).parameters.values():
            reader = reader_of(hints[argument.name])
            if reader is not None and argument.name not in NOT_IN_FILES:
                lists = reader is read_values_or_number
                if argument.kind is argument.VAR_KEYWORD:  # with one coordinate, values must be lists
                    keys |= dict.fromkeys(coordinates, read_values if lists and len(coordinates) == 1 else reader)
                else:
                    keys[argument.name] = reader
    return keys


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """The types of a function's arguments, without that of its result, which may need a module that is not there at run time."""
    annotations = {argument.name: argument.annotation for argument in inspect.signature(function).parameters.values()}
    return get_type_hints(SimpleNamespace(__annotations__=annotations), globalns=vars(sys.modules[function.__module__]))


def read_ask(source: Source, system: System, kind: str, data: Any) -> Ask:
    """The question in a table."""
    names = system.model.coordinates
    keys = keys_of(kind, state_names(names) if len(names) > 1 else names)
    return Ask(kind=kind, options=read_table(source, (kind,), data, keys))
