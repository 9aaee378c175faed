"""Infinitely many impacts in a finite time: e = 0.8, no load but a constant V, from theta = 0.3.

The exact motion comes to rest at 17.82077858790958 and stays. Each code runs to time 25 in a
process of its own, under a limit of time and of impacts.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from peers import Peer
from reference import ZENO_HORIZON, ZENO_REST

from tasks.process import run_child

ENOUGH, LIMIT = 1000, 60.0


def zeno(peers: list[Peer]) -> list[dict[str, Any]]:
    """One row for each peer: what it answers and what that is worth."""
    able = [peer for peer in peers if peer.zeno is not None]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        answers = pool.map(
            lambda peer: run_child("zeno", peer.module, peer.name, str(ENOUGH), limit=LIMIT), able
        )
    return [
        {"peer": peer.name, **answer, "verdict": verdict(answer)}
        for peer, answer in zip(able, answers, strict=True)
    ]


def verdict(answer: dict[str, Any]) -> str:
    """In words, what a code did."""
    if "fails" in answer:
        return f"fails: {answer['fails']}"
    impacts, last = answer["impacts"], answer["last_impact"]
    if answer["time"] < ZENO_HORIZON:
        return (
            f"hangs: time stands still at {answer['time']:.10g}; ended by us after {impacts} "
            "impacts"
        )
    if abs(answer["theta"]) > 1e-6 or abs(answer["velocity"]) > 1e-6:
        theta = f"theta({ZENO_HORIZON:g}) = {answer['theta']:.3g} instead of 0"
        return f"wrong: falls through the contact after {impacts} impacts, {theta}"
    return (
        f"right: at rest from {last:.13g} on, error {abs(last - ZENO_REST):.1e}, {impacts} "
        "impacts resolved"
    )
