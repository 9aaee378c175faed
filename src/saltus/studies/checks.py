"""What studies along a parameter refuse before anything is computed."""

from __future__ import annotations

from saltus.checks import check_bounds, check_count
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
    if path not in system.parameters:
        system.get(path)  # refuses what leads nowhere
        raise ParameterError(f"{path} is not a number, so there is no diagram along it")
    for bound in (low, high):
        system.with_({path: bound})  # refuses bounds beyond what the system allows
    for name, effort in efforts.items():
        check_count(name, effort, 1 if name in ("max_period", "starts") else 0)
    return low, high
