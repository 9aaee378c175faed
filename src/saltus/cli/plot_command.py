"""`saltus plot`: the picture of a result that is on disk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from saltus.errors import ParameterError, SaltusError


def plot_store(path: Path, output: Path | None) -> None:
    """Draw the result at `path` (netCDF, or the Zarr store of a sweep) beside it, or into the folder `output`.

    Raises
    ------
    ParameterError
        There is no result of saltus at `path`, a sweep is not complete, `output` is no folder or cannot be written to.
    """
    from saltus.config import open_result
    from saltus.files import UNCHECKED, check_writable, has_checksum

    folder = path.parent if output is None else output
    if folder.suffix in (".png", ".pdf") and not folder.is_dir():
        raise ParameterError(f"--output names a folder, in which the picture is {path.stem}.png, got {folder}")
    check_writable(folder)
    data = open_result(path)
    _check_sizes(path, data)
    files = draw_file(path, folder / path.stem, data)
    names = ", ".join(file.name for file in files)
    if path.is_file() and not has_checksum(path.read_bytes()):
        Console(highlight=False, stderr=True).print(f"{path} {UNCHECKED}.", markup=False, soft_wrap=True)
    Console(highlight=False).print(f"The picture is in {folder}: {names}", markup=False, soft_wrap=True)


def _check_sizes(path: Path, data: Any) -> None:
    """Refuse numbers that are too large for an axis; computations never give such numbers."""
    import numpy as np

    from saltus.checks import LIMITS

    for node in getattr(data, "subtree", (data,)):
        for name, variable in node.variables.items():
            if variable.dtype.kind == "f" and (np.isfinite(variable.values) & (np.abs(variable.values) > LIMITS.value)).any():
                raise ParameterError(f"{path} cannot be drawn: {name!s:.60} has numbers above {LIMITS.value:g} in size")


def draw_file(path: Path, stem: Path, data: Any) -> list[Path]:
    """Draw a result as `stem`.png and `stem`.pdf.

    Raises
    ------
    ParameterError
        The result is of no kind that has a picture, or its data do not fit its kind.
    """
    from saltus.config import kind_of
    from saltus.files import write_figure
    from saltus.plots import DRAWINGS, figure_of, style

    kind = kind_of(data)
    if kind not in DRAWINGS:
        what = f"its kind is {kind!r}" if kind else "it does not say of what kind it is"
        raise ParameterError(f"{path} is no result that `saltus plot` draws: {what:.60}; it draws {', '.join(DRAWINGS)}")
    try:
        with style():
            return write_figure(stem, figure_of(DRAWINGS[kind](data)))
    except OSError:
        raise
    except Exception as error:  # a file of another program may lack anything, or contain anything
        said = "" if isinstance(error, SaltusError) else f"{type(error).__name__}: "
        said += " ".join(str(error).split())
        raise ParameterError(f"{path} says that it is of the kind {kind!r}, but it cannot be drawn ({said:.150})") from None
