"""The names of coordinates and parameters on axes; units are those of the variables in a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np

SYMBOLS = {"theta": r"\theta", "theta_1": r"\theta_1", "theta_2": r"\theta_2"}
PARAMETERS = {
    "load.frequency": r"frequency $\Omega$",
    "load.force.amplitude": r"force amplitude $\widehat{F}$",
    "load.horizontal.amplitude": r"load amplitude $\widehat{\mathcal{H}}$",
    "load.vertical": r"vertical load $\overline{\mathcal{V}}$",
    "load.vertical.mean": r"mean vertical load $\overline{\mathcal{V}}$",
    "impact.e": "restitution $e$",
    "model.damping": r"damping $\mathcal{C}$",
    "model.beta0": r"$\beta_0$ (rad)",
}
SAME_AMPLITUDE = 1e-9  # of an amplitude: motions between two walls that reach both have the same one, but for rounding


def symbol(name: str) -> str:
    """A state variable's symbol in mathematical text; with several coordinates a velocity's is its coordinate's with a dot."""
    if name.endswith("_velocity"):
        return rf"\dot{{{symbol(name.removesuffix('_velocity'))}}}"
    return SYMBOLS.get(name, name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}")


def peak(names: str, quantity: str = "amplitude") -> str:
    """The amplitude, or the highest or lowest value, of a coordinate or of several in one text, in mathematical text."""
    found, bar = r"\min" if quantity == "lowest" else r"\max", "|" if quantity == "amplitude" else ""
    each = [rf"{bar}{symbol(name)}{bar}" for name in names.split()]
    if len(each) == 1:
        return rf"{found}_\tau{each[0]}"
    return rf"{found}_\tau({', '.join(each)})" if len(each) < 4 else rf"{found}_\tau\,{found}_i{bar}q_i{bar}"


def unit_in_brackets(variable: Any) -> str:
    """The unit of a dataset's variable after its name, such as " (rad)"; nothing where it has none."""
    unit = variable.attrs.get("units", "1")
    return "" if unit == "1" else f" ({unit})"


def parameter_name(path: str) -> str:
    """The name of a parameter on an axis; its dotted path if it has none."""
    return PARAMETERS.get(path, path)


def quantity_name(dataset: Any, quantity: str) -> str:
    """The symbol of the amplitude of a dataset's coordinates, or a quantity's name in words."""
    if quantity == "amplitude" and "coordinate" in dataset.attrs:
        return f"${peak(dataset.attrs['coordinate'])}$"
    return quantity.replace("_", " ")


def parameter_symbol(path: str) -> str:
    """A parameter's symbol; its dotted path where it has none."""
    name = parameter_name(path)
    return name[name.index("$") : name.rindex("$") + 1] if "$" in name else path


def plane_of(dataset: Any) -> tuple[str, str]:
    """The two state variables over which a dataset is drawn."""
    first, second = dataset.attrs["plane"]
    return str(first), str(second)


def state_symbol(name: str, plane: tuple[str, str]) -> str:
    """The symbol of one of the two state variables of a plane, a velocity as its coordinate with a dot."""
    return rf"\dot{{{symbol(plane[0])}}}" if name == "velocity" else symbol(name)


def state_label(dataset: Any, name: str, plane: tuple[str, str], after: str = "") -> str:
    """The name of an axis with a state variable, and its unit as the variable of a dataset of the same name carries it."""
    return (
        f"${state_symbol(name.removeprefix('section_').removeprefix('orbit_'), plane)}${after}{unit_in_brackets(dataset[name])}"
    )


def varied(dataset: Any, dim: str) -> tuple[str, np.ndarray]:
    """The quantity along a dimension of an ensemble, in words with its unit, and its values: a parameter, a start, or numbers."""
    given = [name for name in dataset.variables if "." in str(name) or str(name).startswith(("start_", "initial_"))]
    for name in (dim, *given):
        if name in dataset.variables and dim in dataset[name].dims and dataset[name].dtype.kind in "fi":
            rows = dataset[name].transpose(dim, ...).values.reshape(dataset.sizes[dim], -1).astype(float)
            if name == dim or (np.ptp(rows, axis=1).max() == 0.0 and len(np.unique(rows)) == len(rows)):
                return _start_name(dataset, str(name)), rows[:, 0]
    return dim.replace("_", " "), np.arange(dataset.sizes[dim], dtype=float)


def _start_name(dataset: Any, name: str) -> str:
    """The name of an initial value on an axis; a parameter or another dimension keeps its own name."""
    state = name.removeprefix("start_").removeprefix("initial_")
    if state == name:
        return parameter_name(name)
    if state == "time":
        return r"$\tau$ at the start"
    coordinate = next(iter(dataset.data_vars))
    return f"${state_symbol(state, (str(coordinate), state))}$ at the start{unit_in_brackets(dataset[name])}"


def is_flat(amplitudes: np.ndarray) -> bool:
    """Whether most of several motions have the same amplitude."""
    usual = float(np.median(amplitudes)) if amplitudes.size > 1 else np.nan
    return bool(2 * np.count_nonzero(np.abs(amplitudes - usual) <= SAME_AMPLITUDE * usual) > amplitudes.size)
