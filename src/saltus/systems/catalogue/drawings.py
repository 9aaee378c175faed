"""Drawings: the mechanism of a model in one of its states, as lines and circles in the plane of
motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from saltus.checks import check_states
from saltus.errors import ParameterError
from saltus.systems.catalogue.metainterface import Metainterface
from saltus.systems.catalogue.oscillators import (
    BeltOscillator,
    ImpactPair,
    RockingBlock,
    TwoStops,
    WallOscillator,
)
from saltus.systems.catalogue.two_layer import CellChain, TwoLayer
from saltus.systems.catalogue.unit_cell import CellLayout, UnitCell
from saltus.systems.contracts.model import Model, OneContactModel
from saltus.systems.structures.structure import Structure
from saltus.systems.system import System

BASE = 1.4  # of a cell whose model says nothing of it: the horizontal edges in units of l


@dataclass(frozen=True, eq=False)
class Shape:
    """A part of a drawing.

    Attributes
    ----------
    kind
        "line", an open or closed line through the points, or "circle", a disc about the one point.
    points
        The points, (n, 2).
    role
        What it is: "body", "bar", "spring", "slider", "wall", "ground", "mass" or "hinge".
    radius
        The radius of a circle.

    Examples
    --------
    >>> shapes = saltus.systems.drawing_of(saltus.System(model=saltus.RockingBlock(alpha=0.2)), [0.1])
    >>> [(shape.kind, shape.role, len(shape.points)) for shape in shapes]
    [('line', 'ground', 2), ('line', 'body', 5)]
    """

    kind: str
    points: np.ndarray
    role: str
    radius: float = 0.0


def drawing_of(system: System, position: Any) -> tuple[Shape, ...]:
    """The mechanism of a system with given coordinates: always the same shapes in the same order,
    wherever they are.

    A model of your own may have a method `drawing(position)` that returns a list of `Shape`;
    without one, each of its coordinates is drawn as a mass on a line, with the stops that its
    contacts and surfaces make. Angles are drawn as they are,
    lengths in the unit of the coordinate. The frame is that of the ground.

    Parameters
    ----------
    system
        What is drawn.
    position
        The coordinates, (n,).

    Raises
    ------
    ParameterError
        Another number of coordinates than the model has, or one that is not finite.

    Examples
    --------
    >>> shapes = saltus.systems.drawing_of(system, [0.3])
    >>> sum(shape.role == "mass" for shape in shapes)
    2
    """
    model = system.model
    place = check_states("position", [position], len(model.coordinates))[0]
    own: Any = getattr(model, "drawing", None)
    if own is not None:
        return tuple(own(place))
    if not model.moving:
        names = ", ".join(model.coordinates)
        raise ParameterError(
            f"{type(model).__name__} has {names} of first order, which move nothing: give it a "
            "`drawing`",
            "system",
        )
    draw = next((draw for kind, draw in DRAWN.items() if isinstance(model, kind)), _masses)
    return tuple(draw(model, place))


def _line(role: str, *points: Any) -> Shape:
    return Shape("line", np.array(points, dtype=float), role)


def _disc(role: str, middle: Any, radius: float) -> Shape:
    return Shape("circle", np.array([middle], dtype=float), role, radius)


def _box(role: str, x: float, y: float, width: float, height: float) -> Shape:
    """A rectangle about the middle (x, y)."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * [width / 2, height / 2]
    return Shape("line", corners + np.array([x, y]), role)


def _spring(x: float, y: float, to: float, to_y: float | None = None) -> Shape:
    """A spring from (x, y) to another place, by default at the same height."""
    start = np.array([x, y])
    end = np.array([to, y if to_y is None else to_y])
    # six coils
    along = end - start
    share = np.concatenate([[0.0], np.linspace(0.15, 0.85, 13), [1.0]])
    sideways = np.concatenate([[0.0, 0.0], np.tile([1.0, -1.0], 6)[:11], [0.0, 0.0]])
    length = math.hypot(*along) or 1.0
    across = np.array([-along[1], along[0]]) / length
    return Shape(
        "line", start + share[:, None] * along + 0.09 * sideways[:, None] * across, "spring"
    )


def _block(model: RockingBlock, place: np.ndarray) -> list[Shape]:
    """A block with the half diagonal 1; it turns about its right corner for theta > 0, about its
    left one for theta < 0.
    """
    theta = float(place[0])
    width = math.sin(model.alpha)
    height = math.cos(model.alpha)
    corners = np.array(
        [[-width, 0], [width, 0], [width, 2 * height], [-width, 2 * height], [-width, 0]]
    )
    pivot = np.array([width if theta >= 0 else -width, 0.0])
    turn = np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
    return [
        _line("ground", (-1.6, 0), (1.6, 0)),
        Shape("line", (corners - pivot) @ turn.T + pivot, "body"),
    ]


def _on_spring(x: float, left: float, y: float = 0.25) -> list[Shape]:
    """A mass on a spring that is fixed at `left`."""
    return [
        _line("wall", (left, 0.0), (left, 0.55)),
        _spring(left, y, x - 0.2),
        _box("mass", x - 0.1, y, 0.2, 0.4),
    ]


def _wall(model: WallOscillator, place: np.ndarray) -> list[Shape]:
    """The mass, whose right face is at x, on a spring, and the wall at d."""
    left = min(-2.0, model.wall - 2.0)
    right = max(1.5, model.wall + 0.4)
    return [
        _line("ground", (left, 0.0), (right, 0.0)),
        *_on_spring(float(place[0]), left),
        _line("wall", (model.wall, 0.0), (model.wall, 0.7)),
    ]


def _stops(model: TwoStops, place: np.ndarray) -> list[Shape]:
    """A mass whose faces meet the stops at d_1 and d_2, on a spring above."""
    x = float(place[0])
    left = model.left
    right = model.right
    half = 0.2
    return [
        _line("ground", (left - half - 0.5, 0.0), (right + half + 0.5, 0.0)),
        _line("wall", (left - half, 0.0), (left - half, 0.45)),
        _line("wall", (right + half, 0.0), (right + half, 0.45)),
        _line("wall", (left - half - 0.5, 0.0), (left - half - 0.5, 0.75)),
        _spring(left - half - 0.5, 0.6, x),
        _line("bar", (x, 0.6), (x, 0.4)),
        _box("mass", x, 0.2, 2 * half, 0.4),
    ]


def _pair(model: ImpactPair, place: np.ndarray) -> list[Shape]:
    """The case at z on its spring, and the mass in it at the distance x from its middle."""
    z = float(place[0])
    x = float(place[1])
    half = model.clearance + 0.2
    left = -half - 1.8
    return [
        _line("ground", (left, 0.0), (half + 1.5, 0.0)),
        _line("wall", (left, 0.0), (left, 0.7)),
        _spring(left, 0.35, z - half),
        _box("body", z, 0.35, 2 * half, 0.7),
        _disc("mass", (z + x, 0.35), 0.2),
    ]


def _belt(model: BeltOscillator, place: np.ndarray) -> list[Shape]:
    """A mass on a spring, on a belt between two wheels."""
    x = float(place[0])
    wheels = [_disc("hinge", (at, -0.2), 0.2) for at in (-1.4, 1.4)]
    return [
        _line("ground", (-1.4, 0.0), (1.4, 0.0)),
        _line("ground", (-1.4, -0.4), (1.4, -0.4)),
        *wheels,
        *_on_spring(x, -2.2),
    ]


def cell_shapes(layout: CellLayout, shift: float = 0.0) -> list[Shape]:
    """The shapes of a unit cell: its supports, bars, sliders, hinges and masses, moved to the right
    by `shift`.
    """
    points = {name: at + np.array([shift, 0.0]) for name, at in layout.points.items()}
    left = points["lower_left"]
    right = points["lower_right"]
    aside = np.array([0.25, 0.0])
    shapes = [_line("ground", left - aside - [0.0, 0.1], right + aside - [0.0, 0.1])]
    shapes += [_line("bar", points[first], points[last]) for first, last in layout.bars]
    shapes += [_line("slider", points[first], points[last]) for first, last in layout.sliders]
    hinges = [name for name in points if not name.startswith(("slider", "mass"))]
    shapes += [_disc("hinge", points[name], 0.045) for name in hinges]
    return shapes + [_disc("mass", points[name], 0.09) for name in ("mass_1", "mass_2")]


def _cell_of(beta0: float) -> UnitCell:
    """The cell of an angle beta0 whose base is of the usual length."""
    return UnitCell(alpha0=math.atan2(math.sin(beta0), BASE - math.cos(beta0)), beta0=beta0)


def _layered(beta0: float, lower: float, upper: float, shift: float = 0.0) -> list[Shape]:
    """The cell with these openings, which are kept within what the mechanism allows."""
    cell = _cell_of(beta0)
    limit = cell.kinematic_limit
    return cell_shapes(
        cell.layout(min(max(lower, 0.0), limit), max(min(upper, 0.0), -limit)), shift
    )


def _metainterface(model: Metainterface, place: np.ndarray) -> list[Shape]:
    """The lower layer is open for theta > 0, the upper one for theta < 0."""
    return _layered(model.beta0, float(place[0]), float(place[0]))


def _two_layers(model: TwoLayer, place: np.ndarray) -> list[Shape]:
    """Both layers."""
    return _layered(model.beta0, float(place[0]), float(place[1]))


def _chain(model: CellChain, place: np.ndarray) -> list[Shape]:
    """The cells side by side, with the springs between their masses."""
    step = BASE + 0.9  # with a space between two cells
    cells = [
        _layered(model.beta0, float(place[2 * i]), float(place[2 * i + 1]), i * step)
        for i in range(model.cells)
    ]
    masses = [[shape.points[0] for shape in cell if shape.role == "mass"] for cell in cells]
    springs = [
        _spring(*a, *b)
        for before, after in pairwise(masses)
        for a, b in zip(before, after, strict=True)
    ]
    return [shape for cell in cells for shape in cell] + springs


HALF = 0.2  # of a mass's width, in the unit of a drawing
FEW = 6  # coordinates without a stop that are drawn beside those with one


def _masses(model: Model, place: np.ndarray) -> list[Shape]:
    """A mass on a line of its own for each coordinate that is not of first order, above a mark at
    0, with the stops that its contacts and surfaces make.

    Of a `Structure` only the points with contacts and surfaces are drawn, as its other coordinates
    are modes.
    """
    stops = stops_of(model)
    rows = list(range(len(model.moving)))
    if stops and (isinstance(model, Structure) or len(rows) > FEW):
        rows = sorted({stop.coordinate for stop in stops})
    unit = max((abs(stop.position) for stop in stops), default=0.0) or 1.0
    shapes: list[Shape] = []
    for line, i in enumerate(rows):
        y = -0.8 * line
        x = float(place[i]) / unit
        shapes += [
            _line("ground", (-2.0, y), (2.0, y)),
            _line("wall", (0.0, y - 0.1), (0.0, y)),
            *(_stop(stop, x, y, unit) for stop in stops if stop.coordinate == i),
            _box("mass", x, y + 0.2, 2 * HALF, 0.4),
        ]
    return [Shape(s.kind, s.points * unit, s.role, s.radius * unit) for s in shapes]


@dataclass(frozen=True)
class Stop:
    """What a contact or a surface does in a drawing: a wall, or the spring of a soft stop, at a
    place of one coordinate. `side` is +1 where it stands to the right of the mass.
    """

    coordinate: int
    position: float
    side: int
    soft: bool


def stops_of(model: Model) -> list[Stop]:
    """The stops of a model's contacts and surfaces that are at a number of a single coordinate, as a
    drawing shows them.

    Parameters
    ----------
    model
        The model.

    Examples
    --------
    >>> [(stop.position, stop.side) for stop in saltus.systems.stops_of(saltus.TwoStops(left=-1.0, right=2.0))]
    [(-1.0, -1), (2.0, 1)]
    """
    if isinstance(model, OneContactModel):
        if model.sides != (1,):
            return []
        place = float(model.contact)
        return [Stop(0, place, -1 if model.gap(place + 1.0, 1) > 0.0 else 1, False)]
    names = list(model.coordinates[: len(model.moving)])
    parts = [(part, -part.sign, False) for part in getattr(model, "contacts", ())]
    parts += [(part, part.sign, True) for part in getattr(model, "surfaces", ())]
    found = []
    for part, side, soft in parts:
        name = part.coordinate if isinstance(part.coordinate, str) else part.name
        if name in names and isinstance(part.position, (int, float)):
            found.append(Stop(names.index(name), float(part.position), side, soft))
    return found


def _stop(stop: Stop, x: float, y: float, unit: float) -> Shape:
    """A wall that the mass at x meets with its face, or a spring that it presses; in units of the
    drawing.
    """
    face = stop.position / unit + stop.side * HALF
    if not stop.soft:
        return _line("wall", (face, y), (face, y + 0.55))
    pressed = stop.side * max(stop.side * (x + stop.side * HALF), stop.side * face)
    return _spring(face + stop.side * 0.7, y + 0.2, pressed)


DRAWN: dict[type[Model], Callable[[Any, np.ndarray], list[Shape]]] = {
    RockingBlock: _block,
    WallOscillator: _wall,
    TwoStops: _stops,
    ImpactPair: _pair,
    BeltOscillator: _belt,
    CellChain: _chain,
    TwoLayer: _two_layers,
    Metainterface: _metainterface,
}
