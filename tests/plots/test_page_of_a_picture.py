"""What a picture is asked for: its legend, title, size, density and style."""

import warnings

import matplotlib.pyplot as plt
import numpy as np
import pytest
import results_to_draw
from PIL import Image

import saltus
from saltus import plots
from saltus.errors import ParameterError

WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1),
    load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.5)),
    impact=saltus.VelocityReduction(0.8),
)


@pytest.fixture(scope="module")
def branch():
    return saltus.continue_orbit(saltus.find_orbit(WALL, x=0.0), "load.frequency", (1.0, 1.6))


@pytest.fixture(scope="module")
def motion():
    return saltus.simulate(WALL, x=0.0, periods=3)


def legends(axes):
    """Every legend of the figure."""
    figure = plots.figure_of(axes)
    inside = [ax.get_legend() for ax in np.ravel(axes) if ax.get_legend() is not None]
    return inside + list(figure.legends)


@pytest.mark.parametrize(
    ("place", "count", "inside"),
    [(None, 1, 0), (True, 1, 0), ("below", 1, 0), ("right", 1, 0), ("inside", 1, 1), (False, 0, 0)],
)
def test_a_legend_stands_where_it_is_asked_for(branch, place, count, inside):
    ax = saltus.plot(branch, legend=place)
    found = legends(ax)
    assert len(found) == count
    assert (ax.get_legend() is not None) == bool(inside)
    ax.figure.draw_without_rendering()
    panel = ax.get_window_extent()
    for legend in ax.figure.legends:
        box = legend.get_window_extent()
        assert box.y1 <= panel.y0 if place != "right" else box.x0 >= panel.x1
        assert box.x0 >= 0.0
        assert box.x1 <= ax.figure.bbox.width


def test_a_legend_that_needs_half_of_the_width_stands_below(branch):
    narrow = saltus.plot(branch, legend="right", size=(60, 100))
    wide = saltus.plot(branch, legend="right", size=(150, 62))
    for ax, below in ((narrow, True), (wide, False)):
        ax.figure.draw_without_rendering()
        (legend,) = ax.figure.legends
        box = legend.get_window_extent()
        assert (box.y1 <= ax.get_window_extent().y0) == below
        assert ax.get_position().width > 0.5


@pytest.mark.parametrize("given", [False, True])
def test_angles_are_drawn_in_degrees_where_they_are(given):
    cell = saltus.System(
        model=saltus.Metainterface(beta0=1.4, damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
    )
    motion = saltus.simulate(cell, theta=0.3, periods=2)
    options = {"ax": plt.figure().subplots()} if given else {}
    plain, ours = (
        np.ravel(axes)[0]
        for axes in (saltus.plot(motion), saltus.plot(motion, degrees=True, **options))
    )
    assert plain.get_ylabel().endswith("(rad)")
    assert ours.get_ylabel() == plain.get_ylabel().replace("(rad)", "(deg)")
    assert ours.get_xlabel() == plain.get_xlabel()  # a time, of which nothing changes
    ours.figure.draw_without_rendering()
    low, high = ours.get_ylim()
    ticks = [tick for tick in ours.yaxis.get_major_ticks() if low <= tick.get_loc() <= high]
    assert len(ticks) >= 3
    for tick in ticks:
        shown = float(tick.label1.get_text().replace("\N{MINUS SIGN}", "-"))
        assert shown == pytest.approx(tick.get_loc() * 180 / np.pi, abs=1e-9)
    plt.close("all")


def written(axis):
    """The places of the ticks of an axis that are seen, and the numbers beside them."""
    low, high = sorted(axis.get_view_interval())
    ticks = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    texts = [tick.label1.get_text() or tick.label2.get_text() for tick in ticks]
    numbers = [float(text.replace("\N{MINUS SIGN}", "-")) for text in texts]
    return np.array([tick.get_loc() for tick in ticks]), np.array(numbers)


def test_angles_of_sweeps_starts_and_colour_bars_are_in_degrees():
    cell = saltus.System(
        model=saltus.Metainterface(beta0=1.4, damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
    )
    sweep = saltus.frequency_sweep(
        cell, np.linspace(0.0, 1.2, 3), path="load.horizontal.phase", periods=4, theta=0.3
    )
    many = saltus.simulate_many(
        cell,
        theta=np.linspace(-0.5, 0.5, 4)[:, None],
        velocity=np.linspace(0.0, 0.3, 3),
        periods=1,
    )
    response = saltus.plot(sweep, degrees=True)
    shaded = saltus.plot(many, quantity="theta", degrees=True)
    (bar,) = [mesh.colorbar.ax for mesh in shaded.collections if mesh.colorbar is not None]
    for axis in (response.xaxis, response.yaxis, shaded.xaxis, shaded.yaxis, bar.yaxis):
        assert axis.label.get_text().endswith(" (deg)")
        plots.figure_of(axis.axes).draw_without_rendering()
        places, numbers = written(axis)
        assert len(numbers) >= 2
        np.testing.assert_allclose(numbers, np.degrees(places), rtol=5e-3, atol=1e-9)
    plain = saltus.plot(sweep)
    assert plain.get_xlabel() == "phase of the horizontal (rad)"
    assert saltus.plot(many, quantity="theta").figure.axes[1].get_ylabel().endswith("(rad)")
    plt.close("all")


def test_a_branch_is_drawn_by_the_extreme_of_a_coordinate(branch):
    ax = saltus.plot(branch, quantity="highest")
    ax.figure.draw_without_rendering()  # which reads the mathematical text
    assert ax.get_ylabel() == r"$\max_\tau x$"


def test_a_size_without_room_for_the_panels_is_noticed(branch):
    with pytest.warns(UserWarning, match="leaves a panel"):
        saltus.plot(branch, size=(60, 30))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        saltus.plot(branch, size=(90, 65))
        saltus.plot(branch, size=(60, 30), legend=False)


def test_given_axes_keep_the_legends_of_their_figure(branch):
    figure, (left, right) = plt.subplots(1, 2)
    left.plot([0, 1], label="mine")
    figure.legend()
    saltus.plot(branch, ax=right, legend=False, title="a branch")
    assert len(figure.legends) == 1
    assert right.get_legend() is None
    assert right.get_title() == "a branch"
    plt.close(figure)


def test_two_branches_in_one_picture_have_one_legend(branch):
    for place, count in ((None, 1), ("below", 1), (False, 0)):
        assert len(legends(saltus.plot((branch, branch), legend=place))) == count


@pytest.mark.parametrize(
    ("size", "width"), [("column", 90.0), ("page", 190.0), ((120.0, 50.0), 120.0)]
)
def test_a_picture_has_the_size_of_a_column(branch, motion, size, width):
    for result in (branch, motion):
        figure = plots.figure_of(saltus.plot(result, size=size, title="A resonance"))
        assert 25.4 * figure.get_figwidth() == pytest.approx(width)
        if isinstance(size, tuple):
            assert 25.4 * figure.get_figheight() == pytest.approx(size[1])
        assert figure.get_suptitle() == "A resonance"
        figure.draw_without_rendering()
        for ax in figure.axes:
            box = ax.get_tightbbox()
            assert box.x0 >= -1.0
            assert box.x1 <= figure.bbox.width + 1.0
            assert ax.get_window_extent().height > 0.3 * figure.bbox.height


@pytest.mark.parametrize(("asked", "dots"), [(None, 300), (600, 600), (72, 72)])
def test_a_saved_picture_has_the_dots_of_print(branch, tmp_path, asked, dots):
    path = saltus.save(tmp_path / "branch.png", saltus.plot(branch, size="column"), dpi=asked)
    with Image.open(path) as image:
        assert image.width == pytest.approx(dots * 90.0 / 25.4, abs=1.0)


def test_a_style_lies_on_top_of_the_conventions(branch, tmp_path):
    file = tmp_path / "mine.mplstyle"
    file.write_text("axes.linewidth: 3.25\n")
    for style in (file, str(file), {"axes.linewidth": 3.25}):
        ax = saltus.plot(branch, style=style)
        assert ax.spines["left"].get_linewidth() == 3.25
    assert saltus.plot(branch).spines["left"].get_linewidth() < 1.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"legend": "above"}, "legend must be"),
        ({"legend": 3}, "legend must be"),
        ({"size": "poster"}, 'size must be "column", "page"'),
        ({"size": (5.0, 60.0)}, "size must"),
        ({"size": "column", "width": 80.0}, "exclude each other"),
        ({"dpi": 0}, "dpi must"),
        ({"style": "no such style"}, "style must be"),
    ],
)
def test_what_no_picture_has_is_refused_in_one_sentence(branch, options, words):
    with pytest.raises(ParameterError, match=words) as refusal:
        saltus.plot(branch, **options)
    assert "\n" not in str(refusal.value)


def test_size_and_dots_are_refused_for_given_axes(branch):
    figure, ax = plt.subplots()
    for name, value in (("size", "column"), ("dpi", 200)):
        with pytest.raises(ParameterError, match=f"{name} applies to a new figure"):
            saltus.plot(branch, ax=ax, **{name: value})
    plt.close(figure)


def test_white_cells_are_in_the_legend_of_several_charts():
    """White is rest alone."""
    chart = results_to_draw.chart()
    for resting in (True, False):
        shown = chart.copy(deep=True)
        shown["count"].values[:] = 0 if resting else 1
        shown["unsettled"].values[:] = 0
        figure = plots.new_figure()
        figure.subplots()
        plots.chart_legend(figure, [shown], [])
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        assert ("rest alone" in texts) is resting
