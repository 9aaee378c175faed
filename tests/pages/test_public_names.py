"""Every public name has a docstring, types, a place in the reference and an example that runs."""

import doctest
import enum
import importlib
import inspect
import re
import sys
from dataclasses import is_dataclass
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
    missing = [
        p.name
        for p in signature.parameters.values()
        if p.annotation is p.empty and p.name not in ("self", "cls")
    ]
    return missing + (["return"] if signature.return_annotation is signature.empty else [])


def test_every_public_name_has_a_docstring_and_types():
    assert len(NAMES) >= 170
    assert not [name for name in NAMES if len(inspect.getdoc(found(name)) or "") < 20]
    functions = {
        name: inspect.unwrap(found(name)) for name in NAMES if not inspect.isclass(found(name))
    }
    assert not {
        name: untyped(function) for name, function in functions.items() if untyped(function)
    }


def described(found):
    """The names in the sections of arguments and fields of a docstring."""
    sections = re.findall(
        r"(?:Parameters|Attributes)\n-+\n(.*?)(?=\n\n|\Z)", inspect.getdoc(found) or "", re.DOTALL
    )
    lines = [line for text in sections for line in text.split("\n") if not line.startswith(" ")]
    return {name.strip() for line in lines for name in line.split(",")}


def arguments(found):
    """The names of what a function or a class takes; an enumeration and an error without an own
    `__init__` take nothing.
    """
    if (
        inspect.isclass(found)
        and (issubclass(found, enum.Enum) or "__init__" not in vars(found))
        and not is_dataclass(found)
    ):
        return set()
    return set(inspect.signature(found).parameters) - {"self", "cls"}


def test_every_argument_of_every_public_name_is_described():
    """A method that overrides another one is described there, as the methods of models are by
    `Model`.
    """
    objects = {name: found(name) for name in NAMES}
    for name, cls in list(objects.items()):
        if inspect.isclass(cls):
            own = {key: getattr(cls, key) for key in vars(cls) if not key.startswith("_")}
            new = {
                key: value
                for key, value in own.items()
                if not any(key in vars(base) for base in cls.__mro__[1:])
            }
            objects |= {
                f"{name}.{key}": value
                for key, value in new.items()
                if inspect.isfunction(value) or inspect.ismethod(value)
            }
    assert len(objects) > len(NAMES) + 60
    missing = {name: arguments(each) - described(each) for name, each in objects.items()}
    assert not {name: names for name, names in missing.items() if names}


@pytest.mark.parametrize("name", NAMES)
def test_the_example_of_a_name_runs_and_prints_what_it_says(name, names, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    test = doctest.DocTestParser().get_doctest(
        inspect.getdoc(found(name)), dict(names), name, None, 0
    )
    assert test.examples, f"{name} has no example"
    told = []
    failed, _ = doctest.DocTestRunner(
        checker=Shown(), optionflags=doctest.IGNORE_EXCEPTION_DETAIL
    ).run(test, out=told.append)
    assert not failed, "".join(told)
