"""The reasons of verdicts: a sentence for each, with places for its numbers."""

from __future__ import annotations

from enum import StrEnum


class Reason(StrEnum):
    """The sentences of verdicts, to be filled in by `format`."""

    CAPTURED = "within {periods} forcing periods it is captured by the contact, from where no later load pulls it"
    STANDS = "within {periods} forcing periods it stands still, held by what no later load overcomes"
    ON_ORBIT = "{seen}, on an orbit of period {period} with the largest multiplier {multiplier:.6g}"
    EQUILIBRIUM = "it comes to the equilibrium at {place:.9g}, which attracts"
    DOUBTFUL_ORBIT = "{seen}, but {doubt}"
    LIMIT = "the motion ends at time {time:.6g}, where its margin {limit} reaches 0"
    CANNOT_GO_ON = "the motion cannot go on: {error}"
    NOT_FOLLOWED = "the motion cannot be followed beyond some {periods} forcing periods"
    CONSERVATIVE = "under constant loads it goes on moving: it has not lost its energy, or has none to lose"
    SELF_EXCITED = (
        "under constant loads it goes on moving: the ground that its friction moves on may drive it round a cycle, which has no "
        "forcing period"
    )
    NO_EXPONENTS = "after {periods} forcing periods {note}"
    TRANSIENT = (
        "its largest exponent is {size}, but {left} of {companions} motions from beside its last state settle within {followed} "
        "forcing periods: the chaos is a transient"
    )
    CONTRADICTED = "its largest exponent is {size}, but the 0-1 test sees order (K = {K:.3g})"
    CHAOS = (
        "its largest exponent is {size} over {periods} forcing periods, and nothing near it settles in {followed} more{second}"
    )
    TORUS = "its exponents are 0 ({size}), it does not repeat itself, and the 0-1 test sees order (K = {K:.3g})"
    NOT_SURE = "it has not settled in {periods} forcing periods, and an exponent of {size} is not surely above 0{torus}"
