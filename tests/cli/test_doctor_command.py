"""`saltus doctor`: it finds what is wrong, and says so."""

import inspect
import re
from importlib import metadata

import numpy as np


def test_doctor_finds_a_closed_form(saltus):
    found = saltus("doctor")
    assert found.exit_code == 0, found.output
    assert "saltus works here." in found.stdout


def test_doctor_names_what_is_too_old(saltus, monkeypatch):
    version = metadata.version
    monkeypatch.setattr(
        metadata, "version", lambda name: "0.1" if name == "scipy" else version(name)
    )
    found = saltus("doctor")
    assert found.exit_code == 2
    assert re.search(r"saltus: scipy 0\.1 is not allowed: saltus needs scipy", found.stderr)


def test_doctor_names_what_another_package_no_longer_does(saltus, monkeypatch):
    """As lazy_loader 0.6, which kept the functions that it had loaded, so that nothing looked at
    their arguments; and as a generator of NumPy with other numbers."""
    from saltus import theory

    monkeypatch.setattr(theory, "final_time", inspect.unwrap(theory.final_time))
    monkeypatch.setattr(
        np.random, "default_rng", lambda seed: np.random.Generator(np.random.MT19937(seed))
    )
    found = saltus("doctor")
    assert found.exit_code == 2
    said = " ".join(found.stderr.split())
    assert (
        "public functions (lazy_loader): an unknown argument is not answered with the near ones"
        in said
    )
    assert "random numbers (NumPy): a seed gives other random numbers" in said
    assert "netCDF files" not in said


def test_doctor_says_how_to_install_what_clusters_need(saltus, monkeypatch):
    """With the name of the extra, which the table must not take for a style."""
    version = metadata.version

    def without_distributed(name):
        if name == "distributed":
            raise metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(metadata, "version", without_distributed)
    found = saltus("doctor")
    assert 'pip install ".[cluster]"' in " ".join(found.stdout.split())


def test_doctor_compiles_all_kernels_if_asked(saltus, monkeypatch):
    from saltus import preparation

    waiting = ["motions", "lanes"]
    monkeypatch.setattr(
        preparation,
        "compile_kernels",
        lambda workers: ((waiting.pop(0), len(waiting)) for _ in range(2)),
    )
    found = saltus("doctor", "--compile")
    assert found.exit_code == 0, found.output
    assert "compiled: motions" in found.stdout
    assert "compiled: lanes" in found.stdout
    assert not waiting
