"""The long computations of a diagram's search, done in this process, or as parts that other processes compute and a store keeps.

Each part is a pure function of its inputs, which are JSON: how motions end, the judgement of motions that have not settled, the
branch of an orbit, and the distance of an orbit from itself after some of its periods. A search that runs again finds in its
store what was computed before it was stopped.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import JUDGEMENT, EarlierJudgement, Judged, JudgementSettings, SettledLater, judge
from saltus.flow import Ending
from saltus.orbits import (
    Branch,
    PeriodicOrbit,
    SpecialPoint,
    as_bytes,
    closing_distances,
    continue_orbit,
    from_bytes,
    switch_branch,
)
from saltus.progress import Progress, silent
from saltus.provenance import check_provenance, identity, provenance
from saltus.studies.diagram.side_by_side import all_at_once
from saltus.studies.diagram.simulated import SETTINGS, SimulatedMotions, followed, simulate_from
from saltus.systems import System

if TYPE_CHECKING:
    from saltus.sweep import Parts, Plan

HERE = "saltus.studies.diagram.diagram_work"
KEPT = SETTINGS.kept
NUMBERS = (
    "periods",
    "outcome",
    "period",
    "impact_count",
    "highest",
    "lowest",
    "slowest",
)  # the first entries of a motion's row, before its states
JUDGED = (
    "ending",
    "reason",
    "exponent",
    "error",
    "resolution",
    "zero_one",
    "gone",
    "life",
    "period",
)  # the first entries of a judgement's row
EARLIER = tuple(part.name for part in fields(EarlierJudgement))
WHOLE = (*NUMBERS[1:4], "ending", "reason", "gone")  # the entries that are whole numbers
COMPANIONS = JUDGEMENT.companions  # the most states that are kept of a judgement
SETTLED, ALIKE = 32, 4  # the most settled motions that are kept of a judgement, and the most of one period
BRANCH_BYTES = 1 << 20  # the most bytes of a branch: one of 200 points has 12 000


@dataclass(frozen=True)
class Request:
    """The request for a branch: its start, its bounds, its longest step, and whether it ends where its orbits lose stability."""

    start: PeriodicOrbit | SpecialPoint  # an orbit to be followed, or a special point at which branches are born
    bounds: tuple[float, float]
    step: float
    while_stable: bool = False

    def to_json(self) -> dict[str, Any]:
        """The request as an input of a part."""
        numbers = {"bounds": list(self.bounds), "step": self.step, "while_stable": self.while_stable}
        return numbers | {"start": base64.b64encode(as_bytes(self.start)).decode()}

    def branches(self, path: str, progress: Progress = silent) -> list[Branch]:
        """The branches."""
        options: dict[str, Any] = {"step": self.step, "progress": progress}
        if isinstance(self.start, SpecialPoint):
            return list(switch_branch(self.start, self.bounds, both=False, **options))
        return [continue_orbit(self.start, path, self.bounds, while_stable=self.while_stable, **options)]


@dataclass
class DiagramWork:
    """The functions that a search calls for its long computations."""

    system: System
    path: str
    parts: Parts | None = None  # None: everything is computed in this process, and nothing is kept
    at_once: int = 1  # branches that are computed at the same time; some of them may turn out not to be needed
    # For motions that are known to end: how many forcing periods they were given, and after how many they ended.
    ended: dict[tuple[float, ...], tuple[int, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for given, row in () if self.parts is None else self.parts.remembered(self._kinds["motions"]):
            self._note(given, row)

    @property
    def _kinds(self) -> dict[str, Any]:
        return _parts(self.system.dimension)

    def simulate(self, values: np.ndarray, states: np.ndarray, periods: int, progress: Progress = silent) -> SimulatedMotions:
        """`simulate_from` states at values of the parameter."""
        return simulate_from(self.system, self.path, values, states, periods, progress, self.followed)

    def followed(self, values: np.ndarray, states: np.ndarray, periods: int, progress: Progress = silent) -> SimulatedMotions:
        """`followed` from states at values of the parameter, for at most so many periods, even if motions are slow."""
        if self.parts is None:
            return followed(self.system, self.path, values, states, periods, progress)
        begun = np.column_stack([values, states]).tolist()
        inputs = [[*row, self._time(tuple(row), periods)] for row in begun]
        rows = self.parts.rows(self._kinds["motions"], inputs, progress)
        for given, row in zip(inputs, rows, strict=True):
            self._note(given, row)
        return _motions(values, np.array(rows), self.system.dimension)

    def _time(self, begun: tuple[float, ...], periods: int) -> int:
        """The forcing periods to ask for: `periods` or, if the motion is known to end within these, as many as it was given then.

        It ends in the same way, and the store has the answer to the earlier request.
        """
        given, end = self.ended.get(begun, (periods, 0.0))
        return given if end <= periods else periods

    def _note(self, given: list[float], row: np.ndarray) -> None:
        if row[1] in (Ending.REST, Ending.PERIODIC, Ending.ENDED):
            self.ended.setdefault(tuple(given[:-1]), (int(given[-1]), float(row[0])))

    def judge(
        self, values: np.ndarray, states: np.ndarray, settings: JudgementSettings, earlier: EarlierJudgement | None = None
    ) -> Judged:
        """`judge` of states (n, m, d) at values (n,) of the parameter."""
        if self.parts is None:
            return self._judge(values, states, settings, earlier, silent)
        numbers = asdict(settings)
        given = [of_one[np.isfinite(of_one).all(axis=-1)].tolist() for of_one in states]
        inputs = [{"value": v, "states": s, "settings": numbers} for v, s in zip(values.tolist(), given, strict=True)]
        if earlier is not None:
            for one, row in zip(inputs, np.stack([getattr(earlier, name) for name in EARLIER], axis=1).tolist(), strict=True):
                one["earlier"] = row
        return _judged(np.array(self.parts.rows(self._kinds["judgements"], inputs)), settings.companions, self.system.dimension)

    def _judge(
        self,
        values: np.ndarray,
        states: np.ndarray,
        settings: JudgementSettings,
        earlier: EarlierJudgement | None,
        progress: Progress,
    ) -> Judged:
        found = judge(self.system, states, {self.path: values}, settings=settings, earlier=earlier, progress=progress)
        return replace(found, settled=found.settled.few(ALIKE, SETTLED))

    def judge_all(
        self, questions: Sequence[tuple[np.ndarray, np.ndarray, JudgementSettings, EarlierJudgement | None]]
    ) -> list[Judged]:
        """`judge` several times: all at once, or one after the other if results are kept or other processes compute."""
        if self.parts is not None:
            return [self.judge(*question) for question in questions]
        return all_at_once([partial(self._judge, *question) for question in questions])

    def follow(self, requests: Sequence[Request], progress: Progress = silent) -> list[list[Branch]]:
        """The branches of each request; those that the store lacks are computed at the same time."""
        if self.parts is None:
            return [request.branches(self.path, progress) for request in requests]
        texts = self.parts.texts(self._kinds["branches"], [request.to_json() for request in requests])
        return [from_bytes(text) if text else request.branches(self.path) for request, text in zip(requests, texts, strict=True)]

    def prepare(self, requests: Sequence[Request]) -> None:
        """Compute branches that may be asked for later at the same time, if there are other processes to do so."""
        if self.at_once > 1 and self.parts is not None:
            self.parts.rows(self._kinds["branches"], [request.to_json() for request in requests])

    def distances(self, starts: np.ndarray) -> np.ndarray:
        """`closing_distances` of orbits, (n,), which are given as rows by `closing_rows`."""
        if self.parts is None or not len(starts):
            return closing_distances(self.system, self.path, starts)
        return np.array(self.parts.rows(self._kinds["distances"], starts.tolist()))[:, 0]


def _parts(dimension: int) -> dict[str, Any]:
    """The kinds of parts by name, for states of so many variables."""
    from saltus.sweep import Part

    numbers = len(NUMBERS) + dimension + (dimension + 1) * KEPT
    judged = len(JUDGED) + dimension * COMPANIONS + (dimension + 1) * SETTLED
    kinds = [
        Part("motions", f"{HERE}:motions", numbers, chunk=1000),
        Part("judgements", f"{HERE}:judgements", judged, chunk=64),
        Part("branches", f"{HERE}:branches", BRANCH_BYTES, chunk=1, dtype="u1", threaded=False),
        Part("distances", f"{HERE}:distances", 1, chunk=2000),
    ]
    return {part.name: part for part in kinds}


@contextmanager
def diagram_work(
    system: System, path: str, plan: Plan, store: Path | None, workers: int | None, scheduler: str | None
) -> Iterator[DiagramWork]:
    """The work of a diagram, remembered in a store if one is given, and computed by other processes or by a cluster.

    Raises
    ------
    ParameterError
        As `saltus.sweep.run`.
    SweepError
        As `saltus.sweep.run`.
    """
    from saltus.sweep import Parts, SweepInterrupted, Workers, opened

    if store is None and workers is None and scheduler is None:
        yield DiagramWork(system, path)
        return
    with ExitStack() as stack:
        kept = None if store is None else stack.enter_context(opened(plan, store))
        processes = stack.enter_context(Workers(workers)) if workers is not None else None
        if kept is not None:
            kept.drop((0,))
        common = {"system": system.to_json(), "path": path, **identity(system)}
        at_once = BRANCHES_AT_ONCE if workers is not None or scheduler is not None else 1
        try:
            yield DiagramWork(system, path, Parts(common, store, processes, scheduler), at_once)
        except KeyboardInterrupt:
            keeps = (
                "nothing is kept without a store" if store is None else f"{store} keeps its parts: run the same again to go on"
            )
            raise SweepInterrupted(f"interrupted; {keeps}") from None
        if kept is not None:
            kept.write((0,), finished({}, {"diagram": np.zeros(1)}))


BRANCHES_AT_ONCE = 8  # branches, whatever the number of processes, so that what is computed does not depend on this number


def diagram_plan(system: System, path: str, bounds: tuple[float, float], window: Any, seed: int) -> Plan:
    """The plan that identifies the store of a diagram: searches that agree in its entries have parts in common, and may share a
    store."""
    from saltus.sweep import Plan, Variable

    about = {"kind": "diagram", "path": path, "bounds": list(bounds), "window": np.ravel(window).tolist()}
    mark = Variable(dtype="i1", attrs={"long_name": "1 once a search has come to its end"})
    return Plan(
        function=f"{HERE}:finished",
        axes={"diagram": np.zeros(1)},
        variables={"finished": mark},
        attrs=provenance(system, seed=seed, title="bifurcation diagram computed by saltus", **about),
    )


def finished(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The mark of a search that has come to its end."""
    return {"finished": np.ones(len(block["diagram"]), dtype=np.int8)}


def _given(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> tuple[System, list[Any]]:
    """The system, and the inputs of the parts in a chunk."""
    system = System.from_json(arguments["system"])
    check_provenance(arguments, system, "this diagram")
    return system, [arguments["inputs"][row] for row in np.asarray(block["row"], dtype=int)]


def motions(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """How motions end: each input is the value of the parameter, coordinates, velocities, and the most forcing periods."""
    system, inputs = _given(arguments, block)
    begun = np.array(inputs, dtype=float)
    d = system.dimension
    result = np.empty((len(begun), len(NUMBERS) + d + (d + 1) * KEPT))
    for periods in np.unique(begun[:, -1]):
        rows = begun[:, -1] == periods
        found = followed(system, arguments["path"], begun[rows, 0], begun[rows, 1:-1], int(periods))
        columns = [getattr(found, name)[:, None] for name in NUMBERS]
        result[rows] = np.concatenate([*columns, found.last, found.states.reshape(len(found), -1), found.peaks], axis=1)
    return {"result": result}


def _motions(values: np.ndarray, rows: np.ndarray, d: int) -> SimulatedMotions:
    """The motions that `motions` has written as rows."""
    rows = rows.reshape(len(values), -1)
    n, columns = len(NUMBERS), dict(zip(NUMBERS, rows.T, strict=False))
    columns |= {name: columns[name].astype(int) for name in NUMBERS if name in WHOLE}
    columns["outcome"] = columns["outcome"].astype(np.int8)
    columns |= {"value": np.array(values, dtype=float), "last": rows[:, n : n + d].copy()}
    states, peaks = np.split(rows[:, n + d :], [d * KEPT], axis=1)
    return SimulatedMotions(states=states.reshape(-1, KEPT, d), peaks=peaks, **columns)


def judgements(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The judgements of motions that have not settled; all inputs have the same settings, as they come from one call."""
    system, inputs = _given(arguments, block)
    d = system.dimension
    result = np.full((len(inputs), len(JUDGED) + d * COMPANIONS + (d + 1) * SETTLED), np.nan)
    settings = JudgementSettings(**inputs[0]["settings"])
    assert settings.companions <= COMPANIONS, "rows have room for so many"
    states = np.full((len(inputs), max(len(given["states"]) for given in inputs), d), np.nan)
    for to_fill, given in zip(states, inputs, strict=True):
        to_fill[: len(given["states"])] = given["states"]
    earlier = EarlierJudgement(*np.array([given["earlier"] for given in inputs]).T) if "earlier" in inputs[0] else None
    values = np.array([given["value"] for given in inputs])
    found = judge(system, states, {arguments["path"]: values}, settings=settings, earlier=earlier)
    n, later = len(JUDGED), found.settled.few(ALIKE, SETTLED)
    result[:, :n] = np.stack([getattr(found, name) for name in JUDGED], axis=1)
    result[:, n : n + d * settings.companions] = found.states.reshape(len(inputs), -1)
    for row in range(len(inputs)):
        own = later.question == row
        settled = np.column_stack([later.period[own], later.state[own]])
        result[row, n + d * COMPANIONS :][: settled.size] = settled.ravel()
    return {"result": result}


def _judged(rows: np.ndarray, companions: int, d: int) -> Judged:
    """The judgements that `judgements` has written as rows."""
    n, columns = len(JUDGED), dict(zip(JUDGED, rows.T, strict=False))
    columns |= {name: columns[name].astype(int) for name in JUDGED if name in WHOLE}
    settled = rows[:, n + d * COMPANIONS :].reshape(len(rows), SETTLED, d + 1)
    question, place = np.nonzero(np.isfinite(settled[..., 0]))
    later = SettledLater(question, settled[question, place, 1:], settled[question, place, 0].astype(int))
    return Judged(states=rows[:, n : n + d * companions].reshape(len(rows), -1, d), settled=later, **columns)


def branches(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Branches, as bytes."""
    from saltus.sweep import text_rows

    _, inputs = _given(arguments, block)
    found = []
    for given in inputs:
        start, bounds = from_bytes(base64.b64decode(given["start"])), tuple(given["bounds"])
        found.append(Request(start, bounds, given["step"], given["while_stable"]).branches(arguments["path"]))
    return {"result": text_rows([as_bytes(each) for each in found], BRANCH_BYTES)}


def distances(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The distances of orbits from themselves after some of their periods."""
    system, inputs = _given(arguments, block)
    return {"result": closing_distances(system, arguments["path"], np.array(inputs, dtype=float))[:, None]}
