"""Overturning by pulses and records: which of them overturn a system that rests at its contact, and
the borders.

A border is a curve of amplitude over frequency on which the motion, once the load is over, ends on
an unstable equilibrium. On the one side it overturns, on the other one it comes back. Its equation
is that the state lies on the stable manifold of this saddle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import Equilibrium, share_interval
from saltus.checks import check_axis, checked_by
from saltus.continuation import STEPS, Corrected, Course, EquationCurve, Events, Point, both_ways
from saltus.errors import MotionError, ParameterError, shown
from saltus.flow import Motion, Stop, check_device, on_device, sensitivities, simulate
from saltus.progress import Progress, part_of, silent
from saltus.result import result_dataset
from saltus.studies.shaken import OVERTURNING, Outcomes, Shaken, end_of
from saltus.systems import Box, Record, System

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Distance:
    """How far the amplitude of a motion is from that of the border, by the state near the
    saddle.
    """

    residual: np.ndarray  # (1,)
    slope: Callable[[], float]

    def derivatives(self) -> np.ndarray:
        """To amplitude and frequency, (1, 2)."""
        return np.array([[1.0, self.slope()]])


@dataclass(frozen=True, eq=False)
class Border(EquationCurve[Point]):
    """The amplitudes and frequencies of motions that end on an unstable equilibrium: both are
    parameters of the curve.

    Let (x, v) be the deviation of a state from a saddle with the eigenvalues l > 0 > m, at a time T
    after the load. Its part along the unstable direction is u = v - m x, but for terms of second
    order in the deviation. The distance from the border in the amplitude A is u / (du/dA), with the
    derivative of the exact motion; T is where the motion is nearest to the saddle, so that the
    distance has an error of third order in the deviation there, and the deviation is 0 on the
    border.
    """

    shaken: Shaken
    scale: np.ndarray  # the ranges of amplitude and frequency
    # which the border belongs to, and the impacts before; None if that is to be found
    saddle: Equilibrium | None = None
    impacts: int | None = None
    count: int = 2

    @property
    def weights(self) -> np.ndarray:
        """A thirtieth of each range is the longest step."""
        return 30.0 * STEPS.longest / self.scale

    def evaluate(self, place: np.ndarray, thorough: bool) -> Distance | None:
        """The distance from the border at (amplitude, frequency); None where the motion does not
        come near to a saddle.
        """
        amplitude, frequency = (float(number) for number in place)
        found = self.distance(amplitude, frequency)
        if (
            found is None
            or self.impacts not in (None, found[1])
            or self.saddle not in (None, found[2])
        ):
            return None

        def slope() -> float:
            step = OVERTURNING.difference * frequency
            beside = self.distance(amplitude, frequency + step)
            return np.nan if beside is None else (beside[0] - found[0]) / step

        return Distance(np.array([found[0]]), slope)

    def distance(self, amplitude: float, frequency: float) -> tuple[float, int, Equilibrium] | None:
        """The amplitude less that of the border, the impacts, and the saddle."""
        shaken = self.shaken
        if not (frequency > 0.0 and np.isfinite(amplitude)):
            return None
        system = shaken.under(frequency, amplitude)
        over = end_of(system.load.channels[shaken.channel])
        free = OVERTURNING.free / shaken.rate
        try:
            motion = simulate(system, duration=over + free, tol=OVERTURNING.tol, **shaken.start)
            nearest = self._nearest(motion, over)
            if nearest is None:
                return None
            time, saddle = nearest
            result = sensitivities(
                system, duration=time, parameters=[shaken.path], tol=OVERTURNING.tol, **shaken.start
            )
        except MotionError:
            return None
        assert saddle.eigenvalues is not None
        left = np.array([-saddle.eigenvalues[1].real, 1.0])
        away = float(left @ (result.motion.final_state - [saddle.place, 0.0]))
        rate = float(left @ result.parameters[:, 0])
        if not (np.isfinite(rate) and rate != 0.0):
            return None
        return away / rate, len(result.motion.impacts), saddle

    def _nearest(self, motion: Motion, over: float) -> tuple[float, Equilibrium] | None:
        """When the motion is nearest to a saddle after the load, and which; None where it does not
        come near to one.
        """
        if motion.time <= over:
            return None
        times = np.linspace(over, motion.time, OVERTURNING.samples)
        place, velocity = motion.at(times)
        contact = float(self.shaken.system.model.contact)
        found = []
        for saddle in self.shaken.saddles:
            assert saddle.eigenvalues is not None
            away = np.hypot(place - saddle.place, velocity / saddle.eigenvalues[0].real) / abs(
                saddle.place - contact
            )
            found.append((float(away.min()), float(times[int(away.argmin())]), saddle))
        away, time, saddle = min(found, key=lambda one: one[0])
        return (time, saddle) if away < OVERTURNING.near else None

    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> Point:
        return Point(self, found.place, tangent, found.iterations)

    def through(self, amplitude: float, frequency: float) -> Point | None:
        """The point of a border at a frequency near to an amplitude; the border is that of the
        motion there.
        """
        found = self.distance(amplitude, frequency)
        for _ in range(OVERTURNING.iterations):
            if found is None:
                return None
            amplitude -= found[0]
            if abs(found[0]) <= OVERTURNING.converged * abs(amplitude):
                break
            found = self.distance(amplitude, frequency)
        if found is None:
            return None
        own = replace(self, saddle=found[2], impacts=found[1])
        place = np.array([amplitude, frequency])
        evaluation = own.evaluate(place, True)
        return None if evaluation is None else own.along_kernel(Corrected(place, evaluation, 0))


def _check(device: Any, progress: object = None, **arguments: Any) -> None:
    request = OverturningRequest(**arguments)
    check_device(device, request.system)


@dataclass(frozen=True, kw_only=True)
class OverturningRequest:
    """The arguments of `overturning_spectrum`, checked."""

    system: System
    amplitude: Any
    frequency: Any
    curves: bool = True
    window: Box | None = None
    shaken: Shaken = field(init=False)

    def __post_init__(self) -> None:
        for name in ("amplitude", "frequency"):
            values = check_axis(name, getattr(self, name))
            if values.size < 2 or not values[0] > 0.0:
                raise ParameterError(
                    f"{name} must be two or more numbers above 0, got {shown(getattr(self, name))}",
                    name,
                )
            object.__setattr__(self, name, values)
        object.__setattr__(self, "shaken", Shaken.of(self.system, self.window))


@checked_by(_check)
@on_device
def overturning_spectrum(
    system: System,
    *,
    amplitude: Iterable[float],
    frequency: Iterable[float],
    curves: bool = True,
    window: Box | None = None,
    device: str = "cpu",
    progress: Progress = silent,
) -> xarray.Dataset:
    """Which pulses of every amplitude and frequency overturn a system that rests at its contact,
    and the borders between them.

    The map is computed by an ensemble. Its borders are curves on which the motion ends on an
    unstable equilibrium after the load, each with the number of impacts before; they are followed
    through their folds, and exact to rounding (see `Border`). The frequency of a record says how
    many times faster than written it is played. Its borders are computed at each frequency of the
    map, by halving the interval between two amplitudes down to rounding.

    Amplitudes and frequencies of a pulse are those of the dimensionless system. In the system of a
    `PhysicalBlock` called `body` an acceleration is in units of `body.gravity`, and a frequency in
    units of `body.frequency`: divide m/s^2 and rad/s by these. Factors of a record have no unit.

    Parameters
    ----------
    system
        A model with one coordinate that margins can stop, such as a `RockingBlock`, under a pulse
        or a record.
    amplitude
        The amplitudes of the pulse, that increase; or the factors by which the record, as it is in
        the system, is multiplied, as in `fragility`.
    frequency
        The frequencies of the pulse, or the factors of the speed of the record, that increase.
    curves
        Whether to compute the borders.
    window
        A pair (low, high) for the coordinate and one for the velocity: where unstable equilibria
        are looked for.
    device
        Where the motions are followed, as for `simulate_many`.
    progress
        Called from time to time with the fraction done and what is being done.

    Returns
    -------
    xarray.Dataset
        `overturned`, the side to which the system overturns or 0, `impacts` before the end, and
        `stop`, why each motion ended, over `frequency` and `amplitude`; and over `point` the
        borders: `border_frequency`, `border_amplitude`, its `border_impacts` and `border_side`, and
        the number of the `border`.

    Raises
    ------
    ParameterError
        A system without unstable equilibria, or whose load is not one pulse with a frequency, or
        one record.

    Examples
    --------
    >>> pulse = saltus.OneSine(amplitude=0.3, frequency=2.0, quantity="acceleration")
    >>> block = saltus.System(model=saltus.RockingBlock(alpha=0.2), load=saltus.Load(ground_horizontal=pulse))
    >>> found = saltus.overturning_spectrum(block, amplitude=np.linspace(0.2, 1.0, 9), frequency=[2.0, 2.5])
    >>> sorted(set(found.border_impacts.values.tolist())), bool(found.border_amplitude.min() > np.tan(0.2))
    ([0, 1], True)
    """
    request = OverturningRequest(
        system=system, amplitude=amplitude, frequency=frequency, curves=curves, window=window
    )
    sizes = request.amplitude
    rates = request.frequency
    shaken = request.shaken
    progress(0.0, "map")
    grid = np.meshgrid(rates, sizes, indexing="ij")
    cells = shaken.outcomes(grid[0].ravel(), grid[1].ravel())
    found = _borders(shaken, sizes, rates, cells, part_of(progress, 0.3, 1.0)) if curves else []
    progress(1.0, "map")
    over = ("frequency", "amplitude")
    table = np.concatenate([_no_points(), *found])
    words = [stop.value for stop in Stop]
    stops = {"flag_values": np.arange(len(words)), "flag_meanings": " ".join(words)}
    columns: dict[str, tuple[Any, ...]] = {
        name: (over, values.reshape(grid[0].shape), "1", text)
        for name, values, text in (
            ("overturned", cells.overturned, "the side to which it overturns, 0 where it stands"),
            ("impacts", cells.impacts, "impacts until the end of the motion"),
            (
                "stop",
                np.array([words.index(word) for word in cells.stop], dtype=np.int8),
                "why the motion ended",
            ),
        )
    }
    names = ("frequency", "amplitude", "impacts", "side", "number")
    texts = (
        "of the border",
        "of the border",
        "before the saddle",
        "of the saddle",
        "of the border that the point belongs to",
    )
    for name, values, text in zip(names, table.T, texts, strict=True):
        columns[f"border_{name}"] = (
            "point",
            values if name in names[:2] else values.astype(int),
            "1",
            f"{name} {text}",
        )
    facts = {
        "channel": shaken.channel,
        "path": shaken.path,
        "coordinate": system.model.coordinates[0],
    }
    data = result_dataset(
        "overturning_spectrum", columns, {"frequency": rates, "amplitude": sizes}, system, **facts
    )
    data["stop"].attrs |= stops
    texts_of_axes = (
        ("factor of the speed of the record", "factor of the record, as it is in the system")
        if isinstance(shaken.signal, Record)
        else (
            "frequency of the pulse, dimensionless (of a PhysicalBlock: over its frequency)",
            f"{getattr(shaken.signal, 'quantity', 'amplitude')} of the pulse, dimensionless (of a"
            " PhysicalBlock: over its units, such as its gravity)",
        )
    )
    for name, text in zip(("frequency", "amplitude"), texts_of_axes, strict=True):
        data[name].attrs |= {"units": "1", "long_name": text}
    return data


def _no_points() -> np.ndarray:
    """A table of borders without a point: frequency, amplitude, impacts, side, number, (0, 5)."""
    return np.empty((0, 5))


def _borders(
    shaken: Shaken, sizes: np.ndarray, rates: np.ndarray, cells: Outcomes, progress: Progress
) -> list[np.ndarray]:
    """The borders between the cells of the map, each as a table like `_no_points`."""
    kinds = cells.kinds.reshape(rates.size, sizes.size)
    row, column = np.nonzero(kinds[:, 1:] != kinds[:, :-1])
    low = sizes[column]
    high = sizes[column + 1]
    frequency = rates[row]
    before = kinds[row, column]
    record = isinstance(shaken.signal, Record)
    for _ in range(
        (np.finfo(float).nmant + 2 if record else OVERTURNING.halvings) if row.size else 0
    ):
        middle = 0.5 * (low + high)
        same = shaken.outcomes(frequency, middle).kinds == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    middle = 0.5 * (low + high)
    if record:
        return _rows(shaken, frequency, low, high)
    return _curves(shaken, (sizes, rates), frequency, middle, progress)


def _rows(
    shaken: Shaken, frequency: np.ndarray, low: np.ndarray, high: np.ndarray
) -> list[np.ndarray]:
    """Points of borders that are not followed: of the two motions beside each, one overturns after
    the fewer impacts.
    """
    if not frequency.size:
        return []
    ends = [shaken.outcomes(frequency, amplitude) for amplitude in (low, high)]
    fewer = [np.where(end.overturned != 0, end.impacts, np.iinfo(np.int64).max) for end in ends]
    first = fewer[0] <= fewer[1]
    side = np.where(first, ends[0].overturned, ends[1].overturned)
    return [
        np.stack(
            [frequency, 0.5 * (low + high), np.minimum(*fewer), side, np.arange(frequency.size)],
            axis=1,
        )
    ]


def _curves(
    shaken: Shaken,
    axes: tuple[np.ndarray, np.ndarray],
    frequency: np.ndarray,
    amplitude: np.ndarray,
    progress: Progress,
) -> list[np.ndarray]:
    """The borders through points that are nearly on them, followed within the range of the axes,
    amplitude and frequency.
    """
    bounds = {
        name: (float(axis[0]), float(axis[-1]))
        for name, axis in zip(("amplitude", "frequency"), axes, strict=True)
    }
    border = Border(shaken, np.array([high - low for low, high in bounds.values()]))
    courses: list[Course[Point, Any]] = []
    for number, (rate, size) in enumerate(zip(frequency.tolist(), amplitude.tolist(), strict=True)):
        progress(number / frequency.size, "borders")
        first = border.through(size, rate)
        if first is None or any(_lies_on(first, course, border) for course in courses):
            continue
        courses.append(both_ways(first, Events, bounds))
    tables = []
    for number, course in enumerate(courses):
        own: Any = course.points[0].curve
        places = np.array([point.place for point in course.points])
        said = np.tile(
            [float(own.impacts), float(own.saddle.side), float(number)], (len(places), 1)
        )
        tables.append(np.column_stack([places[:, ::-1], said]))
    return tables


def _lies_on(point: Point, course: Course[Point, Any], border: Border) -> bool:
    """Whether a point of a border is one of a border that was followed."""
    own: Any = course.points[0].curve
    if (own.saddle, own.impacts) != (point.curve.saddle, point.curve.impacts):
        return False
    places = np.array([other.place for other in course.points])
    a, b = places.T[:, :-1]
    low, high = places.T[:, 1:]
    size, rate = point.place
    share = np.divide(rate - b, high - b, out=np.full(b.shape, 0.5), where=high != b)
    there = (a + share * (low - a))[(share >= 0.0) & (share <= 1.0)]
    return bool((np.abs(there - size) <= OVERTURNING.same * border.scale[0]).any())


@on_device
def fragility(
    systems: Iterable[System],
    scales: Iterable[float],
    *,
    window: Box | None = None,
    device: str = "cpu",
    progress: Progress = silent,
) -> xarray.Dataset:
    """The share of loads that overturn a system at rest, over a scale by which each pulse or record
    is multiplied.

    The share at a scale is that of a sample of loads; its interval is Wilson's, which holds the
    share of all such loads with a probability of 95 %.

    Parameters
    ----------
    systems
        The system under each of the loads, such as `[block.system(Load(ground_horizontal=record))
        for record in records]`.
    scales
        The factors, above 0, that increase.
    window
        As for `overturning_spectrum`.
    device
        Where the motions are followed, as for `simulate_many`.
    progress
        Called from time to time with the fraction done and what is being done.

    Returns
    -------
    xarray.Dataset
        `share`, `lower` and `upper` over `scale`, and `overturned` over `record` and `scale`: the
        side, or 0.

    Raises
    ------
    ParameterError
        No system, one that cannot overturn, scales that do not increase.

    Examples
    --------
    >>> block = saltus.PhysicalBlock(half_width=0.2, half_height=0.8)
    >>> pulses = [saltus.HalfSine(amplitude=1.0, frequency=w, quantity="acceleration") for w in (4.0, 8.0, 12.0)]
    >>> shaken = [block.system(saltus.Load(ground_horizontal=pulse)) for pulse in pulses]
    >>> found = saltus.fragility(shaken, [2.0, 5.0, 10.0])
    >>> found.share.values.round(3), found.upper.values.round(3)
    (array([0.   , 0.333, 1.   ]), array([0.561, 0.792, 1.   ]))
    """
    given = list(systems) if isinstance(systems, Iterable) else []
    if not given:
        raise ParameterError(
            f"systems must be a list of systems, one under each load, got {shown(systems)}",
            "systems",
        )
    for system in given:
        check_device(device, system)
    factors = check_axis("scales", scales)
    if not factors[0] > 0.0:
        raise ParameterError(f"scales must be above 0, got {factors[0]:g}", "scales")
    sides = []
    for number, system in enumerate(given):
        progress(number / len(given), f"load {number + 1} of {len(given)}")
        sides.append(Shaken.of(system, window).scaled(factors).overturned)
    progress(1.0, "all loads")
    overturned = np.array(sides)
    counts = np.count_nonzero(overturned, axis=0)
    lower, upper = np.transpose([share_interval(int(count), len(given)) for count in counts])
    columns: dict[str, tuple[Any, ...]] = {
        "share": ("scale", counts / len(given), "1", "share of the loads that overturn the system"),
        "lower": ("scale", lower, "1", "lower end of the 95 % interval of the share"),
        "upper": ("scale", upper, "1", "upper end of the 95 % interval of the share"),
        "overturned": (
            ("record", "scale"),
            overturned,
            "1",
            "the side to which it overturns, 0 where it stands",
        ),
    }
    return result_dataset(
        "fragility", columns, {"scale": factors, "record": np.arange(len(given))}, given[0]
    )
