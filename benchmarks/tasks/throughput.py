"""Many motions on all cores: trajectory-periods a second.

A peer that has no way of its own to use all cores is measured on one of them, on fewer motions, and
multiplied: that is an upper bound, and the row says so.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from typing import Any

from measure import interleave
from peers import Peer
from reference import PERIODS, states

TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12, 1e-14)


def throughput(peers: list[Peer], rounds: int, quick: bool) -> list[dict[str, Any]]:
    """One row for each peer that uses all cores by itself, at each tolerance."""
    motions = 10_000 if quick else 100_000
    rows = []
    for tol in TOLERANCES[::2] if quick else TOLERANCES:
        with ExitStack() as stack:
            flows = {
                p.name: stack.enter_context(p.all_cores(tol))
                for p in peers
                if p.all_cores is not None
            }
            start = states(motions)
            warm = {name: flow(*states(1024)) for name, flow in flows.items()}  # compiles
            assert all(len(x) == 1024 for x, _ in warm.values())
            timings = interleave({n: _task(f, start) for n, f in flows.items()}, rounds, warm=False)
        for name, timing in timings.items():
            rate = motions * PERIODS / timing.median
            spread = {
                "slowest": motions * PERIODS / timing.high,
                "fastest": motions * PERIODS / timing.least,
            }
            rows.append(
                {
                    "peer": name,
                    "tol": tol,
                    "rate": rate,
                    **spread,
                    "motions": motions,
                    "measured": True,
                }
            )
    return rows


def _task(flow: Any, start: Any) -> Any:
    return lambda: flow(*start)


def extrapolated(peers: list[Peer], work: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rates of the other peers, from the times of `work_precision` on one core, as if all cores
    could be used perfectly.
    """
    cores = os.cpu_count() or 1
    alone = {peer.name: peer.batch for peer in peers if peer.all_cores is None}
    return [
        {"peer": row["peer"], "tol": row["tol"], "rate": cores * 1e6 / row["median"], "slowest": cores * 1e6 / row["high"],
         "fastest": cores * 1e6 / row["least"], "motions": alone[row["peer"]], "measured": False}
        for row in work if row["peer"] in alone
    ]  # fmt: skip
