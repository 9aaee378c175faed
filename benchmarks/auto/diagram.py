"""Reading AUTO's bifurcation diagram (fort.7)."""

from __future__ import annotations

import re
from dataclasses import dataclass

# TY; 0 and -4 are points without a kind
KINDS = {5: "LP", 6: "BP", 7: "PD", 8: "TR", 9: "EP", -9: "MX"}
COLUMNS = {"PAR(1)": "omega", "PAR(8)": "amplitude", "PAR(9)": "mean"}


@dataclass(frozen=True)
class Point:
    """One orbit of a branch: Omega, the largest abs(theta), the mean of theta (0 on a symmetric
    orbit), and AUTO's verdicts.
    """

    omega: float
    amplitude: float
    mean: float
    stable: bool
    kind: str = ""  # LP, BP, PD, TR (torus), EP (end of the run), MX (no convergence)


def parse(text: str) -> list[Point]:
    """The points of the first branch in a fort.7, in order; the columns are found by their names.

    Raises ValueError where a column is missing. A last line that was cut off is left out.
    """
    points: list[Point] = []
    names: list[str] = []
    for line in text.splitlines():
        cells = line.split()
        if cells[:1] == ["0"] and "LAB" in cells:
            names = re.split(r"\s{2,}", line.strip())[1:]
        elif cells and cells[0] != "0" and len(cells) == len(names) + 1:
            points.append(_point(dict(zip(names, cells[1:], strict=True))))
    if not points and not names:
        raise ValueError(
            "this is not a bifurcation diagram of AUTO: it has no line with the names of its "
            "columns"
        )
    return points


def _point(row: dict[str, str]) -> Point:
    missing = [name for name in COLUMNS if name not in row]
    if missing:
        raise ValueError(
            f"the diagram has no column {', '.join(missing)}, only {', '.join(row)}; ICP must "
            "name it"
        )
    numbers = {field: _number(row[name]) for name, field in COLUMNS.items()}
    return Point(**numbers, stable=int(row["PT"]) < 0, kind=KINDS.get(int(row["TY"]), ""))


def _number(text: str) -> float:
    """Fortran drops the E of an exponent with three digits: 1.5-104."""
    return float(re.sub(r"(?<=[0-9.])([+-]\d{3})$", r"E\1", text))
