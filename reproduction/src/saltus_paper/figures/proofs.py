"""What is proved of section 6 by interval arithmetic: the folds of Fig. 9, its detached loops, and
stable motions beside rest below the critical load.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

import saltus
from saltus.bounds import rounded_ball
from saltus.orbits import SpecialKind
from saltus.theory import critical_horizontal
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import dataset, joined
from saltus_paper.figures.fig09 import AMPLITUDES, FREQUENCY_RANGE
from saltus_paper.figures.figure import paper_figure
from saltus_paper.figures.harmonic_loads import AMPLITUDE, BETA0, FREQUENCY, VERTICAL, under_force
from saltus_paper.panel_work import Panels

# Omega, theta and theta' at which the main branch of a panel is begun.
MAIN = {"d": (0.1, -0.0373, 0.312)}
ELSEWHERE = (1.0, 0.3, 0.0)
# Panel of Fig. 9, forcing periods, Omega, theta and theta' at phase 0 beside a stable orbit of each
# detached loop, as the searches of Fig. 9 find them.
LOOPS = (
    ("b", 3, 2.5477, 2.2161, -0.2017),
    ("c", 3, 2.1324, -1.0398, -1.0299),
    ("d", 2, 1.3809, 0.4917, 0.2225),
    ("d", 3, 1.0466, 1.0473, -1.5048),
    ("d", 3, 0.8558, 0.2338, -1.8344),
    ("e", 2, 1.2120, -0.9946, -2.3128),
    ("e", 3, 0.6923, -0.3920, -2.0922),
    ("f", 2, 1.0569, 3.3569, -1.8642),
    ("f", 3, 0.4735, -0.8469, -2.1001),
    ("f", 3, 0.5241, -0.9577, 0.1168),
    ("f", 4, 3.5758, -2.2691, -1.1997),
    ("f", 5, 1.3139, 3.8968, -1.3423),
    ("f", 5, 3.1991, 0.6713, -0.6672),
)
LOOP_RANGE = (0.1, 100.0)  # Omega: every loop closes within it
# Hhat below the critical load at which a stable motion beside rest is proved, for each Omega.
LOADS = {0.5: (0.083, 0.085, 0.088), 1.0: (0.03, 0.05, 0.07, 0.088)}


def panels(
    amplitudes: Mapping[str, float] = AMPLITUDES,
    loops: tuple[tuple[str, int, float, float, float], ...] = LOOPS,
    loads: Mapping[float, tuple[float, ...]] = LOADS,
) -> Panels:
    """The folds of the main branches of Fig. 9, the loops, and the motions below the critical load."""
    return {
        **{f"folds_{name}": partial(_main_folds, name, load) for name, load in amplitudes.items()},
        **{f"loop_{i}": partial(_loop, *loop) for i, loop in enumerate(loops)},
        **{
            f"anticipated_{i}": partial(_anticipated, frequency, values)
            for i, (frequency, values) in enumerate(loads.items())
        },
    }


def join(made: Mapping[str, Any]) -> Any:
    """All theorems, with the numbers that they enclose."""
    return joined(made, what="theorems about the orbits of section 6")


def _main_folds(name: str, load: float) -> Any:
    """The folds of the main branch of a panel of Fig. 9."""
    frequency, theta, velocity = MAIN.get(name, ELSEWHERE)
    orbit = saltus.find_orbit(under_force(frequency, load), theta=theta, velocity=velocity)
    branch = saltus.continue_orbit(orbit, FREQUENCY, FREQUENCY_RANGE)
    return _theorems({"folds": _of_folds(branch)}, load=load)


def _loop(name: str, period: int, frequency: float, theta: float, velocity: float) -> Any:
    """A stable orbit of a detached loop, and the folds of the loop."""
    load = AMPLITUDES[name]
    orbit = saltus.find_orbit(
        under_force(frequency, load), theta=theta, velocity=velocity, period=period
    )
    branch = saltus.continue_orbit(orbit, FREQUENCY, LOOP_RANGE)
    return _theorems(
        {"orbits": [saltus.prove(orbit)], "folds": _of_folds(branch)},
        load=load,
        period=orbit.period,
        frequency=frequency,
        closed=int(branch.closed),
    )


def _anticipated(frequency: float, loads: tuple[float, ...]) -> Any:
    """Orbits beside rest at loads below the critical one, and the fold at which they are born."""
    orbit = saltus.find_orbit(under_force(frequency, 1.0), theta=0.3)
    proofs = []
    for load in loads:
        branch = saltus.continue_orbit(orbit, AMPLITUDE, (load, 1.0))
        lowest = min(branch.points, key=lambda point: abs(point.orbit.system.get(AMPLITUDE) - load))
        proofs.append(saltus.prove(lowest.orbit))
    born = saltus.continue_orbit(orbit, AMPLITUDE, (0.01, 1.0))
    folds = [point for point in born.special if point.kind == SpecialKind.LP]
    lowest_fold = min(folds, key=lambda point: point.parameter)
    return _theorems(
        {"orbits": proofs, "folds": [saltus.prove(lowest_fold)]},
        frequency=frequency,
        loads=list(loads),
    )


def _of_folds(branch: saltus.Branch) -> list[Any]:
    return [saltus.prove(point) for point in branch.special if point.kind == SpecialKind.LP]


def _theorems(groups: Mapping[str, list[Any]], **attributes: Any) -> Any:
    """The proofs as tables: whether they are proved, what they enclose, and in words."""
    import xarray as xr

    tables = {}
    for name, proofs in groups.items():
        columns = {
            "proved": ("theorem", np.array([bool(p.proved) for p in proofs], dtype=np.int8)),
            "statement": ("theorem", np.array([p.statement for p in proofs], dtype=str)),
        }
        if name == "folds":
            values = np.array([p.parameter for p in proofs]).reshape(-1, 2)
            columns["parameter"] = ("theorem", values[:, 0])
            columns["radius"] = ("theorem", values[:, 1])
        else:
            stable = np.array([p.stable is True for p in proofs], dtype=np.int8)
            columns["stable"] = ("theorem", stable)
        tables[name] = dataset(columns, what=f"theorems about {name}")
    tree = xr.DataTree.from_dict(tables)
    tree.attrs = attributes
    return tree


def table(data: Any) -> str:
    """All theorems in Markdown."""
    lines = ["# What is proved of section 6", ""]
    for panel in data.children.values():
        for group in panel.children.values():
            lines += [f"* {statement}" for statement in group["statement"].values]
    return "\n".join([*lines, ""])


def measure(data: Any) -> dict[str, Measured | None]:
    """The claims: every theorem of a kind is proved."""
    kinds = {kind: _panels_of(data, kind) for kind in ("folds", "loop", "anticipated")}
    return {
        "proofs-folds": _folds(kinds["folds"]) if kinds["folds"] else None,
        "proofs-loops": _loops(kinds["loop"]) if kinds["loop"] else None,
        "proofs-anticipated": _below(kinds["anticipated"]) if kinds["anticipated"] else None,
    }


def _panels_of(data: Any, kind: str) -> list[Any]:
    return [tree for name, tree in data.children.items() if name.split("_")[0] == kind]


def _folds(trees: list[Any]) -> Measured:
    proved = np.concatenate([tree["folds"]["proved"].values for tree in trees])
    radii = np.concatenate([tree["folds"]["radius"].values for tree in trees])
    return measured(
        bool(proved.all()) and proved.size > 0,
        count=int(proved.sum()),
        tried=proved.size,
        widest=float(radii.max(initial=0.0)),
        panels=[
            {"load": tree.attrs["load"], "places": _places(tree)}
            for tree in trees
            if tree["folds"].sizes["theorem"]
        ],
    )


def _loops(trees: list[Any]) -> Measured:
    good = [
        bool(tree["orbits"]["proved"].values.all())
        and bool(tree["orbits"]["stable"].values.all())
        and bool(tree["folds"]["proved"].values.all())
        and bool(tree.attrs["closed"])
        for tree in trees
    ]
    return measured(
        all(good),
        count=sum(good),
        tried=len(trees),
        panels=[
            {
                **{name: tree.attrs[name] for name in ("load", "period", "frequency")},
                "places": _places(tree),
            }
            for tree in trees
        ],
    )


def _below(trees: list[Any]) -> Measured:
    critical = float(critical_horizontal(math.radians(BETA0), VERTICAL))
    # The closed form in doubles is right to some units of its last digit.
    below = critical * (1.0 - 1e-12)
    good = []
    for tree in trees:
        fold = tree["folds"]
        orbits = tree["orbits"]
        all_proved = all(bool(group["proved"].values.all()) for group in (fold, orbits))
        born = float((fold["parameter"] + fold["radius"]).max())
        # netCDF reads a list of one number as the number.
        loads_below = float(np.max(tree.attrs["loads"])) < below
        good.append(
            all_proved and bool(orbits["stable"].values.all()) and loads_below and born < below
        )
    return measured(
        all(good),
        critical=critical,
        panels=[
            {
                "frequency": tree.attrs["frequency"],
                "loads": [{"load": load} for load in np.atleast_1d(tree.attrs["loads"])],
                "places": _places(tree),
            }
            for tree in trees
        ],
    )


def _places(tree: Any) -> list[dict[str, str]]:
    """The enclosed parameters of folds, rounded outward."""
    folds = tree["folds"]
    pairs = zip(folds["parameter"].values, folds["radius"].values, strict=True)
    return [{"place": rounded_ball(float(m), float(r))} for m, r in sorted(pairs)]


FIGURE = paper_figure(
    "proofs",
    quick={"amplitudes": {"c": 1.0}, "loops": LOOPS[:1], "loads": {1.0: (0.05,)}},
    panels=panels,
    join=join,
    measure=measure,
    table=table,
)
