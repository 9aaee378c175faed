"""What a study's [prove] asks for: theorems about an orbit of a system, or about its branch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from saltus.checks import check_bounds, check_count, checked_by
from saltus.errors import ParameterError
from saltus.orbits import check_proof, continue_orbit, find_orbit, prove
from saltus.progress import Progress, part_of, silent
from saltus.systems import System, check_along, check_path, check_system, read_start

if TYPE_CHECKING:
    import xarray


def _check(
    system: System,
    path: str | None,
    bounds: tuple[float, float] | None,
    velocity: Iterable[float] | float,
    period: int | None,
    settle: int | None,
    radii: Mapping[str, float] | None,
    step: float | None,
    order: int | None,
    most_boxes: int,
    progress: object = None,
    **coordinates: float,
) -> None:
    """Refuse what `prove_orbit_of` cannot answer."""
    check_system(system, "prove_orbit_of", several_contacts=True)
    if system.load.frequency is None:
        raise ParameterError(
            "cycles without a load are not proved yet; give the Load a frequency", "load.frequency"
        )
    if (path is None) != (bounds is None):
        missing = "path" if path is None else "bounds"
        raise ParameterError(f"path and bounds belong together; give {missing} too", missing)
    if path is not None:
        check_path(system, path)
        check_along(system, path, check_bounds(bounds), "bounds")
    for name, count, least in (("period", period, 1), ("settle", settle, 0)):
        if count is not None:
            check_count(name, count, least)
    check_proof(system, radii, step, order, most_boxes)
    read_start(system, velocity, coordinates, (), 0.0)


@checked_by(_check)
def prove_orbit_of(
    system: System,
    *,
    path: str | None = None,
    bounds: tuple[float, float] | None = None,
    velocity: Iterable[float] | float = 0.0,
    period: float | None = None,
    settle: float | None = None,
    radii: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
    most_boxes: int = 2000,
    progress: Progress = silent,
    **coordinates: float,
) -> xarray.Dataset:
    """Find the orbit on which a motion settles and prove it, or its branch with its special points.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    path, bounds
        The parameter of the branch and its range; without them the orbit itself is proved.
    velocity, coordinates
        The state at phase 0 from which the motion settles, such as theta=0.3.
    period, settle
        As `find_orbit` takes them.
    radii, step, order, most_boxes
        As `prove` takes them.
    progress
        Called with the share that is done.

    Returns
    -------
    xarray.Dataset
        What the proof's `to_xarray` gives; its attribute `statement` is the theorem.

    Raises
    ------
    ParameterError
        An argument without meaning; a load without a frequency.
    MotionError
        The motion settles on no orbit.

    Examples
    --------
    >>> data = saltus.studies.prove_orbit_of(system, theta=0.3)
    >>> data.attrs["proved"], data.attrs["stability"]
    ('true', 'true')
    """
    counts: dict[str, Any] = {"period": period, "settle": settle}
    start: dict[str, Any] = {"velocity": velocity, **coordinates}
    orbit = find_orbit(system, progress=part_of(progress, 0.0, 0.2), **counts, **start)
    if path is None or bounds is None:
        return prove(orbit, radii=radii, step=step, order=order).to_xarray()
    branch = continue_orbit(orbit, path, bounds, progress=part_of(progress, 0.2, 0.4))
    proof = prove(
        branch,
        radii=radii,
        step=step,
        order=order,
        most_boxes=most_boxes,
        progress=part_of(progress, 0.4, 1.0),
    )
    return proof.to_xarray()
