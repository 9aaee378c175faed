"""Features of a diagram are counted as defined, on diagrams made by hand."""

import numpy as np
import pytest
from spectrum_cases import branch, diagram, folded, loop

from saltus import branch_of
from saltus_paper.measures import spectrum_features as features


def test_the_main_branch_is_the_longest_one_of_period_one():
    long = branch([0, 30], [1, 1], [1, 1], periods=3)
    data = diagram(long, folded(), branch([1, 2], [1, 1], [1, 1]))
    assert features.main_branch(data).equals(branch_of(data, 1))


@pytest.mark.parametrize(
    ("changes", "number"),
    [
        ({}, 1),
        ({"ends": ("bound", "bound")}, 1),
        ({"ends": ("born", "closed")}, 0),
        ({"origin": "PD at 1"}, 0),
        ({"parameter": [4, 5]}, 0),
    ],
)
def test_a_family_is_detached_if_no_bifurcation_ties_it_and_it_reaches_into_the_range(
    changes, number
):
    parts = {
        "parameter": [1, 2],
        "amplitude": [3, 3],
        "stable": [1, 1],
        "periods": 3,
        "ends": ("closed", "closed"),
    }
    assert len(features.detached(diagram(folded(), branch(**{**parts, **changes})))) == number


def test_superharmonic_peaks_are_those_below_two_thirds_of_the_highest_one():
    x = np.linspace(0.1, 3, 600)
    y = (
        3 * np.exp(-(((x - 0.9) / 0.1) ** 2))
        + np.exp(-(((x - 0.3) / 0.02) ** 2))
        + np.exp(-(((x - 2) / 0.1) ** 2))
    )
    y += 0.005 * np.sin(60 * x)  # ripples are none
    data = branch(x, y, np.ones(600))
    assert features.peaks(data)[:, 0] == pytest.approx([0.3, 0.9, 2.0], abs=0.01)
    assert features.superharmonic(data)[:, 0] == pytest.approx([0.3], abs=0.01)
    assert features.superharmonic(data, share=0.5).size == 0


def test_coexisting_stable_motions_are_counted_through_folds_and_loops():
    values = np.array([0.6, 1.2, 1.78, 1.995, 2.2])
    # both arms and the loop
    assert features.stable_motions(diagram(folded(), loop()), values).tolist() == [1, 2, 3, 3, 1]
    assert features.amplitudes_at(folded(), 1.78).size == 3


def test_amplitudes_are_read_off_up_to_the_special_point_where_the_stability_ends():
    data = branch([0, 1, 2, 3], [1, 1, 1, 1], [1, 1, 1, 0], special=[("PD", 2.9, 1.0)])
    sizes = [features.amplitudes_at(data, value, stable=True).size for value in (0.5, 2.85, 2.95)]
    assert sizes == [1, 1, 0]
    assert features.amplitudes_at(branch([0, 1, 2], [0, 1, 2], [1, 1, 1]), 1.25) == pytest.approx(
        [1.25]
    )


def test_the_first_fold_is_the_one_of_least_parameter():
    assert features.first_fold(folded()) == (1.5, 1.1)
    assert np.isnan(features.first_fold(branch([0, 1], [1, 1], [1, 1]))).all()


def test_motions_jump_at_the_folds_where_the_stability_changes():
    assert sorted(features.turning(folded())) == [1.5, 2.0]
    same = branch([0, 1, 2, 1, 0], [1, 2, 3, 4, 5], [0] * 5, special=[("LP", 2.0, 3.0)])
    assert features.turning(same).size == 0


def test_special_points_are_counted_within_the_range():
    data = diagram(
        folded(), branch([0, 1], [1, 1], [1, 1], special=[("LP", 7.0, 1.0), ("GR", 1.0, 1.0)])
    )
    assert [features.count(data, kind) for kind in ("LP", "GR", "PD")] == [2, 1, 0]
