"""Why a motion ends on what it is said to end on, or why that is not decided: a sentence for each reason."""

from __future__ import annotations

from saltus.enumerations import NumberedSentence


class Reason(NumberedSentence):
    """The reasons of verdicts, of one motion or of many; `sentence.format` fills in the numbers."""

    NOT_SURE = 0, "{seen}, which regular motion and weak chaos may both show{torus}"
    CHAOS = (
        1,
        "{seen}, and none of those beside it settles any more, which excludes transients of a mean life below {life:.3g} periods",
    )
    TRANSIENT = 2, "{seen}, but {gone} of the motions beside it settle, after {life:.3g} forcing periods in the mean: a transient"
    FEW_SETTLED = 3, "{seen}, and {gone} of the motions beside it settle: too few to tell a long transient from chaos beside one"
    COMING_TOGETHER = (
        4,
        (
            "{seen}: motions beside it come together with it, so that it settles slowly, or on an orbit of more than "
            "{longest} forcing periods, which a larger max_period may find"
        ),
    )
    TORUS = 5, "{seen}, it does not repeat itself, and the 0-1 test sees order (K = {K:.3g})"
    LONG_PERIOD = 6, "it repeats itself every {period} forcing periods"
    NO_EXPONENTS = 7, "it comes to rest or ends before an exponent is known"
    LIMIT = 8, "a limit of the model ends it and all motions beside it"
    CAPTURED = 9, "within {periods} forcing periods it is captured by the contact, from where no later load pulls it"
    STANDS = 10, "within {periods} forcing periods it stands still, held by what no later load overcomes"
    ON_ORBIT = 11, "{seen}, on an orbit of period {period} with the largest multiplier {multiplier:.6g}"
    EQUILIBRIUM = 12, "it comes to the equilibrium at {place:.9g}, which attracts"
    DOUBTFUL_ORBIT = 13, "{seen}, but {doubt}"
    MARGIN = 14, "the motion ends at time {time:.6g}, where its margin {limit} reaches 0"
    CANNOT_GO_ON = 15, "the motion cannot go on: {error}"
    NOT_FOLLOWED = 16, "the motion cannot be followed beyond some {periods} forcing periods"
    CONSERVATIVE = 17, "under constant loads it goes on moving: it has not lost its energy, or has none to lose"
    SELF_EXCITED = (
        18,
        (
            "under constant loads it goes on moving: the ground that its friction moves on may drive it round a cycle, which has "
            "no forcing period"
        ),
    )
