"""`saltus doctor`: the machine and packages on which saltus runs, and whether it computes correctly
there.
"""

from __future__ import annotations

import math
import os
import platform
import tempfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from saltus.cli.guard import BAD_INPUT, stop
from saltus.cli.info_command import Block, Row, block_table
from saltus.errors import ParameterError, SaltusError

if TYPE_CHECKING:
    import numpy as np

# default_rng(12345).random(3) in NumPy's documentation of its generators
DOCUMENTED = (0.22733602, 0.31675834, 0.79736546)


def print_doctor(compile_all: bool = False) -> None:
    """Print the machine, the cache and the versions, test what saltus assumes of other packages,
    then a motion with a closed form, alone and in lanes. If asked, compile all kernels before.

    If anything is wrong, the command ends with one sentence about it, after everything is printed.
    """
    console = Console(highlight=False)
    wrong: list[str] = []
    if compile_all:
        _compile(console)
    for block in (
        _machine(),
        _cache(wrong),
        _versions(wrong),
        _leaned_on(wrong),
        _trial(console, wrong),
    ):
        console.print(f"\n{block.title}", style="bold", markup=False)
        console.print(block_table(block))
    if wrong:
        stop("; ".join(wrong), BAD_INPUT)
    console.print("\nsaltus works here.")


def _compile(console: Console) -> None:
    """Compile the kernels that are not compiled yet."""
    from saltus.flow import available_cores
    from saltus.preparation import compile_kernels

    with console.status("compiling all kernels") as status:
        for name, left in compile_kernels(available_cores()):
            console.print(f"compiled: {name}", markup=False)
            status.update(f"compiling, {left} left")


def _machine() -> Block:
    from llvmlite.binding import get_host_cpu_name

    from saltus.checks import free_memory
    from saltus.flow import available_cores, card_seen
    from saltus.taylor.vectors import WIDTH

    rows: list[Row] = [
        ("system", platform.platform()),
        ("processor", get_host_cpu_name()),
        ("cores", f"{available_cores()} that this process may use"),
        ("memory", f"{free_memory() / 2**30:.1f} GiB free"),
        (
            "lanes",
            f"{WIDTH} motions at once in a vector"
            + (" (SALTUS_LANES)" if "SALTUS_LANES" in os.environ else ""),
        ),
        ("card", card_seen()),
    ]
    return Block("Machine", rows)


def _cache(wrong: list[str]) -> Block:
    from saltus.taylor import cache_directory, shipped_level

    folder = cache_directory()  # warns if another folder than the usual one is used, and why
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 2**20
    kernels = sum(path.suffix == ".py" for path in files)
    wanted = os.environ.get("SALTUS_CACHE_DIR")
    if wanted and not folder.is_relative_to(Path(wanted)):
        wrong.append(f"compiled code is not kept in {wanted}, which SALTUS_CACHE_DIR names")
    rows: list[Row] = [
        ("folder", str(folder)),
        ("compiled", f"{kernels} kernels and models, {size:.0f} MiB"),
        ("shipped", f"kernels for {level}" if (level := shipped_level()) else "none"),
        (
            "private",
            (
                "yes: it is the user's own, nobody else may write to it, and code is compared with "
                "its digest before it runs"
            ),
        ),
    ]
    return Block("Compiled code", rows)


def _versions(wrong: list[str]) -> Block:
    from saltus import __version__

    rows: list[Row] = [
        ("saltus", __version__, "", ""),
        ("Python", platform.python_version(), ">=3.11", ""),
    ]
    try:
        rows += _requirements(wrong)
    except metadata.PackageNotFoundError:
        wrong.append(
            "saltus is not installed but run from its files, so the versions were not compared "
            "with those allowed"
        )
    return Block("Versions", rows, ("", "installed", "allowed", ""))


def _requirements(wrong: list[str]) -> Iterator[tuple[str, str, str, str]]:
    """Each package that saltus needs, and each installed one that its extras need."""
    from packaging.requirements import Requirement

    for text in metadata.requires("saltus") or []:
        need = Requirement(text)
        extra = need.marker is not None and "extra" in str(need.marker)
        if extra and not need.marker.evaluate({"extra": "cluster"}):  # type: ignore[union-attr]
            continue
        try:
            there = metadata.version(need.name)
        except metadata.PackageNotFoundError:
            there = ""
        fits = need.specifier.contains(there, prereleases=True) if there else extra
        if not fits:
            wrong.append(
                f"{need.name} {there or 'is missing:'} {'is not allowed:' if there else ''} "
                f"saltus needs {need}"
            )
        remark = (
            'for clusters: pip install ".[cluster]"'
            if extra and not there
            else ""
            if fits
            else "not allowed"
        )
        yield need.name, there or "no", str(need.specifier), remark


def _leaned_on(wrong: list[str]) -> Block:
    """Tests of what saltus relies on in other packages, if its loss would cause no error
    elsewhere.
    """
    trials = {
        "public functions (lazy_loader)": (
            _answers,
            "an unknown argument is not answered with the near ones",
        ),
        "netCDF files (xarray, h5netcdf, h5py)": (
            _comes_back,
            "a dataset does not come back from its file as it was",
        ),
        "stores (Zarr, numcodecs)": (_notices, "a flipped bit in a chunk is not noticed"),
        "random numbers (NumPy)": (
            _repeats,
            "a seed gives other random numbers than in NumPy's documentation",
        ),
    }
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for what, (sound, loss) in trials.items():
            holds = sound(Path(folder))
            rows.append((what, "as saltus needs them" if holds else loss))
            wrong += [] if holds else [f"{what}: {loss}"]
    return Block("Other packages", rows)


def _answers(_: Path) -> bool:
    import saltus

    try:
        saltus.theory.final_time(perod=5.0, e=0.9)  # type: ignore[call-arg]
    except ParameterError as error:
        return error.parameter == "perod"
    except Exception:
        return False
    return False


def _comes_back(folder: Path) -> bool:
    import xarray

    from saltus.files import read_dataset, write_dataset

    values = {
        "number": ("x", [1.5, math.nan]),
        "text": ("x", ["a", "beta"]),
        "whole": ("x", [1, -1]),
    }
    data = xarray.Dataset(values, coords={"x": [0.0, 1.0]}, attrs={"kind": "trial", "list": [1, 2]})
    tree = xarray.DataTree.from_dict({"/": xarray.Dataset(attrs={"kind": "tree"}), "/part": data})
    first = write_dataset(folder / "first.nc", tree).read_bytes()
    again = write_dataset(folder / "again.nc", tree).read_bytes()
    return first == again and bool(read_dataset(folder / "first.nc").identical(tree))


def _notices(folder: Path) -> bool:
    import numpy as np

    from saltus.sweep import Plan, Variable, run, status

    store = folder / "trial.zarr"
    axes = {"x": np.arange(4.0)}
    run(
        Plan(
            function=f"{__name__}:trial_chunk",
            axes=axes,
            chunk={"x": 2},
            variables={"y": Variable()},
        ),
        store,
    )
    sound = not status(store, verify=True).damaged
    chunk = store / "y" / "c" / "1"
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 1
    chunk.write_bytes(content)
    return sound and bool(status(store, verify=True).damaged)


def trial_chunk(_: Any, block: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The function that the trial of a store computes."""
    return {"y": block["x"] ** 2}


def _repeats(_: Path) -> bool:
    import numpy as np

    return bool(
        np.allclose(np.random.default_rng(12345).random(3), DOCUMENTED, rtol=0.0, atol=1e-8)
    )


def _trial(console: Console, wrong: list[str]) -> Block:
    """The trial motion: x'' + x = 0 from (0, 1) with a wall at x = 1/2 and e = 1, with impacts at
    pi/6 + 4 pi n / 3.
    """
    import numpy as np

    from saltus.flow import has_card, simulate, simulate_many
    from saltus.systems import Harmonic, Load, System, VelocityReduction, WallOscillator

    system = System(
        model=WallOscillator(wall=0.5),
        load=Load(frequency=1.0, force=Harmonic(0.0)),
        impact=VelocityReduction(1.0),
    )
    periods = 10  # fifteen impacts, which would show a wrong root or a wrong impact law
    since = (2 * math.pi * periods - math.pi / 6) % (4 * math.pi / 3)
    x = math.sin(5 * math.pi / 6 + since)
    velocity = math.cos(5 * math.pi / 6 + since)
    with console.status("compiling what is not compiled yet, and trying it"):
        one = simulate(system, x=0.0, velocity=1.0, periods=periods, tol=1e-14)
        many = simulate_many(system, x=np.zeros(64), velocity=1.0, periods=periods, tol=1e-14)
    errors = {
        "one motion": math.hypot(one.x - x, one.velocity - velocity),
        "64 motions in lanes": float(np.hypot(many.x - x, many.velocity - velocity).max()),
    }
    for name, error in errors.items():
        if not error <= 1e-12:  # at tol = 1e-14 rounding alone gives some 1e-15 for each impact
            wrong.append(
                f"{name} of an oscillator with a wall is wrong by {error:.1e}: please tell the "
                "developers"
            )
    rows: list[Row] = [
        (name, f"differs from the closed form by {error:.1e}") for name, error in errors.items()
    ]
    if has_card():
        with console.status("trying the card"):
            rows.append(("card", _rate_of_card(system)))
    return Block("Trial", rows)


def _rate_of_card(system: Any) -> str:
    """How fast the card follows motions of a system, copies included; or why it does not."""
    import time

    import numpy as np

    from saltus.flow import simulate_many

    x = np.linspace(-0.5, 0.4, 100_000)
    taken = math.inf
    try:
        for _ in range(2):  # its code is made in the first one
            begin = time.perf_counter()
            simulate_many(system, x=x, periods=100, sample=(), device="cuda")
            taken = min(taken, time.perf_counter() - begin)
    except SaltusError as error:
        return f"has failed: {error}"
    return f"{x.size * 100 / taken / 1e6:.0f} million forcing periods a second"
