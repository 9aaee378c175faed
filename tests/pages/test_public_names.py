"""Every public name has a docstring, types, a place in the reference and an example that runs."""

import doctest
import importlib
import inspect
import sys
from pathlib import Path

import pytest
from code_blocks import Shown, blocks

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "_extensions"))
from public_names import public_names  # noqa: E402

NAMES = [name for names in public_names().values() for name in names]


def found(name):
    room, _, own = name.rpartition(".")
    return getattr(importlib.import_module(room), own)


@pytest.fixture(scope="module")
def names():
    """What the examples of the reference use: the first block of its page."""
    page = (ROOT / "docs" / "reference" / "index.md").read_text(encoding="utf-8")
    pytest.importorskip("matplotlib").use("agg")
    made = {}
    exec(next(code for kind, code, *_ in blocks(page) if kind == "python"), made)
    return made


def untyped(function):
    """The arguments of a function without a type, and `return` where there is none."""
    signature = inspect.signature(function)
    missing = [p.name for p in signature.parameters.values() if p.annotation is p.empty and p.name not in ("self", "cls")]
    return missing + (["return"] if signature.return_annotation is signature.empty else [])


def test_every_public_name_has_a_docstring_and_types():
    assert len(NAMES) >= 170
    assert not [name for name in NAMES if len(inspect.getdoc(found(name)) or "") < 20]
    functions = {name: inspect.unwrap(found(name)) for name in NAMES if not inspect.isclass(found(name))}
    assert not {name: untyped(function) for name, function in functions.items() if untyped(function)}


@pytest.mark.parametrize("name", NAMES)
def test_the_example_of_a_name_runs_and_prints_what_it_says(name, names, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    test = doctest.DocTestParser().get_doctest(inspect.getdoc(found(name)), dict(names), name, None, 0)
    assert test.examples, f"{name} has no example"
    told = []
    failed, _ = doctest.DocTestRunner(checker=Shown(), optionflags=doctest.IGNORE_EXCEPTION_DETAIL).run(test, out=told.append)
    assert not failed, "".join(told)
