"""A study: a system, how to simulate it, and the other questions about it: a table for each, whose
keys are the arguments of a function."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_type_hints

from saltus.checks import LIMITS
from saltus.config.readers import (
    Reader,
    Source,
    read_angle,
    read_number,
    read_source,
    read_switches,
    read_table,
    read_text,
    read_values,
    read_values_or_number,
    read_whole,
    read_within,
    reader_of,
    show,
)
from saltus.config.system_parts import read_load, read_part
from saltus.errors import MotionError, ParameterError, SweepError, TraceError, near, shown
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
    return Settings(
        samples=values.pop("samples", None),
        arguments={**dict.fromkeys(system.model.coordinates, 0.0), **values},
    )


def margin_names(system: System) -> tuple[str, ...]:
    """The margins of the system's model, at which a motion may be asked to stop."""
    return system.model.margin_names(system.load)


def _check_horizon(source: Source, system: System, values: Mapping[str, Any]) -> None:
    if "periods" in values and "duration" in values:
        source.refuse(
            ("simulate", "duration"), "simulate has both periods and duration; keep one of them"
        )
    if "periods" not in values and "duration" not in values:
        source.refuse(
            ("simulate",),
            "simulate needs periods (of the load) or duration (dimensionless time), such as "
            "duration = 50",
        )
    if "periods" in values and system.load.period is None:
        source.refuse(
            ("simulate", "periods"),
            "simulate.periods needs load.frequency, which is not given; give simulate.duration "
            "instead",
        )


def _readers(model: Model, margins: tuple[str, ...]) -> dict[str, Reader]:
    """The keys of the table, which are the arguments of `saltus.simulate` and `samples`."""

    def read_margins(value: Any) -> tuple[str, ...]:
        names = tuple(read_text(item) for item in (value if isinstance(value, list) else [value]))
        for name in names:
            if name not in margins:
                raise ValueError(
                    f"must name margins of this model, got {show(name)}; {near(name, margins)}"
                )
        return names

    def read_velocities(value: Any) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != len(model.coordinates):
            raise ValueError(
                f"must be a list of {len(model.coordinates)} numbers, got {show(value)}"
            )
        return tuple(read_number(item) for item in value)

    return {
        **{
            name: read_angle if model.unit_of(name) == "rad" else read_number
            for name in model.coordinates
        },
        "velocity": read_velocities if len(model.coordinates) > 1 else read_number,
        "periods": read_within(read_number, above=0.0, at_most=LIMITS.periods),
        "duration": read_within(read_number, above=0.0, at_most=LIMITS.periods),
        "tol": read_within(read_number, at_least=1e-15, at_most=1e-6),
        "time": read_number,
        "side": _read_side,
        "relays": read_switches,
        "stop_at": read_margins,
        "samples": read_within(read_whole, at_least=2, at_most=10_000_000),
    }


def _read_side(value: Any) -> int:
    number = read_number(value)
    if number not in (1, -1):
        raise ValueError(f"must be 1 (theta > 0) or -1 (theta < 0), got {show(value)}")
    return int(number)


QUESTIONS: dict[str, tuple[str, ...]] = {
    "phase_portrait": ("phase_portrait",),
    "response_spectrum": ("response_spectrum", "bifurcation_diagram"),
    "bifurcation_diagram": ("bifurcation_diagram",),
    "frequency_sweep": ("frequency_sweep",),
    "attractors": ("find_attractors",),
    "basins": ("basins_of_attraction",),
    "stability_chart": ("stability_chart", "studies.bordered_chart"),
    "prove": ("studies.prove_orbit_of",),
}  # The first function that takes all the given keys answers; a function with open-ended options passes them to the other.
# these come from the rest of the file or the command line
NOT_IN_FILES = ("system", "store", "workers", "scheduler")


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
            if any(a.kind is a.VAR_KEYWORD for a in arguments.values()) or set(self.options) <= set(
                arguments
            ):
                return function
        raise ParameterError(f"no function answers {self.kind} with {', '.join(self.options)}")


def functions_of(kind: str) -> list[Callable[..., Any]]:
    """The functions in the table of questions."""
    return [attrgetter(name)(import_module("saltus")) for name in QUESTIONS[kind]]


def keys_of(kind: str, coordinates: tuple[str, ...] = ()) -> dict[str, Reader]:
    """The keys that the table of a question may have, with their readers: the arguments of types
    that a file can give.

    Parameters
    ----------
    coordinates
        The names of the coordinates; the state variables of such a model stand for an open-ended
        argument.
    """
    keys: dict[str, Reader] = {}
    for function in functions_of(kind):
        hints = _hints(function)
        for argument in inspect.signature(function).parameters.values():
            reader = reader_of(hints[argument.name])
            if reader is not None and argument.name not in NOT_IN_FILES:
                lists = reader is read_values_or_number
                # with one coordinate, values must be lists
                if argument.kind is argument.VAR_KEYWORD:
                    keys |= dict.fromkeys(
                        coordinates, read_values if lists and len(coordinates) == 1 else reader
                    )
                else:
                    keys[argument.name] = reader
    return keys


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """The types of a function's arguments, without that of its result, which may need a module that
    is not there at run time.
    """
    annotations = {
        argument.name: argument.annotation
        for argument in inspect.signature(function).parameters.values()
    }
    return get_type_hints(
        SimpleNamespace(__annotations__=annotations),
        globalns=vars(sys.modules[function.__module__]),
    )


def read_ask(source: Source, system: System, kind: str, data: Any) -> Ask:
    """The question in a table."""
    names = system.model.coordinates
    keys = keys_of(kind, state_names(names) if len(names) > 1 else names)
    return Ask(kind=kind, options=read_table(source, (kind,), data, keys))


PARTS = ("model", "load", "impact", "simulate", *QUESTIONS)


@dataclass(frozen=True, kw_only=True)
class Study:
    r"""A system, how to simulate it and the other questions about it, as a TOML file gives them.

    `load_study("study.toml").run()` is `saltus.simulate` with the file's settings.

    Attributes
    ----------
    name
        Its name, that of the file.
    system
        What is studied.
    simulate
        The settings of [simulate]; None if the file has none.
    asks
        The other questions, in the order of the file.
    source
        The file.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("study.toml").write_text("[model]\ntype = 'WallOscillator'\n[simulate]\nx = -0.5\nduration = 3\n")
    >>> saltus.load_study("study.toml").system.model.wall
    1.0
    """

    name: str
    system: System
    simulate: Settings | None = None
    asks: tuple[Ask, ...] = ()
    source: Source

    def settings(self) -> Settings:
        """The settings of [simulate]; an error if the file has none.

        Raises
        ------
        ParameterError
            The file has no [simulate].
        """
        if self.simulate is None:
            self.source.refuse(
                (), "has no [simulate]; add one, such as [simulate] theta = 0.3, periods = 20"
            )
        return self.simulate

    def run(self, **more: Any) -> Any:
        """The motion that the study asks for; `more` is passed to `saltus.simulate` and replaces
        settings of the file.

        Parameters
        ----------
        more
            Arguments of `saltus.simulate`.

        Raises
        ------
        ParameterError
            The file has no [simulate], or the flow refuses a setting (with the file's name).
        MotionError
            The motion cannot be continued (with the file's name).
        TraceError
            The model uses an operation that cannot be traced (with the file's name).
        """
        from saltus.flow import simulate

        own = {name: value for name, value in self.settings().arguments.items() if name not in more}
        return self.answer(Ask(kind="simulate", options=own), simulate, **more)

    def answer(self, ask: Ask, function: Callable[..., Any], **more: Any) -> Any:
        """`function(system, ...)` with the arguments of a question, and `more`.

        Parameters
        ----------
        ask
            The question.
        function
            The function that answers it.
        more
            Arguments besides those of the file.

        Raises
        ------
        ParameterError
            The function refuses an argument, with its place in the file.
        MotionError
            As the function raises them, with the file's name.
        TraceError
            As the function raises them, with the file's name.
        SweepError
            As the function raises them, with the file's name.
        """
        try:
            return function(self.system, **ask.options, **more)
        except ParameterError as error:
            known = error.parameter in ask.options
            self.source.refuse_error(
                (error if known else ParameterError(str(error))).inside(ask.kind)
            )
        except (MotionError, TraceError, SweepError) as error:
            raise type(error)(f"{self.source.path}, {ask.kind}: {error}") from error


def load_study(path: Path | str, *, questions: bool = True) -> Study:
    r"""The study in the TOML file at `path`, checked in full.

    Parameters
    ----------
    path
        The path of the file.
    questions
        Whether the other questions are read, which loads the functions that answer them.

    Raises
    ------
    ParameterError
        An error in the file, in one sentence with the file and the dotted key.
    TraceError
        A class of one's own that cannot be traced, with the file's name.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("study.toml").write_text("[model]\ntype = 'WallOscillator'\n[simulate]\nx = -0.5\nduration = 3\n")
    >>> str(saltus.load_study("study.toml").run().stop)
    'horizon'
    """
    source, tables = read_source(Path(path))
    for name in tables:
        if name not in PARTS:
            source.refuse((name,), f"unknown key {shown(name)}; {near(name, PARTS)}")
    if "model" not in tables:
        source.refuse(
            (), 'has no [model]; begin with [model] type = "Metainterface", beta0 = "80 deg"'
        )
    parts: dict[str, Any] = {
        name: read_part(source, name, tables[name])
        for name in ("model", "impact")
        if name in tables
    }
    if "load" in tables:
        parts["load"] = read_load(source, tables["load"])
    try:
        system = System.from_dict(parts)
    except ParameterError as error:
        source.refuse_error(error)
    except TraceError as error:
        raise TraceError(f"{source.path}, model: {error}") from error
    settings = read_settings(source, system, tables["simulate"]) if "simulate" in tables else None
    asks = tuple(
        read_ask(source, system, name, tables[name])
        for name in tables
        if questions and name in QUESTIONS
    )
    return Study(name=source.path.stem, system=system, simulate=settings, asks=asks, source=source)
