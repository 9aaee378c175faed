"""The program behind `.ci/run`: its clock, and what it says of steps that fail, are cut or do not
begin.
"""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "release"))

import ci  # noqa: E402


def step(name, commands, minutes=1.0, **more):
    return ci.Step(name, f"what {name} is", commands, minutes, **more)


def test_tests_are_counted_and_a_step_that_fails_fails_the_whole(capfd):
    passing = step("one", "echo '5 passed, 1 skipped in 3 s'; echo '2 passed'")
    assert ci.run_all([passing]) == 0
    assert "one          passed          0.0      7" in capfd.readouterr().out
    assert ci.run_all([step("bad", "false; echo never"), passing]) == 1
    said = capfd.readouterr().out
    assert "FAILED: bad" in said
    assert "never" not in said
    assert "one          passed" in said  # the others run all the same


def test_the_clock_cuts_and_leaves_out_and_does_not_fail(capfd):
    slow = step("slow", "sleep 60 | cat")
    assert ci.run_all([slow, step("late", "echo begun")], begin_before=0.01, end=0.02) == 0
    said = capfd.readouterr().out
    assert "Cut by the clock: slow" in said
    assert "Not run, for want of time: late" in said
    assert "begun" not in said


def test_a_step_that_hangs_fails_unless_it_may_be_cut(capfd):
    assert ci.run_all([step("hangs", "sleep 60", 0.01)]) == 1
    assert ci.run_all([step("long", "sleep 60", 0.01, may_be_cut=True)]) == 0
    assert "Cut by the clock: long" in capfd.readouterr().out


def test_what_a_machine_cannot_run_is_said(capfd):
    assert ci.run_all([step("js", f"exit {ci.IMPOSSIBLE}")]) == 0
    assert "Not possible on this machine: js" in capfd.readouterr().out


@pytest.mark.parametrize("name", ["avx2", "sse"])
def test_commits_take_both_processors_and_all_shares_in_turn(name):
    tables = [ci.steps(number) for number in range(2 * ci.SHARES)]
    processors = [row.commands for table in tables for row in table if row.name == "processor"]
    assert sum(f"tests/processors/{name}.sh" in commands for commands in processors) == ci.SHARES
    assert (ROOT / "tests" / "processors" / f"{name}.sh").exists()
    shares = [ci.thorough_files(share, ci.SHARES) for share in range(ci.SHARES)]
    files = [file for share in shares for file in share]
    marked = [
        path
        for folder in ("tests", "reproduction/tests")
        for path in (ROOT / folder).rglob("test_*.py")
        if "mark.thorough" in path.read_text(encoding="utf-8")
    ]
    assert sorted(files) == sorted(str(path.relative_to(ROOT)) for path in marked)
    thorough = {row.commands for table in tables for row in table if row.name == "thorough"}
    assert len(thorough) == ci.SHARES
    assert all(min(row.minutes for row in table) > 0.0 for table in tables)
