"""The file of a study, and refusals that name it."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from saltus.errors import ParameterError

Keys = tuple[str, ...]

LARGEST = 10_000_000  # the most bytes of a study: a larger file is something else


@dataclass(frozen=True)
class Source:
    """A TOML file, by whose path refusals name it."""

    path: Path

    def refuse(self, keys: Keys, problem: str) -> NoReturn:
        """Raise a ParameterError of one sentence: the file and the `problem`, which names the dotted key."""
        raise ParameterError(one_line(f"{self.path}: {problem}"), ".".join(keys) or "path")

    def refuse_error(self, error: ParameterError) -> NoReturn:
        """Raise the refusal of a parameter at its place in the file, with the path of the file."""
        self.refuse(tuple((error.parameter or "").split(".")), str(error))


def one_line(text: str) -> str:
    """`text` with line breaks and other control characters, which a quoted key may hold, written as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def read_source(path: Path) -> tuple[Source, dict[str, Any]]:
    """The file at `path` and the tables in it.

    Raises
    ------
    ParameterError
        No such file, a folder, a file that cannot be read, text that is not TOML (with the line).
    """
    source = Source(path)
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):  # reading a device or a pipe may never end
            source.refuse((), "is no file; give the path of a study in TOML")
        if path.is_file() and path.stat().st_size > LARGEST:
            source.refuse(
                (), f"has {path.stat().st_size} bytes; a study has at most {LARGEST}, long records have files of their own"
            )
        text = path.read_text(encoding="utf-8-sig")
    except ParameterError:
        raise
    except FileNotFoundError:
        source.refuse((), "there is no such file; give the path of a study in TOML")
    except IsADirectoryError:
        source.refuse((), "is a folder; give the path of a study in TOML")
    except UnicodeDecodeError:
        source.refuse((), "is not a text file; a study is written in TOML, encoded as UTF-8")
    except (OSError, ValueError) as error:
        source.refuse((), f"cannot be read ({getattr(error, 'strerror', None) or error})")
    try:
        return source, tomllib.loads(text)
    except RecursionError:
        source.refuse((), "is not a study: its tables or lists are nested too deeply")
    except ValueError as error:  # TOMLDecodeError is one; so is a number with too many digits
        source.refuse((), _syntax_problem(str(error)))


def _syntax_problem(message: str) -> str:
    place = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    if place is None:
        return f"is not valid TOML: {message[:1].lower()}{message[1:]}"
    problem = message[: place.start()]
    return f"line {place[1]}, column {place[2]} is not valid TOML: {problem[:1].lower()}{problem[1:]}"
