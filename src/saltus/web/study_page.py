"""The page of a system: its description, its compiled code, and results of Python, as one file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from saltus.checks import check_number
from saltus.errors import ParameterError
from saltus.files import check_writable, write_text
from saltus.public_functions import Numbers
from saltus.systems import System, arguments_of, check_system, on_this_side, read_start, rest_state
from saltus.web.accepted import accepted
from saltus.web.description import page_parts
from saltus.web.one_file import one_file
from saltus.web.results import digest, results_as_json

AT_START = {"periods": 20.0, "duration": 60.0, "shift": 0.1}  # of a page that is told nothing of the motion that it begins with


def page(
    system: System,
    *results: Any,
    path: Path | str | None = None,
    title: str = "",
    velocity: Numbers = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    **coordinates: float,
) -> Path:
    """A page that computes: the exact motion of a system in a browser, as one HTML file that needs no server and no network.

    The kernel and the model are compiled to WebAssembly, so that the motion is that of `simulate`; sliders change every number of
    the system. The first page of a version takes some twenty seconds of compiling, each further one about one.

    Parameters
    ----------
    system
        What moves.
    results
        Results that are laid over the page's own, such as of `response_spectrum` or `basins_of_attraction` of this system.
    path
        The file; by default the model's name with ".html" in the current folder.
    title
        The title of the page; by default the model's name.
    velocity, coordinates
        The state at the start of the motion with which the page begins, as in `simulate`; by default a state beside rest.
    periods, duration
        The length of this motion, either in forcing periods or in dimensionless time; by default 20 periods.
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
    check_system(system, "page", several_contacts=True)
    names = ("velocity", "periods", "duration", "time", "path", "title", "tol")
    state = read_start(system, velocity, coordinates, names) if coordinates else _beside_rest(system)
    file = Path(f"{type(system.model).__name__}.html" if path is None else path)
    if file.suffix.lower() not in (".html", ".htm"):
        raise ParameterError(f"path must be the name of a page, such as 'study.html', got {str(path)!r:.80}", "path")
    check_number("tol", tol, at_least=1e-15, at_most=1e-6)
    check_number("time", time)
    length = {"periods": periods, "duration": duration}
    asked = {name: float(value) for name, value in length.items() if value is not None}
    for name, value in asked.items():
        check_number(name, value, above=0.0)
    if not asked:
        kind = "duration" if system.load.period is None else "periods"
        asked = {kind: AT_START[kind]}
    check_writable(file.parent)
    content, described = page_parts(system)
    simulate = {**arguments_of(system, state), **asked, "tol": tol} | ({"time": time} if time else {})
    bounds = accepted(system)
    described |= {
        "numbers": [entry | {"accepted": bounds[entry["path"]]} for entry in described["numbers"]],
        "title": title or type(system.model).__name__,
        "start": {"time": float(time), **dict(zip(_state_names(system), map(float, state), strict=True))},
        "study": {"system": system.to_dict(), "simulate": simulate},
        "digest": digest(system),
        "results": results_as_json(results, system),
    }
    return write_text(file, one_file(described, content))


def _state_names(system: System) -> list[str]:
    """The names of the state variables as the page has them."""
    names = system.model.coordinates
    return [*names, *(f"{name}_velocity" for name in names)]


def _beside_rest(system: System) -> np.ndarray:
    """A state without speed, moved a little from rest, on the side on which the model can be."""
    state = rest_state(system)
    state[: len(state) // 2] += AT_START["shift"]
    return on_this_side(system, state)
