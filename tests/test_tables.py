"""Tables of results: long, never a product of unrelated dimensions, numbers exact, and what a
notebook shows.
"""

import csv
import io
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import saltus
from saltus import checks, progress
from saltus.errors import ParameterError

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
)


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture(scope="module")
def branch():
    return saltus.continue_orbit(
        saltus.find_orbit(SYSTEM, theta=0.3), "load.frequency", (0.85, 1.05)
    )


@pytest.fixture(scope="module")
def motion():
    return saltus.simulate(SYSTEM, theta=0.3, periods=3)


def test_a_branch_has_a_row_for_each_point_and_never_their_product_with_other_dimensions(branch):
    data = branch.to_xarray()
    assert np.prod(list(data.sizes.values())) > 10 * data.sizes["point"]
    table = saltus.to_pandas(branch)
    assert len(table) == data.sizes["point"] == len(branch.points)
    assert list(table.parameter) == list(branch.parameters)
    assert len(saltus.to_pandas(branch, "special")) == len(branch.special)
    with pytest.raises(
        ParameterError, match=r"there is no table 'specials'; did you mean 'special'\?"
    ):
        saltus.to_pandas(branch, "specials")


def test_an_ensemble_has_a_row_for_each_motion_and_stops_are_words():
    theta, size = xr.DataArray([0.1, 0.2, 0.3], dims="a"), xr.DataArray([0.02, 0.5], dims="b")
    ends = saltus.simulate_many(
        SYSTEM,
        theta=theta,
        parameters={"load.horizontal.amplitude": size},
        periods=60,
        until=["rest"],
    )
    table = saltus.to_pandas(ends)
    assert len(table) == 6
    for _, row in table.iterrows():
        own = ends.isel(a=int(row.a), b=int(row.b))
        assert (row.theta, row.start_theta, row.impact_count) == (
            float(own.theta),
            float(own.start_theta),
            int(own.impact_count),
        )
        assert row.stop == str(saltus.stop_names(own).values)
    stops = saltus.stop_names(ends)
    assert stops.dims == ("a", "b")
    assert set(stops.sel(b=0).values) == {"captured"}


def test_a_grid_of_ones_own_has_a_row_for_each_point_whatever_its_number_of_names(tmp_path):
    def place(a, b, c):
        return 100 * a + 10 * b + c

    axes = {"a": [1.0, 2.0], "b": [3.0, 4.0, 5.0], "c": [6.0, 7.0]}
    for count in (1, 2, 3):
        rest = {"b": 0.0, "c": 0.0} if count == 1 else {"c": 0.0} if count == 2 else {}
        chosen = dict(list(axes.items())[:count])
        found = saltus.map_over(lambda rest=rest, **point: place(**point, **rest), chosen)
        with saltus.to_csv(tmp_path / "found.csv", found).open() as file:
            rows = [
                {name: float(row[name]) for name in (*chosen, "value")}
                for row in csv.DictReader(file)
            ]
        assert len(rows) == np.prod([len(values) for values in chosen.values()])
        for row in rows:
            value = row.pop("value")
            assert value == place(**row, **rest)


def test_arrays_at_the_points_of_a_grid_are_columns_or_a_table_of_their_own():
    def several(a, b):
        return {"sum": a + b, "powers": [a, a * a], "square": np.full((2, 2), a)}

    found = saltus.map_over(several, {"a": [2.0, 3.0], "b": [0.0, 1.0]})
    table = saltus.to_pandas(found)
    assert table.columns.to_list() == ["a", "b", "sum", "powers_0", "powers_1"]
    assert table.powers_1.to_list() == [4.0, 4.0, 9.0, 9.0]
    assert saltus.to_pandas(found, "square").square.to_list() == [2.0] * 8 + [3.0] * 8
    with pytest.raises(
        ParameterError, match=r"there is no table 'squares'; did you mean 'square'\?"
    ):
        saltus.to_pandas(found, "squares")
    alone = saltus.to_pandas(saltus.map_over(lambda a: np.full((2, 2), a), {"a": [2.0, 3.0]}))
    assert alone.value.to_list() == [2.0] * 4 + [3.0] * 4


def test_sweeps_basins_and_attractors_along_a_parameter_have_a_row_for_each_of_their_cells():
    sweep = saltus.frequency_sweep(SYSTEM, [0.95, 1.0, 1.05], theta=0.3)
    table = saltus.to_pandas(sweep)
    assert len(table) == 6
    for _, row in table.iterrows():
        assert row.amplitude == float(sweep.amplitude.sel(direction=row.direction, value=row.value))
        assert row.hysteresis == int(sweep.hysteresis.sel(value=row.value))
    basins = saltus.basins_of_attraction(SYSTEM, theta=[-0.5, 0.0, 0.5], velocity=[-0.5, 0.5])
    table = saltus.to_pandas(basins)
    assert len(table) == 6
    for _, row in table.iterrows():
        assert row.time == float(basins.time.sel(theta=row.theta, velocity=row.velocity))
    assert saltus.to_pandas(basins, "attractor").cells.to_list() == basins.cells.values.tolist()
    along = saltus.attractors_along(SYSTEM, "load.frequency", [1.0, 1.05], starts=4)
    table = saltus.to_pandas(along)
    assert len(table) == 2 * along.sizes["attractor"]
    assert list(table.amplitude) == along.amplitude.values.ravel().tolist()


def test_a_diagram_has_the_tables_of_its_parts():
    diagram = saltus.bifurcation_diagram(
        SYSTEM, bounds=(0.85, 0.95), max_period=1, values=[0.9], starts=4, bands=False
    )
    table = saltus.to_pandas(diagram)
    assert len(table) == diagram["points"].sizes["point"]
    assert list(table.amplitude) == diagram["points"]["amplitude"].values.tolist()
    assert len(saltus.to_pandas(diagram, "special")) == diagram["special"].sizes["special"]
    with pytest.raises(ParameterError, match="there is no table 'specal'"):
        saltus.to_pandas(diagram, "specal")


def test_comma_separated_text_has_every_digit(branch, motion, tmp_path):
    path = saltus.to_csv(tmp_path / "branch.csv", branch)
    with path.open() as file:
        assert [float(row["parameter"]) for row in csv.DictReader(file)] == list(branch.parameters)
    with motion.impacts.to_csv(tmp_path / "impacts.csv").open() as file:
        assert [float(row["time"]) for row in csv.DictReader(file)] == motion.impacts.time.tolist()
    assert branch.to_csv(tmp_path / "again.csv").read_bytes() == path.read_bytes()


def test_each_column_of_comma_separated_text_has_a_name(branch, motion, tmp_path):
    sweep = saltus.frequency_sweep(SYSTEM, [0.95, 1.0], theta=0.3)
    for number, result in enumerate((branch, branch.special, motion, motion.events, sweep)):
        lines = saltus.to_csv(tmp_path / f"{number}.csv", result).read_text().splitlines()
        names = lines[0].split(",")
        assert all(names)
        assert len(lines[1].split(",")) == len(names)
        assert len(lines) == 1 + len(saltus.to_pandas(result))


def test_events_impacts_and_special_points_are_tables(branch, motion):
    events = motion.events.to_pandas()
    assert list(events.time) == motion.events.times.tolist()
    assert list(events.kind) == [str(event.kind) for event in motion.events]
    assert list(motion.impacts.to_pandas().velocity_after) == motion.impacts.velocity_after.tolist()
    assert list(branch.special.to_pandas().kind) == [str(point.kind) for point in branch.special]
    several = saltus.System(
        model=saltus.TwoStops(),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(1.0)),
        impact=saltus.NewtonImpact(0.5),
    )
    stops = saltus.simulate(several, x=0.0, periods=3)
    assert set(stops.events.to_pandas().contact) <= {"left", "right"}
    assert len(stops.impacts.to_pandas()) == len(stops.impacts) > 0
    assert not len(saltus.simulate(several, x=0.0, duration=0.1).events.to_pandas())


def test_what_a_notebook_shows_is_a_table_in_html(branch, motion):
    for shown, word in (
        (motion.validity, "kinematic_limit"),
        (branch.special, "line_limit"),
        (branch.special[0], str(branch.special[0].kind)),
        (branch.orbits[0].signature, "period"),
        (motion.impacts, "velocity_before"),
    ):
        html = shown._repr_html_()
        assert html.startswith("<div>")
        assert word in html


def test_a_notebook_shows_each_attractor_and_says_that_a_model_has_no_margins():
    stops = saltus.System(
        model=saltus.TwoStops(left=-5.0, right=5.0, damping=1.0),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.5)),
    )
    html = saltus.find_attractors(stops, starts=4, window=((-0.5, 0.5), (-0.5, 0.5)))._repr_html_()
    for word in (
        "share of the starts",
        "period 1",
        "100 +- 0 %",
        "orbit of period 1: residual",
        "0.5",
    ):
        assert word in html  # at resonance the amplitude is 0.5 / damping
    assert (
        "the model has no margins"
        in saltus.simulate(stops, x=0.1, periods=1).validity._repr_html_()
    )


def test_an_end_of_a_branch_is_shown_as_its_sentence(branch):
    assert repr(branch.ends) == f"({', '.join(f'End({str(end)!r})' for end in branch.ends)})"
    assert "{" not in repr(branch.ends)


def test_progress_in_a_notebook_is_one_line_that_is_written_over(monkeypatch, capsys):
    shown, updates = [], []

    def display(what, display_id):
        shown.append(what)
        return SimpleNamespace(update=updates.append)

    shell = SimpleNamespace(kernel=object())
    notebook = SimpleNamespace(
        get_ipython=lambda: shell, display=SimpleNamespace(HTML=lambda text: text, display=display)
    )
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    for fraction in (0.0, 0.3, 0.7, 1.0):
        saltus.show_progress(fraction, "a < b")
    assert (len(shown), len(updates)) == (1, 3)
    assert "100 % a &lt; b" in updates[-1]
    saltus.show_progress(0.1, "again")
    assert len(shown) == 2
    saltus.show_progress(1.0, "again")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("call", [saltus.simulate, saltus.simulate_many])
def test_long_work_that_nobody_watches_shows_its_progress_in_a_terminal(monkeypatch, call):
    system = saltus.System(model=saltus.WallOscillator(), load=saltus.Load(frequency=1.1))
    asked = {"x": -0.5, "periods": 40_000}
    call(system, x=-0.5, periods=1)
    seen = []
    for after, stream, options in (
        (0.0, Terminal(), {}),
        (0.0, io.StringIO(), {}),  # a file
        (0.0, Terminal(), {"progress": lambda fraction, what: None}),
        (1e9, Terminal(), {}),
    ):
        monkeypatch.setattr(progress, "UNWATCHED", after)
        monkeypatch.setattr(sys, "stderr", stream)
        call(system, **asked, **options)
        seen.append(stream.getvalue())
        asked["x"] -= 0.01  # another motion, as the last one is remembered
    assert "following the motion" in seen[0]
    assert seen[1:] == ["", "", ""]


@pytest.mark.parametrize("read", ["a terminal", "a file", "a helper of a terminal"])
def test_every_long_call_shows_one_line_in_a_terminal(monkeypatch, read):
    orbit = saltus.find_orbit(SYSTEM, theta=0.3)

    def call():
        saltus.continue_orbit(orbit, "load.frequency", (0.95, 1.05))

    stream = io.StringIO() if read == "a file" else Terminal()
    monkeypatch.setattr(progress, "UNWATCHED", 0.0)
    monkeypatch.setattr(progress, "LOOK_INTERVAL", 0.0)
    monkeypatch.setattr(sys, "stderr", stream)
    if read == "a helper of a terminal":
        helper = threading.Thread(target=call)
        helper.start()
        helper.join()
    else:
        call()
    written = stream.getvalue()
    if read == "a terminal":
        assert "100 %" in written.split("\r")[-1]
        assert written.count("\n") == 1
        assert written.endswith("\n")
    else:
        assert written == ""


def test_the_line_of_work_that_fails_is_left(monkeypatch):
    def fails(*, progress=progress.silent):
        progress(0.5, "half")
        raise RuntimeError

    stream = Terminal()
    monkeypatch.setattr(progress, "UNWATCHED", -1.0)
    monkeypatch.setattr(sys, "stderr", stream)
    with pytest.raises(RuntimeError):
        checks.answered(fails)()
    written = stream.getvalue()
    assert "half" in written
    assert "100 %" not in written
    assert written.count("\n") == 1


def test_what_is_no_result_is_refused():
    with pytest.raises(ParameterError, match="result must be a Dataset"):
        saltus.to_pandas(3)
