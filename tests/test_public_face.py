"""The public face: every number of every public function, class and method, with values that have
no meaning.

What is public is read from `saltus.__all__`, from `saltus.theory`, and from what is marked as
answering in the other rooms; of a new name the first test asks for arguments that fit. A value is
refused by a sentence of at most 400 characters, or it is meant; an object of a senseless type may
end in Python's own TypeError, and is not tried.
"""

import importlib
import inspect
import math
import os
import random
import time

import numpy as np
import pytest
import sympy
import xarray

import saltus
from saltus import orbits, studies, sweep
from saltus.errors import ParameterError, SaltusError
from saltus.result import Result

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.3), vertical=-0.5),
)
UNFORCED = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(vertical=-0.5))
LINEAR = saltus.System(
    model=saltus.Metainterface(beta0=math.pi / 2), load=saltus.Load(vertical=-0.5)
)
WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1),
    load=saltus.Load(frequency=2.6, force=saltus.Harmonic(1.0)),
    impact=saltus.VelocityReduction(0.8),
)
CELL = saltus.UnitCell(alpha0=0.3, beta0=1.4)
BODY = saltus.PhysicalBlock(half_width=0.2, half_height=1.0)
BLOCK = saltus.System(
    model=saltus.RockingBlock(alpha=0.2),
    load=saltus.Load(
        ground_horizontal=saltus.HalfSine(amplitude=0.5, frequency=2.0, quantity="acceleration")
    ),
)
X, V = sympy.symbols("x v")
SI = saltus.PhysicalCell(length=0.1, upper_mass=1.0, upper_stiffness=2.0)
ROOMS = ("attractors", "flow", "orbits", "studies", "sweep", "systems", "theory")
# Formulas, which are called with numbers, arrays and the symbols of the tracer alike and check
# nothing; and how orbits are made.
FORMULAS = (
    saltus.Model,
    saltus.Harmonic,
    saltus.Record,
    saltus.systems.Transient,
    saltus.systems.Repeating,
    saltus.Contact,
    saltus.systems.ImpactLaw,
)
MADE_INSIDE = (
    "PeriodicOrbit.known",
    "PeriodicOrbit.near",
    "ParameterError.inside",
    # what tracing and starts ask a part of a model (`flow/contacts/parts.py`)
    "Surface.guard",
    "Surface.marks",
    "Relay.guard",
    "Relay.marks",
    "Relay.start_side",
)

# What is tried, by what stands in the annotation: numbers, or as many numbers as a list has.
# Of processor time: what hangs. A film, the longest of these answers, takes ten on a slow machine.
MOST_SECONDS = 60.0
NUMBERS = (-1, 0, 0.5, 80.0, math.nan, math.inf, -math.inf, 1e300, 10**30, 10**400, np.ma.masked)
# complex numbers lost their imaginary parts, and masked ones counted
NO_REALS = (np.array([1.0, 2j]), np.ma.masked_array([1.0, 2.0], mask=[False, True]))
ARRAYS = ([], [math.nan], [math.inf, 1.0], [1e300], [2.0, 1.0], np.array([]), np.zeros((2, 3)))
TEXTS = ("", "x", "load.vertcal", "x" * 100_000)


class Computed(BaseException):
    """The checks are over, and something would be computed."""


@pytest.fixture(scope="module")
def made():
    """What public functions take and only others give."""
    motion, orbit = (
        saltus.simulate(SYSTEM, theta=0.3, periods=2),
        saltus.find_orbit(SYSTEM, theta=0.1),
    )
    branch = saltus.continue_orbit(
        saltus.find_orbit(SYSTEM, theta=0.1), "load.frequency", (0.8, 1.2)
    )
    fold = next(s for s in branch.special if s.kind == orbits.SpecialKind.LP)
    curve = saltus.continue_special(
        fold, "load.vertical", (-0.51, -0.49), first_bounds=(0.8, 1.2), most_points=10
    )
    chart = saltus.stability_chart(
        SYSTEM, horizontal=[0.1, 0.2], vertical=[-0.5, -0.4], starts=2, periods=60
    )
    many = saltus.simulate_many(SYSTEM, theta=[0.1, 0.3], periods=4, last=3)
    branch.to_xarray()  # computes defects, which are then kept
    record = saltus.Measurement(
        start={"theta": 0.3}, time=[0.5, 1.0], values={"theta": [0.3, 0.2]}, sigma=0.1
    )
    found = saltus.fit(SYSTEM, record, {"model.damping": (0.0, 1.0)}, starts=1)
    explorer = saltus.explore(SYSTEM, theta=0.3)
    more = {
        "explorer": explorer,
        "record": record,
        "fit": found,
        "sensitivities": saltus.sensitivities(SYSTEM, theta=0.3, periods=1),
    }
    return more | {
        "motion": motion,
        "orbit": orbit,
        "branch": branch,
        "fold": fold,
        "curve": curve,
        "chart": chart,
        "many": many,
    }


def good(made):
    """What is called, by its name, with arguments that fit."""
    orbit, branch, fold, curve, chart = (
        made[name] for name in ("orbit", "branch", "fold", "curve", "chart")
    )
    plan = sweep.Plan(
        function="test_public_face:squares",
        axes={"x": np.arange(2.0)},
        variables={"y": sweep.Variable()},
    )
    along = {"system": SYSTEM, "path": "load.frequency"}
    one = {"system": SYSTEM, "theta": 0.3}
    angles = {"beta0": 1.4, "vertical": -0.5}
    model, contact = saltus.Metainterface, {"name": "stop", "coordinate": "x"}
    saddle = next(o for o in branch.orbits if abs(o.multipliers[0]) > 1.01)
    cell_data = {"length": 0.1, "upper_mass": 1.0, "upper_stiffness": 2.0}
    labels = np.repeat([np.arange(64) > 31], 64, axis=0).astype(int)
    functions = {
        "saltus.attractors_along": {**along, "values": [1.0, 1.1]},
        "saltus.basin_integrity": {
            "basins": xarray.Dataset(
                {
                    "label": (("y", "x"), [[1, 1], [2, 2]]),
                    "section_x": (("attractor", "state"), [[0.0], [1.0]]),
                }
                | {"section_y": (("attractor", "state"), [[0.0], [1.0]])},
                {"x": [0.0, 1.0], "y": [0.0, 1.0], "attractor": [1, 2]},
                {"plane": ["x", "y"]},
            )
        },
        "saltus.basins_of_attraction": {
            "system": SYSTEM,
            "theta": [0.0, 1.0],
            "velocity": [0.0, 1.0],
        },
        "saltus.bifurcation_diagram": {"system": SYSTEM},
        "saltus.capture_speed": {"system": SYSTEM},
        "saltus.chaotic_bands": {**along, "bounds": (0.9, 1.1)},
        "saltus.classify": one,
        "saltus.continue_orbit": {"orbit": orbit, "path": "load.frequency", "bounds": (0.9, 1.1)},
        "saltus.continue_special": {
            "special": fold,
            "path": "load.vertical",
            "bounds": (-0.6, -0.4),
        },
        "saltus.doubling_cascade": {"first": fold, "bounds": (0.8, 1.1)},
        "saltus.energies": {"of": made["motion"]},
        "saltus.explore": one,
        "saltus.excludes_tori": {"system": SYSTEM},
        "saltus.find_attractors": {"system": SYSTEM},
        "saltus.page": {"system": SYSTEM, "theta": 0.3},
        "saltus.fit": {
            "system": SYSTEM,
            "data": saltus.Measurement(
                start={"theta": 0.3}, time=[0.5, 1.0], values={"theta": [0.3, 0.2]}
            ),
            "parameters": {"model.damping": (0.0, 1.0)},
        },
        "saltus.frequency_sweep": {"system": SYSTEM, "values": [1.0, 1.1], "theta": 0.3},
        "saltus.find_orbit": one,
        "saltus.load": {"path": "/nowhere/result.nc"},
        "saltus.to_mat": {"path": "motion", "result": made["motion"]},
        "saltus.to_csv": {"path": "motion.csv", "result": made["motion"]},
        "saltus.to_pandas": {"result": made["motion"]},
        "saltus.animate": {
            "result": made["motion"],
            "path": "film.gif",
            "seconds": 0.1,
            "fps": 0.1,
        },
        "saltus.fragility": {"systems": [BLOCK], "scales": [1.0, 2.0]},
        "saltus.overturning_spectrum": {
            "system": BLOCK,
            "amplitude": [0.3, 0.5],
            "frequency": [1.0, 2.0],
        },
        "saltus.show_progress": {"fraction": 0.5, "what": "motions"},
        "saltus.load_study": {"path": "/nowhere/study.toml"},
        "saltus.lyapunov_many": one,
        "saltus.lyapunov_spectrum": one,
        "saltus.map_over": {"function": double, "grid": {"x": [1.0]}},
        "saltus.mean_dissipated_power": {"of": made["motion"]},
        "saltus.transmissibility": {"of": made["motion"], "channel": "horizontal"},
        "saltus.plot": {"result": made["motion"]},
        "saltus.phase_portrait": {"system": UNFORCED},
        "saltus.register": {"cls": saltus.Metainterface},
        "saltus.prove": {"result": orbit},
        "saltus.response_spectrum": {"system": SYSTEM},
        "saltus.search_orbits": {**along, "values": [1.0]},
        "saltus.sensitivities": {**one, "periods": 1},
        "saltus.separatrices": {"system": UNFORCED},
        "saltus.simulate": {**one, "periods": 1},
        "saltus.simulate_many": {**one, "periods": 1},
        "saltus.stability_chart": {"system": SYSTEM},
        "saltus.stable_manifold": {"orbit": saddle},
        "saltus.switch_branch": {"special": fold, "bounds": (0.8, 1.1)},
        "saltus.zero_one_test": {"series": np.sin(np.arange(300.0))},
        "saltus.branch_of": {"diagram": xarray.DataTree(), "number": 0},
        "saltus.branches_of": {"diagram": xarray.DataTree()},
        "saltus.save": {"path": "motion", "result": made["motion"]},
        "attractors.basin_entropy": {"labels": labels},
        "attractors.uncertainty_exponent": {"labels": labels},
        "attractors.unstable_manifold": {"orbit": saddle},
        "attractors.wada": {"labels": labels},
        "flow.load_releases": {"system": SYSTEM},
        "saltus.stop_names": {"dataset": made["many"]},
        "flow.stroboscopic": {"system": SYSTEM, "dataset": made["many"]},
        "saltus.backbone": {"system": UNFORCED, "amplitudes": [0.1, 0.2]},
        "saltus.free_orbit": {"system": UNFORCED, "amplitude": 0.1},
        "orbits.defects": {"orbits": [orbit]},
        "orbits.is_symmetric": {"system": SYSTEM},
        "orbits.orbits_of": {"dataset": branch.to_xarray()},
        "studies.bordered_chart": {"system": SYSTEM},
        "studies.prove_orbit_of": {**one},
        "studies.disagreements": {"chart": chart, "borders": studies.Borders()},
        "studies.with_borders": {"system": SYSTEM, "chart": chart},
        "studies.wrong_cells": {"system": SYSTEM, "chart": chart},
        "sweep.open_store": {"path": "/nowhere/store"},
        "sweep.remove_store": {"path": "/nowhere/store"},
        "sweep.run": {"plan": plan},
        "sweep.status": {"path": "/nowhere/store"},
        "saltus.energy_gain": {
            "model": saltus.TwoLayer(beta0=1.4, mass_ratio=0.5),
            "impact": saltus.NewtonImpact(1.0),
        },
        "theory.amplitude_limits": {"system": SYSTEM},
        "theory.critical_horizontal": angles,
        "theory.decayed_amplitude": {"cycle": 2, "theta0": 0.3, "e": 0.9},
        "theory.decayed_period": {"cycle": 2, "period": 5.0, "e": 0.9},
        "theory.divergence": {"system": LINEAR},
        "theory.energy_factor": {"system": SYSTEM, "velocity": 0.3, "side": 1, "e": 0.9},
        "theory.energy_jump": {"system": SYSTEM, "velocity": 0.3, "side": 1, "e": 0.9},
        "theory.equilibria": {"system": UNFORCED},
        "theory.equivalent_angle": {"beta0": 1.4, "ground_amplitude": 0.1},
        "theory.final_time": {"period": 5.0, "e": 0.9},
        "theory.fold_curve": {"beta0": 1.4, "opening": 0.1},
        "theory.fold_horizontal": {"beta0": 1.4, "vertical": -1.2},
        "theory.high_frequency_onset": {"frequency": 3.0, "damping": 0.1, **angles},
        "theory.housner_restitution": {"alpha": 0.3},
        "theory.inelastic_contact": {"beta0": 1.4, "mass_ratio": 0.1, "side": 1},
        "theory.is_monostable": {"horizontal": 0.1, **angles},
        "theory.layers": {"system": UNFORCED},
        "theory.linear_equilibria": {"system": UNFORCED},
        "theory.linear_motion": {"system": UNFORCED, "theta0": 0.1, "impacts": 3},
        "theory.linear_period": {"theta0": 0.1, **angles},
        "theory.open_layer": {"system": UNFORCED, "side": 1},
        "theory.peaks": {"system": UNFORCED, "theta0": 0.1},
        "theory.pendulum_acceleration": {
            "system": LINEAR,
            "tau": 0.0,
            "theta": 0.1,
            "velocity": 0.0,
        },
        "theory.potential_energy": {"system": UNFORCED, "theta": 0.1},
        "theory.potential_slope": {"system": UNFORCED, "theta": 0.1},
        "theory.quasi_static_border": {
            "system": SYSTEM,
            "plane": ("load.horizontal.amplitude", "load.vertical"),
            "lowest": -1.0,
        },
        "theory.reciprocal": {"system": UNFORCED, "theta0": 0.1},
        "theory.rocking_energy_decreases": {"velocity": 0.1, "alpha": 0.3, "e": 0.9},
        "theory.rocking_energy_jump": {"velocity": 0.1, "alpha": 0.3, "e": 0.9},
        "theory.rocking_period": {"theta0": 0.1, "alpha": 0.3},
        "theory.short_period": {"theta0": 0.1, **angles},
        "theory.short_rocking_period": {"theta0": 0.1, "alpha": 0.3},
        "theory.slender_rocking_period": {"theta0": 0.1, "alpha": 0.3},
        "theory.static_angle": {"horizontal": 0.1, **angles},
        "theory.subcritical_vertical": {"beta0": 1.4},
        "theory.total_energy": {"system": UNFORCED, "theta": 0.1, "velocity": 0.1},
        "theory.undeformed_stability": {"system": UNFORCED},
        "theory.unloaded_fold": {"beta0": 1.4},
        "theory.unloaded_half_periods": {"stiffness_ratio": 1.0},
        "theory.unloaded_peak_ratio": {"stiffness_ratio": 1.0},
        "theory.unloaded_period": {"stiffness_ratio": 1.0},
        "theory.upright_period": {"theta0": 0.1, "beta0": 1.5, "vertical": -0.5},
        "theory.velocity_factor": {"system": SYSTEM, "velocity": 0.3, "side": 1, "r": 0.9},
        "theory.vibrations": {"system": UNFORCED},
        "theory.wall_orbits": {"system": WALL},
    }
    asked = {
        name: (getattr(importlib.import_module(_room(name)), name.partition(".")[2]), kw)
        for name, kw in functions.items()
    }
    return asked | {
        "BeltOscillator": (saltus.BeltOscillator, {}),
        "Branch.at": (branch.at, {"value": 1.0}),
        "Branch.is_joined": (branch.is_joined, {"before": 0}),
        "Branch.solved_at": (branch.solved_at, {"value": 1.0}),
        "Branch.solved_between": (branch.solved_between, {"before": 0, "value": 0.81}),
        "Explorer.add": (made["explorer"].add, {"result": branch}),
        "Chirp": (
            saltus.Chirp,
            {"amplitude": 0.1, "frequency": 1.0, "end_frequency": 2.0, "duration": 3.0},
        ),
        "Contact": (saltus.Contact, contact),
        "EnergyRestitution": (saltus.EnergyRestitution, {"r": 0.9}),
        "Structure": (
            saltus.Structure,
            {"mass": [[2.0]], "stiffness": [[1.0]], "forces": {"drive": 0}},
        ),
        "Surface": (saltus.Surface, {"name": "stop", "coordinate": "x"}),
        "Surface.side": (saltus.Surface(name="stop", coordinate="x").side, {"position": 0.5}),
        "Relay": (saltus.Relay, {"name": "heater", "on": "too_cold", "off": "too_warm"}),
        "SwitchedForce": (
            saltus.SwitchedForce,
            {"name": "damper", "coordinate": "x", "surface": "valve"},
        ),
        "SwitchedForce.factor": (
            saltus.SwitchedForce(name="damper", coordinate="x", surface="valve").factor,
            {"s": 1.0},
        ),
        "Friction": (saltus.Friction, {"name": "belt", "coordinate": "x", "kinetic": 0.2}),
        "Friction.coefficient": (
            saltus.Friction(name="belt", coordinate="x", kinetic=0.2).coefficient,
            {"speed": 0.1},
        ),
        "Friction.slipping": (
            saltus.Friction(name="belt", coordinate="x", kinetic=0.2).slipping,
            {"velocity": 0.1, "direction": 1},
        ),
        "PoissonImpact": (saltus.PoissonImpact, {}),
        "HalfSine": (saltus.HalfSine, {"amplitude": 0.1, "frequency": 1.0}),
        "Harmonic": (saltus.Harmonic, {"amplitude": 0.1}),
        "Load": (saltus.Load, {"frequency": 1.0, "horizontal": 0.1}),
        "ImpactPair": (saltus.ImpactPair, {}),
        "MavroeidisPapageorgiou": (
            saltus.MavroeidisPapageorgiou,
            {"amplitude": 0.1, "frequency": 1.0, "gamma": 2.0},
        ),
        "Fit.log_likelihood": (made["fit"].log_likelihood, {"values": [0.1]}),
        "Measurement": (
            saltus.Measurement,
            {"start": {"theta": 0.3}, "time": [0.5, 1.0], "values": {"theta": [0.3, 0.2]}},
        ),
        "Measurement.sigma_of": (made["record"].sigma_of, {"quantity": "theta"}),
        "Metainterface": (model, {"beta0": 1.4}),
        "Motion.at": (made["motion"].at, {"times": 1.0}),
        "Motion.extrema_between": (made["motion"].extrema_between, {"times": [0.0, 1.0]}),
        "Motion.samples": (made["motion"].samples, {"count": 10}),
        "Motion.to_pandas": (made["motion"].to_pandas, {}),
        "Motion.to_xarray": (made["motion"].to_xarray, {}),
        "NewtonImpact": (saltus.NewtonImpact, {}),
        "Motion.closed_at": (made["motion"].closed_at, {"time": 1.0}),
        "OneCosine": (saltus.OneCosine, {"amplitude": 0.1, "frequency": 1.0}),
        "OneSine": (saltus.OneSine, {"amplitude": 0.1, "frequency": 1.0}),
        "PeriodicOrbit.defect_after": (orbit.defect_after, {"rounds": 1}),
        "PeriodicOrbit.motion": (orbit.motion, {}),
        "PeriodicOrbit.quantity": (orbit.quantity, {}),
        "Branch.quantity": (branch.quantity, {}),
        "Branch.to_xarray": (branch.to_xarray, {}),
        "Motion.range_of": (made["motion"].range_of, {"displacement": "theta"}),
        "Branch.to_csv": (branch.to_csv, {"path": "branch.csv"}),
        "PhysicalBlock": (saltus.PhysicalBlock, {"half_width": 0.2, "half_height": 1.0}),
        "PhysicalBlock.load": (BODY.load, {"si": BLOCK.load}),
        "PhysicalBlock.load_in_si": (BODY.load_in_si, {"load": BLOCK.load}),
        "PhysicalBlock.system": (BODY.system, {"si": BLOCK.load}),
        "PhysicalCell": (saltus.PhysicalCell, cell_data),
        "PhysicalCell.from_model": (
            saltus.PhysicalCell.from_model,
            {"model": SYSTEM.model, **cell_data},
        ),
        "PhysicalCell.load": (SI.load, {"si": SYSTEM.load}),
        "PhysicalCell.load_in_si": (SI.load_in_si, {"load": SYSTEM.load}),
        "PhysicalCell.metainterface": (SI.metainterface, {"beta0": 1.4}),
        "PhysicalCell.two_layer": (SI.two_layer, {"beta0": 1.4}),
        "Pulse": (saltus.Pulse, {"amplitude": 0.1, "duration": 1.0}),
        "Sawtooth": (saltus.Sawtooth, {"amplitude": 0.1}),
        "Square": (saltus.Square, {"amplitude": 0.1}),
        "Step": (saltus.Step, {"amplitude": 0.1}),
        "Table": (saltus.Table, {"times": [0.0, 1.0], "values": [0.0, 1.0]}),
        "Triangle": (saltus.Triangle, {"amplitude": 0.1}),
        "Ramp": (saltus.Ramp, {"amplitude": 0.1, "duration": 1.0}),
        "Ricker": (saltus.Ricker, {"amplitude": 0.1, "frequency": 1.0}),
        "Record": (saltus.Record, {"time": [0.0, 1.0], "value": [0.0, 1.0]}),
        "RockingBlock": (saltus.RockingBlock, {"alpha": 0.3}),
        "Sensitivities.at": (made["sensitivities"].at, {"times": 1.0}),
        "SpecialCurve.at": (curve.at, {"path": "load.vertical", "value": -0.5}),
        "System": (
            saltus.System,
            {"model": SYSTEM.model, "load": SYSTEM.load, "impact": SYSTEM.impact},
        ),
        "System.from_dict": (saltus.System.from_dict, {"data": SYSTEM.to_dict()}),
        "System.from_json": (saltus.System.from_json, {"text": SYSTEM.to_json()}),
        "System.from_toml": (saltus.System.from_toml, {"text": SYSTEM.to_toml()}),
        "System.from_gaps": (SYSTEM.from_gaps, {"time": 0.0, "position": [0.3], "velocity": [0.1]}),
        "System.to_gaps": (SYSTEM.to_gaps, {"time": 0.0, "position": [0.3], "velocity": [0.1]}),
        "System.get": (SYSTEM.get, {"path": "load.frequency"}),
        "System.with_": (SYSTEM.with_, {"changes": {"load.frequency": 1.1}}),
        "TwoLayer": (saltus.TwoLayer, {"beta0": 1.4}),
        "TwoStops": (saltus.TwoStops, {}),
        "UnitCell": (saltus.UnitCell, {"alpha0": 0.3, "beta0": 1.4}),
        "CellChain": (saltus.CellChain, {"beta0": 1.4}),
        "saltus.to_jax": (saltus.to_jax, {"system": SYSTEM, "periods": 1}),
        "saltus.to_torch": (saltus.to_torch, {"system": SYSTEM, "periods": 1}),
        "saltus.from_sympy": (
            saltus.from_sympy,
            {"coordinates": [X], "velocities": [V], "force": [-X], "parameters": {}},
        ),
        **{
            f"UnitCell.{name}": (getattr(CELL, name), {"theta": 0.1})
            for name in ("alpha", "beta", "eta", "phi", "small_phi", "xi")
        },
        "UnitCell.alpha_of_phi": (CELL.alpha_of_phi, {"phi": 0.1}),
        "UnitCell.beta_of_phi": (CELL.beta_of_phi, {"phi": 0.1}),
        "UnitCell.layout": (CELL.layout, {}),
        "UnitCell.line_condition": (CELL.line_condition, {}),
        "UnitCell.phi_velocity": (CELL.phi_velocity, {"theta": 0.1, "velocity": 0.1}),
        "UnitCell.theta": (CELL.theta, {"phi": 0.1}),
        "saltus.number_range": (saltus.number_range, {"above": 0.0, "below": 1.0}),
        "VelocityReduction": (saltus.VelocityReduction, {"e": 0.9}),
        "WallOscillator": (saltus.WallOscillator, {}),
    }


def squares(arguments, block):
    """What the sweep computes."""
    return {"y": block["x"] ** 2}


def double(x):
    """What is asked over a grid."""
    return 2 * x


def _room(name):
    room = name.partition(".")[0]
    return room if room == "saltus" else f"saltus.{room}"


def public():
    """The names of all functions that answer, of the classes that a user makes, and of their
    methods with arguments.
    """
    for room in ("saltus", *(f"saltus.{room}" for room in ROOMS)):
        package = importlib.import_module(room)
        for name in package.__all__:
            found = getattr(package, name)
            own = f"{room.removeprefix('saltus.')}.{name}"
            named_above = room != "saltus" and getattr(saltus, name, None) is found
            if (
                inspect.isfunction(found)
                and hasattr(found, "answers")
                and not named_above
                and _arguments(found)
            ):
                yield own
    for cls in (getattr(saltus, name) for name in saltus.__all__):
        if (
            inspect.isclass(cls)
            and cls.__module__.startswith("saltus.")
            and not issubclass(cls, (Exception, str))
        ):
            yield from _of(cls)


def _of(cls):
    if hasattr(cls.__init__, "answers") and _arguments(cls) and not issubclass(cls, Result):
        yield cls.__name__
    for name, method in inspect.getmembers(cls, inspect.isroutine):
        # those of an enumeration of integers are Python's
        own = str(getattr(method, "__module__", "")).startswith("saltus")
        if name.startswith("_") or not callable(method) or not own or not _arguments(method):
            continue
        if not issubclass(cls, FORMULAS):
            yield f"{cls.__name__}.{name}"


def _arguments(function):
    return [p for p in inspect.signature(function).parameters.values() if p.name != "self"]


def test_every_public_name_is_asked(made):
    """A formula of a model is none of them; whatever else there is has arguments here, and
    answers.
    """
    asked = set(good(made))
    # of several classes
    once = {name.partition(".")[2] for name in asked if name.startswith("Branch.")}
    assert {name for name in public() if name.partition(".")[2] not in once or name in asked} - {
        *MADE_INSIDE
    } == asked


def test_arguments_that_fit_are_taken(made, alone):
    for name, (function, fitting) in good(made).items():
        assert answer(function, fitting) is None or name in REFUSED, name


# A study or a store that is nowhere, an empty tree, a fold where only a period doubling begins
# something.
REFUSED = (
    "saltus.branch_of",
    "saltus.doubling_cascade",
    "saltus.switch_branch",
    "saltus.load",
    "saltus.load_study",
)
REFUSED += ("saltus.branches_of", "sweep.open_store", "sweep.status")


@pytest.fixture
def alone(monkeypatch, tmp_path):
    """A folder of one's own, and nothing is computed."""
    from saltus.flow.lanes import ensemble
    from saltus.flow.motion import simulate as simulation
    from saltus.orbits.equations import one_contact
    from saltus.web import study_page

    def begun(*_, **__):
        raise Computed

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulation, "follow", begun)
    monkeypatch.setattr(ensemble, "compile_driver_aside", begun)
    monkeypatch.setattr(one_contact.OneContactEquations, "evaluate", begun)
    monkeypatch.setattr(study_page, "_page", begun)


def answer(function, named):
    """The error with which a call is refused, if it is."""
    try:
        function(**named)
    except SaltusError as error:
        return error
    except Computed:
        pass
    return None


def values_of(parameter):
    """The values that are tried for an argument, by its annotation."""
    if parameter.kind is parameter.VAR_KEYWORD:
        return ()
    kind = str(parameter.annotation).removesuffix(" | None")
    if kind in ("float", "int", "Number", "Iterable[float] | float"):
        return NUMBERS
    if kind == "Numbers":
        return NUMBERS + ARRAYS[:4]
    return (
        ARRAYS
        if kind in ("np.ndarray", "Iterable[float]", "tuple[float, float]")
        else TEXTS * (kind == "str")
    )


@pytest.mark.filterwarnings("ignore")  # of NumPy, where an array of huge numbers is meant
def test_every_argument_answers_every_value(made, alone):
    """Of more than two thousand calls with one value that may be wrong, none raises anything but
    one sentence.
    """
    wrong, tried = [], 0
    for name, (function, fitting) in good(made).items():
        # tests/theory tries its values
        for parameter in () if name.startswith("theory.") else _arguments(function):
            for value in () if parameter.name in ("workers", "scheduler") else values_of(parameter):
                tried += 1
                begun = time.process_time()
                try:
                    refusal = str(answer(function, {**fitting, parameter.name: value}))
                except Exception as error:
                    wrong.append((name, parameter.name, value, repr(error)))
                    continue
                if (
                    len(refusal) > 400
                    or "\n" in refusal
                    or time.process_time() - begun > MOST_SECONDS
                ):
                    wrong.append((name, parameter.name, value, f"is long: {refusal}"))
    assert tried > 2000
    assert not wrong, "\n".join(
        f"{name}({parameter}={value!r:.30}) {what:.200}" for name, parameter, value, what in wrong
    )


class Own:
    """An object that nobody means."""


# of other kinds than an argument may have; 300 of these calls are tried, all in a thorough run
OTHER_KINDS = (
    *(None, True, Own(), Own, b"x", [None], ["a"], {1: 2}, 1j, np.array("a"), np.array([1j])),
    *(np.zeros((2, 3, 4)), {1, 2}, range(3), slice(1, 2), np.datetime64("2020"), xarray.Dataset()),
    *(SYSTEM, SYSTEM.load, SYSTEM.model, "\0", "x" * 5000, np, saltus.Harmonic(1.0), 10**400),
)
# formulas, which compute with whatever they get, and what calls a function of the user's
UNCHECKED = ("Surface.side", "Friction.slipping", "Friction.coefficient", "SwitchedForce.factor")
CALLED = ("workers", "scheduler", "progress", "response", "functions")
KIND_CASES = int(os.environ.get("SALTUS_CASES", "20000"))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "count", [300, pytest.param(KIND_CASES, marks=pytest.mark.thorough)], ids=["few", "many"]
)
def test_every_argument_answers_every_kind(made, alone, count):
    """Python's own errors are for mistakes of saltus, not for those of its users."""
    wrong = []
    asked = good(made)
    calls = [
        (name, parameter, value)
        for name, (function, _) in asked.items()
        for parameter in _arguments(function)
        for value in OTHER_KINDS
        if name not in UNCHECKED
        and parameter.name not in CALLED
        and parameter.kind not in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL)
    ]
    for name, parameter, value in random.Random(count).sample(calls, min(count, len(calls))):
        function, fitting = asked[name]
        begun = time.process_time()
        try:
            refusal = str(answer(function, {**fitting, parameter.name: value}))
        except Exception as error:
            wrong.append(f"{name}({parameter.name}={value!r:.40}) {error!r:.200}")
            continue
        long = len(refusal) > 400 or not refusal.isprintable()
        if long or time.process_time() - begun > MOST_SECONDS:
            wrong.append(f"{name}({parameter.name}={value!r:.40}) is long: {refusal:.200}")
    assert not wrong, "\n".join(wrong)


def test_complex_and_masked_arrays_are_refused_everywhere(made, alone):
    """But by formulas, which compute with whatever they get."""
    taken = []
    formulas = ("theory.", "UnitCell.", "System.", *UNCHECKED)
    for name, (function, fitting) in good(made).items():
        if name.startswith(formulas):
            continue
        for parameter in _arguments(function):
            kind = str(parameter.annotation).removesuffix(" | None")
            lists = ("Numbers", "np.ndarray", "Iterable[float]", "tuple[float, float]")
            for value in NO_REALS if kind in lists else ():
                try:
                    refusal = answer(function, {**fitting, parameter.name: value})
                except Exception as error:
                    refusal = None
                    taken.append(f"{name}({parameter.name}) {error!r:.80}")
                if refusal is None:
                    taken.append(f"{name}({parameter.name})")
    assert not taken, "\n".join(taken)


def test_every_misspelt_argument_is_answered_with_the_near_name(made):
    for name, (function, fitting) in good(made).items():
        method = name[0].isupper() and "." in name  # whose misspelt arguments Python answers
        if method or any(p.kind is p.VAR_KEYWORD for p in _arguments(function)):
            continue
        for parameter in _arguments(function):
            misspelt = parameter.name + "_"
            with pytest.raises(
                ParameterError, match=f"did you mean .*'{parameter.name}'"
            ) as refusal:
                function(**{**fitting, misspelt: 1})
            assert refusal.value.parameter == misspelt, name
