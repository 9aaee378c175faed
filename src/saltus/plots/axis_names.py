"""What coordinates and parameters are called on axes; units are those that the variables of a dataset carry."""

from __future__ import annotations

from typing import Any

SYMBOLS = {"theta": r"\theta", "theta_1": r"\theta_1", "theta_2": r"\theta_2"}
PARAMETERS = {
    "load.frequency": r"frequency $\Omega$",
    "load.horizontal.amplitude": r"load amplitude $\widehat{\mathcal{H}}$",
    "load.vertical": r"vertical load $\overline{\mathcal{V}}$",
    "load.vertical.mean": r"mean vertical load $\overline{\mathcal{V}}$",
    "model.damping": r"damping $\mathcal{C}$",
    "model.beta0": r"$\beta_0$ (rad)",
}


def symbol(name: str) -> str:
    """A state variable's symbol in mathematical text; that of a velocity, of several, is its coordinate's with a dot."""
    if name.endswith("_velocity"):
        return rf"\dot{{{symbol(name.removesuffix('_velocity'))}}}"
    return SYMBOLS.get(name, name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}")


def peak(names: str) -> str:
    """The amplitude of a coordinate, or of several whose names stand in one text, in mathematical text."""
    each = [rf"|{symbol(name)}|" for name in names.split()]
    return r"\max_\tau" + (each[0] if len(each) == 1 else rf"({', '.join(each)})" if len(each) < 4 else r"\,\max_i|q_i|")


def unit_in_brackets(variable: Any) -> str:
    """The unit of a dataset's variable after its name, such as " (rad)"; nothing where it has none."""
    unit = variable.attrs.get("units", "1")
    return "" if unit == "1" else f" ({unit})"


def parameter_name(path: str) -> str:
    """What a parameter is called on an axis; its dotted path where it has no name."""
    return PARAMETERS.get(path, path)
