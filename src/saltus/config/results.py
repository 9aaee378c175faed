"""Results and studies read back by the kind of their files, and results written for MATLAB."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered, check_number
from saltus.errors import ParameterError, shown
from saltus.result import Result
from saltus.systems import System

PRINT_DPI = 300.0  # what journals ask of pictures with shades

if TYPE_CHECKING:
    import xarray

    from saltus.config.study import Study

# what stores keep beside a netCDF file
PARTIAL = {"basin_cells": "the cells of basins", "diagram": "the parts of a diagram"}
LONGEST_MATLAB_NAME = 63  # the most characters of a name in MATLAB


@answered
def load(path: str | Path) -> xarray.Dataset | xarray.DataTree | Study | System:
    """The contents of a file or a folder that saltus has written, or that describes a study or a
    system.

    A result in netCDF (.nc) becomes a Dataset or a DataTree, whose attribute `kind` says which
    result it is; the complete store of a sweep (a folder) a Dataset; a study (.toml) a `Study`; a
    system (.json, of `System.to_json`) a `System`. The orbits of a branch are given by
    `saltus.orbits.orbits_of(load(...))`. No code in a result is run; Python files with models that
    a study names are run.

    Parameters
    ----------
    path
        The file or the folder.

    Raises
    ------
    ParameterError
        There is no such file, it is of none of these kinds, or it is damaged.

    Examples
    --------
    >>> path = saltus.save("system.json", system)
    >>> saltus.load("system.json") == system
    True
    """
    path = Path(path)
    if not os.path.exists(path):  # which a name that is too long is not, either
        raise ParameterError(
            (
                f"there is no file or folder {path}; give a .nc, .zarr, .toml or .json that saltus "
                "can read"
            ),
            "path",
        )
    if path.is_dir() or path.suffix not in (".toml", ".json"):
        try:
            found: xarray.Dataset | xarray.DataTree = open_result(path)
            return found
        except ParameterError as error:
            raise ParameterError(str(error), error.parameter or "path") from None
    if path.suffix == ".toml":
        from saltus.config.study import load_study

        return load_study(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path} cannot be read as text ({error!s:.120})", "path") from None
    return System.from_json(text)


def open_result(path: Path) -> Any:
    """The Dataset or DataTree at `path`; no code in it is run, and its system is not made.

    Raises
    ------
    ParameterError
        No such file, or one that saltus has not written, or is damaged; a sweep that is not
        complete.
    """
    from saltus.files import read_dataset

    if not os.path.exists(path):  # which a name that is too long is not, either
        raise ParameterError(
            (
                f"there is no file or folder {path}; give the .nc or .zarr that `saltus run` has "
                "written"
            ),
            "path",
        )
    return _open_store(path) if path.is_dir() else read_dataset(path)


def _open_store(path: Path) -> Any:
    """The dataset of a complete sweep."""
    from saltus.checks import check_memory
    from saltus.sweep import open_store, read_plan

    read_plan(path)
    data = open_store(path)
    check_memory(str(path), float(data.nbytes), "its arrays")
    if kind_of(data) in PARTIAL:
        raise ParameterError(
            f"{path} keeps {PARTIAL[kind_of(data)]} alone; read {path.with_suffix('.nc').name} in "
            f"the same folder"
        )
    return data


def kind_of(data: Any) -> str:
    """The kind of a result by its attributes; empty if they do not name one."""
    return str(data.attrs.get("kind", ""))


@answered
def save(
    path: str | Path, result: Any, *, title: str | None = None, dpi: float | None = None
) -> Path:
    """Write a result, a picture or a text to a file that is complete or not there, also after a
    kill; returns its path.

    Results become netCDF with a checksum behind it, which `load` compares; a dataset of one's own
    gets the version of saltus among its attributes. A picture has the format that its suffix names,
    and the same bytes whenever it is drawn again. Folders are made as needed.

    Parameters
    ----------
    path
        The file; that of a result ends in ".nc". If there is no suffix, ".nc" is appended for a
        result, ".json" for a system, ".png" for a picture.
    result
        A Dataset, a DataTree, a result with `to_xarray`, such as a motion or a branch; a system; a
        Matplotlib figure, or axes, such as `plot` returns; a text, or bytes.
    title
        The title of a picture in the description of a PDF.
    dpi
        The dots in an inch of a picture; without it those of its figure, and at least 300.

    Raises
    ------
    ParameterError
        What cannot be written, or a place at which no file can be made.

    Examples
    --------
    >>> path = saltus.save("branch.nc", branch)
    >>> len(saltus.orbits.orbits_of(saltus.load(path))) == len(branch.orbits)
    True
    """
    from saltus import files

    if not isinstance(path, (str, os.PathLike)) or not Path(path).name:
        raise ParameterError(f"path must name a file, such as branch.nc, got {shown(path)}", "path")
    path = Path(path)
    data = result.to_xarray() if hasattr(result, "to_xarray") else result
    if isinstance(result, System):
        path = path if path.suffix else path.with_suffix(".json")
        if path.suffix != ".json":
            raise ParameterError(f"{path} must end in .json, as a system becomes a text", "path")
        data = result.to_json()
    try:
        if isinstance(data, (str, bytes)):
            return files.write_bytes(path, data.encode() if isinstance(data, str) else data)
        if hasattr(data, "data_vars") and hasattr(data, "attrs"):
            path = path if path.suffix else path.with_suffix(".nc")
            if path.suffix.lower() != ".nc":
                others = (
                    "`to_csv` writes tables, `to_mat` files for MATLAB; a picture, as of "
                    "`plot`, ends in .png, .pdf or .svg"
                )
                raise ParameterError(
                    f"{path} must end in .nc, as a result becomes netCDF; {others}", "path"
                )
            return files.write_dataset(path, _with_version(data))
        figure = _figure_of(data)
        if figure is None:
            raise ParameterError(
                (
                    "result must be a Dataset, a DataTree, a system, a figure, a text or an object "
                    f"with to_xarray, got {shown(result)}"
                ),
                "result",
            )
        if dpi is not None:
            check_number("dpi", dpi, at_least=10.0, at_most=2400.0)
        dots = max(PRINT_DPI, figure.dpi) if dpi is None else dpi
        path = path if path.suffix else path.with_suffix(".png")
        return files.write_picture(path, figure, title, dpi=dots)
    except OSError as error:
        raise ParameterError(
            f"{path} cannot be written ({(error.strerror or str(error)).lower()})", "path"
        ) from error


def _with_version(data: Any) -> Any:
    """The same data; with the version of saltus if their attributes have none."""
    from saltus import __version__

    if "saltus_version" in data.attrs:
        return data
    data = data.copy()
    data.attrs = {"saltus_version": __version__, **data.attrs}
    return data


def _figure_of(data: Any) -> Any:
    """A figure, or that of axes or of an array of axes; None of anything else."""
    first = data.flat[0] if isinstance(data, np.ndarray) and data.size else data
    figure = getattr(first, "figure", first)
    return figure if hasattr(figure, "savefig") else None


@answered
def to_mat(path: str | Path, result: xarray.Dataset | xarray.DataTree | Result) -> Path:
    """Write a result as a MATLAB file (version 5), which `load` of MATLAB and Octave reads; returns
    its path.

    Each variable and coordinate is an array under its name, in which characters that MATLAB does
    not take become "_"; texts are cell arrays; `attributes` is a struct, and so is each group of a
    tree.

    Parameters
    ----------
    path
        The path of the file; ".mat" is appended if it has no suffix.
    result
        A Dataset, a DataTree, or a result with `to_xarray`, such as a motion or a branch.

    Raises
    ------
    ParameterError
        Something that is no such result; two names that become one.

    Examples
    --------
    >>> path = saltus.to_mat("branch.mat", branch)
    >>> path.name
    'branch.mat'
    """
    import io

    from scipy.io import savemat

    from saltus.files import write_bytes

    data = result.to_xarray() if hasattr(result, "to_xarray") else result
    if not (hasattr(data, "data_vars") and hasattr(data, "attrs")):
        raise ParameterError(
            f"result must be a Dataset, a DataTree or an object with to_xarray, got "
            f"{shown(result)}",
            "result",
        )
    path = Path(path)
    if not path.name:
        raise ParameterError("path must name a file, such as motion.mat", "path")
    buffer = io.BytesIO()
    savemat(buffer, _struct(data), long_field_names=True, do_compression=True, oned_as="column")
    path = path if path.suffix else path.with_suffix(".mat")
    try:
        return write_bytes(path, buffer.getvalue())
    except OSError as error:
        raise ParameterError(
            f"{path} cannot be written ({(error.strerror or str(error)).lower()})", "path"
        ) from error


def _struct(node: Any) -> dict[str, Any]:
    """A Dataset, or a node of a tree with its children, as arrays and structs by MATLAB's names."""
    parts: dict[str, Any] = {
        str(name): _array(values.values)
        for name, values in {**node.coords, **node.data_vars}.items()
    }
    parts["attributes"] = _named(
        {str(name): _array(np.asarray(value)) for name, value in node.attrs.items()}
    )
    children = getattr(node, "children", {})
    return _named(parts | {str(name): _struct(child) for name, child in children.items()})


def _array(values: np.ndarray) -> Any:
    if values.dtype.kind in "US":
        return values.astype(object) if values.ndim else str(values)
    return values.astype(np.uint8) if values.dtype == bool else values


def _named(parts: dict[str, Any]) -> dict[str, Any]:
    names = [re.sub(r"\W", "_", name)[:LONGEST_MATLAB_NAME] for name in parts]
    names = [name if name[:1].isalpha() else f"x{name}"[:LONGEST_MATLAB_NAME] for name in names]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ParameterError(
            f"two names of the result become {twice} in MATLAB; rename one", "result"
        )
    return dict(zip(names, parts.values(), strict=True))
