"""Compute the pages of the documentation and of the report in node, as a browser does, and compare
each with Python.

    python tests/web/compute_pages.py docs/_build/html results

takes every page that computes in these folders and files, prints one line for each, and ends with
status 1 where one is missing, does not compute or differs. Of a folder `docs/_build/html` all
living pages are expected, of a folder with `figures` of the report all of its pages.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "web"), str(TESTS.parent / "docs" / "_extensions")]

import living_systems  # noqa: E402  (its own model is registered there)
from test_agreement import NODE, run_node  # noqa: E402

import saltus  # noqa: E402
from saltus.web import one_file  # noqa: E402

BLOCK = r'<script[^>]*\bid="{}"[^>]*>(.*?)</script>'
CHANGE = 1e-13  # of the start, to see how much of a motion rounding decides
UNKNOWN = 1e-2  # a motion whose end changes by more than this is compared in nothing


def expected_pages() -> dict[str, list[str]]:
    """The names of the files of all pages that are made: of the documentation, and of the
    report.
    """
    from saltus_paper.parts import FIGURES

    return {
        "documentation": [f"{name}.html" for name in living_systems.PAGES],
        "report": [f"{figure.name}.html" for figure in FIGURES.values() if figure.page],
    }


def pages_in(places: list[Path]) -> list[Path]:
    """The pages that compute among files and in folders."""
    files = [
        file
        for place in places
        for file in (sorted(place.rglob("*.html")) if place.is_dir() else [place])
    ]
    return [file for file in files if _block(file.read_text(errors="replace"), "wasm")]


def _block(text: str, name: str) -> str | None:
    match = re.search(BLOCK.format(name), text, re.DOTALL)
    return match[1].strip() if match else None


def computed(file: Path) -> str:
    """What a page says of its first motion, once it has been compared with Python.

    Raises
    ------
    AssertionError
        The page does not end where Python does.
    """
    text = file.read_text()
    description: dict[str, Any] = json.loads(str(_block(text, "description")))
    wasm = gzip.decompress(base64.b64decode(str(_block(text, "wasm"))))
    with tempfile.TemporaryDirectory() as folder:
        given = [{"wasm": wasm, "description": description, "sweep": None}]
        (said,) = run_node("words.mjs", one_file.PAGE.as_uri(), given, folder)
    assert np.isfinite(said["end"]).all(), "its motion ends at no number"
    study = description["study"]
    system = saltus.System.from_json(json.dumps(study["system"]))
    asked = dict(study["simulate"])
    name = system.model.coordinates[0]
    ends = []
    for change in (0.0, CHANGE, -CHANGE):
        motion = saltus.simulate(system, **asked | {name: asked[name] + change})
        ends.append(np.array(motion.final_state))
    spread = max(np.abs(end - ends[0]).max() for end in ends)
    if spread < UNKNOWN:
        away = np.abs(np.array(said["end"]) - ends[0]).max()
        assert away <= 1e-9 + 1e3 * spread, f"its motion ends {away:.2g} beside that of Python"
    return str(said["summary"])


def main(places: list[str]) -> int:
    """Compute the pages in some places; the status."""
    if NODE is None:
        print("node is not installed here", file=sys.stderr)
        return 1
    files = pages_in([Path(place) for place in places])
    names = {file.name for file in files}
    failed = not files
    for part, expected in expected_pages().items():
        missing = sorted(set(expected) - names)
        if missing and set(expected) & names:
            print(f"the {part} lacks {', '.join(missing)}")
            failed = True
    for file in files:
        try:
            print(f"{file}: {computed(file)}", flush=True)
        except (AssertionError, saltus.SaltusError, KeyError, ValueError) as error:
            print(f"{file}: FAILED, {error}", flush=True)
            failed = True
    print(f"{len(files)} pages computed{', with failures' if failed else ''}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
