"""`saltus prove` and [prove] of a study: theorems in words, their file, and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import saltus
from saltus.studies import prove_orbit_of

TABLE = """
[model]
type = "WallOscillator"
stiffness = 0.0
damping = 0.0
wall = 0.0
[load]
frequency = 1.0
force = 1.0
ground = { amplitude = 1.2 }
[impact]
type = "VelocityReduction"
e = 0.5
[prove]
x = -1.0
velocity = -3.0
"""
ALONG = """path = "load.ground.amplitude"
bounds = [1.0, 1.25]
step = 1.0
order = 24
most_boxes = 3
"""


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    from typer.testing import CliRunner

    from saltus.cli.app import app

    def command(text: str, *more: str) -> str:
        study = tmp_path / "table.toml"
        study.write_text(text)
        result = CliRunner().invoke(app, ["prove", str(study), "-o", str(tmp_path / "out"), *more])
        return result.output

    return command


def test_the_command_prints_the_theorem_and_writes_it(run, tmp_path: Path) -> None:
    """The closed form of the speed, 2 pi / (1 + e), lies in what is printed and in the file."""
    told = run(TABLE)
    assert "It is asymptotically stable" in told
    assert "4.18879020478639" in told
    data = saltus.load(tmp_path / "out" / "prove.nc")
    off = abs(float(data.enclosed_speed[0]) - 4.0 * np.pi / 3.0)
    assert off <= float(data.enclosed_speed_radius[0]) + 1e-15
    assert data.attrs["statement"] in told
    assert (tmp_path / "out" / "prove.png").is_file()


def test_a_branch_is_written_with_columns_and_read_back(run, tmp_path: Path) -> None:
    """Three boxes do not reach the end: some points are proved, the fold is at pi / 3."""
    told = run(TABLE + ALONG)
    assert "a simple quadratic fold (LP)" in told
    assert "3 boxes were used up" in told
    data = saltus.load(tmp_path / "out" / "prove.nc")
    assert 0 < int(data.proved.sum()) < data.sizes["point"]
    fold = int(np.flatnonzero(data.kind.values == "LP")[0])
    assert int(data.special_proved[fold]) == 1
    off = abs(float(data.special_enclosure[fold]) - np.pi / 3)
    assert off <= float(data.special_radius[fold]) + 2e-16
    assert len(saltus.orbits.orbits_of(data)) == data.sizes["point"]
    labels = [text.get_text() for text in saltus.plot(data).figure.legends[0].get_texts()]
    assert {"proved", "not proved"} <= set(labels)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('path = "load.ground.amplitude"', "path and bounds belong together"),
        ("most_boxes = -1", "most_boxes"),
        ('radii = { "model.wal" = 1e-6 }', "is not a number of the system"),
        ("radii = 1e-6", "table of numbers"),
        ('radii = { "model.wall" = "wide" }', "model.wall"),
        ("thet = 0.3", "unknown key prove.thet"),
    ],
)
def test_bad_keys_are_one_sentence(run, more: str, message: str) -> None:
    assert message in " ".join(run(TABLE + more).split())


def test_a_study_without_prove_says_what_to_add(run) -> None:
    assert "has no [prove]" in " ".join(run(TABLE.partition("[prove]")[0]).split())


def test_special_points_carry_their_proofs() -> None:
    system = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=1.2)),
        impact=saltus.VelocityReduction(0.5),
    )
    orbit = saltus.find_orbit(system, x=-1.0, velocity=-3.0)
    branch = saltus.continue_orbit(orbit, "load.ground.amplitude", bounds=(1.0, 1.25))
    assert all(point.evidence.proof is None for point in branch.special)
    proof = saltus.prove(branch, most_boxes=0)
    assert not proof.proved.any()
    folds = [point for point in proof.branch.special if point.kind == "LP"]
    assert all(point.evidence.proof.proved for point in folds)
    assert "proved" in proof.branch.special.to_pandas()


def test_a_load_without_a_frequency_is_refused() -> None:
    with pytest.raises(saltus.ParameterError, match="frequency"):
        prove_orbit_of(saltus.System(model=saltus.WallOscillator()), x=0.0)


def test_a_branch_without_special_points_is_drawn(run, tmp_path: Path) -> None:
    """Between 1.1 and 1.2 the ball's orbit neither folds nor doubles."""
    run(TABLE + ALONG.replace("[1.0, 1.25]", "[1.15, 1.25]"))
    data = saltus.load(tmp_path / "out" / "prove.nc")
    assert data.sizes["special"] == 0
    assert (tmp_path / "out" / "prove.png").is_file()
