"""The documentation's table of what works with what, written from the data of its tests.

`python tests/what_works/table.py` writes the page anew.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "docs" / "what_works.md"
HEAD = """# What works with what

Each cell is a test of one small system (`tests/what_works/`), from which this page is written.
A tick says that it works, and that its result agrees with a motion, another verb or the file read back.
A number says that it is refused in one sentence, for the reason below.
"""


def written() -> str:
    """The page as Markdown."""
    from what_works.refused import REASONS, REFUSED
    from what_works.verbs import VERBS

    numbers = {words: number for number, words in enumerate(REASONS, 1)}
    parts = [HEAD]
    half = (len(VERBS) + 1) // 2
    for title, verbs in (("Motions and orbits", VERBS[:half]), ("Results", VERBS[half:])):
        cells = {key: f"({numbers[words]})" for key, words in REFUSED.items()}
        parts.append(f"## {title}\n\n{_table(verbs, cells)}")
    functions = "\n".join(
        f"* **{verb.name}**: {', '.join(f'`saltus.{name}`' for name in verb.functions.split(', '))}"
        for verb in VERBS
    )
    reasons = "\n".join(f"{number}. {REASONS[words]}" for words, number in numbers.items())
    return "\n".join([*parts, f"## The functions\n\n{functions}\n", f"## Reasons\n\n{reasons}\n"])


def _table(verbs: Sequence[object], cells: dict[tuple[str, str], str]) -> str:
    from what_works.model_classes import CLASSES

    names = [verb.name for verb in verbs]  # type: ignore[attr-defined]
    lines = [f"| | {' | '.join(names)} |", f"|---|{':-:|' * len(names)}"]
    for each in CLASSES:
        row = [cells.get((each.name, name), "✓") for name in names]
        lines.append(f"| {each.label} | {' | '.join(row)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.path[:0] = [str(TESTS), str(TESTS / "web")]
    PAGE.write_text(written())
