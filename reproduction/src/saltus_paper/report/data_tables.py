"""The contents of a netCDF file as tables for a reader: its variables, the systems and the settings
of its panels.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from saltus import ParameterError
from saltus_paper.toml_tables import toml_table

ANGLES = ("beta0", "alpha")  # angles of the paper's models in rad, which are shown in degrees


@dataclass(frozen=True, slots=True, kw_only=True)
class VariableRow:
    """One variable, with the panels that have it."""

    panels: str
    path: str  # the path of its group within the panel, and its name
    dims: str
    units: str
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueRow:
    """A parameter of the system or a setting, with its value, or its values in the panels if they
    differ.
    """

    name: str
    meaning: str
    values: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DataTables:
    """The tables of one file."""

    variables: list[VariableRow]
    parameters: list[ValueRow]
    settings: list[ValueRow]


def data_tables(path: Path) -> DataTables:
    """The tables of a netCDF file that this package has written and whose fingerprint is that of
    its record.

    It is read by h5netcdf, as `saltus.load` would also read all numbers of hundreds of groups.

    Raises
    ------
    ParameterError
        The file is damaged, or another program wrote it.
    """
    import h5netcdf

    try:
        with h5netcdf.File(path, "r") as file:
            return _tables_of(file)
    except Exception as error:  # h5netcdf, HDF5 and forged attributes have many ways to say so
        raise ParameterError(
            f"{path} is no result of saltus that can be read ({error!s:.80}); compute it again"
        ) from error


def _tables_of(file: Any) -> DataTables:
    variables: dict[tuple[str, str, str], list[str]] = {}
    dims: dict[tuple[str, str, str], str] = {}
    parameters: dict[str, dict[str, str]] = {}
    settings: dict[str, dict[str, str]] = {}
    for panel, inner, group in _groups(file):
        for name, variable in group.variables.items():
            units, meaning = (str(variable.attrs.get(key, "")) for key in ("units", "long_name"))
            row = (f"{inner}/{name}".strip("/"), units, meaning or _words("meanings").get(name, ""))
            variables.setdefault(row, []).append(panel)
            if row not in dims:  # looking dimensions up is slow, and all panels have the same ones
                dims[row] = ", ".join(variable.dimensions)
        for name, value in group.attrs.items():
            if name == "system" and panel not in parameters.get("model.type", {}):
                for number, text in _flat(json.loads(str(value))):
                    parameters.setdefault(number, {})[panel] = text
            elif name in _words("settings"):
                settings.setdefault(name, {}).setdefault(panel, _text(value))
    return DataTables(
        variables=[
            VariableRow(
                panels=_panels(panels), path=row[0], dims=dims[row], units=row[1], meaning=row[2]
            )
            for row, panels in variables.items()
        ],
        parameters=[
            _parameter_row(name, values, settings.get("path", {}))
            for name, values in parameters.items()
        ],
        settings=[
            _value_row(name, _words("settings")[name], values) for name, values in settings.items()
        ],
    )


def _groups(group: Any, panel: str = "", inner: str = "") -> Iterator[tuple[str, str, Any]]:
    """Every group: its panel, its path within the panel and itself; of numbered groups, such as
    curves, only the first.
    """
    yield panel, inner, group
    seen = set()
    for name, child in group.groups.items():
        below = re.sub(r"_\d+$", "_…", f"{inner}/{name}") if panel else inner
        if not panel or below not in seen:
            yield from _groups(child, panel or name, below)
        seen.add(below)


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """The numbers and names of a system's JSON by their dotted paths."""
    if isinstance(value, Mapping):
        for name, part in value.items():
            yield from _flat(part, f"{path}.{name}" if path else str(name))
    else:
        angle = path.rpartition(".")[2] in ANGLES and isinstance(value, float)
        yield path, f"{value:.6g} rad ({math.degrees(value):g}°)" if angle else _text(value)


def _text(value: Any) -> str:
    if isinstance(value, (np.ndarray, list, tuple)):
        parts = [_text(one) for one in np.ravel(np.asarray(value, dtype=object))]
        return parts[0] if len(parts) == 1 else f"({', '.join(parts)})"
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)


def _parameter_row(name: str, values: Mapping[str, str], paths: Mapping[str, str]) -> ValueRow:
    """A number of the system; it has no single value in a panel whose diagram or chart is drawn
    over it.
    """
    varied = {
        panel: "varied" if re.search(rf"\b{re.escape(name)}\b", path) else None
        for panel, path in paths.items()
    }
    return _value_row(
        name, "", {panel: varied.get(panel) or value for panel, value in values.items()}
    )


def _value_row(name: str, meaning: str, values: Mapping[str, str]) -> ValueRow:
    """One value if all panels have the same one, otherwise each value with its panels."""
    by_value: dict[str, list[str]] = {}
    for panel, value in values.items():
        by_value.setdefault(value, []).append(panel)
    if len(by_value) == 1:
        return ValueRow(name=name, meaning=meaning, values=next(iter(by_value)))
    return ValueRow(
        name=name,
        meaning=meaning,
        values="; ".join(f"{_panels(p)}: {value}" for value, p in by_value.items()),
    )


def _panels(names: list[str]) -> str:
    """Panels in short: "a–f" where they are letters without a gap."""
    unique = list(dict.fromkeys(filter(None, names)))
    letters = "".join(unique)
    if len(letters) == len(unique) > 2 and letters in "abcdefghijkl":
        return f"{letters[0]}–{letters[-1]}"
    return ", ".join(unique)


def _words(table: str) -> dict[str, str]:
    """The words for `settings` (attributes), or the `meanings` of variables that have no
    description of their own.
    """
    words: dict[str, str] = toml_table("report", "variables.toml")[table]
    return words
