"""The long computations of a diagram's search, done in this process, or as parts that other
processes compute and a store keeps.

Each part is a pure function of its inputs, which are JSON. The parts are how motions end, and the
judgement of motions that have not settled. The others are the branch of an orbit, and its distance
from itself after some of its periods. A search that runs again finds in its store what was computed
before it was stopped.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, CancelledError, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from contextvars import copy_context
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from saltus.attractors import EarlierJudgement, Judged, JudgementSettings, SettledLater, judge
from saltus.flow import Ending, available_cores
from saltus.orbits import (
    Branch,
    PeriodicOrbit,
    SpecialPoint,
    as_json,
    closing_distances,
    continue_orbit,
    from_json,
    switch_branch,
)
from saltus.progress import LOOK_INTERVAL, Progress, silent
from saltus.result import check_provenance, identity, provenance
from saltus.studies.diagram.simulated import SimulatedMotions, followed, simulate_from
from saltus.systems import System

if TYPE_CHECKING:
    from saltus.sweep import Memo, MemoKind, Plan

R = TypeVar("R")


def side_by_side(
    beside: Callable[[Progress], object], here: Callable[[Progress], object], progress: Progress
) -> None:
    """Do two things at the same time, `beside` in another thread.

    Neither may change what the other one reads; the results are then those of one after the other,
    which is how they are done if there is one core only. Only this thread calls `progress`. If one
    of them is interrupted or fails, the other one ends when it next reports its progress.
    """
    if available_cores() == 1:
        beside(progress)
        here(progress)
        return
    with _Others(1) as others:
        other = others.begin(beside)

        def watched(fraction: float, what: str) -> None:
            if other.done():
                other.result()  # raises its error
            progress(fraction, what)

        here(watched)
        others.wait(progress)


def all_at_once(computations: Sequence[Callable[[Progress], R]]) -> list[R]:
    """The results of computations that do not depend on one another, each in a thread of its own if
    there are several cores.

    After an interrupt each ends when it next reports its progress.
    """
    if available_cores() == 1 or len(computations) < 2:
        return [compute(silent) for compute in computations]
    with _Others(len(computations)) as others:
        runs = [others.begin(compute) for compute in computations]
        others.wait(silent)
        return [run.result() for run in runs]


class _Others:
    """Threads beside this one.

    If this one leaves the context by an exception, they end when they next report their progress.
    """

    def __init__(self, count: int) -> None:
        self._pool = ThreadPoolExecutor(count)
        self._stopped = threading.Event()
        self._runs = list[Future[Any]]()
        self._report = (0.0, "")

    def __enter__(self) -> _Others:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._stopped.set()
        self._pool.shutdown()

    def begin(self, compute: Callable[[Progress], R]) -> Future[R]:
        """Begin a computation in a thread of its own."""
        # with the device of the study
        run = self._pool.submit(copy_context().run, compute, self._take_report)
        self._runs.append(run)
        return run

    def wait(self, progress: Progress) -> None:
        """Wait until all are done, and pass on what they report; raises the first error."""
        while wait(self._runs, LOOK_INTERVAL, FIRST_EXCEPTION).not_done:
            for run in self._runs:
                if run.done():
                    run.result()
            if self._report[1]:
                progress(*self._report)
        for run in self._runs:
            run.result()

    def _take_report(self, fraction: float, what: str) -> None:
        if self._stopped.is_set():
            raise CancelledError
        self._report = fraction, what


HERE = "saltus.studies.diagram.diagram_work"
JUDGED = tuple(part.name for part in fields(Judged) if part.name != "settled")
EARLIER = tuple(part.name for part in fields(EarlierJudgement))
# the most settled motions that are kept of a judgement, and the most of one period
SETTLED = 32
ALIKE = 4


@dataclass(frozen=True)
class Request:
    """The request for a branch: its start, its bounds, its longest step, and whether it ends where
    its orbits lose stability.
    """

    # an orbit to be followed, or a special point at which branches are born
    start: PeriodicOrbit | SpecialPoint
    bounds: tuple[float, float]
    step: float
    while_stable: bool = False

    def to_json(self) -> dict[str, Any]:
        """The request as an input of a part."""
        numbers = {
            "bounds": list(self.bounds),
            "step": self.step,
            "while_stable": self.while_stable,
        }
        return numbers | {"start": as_json(self.start)}

    def branches(self, path: str, progress: Progress = silent) -> list[Branch]:
        """The branches."""
        options: dict[str, Any] = {"step": self.step, "progress": progress}
        if isinstance(self.start, SpecialPoint):
            return list(switch_branch(self.start, self.bounds, both=False, **options))
        return [
            continue_orbit(self.start, path, self.bounds, while_stable=self.while_stable, **options)
        ]


@dataclass
class DiagramWork:
    """The functions that a search calls for its long computations."""

    system: System
    path: str
    memo: Memo | None = None  # None: everything is computed in this process, and nothing is kept
    # branches that are computed at the same time; some of them may turn out not to be needed
    at_once: int = 1
    # For motions that are known to end: how many forcing periods they were given, and after how
    # many they ended.
    ended: dict[tuple[float, ...], tuple[int, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for given, found in () if self.memo is None else self.memo.remembered(kinds()["motions"]):
            self._note(given, found)

    def simulate(
        self, values: np.ndarray, states: np.ndarray, periods: int, progress: Progress = silent
    ) -> SimulatedMotions:
        """`simulate_from` states at values of the parameter."""
        return simulate_from(
            self.system, self.path, values, states, periods, progress, self.followed
        )

    def followed(
        self, values: np.ndarray, states: np.ndarray, periods: int, progress: Progress = silent
    ) -> SimulatedMotions:
        """`followed` from states at values of the parameter, for at most so many periods, even if
        motions are slow.
        """
        if self.memo is None or not len(values):
            return followed(self.system, self.path, values, states, periods, progress)
        begun = np.column_stack([values, states]).tolist()
        inputs = [[*row, self._time(tuple(row), periods)] for row in begun]
        found = self.memo.results(kinds()["motions"], inputs, progress)
        for given, one in zip(inputs, found, strict=True):
            self._note(given, one)
        return SimulatedMotions(
            *(np.array([one[part.name] for one in found]) for part in fields(SimulatedMotions))
        )

    def _time(self, begun: tuple[float, ...], periods: int) -> int:
        """The forcing periods to ask for: `periods` or, if the motion is known to end within these,
        as many as it was given then.

        It ends in the same way, and the store has the answer to the earlier request.
        """
        given, end = self.ended.get(begun, (periods, 0.0))
        return given if end <= periods else periods

    def _note(self, given: list[float], found: Mapping[str, Any]) -> None:
        if found["outcome"] in (Ending.REST, Ending.PERIODIC, Ending.ENDED):
            self.ended.setdefault(tuple(given[:-1]), (int(given[-1]), float(found["periods"])))

    def judge(
        self,
        values: np.ndarray,
        states: np.ndarray,
        settings: JudgementSettings,
        earlier: EarlierJudgement | None = None,
    ) -> Judged:
        """`judge` of states (n, m, d) at values (n,) of the parameter."""
        if self.memo is None or not len(values):
            return self._judge(values, states, settings, earlier, silent)
        numbers = asdict(settings)
        given = [of_one[np.isfinite(of_one).all(axis=-1)].tolist() for of_one in states]
        inputs = [
            {"value": v, "states": s, "settings": numbers}
            for v, s in zip(values.tolist(), given, strict=True)
        ]
        if earlier is not None:
            for one, row in zip(
                inputs,
                np.stack([getattr(earlier, name) for name in EARLIER], axis=1).tolist(),
                strict=True,
            ):
                one["earlier"] = row
        return _judged(self.memo.results(kinds()["judgements"], inputs))

    def _judge(
        self,
        values: np.ndarray,
        states: np.ndarray,
        settings: JudgementSettings,
        earlier: EarlierJudgement | None,
        progress: Progress,
    ) -> Judged:
        found = judge(
            self.system,
            states,
            {self.path: values},
            settings=settings,
            earlier=earlier,
            progress=progress,
        )
        return replace(found, settled=found.settled.few(ALIKE, SETTLED))

    def judge_all(
        self,
        questions: Sequence[
            tuple[np.ndarray, np.ndarray, JudgementSettings, EarlierJudgement | None]
        ],
    ) -> list[Judged]:
        """`judge` several times: all at once, or one after the other if results are kept or other
        processes compute.
        """
        if self.memo is not None:
            return [self.judge(*question) for question in questions]
        return all_at_once([partial(self._judge, *question) for question in questions])

    def branches_of(
        self, requests: Sequence[Request], progress: Progress = silent
    ) -> list[list[Branch]]:
        """The branches of each request; those that the store lacks are computed at the same
        time.
        """
        if self.memo is None:
            return [request.branches(self.path, progress) for request in requests]
        found = self.memo.results(kinds()["branches"], [request.to_json() for request in requests])
        return [from_json(one["branches"]) for one in found]

    def prepare(self, requests: Sequence[Request]) -> None:
        """Compute branches that may be asked for later at the same time, if there are other
        processes to do so.
        """
        if self.at_once > 1 and self.memo is not None:
            self.memo.results(kinds()["branches"], [request.to_json() for request in requests])

    def distances(self, starts: np.ndarray) -> np.ndarray:
        """`closing_distances` of orbits, (n,), which are given as rows by `closing_rows`."""
        if self.memo is None or not len(starts):
            return closing_distances(self.system, self.path, starts)
        return np.array(
            [one["distance"] for one in self.memo.results(kinds()["distances"], starts.tolist())]
        )


def kinds() -> dict[str, MemoKind]:
    """The kinds of results that are remembered, by name."""
    from saltus.sweep import MemoKind

    found = [
        MemoKind("motions", f"{HERE}:motions", chunk=1000),
        MemoKind("judgements", f"{HERE}:judgements", chunk=64),
        MemoKind("branches", f"{HERE}:branches", chunk=1, threaded=False),
        MemoKind("distances", f"{HERE}:distances", chunk=2000),
    ]
    return {kind.name: kind for kind in found}


@contextmanager
def diagram_work(
    system: System,
    path: str,
    plan: Plan,
    store: Path | None,
    workers: int | None,
    scheduler: str | None,
) -> Iterator[DiagramWork]:
    """The work of a diagram, remembered in a store if one is given, and computed by other processes
    or by a cluster.

    Raises
    ------
    ParameterError
        As `saltus.sweep.run`.
    SweepError
        As `saltus.sweep.run`.
    """
    from saltus.sweep import Memo, SweepInterrupted, Workers, opened

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
            yield DiagramWork(system, path, Memo(common, store, processes, scheduler), at_once)
        except KeyboardInterrupt:
            keeps = (
                "nothing is kept without a store"
                if store is None
                else f"{store} keeps its parts: run the same again to go on"
            )
            raise SweepInterrupted(f"interrupted; {keeps}") from None
        if kept is not None:
            kept.write((0,), finished({}, {"diagram": np.zeros(1)}))


# branches, whatever the number of processes, so that what is computed does not depend on this
# number
BRANCHES_AT_ONCE = 8


def diagram_plan(
    system: System, path: str, bounds: tuple[float, float], window: Any, seed: int
) -> Plan:
    """The plan that identifies the store of a diagram: searches that agree in its entries have
    parts in common, and may share a store."""
    from saltus.sweep import Plan, Variable

    about = {
        "kind": "diagram",
        "path": path,
        "bounds": list(bounds),
        "window": np.ravel(window).tolist(),
    }
    mark = Variable(dtype="i1", attrs={"long_name": "1 once a search has come to its end"})
    return Plan(
        function=f"{HERE}:finished",
        axes={"diagram": np.zeros(1)},
        variables={"finished": mark},
        attrs=provenance(
            system, seed=seed, title="bifurcation diagram computed by saltus", **about
        ),
    )


def finished(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The mark of a search that has come to its end."""
    return {"finished": np.ones(len(block["diagram"]), dtype=np.int8)}


def _system(arguments: Mapping[str, Any]) -> System:
    system = System.from_json(arguments["system"])
    check_provenance(arguments, system, "this diagram")
    return system


def motions(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, np.ndarray]:
    """How motions end: each input is the value of the parameter, coordinates, velocities, and the
    most forcing periods.
    """
    system = _system(arguments)
    begun = np.array(inputs, dtype=float)
    periods = np.unique(begun[:, -1])
    alike = [np.flatnonzero(begun[:, -1] == each) for each in periods]
    parts = [
        followed(
            system, arguments["path"], begun[rows, 0], begun[rows, 1:-1], int(begun[rows[0], -1])
        )
        for rows in alike
    ]
    found = parts[0].joined(*parts[1:]).only(np.argsort(np.concatenate(alike), kind="stable"))
    return {part.name: getattr(found, part.name) for part in fields(found)}


def judgements(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, Any]:
    """The judgements of motions that have not settled; all inputs have the same settings, as they
    come from one call.
    """
    system = _system(arguments)
    settings = JudgementSettings(**inputs[0]["settings"])
    states = np.full(
        (len(inputs), max(len(given["states"]) for given in inputs), system.dimension), np.nan
    )
    for to_fill, given in zip(states, inputs, strict=True):
        to_fill[: len(given["states"])] = given["states"]
    earlier = (
        EarlierJudgement(*np.array([given["earlier"] for given in inputs]).T)
        if "earlier" in inputs[0]
        else None
    )
    values = np.array([given["value"] for given in inputs])
    found = judge(system, states, {arguments["path"]: values}, settings=settings, earlier=earlier)
    later = found.settled.few(ALIKE, SETTLED)
    own = [later.question == row for row in range(len(inputs))]
    settled = {
        f"settled_{name}": [getattr(later, name)[rows] for rows in own]
        for name in ("state", "period")
    }
    return {name: getattr(found, name) for name in JUDGED} | settled


def _judged(found: Sequence[Mapping[str, Any]]) -> Judged:
    """The judgements that `judgements` has given, together."""
    question = np.repeat(np.arange(len(found)), [len(one["settled_period"]) for one in found])
    settled = (
        np.concatenate([one[f"settled_{name}"] for one in found]) for name in ("state", "period")
    )
    columns = {name: np.array([one[name] for one in found]) for name in JUDGED}
    return Judged(settled=SettledLater(question, *settled), **columns)


def branches(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, Any]:
    """Branches, as records of orbits."""
    _system(arguments)
    found = []
    for given in inputs:
        request = Request(
            from_json(given["start"]), tuple(given["bounds"]), given["step"], given["while_stable"]
        )
        found.append(as_json(request.branches(arguments["path"])))
    return {"branches": found}


def distances(arguments: Mapping[str, Any], inputs: Sequence[Any]) -> dict[str, np.ndarray]:
    """The distances of orbits from themselves after some of their periods."""
    return {
        "distance": closing_distances(
            _system(arguments), arguments["path"], np.array(inputs, dtype=float)
        )
    }
