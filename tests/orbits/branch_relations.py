"""What must be the same of a branch, wherever it is begun and whatever range is asked."""

import saltus

# special points of two runs are one if their parameters differ by less than this share of the range
SAME = 1e-6


def is_in(kind: str, parameter: float, among: list[tuple[str, float]], near: float) -> bool:
    return any(kind == k and abs(parameter - p) < near for k, p in among)


def listed(branch: saltus.Branch) -> list[tuple[str, float]]:
    return [(str(point.kind), point.parameter) for point in branch.special]


def starts_beside(branch: saltus.Branch, special, away: float):
    """An orbit on either side of a special point, about so far from it along the branch."""
    points = branch.points
    near = min(
        range(len(points)),
        key=lambda i: (
            abs(points[i].parameter - special.parameter)
            + abs(points[i].orbit.amplitude - special.amplitude)
        ),
    )
    for way in (-1, 1):
        i = near
        while 0 <= i + way < len(points):
            i += way
            orbit = points[i].orbit
            clear = abs(points[i].parameter - special.parameter) > away
            if clear and orbit.admissible and not orbit.grazes:
                yield orbit
                break


def differences(
    branch: saltus.Branch, path: str, bounds, narrower, away: float = 1e-4
) -> list[str]:
    """In what branches that are begun beside each special point differ from a branch, in all of
    some asked ranges: a special point that is not found again, one that the branch does not have,
    or an end where the branch has none.
    """
    found = []
    near = SAME * (bounds[1] - bounds[0])
    known = listed(branch)
    ends = [(end.reason.name, end.parameter) for end in branch.ends]
    for special in branch.special:
        for low, high in (bounds, *narrower):
            for orbit in starts_beside(branch, special, away):
                value = orbit.system.get(path)
                if not low < value < high:
                    continue
                again = saltus.continue_orbit(orbit, path, (low, high))
                where = (
                    f"{special.kind} {special.parameter:.9g} from {value:.9g} in ({low:.4g},"
                    f" {high:.4g})"
                )
                between = min(low, high) < special.parameter < max(low, high)
                if between and not is_in(str(special.kind), special.parameter, listed(again), near):
                    found.append(f"{where}: not found again, {listed(again)} {again.ends}")
                found += [
                    f"{where}: {kind} {parameter:.9g} is new"
                    for kind, parameter in listed(again)
                    if not is_in(kind, parameter, known, near)
                    and bounds[0] <= parameter <= bounds[1]
                ]
                found += [
                    f"{where}: ends with {end}"
                    for end in again.ends
                    if end.reason.name not in ("BOUND", "CLOSED")
                    and not is_in(end.reason.name, end.parameter or 0.0, ends, near)
                ]
    return found
