"""What is public: the one list that the reference shows and that the tests count."""

import importlib
import inspect
from functools import cache

import saltus

# The rooms in the order of the reference, each with its heading. What `saltus` itself names stands
# where it is written.
ROOMS = {
    "systems": "Systems: models, loads, impact laws",
    "flow": "Motions and ensembles",
    "bounds": "Proofs about rest",
    "orbits": "Periodic orbits and branches",
    "continuation": "Curves: why they end, and what was located on them",
    "attractors": "Attractors, verdicts, basins",
    "studies": "Spectra, diagrams, charts, portraits",
    "sweep": "Grids of computations that can be killed",
    "plots": "Pictures",
    "theory": "Closed forms",
    "config": "Studies in files",
    "cli": "Commands of other packages",
    "errors": "Errors",
}
COMPLETE = ("theory",)  # rooms whose every name is for users
# What other rooms give to users beside the functions that answer: the results of these, and what is
# handed to them.
RESULTS = {
    "attractors": (
        *(
            "Attractor",
            "Attractors",
            "BasinEntropy",
            "Equilibrium",
            "Manifold",
            "Separatrix",
            "UncertaintyExponent",
            "Wada",
        ),
        *("ZeroOne", "equilibria", "share_interval"),
    ),
    "cli": ("progress_bar",),
    "config": ("Study",),
    "continuation": ("CurveEnd", "End", "Evidence", "Missed"),
    "flow": (
        "ContactRegularity",
        "Event",
        "Impacts",
        "Release",
        "Validity",
        "available_cores",
        "share_cores",
    ),
    "orbits": ("Cascade", "OrbitEnd", "Search", "Signature", "SpecialKind"),
    "studies": ("Borders",),
    "sweep": ("Failure", "Plan", "StoreStatus", "SweepInterrupted", "Variable"),
    "systems": (
        *(
            "Channel",
            "LayerState",
            "MarginKind",
            "Scenario",
            "name_impact",
            "other_impulse",
            "reversed_system",
            "table_1",
        ),
    ),
}


@cache
def public_names():
    """The full name of each public object, by room: `saltus.simulate`, `saltus.theory.final_time`,
    ...
    """
    named = {room: [] for room in ROOMS}
    for name in saltus.__all__:
        found = getattr(saltus, name)
        if not inspect.ismodule(found):
            home = found.__module__.split(".")[1]
            named[home if home in ROOMS else "studies"].append(f"saltus.{name}")
    for room in ROOMS:
        package = importlib.import_module(f"saltus.{room}")
        for name in getattr(package, "__all__", ()):
            if not hasattr(saltus, name) and (
                room in COMPLETE or name in RESULTS.get(room, ()) or _answers(package, name)
            ):
                named[room].append(f"saltus.{room}.{name}")
    return named


def _answers(package, name):
    found = getattr(package, name)
    """Whether it is a function for users; those that draw are told by `saltus.plot`, which draws
    all.
    """
    return (
        inspect.isfunction(found)
        and hasattr(found, "answers")
        and package.__name__ != "saltus.plots"
    )
