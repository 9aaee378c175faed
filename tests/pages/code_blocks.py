"""The one engine that runs what pages and docstrings show, and compares what is printed with what
they say.

A page is read from top to bottom, in a folder of its own:

    ```python    runs with the names of the blocks above; what it prints stands in a ```text block
    right below it ```console   each line after `$ ` is a command `saltus ...`, what it prints
    stands below it ```toml, ```python or ```text whose first line is `# name.ext`, a file's name:
    the file that is then there ```toml      else must be a table that TOML knows ```text, ```sh
    are not run: trees, formulas, commands of other programs

In what is printed, `...` stands for anything, and a number agrees within one unit of the last digit
that is shown (and within ROUNDING, since residuals and brackets differ from machine to machine).
"""

import contextlib
import doctest
import io
import re
import sys
import tomllib
import types
from itertools import pairwise
from pathlib import Path

FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w.-]+\.(?:toml|py|csv))\n")
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w])")
ROUNDING = 1e-10
KINDS = ("python", "console", "toml", "text", "sh")


def blocks(text):
    """(kind, code, what is printed or None, line) of each block; what a block prints is no block of
    its own.
    """
    found = list(FENCE.finditer(text))
    printed = {
        a: b
        for a, b in pairwise(found)
        if a[1] == "python" and b[1] == "text" and not text[a.end() : b.start()].strip()
    }
    for block in found:
        if block not in printed.values():
            yield (
                block[1],
                block[2],
                printed[block][2] if block in printed else None,
                text.count("\n", 0, block.start()) + 1,
            )


def agrees(shown, printed):
    """Whether what is printed is what is shown."""
    shown, printed = (re.sub(r"\s+", " ", text).strip() for text in (shown, printed))
    places = list(NUMBER.finditer(shown))
    starts, ends = [0, *(n.end() for n in places)], [*(n.start() for n in places), len(shown)]
    between = [
        re.escape(shown[a:b]).replace(re.escape("..."), ".*?")
        for a, b in zip(starts, ends, strict=True)
    ]
    found = re.fullmatch(f"({NUMBER.pattern})".join(between), printed)
    return bool(found) and all(
        abs(float(got) - float(number[0])) <= max(ROUNDING, 1.001 * _unit(number[0]))
        for got, number in zip(found.groups(), places, strict=True)
    )


def _unit(number):
    """One unit of the last digit of a number; whole numbers are exact."""
    digits, _, exponent = number.partition("e")
    if not exponent and "." not in digits:
        return 0.0
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))


class Shown(doctest.OutputChecker):
    """Docstrings are compared like pages."""

    def check_output(self, want, got, optionflags):
        """Whether what an example prints is what the docstring says."""
        return agrees(want, got)


class Page:
    """A page that runs."""

    def __init__(self, path, folder, command, monkeypatch):
        self.path, self.folder, self.command = path, folder, command
        self.module = types.ModuleType("page_that_runs")
        monkeypatch.setitem(sys.modules, "page_that_runs", self.module)
        monkeypatch.chdir(folder)
        monkeypatch.syspath_prepend(folder)

    def run(self):
        """Run all blocks."""
        for kind, code, shown, line in blocks(self.path.read_text(encoding="utf-8")):
            where = f"{self.path.name}:{line}"
            assert kind in KINDS or kind.startswith("{"), (
                f"{where}: {kind!r} is none of {', '.join(KINDS)}"
            )
            if named := FILE.match(code):
                Path(named[1]).write_text(code, encoding="utf-8")
            elif kind == "python":
                self._python(code, shown, where)
            elif kind == "console":
                self._console(code, where)
            if kind == "toml":
                tomllib.loads(code)

    def _python(self, code, shown, where):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, where, "exec"), vars(self.module))
        assert shown is not None or not printed.getvalue(), (
            f"{where} prints what the page does not show:\n{printed.getvalue()}"
        )
        assert agrees(shown or "", printed.getvalue()), (
            f"{where} shows\n{shown}\nand prints\n{printed.getvalue()}"
        )

    def _console(self, code, where):
        for said in re.split(r"^\$ ", code, flags=re.MULTILINE)[1:]:
            line, _, shown = said.partition("\n")
            program, *arguments = line.partition("#")[0].split()
            assert program == "saltus", (
                f"{where}: {line!r} is no command of saltus; use a block of kind sh"
            )
            printed = self.command(*arguments).output
            assert not shown.strip() or agrees(shown, printed), (
                f"{where}: {line} shows\n{shown}\nand prints\n{printed}"
            )
