"""From the start of the interpreter to the end of the first motion: cold, cached, with other
numbers, with another structure.

The cold start of saltus has an empty cache directory; the kernels that serve every model are
compiled then as well. The other codes keep nothing on disk, so that every start of theirs is the
same.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from measure import summary
from peers import Peer, firsts

from tasks.process import run_child

LIMIT = 300.0
COLD, CACHED = "cold, everything compiled", "cached"
OTHER_NUMBERS, OTHER_STRUCTURE = "other numbers", "another structure, cold"


def startup(peers: list[Peer], rounds: int) -> list[dict[str, Any]]:
    """One row for each start of each package: seconds, how many of them after the imports, and the
    files added to the cache.
    """
    rows: list[dict[str, Any]] = []
    for peer in firsts(peers):
        module = peer.module
        if module.startswith("saltus"):
            rows.extend(_saltus(peer, rounds))
        elif module != "prototype":
            rows.append(
                _row(
                    peer,
                    "every start",
                    [run_child("first", module, peer.name, limit=LIMIT) for _ in range(rounds)],
                )
            )
    return rows


def _saltus(peer: Peer, rounds: int) -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as cache:

        def start(label: str, variant: str, times: int) -> dict[str, Any]:
            before, place = _files(cache), {"SALTUS_CACHE_DIR": cache}
            runs = [
                run_child("first", peer.module, peer.name, variant, limit=LIMIT, environment=place)
                for _ in range(times)
            ]
            return _row(peer, label, runs) | {"new_files": len(_files(cache) - before)}

        return [
            start(COLD, "the case", 1),
            start(CACHED, "the case", rounds),
            start(OTHER_NUMBERS, "other numbers", 1),
            start(OTHER_STRUCTURE, "another structure", 1),
        ]


def _row(peer: Peer, label: str, answers: list[dict[str, Any]]) -> dict[str, Any]:
    row = {"peer": peer.name, "start": label}
    failed = [a["fails"] for a in answers if "fails" in a]
    if failed:
        return row | {"fails": failed[0]}
    after = summary([a["after_imports"] for a in answers]).median
    return row | summary([a["wall"] for a in answers]).as_dict() | {"after_imports": after}


def _files(folder: str) -> set[tuple[str, int]]:
    """What the cache holds: names and times of change, so that a file written anew counts."""
    return {(str(p), p.stat().st_mtime_ns) for p in Path(folder).rglob("*") if p.is_file()}
