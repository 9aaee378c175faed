"""Drawings of mechanisms: bars keep their lengths, blocks stand on the ground, masses touch what
they hit.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import (
    BeltOscillator,
    CellChain,
    ImpactPair,
    Metainterface,
    Model,
    RockingBlock,
    System,
    TwoLayer,
    TwoStops,
    WallOscillator,
)
from saltus.errors import ParameterError
from saltus.systems import Shape, drawing_of

STATES = {
    RockingBlock(alpha=0.3): [[0.0], [0.2], [-0.2]],
    WallOscillator(): [[0.0], [1.0]],
    TwoStops(): [[-1.0], [1.0]],
    ImpactPair(): [[0.1, 1.0], [-0.3, -1.0]],
    BeltOscillator(): [[0.0], [0.4]],
    Metainterface(beta0=1.4): [[0.0], [0.5], [-0.5]],
    TwoLayer(beta0=1.4): [[0.0, 0.0], [0.4, -0.6]],
    CellChain(cells=3, beta0=1.4): [[0.0] * 6, [0.4, -0.6, 0.2, -0.1, 0.0, -0.3]],
}


def shapes(model, position, role):
    return [shape for shape in drawing_of(System(model=model), position) if shape.role == role]


def lengths(shape):
    return np.linalg.norm(np.diff(shape.points, axis=0), axis=1)


@pytest.mark.parametrize("model", STATES, ids=lambda model: type(model).__name__)
def test_a_drawing_has_the_same_rigid_parts_in_every_state(model):
    drawings = [drawing_of(System(model=model), state) for state in STATES[model]]
    for drawing in drawings:
        assert [(s.kind, s.role, len(s.points)) for s in drawing] == [
            (s.kind, s.role, len(s.points)) for s in drawings[0]
        ]
        assert all(np.isfinite(shape.points).all() for shape in drawing)
        for shape, first in zip(drawing, drawings[0], strict=True):
            if shape.role in ("body", "bar", "mass", "wall", "ground"):
                np.testing.assert_allclose(lengths(shape), lengths(first), atol=1e-12)
                assert shape.radius == first.radius


@pytest.mark.parametrize("theta", [-1.2, -0.1, 0.0, 0.4])
def test_a_block_stands_on_the_corner_about_which_it_turns(theta):
    """Its lowest point is that corner, on the ground, and its middle is at the height R cos(alpha -
    abs(theta)), with R = 1.
    """
    (body,) = shapes(RockingBlock(alpha=0.3), [theta], "body")
    corners = body.points[:4]
    assert corners[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    assert corners.mean(axis=0)[1] == pytest.approx(np.cos(0.3 - abs(theta)))
    pivot = np.sign(theta) * np.sin(0.3)
    assert corners.mean(axis=0)[0] == pytest.approx(
        pivot - np.sign(theta) * np.sin(0.3 - abs(theta))
    )


def test_masses_touch_what_they_hit():
    (mass,) = shapes(WallOscillator(wall=0.7), [0.7], "mass")
    assert mass.points[:, 0].max() == pytest.approx(0.7)
    stops = TwoStops(left=-0.5, right=0.8)
    # without that of the spring
    walls = sorted(wall.points[0, 0] for wall in shapes(stops, [0.0], "wall"))[1:]
    for place, end in ((-0.5, np.min), (0.8, np.max)):
        (mass,) = shapes(stops, [place], "mass")
        assert end(mass.points[:, 0]) == pytest.approx(walls[0] if place < 0 else walls[1])
    pair = ImpactPair(clearance=0.6)
    (case,), (ball,) = (shapes(pair, [0.2, 0.6], role) for role in ("body", "mass"))
    assert ball.points[0, 0] + ball.radius == pytest.approx(case.points[:, 0].max())


def test_masses_of_a_cell_are_where_the_model_puts_them():
    """The lower mass is moved by cos(beta0) - cos(beta0 + theta_1), and rises by sin(beta0 +
    theta_1) - sin(beta0).
    """
    model = TwoLayer(beta0=1.4)
    still, moved = (shapes(model, [theta, 0.0], "mass")[0].points[0] for theta in (0.0, 0.3))
    assert moved - still == pytest.approx([np.cos(1.4) - np.cos(1.7), np.sin(1.7) - np.sin(1.4)])


@dataclass(frozen=True, kw_only=True)
class Free(Model):
    coordinates: ClassVar[tuple[str, ...]] = ("a", "b")

    def acceleration(self, t, q, velocity, side, load):
        return -q[0], -q[1]


@dataclass(frozen=True, kw_only=True)
class Drawn(Free):
    def drawing(self, position):
        return [Shape("line", np.array([[0.0, 0.0], position]), "bar")]


def test_a_model_of_ones_own_is_drawn_by_itself_or_as_masses_on_lines():
    assert len(shapes(Free(), [0.1, 0.2], "mass")) == 2
    assert [s.points[:, 0].mean() for s in shapes(Free(), [0.1, 0.2], "mass")] == pytest.approx(
        [0.06, 0.16], abs=0.1
    )
    (bar,) = drawing_of(System(model=Drawn()), [0.1, 0.2])
    assert bar.points[1] == pytest.approx([0.1, 0.2])
    with pytest.raises(ParameterError, match="position must be"):
        drawing_of(System(model=Free()), [np.nan, 0.0])


def test_a_point_of_a_structure_meets_its_stop_with_its_face():
    """Rigid or soft, on either side, in any unit of length."""
    for unit in (1.0, 1e-3):
        stop = saltus.Contact(name="stop", coordinate=1, position=0.5 * unit, sign=-1)
        soft = saltus.Surface(
            name="soft", coordinate=0, position=-0.2 * unit, sign=-1, stiffness=2.0
        )
        structure = saltus.Structure(
            mass=np.eye(3), stiffness=np.eye(3), contacts=[stop], surfaces=[soft], forces={"f": 1}
        )
        at_both = [0.5 * unit if name == "x1" else -0.2 * unit for name in structure.coordinates]
        masses = shapes(structure, at_both, "mass")
        assert len(masses) == 2  # modes are not drawn
        walls = [wall.points for wall in shapes(structure, at_both, "wall")]
        right = max(points[:, 0].max() for points in walls)
        assert masses[0].points[:, 0].max() == pytest.approx(right)
        (spring,) = shapes(structure, at_both, "spring")
        assert masses[1].points[:, 0].min() == pytest.approx(spring.points[-1, 0])
        pressed = [place - 0.1 * unit for place in at_both]
        (shorter,) = shapes(structure, pressed, "spring")
        assert np.ptp(spring.points[:, 0]) - np.ptp(shorter.points[:, 0]) == pytest.approx(
            0.1 * unit
        )
        freed = [place + 0.1 * unit for place in at_both]
        (longest,) = shapes(structure, freed, "spring")
        np.testing.assert_allclose(longest.points, spring.points)
