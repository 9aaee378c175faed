"""Every page that computes, of the documentation and in some folders, run in node and compared with
Python: `python tests/web/every_page.py results`.

What is compared is what test_agreement.py compares: each page's own motion, event by event, as long
as rounding lets it be known.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "docs" / "_extensions")]

import living_systems  # noqa: E402
from test_agreement import AT, check_whole, compared, in_node  # noqa: E402

import saltus  # noqa: E402

BLOCK = r'<script[^>]* id="{}">(.*?)</script>'
MOVED = (0.0, 1e-14, -1e-14, 3e-14)  # by which starts are moved, to see what rounding changes


def pages_in(folder: Path) -> Iterator[tuple[str, dict[str, Any], bytes]]:
    """The name, the description and the compiled code of each page in a folder."""
    for path in sorted(folder.glob("*.html")):
        text = path.read_text(encoding="utf-8")
        blocks = [
            re.search(BLOCK.format(name), text, re.DOTALL) for name in ("description", "wasm")
        ]
        if blocks[0] and blocks[1]:
            code = gzip.decompress(base64.b64decode(blocks[1][1]))
            yield path.name, json.loads(blocks[0][1]), code


def check(description: dict[str, Any], code: bytes) -> int:
    """Compare the motion with which a page opens; how many of its events were compared."""
    study = description["study"]
    system, options = saltus.System.from_json(json.dumps(study["system"])), study["simulate"]
    coordinates = [entry["name"] for entry in description["model"]["coordinates"]]
    length = {name: options[name] for name in ("periods", "duration") if name in options}
    motion = {
        "values": system.parameters,
        "start": description["start"],
        **length,
        "at": [description["start"]["time"] + time for time in AT],
    }
    task = {"wasm": code, "description": description, "motions": [motion]}
    with tempfile.TemporaryDirectory() as folder:
        ((other,),) = in_node([task], folder)
    own, *beside = (
        saltus.simulate(
            system,
            **{
                name: value + shift if name in coordinates and value else value
                for name, value in options.items()
            },
        )
        for shift in MOVED
    )
    count, whole = compared(own, beside, other)
    if whole:
        check_whole(system, own, beside, other, motion["at"])
    return count


def main(folders: list[str]) -> None:
    """Check all pages; an error names the page."""
    with tempfile.TemporaryDirectory() as made:
        for name in living_systems.PAGES:
            living_systems.write(name, made)
        saltus.register(living_systems.Bilinear)
        number = 0
        for folder in (Path(made), *map(Path, folders)):
            for name, description, code in pages_in(folder):
                try:
                    events = check(description, code)
                except Exception as error:
                    raise SystemExit(f"{name} does not agree with Python: {error!r}") from error
                print(f"{name}: {events} events agree with Python", flush=True)
                number += 1
    print(f"{number} pages agree with Python")


if __name__ == "__main__":
    main(sys.argv[1:])
