"""The blocks of text that `saltus info` and `saltus doctor` print, and the form of numbers in them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError
from saltus.systems import Constant, Harmonic, Load, Signal, Sum

if TYPE_CHECKING:
    from rich.table import Table

Row = tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Block:
    """A titled list of rows of text."""

    title: str
    rows: list[Row]
    heads: Row = ()


def block_table(block: Block) -> Table:
    """The rows of a block as a table for the terminal."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, show_header=bool(block.heads))
    for head in block.heads or ("", ""):
        table.add_column(head, header_style="dim", overflow="fold")
    for row in block.rows:
        table.add_row(*row)
    return table


def number(value: Any) -> str:
    """A number with eight digits, which suffice for comparisons."""
    return f"{float(value):.8g}"


def angle(value: Any) -> str:
    """An angle in both units."""
    return f"{float(value):.8g} rad ({math.degrees(float(value)):.6g} deg)"


def attempt(formula: Callable[[], str]) -> str:
    """The result of a closed form, or why it does not apply."""
    try:
        return formula()
    except ParameterError as error:
        return f"none: {error}"


def mean_load(load: Load) -> Load:
    """The constant parts of all forces, to which closed forms for constant loads can be applied."""
    return Load(**{name: mean(signal) for name, signal in load.channels.items() if not name.startswith("ground_")})


def mean(signal: Signal) -> float:
    """The constant part of a signal; 0 for a record."""
    if isinstance(signal, Sum):
        return sum(mean(term) for term in signal.terms)
    return signal.value if isinstance(signal, Constant) else signal.mean if isinstance(signal, Harmonic) else 0.0
