"""The codebook of docs/howto/results.md has every column that tables of results have."""

import re
from pathlib import Path

import numpy as np
import pytest

import saltus

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "results.md"
SYSTEM = saltus.System(
    model=saltus.WallOscillator(damping=0.1),
    load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.5)),
    impact=saltus.VelocityReduction(0.8),
)
STATES = {"x", "velocity"}


def branch():
    return saltus.continue_orbit(saltus.find_orbit(SYSTEM, x=0.0), "load.frequency", (1.1, 1.3))


RESULTS = {
    "branches": branch,
    "spectra": lambda: saltus.response_spectrum(
        SYSTEM, bounds=(1.1, 1.3), effort="quick", max_period=1
    ),
    "special points": lambda: saltus.continue_orbit(
        saltus.find_orbit(SYSTEM, x=0.0), "load.frequency", (1.1, 1.6)
    ),
    "sweeps": lambda: saltus.frequency_sweep(SYSTEM, [1.1, 1.2], x=0.0),
    "ensembles": lambda: saltus.simulate_many(SYSTEM, x=np.array([0.0, 0.1]), periods=3),
    "motions": lambda: saltus.simulate(SYSTEM, x=0.0, periods=2),
}


def known_columns(kind):
    """The columns that the codebook has for a kind of result."""
    section = PAGE.read_text(encoding="utf-8").partition("## What the columns are")[2]
    known = set(STATES)
    for row in re.findall(r"^\| (.+?) \| (.+?) \| .+ \|$", section, re.MULTILINE):
        if kind in row[1] or row[1] == "all":
            known |= set(re.findall(r"`([^`]+)`", row[0]))
    return known


@pytest.mark.parametrize("kind", RESULTS)
def test_every_column_is_in_the_codebook(kind):
    table = ("special",) if kind == "special points" else ()
    columns = [str(name) for name in saltus.to_pandas(RESULTS[kind](), *table).columns]
    known = known_columns(kind)
    begins = tuple(name.removesuffix("...") for name in known if name.endswith("..."))
    missing = [
        name
        for name in columns
        if re.sub(r"_\d+$", "", name) not in known and not name.startswith(begins or ("?",))
    ]
    assert missing == []
