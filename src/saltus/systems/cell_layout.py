"""The positions of a two-layer cell's hinges, sliders and masses, for drawing it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Point = NDArray[np.float64]
Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class CellLayout:
    """Points (x, y) of shape (2,), in units of l, in the frame of the base with its origin at the lower left hinge.

    The masses sit amid the top edge of each layer, at (x_j, y_j) of `displ_ratio2`. The inclined bars lean to the left in the
    lower layer and to the right in the upper one (for beta < pi/2). The diagonal of layer j joins `diagonals[j - 1]`; its halves
    end at `slider_j_in` and `slider_j_out`, whose distance is the transverse jump of the slider.

    The rotational springs of the paper's points A and B measure the angle beta_j. It is the same at opposite corners of a
    layer, and the paper does not say which corners it means: here A is the lower right hinge and B the upper right one.
    """

    points: dict[str, Point]  # of every hinge, slider and mass, by name

    bars: ClassVar[tuple[Pair, ...]] = (
        ("lower_left", "lower_right"),
        ("lower_left", "middle_left"),
        ("lower_right", "middle_right"),
        ("middle_left", "middle_right"),
        ("middle_left", "upper_left"),
        ("middle_right", "upper_right"),
        ("upper_left", "upper_right"),
        ("lower_left", "slider_1_in"),
        ("slider_1_out", "middle_right"),
        ("middle_right", "slider_2_in"),
        ("slider_2_out", "upper_left"),
    )
    diagonals: ClassVar[tuple[Pair, Pair]] = (("lower_left", "middle_right"), ("middle_right", "upper_left"))
    sliders: ClassVar[tuple[Pair, Pair]] = (("slider_1_in", "slider_1_out"), ("slider_2_in", "slider_2_out"))
    springs: ClassVar[dict[str, str]] = {"A": "lower_right", "B": "upper_right"}

    @classmethod
    def build(cls, base: float, half_diagonal: float, beta: tuple[float, float], phi: tuple[float, float]) -> CellLayout:
        """The layout for edges of length `base`, half diagonals of length lambda, and the angles of both layers (rad)."""
        edge = np.array([base, 0.0])
        rise = [np.array([lean * np.cos(b), np.sin(b)]) for lean, b in zip((-1, 1), beta, strict=True)]
        left = [np.zeros(2), rise[0], rise[0] + rise[1]]
        right = [corner + edge for corner in left]
        slider_1 = _slider(left[0], right[1], half_diagonal, phi[0])
        slider_2 = _slider(right[1], left[2], half_diagonal, phi[1])
        points: dict[str, Point] = {}
        for row, at_left, at_right in zip(("lower", "middle", "upper"), left, right, strict=True):
            points |= {f"{row}_left": at_left, f"{row}_right": at_right}
        points |= {"slider_1_in": slider_1[0], "slider_1_out": slider_1[1]}
        points |= {"slider_2_in": slider_2[0], "slider_2_out": slider_2[1]}
        points |= {"mass_1": left[1] + edge / 2, "mass_2": left[2] + edge / 2}
        return cls(points)

    def segment(self, pair: Pair) -> Point:
        """The two ends of a pair of names, as rows, shape (2, 2)."""
        return np.array([self.points[pair[0]], self.points[pair[1]]])


def _slider(start: Point, end: Point, half: float, phi: float) -> tuple[Point, Point]:
    """The ends of the two halves of a diagonal, each turned by phi against the line from `start` to `end`."""
    line = (end - start) / np.hypot(*(end - start))
    turned = np.array([np.cos(phi) * line[0] - np.sin(phi) * line[1], np.sin(phi) * line[0] + np.cos(phi) * line[1]])
    return start + half * turned, end - half * turned
