"""Results as a page gets them: their numbers are those of Python, and what is of another system is
refused.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
import results_of_all_kinds as made
from results_of_all_kinds import SYSTEM

import saltus
from saltus.web.results import digest, results_as_json


def shown(result, system=SYSTEM):
    """A result as it stands in a page, as JSON that knows no nan."""
    return json.loads(json.dumps(results_as_json([result], system), allow_nan=False))[0]


def plain(values):
    """Numbers as JSON has them, and None for nan."""
    return [
        None if np.isnan(value) else value for value in np.asarray(values, dtype=float).tolist()
    ]


def test_a_branch_has_its_orbits_their_stability_their_multipliers_and_its_special_points():
    branch, entry = made.branch(), shown(made.branch())
    (only,) = entry["branches"]
    assert (entry["kind"], entry["path"]) == ("diagram", made.FREQUENCY)
    assert only["parameter"] == branch.parameters.tolist()
    assert only["amplitude"] == branch.amplitudes.tolist()
    assert only["stable"] == branch.stable.astype(int).tolist()
    assert 0 < sum(only["stable"]) < len(only["stable"])
    for orbit, multipliers, evidence in zip(
        branch.orbits, only["multipliers"], only["evidence"], strict=True
    ):
        # rounding in the columns of the dataset, from which the orbits of a page are read
        np.testing.assert_allclose(
            [complex(*pair) for pair in multipliers], orbit.multipliers, rtol=1e-9, atol=1e-9
        )
        assert evidence.startswith("residual ")
    assert [(point["kind"], point["parameter"]) for point in entry["special"]] == [
        (str(point.kind), point.parameter) for point in branch.special
    ]
    assert {point["text"] for point in entry["special"]} >= {"fold"}
    assert entry["values"] == dict(SYSTEM.parameters)


def test_an_orbit_of_a_branch_starts_where_its_motion_comes_back():
    (only,) = shown(made.branch())["branches"]
    for i in range(0, len(only["parameter"]), 12):
        theta, velocity = only["start"][i]
        system = SYSTEM.with_({made.FREQUENCY: only["parameter"][i]})
        motion = saltus.simulate(
            system, theta=theta, velocity=velocity, time=only["time"][i], periods=only["period"][i]
        )
        np.testing.assert_allclose([motion.theta, motion.velocity], [theta, velocity], atol=1e-8)


@pytest.mark.parametrize(
    ("name", "path"), [("spectrum", made.FREQUENCY), ("diagram", made.AMPLITUDE)]
)
def test_a_diagram_has_all_its_branches_and_what_motions_were_seen(name, path):
    tree = getattr(made, name)()
    entry, branches = shown(tree), [branch for _, branch in saltus.branches_of(tree)]
    assert entry["path"] == path
    assert entry["bounds"] == list(tree.attrs["bounds"])
    assert len(entry["branches"]) == len(branches) > 1
    for one, branch in zip(entry["branches"], branches, strict=True):
        for column in ("parameter", "amplitude", "stable", "period"):
            assert one[column] == plain(branch[column].values)
    seen = tree["attractors"].dataset
    assert entry["dots"] == {
        column: plain(seen[column].values) for column in ("parameter", "amplitude")
    }
    assert len(entry["dots"]["parameter"]) > 5


def test_a_chart_starts_the_largest_motion_of_each_cell():
    data, entry = made.chart(), shown(made.chart())
    assert entry["paths"] == [made.AMPLITUDE, "load.vertical"]
    assert (entry["x"], entry["y"]) == (
        data["horizontal"].values.tolist(),
        data["vertical"].values.tolist(),
    )
    moving = 0
    for i, horizontal in enumerate(entry["x"]):
        for k, vertical in enumerate(entry["y"]):
            here = data.sel(horizontal=horizontal, vertical=vertical)
            assert entry["cells"][i][k] == plain([here["amplitude"]])[0]
            if entry["starts"][i][k] is None:
                continue
            moving += 1
            theta, velocity = entry["starts"][i][k]
            system = SYSTEM.with_({made.AMPLITUDE: horizontal, "load.vertical": vertical})
            swing = saltus.simulate_many(
                system, theta=theta, velocity=velocity, periods=12, sample=("extrema",), last=6
            )
            largest = max(
                float(swing["overall_largest_theta"]), -float(swing["overall_smallest_theta"])
            )
            assert largest == pytest.approx(entry["cells"][i][k], rel=1e-6)
    assert moving == sum(cell is not None for row in entry["cells"] for cell in row) > 3
    assert moving < 6


def test_basins_have_the_labels_of_their_cells_and_names_for_attractors():
    data, entry = made.basins(), shown(made.basins())
    assert entry["plane"] == ["theta", "theta_velocity"]
    assert (entry["x"], entry["y"]) == (
        data["theta"].values.tolist(),
        data["velocity"].values.tolist(),
    )
    labels = data["label"].transpose("theta", "velocity").values
    assert (np.array(entry["cells"]) + 1 == labels).all()
    assert len(set(labels.ravel().tolist())) > 1
    (boundary,) = entry["curves"]
    assert [point[0] for point in boundary["points"]] == plain(data["boundary_theta"].values)
    assert [point[1] for point in boundary["points"]] == plain(data["boundary_velocity"].values)
    assert len(boundary["points"]) > 100
    names = {each["label"] + 1: each["name"] for each in entry["attractors"]}
    for number, period, amplitude in zip(
        data["attractor"].values,
        data["attractor_period"].values,
        data["amplitude"].values,
        strict=True,
    ):
        assert names[int(number)] == f"period {int(period)}, amplitude {float(amplitude):.4g}"


def test_curves_of_the_phase_plane_have_all_their_points():
    for result, system in ((made.manifold(), SYSTEM), (made.separatrices()[0], made.RESTING)):
        data, entry = result.to_xarray(), shown(result, system)
        (curve,) = entry["curves"]
        assert entry["plane"] == ["theta", "theta_velocity"]
        assert curve["stable"] is True
        assert [point[0] for point in curve["points"]] == plain(data["theta"].values)
        assert [point[1] for point in curve["points"]] == plain(data["velocity"].values)
        assert len(curve["points"]) > 20


def test_branches_along_one_parameter_are_one_diagram_and_others_are_not():
    branch, damped = made.branch(), SYSTEM.with_({"model.damping": 0.2})
    other = saltus.continue_orbit(
        saltus.find_orbit(damped, theta=0.3), made.FREQUENCY, (0.89, 0.91)
    )
    entries = results_as_json([branch, other, branch, made.spectrum()], SYSTEM)
    assert [len(entry["branches"]) for entry in entries[:2]] == [2, 1]
    assert [entry["title"] for entry in entries] == ["Branch", "Branch", "Response spectrum"]
    assert len(entries[0]["special"]) == 2 * len(branch.special)
    assert entries[1]["values"]["model.damping"] == 0.2


def test_results_carry_the_digest_of_the_page_and_the_numbers_of_their_own_system():
    slower = SYSTEM.with_({made.FREQUENCY: 0.5, "model.damping": 0.3})
    entry = shown(made.branch(), slower)
    assert entry["digest"] == digest(slower) != digest(SYSTEM)
    assert entry["values"]["model.damping"] == 0.1


OTHERS = {
    "another load": saltus.System(
        model=SYSTEM.model,
        load=saltus.Load(frequency=0.9, ground_horizontal=saltus.Harmonic(0.5), vertical=-0.5),
    ),
    "another model": saltus.System(
        model=saltus.WallOscillator(damping=0.1),
        load=saltus.Load(frequency=0.9, force=saltus.Harmonic(0.5)),
    ),
    "another impact law": saltus.System(
        model=SYSTEM.model, load=SYSTEM.load, impact=saltus.InelasticImpact()
    ),
}


@pytest.mark.parametrize("system", OTHERS.values(), ids=OTHERS)
def test_a_result_of_another_system_is_refused_with_one_sentence(system):
    for result in (made.branch(), made.chart(), made.basins()):
        with pytest.raises(
            saltus.ParameterError,
            match=r"^the [a-z ]+ is of another system: its loads or impact law differ$",
        ):
            results_as_json([result], system)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            {"saltus_version": "0.1.0", "result_version": 1},
            r"it is by saltus 0\.1\.0, whose results are of version 1",
        ),
        ({"equations": "0" * 16}, "equations"),
        ({"system": "{"}, "does not say of which system it is; compute it again"),
        (
            {"kind": "ensemble"},
            "a page shows basins, bifurcation_diagram, .* not a result of the kind 'ensemble'",
        ),
    ],
)
def test_a_result_that_cannot_be_believed_is_refused_with_one_sentence(changed, said):
    data = made.branch().to_xarray().assign_attrs(changed)
    with pytest.raises(saltus.ParameterError, match=said):
        results_as_json([data], SYSTEM)
