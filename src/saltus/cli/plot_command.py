"""`saltus plot`: the picture of a result that is on disk."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console

from saltus.errors import ParameterError


def plot_store(path: Path, output: Path | None) -> None:
    """Draw the result at `path` (netCDF, or the Zarr store of a sweep) beside it, or into the folder `output`.

    Raises:
        ParameterError: there is no result of saltus at `path`, a sweep is not complete, a folder cannot be written to.
    """
    from saltus.files import check_writable

    folder = path.parent if output is None else output
    check_writable(folder)
    files = draw_file(path, folder / path.stem, open_result(path))
    names = ", ".join(file.name for file in files)
    Console(highlight=False).print(f"The picture is in {folder}: {names}", markup=False, soft_wrap=True)


def draw_file(path: Path, stem: Path, data: Any) -> list[Path]:
    """Draw a result as `stem`.png and `stem`.pdf.

    Raises:
        ParameterError: it is of no kind that has a picture, or lacks what its kind has.
    """
    from saltus.files import write_figure
    from saltus.plots import style

    kind, drawn = kind_of(data), drawings()
    if kind not in drawn:
        what = f"its kind is {kind!r}" if kind else "it does not say of what kind it is"
        raise ParameterError(f"{path} is no result that `saltus plot` draws: {what}; it draws {', '.join(drawn)}")
    try:
        figure = drawn[kind](data)
    except (LookupError, AttributeError, StopIteration) as error:
        raise ParameterError(f"{path} says that it is of the kind {kind!r}, but lacks {error}; compute it again") from error
    with style():
        return write_figure(stem, figure)


def drawings() -> dict[str, Callable[[Any], Any]]:
    """The kinds of results that have a picture, with the functions that draw them."""
    from saltus.plots import draw_attractors, draw_basins, draw_diagram, draw_motion, draw_plane, draw_stability_chart

    return {
        "motion": draw_motion,
        "phase_portrait": draw_plane,
        "response_spectrum": draw_diagram,
        "bifurcation_diagram": draw_diagram,
        "attractors": draw_attractors,
        "basins": draw_basins,
        "stability_chart": draw_stability_chart,
    }


def open_result(path: Path) -> Any:
    """The Dataset or DataTree at `path`.

    Raises:
        ParameterError: no such file, or one that is not of saltus; a sweep that is not complete.
    """
    import traceback

    import xarray

    if not path.exists():
        raise ParameterError(f"there is no file or folder {path}; give the .nc or .zarr that `saltus run` has written")
    if path.is_dir():
        return _open_store(path)
    try:
        with xarray.open_datatree(path, engine="h5netcdf") as tree:
            tree.load()
    except (OSError, ValueError, KeyError, TypeError) as error:  # h5netcdf has many ways to say so
        with _without_unraisable():
            traceback.clear_frames(error.__traceback__)
        raise ParameterError(f"{path} is no netCDF file that can be read ({_first_line(error)})") from error
    return tree if tree.children else tree.to_dataset()


@contextmanager
def _without_unraisable() -> Iterator[None]:
    """Let objects go in silence: a file that h5netcdf could open only half prints a traceback when it is closed."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda lost: None
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _open_store(path: Path) -> Any:
    """The dataset of a complete sweep."""
    from saltus.sweep import open_store, status

    found = status(path)
    if not found.complete:
        raise ParameterError(f"{path} has {found.done} of {found.total} chunks; run the study again to go on, then plot it")
    data = open_store(path)
    if kind_of(data) == "basin_cells":
        raise ParameterError(f"{path} keeps the cells of basins alone; plot {path.with_suffix('.nc').name} beside it")
    return data


def _first_line(error: Exception) -> str:
    return f"{next(iter(str(error).splitlines()), type(error).__name__):.80}"


def kind_of(data: Any) -> str:
    """What a result is, by its attributes; empty where they do not name it."""
    return str(data.attrs.get("kind", ""))
