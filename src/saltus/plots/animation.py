"""Motions as films: the mechanism that moves, beside its phase portrait that grows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import animation, image
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon

from saltus.checks import check_number
from saltus.errors import ParameterError, shown
from saltus.plots.conventions import LOOK, NARROWEST, WIDEST, style, symbol, unit_in_brackets
from saltus.plots.motion import LINES, PAIRS, arcs, coordinates
from saltus.progress import Progress, silent
from saltus.systems import drawing_of

LOOKS: dict[str, dict[str, Any]] = {
    "ground": {"color": LOOK.ink, "lw": 1.2},
    "wall": {"color": LOOK.ink, "lw": 2.4},
    "slider": {"color": LOOK.ink, "lw": 1.4},
    "bar": {"color": "#5f6b76", "lw": 2.4},
    "spring": {"color": LOOK.limit, "lw": 1.0},
    "body": {"facecolor": "#d9e4f1", "edgecolor": LOOK.stable, "lw": 1.4},
    "mass": {"facecolor": LOOK.ink, "edgecolor": LOOK.ink, "lw": 0.8},
    "hinge": {"facecolor": "white", "edgecolor": LOOK.ink, "lw": 0.8},
}  # by the role of a shape; those with a face are filled
SUFFIXES = {".gif": "pillow", ".mp4": "ffmpeg", ".html": "html"}


def animate(
    result: Any,
    path: Path | str | None = None,
    *,
    seconds: float = 8.0,
    fps: float = 30.0,
    width: float = LOOK.double_column,
    title: str | None = None,
    progress: Progress = silent,
) -> Any:
    """A film of a motion, or of one period of an orbit: the mechanism as it moves under its loads,
    beside its phase portrait.

    An arrow above the mechanism shows each load that varies, as long as its value. The mechanism is
    that of `saltus.systems.drawing_of`; a model of your own may say how it is
    drawn.

    Parameters
    ----------
    result
        A `Motion` that was kept densely, or a `PeriodicOrbit` or a `FreeOrbit`.
    path
        The file, a GIF (.gif), a page with buttons (.html) or, where ffmpeg is installed, a film
        (.mp4).
    seconds
        How long the film is, in seconds.
    fps
        The pictures in a second.
    width
        The width of the picture, mm.
    title
        A title above the film.
    progress
        Called from time to time with the fraction done and what is being done.

    Returns
    -------
    Path or matplotlib.animation.FuncAnimation
        The path of the file; without one the animation, whose `to_jshtml()` a notebook shows.

    Raises
    ------
    ParameterError
        A result that does not move, a file of another kind, an MP4 where ffmpeg is missing.

    Examples
    --------
    >>> film = saltus.animate(saltus.simulate(system, theta=0.3, periods=2), "cell.gif", seconds=0.4, fps=10)
    >>> film.name, film.stat().st_size > 1000
    ('cell.gif', True)
    """
    file = None if path is None else Path(path)
    # GIF counts the hundredths of a second of a picture in two bytes
    check_number("fps", fps, at_least=0.01, at_most=240.0)
    check_number("seconds", seconds, above=0.0, at_most=3600.0)
    writer = None if file is None else _writer(file, fps)
    check_number("width", width, at_least=NARROWEST, at_most=WIDEST, unit="mm")
    # of the class, as a load takes any name for a channel
    motion = result.motion() if callable(getattr(type(result), "motion", None)) else result
    names = dir(motion)
    if "system" not in names or "dense" not in names or motion.dense is None:
        raise ParameterError(
            f"result must be a motion with dense output, or an orbit, got {shown(result)}",
            "result",
        )
    count = max(2, round(seconds * fps))
    with style():
        film = _Film(motion, np.linspace(motion.start, motion.time, count), width, title)
        made = animation.FuncAnimation(
            film.page, film.show, frames=count, interval=1000.0 / fps, blit=False
        )
        if file is None or writer is None:
            return made
        file.parent.mkdir(parents=True, exist_ok=True)

        # 820 x 330 points, which a page shows without scaling
        with writer.saving(film.page, str(file), 110):
            for number in range(count):
                progress(number / count, f"picture {number + 1} of {count}")
                film.show(number)
                writer.grab_frame()
        made._draw_was_started = True  # type: ignore[attr-defined]  # or it warns that it was never shown
    progress(1.0, "film")
    return file


def _writer(file: Path, fps: Any) -> Any:
    """The writer of Matplotlib for a file."""
    kind = SUFFIXES.get(file.suffix.lower())
    if kind is None:
        raise ParameterError(f"a film is a .gif, .html or .mp4, got {file.name!r}", "path")
    if kind == "ffmpeg" and not animation.FFMpegWriter.isAvailable():
        raise ParameterError(
            "an MP4 is written by ffmpeg, which is not installed here; write a .gif or .html "
            "instead",
            "path",
        )
    if kind == "html":
        return animation.HTMLWriter(fps=fps, embed_frames=True)
    return animation.PillowWriter(fps=fps) if kind == "pillow" else animation.FFMpegWriter(fps=fps)


class _Page(Figure):
    """A figure in which little moves: what stands still is drawn once for all pictures that writers
    ask for.
    """

    moving: Sequence[Artist] = ()
    still: Any = None

    def savefig(self, fname: Any, **options: Any) -> None:
        """As Matplotlib's; a picture for a writer, which is not a file of its own, is what stands
        still and what moves on top.

        Parameters
        ----------
        fname
            A file, or where to write.
        options
            As for `Figure.savefig`.
        """
        form = options.get("format")
        if form not in ("rgba", "png") or isinstance(fname, (str, Path)):
            super().savefig(fname, **options)
            return
        canvas = self.canvas if isinstance(self.canvas, FigureCanvasAgg) else FigureCanvasAgg(self)
        if self.still is None or options.get("dpi", self.dpi) != self.dpi:
            self.set_dpi(options.get("dpi", self.dpi))
            canvas.draw()  # type: ignore[no-untyped-call]  # without what moves, which is animated
            self.still = canvas.copy_from_bbox(self.bbox)  # type: ignore[no-untyped-call]
        canvas.restore_region(self.still)  # type: ignore[no-untyped-call]
        for artist in self.moving:
            self.draw_artist(artist)
        points = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        if form == "rgba":
            fname.write(points.tobytes())
        else:
            image.imsave(fname, points, format=form)


class _Film:
    """The figure of a film, and how it shows one of its times."""

    def __init__(
        self, motion: Any, times: np.ndarray, width: float, title: str | None = None
    ) -> None:
        self.motion = motion
        self.times = times
        self.places = np.atleast_2d(motion.at(times)[0])  # (degrees of freedom, n)
        self.page = _Page(figsize=(width / 25.4, 0.4 * width / 25.4), layout="constrained")
        if title is not None:
            self.page.suptitle(str(title))
        mechanism, portrait = self.page.subplots(1, 2, width_ratios=(1.2, 1))
        shapes = [drawing_of(motion.system, place) for place in self.places.T]
        self.shapes = shapes
        self.artists = [_artist(mechanism, shape) for shape in shapes[0]]
        corners = np.concatenate(
            [
                shape.points + reach
                for each in shapes
                for shape in each
                for reach in (shape.radius, -shape.radius)
            ]
        )
        x0, y0 = corners.min(axis=0)
        x1, y1 = corners.max(axis=0)
        self.loads = _Loads(motion.system.load, times, mechanism, (x0, x1, y1))
        y1 = self.loads.top
        room = 0.04 * max(x1 - x0, y1 - y0)
        mechanism.set(xlim=(x0 - room, x1 + room), ylim=(y0 - room, y1 + room), aspect="equal")
        mechanism.axis("off")
        self.title = mechanism.set_title("", loc="left")
        self._portrait(portrait)
        moving = [
            *self.artists,
            *self.loads.arrows,
            self.title,
            *(line for line, *_ in self.lines),
            *self.dots,
        ]
        self.page.moving = sorted(moving, key=lambda artist: artist.get_zorder())
        for artist in self.page.moving:
            artist.set_animated(True)

    def _portrait(self, ax: Axes) -> None:
        """The whole motion, faint, the part that was shown, and the states at the time that is
        shown.
        """
        data = self.motion.to_xarray()
        names = coordinates(data)
        looks = [
            (
                LINES[i]
                if len(names) <= len(LINES)
                else {"color": PAIRS[i // 2 % len(PAIRS)], "ls": ("-", (0, (4, 1.5)))[i % 2]}
            )
            for i in range(len(names))
        ]
        self.lines = []
        self.dots = []
        for name, look in zip(names, looks, strict=True):
            time, place, velocity = arcs(data, name)
            ax.plot(place, velocity, color=LOOK.faint, lw=0.7, zorder=1)
            (line,) = ax.plot([], [], lw=1.0, zorder=2, label=f"${symbol(name)}$", **look)
            (dot,) = ax.plot([], [], marker="o", ms=5, color=look["color"], ls="none", zorder=3)
            self.lines.append((line, time, place, velocity))
            self.dots.append(dot)
        unit = unit_in_brackets(data[names[0]])
        if len(names) == 1:
            ax.set(
                xlabel=f"${symbol(names[0])}${unit}", ylabel=rf"$\dot{{{symbol(names[0])}}}${unit}"
            )
        else:
            ax.set(xlabel=f"coordinates{unit}", ylabel=f"velocities{unit}")
            if len(names) <= 4:
                ax.legend(loc="best")

    def show(self, frame: int) -> list[Artist]:
        """The picture with this number."""
        time = float(self.times[frame])
        self.title.set_text(rf"$\tau={time:.2f}$")
        for artist, shape in zip(self.artists, self.shapes[frame], strict=True):
            if isinstance(artist, Line2D):
                artist.set_data(*shape.points.T)
            elif isinstance(artist, Polygon):
                artist.set_xy(shape.points)
            elif isinstance(artist, Circle):
                artist.center = tuple(shape.points[0])
        self.loads.show(frame)
        place, velocity = (np.atleast_1d(values) for values in self.motion.at(time))
        for i, (line, times, places, velocities) in enumerate(self.lines):
            seen = int(np.searchsorted(times, time, side="right"))
            line.set_data(
                np.append(places[:seen], place[i]), np.append(velocities[:seen], velocity[i])
            )
            self.dots[i].set_data([place[i]], [velocity[i]])
        return [*self.artists, *self.loads.arrows, *self.dots]


MOST_ARROWS = 3  # loads that are drawn, the first of those that vary


class _Loads:
    """An arrow for each load that varies, above a mechanism: its length is the value beside the
    largest one of the film. Loads called vertical point up and down.
    """

    def __init__(
        self, load: Any, times: np.ndarray, ax: Axes, box: tuple[float, float, float]
    ) -> None:
        left, right, self.top = box
        values = {
            name: np.array([float(getattr(load, name)(time)) for time in times])
            for name in load.channels
        }
        varying = [name for name in values if np.ptp(values[name]) > 0.0][:MOST_ARROWS]
        reach = 0.25 * (right - left)
        middle = 0.5 * (left + right)
        self.arrows: list[Polygon] = []
        self.corners: list[np.ndarray] = []  # of each arrow at each time, (times, 7, 2)
        for name in varying:
            upright = "vertical" in name
            height = self.top + (1.3 if upright else 0.4) * reach
            share = reach * values[name] / np.abs(values[name]).max()
            outline = _arrow(share, 0.1 * reach)
            outline = outline[..., ::-1] if upright else outline
            self.corners.append(outline + np.array([middle, height]))
            arrow = Polygon(self.corners[-1][0], closed=True, color=LOOK.unstable, lw=0.0, zorder=5)
            ax.add_patch(arrow)
            self.arrows.append(arrow)
            ax.plot(middle, height, marker="o", ms=2.5, color=LOOK.ink, zorder=1)
            words = name.replace("_", " ")
            aside = (0.3 * reach, 0.0) if upright else (0.0, 0.22 * reach)
            place: dict[str, Any] = (
                {"ha": "left", "va": "center"} if upright else {"ha": "center", "va": "bottom"}
            )
            ax.text(
                middle + aside[0],
                height + aside[1],
                words,
                color=LOOK.unstable,
                fontsize=8,
                zorder=1,
                **place,
            )
            self.top = height + (1.1 if upright else 0.6) * reach

    def show(self, frame: int) -> None:
        """The arrows of the picture with this number."""
        for arrow, corners in zip(self.arrows, self.corners, strict=True):
            arrow.set_xy(corners[frame])


def _arrow(lengths: np.ndarray, half: float) -> np.ndarray:
    """The outlines of arrows along x from 0 to each length, (n, 7, 2); short ones have a short
    head.
    """
    head = np.minimum(np.abs(lengths), 2.0 * half) * np.sign(lengths)
    neck = lengths - head
    width = np.minimum(1.0, np.abs(lengths) / (2.0 * half)) * half
    zero = np.zeros_like(lengths)
    x = np.stack([zero, neck, neck, lengths, neck, neck, zero], axis=1)
    y = np.stack(
        [0.4 * width, 0.4 * width, width, zero, -width, -0.4 * width, -0.4 * width], axis=1
    )
    return np.stack([x, y], axis=2)


def _artist(ax: Axes, shape: Any) -> Artist:
    """A shape in axes."""
    look = LOOKS.get(shape.role, {"color": LOOK.unstable})
    if shape.kind == "circle":
        face = {key: look[key] for key in ("facecolor", "edgecolor", "lw") if key in look}
        patch: Artist = Circle(tuple(shape.points[0]), shape.radius, zorder=4, **face)
        ax.add_patch(patch)  # type: ignore[arg-type]
        return patch
    if "facecolor" in look:
        patch = Polygon(shape.points, closed=True, zorder=3, **look)
        ax.add_patch(patch)
        return patch
    (line,) = ax.plot(*shape.points.T, zorder=2, solid_capstyle="round", **look)
    return line
