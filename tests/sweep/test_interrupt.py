"""An interrupt is deferred_interrupts until it can be heeded, and the handler of before comes back."""

import os
import signal

import pytest

from saltus.sweep.interrupt import deferred_interrupts


def test_an_interrupt_waits_until_it_is_heeded():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with deferred_interrupts() as raise_if_interrupted:
            raise_if_interrupted()
            os.kill(os.getpid(), signal.SIGINT)
            with pytest.raises(KeyboardInterrupt):
                raise_if_interrupted()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
