"""`saltus run` on a stability chart with `curves`: the exact borders, the quasi-static one, and
what is said of them.
"""

import re

import numpy as np
import pytest
import xarray as xr

from saltus.theory import critical_horizontal

STUDY = """
[model]
type = "Metainterface"
beta0 = "80 deg"
damping = 0.1

[load]
frequency = 1.0
vertical = -0.5
horizontal.amplitude = 0.05

[stability_chart]
horizontal = { from = 0, to = 0.06, count = 5 }
vertical = { from = -0.9, to = -0.5, count = 3 }
starts = 6
curves = 1
"""


def test_a_chart_with_curves_is_written_said_and_drawn_twice_with_its_borders(saltus, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    done = saltus("run", tmp_path / "study.toml", "-o", tmp_path / "out")
    assert done.exit_code == 0
    said = (
        r"Of (\d+) ends of motions .* (\d+) are located between them, (\d+) are none, .* and "
        r"(\d+) are not explained"
    )
    total, *parts = map(int, re.search(said, done.stdout).groups())
    assert total == sum(parts) > 0
    assert parts[2] == 0
    shown = saltus("status", tmp_path / "out" / "stability_chart.zarr").stdout
    assert re.search(r"ends +1 chunk remembered", shown)
    assert re.search(r"curves +1 chunk remembered", shown)
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {
        "stability_chart.nc",
        "stability_chart.zarr",
        "stability_chart.png",
        "stability_chart.pdf",
    } <= names
    with xr.open_datatree(tmp_path / "out" / "stability_chart.nc", engine="h5netcdf") as tree:
        curve, static = (
            tree["borders/curve_00"].to_dataset().load(),
            tree["static"].to_dataset().load(),
        )
    assert curve.attrs["kind"] == "LP"
    at = np.interp(
        -0.5,
        *(
            curve[name].values[np.argsort(curve["vertical"].values)]
            for name in ("vertical", "horizontal")
        ),
    )
    assert at == pytest.approx(0.0219879514, rel=1e-3)  # issue 5
    inside = static["vertical"].values > -0.9
    expected = critical_horizontal(np.deg2rad(80), static["vertical"].values[inside])
    np.testing.assert_allclose(static["critical"].values[inside], expected)
    assert static["vertical"].values.min() == -0.9
    before = (tmp_path / "out" / "stability_chart.png").read_bytes()
    assert saltus("plot", tmp_path / "out" / "stability_chart.nc", "-o", tmp_path).exit_code == 0
    assert (tmp_path / "stability_chart.png").read_bytes() == before


def test_a_number_of_curves_without_meaning_is_refused_before_anything_runs(refused, tmp_path):
    (tmp_path / "bad.toml").write_text(STUDY.replace("curves = 1", "curves = -1"))
    assert "stability_chart.curves must lie in [0, 1e+07], got -1" in refused(
        "run", tmp_path / "bad.toml", "-o", tmp_path / "bad"
    )
    assert not (tmp_path / "bad").exists()
