"""How long the next step is: as long as the curve changes by a chosen amount in it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StepSettings:
    """The control of the steps, whose lengths are in the norm of the curve."""

    aim: float = 0.12  # the angle between the tangents of neighbouring points that a step aims at, rad
    most: float = 0.5  # the angle above which a step is taken again, shorter, rad
    longest: float = 0.1  # a thirtieth of the range of the parameter, or a tenth of a unit of the unknowns
    first: float = 1e-3  # the length of the first step
    restart: float = 1e-3  # the largest length of the first step after the equations have changed
    # The least such length: steps that end at a change may have shrunk to nothing, as the equations have no solution beyond it.
    renewed: float = 1e-6
    least: float = 1e-11  # the length below which steps have shrunk to nothing
    shrink: float = 0.4  # the length of a step that has to be taken again, as a share of the one that failed
    grow: tuple[float, float] = (0.5, 2.0)  # the least and the largest ratio of a step to the one before
    easy: int = 5  # iterations of the corrector up to which the next step may grow
    hard: float = 0.7  # after more iterations, the largest length of the next step as a share of this one
    most_points: int = 20_000  # points after which the curve is given up
    most_stretched: float = 3.0  # the largest step, in the last one, for which the curvature of the last one is of use
    off: float = 0.05  # share of a step by which its end may lie off where it was predicted: else it may be on another branch
    off_tangent: float = 0.3  # the same share where it was predicted along the tangent alone, which may itself be inexact
    beside: float = 0.1  # share of a step by which a point within it, at a given value, may lie beside the cubic through its ends
    closing: float = 0.2  # share of a step by which the first point of a curve may lie beside it for the curve to close
    ahead: float = 1e-6  # length along a tangent of the point that gives its direction after the impacts are renumbered

    def following(self, step: float, turn: float, iterations: int) -> float:
        """The length of the step after one that was accepted."""
        factor = min(self.grow[1], max(self.grow[0], self.aim / max(turn, 1e-3)))
        return min(self.longest, step * (factor if iterations <= self.easy else min(factor, self.hard)))


STEPS = StepSettings()
