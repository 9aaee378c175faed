"""Kernels that are compiled before they are needed."""

import pytest

from saltus import preparation
from saltus.errors import SaltusError


def test_a_kernel_is_compiled_by_a_process_of_its_own(monkeypatch, tmp_path):
    monkeypatch.setattr(preparation, "KERNELS", {"tables": None})
    cache = {"SALTUS_CACHE_DIR": str(tmp_path)}
    assert list(preparation.compile_kernels(2, cache)) == [("tables", 0)]
    assert list(tmp_path.rglob("fillers_*.py"))


def test_a_kernel_that_does_not_compile_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(preparation, "KERNELS", {"nothing of this name": None})
    with pytest.raises(SaltusError, match="kernel for nothing of this name could not"):
        list(preparation.compile_kernels(1, {"SALTUS_CACHE_DIR": str(tmp_path)}))
