"""A diagram that cannot be made is refused in a sentence, before anything is computed; an
interrupted one leaves no file.
"""

import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from shared_systems import forced
from study_cases import AMPLITUDE, FREQUENCY

from saltus import bifurcation_diagram, response_spectrum
from saltus.errors import ParameterError
from saltus.studies.diagram.diagram_search import DiagramSearch
from saltus.systems import Load, Metainterface, System

UNFORCED = System(model=Metainterface(beta0=1.4), load=Load(vertical=-0.5))
GOOD = {"path": FREQUENCY, "bounds": (0.5, 1.5)}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"path": "load.frequenzy"}, "no parameter 'load.frequenzy'.*load.frequency"),
        ({"path": "model"}, "model is not a number"),
        ({"path": ""}, "no parameter ''"),
        ({"bounds": (1.5, 0.5)}, "smaller one first"),
        ({"bounds": (1.0, 1.0)}, "smaller one first"),
        ({"bounds": (0.5, math.nan)}, "smaller one first"),
        ({"bounds": (0.5, math.inf)}, "smaller one first"),
        ({"bounds": 2.0}, "two numbers"),
        ({"bounds": (0.0, 1.0)}, "frequency must lie in"),
        ({"bounds": (-1.0, 1.0)}, "frequency must lie in"),
        ({"path": "model.beta0", "bounds": (1.0, 4.0)}, "beta0 must lie in"),
        ({"path": "impact.e", "bounds": (0.5, 1.5)}, "e must lie in"),
        ({"max_period": 0}, "max_period must lie in"),
        ({"max_period": 2.5}, "max_period must be a whole number"),
        ({"max_period": "six"}, "max_period must be a whole number"),
        ({"starts": 0}, "starts must lie in"),
        ({"starts": "many"}, "starts must be a whole number"),
        ({"effort": "standart"}, "did you mean 'standard'"),
        ({"effort": 3}, "there is no effort"),
        ({"seed": -1}, "seed must lie in"),
        ({"repelling": -1}, "repelling must lie in"),
        ({"step": 0.0}, "step must lie in"),
        ({"step": -0.1}, "step must lie in"),
        ({"step": math.nan}, "step must lie in"),
        ({"values": [2.0]}, "values must lie within the bounds.*got 2"),
        ({"values": [math.nan]}, "values must lie within the bounds"),
        ({"values": []}, "values must be numbers"),
        ({"values": 1.0}, "values must be numbers"),
        ({"values": ["a"]}, "values must be numbers"),
        ({"window": 1.0}, "window must be"),
        ({"window": ((1.0, -1.0), (-1.0, 1.0))}, "window must be"),
        ({"window": ((-1.0, math.inf), (-1.0, 1.0))}, "window must be"),
        ({"progress": 3}, "progress must be a function"),
    ],
)
def test_a_diagram_without_meaning_is_refused_in_a_sentence(changes, sentence, monkeypatch):
    monkeypatch.setattr(
        DiagramSearch, "simulate", lambda *args, **options: pytest.fail("it began to compute")
    )
    with pytest.raises(ParameterError, match=sentence) as refusal:
        response_spectrum(forced(1.0), **{**GOOD, **changes})
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 300


def test_what_is_no_system_or_has_no_forcing_is_refused():
    with pytest.raises(ParameterError, match=r"System\(model"):
        response_spectrum(forced(1.0).model)
    with pytest.raises(ParameterError, match="frequency"):
        response_spectrum(UNFORCED)
    with pytest.raises(ParameterError, match="without a frequency"):
        bifurcation_diagram(UNFORCED, "load.vertical", (-1.0, -0.5))


def test_an_unknown_option_is_named():
    with pytest.raises(ParameterError, match="max_periods"):
        response_spectrum(forced(1.0), max_periods=3)


def test_an_error_in_the_progress_ends_the_diagram():
    def fail(share, what):
        if share > 0:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        bifurcation_diagram(
            forced(1.0), AMPLITUDE, (0.4, 0.6), max_period=1, values=[0.5], starts=2, progress=fail
        )


PROGRAM = """
import signal, sys
sys.path[:0] = {tests!r}
from shared_systems import forced
from study_cases import FREQUENCY
from saltus.files import write_dataset
from saltus import response_spectrum

def heard(share, what, times=[]):
    times += [what] * what.startswith({when!r})
    # its modules are imported by then: Python may lose a signal while it imports
    if len(times) > 1:
        print("ready", flush=True)

signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell's background jobs are started without
try:
    write_dataset({path!r}, response_spectrum(forced(1.0), FREQUENCY, (0.3, 3.0), starts=30, max_period=3, progress=heard))
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.parametrize(
    "when", ["searching", pytest.param("following", marks=pytest.mark.thorough)]
)
def test_ctrl_c_leaves_nothing_half_written(when, tmp_path):
    program = PROGRAM.format(
        tests=[str(Path(__file__).parent), str(Path(__file__).parents[1])],
        when=when,
        path=str(tmp_path / "spectrum.nc"),
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    ) as process:
        patience = threading.Timer(200.0, process.kill)
        patience.start()
        try:
            assert process.stdout.readline() == "ready\n"
            time.sleep(0.2)
            os.kill(process.pid, signal.SIGINT)
            begin = time.monotonic()
            answers = process.stdout.read().split()
            took = time.monotonic() - begin
        finally:
            patience.cancel()
            process.kill()
    assert answers[-1] == "interrupted"
    assert took < 20.0
    assert list(tmp_path.iterdir()) == []
