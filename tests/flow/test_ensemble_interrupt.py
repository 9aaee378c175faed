"""Ctrl-C ends an ensemble within a second; progress goes from less to 1; memory is what is asked
for.
"""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import saltus
from saltus.flow import stop_names
from saltus.systems import EnergyRestitution, Harmonic, Load, Metainterface, System

SYSTEM = System(
    model=Metainterface(beta0=1.4, damping=0.1),
    load=Load(frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5),
)

ENDLESS = """
import signal
import time
import numpy as np
import saltus
from saltus.systems import Harmonic, Load, Metainterface, System
system = System(model=Metainterface(beta0=1.4, damping=0.1), load=Load(frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5))
saltus.simulate_many(system, theta=np.linspace(-1, 1, 8), periods=1, **{options})
signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell's background jobs are started without
print("ready", flush=True)
try:
    saltus.simulate_many(system, theta=np.linspace(-1, 1, {n}), periods={periods}, **{options})
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("finished", flush=True)
"""


@pytest.mark.parametrize(
    ("n", "periods", "options"),
    [
        pytest.param(200_000, 10_000, "dict()", marks=pytest.mark.thorough),
        (16, 10**9, "dict()"),  # one chunk that never ends
        pytest.param(
            16,
            10**9,
            "dict(threads=1, progress=lambda fraction, what: None)",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_ctrl_c_ends_an_ensemble_at_once(n, periods, options):
    program = ENDLESS.format(n=n, periods=periods, options=options)
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.2)
        os.kill(process.pid, signal.SIGINT)
        begin = time.monotonic()
        patience = threading.Timer(60.0, process.kill)
        patience.start()
        try:
            answer = process.stdout.readline()
            took = time.monotonic() - begin
            process.wait()
        finally:
            patience.cancel()
            process.kill()
    assert answer == "interrupted\n"
    assert took < 10.0  # less than a second on a machine that is not busy


def test_an_error_in_the_progress_ends_the_ensemble():
    def fail(fraction, what):
        raise ZeroDivisionError

    begin = time.monotonic()
    with pytest.raises(ZeroDivisionError):
        saltus.simulate_many(SYSTEM, theta=np.linspace(-1, 1, 64), periods=10**7, progress=fail)
    assert time.monotonic() - begin < 30.0


def test_impacts_that_never_end_do_not_hang():
    """Where the ground moves, T+ = T- takes from two impacts a share of the speed in proportion to
    the speed.
    """
    system = System(
        model=Metainterface(beta0=0.5526761734359283, damping=0.5369641445805373),
        load=Load(
            frequency=0.25669797471010786,
            ground_horizontal=Harmonic(0.5746354777805622),
            vertical=-0.5,
        ),
        impact=EnergyRestitution(1.0),
    )
    begin = time.monotonic()

    def patience(fraction, what):
        if time.monotonic() - begin > 100.0:
            raise TimeoutError

    ensemble = saltus.simulate_many(
        system, theta=0.0, velocity=-0.0004, time=8.0, periods=2, progress=patience
    )
    assert str(stop_names(ensemble).values) in ("unresolved", "horizon")
    assert np.isfinite(ensemble.theta)


def test_progress_grows_to_one():
    fractions = []
    saltus.simulate_many(
        SYSTEM,
        theta=np.linspace(-1, 1, 3000),
        periods=100,
        progress=lambda done, _: fractions.append(done),
        threads=1,
    )
    assert fractions[-1] == 1.0
    assert len(fractions) >= 2
    assert (np.diff(fractions) >= 0).all()
    assert min(fractions) >= 0.0
    assert max(fractions) <= 1.0


def test_progress_counts_a_load_without_periods_too():
    system = System(model=Metainterface(beta0=1.4), load=Load(vertical=-0.5))
    fractions = []
    saltus.simulate_many(
        system,
        theta=np.linspace(0.1, 1, 50),
        duration=2.0,
        progress=lambda done, _: fractions.append(done),
    )
    assert fractions[-1] == 1.0


def test_memory_is_what_is_asked_for():
    """The peak while 60000 trajectories run over 20 periods is that of a few numbers each, not of
    all their periods.
    """
    import tracemalloc

    n = 60_000
    theta = np.linspace(-1, 1, n)
    saltus.simulate_many(SYSTEM, theta=theta[:10], periods=1)
    tracemalloc.start()
    saltus.simulate_many(
        SYSTEM, theta=theta, periods=20, sample=("state", "extrema"), last=2, tol=1e-6
    )
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < n * 8 * 100  # a hundred numbers for each trajectory
