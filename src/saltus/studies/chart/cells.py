"""The cells of a stability chart: which stable motions there are under each pair of values of two
parameters.

In every cell motions are followed from states spread over a window, then from the motions of its
neighbours, until these add nothing new. Motions that have not settled are judged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.attractors import (
    JUDGEMENT,
    EarlierJudgement,
    Judged,
    JudgementSettings,
    SettledLater,
    approached_orbit,
    judge,
)
from saltus.flow import Ending, Recurrence
from saltus.studies.chart.chart_request import ChartRequest
from saltus.studies.chart.motions import (
    ALIKE,
    SIDES,
    distance,
    distinct,
    has_alike,
    is_alike,
    motion_type,
    motions_in,
    motions_later,
    outcomes,
    table,
)
from saltus.systems import (
    System,
    Window,
    initial_states,
    natural_units,
    rest_state,
    states_beside,
)
from saltus.theory import amplitude_limits

ASKED = 3  # motions of a cell that have not settled, from which the judgement starts at most
COMPANIONS = 6  # motions that are followed for each cell that is judged


class CellVerdicts:
    """The judgement of the motions that have not settled, an entry for each cell in `cell`.

    `later` holds the cells (k,) and states (k, d) of motions on which companions have settled after
    all.
    """

    def __init__(self, request: ChartRequest, motions: np.ndarray) -> None:
        motions = motions[np.argsort(motions["cell"], kind="stable")]
        self.cell, first = np.unique(motions["cell"], return_index=True)
        last = np.append(first[1:], len(motions))
        states = np.full((len(self.cell), ASKED, request.system.dimension), np.nan)
        for i in range(ASKED):
            there = first + i < last
            states[there, i] = motions["state"][(first + i)[there]]
        parameters = {path: values[self.cell] for path, values in request.parameters.items()}
        found = judge(
            request.system, states, parameters, settings=judgement(request.periods, request.tol)
        )
        self.verdict, self.exponent, self.error, self.settled = (
            found.ending.copy(),
            found.exponent,
            found.error,
            found.settled,
        )
        self._confirm(request, parameters, found)
        self._solve_slow(request, parameters, found)
        longer = np.unique(self.settled.question[self.settled.period > request.max_period])
        # A transient to an orbit of a longer period than the chart looks for leads to none of its
        # motions.
        self.verdict[longer[self.verdict[longer] == Ending.TRANSIENT]] = Ending.PERIODIC
        self.later = self.cell[self.settled.question], self.settled.state

        of_no_period = (self.verdict == Ending.PERIODIC) & (found.period == 0)
        of_no_period[longer] = False
        # it comes to no orbit that is known, so `classify` is not sure either
        self.verdict[of_no_period] = Ending.UNDECIDED
        known = (found.period > 0) & (found.period <= request.max_period)
        # Such starts end on motions that the cell has through `later`, or come to rest.
        self.settles = (self.verdict == Ending.TRANSIENT) | (
            (self.verdict == Ending.PERIODIC) & known
        )

    def _confirm(
        self, request: ChartRequest, parameters: Mapping[str, np.ndarray], found: Judged
    ) -> None:
        """Judge chaos beside cells without chaos once more, as carefully as `classify`: a long
        transient may look like chaos.

        What is then no chaos makes the chaos of its neighbours doubtful, too. Beyond the edge of
        the block there is no chaos.
        """
        confirmed = np.zeros(len(self.cell), dtype=bool)
        while len(rows := np.flatnonzero(self._beside_no_chaos(request.shape) & ~confirmed)):
            earlier = EarlierJudgement(
                found.exponent[rows], found.error[rows], _periods_without_settling(found)[rows]
            )
            columns = {path: values[rows] for path, values in parameters.items()}
            settings = replace(JUDGEMENT, tol=request.tol)
            again = judge(
                request.system, found.states[rows], columns, settings=settings, earlier=earlier
            )
            self.verdict[rows] = again.ending
            confirmed[rows] = True
            self.settled = self.settled.joined(
                replace(again.settled, question=rows[again.settled.question])
            )

    def _solve_slow(
        self, request: ChartRequest, parameters: Mapping[str, np.ndarray], found: Judged
    ) -> None:
        """Solve for the orbits to which motions come that have not settled and whose exponent is
        not surely positive: beside a period doubling or a torus they take thousands of periods.

        An orbit counts if it is stable, near the motion's last state, and nearer to its states
        later.
        """
        no_period = (self.verdict == Ending.UNDECIDED) | (
            (self.verdict == Ending.PERIODIC) & (found.period == 0)
        )
        asked = no_period & (self.exponent - self.error <= 0.0)
        asked[self.settled.question] = False
        for row in np.flatnonzero(asked):
            system = request.system.with_(
                {path: float(values[row]) for path, values in parameters.items()}
            )
            orbit = approached_orbit(system, found.states[row, 0], request.max_period, ALIKE.alike)
            if orbit is not None:
                self.verdict[row] = Ending.PERIODIC
                found.period[row] = orbit.period
                self.settled = self.settled.joined(
                    SettledLater(
                        np.array([row]), orbit.section_state[None], np.array([orbit.period])
                    )
                )

    def _beside_no_chaos(self, shape: tuple[int, int]) -> np.ndarray:
        """Whether there is chaos in a cell, and none in one of the four beside it."""
        chaos = np.zeros((shape[0] + 2, shape[1] + 2), dtype=bool)
        row, column = (place + 1 for place in np.unravel_index(self.cell, shape))
        chaos[row, column] = self.verdict == Ending.CHAOTIC
        return np.asarray(
            chaos[row, column] & ~np.all([chaos[row + i, column + j] for i, j in SIDES], axis=0)
        )


def _periods_without_settling(found: Judged) -> np.ndarray:
    """Forcing periods of companions, in all, where none of these has settled, else 0; see
    `Judged.mean_life`.
    """
    return np.where(found.settled_count > 0, 0.0, 3.0 * found.mean_life)


def judgement(periods: int, tol: float) -> JudgementSettings:
    """The settings by which motions of a chart are judged that have not settled within so many
    forcing periods.

    As a chart has thousands of cells, each gets a few companions only, and transients are excluded
    with mean lives up to eight times the periods.
    """
    return JudgementSettings(
        companions=COMPANIONS,
        first_periods=periods,
        round_periods=3 * periods,
        rounds=3,
        exposure=4 * COMPANIONS * periods,
        measured=COMPANIONS,
        shortest_run=max(16, periods // 2),
        longest_run=3 * periods,
        regular_run=periods,
        longest_period=64,
        patience=10 * periods,
        tol=tol,
    )


@dataclass(frozen=True)
class CellSettings:
    """How the cells of a chart are filled."""

    # Every other initial state lies in a smaller copy of the window, down to this share of its
    # size: some motions are small.
    innermost: float = 1e-2
    # The stages in which motions are followed, as shares of the forcing periods: after each,
    # motions that have come together are continued as one.
    stages: tuple[float, ...] = (1 / 20, 1 / 20, 1 / 10, 4 / 5)
    # An ensemble of up to this many motions is hardly faster with fewer motions, so that fewer
    # stages take less time.
    few_motions: int = 500
    few_stages: tuple[float, ...] = (1 / 10, 9 / 10)
    # If few motions are left in a cell after all stages they are slow, while chaos leaves many. If
    # there are at most `patient_with` of them, they are followed for `patience` times the forcing
    # periods.
    patience: int = 4
    patient_with: int = 3
    # Motions below this share of the least amplitude are not followed until they settle.
    negligible: float = 0.5
    # A motion fades if its amplitude in a forcing period is below this share of that in the period
    # before, as under slow loads if it comes to rest. It is not followed to its end: small motions
    # have thousands of impacts in a period.
    fading: float = 0.5
    # Stroboscopic states from which the limit of a motion is extrapolated: enough for periods 1 and
    # 2.
    kept: int = 9
    # The most rounds of starts from neighbours: more than the cells along a side of any chart.
    rounds: int = 400


CELLS = CellSettings()


@dataclass
class CellOutcomes:
    """The stable motions, each once, by cell and falling amplitude, and the number of other starts
    of each cell by their ends.
    """

    motions: np.ndarray  # of dtype `motion_type`
    captured: np.ndarray  # starts captured at rest, for all later loads
    tiny: np.ndarray  # starts that end on motions too small to count
    unsettled: np.ndarray  # starts of motions that are chaotic, slow, or of a longer period
    ended: np.ndarray  # starts of motions that a limit of the model has ended
    moving: np.ndarray  # of dtype `motion_type`: the unsettled motions in their last states


def cells(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The variables of a chart over a block of its plane, (rows, columns), and those of its
    motions, (rows, columns, 8).

    A pure function of its arguments, as a sweep needs it: `arguments` are those of a
    `ChartRequest`, `block` holds the values along the two axes.
    """
    request = ChartRequest.from_arguments(arguments, block)
    return {
        name: values.reshape(*request.shape, *values.shape[1:])
        for name, values in computed(request)[0].items()
    }


def computed(request: ChartRequest) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The variables of a chart with a row for each of its cells, and its motions, of dtype
    `motion_type`.
    """
    settled, judged, motions = stable_motions(request)
    time = natural_units(request.system).time if request.told_by_speed else None
    columns = table(motions, len(settled.captured), request.variables, time) | {
        "rest": settled.captured > 0,
        "tiny": settled.tiny,
        **_verdicts(settled, judged),
    }
    columns["outcome"] = outcomes(columns["count"], columns["unsettled"], columns["verdict"])
    return columns | beyond_limits(
        request.system, request.parameters, columns["amplitude"]
    ), motions


def _verdicts(settled: CellOutcomes, judged: CellVerdicts) -> dict[str, np.ndarray]:
    """The variables of a chart that follow from the judgement; starts that settle after all no
    longer count as unsettled.

    Starts whose motions a limit of the model has ended do count, as it is not known where they
    would have gone.
    """
    unsettled = settled.unsettled.copy()
    size = len(settled.unsettled)
    unsettled[judged.cell[judged.settles]] = 0
    columns = {
        "verdict": np.zeros(size, dtype=int),
        "exponent": np.full(size, np.nan),
        "exponent_error": np.full(size, np.nan),
    }
    for name, values in zip(columns, (judged.verdict, judged.exponent, judged.error), strict=True):
        columns[name][judged.cell] = values
    return columns | {"unsettled": unsettled + settled.ended}


def beyond_limits(
    system: System, parameters: Mapping[str, np.ndarray], amplitude: np.ndarray
) -> dict[str, np.ndarray]:
    """Whether the largest motion of each cell exceeds each limit of the mechanism that theory
    knows.
    """
    return {
        f"beyond_{limit.name}": amplitude > limit.value
        for limit in amplitude_limits(system, parameters)
    }


def stable_motions(request: ChartRequest) -> tuple[CellOutcomes, CellVerdicts, np.ndarray]:
    """How the starts in each cell end, the verdicts on motions that do not settle, and all stable
    motions.

    The last include those found by starts from motions of neighbouring cells. So every motion is
    followed through the chart to where its stability ends, however small its basin is there.
    """
    states = starts(request.system, request.starts, request.window, request.seed)
    size = math.prod(request.shape)
    settled = settle(request, np.repeat(np.arange(size), len(states)), np.tile(states, (size, 1)))
    judged = CellVerdicts(request, settled.moving)
    later = settle(request, *judged.later)
    known = distinct(np.concatenate([settled.motions, later.motions]))
    return settled, judged, spread(request, known, known)


def spread(request: ChartRequest, new: np.ndarray, known: np.ndarray) -> np.ndarray:
    """The known motions and those found by starting the new ones in neighbouring cells, again and
    again until none is added.
    """
    for _ in range(CELLS.rounds):
        cell, states = seeds(request.system, new, known, request.shape)
        if not len(cell):
            break
        further = settle(request, cell, states, known).motions
        new = further[~has_alike(known, further["cell"], further, ALIKE.same)]
        known = distinct(np.concatenate([known, new]))
    return known


def starts(system: System, count: int, window: Window, seed: int) -> np.ndarray:
    """(count, d): states spread over the window, every other one drawn in towards the contact, the
    last of them to 1 %.
    """
    states = initial_states(system, count, window, seed)
    contact = rest_state(system)
    inner = states[1::2]
    inner[:] = (
        contact + (inner - contact) * np.geomspace(1.0, CELLS.innermost, len(inner) + 1)[1:, None]
    )
    return states


def settle(
    request: ChartRequest, cell: np.ndarray, states: np.ndarray, known: np.ndarray | None = None
) -> CellOutcomes:
    """Follow motions from states (n, d) at phase 0 in the cells of these numbers until they settle
    or reach a known motion.
    """
    total = math.prod(request.shape)
    least = request.least
    captured, tiny, unsettled, ended = (np.zeros(total, dtype=np.int64) for _ in range(4))
    record = motion_type(request.system.dimension)
    moving = np.zeros(len(cell), record)
    found = [np.empty(0, record)]
    left = []
    moving["cell"] = cell
    moving["state"] = states
    moving["starts"] = 1
    moving["amplitude"] = np.inf
    for share in (
        *(CELLS.stages if len(cell) > CELLS.few_motions else CELLS.few_stages),
        CELLS.patience,
    ):
        if share == CELLS.patience:
            many = np.bincount(moving["cell"], minlength=total)[moving["cell"]] > CELLS.patient_with
            left.append(moving[many])
            moving = moving[~many]
        moving, outcome, fading = _followed(request, moving, math.ceil(share * request.periods))
        _count(ended, moving[outcome == Ending.ENDED])
        moving, outcome, fading = (
            values[outcome != Ending.ENDED] for values in (moving, outcome, fading)
        )
        rests = outcome == Ending.REST
        _count(captured, moving[rests])
        settled = moving["period"] > 0
        # Until a motion of the cell has come to rest, fading motions are followed, to show that
        # there is rest.
        size = np.where(settled | (captured[moving["cell"]] == 0), moving["amplitude"], fading)
        small = ~rests & (size < least * np.where(settled, 1.0, CELLS.negligible))
        found.append(moving[settled & ~small])
        _count(tiny, moving[small])
        moving = joined(request.system, moving[~rests & ~settled & ~small])
        if known is not None:
            moving = moving[~_arrived(request.system, moving, known)]
    small = moving["amplitude"] < least
    _count(tiny, moving[small])
    unfinished = np.concatenate([*left, moving[~small]])
    _count(unsettled, unfinished)
    return CellOutcomes(
        distinct(np.concatenate(found)), captured, tiny, unsettled, ended, unfinished
    )


def _count(number: np.ndarray, motions: np.ndarray) -> None:
    """Add the starts that have led to these motions to the number of each cell."""
    np.add.at(number, motions["cell"], motions["starts"])


def _followed(
    request: ChartRequest, motions: np.ndarray, periods: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The motions some forcing periods later, with the period of those that have settled; the
    `Ending` of each; the amplitudes as `_fading` gives them.

    The state of a motion that is about to settle is replaced by its extrapolated limit.
    """
    if not len(motions):
        return motions, np.zeros(0, dtype=int), np.zeros(0)
    parameters = {path: values[motions["cell"]] for path, values in request.parameters.items()}
    how: dict[str, Any] = {"max_period": request.max_period, "kept": CELLS.kept, "tol": request.tol}
    motions, ends = motions_later(request.system, motions, periods, parameters, **how)
    motions["period"] = ends.period
    return motions, ends.outcome, _fading(ends, motions["amplitude"])


def _fading(ends: Recurrence, amplitude: np.ndarray) -> np.ndarray:
    """The amplitude in the last forcing period for motions that fade, and over all periods that are
    kept for the others, (n,).

    The smaller a bouncing motion becomes the more impacts it has in a period: a few of these take
    longer than thousands of other motions.
    """
    assert ends.extrema is not None
    if ends.extrema.shape[1] < 2:
        return amplitude
    before, last = np.abs(ends.extrema[:, -2:]).max(axis=2).T
    return np.where(last < CELLS.fading * before, last, amplitude)


def joined(system: System, motions: np.ndarray) -> np.ndarray:
    """The motions, of which those that have come together are joined to one: motions of one cell
    whose states at phase 0 are near to one another relative to their size."""
    motions = motions[np.argsort(motions["cell"], kind="stable")]
    cell = motions["cell"]
    state = motions["state"]
    amplitude = motions["amplitude"]
    into = np.arange(len(motions))
    for step in range(1, int(np.bincount(cell).max(initial=0))):
        near = _is_near(
            system, state[step:], state[:-step], np.minimum(amplitude[step:], amplitude[:-step])
        )
        near &= cell[step:] == cell[:-step]
        into[step:] = np.where(near, np.minimum(into[step:], into[:-step]), into[step:])
    kept = into == np.arange(len(into))
    while not kept[into].all():  # a motion may be joined to one that is itself joined to another
        into = into[into]
    number = np.zeros(len(into), dtype=np.int64)
    np.add.at(number, into, motions["starts"])
    motions["starts"] = number
    return np.asarray(motions[kept])


def _is_near(
    system: System, one: np.ndarray, other: np.ndarray, amplitude: np.ndarray
) -> np.ndarray:
    """Whether states at the same phase are so near to one another that the motions end on the same
    motion.
    """
    return np.asarray(distance(system, one - other) <= ALIKE.joined * amplitude)


def _arrived(system: System, motions: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Which motions have reached a motion that their cell has already."""
    result = np.zeros(len(motions), dtype=bool)
    for there, index in motions_in(known, motions["cell"]):
        other = known[index]
        least = np.minimum(motions["amplitude"], other["amplitude"])
        result |= there & _is_near(system, motions["state"], other["state"], least)
    return result


def seeds(
    system: System, motions: np.ndarray, known: np.ndarray, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Further starts, as cells (n,) and states (n, d): for each cell the motions of its neighbours
    to which none of its own is similar.

    The state is that in the neighbour or, if the cell behind the neighbour has a similar motion
    too, is extrapolated from both.
    """
    place = np.stack(np.unravel_index(motions["cell"], shape), axis=1)
    found = []
    for side in np.array(SIDES):
        ahead, behind = (
            ((place + step >= 0) & (place + step < shape)).all(axis=1) for step in (side, -side)
        )
        step = side @ [shape[1], 1]
        source = motions[ahead]
        new = ~has_alike(known, source["cell"] + step, source, ALIKE.alike)
        source, behind = source[new], behind[ahead][new]
        steps = _heading(system, source, known, np.where(behind, source["cell"] - step, -1))
        found.append((source["cell"] + step, states_beside(system, source["state"], steps)))
    return np.concatenate([cell for cell, _ in found]), np.concatenate(
        [states for _, states in found]
    )


def _heading(
    system: System, motions: np.ndarray, known: np.ndarray, behind: np.ndarray
) -> np.ndarray:
    """The steps from the states of motions to those expected a cell further on, (n, d): the
    differences to similar motions in the cells behind, or 0 if there are none."""
    ahead = np.zeros_like(motions["state"])
    for there, index in motions_in(known, behind):
        other = known[index]
        like = there & is_alike(other, motions, ALIKE.alike)
        step = motions["state"] - other["state"]
        # else it is in another of its forcing periods
        like &= distance(system, step) <= ALIKE.alike * motions["amplitude"]
        ahead[like] = step[like]
    return ahead
