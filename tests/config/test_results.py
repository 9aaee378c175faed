"""`saltus.load` knows what a file is, `to_mat` writes what SciPy reads back, and a notebook shows
results with texts escaped.
"""

import numpy as np
import pytest
import xarray
from scipy.io import loadmat

import saltus
from saltus.config import Study
from saltus.errors import ParameterError
from saltus.files import write_dataset
from saltus.orbits import orbits_of
from saltus.progress import html_table

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.3), vertical=-0.5),
)


@pytest.fixture(scope="module")
def motion():
    return saltus.simulate(SYSTEM, theta=0.3, periods=3)


def test_each_kind_of_file_is_read_as_what_it_is(tmp_path, motion):
    (tmp_path / "system.json").write_text(SYSTEM.to_json())
    assert saltus.load(tmp_path / "system.json") == SYSTEM
    (tmp_path / "study.toml").write_text(SYSTEM.to_toml())
    study = saltus.load(str(tmp_path / "study.toml"))
    assert isinstance(study, Study)
    assert study.system == SYSTEM
    write_dataset(tmp_path / "motion.nc", motion.to_xarray())
    assert saltus.load(tmp_path / "motion.nc").identical(motion.to_xarray())
    store = tmp_path / "chart.zarr"
    chart = saltus.stability_chart(
        SYSTEM, horizontal=[0.1, 0.2], vertical=[-0.5, -0.4], starts=2, periods=60, store=store
    )
    assert saltus.load(store)["amplitude"].equals(chart["amplitude"])


def test_orbits_come_back_from_a_file_that_is_loaded(tmp_path):
    branch = saltus.continue_orbit(
        saltus.find_orbit(SYSTEM, theta=0.1), "load.frequency", (0.95, 1.05)
    )
    write_dataset(tmp_path / "branch.nc", branch.to_xarray())
    again = orbits_of(saltus.load(tmp_path / "branch.nc"))
    assert [orbit.amplitude for orbit in again] == [orbit.amplitude for orbit in branch.orbits]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("nothing.nc", None),
        ("text.nc", b"text"),
        ("bad.json", b"\xff"),
        ("bad.toml", b"="),
        ("x", b""),
    ],
)
def test_what_is_no_file_of_saltus_is_told_in_one_sentence(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ParameterError, match=name) as error:
        saltus.load(tmp_path / name)
    assert "\n" not in str(error.value)


def test_a_motion_in_a_mat_file_has_its_arrays_and_attributes(tmp_path, motion):
    path = saltus.to_mat(tmp_path / "motion", motion)
    assert path == tmp_path / "motion.mat"
    found, data = loadmat(path, squeeze_me=True, struct_as_record=False), motion.to_xarray()
    for name in ("time", "theta", "velocity", "impact_time"):
        assert found[name].tolist() == data[name].values.tolist()
    assert found["attributes"].system == SYSTEM.to_json()
    assert found["attributes"].tol == motion.tol


def test_texts_dots_and_groups_have_matlab_names(tmp_path):
    child = xarray.Dataset(
        {
            "load.frequency": ("x", [1.0, 2.0]),
            "kind": ("x", ["LP", "PD"]),
            "yes": ("x", [True, False]),
        }
    )
    tree = xarray.DataTree.from_dict({"/": xarray.Dataset(attrs={"a b": 3}), "/1st": child})
    found = loadmat(
        saltus.to_mat(tmp_path / "tree.mat", tree), squeeze_me=True, struct_as_record=False
    )
    group = found["x1st"]
    assert group.load_frequency.tolist() == [1.0, 2.0]
    assert group.kind.tolist() == ["LP", "PD"]
    assert group.yes.tolist() == [1, 0]
    assert found["attributes"].a_b == 3
    with pytest.raises(ParameterError, match="become a_b in MATLAB"):
        saltus.to_mat(tmp_path / "two.mat", xarray.Dataset({"a.b": 1.0, "a b": 2.0}))


def test_a_motion_is_arrays_and_a_table_without_ceremony(motion):
    samples = motion.samples(5)
    assert samples.time == pytest.approx(np.linspace(0.0, motion.time, 5))
    assert samples.position[0] == pytest.approx(motion.at(samples.time)[0], abs=0.0)
    table = motion.to_pandas(samples.time)
    assert list(table.columns) == ["theta", "velocity", "side"]
    assert table.index.name == "time"
    assert table["velocity"].to_numpy() == pytest.approx(samples.velocity[0], abs=0.0)
    with pytest.raises(ParameterError, match="count"):
        motion.samples(1)


def test_a_notebook_shows_results_and_escapes_every_text(motion):
    orbit = saltus.find_orbit(SYSTEM, theta=0.1)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.95, 1.05))
    verdict = saltus.classify(SYSTEM, theta=0.3)
    shown = [each._repr_html_() for each in (SYSTEM, motion, orbit, branch, verdict)]
    for text, known in zip(
        shown, ("load.frequency", "theta", "multipliers", "points", "periodic"), strict=True
    ):
        assert known in text
        assert text.startswith("<div>")
        assert text.count("<table>") == text.count("</table>") == 1
    bad = html_table("<script>", {"<b>": "<img src=x onerror=alert(1)>", "&": 1.0})
    assert "<script>" not in bad
    assert "<img" not in bad
    assert "<b>" not in bad


def test_progress_is_one_line_that_ends(capsys):
    for fraction in (0.0, 0.5, 1.0):
        saltus.show_progress(fraction, "motions")
    text = capsys.readouterr().err
    assert text.count("\n") == 1
    assert text.endswith("100 % " + "motions".ljust(40) + "\n")


def test_stops_have_names():
    many = saltus.simulate_many(SYSTEM, theta=[0.0, 0.3], periods=2)
    assert set(saltus.stop_names(many).values) <= {str(stop) for stop in saltus.Stop}


def test_what_is_saved_is_loaded_again_and_an_own_dataset_gets_the_version(tmp_path, motion):
    path = saltus.save(tmp_path / "there" / "motion", motion)
    assert path.name == "motion.nc"
    assert saltus.load(path).identical(motion.to_xarray())
    own = xarray.Dataset({"y": ("x", [1.0, 2.0])})
    for data in (own, xarray.DataTree.from_dict({"/": own, "/below": own})):
        back = saltus.load(saltus.save(tmp_path / "own.nc", data))
        assert back.attrs == {"saltus_version": saltus.__version__}
        assert not data.attrs


@pytest.mark.parametrize(
    ("name", "begins"),
    [("p", b"\x89PNG"), ("p.png", b"\x89PNG"), ("p.pdf", b"%PDF"), ("p.svg", b"<?xml")],
)
def test_a_picture_is_saved_in_the_format_of_its_suffix(tmp_path, motion, name, begins):
    first = saltus.save(tmp_path / name, saltus.plot(motion), title="a motion").read_bytes()
    assert first.startswith(begins)
    if name.endswith((".png", ".pdf")):
        assert (
            saltus.save(tmp_path / name, saltus.plot(motion), title="a motion").read_bytes()
            == first
        )


def test_a_system_is_saved_as_a_text_and_loaded_again(tmp_path):
    path = saltus.save(tmp_path / "system", SYSTEM)
    assert path.name == "system.json"
    assert saltus.load(path) == SYSTEM
    with pytest.raises(ParameterError, match=r"must end in \.json"):
        saltus.save(tmp_path / "system.nc", SYSTEM)


def test_texts_are_saved_as_they_are(tmp_path):
    assert saltus.save(tmp_path / "a.txt", "größe\n").read_text(encoding="utf-8") == "größe\n"
    assert saltus.save(tmp_path / "a.txt", b"\x00").read_bytes() == b"\x00"


@pytest.mark.parametrize(
    ("path", "result", "said"),
    [
        ("a.nc", 5, "result must be"),
        ("", "text", "path must name a file"),
        ("file/a.txt", "text", "cannot be written"),
        ("a.xyz", "motion", "must end in .nc, as a result becomes netCDF; `to_csv` writes tables"),
        ("a.xyz", "figure", "must end in .png, .pdf or .svg"),
        (5, "text", "path must"),
    ],
)
def test_what_cannot_be_saved_is_refused(tmp_path, monkeypatch, motion, path, result, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ParameterError, match=said):
        saltus.save(path, {"figure": saltus.plot(motion), "motion": motion}.get(result, result))
