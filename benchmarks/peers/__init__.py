"""The peers: one file for each way of computing the motions; a peer that is not installed is
reported as absent.
"""

from __future__ import annotations

import importlib

from peers.peer import AbsentError, DerivativeFlow, Flow, Peer, zeno_answer

MODULES = (
    "saltus_lanes",
    "saltus_scalar",
    "heyoka_batch",
    "heyoka_scalar",
    "diffrax_batch",
    "scipy_restarts",
    "prototype",
)
# the environment variable by which run.py hands --prototype on
PROTOTYPE = "SALTUS_BENCHMARK_PROTOTYPE"

__all__ = [
    "MODULES",
    "PROTOTYPE",
    "AbsentError",
    "DerivativeFlow",
    "Flow",
    "Peer",
    "firsts",
    "load_peers",
    "zeno_answer",
]


def firsts(peers: list[Peer]) -> list[Peer]:
    """One peer of each file: the first, where several methods of one package are measured."""
    seen: dict[str, Peer] = {}
    for peer in peers:
        seen.setdefault(peer.module, peer)
    return list(seen.values())


def load_peers(modules: tuple[str, ...] = MODULES) -> tuple[list[Peer], dict[str, str]]:
    """The peers that can run here, and why the others cannot."""
    peers: list[Peer] = []
    absent: dict[str, str] = {}
    for name in modules:
        try:
            peers.extend(importlib.import_module(f"peers.{name}").PEERS)
        except (ImportError, AbsentError) as reason:
            absent[name] = str(reason)
    return peers, absent
