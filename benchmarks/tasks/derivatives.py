"""What derivatives cost: the flow with them over the flow without, at one tolerance, on one
core.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from measure import interleave
from peers import AbsentError, Peer
from reference import PERIODS, exact, states

TOL = 1e-10


def derivative_cost(peers: list[Peer], rounds: int) -> list[dict[str, Any]]:
    """One row for each peer that has derivatives: both times, their ratio, and the error of the
    derivative to the amplitude.
    """
    tasks: dict[tuple[str, str], Any] = {}
    rows: list[dict[str, Any]] = []
    known = exact()["derivative_to_amplitude"]
    for peer in peers:
        if peer.derivatives is None:
            continue
        row: dict[str, Any] = {"peer": peer.name, "about": peer.derivatives_about}
        rows.append(row)
        start = states(peer.batch)
        try:
            flow = peer.derivatives(TOL)
            _, _, theta, velocity = flow(*start)
        except (AbsentError, TypeError, ValueError, NotImplementedError, RuntimeError) as reason:
            row["fails"] = f"{type(reason).__name__}: {reason}"[:200]
            continue
        row["error"] = float(
            np.max(np.abs([theta[0] - known[0], velocity[0] - known[1]]) / np.abs(known))
        )
        tasks[peer.name, "with"], tasks[peer.name, "without"] = (
            _task(flow, start),
            _task(peer.setup(TOL), start),
        )
    timings = interleave(tasks, rounds, one_core=True)
    for row in rows:
        if "fails" not in row:
            count = next(p.batch for p in peers if p.name == row["peer"]) * PERIODS
            both = [timings[row["peer"], mode].per(count) for mode in ("with", "without")]
            row |= {
                "with": both[0].median,
                "without": both[1].median,
                "ratio": both[0].median / both[1].median,
            }
    return rows


def _task(flow: Any, start: Any) -> Any:
    return lambda: flow(*start)
