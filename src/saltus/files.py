"""Files that are complete or not there: every output is written beside its place and moved there once complete."""

from __future__ import annotations

import contextlib
import os
import secrets
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from saltus.errors import ParameterError


def write_atomically(path: Path | str, writer: Callable[[Path], object]) -> Path:
    """Let `writer` fill a temporary file in the folder of `path`, then move it to `path` in one step.

    Folders are made as needed; the temporary name ends as `path` does. If the writer fails or is interrupted, `path` is what
    it was before and the temporary file is gone. Returns `path`.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.stem}.{secrets.token_hex(6)}.part{path.suffix}")
    try:
        writer(part)
        os.replace(part, path)
    except BaseException:  # KeyboardInterrupt too
        with contextlib.suppress(FileNotFoundError):
            part.unlink()
        raise
    return path


def write_text(path: Path | str, text: str) -> Path:
    """Write `text` to `path` atomically, as UTF-8."""
    return write_atomically(path, lambda part: part.write_text(text, encoding="utf-8"))


def write_dataset(path: Path | str, dataset: Any) -> Path:
    """Write an xarray Dataset or DataTree to `path` atomically, as netCDF."""
    return write_atomically(path, lambda part: dataset.to_netcdf(part, engine="h5netcdf"))


def write_figure(stem: Path | str, figure: Any, formats: tuple[str, ...] = ("png", "pdf"), **options: Any) -> list[Path]:
    """Write a matplotlib Figure atomically in each of `formats`, as `stem`.png and so on; `options` go to savefig."""

    def save(part: Path) -> None:
        figure.savefig(part, format=part.suffix[1:], **options)

    return [write_atomically(f"{stem}.{kind}", save) for kind in formats]


def check_writable(folder: Path | str) -> None:
    """Refuse, before anything is computed, a folder in which no file can be made; nothing is left behind.

    Raises:
        ParameterError: the folder, or the nearest one above it that exists, is a file or cannot be written to.
    """
    folder = Path(folder)
    existing = folder
    try:
        while not existing.exists() and existing != existing.parent:
            existing = existing.parent
        if not existing.is_dir():
            raise ParameterError(f"the output folder {folder} cannot be made: {existing} is a file; name another with --output")
        with tempfile.TemporaryFile(dir=existing):
            pass
    except (OSError, ValueError) as error:
        if isinstance(error, ParameterError):
            raise
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ParameterError(
            f"the output folder {folder} cannot be written to ({reason.lower()}); name another with --output"
        ) from error
