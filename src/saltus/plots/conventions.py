"""The look of all pictures: the paper's conventions, widths, and colours that are also distinct in
grey and for the colour-blind.

Coordinates and parameters have their names on axes here; their units come from the variables in a
dataset.

Stable is a solid blue line, unstable a dashed red one, a separatrix dashed grey, a limit of the
mechanism dash-dotted green. No two of them share both a line style and a lightness. Along a branch
such a line is heavy where the model holds, thin where an assumption of the model fails, and thin
and pale beyond a limit of the mechanism.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from saltus.checks import answered, bound_arguments, check_number
from saltus.errors import ParameterError, SaltusError, near, shown

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Look:
    """Colours, lines and widths of all pictures."""

    stable: str = "#0b4fa0"
    unstable: str = "#d1342f"
    pale_stable: str = "#8db3de"
    pale_unstable: str = "#efaaa5"
    separatrix: str = "#7a7a7a"
    limit: str = "#009060"
    faint: str = "#bdbdbd"  # grids, axes of symmetry, the discontinuity plane
    ink: str = "#1a1a1a"
    single_column: float = 90.0  # mm
    double_column: float = 190.0  # mm
    dashes: tuple[Any, ...] = (
        "-",
        (0, (6, 1.5)),
        (0, (3, 1.2)),
        (0, (5, 1.2, 1, 1.2)),
        (0, (1, 1.2)),
    )

    @property
    def stable_line(self) -> dict[str, Any]:
        """Solid and blue."""
        return {"color": self.stable, "linestyle": "-", "linewidth": 1.0}

    @property
    def unstable_line(self) -> dict[str, Any]:
        """Dashed and red."""
        return {"color": self.unstable, "linestyle": (0, (4, 2)), "linewidth": 1.0}

    @property
    def separatrix_line(self) -> dict[str, Any]:
        """Dashed and grey."""
        return {"color": self.separatrix, "linestyle": (0, (5, 2)), "linewidth": 1.1}

    @property
    def limit_line(self) -> dict[str, Any]:
        """Dash-dotted and green."""
        return {"color": self.limit, "linestyle": (0, (6, 2, 1, 2)), "linewidth": 1.0}


LOOK = Look()

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
    "axes.edgecolor": LOOK.ink,
    "axes.labelcolor": LOOK.ink,
    "text.color": LOOK.ink,
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
    "savefig.dpi": 300,
    "figure.dpi": 100,
    "axes.formatter.use_mathtext": True,
    "axes.unicode_minus": True,
}


# what `plot` was asked for, while it draws
_ASKED_LEGEND: ContextVar[str | None] = ContextVar("legend", default=None)
_ASKED_STYLE: ContextVar[Any] = ContextVar("style", default=None)
LEGENDS = ("inside", "below", "right", "none")  # the places of a legend that a user may ask for


def asked_legend() -> str | None:
    """The place that `plot(legend=)` asks for; None leaves it to the picture."""
    return _ASKED_LEGEND.get()


@contextmanager
def legend_at(place: str | None) -> Iterator[None]:
    """Draw with this place of the legend."""
    before = _ASKED_LEGEND.set(place)
    try:
        yield
    finally:
        _ASKED_LEGEND.reset(before)


@contextmanager
def style_on_top(own_style: Any) -> Iterator[None]:
    """Draw with a style of Matplotlib on top of the conventions."""
    before = _ASKED_STYLE.set(own_style)
    try:
        yield
    finally:
        _ASKED_STYLE.reset(before)


@contextmanager
def style() -> Iterator[None]:
    """The conventions, for the time of a `with` block: drawing and saving both belong inside."""
    own = _ASKED_STYLE.get()
    with mpl.rc_context(RC), nullcontext() if own is None else mpl.style.context(own):
        yield


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw in the conventions if it makes a new figure; a given figure or given axes
    keep their style.
    """

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        given = kwargs.get("ax") is not None or kwargs.get("figure") is not None
        with nullcontext() if given else style():
            return draw(*args, **kwargs)

    return inside


def new_figure(width: float = LOOK.single_column, height: float = 65.0, **options: Any) -> Figure:
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
    return (
        list(mpl.colormaps["viridis"](np.linspace(first, last, n)))
        if n > 1
        else [mpl.colormaps["viridis"](first)]
    )


def figure_of(axes: Any) -> Figure:
    """The figure of axes, one or several."""
    figure = np.ravel(axes)[0].figure
    return figure if isinstance(figure, Figure) else figure.figure


def outside_legend(figure: Any, **options: Any) -> None:
    """A legend of all panels of a figure, below them unless `plot` was asked for another place; the
    figure is laid out so that the legend covers nothing.
    """
    place = asked_legend() or "below"
    if place == "none":
        return
    if place == "inside":
        beside = {"title", "title_fontsize", "ncols"}
        inside = {key: value for key, value in options.items() if key not in beside}
        figure.axes[0].legend(loc="best", **inside)
        return
    if figure.get_layout_engine() is None:
        figure.set_layout_engine("constrained")
    if place == "right":
        texts = [*map(str, options.get("labels", ())), *(options.get("title") or "").split("\n")]
        room = 25.4 * figure.get_figwidth()
        if _entry_width(texts) > MOST_LEGEND * room:  # the axes would have too little of the rest
            place = "below"
            rows = len(options.get("labels", ())) + (options.get("title") or "").count("\n")
            figure.set_figheight(figure.get_figheight() + rows * LEGEND_ROW / 25.4)
        options["ncols"] = 1
    figure.legend(
        loc="outside right upper" if place == "right" else "outside lower center", **options
    )


def legend_of(
    ax: Any,
    own: bool,
    handles: Iterable[Any] | None = None,
    labels: Iterable[str] | None = None,
    **options: Any,
) -> None:
    """A legend below a new figure (`own`), or within given axes, unless `plot` was asked for
    another place.

    Without `handles` it names what the axes hold, each label once. A legend below makes its figure
    higher, so that the axes stay as large as they are.
    """
    if handles is None:
        marks = marks_of(ax)
        handles, labels = marks.values(), marks.keys()
    shown_handles = list(handles)
    texts = list(labels) if labels is not None else [str(h.get_label()) for h in shown_handles]
    if not texts:
        return
    for text, handle in _entries_before(ax):
        if text not in texts:
            texts.insert(0, text)
            shown_handles.insert(0, handle)
    if asked_legend() == "inside" or (asked_legend() is None and not own):
        options.pop("ncols", None)
        ax.legend(handles=shown_handles, labels=texts, loc="best", **options)
        return
    figure = figure_of(ax)
    options["ncols"] = min(options.get("ncols", 4), _columns(texts, figure.get_figwidth()))
    if asked_legend() in (None, "below") and own:
        rows = math.ceil(len(texts) / options["ncols"])
        figure.set_figheight(figure.get_figheight() + rows * LEGEND_ROW / 25.4)
    for earlier in [legend for legend in figure.legends if legend.get_gid() == f"of {id(ax)}"]:
        earlier.remove()
    outside_legend(figure, handles=shown_handles, labels=texts, **options)
    if figure.legends:
        figure.legends[-1].set_gid(f"of {id(ax)}")


def _entries_before(ax: Any) -> list[tuple[str, Any]]:
    """What an earlier result has in the legend of these axes, the last entry first."""
    legends = [legend for legend in figure_of(ax).legends if legend.get_gid() == f"of {id(ax)}"]
    if ax.get_legend() is not None:
        legends.append(ax.get_legend())
    found = [
        (text.get_text(), handle)
        for legend in legends
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True)
    ]
    return found[::-1]


LEGEND_ROW = 3.6  # mm, the height of a line of a legend
MOST_LEGEND = 0.45  # the largest share of a figure's width that a legend beside the axes may take


def _columns(texts: list[str], width: float) -> int:
    """How many columns of these labels fit side by side into a figure, whose width is in inches."""
    return max(1, int(25.4 * width / _entry_width(texts)))


def _entry_width(texts: list[str]) -> float:
    """About how wide the longest entry of a legend is, in mm."""
    letters = max(len(re.sub(r"\\\w+|[${}^_\\]", "", text)) for text in texts)
    return 1.35 * letters + 12.0


def marks_of(ax: Axes) -> dict[str, Any]:
    """The handles and labels of a legend of axes, each label once."""
    handles, labels = ax.get_legend_handles_labels()
    return dict(zip(labels, handles, strict=True))


def panel_label(ax: Any, label: str) -> None:
    """Name a panel `(label)` above its upper left corner."""
    ax.set_title(f"$({label})$", loc="left", pad=4)


# mm, of a picture: from a stamp to the widest poster
NARROWEST = 10.0
WIDEST = 2000.0


def _drawable(dataset: Any) -> list[str]:
    """The names of the numbers of a result that may be drawn."""
    nodes = dataset.subtree if hasattr(dataset, "subtree") else (dataset,)
    return [
        str(name)
        for node in nodes
        for name, variable in node.data_vars.items()
        if variable.dtype.kind in "fiu" and not str(name).startswith(("special_", "flag_"))
    ]


def drawing(draw: Callable[P, R]) -> Callable[P, R]:
    """A decorator of functions that draw a dataset in the conventions: arguments of a wrong kind
    are refused by their names.

    Users can change datasets: if one lacks something, or its arrays do not fit one another, the
    error of NumPy or Matplotlib is turned into a sentence.
    """
    name = next(iter(signature(draw).parameters))
    drawn = styled(draw)

    @answered
    @wraps(draw)
    def inside(*given: P.args, **named: P.kwargs) -> R:
        arguments = bound_arguments(draw, given, named).arguments
        dataset = arguments[name]
        if not hasattr(dataset, "attrs") or not hasattr(dataset, "data_vars"):
            raise ParameterError(
                f"{name} must be a Dataset or a DataTree, got {shown(dataset)}", name
            )
        if arguments.get("width") is not None:
            check_number("width", arguments["width"], at_least=NARROWEST, at_most=WIDEST, unit="mm")
        try:
            return drawn(*given, **named)
        except (SaltusError, OSError, MemoryError):
            raise
        except Exception as error:
            asked = arguments.get("quantity")
            if isinstance(error, KeyError) and isinstance(asked, str):
                raise ParameterError(
                    f"quantity {shown(asked)} is not in this result;"
                    f" {near(asked, _drawable(dataset))}",
                    "quantity",
                ) from error
            said = " ".join(f"{type(error).__name__}: {error}".split())
            raise ParameterError(
                f"{name} cannot be drawn by {draw.__name__} ({said:.150})", name
            ) from error

    return inside


SYMBOLS = {"theta": r"\theta", "theta_1": r"\theta_1", "theta_2": r"\theta_2"}
PARAMETERS = {
    "load.frequency": r"frequency $\Omega$",
    "load.force.amplitude": r"force amplitude $\widehat{F}$",
    "load.horizontal.amplitude": r"load amplitude $\widehat{\mathcal{H}}$",
    "load.vertical": r"vertical load $\overline{\mathcal{V}}$",
    "load.vertical.mean": r"mean vertical load $\overline{\mathcal{V}}$",
    "impact.e": "restitution $e$",
    "model.damping": r"damping $\mathcal{C}$",
    "model.beta0": r"$\beta_0$ (rad)",
}
# of an amplitude: motions between two walls that reach both have the same one, but for rounding
SAME_AMPLITUDE = 1e-9


def symbol(name: str) -> str:
    """A state variable's symbol in mathematical text; with several coordinates a velocity's is its
    coordinate's with a dot.
    """
    if name.endswith("_velocity"):
        return rf"\dot{{{symbol(name.removesuffix('_velocity'))}}}"
    return SYMBOLS.get(
        name, name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"
    )


def peak(names: str, quantity: str = "amplitude") -> str:
    """The amplitude, or the highest or lowest value, of a coordinate or of several in one text, in
    mathematical text.
    """
    found = r"\min" if quantity == "lowest" else r"\max"
    bar = "|" if quantity == "amplitude" else ""
    each = [rf"{bar}{symbol(name)}{bar}" for name in names.split()]
    if len(each) == 1:
        return rf"{found}_\tau {each[0]}"
    return (
        rf"{found}_\tau({', '.join(each)})"
        if len(each) < 4
        else rf"{found}_\tau\,{found}_i{bar}q_i{bar}"
    )


def unit_in_brackets(variable: Any) -> str:
    """The unit of a dataset's variable after its name, such as " (rad)"; nothing where it has
    none.
    """
    unit = variable.attrs.get("units", "1")
    return "" if unit == "1" else f" ({unit})"


def parameter_name(path: str) -> str:
    """The name of a parameter on an axis: what it is and whose, as "frequency of the ground
    horizontal", if it has no symbol.
    """
    if path in PARAMETERS or "." not in path:
        return PARAMETERS.get(path, path)
    owner, _, own = path.rpartition(".")
    whose = owner.removeprefix("load.").replace("_", " ").replace(".", " ")
    unit = " (rad)" if owner.startswith("load.") and own == "phase" else ""
    return (
        own.replace("_", " ")
        if owner in ("model", "impact", "load")
        else f"{own.replace('_', ' ')} of the {whose}{unit}"
    )


def quantity_name(dataset: Any, quantity: str) -> str:
    """The symbol of an amplitude, or a quantity's name in words."""
    driven = dataset.attrs.get("shown", dataset.attrs.get("coordinate"))
    if quantity in ("amplitude", "highest", "lowest") and driven is not None:
        return f"${peak(str(driven), quantity)}$"
    kind, _, coordinate = quantity.partition("_")
    named = str(dataset.attrs.get("coordinate", "")).split()
    if coordinate and (coordinate in named or f"largest_{coordinate}" in dataset):
        return {
            "amplitude": f"${peak(coordinate)}$",
            "largest": f"${peak(coordinate, 'highest')}$",
            "smallest": f"${peak(coordinate, 'lowest')}$",
        }.get(kind, quantity.replace("_", " "))
    return quantity.replace("_", " ")


def with_amplitudes(dataset: Any) -> Any:
    """The dataset with the amplitude of each coordinate, `amplitude_x`, beside its extrema."""
    amplitudes: dict[str, Any] = {}
    for name in map(str, dataset.data_vars):
        before, largest, coordinate = name.partition("largest_")
        low = f"{before}smallest_{coordinate}"
        if largest and before in ("", "special_") and low in dataset:
            size = np.maximum(abs(dataset[name]), abs(dataset[low]))
            text = {"long_name": f"max abs({coordinate})"}
            size.attrs = {**dataset[name].attrs, **text}
            amplitudes[f"{before}amplitude_{coordinate}"] = size
    return dataset.assign(amplitudes)


def shown_quantity(dataset: Any) -> str:
    """The amplitude that is drawn of a branch or a sweep by default: of the displacement that the
    load drives.
    """
    name = dataset.attrs.get("shown")
    return f"amplitude_{name}" if name and f"largest_{name}" in dataset else "amplitude"


def chosen_quantity(quantity: str | None, known: Iterable[str], usual: str) -> str:
    """The quantity that is drawn: `usual` without a choice; a coordinate or a point alone stands for
    its amplitude. One that there is not is refused with those that there are.
    """
    known = [*known]
    if quantity is None:
        return usual
    for name in (f"amplitude_{quantity}", quantity):
        if name in known:
            return name
    raise ParameterError(
        f"quantity must be one of {', '.join(known)}, got {shown(quantity)}", "quantity"
    )


def parameter_symbol(path: str) -> str:
    """A parameter's symbol; its dotted path where it has none."""
    name = parameter_name(path)
    return name[name.index("$") : name.rindex("$") + 1] if "$" in name else path


def plane_of(dataset: Any) -> tuple[str, str]:
    """The two state variables over which a dataset is drawn."""
    first, second = dataset.attrs["plane"]
    return str(first), str(second)


def state_symbol(name: str, plane: tuple[str, str]) -> str:
    """The symbol of one of the two state variables of a plane, a velocity as its coordinate with a
    dot.
    """
    return rf"\dot{{{symbol(plane[0])}}}" if name == "velocity" else symbol(name)


def state_label(dataset: Any, name: str, plane: tuple[str, str], after: str = "") -> str:
    """The name of an axis with a state variable, and its unit as the variable of a dataset of the
    same name carries it.
    """
    return f"${state_symbol(name.removeprefix('section_').removeprefix('orbit_'), plane)}${after}{unit_in_brackets(dataset[name])}"


def varied(dataset: Any, dim: str) -> tuple[str, np.ndarray]:
    """The quantity along a dimension of an ensemble, in words with its unit, and its values: a
    parameter, a start, or numbers.
    """
    given = [
        name
        for name in dataset.variables
        if "." in str(name) or str(name).startswith(("start_", "initial_"))
    ]
    for name in (dim, *given):
        if (
            name in dataset.variables
            and dim in dataset[name].dims
            and dataset[name].dtype.kind in "fi"
        ):
            rows = (
                dataset[name]
                .transpose(dim, ...)
                .values.reshape(dataset.sizes[dim], -1)
                .astype(float)
            )
            if name == dim or (
                np.ptp(rows, axis=1).max() == 0.0 and len(np.unique(rows)) == len(rows)
            ):
                return _start_name(dataset, str(name)), rows[:, 0]
    return dim.replace("_", " "), np.arange(dataset.sizes[dim], dtype=float)


def _start_name(dataset: Any, name: str) -> str:
    """The name of an initial value on an axis; a parameter or another dimension keeps its own
    name.
    """
    state = name.removeprefix("start_").removeprefix("initial_")
    if state == name:
        return parameter_name(name)
    if state == "time":
        return r"$\tau$ at the start"
    coordinate = next(iter(dataset.data_vars))
    return (
        f"${state_symbol(state, (str(coordinate), state))}$ at the "
        f"start{unit_in_brackets(dataset[name])}"
    )


def is_flat(amplitudes: np.ndarray) -> bool:
    """Whether most of several motions have the same amplitude."""
    usual = float(np.median(amplitudes)) if amplitudes.size > 1 else np.nan
    return bool(
        2 * np.count_nonzero(np.abs(amplitudes - usual) <= SAME_AMPLITUDE * usual) > amplitudes.size
    )


def cell_edges(middles: np.ndarray) -> np.ndarray:
    """The edges of cells about their middles, (n + 1,), halfway between them."""
    if len(middles) == 1:
        return np.asarray(middles[0] + np.array([-0.5, 0.5]))
    inner = (middles[1:] + middles[:-1]) / 2
    return np.concatenate([[2 * middles[0] - inner[0]], inner, [2 * middles[-1] - inner[-1]]])
