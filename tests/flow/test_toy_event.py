"""A dry run: how many files a new kind of event takes, from the kernel to a plot."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import saltus

MOST_FILES = 10
# A peak: the first coordinate has a maximum on a smooth arc. In each file, what is put behind which
# of its lines.
PEAK = {
    "flow/kernel/layout.py": {
        "    CROSSING = 10\n": "    CROSSING = 10\n    PEAK = 11\n",
        "    RESET_SLOPES = 11": "    RESET_SLOPES = 12",
    },
    "flow/motion/events.py": {
        '    CROSSING = "crossing"': '    CROSSING = "crossing"\n    PEAK = "peak"\n    # once'
    },
    "flow/one_contact/kernel.py": {
        "    tau = first * h if hit >= 0 else h\n": (
            """\
    tau = first * h if hit >= 0 else h
    if motion.velocity_series[0, 0] > 0.0:
        top = margin_root(motion.velocity_series[0], order, h, poly) * h
        if top < tau:
            record_event(motion, EventCode.PEAK, 0, t + top, 0.0, 0.0)
"""
        )
    },
    "flow/motion/motion.py": {
        '    dataset.attrs = {"title": "motion computed by saltus"': (
            """\
    dataset["peak_time"] = ("peak", motion.events.of(EventKind.PEAK).times, {"units": "1"})
    dataset.attrs = {"title": "motion computed by saltus\""""
        )
    },
    "plots/motion.py": {
        "    limit = _limit_angle(dataset)\n": (
            """\
    for peak in dataset["peak_time"].values:
        history.axvline(peak, gid="peak")
    limit = _limit_angle(dataset)
"""
        )
    },
}
MOTION = """
import dataclasses, math, sys
import matplotlib
matplotlib.use("agg")
import numpy as np
import saltus

assert saltus.__file__.startswith(sys.argv[1]), saltus.__file__

@dataclasses.dataclass(frozen=True, kw_only=True)
class Spring(saltus.Model):
    coordinates = ("x",)
    def acceleration(self, t, x, velocity, side, load):
        return -x

motion = saltus.simulate(saltus.System(model=Spring(), load=saltus.Load()), x=0.0, velocity=1.0, duration=20.0)
peaks = motion.events.of(saltus.EventKind.PEAK)
assert np.allclose(peaks.times, math.pi / 2 + 2 * math.pi * np.arange(3), rtol=1e-10), peaks.times
assert str(peaks[0].kind) == "peak"
panels = saltus.plot(motion)
lines = [line for line in np.ravel(panels)[0].get_lines() if line.get_gid() == "peak"]
assert np.allclose([line.get_xdata()[0] for line in lines], peaks.times), lines
print(len(peaks), "peaks")
"""


def changed():
    """The text of each file with the new kind of event."""
    for name, changes in PEAK.items():
        text = (Path(saltus.__file__).parent / name).read_text()
        for line, more in changes.items():
            assert text.count(line) == 1, f"{name}: {line}"
            text = text.replace(line, more)
        yield name, text


def test_a_new_kind_of_event_takes_few_files():
    """The files are those of the dry run below, and each still has the lines behind which it puts
    something.
    """
    assert len(PEAK) <= MOST_FILES
    for name, text in changed():
        compile(text, name, "exec")


@pytest.mark.thorough
def test_a_new_kind_of_event_comes_from_the_kernel_to_a_plot(tmp_path):
    """x'' = -x from x = 0, x' = 1 is sin t, whose maxima are at pi/2 + 2 pi n."""
    shutil.copytree(
        Path(saltus.__file__).parent,
        tmp_path / "saltus",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    for name, text in changed():
        (tmp_path / "saltus" / name).write_text(text)
    command = [sys.executable, "-c", MOTION, str(tmp_path)]
    done = subprocess.run(
        command,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "3 peaks\n", done.stderr
