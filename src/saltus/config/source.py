"""The text of a study, and the line of each key in it."""

from __future__ import annotations

import bisect
import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from saltus.errors import ParameterError

Keys = tuple[str, ...]

LARGEST = 10_000_000  # the most bytes of a study: a larger file is something else

BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
BARE = re.compile(r"[^\s,\]\}#=.\"']+")
SCALAR = re.compile(r"[^\n,\]\}#]+")
STRINGS = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|' r"'''.*?'{3,5}|" r'"(?:\\.|[^"\\\n])*"|' r"'[^'\n]*'", re.DOTALL)


@dataclass(frozen=True)
class Source:
    """A TOML file: its path, its text and the line of every key, with which refusals name the place of an error."""

    path: Path
    text: str = ""
    lines: dict[Keys, int] = field(default_factory=dict)

    def refuse(self, keys: Keys, problem: str) -> NoReturn:
        """Raise a ParameterError of one sentence: file, line of `keys` (or of the table around them) and `problem`."""
        while keys and keys not in self.lines:
            keys = keys[:-1]
        line = f", line {self.lines[keys]}" if keys else ""
        raise ParameterError(one_line(f"{self.path}{line}: {problem}"), ".".join(keys) or "path")

    def refuse_error(self, error: ParameterError) -> NoReturn:
        """Raise the refusal of a parameter at its place in the file, or at that of the nearest table around it."""
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
        tables = tomllib.loads(text)
        return Source(path, text, key_lines(text)), tables
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


def key_lines(text: str) -> dict[Keys, int]:
    """The line, from 1, of every key of a valid TOML text; items of a list are named by their number from 0."""
    return _Scanner(text).run()


class _Scanner:
    """A walk through valid TOML that notes where keys stand and skips everything else."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.lines: dict[Keys, int] = {}

    def run(self) -> dict[Keys, int]:
        table: Keys = ()
        counts: dict[Keys, int] = {}
        self.skip()
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                double = self.text.startswith("[[", self.at)
                table = self.header(2 if double else 1, counts, double)
            else:
                self.pair(table)
            self.skip()
        return self.lines

    def header(self, width: int, counts: dict[Keys, int], double: bool) -> Keys:
        """Past a [table] or [[table]] header; its keys, with the numbers of the lists of tables on the way."""
        self.at += width
        parts = self.key()
        self.skip()
        self.at += width
        keys: Keys = ()
        for i, part in enumerate(parts):
            keys = (*keys, part)
            if double and i == len(parts) - 1:
                counts[keys] = counts.get(keys, -1) + 1
            self.note(keys)
            if keys in counts:
                keys = (*keys, str(counts[keys]))
                self.note(keys)
        return keys

    def pair(self, table: Keys) -> None:
        """Past `key = value`."""
        for part in self.key():
            table = (*table, part)
            self.note(table)
        self.skip()
        self.at += 1  # the equals sign
        self.skip()
        self.value(table)

    def key(self) -> list[str]:
        """Past a dotted key; its parts."""
        parts: list[str] = []
        while True:
            self.skip()
            string = STRINGS.match(self.text, self.at)
            match = string or BARE.match(self.text, self.at)
            if match is None:
                return parts
            parts.append(tomllib.loads(f"key = {match[0]}")["key"] if string else match[0])
            self.at = match.end()
            self.skip()
            if not self.text.startswith(".", self.at):
                return parts
            self.at += 1

    def value(self, keys: Keys) -> None:
        """Past a value, noting the keys inside it."""
        opening = self.text[self.at : self.at + 1]
        if opening in ("[", "{"):
            self.at += 1
            self.inside(keys, "]" if opening == "[" else "}")
        else:
            match = STRINGS.match(self.text, self.at) or SCALAR.match(self.text, self.at)
            self.at = match.end() if match else len(self.text)

    def inside(self, keys: Keys, closing: str) -> None:
        """Past the items of a list or an inline table."""
        number = 0
        self.skip()
        while self.at < len(self.text) and self.text[self.at] != closing:
            if closing == "}":
                self.pair(keys)
            else:
                item = (*keys, str(number))
                self.note(item)
                self.value(item)
                number += 1
            self.skip()
            if self.text.startswith(",", self.at):
                self.at += 1
                self.skip()
        self.at += 1

    def note(self, keys: Keys) -> None:
        self.lines.setdefault(keys, bisect.bisect_right(self.starts, self.at))

    def skip(self) -> None:
        match = BLANK.match(self.text, self.at)
        self.at = match.end() if match else self.at
