"""The sums of products of two series for the orders k and k + 1, computed in loops over coefficients in memory.

A loop computes the sums of up to `most_sums` products. Each loaded coefficient serves both orders, and the code is so short that
the processor keeps it decoded; with all orders written out a call took 5 to 30 % longer at orders 12 to 20.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from saltus.taylor.vectors import LONG, Coefficient, Vec

if TYPE_CHECKING:
    from saltus.taylor.series import Series


@dataclass(frozen=True)
class SeriesSettings:
    """How the code of series is laid out."""

    # The most products in an inner loop, whose sums and loaded coefficients fit into the registers of AVX-512 and of AVX2.
    most_sums: int = 3
    # The highest degree of a polynomial whose vanishing coefficients are left out of the sums. The orders that are written out
    # for it must be fewer than the lowest order of an ensemble's series.
    most_ending: int = 7


SETTINGS = SeriesSettings()


@dataclass(eq=False)
class Row:
    """One series: its coefficients of the first orders, and those of a pair of orders as far as they are known."""

    degree: int | None  # above which all coefficients vanish; None where it does not end
    early: bool  # whether the coefficient k of a pair is known before the sums are
    first: list[Coefficient] = field(default_factory=list)
    pair: list[Coefficient] = field(default_factory=list)
    place: Any = None  # LLVM's pointer to coefficient 0, where the series lies in memory


class InnerLoop:
    """A loop over j = 1 .. k - 1 that makes the sums of some products for the orders k and k + 1."""

    def __init__(self, series: Series) -> None:
        self.series, self.builder = series, series.builder
        self.block = self.builder.append_basic_block("sums")
        self._changing: list[tuple[Any, Any, Any]] = []  # LLVM's variable, its value at first, its next value
        self._loaded: dict[tuple[int, bool], Vec] = {}
        self._carried: dict[int, Vec] = {}
        self._made = 0
        self._j = self._variable(LONG)

    @property
    def full(self) -> bool:
        """Whether the loop has as many sums as it should."""
        return self._made == SETTINGS.most_sums

    def sums(self, forward: Row, backward: Row) -> tuple[Vec, Vec]:
        """sum a_j b_{k-j} and sum a_j b_{k+1-j} of a `forward`, b `backward`; a_1 b_k only if b_k is known before the loop."""
        self._made += 1
        with self.builder.goto_block(self.block):
            a, b = self._load(forward, False), self._load(backward, True)
            return self._sum(a, b), self._sum(a, self._before(backward, b))

    def _variable(self, kind: Any) -> Any:
        with self.builder.goto_block(self.block):
            self.builder.position_at_start(self.block)
            return self.builder.phi(kind)

    def _load(self, row: Row, backwards: bool) -> Vec:
        """Coefficient j, or k - j, of a series."""
        key = (id(row), backwards)
        if key not in self._loaded:
            index = self.builder.sub(self.series.order, self._j) if backwards else self._j
            self._loaded[key] = self.series._at(row, index)
        return self._loaded[key]

    def _before(self, row: Row, loaded: Vec) -> Vec:
        """Coefficient k + 1 - j, which the iteration before has loaded."""
        if id(row) not in self._carried:
            variable = self._variable(self.series._kind)
            start = self.series.memory.value(row.pair[0] if row.early else None)
            self._changing.append((variable, start, loaded.value))
            self._carried[id(row)] = Vec(self.builder, variable, self.series.memory.arithmetic)
        return self._carried[id(row)]

    def _sum(self, a: Vec, b: Vec) -> Vec:
        variable = self._variable(self.series._kind)
        total = a.fma(b, Vec(self.builder, variable, self.series.memory.arithmetic))
        self._changing.append((variable, a.as_value(0.0), total.value))
        return total

    def close(self, before: Any, after: Any) -> None:
        """Join the loop to the code before and after it."""
        with self.builder.goto_block(self.block):
            following = self.builder.add(self._j, LONG(1))
            self.builder.cbranch(self.builder.icmp_signed("<", following, self.series.order), self.block, after)
        for variable, start, value in [(self._j, LONG(1), following), *self._changing]:
            variable.add_incoming(start, before)
            variable.add_incoming(value, self.block)
