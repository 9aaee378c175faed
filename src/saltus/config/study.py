"""A study: a system, how to simulate it, and what else is asked of it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from saltus.config.fields import call
from saltus.config.loads import read_load
from saltus.config.questions import ASKS, Ask, read_ask
from saltus.config.settings import Settings, read_settings
from saltus.config.source import Source, read_source
from saltus.config.types import read_part
from saltus.errors import MotionError, ParameterError, SweepError, TraceError, near
from saltus.systems import Load, System, VelocityReduction

PARTS = ("model", "load", "impact", "simulate", *ASKS)


@dataclass(frozen=True, kw_only=True)
class Study:
    """A system, how to simulate it and what else is asked of it, as a TOML file gives them.

    `load_study("study.toml").run()` is `saltus.simulate` with the file's settings.
    """

    name: str
    system: System
    simulate: Settings | None = None  # None where the file has no [simulate]
    asks: tuple[Ask, ...] = ()  # the other questions, in the order of the file
    source: Source

    def settings(self) -> Settings:
        """`simulate`, refused where the file has none.

        Raises:
            ParameterError: the file has no [simulate].
        """
        if self.simulate is None:
            self.source.refuse((), "has no [simulate]; add one, such as [simulate] theta = 0.3, periods = 20")
        return self.simulate

    def run(self, **more: Any) -> Any:
        """The motion that the study asks for; `more` goes to `saltus.simulate` as it is.

        Raises:
            ParameterError: the file has no [simulate], or the flow refuses a setting (with the file's name).
            MotionError: the motion cannot be continued (with the file's name).
            TraceError: the model uses an operation that cannot be traced (with the file's name).
        """
        from saltus.flow import simulate

        arguments = {**self.settings().arguments(), **more}
        try:
            return call(self.source, simulate, self.system, **arguments)
        except (MotionError, TraceError) as error:
            raise type(error)(f"{self.source.path}: {error}") from error

    def answer(self, ask: Ask, function: Callable[..., Any], **more: Any) -> Any:
        """`function(system, ...)` with the arguments of a question, and `more`.

        Raises:
            ParameterError: the function refuses an argument, told at its place in the file.
            MotionError, TraceError, SweepError: as the function raises them, with the file's name.
        """
        try:
            return function(self.system, **ask.options, **more)
        except ParameterError as error:
            key = _named(ask, str(error))
            place = (ask.kind,) if key is None else (ask.kind, key)
            said = f".{error}" if str(error).startswith(f"{key} ") else f": {error}"
            self.source.refuse(place, (ask.kind if said[0] == "." else ".".join(place)) + said)
        except (MotionError, TraceError, SweepError) as error:
            raise type(error)(f"{self.source.path}, {ask.kind}: {error}") from error


def _named(ask: Ask, sentence: str) -> str | None:
    """The key of a question that a refusal is about: the one that it begins with, or else whose text or name is in it."""
    words = re.findall(r"\w+", sentence)
    if words and words[0] in ask.options:
        return words[0]
    for key, value in ask.options.items():
        texts = [value] if isinstance(value, str) else value if isinstance(value, tuple) else []
        if any(isinstance(text, str) and text in sentence for text in texts):
            return key
    return next((word for word in words if word in ask.options), None)


def load_study(path: Path | str) -> Study:
    """The study in the TOML file at `path`, checked in full.

    Raises:
        ParameterError: whatever is wrong, in one sentence with the file, the line and the dotted key.
    """
    source, tables = read_source(Path(path))
    for name in tables:
        if name not in PARTS:
            source.refuse((name,), f"unknown key {name!r}; {near(name, PARTS)}")
    if "model" not in tables:
        source.refuse((), 'has no [model]; begin with [model] type = "Metainterface", beta0 = "80 deg"')
    model = read_part(source, "model", tables["model"])
    load = read_load(source, tables["load"]) if "load" in tables else Load()
    impact = read_part(source, "impact", tables["impact"]) if "impact" in tables else VelocityReduction()
    system: System = call(source, System, model=model, load=load, impact=impact)
    settings = read_settings(source, system, tables["simulate"]) if "simulate" in tables else None
    asks = tuple(read_ask(source, system, name, tables[name]) for name in tables if name in ASKS)
    return Study(name=source.path.stem, system=system, simulate=settings, asks=asks, source=source)
