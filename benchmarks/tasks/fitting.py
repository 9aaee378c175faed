"""What a fit costs with exact derivatives, beside SciPy's two-point differences of the same motions
at the same final error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from measure import interleave
from scipy.optimize import least_squares

import saltus

DURATION, COUNT, SIGMA = 12.0, 300, 0.01
NEAR = 1e-5  # standard errors by which the result may miss the least squares
SIX = {  # the true value, the guess, the bounds
    "model.damping": (0.1, 0.103, (0.0, 0.5)),
    "impact.e": (0.9, 0.927, (0.6, 1.0)),
    "model.beta0": (np.deg2rad(80), 1.41, (1.1, 1.56)),
    "load.horizontal.amplitude": (0.5, 0.515, (0.2, 1.0)),
    "load.vertical": (-0.5, -0.515, (-1.0, -0.2)),
    "start.theta": (0.3, 0.309, (0.05, 0.6)),
}


@dataclass(frozen=True)
class Fitted:
    """A problem: what is to be found from one noisy record of theta."""

    names: tuple[str, ...]
    system: saltus.System
    record: saltus.Measurement

    def exactly(self) -> saltus.Fit:
        """By saltus, from the one guess."""
        return saltus.fit(
            self.system, self.record, {name: SIX[name][2] for name in self.names}, starts=1
        )

    def by_differences(self, tolerance: float) -> Any:
        """By SciPy, as one would write it without derivatives; `tolerance` is where it ends."""
        low, high = np.array([SIX[name][2] for name in self.names]).T

        def residuals(x: np.ndarray) -> np.ndarray:
            given = dict(zip(self.names, x.tolist(), strict=True))
            theta = given.pop("start.theta", self.record.start["theta"])
            motion = saltus.simulate(
                self.system.with_(given), theta=theta, duration=DURATION, tol=1e-11
            )
            return (motion.at(self.record.time)[0] - self.record.values["theta"]) / SIGMA

        start = [SIX[name][1] for name in self.names]
        ends = {"xtol": tolerance, "ftol": tolerance, "gtol": tolerance}
        return least_squares(residuals, start, bounds=(low, high), x_scale="jac", **ends)


def problem(names: tuple[str, ...]) -> Fitted:
    """The record of the true system, and the system with the guess."""
    true = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
        impact=saltus.VelocityReduction(0.9),
    )
    times = np.linspace(0.0, DURATION, COUNT)
    theta = saltus.simulate(true, theta=0.3, duration=DURATION).at(times)[0]
    values = {"theta": theta + SIGMA * np.random.default_rng(0).normal(size=COUNT)}
    begin = {"theta": SIX["start.theta"][1] if "start.theta" in names else 0.3}
    guess = true.with_({name: SIX[name][1] for name in names if name != "start.theta"})
    return Fitted(
        names, guess, saltus.Measurement(start=begin, time=times, values=values, sigma=SIGMA)
    )


def fits(rounds: int) -> list[dict[str, Any]]:
    """One row for one and for six unknowns: milliseconds of both, their ratio, and by how many
    standard errors they miss.
    """
    rows: list[dict[str, Any]] = []
    tasks: dict[tuple[int, str], Any] = {}
    for names in (("model.damping",), tuple(SIX)):
        this = problem(names)
        best, errors = this.by_differences(1e-15).x, np.array(list(this.exactly().errors.values()))

        def missed(x: Any, best: Any = best, errors: Any = errors) -> float:
            return float(np.max(np.abs(np.subtract(x, best)) / errors))

        looser = (10.0**-k for k in range(4, 15))  # SciPy's own default is 1e-8
        tolerance = next(each for each in looser if missed(this.by_differences(each).x) < NEAR)
        found, other = this.exactly(), this.by_differences(tolerance)
        rows.append(
            {
                "unknowns": len(names),
                "missed": missed(list(found.values.values())),
                "missed_by_differences": missed(other.x),
                "tolerance": tolerance,
            }
        )
        tasks[len(names), "exact"] = this.exactly
        tasks[len(names), "differences"] = lambda this=this, tolerance=tolerance: (
            this.by_differences(tolerance)
        )
    timings = interleave(tasks, rounds, one_core=True)
    for row in rows:
        both = [
            timings[row["unknowns"], way].per(1, 1e3).median for way in ("exact", "differences")
        ]
        row |= {"exact": both[0], "differences": both[1], "ratio": both[1] / both[0]}
    return rows
