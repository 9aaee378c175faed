"""An interrupt is heeded wherever it falls, and nothing else is taken for one."""

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from saltus.cli import guard
from saltus.cli.guard import interruptible


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(guard, "REMINDER_AFTER", 0.05)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt_here():
    os.kill(os.getpid(), signal.SIGINT)
    threading.Event().wait(30)  # an interrupt ends it


def test_an_interrupt_ends_the_block():
    with pytest.raises(KeyboardInterrupt), interruptible():
        interrupt_here()


def test_an_interrupt_that_becomes_another_error_is_still_one():
    def disguised():
        try:
            interrupt_here()
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    with pytest.raises(KeyboardInterrupt), interruptible():
        disguised()


def test_an_interrupt_that_is_dropped_comes_again(capsys):
    callback = ctypes.CFUNCTYPE(None)(interrupt_here)  # as llvmlite's
    start = time.monotonic()

    def dropped():
        callback()
        threading.Event().wait(30)

    with pytest.raises(KeyboardInterrupt), interruptible():
        dropped()
    assert time.monotonic() - start < 20  # it did not wait to the end
    assert capsys.readouterr().err == ""


def test_an_error_of_its_own_stays_what_it_is():
    with pytest.raises(ZeroDivisionError), interruptible():
        1 / 0  # noqa: B018


def test_what_was_there_before_is_there_again():
    with interruptible():
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_process_that_ignores_interrupts_goes_on():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interruptible():
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_an_interrupt_outside_any_command_says_the_same():
    """As while modules are loaded, where an interrupt may become another error, or in typer, which
    ends without a word.
    """
    script = (
        "import os, signal, sys, saltus.cli\n"
        "import saltus.cli.app as app\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "app.begin = lambda: os.kill(os.getpid(), signal.SIGINT)\n"
        "saltus.cli.main()\n"
        "print('went on')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "saltus: interrupted; no file was left half-written\n"
