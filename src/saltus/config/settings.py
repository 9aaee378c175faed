"""The [simulate] table: the start, the duration and the accuracy of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from saltus.checks import LIMITS
from saltus.config.readers import Reader, read_angle, read_number, read_table, read_text, read_whole, read_within, show
from saltus.config.source import Source
from saltus.errors import near
from saltus.systems import Model, System


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a study is simulated."""

    arguments: dict[str, Any]  # the arguments of `saltus.simulate`, except the system
    samples: int | None = None  # the number of evenly spaced samples that are written to motion.nc


def read_settings(source: Source, system: System, data: Any) -> Settings:
    """The settings of a study of `system`."""
    values = read_table(source, ("simulate",), data, _readers(system.model, margin_names(system)))
    _check_horizon(source, system, values)
    return Settings(samples=values.pop("samples", None), arguments={**dict.fromkeys(system.model.coordinates, 0.0), **values})


def margin_names(system: System) -> tuple[str, ...]:
    """The margins of the system's model, at which a motion may be asked to stop."""
    return system.model.margin_names(system.load)


def _check_horizon(source: Source, system: System, values: Mapping[str, Any]) -> None:
    if "periods" in values and "duration" in values:
        source.refuse(("simulate", "duration"), "simulate has both periods and duration; keep one of them")
    if "periods" not in values and "duration" not in values:
        source.refuse(
            ("simulate",), "simulate needs periods (of the load) or duration (dimensionless time), such as duration = 50"
        )
    if "periods" in values and system.load.period is None:
        source.refuse(
            ("simulate", "periods"), "simulate.periods needs load.frequency, which is not given; give simulate.duration instead"
        )


def _readers(model: Model, margins: tuple[str, ...]) -> dict[str, Reader]:
    """The keys of the table, which are the arguments of `saltus.simulate` and `samples`."""

    def read_margins(value: Any) -> tuple[str, ...]:
        names = tuple(read_text(item) for item in (value if isinstance(value, list) else [value]))
        for name in names:
            if name not in margins:
                raise ValueError(f"names no margin of this model with {show(name)}; {near(name, margins)}")
        return names

    def read_velocities(value: Any) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != len(model.coordinates):
            raise ValueError(f"must be a list of {len(model.coordinates)} numbers, got {show(value)}")
        return tuple(read_number(item) for item in value)

    return {
        **{name: read_angle if model.unit_of(name) == "rad" else read_number for name in model.coordinates},
        "velocity": read_velocities if len(model.coordinates) > 1 else read_number,
        "periods": read_within(read_number, above=0.0, at_most=LIMITS.periods),
        "duration": read_within(read_number, above=0.0, at_most=LIMITS.periods),
        "tol": read_within(read_number, at_least=1e-15, at_most=1e-6),
        "time": read_number,
        "side": _read_side,
        "stop_at": read_margins,
        "samples": read_within(read_whole, at_least=2, at_most=10_000_000),
    }


def _read_side(value: Any) -> int:
    number = read_number(value)
    if number not in (1, -1):
        raise ValueError(f"must be 1 (theta > 0) or -1 (theta < 0), got {show(value)}")
    return int(number)
