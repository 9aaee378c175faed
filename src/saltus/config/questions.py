"""What a study asks: the settings of [simulate], and a table for each other question, whose keys are arguments of functions."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from types import SimpleNamespace
from typing import Any, get_type_hints

from saltus.checks import LIMITS
from saltus.config.readers import (
    Reader,
    Source,
    read_angle,
    read_number,
    read_table,
    read_text,
    read_values,
    read_values_or_number,
    read_whole,
    read_within,
    reader_of,
    show,
)
from saltus.errors import ParameterError, near
from saltus.flow import state_names
from saltus.systems import Model, System


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a study is simulated."""

    arguments: dict[str, Any]  # the arguments of `saltus.simulate`, except the system
    samples: int | None = None  # the number of evenly spaced samples that are written to motion.nc


def read_settings(source: Source, system: System, data: Any) -> Settings:
    """The settings of a study of `system`."""
    values = read_table(source, ("simulate",), data, _readers(system.model, margin_names(system)))
    _check_horizon(source, system, values)
    return Settings(samples=values.pop("samples", None), arguments={**dict.fromkeys(system.model.coordinates, 0.0), **values})


def margin_names(system: System) -> tuple[str, ...]:
    """The margins of the system's model, at which a motion may be asked to stop."""
    return system.model.margin_names(system.load)


def _check_horizon(source: Source, system: System, values: Mapping[str, Any]) -> None:
    if "periods" in values and "duration" in values:
        source.refuse(("simulate", "duration"), "simulate has both periods and duration; keep one of them")
    if "periods" not in values and "duration" not in values:
        source.refuse(
            ("simulate",), "simulate needs periods (of the load) or duration (dimensionless time), such as duration = 50"
        )
    if "periods" in values and system.load.period is None:
        source.refuse(
            ("simulate", "periods"), "simulate.periods needs load.frequency, which is not given; give simulate.duration instead"
        )


def _readers(model: Model, margins: tuple[str, ...]) -> dict[str, Reader]:
    """The keys of the table, which are the arguments of `saltus.simulate` and `samples`."""

    def read_margins(value: Any) -> tuple[str, ...]:
        names = tuple(read_text(item) for item in (value if isinstance(value, list) else [value]))
        for name in names:
            if name not in margins:
                raise ValueError(f"names no margin of this model with {show(name)}; {near(name, margins)}")
        return names

    def read_velocities(value: Any) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != len(model.coordinates):
            raise ValueError(f"must be a list of {len(model.coordinates)} numbers, got {show(value)}")
        return tuple(read_number(item) for item in value)

    return {
        **{name: read_angle if model.unit_of(name) == "rad" else read_number for name in model.coordinates},
        "velocity": read_velocities if len(model.coordinates) > 1 else read_number,
        "periods": read_within(read_number, above=0.0, at_most=LIMITS.periods),
        "duration": read_within(read_number, above=0.0, at_most=LIMITS.periods),
        "tol": read_within(read_number, at_least=1e-15, at_most=1e-6),
        "time": read_number,
        "side": _read_side,
        "stop_at": read_margins,
        "samples": read_within(read_whole, at_least=2, at_most=10_000_000),
    }


def _read_side(value: Any) -> int:
    number = read_number(value)
    if number not in (1, -1):
        raise ValueError(f"must be 1 (theta > 0) or -1 (theta < 0), got {show(value)}")
    return int(number)


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
