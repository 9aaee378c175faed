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


def rows_table(columns: Mapping[str, Any]) -> str:
    """A table with a column for each name, and a heading."""
    count = max((len(values) for values in columns.values()), default=0)
    head = "".join(f"<th {CELL}>{_text(name)}</th>" for name in columns)
    rows = [
        "<tr>" + "".join(f"<td {CELL}>{_text(_plain(values[i]))}</td>" for values in columns.values()) + "</tr>"
        for i in range(min(count, MOST_ROWS))
    ]
    more = f"<tr><td {CELL} colspan='{len(columns)}'>and {count - MOST_ROWS} more</td></tr>" if count > MOST_ROWS else ""
    return f"<div><table><tr>{head}</tr>{''.join(rows)}{more}</table></div>"


class LineBelowCell:
    """One line below the cell of a notebook, which is written over as work goes on, as also in a notebook that is executed."""

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, fraction: float, what: str) -> bool:
        """Show the line; False outside of a notebook."""
        shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
        if not hasattr(shell, "kernel"):
            return False
        notebook, done = sys.modules["IPython"].display, fraction >= 1.0
        line = f"<progress value='{fraction:.4f}' max='1'></progress> {100 * fraction:3.0f} % {_text(what)}"
        if self._handle is None:
            self._handle = notebook.display(notebook.HTML(line), display_id=True)
        else:
            self._handle.update(notebook.HTML(line))
        if done:
            self._handle = None
        return True


def show_below_cell(figure: Any) -> None:
    """In a notebook, show a figure below the cell that makes it; elsewhere do nothing."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if hasattr(shell, "kernel"):
        picture, notebook = io.BytesIO(), sys.modules["IPython"].display
        figure.savefig(picture, format="png", dpi=110)
        notebook.display(notebook.Image(picture.getvalue()))


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _text(value: Any) -> str:
    import html

    return html.escape(f"{value:.9g}" if isinstance(value, float) else str(value))
