"""Pulses as signals: their values, derivatives and integrals against printed formulas and
quadrature, and their files.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from saltus import (
    Chirp,
    HalfSine,
    MavroeidisPapageorgiou,
    OneCosine,
    OneSine,
    PhysicalCell,
    Ramp,
    Ricker,
)
from saltus.config import load_study
from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, RockingBlock, System, WallOscillator

A, W, START = 0.7, 2.3, 0.4


def near_fault(r, gamma=2.3, nu=0.6):
    """Mavroeidis and Papageorgiou's velocity pulse, as they print it, r after its middle."""
    return 0.5 * A * (1 + math.cos(W * r / gamma)) * math.cos(W * r + nu)


def ricker(r):
    """The symmetric Ricker wavelet, r after its peak."""
    return A * (1 - 2 * (W * r / 2) ** 2) * math.exp(-((W * r / 2) ** 2))


PULSES = {
    "half sine": (HalfSine, {"frequency": W}, math.pi / W, lambda s: A * math.sin(W * s)),
    "one sine": (OneSine, {"frequency": W}, 2 * math.pi / W, lambda s: A * math.sin(W * s)),
    "one cosine": (OneCosine, {"frequency": W}, 2 * math.pi / W, lambda s: A * math.cos(W * s)),
    "near fault": (MavroeidisPapageorgiou, {"frequency": W, "gamma": 2.3, "phase": 0.6}, 2 * math.pi * 2.3 / W,
                   lambda s: near_fault(s - math.pi * 2.3 / W)),
    "ricker": (Ricker, {"frequency": W}, 28 / W, lambda s: ricker(s - 14 / W)),
    "ramp": (Ramp, {"duration": 1.9}, 1.9, lambda s: A * s / 1.9),
    "chirp": (Chirp, {"frequency": W, "end_frequency": 5.1, "duration": 1.9}, 1.9,
              lambda s: A * math.sin(W * s + (5.1 - W) * s**2 / (2 * 1.9))),
}  # fmt: skip
INTEGRATED = [name for name in PULSES if name != "chirp"]


def values(name, quantity, order, times):
    """The channel, or a derivative, of a load with one pulse."""
    cls, numbers, _, _ = PULSES[name]
    channel = "force" if quantity == "force" else "ground_horizontal"
    load = Load(**{channel: cls(amplitude=A, start=START, quantity=quantity, **numbers)})
    return load.channels[channel].derivative(times, None, order)


@pytest.mark.parametrize("name", PULSES)
def test_a_pulse_is_its_formula_within_its_span_and_nothing_outside(name):
    _, _, duration, formula = PULSES[name]
    inside = START + duration * np.linspace(0.01, 0.99, 29)
    assert values(name, "force", 0, inside) == pytest.approx(
        [formula(t - START) for t in inside], abs=1e-14
    )
    outside = np.array([START - 1.0, START - 1e-9, START + duration + 1e-9, 100.0])
    after = A if name == "ramp" else 0.0
    assert values(name, "force", 0, outside) == pytest.approx([0.0, 0.0, after, after], abs=0.0)


@pytest.mark.parametrize("name", PULSES)
@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_of_a_pulse_are_those_of_its_formula(name, order):
    _, _, duration, formula = PULSES[name]
    h = 1e-3
    for s in duration * np.array([0.2, 0.47, 0.8]):
        points = [formula(s + k * h) for k in range(-3, 4)]
        weights = {
            1: [-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60],
            2: [1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90],
        }
        expected = np.dot(weights[order], points) / h**order
        assert values(name, "force", order, START + s) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("name", INTEGRATED)
# within the pulse, at its end, and long after it
@pytest.mark.parametrize("share", [0.3, 1.0, 1.7])
def test_the_ground_under_a_pulse_of_acceleration_moves_from_rest(name, share):
    _, _, duration, formula = PULSES[name]
    end = share * duration
    held = (lambda s: A) if name == "ramp" else (lambda s: 0.0)
    parts = [(0.0, min(end, duration), formula)] + (
        [(duration, end, held)] if end > duration else []
    )
    velocity = sum(quad(f, a, b, epsabs=1e-13, limit=400)[0] for a, b, f in parts)
    position = sum(
        quad(lambda s, f=f: (end - s) * f(s), a, b, epsabs=1e-13, limit=400)[0] for a, b, f in parts
    )
    assert values(name, "acceleration", 1, START + end) == pytest.approx(velocity, abs=1e-11)
    assert values(name, "acceleration", 0, START + end) == pytest.approx(position, abs=1e-11)


def test_a_near_fault_pulse_of_velocity_begins_and_ends_at_rest():
    times = START + 2 * math.pi * 2.3 / W * np.array([0.0, 0.35, 1.0, 2.0])
    expected = [0.0, near_fault((0.35 - 0.5) * 2 * math.pi * 2.3 / W), 0.0, 0.0]
    assert values("near fault", "velocity", 1, times) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("name", PULSES)
def test_systems_with_pulses_come_back_from_json_and_have_dotted_paths(name):
    cls, numbers, _, _ = PULSES[name]
    pulse = cls(amplitude=A, start=START, **numbers)
    system = System(
        model=WallOscillator(stiffness=1.0),
        load=Load(frequency=2.0, force=pulse + Harmonic(amplitude=0.1)),
    )
    assert System.from_json(system.to_json()) == system
    assert system.with_({"load.force.0.start": 0.9}).load.channels["force"].terms[0].start == 0.9


def test_a_study_names_a_pulse_by_its_type(tmp_path):
    text = """
[model]
type = "RockingBlock"
alpha = 0.2
[load.ground_horizontal]
type = "MavroeidisPapageorgiou"
amplitude = 0.3
frequency = 2.0
gamma = 1.5
phase = "90 deg"
quantity = "velocity"
"""
    path = tmp_path / "study.toml"
    path.write_text(text)
    pulse = MavroeidisPapageorgiou(
        amplitude=0.3, frequency=2.0, gamma=1.5, phase=math.pi / 2, quantity="velocity"
    )
    assert load_study(path).system == System(
        model=RockingBlock(alpha=0.2), load=Load(ground_horizontal=pulse)
    )
    path.write_text(text.replace("MavroeidisPapageorgiou", "HalfSin"))
    with pytest.raises(
        ParameterError,
        match=(
            r"study.toml: load.ground_horizontal.type .HalfSin. is not a pulse; did you mean"
            r" 'HalfSine'"
        ),
    ):
        load_study(path)


def test_pulses_in_si_units_are_the_same_pulses():
    cell = PhysicalCell(length=0.1, upper_mass=0.02, upper_stiffness=3.0)
    pulse = HalfSine(amplitude=4.0, frequency=50.0, start=0.3, quantity="acceleration")
    si = Load(ground_horizontal=pulse, vertical=Ramp(amplitude=-20.0, duration=0.5))
    load, unit = cell.load(si), cell.units
    assert load.ground_horizontal.acceleration(0.31 / unit["time"]) * unit[
        "acceleration"
    ] == pytest.approx(4.0 * math.sin(0.5), rel=1e-13)
    assert load.vertical(0.4 / unit["time"]) * unit["force"] == pytest.approx(-16.0, rel=1e-13)
    back = cell.load_in_si(load)
    assert back.ground_horizontal.acceleration(0.31) == pytest.approx(
        4.0 * math.sin(0.5), rel=1e-13
    )


def sweep():
    return Chirp(
        amplitude=1.0, frequency=1.0, end_frequency=2.0, duration=1.0, quantity="acceleration"
    )


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: HalfSine(amplitude=1.0, frequency=-1.0), "frequency must lie in .0, inf., got -1.0"),
        (lambda: HalfSine(amplitude=1.0, frequency=1e-320), "does not end"),
        (lambda: Ramp(amplitude=1.0, duration=1e-9, start=1e9), "does not end after its start"),
        (lambda: OneSine(amplitude=1.0, frequency=1.0, quantity="velocity"), "quantity of a OneSine must be one of force, acc"),
        (lambda: MavroeidisPapageorgiou(amplitude=1.0, frequency=1.0, gamma=1.0), "gamma must lie in .1, inf."),
        (lambda: Load(force=HalfSine(amplitude=1.0, frequency=1.0, quantity="acceleration")), "takes a HalfSine of force"),
        (lambda: Load(ground_vertical=Ricker(amplitude=1.0, frequency=1.0)), "takes a Ricker of displacement, velocity or acc"),
        (lambda: Load(ground_vertical=sweep()).ground_vertical.velocity(0.5), "not an elementary function"),
        (lambda: System.from_dict({"model": {"type": "TwoStops"}, "load": {"force": {"type": 3}}}), "is not a pulse"),
    ],
)  # fmt: skip
def test_a_pulse_without_meaning_is_refused(make, sentence):
    with pytest.raises(ParameterError, match=sentence):
        make()


def test_mirror_of_a_block_turns_a_pulse_round():
    pulse = OneCosine(amplitude=A, frequency=W, quantity="acceleration")
    system = System(model=RockingBlock(alpha=0.2), load=Load(ground_horizontal=pulse))
    assert system.mirrored().load.channels["ground_horizontal"].amplitude == -A
