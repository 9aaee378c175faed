"""The arguments of a stability chart: checked once, kept in a store as JSON, and given to the
processes that compute cells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import (
    check_axis,
    check_count,
    check_dataset,
    check_memory,
    check_number,
    check_starts,
    check_work,
)
from saltus.enumerations import flags
from saltus.errors import ParameterError, shown
from saltus.flow import RECURRENCE, Ending, state_names
from saltus.result import check_provenance, identity, provenance
from saltus.studies.chart.motions import KEPT, CellOutcome
from saltus.systems import (
    System,
    check_along,
    check_path,
    check_system,
    check_window,
    natural_units,
)
from saltus.theory import amplitude_limits

if TYPE_CHECKING:
    from saltus.sweep import Plan, Variable

CELLS = "saltus.studies.chart.cells:cells"
LEAST = 1e-3  # the smallest amplitude that counts if none is given, in natural units
NUMBERS = ("max_period", "starts", "least", "periods", "tol", "seed")


@dataclass(frozen=True)
class DurationSettings:
    """How long a motion is given to settle where `periods` is not given."""

    # As a rule, a motion has settled once exp(-C tau / 2) has fallen to exp(-75).
    decay: float = 75.0
    # With much damping, or at a low frequency, some motions need longer than by this rule.
    fewest: int = 40
    most: int = 1200  # Without damping only impacts dissipate, and the rule gives an infinite time.


DURATION = DurationSettings()


@dataclass(frozen=True, eq=False, kw_only=True)
class ChartRequest:
    """The arguments of `stability_chart` that decide what is computed.

    Raises
    ------
    ParameterError
        An argument without meaning, or one that the system refuses.
    """

    system: System
    horizontal: Any
    vertical: Any
    paths: tuple[str, str]
    max_period: int
    starts: int
    window: Any  # None: a window around the contact
    least: Any  # None: LEAST natural lengths
    periods: Any  # None: the time in which motions settle by the damping of the model
    tol: float
    seed: int
    rows: int = 1

    def __post_init__(self) -> None:
        _check_driven(self.system)
        for name in ("horizontal", "vertical"):
            object.__setattr__(self, name, check_axis(name, getattr(self, name)))
        _check_paths(self.system, self.paths, (self.horizontal, self.vertical))
        if self.periods is None:
            object.__setattr__(self, "periods", periods_to_settle(self.system))
        for name in ("periods", "rows"):
            check_count(name, getattr(self, name), 1)
        check_starts(self.starts, min(self.rows, len(self.vertical)) * len(self.horizontal))
        check_work(
            "periods", float(self.starts) * len(self.vertical) * len(self.horizontal), self.periods
        )
        # of 8 bytes each
        cells = len(self.vertical) * len(self.horizontal)
        numbers = 8 * (KEPT + 2)
        check_memory("horizontal", 8.0 * numbers * cells, f"{cells} cells")
        check_count("max_period", self.max_period, 1, RECURRENCE.compiled_max_period)
        check_count("seed", self.seed, 0)
        if self.least is None:
            object.__setattr__(self, "least", LEAST * natural_units(self.system).length)
        check_number("least", self.least, above=0.0)
        check_number("tol", self.tol, at_least=1e-15, at_most=1e-6)
        object.__setattr__(self, "window", check_window(self.window, self.system))

    @property
    def coordinate(self) -> str:
        """The name of the system's coordinate, or the names of all of several."""
        return " ".join(self.system.model.coordinates)

    @property
    def variables(self) -> tuple[str, ...]:
        """The names of the state variables."""
        return state_names(self.system.model.coordinates)

    @property
    def told_by_speed(self) -> bool:
        """Whether motions are told apart by their slowest impact too, as their extrema do not tell
        which contacts they hit.
        """
        return self.system.model.names_its_contacts

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.vertical), len(self.horizontal)

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The values of both parameters in each cell, row by row, by their dotted paths."""
        vertical, horizontal = np.meshgrid(self.vertical, self.horizontal, indexing="ij")
        return {self.paths[1]: vertical.ravel(), self.paths[0]: horizontal.ravel()}

    def to_arguments(self) -> dict[str, Any]:
        """The request without its axes, in types that can be written as JSON."""
        numbers = {name: getattr(self, name) for name in NUMBERS}
        named = {
            "system": self.system.to_json(),
            "paths": list(self.paths),
            "window": list(self.window),
        }
        return named | numbers | identity(self.system)

    @classmethod
    def from_arguments(cls, arguments: Mapping[str, Any], block: Mapping[str, Any]) -> ChartRequest:
        """The request for a block of the plane, with these values along its axes.

        Raises
        ------
        ParameterError
            Arguments of a system with other equations than it has here, or of another version of
            saltus.
        """
        system = System.from_json(arguments["system"])
        paths = tuple(arguments["paths"])
        check_provenance(arguments, system, "this chart")
        numbers = {name: arguments[name] for name in NUMBERS}
        return cls(system=system, paths=paths, window=arguments["window"], **block, **numbers)

    @classmethod
    def of_chart(cls, system: System, chart: Any) -> ChartRequest:
        """The request that has led to a chart."""
        needed = ("vertical", "horizontal", "count", "amplitude"), ("window", "path", *NUMBERS)
        check_dataset(chart, "stability_chart", *needed, name="chart")
        attrs = chart.attrs
        numbers = {
            name: attrs[name].item() if isinstance(attrs[name], np.generic) else attrs[name]
            for name in NUMBERS
        }
        axes = {name: chart[name].values for name in ("horizontal", "vertical")}
        window = np.asarray(attrs["window"], dtype=float).reshape(-1, 2)
        paths = (str(attrs["path"][0]), str(attrs["path"][1]))
        return cls(system=system, paths=paths, window=window, **axes, **numbers)

    def plan(self) -> Plan:
        """The chart as a sweep: chunks of rows, each a call of `cells`.

        Raises
        ------
        ParameterError
            The model is of a user's own class that is not registered, so that no process could make
            the system from its name.
        """
        from saltus.sweep import Plan

        System.from_json(self.system.to_json())
        more = {name: getattr(self, name) for name in NUMBERS if name not in ("tol", "seed")}
        more |= {
            "kind": "stability_chart",
            "path": list(self.paths),
            "window": np.ravel(self.window).tolist(),
            "coordinate": self.coordinate,
        }
        return Plan(
            function=CELLS,
            arguments=self.to_arguments(),
            axes={"vertical": self.vertical, "horizontal": self.horizontal},
            chunk={"vertical": self.rows},
            variables=self._variables(),
            attrs=provenance(
                self.system,
                tol=self.tol,
                seed=self.seed,
                title="stability chart computed by saltus",
                **more,
            ),
        )

    def _variables(self) -> dict[str, Variable]:
        """The arrays of a chart, with their units and what they mean."""
        from saltus.sweep import Variable

        model = self.system.model
        each = (("motion", KEPT),)
        unit = model.unit_of(model.coordinates[0])
        rows: list[tuple[str, str, str, Any, str]] = [
            (
                "amplitude",
                "f8",
                unit,
                (),
                "the largest amplitude of the stable motions beside rest",
            ),
            (
                "period",
                "i2",
                "1",
                (),
                "forcing periods of the largest motion, 0 where there is none",
            ),
            ("smallest_amplitude", "f8", unit, (), "the smallest amplitude of those that count"),
            ("count", "i2", "1", (), "stable motions beside rest, mirror images counted once"),
            ("rest", "?", "1", (), "some start is captured at rest"),
            ("tiny", "i2", "1", (), "starts that end on motions too small to count"),
            (
                "unsettled",
                "i2",
                "1",
                (),
                (
                    "starts that neither rest nor repeat themselves, or are ended by a limit of the"
                    " model"
                ),
            ),
            ("outcome", "i1", "1", (), "what there is in the cell"),
            (
                "verdict",
                "i1",
                "1",
                (),
                "what the motions are that do not settle; 0 too where all do",
            ),
            (
                "exponent",
                "f8",
                "1",
                (),
                "largest Lyapunov exponent of the motions that do not settle, per unit of time",
            ),
            ("exponent_error", "f8", "1", (), "half width of its 95 % interval"),
            ("motion_amplitude", "f8", unit, each, "amplitude of each motion"),
            (
                "motion_other",
                "f8",
                unit,
                each,
                "extremum of each motion on the other side, as its amplitude if symmetric",
            ),
            ("motion_period", "i2", "1", each, "forcing periods of each motion"),
            ("motion_impact_count", "i4", "1", each, "impacts in a period of each motion"),
            *(
                (f"motion_{name}", "f8", unit, each, f"{name} of each motion at phase 0")
                for name in self.variables
            ),
        ]
        if self.told_by_speed:
            rows.append(
                (
                    "motion_slowest",
                    "f8",
                    unit,
                    each,
                    "least speed of an impact of each motion, 0 without impacts",
                )
            )
        limits = amplitude_limits(self.system)
        rows += [
            (f"beyond_{limit.name}", "?", "1", (), f"the largest motion passes {limit.meaning}")
            for limit in limits
        ]
        meanings = {"outcome": flags(CellOutcome), "verdict": flags(Ending)}
        return {
            key: Variable(
                dtype=dtype,
                extra=extra,
                attrs={"units": units, "long_name": text} | meanings.get(key, {}),
            )
            for key, dtype, units, extra, text in rows
        }


def _check_driven(system: Any) -> None:
    """Refuse systems that have no chart."""
    check_system(system, "stability_chart", several_contacts=True)
    if system.load.frequency is None:
        raise ParameterError(
            "a stability chart needs a load with a frequency, Load(frequency=..., ...)",
            "load.frequency",
        )


def _check_paths(system: System, paths: Any, axes: tuple[np.ndarray, np.ndarray]) -> None:
    """Refuse paths that lead to no number, and values that the system refuses."""
    texts = (
        isinstance(paths, (list, tuple))
        and len(paths) == 2
        and all(isinstance(path, str) for path in paths)
    )
    if not texts or paths[0] == paths[1]:
        raise ParameterError(
            f"paths must be two parameters, (along horizontal, along vertical), got {shown(paths)}",
            "paths",
        )
    for path, values in zip(paths, axes, strict=True):
        check_path(system, path, "paths")
        check_along(system, path, (values.min(), values.max()), "paths")


def periods_to_settle(system: System) -> int:
    """The forcing periods in which motions settle as a rule, by the damping of the model."""
    damping = system.model.damping
    frequency = system.load.frequency
    if not damping or not frequency:
        return DURATION.most
    return math.ceil(
        min(
            DURATION.most,
            max(DURATION.fewest, 2 * DURATION.decay * frequency / (2 * math.pi * damping)),
        )
    )
