"""How long for how much: every peer at each of its tolerances, on one core, against the exact ends
of sixteen motions.

A code's error is the largest over the sixteen, so that one lost motion is not averaged away.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from measure import interleave
from peers import Peer
from reference import MOTIONS, PERIODS, errors, states


def work_precision(peers: list[Peer], rounds: int, quick: bool) -> list[dict[str, Any]]:
    """One row for each peer and tolerance: the error, and microseconds for one motion over one
    period.
    """
    tasks: dict[tuple[str, float], Any] = {}
    rows: dict[tuple[str, float], dict[str, Any]] = {}
    for peer in peers:
        slow = peer.batch == 1
        for tol in peer.tolerances[:: 2 if quick else 1]:
            key, flow = (peer.name, tol), peer.setup(tol)
            error = errors(
                *flow(*states((4 if quick else MOTIONS) if slow else max(peer.batch, MOTIONS)))
            )
            rows[key] = {
                "peer": peer.name,
                "tol": tol,
                "error": float(error.max()),
                "median_error": float(np.median(error)),
            }
            tasks[key] = _task(flow, peer.batch)
    timings = interleave(tasks, rounds, warm=False, one_core=True)
    batches = {peer.name: peer.batch for peer in peers}
    return [
        row | timings[key].per(batches[key[0]] * PERIODS).as_dict() for key, row in rows.items()
    ]


def _task(flow: Any, batch: int) -> Any:
    start = states(batch)
    return lambda: flow(*start)
