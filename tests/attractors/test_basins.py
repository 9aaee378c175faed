"""Basins on a grid: the labels and times that single simulations give, new attractors, blocks, and
the picture.
"""

import json
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
import xarray
from attractor_cases import strobes
from shared_systems import forced, steady, walled

from saltus import basins_of_attraction
from saltus.attractors.attractor_search import Attractors, find_attractors
from saltus.attractors.basins.basin_cells import Grid, Labelling, cell_arguments, cells
from saltus.attractors.basins.grid import _relabelled
from saltus.errors import ParameterError
from saltus.plots import figure_of
from saltus.plots.basins import draw_basins

SYSTEM = forced(W=0.88)
THETA, VELOCITY = np.linspace(-2.4, 2.4, 13), np.linspace(-2.1, 2.1, 11)


@pytest.fixture(scope="module")
def found() -> Attractors:
    return find_attractors(SYSTEM, starts=64)


@pytest.fixture(scope="module")
def picture(found: Attractors) -> xarray.Dataset:
    return basins_of_attraction(SYSTEM, theta=THETA, velocity=VELOCITY, found=found)


def test_labels_and_times_are_those_of_single_simulations(
    found: Attractors, picture: xarray.Dataset
) -> None:
    rng = np.random.default_rng(0)
    for i, j in zip(rng.integers(0, 11, 12), rng.integers(0, 13, 12), strict=True):
        path = strobes(SYSTEM, np.array([THETA[j], VELOCITY[i]]), 90)
        label = int(picture["label"].values[i, j])
        apart = np.abs(path[:, None] - found.of(label).states).max(axis=2).min(axis=1)
        assert apart[-1] < 1e-6
        assert int(picture["time"].values[i, j]) == np.flatnonzero(apart > 0.01)[-1] + 1


def test_the_shares_are_those_of_the_cells(picture: xarray.Dataset) -> None:
    for label in (1, 2):
        assert (
            float(picture["cells"].sel(attractor=label))
            == (picture["label"].values == label).mean()
        )
    assert picture.attrs["undecided"] == 0.0


def test_sampled_fractions_agree_with_the_area() -> None:
    sampled = find_attractors(SYSTEM, starts=256, window=((-2.0, 2.0), (-2.0, 2.0))).of(1)
    middles = -2.0 + 4.0 * (np.arange(60) + 0.5) / 60
    area = basins_of_attraction(SYSTEM, theta=middles, velocity=middles)["cells"].sel(attractor=1)
    assert abs(float(area) - sampled.fraction) < 3.0 * sampled.error


def test_an_attractor_that_was_not_known_gets_a_label_after_the_others(
    found: Attractors, picture: xarray.Dataset
) -> None:
    less = replace(found, members=found.members[1:])
    again = basins_of_attraction(SYSTEM, theta=THETA, velocity=VELOCITY, found=less)
    assert again["attractor"].values.tolist() == [2, 3]
    assert np.array_equal(again["label"].values == 2, picture["label"].values == 2)
    assert np.array_equal(again["label"].values == 3, picture["label"].values == 1)
    assert np.array_equal(again["time"].values, picture["time"].values)


def test_a_second_state_of_rest_has_a_label_of_its_own() -> None:
    """As models with several contacts may have several; the first one has the label of rest,
    whatever else is known.
    """
    (rest,) = (member for member in find_attractors(steady(-0.5), starts=8) if member.label == 0)
    assert [_relabelled([rest], known)[0].label for known in ([], [1, 2], [0], [0, 1])] == [
        0,
        0,
        1,
        2,
    ]


def test_a_cell_on_an_attractor_has_reached_it(found: Attractors) -> None:
    (theta, velocity) = found.of(1).states[0]
    here = basins_of_attraction(SYSTEM, theta=[theta], velocity=[velocity], found=found)
    assert int(here["label"][0, 0]) == 1
    assert float(here["time"][0, 0]) == 0.0


def test_blocks_with_plain_arguments_give_the_whole(
    found: Attractors, picture: xarray.Dataset
) -> None:
    plane = Grid(("theta", "velocity"), THETA, VELOCITY, {"theta": 0.0, "velocity": 0.0})
    arguments = json.loads(
        json.dumps(
            cell_arguments(SYSTEM, Labelling(SYSTEM, found.targets, 500, 1e-2, 1e-11), plane)
        )
    )
    for rows in (slice(0, 4), slice(4, 11)):
        block = cells(arguments, {"velocity": VELOCITY[rows].tolist(), "theta": THETA.tolist()})
        assert np.array_equal(block["label"], picture["label"].values[rows])
        assert np.array_equal(block["time"], picture["time"].values[rows])


def test_captured_cells_are_at_rest_at_a_time_of_their_own() -> None:
    picture = basins_of_attraction(forced(0.05), theta=[0.001, 0.5], velocity=[0.0, 0.3])
    assert int(picture["label"][0, 0]) == 0
    assert 0.0 <= float(picture["time"][0, 0]) < 200.0
    assert "rest" in picture["attractor_kind"].values


def test_too_few_periods_leave_cells_undecided_and_say_so(found: Attractors) -> None:
    picture = basins_of_attraction(
        SYSTEM, theta=THETA[:2], velocity=VELOCITY[:2], found=found, periods=32
    )
    assert (picture["label"].values == -1).all()
    assert np.isnan(picture["time"].values).all()
    assert picture.attrs["undecided"] == 1.0


@pytest.mark.thorough
def test_the_basins_of_mirrored_equilibria_are_mirror_images() -> None:
    theta, velocity = np.linspace(-2.0, 2.0, 21), np.linspace(-1.5, 1.5, 15)
    label = basins_of_attraction(steady(), theta=theta, velocity=velocity)["label"].values
    image = np.array([0, 2, 1])[label[::-1, ::-1]]
    assert np.array_equal(label, image)
    assert set(np.unique(label)) == {0, 1, 2}


def test_a_grid_of_its_own_keeps_to_the_side_of_the_wall() -> None:
    system = walled()
    picture = basins_of_attraction(
        system,
        found=find_attractors(system, starts=8, window=((0.5, 1.5), (-0.5, 0.5))),
        velocity=[0.0],
        x=None,
    )
    assert picture["x"].values.max() <= 1.0
    assert (picture["label"].values == 1).all()


@pytest.mark.thorough
def test_cells_of_a_chaotic_attractor_are_told_from_those_of_a_cycle() -> None:
    grid = np.linspace(-1.9, 1.9, 8)
    system = forced(3.0, 1.1)
    picture = basins_of_attraction(system, theta=grid, velocity=grid)
    assert picture["attractor_kind"].values.tolist() == ["periodic", "chaotic"]
    assert picture.attrs["undecided"] == 0.0
    for i, j in ((0, 0), (7, 0), (2, 5), (5, 6)):
        last = strobes(system, np.array([grid[j], grid[i]]), 120)
        repeats = np.abs(last[-1] - last[-2]).max() < 1e-6
        assert int(picture["label"][i, j]) == (1 if repeats else 2)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"theta": [1.0, 0.0]}, "that rise"),
        ({"x": [0.0]}, "no coordinate 'x'"),
        ({"periods": 3}, "periods"),
        ({"within": 0.0}, "within"),
        ({"velocity": [np.nan]}, "that rise"),
    ],
)
def test_senseless_grids_are_refused(arguments: dict, says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        basins_of_attraction(SYSTEM, **arguments)


def test_attractors_of_another_system_are_refused(found: Attractors) -> None:
    with pytest.raises(ParameterError, match="another system"):
        basins_of_attraction(forced(), theta=[0.0], velocity=[0.0], found=found)


def test_the_picture_shows_each_basin_in_its_own_lightness(picture: xarray.Dataset) -> None:
    figure = figure_of(draw_basins(picture, [np.array([[-2.0, 0.0], [2.0, 0.5]])]))
    (ax,) = figure.axes
    mesh = ax.collections[0]
    shown = np.unique(np.asarray(mesh.get_array()).ravel())
    greys = [
        float(np.dot(mpl.colors.to_rgb(mesh.cmap(int(n))), (0.2126, 0.7152, 0.0722))) for n in shown
    ]
    assert len(shown) == 2
    assert abs(greys[0] - greys[1]) > 0.3
    marks = [line for line in ax.lines if line.get_marker() in ("o", "s")]
    assert [(float(m.get_xdata()[0]), float(m.get_ydata()[0])) for m in marks] == [
        (float(picture["section_theta"][i, 0]), float(picture["section_velocity"][i, 0]))
        for i in range(2)
    ]
    assert "(rad)" in ax.get_xlabel()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [text.split(":")[0] for text in texts] == ["1", "2"]
