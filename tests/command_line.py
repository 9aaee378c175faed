"""Running the command line in this process, and in one of its own."""

import signal
import subprocess
from functools import cache

import pytest
from typer.main import get_command
from typer.testing import CliRunner

_built_once = cache(get_command)


def _heed_interrupts():
    """A process started from a background job ignores SIGINT unless told otherwise."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.fixture
def started():
    """Start processes; whatever is left of them is killed at the end."""
    processes = []

    def start(command, **options):
        processes.append(
            subprocess.Popen(command, text=True, preexec_fn=_heed_interrupts, **options)
        )
        return processes[-1]

    yield start
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def saltus(monkeypatch):
    """Run `saltus` with arguments, in this process; a traceback fails the test."""
    from saltus.cli.app import app

    # The runner builds all commands anew for each call, which takes twice as long as what most of
    # these tests ask.
    monkeypatch.setattr("typer.testing._get_command", _built_once, raising=False)

    def run(*arguments):
        result = CliRunner().invoke(
            app,
            [str(a) for a in arguments],
            prog_name="saltus",
            env={"COLUMNS": "160", "NO_COLOR": "1"},
        )
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


@pytest.fixture
def refused(saltus):
    """Run `saltus` and return the one sentence with which it refuses, with exit status 2."""

    def run(*arguments):
        result = saltus(*arguments)
        assert result.exit_code == 2
        assert result.stdout == ""
        # What goes on is told on stderr as well, before the sentence.
        *told, sentence = result.stderr.splitlines()
        assert all(": computing" in line or ": following" in line for line in told)
        assert sentence.startswith("saltus: ")
        return sentence

    return run
