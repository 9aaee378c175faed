"""From the start of the interpreter to the end of the first motion: cold, cached, with other numbers, with another structure.

The cold start of saltus has an empty cache directory; the kernels that serve every model are compiled then as well. The
other codes keep nothing on disk, so that every start of theirs is the same.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from measure import summary
from peers import Peer

from tasks.process import run_child

LIMIT = 300.0


def startup(peers: list[Peer], rounds: int) -> list[dict[str, Any]]:
    """One row for each start: seconds, and the files that it added to the cache."""
    rows: list[dict[str, Any]] = []
    for peer in peers:
        module = peer.setup.__module__.removeprefix("peers.")
        if module.startswith("saltus"):
            rows.extend(_saltus(module, peer.name, rounds))
        elif module != "prototype":
            rows.append(
                _row(peer.name, "every start", [run_child("first", module, peer.name, limit=LIMIT) for _ in range(rounds)])
            )
    return rows


def _saltus(module: str, name: str, rounds: int) -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as cache:

        def start(label: str, variant: str, times: int) -> dict[str, Any]:
            before = _files(cache)
            answers = [
                run_child("first", module, name, variant, limit=LIMIT, environment={"SALTUS_CACHE_DIR": cache})
                for _ in range(times)
            ]
            return _row(name, label, answers) | {"new_files": len(_files(cache) - before)}

        return [
            start("cold, everything compiled", "the case", 1),
            start("cached", "the case", rounds),
            start("other numbers", "other numbers", 1),
            start("another structure, cold", "another structure", 1),
        ]


def _row(name: str, label: str, answers: list[dict[str, Any]]) -> dict[str, Any]:
    failed = [a["fails"] for a in answers if "fails" in a]
    row = {"peer": name, "start": label}
    return row | ({"fails": failed[0]} if failed else summary([a["wall"] for a in answers]).as_dict())


def _files(folder: str) -> set[tuple[str, int]]:
    """What the cache holds: names and times of change, so that a file written anew counts."""
    return {(str(p), p.stat().st_mtime_ns) for p in Path(folder).rglob("*") if p.is_file()}
