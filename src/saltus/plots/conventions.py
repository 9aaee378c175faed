"""The look of all pictures: the paper's conventions, colours that are also distinct in grey and for the colour-blind, widths.

Stable is a solid blue line, unstable a dashed red one, a separatrix dashed grey, a limit of the mechanism dash-dotted green; no
two of them share both a line style and a lightness. Along a branch such a line is heavy where the model holds, thin where an
assumption of the model fails, and thin and pale beyond a limit of the mechanism.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from saltus.checks import check_number
from saltus.errors import ParameterError, SaltusError, shown
from saltus.public_functions import answered, bound_arguments

P = ParamSpec("P")
R = TypeVar("R")

STABLE = "#0b4fa0"
UNSTABLE = "#d1342f"
PALE_STABLE = "#8db3de"
PALE_UNSTABLE = "#efaaa5"
SEPARATRIX = "#7a7a7a"
LIMIT = "#009060"
FAINT = "#bdbdbd"  # grids, axes of symmetry, the discontinuity plane
INK = "#1a1a1a"

STABLE_LINE: dict[str, Any] = {"color": STABLE, "linestyle": "-", "linewidth": 1.0}
UNSTABLE_LINE: dict[str, Any] = {"color": UNSTABLE, "linestyle": (0, (4, 2)), "linewidth": 1.0}
SEPARATRIX_LINE: dict[str, Any] = {"color": SEPARATRIX, "linestyle": (0, (5, 2)), "linewidth": 1.1}
LIMIT_LINE: dict[str, Any] = {"color": LIMIT, "linestyle": (0, (6, 2, 1, 2)), "linewidth": 1.0}

SINGLE_COLUMN = 90.0  # mm
DOUBLE_COLUMN = 190.0  # mm
RESOLUTION = 300  # dots per inch of the PNG

RC: Any = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": True,  # white without an edge, so that lines below do not cross the words
    "legend.edgecolor": "none",
    "legend.framealpha": 0.85,
    "legend.handlelength": 2.4,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.pad": 4.5,  # so that the numbers at the corner of two axes stay apart
    "ytick.major.pad": 4.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "lines.linewidth": 1.0,
    "lines.solid_capstyle": "round",
    "pdf.fonttype": 42,  # all glyphs embedded, so that a publisher can edit the text
    "agg.path.chunksize": 20_000,  # a curve of a million points is drawn in parts
    "savefig.dpi": RESOLUTION,
    "figure.dpi": 100,
    "axes.formatter.use_mathtext": True,
    "axes.unicode_minus": True,
}


@contextmanager
def style() -> Iterator[None]:
    """The conventions, for the time of a `with` block: drawing and saving both belong inside."""
    with mpl.rc_context(RC):
        yield


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw in the conventions if it makes a new figure; a given figure or given axes keep their style."""

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        given = kwargs.get("ax") is not None or kwargs.get("figure") is not None
        with nullcontext() if given else style():
            return draw(*args, **kwargs)

    return inside


def new_figure(width: float = SINGLE_COLUMN, height: float = 65.0, **options: Any) -> Figure:
    """An empty Figure of the given size in millimetres, laid out so that nothing is clipped."""
    options.setdefault("layout", "constrained")
    return Figure(figsize=(width / 25.4, height / 25.4), **options)


def axes_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """The given axes, or those of a new figure of this size in mm."""
    if ax is not None:
        return ax
    new = new_figure(width, height).subplots()
    new.locator_params(axis="x", nbins=6)  # numbers of five digits then stay apart in one column
    return new


def shades(n: int, first: float = 0.0, last: float = 0.78) -> list[Any]:
    """`n` colours of an ordered family, from dark to light, which have the same order in grey."""
    return list(mpl.colormaps["viridis"](np.linspace(first, last, n))) if n > 1 else [mpl.colormaps["viridis"](first)]


def figure_of(axes: Any) -> Figure:
    """The figure of axes, one or several."""
    figure = np.ravel(axes)[0].figure
    return figure if isinstance(figure, Figure) else figure.figure


def outside_legend(figure: Any, **options: Any) -> None:
    """A legend below all panels of a figure; the figure is laid out so that the legend covers nothing."""
    if figure.get_layout_engine() is None:
        figure.set_layout_engine("constrained")
    figure.legend(loc="outside lower center", **options)


def legend_of(ax: Any, own: bool, handles: Iterable[Any], **options: Any) -> None:
    """A legend below a new figure (`own`), or within given axes."""
    if own:
        outside_legend(ax.figure, handles=list(handles), **options)
    else:
        ax.legend(handles=list(handles), loc="best")


def marks_of(ax: Axes) -> dict[str, Any]:
    """The handles and labels of a legend of axes, each label once."""
    handles, labels = ax.get_legend_handles_labels()
    return dict(zip(labels, handles, strict=True))


DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (3, 1.2)), (0, (5, 1.2, 1, 1.2)), (0, (1, 1.2)))


def panel_label(ax: Any, label: str) -> None:
    """Name a panel `(label)` above its upper left corner."""
    ax.set_title(f"$({label})$", loc="left", pad=4)


NARROWEST, WIDEST = 10.0, 2000.0  # mm, of a picture: from a stamp to the widest poster


def drawing(draw: Callable[P, R]) -> Callable[P, R]:
    """A decorator of functions that draw a dataset in the conventions: arguments of a wrong kind are refused by their names.

    Users can change datasets: if one lacks something, or its arrays do not fit one another, the error of NumPy or Matplotlib is
    turned into a sentence.
    """
    name, drawn = next(iter(signature(draw).parameters)), styled(draw)

    @answered
    @wraps(draw)
    def inside(*given: P.args, **named: P.kwargs) -> R:
        arguments = bound_arguments(draw, given, named).arguments
        dataset = arguments[name]
        if not hasattr(dataset, "attrs") or not hasattr(dataset, "data_vars"):
            raise ParameterError(f"{name} must be a Dataset or a DataTree, got {shown(dataset)}", name)
        if arguments.get("width") is not None:
            check_number("width", arguments["width"], at_least=NARROWEST, at_most=WIDEST, unit="mm")
        try:
            return drawn(*given, **named)
        except (SaltusError, OSError, MemoryError):
            raise
        except Exception as error:
            said = " ".join(f"{type(error).__name__}: {error}".split())
            raise ParameterError(f"{name} cannot be drawn by {draw.__name__} ({said:.150})", name) from error

    return inside
