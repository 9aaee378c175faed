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
    Ball,
    NotProved,
    ProvedArc,
    Shooting,
    ShootingSettings,
    Tube,
    arc_along,
    multipliers_of,
    prove_zero,
    return_map,
    rounded_down,
    rounded_up,
    verified_arc,
    verified_zero,
)
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.branches.branch import Branch
from saltus.orbits.proofs.orbit_proof import assumptions_of, of_radii, shooting_of, with_proof
from saltus.orbits.proofs.special_proof import MEANINGS, prove_special
from saltus.orbits.segments.segments import CannotProve, OrbitSegments, least_speed
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
    """One box of a piece: its parameters, whether its orbits are stable, and how they turn.

    `tube` is the box itself, and `start` encloses the orbit with which it begins, in the unknowns of
    the piece's nodes of number `nodes`.
    """

    low: float
    high: float
    stable: bool | None
    turn: int
    least_speed: float
    tube: Tube = field(repr=False)
    start: Ball = field(repr=False)
    nodes: int = field(repr=False)

    @property
    def told(self) -> tuple[float, float, bool | None, int, float]:
        """What is said of its orbits."""
        return self.low, self.high, self.stable, self.turn, self.least_speed


@dataclass(frozen=True)
class ProvedPiece:
    """A connected curve of orbits of one signature, each alone in its box and with open contacts.

    `ends` are the numbers of the first and of the last point of the branch that lie on it; `reason`
    says why it ends before the last point that it was asked for. `guesses` are the events and the
    parameters from which nodes were set.
    """

    ends: tuple[int, int]
    boxes: tuple[ProvedBox, ...]
    reason: str
    guesses: tuple[tuple[np.ndarray, float], ...] = field(repr=False)

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
    radii
        How far numbers of the system may lie from their doubles.

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
    radii: dict[str, float] = field(default_factory=dict, repr=False)
    steps: ShootingSettings | None = field(default=None, repr=False)

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
        told += of_radii(self.radii)
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

    def check(self) -> bool:
        """Whether all that the proof says of its pieces and special points holds when it is computed
        anew, from the branch and the boxes of the pieces, without a search. The `reasons` say what
        was not proved, and are not looked at.
        """
        points = self.branch.points
        orbit = points[0].orbit
        lies = np.zeros(len(points), dtype=bool)
        for piece in self.pieces:
            lies[piece.ends[0] : piece.ends[1] + 1] = True
        proofs = [(point, point.evidence.proof) for point in self.branch.special]
        own = [
            proof.kind == point.kind
            and proof.special.parameter == point.parameter
            and proof.check()
            for point, proof in proofs
            if proof is not None and proof.proved
        ]
        return bool(
            self.path == orbit.equations.paths[0]
            and self.assumptions == assumptions_of(any(p.orbit.symmetric for p in points))
            and np.array_equal(self.proved, lies)
            and all(own)
            and all(
                _Walk(self.branch, *piece.ends, self.path, self.radii, self.steps).confirms(piece)
                for piece in self.pieces
            )
        )


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
    return BranchProof(
        pieces=tuple(pieces),
        proved=proved,
        path=path,
        reasons=tuple(reasons),
        assumptions=assumptions_of(any(point.orbit.symmetric for point in points)),
        seconds=time.process_time() - began,
        branch=replace(branch, special=special),
        radii=dict(radii or {}),
        steps=steps,
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
        self.guesses: list[tuple[np.ndarray, float]] = []
        self.places: dict[int, np.ndarray | None] = {}

    def walk(self, most_boxes: int) -> ProvedPiece | str:
        """The piece, or why there is none."""
        orbit = self.points[self.first].orbit
        made = orbit.equations.segments_to_prove(orbit.solution)
        if isinstance(made, CannotProve):
            return made.reason
        if made.rests:
            return "orbits that rest are proved one by one, not yet along a branch"
        shooting = self._laid_out(made, made.guess, float(orbit.solution.values[0]))
        start = self._start(shooting, shooting.x0, None)
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
            longer = half * (1.0 + SETTINGS.overlap)
            arc = arc_along(shooting, start.middle + tangent * half, row, longer)
            box = None if arc is None else self._judged(shooting, made, arc, start)
            if arc is None or box is None or (box.turn == 0 and half > SETTINGS.sign):
                half *= 0.5
                if half < SETTINGS.least:
                    reason = "a box shrinks to nothing, as beside a grazing or another branch"
                    break
                continue
            self.boxes.append(box)
            tube = box.tube
            reached = self._passed(shooting, tube, reached)
            end = self._start(shooting, tube.at(tube.half * (1.0 - SETTINGS.overlap)), tube)
            if end is None or not tube.holds(end):
                reason = "a box's end has no enclosure inside it"
                break
            start = end
            half *= SETTINGS.longer
            if self._uneven(arc):
                before = shooting
                guess = end.middle[: before.event_unknowns].reshape(-1, before.event_size)
                shooting = self._laid_out(made, guess, float(end.middle[-1]))
                x = shooting.x0.copy()
                x[-1] = end.middle[-1]
                anew = self._start(shooting, x, tube)
                if anew is None or not tube.holds(_with_nodes_of(before, anew)):
                    reason = "boxes with other nodes could not be glued"
                    break
                start = anew
            row, tangent = _along(shooting, start.middle, _row_of(tube, shooting))
        if not self.boxes:
            return reason
        ends = (self.first, reached)
        return ProvedPiece(ends, tuple(self.boxes), reason, tuple(self.guesses))

    def confirms(self, piece: ProvedPiece) -> bool:
        """Whether a piece holds when it is computed anew, from its boxes, without a search."""
        orbit = self.points[self.first].orbit
        made = orbit.equations.segments_to_prove(orbit.solution)
        if isinstance(made, CannotProve) or made.rests or not piece.boxes:
            return False
        reached = self.first
        before: tuple[Tube, Shooting] | None = None
        shooting: Shooting | None = None
        for box in piece.boxes:
            if shooting is None or box.nodes != len(self.guesses) - 1:
                if len(self.guesses) == len(piece.guesses):
                    return False
                shooting = self._laid_out(made, *piece.guesses[len(self.guesses)])
            size = (shooting.size,)
            if box.nodes != len(self.guesses) - 1 or box.tube.middle.shape != size:
                return False
            shooting.pins = [_pin(box.start.middle, before and before[0], shooting)]
            start = verified_zero(shooting, box.start.middle, box.start.radius, box.start.radius)
            arc = verified_arc(shooting, box.tube)
            if isinstance(start, NotProved) or arc is None:
                return False
            again = self._judged(shooting, made, arc, box.start)
            if again is None or again.told != box.told:
                return False
            if before is not None:
                same = before[1] is shooting
                shared = box.start if same else _with_nodes_of(before[1], box.start)
                if not before[0].holds(shared):
                    return False
            before = box.tube, shooting
            reached = self._passed(shooting, box.tube, reached)
        return reached == self.last and len(piece.guesses) == len(self.guesses)

    def _laid_out(self, made: OrbitSegments, guess: np.ndarray, parameter: float) -> Shooting:
        """The equations with nodes that fit an orbit at a parameter."""
        self.guesses.append((guess, parameter))
        return shooting_of(
            self.points[self.first].orbit,
            replace(made, guess=guess),
            values=np.array([parameter]),
            path=self.path,
            radii=self.radii,
            pins=[],
            settings=self.steps,
        )

    def _start(self, shooting: Shooting, x: np.ndarray, before: Tube | None) -> Ball | None:
        """The enclosure of the zero near x with which a box begins, behind another one."""
        shooting.pins = [_pin(x, before, shooting)]
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

    def _judged(
        self, shooting: Shooting, made: OrbitSegments, arc: ProvedArc, start: Ball
    ) -> ProvedBox | None:
        """The box that begins at an enclosed zero, if its contacts are open and all of its impacts
        have a speed.
        """
        hull = arc.tube.hull
        slowest = least_speed(shooting, hull, made)
        if not (arc.tube.holds(start) and slowest > 0.0):
            return None
        if not shooting.is_open(arc.enclosure, hull):
            return None
        parameter = hull[-1]
        return ProvedBox(
            low=float(parameter.low),
            high=float(parameter.high),
            stable=multipliers_of(return_map(shooting, arc.enclosure)).stable,
            turn=arc.turn,
            least_speed=slowest,
            tube=arc.tube,
            start=start,
            nodes=len(self.guesses) - 1,
        )

    def _passed(self, shooting: Shooting, tube: Tube, reached: int) -> int:
        """The last point of the branch whose events lie in a box."""
        count = shooting.event_unknowns
        columns = [*range(count), -1]
        while reached < self.last:
            place = self._place_of(reached + 1)
            if place is None:
                return reached
            distance = place - tube.middle[columns]
            s = float(tube.row[columns] @ distance)
            if s > tube.half:
                return reached
            off = np.abs(distance - tube.tangent[columns] * s)
            if s < -tube.half or not (off < tube.radius[columns]).all():
                return reached
            reached += 1
        return reached

    def _place_of(self, number: int) -> np.ndarray | None:
        """The unknowns of the events of a point of the branch, then its parameter."""
        if number not in self.places:
            point = self.points[number]
            made = point.orbit.equations.segments_to_prove(point.solution)
            self.places[number] = (
                None
                if isinstance(made, CannotProve)
                else np.append(made.guess.ravel(), point.solution.values[0])
            )
        return self.places[number]

    def _uneven(self, arc: ProvedArc) -> bool:
        """Whether nodes no longer fit."""
        lengths = np.array([float(h.middle) for h in arc.enclosure.lengths])
        return bool(
            lengths.min() < SETTINGS.short * lengths.max()
            or lengths.max() > SETTINGS.long * np.median(lengths)
        )


def _with_nodes_of(shooting: Shooting, zero: Ball) -> Ball:
    """An enclosed zero with the states at the nodes of other equations, which follow from its
    events.
    """
    count = shooting.event_unknowns
    size = shooting.event_size
    parts = [zero[:count]]
    for i in range(shooting.event_count):
        nodes = [
            step.begin_time for step in shooting.steps if step.segment == i and not step.from_event
        ]
        parts += shooting.follow(i, zero[size * i : size * (i + 1)], nodes, zero[-1])
    parts.append(zero[-1:])
    return Ball(
        np.concatenate([part.middle for part in parts]),
        np.concatenate([part.radius for part in parts]),
    )


def _pin(x: np.ndarray, before: Tube | None, shooting: Shooting) -> tuple[np.ndarray, float]:
    """The hyperplane through x on which a box's first zero lies: the parameter's, or that of the
    tube before.
    """
    row = _unit(shooting.size) if before is None else _row_of(before, shooting)
    return row, float(row @ x)


def _row_of(tube: Tube, shooting: Shooting) -> np.ndarray:
    """The row of a tube, which is one of events and the parameter, for equations with other
    nodes.
    """
    count = shooting.event_unknowns
    row = np.zeros(shooting.size)
    row[:count] = tube.row[:count]
    row[-1] = tube.row[-1]
    return row


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
