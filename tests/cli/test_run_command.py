"""`saltus run`: what it computes, writes and says; what it refuses before it computes; interrupts,
resuming, a cluster.
"""

import importlib
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray

from saltus import basins_of_attraction, stability_chart
from saltus.config import load_study
from saltus.plots import figure_of
from saltus.plots.chart import draw_stability_chart
from saltus.sweep import open_store, status
from saltus.sweep.workers import ClusterSettings
from saltus.systems import System
from saltus.theory import equilibria

MODEL = '[model]\ntype = "Metainterface"\nbeta0 = "80 deg"\ndamping = 0.1\n'
FORCED = MODEL + "[load]\nfrequency = 1.0\nhorizontal = { amplitude = 0.5 }\nvertical = -0.5\n"
CONSTANT = MODEL + "[load]\nhorizontal = 0.05\nvertical = -1.5\n"
CHART = (
    "[stability_chart]\nhorizontal = { from = 0, to = 0.5, count = 6 }\nvertical = { from = -1, to"
    " = -0.1, count = 4 }\n"
)
BASINS = (
    "[basins]\ntheta = { from = -2, to = 2, count = 6 }\nvelocity = { from = -2, to = 2, count ="
    " 5 }\n"
)
DIAGRAM = "bounds = [0.8, 1.0]\nmax_period = 1\nvalues = [0.88]\nstarts = 6\nbands = false\n"


@pytest.fixture
def study(tmp_path):
    def write(text, name="study"):
        path = tmp_path / f"{name}.toml"
        path.write_text(text)
        return path

    return write


def files(folder):
    return sorted(path.name for path in folder.iterdir())


# --- answers -----------------------------------------------------------------


def test_a_study_asks_for_a_motion_a_portrait_and_attractors_at_once(saltus, study, tmp_path):
    path = study(
        CONSTANT + "[simulate]\ntheta = 0.3\nduration = 5\n[phase_portrait]\nduration ="
        " 5\n[attractors]\nstarts = 32\n"
    )
    result = saltus("run", path, "-o", tmp_path / "out")
    assert result.exit_code == 0
    kinds = ("attractors", "motion", "phase_portrait")
    assert files(tmp_path / "out") == [
        f"{kind}.{end}" for kind in kinds for end in ("nc", "pdf", "png")
    ]
    known = equilibria(load_study(path).system)
    stable = [one.theta for one in known if one.stable]
    saddles = len(known) - len(stable)  # each with two branches of its stable manifold
    assert (
        f"{len(stable)} stable and {saddles} unstable equilibria, {2 * saddles} separatrices.\n"
        in result.stdout
    )
    assert result.stdout.endswith(
        f"Results are in {tmp_path / 'out'}: attractors.nc, attractors.png, attractors.pdf\n"
    )
    with xarray.open_dataset(tmp_path / "out" / "attractors.nc", engine="h5netcdf") as data:
        places = np.sort(
            np.append(data["section_theta"].values[data["attractor"].values > 0, 0], 0.0)
        )
        np.testing.assert_allclose(places, stable, atol=1e-7)
        assert System.from_json(data.attrs["system"]) == load_study(path).system


def test_diagrams_tell_their_folds(saltus, study, tmp_path):
    path = study(FORCED + "[response_spectrum]\n" + DIAGRAM)
    result = saltus("run", path, "-o", tmp_path / "out")
    # the project's reference, from two independent codes: folds at Hhat = 0.5
    for fold in ("0.848485", "0.908811"):
        assert f"LP {fold}" in result.stdout
    assert files(tmp_path / "out") == [
        f"response_spectrum.{end}" for end in ("nc", "pdf", "png", "zarr")
    ]
    assert status(tmp_path / "out" / "response_spectrum.zarr").complete
    tree = xarray.open_datatree(tmp_path / "out" / "response_spectrum.nc", engine="h5netcdf")
    assert tree.attrs["kind"] == "response_spectrum"
    tree.close()
    told = [line for line in result.stderr.splitlines() if line]
    assert told[0] == "response spectrum: computing"
    assert "response spectrum: searching" in told
    assert told[-1] == "response spectrum: writing"


def test_a_chart_is_that_of_python_and_stays_in_its_store(saltus, study, tmp_path):
    path = study(FORCED + CHART)
    result = saltus("run", path, "-o", tmp_path / "out", "--no-plot")
    assert files(tmp_path / "out") == ["stability_chart.zarr"]
    chart = stability_chart(
        load_study(path).system,
        horizontal=np.linspace(0, 0.5, 6),
        vertical=np.linspace(-1, -0.1, 4),
    )
    kept = open_store(tmp_path / "out" / "stability_chart.zarr")
    for name in kept:
        np.testing.assert_array_equal(kept[name], chart[name])
    moving = int((chart["count"] > 0).sum())
    assert f"Stable motions beside rest in {moving} of 24 cells" in result.stdout
    assert 0 < moving < 24


def test_basins_are_those_of_python_and_their_cells_stay_in_a_store(saltus, study, tmp_path):
    path = study(FORCED + BASINS + "rows = 2\n")
    result = saltus("run", path, "-o", tmp_path / "out", "--no-plot")
    assert files(tmp_path / "out") == ["basins.nc", "basins.zarr"]
    whole = basins_of_attraction(
        load_study(path).system, theta=np.linspace(-2, 2, 6), velocity=np.linspace(-2, 2, 5)
    )
    with xarray.open_dataset(tmp_path / "out" / "basins.nc", engine="h5netcdf") as data:
        for name in ("label", "time", "cells", "section_theta"):
            np.testing.assert_array_equal(data[name], whole[name])
    assert status(tmp_path / "out" / "basins.zarr").done == 3
    assert "period 1, amplitude 1.02, 100 % of the cells" in result.stdout


def test_a_chart_of_lengths_has_no_radians(saltus, study, tmp_path):
    path = study(
        '[model]\ntype = "WallOscillator"\nwall = 0.5\ndamping = 0.2\n[load]\nfrequency = 1\nforce'
        " = { amplitude = 0.6 }\n[stability_chart]\nhorizontal = [0.3, 0.6]\nvertical = [0.9,"
        ' 1.1]\npaths = ["load.force.amplitude", "load.frequency"]\nstarts = 2\n'
    )
    result = saltus("run", path, "-o", tmp_path / "out", "--no-plot")
    assert re.search(r"in 4 of 4 cells, the largest amplitude is [\d.]+\d\.\n", result.stdout)
    bar = figure_of(
        draw_stability_chart(open_store(tmp_path / "out" / "stability_chart.zarr"))
    ).axes[-1]
    assert bar.get_ylabel() == r"largest amplitude $\max_\tau |x|$"


def test_what_is_kept_is_not_computed_again(saltus, study, tmp_path, monkeypatch):
    path = study(FORCED + CHART)
    saltus("run", path, "-o", tmp_path / "out", "--no-plot")
    monkeypatch.setattr(
        "saltus.studies.chart.cells.cells", lambda *args: pytest.fail("it computed the chart again")
    )
    result = saltus("run", path, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert files(tmp_path / "out") == [
        "stability_chart.pdf",
        "stability_chart.png",
        "stability_chart.zarr",
    ]


# --- refusals ----------------------------------------------------------------

TWO = MODEL.replace("Metainterface", "TwoLayer") + "[load]\nfrequency = 1\nvertical = -0.5\n"
WALL = '[model]\ntype = "WallOscillator"\nwall = 0.5\n[load]\nforce = 0.1\n'
RESTITUTION = '[impact]\ntype = "EnergyRestitution"\nr = 0.8\n'
REFUSED = {
    "nothing": (FORCED, "asks for nothing; add [simulate]"),
    "table": (FORCED + "[stabilty_chart]\n", "did you mean 'stability_chart'?"),
    "no_table": ("basins = 3\n" + FORCED, "basins must be a table of keys and values, got 3"),
    "key": (FORCED + "[basins]\nthta = [0, 1]\n", "unknown key basins.thta; did you mean 'theta'?"),
    "no_count": (
        FORCED + "[basins]\ntheta = { from = 0, to = 1 }\n",
        "basins.theta needs from, to and count",
    ),
    "count_text": (
        FORCED + '[basins]\ntheta = { from = 0, to = 1, count = "9" }\n',
        (
            'basins.theta has a count that must be a number, got the text "9"; write it without'
            " quotes: 9"
        ),
    ),
    "count_near": (
        FORCED + "[basins]\ntheta = { from = 0, to = 1, cont = 9 }\n",
        "did you mean 'count'?",
    ),
    "count_one": (
        FORCED + "[basins]\ntheta = { from = 0, to = 1, count = 1 }\n",
        "needs a count from 2 to",
    ),
    "falling": (FORCED + "[basins]\ntheta = [1, 0]\n", "basins.theta must be numbers that rise"),
    "backward": (
        FORCED + "[basins]\ntheta = { from = 1, to = 0, count = 3 }\n",
        "from the smaller number",
    ),
    "number": (
        FORCED + "[basins]\ntheta = 3\n",
        "basins.theta must be a list of numbers or a table",
    ),
    "text": (FORCED + '[basins]\nperiods = "500"\n', "basins.periods must be a number"),
    "periods": (
        FORCED + "[basins]\nperiods = 3\n",
        "basins.periods must lie in [32, 1e+12], got 3",
    ),
    "two_layers": (
        TWO + "[basins]\nvelocity = [0, 1]\n",
        "TwoLayer has no state variable 'velocity'",
    ),
    "two_attractors": (
        TWO + "[attractors]\nwindow = [[-1, 1], [-1, 1]]\n",
        "4 pairs (least, largest)",
    ),
    "two_diagram": (
        TWO + "[response_spectrum]\nwindow = [[-1, 1], [-1, 1]]\n",
        "4 pairs (least, largest)",
    ),
    "two_chart": (
        TWO
        + '[stability_chart]\npaths = ["load.frequency", "load.vertical"]\nhorizontal = [0.5, 1]\n'
        + "window = [[-1, 1], [-1, 1]]\ncurves = 2\n",
        "4 pairs (least, largest)",
    ),
    "curves": (FORCED + RESTITUTION + "[basins]\ncurves = true\n", "cannot be followed backward"),
    "constant_chart": (CONSTANT + CHART, "a stability chart needs a load with a frequency"),
    "constant_spectrum": (CONSTANT + "[response_spectrum]\n", "a load without a frequency"),
    "varying": (
        FORCED + "[phase_portrait]\n",
        "load.horizontal varies, so there is no phase plane",
    ),
    "window": (
        CONSTANT + "[phase_portrait]\nwindow = [1, 2]\n",
        "phase_portrait.window must be pairs of numbers",
    ),
    "beyond": (WALL + "[phase_portrait]\nstarts = [[2, 0]]\n", "[2.0, 0.0] is beyond the contact"),
    "window of states": (
        FORCED + "[attractors]\nwindow = [[1, -1], [0, 1]]\n",
        "attractors.window must be ((least",
    ),
    "path": (
        FORCED + '[response_spectrum]\npath = "load.frequenzy"\n',
        "did you mean 'load.frequency'?",
    ),
    "bounds": (
        FORCED + "[bifurcation_diagram]\nbounds = [2, 1]\n",
        "bifurcation_diagram.bounds must be two numbers",
    ),
    "paths": (
        FORCED + '[stability_chart]\npaths = ["load.vertical", "a.b"]\n',
        "no parameter 'a.b'",
    ),
    "rows": (
        FORCED + "[stability_chart]\nrows = 0\n",
        "stability_chart.rows must lie in [1, 1e+07], got 0",
    ),
    "later": (
        FORCED + "[simulate]\nperiods = 2\n" + BASINS + "tol = 1\n",
        "basins.tol must lie in",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_question_without_meaning_is_refused_before_anything_is_computed(
    name, refused, study, tmp_path, monkeypatch
):
    text, problem = REFUSED[name]
    for place in (
        "flow.motion.simulate:simulate",
        "studies.portrait:simulate",
        "flow.long_time.recurrence:simulate_many",
    ):
        module, function = place.split(":")
        monkeypatch.setattr(
            importlib.import_module(f"saltus.{module}"),
            function,
            lambda *args, **options: pytest.fail("it began to compute"),
        )
    path = study(text)
    sentence = refused("run", path, "-o", tmp_path / "out")
    assert sentence.startswith(f"saltus: {path}: ")
    assert problem in sentence
    assert not (tmp_path / "out").exists()


def test_an_output_folder_that_cannot_be_is_refused(refused, study, tmp_path):
    path = study(FORCED + CHART)
    assert "study.toml is a file; name another with --output" in refused("run", path, "-o", path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "stability_chart.zarr").write_text("mine")
    assert "stability_chart.zarr is a file; name a store that does not exist yet" in refused(
        "run", path, "-o", tmp_path / "out"
    )
    assert (tmp_path / "out" / "stability_chart.zarr").read_text() == "mine"


def test_the_store_of_another_chart_is_left_alone(saltus, refused, study, tmp_path):
    saltus("run", study(FORCED + CHART), "-o", tmp_path / "out", "--no-plot")
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    text = (FORCED + "[simulate]\nperiods = 1\n" + CHART).replace(
        "amplitude = 0.5", "amplitude = 0.5, phase = 1.0"
    )
    sentence = refused("run", study(text, "other"), "-o", tmp_path / "out")
    assert "stability_chart.zarr is the store of another plan" in sentence
    assert {
        path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()
    } == before


@pytest.mark.parametrize(
    ("address", "asks", "problem"),
    [
        ("here", CHART, "--scheduler must be an address such as tcp://host:8786, got 'here'"),
        ("tcp://127.0.0.1:1", "[attractors]\n", "of which the study has none"),
        (
            "tcp://127.0.0.1:1",
            "[simulate]\nperiods = 1\n" + CHART,
            "no Dask scheduler answers at tcp://127.0.0.1:1",
        ),
    ],
)
def test_a_scheduler_that_is_of_no_use_is_refused(
    address, asks, problem, refused, study, tmp_path, monkeypatch
):
    monkeypatch.setattr("saltus.sweep.workers.CLUSTER", ClusterSettings(patience=1.0))
    assert problem in refused(
        "run", study(FORCED + asks), "-o", tmp_path / "out", "--scheduler", address
    )
    assert not (tmp_path / "out").exists()


# --- a real process ----------------------------------------------------------

LONG_CHART = (
    "[stability_chart]\nhorizontal = [0, 0.3]\nvertical = { from = -1, to = -0.1, count = 16"
    " }\nrows = 1\nstarts = 6\n"
)


def test_an_interrupted_chart_goes_on_where_it_was(started, saltus, study, tmp_path):
    path, store = study(FORCED + LONG_CHART), tmp_path / "out" / "stability_chart.zarr"
    command = [sys.executable, "-m", "saltus", "run", path, "-o", tmp_path / "out", "--no-plot"]
    process = started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    for line in process.stderr:
        if re.search(r"[2-9] of 16 chunks", line):
            break
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    sentence = err.splitlines()[-1]
    done = int(re.search(r"interrupted after (\d+) of 16 chunks", sentence)[1])
    assert sentence.endswith(f"{store} keeps them: run the same again to go on")
    assert 2 <= done == status(store).done < 16
    kept = {file: file.read_bytes() for file in store.rglob("*") if file.is_file()}
    assert saltus("run", path, "-o", tmp_path / "out", "--no-plot").exit_code == 0
    assert status(store).complete
    assert {file: file.read_bytes() for file in kept} == kept
    whole = stability_chart(
        load_study(path).system,
        horizontal=[0.0, 0.3],
        vertical=np.linspace(-1, -0.1, 16),
        rows=1,
        starts=6,
    )
    np.testing.assert_array_equal(open_store(store)["amplitude"], whole["amplitude"])


@pytest.mark.parametrize(
    "asks",
    [
        "[attractors]\nstarts = 1000000\n",
        pytest.param("[phase_portrait]\nduration = 1e5\n", marks=pytest.mark.thorough),
    ],
)
def test_an_interrupt_leaves_nothing_half_written(started, study, tmp_path, asks):
    text = CONSTANT if "portrait" in asks else FORCED
    command = [sys.executable, "-m", "saltus", "run", study(text + asks), "-o", tmp_path / "out"]
    process = started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stderr.readline()
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "saltus: interrupted; no file was left half-written"
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
def test_an_interrupted_diagram_leaves_a_store_to_go_on_with(started, study, tmp_path):
    command = [
        sys.executable,
        "-m",
        "saltus",
        "run",
        study(FORCED + "[response_spectrum]\nstarts = 200\n"),
        "-o",
        tmp_path / "out",
    ]
    process = started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    store = tmp_path / "out" / "response_spectrum.zarr"
    while not (store / "parts").exists():
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1].startswith("saltus: interrupted; ")
    assert not status(store).complete
    assert not list((tmp_path / "out").glob("*.nc"))


def test_a_cluster_computes_the_same_chart(saltus, study, tmp_path):
    distributed = pytest.importorskip("distributed")
    path = study(FORCED + CHART + "rows = 2\n")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, processes=False, protocol="tcp"
    ) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tcp://")
        saltus("run", path, "-o", tmp_path / "there", "--no-plot", "--scheduler", address)
    saltus("run", path, "-o", tmp_path / "here", "--no-plot")
    there, here = (
        open_store(tmp_path / name / "stability_chart.zarr") for name in ("there", "here")
    )
    for name in here:
        np.testing.assert_array_equal(there[name], here[name])
