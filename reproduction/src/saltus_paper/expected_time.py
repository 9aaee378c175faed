"""How long a reproduction takes here: the work of each part, and the speed of this machine, from a
measured second of motions.
"""

from __future__ import annotations

import time
from collections.abc import Iterable

import numpy as np

import saltus
from saltus.flow import available_cores
from saltus_paper.figures.figure import PaperFigure
from saltus_paper.figures.harmonic_loads import under_force
from saltus_paper.toml_tables import toml_table

MEASURED = 0.5  # seconds for which motions are followed
# of one batch of them
MOTIONS = 64
PERIODS = 50
USUAL = 60.0  # seconds for a part that is not in the table


def measured_speed() -> float:
    """Forcing periods of the metainterface that one core follows in a second of the clock; the code
    for it is compiled before.
    """
    theta = np.linspace(-1.0, 1.0, MOTIONS)
    saltus.simulate_many(under_force(), theta=theta, periods=1, threads=1)
    done = 0
    start = time.perf_counter()
    while time.perf_counter() - start < MEASURED:
        saltus.simulate_many(under_force(), theta=theta, periods=PERIODS, threads=1)
        done += MOTIONS * PERIODS
    return done / (time.perf_counter() - start)


def expected_seconds(figures: Iterable[PaperFigure], speed: float) -> dict[str, float]:
    """The seconds of one core for each of these parts at this speed, by name, from
    `expected_time.toml`.
    """
    table = toml_table("expected_time.toml")
    slower = table["speed"] / speed
    return {
        figure.name: slower * table[figure.effort].get(figure.name, USUAL) for figure in figures
    }


def on_the_clock(seconds: float) -> str:
    """So many seconds of one core on the cores that there are, in words: "20 s", "4 min"."""
    seconds /= available_cores()
    return f"{5 * max(1, round(seconds / 5))} s" if seconds < 90 else f"{round(seconds / 60)} min"
