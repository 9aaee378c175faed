"""`saltus plot`: the picture of a result that is on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from saltus.errors import ParameterError, SaltusError

PARTIAL = {"basin_cells": "the cells of basins", "diagram": "the parts of a diagram"}  # what stores keep beside a netCDF file


def plot_store(path: Path, output: Path | None) -> None:
    """Draw the result at `path` (netCDF, or the Zarr store of a sweep) beside it, or into the folder `output`.

    Raises:
        ParameterError: there is no result of saltus at `path`, a sweep is not complete, a folder cannot be written to.
    """
    from saltus.files import UNCHECKED, check_writable, has_checksum

    folder = path.parent if output is None else output
    check_writable(folder)
    data = open_result(path)
    try:
        files = draw_file(path, folder / path.stem, data)
    except (SaltusError, OSError):
        raise
    except Exception as error:  # what another program wrote may lack anything, and may hold anything in its place
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise ParameterError(
            f"{path} says that it is of the kind {kind_of(data)!r}, but it cannot be drawn ({said:.120})"
        ) from None
    names = ", ".join(file.name for file in files)
    if path.is_file() and not has_checksum(path.read_bytes()):
        Console(highlight=False, stderr=True).print(f"{path} {UNCHECKED}.", markup=False, soft_wrap=True)
    Console(highlight=False).print(f"The picture is in {folder}: {names}", markup=False, soft_wrap=True)


def draw_file(path: Path, stem: Path, data: Any) -> list[Path]:
    """Draw a result as `stem`.png and `stem`.pdf.

    Raises:
        ParameterError: it is of no kind that has a picture.
    """
    from saltus.files import write_figure
    from saltus.plots import style

    kind, drawn = kind_of(data), drawings()
    if kind not in drawn:
        what = f"its kind is {kind!r}" if kind else "it does not say of what kind it is"
        raise ParameterError(f"{path} is no result that `saltus plot` draws: {what:.60}; it draws {', '.join(drawn)}")
    with style():
        return write_figure(stem, drawn[kind](data))


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
    """The Dataset or DataTree at `path`; nothing in it is run, and its system is not made.

    Raises:
        ParameterError: no such file, or one that is not of saltus, or is damaged; a sweep that is not complete.
    """
    from saltus.files import read_dataset

    if not path.exists():
        raise ParameterError(f"there is no file or folder {path}; give the .nc or .zarr that `saltus run` has written")
    return _open_store(path) if path.is_dir() else read_dataset(path)


def _open_store(path: Path) -> Any:
    """The dataset of a complete sweep."""
    from saltus.checks import check_memory
    from saltus.sweep import open_store, read_plan

    read_plan(path)
    data = open_store(path)
    check_memory(str(path), float(data.nbytes), "its arrays")
    if kind_of(data) in PARTIAL:
        raise ParameterError(f"{path} keeps {PARTIAL[kind_of(data)]} alone; plot {path.with_suffix('.nc').name} beside it")
    return data


def kind_of(data: Any) -> str:
    """What a result is, by its attributes; empty where they do not name it."""
    return str(data.attrs.get("kind", ""))
