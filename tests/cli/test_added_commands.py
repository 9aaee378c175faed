"""Commands of other packages: they are added by entry points, and one that is missing or broken
says so in a sentence.
"""

import sys
from importlib.metadata import EntryPoint

import pytest
import typer
from typer.testing import CliRunner

from saltus import ParameterError
from saltus.cli import app as added_commands


def greet(name: str, loud: bool = False) -> None:
    """Greet somebody."""
    if name == "nobody":
        raise ParameterError("nobody cannot be greeted")
    print(name.upper() if loud else name)


@pytest.fixture
def run(monkeypatch):
    """Run a command line to which these entry points add commands; its exit status, and what it
    says.
    """

    def with_entries(entries, *arguments):
        points = [EntryPoint(name, value, added_commands.GROUP) for name, value in entries.items()]
        monkeypatch.setattr(added_commands, "entry_points", lambda group: points)
        app = typer.Typer()
        added_commands.add_commands(app)
        result = CliRunner().invoke(app, arguments)
        return result.exit_code, result.stdout + result.stderr

    monkeypatch.setitem(sys.modules, "a_package", sys.modules[__name__])
    return with_entries


def test_a_command_is_added_with_its_arguments_and_options(run):
    assert run({"greet": "a_package:greet"}, "greet", "you", "--loud") == (0, "YOU\n")


def test_its_errors_end_with_one_sentence(run):
    assert run({"greet": "a_package:greet"}, "greet", "nobody") == (
        2,
        "saltus: nobody cannot be greeted\n",
    )


@pytest.mark.parametrize(
    "command", [["reproduce"], ["reproduce", "fig04", "--force"], ["report", "results"]]
)
def test_without_its_package_a_known_command_says_how_to_get_it(run, command):
    status, said = run({}, *command)
    assert status == 2
    assert said.count("\n") == 1
    assert "comes with the package saltus-paper" in said
    assert "make reproduce" in said


def test_a_broken_package_breaks_its_own_command_only(run):
    entries = {"greet": "a_package:greet", "broken": "a_package_that_is_not_there:command"}
    assert run(entries, "greet", "you") == (0, "you\n")
    status, said = run(entries, "broken")
    assert (status, said.count("\n")) == (2, 1)
    assert "`saltus broken` cannot be loaded" in said
