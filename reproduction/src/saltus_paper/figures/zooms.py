"""A part of a spectrum or a diagram drawn larger: as an inset where there is room, or in axes of
its own beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import branches_of
from saltus.plots import LOOK, draw_response, smooth_lines

PLACES = 24  # the number of places along each side of the axes that are tried for an inset
SHARES = (1.0, 0.9, 0.8, 0.75)  # of the size of an inset, which are tried
MARGIN = 0.05  # the ticks of an inset take this share of the axes
LINE = 5.0  # to cover a line is as bad as to cover so many points of a branch
# lines that are drawn larger have this share of their width, as they lie closer together
WEIGHT = 0.65


def draw_zoom(
    ax: Any,
    spectrum: Any,
    size: tuple[float, float],
    window: tuple[float, float, float, float],
    quantity: str = "amplitude",
    scale: float = 1.0,
) -> Any:
    """An inset of a `size` (shares of the axes), placed where there is room, with the part `window`
    (x from, to, y from, to).
    """
    inset = ax.inset_axes(free_place(ax, spectrum, size, quantity, scale))
    inset.set_xlim(window[:2])
    inset.set_ylim(window[2:])
    inset.tick_params(labelsize=7, length=2, pad=1.5)
    inset.locator_params(nbins=3)
    draw_response(inset, spectrum, quantity, scale, WEIGHT)
    box = ax.indicate_inset_zoom(inset, edgecolor=LOOK.ink, linewidth=0.4, alpha=1.0)
    for connector in box.connectors:
        connector.set_visible(False)  # they would cross the curves
    return inset


def draw_beside(
    ax: Any,
    main: Any,
    spectrum: Any,
    window: tuple[float, float, float, float],
    quantity: str = "amplitude",
    scale: float = 1.0,
) -> None:
    """In the axes `ax` the part `window` (x from, to, y from, to) of a diagram, framed in its axes
    `main`.
    """
    ax.set_xlim(window[:2])
    ax.set_ylim(window[2:])
    ax.locator_params(axis="x", nbins=4)
    draw_response(ax, spectrum, quantity, scale, WEIGHT)
    box = main.indicate_inset(
        bounds=(window[0], window[2], window[1] - window[0], window[3] - window[2]),
        edgecolor=LOOK.ink,
        alpha=1.0,
    )
    box.set_linewidth(0.5)


def free_place(
    ax: Any,
    spectrum: Any,
    size: tuple[float, float],
    quantity: str = "amplitude",
    scale: float = 1.0,
) -> tuple[float, float, float, float]:
    """Where in the axes an inset of a size (shares of the axes) covers least of the branches and
    lines; it is up to a fourth smaller where it covers less then."""
    (left, right) = ax.get_xlim()
    (low, high) = ax.get_ylim()
    marks = [np.empty((0, 2))]
    for _, branch in branches_of(spectrum):
        for line in smooth_lines(branch, quantity):
            marks.append(
                (line.places / np.array([1.0, scale]) - np.array([left, low]))
                / np.array([right - left, high - low])
            )
    points = np.concatenate(marks)
    margin = MARGIN
    lines = [
        (line.get_ydata()[0] - low) / (high - low)
        for line in ax.get_lines()
        if len(set(line.get_ydata())) == 1
    ]
    table = spectrum["bands"]
    bands = (np.stack([table["low"].values, table["high"].values], axis=1) - left) / (right - left)
    best = (0.1, 0.1, *size)
    least = np.inf
    for share in SHARES:
        wide = share * size[0]
        tall = share * size[1]
        for y in np.linspace(0.07, 0.96 - tall, PLACES):
            for x in np.linspace(0.07, 0.98 - wide, PLACES):
                inside = (
                    np.abs(points - [x + wide / 2, y + tall / 2])
                    < [wide / 2 + margin, tall / 2 + margin]
                ).all(axis=1)
                crossed = sum(y - margin < line < y + tall + 0.01 for line in lines)
                hidden = int(((bands[:, 0] < x + wide) & (bands[:, 1] > x)).sum())
                # It is better to cover a band than a branch or a line, to be large, and to be high
                # rather than low.
                cost = inside.sum() + LINE * crossed + 0.5 * hidden + 2 * (1 - share) - 1e-3 * y
                if cost < least:
                    best = (x, y, wide, tall)
                    least = cost
    return best
