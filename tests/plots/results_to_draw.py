"""One result of each public function that gives one, small, and why the others have no picture."""

from functools import cache

import numpy as np

import saltus
from saltus import attractors, studies, sweep
from saltus.orbits import SpecialKind

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.3), vertical=-0.5),
)
FREE = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(vertical=-0.5))
TRISTABLE = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80)), load=saltus.Load(vertical=-1.5)
)
UNSYMMETRIC = SYSTEM.with_({"load.horizontal.amplitude": 1.6})
CHART = {"horizontal": [0.1, 0.3], "vertical": [-0.5, -0.4], "starts": 2, "periods": 60}
ALONG = {"system": SYSTEM, "path": "load.frequency"}


@cache
def branch():
    return saltus.continue_orbit(saltus.find_orbit(SYSTEM, theta=0.1), "load.frequency", (0.8, 1.2))


@cache
def fold():
    return next(s for s in branch().special if s.kind == SpecialKind.LP)


@cache
def doubling():
    found = saltus.continue_orbit(
        saltus.find_orbit(UNSYMMETRIC, theta=0.3), "load.horizontal.amplitude", (1.55, 1.75)
    )
    return next(s for s in found.special if s.kind == SpecialKind.PD)


def saddle():
    return next(orbit for orbit in branch().at(0.85) if not orbit.stable)


def chart():
    return saltus.stability_chart(SYSTEM, **CHART)


def labels():
    return np.repeat([np.arange(64) > 31], 64, axis=0).astype(int)


def halves(arguments, block):
    """What the sweep computes."""
    return {"y": block["x"] / 2}


def plan():
    variables = {"y": sweep.Variable()}
    return sweep.Plan(
        function="results_to_draw:halves", axes={"x": np.arange(3.0)}, variables=variables
    )


RESULTS = {  # by the function that gives it
    "saltus.attractors_along": lambda: saltus.attractors_along(
        **ALONG, values=[1.0, 1.05], starts=8
    ),
    "saltus.backbone": lambda: saltus.backbone(FREE, [0.1, 0.2]),
    "saltus.basins_of_attraction": lambda: saltus.basins_of_attraction(
        SYSTEM, theta=[-0.5, 0.5], velocity=[-0.5, 0.5]
    ),
    "saltus.bifurcation_diagram": lambda: saltus.bifurcation_diagram(
        SYSTEM, bounds=(0.2, 0.3), max_period=1, values=[0.3], starts=4, bands=False
    ),
    "saltus.branch_of": lambda: saltus.branch_of(spectrum(), 0),
    "saltus.chaotic_bands": lambda: saltus.chaotic_bands(**ALONG, bounds=(0.98, 1.0), count=3),
    "saltus.classify": lambda: saltus.classify(SYSTEM, theta=0.3),
    "saltus.continue_orbit": branch,
    "saltus.continue_special": lambda: saltus.continue_special(
        fold(), "load.vertical", (-0.51, -0.49), first_bounds=(0.8, 1.2), most_points=10
    ),
    "saltus.doubling_cascade": lambda: saltus.doubling_cascade(
        doubling(), (1.6, 1.8), max_period=8
    ),
    "saltus.energies": lambda: saltus.energies(saltus.simulate(SYSTEM, theta=0.3, periods=3)),
    "saltus.find_attractors": lambda: saltus.find_attractors(SYSTEM, starts=8),
    "saltus.find_orbit": lambda: saltus.find_orbit(SYSTEM, theta=0.1),
    "saltus.fit": lambda: saltus.fit(SYSTEM, record(), {"model.damping": (0.0, 1.0)}),
    "saltus.free_orbit": lambda: saltus.free_orbit(FREE, 0.2),
    "saltus.frequency_sweep": lambda: saltus.frequency_sweep(SYSTEM, [0.9, 1.0, 1.1], theta=0.3),
    "saltus.lyapunov_many": lambda: saltus.lyapunov_many(
        SYSTEM, {"load.frequency": [0.9, 1.0]}, theta=0.3, periods=64
    ),
    "saltus.lyapunov_spectrum": lambda: saltus.lyapunov_spectrum(SYSTEM, theta=0.3, periods=64),
    "saltus.map_over": lambda: saltus.map_over(
        lambda x, y: x * y, {"x": [1.0, 2.0], "y": [0.1, 0.2]}
    ),
    "saltus.phase_portrait": lambda: saltus.phase_portrait(
        FREE, starts=[(0.5, 0.0)], duration=5.0, samples=50
    ),
    "saltus.response_spectrum": lambda: spectrum(),
    "saltus.search_orbits": lambda: saltus.search_orbits(
        **ALONG, values=[0.9, 1.0], max_period=1, starts=8
    ),
    "saltus.sensitivities": lambda: saltus.sensitivities(
        SYSTEM, theta=0.3, periods=2, parameters=["load.frequency"]
    ),
    "saltus.separatrices": lambda: saltus.separatrices(
        TRISTABLE, window=((-2.0, 2.0), (-2.0, 2.0))
    ),
    "saltus.simulate": lambda: saltus.simulate(SYSTEM, theta=0.3, periods=3),
    "saltus.simulate_many": lambda: saltus.simulate_many(
        SYSTEM, theta=np.linspace(0.1, 0.3, 5), periods=3
    ),
    "saltus.stability_chart": chart,
    "saltus.stable_manifold": lambda: saltus.stable_manifold(
        saddle(), window=((-1.0, 1.0), (-1.0, 1.0)), periods=5
    ),
    "saltus.switch_branch": lambda: saltus.switch_branch(doubling(), (1.6, 1.8)),
    "saltus.basin_integrity": lambda: saltus.basin_integrity(
        saltus.basins_of_attraction(SYSTEM, theta=[-0.5, 0.5], velocity=[-0.5, 0.5])
    ),
    "attractors.uncertainty_exponent": lambda: attractors.uncertainty_exponent(labels()),
    "attractors.unstable_manifold": lambda: attractors.unstable_manifold(saddle(), periods=5),
    "attractors.wada": lambda: attractors.wada(labels()),
    "studies.bordered_chart": lambda: studies.bordered_chart(SYSTEM, **CHART),
}


def record():
    times = np.linspace(0.0, 5.0, 40)
    return saltus.Measurement(
        start={"theta": 0.3}, time=times, values={"theta": np.cos(times) / 3}, sigma=0.1
    )


@cache
def spectrum():
    return saltus.response_spectrum(
        SYSTEM, bounds=(0.9, 1.1), max_period=1, values=[1.0], starts=4, bands=False
    )


NUMBER, WRITES, STORE = (
    "gives numbers or words",
    "reads, writes or registers",
    "gives what a user's own function computes",
)
WITHOUT = {
    **dict.fromkeys(
        (
            "saltus.capture_speed",
            "saltus.excludes_tori",
            "saltus.mean_dissipated_power",
            "saltus.number_range",
            "saltus.energy_gain",
        ),
        NUMBER,
    ),
    **dict.fromkeys(
        (
            "saltus.transmissibility",
            "saltus.zero_one_test",
            "saltus.stop_names",
            "attractors.basin_entropy",
        ),
        NUMBER,
    ),
    **dict.fromkeys(
        ("flow.load_releases", "flow.stroboscopic", "orbits.defects", "orbits.is_symmetric"), NUMBER
    ),
    "studies.prove_orbit_of": "is drawn in tests/proofs/test_prove_command.py",
    "saltus.prove": "gives a theorem in words, and the enclosures in it",
    "studies.wrong_cells": NUMBER,
    "studies.disagreements": "gives a part of what studies.bordered_chart gives",
    "studies.with_borders": "gives a part of what studies.bordered_chart gives",
    "saltus.branches_of": "gives branches, each as saltus.branch_of does",
    "orbits.orbits_of": "gives orbits, each as saltus.find_orbit does",
    **dict.fromkeys(
        ("saltus.load", "saltus.load_study", "saltus.to_mat", "saltus.plot", "saltus.register"),
        WRITES,
    ),
    **dict.fromkeys(("saltus.to_csv", "saltus.animate", "saltus.page", "saltus.explore"), WRITES),
    "saltus.to_pandas": "gives a table",
    "saltus.from_sympy": "gives a model",
    **dict.fromkeys(("saltus.to_jax", "saltus.to_torch"), "gives a function"),
    **dict.fromkeys(
        ("saltus.overturning_spectrum", "saltus.fragility"),
        "is drawn in tests/studies/test_overturning.py",
    ),
    **dict.fromkeys(
        ("saltus.save", "saltus.show_progress", "sweep.remove_store", "sweep.status"), WRITES
    ),
    **dict.fromkeys(("sweep.open_store", "sweep.run"), STORE),
}
