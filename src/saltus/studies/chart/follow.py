"""The special point at which a stable orbit ends on the way to a neighbouring cell."""

from __future__ import annotations

import numpy as np

from saltus.orbits import Branch, SpecialPoint

STABILITY_ENDS = ("LP", "PD", "BPC", "GR", "RL", "CH")  # kinds of special points, the last two of resting orbits
AT_THE_END = 1e-6  # a special point within this share of the branch's range from its end is its end


def stability_loss(branch: Branch) -> SpecialPoint | str:
    """The special point at which the orbits of a branch lose their stability, seen from its first point, or why there is none.

    It may also be the end of the branch: an orbit that is its own mirror image, a grazing, or the end of a rest.
    """
    points = list(branch.points)
    unstable = [i for i, point in enumerate(points) if not point.orbit.stable and not point.orbit.grazes]
    known = [special for special in branch.special if special.kind in STABILITY_ENDS]
    if not unstable:
        reach = AT_THE_END * (float(np.ptp(branch.parameters)) or 1.0)
        if known and abs(known[-1].parameter - points[-1].parameter) <= reach:
            return known[-1]
        return f"no loss of stability: {branch.ends[1]}"
    if unstable[0] == 0:
        return "the orbit is not stable to its multipliers"
    if not known:
        return "no special point where the stability is lost"
    scale = np.array([np.ptp(branch.parameters) or 1.0, np.ptp(branch.amplitudes) or 1.0])
    beside = np.array([[p.parameter, p.orbit.amplitude] for p in points[unstable[0] - 1 : unstable[0] + 1]]) / scale

    def distance(special: SpecialPoint) -> float:
        spot = np.array([special.parameter, special.amplitude]) / scale
        return float(np.linalg.norm(spot - beside, axis=1).sum())

    return min(known, key=distance)
