"""The lanes agree with the scalar kernel on random cases of every kind of model, load and impact.

SALTUS_CASES=100000 runs so many cases in all (minutes); by default about 4000.

What may differ, and why. A motion magnifies its rounding. How much is measured, not assumed: every
number of a case is changed by 1e-7 of itself, and the end moves `amplification` times as far. Below
`CALM` -- away from chaos and grazing -- ends must agree to 1e-12 at tol 1e-14 and 1e-15 (else to
300 tol), and all that is counted exactly. Above, they must agree to 1e-12 times the amplification.
Where the change makes an impact appear or vanish, or where the motion touches the contact, rounding
decides what comes; only such cases may differ in what is counted, and they are rare. Besides, every
impact rounds speed and clock: 10^5 slow impacts without loss add up to a shift of the phase by 10^5
eps of the time since.
"""

import os

import numpy as np
import pytest
from lane_cases import FAMILIES, amplification, end_state, motion_state

import saltus
from saltus.flow import EventKind, stop_names

CASES = int(os.environ.get("SALTUS_CASES", "4000")) // len(FAMILIES)
BATCH = 250
CALM = 100.0
TOLERANCES = (1e-14, 1e-15, 1e-14, 1e-12, 1e-9)  # batch by batch, in turn


def counted_in_lanes(ensemble):
    held = ensemble.chatter_speed.values > 0
    return [
        *zip(
            stop_names(ensemble).values,
            ensemble.impact_count.values,
            ensemble.side.values,
            held,
            strict=True,
        )
    ]


def counted(motion):
    if isinstance(motion, str):
        return motion
    return motion.stop.value, len(motion.impacts), motion.side, motion.chatter_speed is not None


def elapsed(cases):
    """How long each case takes."""
    if "duration" in cases.span:
        return np.full(len(cases), cases.span["duration"])
    return cases.span["periods"] * 2 * np.pi / cases.columns["load.frequency"]


def compare(cases, tol, rng):
    """Differences in what is counted, and the numbers of calm and of doubtful cases."""
    ensemble = cases.in_lanes(tol=tol)
    magnified = amplification(cases, ensemble, tol, rng)
    found, state, wrong, calm, doubtful = (
        counted_in_lanes(ensemble),
        end_state(ensemble, cases.system),
        [],
        0,
        0,
    )
    each, rounding = max(1e-12, 300 * tol), 4 * np.spacing(1.0) * elapsed(cases)
    for i in range(len(cases)):
        motion = cases.alone(i, tol=tol)
        what = counted(motion)
        touched = not isinstance(motion, str) and len(motion.events.of(EventKind.GRAZING)) > 0
        if not np.isfinite(magnified[i]) or touched:
            doubtful += 1
        elif (found[i][0] if isinstance(motion, str) else found[i]) != what:
            wrong.append((i, found[i], what, magnified[i]))
        elif not isinstance(motion, str):
            calm += magnified[i] <= CALM
            here, there = state[i], motion_state(motion)
            error = np.abs(here - there).max() / max(1.0, np.abs(there).max())
            clock = abs(float(ensemble.time[i]) - motion.time) / max(1.0, abs(motion.time))
            allowed = (
                each * (1.0 if magnified[i] <= CALM else magnified[i])
                + len(motion.impacts) * rounding[i]
            )
            if not max(error, clock) <= allowed:
                wrong.append((i, error, clock, magnified[i]))
    return wrong, calm, doubtful


USUAL = ("paper", "constant_loads", "rocking", "wall")  # the others compile for themselves


@pytest.mark.parametrize(
    "family", [pytest.param(f, marks=[pytest.mark.thorough] * (f not in USUAL)) for f in FAMILIES]
)
def test_lanes_end_where_the_scalar_kernel_does(family):
    wrong, calm, doubtful, total = [], 0, 0, 0
    for batch in range(max(1, round(CASES / BATCH))):
        rng = np.random.default_rng([batch, *family.encode()])
        tol = TOLERANCES[batch % len(TOLERANCES)]
        cases = FAMILIES[family](rng, BATCH)
        differences, quiet, doubts = compare(cases, tol, rng)
        wrong += [(batch, tol, *difference) for difference in differences]
        calm, doubtful, total = calm + quiet, doubtful + doubts, total + BATCH
    print(f"{family}: {total} cases, {calm} calm, {doubtful} doubtful, wrong: {wrong}")
    assert not wrong, f"{len(wrong)} of {total}: {wrong[:5]}"
    assert doubtful <= 0.03 * total
    assert calm >= 0.3 * total


@pytest.mark.thorough
@pytest.mark.parametrize("family", FAMILIES)
def test_lanes_agree_with_themselves_at_another_tolerance(family):
    """Other steps, hence other roots and other polynomials: what goes wrong once in 10^5 impacts
    shows here.
    """
    rng = np.random.default_rng([99, *family.encode()])
    cases = FAMILIES[family](rng, 10_000 if "SALTUS_CASES" in os.environ else 2_000)
    one, other = cases.in_lanes(tol=1e-14), cases.in_lanes(tol=3e-15)
    magnified = amplification(cases, one, 1e-14, rng)
    state, again = end_state(one, cases.system), end_state(other, cases.system)
    error = np.abs(state - again).max(axis=1) / np.maximum(1.0, np.abs(again).max(axis=1))
    allowed = 5e-12 * magnified + one.impact_count.values * 8 * np.spacing(1.0) * elapsed(cases)
    ended = np.isin(stop_names(one).values, ["horizon", "rest", "limit"])  # not at a singularity
    calm = ended & np.isfinite(magnified) & (other.grazings.values == 0)
    # an accumulation of impacts is cut at a speed that follows the tolerance
    lossless = cases.columns.get("impact.e", np.zeros(len(cases))) == 1.0
    counts = lossless & (one.impact_count.values != other.impact_count.values)
    wrong = np.flatnonzero(calm & (counts | ~(error <= allowed)))
    assert not wrong.size, [
        (i, error[i], magnified[i], one.impact_count.values[i], other.impact_count.values[i])
        for i in wrong[:5]
    ]
    assert calm.mean() > 0.75


def test_no_flight_of_thousands_of_slow_ones_is_wrong():
    """Between slow impacts steps are much longer than flights: the guess of the root may go astray,
    the root may not.
    """
    n, rng = 50_000, np.random.default_rng(0)
    speed, begin = 10 ** rng.uniform(-4, -1, n), rng.uniform(0.0, 6.0, n)
    system = (
        FAMILIES["paper"](rng, 1)
        .one(0)[0]
        .with_({"impact.e": 1.0, "load.horizontal.amplitude": 0.05, "load.vertical": -0.5})
    )
    ends = [
        saltus.simulate_many(system, theta=0.0, velocity=speed, time=begin, duration=0.3, tol=tol)
        for tol in (1e-14, 1e-15)
    ]
    assert int(ends[0].impact_count.max()) > 50
    np.testing.assert_array_equal(ends[0].impact_count, ends[1].impact_count)
    np.testing.assert_allclose(ends[0].velocity, ends[1].velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(ends[0].theta, ends[1].theta, rtol=0, atol=1e-12)
