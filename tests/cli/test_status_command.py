"""`saltus status`: how far a sweep is, while it runs, when it was stopped, when it is over, and
when it is none.
"""

import numpy as np
import pytest

from saltus.cli.guard import guarded
from saltus.cli.summaries import print_status, size
from saltus.errors import SweepError
from saltus.sweep import Plan, Variable, run
from saltus.sweep import store_files as files
from saltus.sweep.store import opened


@pytest.fixture
def plan():
    """The hypotenuses of a grid of 6 x 4 catheti, in 3 x 2 chunks."""
    axes = {"a": np.linspace(0.0, 3.0, 6), "b": np.linspace(0.0, 4.0, 4)}
    function = f"{__name__}:hypotenuse"
    chunk = {"a": 2, "b": 2}
    return Plan(
        function=function,
        axes=axes,
        chunk=chunk,
        variables={"c": Variable()},
        attrs={"kind": "stability chart"},
    )


def hypotenuse(arguments, block):
    return {"c": np.hypot(block["a"][:, None], block["b"])}


def limited(arguments, block):
    if block["a"].max() > 2.0:
        raise ValueError("[too long]")
    return hypotenuse(arguments, block)


@pytest.fixture
def told(capsys):
    """What is printed of a store, as lines of words."""

    def tell(path):
        print_status(path)
        return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]

    return tell


def test_a_complete_sweep(plan, told, tmp_path):
    run(plan, tmp_path / "store")
    lines = told(tmp_path / "store")
    assert lines[0] == f"Stability chart in {tmp_path / 'store'}"
    assert "chunks 6 of 6 done (100 %)" in lines
    assert "grid 6 along a, 4 along b" in lines
    assert lines[-1] == "The sweep is complete."
    assert any(line.startswith("size ") and line.endswith(" kB") for line in lines)


def test_the_command_is_there(plan, saltus, refused, tmp_path):
    run(plan, tmp_path / "store")
    result = saltus("status", tmp_path / "store")
    assert result.exit_code == 0
    assert "6 of 6 done" in result.stdout
    assert (
        refused("status", tmp_path / "no store")
        == f"saltus: there is no store at {tmp_path / 'no store'}"
    )


def test_a_sweep_that_was_stopped(plan, told, tmp_path):
    run(plan, tmp_path / "store")
    files.chunk_file(tmp_path / "store", "c", (1, 1), 0).unlink()
    lines = told(tmp_path / "store")
    assert "chunks 5 of 6 done (83 %)" in lines
    assert lines[-1] == "No run is writing to it; start the sweep again to go on from here."


def test_a_sweep_that_runs(plan, told, tmp_path):
    with opened(plan, tmp_path / "store"):
        lines = told(tmp_path / "store")
    assert "chunks 0 of 6 done (0 %)" in lines
    assert "last written nothing yet" in lines
    assert lines[-1] == "A run is writing to it now."


def test_failed_chunks_are_named(plan, told, tmp_path):
    plan = Plan(
        function=f"{__name__}:limited", axes=plan.axes, chunk=plan.chunk, variables=plan.variables
    )
    with pytest.raises(SweepError):
        run(plan, tmp_path / "store", retries=0)
    lines = told(tmp_path / "store")
    assert lines[0].startswith("Sweep in ")
    assert "failed 2" in lines
    assert "chunk 2/0 (a 2.4 to 3, b 0 to 1.33333): ValueError: [too long]" in lines


def test_what_is_no_store_is_told(tmp_path, capsys):
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    for name, text in (
        ("broken", "{"),
        ("other", '{"zarr_format": 3, "node_type": "group", "attributes": {}}'),
        ("list", "[]"),
    ):
        (tmp_path / name).mkdir()
        (tmp_path / name / "zarr.json").write_text(text)
    for name, sentence in (
        ("nothing", "there is no store at {}"),
        ("file", "{} is a file; the store of a sweep is a folder"),
        ("folder", "{} is not a store: it has no zarr.json"),
        ("broken", "{}/zarr.json cannot be read"),
        ("other", "{} is a Zarr store, but not of a sweep: it keeps no plan"),
        ("list", "{} is a Zarr store, but not of a sweep: it keeps no plan"),
    ):
        with pytest.raises(BaseException) as stopped, guarded():
            print_status(tmp_path / name)
        assert stopped.value.exit_code == 2
        assert capsys.readouterr().err.startswith("saltus: " + sentence.format(tmp_path / name))


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "0 B"), (999, "999 B"), (1000, "1 kB"), (23_456, "23.5 kB"), (5_000_000_000, "5 GB")],
)
def test_sizes_are_given_in_the_unit_that_fits(count, text):
    assert size(count) == text


def test_what_a_store_says_of_itself_is_never_obeyed_by_the_terminal(told, tmp_path):
    axes = {"a": np.linspace(0.0, 1.0, 2)}
    hostile = Plan(
        function=f"{__name__}:hypotenuse",
        axes=axes,
        variables={"c": Variable()},
        attrs={"kind": "\x1b[2J\u202e" * 40},
    )
    with opened(hostile, tmp_path / "store"):
        pass
    said = " ".join(told(tmp_path / "store"))
    assert "\x1b" not in said
    assert "\u202e" not in said
    assert len(said) < 600
