"""Files that are complete or not there, and that notice when they are damaged.

Every output is made in memory, written to a file beside its place, brought to the disk and moved
there. A netCDF file ends with a checksum of all its bytes, after the part that HDF5 reads, so that
it is checked before HDF5 opens it.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

from saltus.checks import check_memory
from saltus.errors import ParameterError, SaltusError, shown

PART = ".part"
# s; without locks, a half-written file that was not touched for so long is taken as left by a
# killed run
STALE = 60.0
LONGEST_NAME = 220  # bytes; file systems allow 255, and a half-written file has a longer name
COPIES = 2  # the number of copies of a file's bytes that reading it makes
# of the checksum: wiping out 64 bytes leaves one of them
HEAD = b"\nsha256 of the bytes before: "
TAIL = b" (saltus)\n"
UNCHECKED = (
    "has no checksum (saltus writes one behind each file), so that damage to its numbers "
    "cannot be excluded"
)
HDF5 = b"\x89HDF\r\n\x1a\n"  # the first bytes of its files
# where HDF5's superblock holds the file's length, by its version
END_OF_FILE = {0: 40, 1: 44, 2: 28, 3: 28}


# --- writing -----------------------------------------------------------------


def write_durably(path: Path, content: bytes, flush: bool = True) -> None:
    """Write a file so that it is either complete or not there, also after a kill or a power
    failure.

    It is written to a file beside its place, brought to the disk, and moved there; its folder is
    made as needed. If this fails or is interrupted, `path` is as it was before and nothing is left
    beside it. Without `flush` the disk is not waited for, which takes some milliseconds: after a
    power failure the file may then lack its content, which its checksum tells.

    Raises
    ------
    OSError
        The error has the name of the file.
    """
    if "\0" in str(path) or len(os.fsencode(path.name)) > LONGEST_NAME:
        raise ParameterError(
            f"path must name a file, with a name of at most {LONGEST_NAME} bytes, got "
            f"{shown(str(path))}",
            "path",
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.urandom(6).hex()}{PART}")
    try:
        with part.open("xb") as file:
            lock(file)  # tells `sweep_up` that the file is still being written
            file.write(content)
            file.flush()
            if flush:
                os.fsync(file.fileno())
            os.replace(part, path)
    except BaseException as error:  # KeyboardInterrupt too
        with contextlib.suppress(OSError):
            part.unlink()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
        raise


def write_bytes(path: Path | str, content: bytes) -> Path:
    """Write `content` to `path` durably, and remove what killed runs left half-written in its
    folder. Returns `path`.
    """
    path = Path(path)
    write_durably(path, content)
    sweep_up(path.parent.glob(f".*{PART}"))
    return path


def write_text(path: Path | str, text: str) -> Path:
    """Write `text` to `path` as `write_bytes` does, as UTF-8."""
    return write_bytes(path, text.encode())


def write_dataset(path: Path | str, dataset: Any) -> Path:
    """Write an xarray Dataset or DataTree to `path` as `write_bytes` does, as netCDF with a
    checksum at its end.
    """
    buffer = io.BytesIO()
    dataset.to_netcdf(buffer, engine="h5netcdf")
    return write_bytes(path, sealed(buffer.getvalue()))


def sealed(content: bytes) -> bytes:
    """Bytes with their checksum behind them, as `checked_content` reads them."""
    return content + HEAD + _digest(content) + TAIL


def write_figure(stem: Path | str, figure: Any, title: str | None = None) -> list[Path]:
    """Write a matplotlib Figure as `stem`.png and `stem`.pdf, the same bytes for the same figure;
    `title` is that of the PDF.

    The PDF has the layout of the PNG, as computing a second layout would take a third of the time
    of both.
    """
    png = write_picture(Path(f"{stem}.png"), figure)
    layout = figure.get_layout_engine()
    figure.set_layout_engine("none")
    try:
        return [png, write_picture(Path(f"{stem}.pdf"), figure, title)]
    finally:
        figure.set_layout_engine(layout)


def write_picture(
    path: Path, figure: Any, title: str | None = None, *, dpi: float | str | None = None
) -> Path:
    """Write a matplotlib Figure in the format that the suffix of `path` names; `title` is that of a
    PDF, `dpi` the dots in an inch, by default those of Matplotlib's settings.

    Raises
    ------
    ParameterError
        Matplotlib has no such format.
    """
    kind = path.suffix.removeprefix(".")
    buffer = io.BytesIO()
    known = figure.canvas.get_supported_filetypes()
    if kind not in known:
        raise ParameterError(
            f"{path} must end in .png, .pdf or .svg, for a picture of that format", "path"
        )
    metadata = {
        "pdf": {"CreationDate": None, "Title": title},
        "svg": {"Date": None, "Title": title},
    }
    dots = {} if dpi is None else {"dpi": dpi}
    figure.savefig(buffer, format=kind, metadata=metadata.get(kind, {}), **dots)
    return write_bytes(path, buffer.getvalue())


def sweep_up(parts: Iterable[Path]) -> None:
    """Remove the files that no process is writing any more, as they were left by killed runs."""
    for part in parts:
        with contextlib.suppress(OSError), part.open("rb") as file:
            mine = lock(file)
            if mine or (mine is None and time.time() - part.stat().st_mtime > STALE):
                part.unlink()


def lock(file: IO[bytes], shared: bool = False, wait: bool = False) -> bool | None:
    """Lock an open file until it is closed or its process ends; with `wait`, wait for that. Returns
    whether it is locked, None if the system has no locks."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        fcntl.flock(
            file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB)
        )
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


# --- JSON --------------------------------------------------------------------


def parsed_json(text: str | bytes) -> Any:
    """The value of a JSON text; keys that are given twice are refused, as the last one would count
    without a notice.

    Raises
    ------
    ValueError
        The text is no JSON, or has a key twice.
    """

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, value in pairs:
            if name in found:
                raise ValueError(f"the key {shown(name)} is given twice")
            found[name] = value
        return found

    return json.loads(text, object_pairs_hook=once)


# --- reading -----------------------------------------------------------------


@contextlib.contextmanager
def reading(path: Path | str, kind: str) -> Iterator[None]:
    """Where a file that others wrote is read: whatever the reader of its format raises is told in
    one sentence.

    Raises
    ------
    ParameterError
        The file does not exist, or cannot be read as what `kind` says, such as "a record".
    """
    try:
        yield
    except SaltusError:
        raise
    except FileNotFoundError:
        raise ParameterError(f"file {shown(str(path), 160)} does not exist", "file") from None
    except RecursionError:
        raise ParameterError(
            f"file {shown(str(path), 160)} cannot be read as {kind}: it is nested too deeply",
            "file",
        ) from None
    except Exception as error:  # a format's reader may raise anything where the bytes are damaged
        said = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise ParameterError(
            f"file {shown(str(path), 160)} cannot be read as {kind} ({said:.120})", "file"
        ) from error


def read_dataset(path: Path | str) -> Any:
    """The Dataset or DataTree in a netCDF file, in memory; its checksum is compared before HDF5
    reads it.

    A file without a checksum, which another program has written, is `UNCHECKED`.

    Raises
    ------
    ParameterError
        There is no such file, it is damaged, or it is no netCDF file.
    """
    import xarray

    from saltus.result_tree import ResultTree

    path = Path(path)
    content = checked_content(path)
    if content[:200].lstrip().lower().startswith((b"<!doctype html", b"<html")):
        raise ParameterError(f"{path} is a page; open it in a browser")
    try:
        with xarray.open_datatree(
            io.BytesIO(content), engine="h5netcdf", phony_dims="access"
        ) as tree:
            variables = [variable for node in tree.subtree for variable in node.variables.values()]
            size = float(sum(variable.nbytes for variable in variables))
            check_memory(str(path), size, "its arrays")  # these may be larger than the file
            # not `tree.load()`, which leaves one lazy that has the name of a child of the root
            for variable in variables:
                variable.load()
    except ParameterError:
        raise
    except Exception as error:  # h5netcdf, HDF5 and xarray have many ways to say so
        with _without_unraisable():
            traceback.clear_frames(error.__traceback__)
        said = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise ParameterError(f"{path} is not a readable netCDF file ({said:.80})") from error
    for node in tree.subtree:
        # the file is closed, and a handle to it need not be sent to other processes
        node.set_close(None)
    return (
        ResultTree.from_dict(tree.to_dict(), name=tree.name) if tree.children else tree.to_dataset()
    )


@contextlib.contextmanager
def _without_unraisable() -> Iterator[None]:
    """Suppress errors of objects that are deleted: a file that h5netcdf has opened only in part
    prints a traceback then.
    """
    hook = sys.unraisablehook
    sys.unraisablehook = lambda lost: None
    try:
        yield
    finally:
        sys.unraisablehook = hook


def checked_content(path: Path) -> bytes:
    """The bytes of a netCDF file, without its checksum.

    Raises
    ------
    ParameterError
        It cannot be read, or its checksum is not that of its bytes.
    """
    try:
        if path.exists() and not path.is_file():  # reading a device or a pipe may never end
            raise ParameterError(f"{path} is not a readable file")
        # a sparse file may have any size
        check_memory(str(path), COPIES * path.stat().st_size, "its bytes")
        content = path.read_bytes()
    except OSError as error:
        raise ParameterError(
            f"{path} cannot be read ({(error.strerror or str(error)).lower()})"
        ) from error
    if not has_checksum(content):
        place = (
            END_OF_FILE.get(content[8]) if content.startswith(HDF5) and len(content) > 52 else None
        )
        end = (
            len(content) if place is None else int.from_bytes(content[place : place + 8], "little")
        )
        if end != len(content):
            raise ParameterError(
                f"{path} is damaged: it has {len(content)} bytes, and its data end at {end}; "
                "compute it again"
            )
        return content
    head = content[:-_END]
    middle = content[-_END : -len(TAIL)]
    tail = content[-len(TAIL) :]
    if middle != HEAD + _digest(head) or tail != TAIL:
        raise ParameterError(
            f"{path} is damaged: its checksum is not that of its bytes; compute it again, or "
            "take a copy of it"
        )
    return head


def has_checksum(content: bytes) -> bool:
    """Whether bytes end with a checksum or a part of one."""
    end = content[-2 * _END :]
    return HEAD in end or TAIL in end


_END = len(HEAD) + 64 + len(TAIL)


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


# --- folders -----------------------------------------------------------------


def check_writable(folder: Path | str) -> None:
    """Refuse, before anything is computed, a folder in which no file can be made; nothing is left
    behind.

    Raises
    ------
    ParameterError
        The folder, or the nearest one above it that exists, is a file or cannot be written to.
    """
    folder = Path(folder)
    existing = folder
    try:
        while not existing.exists() and existing != existing.parent:
            existing = existing.parent
        if not existing.is_dir():
            raise ParameterError(
                f"the output folder {folder} cannot be made: {existing} is a file; name another "
                "with --output"
            )
        with tempfile.TemporaryFile(dir=existing):
            pass
    except (OSError, ValueError) as error:
        if isinstance(error, ParameterError):
            raise
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ParameterError(
            f"the output folder {folder} cannot be written to ({reason.lower()}); name another "
            "with --output"
        ) from error
