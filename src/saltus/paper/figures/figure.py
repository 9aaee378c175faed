"""What a part of the paper is: a computation, a picture drawn from its dataset alone, and the claims it bears on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from saltus.paper.claims.claim import Claim


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperFigure:
    """One figure, table or group of statements of the paper, which `reproduce` makes by its name.

    1. `compute(**parameters)` returns an xarray DataTree: every number behind the picture, with units;
    2. `draw(data)` returns a matplotlib Figure from that data alone, or is None where there is nothing to draw;
    3. `claims(data)` returns the statements that the data bears on, again from the data alone;
    4. `table(data)`, where given, returns Markdown.
    """

    name: str
    title: str
    caption: str
    compute: Callable[..., Any]
    claims: Callable[[Any], list[Claim]]
    draw: Callable[[Any], Any] | None = None
    table: Callable[[Any], str] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @property
    def module(self) -> str:
        """The module that computes it."""
        return self.compute.__module__

    def files(self) -> list[str]:
        """The names of its outputs."""
        kinds = [".nc"] + ([".png", ".pdf"] if self.draw else []) + ([".md"] if self.table else [])
        return [self.name + kind for kind in kinds]
