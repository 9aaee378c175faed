"""A motion as an xarray Dataset, with units and provenance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import instants
from saltus.flow.contacts.modes import modes_of
from saltus.provenance import provenance

if TYPE_CHECKING:
    import xarray

    from saltus.flow.motion.motion import Motion

PERIOD_SAMPLES = 200  # samples in a forcing period if no times are given


def to_dataset(motion: Motion, times: Any = None) -> xarray.Dataset:
    """The sampled states over `time` and the impacts over `impact`; the attributes hold all that is needed to repeat the
    motion."""
    import xarray

    period = motion.system.load.period
    if times is None and motion.kept is not None:
        times, position, velocity, side = (getattr(motion.kept, n) for n in ("time", "position", "velocity", "side"))
    else:
        times = _default_times(motion, period) if times is None else instants(times)
        position, velocity, side = motion._states(times)
    names = motion.system.model.coordinates
    dataset = xarray.Dataset(coords={"time": ("time", times, {"units": "1", "long_name": "dimensionless time tau"})})
    for i, name in enumerate(names):
        unit = motion.system.model.unit_of(name)
        dataset[name] = ("time", position[i], {"units": unit})
        dataset[rate_name(name, names)] = ("time", velocity[i], {"units": unit, "long_name": f"d {name} / d tau"})
    if motion.system.model.holds_coordinates:
        _add_contacts(motion, dataset, side)
    else:
        dataset["side"] = ("time", side.astype(np.int8), {"units": "1", "long_name": "side, 0 at rest"})
        for name in ("time", "velocity_before", "velocity_after"):
            unit = "1" if name == "time" else motion.system.model.unit_of(names[0])
            dataset[f"impact_{name}"] = ("impact", getattr(motion.impacts, name), {"units": unit})
    dataset.attrs = {"title": "motion computed by saltus", "kind": "motion"} | provenance(motion.system, tol=motion.tol)
    dataset.attrs |= {
        "stop": motion.stop.value + (f" ({motion.limit})" if motion.limit else ""),
        "end_time": motion.time,
        "phase_known": str(motion.phase_known),
        "validity": str(motion.validity) if motion.dense or motion.sampled_validity else "not kept",
        "Conventions": "CF-1.8",
    }
    if motion.rest_time is not None:
        dataset.attrs["rest_time"] = motion.rest_time
    return dataset


def _add_contacts(motion: Motion, dataset: xarray.Dataset, side: np.ndarray) -> None:
    """Add the closed contacts, the directions of frictions, and the impacts: times, contacts, positions and velocities."""
    model, impacts = motion.system.model, motion.impacts
    names, contacts = model.coordinates, [contact.name for contact in model.contacts]
    masks = np.array([1 << i for i in range(len(contacts))], dtype=np.int16)
    flags = {"units": "1", "flag_masks": masks, "flag_meanings": " ".join(contacts)}
    closed, slides = modes_of(model, side)
    for friction, direction in zip(model.frictions, slides, strict=True):
        text = f"direction in which {friction.name} slides, 0 where it sticks"
        dataset[f"sliding_{friction.name}"] = ("time", direction.astype(np.int8), {"units": "1", "long_name": text})
    if not contacts:
        return
    dataset["closed_contacts"] = ("time", closed.astype(np.int16), flags | {"long_name": "contacts that are closed"})
    dataset["impact_time"] = ("impact", impacts.time, {"units": "1"})
    dataset["impact_contacts"] = ("impact", impacts.side, flags | {"long_name": "contacts that were hit"})
    position = np.full((len(names), len(impacts)), np.nan)
    if motion.dense is not None and len(impacts):
        position = motion._states(impacts.time)[0]
    for i, name in enumerate(names):
        unit = {"units": model.unit_of(name)}
        dataset[f"impact_{name}"] = ("impact", position[i], unit)
        for when, velocity in (("before", impacts.velocity_before), ("after", impacts.velocity_after)):
            dataset[f"impact_{rate_name(name, names)}_{when}"] = ("impact", velocity[:, i], unit)


def rate_name(name: str, names: tuple[str, ...]) -> str:
    """The name of the velocity of a coordinate."""
    return "velocity" if len(names) == 1 else f"{name}_velocity"


def _default_times(motion: Motion, period: float | None) -> np.ndarray:
    count = 10 * PERIOD_SAMPLES if period is None else int(np.ceil(PERIOD_SAMPLES * (motion.time - motion.start) / period))
    return np.linspace(motion.start, motion.time, max(2, count + 1))


def state_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names of the state variables, coordinates and then velocities, of a model with these coordinates."""
    return *names, *(rate_name(name, names) for name in names)
