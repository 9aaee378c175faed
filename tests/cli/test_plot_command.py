"""`saltus plot`: a picture of every kind of result again, and what is no result."""

import sys

import numpy as np
import pytest
import xarray

from saltus.config import open_result
from saltus.sweep import Plan, Variable, run
from saltus.sweep import store_files as files

MODEL = '[model]\ntype = "Metainterface"\nbeta0 = "80 deg"\ndamping = 0.1\n'
FORCED = MODEL + "[load]\nfrequency = 1.0\nhorizontal = { amplitude = 0.5 }\nvertical = -0.5\n"
ASKS = {
    "motion": "[simulate]\ntheta = 0.3\nperiods = 3\n",
    "phase_portrait": "[phase_portrait]\nstarts = [[0.3, 0.0]]\nduration = 2\n",
    "bifurcation_diagram": (
        "[bifurcation_diagram]\nbounds = [0.4, 0.5]\nmax_period = 1\nvalues = [0.45]\nstarts = 4\n"
        "bands = false\n"
    ),
    "attractors": "[attractors]\nstarts = 8\n",
    "basins": "[basins]\ntheta = [-1, 0, 1]\nvelocity = [0, 1]\n",
    "stability_chart": "[stability_chart]\nhorizontal = [0.1, 0.3]\nvertical = [-1.9, -0.5]\n",
}
LONGEST = ("bifurcation_diagram", "stability_chart", "attractors", "phase_portrait")


@pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, marks=pytest.mark.thorough if kind in LONGEST else ()) for kind in ASKS],
)
def test_every_kind_of_result_is_drawn_again_as_it_was(kind, saltus, tmp_path):
    system = FORCED if kind != "phase_portrait" else MODEL + "[load]\nvertical = -0.5\n"
    (tmp_path / "study.toml").write_text(system + ASKS[kind])
    assert saltus("run", tmp_path / "study.toml", "-o", tmp_path / "out").exit_code == 0
    store = tmp_path / "out" / f"{kind}.{'zarr' if kind == 'stability_chart' else 'nc'}"
    result = saltus("plot", store, "-o", tmp_path / "again")
    assert result.stdout == f"The picture is in {tmp_path / 'again'}: {kind}.png, {kind}.pdf\n"
    first, second = (tmp_path / folder / f"{kind}.png" for folder in ("out", "again"))
    assert first.read_bytes() == second.read_bytes()


def test_a_chart_from_its_store_shows_where_motions_pass_the_straight_line(saltus, tmp_path):
    (tmp_path / "study.toml").write_text(FORCED + ASKS["stability_chart"])
    saltus("run", tmp_path / "study.toml", "-o", tmp_path, "--no-plot")
    chart = open_result(tmp_path / "stability_chart.zarr")
    assert chart["amplitude"].sel(vertical=-1.9).max() > np.pi - np.deg2rad(80)
    np.testing.assert_array_equal(chart["beyond_line"], chart["amplitude"] > np.pi - np.deg2rad(80))


def netcdf(path, attrs=None, **variables):
    xarray.Dataset(variables, attrs=attrs).to_netcdf(path, engine="h5netcdf")


def test_numbers_that_no_axis_can_hold_are_refused(refused, tmp_path):
    netcdf(tmp_path / "huge.nc", {"kind": "motion"}, theta=("time", [0.0, -1e308, 1e308]))
    sentence = refused("plot", tmp_path / "huge.nc")
    assert (
        sentence
        == f"saltus: {tmp_path / 'huge.nc'} cannot be drawn: theta has numbers above 1e+100 in size"
    )


def test_what_is_no_result_is_told(refused, tmp_path):
    (tmp_path / "text.nc").write_text("no netCDF")
    (tmp_path / "empty.nc").touch()
    (tmp_path / "folder").mkdir()
    netcdf(tmp_path / "foreign.nc", rain=("day", [1.0, 2.0]))
    netcdf(tmp_path / "other.nc", {"kind": "rain fall"}, rain=("day", [1.0, 2.0]))
    (tmp_path / "cut.nc").write_bytes((tmp_path / "foreign.nc").read_bytes()[:700])
    for name, problem in (
        ("nothing.nc", "there is no file or folder"),
        ("text.nc", "is not a readable netCDF file"),
        ("empty.nc", "is not a readable netCDF file"),
        ("cut.nc", "is damaged: it has 700 bytes, and its data end at"),
        ("folder", "is not a store: it has no zarr.json"),
        ("foreign.nc", "it does not say of what kind it is; it draws attractors, "),
        ("other.nc", "its kind is 'rain fall'"),
    ):
        assert problem in refused("plot", tmp_path / name)


def test_a_file_without_a_checksum_is_drawn_and_said_to_be_unchecked(saltus, tmp_path):
    """A user's own program read a motion and wrote it again; drawn beside the same motion as saltus
    wrote it.
    """
    (tmp_path / "study.toml").write_text(FORCED + ASKS["motion"])
    assert saltus("run", tmp_path / "study.toml", "-o", tmp_path / "out").exit_code == 0
    with xarray.open_dataset(tmp_path / "out" / "motion.nc") as data:
        data.to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    for path, unchecked in ((tmp_path / "out" / "motion.nc", False), (tmp_path / "mine.nc", True)):
        drawn, verified = saltus("plot", path), saltus("status", "--verify", path)
        assert (drawn.exit_code, verified.exit_code) == (0, 0)
        for said in (drawn.stderr, verified.stdout):
            assert (
                "has no checksum" in said and "damage to its numbers cannot be excluded" in said
            ) == unchecked
    assert (tmp_path / "mine.png").read_bytes() == (tmp_path / "out" / "motion.png").read_bytes()


def test_a_file_that_opens_only_half_is_told_without_a_traceback(refused, tmp_path, monkeypatch):
    """As h5netcdf leaves a file that it could not open to the end: an object that fails when it is
    deleted.
    """

    class HalfOpen:
        def __del__(self) -> None:
            raise AttributeError("it has no handle to close")

    def open_half(*_, **__):
        file = HalfOpen()  # the frame of the error keeps it
        raise OSError(f"truncated file {file}")

    failed: list = []
    hook = failed.append
    monkeypatch.setattr(sys, "unraisablehook", hook)
    monkeypatch.setattr(xarray, "open_datatree", open_half)
    (tmp_path / "damaged.nc").write_bytes(b"damaged")
    assert "is not a readable netCDF file" in refused("plot", tmp_path / "damaged.nc")
    assert not failed
    assert sys.unraisablehook is hook


@pytest.mark.parametrize("kind", ASKS)
def test_a_result_that_lacks_what_its_kind_has_is_told(kind, refused, tmp_path):
    netcdf(tmp_path / "broken.nc", {"kind": kind}, x=("day", [1.0]))
    assert f"of the kind '{kind}', but it cannot be drawn (" in refused(
        "plot", tmp_path / "broken.nc"
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.nc"]


def test_a_picture_is_beside_its_data_unless_another_folder_is_named(saltus, tmp_path, monkeypatch):
    (tmp_path / "study.toml").write_text(FORCED + ASKS["motion"])
    saltus("run", tmp_path / "study.toml", "-o", tmp_path, "--no-plot")
    monkeypatch.chdir(tmp_path)
    assert saltus("plot", "motion.nc").stdout == "The picture is in .: motion.png, motion.pdf\n"


def test_a_picture_s_name_in_the_place_of_a_folder_is_refused(refused, tmp_path):
    """It would become a folder with the name of a picture."""
    said = refused("plot", tmp_path / "motion.nc", "-o", tmp_path / "mine.png")
    assert "--output names a folder, in which the picture is motion.png" in said
    assert not (tmp_path / "mine.png").exists()


def test_a_folder_that_cannot_be_written_to_is_told(refused, tmp_path):
    netcdf(tmp_path / "a.nc", {"kind": "motion"}, x=("day", [1.0]))
    assert "a.nc is a file; name another with --output" in refused(
        "plot", tmp_path / "a.nc", "-o", tmp_path / "a.nc"
    )


def squares(arguments, block):
    return {"c": block["a"] ** 2}


def plan(kind):
    variables = {"c": Variable()}
    return Plan(
        function=f"{__name__}:squares",
        axes={"a": np.arange(4.0)},
        chunk={"a": 2},
        variables=variables,
        attrs={"kind": kind},
    )


def test_sweeps_that_have_no_picture_are_told(refused, tmp_path):
    run(plan("stability_chart"), tmp_path / "half.zarr")
    files.chunk_file(tmp_path / "half.zarr", "c", (1,), 0).unlink()
    assert "half.zarr has 1 of 2 chunks; run the sweep again to complete it" in refused(
        "plot", tmp_path / "half.zarr"
    )
    run(plan("basin_cells"), tmp_path / "basins.zarr")
    assert "read basins.nc in the same folder" in refused("plot", tmp_path / "basins.zarr")
    run(plan("squares"), tmp_path / "mine.zarr")
    assert "its kind is 'squares'" in refused("plot", tmp_path / "mine.zarr")
