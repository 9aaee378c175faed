"""`saltus reproduce`: the names, the options, and what is refused."""

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest


def test_the_parts_are_listed(saltus):
    from saltus_paper import FIGURES

    listed = [line.split()[0] for line in saltus("reproduce", "--list").stdout.splitlines()]
    assert listed == list(FIGURES)
    assert {"fig04", "table1"} <= set(listed)


@pytest.mark.parametrize("command", ["reproduce", "report"])
def test_the_commands_show_an_example(saltus, command):
    result = saltus(command, "--help")
    assert result.exit_code == 0
    assert f"Example: saltus {command}" in result.stdout


def test_wrong_use_ends_with_status_2(saltus):
    result = saltus("reproduce", "--nope")
    assert result.exit_code == 2
    assert "Usage: saltus reproduce" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "names", "output", "force", "effort"),
    [
        ([], [], Path("results"), False, "standard"),
        (
            ["fig04", "table1", "-o", "there", "--force"],
            ["fig04", "table1"],
            Path("there"),
            True,
            "standard",
        ),
        (["fig09", "--effort", "quick"], ["fig09"], Path("results"), False, "quick"),
    ],
)
def test_the_options_reach_the_paper(saltus, monkeypatch, arguments, names, output, force, effort):
    calls = []
    monkeypatch.setattr("saltus_paper.reproduce", lambda *given: calls.append(given) or [])
    monkeypatch.setattr("saltus_paper.report_as_pdf", lambda folder: None)
    assert saltus("reproduce", *arguments).exit_code == 0
    assert (*calls[0][:3], calls[0][4]) == (names, output, force, effort)


def test_a_part_that_fails_is_named_at_the_end_and_the_others_are_made(
    saltus, monkeypatch, tmp_path
):
    from saltus_paper import FIGURES

    def fail(data):
        raise KeyError("no pen")

    monkeypatch.setitem(FIGURES, "fig08", replace(FIGURES["fig08"], draw=fail))
    monkeypatch.setattr("saltus_paper.report.browser.BROWSERS", ())
    found = saltus("reproduce", "fig08", "table1", "-o", tmp_path)
    assert found.exit_code == 1
    assert "saltus: fig08 failed: KeyError: 'no pen'" in found.stderr
    assert "in fail" in (tmp_path / "failures.txt").read_text(encoding="utf-8")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'id="table1"' in page
    assert 'id="fig08"' not in page
    monkeypatch.undo()
    monkeypatch.setattr("saltus_paper.report.browser.BROWSERS", ())
    again = saltus("reproduce", "fig08", "table1", "-o", tmp_path)
    assert again.exit_code == 0
    assert not (tmp_path / "failures.txt").exists()
    assert 'id="fig08"' in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("verdict", "draft", "status"),
    [("DISAGREES", False, 1), ("DISAGREES", True, 0), ("UNDECIDED", False, 0)],
)
def test_a_claim_that_disagrees_is_named_at_the_end_and_has_a_status(
    saltus, monkeypatch, tmp_path, verdict, draft, status
):
    from saltus_paper import ClaimVerdict, reproduce

    monkeypatch.setattr("saltus_paper.report.browser.BROWSERS", ())
    (made,) = reproduce(["table1"], tmp_path)
    first, *others = made.claims
    judged = replace(first, verdict=ClaimVerdict[verdict], evidence="2 instead of 3")
    results = [replace(made, claims=(judged, *others), draft=draft)]
    monkeypatch.setattr("saltus_paper.reproduce", lambda *given: results)
    found = saltus("reproduce", "table1", "-o", tmp_path)
    assert found.exit_code == status
    assert (f"saltus: {first.id} disagrees: 2 instead of 3" in found.stderr) == bool(status)


def test_an_unknown_part_is_refused(refused, tmp_path):
    said = refused("reproduce", "fig4", "-o", tmp_path)
    assert "did you mean" in said
    assert "'fig04'" in said


def test_an_unknown_effort_is_refused(refused, tmp_path):
    assert "'standard', 'quick'" in refused(
        "reproduce", "fig08", "--effort", "fast", "-o", tmp_path
    )


def test_an_unwritable_folder_is_refused(refused, tmp_path):
    (tmp_path / "file").touch()
    assert "is a file; name another with --output" in refused(
        "reproduce", "fig08", "-o", tmp_path / "file"
    )


def test_the_report_of_no_results_is_refused(refused, tmp_path):
    assert "holds no results of `saltus reproduce`" in refused("report", tmp_path)


def test_the_report_is_renewed_and_a_missing_browser_told(saltus, monkeypatch, tmp_path):
    monkeypatch.setattr("saltus_paper.report.browser.BROWSERS", ())
    assert "there is no report.pdf" in saltus("reproduce", "table1", "-o", tmp_path).stdout
    (tmp_path / "report.html").unlink()
    assert "Parts in the report: table1" in saltus("report", tmp_path).stdout
    assert (tmp_path / "report.html").exists()


@pytest.mark.thorough
def test_an_interrupt_leaves_whole_files_only(started, tmp_path):
    command = [sys.executable, "-m", "saltus", "reproduce", "fig04", "fig05", "-o", tmp_path]
    process = started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while not process.stderr.readline().endswith("fig05.png is ready\n"):
        assert process.poll() is None
    # fig05 is made, and while fig04, which takes seconds, is being made
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=120)
    *_, said = err.splitlines()
    assert (process.returncode, said) == (130, "saltus: interrupted; no file was left half-written")
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert any("fig05" in path.name for path in files)
    assert not [path for path in files if ".part" in path.name]
