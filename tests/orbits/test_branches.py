"""Branches: every point is a motion, branches do not depend on how they were walked, and they end
where they say.
"""

import functools
import math

import numpy as np
import pytest
from orbit_cases import FREQUENCY
from shared_systems import forced, hinged, walled

from saltus import ParameterError, continue_orbit, find_orbit, simulate
from saltus.continuation import CurveEnd, End

AMPLITUDE = "load.horizontal.amplitude"


@functools.cache
def start(path=FREQUENCY, theta=0.3, velocity=0.0, **numbers):
    """The orbit that a motion of the paper's system settles on."""
    return find_orbit(forced(**numbers), theta=theta, velocity=velocity, parameters=(path,))


@functools.cache
def branch(name):
    """The branches that the tests look at, each followed once."""
    if name == "impact oscillator":
        path = "load.force.amplitude"
        return continue_orbit(
            find_orbit(walled(A=0.5, W=1.0), x=0.2, parameters=(path,)), path, (0.02, 3.0)
        )
    if name == "a user's model":
        return continue_orbit(
            find_orbit(hinged(), x=1.2, parameters=(FREQUENCY,)), FREQUENCY, (0.3, 3.0)
        )
    orbit, path, bounds = {
        "Hhat 0.5": (lambda: start(), FREQUENCY, (0.15, 3.0)),
        "Hhat 1": (lambda: start(H=1.0, W=1.5), FREQUENCY, (0.25, 3.2)),
        "losses": (lambda: start(e=0.9), FREQUENCY, (0.2, 3.0)),
        "unequal layers": (lambda: start(k=1.1), FREQUENCY, (0.2, 3.0)),
        "unequal everything": (
            lambda: start(k=1.2, m=0.2, c=0.7, mean=0.1, e=0.9),
            FREQUENCY,
            (0.25, 3.0),
        ),
        "period 3": (lambda: start(H=1.0, W=2.4, theta=2.0), FREQUENCY, (1.0, 8.0)),
        "loop": (lambda: start(H=0.5, W=2.8, theta=3.0), FREQUENCY, (0.25, 30.0)),
        "onset": (lambda: start(AMPLITUDE, H=0.05), AMPLITUDE, (0.001, 0.085)),
        "one side": (lambda: start(AMPLITUDE, H=0.3, V=-1.6, theta=-1.2), AMPLITUDE, (0.01, 3.0)),
        "other side": (lambda: start(AMPLITUDE, H=0.3, V=-1.6, theta=1.2), AMPLITUDE, (0.01, 3.0)),
    }[name]
    return continue_orbit(orbit(), path, bounds)


NAMES = ("Hhat 0.5", "Hhat 1", "losses", "unequal layers", "unequal everything", ("period "
                                                                                 "3"), "loop", "onset", "one side",
         "impact oscillator", "a user's model")  # fmt: skip


def kinds(branch, *wanted):
    """Parameters of special points of the wanted kinds, in the order of the branch."""
    return [(s.kind, s.parameter) for s in branch.special if s.kind in wanted]


def parameter(branch, kind, near):
    """The parameter of the special point of a kind nearest to a value."""
    return min((s.parameter for s in branch.special if s.kind == kind), key=lambda p: abs(p - near))


# --- references --------------------------------------------------------------


def test_grazing_at_which_the_smoothed_problem_stops():
    (graze,) = (
        s for s in branch("Hhat 0.5").special if s.kind == "GR" and abs(s.parameter - 0.2846) < 1e-4
    )
    assert graze.parameter == pytest.approx(0.284630020, abs=5e-10)
    assert graze.amplitude == pytest.approx(1.05950014, abs=5e-9)
    counts = [
        o.signature.impact_count for o in branch("Hhat 0.5").orbits if 0.2840 < o.frequency < 0.2860
    ]
    assert set(counts) == {2, 6}
    # the fold just above it
    assert parameter(branch("Hhat 0.5"), "LP", 0.28465) == pytest.approx(0.28467, abs=2e-5)


@pytest.mark.parametrize(
    ("name", "folds"),
    [
        ("Hhat 0.5", [0.848485265597, 0.908810732539]),
        ("Hhat 1", [0.811772145949, 0.995113422444]),
        ("period 3", [2.1304272516, 2.3228679307, 3.0430772685, 3.0513452905, 3.1064546343]),
    ],
)
def test_folds_of_two_independent_codes(name, folds):
    for fold in folds:
        assert parameter(branch(name), "LP", fold) == pytest.approx(
            fold, abs=6e-11 if name == "period 3" else 1e-12
        )


def test_onset_in_the_amplitude_of_the_load():
    assert parameter(branch("onset"), "LP", 0.022) == pytest.approx(0.0219879514, abs=6e-11)


def test_grazing_of_the_period_3_family():
    assert parameter(branch("period 3"), "GR", 2.45) == pytest.approx(2.4548757753, abs=6e-11)


def test_detached_loop_closes():
    loop = branch("loop")
    assert loop.closed
    assert loop.points[0] is loop.points[-1]
    assert len(kinds(loop, "LP")) == 2
    assert all(o.period == 3 for o in loop.orbits)


def test_the_dataset_of_a_branch_says_what_its_margins_mean_and_simulation_agrees_with_their_signs():
    found = branch("Hhat 0.5")
    data = found.to_xarray()
    kinds = {"line_limit": "landmark", "kinematic_limit": "limit", "reaction": "assumption"}
    assert {name: data[f"margin_{name}"].attrs["margin_kind"] for name in kinds} == kinds
    for i in range(3, len(found.orbits), 20):
        violated = found.orbits[i].validity.first
        for name in kinds:
            least = float(data[f"margin_{name}"][i])
            assert abs(least) < 1e-6 or (violated[name] is not None) == (least < 0.0)


# --- every point of every branch ---------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_no_point_is_anything_but_a_motion(name):
    """Impacts in order and with a speed, the gap open between them."""
    for orbit in branch(name).orbits:
        assert orbit.slowest > -1e-9
        assert orbit.clearance > -1e-9
        times = np.append(orbit.impact_times, orbit.impact_times[:1] + orbit.duration)
        assert (np.diff(times) > -1e-9).all()
        assert orbit.residual < 4e-12 * orbit.period
        assert orbit.admissible


@pytest.mark.parametrize("name", NAMES)
def test_every_point_is_periodic_under_the_event_driven_flow(name):
    """With the impacts that it says; a point at a grazing only to the square root of rounding."""
    for orbit in branch(name).orbits:
        graze = min(abs(orbit.slowest), abs(orbit.clearance)) < 1e-9
        growth = max(1.0, abs(orbit.multipliers[0]) if np.isfinite(orbit.multipliers[0]) else 1.0)
        assert orbit.defect < (1e-4 if graze else 1e-11 * growth / min(1.0, orbit.slowest))


@pytest.mark.parametrize("name", NAMES)
def test_stable_points_stay_under_simulation_for_twenty_periods(name):
    """Also from a little beside them; the event-driven flow knows nothing of the equations."""
    points = [
        o for o in branch(name).orbits if o.stable and min(abs(o.slowest), abs(o.clearance)) > 1e-6
    ]
    for orbit in points[:: max(1, len(points) // 12)]:
        begin = orbit.start()
        motion = simulate(orbit.system, **begin, periods=20 * orbit.period, tol=1e-13, dense=False)
        first = orbit.system.model.coordinates[0]
        position = abs(float(motion.position) - begin[first])
        speeds = (
            [abs(begin["velocity"]), orbit.speeds[0]]
            if orbit.signature.impact_count
            else [abs(begin["velocity"])]
        )
        assert position < 1e-8
        assert min(abs(abs(motion.velocity) - v) for v in speeds) < 1e-8


@pytest.mark.parametrize("name", NAMES)
def test_multipliers_on_branches_obey_the_determinant_law(name):
    for orbit in branch(name).orbits[::7]:
        model, e = orbit.system.model, orbit.system.impact.e
        if (
            not np.isfinite(orbit.multipliers).all()
            or min(orbit.slowest, abs(orbit.clearance)) < 1e-6
        ):
            continue
        spent = {1: 0.0, -1: 0.0}
        if name in ("impact oscillator", "a user's model"):
            rate = model.damping * orbit.duration
        else:
            ends = np.append(orbit.impact_times, orbit.impact_times[:1] + orbit.duration)
            for side, duration in zip(-orbit.sides, np.diff(ends), strict=True):
                spent[int(side)] += duration
            if not len(orbit.sides):
                spent[orbit.signature.side] = orbit.duration
            rate = model.damping * (
                model.dissipation_ratio * spent[1] / (1 + model.mass_ratio) + spent[-1]
            )
        expected = e ** (2 * len(orbit.speeds)) * math.exp(-rate)
        size = max(1.0, abs(orbit.multipliers[0])) ** 2
        assert abs(np.prod(orbit.multipliers) - expected) < 1e-8 * expected + 1e-13 * size


@pytest.mark.parametrize("name", NAMES)
def test_neighbouring_points_are_near_each_other(name):
    """No jump to another branch: the amplitude is continuous, through grazings too."""
    found = branch(name)
    span = np.ptp(found.parameters)
    for a, b in zip(found.orbits, found.orbits[1:], strict=False):
        assert abs(a.amplitude - b.amplitude) < 0.3
        assert abs(a.system.get(found.path) - b.system.get(found.path)) < 0.12 * span + 1e-12


# --- special points ----------------------------------------------------------


def expected_multiplier(special):
    """+1 at a fold and where branches cross, -1 where a period doubles."""
    return -1.0 if special.kind == "PD" else 1.0


@pytest.mark.parametrize("name", NAMES)
def test_special_points_have_the_multiplier_that_makes_them_special(name):
    for special in branch(name).special:
        if special.kind in ("LP", "PD", "BPC"):
            distance = np.abs(special.orbit.multipliers - expected_multiplier(special)).min()
            assert distance < 1e-6, special
        # excluded where the multipliers' product is below 1 (errata 22)
        assert special.kind != "NS"
        if special.kind == "PD":
            assert not special.orbit.symmetric
            assert (special.orbit.multipliers.imag == 0.0).all()
        if special.kind == "GR":
            assert min(abs(special.orbit.slowest), abs(special.orbit.clearance)) < 1e-12
        if special.kind in special.orbit.margins:
            assert special.orbit.margins[special.kind] == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_special_points_carry_their_evidence(name):
    for special in branch(name).special:
        assert special.evidence.before * special.evidence.after <= 0.0
        assert (
            abs(special.evidence.value)
            <= min(abs(special.evidence.before), abs(special.evidence.after)) + 1e-15
        )
        assert special.evidence.bracket < 1e-10
        assert special.evidence.residual < 3e-12


@pytest.mark.parametrize("name", NAMES)
def test_stability_changes_only_at_special_points(name):
    """Between two points of one stability and two of the other lies an LP, PD, BPC or GR: none is
    missed.
    """
    found = branch(name)
    order = found.parameters
    special = np.array([s.parameter for s in found.special if s.kind in ("LP", "PD", "BPC", "GR")])
    for i in np.flatnonzero(np.diff(found.stable.astype(int))):
        low, high = sorted((order[i], order[i + 1]))
        margin = np.ptp(order[max(0, i - 1) : i + 3]) + 1e-9  # a fold lies beyond both
        assert ((special > low - margin) & (special < high + margin)).any(), (low, high)


@pytest.mark.parametrize("name", NAMES)
def test_the_parameter_turns_only_at_folds_and_grazings(name):
    found = branch(name)
    turns = np.flatnonzero(
        np.diff(np.sign(np.diff(found.parameters)[np.diff(found.parameters) != 0.0]))
    )
    assert len(turns) <= len(kinds(found, "LP", "GR"))


@pytest.mark.parametrize("step", [pytest.param(0.02, marks=pytest.mark.thorough), 0.3])
@pytest.mark.parametrize("name", ["Hhat 0.5", "unequal layers", "impact oscillator"])
def test_special_points_do_not_depend_on_the_step(name, step):
    found = branch(name)
    other = continue_orbit(
        found.orbits[len(found.orbits) // 2],
        found.path,
        (found.parameters.min(), found.parameters.max()),
        step=step,
    )
    wanted = ("LP", "PD", "BPC", "GR")
    one, two = sorted(kinds(found, *wanted)), sorted(kinds(other, *wanted))
    assert [k for k, _ in one] == [k for k, _ in two]
    assert np.abs(np.array([p for _, p in one]) - np.array([p for _, p in two])).max() < 1e-10


@pytest.mark.parametrize("W", [0.5, 2.5])
def test_branch_does_not_depend_on_the_orbit_it_is_followed_from(W):
    found, other = branch("Hhat 0.5"), continue_orbit(start(W=W), FREQUENCY, (0.15, 3.0))
    wanted = ("LP", "BPC", "GR", "line_limit", "reaction")
    assert [k for k, _ in kinds(found, *wanted)] == [k for k, _ in kinds(other, *wanted)]
    differences = np.array([p for _, p in kinds(found, *wanted)]) - np.array(
        [p for _, p in kinds(other, *wanted)]
    )
    assert np.abs(differences).max() < 1e-10
    assert found.ends == other.ends


@pytest.mark.parametrize("W", [0.2, 0.7, 0.88, 2.0])
def test_branches_along_two_parameters_meet_in_the_same_orbits(W):
    """Along the frequency at Hhat = 0.5, and along Hhat at that frequency: the orbits of the first
    are also on the second.
    """
    along_frequency = [o for o in branch("Hhat 0.5").at(W) if o.stable]
    assert along_frequency
    for orbit in along_frequency:
        position, velocity = orbit.state
        again = find_orbit(
            forced(W=W),
            parameters=(AMPLITUDE,),
            theta=position,
            velocity=velocity,
            settle=0,
            period=1,
        )
        across = continue_orbit(again, AMPLITUDE, (0.4, 0.6))
        assert (
            min(
                abs(o.amplitude - orbit.amplitude) + abs(o.state[0] - position)
                for o in across.at(0.5)
            )
            < 1e-9
        )


def test_orbits_at_a_value_are_solved_there():
    found = branch("Hhat 0.5")
    orbits = found.at(0.88)
    assert len(orbits) == 3  # between the folds
    assert [o.stable for o in orbits].count(False) == 1
    for orbit in orbits:
        assert orbit.frequency == 0.88
        assert orbit.defect < 1e-11 * max(1.0, abs(orbit.multipliers[0]))
    assert found.at(5.0) == []


def test_unstable_orbits_are_found_from_beside_them_without_settling():
    (orbit,) = (o for o in branch("Hhat 0.5").at(0.88) if not o.stable)
    position, velocity = orbit.state
    beside = {"theta": position + 1e-3, "velocity": velocity - 1e-3}
    again = find_orbit(forced(W=0.88), parameters=(FREQUENCY,), **beside, settle=0, period=1)
    assert not again.stable
    assert again.amplitude == pytest.approx(orbit.amplitude, abs=1e-11)
    settled = find_orbit(forced(W=0.88), parameters=(FREQUENCY,), **beside)
    assert settled.stable
    assert abs(settled.amplitude - orbit.amplitude) > 0.05


def test_mirror_images_have_mirrored_branches():
    one, other = branch("one side"), branch("other side")
    assert [k for k, _ in kinds(one, "LP", "PD", "GR")] == [
        k for k, _ in kinds(other, "LP", "PD", "GR")
    ]
    for a, b in zip(one.special, other.special, strict=True):
        assert a.parameter == pytest.approx(b.parameter, abs=1e-10)
        assert a.orbit.highest == pytest.approx(-b.orbit.lowest, abs=1e-9)


# --- nearly symmetric systems ------------------------------------------------


@pytest.mark.parametrize("excess", [1e-7, 1e-5, 1e-3])
def test_systems_that_are_almost_symmetric(excess):
    """The two mirror pairs of impacts appear one after the other, at grazings as near to each other
    as the stiffness is to 1.
    """
    found = continue_orbit(start(k=1.0 + excess, W=0.3), FREQUENCY, (0.2845, 0.31))
    assert [str(end) for end in found.ends] == ["bound 0.2845", "bound 0.31"]
    assert parameter(found, "LP", 0.284668) == pytest.approx(0.284668455747, abs=2 * excess)
    near = [p for _, p in kinds(found, "GR") if abs(p - 0.28463) < 10 * excess]
    assert len(near) == 2
    for special in found.special:
        if special.kind in ("LP", "PD", "BPC"):
            assert np.abs(special.orbit.multipliers - expected_multiplier(special)).min() < 1e-6, (
                special
            )
        assert special.evidence.bracket < 1e-10
    assert all(o.admissible for o in found.orbits)


def test_symmetric_but_for_rounding():
    """The second grazing lies within rounding of the first: the branch may end there, but with a
    reason and nothing false.
    """
    found = continue_orbit(start(k=1.0 + 1e-9, W=0.3), FREQUENCY, (0.2845, 0.31))
    assert all(o.admissible for o in found.orbits)
    assert not found.closed
    assert found.ends[1] == End(CurveEnd.BOUND, 0.31)
    assert {s.kind for s in found.special} <= {"GR", "LP", "PD"}


# --- what is asked -----------------------------------------------------------


def test_functions_of_the_user_are_special_points_too():
    found = continue_orbit(
        start(), FREQUENCY, (0.6, 2.0), functions={"small": lambda orbit: orbit.amplitude - 0.8}
    )
    names = kinds(found, "small")
    assert len(names) == np.count_nonzero(np.diff(np.sign(found.amplitudes - 0.8)))
    for special in found.special:
        if special.kind == "small":
            assert special.amplitude == pytest.approx(0.8, abs=1e-12)


def test_bounds_end_a_branch_exactly_on_them():
    found = continue_orbit(start(), FREQUENCY, (0.95, 1.4))
    assert found.parameters[0] == 0.95
    assert found.parameters[-1] == 1.4
    assert found.ends == (End(CurveEnd.BOUND, 0.95), End(CurveEnd.BOUND, 1.4))


def test_a_start_on_a_bound_is_followed_the_other_way():
    found = continue_orbit(start(), FREQUENCY, (1.0, 1.4))
    assert found.parameters[0] == 1.0
    assert found.parameters[-1] == 1.4


def test_progress_hears_of_every_step():
    heard = []
    found = continue_orbit(
        start(), FREQUENCY, (0.95, 1.4), progress=lambda *told: heard.append(told)
    )
    fractions, steps = zip(*heard, strict=True)
    assert list(fractions) == sorted(fractions)
    assert fractions[-1] == 1.0
    assert len(heard) >= len(found.points) - len(found.special) - 1
    assert set(steps) <= {f"{FREQUENCY} = {value:.6g}" for value in found.parameters}


@pytest.mark.parametrize(
    ("path", "bounds", "sentence"),
    [
        ("load.frequenzy", (0.2, 3.0), "frequency"),
        ("model", (0.2, 3.0), "not a number"),
        ("", (0.2, 3.0), "path|parameter"),
        (FREQUENCY, (2.0, 3.0), "widen the range"),
        (FREQUENCY, (3.0, 0.2), "smaller one first"),
        (FREQUENCY, (1.0, 1.0), "smaller one first"),
        (FREQUENCY, (0.2, math.inf), "two numbers"),
        (FREQUENCY, (math.nan, 3.0), "two numbers"),
        (FREQUENCY, (0.2,), "two numbers"),
        (FREQUENCY, 3.0, "two numbers"),
        (FREQUENCY, ("a", "b"), "two numbers"),
        (FREQUENCY, (-1.0, 3.0), "frequency|positive|above 0"),
        ("model.beta0", (0.1, 4.0), "beta0"),
        ("impact.e", (0.5, 1.5), "e must|VelocityReduction"),
    ],
)
def test_what_cannot_be_followed_is_refused_in_a_sentence(path, bounds, sentence):
    with pytest.raises(ParameterError, match=sentence) as refusal:
        continue_orbit(start(), path, bounds)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 400
