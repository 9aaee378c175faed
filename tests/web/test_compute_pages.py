"""The pages that the documentation and the report make are listed, and each is computed in node and
compared with Python; here those that take no search.
"""

import re

import compute_pages
import pytest
from test_agreement import NODE

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed here")


@pytest.mark.parametrize("name", ["tristable", "block"])
def test_a_living_page_computes_what_python_does(name, tmp_path):
    compute_pages.living_systems.write(name, tmp_path)
    (file,) = compute_pages.pages_in([tmp_path])
    assert " up to time " in compute_pages.computed(file)


def test_a_page_that_ends_elsewhere_is_seen(tmp_path):
    compute_pages.living_systems.write("block", tmp_path)
    file = tmp_path / "block.html"
    text = file.read_text()
    moved = re.sub(r'("study": \{"system": .*?"alpha": )0\.2617993', r"\g<1>0.2617994", text)
    assert moved != text
    file.write_text(moved)
    with pytest.raises(AssertionError, match="beside that of Python"):
        compute_pages.computed(file)


def test_pages_of_the_report_and_of_the_documentation_are_listed():
    expected = compute_pages.expected_pages()
    assert set(expected["documentation"]) == {
        f"{name}.html" for name in compute_pages.living_systems.PAGES
    }
    assert "fig04.html" in expected["report"]
