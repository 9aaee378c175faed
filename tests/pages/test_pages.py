"""Every block of code on every page runs, and prints what the page says; the pages that take
longest in `make thorough`.
"""

from pathlib import Path

import pytest
from code_blocks import Page, agrees, blocks
from typer.testing import CliRunner

ROOT = Path(__file__).parents[2]
GENERATED = {"_build", "api", "gallery"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if not GENERATED & set(page.relative_to(ROOT).parts)]
# three to six seconds each
LONGEST = {"charts.md", "spectra.md", "fit.md", "experiments.md", "contact_orbits.md"}


def command(*arguments):
    """`saltus` in this process; a traceback fails the test."""
    from saltus.cli.app import app

    result = CliRunner().invoke(
        app, list(arguments), prog_name="saltus", env={"COLUMNS": "100", "NO_COLOR": "1"}
    )
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.thorough if page.name in LONGEST else ())
        for page in PAGES
    ],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_a_page_prints_what_it_says(page, tmp_path, monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    Page(page, tmp_path, command, monkeypatch).run()
    pyplot.close("all")


def test_there_is_code_on_the_pages():
    kinds = [kind for page in PAGES for kind, *_ in blocks(page.read_text(encoding="utf-8"))]
    assert kinds.count("python") > 35


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("x = 0.25, 3 of them", "x = 0.2504, 3 of them", True),
        ("x = 0.25, 3 of them", "x = 0.27, 3 of them", False),
        ("3 impacts", "4 impacts", False),
        ("1.2e-14", "1.3e-14", True),
        ("1.2e-14", "7e-15", True),
        ("1.2e-4", "1.5e-4", False),
        ("rest at 2.0 ...", "rest at 2.01 (a wall)", True),
        ("chaotic", "periodic", False),
        ("-0.5", "0.5", False),
        ("", "something", False),
    ],
)
def test_numbers_agree_within_a_unit_of_the_last_digit_shown(shown, printed, same):
    assert agrees(shown, printed) is same
