"""The paper's motions compared with those of both layers: which stay, change or vanish when the
closed layer may open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus import NewtonImpact, System, TwoLayer, simulate
from saltus.flow import Ending, Recurrence, find_recurrence
from saltus_paper.claims.claim import Measured, measured
from saltus_paper.figure_data import dataset, joined
from saltus_paper.figures import fig04, fig05
from saltus_paper.figures.both_layers_panels import MEANINGS, draw
from saltus_paper.figures.figure import LivingPage, paper_figure
from saltus_paper.figures.harmonic_loads import AMPLITUDE, FREQUENCY, under_force
from saltus_paper.figures.phase_portraits import constant_load

# Variants of the full model: m, e of both layers, and the transfer g. With m = 0 and (e, g) = (0,
# 1) motions cross the contact as in the paper. With e > 0 the transfer changes no motion, as the
# other layer is open when one closes.
VARIANTS: tuple[tuple[float, float, float], ...] = (
    (0.0, 0.0, 1.0),
    *((m, e, g) for m in (0.001, 0.01) for e, g in ((0.0, 1.0), (0.0, 0.0), (0.5, 0.0))),
)
# the variant of the pictures: almost no mass, frictionless inelastic contact (erratum 25)
REFERENCE = (0.001, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BothLayersSettings:
    """How long motions are followed, and what counts as the same motion."""

    # Forcing periods in which motions settle on the reduced model's attractors: with C = 0.1 most
    # do.
    settling: int = 300
    # Forcing periods for which the full motion from a reduced attractor's state is followed.
    following: int = 300
    # Attractors are the same up to this distance of their states at phase 0, relative to the
    # amplitude.
    same: float = 1e-6
    # Up to this distance they hardly differ: a mass m = 0.01 alone changes an attractor by so much.
    near: float = 0.01
    # Up to this distance the attractor has moved; farther away it is another one.
    moved: float = 0.1
    starts: tuple[tuple[float, float], ...] = (
        (0.05, 0.0),
        (0.6, 0.0),
        (1.5, 0.0),
        (2.2, 0.0),
        (-0.8, 0.0),
        (-2.0, 1.0),
    )
    # m of the motions compared with Figs. 4 and 5: with m = 0 they end where M is singular.
    portrait_mass: float = 0.001
    settle_time: float = 400.0  # The time in which damped motions come to rest, C = 0.1.


SETTINGS = BothLayersSettings()
FATES = ("same", "near", "moved", "other", "unsettled", "rest", "ended")


def full(system: System, mass: float, e: float, transfer: float) -> System:
    """The same cell with both of its layers."""
    one: Any = system.model
    both = TwoLayer(**{**one.cell_numbers, "mass_ratio": mass})
    return System(model=both, load=system.load, impact=NewtonImpact(e=(e, e), transfer=transfer))


def embedded(states: np.ndarray) -> np.ndarray:
    """States (n, 2) of the reduced model as states of both layers, (n, 4): the sign of theta (at 0
    of theta') says which layer is open."""
    theta, velocity = states.T
    lower = np.where(theta != 0.0, theta > 0.0, velocity > 0.0)
    return np.stack([theta * lower, theta * ~lower, velocity * lower, velocity * ~lower], axis=1)


def attractors(
    system: System, parameters: dict[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], Recurrence]:
    """The attractors beside rest on which the reduced model's motions settle, each once for each
    row of the parameters.
    """
    starts = np.array(SETTINGS.starts)
    rows = np.repeat(np.arange(len(next(iter(parameters.values())))), len(starts))
    states = np.tile(starts, (rows[-1] + 1, 1))
    found = find_recurrence(
        system,
        states,
        SETTINGS.settling,
        parameters={p: v[rows] for p, v in parameters.items()},
        kept=16,
        extrema=True,
    )
    moving = np.flatnonzero(found.periodic)
    key = np.column_stack([rows[moving], found.period[moving], np.round(found.highest[moving], 5)])
    chosen = moving[np.unique(key, axis=0, return_index=True)[1]]
    return {p: v[rows[chosen]] for p, v in parameters.items()}, found.only(chosen)


def fates(
    system: System,
    variant: tuple[float, float, float],
    parameters: dict[str, np.ndarray],
    one: Recurrence,
) -> Any:
    """What becomes of the reduced attractors in the full model, (n,) of `FATES`, and the largest
    opening of the lower layer.
    """
    end = find_recurrence(
        full(system, *variant),
        embedded(one.last),
        SETTINGS.following,
        parameters=parameters,
        kept=16,
        extrema=True,
    )
    fate = np.full(len(one), FATES.index("unsettled"))
    shift = _apart(one, end.last)
    fate[end.periodic] = FATES.index("other")
    for name in ("moved", "near", "same"):
        fate[end.periodic & (shift <= getattr(SETTINGS, name)) & (end.period == one.period)] = (
            FATES.index(name)
        )
    fate[end.rest | (end.outcome == Ending.HELD)] = FATES.index("rest")
    fate[end.ended] = FATES.index("ended")
    return fate, np.where(end.periodic, end.highest, np.nan)


def _apart(one: Recurrence, states: np.ndarray) -> np.ndarray:
    """The distances of states of both layers at phase 0 from the reduced attractors, over the
    amplitudes of these, (n,).
    """
    amplitude = np.maximum(np.abs(one.highest), np.abs(one.lowest))
    apart = np.full(len(one), np.inf)
    for back in range(1, 1 + int(one.period.max(initial=0))):
        distance = np.abs(embedded(one.states[:, -back]) - states).max(axis=1)
        apart = np.where(back <= one.period, np.fmin(apart, distance), apart)
    return np.asarray(apart / amplitude)


def beside(system: System, parameters: dict[str, np.ndarray], variants: Any = VARIANTS) -> Any:
    """The reduced attractors at these parameters, and what becomes of each in every variant of the
    full model.
    """
    here, one = attractors(system, parameters)
    results = [fates(system, variant, here, one) for variant in variants]
    meaning = {
        "flag_values": np.arange(len(FATES), dtype=np.int8),
        "flag_meanings": " ".join(FATES),
    }
    data = dataset(
        {
            **{
                path: ("attractor", values, "1", f"parameter {path}")
                for path, values in here.items()
            },
            "reduced": (
                "attractor",
                np.maximum(one.highest, 0.0),
                "rad",
                "largest opening of the lower layer, reduced model",
            ),
            "period": ("attractor", one.period, "1", "forcing periods of it"),
            "full": (
                ("variant", "attractor"),
                [a for _, a in results],
                "rad",
                "largest theta_1 of the full motion from its state",
            ),
            "fate": (
                ("variant", "attractor"),
                np.array([f for f, _ in results], dtype=np.int8),
                "1",
                "what becomes of it",
            ),
        },
        {
            name: ("variant", [v[i] for v in variants], "1", name)
            for i, name in enumerate(("mass_ratio", "e", "transfer"))
        },
        what="attractors of the reduced model, and the full motion from their states",
        system=system,
    )
    data["fate"].attrs |= meaning
    return data


def grid(**axes: np.ndarray) -> dict[str, np.ndarray]:
    """All pairs of the values along two axes, flat, by dotted path (with __ for a dot)."""
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    return {
        name.replace("__", "."): values.ravel() for name, values in zip(axes, mesh, strict=True)
    }


def compute(size: int = 41) -> Any:
    """Figs.

    9 and 11, Fig. 14 at Omega = 1 and a map of (Omega, Hhat) at `size` values along an axis, and
    Figs. 4 and 5.
    """
    frequencies = np.linspace(0.1, 2.0, 2 * size)
    amplitudes = np.linspace(0.02, 4.0, 2 * size)
    only = ((0.0, 0.0, 1.0),)
    groups = {
        "fig09": beside(
            under_force(),
            grid(
                load__frequency=frequencies,
                load__horizontal__amplitude=np.array([0.2, 0.5, 1.0, 2.0]),
            ),
        ),
        "fig11": beside(
            under_force(),
            grid(load__frequency=np.array([0.5, 1.0]), load__horizontal__amplitude=amplitudes),
        ),
        "fig14": beside(
            under_force(),
            grid(
                load__horizontal__amplitude=np.linspace(0.0125, 0.5, size),
                load__vertical=np.linspace(-2.0, -0.05, size),
            ),
            (only[0], REFERENCE),
        ),
        "map": beside(
            under_force(),
            grid(
                load__frequency=np.linspace(0.1, 2.0, size),
                load__horizontal__amplitude=np.linspace(0.025, 1.0, size),
            ),
            only,
        ),
        "portraits": portraits(),
        "stable": stable_states(),
    }
    return joined(
        {name: xr.DataTree(group) for name, group in groups.items()},
        what="the reduced model beside both layers",
    )


def portraits() -> Any:
    """The motions of Figs.

    4 and 5 with both layers: for how long they are the reduced motions, and where they end.
    """
    rows = []
    cases = [("fig04", fig04.systems(), fig04.STARTS, fig04.DURATIONS)]
    soft = {name: constant_load(stiffness=k) for name, k in fig05.STIFFNESS.items()}
    cases.append(("fig05", soft, fig05.STARTS, dict.fromkeys(soft, fig05.MOTION_DURATION)))
    for figure, systems, starts, durations in cases:
        for panel, system in systems.items():
            for start in starts[panel]:
                rows.append(
                    (f"{figure}{panel}", *start, *_one_portrait(system, start, durations[panel]))
                )
    name, theta, velocity, exact, opened, most = zip(*rows, strict=True)
    return dataset(
        {
            "panel": ("motion", np.array(name), "1", "of the paper's figure"),
            "theta": ("motion", np.array(theta), "rad", "theta at the start"),
            "velocity": ("motion", np.array(velocity), "rad", "theta' at the start"),
            "exact": (
                "motion",
                np.array(exact),
                "1",
                "whether one layer is closed at all times, with m = 0",
            ),
            "opened": (
                "motion",
                np.array(opened),
                "1",
                "when the closed layer opens, inf if it does not",
            ),
            "both_open": (
                "motion",
                np.array(most),
                "1",
                f"share of the time with both layers open, m = {SETTINGS.portrait_mass:g}",
            ),
        },
        what="motions of Figs. 4 and 5 with both layers",
    )


def _one_portrait(
    system: System, start: tuple[float, float], duration: float
) -> tuple[bool, float, float]:
    """Whether the reduced motion is exact, when a closed layer is first released, and the share of
    the time with both open.
    """
    factor = float(system.get("impact.e"))
    x = embedded(np.array([start]))[0]
    state: dict[str, Any] = {"theta": (x[0], x[1]), "velocity": (x[2], x[3]), "duration": duration}
    strict = simulate(full(system, 0.0, 0.0, factor), **state)
    released = [event.time for event in strict.events if str(event.kind) == "release"]
    motion = simulate(full(system, SETTINGS.portrait_mass, 0.0, 0.0), **state)
    closed = motion.to_xarray()["closed_contacts"].values
    exact = not released and strict.stop.value in ("horizon", "rest")
    return exact, min(released, default=math.inf), float(np.mean(closed == 0))


def stable_states() -> Any:
    """Where damped motions of both layers come to rest, Figs.

    4 and 5: both closed, one of them open, both open.
    """
    found = []
    for stiffness in (1.0, 0.5, 1.1):
        system = full(
            constant_load(stiffness=stiffness, damping=0.1), SETTINGS.portrait_mass, 0.0, 0.0
        )
        for theta in ((0.02, -0.02), (1.3, 0.0), (0.0, -1.3), (1.3, -1.3)):
            state: dict[str, Any] = {"theta": theta, "velocity": (0.0, 0.0)}
            motion = simulate(system, **state, duration=SETTINGS.settle_time, dense=False)
            found.append((stiffness, *motion.position, max(map(abs, motion.velocity))))
    stiffness, lower, upper, speed = np.array(found).T
    return dataset(
        {
            "stiffness": ("state", stiffness, "1", "k"),
            "lower": ("state", lower, "rad", "theta_1"),
            "upper": ("state", upper, "rad", "theta_2"),
            "speed": ("state", speed, "1", "what is left of the velocities"),
        },
        what="stable states of both layers under V = -1.5 / sin(beta0)",
    )


def page(data: Any) -> LivingPage:
    """Both layers at a place of Fig.

    9 at which the closed layer opens: both angles, each with its impacts.
    """
    return (
        full(under_force(0.85, 0.5), *REFERENCE),
        [],
        {"theta": (0.6, 0.0), "velocity": (0.0, 0.0), "periods": 40},
    )


def exact_below(data: Any, frequency: float) -> tuple[float, float]:
    """The largest Hhat of the map up to which all attractors are exact, at the nearest frequency,
    and the next Hhat.
    """
    near = data[FREQUENCY].values[np.abs(data[FREQUENCY].values - frequency).argmin()]
    here = data[FREQUENCY].values == near
    amplitude = data[AMPLITUDE].values[here]
    wrong = data["fate"].values[0][here] != FATES.index("same")
    first = float(amplitude[wrong].min(initial=math.inf))
    return float(amplitude[amplitude < first].max(initial=0.0)), first


def shares(data: Any, variant: int) -> dict[str, float]:
    """The share of the reduced attractors with each fate in a variant."""
    return {name: float(np.mean(data["fate"].values[variant] == i)) for i, name in enumerate(FATES)}


def share_table(data: Any) -> list[list[str]]:
    """The shares of the reduced attractors with each fate, as text: a row for each variant of the
    full model, below headings.
    """
    rows = [["m, e, g", *MEANINGS]]
    for i, numbers in enumerate(
        zip(*(data[name].values for name in ("mass_ratio", "e", "transfer")), strict=True)
    ):
        rows.append(
            [
                ", ".join(f"{number:g}" for number in numbers),
                *(f"{share:.0%}" for share in shares(data, i).values()),
            ]
        )
    return rows


def exact_portraits(data: Any) -> list[tuple[str, int, int]]:
    """For each panel of Figs.

    4 and 5, how many motions both layers with m = 0 have in common with it, and how many there are.
    """
    panels = data["panel"].values.astype(str)
    found = {name: data["exact"].values[panels == name] for name in dict.fromkeys(panels)}
    return [
        (name.removeprefix("fig").lstrip("0"), int(exact.sum()), exact.size)
        for name, exact in found.items()
    ]


def measure(data: Any) -> dict[str, Measured]:
    """Where the reduced model is exact, and what becomes of its attractors elsewhere."""
    low, high = exact_below(data["map"], 1.0)
    stable = data["stable"]
    fourth = (
        (stable["stiffness"].values == 1.0)
        & (stable["lower"].values > 0.1)
        & (stable["upper"].values < -0.1)
    )
    both = float(stable["lower"].values[fourth][0]), float(-stable["upper"].values[fourth][0])
    kept = {
        f"Fig. {name[3:].lstrip('0')}": shares(data[name], 0)["same"] for name in ("fig09", "fig11")
    }
    rows = [{"figure": name, "exact": share} for name, share in kept.items()]
    return {
        "both-layers-exact": measured(low <= 0.174 <= high, low=low, high=high, figures=rows),
        "both-layers-fourth": measured(
            max(abs(both[0] - 1.4627), abs(both[1] - 1.4627)) < 1e-4, lower=both[0], upper=both[1]
        ),
    }


FIGURE = paper_figure(
    "both_layers", quick={"size": 13}, compute=compute, draw=draw, measure=measure, page=page
)
