"""What docs/sweeps.md shows runs, and gives what theory says."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from saltus.sweep import status

PAGE = Path(__file__).parents[2] / "docs" / "sweeps.md"


def test_the_example_gives_the_peak_of_a_damped_oscillator(tmp_path, monkeypatch):
    sweep, function = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.S)
    (tmp_path / "numbers_of_mine.py").write_text("import numpy as np\n\n\n" + function)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(sweep, names)
    dataset, damping = names["dataset"], 0.1
    assert float(dataset["peak"].max()) == pytest.approx(1 / (2 * damping * math.sqrt(1 - damping**2)), rel=1e-3)
    np.testing.assert_array_equal(dataset["first"][..., 1], dataset["peak"] / 2)
    assert status("peaks.zarr").total == 30
