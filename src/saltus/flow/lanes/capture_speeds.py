"""The speeds below which trajectories of an ensemble are proved to be captured at rest; equal
parameters are proved once.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.systems import System, distinct_rows

# the most systems, and parameter sets of each, whose capture speeds are kept
MOST_SYSTEMS = 16
MOST_PROVED = 1 << 18


def capture_speeds(
    system: System,
    columns: Mapping[str, np.ndarray],
    limits: tuple[str, ...],
    known: np.ndarray | None = None,
) -> Any:
    """The speed below which each trajectory is proved to be captured; `known` holds speeds that are
    known already, else nan.

    With several contacts the speed is used only where all contacts are closed and nothing moves: it
    is 0 or infinite.

    Raises
    ------
    ParameterError
        The motion is to stop at a margin other than the model's own ones: a captured motion may
        still reach it.
    """
    from saltus.bounds import keeps_rest

    lifted = system.model.friction_limits
    asked = [name for name in limits if name not in (*system.model.stops, *lifted)]
    if asked:
        raise ParameterError(
            f'until="rest" proves nothing about {asked[0]}; leave out either it or stop_at', "until"
        )
    model = system.model
    if model.frictions or model.surfaces or model.has_switches or model.has_multipliers:
        return 0.0  # nothing is proved about sticking frictions and about motions through surfaces
    if system.model.contacts:
        return np.where(keeps_rest(system, columns), math.inf, 0.0)
    if not system.model.sides:
        return 0.0
    if known is None:
        return _remembered(system, columns)
    speeds = known.copy()
    left = np.flatnonzero(np.isnan(known))
    if left.size:
        speeds[left] = _remembered(
            system, {path: a[left] if a.ndim else a for path, a in columns.items()}
        )
    return speeds


def captured_between(
    system: System, start: Mapping[str, np.ndarray], end: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The speeds below which motions are proved to be captured, for all parameters on n straight
    ways from `start` to `end`.

    A speed is nan if a proof succeeds at one end of a way but not along all of it: then single
    values must be asked. It is 0 if no proof succeeds at either end.
    """
    from saltus.bounds import proved_speeds

    size = len(next(iter(start.values())))
    if system.model.frictions or system.model.contacts or not system.model.sides:
        return np.full(size, np.nan)
    speeds = proved_speeds(system, start, end)
    left = np.flatnonzero(speeds == 0.0)
    if left.size:
        ends = [
            _remembered(system, {path: a[left] for path, a in columns.items()})
            for columns in (start, end)
        ]
        speeds[left] = np.where(np.maximum(*ends) > 0.0, np.nan, 0.0)
    return speeds


def _remembered(system: System, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """`proved_speeds`, remembered for equal parameters, because studies ask for the same ones many
    times.
    """
    from saltus.bounds import proved_speeds

    varied = {path: values for path, values in sorted(columns.items()) if values.ndim}
    if not varied:
        return proved_speeds(system, columns)
    sets, place = distinct_rows(list(varied.values()))
    single = {path: float(values) for path, values in columns.items() if not values.ndim}
    rows = [row.tobytes() for row in sets]
    with _proving:
        if len(_proved) >= MOST_SYSTEMS:
            _proved.clear()
        known = _proved.setdefault((system.to_json(), *varied, *single.items()), {})
        new = [i for i, row in enumerate(rows) if row not in known]
        if new:
            if len(known) + len(new) > MOST_PROVED:
                known.clear()
                new = list(range(len(rows)))
            distinct = dict(zip(varied, sets[new].T, strict=True))
            known.update(
                zip(
                    (rows[i] for i in new),
                    proved_speeds(system, {**columns, **distinct}).tolist(),
                    strict=True,
                )
            )
        return np.asarray(np.array([known[row] for row in rows])[place])


_proving = threading.Lock()  # Studies follow several ensembles at the same time.
_proved: dict[tuple[Any, ...], dict[bytes, float]] = {}
