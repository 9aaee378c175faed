"""No sentence of the README, of a page or of a public docstring has more than 30 words."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST_WORDS = 30
GENERATED = {"api", "gallery", "_build"}  # folders that sphinx writes
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *(
        path
        for path in sorted((ROOT / "docs").rglob("*.md"))
        if not GENERATED.intersection(path.relative_to(ROOT).parts)
    ),
]
SOURCES = sorted((ROOT / "src").rglob("*.py"))
# what is no prose: blocks of code, tables, headings, pictures, a reference's lines
NO_PROSE = re.compile(r"^(\[cyan\]|\||#|!\[|:::|```|>>>|\.\.\. )")
END = re.compile(r"(?<=[A-Za-z0-9)`\]'\"$*|])[.:;?!](?:\*\*)?(?=\s|$)")


def sentences(paragraphs):
    """The sentences of paragraphs of text; a colon and a semicolon end one, too."""
    for paragraph in paragraphs:
        for sentence in END.split(" ".join(paragraph.split())):
            yield sentence.strip()


def words(sentence):
    """The words of a sentence; code between backquotes is one, and formulas have none."""
    plain = re.sub(r"``?[^`]*``?", "code", re.sub(r"\]\([^)]*\)", "]", sentence))
    return [word for word in plain.split() if re.search(r"[A-Za-z]{2}", word) or word in "aAI"]


def paragraphs_of_page(text):
    """The paragraphs of a page in Markdown."""
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->|^---\n.*?^---$|\$\$.*?\$\$", "", text, flags=re.M | re.S)
    block: list[str] = []
    for line in [*text.splitlines(), ""]:
        begins = re.match(r"^\s*([*+-]|\d+\.) ", line)
        if not line.strip() or begins or NO_PROSE.match(line.strip()):
            yield " ".join(block)
            block = []
        if line.strip() and not NO_PROSE.match(line.strip()):
            block.append(re.sub(r"^\s*([*+-]|\d+\.) ", "", line))


def paragraphs_of_docstring(text):
    """The paragraphs of a docstring: lines of one indentation; formulas stand further in."""
    text = text.partition("\nReferences\n")[0]
    block: list[str] = []
    indent = 0
    for line in [*text.splitlines(), ""]:
        own = len(line) - len(line.lstrip())
        begins = re.match(r"^\s*([*+-]|\d+\.) ", line)
        other = not line.strip() or begins or NO_PROSE.match(line.strip()) or own != indent
        if other:
            yield " ".join(block)
            block, indent = [], own + (2 if begins else 0)
        if line.strip() and not NO_PROSE.match(line.strip()):
            block.append(line)


def public_docstrings(path):
    """The docstrings of a module and of its public functions, classes and methods."""

    def inside(node, name):
        if (text := ast.get_docstring(node)) and not name.rpartition(".")[2].startswith("_"):
            yield name, text
        for part in getattr(node, "body", ()):
            if isinstance(part, (ast.FunctionDef, ast.ClassDef)) and not part.name.startswith("_"):
                yield from inside(part, f"{name}.{part.name}")

    yield from inside(ast.parse(path.read_text(encoding="utf-8")), path.stem.strip("_"))


def long_ones(paragraphs):
    return [s for s in sentences(paragraphs) if len(words(s)) > MOST_WORDS]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_sentence_of_a_page_is_long(path):
    assert long_ones(paragraphs_of_page(path.read_text(encoding="utf-8"))) == []


def test_no_sentence_of_a_public_docstring_is_long():
    found = {
        f"{path.relative_to(ROOT)}:{name}": long
        for path in SOURCES
        for name, text in public_docstrings(path)
        if (long := long_ones(paragraphs_of_docstring(text)))
    }
    assert found == {}


def test_a_long_sentence_is_seen():
    """Thirty words pass, thirty-one do not, in either kind of text; a colon ends a sentence."""
    short, long = " ".join(["word"] * 30), " ".join(["word"] * 31)
    for paragraphs in (paragraphs_of_page, paragraphs_of_docstring):
        assert long_ones(paragraphs(f"{short}. {short}: {short}.")) == []
        assert long_ones(paragraphs(f"Title.\n\n{long}.\n")) == [long]
