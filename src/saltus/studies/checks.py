"""The checks of a study's arguments along a parameter, made before anything is computed."""

from __future__ import annotations

from saltus.checks import check_along, check_bounds, check_count, check_path, check_starts
from saltus.errors import ParameterError
from saltus.systems import System, check_system


def check_diagram(system: System, path: str, bounds: tuple[float, float], **counts: int) -> tuple[float, float]:
    """The bounds as two numbers; raises a ParameterError for arguments with which the study would fail later."""
    check_system(system, "a diagram", several_contacts=True)
    if system.load.frequency is None:
        raise ParameterError(
            "a load without a frequency has no periodic orbits to draw; give the Load a frequency", "load.frequency"
        )
    low, high = check_bounds(bounds)
    check_path(system, path)
    check_along(system, path, (low, high), "bounds")
    for name, count in counts.items():
        check_count(name, count, 1 if name in ("max_period", "starts") else 0)
        if name == "starts":
            check_starts(count)
    return low, high
