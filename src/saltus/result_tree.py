"""The tree of datasets that a diagram, a chart with borders or bands of chaos is."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray

MOST_GROUPS = 18  # with the heading and the last two lines at most 21 lines


class ResultTree(xarray.DataTree):  # type: ignore[no-untyped-call]
    """A DataTree that prints a line for each of its groups; one without groups prints all of itself.

    In a notebook it opens and closes as any DataTree does.
    """

    __slots__ = ()

    def __repr__(self) -> str:  # type: ignore[override]
        if not self.children:
            return str(super().__repr__())
        groups = [node for node in self.subtree if node.data_vars]
        width = max((len(_name(node, self)) for node in groups[:MOST_GROUPS]), default=0)
        lines = [f"{_name(node, self):{width}}  {_content(node)}" for node in groups[:MOST_GROUPS]]
        if len(groups) > MOST_GROUPS:
            lines.append(f"… {len(groups) - MOST_GROUPS} more groups")
        first = _name(groups[0], self) if groups else ""
        return "\n".join(
            [
                f"DataTree{_subject(self.attrs)}",
                *(f"  {line}" for line in lines),
                f'one group: tree["{first}"]; its table: saltus.to_pandas(tree, "{first}")',
            ]
        )

    def __str__(self) -> str:
        return repr(self)


def _subject(attrs: dict[Any, Any]) -> str:
    """Which system the results are of, and along which of its numbers."""
    try:
        model = f" of a {json.loads(attrs['system'])['model']['type']}"
    except (KeyError, TypeError, ValueError):  # a group within a tree has no system
        model = ""
    path = attrs.get("path")
    return model + (f" along {' and '.join(np.atleast_1d(path).tolist())}" if path else "")


def _name(node: xarray.DataTree, root: xarray.DataTree) -> str:
    """The path of a group, as it is asked for from the tree that is printed."""
    return node.path.removeprefix(root.path).strip("/") or "/"


def _content(node: xarray.DataTree) -> str:
    sizes = ", ".join(f"{name} {size}" for name, size in node.sizes.items())
    count = len(node.data_vars)
    return f"{count} variable{'' if count == 1 else 's'}" + (f" over {sizes}" if sizes else "")
