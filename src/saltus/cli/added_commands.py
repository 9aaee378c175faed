"""Commands that other packages add: each is an entry point of the group `saltus.commands`, a function with typer's annotations.

The name of the entry point is that of the command. An error of saltus or an interruption ends it with one sentence, as it ends
any other command.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer

from saltus.cli.guard import guarded
from saltus.errors import SaltusError

GROUP = "saltus.commands"
ELSEWHERE = {"reproduce": "saltus-paper", "report": "saltus-paper"}  # commands of packages that saltus does not need


def add_commands(app: typer.Typer) -> None:
    """Add every command that an installed package gives, and for one that is known and not installed, how to get it."""
    given = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name, entry in sorted(given.items()):
        _add(app, name, entry)
    for name in ELSEWHERE.keys() - given.keys():
        package = ELSEWHERE[name]
        sentence = f"`saltus {name}` comes with the package {package}; in a checkout of saltus, `make reproduce` installs it"
        _add_refusal(app, name, sentence)


def _add(app: typer.Typer, name: str, entry: EntryPoint) -> None:
    try:
        work = entry.load()
    except Exception as error:  # whatever another package does, the other commands go on
        package = entry.dist.name if entry.dist else entry.value
        _add_refusal(app, name, f"`saltus {name}` cannot be loaded from {package} ({type(error).__name__}: {error})")
    else:
        app.command(name)(_in_guard(work))


def _in_guard(work: Callable[..., Any]) -> Callable[..., None]:
    @wraps(work)
    def command(*given: Any, **named: Any) -> None:
        with guarded():
            work(*given, **named)

    return command


def _add_refusal(app: typer.Typer, name: str, sentence: str) -> None:
    """A command that takes any arguments, and says why it cannot run."""

    def refuse() -> None:
        with guarded():
            raise SaltusError(sentence)

    any_arguments = {"allow_extra_args": True, "ignore_unknown_options": True}
    app.command(name, help=f"{sentence[0].upper()}{sentence[1:]}.", context_settings=any_arguments)(refuse)
