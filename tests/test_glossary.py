"""The words of the code are those of the glossary, and a function's name has few meanings."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import saltus

SOURCE = Path(saltus.__file__).parent
GLOSSARY = SOURCE.parents[1] / "docs" / "glossary.md"
# Words of class names that mean what they mean in plain English, or in every program.
PLAIN = """
    advanced approach array ask backward belt box buffer case chain check common compiler computation condition conditioned
    confirmation declared detail difference energy extreme factor failure file find four gain geometry group growth half
    helper inner interrupted judged line linear linked linking loaded location look loop mask matching natural neighbour numbered
    opening option origin oscillator outcome peak physical placement pointed raised read reading restart row run sampled searched
    sequence singular size slow solver source spacing stretch stretched stretching table three timed type until vibration watch
    whole
"""
PERSONS = "lyapunov mavroeidis newton papageorgiou ricker wada"
MEANINGS = {"follow": 3, "at": 4, "held": 3}  # the most functions of these names; the glossary says what they do


@cache
def named_nodes() -> list[ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef]:
    kinds = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    trees = [ast.parse(path.read_text()) for path in sorted(SOURCE.rglob("*.py"))]
    return [node for tree in trees for node in ast.walk(tree) if isinstance(node, kinds)]


def definitions(kind: type | tuple[type, ...]) -> Iterator[str]:
    yield from (node.name for node in named_nodes() if isinstance(node, kind))


def words(name: str) -> list[str]:
    """The words of a name in capitals: `ChartRequest` has chart and request."""
    return [singular(word.lower()) for word in re.findall(r"[A-Z]+(?=[A-Z][a-z])|[A-Z][a-z]*|[a-z]+", name)]


def singular(word: str) -> str:
    if word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-1] if word.endswith("s") and not word.endswith("ss") else word


def test_every_word_of_a_class_is_in_the_glossary_or_plain_english() -> None:
    known = {singular(word) for word in re.findall(r"[a-z]+", f"{GLOSSARY.read_text().lower()} {PLAIN} {PERSONS}")}
    names = sorted(set(definitions(ast.ClassDef)))
    assert len(names) > 300
    assert not {name: missing for name in names if (missing := [word for word in words(name) if word not in known])}


@pytest.mark.parametrize("name", MEANINGS)
def test_the_name_of_a_function_has_few_meanings(name: str) -> None:
    functions = list(definitions((ast.FunctionDef, ast.AsyncFunctionDef)))
    assert functions.count(name) <= MEANINGS[name]
