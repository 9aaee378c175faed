"""The headings of samples in files of PEER, CSMIP and COSMOS.

A field of a heading is read whole: a number, and a unit behind it. What is left over is refused, as
a part of it would be another number, and a unit is taken by default only where none is named.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from saltus.checks import LIMITS

# the most letters of a line that may be a heading; patterns are tried on shorter ones alone, so
# that their time is bounded
LONGEST_HEADING = 400
DECIMAL = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[ed][-+]?\d+)?"
# numbers whose signs stand where spaces would; each text is matched in one way at most
TOUCHING = re.compile(rf"{DECIMAL}(?:(?=[-+]){DECIMAL})*", re.IGNORECASE)
SECOND = dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0) | dict.fromkeys(
    ("ms", "msec", "msecs", "millisecond", "milliseconds"), 0.001
)
QUANTITY = {"acc": "acceleration", "vel": "velocity", "dis": "displacement"}
PEER = "peer"  # samples whose units stand in a line of their own
STEP = "step"
SPAN = "span"  # the heading has about the duration in the place of the step

PEER_NAMED = re.compile(r"NPTS\s*=(.*?)\bDT\s*=(.*)$", re.IGNORECASE)
PEER_BEFORE = re.compile(r"\s*(\S+)\s+(\S.*?)\s*\bNPTS\s*,?\s*DT\b(.*)$", re.IGNORECASE)
PEER_UNITS = re.compile(r"\b(ACC|VEL|DIS)[A-Z]*\b.*\bUNITS?\s*(?:OF|:|=)(.*)$", re.IGNORECASE)
# what may stand behind the units of a PEER file: the corners of filters
REMARK = re.compile(r"[.,;]\s+FILTER\b.*$", re.IGNORECASE)
CSMIP = re.compile(
    r"\s*(\S+)\s+points?\s+of\s+(acc|vel|dis)\w*\s+data\s+equally\s+spaced\s+at(.*)$", re.IGNORECASE
)
COSMOS = re.compile(
    r"\s*(\S+)\s+(?:[a-z]+\.?\s+)?(acc|vel|dis)\w*\.?\s+(?:pts|points)\b,?\s*(?:approx\.?|at?)(.*)$",
    re.IGNORECASE,
)
REALS = re.compile(r"\s*(\d+)\s+real-header values follow on\s+(\d+)\s+lines(.*)$", re.IGNORECASE)
# a number and the word behind it
MEASURED = re.compile(rf"\s*({DECIMAL})(?:\s*((?:pts|points)/)?([a-z]+)\b\.?)?(.*)$", re.IGNORECASE)
FORMAT = re.compile(
    r"(?:,?\s*format\s*=)?\s*\(\s*(?:(?:\d+p,?\s*)?\d*\s*[edg]|\d*\s*[fi])(\d+)(?:\.\d+)?\s*\)\s*$",
    re.IGNORECASE,
)
UNITS_BEHIND = re.compile(
    r"in\s+(.+)|\(\s*units?\s*[:=]\s*([^()]+)\)|units?\s*[:=]\s*(.+)", re.IGNORECASE
)
UNIT_CODE = re.compile(r"\s*\(\s*\d+\s*\)\s*$")  # the number of the unit in the tables of COSMOS


@dataclass(frozen=True)
class SamplesHeading:
    """What the heading of samples says."""

    count: int
    step: float  # s; about the duration where it is the `SPAN`
    step_below: str  # PEER, STEP or SPAN
    quantity: str = ""
    units: str = ""  # "" where no unit is named
    width: int | None = None  # the letters of each number; None where spaces part them


def heading_in(line: str, first: bool) -> SamplesHeading | None:
    """The heading that a line is, or None; those of PEER are among the `first` lines of a file.

    Raises
    ------
    ValueError
        A heading with a field that cannot be read whole, with the end of a sentence.
    """
    if len(line) > LONGEST_HEADING:
        return None
    if first and (found := PEER_NAMED.search(line)):
        return SamplesHeading(_count(found[1].rstrip(" ,\t")), _seconds(found[2], True), PEER)
    if first and (found := PEER_BEFORE.match(line)):
        unit = found[3].strip(" ()\t").lower()
        if unit and unit not in SECOND:
            raise ValueError("must end with the unit of the step, such as NPTS, DT (SEC)")
        step = _seconds(f"{found[2]} {unit}", True)
        return SamplesHeading(_count(found[1]), step, PEER)
    if found := CSMIP.match(line):
        return _csmip(*found.groups())
    if found := COSMOS.match(line):
        return _cosmos(*found.groups())
    return None


def peer_units(line: str) -> tuple[str, str] | None:
    """The quantity and the units that a line of a PEER file names, or None."""
    found = PEER_UNITS.search(line) if len(line) <= LONGEST_HEADING else None
    if found is None:
        return None
    return QUANTITY[found[1].lower()], REMARK.sub("", found[2]).strip()


def real_headings(line: str) -> tuple[int, int] | None:
    """How many numbers follow a line of a COSMOS file, and their width, or None."""
    found = REALS.match(line) if len(line) <= LONGEST_HEADING else None
    width = FORMAT.search(found[3]) if found else None
    if found is None or width is None or not 0 < int(width[1]) <= LONGEST_HEADING:
        return None
    return min(int(found[1]), LIMITS.count), int(width[1])


def _csmip(count: str, quantity: str, behind: str) -> SamplesHeading:
    """A heading of CSMIP: `43 points of accel data equally spaced at .02 sec, in cm/sec2.
    (8f10.3)`.
    """
    found = MEASURED.match(behind)
    if found is None or found[2] or (found[3] or "").lower() not in SECOND:
        raise ValueError("must have a step with its unit, such as at .02 sec")
    step = _number(found[1]) * SECOND[found[3].lower()]
    units, width = _format(found[4])
    units = units.strip(" ,.\t")
    named = UNITS_BEHIND.fullmatch(units)
    if named:
        units = next(part for part in named.groups() if part)
    kind = QUANTITY[quantity.lower()]
    return SamplesHeading(_count(count), step, STEP, kind, units.strip(), width)


def _cosmos(count: str, quantity: str, behind: str) -> SamplesHeading:
    """A heading of COSMOS: `43 acceleration pts, approx 1 secs, units=cm/sec2(04),
    Format=(10F8.2)`.
    """
    found = MEASURED.match(behind)
    units, width = _format(found[4] if found else "")
    named = re.fullmatch(r"\s*,?\s*units?\s*=\s*(.+)", units, re.IGNORECASE)
    word = (found[3] or "").lower() if found else ""
    rate = bool(found and found[2])
    if found is None or word not in SECOND or (rate and SECOND[word] != 1.0) or named is None:
        raise ValueError("must have a duration and units, such as approx 40 secs, units=cm/sec2")
    number = _number(found[1])
    kind = QUANTITY[quantity.lower()]
    unit = UNIT_CODE.sub("", named[1].rstrip(" ,")).strip()
    if rate:  # samples in a second
        step = 1.0 / number if number > 0.0 else 0.0
        return SamplesHeading(_count(count), step, STEP, kind, unit, width)
    return SamplesHeading(_count(count), number * SECOND[word], SPAN, kind, unit, width)


def _format(text: str) -> tuple[str, int | None]:
    """A text without the format of Fortran at its end, and the width of the numbers in that."""
    found = FORMAT.search(text)
    if found is None:
        return text, None
    width = int(found[1])
    if not 0 < width <= LONGEST_HEADING:
        raise ValueError("must have a format with a width above 0, such as (8f10.3)")
    return text[: found.start()], width


def _count(text: str) -> int:
    """A number of samples."""
    found = re.fullmatch(r"\s*(\d+)(?:\.0*)?\s*", text)
    if found is None or not int(found[1]) <= LIMITS.count:
        raise ValueError(
            f"must have a whole number of samples of at most {LIMITS.count}, such as NPTS= 4000"
        )
    return int(found[1])


def _seconds(text: str, plain: bool = False) -> float:
    """A time in s, with its unit or, where it may be `plain`, without one."""
    found = MEASURED.match(text)
    unit = (found[3] or "").lower() if found else ""
    factor = SECOND.get(unit, 1.0 if plain and not unit else 0.0)
    if found is None or found[2] or factor == 0.0 or found[4].strip(" ,;."):
        raise ValueError("must have a step in s or ms and nothing behind it, such as DT= .01 SEC")
    return factor * _number(found[1])


def _number(text: str) -> float:
    """A number as Fortran writes it."""
    return float(text.lower().replace("d", "e"))
