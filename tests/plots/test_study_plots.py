"""The pictures of studies show what their datasets hold, and nothing else."""

import functools

import numpy as np
import pytest
import xarray
from matplotlib.colors import same_color

import saltus
from saltus import ParameterError, phase_portrait
from saltus.branch_tables import branch_tables
from saltus.plots import figure_of
from saltus.plots.basins import draw_attractors
from saltus.plots.conventions import LOOK
from saltus.plots.plane import draw_plane
from saltus.plots.response import draw_diagram
from saltus.systems import Load, Metainterface, System


@functools.cache
def portrait(starts=None, H=0.05):
    system = System(
        model=Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=Load(horizontal=H, vertical=-1.5),
    )
    return phase_portrait(
        system, window=((-2.5, 2.5), (-1.5, 1.5)), starts=starts, duration=20.0, samples=500
    )


def drawn(figure, color, marker="None"):
    """The lines of the first axes in a colour, with a marker or without."""
    return [
        line
        for line in figure.axes[0].lines
        if line.get_marker() == marker and same_color(line.get_color(), color)
    ]


def marks(figure, face):
    """The places of the round marks with a face of some colour."""
    round_ = [
        line
        for line in figure.axes[0].lines
        if line.get_marker() == "o" and same_color(line.get_markerfacecolor(), face)
    ]
    return np.concatenate([line.get_xdata() for line in round_])


# --- the phase plane ---------------------------------------------------------


def test_stable_equilibria_are_filled_and_unstable_ones_open():
    data, figure = portrait(), figure_of(draw_plane(portrait()))
    stable = data["stable"].values
    np.testing.assert_array_equal(marks(figure, LOOK.stable), data["equilibrium"].values[stable])
    np.testing.assert_array_equal(marks(figure, "white"), data["equilibrium"].values[~stable])
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {
        "motion",
        "stable equilibrium",
        "unstable equilibrium",
        "separatrix",
    }


def test_motions_that_were_spread_stay_apart():
    """No two of them run on beside one another: few of their points are as near to another motion
    as lines are wide.
    """
    figure = figure_of(draw_plane(portrait()))
    lines = [np.stack(line.get_data(), axis=1) / [5.0, 3.0] for line in drawn(figure, LOOK.stable)]
    assert 8 < len(lines) <= portrait().sizes["motion"]
    near = 0
    for i, line in enumerate(lines):
        others = np.concatenate([other for j, other in enumerate(lines) if j != i])
        others = others[np.isfinite(others).all(axis=1)]
        apart = np.linalg.norm(line[::10, None] - others[None], axis=2).min(axis=1)
        near += int((apart < 0.003).sum())
    assert near < 0.02 * sum(len(line) for line in lines) / 10 + 1


def test_given_motions_are_drawn_whole():
    data = portrait(starts=((0.3, 0.0), (0.301, 0.0)))
    lines = drawn(figure_of(draw_plane(data)), LOOK.stable)
    assert len(lines) == 2
    for line, theta in zip(lines, data["theta"].values, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), theta)


def test_a_closed_motion_is_drawn_closed():
    system = System(model=Metainterface(beta0=np.deg2rad(80)), load=Load(vertical=-1.5))
    figure = figure_of(
        draw_plane(phase_portrait(system, window=((-2.5, 2.5), (-1.5, 1.5)), duration=30.0))
    )
    closed = 0
    for line in drawn(figure, LOOK.stable):
        points = np.stack(line.get_data(), axis=1) / [5.0, 3.0]
        points = points[np.isfinite(points).all(axis=1)]
        later = points[len(points) // 2 :]
        closed += np.linalg.norm(later - points[0], axis=1).min() < 2e-3
    assert closed >= 6


def test_arrows_point_along_the_motion():
    """To the right above the axis and to the left below it: velocity is the rate of the
    coordinate.
    """
    figure = figure_of(draw_plane(portrait()))
    arrows = figure.axes[0].texts
    assert len(arrows) > 10
    for arrow in arrows:
        (x0, _), (x1, v) = arrow.get_position(), arrow.xy
        assert (x1 - x0) * v > 0


# --- diagrams ----------------------------------------------------------------


def diagram(amplitudes=(0.5, 1.0), limits=(1.74, 3.48), parameters=(0.5, 1.0)):
    """A tree as small as they come: one branch without special points, or none."""
    n = len(amplitudes)
    branch = xarray.Dataset(
        {
            "parameter": ("point", np.array(parameters[:n])),
            "amplitude": ("point", np.array(amplitudes)),
            "stable": ("point", np.ones(n, dtype=bool)),
            "impact_count": ("point", np.full(n, 2)),
            **{f"special_{name}": ("special", np.empty(0)) for name in ("parameter", "amplitude")},
            "kind": ("special", np.empty(0, dtype=str)),
        }
    )
    empty = np.empty(0)
    bands = xarray.Dataset(
        dict.fromkeys(("low", "high"), ("band", empty))
        | {"kind": ("band", np.empty(0, dtype="U2"))}
    )
    dots = xarray.Dataset({"parameter": ("dot", empty), "amplitude": ("dot", empty)})
    columns = {
        "position": np.full(6, 0.3),
        "peak": np.full(6, 0.5),
        "value": np.repeat([0.6, 0.9], 3),
    }
    strobes = xarray.Dataset({name: ("dot", values) for name, values in columns.items()})
    attrs = {
        "bounds": [0.5, 1.0],
        "coordinate": "theta",
        "path": "load.frequency",
        "limits": list(limits),
    }
    return xarray.DataTree.from_dict(
        {
            "/": xarray.Dataset(attrs=attrs),
            **branch_tables([branch] if n else []),
            "attractors": dots,
            "bands": bands,
            "stroboscopic": strobes,
        }
    )


@pytest.mark.parametrize(
    ("limits", "top", "number"),
    [((1.74, 3.48), 1.0, 0), ((0.74, 1.48), 1.0, 1), ((0.74, 1.48), 2.0, 2)],
)
def test_the_limits_of_the_mechanism_are_drawn_where_they_are_reached(limits, top, number):
    figure = figure_of(draw_diagram(diagram((0.5, top), limits)))
    places = sorted({float(line.get_ydata()[0]) for line in drawn(figure, LOOK.limit)})
    np.testing.assert_allclose(places, limits[:number])


def test_no_limit_is_drawn_where_there_is_none_or_it_varies():
    assert not drawn(figure_of(draw_diagram(diagram((0.5, 3.0), ()))), LOOK.limit)


def test_a_diagram_of_nothing_but_rest_is_drawn():
    tree = diagram(())
    tree["stroboscopic"]["peak"][:] = 0.0
    figure = figure_of(draw_diagram(tree))
    low, high = figure.axes[0].get_ylim()
    assert low <= 0.0 < high
    assert not len(figure.axes[1].lines[0].get_xdata())


def test_branches_beyond_the_bounds_do_not_set_the_scale():
    tree = diagram((0.5, 1.0, 40.0, 50.0), parameters=(0.5, 1.0, 2.0, 3.0))
    assert figure_of(draw_diagram(tree)).axes[0].get_ylim()[1] == pytest.approx(1.08)


def test_stroboscopic_points_of_motions_stand_at_their_values():
    points = figure_of(draw_diagram(diagram())).axes[1].lines[0]
    np.testing.assert_allclose(np.unique(points.get_xdata()), [0.6, 0.9])
    np.testing.assert_allclose(points.get_ydata(), 0.3)


# --- attractors --------------------------------------------------------------


def found(load="periodic", undecided=0.25):
    """Two attractors, a cycle of two periods and rest, and four starts, one of them undecided."""
    columns = {
        "attractor_kind": ("attractor", ["rest", "periodic"]),
        "attractor_period": ("attractor", [0, 2]),
        "fraction": ("attractor", [0.25, 0.5]),
        "fraction_error": ("attractor", [0.217, 0.25]),
        "section_theta": (("attractor", "state"), [[0.0, np.nan], [0.5, -0.5]]),
        "section_velocity": (("attractor", "state"), [[0.0, np.nan], [1.0, -1.0]]),
        "start_theta": ("start", [0.1, 0.2, 0.3, 0.4]),
        "start_velocity": ("start", [1.0, 1.0, 1.0, 1.0]),
        "end": ("start", [0, 1, 1, -1]),
    }
    return xarray.Dataset(
        columns,
        {"attractor": [0, 1]},
        {"load": load, "undecided": undecided, "plane": ["theta", "velocity"]},
    )


def test_attractors_are_named_with_their_shares_and_errors():
    figure = figure_of(draw_attractors(found()))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["0: rest, 25.0 ± 21.7 %", "1: period 2, 50.0 ± 25.0 %", "undecided, 25 %"]
    assert "phase 0" in figure.axes[0].get_xlabel()


def test_under_a_constant_load_there_are_equilibria_and_no_phases():
    figure = figure_of(draw_attractors(found("constant")))
    assert figure.legends[0].get_texts()[1].get_text().startswith("1: equilibrium")
    assert "phase" not in figure.axes[0].get_xlabel()


def test_starts_have_the_colour_of_the_attractor_that_they_lead_to():
    lines = figure_lines = figure_of(draw_attractors(found())).axes[0].lines
    cycle = next(line for line in lines if list(line.get_xdata()) == [0.5, -0.5])
    starts = next(line for line in figure_lines if list(line.get_xdata()) == [0.2, 0.3])
    assert same_color(cycle.get_markerfacecolor(), starts.get_markerfacecolor())
    assert not same_color(starts.get_markerfacecolor(), LOOK.unstable)


def test_where_the_amplitude_is_flat_the_lowest_values_can_be_drawn():
    tree = diagram((0.5, 1.0), (0.7,))
    for table in ("points", "attractors", "special"):
        name = "special_lowest" if table == "special" else "lowest"
        other = name.replace("lowest", "amplitude")
        if other in tree[table]:
            tree[table][name] = -2.0 * tree[table][other]
    axes = draw_diagram(tree, "lowest")[0]
    assert axes.get_ylabel().startswith(r"$\min_\tau")
    assert axes.get_ylim()[0] < -2.0
    assert axes.get_ylim()[1] > -1.0
    with pytest.raises(
        ParameterError, match="quantity must be one of amplitude, lowest, got 'speed'"
    ):
        draw_diagram(tree, "speed")


def two_masses(push, damping=0.1):
    """Two masses in a row whose stop lies far away, so that they are linear, and their matrices."""
    mass, stiffness = np.diag([1.0, 2.0]), np.array([[2.0, -1.0], [-1.0, 1.5]])
    structure = saltus.Structure(
        mass=mass,
        stiffness=stiffness,
        damping=damping * stiffness,
        points={"tip": [0.0, 1.0], "root": [1.0, 0.0]},
        contacts=[
            saltus.Contact(name=f"far_{name}", coordinate=name, position=-50.0)
            for name in ("tip", "root")
        ],
        forces={"push": push},
    )
    load = Load(frequency=0.5, push=saltus.Harmonic(0.1))
    system = System(model=structure, load=load, impact=saltus.NewtonImpact(e=0.0))
    return system, mass, stiffness, damping * stiffness


@pytest.mark.parametrize(("push", "shown"), [([0.0, 1.0], "tip"), ([1.0, 0.2], "root")])
def test_a_branch_of_a_structure_shows_the_displacement_that_the_load_drives(push, shown):
    """The amplitudes are those of the linear response, from the matrices."""
    system, mass, stiffness, damping = two_masses(push)
    orbit = saltus.find_orbit(system, **system.model.start())
    axes = saltus.plot(saltus.continue_orbit(orbit, "load.frequency", (0.4, 0.7)))
    assert shown in axes.get_ylabel()
    place = {"tip": 1, "root": 0}[shown]
    for w, amplitude in axes.lines[0].get_xydata():
        response = np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, push)
        assert amplitude == pytest.approx(0.1 * abs(response[place]), rel=2e-4)  # drawn smoothly


def test_a_sweep_of_a_structure_shows_what_its_branch_shows():
    system, mass, stiffness, damping = two_masses([0.0, 1.0])
    sweep = saltus.frequency_sweep(
        system, [0.4, 0.5, 0.6], **system.model.start(), periods=80, stop_early=False
    )
    axes = saltus.plot(sweep)
    assert "tip" in axes.get_ylabel()
    for w, amplitude in axes.lines[0].get_xydata():
        response = np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, [0.0, 1.0])
        assert amplitude == pytest.approx(0.1 * abs(response[1]), rel=1e-3)
    other = saltus.plot(sweep, quantity="largest_root")
    assert "root" in other.get_ylabel()


def test_a_jump_of_another_quantity_is_an_arrow_and_no_ramp():
    """A made-up sweep that jumps between its second and third value, on the way up alone."""
    values = np.array([1.0, 2.0, 3.0, 4.0])
    up, down = np.array([1.0, 1.0, 5.0, 5.0]), np.array([1.0, 1.0, 1.0, 5.0])
    over = ("direction", "value")
    jump = {"direction": ["up", "down"], "before": [2.4, 3.6], "after": [2.5, 3.5]}
    sizes = {"amplitude_before": [1.0, 5.0], "amplitude_after": [5.0, 1.0]}
    sweep = xarray.Dataset(
        {
            "amplitude": (over, np.array([up, down])),
            "work": (over, 3.0 * np.array([up, down]), {"long_name": "work"}),
            "hysteresis": ("value", np.array([0, 0, 1, 0])),
            **{f"jump_{name}": ("jump", row) for name, row in (jump | sizes).items()},
        },
        coords={"direction": ["up", "down"], "value": values},
        attrs={"kind": "frequency_sweep", "path": "load.frequency", "coordinate": "x"},
    )
    axes = saltus.plot(sweep, quantity="work")
    x, y = axes.lines[0].get_data()
    broken = x[np.isnan(y)]
    assert broken == pytest.approx([2.45])
    arrows = [(text.xyann, text.xy) for text in axes.texts]
    assert arrows == [((2.45, 3.0), (2.45, 15.0)), ((3.55, 15.0), (3.55, 3.0))]


def test_a_coordinate_is_its_amplitude_on_branches_and_sweeps_alike() -> None:
    """A sweep has its state at phase 0 under this name, too."""
    system = saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.1, damping=0.1, clearance=0.5),
        load=saltus.Load(frequency=0.8, force=saltus.Harmonic(0.2)),
        impact=saltus.NewtonImpact(0.6),
    )
    sweep = saltus.frequency_sweep(system, [0.7, 0.8], z=0.1, x=0.0, periods=20)
    orbit = saltus.find_orbit(system, z=0.1, x=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.79, 0.81))
    axes = [saltus.plot((branch, sweep), quantity=name) for name in ("x", "amplitude_x")]
    drawn = [np.concatenate([line.get_ydata() for line in each.lines]) for each in axes]
    np.testing.assert_array_equal(*drawn)
    assert axes[0].get_ylabel() == axes[1].get_ylabel() == r"$\max_\tau |x|$"
