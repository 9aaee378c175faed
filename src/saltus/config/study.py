"""A study: a system, how to simulate it, and the other questions about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from saltus.config.questions import QUESTIONS, Ask, Settings, read_ask, read_settings
from saltus.config.readers import Source, read_source
from saltus.config.system_parts import read_load, read_part
from saltus.errors import MotionError, ParameterError, SweepError, TraceError, near, shown
from saltus.systems import System

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
            self.source.refuse((), "has no [simulate]; add one, such as [simulate] theta = 0.3, periods = 20")
        return self.simulate

    def run(self, **more: Any) -> Any:
        """The motion that the study asks for; `more` is passed to `saltus.simulate` and replaces settings of the file.

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
            self.source.refuse_error((error if known else ParameterError(str(error))).inside(ask.kind))
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
        source.refuse((), 'has no [model]; begin with [model] type = "Metainterface", beta0 = "80 deg"')
    parts: dict[str, Any] = {name: read_part(source, name, tables[name]) for name in ("model", "impact") if name in tables}
    if "load" in tables:
        parts["load"] = read_load(source, tables["load"])
    try:
        system = System.from_dict(parts)
    except ParameterError as error:
        source.refuse_error(error)
    settings = read_settings(source, system, tables["simulate"]) if "simulate" in tables else None
    asks = tuple(read_ask(source, system, name, tables[name]) for name in tables if questions and name in QUESTIONS)
    return Study(name=source.path.stem, system=system, simulate=settings, asks=asks, source=source)
