"""A chain of eight cells: where they stop moving alike, in which wave they part, which then move,
and from which load on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus import MotionError, find_orbit, simulate
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import dataset, joined
from saltus_paper.figures.both_layers import embedded
from saltus_paper.figures.chain_panels import draw
from saltus_paper.figures.chain_waves import (
    CELLS,
    CRITICAL,
    PERIOD,
    SETTINGS,
    angles_at,
    at_load,
    begun,
    borders,
    branch_of,
    cell,
    chain,
    kept_states,
    largest,
    of_waves,
    orbit_at,
    shapes,
    transverse,
    turning,
    wave_numbers,
)
from saltus_paper.figures.figure import LivingPage, paper_figure
from saltus_paper.figures.harmonic_loads import AMPLITUDE
from saltus_paper.panel_work import Panels


def panels(samples: int = 49, couplings: int = 25, starts: int = 12, descents: int = 9) -> Panels:
    """The waves' multipliers over load and coupling and their checks; patterns, states and least
    loads over the coupling.
    """
    kappa = {
        name: np.geomspace(*SETTINGS.couplings, n).tolist()
        for name, n in (("cells", couplings), ("least", descents))
    }
    return {
        "cells": partial(settled_cells, kappa["cells"]),
        "least": partial(least_loads, kappa["least"]),
        "states": partial(states_beside, kappa["least"], starts),
        "modes": partial(mode_multipliers, samples),
        "pairs": pair_orbits,
        "traces": measured_traces,
        "waves": growing_waves,
    }


def mode_multipliers(samples: int, stiffnesses: int = 241) -> Any:
    """The multiplier of largest modulus over the stiffness sigma = kappa mu_q of a wave, at loads
    from the fold on.
    """
    branch = branch_of()
    fold, opens = borders(branch)
    # densely beside the fold
    loads = fold + (opens - fold) * (np.linspace(0.0, 1.0, samples + 1)[1:] ** 2 - 1e-6)
    sigma = np.geomspace(4e-3, 8.0, stiffnesses)
    found = np.array([largest(transverse(orbit_at(branch, load), sigma)) for load in loads])
    data = dataset(
        {
            "modulus": (
                ("amplitude", "stiffness"),
                np.abs(found),
                "1",
                "largest modulus of the multipliers of a wave",
            ),
            "real": (("amplitude", "stiffness"), found.real, "1", "real part of that multiplier"),
            "fold": ((), fold, "1", "Hhat at which the motion of one cell is born"),
            "opens": ((), opens, "1", "Hhat from which its closed layer opens"),
        },
        {
            "amplitude": ("amplitude", loads, "1", "Hhat"),
            "stiffness": (
                "stiffness",
                sigma,
                "1",
                "sigma = kappa mu_q of a wave of a row of any length",
            ),
        },
        what="transverse multipliers of the motion of one cell",
        system=cell(SETTINGS.begin),
    )
    return xr.DataTree(data)


def pair_orbits() -> Any:
    """The orbits of two cells that move alike, whose equations know nothing of waves, beside the
    multipliers of one cell.
    """
    # where two cells return to moving alike
    branch = branch_of()
    sigma = np.array([0.05, 0.5, 1.2])
    rows = []
    for load in (0.05, 0.1, 0.15):
        one = orbit_at(branch, load)
        time, state = turning(one)
        later = simulate(
            one.system, theta=state[0], velocity=state[1], time=time, duration=-time % PERIOD
        ).final_state
        both = embedded(np.tile(np.ravel(later), (2, 1)))
        for stiffness, wave in zip(sigma, np.linalg.eigvals(transverse(one, sigma)), strict=True):
            system = chain(load, stiffness / 2, cells=2)
            angles = dict(zip(system.model.coordinates, both[:, :2].ravel().tolist(), strict=True))
            pair = find_orbit(system, **angles, velocity=tuple(both[:, 2:].ravel().tolist()))
            off = max(np.abs(pair.multipliers - value).min() for value in (*wave, *one.multipliers))
            rows.append((load, stiffness, np.abs(wave).max(), off))
    load, stiffness, modulus, off = np.array(rows).T
    data = dataset(
        {
            "amplitude": ("orbit", load, "1", "Hhat"),
            "stiffness": ("orbit", stiffness, "1", "sigma = 2 kappa"),
            "modulus": (
                "orbit",
                modulus,
                "1",
                "largest modulus of the multipliers of the wave, from one cell",
            ),
            "difference": (
                "orbit",
                off,
                "1",
                "of both cells' multipliers from those of one cell and of the wave",
            ),
        },
        what="orbits of two cells that move alike",
    )
    return xr.DataTree(data)


def measured_traces(periods: int = 12) -> Any:
    """The traces of the waves' maps, from a motion of eight cells beside the one that they share,
    and from their equations.

    Of each wave the difference d_k after k periods follows d_(k+2) - tr d_(k+1) + det d_k = 0.
    """
    one = at_load(SETTINGS.load)
    coupling = SETTINGS.waves[0]
    maps = transverse(one, coupling * wave_numbers())
    time, state = turning(one)
    apart = SETTINGS.tiny * np.random.default_rng(0).standard_normal(CELLS)
    system = chain(SETTINGS.load, coupling)
    states = state + np.stack([apart, np.zeros(CELLS)], axis=1)
    motion = simulate(system, **begun(system, states, time), periods=periods, tol=1e-12)
    waves = shapes() @ (angles_at(motion, time + PERIOD * np.arange(periods + 1)) - state[0])
    first = waves[:, :-2]
    second = waves[:, 1:-1]
    third = waves[:, 2:]
    found = [
        np.sum(b * (c + np.linalg.det(m) * a)) / np.sum(b * b)
        for a, b, c, m in zip(first, second, third, maps, strict=True)
    ]
    data = dataset(
        {
            "expected": (
                "wave",
                np.trace(maps, axis1=1, axis2=2),
                "1",
                "trace of the map of the wave",
            ),
            "found": ("wave", np.array(found), "1", "the same from the motion of eight cells"),
        },
        {"wave": ("wave", np.arange(CELLS), "1", "q")},
        what="traces of the waves' maps",
        system=system,
    )
    return xr.DataTree(data)


def settled_cells(couplings: Sequence[float]) -> Any:
    """Where eight cells go that move nearly alike: the wave that has grown after a while, and which
    cells move at last.
    """
    one = at_load(SETTINGS.load)
    time, state = turning(one)
    rng = np.random.default_rng(0)
    rows = []
    for coupling in couplings:
        system = chain(SETTINGS.load, coupling)
        apart = rng.standard_normal(CELLS)
        states = state + SETTINGS.tiny * np.stack([apart, np.zeros(CELLS)], axis=1)
        early = simulate(
            system, **begun(system, states, time), periods=SETTINGS.dwell, tol=1e-12, dense=False
        )
        wave = shapes() @ (np.reshape(early.position, (-1, 2)).sum(axis=1) - state[0])
        states = state + SETTINGS.disturbed * np.stack([apart, np.zeros(CELLS)], axis=1)
        motion = followed(system, **begun(system, states, time), periods=SETTINGS.settling)
        if motion is None:
            rows.append(
                (int(np.abs(wave[1:]).argmax()) + 1, np.full(CELLS, np.nan), math.nan, math.nan)
            )
            continue
        seen = angles_at(
            motion, motion.time - PERIOD * SETTINGS.read * np.linspace(1, 0, 50 * SETTINGS.read + 1)
        )
        again = np.abs(seen[:, ::50] - seen[:, -1:])[:, :-1].max(axis=0).min()
        rows.append(
            (int(np.abs(wave[1:]).argmax()) + 1, np.abs(seen).max(axis=1), again, both_open(motion))
        )
    grown, size, again, opened = zip(*rows, strict=True)
    data = dataset(
        {
            "grown": (
                "coupling",
                np.array(grown),
                "1",
                "q of the wave that is largest after some periods, beside q = 0",
            ),
            "size": (
                ("coupling", "cell"),
                np.array(size),
                "rad",
                "largest angle of each cell at last",
            ),
            "again": (
                "coupling",
                np.array(again),
                "rad",
                "least distance from itself one to four periods before",
            ),
            "both_open": (
                "coupling",
                np.array(opened),
                "1",
                "share of the time and the cells with both layers open",
            ),
            "alike": ((), one.amplitude, "rad", "amplitude of the motion that all cells may share"),
        },
        {
            "coupling": ("coupling", list(couplings), "1", "kappa"),
            "cell": ("cell", np.arange(1, CELLS + 1), "1", "cell"),
        },
        what=f"eight cells that begin nearly alike, Hhat = {SETTINGS.load:g}",
        system=chain(SETTINGS.load, couplings[0]),
    )
    return xr.DataTree(data)


def both_open(motion: Any) -> float:
    """The share of the time and the cells with both layers open, in the last periods of a
    motion.
    """
    times = motion.time - PERIOD * SETTINGS.read * np.linspace(1, 0, 50 * SETTINGS.read + 1)
    return float(
        (motion.at(np.minimum(times, motion.time))[0].reshape(CELLS, 2, -1) != 0.0)
        .all(axis=1)
        .mean()
    )


def growing_waves(periods: int = 150) -> Any:
    """theta of each cell at one phase of the load, while a wave grows from small random
    differences, at two couplings.
    """
    one = at_load(SETTINGS.load)
    time, state = turning(one)
    apart = SETTINGS.disturbed * np.stack(
        [np.random.default_rng(1).standard_normal(CELLS), np.zeros(CELLS)], axis=1
    )
    seen = []
    for coupling in SETTINGS.waves:
        system = chain(SETTINGS.load, coupling)
        motion = simulate(system, **begun(system, state + apart, time), periods=periods)
        seen.append(angles_at(motion, time + PERIOD * np.arange(periods + 1)))
    data = dataset(
        {
            "theta": (
                ("coupling", "cell", "period"),
                np.array(seen),
                "rad",
                "angle at one phase of the load",
            )
        },
        {
            "coupling": ("coupling", list(SETTINGS.waves), "1", "kappa"),
            "cell": ("cell", np.arange(1, CELLS + 1), "1", "cell"),
            "period": ("period", np.arange(periods + 1), "1", "forcing periods"),
        },
        what=f"waves that grow, Hhat = {SETTINGS.load:g}",
        system=system,
    )
    return xr.DataTree(data)


def followed(system: Any, **arguments: Any) -> Any:
    """A motion, or None where a cell has both layers open and its hinge without mass lets no motion
    go on.
    """
    try:
        motion = simulate(system, **arguments)
    except MotionError:
        return None
    return motion if str(motion.stop) in ("horizon", "rest") else None


def moving(motion: Any) -> np.ndarray:
    """Which cells move in the last period, (cells,); none of a motion that has come to rest, or
    that has ended.
    """
    if motion is None or str(motion.stop) != "horizon":
        return np.zeros(CELLS, dtype=bool)
    return np.asarray(
        np.abs(angles_at(motion, motion.time - PERIOD * np.linspace(1, 0, 51))).max(axis=1)
        > SETTINGS.moves
    )


def states_beside(couplings: Sequence[float], starts: int) -> Any:
    """Which cells move at last if some of them begin on the motion of one cell and the others
    closed.
    """
    time, state = turning(at_load(SETTINGS.load))
    chosen = np.random.default_rng(2).permutation(2**CELLS - 2)[:starts] + 1
    begins = (chosen[:, None] >> np.arange(CELLS) & 1).astype(bool)
    ends = np.zeros((len(couplings), starts, CELLS), dtype=bool)
    ended = np.zeros((len(couplings), starts), dtype=bool)
    for i, coupling in enumerate(couplings):
        system = chain(SETTINGS.load, coupling)
        for j, open_cells in enumerate(begins):
            motion = followed(
                system,
                **begun(system, state * open_cells[:, None], time),
                periods=SETTINGS.settling // 2,
            )
            ends[i, j] = moving(motion)
            ended[i, j] = motion is None
    data = dataset(
        {
            "begun": (("start", "cell"), begins, "1", "which cells begin to move"),
            "moving": (("coupling", "start", "cell"), ends, "1", "which cells move at last"),
            "ended": (
                ("coupling", "start"),
                ended,
                "1",
                "whether the motion ends at the hinge without mass of a cell",
            ),
        },
        {"coupling": ("coupling", list(couplings), "1", "kappa")},
        what=f"eight cells of which some begin to move, Hhat = {SETTINGS.load:g}",
        system=chain(SETTINGS.load, couplings[0]),
    )
    return xr.DataTree(data)


def least_loads(couplings: Sequence[float]) -> Any:
    """How far the load may fall until all cells are closed for good: from nearly alike, and with
    the first cell alone moving.
    """
    time, state = turning(at_load(SETTINGS.load))
    apart = SETTINGS.disturbed * np.stack(
        [np.random.default_rng(0).standard_normal(CELLS), np.zeros(CELLS)], axis=1
    )
    begins = (state + apart, np.vstack([state, np.zeros((CELLS - 1, 2))]))
    found = np.array(
        [[descent(coupling, begin, time) for coupling in couplings] for begin in begins]
    )
    data = dataset(
        {"least": (("begin", "coupling"), found, "1", "least Hhat at which a cell still moves")},
        {
            "begin": ("begin", ["all cells", "first cell"]),
            "coupling": ("coupling", list(couplings), "1", "kappa"),
        },
        what="eight cells while the load is taken off",
        system=chain(SETTINGS.load, couplings[0]),
        step=SETTINGS.step,
    )
    return xr.DataTree(data)


def descent(coupling: float, begin: np.ndarray, time: float) -> float:
    """The least load of a descent at which a cell still moves; inf if none does at its beginning,
    nan if the motion ends.
    """
    system = chain(SETTINGS.load, coupling)
    least = math.inf
    start = begun(system, begin, time)
    periods = SETTINGS.settling // 2
    for load in np.arange(SETTINGS.load, SETTINGS.step / 2, -SETTINGS.step):
        motion = followed(system.with_({AMPLITUDE: float(load)}), **start, periods=periods)
        if motion is None:
            return math.nan
        if not moving(motion).any():
            return least
        names = system.model.coordinates
        own = 2 * CELLS
        x = motion.final_state.ravel().tolist()
        least = float(load)
        periods = SETTINGS.dwell
        start = dict(zip(names, x[:own], strict=True)) | {
            "velocity": tuple(x[own:]),
            "time": motion.time,
        }
    return least


def join(made: dict[str, Any]) -> Any:
    """The data of all panels."""
    return joined(
        made,
        what=(
            "a chain of eight cells under load (i), Omega = 1, V = -0.5, beta0 = 80 deg, C = "
            "0.1, m = 0, e = 0"
        ),
    )


def page(data: Any) -> LivingPage:
    """Eight cells beside the motion that they share, with a wave that grows."""
    system = chain(SETTINGS.load, SETTINGS.waves[0])
    time, state = turning(at_load(SETTINGS.load))
    states = state + SETTINGS.disturbed * np.stack([np.arange(CELLS) % 3, np.zeros(CELLS)], axis=1)
    return system, [], begun(system, states, time) | {"periods": 40}


def measure(data: Any) -> dict[str, Measured]:
    """Waves and their checks, where cells part, which move, and from which load on."""
    modes = data["modes"]
    cells = data["cells"]
    least = data["least"]
    pairs = data["pairs"]["difference"].values
    traces = np.abs(data["traces"]["found"] - data["traces"]["expected"]).values
    modulus = modes["modulus"].values
    real = modes["real"].values
    grows = modulus > 1.0
    loads = modes["amplitude"].values
    sigma = modes["stiffness"].values
    fold = float(modes["fold"])
    last = float(loads[grows.any(axis=1)].max())
    row = grows[np.abs(loads - SETTINGS.load).argmin()]
    band = sigma[row & (sigma < 1.0)]
    kappa = cells["coupling"].values
    moduli = np.array([of_waves(modes, value, SETTINGS.load) for value in kappa])
    size = cells["size"].values
    whole = np.isfinite(size).all(axis=1)
    parts = moduli.max(axis=1) > 1.0
    clear = (np.abs(moduli.max(axis=1) - 1.0) > 0.02) & whole
    parted = np.ptp(size, axis=1) > 10 * SETTINGS.disturbed
    ranked = np.sort(moduli, axis=1)
    fast = (ranked[:, -1] > 1.05) & (ranked[:, -1] > 1.03 * ranked[:, -2])
    lowest = least["least"].values[np.isfinite(least["least"].values)]
    waves = cells["grown"].values
    expected = moduli.argmax(axis=1) + 1
    count = np.where(whole, (size > SETTINGS.moves).sum(axis=1), CELLS)
    return {
        "chain-waves": measured(
            bool(pairs.max() < 1e-6 and traces.max() < 1e-3),
            pairs=float(pairs.max()), traces=float(traces.max()), orbits=pairs.size,
        ),
        "chain-parts": measured(
            bool((real[grows] > 1.0).all() and last < float(modes["opens"]) and (parts == parted)[clear].all()),
            last=last, fold=fold, load=SETTINGS.load, low=float(band.min()), high=float(band.max()),
            agree=int((parts == parted)[clear].sum()), tried=int(clear.sum()),
        ),
        "chain-wave": measured(
            bool((waves == expected)[fast].all() and np.unique(expected[fast]).size > 3),
            agree=int((waves == expected)[fast].sum()), tried=int(fast.sum()),
            waves=[{"q": int(q), "low": kappa[fast & (expected == q)].min(), "high": kappa[fast & (expected == q)].max()}
                   for q in np.unique(expected[fast])[::-1]],
        ),
        "chain-cells": measured(
            bool(count.min() <= CELLS // 2 and np.nanmax(size) > 1.2 * float(cells["alike"])),
            load=SETTINGS.load,
            fewest=int(count.min()),
            at=float(kappa[count.argmin()]),
            widest=float(np.nanmax(size)),
            alike=float(cells["alike"]),
            runs=kappa.size,
            one=int((cells["both_open"].values == 0.0).sum()),
            ended=int((~whole).sum()),
        ),
        "chain-states": _states(data["states"]),
        "chain-anticipated": measured(
            bool((lowest < 0.6 * CRITICAL).all()),
            critical=CRITICAL, fold=fold, low=float(lowest.min()), high=float(lowest.max()), descents=lowest.size,
            weakest=float(least["coupling"].min()), strongest=float(least["coupling"].max()),
        ),
    }  # fmt: skip


def _states(states: Any) -> Measured:
    same, sets = kept_states(states)
    kappa = states["coupling"].values
    starts = states.sizes["start"]
    return measured(
        bool(same[0] == starts and sets[-1] <= 2),
        starts=starts, first=kappa[0], same=int(same[0]), ended=int(states["ended"].sum()),
        couplings=[{"coupling": k, "same": int(a), "sets": int(b)} for k, a, b in zip(kappa, same, sets, strict=True)],
    )  # fmt: skip


FIGURE = paper_figure(
    "chain",
    quick={"samples": 17, "couplings": 9, "starts": 4, "descents": 3},
    panels=panels,
    join=join,
    draw=draw,
    measure=measure,
    page=page,
)
