"""Records in files: AT2, VT2 and DT2 of PEER, V2 of CSMIP and COSMOS, and text with two columns.

The formats are told apart by their headings, not by the names of the files. Samples whose unit is
known are given in seconds and in metres, m/s, m/s^2 or newtons.
"""

from __future__ import annotations

import base64
import math
import re
import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from saltus.checks import LIMITS, check_count, check_number, free_memory
from saltus.errors import ParameterError, near, shown

GRAVITY = 9.80665  # m/s^2, the standard value, of which the g of a record is a multiple
# bytes that a character of a record takes, about, while it is read: as text, in lines, in pairs of
# numbers
RECORD_MEMORY = 20
WANTED = "saltus reads AT2, VT2 and DT2 (PEER), V2 (CSMIP, COSMOS), and text with two columns, time and value"
# the most lines before the samples of a PEER file: there are four, and some programs write more
MOST_HEADINGS = 12
UNITS = {
    "g": ("acceleration", GRAVITY),
    "m/s2": ("acceleration", 1.0),
    "cm/s2": ("acceleration", 0.01),
    "mm/s2": ("acceleration", 0.001),
    "m/s": ("velocity", 1.0),
    "cm/s": ("velocity", 0.01),
    "mm/s": ("velocity", 0.001),
    "m": ("displacement", 1.0),
    "cm": ("displacement", 0.01),
    "mm": ("displacement", 0.001),
    "n": ("force", 1.0),
    "kn": ("force", 1000.0),
}
# of a V2 file that does not say it
PLAIN = {"acceleration": "cm/s2", "velocity": "cm/s", "displacement": "cm"}
KINDS = {"acc": "acceleration", "vel": "velocity", "dis": "displacement"}  # by their first letters
PEER_COUNT = re.compile(
    r"NPTS\s*=\s*(\d+)\s*,?\s*DT\s*=\s*([\d.E+-]+)|^\s*(\d+)\s+([\d.E+-]+)\s+NPTS", re.IGNORECASE
)
PEER_UNITS = re.compile(r"\b(ACC|VEL|DIS)\w*\b.*\bUNITS?\s*(?:OF|:|=)\s*([\w/^.]+)", re.IGNORECASE)
CSMIP = re.compile(
    r"^\s*(\d+)\s+points? of (acc|vel|dis)\w* data equally spaced at\s*([\d.]+)\s*sec\w*[^\w(]*(?:in\s+|\(?\s*units\s*[:=]\s*)?"
    r"([a-z]+(?:/[\w/^]+)?)?(?:.*\(\s*\d*\s*[fegi](\d+))?",
    re.IGNORECASE,
)
COSMOS = re.compile(
    r"^\s*(\d+)\s+(?:[a-z]+\.?\s+)?(acc|vel|dis)\w*\.?\s+(?:pts|points),?\s*(?:approx\.?|at?)\s*"
    r"([\d.]+\s*(?:secs?|(?:pts|points)/sec))\s*,\s*units?\s*=\s*([\w/^]+)(?:.*\(\s*\d*\s*[fegi](\d+))?",
    re.IGNORECASE,
)
DECIMAL = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[ed][-+]?\d+)?"
# numbers whose signs stand where spaces would
TOUCHING = re.compile(rf"{DECIMAL}(?:(?=[-+]){DECIMAL})*", re.IGNORECASE)
COSMOS_REALS = re.compile(
    r"^\s*(\d+)\s+real-header values follow on\s+(\d+)\s+lines.*\(\s*\d*\s*[feg](\d+)",
    re.IGNORECASE,
)
# The places, from 0, of the step of the processed samples in ms, and of the raw ones in s, among
# the numbers of a COSMOS heading.
COSMOS_STEPS = ((61, 0.001), (33, 1.0))


@dataclass(frozen=True, eq=False)
class FileSamples:
    """The samples of a file, as they are written in it."""

    time: np.ndarray
    value: np.ndarray
    quantity: str = ""  # "" where the file does not say it
    units: str = ""


@dataclass(frozen=True)
class RecordFile:
    """The text of a file, by whose `name` refusals call it."""

    name: str
    lines: Sequence[str]

    @classmethod
    def opened(cls, path: Path, name: str) -> RecordFile:
        """The file at a path, if it is a text that fits into the memory."""
        try:
            found = path.stat()
            problem = ""
            if not stat.S_ISREG(found.st_mode):  # reading a device or a pipe may never end
                problem = "is no file"
            elif RECORD_MEMORY * found.st_size > LIMITS.memory * free_memory():
                problem = f"has {found.st_size} bytes, more than fits into the free memory"
            text = "" if problem else path.read_text(encoding="utf-8-sig")
        except FileNotFoundError:
            problem = "does not exist"
        except UnicodeDecodeError:
            problem = f"is not a text file; {WANTED}"
        except (OSError, ValueError) as error:
            problem = f"cannot be read ({getattr(error, 'strerror', None) or error!s:.120})"
        file = cls(name, () if problem else text.splitlines())
        if problem:
            file.refuse(problem, "")
        return file

    def refuse(self, problem: str, joined: str = ":") -> NoReturn:
        """Raise a ParameterError of one sentence about this file."""
        raise ParameterError(f"file {self.name!r}{joined} {problem}", "file")

    def samples(self, quantity: str, component: int) -> FileSamples:
        """The samples, in whichever of the formats the file is."""
        headings = enumerate(self.lines[:MOST_HEADINGS])
        peer = next((i for i, line in headings if PEER_COUNT.search(line)), None)
        if peer is not None:
            return self._peer(peer, quantity)
        parts = [i for i, line in enumerate(self.lines) if CSMIP.match(line) or COSMOS.match(line)]
        return (
            self._strong_motion(parts, quantity or "acceleration", component)
            if parts
            else self._columns()
        )

    def _peer(self, at: int, quantity: str) -> FileSamples:
        """The samples below the heading with their number and their step, of a file of PEER; the
        quantity, if it is given.
        """
        found = PEER_COUNT.search(self.lines[at])
        assert found is not None
        count = int(found[1] or found[3])
        step = _decimal(found[2] or found[4])
        words = next(
            (said for line in self.lines[:MOST_HEADINGS] if (said := PEER_UNITS.search(line))), None
        )
        if words is None and not quantity:
            self.refuse(
                'does not say in its headings in which units it is; give them, such as units="g"',
                "",
            )
        first = at + 1 if words is None or self.lines[at + 1] != words.string else at + 2
        kind, units = ("", "") if words is None else (KINDS[words[1].lower()], words[2])
        return self._even(count, step, first, None, kind, units)

    def _strong_motion(self, parts: list[int], quantity: str, component: int) -> FileSamples:
        """The samples of a quantity and a component in a V2 file of CSMIP or COSMOS."""
        said = {i: CSMIP.match(self.lines[i]) or COSMOS.match(self.lines[i]) for i in parts}
        own = [
            (i, found)
            for i, found in said.items()
            if found is not None and KINDS[found[2].lower()] == quantity
        ]
        if not own:
            there = ", ".join(
                dict.fromkeys(KINDS[found[2].lower()] for found in said.values() if found)
            )
            self.refuse(f"has samples of {there}, and none of {quantity}", "")
        if component > len(own):
            self.refuse(f"has {len(own)} components of {quantity}, and no number {component}", "")
        at, found = own[component - 1]
        plain = CSMIP.match(self.lines[at]) is not None
        step = _decimal(found[3]) if plain else self._cosmos_step(at, int(found[1]), found[3])
        return self._even(
            int(found[1]),
            step,
            at + 1,
            int(found[5]) if found[5] else None,
            quantity,
            found[4] or PLAIN[quantity],
        )

    def _cosmos_step(self, at: int, count: int, said: str) -> float:
        """The step of the samples below a heading of COSMOS, which has the number of samples and
        about their duration in s, or how many there are in a second."""
        span = float(re.sub(r"[^\d.]", "", said.rpartition("/")[0] or said))
        each = "/" in said
        if each:
            return 1.0 / span if span else 0.0
        fitting: list[float] = []
        for i in range(at):
            found = COSMOS_REALS.match(self.lines[i])
            if found:
                numbers = list(self._numbers(i + 1, int(found[1]), int(found[3])))
                steps = [
                    numbers[place] * unit for place, unit in COSMOS_STEPS if place < len(numbers)
                ]
                fitting = [
                    step
                    for step in steps
                    if step > 0.0 and abs(count * step - span) <= 1.5 + 0.02 * span
                ]
        if not fitting:
            self.refuse(
                f"line {at + 1} has {count} samples in about {span:g} s, and no step in the headings above fits that"
            )
        return fitting[0]

    def _even(
        self, count: int, step: float, first: int, width: int | None, quantity: str, units: str
    ) -> FileSamples:
        """`count` samples from line `first` on, which are `step` apart."""
        value = np.array(list(self._numbers(first, count, width)))
        if value.size < count:
            self.refuse(f"has {value.size} of the {count} samples that its headings promise", "")
        if not step > 0.0:
            self.refuse(f"has samples {step:g} s apart; the step must be above 0", "")
        return FileSamples(step * np.arange(count), value, quantity, units)

    def _numbers(self, first: int, count: int, width: int | None) -> Iterator[float]:
        """The next `count` numbers from a line on, each `width` characters wide, or parted by
        spaces.
        """
        for number, line in enumerate(self.lines[first:], start=first + 1):
            cells = (
                _cells(line)
                if width is None
                else [line[i : i + width] for i in range(0, len(line.rstrip()), width)]
            )
            for cell in cells:
                if count == 0:
                    return
                value = _decimal(cell)
                if not math.isfinite(value):
                    self.refuse(f"line {number} must be numbers, got {_quoted(cell.strip())}")
                yield value
                count -= 1

    def _columns(self) -> FileSamples:
        """Times and values from the first two columns.

        Columns are parted by commas, semicolons, tabs or spaces; one line of headings, blank lines
        and lines that begin with # are skipped.
        """
        rows: list[tuple[float, float]] = []
        headed = False
        for number, line in enumerate(self.lines, start=1):
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            row = _row(line)
            if row is None:
                if rows or headed:
                    self.refuse(
                        f"line {number} must be two finite numbers, got {_quoted(line.strip())}; {WANTED}"
                    )
                headed = True
                continue
            if rows and row[0] <= rows[-1][0]:
                self.refuse(
                    f"times must increase, but line {number} has {row[0]:g} after {rows[-1][0]:g}; sort the file"
                )
            rows.append(row)
        time, value = np.array(rows, dtype=float).reshape(-1, 2).T
        return FileSamples(time, value)


def read_record(
    path: Any,
    quantity: str | None,
    units: str | None,
    baseline: int | None,
    component: int,
    time_scale: float,
    source: str | None,
) -> dict[str, Any]:
    """Time, value, quantity and source of a record in a file; see `Record.read`."""
    if not isinstance(path, (str, Path)):
        raise ParameterError(f"path must be the path of a file, got {shown(path)}", "path")
    check_count("component", component, 1)
    check_number("time_scale", time_scale, above=0.0)
    if baseline is not None:
        check_count("baseline", baseline, 0, 9)
    unit = None if units is None else _unit(units)
    file = RecordFile.opened(Path(path), source or str(path))
    found = file.samples(quantity or (unit or ("",))[0], component)
    if unit is None and found.units:
        unit = _unit(found.units, f"file {file.name!r}: ")
    said = dict.fromkeys(name for name in (quantity, unit and unit[0], found.quantity) if name)
    if len(said) > 1:
        file.refuse(
            f"the samples are said to be both {' and '.join(said)}; give the quantity and the units that they have"
        )
    value = found.value * (unit[1] if unit else 1.0)
    if baseline is not None and value.size:
        fit = np.polynomial.Legendre.fit(found.time, value, min(int(baseline), value.size - 1))
        value = value - fit(found.time)
    return {
        "time": time_scale * found.time,
        "value": value,
        "quantity": next(iter(said), "force"),
        "source": file.name,
    }


def _unit(name: Any, where: str = "") -> tuple[str, float]:
    """The quantity that has a unit, and the unit in SI; `cm/sec^2`, `cm/sec/sec` and `gal` are
    cm/s2.
    """
    plain = re.sub(r"[\^.*]", "", name.lower()).replace("sec", "s") if isinstance(name, str) else ""
    plain = {"gal": "cm/s2", "gals": "cm/s2", "g's": "g"}.get(plain, plain).replace("/s/s", "/s2")
    if plain not in UNITS:
        raise ParameterError(
            f"{where}units {shown(name)} are not known; {near(plain, UNITS)}",
            "file" if where else "units",
        )
    return UNITS[plain]


def _cells(line: str) -> list[str]:
    """The numbers of a line that are parted by spaces, or by their signs alone."""
    return [
        n
        for cell in line.split()
        for n in (re.findall(DECIMAL, cell, re.I) if TOUCHING.fullmatch(cell) else [cell])
    ]


def _decimal(text: str) -> float:
    """A number as Fortran or a person writes it; nan for anything else, as Python would read 1_0 as
    ten.
    """
    try:
        return float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan


def _row(line: str) -> tuple[float, float] | None:
    """The first two numbers of a line, or None.

    With commas there must be exactly two cells, as commas may be decimal ones.
    """
    separator = next((s for s in ";,\t" if s in line), None)
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    if len(cells) < 2 or (separator == "," and len(cells) != 2):
        return None
    time, value = (_decimal(cell) for cell in cells[:2])
    return (time, value) if math.isfinite(time) and math.isfinite(value) else None


def _quoted(text: str) -> str:
    """The beginning of a text in a sentence."""
    short = text if len(text) <= 40 else text[:37] + "..."
    return 'the text "' + short.encode("unicode_escape").decode("ascii") + '"'


PACKED = "float64 "  # in front of the text of a matrix in a file


class ConstantNumbers:
    """A matrix that does not change, which is equal to another one with the same entries."""

    __slots__ = ("_bytes", "array")

    def __init__(self, given: Any, name: str) -> None:
        self.array = read_array(given, name)
        self.array.flags.writeable = False
        self._bytes = self.array.tobytes()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ConstantNumbers) and (self.array.shape, self._bytes) == (
            other.array.shape,
            other._bytes,
        )

    def __hash__(self) -> int:
        return hash(self._bytes)

    def __repr__(self) -> str:
        return f"a matrix of {' x '.join(map(str, self.array.shape))} numbers"

    def __reduce__(self) -> Any:
        return ConstantNumbers, (self.array, "matrix")

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return np.array(self.array, dtype=dtype)

    @property
    def structure_key(self) -> Any:
        """What of it belongs to a system's structure: its size."""
        return ConstantNumbers, self.array.shape

    def packed(self) -> str:
        """Its numbers as a text, exactly; `ConstantNumbers` reads it."""
        size = "x".join(map(str, self.array.shape))
        return f"{PACKED}{size} {base64.b64encode(zlib.compress(self.array.astype('<f8').tobytes())).decode()}"


def read_array(given: Any, name: str) -> np.ndarray:
    """An array of finite numbers of its own, from numbers or from a text that
    `ConstantNumbers.packed` has written.
    """
    try:
        if isinstance(given, str) and given.startswith(PACKED):
            _, size, text = given.split(" ")
            shape = [int(number) for number in size.split("x")]
            return (
                np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<f8")
                .reshape(shape)
                .astype(float)
            )
        dense = given.toarray() if hasattr(given, "toarray") else given  # a sparse matrix of SciPy
        array = np.array(dense, dtype=float)
    except (TypeError, ValueError, zlib.error):
        raise ParameterError(f"{name} must be rows of numbers, got {shown(given)}", name) from None
    if not np.isfinite(array).all():
        raise ParameterError(f"{name} must be finite; it holds nan or inf", name)
    return array


def matrices_in(path: str, names: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """The matrices in a .npz or .mat file by their names, each with what it may be called there;
    damping may lack.
    """
    place = Path(path)
    if place.suffix not in (".npz", ".mat"):
        raise ParameterError(
            f"file must be a .npz or .mat file of matrices, got {shown(path)}", "file"
        )
    if not place.is_file():
        raise ParameterError(f"there is no file {path}", "file")
    try:
        if place.suffix == ".npz":
            with np.load(place, allow_pickle=False) as data:
                arrays: dict[str, Any] = {name: data[name] for name in data.files}
        else:
            from scipy.io import loadmat

            arrays = {
                name: value for name, value in loadmat(place).items() if not name.startswith("__")
            }
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile) as error:
        raise ParameterError(
            f"{path} cannot be read as a {place.suffix} file: {error!s:.120}", "file"
        ) from None
    found: dict[str, Any] = {}
    for name, called in names.items():
        there = [arrays[key] for key in called if key in arrays]
        if not there and name != "damping":
            raise ParameterError(
                f"{path} has no {' or '.join(called)}; it has {', '.join(arrays)}", "file"
            )
        found[name] = there[0] if there else None
    return found


def check_matrices(given: Mapping[str, np.ndarray]) -> None:
    """Refuse matrices that are not those of a structure: its `mass`, its `stiffness` and maybe its
    `damping`.
    """
    mass = given["mass"]
    for name, a in given.items():
        if a.ndim != 2 or a.shape[0] != a.shape[1] or not a.size:
            raise ParameterError(
                f"{name} must be a square matrix, got one of {' x '.join(map(str, a.shape))}", name
            )
        if a.shape != mass.shape:
            raise ParameterError(
                f"{name} must be {len(mass)} x {len(mass)} as the mass is, got {len(a)} x {len(a)}",
                name,
            )
        if name != "damping" and np.abs(a - a.T).max() > 1e-9 * np.abs(a).max():
            i, j = np.unravel_index(np.abs(a - a.T).argmax(), a.shape)
            raise ParameterError(
                f"{name} must be symmetric, got {a[i, j]:g} in row {i}, column {j} and {a[j, i]:g} in row {j}, column {i}",
                name,
            )
    if len(mass) > LIMITS.coordinates:
        raise ParameterError(
            f"mass must have at most {LIMITS.coordinates} rows, got {len(mass)}: reduce the structure first, such as by the "
            "method of Craig and Bampton",
            "mass",
        )
    if (least := np.linalg.eigvalsh(mass)[0]) <= 0.0:
        raise ParameterError(
            f"mass must be positive definite, and its least eigenvalue is {least:g}", "mass"
        )


def check_independent(rows: np.ndarray, local: tuple[str, ...]) -> None:
    """Refuse local displacements of which one follows from the others."""
    for i, name in enumerate(local):
        size = np.linalg.norm(rows[i])
        rest = rows[i] - (
            np.linalg.lstsq(rows[:i].T, rows[i], rcond=None)[0] @ rows[:i] if i else 0.0
        )
        if np.linalg.norm(rest) <= 1e-9 * size:
            why = f"follows from {', '.join(local[:i])}" if size else "is 0"
            raise ParameterError(
                f"the displacement {name} {why}: contacts of one point share its name or its row",
                "points",
            )
