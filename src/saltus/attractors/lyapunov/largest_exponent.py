"""The largest Lyapunov exponent of many motions at once, as samples of their attractors: what searching for chaos takes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from saltus.attractors.lyapunov.averages import resolution
from saltus.flow import Stop, last_states, motions_from, stop_names
from saltus.systems import System

FEWEST = 4  # motions of which a scatter is taken


@dataclass(frozen=True, eq=False)
class Largest:
    """Largest exponents with half widths of their 95 % intervals, per unit of dimensionless time; an entry for each group."""

    exponent: np.ndarray  # (groups,): nan where fewer than four motions of a group have an exponent
    error: np.ndarray
    positive: np.ndarray  # (groups,): whether it is above its error and the resolution
    negative: np.ndarray  # (groups,): whether it is below them


def largest_exponents(
    system: System,
    states: np.ndarray,
    parameters: Mapping[str, np.ndarray],
    *,
    periods: int,
    tol: float = 1e-10,
) -> Largest:
    """The largest exponent of each group of motions from states (groups, size, d) at phase 0, over so many forcing periods.

    The motions of a group are taken for independent samples of one attractor, so that their scatter gives the error, by Student's
    t. Motions that are lost are left out, and so are those whose perturbations surely shrink where others surely grow. A
    perturbation is given a quarter of the periods to turn to the direction that grows. The derivatives of the end to the start,
    through impacts, are those of `simulate_many`: along that direction they are accurate however far it grows. A perturbation
    of which closed contacts and sticking frictions leave nothing has shrunk by as much as a number can.

    The resolution is 2 ln(t) / t for the time t of one motion, as regular ones may part like t^2.

    Parameters
    ----------
    parameters
        Numbers by dotted path, (groups,) each, in place of the system's.
    """
    groups, size = states.shape[:2]
    frequency = parameters.get("load.frequency", np.array(system.load.frequency, dtype=float))
    duration = periods * 2.0 * math.pi / np.broadcast_to(frequency, groups)
    columns = {path: np.repeat(values, size) for path, values in parameters.items()}
    d = states.shape[-1]
    begin, direction = states.reshape(-1, d), np.full((groups * size, d), math.sqrt(1.0 / d))
    begin, direction, _ = _stretched(system, begin, direction, columns, max(1, periods // 4), tol)
    _, _, growth = _stretched(system, begin, direction, columns, periods, tol)
    return _averaged(growth.reshape(groups, size) / duration[:, None], resolution(duration))


def _stretched(
    system: System, states: np.ndarray, direction: np.ndarray, columns: dict[str, np.ndarray], periods: int, tol: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, directions and ln of the growth of small perturbations after so many periods; nan where a motion is lost."""
    here = np.isfinite(states).all(axis=1)
    later, turned, growth = np.full_like(states, np.nan), np.full_like(states, np.nan), np.full(len(states), np.nan)
    if not here.any():
        return later, turned, growth
    chosen = {path: values[here] for path, values in columns.items()}
    options = {"parameters": chosen, "periods": periods, "sensitivities": (), "sample": (), "until": ("rest",), "tol": tol}
    ends = motions_from(system, states[here], **options)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        grown = np.einsum("nij,nj->ni", ends["derivative"].values, direction[here])
        size = np.abs(grown).max(axis=1, keepdims=True)  # squares of what has grown by 1e200 are no numbers
        length = size[:, 0] * np.linalg.norm(grown / np.where(size > 0.0, size, 1.0), axis=1)
        # What is captured at rest would have to be followed through all of its impacts, of which there are millions.
        moving = (ends["side"].values != 0) & (stop_names(ends) != Stop.CAPTURED)
        gone = length == 0.0 if system.model.held else np.zeros(length.shape, dtype=bool)
        going = moving & np.isfinite(length) & ((length > 0.0) | gone)
        growth[here] = np.where(going, np.log(np.maximum(length, np.finfo(float).tiny)), np.nan)
        turned[here] = np.where(gone[:, None], direction[here], grown / length[:, None])
    later[here] = np.where(going[:, None], last_states(system, ends), np.nan)
    return later, turned, growth


def _averaged(rates: np.ndarray, least: np.ndarray) -> Largest:
    """The averages of rates (groups, size), of which those below `least` (groups,) count as 0."""
    surely = np.abs(rates) > least[:, None]
    grows, shrinks = surely & (rates > 0.0), surely & (rates < 0.0)
    counted = np.isfinite(rates) & ~(shrinks & grows.any(axis=1)[:, None])
    count = counted.sum(axis=1)
    enough = np.where(count < FEWEST, np.nan, count)
    mean = np.where(counted, rates, 0.0).sum(axis=1) / enough
    scatter = np.sqrt((np.where(counted, rates - mean[:, None], 0.0) ** 2).sum(axis=1) / (enough - 1.0))
    error = stdtrit(enough - 1.0, 0.975) * scatter / np.sqrt(enough)
    with np.errstate(invalid="ignore"):
        return Largest(mean, error, mean - error > least, mean + error < -least)
