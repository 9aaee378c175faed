"""Derivatives in lanes: those of the scalar kernel for every kind of load, and the law of their
determinant on many cases.

det d(end)/d(start) = product over impacts of (v+/v-)^2 . exp(-C [c T_lower / (1+m) + T_upper])
(numerics.md, section 5); for the wall the same with its one side, and for a block without damping
the product alone. Free volumes of two coordinates shrink by the integral of the divergence.
"""

import os

import numpy as np
import pytest
from lane_cases import FAMILIES, Cases

import saltus
from saltus.flow import stop_names

CASES = int(os.environ.get("SALTUS_CASES", "1500"))
pytestmark = pytest.mark.thorough  # a tangent of its own for each family
PATHS = {
    "paper": ("load.frequency", "load.horizontal.amplitude", "impact.e", "model.beta0"),
    "every_channel": ("model.mass_ratio", "load.horizontal.phase"),
    "wall": ("model.wall", "impact.e", "load.frequency"),
    "rocking": ("model.alpha", "load.frequency", "impact.e"),
    "records": ("load.horizontal.0.scale", "model.damping"),
    "energy_restitution": ("impact.r",),
}


@pytest.mark.parametrize("family", PATHS)
def test_derivatives_in_lanes_are_those_of_the_scalar_kernel(family):
    cases = FAMILIES[family](np.random.default_rng([9, *family.encode()]), 60)
    ensemble = cases.in_lanes(tol=1e-14, sensitivities=PATHS[family])
    compared, undefined, wrong = 0, 0, []
    for i in range(len(cases)):
        system, arguments = cases.one(i)
        try:
            result = saltus.sensitivities(
                system, parameters=PATHS[family], **arguments, tol=1e-14, dense=False
            )
        except (saltus.MotionError, saltus.ParameterError):
            continue
        expected, found = (
            np.hstack([result.state, result.parameters]),
            ensemble.derivative.values[i],
        )
        if result.motion.stop == "limit" or result.grazings.size:
            continue
        speeds = np.abs(result.motion.impacts.velocity_before)
        if speeds.size and result.motion.side != 0 and speeds.min() < 1e-3:
            continue  # near a grazing a derivative of the order 1/v magnifies the rounding
        undefined += bool(result.undefined)
        scale = np.maximum(np.nanmax(np.abs(expected), axis=0, initial=1e-300), 1.0)
        same = np.array_equal(np.isnan(found), np.isnan(expected))
        # second derivatives magnify the rounding of states by as much again
        error = np.nanmax(np.abs(found - expected) / scale, initial=0.0)
        if not same or error > 1e-9 * max(1.0, np.nanmax(np.abs(result.state), initial=0.0) / 100):
            wrong.append((i, error, int(ensemble.impact_count[i]), found, expected))
        compared += 1
    assert not wrong, wrong[:2]
    assert compared >= 20


def times_on_sides(motion):
    """The time spent on the lower (+1) and on the upper side (-1)."""
    spent = {1: 0.0, -1: 0.0, 0: 0.0}
    for side, length in zip(motion.dense.side, motion.dense.length, strict=True):
        spent[int(side)] += float(length)
    return spent


@pytest.mark.parametrize("family", ["paper", "every_channel", "wall", "rocking", "duffing"])
def test_the_determinant_obeys_its_law(family):
    """The lanes tell impacts and derivatives of many; the times on each side come from the scalar
    motion of some.
    """
    cases = FAMILIES[family](np.random.default_rng([10, *family.encode()]), CASES // 5)
    ensemble = cases.in_lanes(tol=1e-14, sensitivities=())
    found = np.linalg.det(np.nan_to_num(ensemble.derivative.values))
    size = np.abs(np.nan_to_num(ensemble.derivative.values)).max(axis=(1, 2))
    defined = np.isfinite(ensemble.derivative.values).all(axis=(1, 2))
    stops, used, wrong, kinds = stop_names(ensemble).values, 0, [], set()
    factor = cases.columns.get("impact.e", np.ones(len(cases)))
    equal_sides = family in ("wall", "rocking", "duffing", "paper")
    for i in range(len(cases)):
        if not defined[i] or stops[i] not in ("horizon", "rest"):
            continue
        if stops[i] == "rest":
            expected = 0.0
        else:
            damping = cases.columns["model.damping"][i] if "model.damping" in cases.columns else 0.0
            if equal_sides:
                moved = float(ensemble.time[i]) - cases.time[i]
                if held_within(cases, ensemble, i):
                    continue
                exponent = damping * moved
            else:
                motion = cases.alone(i, tol=1e-14, dense=True)
                spent = times_on_sides(motion)
                if spent[0] > 0:
                    continue
                c, m = (
                    cases.columns["model.dissipation_ratio"][i],
                    cases.columns["model.mass_ratio"][i],
                )
                exponent = damping * (c * spent[1] / (1 + m) + spent[-1])
            expected = factor[i] ** (2.0 * int(ensemble.impact_count[i])) * np.exp(-exponent)
        used += 1
        kinds.add((stops[i], min(int(ensemble.impact_count[i]), 3)))
        if abs(found[i] - expected) > 1e-10 * (1 + size[i] ** 2):
            wrong.append((i, found[i], expected, size[i], stops[i], int(ensemble.impact_count[i])))
    assert not wrong, f"{len(wrong)} of {used}: {wrong[:4]}"
    assert used >= 0.4 * len(cases)
    assert len(kinds) >= (1 if family == "duffing" else 4)


def held_within(cases, ensemble, i):
    """Whether the motion may have rested or lost its phase before the end: it starts at contact, or
    loses speed there.
    """
    if not cases.system.model.sides:
        return False
    motion = cases.alone(i, tol=1e-14, dense=False)
    return (
        len(motion.events.of(saltus.EventKind.REST)) > 0
        or len(motion.events.of(saltus.EventKind.CHATTER)) > 0
    )


def test_after_rest_there_is_no_derivative_to_the_start_left():
    cases = FAMILIES["paper"](np.random.default_rng(1), 400)
    ensemble = Cases(
        cases.system, cases.columns, cases.state, cases.velocity, cases.time, {"periods": 6.0}
    ).in_lanes(sensitivities=())
    resting = (
        (stop_names(ensemble).values == "rest")
        & (cases.columns["impact.e"] < 1)
        & (ensemble.impact_count.values > 0)
    )
    assert resting.sum() >= 5
    assert not ensemble.derivative.values[resting].any()
