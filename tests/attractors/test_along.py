"""Attractors keep their identities along a parameter, and begin and end where the theory says."""

import numpy as np
import pytest
from attractor_cases import FOLDS, HELD, ONSET
from shared_systems import forced, walled

import saltus
from saltus.attractors.along_parameter import attractors_along, set_distance
from saltus.attractors.attractor import Target
from saltus.errors import ParameterError
from saltus.flow import Ending
from saltus.theory import wall_orbits


def test_births_and_deaths_bracket_the_folds_and_the_jump_changes_the_identity() -> None:
    found = attractors_along(forced(), "load.frequency", np.linspace(0.83, 0.93, 11), starts=32)
    events = list(zip(found["event_kind"].values, found["event_label"].values, strict=True))
    assert events == [("birth", 2), ("death", 1)]
    for fold, before, after in zip(
        FOLDS, found["event_before"].values, found["event_after"].values, strict=True
    ):
        assert before < fold < after
    lower = found["amplitude"].sel(attractor=2).values
    assert np.isfinite(lower).sum() == 9
    assert (np.diff(lower[np.isfinite(lower)]) < 0).all()
    assert (np.diff(found["amplitude"].sel(attractor=1).values[:8]) > 0).all()
    assert found["fraction"].sum("attractor").values == pytest.approx(1.0)


def test_rest_is_always_0_and_goes_with_the_load_that_releases_it() -> None:
    values = [ONSET - 2e-3, ONSET + 2e-3, 0.05, HELD - 2e-3, HELD + 2e-3]
    found = attractors_along(forced(), "load.horizontal.amplitude", values, starts=96)
    assert np.isfinite(found["fraction"].sel(attractor=0).values).tolist() == [
        True,
        True,
        True,
        True,
        False,
    ]
    assert found["kind"].sel(attractor=0).values.tolist() == ["rest"] * 4 + [""]
    motion = found["fraction"].sel(attractor=1).values
    assert np.isfinite(motion).tolist() == [False, True, True, True, True]
    assert (motion[1:] > 0.2).all()


def test_an_attractor_without_starts_of_its_own_is_carried_along() -> None:
    system = forced()
    values = [0.80, 0.83, 0.86, 0.88, 0.90]
    alone = attractors_along(system, "load.frequency", values, starts=1, seed=4)
    amplitude = alone["amplitude"].sel(attractor=1).values
    branch = saltus.continue_orbit(
        saltus.find_orbit(forced(W=0.8), theta=0.3), "load.frequency", (0.7, 0.92)
    )
    upper = [max(orbit.amplitude for orbit in branch.at(value) if orbit.stable) for value in values]
    # the large motion is followed past the birth of the small one
    assert amplitude == pytest.approx(upper, rel=1e-9)


def test_a_doubling_changes_the_period_where_the_closed_form_says_and_not_the_identity() -> None:
    system = walled(W=2.6, wall=0.3, e=0.5)
    family = wall_orbits(system, 2)
    doubling = family.amplitude(family.doubling_speed)
    values = doubling * np.array([0.99, 0.996, 1.004, 1.01])
    found = attractors_along(system, "load.force.amplitude", values, starts=48)
    assert found["event_kind"].size == 0
    assert found["period"].sel(attractor=1).values.tolist() == [1, 1, 1, 1]  # without impacts
    assert found["period"].sel(attractor=2).values.tolist() == [2, 2, 4, 4]


def test_mirror_images_are_not_exchanged() -> None:
    found = attractors_along(
        forced(0.2, V=-1.6), "load.horizontal.amplitude", np.linspace(0.2, 0.32, 4), starts=24
    )
    assert found["event_kind"].size == 0
    assert (found["largest_theta"].sel(attractor=1).values > 1.0).all()
    assert (found["smallest_theta"].sel(attractor=2).values < -1.0).all()


def test_the_distance_of_sets_is_hausdorffs_over_their_size() -> None:
    one = Target(1, Ending.PERIODIC, np.array([[0.0, 0.0], [2.0, 0.0]]))
    other = Target(1, Ending.PERIODIC, np.array([[0.0, 0.5], [2.0, 0.0], [4.0, 0.0]]))
    assert set_distance(one, other) == set_distance(other, one) == pytest.approx(2.0 / 4.0)
    nothing = Target(0, Ending.REST, np.zeros((1, 2)))
    assert set_distance(nothing, nothing) == 0.0


@pytest.mark.parametrize(
    ("path", "values", "says"),
    [
        ("load.frequenzy", [1.0], "load.frequency"),
        ("load", [1.0], "not a number"),
        ("load.frequency", [1.0, 0.9, 1.1], "increase"),
        ("load.frequency", [], "values"),
        ("load.frequency", [-1.0, 1.0], "load.frequency"),
    ],
)
def test_senseless_paths_and_values_are_refused(path: str, values: list[float], says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        attractors_along(forced(), path, values)
