"""Results in a notebook: a title and a table of facts, as HTML in which every text is escaped; and pictures."""

from __future__ import annotations

import io
import sys
from collections.abc import Mapping
from typing import Any

MOST_ROWS = 40  # the most rows of a table; further ones are only counted
CELL = "style='text-align:left;padding:1px 10px 1px 0;vertical-align:top'"


def html_table(title: str, facts: Mapping[str, Any]) -> str:
    """A table with a row for each fact; floats with 9 digits."""
    rows = [f"<tr><th {CELL}>{_text(name)}</th><td {CELL}>{_text(value)}</td></tr>" for name, value in facts.items()]
    more = f"<tr><td {CELL} colspan='2'>and {len(rows) - MOST_ROWS} more</td></tr>" if len(rows) > MOST_ROWS else ""
    return f"<div><strong>{_text(title)}</strong><table>{''.join(rows[:MOST_ROWS])}{more}</table></div>"


def show_below_cell(figure: Any) -> None:
    """In a notebook, show a figure below the cell that makes it; elsewhere do nothing."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if hasattr(shell, "kernel"):
        picture, notebook = io.BytesIO(), sys.modules["IPython"].display
        figure.savefig(picture, format="png", dpi=110)
        notebook.display(notebook.Image(picture.getvalue()))


def _text(value: Any) -> str:
    import html

    return html.escape(f"{value:.9g}" if isinstance(value, float) else str(value))
