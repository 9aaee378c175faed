"""Help that teaches, and is immediate."""

import os
import subprocess
import sys

import pytest

import saltus as package

HEAVY = ("numpy", "scipy", "numba", "xarray", "matplotlib")


@pytest.mark.parametrize("command", ["simulate", "info"])
def test_every_command_shows_an_example(saltus, command):
    result = saltus(command, "--help")
    assert result.exit_code == 0
    assert f"Example: saltus {command}" in result.stdout


def test_the_first_page_names_the_commands_and_shows_a_study(saltus, tmp_path):
    result = saltus("--help")
    for command in ("saltus reproduce", "saltus simulate study.toml", "saltus info study.toml"):
        assert command in result.stdout
    shown = result.stdout[result.stdout.index("[model]") :]
    (tmp_path / "study.toml").write_text("\n".join(line.strip() for line in shown.splitlines()))
    from saltus.config import load_study

    # what help shows is a study
    assert load_study(tmp_path / "study.toml").settings().arguments["periods"] == 20


def test_the_version(saltus):
    assert saltus("--version").stdout == f"saltus {package.__version__}\n"


def test_help_imports_nothing_heavy():
    script = (
        "import sys; sys.argv = ['saltus', '--help']\nfrom saltus.cli import main\ntry:\n   "
        f" main()\nexcept SystemExit:\n    print('heavy:', *(set({HEAVY!r}) & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.splitlines()[-1] == "heavy:"


@pytest.mark.parametrize(
    "arguments",
    [["simulte"], ["simulate"], ["simulate", "a.toml", "--outputs", "b"], ["info", "--nope"]],
)
def test_wrong_use_ends_with_status_2(saltus, arguments):
    result = saltus(*arguments)
    assert result.exit_code == 2
    assert "Usage: saltus" in result.stderr


def test_a_terminal_of_few_letters_shows_the_others_as_escapes(tmp_path):
    (tmp_path / "größe.toml").write_text('[model]\ntype = "WallOscillator"\n')
    environment = os.environ | {
        "PYTHONIOENCODING": "ascii",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-m", "saltus", "info", "größe.toml"]
    done = subprocess.run(
        command, capture_output=True, cwd=tmp_path, env=environment, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert rb"WallOscillator from gr\xf6\xdfe.toml" in done.stdout


@pytest.mark.parametrize(("own", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_linear_algebra_has_one_thread_unless_the_user_says_otherwise(own, threads):
    """Before numpy is loaded, which reads it then."""
    script = (
        "import os, sys; sys.argv = ['saltus', '--version']\nfrom saltus.cli import main\ntry:\n   "
        " main()\nexcept SystemExit:\n    print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in"
        " sys.modules)"
    )
    clean = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, env=clean | own
    )
    assert done.stdout.split()[-2:] == [threads, "False"]
