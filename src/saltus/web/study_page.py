"""The page of a system: its description, its compiled code, and results of Python, as one file or
in a notebook.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from saltus.checks import Speeds, check_number, with_answers
from saltus.errors import ParameterError, SaltusError, shown
from saltus.files import check_writable, write_text
from saltus.orbits import Branch, OrbitEnd
from saltus.systems import (
    System,
    arguments_of,
    check_system,
    numbers,
    on_this_side,
    read_start,
    rest_state,
    state_of,
)
from saltus.web.description import notice_undeclared, page_parts
from saltus.web.one_file import PAGE, one_file
from saltus.web.results import differ_in_numbers, digest, results_as_json

# of a page that is told nothing of the motion that it begins with
AT_START = {"periods": 20.0, "duration": 60.0, "shift": 0.1}


def page(
    system: System,
    *results: Any,
    path: Path | str | None = None,
    title: str = "",
    presets: Mapping[str, Mapping[str, float]] | None = None,
    velocity: Speeds = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    **coordinates: float,
) -> Path:
    """A page that computes: the exact motion of a system in a browser, as one HTML file that needs
    no server and no network.

    The kernel and the model are compiled to WebAssembly, so that the motion is that of `simulate`;
    sliders change every number of the system. The first page of a version takes some twenty seconds
    of compiling, each further one about one.

    Parameters
    ----------
    system
        What moves.
    results
        Results that are laid over the page's own, such as of `response_spectrum` or
        `basins_of_attraction` of this system.
    path
        The file; by default the model's name with ".html" in the current folder.
    title
        The title of the page; by default the model's name.
    presets
        What the reader may try, by its name: numbers by their paths, and coordinates and velocities
        of the start, such as `{"less damping": {"model.damping": 0.01, "theta": 0.5}}`.
    velocity, coordinates
        The state at the start of the motion with which the page begins, as in `simulate`; by
        default a state beside rest.
    periods, duration
        The length of this motion, either in forcing periods or in dimensionless time; by default 20
        periods.
    tol
        The error that one step may make.
    time
        The dimensionless time at the start.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    ParameterError
        An argument has no meaning, or a result is of another system.
    SaltusError
        The equations need what a page does not have.

    Examples
    --------
    >>> file = saltus.page(system, path="cell.html", theta=0.3)
    >>> file.stat().st_size < 300_000
    True
    """
    _check(system, "page")
    file = Path(f"{type(system.model).__name__}.html" if path is None else path)
    if file.suffix.lower() not in (".html", ".htm"):
        raise ParameterError(
            f"path must be the name of a page, such as 'study.html', got {str(path)!r:.80}", "path"
        )
    motion = _motion(
        system, velocity, coordinates, {"periods": periods, "duration": duration}, tol, time
    )
    check_writable(file.parent)
    proposed = _presets(system, presets)
    return write_text(
        file, _page(system, motion, title, results_as_json(results, system), presets=proposed)
    )


def explore(
    system: System,
    *results: Any,
    title: str = "",
    velocity: Speeds = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    **coordinates: float,
) -> Explorer:
    """The page of a system in a notebook (Jupyter, marimo), which Python changes and which tells
    Python what is changed in it.

    It is the page of `page`, in a frame of its own; it needs the package anywidget, `pip install
    "saltus[explore]"`.

    Parameters
    ----------
    system, results, title, velocity, periods, duration, tol, time, coordinates
        As for `page`.

    Raises
    ------
    ParameterError
        An argument has no meaning, or a result is of another system.
    SaltusError
        anywidget is not installed, or the equations need what a page does not have.

    Examples
    --------
    >>> explorer = saltus.explore(system, theta=0.3, periods=30)
    >>> explorer.system == system, explorer.state["theta"]
    (True, 0.3)
    """
    _check(system, "explore")
    motion = _motion(
        system, velocity, coordinates, {"periods": periods, "duration": duration}, tol, time
    )
    return Explorer(system, results, motion, title)


@with_answers
class Explorer:
    """The page of a system in a notebook, made by `explore`: a name alone in a cell shows it.

    Parameters
    ----------
    system, results, motion, title
        What `explore` was asked for; the motion as `simulate` takes it.

    Attributes
    ----------
    widget
        The widget of anywidget, for layouts (`ipywidgets.VBox`, `marimo.ui.anywidget`) and for
        functions that are called at changes: `explorer.widget.observe(function, ["values", "start",
        "periods"])`.

    Examples
    --------
    >>> explorer = saltus.explore(system, theta=0.3)
    >>> explorer.system = system.with_({"model.damping": 0.2})
    >>> motion = saltus.simulate(explorer.system, **explorer.state)  # what the page shows
    """

    def __init__(
        self, system: System, results: Iterable[Any], motion: Mapping[str, Any], title: str
    ) -> None:
        self._first = system
        self._results = dict[str, dict[str, Any]]()
        self._shown = -math.inf
        content = _page(system, motion, title, [], embedded=True)
        entries = {
            "title": title or type(system.model).__name__,
            "page": content,
            "values": dict(numbers(system)),
        }
        self.widget = _widget(**entries, **_agreed(system, motion), results=[], height=760.0)
        for result in results:
            self.add(result)

    @property
    def system(self) -> System:
        """The system with the numbers that the page has; another one may differ from it in its
        numbers.
        """
        return self._first.with_(self.widget.values)

    @system.setter
    def system(self, system: System) -> None:
        if not isinstance(system, System) or not differ_in_numbers(system, self._first):
            raise ParameterError(
                "system must differ from the explorer's in its numbers alone; explore others anew",
                "system",
            )
        self.widget.values = dict(numbers(system))

    @property
    def state(self) -> dict[str, Any]:
        """The motion that is shown, as `simulate` takes it: coordinates, `velocity`, `time`, and
        `periods` or `duration`.
        """
        widget = self.widget
        kind = "duration" if self._first.load.period is None else "periods"
        start = arguments_of(
            self._first, [widget.start[name] for name in _state_names(self._first)]
        )
        return {**start, "time": float(widget.start["time"]), kind: float(widget.periods)}

    @state.setter
    def state(self, state: Mapping[str, Any]) -> None:
        given = {**self.state, **state}
        length: dict[str, Any] = {
            name: given.pop(name) for name in ("periods", "duration") if name in given
        }
        motion = _motion(
            self._first, given.pop("velocity"), given, length, 1e-12, given.pop("time")
        )
        with self.widget.hold_sync():
            for name, value in _agreed(self._first, motion).items():
                setattr(self.widget, name, value)

    def add(self, result: Any, name: str = "") -> None:
        """Lay a result over the page: another one of the same name, by default its kind, gives way
        to it.

        A branch may be added while it grows: `continue_orbit(..., growing=explorer.add)`.

        Parameters
        ----------
        result
            A result of this system, but for its numbers.
        name
            How the page calls it.

        Raises
        ------
        ParameterError
            A result of another system, or of a kind that a page does not show.
        """
        growing = isinstance(result, Branch) and any(
            end.reason is OrbitEnd.GROWING for end in result.ends
        )
        # seconds: to show it takes longer than to find an orbit
        if growing and monotonic() < self._shown + 0.25:
            return
        (entry,) = results_as_json([result], self._first)
        entry["title"] = name or entry["title"]
        self._results[entry["title"]] = entry
        self.widget.results = list(self._results.values())
        self._shown = monotonic()

    def _repr_mimebundle_(self, **asked: Any) -> Any:
        return self.widget._repr_mimebundle_(**asked)

    def _display_(self) -> Any:  # marimo asks for it
        return self.widget


def _check(system: System, function: str) -> None:
    """Refuse a system that a page cannot follow."""
    check_system(system, function, several_contacts=True, sums=False, switches=True, jumps=True)
    model = system.model
    switches = model.surfaces or model.has_switches
    parts = {"surfaces": switches, "coordinates of first order": model.first_order}
    for what in (
        what
        for what, given in (parts | {"frictions in contacts": model.rubs_in_contacts}).items()
        if given
    ):
        raise ParameterError(
            f"a page cannot show {what} yet, and {type(model).__name__} has some", "system"
        )


def _motion(
    system: System,
    velocity: Any,
    coordinates: Mapping[str, Any],
    length: Mapping[str, float | None],
    tol: float,
    time: float,
) -> dict[str, Any]:
    """The motion with which a page begins, as `simulate` takes it."""
    names = ("velocity", "periods", "duration", "time", "path", "title", "tol")
    state = (
        read_start(system, velocity, coordinates, names) if coordinates else _beside_rest(system)
    )
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_number("time", time)
    asked = {name: float(value) for name, value in length.items() if value is not None}
    for name, value in asked.items():
        check_number(name, value, above=0.0)
    kind = "duration" if system.load.period is None else "periods"
    return {
        **arguments_of(system, state),
        **(asked or {kind: AT_START[kind]}),
        "tol": tol,
        "time": float(time),
    }


def _presets(system: System, presets: Any) -> list[dict[str, Any]]:
    """The presets as the page has them; numbers that the system does not take are refused."""
    if presets is None:
        return []
    if not isinstance(presets, Mapping):
        raise ParameterError(
            f'presets must be a dictionary such as {{"slow": {{"load.frequency": 0.5}}}}, got '
            f"{shown(presets)}",
            "presets",
        )
    states = _state_names(system)
    found = []
    for name, given in presets.items():
        where = f"presets[{name!r:.40}]"
        if not isinstance(name, str) or not isinstance(given, Mapping):
            raise ParameterError(f"{where} must be a dictionary of numbers by name", "presets")
        for key, value in given.items():
            check_number(f"{where}, {key}", value)
        values = {path: float(value) for path, value in given.items() if path not in states}
        system.with_(values)
        start = {key: float(given[key]) for key in states if key in given}
        found.append({"name": name, "values": values, "start": start})
    return found


def _page(
    system: System, motion: Mapping[str, Any], title: str, results: list[Any], **more: Any
) -> str:
    """The text of a page that begins with a motion and has results laid over it."""
    content, described = page_content(system, motion, title, results)
    return one_file(described | more, content)


def page_content(
    system: System, motion: Mapping[str, Any], title: str, results: list[Any]
) -> tuple[bytes, dict[str, Any]]:
    """The WebAssembly of a page and all that it is told."""
    content, described = page_parts(system)
    notice_undeclared(system, described["numbers"])
    fixed = {each["path"] for each in described["numbers"] if "only" in each["range"]}
    fixed.update(described.get("without_effect", ()))
    for part in (described["model"], described["impact"], *described["load"]):
        part["parameters"] = [path for path in part["parameters"] if path not in fixed]
    return content, described | {
        "title": title or type(system.model).__name__,
        "start": _agreed(system, motion)["start"],
        "study": {
            "system": system.to_dict(),
            "simulate": {k: v for k, v in motion.items() if k != "time" or v},
        },
        "digest": digest(system),
        "results": results,
    }


def _agreed(system: System, motion: Mapping[str, Any]) -> dict[str, Any]:
    """The start and the length of a motion, as the page has them: its `periods` are units of time
    for a load without a period.
    """
    start = {
        "time": motion["time"],
        **dict(zip(_state_names(system), map(float, state_of(system, motion)), strict=True)),
    }
    return {
        "start": start,
        "periods": motion["periods"] if "periods" in motion else motion["duration"],
    }


def _widget(**values: Any) -> Any:
    """A widget of anywidget that has these values, and keeps them the same in Python and in the
    notebook's page.
    """
    try:
        import traitlets
        from anywidget import AnyWidget
    except ImportError:
        raise SaltusError(
            'notebooks show pages through the package anywidget: pip install ".[explore]"'
        ) from None
    kinds: dict[type, Any] = {
        str: traitlets.Unicode,
        dict: traitlets.Dict,
        list: traitlets.List,
        float: traitlets.Float,
    }
    traits = {name: kinds[type(value)]().tag(sync=True) for name, value in values.items()}
    return type(
        "ExplorerWidget", (AnyWidget,), {"_esm": (PAGE / "notebook.js").read_text(), **traits}
    )(**values)


def _state_names(system: System) -> list[str]:
    """The names of the state variables as the page has them."""
    names = system.model.coordinates
    return [*names, *(f"{name}_velocity" for name in names)]


def _beside_rest(system: System) -> np.ndarray:
    """A state without speed, moved a little from rest, on the side on which the model can be."""
    state = rest_state(system)
    state[: len(state) // 2] += AT_START["shift"]
    return on_this_side(system, state)
