"""Records in files: AT2, VT2 and DT2 of PEER, V2 of CSMIP and COSMOS, and text with two columns.

The formats are told apart by their headings, not by the names of the files. Samples whose unit is
known are given in seconds and in metres, m/s, m/s^2 or newtons.
"""

from __future__ import annotations

import base64
import math
import re
import stat
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from saltus.checks import LIMITS, check_count, check_number, check_size, free_memory
from saltus.errors import ParameterError, near, shown
from saltus.files import reading
from saltus.systems.files.matrix_files import unpacked_numbers
from saltus.systems.files.record_headings import (
    DECIMAL,
    PEER,
    SPAN,
    TOUCHING,
    SamplesHeading,
    heading_in,
    peer_units,
    real_headings,
)

GRAVITY = 9.80665  # m/s^2, the standard value, of which the g of a record is a multiple
# bytes that a character of a record takes, about, while it is read: as text, in lines, in pairs of
# numbers
RECORD_MEMORY = 20
WANTED = (
    "saltus reads AT2, VT2 and DT2 (PEER), V2 (CSMIP, COSMOS), and text with two columns, time and"
    " value"
)
# the most letters of a word among samples: numbers of a line may touch, longer ones are no numbers
LONGEST_CELL = 400
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
        headings = {
            i: found
            for i, line in enumerate(self.lines)
            if (found := self._heading(i, line)) is not None
        }
        peer = next((i for i in headings if headings[i].step_below == PEER), None)
        strong = {i: found for i, found in headings.items() if found.step_below != PEER}
        if peer is None and strong:
            return self._strong_motion(strong, quantity or "acceleration", component)
        if component > 1:
            self.refuse(f"has one component, and no number {component}", "")
        return self._columns() if peer is None else self._peer(peer, headings[peer], quantity)

    def _heading(self, at: int, line: str) -> SamplesHeading | None:
        """The heading of samples that a line is, if it is one."""
        try:
            return heading_in(line, at < MOST_HEADINGS)
        except ValueError as error:
            self.refuse(f"line {at + 1} {error}, got {_quoted(line.strip())}")

    def _peer(self, at: int, heading: SamplesHeading, quantity: str) -> FileSamples:
        """The samples below the heading with their number and their step, of a file of PEER; the
        quantity, if it is given.
        """
        units = {
            i: found
            for i, line in enumerate(self.lines[:MOST_HEADINGS])
            if (found := peer_units(line)) is not None
        }
        if not units and not quantity:
            self.refuse(
                'does not say in its headings in which units it is; give them, such as units="g"',
                "",
            )
        first = at + 2 if at + 1 in units else at + 1
        kind, unit = next(iter(units.values()), ("", ""))
        return self._even(replace(heading, quantity=kind, units=unit), heading.step, first)

    def _strong_motion(
        self, headings: Mapping[int, SamplesHeading], quantity: str, component: int
    ) -> FileSamples:
        """The samples of a quantity and a component in a V2 file of CSMIP or COSMOS."""
        own = [i for i, found in headings.items() if found.quantity == quantity]
        if not own:
            there = ", ".join(dict.fromkeys(found.quantity for found in headings.values()))
            self.refuse(f"has samples of {there}, and none of {quantity}", "")
        if component > len(own):
            self.refuse(f"has {len(own)} components of {quantity}, and no number {component}", "")
        at = own[component - 1]
        heading = headings[at]
        span = heading.step_below == SPAN
        step = self._fitting_step(at, heading.count, heading.step) if span else heading.step
        named = heading if heading.units else replace(heading, units=PLAIN[quantity])
        return self._even(named, step, at + 1)

    def _fitting_step(self, at: int, count: int, span: float) -> float:
        """The step of the samples below a heading of COSMOS that has their number and about their
        duration in s: that of the headings above it which fits."""
        fitting: list[float] = []
        for i in range(at):
            reals = real_headings(self.lines[i])
            if reals is not None:
                numbers = list(self._numbers(i + 1, *reals))
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
                f"line {at + 1} has {count} samples in about {span:g} s, and no step in the"
                " headings above fits that"
            )
        return fitting[0]

    def _even(self, heading: SamplesHeading, step: float, first: int) -> FileSamples:
        """The samples of a heading from line `first` on, which are `step` apart."""
        count = heading.count
        value = np.array(list(self._numbers(first, count, heading.width)))
        if value.size < count:
            self.refuse(f"has {value.size} of the {count} samples that its headings promise", "")
        if not step > 0.0:
            self.refuse(f"has samples {step:g} s apart; the step must be above 0", "")
        return FileSamples(step * np.arange(count), value, heading.quantity, heading.units)

    def _numbers(self, first: int, count: int, width: int | None) -> Iterator[float]:
        """The next `count` numbers from a line on, each `width` characters wide, or parted by
        spaces.
        """
        for number, line in enumerate(self.lines[first:], start=first + 1):
            longest = max(map(len, line.split()), default=0)
            if width is None and longest > LONGEST_CELL:
                self.refuse(f"line {number} must be numbers, got a word of {longest} letters")
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
                        f"line {number} must be two finite numbers, got {_quoted(line.strip())};"
                        f" {WANTED}"
                    )
                headed = True
                continue
            if rows and row[0] <= rows[-1][0]:
                self.refuse(
                    f"times must increase, but line {number} has {row[0]:g} after {rows[-1][0]:g};"
                    " sort the file"
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
    with reading(path, "a record"):
        file = RecordFile.opened(Path(path), source or str(path))
        found = file.samples(quantity or (unit or ("",))[0], component)
    if unit is None and found.units:
        unit = _unit(found.units, f"file {file.name!r}: ")
    said = dict.fromkeys(name for name in (quantity, unit and unit[0], found.quantity) if name)
    if len(said) > 1:
        file.refuse(
            f"the samples are said to be both {' and '.join(said)}; give the quantity and the units"
            " that they have"
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
    cm/s2. The name is read whole: of `g*100` nothing is left out.
    """
    plain = ""
    if isinstance(name, str):
        plain = name[: 2 * LONGEST_CELL].lower().strip()
        if plain.startswith("(") and plain.endswith(")"):
            plain = plain[1:-1].strip()
        plain = re.sub(r"\s*/\s*", "/", plain.removesuffix("."))
        plain = plain.replace("**", "").replace("^", "").replace("sec", "s")
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
        plain = text.replace("d", "e").replace("D", "E")
        return float(plain) if text.isascii() and "_" not in text else math.nan
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
        return (
            f"{PACKED}{size}"
            f" {base64.b64encode(zlib.compress(self.array.astype('<f8').tobytes())).decode()}"
        )


def read_array(given: Any, name: str) -> np.ndarray:
    """An array of finite numbers of its own, from numbers or from a text that
    `ConstantNumbers.packed` has written.
    """
    try:
        if isinstance(given, str) and given.startswith(PACKED):
            return _unpacked(given, name)
        dense = given.toarray() if hasattr(given, "toarray") else given  # a sparse matrix of SciPy
        check_size(dense, name)
        array = np.array(dense)
    except (TypeError, ValueError, zlib.error):
        raise ParameterError(f"{name} must be rows of numbers, got {shown(given)}", name) from None
    if np.ma.is_masked(dense):
        raise ParameterError(f"{name} must be numbers, and some of them are masked", name)
    if array.dtype.kind == "c":
        raise ParameterError(_of_complex(name), name)
    try:
        if array.dtype.kind not in "biufO":  # NumPy would read a text as a number
            raise TypeError
        array = array.astype(float)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} must be rows of numbers, got {shown(given)}", name) from None
    if not np.isfinite(array).all():
        raise ParameterError(f"{name} must be finite; it holds nan or inf", name)
    return array


def _of_complex(name: str) -> str:
    """The refusal of complex numbers, which would lose their imaginary parts."""
    if name == "stiffness":
        return (
            "stiffness must be real, got complex numbers: structural damping K (1 + i eta) is a "
            "response to one frequency alone; give its real part, and damping=C of the motion"
        )
    return f"{name} must be real, got complex numbers; give what slows the motion as damping"


def _unpacked(text: str, name: str) -> np.ndarray:
    """The numbers of a text that `ConstantNumbers.packed` has written, within their size."""
    try:
        _, size, packed = text.split(" ")
        shape = [int(number) for number in size.split("x")]
        if any(number < 0 for number in shape) or math.prod(shape) > LIMITS.count:
            raise ValueError
        array = unpacked_numbers(base64.b64decode(packed, validate=True), shape).astype(float)
    except (TypeError, ValueError, zlib.error):
        raise ParameterError(f"{name} must be rows of numbers, got {shown(text)}", name) from None
    if not np.isfinite(array).all():
        raise ParameterError(f"{name} must be finite; it holds nan or inf", name)
    return array


def check_range_of(largest: float, name: str) -> None:
    """Refuse a matrix whose largest number is so large or small that products of it are no
    numbers."""
    least = 1.0 / LIMITS.value
    if largest != 0.0 and not least <= largest <= LIMITS.value:
        raise ParameterError(
            f"{name} must have numbers of {least:g} to {LIMITS.value:g} in size, and its largest is"
            f" {largest:g}: choose other units",
            name,
        )


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
        check_range_of(np.abs(a).max(), name)
        if name != "damping" and np.abs(a - a.T).max() > 1e-9 * np.abs(a).max():
            i, j = np.unravel_index(np.abs(a - a.T).argmax(), a.shape)
            raise ParameterError(
                f"{name} must be symmetric, got {a[i, j]:g} in row {i}, column {j} and {a[j, i]:g}"
                f" in row {j}, column {i}",
                name,
            )
    if len(mass) > LIMITS.coordinates:
        raise ParameterError(
            f"mass must have at most {LIMITS.coordinates} rows, got {len(mass)}: reduce the"
            " structure first, such as by the method of Craig and Bampton",
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
