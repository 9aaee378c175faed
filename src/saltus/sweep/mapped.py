"""A quantity of one's own over a grid of parameters: a plan of single calls of a function."""

from __future__ import annotations

import itertools
import pickle
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Numbers, answered, check_count
from saltus.errors import ParameterError, SweepError, shown
from saltus.progress import Progress, silent
from saltus.result import MAPPED, provenance
from saltus.sweep.content import contents_of
from saltus.sweep.execution import check_run, run
from saltus.sweep.plan import Plan, Variable, axis_values
from saltus.sweep.store import opened
from saltus.sweep.store_files import METADATA
from saltus.sweep.store_status import read_plan

if TYPE_CHECKING:
    import xarray

VALUE = "value"  # the variable of a function that returns no names
ASKED_AGAIN = 2  # kept points that are computed again where a store is gone on with
REPEATED = 1e-6  # the relative difference of values that another machine may round differently
ANEW = (
    "name another store, or remove this one (saltus.sweep.remove_store) to compute all points anew"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class FunctionPlan(Plan):
    """A plan of single calls.

    Its store knows the function by its name and by digests of what it computes with; processes get it itself, or pickled.
    """

    call: Any

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "arguments", {**self.arguments, "call": self.call})

    def describe(self) -> dict[str, Any]:
        """The plan as JSON, without the function itself."""
        described = super().describe()
        return {
            **described,
            "arguments": {k: v for k, v in described["arguments"].items() if k != "call"},
        }


@answered
def map_over(
    function: Callable[..., Any],
    grid: Mapping[str, Numbers],
    *,
    store: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    chunk: Mapping[str, int] | None = None,
    progress: Progress = silent,
    retries: int = 1,
) -> xarray.Dataset:
    """A quantity of one's own at every point of a grid (a parameter study): `function(**point)` for
    all combinations of values.

    With a `store` it can be stopped, or killed, at any moment, and the same call goes on where it
    was. A store that was made by another function is refused, or by other values that it reads:
    closures, defaults, globals, and what these depend on. Where a store goes on, two points are
    computed again and compared. The function may be defined anywhere, in a notebook too: with
    `workers` or a `scheduler` it is sent to the processes by cloudpickle then (`pip install
    "saltus[cluster]"` has it).

    Parameters
    ----------
    function
        Called with one number for each name of the grid, it returns a number or an array, or a dict
        of them by name. Their shapes are the same at all points. It must depend on nothing else
        that changes.
    grid
        The values by name, each a list of numbers.
    store
        A folder in which each chunk is kept as soon as it is computed; see `saltus.sweep.run`.
    workers
        How many processes compute at once, such as os.cpu_count(); None computes in this one, which
        is right for functions that use all cores themselves, as `simulate_many` does. Scripts need
        `if __name__ == "__main__":` around a call with workers.
    scheduler
        The address of a Dask scheduler, such as "tcp://host:8786", whose workers compute.
    chunk
        How many points of a name make one chunk, 1 where nothing is said. A chunk is what a process
        computes at once, and a file of the store.
    progress
        Called with the share of the chunks that are done, and in words with their number and the
        time that is left.
    retries
        How often a chunk whose function raises is tried again, after all others.

    Returns
    -------
    xarray.Dataset
        Over the names of the grid a variable for each name that the function returns, or `value`;
        entries of arrays are along dimensions of their own.

    Raises
    ------
    ParameterError
        The function returns no numbers, or other shapes than before; the store is of another
        function or another grid; the function cannot be sent to processes.
    SweepError, SweepInterrupted
        As for `saltus.sweep.run`; what was computed is kept. Or the function raises at every point.

    Examples
    --------
    >>> def amplitude(frequency, damping):
    ...     changed = wall.with_({"load.frequency": frequency, "model.damping": damping, "load.force.amplitude": 0.1})
    ...     return saltus.find_orbit(changed, x=0.0).amplitude
    >>> found = saltus.map_over(amplitude, {"frequency": [2.0, 3.0], "damping": [0.1, 0.2]})
    >>> found.value.dims, round(float(found.value[0, 0]), 6)  # 0.1 / hypot(3, 0.2)
    (('frequency', 'damping'), 0.03326)
    """
    if not callable(function):
        raise ParameterError(
            f"function must be a function of the names of the grid, got {shown(function)}",
            "function",
        )
    if not isinstance(grid, Mapping) or not grid:
        raise ParameterError(
            f"grid must be a dict of lists of numbers, by their names, got {shown(grid)}", "grid"
        )
    check_count("retries", retries, 0, 100)
    path = check_run(store, workers, scheduler, progress)
    axes = {name: axis_values(name, values) for name, values in grid.items()}
    name = getattr(function, "__qualname__", type(function).__name__)
    content = {} if path is None else contents_of(function)
    _refuse_other_content(path, name, content)
    call = (
        function
        if workers is None and scheduler is None
        else _sent(function, scheduler is not None)
    )
    plan = FunctionPlan(
        function=f"{__name__}:values_at",
        arguments={"function": name, "content": content},
        variables=_known_variables(path) or _variables(_first_answer(function, axes)),
        attrs={"title": f"{name} over a grid, computed by saltus", "kind": MAPPED}
        | provenance(None),
        axes=axes,
        chunk=dict.fromkeys(axes, 1) | dict(chunk or {}),
        call=call,
    )
    if path is not None:
        _ask_again(plan, path, name)
    return run(plan, path, workers=workers, scheduler=scheduler, progress=progress, retries=retries)


def values_at(
    arguments: Mapping[str, Any], block: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """The answers of the function at all points of a chunk, as `run` asks for them."""
    call = arguments["call"]
    function = pickle.loads(call) if isinstance(call, bytes) else call
    shape = tuple(len(values) for values in block.values())
    points = [
        dict(zip(block, point, strict=True))
        for point in itertools.product(*(v.tolist() for v in block.values()))
    ]
    answers = [_answer(function, point) for point in points]
    for answer, point in zip(answers, points, strict=True):
        if {n: v.shape for n, v in answer.items()} != {n: v.shape for n, v in answers[0].items()}:
            raise ParameterError(
                f"function returned at {point} other names or shapes than at {points[0]}",
                "function",
            )
    return {
        name: np.stack([a[name] for a in answers]).reshape(shape + first.shape)
        for name, first in answers[0].items()
    }


def _first_answer(
    function: Callable[..., Any], axes: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """What the function returns at the first point at which it does not raise."""
    raised: list[tuple[dict[str, float], Exception]] = []
    for values in itertools.product(*(axis.tolist() for axis in axes.values())):
        point = dict(zip(axes, values, strict=True))
        try:
            answer = function(**point)
        except (
            Exception
        ) as error:  # of whatever kind: the plan reports it as it does that of any other point
            raised.append((point, error))
        else:
            return _arrays(answer, point)
    point, first = raised[0]
    where = ", ".join(f"{name} {shown(value)}" for name, value in point.items())
    sentence = (
        f"the function raised at each of the {len(raised)} points: {type(first).__name__}: {first}"
        f" at the first, {where}"
    )
    raise SweepError(sentence) from first


def _answer(function: Callable[..., Any], point: Mapping[str, float]) -> dict[str, np.ndarray]:
    """What the function returns at a point, as arrays by name."""
    return _arrays(function(**point), point)


def _arrays(answer: Any, point: Mapping[str, float]) -> dict[str, np.ndarray]:
    """What the function returned at a point, as arrays by name."""
    named = (
        dict(answer)
        if isinstance(answer, Mapping) and not hasattr(answer, "data_vars")
        else {VALUE: answer}
    )
    arrays = {str(name): np.asarray(value) for name, value in named.items()}
    for name, array in arrays.items():
        if array.dtype.kind not in "biufc":
            what = f"as {name!r} " if isinstance(answer, Mapping) else ""
            raise ParameterError(
                f"function must return numbers, got {what}{shown(named[name])} at {dict(point)}",
                "function",
            )
    return {
        name: array.astype(complex if array.dtype.kind == "c" else float)
        for name, array in arrays.items()
    }


def _variables(answer: Mapping[str, np.ndarray]) -> dict[str, Variable]:
    """The variables of a plan whose function gives such answers."""
    return {
        name: Variable(
            dtype=array.dtype.name,
            extra=tuple((f"{name}_{i}", size) for i, size in enumerate(array.shape)),
        )
        for name, array in answer.items()
    }


def _known_variables(path: Path | None) -> dict[str, Variable]:
    """The variables of a store that is there, so that to go on asks the function for nothing that
    is known.
    """
    if path is None or not (path / METADATA).is_file():
        return {}
    known = read_plan(path)["variables"].items()
    return {
        name: Variable(dtype=each["dtype"], extra=tuple(map(tuple, each["extra"])))
        for name, each in known
    }


def _refuse_other_content(path: Path | None, name: str, content: Mapping[str, str]) -> None:
    """Refuse a store that was begun with another function, or with other values in it."""
    if path is None or not (path / METADATA).is_file():
        return
    arguments = read_plan(path)["arguments"]
    known = arguments.get("content")
    if not isinstance(known, dict):
        what = f"{path} does not say of what its function was made, as an older saltus wrote it"
    else:
        changed = [part for part in {**known, **content} if known.get(part) != content.get(part)]
        if not changed:
            return
        part = next((part for part in changed if part == "text"), changed[0])
        what = f"the {part} of the function {name} has changed since {path} was begun"
    raise ParameterError(f"{what}: {ANEW}", "store")


def _ask_again(plan: FunctionPlan, path: Path, name: str) -> None:
    """Refuse a store with kept points at which the function gives other values now, as where it
    reads a file that has changed: some are computed again where it goes on.
    """
    if not (path / METADATA).is_file():
        return
    with opened(plan, path) as store:
        missing = set(store.missing())
        kept = [index for index in np.ndindex(plan.chunks.grid) if index not in missing]
        if not missing or not kept:
            return
        rng = np.random.default_rng()
        for place in rng.permutation(len(kept))[:ASKED_AGAIN]:
            cut = plan.chunks.slices(kept[place])
            point = tuple(int(rng.integers(part.start, part.stop)) for part in cut)
            block = {
                axis: values[[i]]
                for (axis, values), i in zip(plan.axes.items(), point, strict=True)
            }
            try:
                now = values_at(plan.arguments, block)
            except Exception:  # the run tells what it raises, and may come to this point again
                continue
            for variable, array in store.arrays.items():
                before = np.asarray(array[tuple(slice(i, i + 1) for i in point)])
                if before.shape != now[variable].shape or not _same(before, now[variable]):
                    where = ", ".join(f"{axis}={float(v[0]):g}" for axis, v in block.items())
                    raise ParameterError(
                        f"the function {name} gives {variable} = {shown(now[variable].ravel()[0])} "
                        f"at {where}, and {path} keeps {shown(before.ravel()[0])}: something that "
                        f"the function reads has changed; {ANEW}",
                        "store",
                    )


def _same(before: np.ndarray, now: np.ndarray) -> bool:
    """Whether values are the same but for the rounding of another machine."""
    size = float(np.nanmax(np.abs(before), initial=0.0, where=np.isfinite(before)))
    return np.allclose(now, before, rtol=REPEATED, atol=1e-3 * REPEATED * size, equal_nan=True)


def _sent(function: Callable[..., Any], far: bool) -> Any:
    """The function as processes take it: itself if they can import it, else its bytes by
    cloudpickle.
    """
    module = getattr(function, "__module__", None)
    script = module == "__main__" and not far and getattr(sys.modules["__main__"], "__file__", None)
    if module != "__main__" or script:
        try:
            pickle.dumps(function)
        except (
            pickle.PicklingError,
            AttributeError,
            TypeError,
        ):  # a lambda, or one that is defined inside of another
            pass
        else:
            return function
    try:
        from cloudpickle import dumps
    except ImportError:
        raise ParameterError(
            "the function is defined in a notebook or inside another function, where other "
            "processes cannot find it: install cloudpickle, put the function into a file and "
            "import it, or"
            " leave workers out",
            "function",
        ) from None
    return dumps(function)
