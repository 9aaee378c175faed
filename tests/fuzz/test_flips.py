"""Single flipped bits in files of every kind: each is noticed, or what is read is as it was.

50 bits of each kind in each test run, in `make thorough` 1500, or as many as SALTUS_FLIPS says; the
same in every run.
"""

import os
import random
import shutil

import bad_inputs
import pytest
import tomli_w

from saltus import response_spectrum
from saltus.errors import SaltusError
from saltus.files import read_dataset, write_dataset
from saltus.sweep import open_store, status
from saltus.systems import System

SYSTEM = {name: bad_inputs.STUDY[name] for name in ("model", "load")}
CHART = {
    "horizontal": [0.1, 0.2, 0.3],
    "vertical": [-0.5, -0.4],
    "starts": 2,
    "periods": 40,
    "rows": 1,
}
KINDS = ("chart", "diagram", "netcdf", "study")
THOROUGH = int(os.environ.get("SALTUS_FLIPS", "1500"))


class Computed(BaseException):
    """Something would be computed for a study that is another one."""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A study, the store of its chart, the store of a diagram with its parts, and the diagram's
    netCDF file.
    """
    from saltus.cli.run_command import run_study

    folder = tmp_path_factory.mktemp("results")
    (folder / "study.toml").write_text(tomli_w.dumps(SYSTEM | {"stability_chart": CHART}))
    run_study(folder / "study.toml", folder / "out", False, None)
    system = System.from_dict(SYSTEM)
    asked = {"effort": "quick", "max_period": 1, "values": [0.98, 1.02], "starts": 2}
    diagram = response_spectrum(
        system, "load.frequency", (0.95, 1.05), **asked, store=folder / "diagram.zarr"
    )
    write_dataset(folder / "diagram.nc", diagram)
    return folder


def files_of(kind, folder):
    """The files of a kind, of which every one is flipped equally often."""
    single = {"netcdf": folder / "diagram.nc", "study": folder / "study.toml"}
    if kind in single:
        return [single[kind]]
    store = {"chart": folder / "out" / "stability_chart.zarr", "diagram": folder / "diagram.zarr"}[
        kind
    ]
    return sorted(file for file in store.rglob("*") if file.is_file())


def home_of(kind, folder, file):
    """What a file is read as part of: itself, a store, or of a diagram's search a part of its
    store.
    """
    if kind in ("netcdf", "study"):
        return file
    homes = ("parts", "out", folder.name)
    return next(
        place
        for place in file.parents
        if (place / "zarr.json").is_file() and place.parent.name in homes
    )


def content_of(kind, folder, home):
    """What is read of the flipped file's home.

    Raises
    ------
    SaltusError
        The damage is noticed.
    """
    if kind == "netcdf":
        return read_dataset(home)
    if kind == "study":
        return asked_again(folder)
    if status(home, verify=True).damaged:
        raise SaltusError("status --verify names it")
    return open_store(home).load()


def asked_again(folder):
    """The chart that the study gives where its store is there: that store's, or a refusal; another
    one would be computed.
    """
    from saltus.cli.run_command import run_study

    run_study(folder / "study.toml", folder / "out", False, None)
    return open_store(folder / "out" / "stability_chart.zarr").load()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [20, pytest.param(THOROUGH, marks=pytest.mark.thorough)])
def test_a_flipped_bit_is_noticed_or_harmless(results, tmp_path, monkeypatch, kind, count):
    from saltus.sweep import execution

    def begun(*_):
        raise Computed

    folder = shutil.copytree(results, tmp_path / "copy")
    rng, files = random.Random(kind), files_of(kind, folder)
    homes = {file: home_of(kind, folder, file) for file in files}
    good = {home: content_of(kind, folder, home) for home in {*homes.values()}}
    monkeypatch.setattr(execution, "attempt", begun)
    told = {"noticed": 0, "harmless": 0}
    for case in range(count):
        file = files[case % len(files)]
        content = file.read_bytes()
        place = rng.randrange(8 * len(content))
        flipped = bytearray(content)
        flipped[place // 8] ^= 1 << place % 8
        file.write_bytes(flipped)
        try:
            read = content_of(kind, folder, homes[file])
        except SaltusError:
            told["noticed"] += 1
        else:
            assert read.identical(good[homes[file]]), (
                f"case {case}: bit {place} of {file} is read in silence"
            )
            told["harmless"] += 1
        file.write_bytes(content)
    print(kind, told)  # the counts, with -s
    assert told["noticed"] > count / 2
    assert kind == "study" or not told["harmless"]
