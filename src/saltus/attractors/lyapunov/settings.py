"""The settings of all estimates of Lyapunov exponents."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LyapunovSettings:
    """How long runs are cut, how their error bars are taken, and what the comparisons allow."""

    batches: int = 16  # The least number of batches from which a standard error is taken.
    student: float = 2.131449545559323  # The two-sided 95 % point of Student's t with batches - 1 degrees of freedom.
    stretches: int = 32  # The number of stretches of a search, whose means give error bars to both halves of the run.
    longest_span: float = 6.5  # Derivatives grow and shrink by less than 1e6 in this time, a forcing period at Omega = 1.
    look_back: int = 160  # The forcing periods after the run within which it is tested whether a motion repeats itself.
    lossless: float = 1.0 - 1e-14  # A product of impact factors below this counts as below 1.
    largest_group: int = 256  # The most motions that one thread follows together: enough to make the cost of a call small.
    look: float = 0.2  # The time between checks for Ctrl-C and reports of progress, s.
    distance: float = 1e-7  # Of two trajectories: far above the error of a period, small enough for the map to be linear.
    accuracy: float = 1e-5  # The error of the exponent from two trajectories that their own numerical errors cause.
    tolerance: float = 1e-14  # The error of a step of the two trajectories.
    rounding: float = 1e-13  # Derivatives below this share of the largest are 0: contacts or frictions hold that direction.
    every: int = 16  # The number of periods between calls of the progress.


LYAPUNOV = LyapunovSettings()
