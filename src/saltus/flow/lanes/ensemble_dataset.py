"""An ensemble as an xarray Dataset, with units and provenance; and what is read from it again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered, check_dataset
from saltus.flow.kernel.layout import LOSSLESS, Status
from saltus.flow.lanes.options import Sample, Until
from saltus.flow.motion.events import Stop, masks_of, type_of_bits
from saltus.flow.motion.motion import rate_name, state_names
from saltus.result import provenance
from saltus.systems import energy_gains

if TYPE_CHECKING:
    import xarray

    from saltus.flow.lanes.ensemble_result import EnsembleResult
    from saltus.flow.lanes.inputs import Inputs
    from saltus.systems import Model, System

# The names in a dataset other than the coordinates and velocities of the model and names that are
# made of these.
FIXED = (
    *(
        "time",
        "side",
        "closed_contacts",
        "gaining_contacts",
        "stop",
        "limit",
        "recurrence_period",
        "impact_count",
        "grazings",
        "periods",
        "chatter_speed",
        "derivative",
    ),
    *("least_speed", "overall_least_speed", "period_impact_count", "start_time"),
)
DIMENSIONS = ("period", "state", "column")


def start_name(name: str) -> str:
    """The name in a dataset of a coordinate, a velocity or the time at the start."""
    return f"start_{name}"


def extrema_names(names: tuple[str, ...]) -> tuple[str, str]:
    """The names in a dataset of the largest and the least value of the coordinate; of several
    coordinates, of any of them.
    """
    of = names[0] if len(names) == 1 else "coordinate"
    return f"largest_{of}", f"smallest_{of}"


def side_name(relay: str) -> str:
    """The name in a dataset of the side of a relay."""
    return f"side_{relay}"


def result_names(names: tuple[str, ...], relays: tuple[str, ...] = ()) -> set[str]:
    """All names of variables and dimensions that a dataset of a model with these coordinates and
    relays may have.
    """
    states = (*state_names(names), *map(side_name, relays))
    extrema = extrema_names(names)
    further = [
        *(f"{kind}_{name}" for kind in ("sampled", "start") for name in states),
        *(f"overall_{name}" for name in extrema),
    ]
    return {*FIXED, *DIMENSIONS, *states, *extrema, *further}


def to_dataset(result: EnsembleResult) -> xarray.Dataset:
    """The dataset of an ensemble: the ends of all trajectories and their samples."""
    import xarray

    system = result.system
    inputs = result.inputs
    writer = _Writer(system.model, inputs)
    _add_ends(writer, result)
    _add_stops(writer, result)
    if system.model.contacts and not system.model.has_multipliers:
        _add_gains(writer, system, inputs)
    _add_samples(writer, result)
    if result.options.paths is not None:
        _add_derivatives(writer, result, result.options.paths)
    known: dict[str, Any] = {"kind": "ensemble", "Conventions": "CF-1.8"}
    known |= {"device": result.device} if result.device else {}
    attributes = {"title": "ensemble computed by saltus"} | provenance(
        system, tol=result.options.tol, **known
    )
    attributes |= _add_inputs(writer, inputs)
    return xarray.Dataset(writer.variables, writer.coords, attributes)


class _Writer:
    """Collects variables over the dimensions of an ensemble."""

    def __init__(self, model: Model, inputs: Inputs) -> None:
        self.names = names = model.coordinates
        self.rates = tuple(rate_name(name, names) for name in names)
        self.units = dict(
            zip((*names, *self.rates), 2 * [model.unit_of(name) for name in names], strict=True)
        )
        self.dims, self.shape, self.coords = inputs.dims, inputs.shape, dict(inputs.coords)
        self.variables: dict[str, Any] = {}

    def add(
        self, name: str, values: np.ndarray, unit: str, text: str, *extra: str, **more: Any
    ) -> None:
        """Add a variable that has a row for each trajectory, over further dimensions `extra`."""
        import xarray

        reshaped = values.reshape((*self.shape, *values.shape[1:]))
        attributes = {"units": unit, "long_name": text} | more
        # `fastpath` keeps xarray from importing Dask to see that a NumPy array is no array of Dask
        self.variables[name] = xarray.Variable(
            (*self.dims, *extra), reshaped, attributes, fastpath=True
        )


def _add_ends(writer: _Writer, result: EnsembleResult) -> None:
    """The states at the end, and what happened until then."""
    ends = result.ends
    last = result.last
    own = len(writer.names)
    for i, (name, rate) in enumerate(zip(writer.names, writer.rates, strict=True)):
        writer.add(name, last[:, i], writer.units[name], f"{name} at the end")
        writer.add(rate, last[:, own + i], writer.units[rate], f"d {name} / d tau at the end")
    writer.add("time", result.time, "1", "dimensionless time tau at the end")
    names = [contact.name for contact in result.system.model.contacts]
    if names:
        closed = (ends.rows["side"] - 1).astype(type_of_bits(len(names)))
        writer.add(
            "closed_contacts", closed, "1", "contacts that are closed at the end", **masks_of(names)
        )
    for i, relay in enumerate(result.system.model.relays):
        name = side_name(relay.name)
        text = f"side of {relay.name!r} at the end, 1 where it is on"
        writer.add(name, ends.sides[:, i], "1", text)
    writer.add("side", result.side.astype(np.int8), "1", "side at the end, 0 at rest")
    writer.add("impact_count", ends.rows["impacts"], "1", "impacts")
    writer.add("grazings", ends.rows["grazings"], "1", "touches of the contact without an impact")
    if result.periods is not None:
        writer.add("periods", result.periods, "1", "forcing periods from the start to the end")
    text = "speed of the gap after impacts too small to be followed, else 0"
    writer.add("chatter_speed", ends.rows["chatter_speed"], "1", text)


def _add_gains(writer: _Writer, system: System, inputs: Inputs) -> None:
    """The contacts at which the impact law may gain energy, as in `Validity.gains`."""
    twin = inputs.with_numbers(system.in_gap_coordinates)
    gains = energy_gains(twin.model, twin.impact, (inputs.size,))
    which = np.zeros(inputs.size, dtype=type_of_bits(len(gains)))
    for gain, bit in zip(gains.values(), masks_of(list(gains))["flag_masks"], strict=True):
        which |= np.where(gain > LOSSLESS, bit, which.dtype.type(0))
    writer.add(
        "gaining_contacts",
        which,
        "1",
        "contacts at which impacts may gain energy",
        **masks_of(list(gains)),
    )


def _add_inputs(writer: _Writer, inputs: Inputs) -> dict[str, float]:
    """Add arguments that are arrays as variables, unless a coordinate holds them; returns the
    arguments that are one number.
    """
    single = {}
    for name, values in inputs.values.items():
        parameter = name in inputs.paths
        where = name if parameter else start_name(name)
        if not np.ndim(values):
            single[where] = float(values)
        elif not _is_coordinate(name if parameter else f"initial_{name}", values, inputs):
            writer.add(
                where,
                values,
                writer.units.get(name, "1"),
                f"parameter {name}" if parameter else f"{name} at the start",
            )
    return single


def _is_coordinate(name: str, values: np.ndarray, inputs: Inputs) -> bool:
    """Whether the coordinate of this name holds these values."""
    if name not in inputs.coords:
        return False
    values_there = inputs.coords[name].variable.set_dims(
        dict(zip(inputs.dims, inputs.shape, strict=True))
    )
    return bool(np.array_equal(values_there.values.reshape(-1), values))


def _add_stops(writer: _Writer, result: EnsembleResult) -> None:
    """Why each trajectory ended."""
    members = tuple(Stop)
    options = result.options
    ends = result.ends
    comment = "; ".join(f"{stop}: {stop.meaning}" for stop in members)
    writer.add("stop", result.stops, "1", "why it ended", **_flags(members), comment=comment)
    if options.limits:
        which = np.where(ends.rows["status"] == Status.LIMITED, ends.rows["detail"], -1).astype(
            np.int8
        )
        writer.add(
            "limit", which, "1", "the margin that ended it, -1 for none", **_flags(options.limits)
        )
    if Until.SETTLED in options.until:
        text = "forcing periods after which it repeats itself, 0 where it has not settled"
        writer.add("recurrence_period", result.recurrence_period, "1", text)


def _flags(names: tuple[str, ...]) -> dict[str, Any]:
    """The attributes of the CF conventions that say what the numbers 0, 1, ... stand for."""
    return {"flag_values": np.arange(len(names), dtype=np.int8), "flag_meanings": " ".join(names)}


def _add_samples(writer: _Writer, result: EnsembleResult) -> None:
    """Add the samples of the last forcing periods, and the extrema and least speeds of the whole
    motions.
    """
    first = writer.names[0]
    extrema = extrema_names(writer.names)
    sample = result.options.sample
    rows = result.ends.rows
    slowest = "the least speed before an impact, inf without impacts"
    unit = writer.units[first]
    meant = [
        f"the {which} {first if len(writer.names) == 1 else 'of all coordinates'}"
        for which in ("largest", "smallest")
    ]
    variables = {
        "state": [
            (f"sampled_{n}", writer.units[n], f"{n} at the end of the forcing period")
            for n in (*writer.names, *writer.rates)
        ]
        + [
            (f"sampled_{side_name(each.name)}", "1", f"side of {each.name!r} at that time")
            for each in result.system.model.relays
        ],
        "extrema": [
            (name, unit, f"{text} in the forcing period")
            for name, text in zip(extrema, meant, strict=True)
        ],
        Sample.SPEED: [("least_speed", unit, f"{slowest}, in the forcing period")],
        Sample.IMPACT_COUNT: [("period_impact_count", "1", "impacts in the forcing period")],
    }
    for kind, values in result.samples.items():
        for column, (variable, its_unit, text) in enumerate(variables[kind]):
            writer.add(
                variable, np.ascontiguousarray(values[:, :, column]), its_unit, text, "period"
            )
    if Sample.EXTREMA in sample:
        for name, text, field in zip(extrema, meant, ("highest", "lowest"), strict=True):
            writer.add(f"overall_{name}", rows[field], unit, f"{text} from the start to the end")
    if Sample.SPEED in sample:
        writer.add(
            "overall_least_speed",
            rows["least_speed"],
            unit,
            f"{slowest}, from the start to the end",
        )


def _add_derivatives(writer: _Writer, result: EnsembleResult, paths: tuple[str, ...]) -> None:
    """The derivatives of the end state to the initial one and to parameters, (..., state,
    column).
    """
    states = [*writer.names, *writer.rates]
    writer.coords |= {"state": ("state", states), "column": ("column", [*states, *paths])}
    writer.add(
        "derivative",
        result.derivatives,
        "1",
        "derivative of the state at the end",
        "state",
        "column",
    )


# --- reading -----------------------------------------------------------------


@answered
def stop_names(dataset: xarray.Dataset) -> xarray.DataArray:
    """Why each motion ended, over the dimensions of the ensemble; the words are those of `Stop`.

    Parameters
    ----------
    dataset
        The dataset that `simulate_many` gave.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.2], periods=2)
    >>> saltus.stop_names(ends).values
    array(['horizon', 'horizon'], dtype='<U10')
    """
    check_dataset(dataset, "simulate_many", ("stop",))
    stop = dataset["stop"]
    words = np.array(stop.attrs["flag_meanings"].split())
    return stop.copy(data=words[stop.values]).drop_attrs()


@answered
def stroboscopic(system: System, dataset: xarray.Dataset) -> np.ndarray[Any, Any]:
    """The states (coordinates, then velocities, then the sides of relays) at the ends of the forcing
    periods that were kept, in the order of time.

    The shape is that of the ensemble, then (periods, d); states are nan where a motion had fewer
    periods than were kept.

    Parameters
    ----------
    system
        What moved.
    dataset
        The dataset that `simulate_many` gave, with "state" among its samples.

    Examples
    --------
    >>> ends = saltus.simulate_many(system, theta=[0.1, 0.2], periods=4, last=3)
    >>> saltus.flow.stroboscopic(system, ends).shape
    (2, 3, 2)
    """
    sides = [side_name(relay.name) for relay in system.model.relays]
    states = [*state_names(system.model.coordinates), *sides]
    check_dataset(dataset, "simulate_many with sample", [f"sampled_{name}" for name in states])
    return np.stack([dataset[f"sampled_{name}"].values for name in states], axis=-1)
