"""What is done with the system of each class of models, each with a check that a wrong result does
not pass: it agrees with a motion, with another verb, or with what is read back.

All work is the smallest that shows it: few periods, starts and points. Motions, orbits and branches
are made once for each class and shared.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_agreement import NODE, in_node
from what_works.model_classes import ModelClass, model_class, system_of

import saltus
from saltus.flow import state_names
from saltus.web.description import page_parts

__all__ = ["NODE", "VERBS", "Tried", "Verb"]
FREQUENCY = "load.frequency"


class Tried:
    """A class of models while its verbs are tried: what they share is made once."""

    def __init__(self, name: str) -> None:
        self.model_class: ModelClass = model_class(name)
        self.system = system_of(name)
        self.start = self.model_class.whole_start
        self.coordinates = self.system.model.coordinates
        self.frequency = self.system.load.frequency
        # of a cycle without a load, about as long as one round
        self.round = self.system.load.period or 2.0 * math.pi
        forced = self.frequency is not None
        self.path = FREQUENCY if forced else self.model_class.parameter
        self.parameter = self.system.parameters[self.path]
        self.observed = self.model_class.observed

    def lasting(self, rounds: float) -> dict[str, Any]:
        """The arguments of a motion over so many forcing periods, or as long without a load."""
        if self.frequency is None:
            return {"duration": rounds * self.round}
        return {"periods": rounds}

    @property
    def largest_exponent(self) -> float:
        """That of the orbit's multipliers; along a cycle it is 0."""
        largest = max([*abs(self.orbit.multipliers), float(self.frequency is None)])
        return math.log(largest) / self.orbit.duration if largest > 0.0 else -math.inf

    @cached_property
    def motion(self) -> saltus.Motion:
        return saltus.simulate(self.system, **self.start, **self.lasting(3))

    @cached_property
    def orbit(self) -> saltus.PeriodicOrbit:
        return saltus.find_orbit(self.system, **self.start)

    @cached_property
    def branch(self) -> saltus.Branch:
        near = (0.99 * self.parameter, 1.01 * self.parameter)
        return saltus.continue_orbit(self.orbit, self.path, near, step=0.5)

    @cached_property
    def attractors(self) -> Any:
        states = 2 * len(self.coordinates) - len(self.system.model.first_order)
        reach = self.model_class.reach
        return saltus.find_attractors(self.system, window=((-reach, reach),) * states, starts=4)

    def value(self, position: Any) -> Any:
        """The observed coordinate of positions, of which one coordinate has no tuple."""
        if len(self.coordinates) == 1:
            return np.asarray(position)
        return np.asarray(position)[self.coordinates.index(self.observed)]


def simulate(tried: Tried, folder: Path) -> None:
    """A motion goes on from its own end as if it had not been stopped."""
    motion = tried.motion
    assert motion.stop == "horizon"
    assert motion.time == 3 * tried.round
    first = saltus.simulate(tried.system, **tried.start, **tried.lasting(3), tol=1e-10)
    np.testing.assert_allclose(first.final_state, motion.final_state, atol=1e-6)
    assert np.all(np.isfinite(motion.final_state))
    assert abs(tried.value(motion.at([0.0])[0])[0] - tried.start[tried.observed]) < 1e-14


def many(tried: Tried, folder: Path) -> None:
    """Motions of an ensemble are those that are followed one by one."""
    ends = saltus.simulate_many(tried.system, **tried.start, **tried.lasting(3))
    assert abs(float(ends[tried.observed]) - tried.value(tried.motion.position)) < 1e-8


def many_extremes(tried: Tried, folder: Path) -> None:
    """The least and the largest value of a motion of an ensemble are those of the motion alone."""
    ends = saltus.simulate_many(
        tried.system, **tried.start, **tried.lasting(3), sample=("extrema",), last="all"
    )
    name = tried.observed if len(tried.coordinates) == 1 else "coordinate"
    extrema = np.asarray(tried.motion.extrema)
    assert abs(float(ends[f"overall_smallest_{name}"]) - extrema.min()) < 1e-8
    assert abs(float(ends[f"overall_largest_{name}"]) - extrema.max()) < 1e-8


def many_exponents(tried: Tried, folder: Path) -> None:
    """The largest exponent of each motion of an ensemble is that of the orbit's multipliers."""
    found = saltus.lyapunov_many(tried.system, **tried.start, periods=64, transient=40)
    assert abs(float(np.ravel(found.exponent)[0]) - tried.largest_exponent) < 0.05


def sensitivities(tried: Tried, folder: Path) -> None:
    """A derivative to a number of the model is the quotient of differences."""
    path = tried.model_class.parameter
    asked = {**tried.start, **tried.lasting(1.4)}
    found = saltus.sensitivities(tried.system, parameters=(path,), **asked)
    value, change = tried.system.parameters[path], 1e-6
    ends = [
        saltus.simulate(tried.system.with_({path: value + way * change}), **asked).final_state
        for way in (-1, 1)
    ]
    slope = (ends[1] - ends[0]) / (2 * change)
    assert abs(slope).max() > 1e-3
    np.testing.assert_allclose(
        found.parameters[:, 0], slope, rtol=1e-4, atol=1e-4 * (1e-3 + abs(slope).max())
    )


def orbit(tried: Tried, folder: Path) -> None:
    """An orbit repeats itself; between its events, as states jump there."""
    found, length = tried.orbit, tried.round
    motion = saltus.simulate(found.system, **found.start(), duration=found.duration + length)
    times = motion.time - np.array([0.37 * length, 0.37 * length + found.duration])
    for part in motion.at(times)[:2]:
        one, other = np.moveaxis(np.asarray(part), -1, 0)
        np.testing.assert_allclose(other, one, atol=1e-7)


def branch(tried: Tried, folder: Path) -> None:
    """A branch goes through the orbit from which it began, and to both of its bounds."""
    points = tried.branch.to_xarray()
    values, amplitudes = points.parameter.values, points.amplitude.values
    assert np.isfinite(amplitudes).all()
    here = np.argmin(abs(values - tried.parameter))
    assert abs(amplitudes[here] - tried.orbit.amplitude) < 1e-8
    assert math.isclose(values.min(), 0.99 * tried.parameter)
    assert math.isclose(values.max(), 1.01 * tried.parameter)


def sweep(tried: Tried, folder: Path) -> None:
    """A sweep has the amplitude of the stable orbit on which the motion settles."""
    values = [tried.parameter, 1.001 * tried.parameter]
    found = saltus.frequency_sweep(
        tried.system, values, path=tried.path, periods=400, **tried.start
    )
    up = found.amplitude.values[0]
    assert np.isfinite(found.amplitude).all()
    assert abs(up[0] - tried.orbit.amplitude) < 1e-5 * tried.orbit.amplitude
    assert abs(up[1] - up[0]) < 0.1 * up[0]


def classify(tried: Tried, folder: Path) -> None:
    """The motion is periodic, with the period of the orbit that is found."""
    verdict = saltus.classify(tried.system, periods=200, transient=50, **tried.start)
    assert str(verdict.kind) == "periodic"
    assert verdict.period == pytest.approx(tried.orbit.period, rel=1e-12)


def attractors(tried: Tried, folder: Path) -> None:
    """Each start ends on one attractor, which is the orbit, or is counted as undecided."""
    found = tried.attractors
    assert sum(attractor.starts for attractor in found) + found.undecided == 4
    sizes = [attractor.amplitude for attractor in found]
    assert min(abs(size - tried.orbit.amplitude) for size in sizes) < 1e-6


def basins(tried: Tried, folder: Path) -> None:
    """The cell of a state on an attractor has its label."""
    first = tried.coordinates[0]
    speed = "velocity" if len(tried.coordinates) == 1 else f"{first}_velocity"
    axes = {first: [0.0, 0.02], speed: [0.0, 0.02]}
    sides = {name: tried.start[name] for name in ("relays",) if name in tried.start}
    found = saltus.basins_of_attraction(
        tried.system, found=tried.attractors, periods=200, **axes, **sides
    )
    labels = found.label.values
    assert labels.shape == (2, 2)
    assert set(np.unique(labels)) <= {-1, *range(len(tried.attractors) + 2)}
    assert (labels >= 0).any()


def spectrum(tried: Tried, folder: Path) -> None:
    """A diagram has the branch that is followed from the orbit."""
    near = (0.99 * tried.parameter, 1.01 * tried.parameter)
    found = saltus.response_spectrum(
        tried.system,
        bounds=near,
        effort="quick",
        values=[tried.parameter],
        max_period=max(tried.orbit.signature.period, 1),
        starts=4,
        window=tried_window(tried),
        bands=False,
        repelling=0,
        switch=False,
    )
    points = found["points"]
    here = np.argmin(abs(points.parameter.values - tried.parameter))
    assert abs(points.amplitude.values[here] - tried.orbit.amplitude) < 1e-2 * tried.orbit.amplitude


def tried_window(tried: Tried) -> Any:
    """The window of a search."""
    states = 2 * len(tried.coordinates) - len(tried.system.model.first_order)
    reach = tried.model_class.reach
    return ((-reach, reach),) * states


def exponents(tried: Tried, folder: Path) -> None:
    """The largest exponent is that of the orbit's largest multiplier."""
    found = saltus.lyapunov_spectrum(
        tried.system, periods=64, transient=40, two_trajectories=False, **tried.start
    )
    expected = tried.largest_exponent
    assert abs(found.values[0] - expected) < 0.05 or found.values[0] == expected


def fit(tried: Tried, folder: Path) -> None:
    """A number is found again from samples of the motion."""
    path = tried.model_class.parameter
    true = tried.system.parameters[path]
    times = np.linspace(0.2, 1.9, 12) * tried.round
    samples = tried.value(tried.motion.at(times)[0])
    start = {name: tried.start[name] for name in tried.coordinates}
    if "velocity" in tried.start:
        rates = np.ravel(tried.start["velocity"])
        start |= zip(state_names(tried.coordinates)[len(start) :], map(float, rates), strict=True)
    record = saltus.Measurement(start=start, time=times, values={tried.observed: samples})
    guess = tried.system.with_({path: 1.01 * true})
    found = saltus.fit(guess, record, {path: (0.9 * true, 1.1 * true)}, starts=1)
    assert abs(found.values[path] - true) < 1e-6 * true


def energies(tried: Tried, folder: Path) -> None:
    """What is supplied is dissipated or stored."""
    balance = saltus.energies(tried.motion, periods=1)
    scale = float(abs(balance.energy).max())
    assert scale > 1e-6
    assert abs(balance.defect) < 1e-9 * max(scale, 1.0)


def page(tried: Tried, folder: Path) -> None:
    """The page's own engine comes to the end of Python's motion."""
    saltus.page(tried.system, path=folder / "page.html", **tried.start)
    wasm, description = page_parts(tried.system)
    speeds = np.ravel(tried.start.get("velocity", 0.0)) * np.ones(len(tried.coordinates))
    start = {name: tried.start[name] for name in tried.coordinates} | {
        f"{name}_velocity": float(speed)
        for name, speed in zip(tried.coordinates, speeds, strict=True)
    }
    asked = {"values": tried.system.parameters, "start": start, "at": [0.5]} | tried.lasting(1)
    ((found,),) = in_node([{"wasm": wasm, "description": description, "motions": [asked]}], folder)
    expected = saltus.simulate(tried.system, **tried.start, **tried.lasting(1))
    np.testing.assert_allclose(found["end"], expected.final_state, atol=1e-9)
    assert len(found["events"]) == len(expected.events)


def plot(tried: Tried, folder: Path) -> None:
    """The picture of a motion has its observed coordinate among its curves."""
    from matplotlib import pyplot

    axes = saltus.plot(tried.motion)
    lines = [line for each in np.ravel(axes) for line in each.get_lines()]
    begins = [line.get_ydata()[0] for line in lines if len(line.get_ydata()) > 10]
    assert tried.start[tried.observed] in [float(y) for y in begins]
    pyplot.close("all")


def animate(tried: Tried, folder: Path) -> None:
    """A film has as many pictures as were asked for."""
    from matplotlib import pyplot
    from PIL import Image

    file = saltus.animate(tried.motion, folder / "film.gif", seconds=0.2, fps=10)
    with Image.open(file) as film:
        assert film.n_frames == 2
    pyplot.close("all")


def saved(tried: Tried, folder: Path) -> None:
    """A motion is read back with the same numbers, and its system too."""
    back = saltus.load(saltus.save(folder / "motion.nc", tried.motion))
    data = tried.motion.to_xarray()
    for name in data.data_vars:
        np.testing.assert_array_equal(back[name].values, data[name].values)
    assert saltus.System.from_json(back.attrs["system"]) == tried.system


def table(tried: Tried, folder: Path) -> None:
    """The table has all digits of the motion."""
    with saltus.to_csv(folder / "motion.csv", tried.motion).open() as file:
        rows = list(csv.DictReader(file))
    data = tried.motion.to_xarray()
    values = [float(row[tried.observed]) for row in rows]
    np.testing.assert_array_equal(values, data[tried.observed].values)


@dataclass(frozen=True)
class Verb:
    """What is done with a system: its name in the table, the public functions, and the trial."""

    name: str
    functions: str
    trial: Callable[[Tried, Path], None]


VERBS = (
    Verb("motion", "simulate", simulate),
    Verb("ensemble", "simulate_many", many),
    Verb("its extrema", "simulate_many", many_extremes),
    Verb("derivatives", "sensitivities", sensitivities),
    Verb("orbit", "find_orbit", orbit),
    Verb("branch", "continue_orbit", branch),
    Verb("sweep", "frequency_sweep", sweep),
    Verb("verdict", "classify", classify),
    Verb("attractors", "find_attractors", attractors),
    Verb("basins", "basins_of_attraction", basins),
    Verb("diagram", "response_spectrum", spectrum),
    Verb("exponents", "lyapunov_spectrum", exponents),
    Verb("of an ensemble", "lyapunov_many", many_exponents),
    Verb("fit", "fit", fit),
    Verb("energies", "energies", energies),
    Verb("page", "page", page),
    Verb("picture", "plot", plot),
    Verb("film", "animate", animate),
    Verb("file", "save, load", saved),
    Verb("table", "to_csv", table),
)
