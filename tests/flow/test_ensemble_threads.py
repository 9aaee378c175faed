"""The threads of ensembles are kept: ensembles that run at the same time, within one another or in
a forked process agree.
"""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import saltus
from saltus.systems import Harmonic, Load, Metainterface, System

SYSTEM = System(
    model=Metainterface(beta0=1.4, damping=0.1),
    load=Load(frequency=1.0, horizontal=Harmonic(0.5), vertical=-0.5),
)

FORKED = """
import os
import numpy as np
import saltus
from saltus.systems import System
system = System.from_json({system!r})
def ends():
    return saltus.simulate_many(system, theta=np.linspace(-1, 1, 300), periods=20, threads=2).theta.values
before, child = ends(), os.fork()
if child:
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
else:
    raise SystemExit(0 if np.array_equal(before, ends()) else 1)
"""


def ends(**options):
    return saltus.simulate_many(
        SYSTEM, theta=np.linspace(-1, 1, 300), periods=20, **options
    ).theta.values


def test_ensembles_at_the_same_time_are_those_of_one_after_the_other():
    expected, found = ends(), [np.empty(0)] * 4

    def follow(i):
        found[i] = ends(threads=1 + i % 2)

    threads = [threading.Thread(target=follow, args=(i,)) for i in range(len(found))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for states in found:
        np.testing.assert_array_equal(states, expected)


def test_an_ensemble_runs_while_another_one_reports_its_progress():
    expected, within = ends(), []
    np.testing.assert_array_equal(
        ends(progress=lambda done, what: within or within.append(ends())), expected
    )
    np.testing.assert_array_equal(within[0], expected)


def test_threads_that_are_idle_are_used_again():
    ends(threads=2)
    before = threading.active_count()
    for _ in range(50):
        ends(threads=2)
    # a thread may be asked for just before one is idle
    assert threading.active_count() <= before + 2


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_forked_process_has_threads_of_its_own():
    program = FORKED.format(system=SYSTEM.to_json())
    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True
    )
    assert answer.stdout == "0\n"
