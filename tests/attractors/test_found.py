"""The set of attractors: complete between known borders, certified, told from their mirror images,
with honest shares.
"""

import math

import numpy as np
import pytest
from attractor_cases import FOLDS, HELD, ONSET, strobes
from shared_systems import forced, steady, walled

import saltus
from saltus.attractors.attractor import Target
from saltus.attractors.attractor_search import find_attractors
from saltus.errors import ParameterError
from saltus.theory import equilibria


@pytest.fixture(scope="module")
def branch() -> saltus.Branch:
    """The period-1 motions at H = 0.5, which coexist between the folds."""
    return saltus.continue_orbit(
        saltus.find_orbit(forced(), theta=0.3), "load.frequency", (0.8, 1.0)
    )


def test_the_attractors_between_two_folds_are_the_stable_orbits_of_the_branch(
    branch: saltus.Branch,
) -> None:
    found = find_attractors(forced(W=0.88), starts=64)
    expected = sorted(orbit.amplitude for orbit in branch.at(0.88) if orbit.stable)
    assert len(expected) == 2
    assert [member.amplitude for member in found] == pytest.approx(expected, rel=1e-9)
    assert [member.label for member in found] == [1, 2]
    assert sum(member.starts for member in found) == 64
    assert found.undecided == 0


@pytest.mark.parametrize(
    ("W", "count"),
    [(FOLDS[0] - 0.004, 1), (FOLDS[0] + 0.004, 2), (FOLDS[1] - 0.004, 2), (FOLDS[1] + 0.004, 1)],
)
def test_their_number_changes_at_the_folds(W: float, count: int) -> None:
    assert len(find_attractors(forced(W=W), starts=48)) == count


@pytest.mark.parametrize(
    ("H", "kinds"),
    [(ONSET - 5e-4, ["rest"]), (ONSET + 5e-4, ["rest", "periodic"]), (HELD + 2e-3, ["periodic"])],
)
def test_rest_and_motion_coexist_from_the_onset_to_the_load_that_releases(
    H: float, kinds: list[str]
) -> None:
    found = find_attractors(forced(H), starts=96)
    assert [str(member.kind) for member in found] == kinds
    assert found.undecided == 0
    if kinds[0] == "rest":
        assert found.of(0).amplitude == 0.0


def test_each_start_ends_where_a_scalar_simulation_says() -> None:
    system = forced(W=0.88)
    found = find_attractors(system, starts=12, seed=3)
    for state, label in zip(found.states, found.assigned, strict=True):
        last = strobes(system, state, 80)[-1]
        assert found.of(label).target.distance(last) < 1e-6


def test_mirror_images_are_two_attractors_even_where_no_start_leads_to_one() -> None:
    system = forced(0.3, V=-1.6)
    found = find_attractors(system, starts=64)
    assert [(member.label, member.mirror) for member in found] == [(1, 2), (2, 1)]
    one, other = found
    assert (one.highest, one.lowest) == pytest.approx((-other.lowest, -other.highest), rel=1e-9)
    assert one.highest > other.highest
    alone = find_attractors(system, starts=1, seed=5)
    assert sorted(member.starts for member in alone) == [0, 1]


def test_a_symmetric_cycle_is_its_own_mirror_image() -> None:
    found = find_attractors(forced(1.0, 2.4), starts=48)
    assert [(member.label, member.period, member.mirror) for member in found] == [
        (1, 1, 1),
        (2, 3, 2),
        (3, 3, 3),
    ]
    assert all(len(member.states) == member.period for member in found)


def test_labels_do_not_depend_on_the_sample() -> None:
    one, other = (
        find_attractors(forced(1.0, 2.4), starts=n, seed=seed) for n, seed in ((40, 1), (56, 9))
    )
    assert [m.amplitude for m in one] == pytest.approx([m.amplitude for m in other], rel=1e-9)


def test_under_a_constant_load_they_are_rest_and_the_stable_equilibria() -> None:
    found = find_attractors(steady(), starts=48)
    stable = sorted(e.theta for e in equilibria(steady()) if e.stability.value == "stable")
    assert sorted(float(member.states[0, 0]) for member in found) == pytest.approx(stable, abs=1e-9)
    assert str(found.of(0).kind) == "rest"
    assert [found.of(label).mirror for label in (1, 2)] == [2, 1]


def test_an_oscillator_that_never_reaches_its_wall_has_one_attractor_and_its_closed_form() -> None:
    found = find_attractors(walled(), starts=32, window=((-1.0, 3.0), (-2.0, 2.0)))
    (member,) = found
    assert member.amplitude == pytest.approx(0.2 / abs(1.0 - 1.3**2 + 0.13j), rel=1e-10)
    assert float(found.to_xarray()["multiplier"][0]) == pytest.approx(
        math.exp(-0.1 * math.pi / 1.3), rel=1e-9
    )
    assert member.mirror == -1


def test_with_losses_an_orbit_may_rest_and_be_an_attractor() -> None:
    found = find_attractors(forced(0.15, 0.2, e=0.3), starts=32)
    (member,) = found
    assert member.orbit.rest_share > 0.0
    assert member.starts == 32


def test_known_stable_orbits_count_and_repelling_ones_do_not(branch: saltus.Branch) -> None:
    system = forced(W=0.88)
    found = find_attractors(system, starts=1, known=branch)
    assert [member.amplitude for member in found] == pytest.approx(
        sorted(orbit.amplitude for orbit in branch.at(0.88) if orbit.stable), rel=1e-9
    )
    assert sorted(member.starts for member in found) == [0, 1]


def test_further_starts_find_but_do_not_count() -> None:
    system = forced(W=0.88)
    whole = find_attractors(system, starts=32)
    found = find_attractors(
        system, starts=1, also=np.concatenate([member.states for member in whole])
    )
    assert len(found) == 2
    assert sum(member.starts for member in found) == 1


def test_the_error_of_a_share_is_binomial_and_covers_the_truth() -> None:
    shares, system = [], forced(W=0.88)
    for seed in range(4):
        found = find_attractors(system, starts=64, seed=seed)
        p, n = found.of(1).fraction, 64
        assert found.of(1).error == pytest.approx(math.sqrt(p * (1 - p) / n), rel=1e-12)
        shares.append(p)
    many = find_attractors(system, starts=1024, seed=7).of(1)
    assert np.abs(np.array(shares) - many.fraction).max() < 3.0 * math.hypot(0.5 / 8.0, many.error)


def test_the_dataset_says_what_was_found_and_how() -> None:
    found = find_attractors(forced(0.05), starts=40)
    data = found.to_xarray()
    assert data["attractor"].values.tolist() == [0, 1]
    assert data["attractor_kind"].values.tolist() == ["rest", "periodic"]
    assert float(data["fraction"].sum()) == pytest.approx(1.0)
    assert (data["end"].values == found.assigned).all()
    assert saltus.System.from_json(data.attrs["system"]) == forced(0.05)
    assert "captured" in str(data["evidence"].values[0])
    assert "residual" in str(data["evidence"].values[1])


def test_a_sampled_set_knows_its_points_from_others() -> None:
    points = np.random.default_rng(0).random((2000, 2))
    target = Target(1, "chaotic", points)
    assert target.distance(points[:10]).max() == 0.0
    assert np.median(target.distance(np.random.default_rng(1).random((500, 2)))) < target.grain
    assert target.distance(np.array([3.0, 0.5])) > 1.9 > target.grain
    assert target.distance(np.array([np.nan, 0.0])) == np.inf
    again = Target.from_dict(target.to_dict())
    assert np.array_equal(again.states, points)
    assert (again.label, str(again.kind)) == (1, "chaotic")


@pytest.mark.thorough
def test_without_losses_nothing_attracts() -> None:
    found = find_attractors(forced(0.05, C=0.0), starts=2)
    assert len(found) == 0
    assert found.undecided == 2
    assert any("areas do not shrink" in reason for reason in found.reasons)


@pytest.mark.thorough
def test_chaos_and_a_periodic_motion_coexist() -> None:
    found = find_attractors(forced(3.0, 1.1), starts=64)
    assert [str(member.kind) for member in found] == ["periodic", "chaotic"]
    assert found.undecided == 0
    assert found.of(2).amplitude > 4.0
    assert "exponent" in found.of(2).evidence


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: find_attractors(forced(), window=(1.0, 0.0)), "window must be"),
        (lambda: find_attractors(forced(), starts=0), "starts"),
        (lambda: find_attractors(forced(), max_period=40), "max_period"),
        (lambda: find_attractors(forced(), also=[[1.0, np.inf]]), "also"),
        (lambda: find_attractors(forced(), known=[3]), "known must be"),
        (lambda: find_attractors("loaded"), "System"),
        (
            lambda: find_attractors(
                saltus.System(model=saltus.TwoLayer(beta0=1.4)), window=((-1.0, 1.0), (-1.0, 1.0))
            ),
            "4 pairs",
        ),
        (
            lambda: find_attractors(
                forced().with_({"load.horizontal": saltus.Record([0.0, 1.0], [0.0, 1.0])})
            ),
            "does not repeat",
        ),
    ],
)
def test_senseless_questions_are_refused(call, says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        call()


def test_an_orbit_of_another_system_is_refused(branch: saltus.Branch) -> None:
    with pytest.raises(ParameterError, match=r"differs in load\.frequency"):
        find_attractors(forced(W=0.5), known=branch.orbits[0])
