"""Results in a notebook: a title and a table of facts, as HTML in which every text is escaped."""

from __future__ import annotations

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


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _text(value: Any) -> str:
    import html

    return html.escape(f"{value:.9g}" if isinstance(value, float) else str(value))
