"""Build the wheel and the source archive, and try the wheel in empty environments: `make dist`.

Each Python on the path that saltus allows, with the newest packages, and the oldest Python also
with the lowest packages that pyproject.toml allows, which newer ones may not have, gets an
environment of its own with nothing but the wheel and what it needs. There `saltus doctor` compares
a motion with its closed form, a study is run and read back, the README's blocks run, a page is
made, the reproduction of the paper is added and makes a part, and with --tests the tests of both
run.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")  # those that some numba in the allowed range supports
STUDY = ROOT / "examples" / "resonance.toml"
VERSIONS = """
import json, platform
from importlib import metadata
names = ("numba", "numpy", "scipy", "xarray", "zarr", "matplotlib")
print(json.dumps({"python": platform.python_version()} | {name: metadata.version(name) for name in names}))
"""


@dataclass(frozen=True)
class Trial:
    """One environment: which Python, and whether packages are the lowest allowed ones."""

    python: str
    lowest: bool

    def run(self, wheel: Path, paper: Path, folder: Path, tests: bool) -> str:
        """Install and try; the row of the table that says how it went."""
        python = folder / "venv" / "bin" / "python"
        uv(
            "venv",
            "--quiet",
            "--python",
            command_of(self.python) or "",
            folder / "venv",
        )
        install = ("pip", "install", "--quiet", "--python", python)
        resolution = "lowest-direct" if self.lowest else "highest"
        extras = ("--extra", "cluster", "--extra", "test") if tests else ()
        # what the wheel needs is direct here
        uv(*install, "--resolution", resolution, *extras, "-r", ROOT / "pyproject.toml")
        uv(*install, "--no-deps", wheel)
        uv("pip", "check", "--quiet", "--python", python)
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith("PYTHON")
        }
        environment["SALTUS_CACHE_DIR"] = str(folder / "cache")

        def call(*command: str | Path) -> str:
            done = subprocess.run(
                [python, *command],
                cwd=folder,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                check=False,
            )
            if done.returncode:
                raise SystemExit(
                    f"{self.title}: {' '.join(map(str, command))} ended with "
                    f"{done.returncode}\n{done.stdout[-4000:]}"
                )
            return done.stdout

        found = json.loads(call("-c", VERSIONS))
        call("-m", "saltus", "doctor")
        call("-m", "saltus", "run", STUDY, "--output", folder / "results")
        call("-m", "saltus", "status", "--verify", folder / "results")
        print(call(ROOT / "release" / "try_readme.py", ROOT, folder / "readme"), end="")
        uv(*install, paper)  # with what it needs beside saltus
        uv("pip", "check", "--quiet", "--python", python)
        call("-m", "saltus", "reproduce", "table1", "--output", folder / "paper")
        passed = "not run"
        if tests:
            shutil.copytree(ROOT / "tests", folder / "checkout" / "tests")
            for name in (
                "examples",
                "docs",
                "reproduction",
                "README.md",
                "CHANGELOG.md",
                "CONTRIBUTING.md",
                "pyproject.toml",
            ):
                source, target = ROOT / name, folder / "checkout" / name
                shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)
            passed = call(
                "-m", "pytest", "-q", folder / "checkout", "--rootdir", folder / "checkout"
            ).splitlines()[-1]
        return (
            f"| {self.title} | "
            + " | ".join(f"{value}" for value in found.values())
            + f" | {passed} |"
        )

    @property
    def title(self) -> str:
        """What is tried."""
        return f"Python {self.python}, {'lowest' if self.lowest else 'newest'} packages"


def uv(*arguments: str | Path) -> None:
    """Run uv, which resolves to the lowest versions as pip cannot."""
    subprocess.run([sys.executable, "-m", "uv", *arguments], check=True)


def command_of(python: str) -> str | None:
    """The command of a Python, if this machine has it; one of its name may be a pointer to none."""
    if python == f"{sys.version_info[0]}.{sys.version_info[1]}":
        return sys.executable
    command = shutil.which(f"python{python}")
    if command is None:
        return None
    done = subprocess.run([command, "-c", ""], capture_output=True, check=False)
    return command if done.returncode == 0 else None


def build(target: Path) -> tuple[Path, Path]:
    """Build both archives of saltus, and those of the reproduction, from what is committed; the two
    wheels.
    """
    with tempfile.TemporaryDirectory() as folder:
        sources = subprocess.run(
            ["git", "archive", "HEAD"], cwd=ROOT, check=True, stdout=subprocess.PIPE
        )
        subprocess.run(["tar", "-x", "-C", folder], input=sources.stdout, check=True)
        own = ROOT / ".venv" / "bin" / "python"  # has numba, which builds need not have
        maker = own if own.exists() else sys.executable
        ship = ROOT / "release" / "ship_kernels.py"
        subprocess.run([maker, ship, Path(folder) / "src"], check=True)
        for project in (Path(folder), Path(folder) / "reproduction"):
            subprocess.run(
                [sys.executable, "-m", "hatchling", "build", "-d", target], cwd=project, check=True
            )
        (wheel,), (paper,) = target.glob("saltus-*.whl"), target.glob("saltus_paper-*.whl")
        for archive in (wheel, paper):
            check_names_no_folder(archive, (Path(folder), ROOT))
    return wheel, paper


def check_names_no_folder(wheel: Path, folders: tuple[Path, ...]) -> None:
    """Stop if a file of a wheel holds the path of a folder of this machine."""
    with zipfile.ZipFile(wheel) as content:
        for name in content.namelist():
            held = content.read(name)
            for folder in folders:
                if os.fsencode(folder) in held:
                    raise SystemExit(f"{wheel.name}: {name} holds the path {folder}")


def main() -> None:
    """Build, then try all that can be had here."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PYTHONS, help="try this Python alone")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--newest", action="store_true", help="with the newest packages alone")
    which.add_argument("--lowest", action="store_true", help="with the lowest packages alone")
    parser.add_argument(
        "--tests", action="store_true", help="run the tests in each environment as well"
    )
    options = parser.parse_args()
    target = ROOT / "dist"
    shutil.rmtree(target, ignore_errors=True)
    wheel, paper = build(target)
    there = [
        python
        for python in PYTHONS
        if command_of(python) is not None and options.only in (None, python)
    ]
    if not there:
        raise SystemExit(f"there is no Python {options.only or 'from 3.11'} here")
    print(f"{wheel.name}: {wheel.stat().st_size / 2**20:.1f} MiB")
    print("| environment | Python | numba | NumPy | SciPy | xarray | Zarr | Matplotlib | tests |")
    print("|---|---|---|---|---|---|---|---|---|")
    for python in there:
        for lowest in (False, True):
            if options.newest if lowest else options.lowest:
                continue
            if lowest and python != PYTHONS[0] and not options.lowest:
                continue  # the lowest packages are older than newer Pythons
            with tempfile.TemporaryDirectory() as folder:
                print(
                    Trial(python, lowest).run(wheel, paper, Path(folder), options.tests), flush=True
                )
    missing = [python for python in PYTHONS if python not in there]
    if missing:
        print(f"Not tried here: Python {', '.join(missing)}.")


if __name__ == "__main__":
    main()
