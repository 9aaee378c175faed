"""Measure saltus beside its peers, and write the report, the numbers and the picture to
benchmarks/results/.

    make bench        or        python benchmarks/run.py [--rounds N] [--quick] [--grid] [--only
    PEER ...]

Everything runs in one session, the codes in turn; a peer that is not installed, or that fails, is
reported as such.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

from against import beside_commit
from auto import beside_auto
from machine import about
from pages import beside_pages
from peers import MODULES, PROTOTYPE, Peer, firsts, load_peers
from plot import draw
from report import report
from siconos import beside_siconos
from structures import beside_structures
from tasks.derivatives import derivative_cost
from tasks.fitting import fits
from tasks.one_motion import one_motion
from tasks.process import run_child
from tasks.smoothed import paper_way
from tasks.startup import startup
from tasks.throughput import extrapolated, throughput
from tasks.work_precision import work_precision
from tasks.zeno import zeno

from saltus.files import write_bytes, write_text

RESULTS = Path(__file__).parent / "results"
# not tracked: a quick look changes no published figure
QUICK = Path(__file__).parent.parent / "results" / "benchmarks"
GRID = ("1000", "100", "1e-8")


def measure(peers: list[Peer], rounds: int, quick: bool) -> dict[str, Any]:
    """Every task, each with a line that says how long it took."""
    tasks = {
        "work": lambda: work_precision(peers, rounds, quick),
        **(
            {"one_motion": lambda: one_motion(rounds)}
            if any(p.module == "heyoka_scalar" for p in peers)
            else {}
        ),
        "throughput": lambda: throughput(peers, min(rounds, 3), quick),
        "derivatives": lambda: derivative_cost(peers, rounds),
        "fits": lambda: fits(rounds),
        "startup": lambda: startup(
            [p for p in peers if not quick or p.module != "saltus_scalar"],
            1 if quick else min(rounds, 3),
        ),
        "paper_way": lambda: paper_way(1 if quick else 2, quick),
        "zeno": lambda: zeno(peers),
    }
    results: dict[str, Any] = {}
    for name, task in tasks.items():
        start = time.perf_counter()
        results[name] = task()
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)
    results["throughput"] += extrapolated(peers, results["work"])
    return results


def options() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rounds",
        type=int,
        default=None,
        help="rounds over which medians are taken (9, with --quick 3)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help=(
            "one method a package, and fewer motions, tolerances and rounds: about two minutes "
            "on two quiet cores"
        ),
    )
    parser.add_argument(
        "--grid", action="store_true", help="also a 1000 x 1000 grid of states over 100 periods"
    )
    parser.add_argument(
        "--only", nargs="+", choices=MODULES, default=MODULES, help="these peers alone"
    )
    parser.add_argument(
        "--against",
        default="",
        metavar="COMMIT",
        help="instead this tree beside that one, in turn (against.py)",
    )
    parser.add_argument(
        "--prototype", default="", help="a folder with nb_lanes.py, to be measured beside the lanes"
    )
    return parser.parse_args()


def main() -> None:
    """Measure, write, print."""
    chosen = options()
    if chosen.against:
        beside_commit(chosen.against, chosen.rounds or 15)
        return
    os.environ[PROTOTYPE] = chosen.prototype
    rounds = chosen.rounds or (3 if chosen.quick else 9)
    peers, absent = load_peers(tuple(chosen.only))
    if chosen.quick:
        peers = firsts(peers)
    packages = ("saltus", "numpy", *(package for peer in peers for package in peer.packages))
    head = about(packages, rounds=rounds, **({"quick": "yes"} if chosen.quick else {}))
    results = {
        "about": head,
        "peers": [{"name": p.name, "about": p.about} for p in peers],
        "absent": absent,
    }
    results |= measure(peers, rounds, chosen.quick)
    if chosen.grid:
        results["grid"] = run_child("grid", *GRID, limit=3600.0)
    folder = QUICK if chosen.quick else RESULTS
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "benchmarks.json", json.dumps(results, indent=1) + "\n")
    write_bytes(folder / "benchmarks.png", draw(results))
    print(write_text(folder / "benchmarks.md", report(results)).read_text())
    if set(chosen.only) == set(MODULES):  # what is in files of its own
        beside_auto(head, chosen.quick, folder)
        beside_siconos(head, chosen.quick, folder)
        beside_structures(head, chosen.quick, folder)
        beside_pages(head, chosen.quick, folder)


if __name__ == "__main__":  # worker processes import this file
    main()
