"""`saltus doctor`: it finds what is wrong, and says so."""

import re
from importlib import metadata


def test_doctor_finds_a_closed_form(saltus):
    found = saltus("doctor")
    assert found.exit_code == 0, found.output
    assert "saltus works here." in found.stdout


def test_doctor_names_what_is_too_old(saltus, monkeypatch):
    version = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: "0.1" if name == "scipy" else version(name))
    found = saltus("doctor")
    assert found.exit_code == 2
    assert re.search(r"saltus: scipy 0\.1 is not allowed: saltus needs scipy", found.stderr)
