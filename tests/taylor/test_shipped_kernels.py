"""Machine code that comes with a wheel is run in place of compiling, and only as it was written."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from saltus.taylor import shipped
from saltus.taylor.cache import with_digest, without_digest

LOADED = """
import sys
from pathlib import Path
from saltus.taylor import shipped
from saltus.taylor.kernels import load_module
shipped.FOLDER = Path(sys.argv[1])
TEXT = '''
from numba import types
from saltus.taylor.private_numba import cached_jit

@cached_jit(types.float64(types.float64))
def doubled(x):
    if x < 0:
        raise ValueError
    return 2.0 * x
'''
print(load_module("shipped", TEXT).doubled(3.0), shipped.shipped_level())
"""
OTHERS = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "SALTUS_LANES")


def run(folder, cache, more):
    """What a process prints that loads a module with wheels' code in this folder."""
    own = {name: value for name, value in os.environ.items() if name not in OTHERS}
    done = subprocess.run(
        [sys.executable, "-c", LOADED, str(folder)],
        capture_output=True,
        text=True,
        env=own | {"SALTUS_CACHE_DIR": str(cache), "PYTHONPATH": os.pathsep.join(sys.path)} | more,
        check=True,
    )
    return done.stdout.split()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A folder of a wheel's code for this machine's level, and the level."""
    level = shipped.level_of_machine()
    if level is None:
        pytest.skip("wheels have no code for this kind of processor")
    folder, cache = tmp_path_factory.mktemp("wheel"), tmp_path_factory.mktemp("built")
    # numba names another processor here, so that nothing is read from the wheel
    assert run(folder, cache, shipped.environment_of(level)) == ["6.0", "None"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shipped, "FOLDER", folder)
        assert shipped.ship(cache, level) == 1
    return folder, level


def compiled_in(cache):
    return list(cache.rglob("*.nbc"))


def test_a_wheels_code_is_run_without_compiling(wheel, tmp_path):
    folder, level = wheel
    assert run(folder, tmp_path, {}) == ["6.0", level]
    assert not compiled_in(tmp_path)


def test_a_wheels_code_names_no_folder_of_the_machine_that_built_it(wheel):
    # the exception of `doubled` holds the path of its source, and so does the text of its types
    folder, _ = wheel
    (file,) = folder.rglob(f"*{shipped.SUFFIX}")
    content = file.read_bytes()
    assert b"shipped_" in content  # the module's name is there
    for place in (folder.parent, Path(numba.__file__).parents[1]):
        assert os.fsencode(place) not in content


def test_numba_asked_for_another_processor_compiles(wheel, tmp_path):
    folder, level = wheel
    assert run(folder, tmp_path, {"NUMBA_CPU_NAME": level}) == ["6.0", "None"]
    assert compiled_in(tmp_path)


def test_a_wheels_damaged_code_is_not_run(wheel, tmp_path):
    folder, level = wheel
    (file,) = folder.rglob(f"*{shipped.SUFFIX}")
    content = file.read_bytes()
    try:
        file.write_bytes(content[:100] + bytes([content[100] ^ 1]) + content[101:])
        assert run(folder, tmp_path, {}) == ["6.0", level]
    finally:
        file.write_bytes(content)
    assert compiled_in(tmp_path)


def test_a_digest_tells_every_changed_byte():
    content = with_digest(b"code")
    assert without_digest(content) == b"code"
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1
        assert without_digest(bytes(changed)) is None
