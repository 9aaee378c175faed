"""What mypy sees of a call: a misspelt keyword of `simulate` that would be read as a coordinate."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = """import numpy as np
import saltus
system = saltus.System(model=saltus.WallOscillator(), load=saltus.Load(frequency=1.0))
"""
RIGHT = (
    "saltus.simulate(system, x=0.1, periods=3)",
    "saltus.simulate(system, x=0.1, duration=3.0, tol=1e-10, stop_at=('contact',))",
    "saltus.simulate(system, x=0.1, velocity=(0.5,), duration=3.0)",
    "saltus.classify(system, x=0.1, velocity=np.zeros(1))",
    "saltus.simulate_many(system, x=np.zeros(3), periods=3)",
    "saltus.simulate(system, theta=0.1, theta_2=0.1, phi=1.0, tip=2.0, x_1=1.0, periods=3)",
)
MISSPELT = (
    "saltus.simulate(system, x=0.1, perods=3)",
    "saltus.simulate(system, x=0.1, durration=3.0)",
    "saltus.simulate(system, x=0.1, periods=3, stop_att=('contact',))",
    "saltus.simulate(system, x=0.1, periods=3, duration=3.0)",
    "saltus.simulate(system, x=0.1, periods=3, velocty=0.3)",
    "saltus.simulate(system, x=0.1, periods=3, toll=1e-9)",
    "saltus.simulate(system, x=0.1, duration=3.0, tme=0.5)",
    "saltus.simulate(system, x=0.1, duration=3.0, dens=False)",
    "saltus.find_orbit(system, x=0.1, sied=1)",
    "saltus.classify(system, x=0.1, seeed=1)",
    "saltus.page(system, x=0.1, velociti=0.2)",
    "saltus.simulate(system, x=0.1, periods=3, velocity='fast')",
    "saltus.simulate(system, x=0.1, periods=3, tol='tight')",
    "saltus.simulate(system, x=0.1, periods=3, time='now')",
    "saltus.simulate(system, x=0.1, periods=3, side='left')",
    "saltus.simulate(system, x=0.1, periods=3, dense='no')",
    "saltus.classify(system, x=0.1, velocity='fast')",
)


def test_a_misspelt_keyword_of_simulate_is_seen(tmp_path):
    pytest.importorskip("mypy")
    script = tmp_path / "calls.py"
    script.write_text(SCRIPT + "\n".join((*RIGHT, *MISSPELT)) + "\n")
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-error-summary", str(script)],
        cwd=ROOT,  # with the settings and the cache of `make lint`
        capture_output=True,
        text=True,
        check=False,
    )
    seen = {int(line.split(":")[1]) for line in checked.stdout.splitlines() if ": error: " in line}
    first = len(SCRIPT.splitlines()) + len(RIGHT) + 1
    assert seen == set(range(first, first + len(MISSPELT))), checked.stdout + checked.stderr
