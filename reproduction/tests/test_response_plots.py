"""Pictures of branches follow the conventions, and their lines go through what was computed and
nothing else.
"""

import matplotlib as mpl
import numpy as np
import pytest
from spectrum_cases import branch, diagram, folded, loop

from saltus.plots import ModelValidity, branch_lines, response, smooth_lines
from saltus.plots import conventions as style
from saltus_paper.figures.zooms import draw_zoom


def lines(ax, line):
    """The lines of an axes in the colour and dashes of a convention."""
    return [
        one
        for one in ax.lines
        if one.get_color() == line["color"] and one.get_linestyle() == drawn(line)
    ]


def drawn(line):
    return "-" if line["linestyle"] == "-" else "--"


@pytest.fixture
def axes():
    figure = style.new_figure(layout=None)
    ax = figure.subplots()
    ax.set_xlim(0, 3)
    ax.set_ylim(0, 4)
    return ax


def test_runs_of_one_stability_meet_at_the_fold_between_them():
    runs = list(smooth_lines(folded()))
    assert [run.stable for run in runs] == [True, False, True]
    for one, two, fold in zip(runs[:-1], runs[1:], [(2.0, 2.0), (1.5, 1.1)], strict=True):
        assert one.places[-1] == pytest.approx(fold)
        assert two.places[0] == pytest.approx(fold)


def test_the_line_passes_every_point_and_leaves_the_range_of_its_neighbours_nowhere():
    data = folded()
    places = np.concatenate([run.places for run in smooth_lines(data)])
    for point in zip(data["parameter"].values, data["amplitude"].values, strict=True):
        assert np.linalg.norm(places - point, axis=1).min() < 1e-12
    first, second, _ = (run.places[:, 0] for run in smooth_lines(data))
    assert (first.max(), second.max(), second.min()) == pytest.approx((2.0, 2.0, 1.5))
    assert places[:, 1].max() == pytest.approx(2.1)
    assert places[:, 1].min() == pytest.approx(0.4)


def test_a_smooth_curve_looks_smooth_between_its_points():
    angle = np.linspace(0, 2 * np.pi, 41)
    (run,) = smooth_lines(branch(1.5 + np.cos(angle), 2 + np.sin(angle), np.ones(41)))
    assert np.abs(np.linalg.norm(run.places - (1.5, 2), axis=1) - 1).max() < 1.5e-3
    chords = 1 - np.cos(np.pi / 40)
    assert chords > 1.5e-3


@pytest.mark.parametrize(
    ("special", "stable"),
    [((("LP", 1.0, 0.0),), 0), ((("reach", 1.0, 0.0),), 1)],
)
def test_a_line_that_is_cut_at_a_fold_has_the_slope_of_the_curve_there(special, stable):
    """p = 1 - y^2: at a value of p the line has the y of the curve within a tenth of the step."""
    y = np.array([-0.65, -0.6, -0.5, -0.3, 0.0, 0.3, 0.5, 0.6, 0.65])
    flags = np.where(y < 0.0, stable, 1)
    margins = {"reach": np.where(y <= 0.0, -1.0, 1.0)} if stable else None
    data = branch(1.0 - y**2, y, flags, special=special, margins=margins)
    runs = list(smooth_lines(data))
    assert len(runs) == 2
    at = np.linspace(0.02, 0.28, 27)
    for run in runs:
        p, amplitude = run.places[np.argsort(-run.places[:, 0])].T
        assert np.abs(np.abs(np.interp(at**2, 1.0 - p, amplitude)) - at).max() < 0.03


def test_a_grazing_keeps_its_corner():
    data = branch([0, 1, 2, 2, 1, 0], [0, 1, 2, 2, 3, 4], np.ones(6), crossings=[2, 2, 2, 6, 6, 6])
    one, two = (run.places for run in smooth_lines(data))
    for places in (one, two):
        assert (2, 2) in (tuple(places[-1]), tuple(places[0]))
    assert one[:, 0] == pytest.approx(one[:, 1])
    assert two.sum(axis=1) == pytest.approx(4)


def test_without_a_special_point_runs_meet_in_the_middle():
    first, second = smooth_lines(branch([0, 1, 2, 3], [1, 1, 2, 2], [1, 1, 0, 0]))
    assert tuple(first.places[-1]) == tuple(second.places[0]) == (1.5, 1.5)


def test_a_branch_is_cut_at_the_zero_of_a_margin_and_the_graver_one_counts():
    margins = {
        "reaction": [1, 0.2, -1, -1],
        "reach": [1, 1, 0.5, -0.5],
        "straight": [1, -1, -1, -1],
    }
    zeros = [("reaction", 1.25, 1.2), ("reach", 2.5, 2.6), ("straight", 0.5, 0.5)]
    runs = list(
        branch_lines(
            branch([0, 1, 2, 3], [0, 1, 2, 3], [1, 1, 1, 1], margins=margins, special=zeros)
        )
    )
    assert [run.validity for run in runs] == [
        ModelValidity.HOLDS,
        ModelValidity.ASSUMPTION,
        ModelValidity.LIMIT,
    ]
    ends = [(tuple(run.places[0]), tuple(run.places[-1])) for run in runs]
    assert ends == [((0, 0), (1.25, 1.2)), ((1.25, 1.2), (2.5, 2.6)), ((2.5, 2.6), (3, 3))]


@pytest.mark.parametrize(("fold", "zero"), [(1.2, 1.8), (1.8, 1.2)])
def test_stability_and_validity_may_change_between_the_same_two_points(fold, zero):
    special = [("LP", fold, fold), ("reaction", zero, zero)]
    data = branch(
        [0, 1, 2, 3],
        [0, 1, 2, 3],
        [1, 1, 0, 0],
        margins={"reaction": [1, 1, -1, -1]},
        special=special,
    )
    first, between, last = branch_lines(data)
    assert (first.stable, first.validity) == (True, ModelValidity.HOLDS)
    expected = (False, ModelValidity.HOLDS) if fold < zero else (True, ModelValidity.ASSUMPTION)
    assert (between.stable, between.validity) == expected
    assert between.places[:, 0] == pytest.approx(sorted([fold, zero]))
    assert (last.stable, last.validity) == (False, ModelValidity.ASSUMPTION)
    assert last.places[0] == pytest.approx(between.places[-1])


def test_a_margin_that_jumps_where_impacts_are_born_is_cut_at_the_grazing():
    margins = {"reaction": [1, 1, -1, -1]}
    crossings, special = [2, 2, 6, 6], [("GR", 1.9, 1.0)]
    holds, violated = branch_lines(
        branch(
            [0, 1, 2, 3],
            np.ones(4),
            np.ones(4),
            crossings=crossings,
            margins=margins,
            special=special,
        )
    )
    assert tuple(holds.places[-1]) == tuple(violated.places[0]) == (1.9, 1.0)
    assert violated.validity is ModelValidity.ASSUMPTION


def test_stable_is_solid_blue_unstable_dashed_red_in_the_given_unit(axes):
    response.draw_branches(axes, diagram(folded()), scale=2.0)
    blue, red = lines(axes, style.LOOK.stable_line), lines(axes, style.LOOK.unstable_line)
    assert (len(blue), len(red)) == (2, 1)
    assert max(line.get_ydata().max() for line in blue + red) == pytest.approx(2.1 / 2.0)


def test_validity_is_seen_in_colour_and_in_grey(axes):
    margins = {"reaction": [1, 1, -1, -1, -1, -1], "reach": [1, 1, 1, 1, -1, -1]}
    one = branch(np.arange(6), np.ones(6), np.ones(6), margins=margins)
    two = branch(np.arange(6), 2 * np.ones(6), np.zeros(6), margins=margins)
    response.draw_branches(axes, diagram(one, two))
    looks = {}
    for line in axes.lines:
        grey = np.dot(mpl.colors.to_rgb(line.get_color()), (0.299, 0.587, 0.114))
        looks.setdefault(line.get_linestyle(), []).append((round(line.get_linewidth(), 3), grey))
    for holds, violated, beyond in looks.values():  # solid and dashed
        assert holds[0] >= 2 * violated[0]
        assert beyond[1] - violated[1] > 0.25
    assert set(looks) == {"-", "--"}


def test_marks_name_the_kinds_that_are_inside_and_are_thinned_out(axes):
    crowd = [("GR", 1.0 + 1e-4 * k, 1.0) for k in range(50)]
    data = diagram(
        branch([0, 3], [1, 1], [1, 1], special=[*crowd, ("LP", 2.0, 1.0), ("PD", 9.0, 1.0)])
    )
    response.draw_special(axes, data)
    counts = {line.get_marker(): len(line.get_xdata()) for line in axes.lines}
    assert counts == {"^": 1, "o": 1}


def test_a_branch_that_is_shorter_than_its_mark_has_none(axes):
    """The axes are some centimetres wide: a thousandth of them is shorter than a mark of 1 mm."""
    long = branch([0, 3], [1, 1], [1, 1], special=[("LP", 2.0, 1.0)])
    short = branch([1, 1.003], [2, 2], [1, 1], special=[("PD", 1.0, 2.0), ("LP", 1.003, 2.0)])
    response.draw_special(axes, diagram(long, short))
    (marks,) = axes.lines
    assert marks.get_xdata() == pytest.approx([2.0])


def test_bands_are_light_blue_and_light_orange_behind_everything(axes):
    response.draw_bands(axes, diagram(folded()))
    (band,) = axes.patches
    assert band.get_facecolor()[:3] == mpl.colors.to_rgb(response.BANDS["CH"])
    assert (band.get_x(), band.get_width()) == (1.0, 0.5)
    assert band.get_zorder() == 0


def test_limits_are_two_greens_apart_from_each_other_and_from_the_critical_load(axes):
    response.draw_limits(axes, (1.7, 3.5), scale=1.0)
    response.draw_critical(axes, 0.1)
    line, farthest, critical = axes.lines
    assert line.get_ydata()[0] == 1.7
    assert farthest.get_ydata()[0] == 3.5
    assert critical.get_xdata()[0] == 0.1
    assert len({str(one._dash_pattern) for one in axes.lines}) == 3  # told apart without colour
    assert line.get_color() == farthest.get_color() != critical.get_color()


def test_limits_beyond_the_axes_do_not_stretch_them(axes):
    response.draw_limits(axes, (1.7, 35.0))
    assert len(axes.lines) == 1
    assert axes.get_ylim() == (0, 4)


def test_dots_of_simulation_lie_where_they_were_found(axes):
    response.draw_attractors(axes, diagram(folded(), dots=[(1.0, 1.0), (2.4, 0.5)]), scale=2.0)
    (dots,) = axes.lines
    assert dots.get_xydata() == pytest.approx(np.array([[1.0, 0.5], [2.4, 0.25]]))


def test_a_zoom_shows_its_window_of_the_same_data(axes):
    inset = draw_zoom(axes, diagram(folded()), (0.4, 0.4), (1.4, 2.1, 1.0, 2.2))
    assert inset.get_xlim() == (1.4, 2.1)
    assert lines(inset, style.LOOK.unstable_line)


def test_the_legend_names_only_the_kinds_and_bands_that_are_there():
    figure = style.new_figure()
    response.response_legend(figure, [diagram(folded(), loop())])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "fold (LP)" in names
    assert "chaotic" in names
    assert not {"grazing (GR)", "period doubling (PD)", "quasi-periodic"} & set(names)


def test_the_legend_says_what_is_violated_and_what_is_beyond():
    valid = branch([0, 3], [1, 1], [1, 1], margins={"reaction": [1, 1], "reach": [1, 1]})
    wrong = branch([0, 3], [1, 1], [1, 1], margins={"reaction": [-1, -1], "reach": [1, 1]})
    beyond = branch([0, 3], [1, 1], [1, 1], margins={"reaction": [-1, -1], "reach": [-1, -1]})
    model, violated, farther = "stable, unstable (model holds)", "reaction violated", "beyond reach"
    cases = [
        ([valid], [model]),
        ([valid, wrong], [model, violated]),
        ([wrong, beyond], [violated, farther]),
    ]
    for branches, expected in cases:
        assert [label for label, _ in response.line_labels(branches)] == expected
    assert [label for label, _ in response.line_labels([folded()])] == ["stable", "unstable"]


def test_the_extremes_are_those_within_the_range():
    data = diagram(folded(), loop())
    assert response.highest(data, 0.0, 3.0) == 3.5
    assert response.highest(data, 2.2, 3.0) == 0.5
    assert response.lowest(data, 0.0, 3.0, "lowest") == -1.75
