"""The reproduction uses saltus as any user can: names that a documented front door gives, and
nothing behind it.
"""

import ast
import re
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

import saltus
import saltus_paper

HERE, LIBRARY = Path(saltus_paper.__file__).parent, Path(saltus.__file__).parent
FILES = sorted(HERE.rglob("*.py"))
ROOT = Path(__file__).parents[2]
# each a page of the reference
DOORS = ("systems", "flow", "bounds", "orbits", "attractors", "studies", "plots", "theory", "cli")


@cache
def given_by(package):
    """The names in the stub of a front door."""
    stub = LIBRARY.parent.joinpath(*package.split("."), "__init__.pyi")
    imports = [
        node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)
    ]
    return {alias.name for node in imports for alias in node.names}


def nodes(path, *kinds):
    return (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, kinds))


def test_every_door_is_a_page_of_the_reference():
    page = (ROOT / "docs" / "reference" / "index.md").read_text()
    assert not [door for door in DOORS if f"api/{door}" not in page]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(HERE)))
def test_a_file_imports_public_names_alone(path):
    doors = {"saltus", *(f"saltus.{door}" for door in DOORS)}
    for node in nodes(path, ast.Import):
        assert not [alias.name for alias in node.names if alias.name.startswith("saltus.")], (
            node.lineno
        )
    for node in nodes(path, ast.ImportFrom):
        if node.module.split(".")[0] == "saltus":
            assert node.module in doors, f"{node.lineno}: {node.module}"
            hidden = {alias.name for alias in node.names} - given_by(node.module)
            assert not hidden, f"{node.lineno}: {hidden} of {node.module}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(HERE)))
def test_a_file_reaches_nothing_hidden_of_an_object(path):
    """No attribute with an underscore of anything but the object's own class, and no submodule of
    saltus by its dots.
    """
    own = ("self", "cls")
    for node in nodes(path, ast.Attribute):
        inner = node.attr.startswith("_") and not node.attr.startswith("__")
        base = node.value.id if isinstance(node.value, ast.Name) else ""
        assert not (inner and base not in own and node.attr not in ALLOWED), (
            f"{node.lineno}: .{node.attr}"
        )
        if base == "saltus":
            assert node.attr in given_by("saltus") | {"__version__", "__file__"}, (
                f"{node.lineno}: saltus.{node.attr}"
            )


ALLOWED = {"_axinfo"}  # of Matplotlib's axes in space, whose grid has no public handle


def test_it_requires_what_it_imports():
    project = tomllib.loads((ROOT / "reproduction" / "pyproject.toml").read_text())["project"]
    names = {"lazy-loader": "lazy_loader", "pillow": "PIL"}
    required = {re.match(r"[\w-]+", text)[0] for text in project["dependencies"]}
    allowed = {names.get(name, name) for name in required} | {
        "saltus_paper",
        *sys.stdlib_module_names,
    }
    found = {
        alias.name.split(".")[0]
        for path in FILES
        for node in nodes(path, ast.Import)
        for alias in node.names
    }
    found |= {
        node.module.split(".")[0]
        for path in FILES
        for node in nodes(path, ast.ImportFrom)
        if not node.level
    }
    assert found <= allowed, found - allowed
    assert found >= {name for name in allowed if name not in sys.stdlib_module_names} - {"saltus"}
