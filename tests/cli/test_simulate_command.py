"""`saltus simulate`: what it writes, what it says, and what it refuses."""

import math
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from saltus.config import load_study
from saltus.systems import System

EXAMPLES = Path(__file__).parents[2] / "examples"
SYSTEM = '[model]\ntype = "Metainterface"\nbeta0 = "80 deg"\n'
SHORT = (
    SYSTEM + "damping = 0.1\n[load]\nfrequency = 1\nhorizontal = { amplitude = 0.5 }\nvertical ="
    " -0.5\n[simulate]\ntheta = 0.3\n"
)


@pytest.fixture
def study(tmp_path):
    def write(text, name="short"):
        path = tmp_path / f"{name}.toml"
        path.write_text(text)
        return path

    return write


def test_the_files_hold_the_motion(saltus, study, tmp_path):
    path = study(SHORT + "periods = 20\nsamples = 101\n")
    result = saltus("simulate", path, "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert result.stdout.endswith(
        f"Results are in {tmp_path / 'out'}: motion.nc, motion.png, motion.pdf\n"
    )
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "motion.nc",
        "motion.pdf",
        "motion.png",
    ]
    assert (tmp_path / "out" / "motion.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "out" / "motion.pdf").read_bytes().startswith(b"%PDF")
    with xarray.open_dataset(tmp_path / "out" / "motion.nc", engine="h5netcdf") as motion:
        assert motion.sizes["time"] == 101
        np.testing.assert_allclose(motion.time, np.linspace(0, 40 * math.pi, 101), rtol=1e-14)
        # the project's 40-digit reference after 20 periods
        np.testing.assert_allclose(
            motion.theta[-1], -0.235680595299311781821932031456, rtol=0, atol=2e-12
        )
        np.testing.assert_allclose(
            motion.velocity[-1], -1.02103882791726021543767997137, rtol=0, atol=2e-12
        )
        assert motion.sizes["impact"] == 39
        assert motion.theta.attrs["units"] == "rad"
        assert System.from_json(motion.attrs["system"]) == load_study(path).system
        assert motion.attrs["study"] == "short.toml"


def test_the_default_folder_bears_the_studys_name(saltus, study, tmp_path, monkeypatch):
    path = study(SHORT + "duration = 2\n", name="first")
    monkeypatch.chdir(tmp_path)
    assert saltus("simulate", "first.toml", "--no-plot").exit_code == 0
    assert path.exists()
    assert [p.name for p in Path("results/first").iterdir()] == ["motion.nc"]


def test_the_summary_tells_impacts_and_rest(saltus, study, tmp_path):
    text = (
        SYSTEM + 'damping = 0.1\n[load]\nvertical = -0.5\n[impact]\ntype = "VelocityReduction"\ne ='
        " 0.8\n[simulate]\ntheta = 0.3\n"
    )
    out = saltus("simulate", study(text + "duration = 30\n"), "-o", tmp_path, "--no-plot").stdout
    assert "the time asked for, at rest" in out
    assert float(re.search(r"at rest from +([\d.]+)", out)[1]) == pytest.approx(
        17.82077858790958, abs=1e-10
    )  # design/numerics.md
    assert float(re.search(r"theta at the end +(\S+)", out)[1]) == 0.0
    assert re.search(r"other events +1 rest +\n", out)  # the impacts are counted above
    assert re.search(r"kinematic limit +not passed", out)


def test_a_limit_that_is_reached_ends_the_motion(saltus, study, tmp_path):
    text = SYSTEM + '[load]\nhorizontal = 5\n[simulate]\nduration = 50\nstop_at = ["line_limit"]\n'
    out = saltus("simulate", study(text), "-o", tmp_path, "--no-plot").stdout
    assert "a margin of the model reached zero: line_limit" in out
    assert float(re.search(r"theta at the end +([\d.]+)", out)[1]) == pytest.approx(
        math.radians(100), abs=1e-12
    )


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.toml")))
def test_every_example_runs(saltus, tmp_path, name):
    result = saltus("simulate", EXAMPLES / name, "-o", tmp_path, "--no-plot")
    assert result.exit_code == 0, result.stderr


def test_a_motion_that_is_not_unique_is_refused(refused, study, tmp_path):
    path = study(SYSTEM + "[load]\nvertical = 0.5\n[simulate]\nduration = 5\n")
    sentence = refused("simulate", path, "-o", tmp_path / "out")
    assert str(path) in sentence
    assert "is not unique" in sentence
    assert not (tmp_path / "out").exists()


def test_an_impact_without_a_solution_is_refused(refused, study, tmp_path):
    # T+ = T-/2 is below the energy that the ground's own velocity leaves at any theta' (errata 26).
    text = (
        SYSTEM + "[load]\nfrequency = 1\nvertical = -0.5\nground_horizontal = { amplitude = 2"
        " }\n[impact]\n"
    )
    path = study(
        text + 'type = "EnergyRestitution"\nr = 0.01\n[simulate]\ntheta = 0.1\nduration = 20\n'
    )
    assert "no velocity after the impact at time" in refused(
        "simulate", path, "-o", tmp_path / "out"
    )


def test_an_unwritable_folder_is_refused_before_anything_is_computed(
    refused, study, tmp_path, monkeypatch
):
    def compute(*_, **__):
        raise AssertionError("computed")

    monkeypatch.setattr("saltus.flow.simulate", compute)
    (tmp_path / "file").touch()
    sentence = refused("simulate", study(SHORT + "periods = 1\n"), "-o", tmp_path / "file" / "out")
    assert f"{tmp_path / 'file'} is a file; name another with --output" in sentence


def test_a_study_without_settings_is_refused(refused, study, tmp_path):
    assert "has no [simulate]; add one" in refused("simulate", study(SYSTEM), "-o", tmp_path)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (SYSTEM.replace('"80 deg"', '"80 degree s"'), "model.beta0 must be an angle"),
        (SHORT + "periods = 3\nduration = 3\n", "both periods and duration"),
        (SHORT, "simulate needs periods"),
        ("[model", "is not valid TOML"),
    ],
)
def test_bad_studies_end_with_status_2(refused, study, text, problem):
    assert problem in refused("simulate", study(text))


def test_missing_files_and_folders_end_with_status_2(refused, tmp_path):
    assert "there is no such file" in refused("simulate", tmp_path / "none.toml")
    assert "is a folder" in refused("simulate", tmp_path)


def test_a_process_of_its_own_ends_with_status_2_and_no_traceback(study):
    path = study(SYSTEM.replace("beta0", "beta1") + "[simulate]\nduration = 1\n")
    done = subprocess.run(
        [sys.executable, "-m", "saltus", "simulate", path],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == f"saltus: {path}: unknown key model.beta1; did you mean 'beta0'?\n"
    assert done.stdout == ""


def test_an_interrupt_ends_with_status_130_and_leaves_nothing(started, study, tmp_path):
    path = study(SHORT + "periods = 100000000\n")
    command = [sys.executable, "-m", "saltus", "simulate", path, "-o", tmp_path / "out"]
    process = started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stderr.readline() == f"motion of {path}: computing\n"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.strip().splitlines() == ["saltus: interrupted; no file was left half-written"]
    assert out == ""
    assert not (tmp_path / "out").exists()


def test_the_example_model_is_also_a_script():
    subprocess.run(
        [sys.executable, EXAMPLES / "duffing.py"], check=True, timeout=300, capture_output=True
    )


def test_an_operation_that_cannot_be_traced_is_refused(refused, study, tmp_path):
    (tmp_path / "own.py").write_text(
        "from dataclasses import dataclass\nimport numpy as np\nfrom saltus.systems import"
        " Model\n\n@dataclass(frozen=True)\nclass Own(Model):\n    def acceleration(self, t, theta,"
        " velocity, side, load):\n        return -np.floor(theta)\n"
    )
    path = study('[model]\ntype = "own.py:Own"\n[simulate]\nduration = 1\n')
    sentence = refused("simulate", path, "-o", tmp_path / "out")
    assert sentence.startswith(f"saltus: {path}, model: ")
    assert "floor" in sentence


def test_an_interrupt_within_an_exec_ends_with_status_130(started, study, tmp_path):
    """dataclasses and numba exec texts, and Python treats an interrupt there as one that nothing
    has caught.
    """
    wait = (
        "import os, signal, threading; os.kill(os.getpid(), signal.SIGINT);"
        " threading.Event().wait(30)"
    )
    (tmp_path / "own.py").write_text(f"exec({wait!r})\n")
    process = started(
        [sys.executable, "-m", "saltus", "info", study('[model]\ntype = "own.py:Own"\n')],
        stderr=subprocess.PIPE,
    )
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (
        130,
        "saltus: interrupted; no file was left half-written\n",
    )
