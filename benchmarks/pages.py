"""The page that computes, measured in a real Chromium: written to results/pages.md with the rest,
or alone by `python pages.py`.

A page is opened from disk; its slider is moved at various instants of a frame; the mechanism plays;
basins are computed in workers. Each figure is taken in several rounds, and the best one is said
beside the median: other work on the machine slows a browser more than it slows Python.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import saltus
from saltus.files import write_text

sys.path[:0] = [
    str(Path(__file__).parents[1] / "tests"),
    str(Path(__file__).parents[1] / "tests" / "web"),
]

LIMITS = {
    "size": (200.0, "kB of one file"),
    "first picture": (1.0, "s after it is opened from disk"),
    "slider": (
        25.0,
        "ms from a move of the slider to the drawn frame, 95 of 100 moves, 60 forcing periods",
    ),
    "slider, processor time": (
        25.0,
        "ms of the page's own thread for a move, in the mean, whatever else the machine does",
    ),
    "frame": (1000 / 60, "ms between two frames while the mechanism moves, 95 of 100"),
    "work": (1000 / 60, "ms of work in a frame while the mechanism moves, 95 of 100"),
    "readable": (1.0, "s until a 200 x 200 basin of 100 periods is known at every eighth cell"),
    "complete": (60.0, "s until it is complete"),
}  # what a page is to keep to
MOVES = """(async () => {
  const slider = document.querySelector('[data-path="load.horizontal.amplitude"] .slider');
  const found = [];
  const pause = (ms) => new Promise((done) => setTimeout(done, ms));
  for (let i = 0; i < 60; i++) {
    await pause(5 + (i * 7919) % 17);
    const from = performance.now();
    slider.value = String(400 + (i * 37) % 200);
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    await new Promise((done) => requestAnimationFrame(done));
    await pause(0);
    found.push(performance.now() - from);
  }
  return found;
})()"""
PLAYS = """(async () => {
  const [between, work] = [[], []];
  saltusPage.store.set({ playing: true });
  const drawn = saltusPage.cursorChanged.bind(saltusPage);
  saltusPage.cursorChanged = () => { const from = performance.now(); drawn(); work.push(performance.now() - from); };
  let last = await new Promise((done) => requestAnimationFrame(done));
  for (let i = 0; i < 180; i++) {
    const now = await new Promise((done) => requestAnimationFrame(done));
    between.push(now - last);
    last = now;
  }
  saltusPage.store.set({ playing: false });
  saltusPage.cursorChanged = drawn;
  return [between, work];
})()"""
BASINS = """(async () => {
  saltusPage.store.set({ windows: { phase: [-1.8, 1.8, -1, 1] } });
  const from = performance.now();
  saltusPage.toggleBasins();
  const until = (done) => new Promise((tell) => {
    const look = () => (done() ? tell(performance.now() - from) : setTimeout(look, 5));
    look();
  });
  const readable = await until(() => saltusPage.basins.counted >= 625);
  const complete = await until(() => saltusPage.basins.done);
  return [readable / 1000, complete / 1000, saltusPage.basins.counted];
})()"""


def system() -> saltus.System:
    """The tristable cell of the paper, shaken a little: orbits about both buckled states, impacts
    between them, and rest.
    """
    model = saltus.Metainterface(beta0=math.radians(80), damping=0.1)
    load = saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.1), vertical=-1.5)
    return saltus.System(model=model, load=load, impact=saltus.VelocityReduction(0.8))


def measured(rounds: int) -> dict[str, list[float]] | None:
    """Each figure in every round; None where no browser is installed."""
    from computing_page import BROWSER, READY, ComputingPage

    if BROWSER is None:
        return None
    found: dict[str, list[float]] = {name: [] for name in LIMITS}
    with tempfile.TemporaryDirectory() as folder:
        file = saltus.page(system(), path=Path(folder) / "cell.html", theta=0.4, periods=60)
        found["size"].append(file.stat().st_size / 1000)
        page = ComputingPage(BROWSER, Path(folder) / "profile")
        page("Performance.enable", timeDomain="threadTicks")
        for _ in range(rounds):
            page.open(file, 1440, 1000)
            found["first picture"].append(
                page.evaluate(f"{READY}.then(() => saltusPage.drawnAt / 1000)")
            )
            before = _processor_time(page)
            times = page.evaluate(MOVES)
            found["slider"].append(_late(times))
            found["slider, processor time"].append(
                1000 * (_processor_time(page) - before) / len(times)
            )
            between, work = page.evaluate(PLAYS)
            found["frame"].append(_late(between))
            found["work"].append(_late(work))
            readable, complete, cells = page.evaluate(BASINS)
            assert cells == 200 * 200
            found["readable"].append(readable)
            found["complete"].append(complete)
        page.close()
    return found


def _processor_time(page: Any) -> float:
    """Seconds that the thread of the page has worked."""
    metrics = page("Performance.getMetrics")["metrics"]
    return next(float(each["value"]) for each in metrics if each["name"] == "TaskDuration")


def _late(times: list[float]) -> float:
    return float(np.percentile(times, 95))


def beside_pages(
    head: dict[str, Any], quick: bool, folder: Path, tell: Callable[[str], object] = print
) -> None:
    """Measure, and write `pages.md` into a folder."""
    found = measured(1 if quick else 5)
    if found is None:
        tell("pages: no Chromium is installed here")
        return
    lines = [
        "# The page that computes, in Chromium",
        "",
        *(f"* {name}: {value}" for name, value in head.items()),
        "",
    ]
    lines += ["| what | is to stay below | best round | median |", "|---|---|---|---|"]
    for name, (limit, meaning) in LIMITS.items():
        best, median = min(found[name]), float(np.median(found[name]))
        lines.append(f"| {name}: {meaning} | {limit:.3g} | {best:.3g} | {median:.3g} |")
    tell(write_text(folder / "pages.md", "\n".join(lines) + "\n").read_text())


if __name__ == "__main__":
    from machine import about

    target = Path(__file__).parents[1] / "results" / "benchmarks"
    target.mkdir(parents=True, exist_ok=True)
    beside_pages(about(("saltus", "numpy")), "--quick" in sys.argv, target)
