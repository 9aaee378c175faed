"""An interrupt is deferred until it can be heeded, and the handler of before comes back."""

import os
import signal

import pytest

from saltus.sweep import run, status, store
from saltus.sweep.store_files import deferred_interrupts


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


def test_an_interrupt_while_a_store_is_made_waits_until_it_is_there(
    waves_plan, tmp_path, monkeypatch
):
    """Zarr writes in a thread: if the folder were removed under it there would be its traceback
    after the message.
    """
    made = store._make

    def interrupted(plan, path):
        os.kill(os.getpid(), signal.SIGINT)
        made(plan, path)

    monkeypatch.setattr(store, "_make", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run(waves_plan(), tmp_path / "store")
    finally:
        signal.signal(signal.SIGINT, before)
    assert status(tmp_path / "store").done == 0
    assert [path.name for path in tmp_path.iterdir() if path.name.endswith(".part")] == []
