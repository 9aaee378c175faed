"""How long a reproduction takes here: the work of each part, and the speed of this machine, from a
measured second of motions and of branches.

`python -m saltus_paper.expected_time` prints the effort at which the whole takes at most
REASONABLE minutes here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

import saltus
from saltus.flow import available_cores
from saltus_paper.figures.figure import EFFORTS, PaperFigure
from saltus_paper.figures.harmonic_loads import under_force
from saltus_paper.toml_tables import toml_table

MEASURED = 0.5  # seconds for which motions are followed, and branches
# of one batch of them
MOTIONS = 64
PERIODS = 50
USUAL = 30.0  # seconds for a part that is not in the table
REASONABLE = 15.0  # minutes


class Speeds(NamedTuple):
    """What one core does in a second of the clock."""

    motions: float  # forcing periods of the metainterface, in lanes
    points: float  # points of a branch of its orbits, with their special points


def measured_speeds() -> Speeds:
    """The speeds of this machine; the code for it is compiled before."""
    theta = np.linspace(-1.0, 1.0, MOTIONS)
    orbit = saltus.find_orbit(under_force(), theta=0.3)

    def motions() -> int:
        saltus.simulate_many(under_force(), theta=theta, periods=PERIODS, threads=1)
        return MOTIONS * PERIODS

    def points() -> int:
        return len(saltus.continue_orbit(orbit, "load.frequency", (0.5, 2.0)).orbits)

    return Speeds(_per_second(motions), _per_second(points))


def _per_second(work: Callable[[], int]) -> float:
    work()  # compiles
    done, start = 0, time.perf_counter()
    while time.perf_counter() - start < MEASURED:
        done += work()
    return done / (time.perf_counter() - start)


def expected_seconds(figures: Iterable[PaperFigure], speeds: Speeds) -> dict[str, float]:
    """The seconds of one core for each of these parts at these speeds, by name, from
    `expected_time.toml`.
    """
    table = toml_table("expected_time.toml")
    slower = Speeds(table["speed"] / speeds.motions, table["points"] / speeds.points)
    expected = {}
    for figure in figures:
        share = table["motions"].get(figure.name, table["motions"]["others"])
        factor = share * slower.motions + (1.0 - share) * slower.points
        seconds = table[figure.effort].get(figure.name, USUAL)
        expected[figure.name] = (1.0 + table["overhead"]) * factor * seconds
    return expected


def on_the_clock(seconds: float) -> str:
    """So many seconds of one core on the cores that there are, in words: "20 s", "4 min"."""
    seconds /= available_cores()
    return f"{5 * max(1, round(seconds / 5))} s" if seconds < 90 else f"{round(seconds / 60)} min"


def reasonable_effort(figures: Iterable[PaperFigure], speeds: Speeds, cores: float) -> str:
    """The effort at which these parts take no longer than REASONABLE; a draft where none does."""
    seconds = sum(expected_seconds(figures, speeds).values())
    standard, quick = EFFORTS
    return standard if seconds / cores < 60.0 * REASONABLE else quick


if __name__ == "__main__":
    from saltus_paper.parts import FIGURES

    print(reasonable_effort(FIGURES.values(), measured_speeds(), available_cores()))
