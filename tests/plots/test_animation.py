"""Films: a picture for each time, files of the kinds that are asked for, and refusals."""

import io
from itertools import pairwise

import numpy as np
import pytest

import saltus
from saltus.errors import ParameterError

plt = pytest.importorskip("matplotlib.pyplot")
SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.5), vertical=-0.5),
)


@pytest.fixture(scope="module")
def motion():
    return saltus.simulate(SYSTEM, theta=0.3, periods=1)


def test_a_gif_has_a_picture_for_each_time_and_is_not_still(motion, tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = saltus.animate(motion, tmp_path / "film.gif", seconds=0.5, fps=8)
    with image.open(path) as film:
        assert film.n_frames == 4
        pictures = []
        for i in range(4):
            film.seek(i)
            pictures.append(np.asarray(film.convert("L"), dtype=float))
    assert all(np.abs(a - b).max() > 50 for a, b in pairwise(pictures))


def test_the_last_picture_shows_the_end_of_the_motion(motion):
    film = saltus.animate(motion, seconds=1.0, fps=5)
    film._draw_was_started = True  # it is not shown here
    shown = film._func(4)
    dots = [
        artist
        for artist in shown
        if artist.get_zorder() == 3 and hasattr(artist, "get_xdata") and artist.get_marker() == "o"
    ]
    assert [(float(dot.get_xdata()[0]), float(dot.get_ydata()[0])) for dot in dots] == [
        (motion.theta, motion.velocity)
    ]


def test_an_orbit_is_shown_for_a_period_as_a_page(tmp_path):
    orbit = saltus.find_orbit(SYSTEM, theta=0.3)
    path = saltus.animate(orbit, tmp_path / "orbit.html", seconds=0.3, fps=10)
    assert path.read_text().count("data:image/png;base64") == 3


def test_what_is_no_film_is_refused(motion, tmp_path, monkeypatch):
    from matplotlib import animation

    monkeypatch.setattr(animation.FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(
        ParameterError,
        match=r"an MP4 is written by ffmpeg, which is not installed here; write a .gif or .html",
    ):
        saltus.animate(motion, tmp_path / "film.mp4")
    with pytest.raises(ParameterError, match=r"a film is a .gif, .html or .mp4, got 'film.avi'"):
        saltus.animate(motion, tmp_path / "film.avi")
    with pytest.raises(ParameterError, match="result must be a motion with dense output"):
        saltus.animate(saltus.simulate(SYSTEM, theta=0.3, periods=1, dense=False))


def test_a_picture_is_that_of_a_whole_drawing(motion):
    """What stands still is drawn once, and what moves on top of it."""
    film = saltus.animate(motion, seconds=1.0, fps=5)
    film._draw_was_started = True  # it is not shown here
    page, pictures = film._fig, [io.BytesIO(), io.BytesIO()]
    for number in (1, 3):
        film._func(number)
        page.savefig(pictures[0], format="rgba", dpi=page.dpi)
    for artist in page.moving:
        artist.set_animated(False)
    page.canvas.print_rgba(pictures[1])
    quick, whole = (
        np.frombuffer(picture.getvalue()[-page.canvas.buffer_rgba().nbytes :], np.uint8)
        for picture in pictures
    )
    np.testing.assert_array_equal(quick, whole)


def test_an_arrow_is_as_long_as_the_load_and_points_where_it_does():
    """Sine and cosine of one frequency: the tips follow them, the upright arrow upwards."""
    load = saltus.Load(
        frequency=2.0,
        ground_horizontal=saltus.Harmonic(0.1),
        ground_vertical=saltus.Harmonic(0.02, phase=0.5),
    )
    system = saltus.System(model=saltus.RockingBlock(alpha=0.4), load=load)
    film = saltus.animate(saltus.simulate(system, theta=0.0, periods=1), fps=5, title="A block")
    film._draw_was_started = True  # it is not shown here
    arrows = [artist for artist in film._fig.moving if artist.get_zorder() == 5]
    assert film._fig.get_suptitle() == "A block"
    tips = []
    for number in range(40):
        film._func(number)
        tips.append([arrow.get_xy()[3] - arrow.get_xy()[[0, 6]].mean(axis=0) for arrow in arrows])
    times = np.linspace(0.0, np.pi, 40)
    across, upright = np.moveaxis(np.array(tips), 1, 0)
    for tip, axis, channel in ((across, 0, "ground_horizontal"), (upright, 1, "ground_vertical")):
        values = np.array([getattr(load, channel)(time) for time in times])
        size = np.abs(tip[:, axis]).max()
        assert size > 0.1
        np.testing.assert_allclose(tip[:, axis] / size, values / np.abs(values).max(), atol=1e-12)
        np.testing.assert_allclose(tip[:, 1 - axis], 0.0, atol=1e-12)
