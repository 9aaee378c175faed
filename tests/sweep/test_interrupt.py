"""An interrupt is remembered until it can be heeded, and the handler of before comes back."""

import os
import signal

import pytest

from saltus.sweep.interrupt import remembered


def test_an_interrupt_waits_until_it_is_heeded():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with remembered() as heed:
            heed()
            os.kill(os.getpid(), signal.SIGINT)
            with pytest.raises(KeyboardInterrupt):
                heed()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
