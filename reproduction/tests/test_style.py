"""The colours keep their order in grey and the conventions stay apart."""

from itertools import pairwise

import matplotlib as mpl
import numpy as np

from saltus.plots import conventions as style


def lightness(colour):
    red, green, blue = (
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in mpl.colors.to_rgb(colour)
    )
    return 116 * np.cbrt(0.2126 * red + 0.7152 * green + 0.0722 * blue) - 16


def test_a_family_of_curves_gets_lighter_step_by_step():
    levels = [lightness(colour) for colour in style.shades(5)]
    assert all(later - earlier > 8 for earlier, later in pairwise(levels))
    assert levels[-1] < 85  # still dark enough on white


def test_no_two_conventions_share_line_style_and_lightness():
    lines = (
        style.LOOK.stable_line,
        style.LOOK.unstable_line,
        style.LOOK.separatrix_line,
        style.LOOK.limit_line,
    )
    for i, one in enumerate(lines):
        for two in lines[i + 1 :]:
            assert (
                one["linestyle"] != two["linestyle"]
                or abs(lightness(one["color"]) - lightness(two["color"])) > 10
            )


def test_the_conventions_end_with_their_block():
    before = mpl.rcParams["font.family"]
    with style.style():
        assert mpl.rcParams["pdf.fonttype"] == 42
    assert mpl.rcParams["font.family"] == before


def test_a_figure_has_the_width_asked_for():
    assert style.new_figure(style.LOOK.single_column, 60).get_size_inches()[0] * 25.4 == 90
