"""Matrices in files: `.npz` of NumPy, and `.mat` of MATLAB's version 5, 6 and 7.

Only the arrays that are asked for are read, and their sizes are compared with the bytes that are
there before any memory is taken. A `.mat` file is read here, as SciPy's reader may end the process
where bytes are damaged.
"""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_memory
from saltus.errors import ParameterError, shown
from saltus.files import reading

# of a matrix that is read: one with more rows than a structure may have is refused by its size
MOST_NUMBERS = 4 * LIMITS.coordinates**2
ENTRY_BYTES = 16  # the most bytes of a number: a complex one
# the types of MATLAB's data elements that hold numbers, without their byte order
STORED = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"
}  # fmt: skip
MATRIX = 14
COMPRESSED = 15
SPARSE = 5  # the class of sparse arrays
NUMERIC = range(6, 16)  # the classes of full arrays of numbers
COMPLEX = 0x0800
HEADER = 128  # bytes before the first element
NAME_BYTES = 2048  # which hold flags, dimensions and the name of an array
MOST_ELEMENTS = 10_000  # in a file


def matrices_in(path: str, names: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """The matrices in a .npz or .mat file by their names, each with what it may be called there;
    damping may lack.

    Raises
    ------
    ParameterError
        No such file, one that is damaged, an array that is missing, no matrix, or too large.
    """
    place = Path(path)
    if place.suffix not in (".npz", ".mat"):
        raise ParameterError(
            f"file must be a .npz or .mat file of matrices, got {shown(path)}", "file"
        )
    with reading(path, f"a {place.suffix} file"):
        if not place.exists():
            raise FileNotFoundError
        if not place.is_file():  # reading a device or a pipe may never end
            raise ValueError("it is no file")
        check_memory("file", 2.0 * place.stat().st_size, "its bytes")
        if place.suffix == ".npz":
            with zipfile.ZipFile(place) as archive:
                found = _wanted(path, names, _members(archive))
        else:
            found = _wanted(path, names, _arrays(place.read_bytes()))
    return found


def _wanted(
    path: str, names: Mapping[str, Sequence[str]], arrays: Mapping[str, Callable[[], np.ndarray]]
) -> dict[str, Any]:
    """The arrays of a file that are asked for, of those that it has."""
    found: dict[str, Any] = {}
    for name, called in names.items():
        there = [arrays[key] for key in called if key in arrays]
        if not there and name != "damping":
            raise ParameterError(
                f"{path} has no {' or '.join(called)}; it has {shown(', '.join(arrays), 200)}",
                "file",
            )
        found[name] = there[0]() if there else None
    return found


def _check_shape(shape: Sequence[int]) -> None:
    """Refuse an array that is no matrix of a size that a structure may have."""
    if len(shape) != 2 or min(shape) < 0 or math.prod(shape) > MOST_NUMBERS:
        raise ValueError(
            f"an array of {' x '.join(map(str, shape))} numbers is in it; matrices of a structure "
            f"have at most {LIMITS.coordinates} rows"
        )


# --- NumPy -------------------------------------------------------------------


def _members(archive: zipfile.ZipFile) -> dict[str, Callable[[], np.ndarray]]:
    """The arrays of a .npz file by their names, each with its reader."""
    return {
        info.filename.removesuffix(".npy"): partial(_member, archive, info)
        for info in archive.infolist()
    }


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """An array of a .npz file, of which no more bytes are unpacked than its heading says."""
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("it is compressed in another way than NumPy does it")
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        heading = (
            np.lib.format.read_array_header_1_0(file)
            if version == (1, 0)
            else np.lib.format.read_array_header_2_0(file)
        )
        shape, by_columns, kind = heading
        _check_shape(shape)
        if kind.kind not in "biufc" or kind.itemsize > ENTRY_BYTES:
            raise ValueError(f"it holds {kind} in the place of numbers")
        size = math.prod(shape) * kind.itemsize
        content = file.read(size + 1)  # one more, by which the end of the member is checked
    if len(content) != size:
        raise ValueError(f"{info.filename} has not the {size} bytes that its header declares")
    return np.frombuffer(content, kind).reshape(shape, order="F" if by_columns else "C")


# --- MATLAB ------------------------------------------------------------------


@dataclass(frozen=True)
class Element:
    """A data element: its type, its bytes, and where the next one begins."""

    kind: int
    content: bytes
    end: int


@dataclass(frozen=True)
class Bytes:
    """Bytes in an order, of which elements are read within their length."""

    content: bytes
    order: str  # "<" or ">"

    def element(self, at: int) -> Element:
        """The element at a place."""
        tag = self.whole(at)
        if tag >> 16:  # a short one, whose bytes stand beside its type
            size = tag >> 16
            start = at + 4
            end = at + 8
            kind = tag & 0xFFFF
            inside = size <= 4
        else:
            kind, size, start = tag, self.whole(at + 4), at + 8
            end = start + size if kind == COMPRESSED else start + 8 * -(-size // 8)
            inside = start + size <= len(self.content)
        content = self.content[start : start + size]
        if not inside or len(content) != size:
            raise ValueError("an element in it is longer than the file")
        return Element(kind, content, end)

    def numbers(self, at: int, most: int) -> tuple[np.ndarray, int]:
        """The numbers of an element at a place, and where the next one begins."""
        found = self.element(at)
        if found.kind not in STORED:
            raise ValueError(f"data of the type {found.kind} stand in the place of numbers")
        kind = np.dtype(self.order + STORED[found.kind])
        if len(found.content) % kind.itemsize or len(found.content) > most * kind.itemsize:
            raise ValueError("an element in it has another length than its numbers")
        return np.frombuffer(found.content, kind), found.end

    def whole(self, at: int) -> int:
        part = self.content[at : at + 4]
        if len(part) < 4:
            raise ValueError("it ends within an element")
        return int.from_bytes(part, "little" if self.order == "<" else "big")


def _arrays(content: bytes) -> dict[str, Callable[[], np.ndarray]]:
    """The arrays of a .mat file by their names, each with its reader."""
    if content[:4] in (b"\x89HDF", b"MATL") and b"7.3" in content[:HEADER]:
        raise ValueError("it has MATLAB's version 7.3; save it with -v7")
    if content.startswith(b"\x89HDF"):
        raise ValueError("it is an HDF5 file; save it with -v7 in MATLAB")
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None or len(content) < HEADER:
        raise ValueError("it is not a file of MATLAB's version 5 to 7; save it with -v7")
    file = Bytes(content, order)
    found: dict[str, Callable[[], np.ndarray]] = {}
    at = HEADER
    for _ in range(MOST_ELEMENTS):
        if at >= len(content):
            break
        element = file.element(at)
        at = element.end
        if element.kind == COMPRESSED:
            unpacked = zlib.decompressobj().decompress(element.content, NAME_BYTES)
            kind = Bytes(unpacked, order).whole(0)
            inner = unpacked[8:]
        else:
            kind = element.kind
            inner = element.content
        if kind != MATRIX:
            raise ValueError(f"data of the type {kind} stand in the place of an array")
        heading = _heading(Bytes(inner, order))
        found[heading.name] = partial(_array, heading, element, order)
    return found


@dataclass(frozen=True)
class ArrayHeading:
    """What stands before the numbers of an array, and where these begin."""

    flags: int
    shape: list[int]
    name: str
    end: int


def _heading(array: Bytes) -> ArrayHeading:
    """The heading of an array."""
    flags, at = array.numbers(0, 2)
    shape, at = array.numbers(at, 32)
    name, at = array.numbers(at, NAME_BYTES)
    if flags.size != 2 or shape.size < 2 or name.dtype.itemsize != 1:
        raise ValueError("the header of an array is damaged")
    sizes = [int(size) for size in shape]
    return ArrayHeading(int(flags[0]), sizes, name.tobytes().decode("ascii"), at)


def _array(heading: ArrayHeading, element: Element, order: str) -> np.ndarray:
    """The matrix that an element of a .mat file holds."""
    shape, name, at = heading.shape, heading.name, heading.end
    _check_shape(shape)
    content = element.content
    if element.kind == COMPRESSED:
        unpack = zlib.decompressobj()
        content = unpack.decompress(content, MOST_NUMBERS * 2 * ENTRY_BYTES + NAME_BYTES)
        if not unpack.eof:  # which compares the checksum
            raise ValueError(f"{name} is cut short, or has more numbers than its header declares")
        content = Bytes(content, order).element(0).content
    array = Bytes(content, order)
    kind = heading.flags & 0xFF
    if kind != SPARSE and kind not in NUMERIC:
        raise ValueError(f"{name} is not an array of numbers")
    entries = math.prod(shape)
    rows = columns = np.zeros(0, dtype=int)
    if kind == SPARSE:
        rows, at = array.numbers(at, MOST_NUMBERS)
        columns, at = array.numbers(at, shape[1] + 1)
        entries = _stored(rows, columns, shape)
    parts = []
    for _ in range(2 if heading.flags & COMPLEX else 1):
        numbers, at = array.numbers(at, MOST_NUMBERS)
        parts.append(numbers)
    if any(part.size < entries or (kind != SPARSE and part.size > entries) for part in parts):
        raise ValueError(f"{name} has another number of entries than its header declares")
    values = parts[0].astype(float)
    if len(parts) > 1:
        values = values + 1j * parts[1].astype(float)
    if kind != SPARSE:
        return values.reshape(shape, order="F")
    dense = np.zeros(shape, dtype=values.dtype)
    column = np.repeat(np.arange(shape[1]), np.diff(columns.astype(int)))
    np.add.at(dense, (rows[:entries].astype(int), column), values[:entries])
    return dense


def _stored(rows: np.ndarray, columns: np.ndarray, shape: Sequence[int]) -> int:
    """The number of entries of a sparse array, whose places are within its size."""
    ends = columns.astype(int)
    if ends.size != shape[1] + 1 or ends[0] != 0 or (np.diff(ends) < 0).any():
        raise ValueError("the columns of a sparse array are damaged")
    entries = int(ends[-1])
    own = rows[:entries].astype(int)
    if own.size != entries or (own < 0).any() or (own >= shape[0]).any():
        raise ValueError("the rows of a sparse array are damaged")
    return entries


def unpacked_numbers(text: bytes, shape: Sequence[int]) -> np.ndarray:
    """The numbers that were compressed, as many as a shape has; more are not unpacked.

    Raises
    ------
    ValueError
        Another number of them, or bytes that are damaged.
    """
    size = 8 * math.prod(shape)
    unpack = zlib.decompressobj()
    content = unpack.decompress(text, size + 1)
    if len(content) != size or not unpack.eof or unpack.unused_data:
        raise ValueError("it has another size than its header declares")
    return np.frombuffer(content, dtype="<f8").reshape(shape)
