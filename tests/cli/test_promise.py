"""The promise: whatever kills a run, and whenever, the same command again ends with the same bytes
in every file.
"""

import contextlib
import math
import os
import random
import signal
import subprocess
import sys
import time

import pytest

SYSTEM = """
[model]
type = "Metainterface"
beta0 = "80 deg"
damping = 0.1
[load]
frequency = 1.0
horizontal = { amplitude = 0.5 }
vertical = -0.5
"""
RECORDED = SYSTEM.replace("{ amplitude = 0.5 }", '{ file = "shaking.csv", quantity = "force" }')
OWN = """
[model]
type = "hinged.py:Hinged"
[load]
frequency = 1.5
force = { amplitude = 1.0 }
"""
FILES = {
    "shaking.csv": (
        "time,force\n"
        + "\n".join(f"{0.1 * i},{math.sin(0.13 * i * i):.6f}" for i in range(200))
        + "\n"
    ),
    "hinged.py": (
        """
from dataclasses import dataclass
from saltus import OneContactModel

@dataclass(frozen=True, kw_only=True)
class Hinged(OneContactModel):
    damping: float = 0.3
    coordinates = ("x",)
    channels = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        return load.force(t) - self.damping * velocity - x - 0.2 * side
"""
    ),
}
STUDIES = {
    "motion": "[simulate]\ntheta = 0.3\nperiods = 200\n",
    "portrait": "[phase_portrait]\nduration = 20\n",
    "spectrum": (
        "[response_spectrum]\nbounds = [0.95, 1.05]\nmax_period = 1\nstarts = 4\neffort = 'quick'\n"
    ),
    "attractors": "[attractors]\nstarts = 8\nmax_period = 2\n",
    "basins": (
        "[basins]\ntheta = { from = -1, to = 1, count = 20 }\nvelocity = { from = -1, to = 1, count"
        " = 20 }\nrows = 2\n"
    ),
    "chart": (
        "[stability_chart]\nhorizontal = { from = 0.1, to = 0.5, count = 8 }\n"
        "vertical = { from = -0.9, to = -0.3, count = 8 }\nstarts = 2\nperiods = 60\n"
    ),
    "borders": (
        "[stability_chart]\nhorizontal = { from = 0.1, to = 0.5, count = 4 }\n"
        "vertical = { from = -0.9, to = -0.3, count = 3 }\nstarts = 2\nperiods = 60\ncurves = 1\n"
    ),
    "record": "[simulate]\ntheta = 0.3\nperiods = 60\n",
    "own model": (
        "[stability_chart]\nhorizontal = { from = 0.5, to = 1.0, count = 5 }\n"
        "vertical = { from = 1.4, to = 1.8, count = 6 }\n"
        'paths = ["load.force.amplitude", "load.frequency"]\nstarts = 2\nperiods = 60\nrows = 1\n'
    ),
    "own basins": (
        "[basins]\nx = { from = -1, to = 1, count = 16 }\nvelocity = { from = -1, to = 1, count ="
        " 16 }\nrows = 2\n"
    ),
}
INTERRUPTS = 8  # of each kind of study
# a phase portrait is of a constant load
NO_LOAD = SYSTEM.replace("frequency = 1.0\nhorizontal = { amplitude = 0.5 }\n", "")


def command(folder, kind):
    study, system = (
        folder / "study.toml",
        {"portrait": NO_LOAD, "record": RECORDED}.get(kind, OWN if "own" in kind else SYSTEM),
    )
    study.write_text(system + STUDIES[kind])
    for name, text in FILES.items():
        (folder / name).write_text(text)
    return [sys.executable, "-m", "saltus", "run", str(study), "-o", str(folder / "out")]


def files(folder):
    """The bytes of every file below a folder, those of pictures too."""
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in folder.rglob("*")
        if file.is_file()
    }


def finished(folder, kind):
    """The seconds that a run takes which nothing disturbs, and what it leaves."""
    begun = time.monotonic()
    done = subprocess.run(command(folder, kind), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return time.monotonic() - begun, files(folder / "out")


@pytest.mark.thorough
@pytest.mark.parametrize("kind", STUDIES)
def test_killed_at_random_moments_a_study_ends_with_the_same_bytes(kind, tmp_path):
    """11 kills of each of ten kinds of study; of some of them several hit one after the other,
    before it may end.
    """
    rng, kills = random.Random(kind), int(os.environ.get("SALTUS_KILLS", "11"))
    (tmp_path / "first").mkdir()
    finished(tmp_path / "first", kind)  # compiles what is not there yet
    (tmp_path / "whole").mkdir()
    seconds, whole = finished(tmp_path / "whole", kind)
    assert whole
    assert files(tmp_path / "first" / "out") == whole
    struck, tried = 0, 0
    while struck < kills:  # a run may be over before it is struck
        tried += 1
        folder = tmp_path / f"{tried}"
        folder.mkdir()
        for _ in range(rng.choice((1, 1, 2, 3))):
            process = subprocess.Popen(
                command(folder, kind), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            time.sleep(rng.uniform(0.2, 1.0) * seconds)
            process.send_signal(signal.SIGKILL)
            struck += process.wait() == -signal.SIGKILL
        assert finished(folder, kind)[1] == whole


def _hears_interrupts():
    """A script's background commands, and with them these tests, ignore Ctrl-C from the start."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["motion", "spectrum", "chart", "basins"])
def test_interrupted_at_random_moments_a_study_says_so_and_ends_with_the_same_bytes(kind, tmp_path):
    """Ctrl-C reaches every process of a terminal: one sentence, status 130, no half file; or it
    came too late.
    """
    rng, struck = random.Random(kind), 0
    for name in ("first", "whole"):
        (tmp_path / name).mkdir()
        seconds, whole = finished(tmp_path / name, kind)
    for case in range(INTERRUPTS):
        folder = tmp_path / f"{case}"
        folder.mkdir()
        process = subprocess.Popen(
            command(folder, kind),
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=_hears_interrupts,
        )
        # before, Python itself may not have begun
        time.sleep(0.15 + rng.uniform(0.0, 1.0) * seconds)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGINT)
        said = process.communicate(timeout=60)[1]
        # the last while Python itself ends, when all is written
        assert process.returncode in (0, 130, -signal.SIGINT), said
        assert "Traceback" not in said
        assert (
            process.returncode != 130
            or len([line for line in said.splitlines() if line.startswith("saltus: ")]) == 1
        ), said
        struck += process.returncode == 130
        assert finished(folder, kind)[1] == whole
    assert struck


@pytest.mark.thorough
def test_two_runs_at_once_leave_the_same_bytes(tmp_path):
    (tmp_path / "whole").mkdir()
    _, whole = finished(tmp_path / "whole", "chart")
    (tmp_path / "both").mkdir()
    both = [
        subprocess.Popen(command(tmp_path / "both", "chart"), stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    said = [process.communicate()[1] for process in both]
    codes = sorted(process.returncode for process in both)
    assert codes in ([0, 0], [0, 2])
    assert codes == [0, 0] or any("another run is writing to" in text for text in said)
    assert files(tmp_path / "both" / "out") == whole


@pytest.mark.thorough
def test_a_process_that_compiles_computes_the_same_bytes_as_one_that_loads(tmp_path, monkeypatch):
    """Chaotic motions show the last digit of everything; the lanes are compiled in a cache of their
    own, then loaded from it.
    """
    script = (
        "import hashlib, numpy as np, saltus\nmodel = saltus.Metainterface(beta0=np.deg2rad(80),"
        " damping=0.1)\nload = saltus.Load(frequency=0.5,"
        " horizontal=saltus.Harmonic(amplitude=2.0), vertical=-0.5)\nsystem ="
        " saltus.System(model=model, load=load)\nmany = saltus.simulate_many(system,"
        " theta=np.linspace(-1, 1, 200), velocity=0.1, periods=200, tol=1e-11)\none ="
        " saltus.simulate(system, theta=0.3,"
        " periods=100)\nprint(hashlib.sha256(many['theta'].values.tobytes() +"
        " np.float64(one.theta).tobytes()).hexdigest())\n"
    )
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    runs = [
        subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(3)
    ]
    assert len(set(runs)) == 1
