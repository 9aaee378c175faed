"""The proof of a branch: pieces on which, box by box, exactly one orbit lies on a connected
curve.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.bounds import (
    ArcBox,
    Ball,
    NotProved,
    Shooting,
    ShootingSettings,
    arc_box,
    multipliers_of,
    prove_zero,
    return_map,
    rounded_down,
    rounded_up,
)
from saltus.orbits.branches.branch import Branch
from saltus.orbits.branches.orbit_curve import OrbitPoint
from saltus.orbits.proofs.orbit_proof import ASSUMPTIONS, MIRROR, with_proof
from saltus.orbits.proofs.segments import CannotProve, OrbitSegments
from saltus.orbits.proofs.special_proof import MEANINGS, prove_special
from saltus.progress import Progress, silent
from saltus.result import Result

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class BranchProofSettings:
    """How boxes follow a branch."""

    # Half of the length of a first box; lengths are in natural scales.
    first: float = 1e-3
    least: float = 1e-9  # below which a piece ends
    # Beside a fold boxes are not halved below this for the sign of d parameter / ds alone.
    sign: float = 2e-4
    longer: float = 1.5  # after each box
    # By how much of its length a box reaches beyond the zeros at its ends.
    overlap: float = 1e-4
    # Nodes are set anew once a step beside an event is shorter than this share of the longest, or
    # longer than this multiple of the median.
    short: float = 0.3
    long: float = 1.3


SETTINGS = BranchProofSettings()


@dataclass(frozen=True)
class ProvedBox:
    """One box of a piece: its parameters, whether its orbits are stable, and how they turn."""

    low: float
    high: float
    stable: bool | None
    turn: int
    least_speed: float


@dataclass(frozen=True)
class ProvedPiece:
    """A connected curve of orbits of one signature, each alone in its box and with open contacts.

    `ends` are the numbers of the first and of the last point of the branch that lie on it; `reason`
    says why it ends before the last point that it was asked for.
    """

    ends: tuple[int, int]
    boxes: tuple[ProvedBox, ...]
    reason: str

    @property
    def turns(self) -> list[int]:
        """The signs of d parameter / ds along it, without repetition and without undecided
        boxes.
        """
        signs = [box.turn for box in self.boxes if box.turn]
        return [sign for i, sign in enumerate(signs) if i == 0 or sign != signs[i - 1]]


@dataclass(frozen=True, eq=False, repr=False)
class BranchProof(Result):
    """What is proved of a branch.

    Attributes
    ----------
    pieces
        The proved pieces, in the order of the branch.
    proved
        For each point of the branch, whether it lies on a proved piece, (points,).
    path
        The parameter along the branch.
    reasons
        Why the points between the pieces are not proved.
    assumptions
        What is taken for granted.
    seconds
        The processor time.
    branch
        The branch; its special points have their proofs in `evidence.proof`.

    Examples
    --------
    >>> short = saltus.continue_orbit(orbit, "load.frequency", bounds=(0.99, 1.01))
    >>> saltus.prove(short).proved.all()
    True
    """

    pieces: tuple[ProvedPiece, ...]
    proved: np.ndarray
    path: str
    reasons: tuple[str, ...]
    assumptions: tuple[str, ...]
    seconds: float
    branch: Branch = field(repr=False)

    @property
    def proved_special(self) -> int:
        """How many of its special points are proved."""
        proofs = [point.evidence.proof for point in self.branch.special]
        return sum(proof is not None and bool(proof.proved) for proof in proofs)

    @property
    def proved_share(self) -> float:
        """The share of the branch's points that lie on proved pieces."""
        return float(self.proved.mean()) if self.proved.size else 0.0

    def _facts(self) -> dict[str, Any]:
        boxes = sum(len(piece.boxes) for piece in self.pieces)
        facts: dict[str, Any] = {
            "proved_share": rounded_down(self.proved_share, 3),
            "special": f"{self.proved_special} of {len(self.branch.special)}",
            "pieces": len(self.pieces),
            "boxes": boxes,
        }
        if self.reasons:
            facts["reason"] = self.reasons[0]
        return facts

    @property
    def statement(self) -> str:
        """The theorem, a sentence for each piece."""
        told = [_of_piece(piece, self.path) for piece in self.pieces]
        if self.branch.special:
            told.append(
                f"{self.proved_special} of {len(self.branch.special)} special points are proved."
            )
        told += [f"Not proved: {reason}." for reason in self.reasons]
        return " ".join(told) or "Nothing is proved."

    def to_xarray(self) -> xarray.Dataset:
        """The branch's dataset with the columns `proved` of its points and `special_proved` of its
        special points, with the boxes of all pieces, and with the statement as an attribute.
        """
        boxes = [(number, box) for number, piece in enumerate(self.pieces) for box in piece.boxes]
        stable = [-1 if box.stable is None else int(box.stable) for _, box in boxes]
        proofs = [point.evidence.proof for point in self.branch.special]
        statements = ["" if proof is None else proof.statement for proof in proofs]
        columns = {
            "proved": ("point", self.proved.astype(np.int8), "lies on a proved piece"),
            "special_statement": ("special", np.array(statements, dtype=str), "theorem"),
            "box_piece": ("box", [number for number, _ in boxes], "number of the piece"),
            "box_low": ("box", [box.low for _, box in boxes], "least parameter"),
            "box_high": ("box", [box.high for _, box in boxes], "largest parameter"),
            "box_stable": ("box", stable, "1 stable, 0 unstable, -1 undecided"),
            "box_turn": ("box", [box.turn for _, box in boxes], "sign of d parameter / ds"),
            "box_speed": ("box", [box.least_speed for _, box in boxes], "least speed, lower bound"),
        }
        facts = {
            "proved_share": self.proved_share,
            "statement": self.statement,
            "assumptions": "; ".join(self.assumptions),
        }
        return with_proof(self.branch.to_xarray(), "branch_proof", columns, facts)


def _of_piece(piece: ProvedPiece, path: str) -> str:
    low = min(box.low for box in piece.boxes)
    high = max(box.high for box in piece.boxes)
    stable = sum(box.stable is True for box in piece.boxes)
    folds = len(piece.turns) - 1
    told = (
        f"Points {piece.ends[0]} to {piece.ends[1]} lie on one connected curve of orbits, each"
        f" alone in one of {len(piece.boxes)} boxes, with open contacts, at {path} between"
        f" {rounded_down(low, 9)} and {rounded_up(high, 9)}"
    )
    if folds > 0:
        told += f", which turns round at least {folds} time{'s' * (folds > 1)}"
    return f"{told}; {stable} boxes have stable orbits only."


def prove_branch(
    branch: Branch,
    radii: dict[str, float] | None = None,
    steps: ShootingSettings | None = None,
    most_boxes: int = 2000,
    progress: Progress = silent,
) -> BranchProof:
    """The proof of a branch; `prove` says what it is."""
    began = time.process_time()
    points = branch.points
    path = points[0].orbit.equations.paths[0]
    proved = np.zeros(len(points), dtype=bool)
    pieces: list[ProvedPiece] = []
    reasons: list[str] = []
    left = most_boxes
    special = tuple(
        (
            replace(
                point, evidence=replace(point.evidence, proof=prove_special(point, radii, steps))
            )
            if point.kind in MEANINGS
            else point
        )
        for point in branch.special
    )
    for first, last in _runs(points) if most_boxes else ():
        if left <= 0:
            reasons.append(f"points {first} to {last}: {most_boxes} boxes were used up")
            continue
        walked = _Walk(branch, first, last, path, radii, steps).walk(left)
        progress((last + 1) / len(points), "points of the branch proved")
        if isinstance(walked, str):
            reasons.append(f"points {first} to {last}: {walked}")
            continue
        left -= len(walked.boxes)
        pieces.append(walked)
        proved[walked.ends[0] : walked.ends[1] + 1] = True
        if walked.reason:
            reasons.append(f"from point {walked.ends[1]} on: {walked.reason}")
    symmetric = any(point.orbit.symmetric for point in points)
    return BranchProof(
        pieces=tuple(pieces),
        proved=proved,
        path=path,
        reasons=tuple(reasons),
        assumptions=(*ASSUMPTIONS, *((MIRROR,) * symmetric)),
        seconds=time.process_time() - began,
        branch=replace(branch, special=special),
    )


def _runs(points: Sequence[OrbitPoint]) -> Iterator[tuple[int, int]]:
    """The numbers of the first and last points of one signature, without those at a grazing."""
    start: int | None = None
    for i, point in enumerate(points):
        fits = not point.orbit.grazes
        same = start is not None and point.orbit.signature == points[start].orbit.signature
        if start is not None and not (fits and same):
            yield start, i - 1
            start = None
        if start is None and fits:
            start = i
    if start is not None:
        yield start, len(points) - 1


class _Walk:
    """The boxes from one point of a branch to another one of the same signature."""

    def __init__(
        self,
        branch: Branch,
        first: int,
        last: int,
        path: str,
        radii: dict[str, float] | None,
        steps: ShootingSettings | None,
    ) -> None:
        self.points = branch.points
        self.first = first
        self.last = last
        self.path = path
        self.radii = radii
        self.steps = steps
        self.boxes: list[ProvedBox] = []

    def walk(self, most_boxes: int) -> ProvedPiece | str:
        """The piece, or why there is none."""
        orbit = self.points[self.first].orbit
        made = orbit.equations.segments_to_prove(orbit.solution)
        if isinstance(made, CannotProve):
            return made.reason
        self.made = made
        shooting = self._laid_out(made, orbit.solution.values[0])
        start = self._pinned_zero(shooting, shooting.x0, _unit(shooting.size))
        if start is None:
            return "its first orbit is not proved"
        reached = self.first
        row, tangent = _along(shooting, start.middle, self._towards(shooting, start))
        half = SETTINGS.first
        reason = ""
        while reached < self.last:
            if len(self.boxes) >= most_boxes:
                reason = f"{most_boxes} boxes were used up"
                break
            box = self._next(shooting, start, row, tangent, half)
            if box is None or (box.turn == 0 and half > SETTINGS.sign):
                half *= 0.5
                if half < SETTINGS.least:
                    reason = "a box shrinks to nothing, as beside a grazing or another branch"
                    break
                continue
            self.boxes.append(self._told(shooting, box))
            reached = self._passed(shooting, box, reached)
            end = self._pinned_zero(shooting, box.at(box.half * (1.0 - SETTINGS.overlap)), box.row)
            if end is None or not box.holds(end):
                reason = "a box's end has no enclosure inside it"
                break
            start = end
            forward = box.row
            half *= SETTINGS.longer
            if self._uneven(box):
                following = self._set_anew(shooting, box, end)
                if following is None:
                    reason = "boxes with other nodes could not be glued"
                    break
                shooting, start, forward = following
            row, tangent = _along(shooting, start.middle, forward)
        if not self.boxes:
            return reason
        return ProvedPiece((self.first, reached), tuple(self.boxes), reason)

    def _laid_out(self, made: OrbitSegments, parameter: float) -> Shooting:
        """The equations with nodes that fit an orbit at a parameter."""
        orbit = self.points[self.first].orbit
        equations = orbit.equations
        values = np.array([parameter])
        system = equations.system_at(values)
        return Shooting(
            system,
            made.segments,
            made.guess,
            made.event_names,
            made.state_names,
            orbit.signature.span,
            path=self.path,
            radii=self.radii,
            pins=[],
            free_time=made.free_time,
            settings=self.steps,
        )

    def _pinned_zero(self, shooting: Shooting, x: np.ndarray, row: np.ndarray) -> Ball | None:
        """The enclosure of the zero near x on its hyperplane."""
        shooting.pins = [(row, float(row @ x))]
        shooting.x0 = x
        zero = prove_zero(shooting, unique=False)
        return None if isinstance(zero, NotProved) else zero.box

    def _towards(self, shooting: Shooting, start: Ball) -> np.ndarray:
        """A direction that leads to the next point of the branch."""
        following = self.points[min(self.first + 1, self.last)]
        row = _unit(shooting.size)
        here = float(start.middle[-1])
        there = float(following.solution.values[0])
        if there == here:
            return row
        return np.asarray(row * np.sign(there - here))

    def _next(
        self, shooting: Shooting, start: Ball, row: np.ndarray, tangent: np.ndarray, half: float
    ) -> ArcBox | None:
        """The box that begins at an enclosed zero, with open contacts and impacts with a speed."""
        box = arc_box(shooting, start.middle + tangent * half, row, half * (1.0 + SETTINGS.overlap))
        if box is None or not box.holds(start) or not self._speeds(shooting, box) > 0.0:
            return None
        return box if shooting.is_open(box.enclosure, box.hull) else None

    def _speeds(self, shooting: Shooting, box: ArcBox) -> float:
        """A lower bound of the speeds of all impacts in a box; inf without impacts."""
        if not shooting.free_time:
            return np.inf
        events = box.hull[: shooting.event_unknowns].reshape(-1, shooting.event_size)
        return float(events[:, 1].low.min())

    def _told(self, shooting: Shooting, box: ArcBox) -> ProvedBox:
        multipliers = multipliers_of(return_map(shooting, box.enclosure))
        parameter = box.hull[-1]
        return ProvedBox(
            low=float(parameter.low),
            high=float(parameter.high),
            stable=multipliers.stable,
            turn=box.turn,
            least_speed=self._speeds(shooting, box),
        )

    def _passed(self, shooting: Shooting, box: ArcBox, reached: int) -> int:
        """The last point of the branch whose events lie in a box."""
        count = shooting.event_unknowns
        while reached < self.last:
            point = self.points[reached + 1]
            made = point.orbit.equations.segments_to_prove(point.solution)
            if isinstance(made, CannotProve):
                return reached
            place = np.append(made.guess.ravel(), point.solution.values[0])
            columns = [*range(count), -1]
            distance = place - box.middle[columns]
            s = float(box.row[columns] @ distance)
            if s > box.half:
                return reached
            off = np.abs(distance - box.tangent[columns] * s)
            if s < -box.half or not (off < box.radius[columns]).all():
                return reached
            reached += 1
        return reached

    def _uneven(self, box: ArcBox) -> bool:
        """Whether nodes no longer fit."""
        lengths = np.array([float(h.middle) for h in box.enclosure.lengths])
        return bool(
            lengths.min() < SETTINGS.short * lengths.max()
            or lengths.max() > SETTINGS.long * np.median(lengths)
        )

    def _set_anew(
        self, shooting: Shooting, box: ArcBox, end: Ball
    ) -> tuple[Shooting, Ball, np.ndarray] | None:
        """The equations with new nodes, the zero at a box's end, and the direction, if the states
        at the old nodes lie in the box."""
        count = shooting.event_unknowns
        guess = end.middle[:count].reshape(-1, shooting.event_size)
        other = self._laid_out(replace(self.made, guess=guess), float(end.middle[-1]))
        row = np.zeros(other.size)
        row[:count] = box.row[:count]
        row[-1] = box.row[-1]
        x = other.x0.copy()
        x[-1] = end.middle[-1]
        now = self._pinned_zero(other, x, row)
        if now is None:
            return None
        found = [now[:count], *_old_nodes(shooting, now, count), now[-1:]]
        whole = Ball(
            np.concatenate([part.middle for part in found]),
            np.concatenate([part.radius for part in found]),
        )
        return (other, now, row) if box.holds(whole) else None


def _old_nodes(shooting: Shooting, zero: Ball, count: int) -> Iterator[Ball]:
    """Balls of the states at a shooting's nodes, from the events of an enclosed zero."""
    size = shooting.event_size
    for i in range(shooting.event_count):
        nodes = [
            step.begin_time for step in shooting.steps if step.segment == i and not step.from_event
        ]
        yield from shooting.follow(i, zero[size * i : size * (i + 1)], nodes, zero[-1])


def _unit(size: int) -> np.ndarray:
    row = np.zeros(size)
    row[-1] = 1.0
    return row


def _along(shooting: Shooting, x: np.ndarray, forward: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The row of the arclength of events and parameter, in the direction of another row, and the
    direction of the curve, whose product with the row is 1.
    """
    enclosure = shooting.enclose(Ball(x))
    jacobian = shooting.system_rows(enclosure, Ball(x))[1].middle[:-1]
    along = np.linalg.svd(jacobian * shooting.scales / shooting.row_scales[:-1, None])[2][-1]
    if float((along * shooting.scales) @ forward) < 0.0:
        along = -along
    row = np.zeros(len(x))
    count = shooting.event_unknowns
    row[:count] = along[:count]
    row[-1] = along[-1]
    row /= np.linalg.norm(row)
    tangent = along / float(row @ along)
    return row / shooting.scales, tangent * shooting.scales
