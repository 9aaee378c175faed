"""The window of basins is that of `find_attractors`: the cells are those of the grid over it."""

import numpy as np
import pytest

import saltus
from saltus import ParameterError

WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1, wall=1.0),
    load=saltus.Load(frequency=1.4, force=saltus.Harmonic(0.5)),
    impact=saltus.VelocityReduction(0.8),
)
PAIR = saltus.System(
    model=saltus.ImpactPair(clearance=0.5, damping=0.2),
    load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.3)),
    impact=saltus.NewtonImpact(0.5),
)


def test_a_window_is_the_grid_over_it():
    found = saltus.find_attractors(WALL, window=((-3, 0.9), (-3, 3)), starts=16)
    ours = saltus.basins_of_attraction(WALL, window=((-3, 0.9), (-3, 3)), points=7, found=found)
    grids = {"x": np.linspace(-3, 0.9, 7), "velocity": np.linspace(-3, 3, 7)}
    theirs = saltus.basins_of_attraction(WALL, **grids, found=found)
    assert ours.label.dims == theirs.label.dims
    assert len(np.unique(ours.label)) == 2  # one motion meets the wall, and one does not
    for name in ("x", "velocity", "label", "time"):
        np.testing.assert_array_equal(ours[name], theirs[name])


def test_cells_beyond_a_contact_are_left_out():
    check = saltus.basins_of_attraction.check
    check(WALL, window=((0.0, 2.0), (-1, 1)), points=5)
    basins = saltus.basins_of_attraction(WALL, window=((0.0, 2.0), (-1, 1)), points=5)
    np.testing.assert_array_equal(basins.x, [0.0, 0.5, 1.0])


def test_equal_bounds_keep_a_state_variable():
    window = ((0.0, 0.0), (-0.4, 0.4), (0.3, 0.3), (-1.0, 1.0))
    ours = saltus.basins_of_attraction(PAIR, window=window, points=4)
    theirs = saltus.basins_of_attraction(
        PAIR,
        x=np.linspace(-0.4, 0.4, 4),
        x_velocity=np.linspace(-1.0, 1.0, 4),
        z=0.0,
        z_velocity=0.3,
        found=saltus.find_attractors(PAIR, window=window),
    )
    assert set(ours.label.dims) == {"x", "x_velocity"}
    np.testing.assert_array_equal(ours.time, theirs.time)


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({"window": ((-1, 1), (-1, 1)), "x": [0.0, 1.0]}, "not both"),
        ({"window": ((1, -1), (-1, 1))}, "window must be"),
        ({"window": ((-1, 1), (-1, 1)), "points": 1}, "points must"),
        ({"progres": None}, "did you mean 'progress'"),
        ({"windo": ((-1, 1), (-1, 1))}, "did you mean 'window'"),
        ({"toll": 1e-9}, "did you mean 'tol'"),
    ],
)
def test_windows_and_names_without_meaning_are_refused(asked, sentence):
    with pytest.raises(ParameterError, match=sentence):
        saltus.basins_of_attraction(WALL, **asked)


def test_two_state_variables_have_different_bounds():
    with pytest.raises(ParameterError, match="two different bounds for two of"):
        saltus.basins_of_attraction(PAIR, window=((0, 0), (-0.4, 0.4), (0, 0), (0, 0)))
