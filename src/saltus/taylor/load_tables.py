"""Tables of a system's loads between their breakpoints: the polynomials of records, and the times
that pulses depend on, and the polynomials of what repeats itself between corners.

A trace reads rows of such a table by (dotted path, order). For a record the order is that of the
derivative. A pulse is a closed form in its own time; its rows are polynomials of degree 1: SINCE,
the time since its start, at most its length; WITHIN, the derivative of SINCE, 1 within the pulse
and else 0; AFTER, the time since its end; and the derivative of AFTER.

The last part is compiled together with the lanes; `memory.py` runs the same functions while it
writes the code of one motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from saltus.errors import TraceError
from saltus.systems import SAME_CORNER, Record, System, Transient, substitute
from saltus.taylor.graph import RECORD_WIDTH, Expr, combine
from saltus.taylor.kernels import jit

# Rows of what repeats itself between corners: the phase of the corner behind, and from PIECES on
# the coefficients of the polynomials of its derivatives of the orders -2 to 2, all constant between
# corners. Between two of these numbers is the derivative of the row, which is 0.
CORNER = 20
PIECES = 22
MOST_POWERS = 8


SINCE = 0
WITHIN = 1
AFTER = 10


def record_table(system: System, rows: list[tuple[str, int]]) -> tuple[np.ndarray, np.ndarray]:
    """The records and pulses that a trace reads, on their common breakpoints.

    Returns
    -------
    tuple[np.ndarray, np.ndarray]
        Breakpoints (m,) and coefficients (rows, m + 1, RECORD_WIDTH): piece i of a row holds
        between the breakpoints i - 1 and i, in ascending powers of the time since breakpoint i - 1
        (the first piece: since breakpoint 0). Scales are left out.
    """
    breaks, tables = record_tables(system, rows, {})
    return breaks[0], tables[0]


def record_tables(
    system: System, rows: list[tuple[str, int]], columns: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """`record_table` for many sets of numbers, given in flat columns by dotted path.

    Returns
    -------
    tuple[np.ndarray, np.ndarray]
        Breakpoints (n, m) and coefficients (n, rows, m + 1, RECORD_WIDTH); n is 1 where no column
        moves a breakpoint.
    """
    if not rows:
        return np.empty((1, 0)), np.empty((1, 0, 1, RECORD_WIDTH))
    signals = {path: system.get(path) for path, _ in rows}
    if any(signal.repeats for signal in signals.values()):
        found, table = _repeating_table(signals, rows)
        return found[None], table[None]
    moving = {
        f"{path}.{name}"
        for path, signal in signals.items()
        for name in getattr(signal, "moving", ())
    }
    varied = {
        path: values[:, None] for path, values in columns.items() if path in moving and values.ndim
    }
    pulses = {path: substitute(signal, lambda at, value: varied.get(at, value), path) for path, signal in signals.items()
              if isinstance(signal, Transient)}  # fmt: skip
    count = max((values.shape[0] for values in varied.values()), default=1)
    edges = [_edges(pulses.get(path, signal), count) for path, signal in signals.items()]
    together = np.concatenate(edges, axis=1)
    breaks = np.sort(together, axis=1) if varied else np.unique(together)[None]
    tables = np.zeros((count, len(rows), breaks.shape[1] + 1, RECORD_WIDTH))
    for i, (path, order) in enumerate(rows):
        if path in pulses:
            _fill_clock(tables[:, i], breaks, pulses[path], order)
        else:
            for table, own in zip(tables[:, i], breaks, strict=True):
                _fill(table, own, signals[path], order)
    return breaks, tables


def _repeating_table(
    signals: Mapping[str, Any], rows: list[tuple[str, int]]
) -> tuple[np.ndarray, np.ndarray]:
    """Breakpoints, as shares of the forcing period, and coefficients of what repeats itself.

    They cover two periods, as lanes count a period from the phase at which their motion starts.
    """
    corners = np.concatenate([signal.pieces(0).corners for signal in signals.values()])
    corners = np.unique(corners)
    apart = np.append(True, np.diff(corners) > SAME_CORNER)
    corners = corners[apart]
    breaks = np.concatenate([corners, 1.0 + corners, [2.0]])
    table = np.zeros((len(rows), breaks.size + 1, RECORD_WIDTH))
    middles = 0.5 * (corners + np.append(corners[1:], 1.0))
    for row, (path, code) in zip(table, rows, strict=True):
        if code % 2:  # a derivative
            continue
        level, power = divmod((code - PIECES) // 2, MOST_POWERS)
        pieces = signals[path].pieces(0 if code == CORNER else level - 2)
        behind = np.searchsorted(pieces.corners, middles, side="right") - 1
        if code == CORNER:
            for period in range(2):
                first = 1 + period * corners.size
                row[first : first + corners.size, 0] = math.tau * (pieces.corners[behind] + period)
            continue
        values = pieces.coefficients[behind, power]
        row[1:-1, 0] = np.tile(values, 2)
    return breaks, table


def _edges(signal: Any, count: int) -> np.ndarray:
    """The breakpoints of a record or a pulse, (count, its breakpoints)."""
    if isinstance(signal, Record):
        return np.broadcast_to(signal.time, (count, signal.time.size))
    return np.concatenate(
        [np.broadcast_to(t, (count, 1)) for t in (signal.start, signal.start + signal.length)],
        axis=1,
    )


def _fill_clock(table: np.ndarray, breaks: np.ndarray, pulse: Any, order: int) -> None:
    """One row of a pulse, (n, m + 1, RECORD_WIDTH); before the first breakpoint it has not
    begun.
    """
    end = pulse.start + pulse.length
    within = (breaks >= pulse.start) & (breaks < end)
    past = breaks >= end
    pieces = table[:, 1:]
    if order == SINCE:
        # the length itself at the end, of which end - start is no rounding where it is short
        pieces[..., 0] = np.where(past, pulse.length, np.where(within, breaks - pulse.start, 0.0))
    if order == AFTER:
        pieces[..., 0] = np.where(past, breaks - end, 0.0)
    slope = {SINCE: within, WITHIN: within, AFTER: past, AFTER + 1: past}.get(order)
    if slope is not None:
        pieces[..., 1 if order in (SINCE, AFTER) else 0] = slope


def _fill(row: np.ndarray, breaks: np.ndarray, record: Record, order: int) -> None:
    from scipy.special import factorial

    polynomial = (
        record.polynomials[order] if order < 3 else record.polynomials[2].derivative(order - 2)
    )
    first = record.time[0]
    last = record.time[-1]
    inside = (breaks >= first) & (breaks < last)
    anchors = breaks[inside]
    for power in range(polynomial.c.shape[0]):
        row[1:][inside, power] = polynomial(anchors, nu=power) / factorial(power)
    if record.quantity == "force" or order >= 2:
        return
    for after in (False, True):  # outside of the record the ground moves on with constant velocity
        edge = last if after else first
        where = np.append(False, breaks >= last) if after else np.append(True, breaks < first)
        anchor = np.append(breaks[0], breaks)[where]
        velocity = record.polynomials[1](edge)
        row[where, 0] = (
            velocity if order == 1 else record.polynomials[0](edge) + velocity * (anchor - edge)
        )
        row[where, 1] = 0.0 if order == 1 else velocity


class LoadTime:
    """The time in a traced model, which may be passed to load channels only.

    The flow counts whole forcing periods and keeps a local time within them. A model may therefore
    depend on the time only through its load, for which this representation is exact.
    """

    def __init__(self, trace: Any) -> None:
        self._trace = trace

    def phase(self, rate: Any, phase: Any) -> Expr:
        """rate t + phase, for a harmonic."""
        return combine("add", combine("mul", rate, Expr("time")), phase)

    def record(self, record: Record, order: int) -> Expr:
        """The `order`-th derivative of a record at t, times its scale."""
        return combine("mul", record.scale, self._row(record, order))

    def pulse(self, pulse: Transient) -> tuple[Expr, Expr, Expr]:
        """The time since the start of a pulse, at most its length; 1 within it, else 0; the time
        since its end.
        """
        return self._row(pulse, SINCE), self._row(pulse, WITHIN), self._row(pulse, AFTER)

    def repeating(self, signal: Any, level: int, frequency: Any) -> Expr:
        """The derivative by the phase, or the integral, of the shape of what repeats itself."""
        degree = signal.pieces(level).degree
        first = PIECES + 2 * MOST_POWERS * (level + 2)
        coefficients = [self._row(signal, first + 2 * power) for power in range(degree + 1)]
        value: Any = coefficients[-1]
        if degree > 0:
            corner = self._row(signal, CORNER)
            since = combine("sub", combine("mul", frequency, Expr("time")), corner)
            for coefficient in coefficients[-2::-1]:
                value = combine("add", combine("mul", value, since), coefficient)
        return cast(Expr, value)

    def _row(self, signal: Any, order: int) -> Expr:
        row = (signal.path, order)
        if row not in self._trace.records:
            self._trace.records.append(row)
        return Expr("record", (), self._trace.records.index(row))

    def refuse(self, *_: Any) -> Any:
        """Raise an error for every other use."""
        raise TraceError(
            "the time may only be passed to a load channel, such as load.horizontal(t); give the "
            "model a channel for it"
        )

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = (
        refuse
    )
    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = __pow__ = __rpow__ = __neg__ = __pos__ = (
        __abs__
    ) = refuse
    __float__ = __int__ = __bool__ = __lt__ = __gt__ = __le__ = __ge__ = __eq__ = __ne__ = (
        __array__
    ) = refuse
    __hash__ = object.__hash__


# --- compiled from here on ---------------------------------------------------


@jit
def anchor(breaks, piece):
    """The time that a record's piece counts from."""
    return breaks[max(piece - 1, 0)]


@jit
def own_records(tables, trajectory):
    """The breakpoints and the table of one trajectory; all trajectories share one of each if no
    breakpoint depends on it.
    """
    breaks, table = tables
    i = min(trajectory, breaks.shape[0] - 1)
    return breaks[i], table[i]


@jit
def expand_record(coefficients, start, t, row):
    """Taylor coefficients at `t` of a record's piece, given in powers of the time since `start`."""
    width = coefficients.size
    for k in range(width):
        row[k] = coefficients[k]
    for k in range(width - 1):  # repeated synthetic division: p(x + t - start)
        for j in range(width - 2, k - 1, -1):
            row[j] += (t - start) * row[j + 1]
