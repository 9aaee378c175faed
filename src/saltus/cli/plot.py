"""`saltus plot`: the picture of a result that is on disk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from saltus.errors import ParameterError, near


def plot_store(path: Path, output: Path | None) -> None:
    """Draw the result at `path` (netCDF, or the Zarr store of a sweep) beside it, or into the folder `output`.

    Raises:
        ParameterError: there is no result of saltus at `path`, or a sweep is not complete.
    """
    data = open_result(path)
    stem = (path.parent if output is None else output) / path.stem
    files = draw_file(path, stem, data)
    Console(highlight=False).print(
        f"The picture is in {stem.parent}: {', '.join(f.name for f in files)}", markup=False, soft_wrap=True
    )


def draw_file(path: Path, stem: Path, data: Any) -> list[Path]:
    """Draw a result as `stem`.png and `stem`.pdf.

    Raises:
        ParameterError: it is of no kind that has a picture.
    """
    from saltus.files import write_figure
    from saltus.plots.style import style

    kind = kind_of(data)
    if kind not in DRAWN:
        raise ParameterError(f"{path} is no result that saltus draws (its kind is {kind or 'not said'!r}); {near(kind, DRAWN)}")
    figure = DRAWN[kind](data)
    with style():
        return write_figure(stem, figure)


def open_result(path: Path) -> Any:
    """The Dataset or DataTree at `path`.

    Raises:
        ParameterError: no such file, or one that is not of saltus; a sweep that is not complete.
    """
    import xarray

    if not path.exists():
        raise ParameterError(f"there is no file or folder {path}; give the .nc or .zarr that `saltus run` has written")
    if path.is_dir():
        from saltus.sweep import open_store, status

        found = status(path)
        if not found.complete:
            raise ParameterError(f"{path} has {found.done} of {found.total} chunks; run the study again to go on, then plot it")
        return open_store(path)
    try:
        tree = xarray.open_datatree(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise ParameterError(f"{path} is no netCDF file of saltus ({str(error).splitlines()[0]:.80})") from error
    return tree if tree.children else tree.to_dataset()


def kind_of(data: Any) -> str:
    """What a result says that it is, in its attributes."""
    kind = str(data.attrs.get("kind", ""))
    if kind:
        return kind.replace(" ", "_")
    title = str(data.attrs.get("title", ""))
    return title.removesuffix(" computed by saltus").replace(" ", "_")


def _motion(data: Any) -> Any:
    from saltus.plots.motion import draw_motion

    return draw_motion(data)


def _diagram(data: Any) -> Any:
    from saltus.plots.diagram import draw_diagram

    return draw_diagram(data)


def _portrait(data: Any) -> Any:
    from saltus.plots.plane import draw_plane

    return draw_plane(data)


def _basins(data: Any) -> Any:
    from saltus.plots.basins import draw_basins

    return draw_basins(data)


def _attractors(data: Any) -> Any:
    from saltus.plots.attractors import draw_attractors

    return draw_attractors(data)


def _chart(data: Any) -> Any:
    from saltus.plots.chart import draw_stability_chart

    return draw_stability_chart(data)


DRAWN = {
    "motion": _motion,
    "phase_portrait": _portrait,
    "response_spectrum": _diagram,
    "bifurcation_diagram": _diagram,
    "attractors": _attractors,
    "basins": _basins,
    "stability_chart": _chart,
}
