"""A part of the paper: a computation, a picture drawn from its dataset, and the measures for its
claims.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from operator import itemgetter
from typing import Any

from saltus import System
from saltus_paper.claims.claim import Claim, Measures, judge
from saltus_paper.panel_work import Panels, compute_panels
from saltus_paper.toml_tables import toml_table

EFFORTS = ("standard", "quick")
# what `saltus.page` takes: what moves, results, and the first motion
LivingPage = tuple[System, list[Any], dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperFigure:
    """One figure, table or group of statements of the paper, which `reproduce` makes by its name.

    1. `panels(**parameters)` returns a function without arguments for each panel, and `join` makes
       an xarray DataTree of their
       results by the panels' names: every number behind the picture, with units;
    2. `draw(data)` returns a matplotlib Figure from nothing but that data, or is None where there
       is nothing to draw;
    3. `measure(data)` returns the numbers for its claims, again from nothing but the data; the
       tables of claims hold the rest;
    4. `table(data)`, where given, returns Markdown;
    5. `page(data)`, where given, returns what a page is made of on which one moves the numbers and
       computes the motions anew.
    """

    name: str
    title: str
    caption: str
    section: str = ""  # its number in the paper; empty if the statements belong to several sections
    panels: Callable[..., Panels]
    join: Callable[[dict[str, Any]], Any]
    measure: Callable[[Any], Measures] = lambda data: {}
    draw: Callable[[Any], Any] | None = None
    table: Callable[[Any], str] | None = None
    page: Callable[[Any], LivingPage] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    # parameters of a draft; none where the part is quick anyway
    quick: Mapping[str, Any] = field(default_factory=dict)
    effort: str = "standard"
    module: str  # the module that computes it

    def at(self, effort: str) -> PaperFigure:
        """The part at an effort of `EFFORTS`: a draft is a part of its own, unless the part is
        quick anyway.
        """
        if effort == self.effort or not self.quick:
            return self
        return replace(self, parameters={**self.parameters, **self.quick}, effort=effort)

    def compute(self, **parameters: Any) -> Any:
        """The data of all panels together, for parameters that need not be the paper's."""
        (part,) = compute_panels({self.name: self.panels(**parameters)})
        if part.error is not None:
            raise part.error
        return self.join(part.panels)

    def claims(self, data: Any) -> list[Claim]:
        """The claims that the data bears on, each with its verdict."""
        return judge(self.name, self.measure(data))

    def files(self) -> list[str]:
        """The names of its outputs."""
        kinds = (
            [".nc"]
            + ([".png", ".pdf"] if self.draw else [])
            + ([".md"] if self.table else [])
            + ([".html"] if self.page else [])
        )
        return [self.name + kind for kind in kinds]


def paper_figure(
    name: str, *, compute: Callable[..., Any] | None = None, **parts: Any
) -> PaperFigure:
    """A `PaperFigure` with its title and caption from `captions.toml`; `compute` is all of one that
    has no panels.
    """
    words = toml_table("figures", "captions.toml")[name]
    if compute is not None:
        parts |= {
            "panels": partial(_only, name, compute),
            "join": itemgetter(name),
            "module": compute.__module__,
        }
    else:
        parts.setdefault("module", parts["panels"].__module__)
    return PaperFigure(
        name=name,
        title=words["title"],
        caption=words["caption"],
        section=words.get("section", ""),
        **parts,
    )


def _only(name: str, compute: Callable[..., Any], **parameters: Any) -> Panels:
    return {name: partial(compute, **parameters)}
