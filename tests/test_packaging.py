"""What is published: the wheel holds all that saltus reads, and every place says the same
version.
"""

import json
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import saltus

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PAPER = tomllib.loads((ROOT / "reproduction" / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The names of the files in a wheel that is built here."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        cwd=ROOT,
        check=True,
    )
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        return archive.namelist()


def test_the_wheel_holds_every_file_of_the_package(wheel):
    source = ROOT / "src"
    there = {
        path.relative_to(source).as_posix()
        for path in (source / "saltus").rglob("*")
        if path.is_file()
    }
    there = {name for name in there if "__pycache__" not in name}
    assert there <= set(wheel)
    # without which no type checker sees a type
    assert {"saltus/py.typed", "saltus/__init__.pyi"} <= there


def test_the_wheel_holds_nothing_else(wheel):
    info = f"saltus-{PROJECT['version']}.dist-info/"
    assert all(name.startswith(("saltus/", info)) for name in wheel)
    assert f"{info}licenses/LICENSE" in wheel


def test_all_places_say_the_same_version():
    version = PROJECT["version"]
    assert saltus.__version__ == version
    assert PAPER["version"] == version
    assert f"saltus=={version}" in PAPER["dependencies"]
    assert re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.M)[1] == version
    assert json.loads((ROOT / ".zenodo.json").read_text())["version"] == version
    assert re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)[1] == version


def test_what_saltus_imports_it_also_requires():
    """A package that another one brings along may be gone with that one's next release."""
    names = {
        "tomli-w": "tomli_w",
        "lazy-loader": "lazy_loader",
        "cuda-bindings": "cuda",
        "python-flint": "flint",
    }
    extras = PROJECT["optional-dependencies"]
    texts = [*PROJECT["dependencies"], *extras["cluster"], *extras["explore"], *extras["sympy"]]
    texts += [*extras["jax"], *extras["torch"], *extras["cuda"], *extras["prove"]]
    required = {re.match(r"[\w-]+", text)[0] for text in texts}
    allowed = {names.get(name, name) for name in required} | {"saltus", *sys.stdlib_module_names}
    statement = re.compile(r"^\s*(?:from|import) ([A-Za-z_]\w*)", re.M)
    code = [
        re.sub(r'""".*?"""', "", path.read_text(), flags=re.S)
        for path in (ROOT / "src").rglob("*.py")
    ]
    imported = {name for text in code for name in statement.findall(text)}
    assert "numba" in imported
    # llvmlite is of one release with numba, which fixes its version; mypy loads its plugin itself
    assert imported - allowed == {"llvmlite", "mypy"}


def test_the_changelog_can_be_read():
    """Ten lines of highlights above, then a line an entry, and a date for each older version. If the
    newest one has a date, what was done for it is recorded (docs/releasing.md).
    """
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest, *older = re.split(r"^## ", text, flags=re.M)[1:]
    version, said = re.match(
        r"(\S+) \((20\d\d-\d\d-\d\d|not released)\)\n\nIn short:\n\n(?:\* .+\n){10}\n### ", newest
    ).groups()
    record = (ROOT / "docs" / "releasing.md").read_text(encoding="utf-8")
    assert (f"### {version} ({said})" in record) == (said != "not released")
    assert all(re.match(r"\S+ \((20\d\d-\d\d-\d\d|\w{7})[),]", version) for version in older)
    entries = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert all(line.startswith("* ") or not line.startswith(" ") for line in entries)
    assert max(map(len, entries)) <= 160
