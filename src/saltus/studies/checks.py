"""What studies along a parameter refuse before anything is computed."""

from __future__ import annotations

from saltus.checks import check_along, check_bounds, check_count, check_path
from saltus.errors import ParameterError
from saltus.systems import System


def check_diagram(system: System, path: str, bounds: tuple[float, float], **efforts: int) -> tuple[float, float]:
    """The bounds; refuses, before anything is computed, what would fail later."""
    if not isinstance(system, System):
        raise ParameterError(f"a diagram takes a System(model=..., load=..., impact=...), got {system!r}")
    if system.load.frequency is None:
        raise ParameterError("a load without a frequency has no periodic orbits to draw; give the Load a frequency")
    if len(system.model.coordinates) > 1:
        names = ", ".join(system.model.coordinates)
        raise ParameterError(f"diagrams are for models with one coordinate, and this one has {names}; see continue_orbit")
    low, high = check_bounds(bounds)
    check_path(system, path)
    check_along(system, path, (low, high), "bounds")
    for name, effort in efforts.items():
        check_count(name, effort, 1 if name in ("max_period", "starts") else 0)
    return low, high
