"""The text for a card, followed on this processor, against the lanes; and the PTX that it becomes.

No card is needed. What a motion does may not depend on where launches are cut, nor on which of two
texts follows it: both are the lanes' own, of widths that differ. Only the elementary functions and
fused multiply-adds may round otherwise, so motions agree to rounding times what they magnify.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from lane_cases import FAMILIES, amplification, end_state
from test_contacts import layers

import saltus
from saltus.attractors import Attractors
from saltus.errors import ParameterError, SaltusError
from saltus.flow.cuda import devices
from saltus.flow.cuda.launch import LaunchSettings, example_of, run_on
from saltus.flow.cuda.targets import Card, Host
from saltus.flow.cuda.thread_code import BLOCK, BLOCKS, OLDEST, thread_code
from saltus.flow.lanes import ensemble
from saltus.flow.lanes.inputs import read_inputs
from saltus.flow.lanes.options import EnsembleOptions
from saltus.flow.programs.compiled import limits_of, program

TOL = 1e-12
ALL = {"sample": ("state", "extrema", "speed", "impact_count"), "last": "all"}
EARLY = {"until": ("rest", "settled")}
COUNTED = ("impact_count", "stop", "side", "grazings")
MOST_LOCAL = 1 << 14  # bytes of a thread in one function
MANY = 1000, 1e9, 2  # motions, forcing periods of all of them, cores
MOST_BYTES = 16  # stores of single bytes: of truths, in errors of memory


@pytest.fixture(scope="module")
def host():
    return Host()


def on_host(monkeypatch, host):
    """Let ensembles run in the threads of this processor."""
    monkeypatch.setattr(ensemble, "target_of", lambda *asked: host)


def agree(name, monkeypatch, host, count=150, **options):
    """Compare random cases of a family, followed both ways."""
    rng = np.random.default_rng(11)
    cases = FAMILIES[name](rng, count)
    lanes = cases.in_lanes(tol=TOL, **options)
    magnified = amplification(cases, lanes, TOL, rng)
    with monkeypatch.context() as patch:
        on_host(patch, host)
        threads = cases.in_lanes(tol=TOL, **options)
    calm = magnified < 100.0
    assert calm.sum() > count / 4
    for counted in COUNTED:
        same = lanes[counted].values == threads[counted].values
        assert same[calm].all(), counted
        assert same.mean() > 0.98, counted
    # below it rounding magnifies; a last bit of each step is 1e-15
    allowed = 1e-12 * np.maximum(magnified, 1.0)[:, None]
    found = end_state(lanes, cases.system) - end_state(threads, cases.system)
    assert (np.abs(found) <= allowed)[calm].all()
    assert threads.attrs["device"] == host.name
    for name in set(lanes.data_vars) - set(COUNTED):
        if lanes[name].dims == lanes["time"].dims and lanes[name].dtype.kind == "f":
            a, b = lanes[name].values[calm], threads[name].values[calm]
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("name", ["paper", "rocking"])
def test_motions_in_threads_are_those_in_lanes(name, monkeypatch, host):
    agree(name, monkeypatch, host, **ALL, **EARLY)


@pytest.mark.thorough
@pytest.mark.parametrize("more", [{}, ALL | EARLY], ids=["ends", "all"])
@pytest.mark.parametrize("name", [name for name in FAMILIES if name != "pair"])
def test_all_models_with_one_contact_agree(name, more, monkeypatch, host):
    agree(name, monkeypatch, host, count=300, **more)


# --- several contacts --------------------------------------------------------


def between_stops(count, rng):
    """A mass between two stops of different restitution; some come to rest at one of them."""
    system = saltus.System(
        model=saltus.TwoStops(left=-0.4, right=0.5, damping=0.1),
        load=saltus.Load(frequency=1.2, force=saltus.Harmonic(0.8, mean=0.1)),
        impact=saltus.NewtonImpact((0.8, 0.3)),
    )
    columns = {
        "load.force.amplitude": rng.uniform(0.05, 1.2, count),
        "load.force.mean": rng.uniform(-0.6, 0.6, count),
        "impact.e.0": rng.uniform(0.0, 1.0, count),
    }
    return system, columns, {"x": rng.uniform(-0.3, 0.4, count)}


def both_layers(count, rng):
    """The two layers of the metainterface, from rest, open or closed."""
    columns = {
        "load.vertical": rng.uniform(-1.5, 0.3, count),
        "load.horizontal.amplitude": rng.uniform(0.0, 1.0, count),
        "model.mass_ratio": 10 ** rng.uniform(-2.0, 1.0, count),
    }
    start = rng.uniform(0.02, 0.6, (2, count)) * (rng.random((2, count)) < 0.7)
    return layers(e=(0.1, 0.1)), columns, {"theta_1": start[0], "theta_2": -start[1]}


def agree_with_several_contacts(cases, monkeypatch, host, count):
    """Compare ends and what is counted, in all motions that a change of the start by 1e-9 moves by
    less than 1e-7.
    """
    system, columns, state = cases(count, np.random.default_rng(7))
    many = {"periods": 12, "parameters": columns, "tol": TOL, **ALL, **EARLY}
    lanes = saltus.simulate_many(system, **state, **many)
    moved = saltus.simulate_many(
        system, **{name: x * (1 + 1e-9) for name, x in state.items()}, **many
    )
    with monkeypatch.context() as patch:
        on_host(patch, host)
        threads = saltus.simulate_many(system, **state, **many)
    apart = np.abs(end_state(lanes, system) - end_state(moved, system)).max(axis=1)
    calm = (apart < 1e-7) & (lanes.impact_count == moved.impact_count).values
    assert calm.mean() > 0.7
    assert set(lanes.stop.values) > {0}
    assert threads.attrs["device"] == host.name
    for counted in ("impact_count", "stop", "closed_contacts"):
        assert (lanes[counted].values == threads[counted].values)[calm].all(), counted
    difference = np.abs(end_state(lanes, system) - end_state(threads, system))
    assert difference[calm].max() < 1e-9


@pytest.mark.parametrize(
    "cases", [between_stops, pytest.param(both_layers, marks=pytest.mark.thorough)]
)
def test_models_with_several_contacts_agree(cases, monkeypatch, host):
    agree_with_several_contacts(cases, monkeypatch, host, 100)


# --- launches ----------------------------------------------------------------


def oscillator():
    """A metainterface whose motions lose speed at impacts."""
    return saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
        impact=saltus.VelocityReduction(0.9),
    )


def oscillators():
    """Motions of it: their lanes and jobs."""
    system = oscillator()
    options = EnsembleOptions(
        tol=TOL, periods=20, limits=limits_of(system, ()), sample=(), until=(), paths=None
    )
    run = program(system, options.limits, None)
    states = {"theta": np.linspace(-1.0, 1.0, 60)}
    inputs = read_inputs(system, np.linspace(-0.5, 0.5, 60), 0.0, None, states)
    jobs = ensemble._jobs(system, run, inputs, 20, None, 0)
    return ensemble.compiled_lanes(system, run, options, 1), jobs


def test_launches_change_nothing_wherever_they_are_cut(host):
    lanes, jobs = oscillators()
    whole = run_on(host, lanes, jobs, 1, settings=LaunchSettings(periods=1000))
    for periods, most in ((1, 1 << 20), (7, 13)):
        cut = run_on(host, lanes, jobs, 1, settings=LaunchSettings(periods, most_motions=most))
        assert (cut.states == whole.states).all()
        assert (cut.rows == whole.rows).all()


def test_motions_with_many_rare_events_are_left_to_the_lanes(host):
    lanes, jobs = oscillators()
    left = run_on(host, lanes, jobs, 1, settings=LaunchSettings(calls=0))
    own = lanes.run(jobs, 1)
    assert (left.states == own.states).all()
    assert (left.rows == own.rows).all()


def test_an_interrupt_ends_all_launches(host):
    lanes, jobs = oscillators()
    asked = []

    def progress(fraction, what):
        asked.append(fraction)
        if len(asked) > 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_on(host, lanes, jobs, 1, progress, 1200.0, LaunchSettings(periods=1))
    assert not host._arrays
    assert asked == sorted(asked)


# --- the code for a card -----------------------------------------------------


@pytest.fixture(scope="module")
def ptx():
    lanes, jobs = oscillators()
    return thread_code(lanes, example_of(lanes, jobs, lanes.no_ends(1)), True).code.decode()


def test_a_card_needs_nothing_besides(ptx):
    assert f".target {OLDEST}" in ptx
    assert ".entry follow_all" in ptx
    assert ".extern" not in ptx  # no name is open
    # the registers that the driver gives follow from these
    assert f".maxntid {BLOCK}" in ptx
    assert f".minnctapersm {BLOCKS}" in ptx
    assert "callprototype" not in ptx  # no call through an address, so the stack is known


def test_a_card_moves_whole_words_in_little_memory_of_its_own(ptx):
    assert len(re.findall(r"\bst\.(?:\w+\.)*b8\b", ptx)) <= MOST_BYTES
    local = [
        int(size) for size in re.findall(r"\.local\s+\.align\s+\d+\s+\.b8\s+\S+\[(\d+)\]", ptx)
    ]
    assert local
    assert max(local) <= MOST_LOCAL


def ptxas():
    """NVIDIA's assembler, where it is installed."""
    found = importlib.util.find_spec("nvidia")
    folders = [] if found is None else list(found.submodule_search_locations or [])
    packaged = [str(path) for folder in folders for path in Path(folder).rglob("bin/ptxas")]
    return os.environ.get("SALTUS_PTXAS") or shutil.which("ptxas") or next(iter(packaged), None)


@pytest.mark.thorough
@pytest.mark.skipif(ptxas() is None, reason="ptxas is not installed")
def test_the_assembler_takes_the_code(ptx, tmp_path):
    source = tmp_path / "thread.ptx"
    source.write_text(ptx)
    command = [ptxas(), "-arch=sm_80", "-O1", str(source), "-o", str(tmp_path / "thread.cubin")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


# --- devices -----------------------------------------------------------------


def test_a_card_that_is_not_there_is_one_sentence(monkeypatch):
    def none():
        raise SaltusError("no card was found: this machine has no driver of NVIDIA's")

    monkeypatch.setattr(devices, "card", none)
    lanes, _ = oscillators()
    with pytest.raises(SaltusError, match="no card was found"):
        devices.target_of("cuda", lanes.program, *MANY)
    assert devices.target_of("auto", lanes.program, *MANY) is None
    with pytest.raises(SaltusError, match="no card was found"):
        saltus.find_attractors(oscillator(), device="cuda")


def test_what_the_driver_answers_is_told(monkeypatch):
    failing = type("Answer", (), {"__int__": lambda self: 100, "name": "CUDA_ERROR_NO_DEVICE"})()
    driver = SimpleNamespace(cuInit=lambda flags: (failing,))
    monkeypatch.setitem(sys.modules, "cuda", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "cuda.bindings", SimpleNamespace(driver=driver))
    with pytest.raises(SaltusError, match="no card was found: CUDA_ERROR_NO_DEVICE"):
        Card()
    monkeypatch.setitem(sys.modules, "cuda.bindings", None)
    with pytest.raises(SaltusError, match="pip install"):
        Card()


def test_a_card_is_taken_where_it_is_faster(monkeypatch, host):
    monkeypatch.setattr(devices, "card", lambda: host)
    lanes, _ = oscillators()
    motions, periods, cores = MANY
    assert devices.target_of("auto", lanes.program, *MANY) is host
    for few in (
        (cores * devices.FEWEST - 1, periods, cores),
        (motions, 0.9 * cores * devices.LEAST_WORK, cores),
    ):
        assert devices.target_of("auto", lanes.program, *few) is None
        assert devices.target_of("cuda", lanes.program, *few) is host
    assert devices.target_of("cpu", lanes.program, *MANY) is None


def test_what_a_card_cannot_follow_is_refused_by_name():
    system = saltus.System(model=saltus.BeltOscillator(), load=saltus.Load())
    with pytest.raises(ParameterError, match="with friction or with surfaces"):
        devices.target_of("cuda", program(system), *MANY)
    assert devices.target_of("auto", program(system), *MANY) is None
    driven = saltus.System(
        model=saltus.BeltOscillator(), load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.1))
    )
    with pytest.raises(ParameterError, match="with friction or with surfaces"):
        saltus.find_attractors(driven, device="cuda")
    with pytest.raises(ParameterError, match="device must be one of"):
        saltus.simulate_many(system, periods=1, device="gpu")


# --- studies -----------------------------------------------------------------


def block():
    """A block under a pulse that may overturn it."""
    pulse = saltus.OneSine(amplitude=0.3, frequency=2.0, quantity="acceleration")
    load = saltus.Load(ground_horizontal=pulse)
    return saltus.System(model=saltus.RockingBlock(alpha=0.2), load=load)


GRID = np.linspace(-1.0, 1.0, 6)
STUDIES = {
    "attractors": lambda device: saltus.find_attractors(oscillator(), starts=24, device=device),
    "basins": lambda device: saltus.basins_of_attraction(
        oscillator(), theta=GRID, velocity=GRID, device=device
    ),
    "chart": lambda device: saltus.stability_chart(
        oscillator(), horizontal=[0.2, 0.4], vertical=[-0.5], starts=8, device=device
    ),
    "spectrum": lambda device: saltus.response_spectrum(
        oscillator(), bounds=(0.9, 1.0), max_period=1, values=[0.95], bands=False, device=device
    ),
    "overturning": lambda device: saltus.overturning_spectrum(
        block(), amplitude=GRID[3:], frequency=[2.0, 3.0], curves=False, device=device
    ),
    "fragility": lambda device: saltus.fragility([block()], [1.0, 3.0, 5.0], device=device),
}
SLOW_STUDIES = ("attractors", "basins", "chart", "spectrum", "overturning")


def numbers_of(result):
    """The tables of a result."""
    result = result.to_xarray() if isinstance(result, Attractors) else result
    parts = [node.dataset for node in result.subtree] if hasattr(result, "subtree") else [result]
    return [{name: values.values for name, values in part.data_vars.items()} for part in parts]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.thorough] if name in SLOW_STUDIES else [])
        for name in STUDIES
    ],
)
def test_a_study_passes_its_device_on(name, monkeypatch, host):
    monkeypatch.setattr(devices, "card", lambda: host)
    monkeypatch.setattr(devices, "FEWEST", 1)
    here = STUDIES[name]("cpu")
    there = STUDIES[name]("cuda")
    told = there.device if name == "attractors" else there.attrs["device"]
    assert told == host.name
    for one, other in zip(numbers_of(here), numbers_of(there), strict=True):
        assert one.keys() == other.keys()
        for key, values in one.items():
            if values.dtype.kind in "fc":
                np.testing.assert_allclose(other[key], values, rtol=1e-6, atol=1e-8, err_msg=key)
            else:
                assert (other[key] == values).all(), key


def test_a_study_on_a_card_is_of_one_process(monkeypatch, host):
    monkeypatch.setattr(devices, "card", lambda: host)
    with pytest.raises(ParameterError, match="one process"):
        saltus.stability_chart(oscillator(), workers=2, device="auto")
    with pytest.raises(ParameterError, match="device must be one of"):
        saltus.fragility([block()], [1.0], device="gpu")


def test_a_file_may_name_the_device(tmp_path, monkeypatch):
    def none():
        raise SaltusError("no card was found")

    monkeypatch.setattr(devices, "card", none)
    file = tmp_path / "study.toml"
    file.write_text(
        "[model]\ntype = 'Metainterface'\nbeta0 = '80 deg'\n[load]\nfrequency = 1\nhorizontal = 0.2\n"
        "[basins]\ntheta = [0.0, 0.1]\nvelocity = [0.0, 0.1]\ndevice = 'cuda'\n"
    )
    study = saltus.load_study(file)
    (ask,) = study.asks
    with pytest.raises(SaltusError, match="no card was found"):
        study.answer(ask, ask.function.check)


@pytest.fixture
def card():
    """A card of this machine."""
    try:
        return devices.card()
    except SaltusError as error:
        pytest.skip(f"no card was seen: {error}")


@pytest.mark.gpu
@pytest.mark.parametrize("name", [name for name in FAMILIES if name != "pair"])
def test_a_card_agrees_with_the_lanes(name, monkeypatch, card):
    agree(name, monkeypatch, card, count=1000, **ALL, **EARLY)


@pytest.mark.gpu
@pytest.mark.parametrize("cases", [between_stops, both_layers])
def test_a_card_agrees_on_models_with_several_contacts(cases, monkeypatch, card):
    agree_with_several_contacts(cases, monkeypatch, card, 1000)


def test_the_doctor_tells_the_rate_of_a_card(monkeypatch, host):
    from saltus.cli.doctor_command import _rate_of_card

    system = saltus.System(
        model=saltus.WallOscillator(wall=0.5),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.0)),
    )

    def failing():
        raise SaltusError("no card was found")

    monkeypatch.setattr(devices, "card", failing)
    assert _rate_of_card(system) == "has failed: no card was found"
    assert not devices.has_card()
