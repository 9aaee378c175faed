"""A branch of periodic orbits along one parameter: its points, its special points and why it ends.

Its dataset stores it without loss, and its orbits are read back from there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import answered, check_dataset, check_number, with_answers
from saltus.continuation import NEWTON, Course, End
from saltus.errors import ParameterError
from saltus.flow import (
    Functions,
    Motion,
    Quantity,
    check_new_names,
    extremes_of,
    own_quantities,
    unit_of,
)
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.beyond.special_point import OrbitEnd, SpecialPoint, SpecialPoints
from saltus.orbits.contract.equations import OrbitEquations
from saltus.orbits.equations.kinds import equations_of
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import ModeChange, Signature
from saltus.progress import html_table
from saltus.result import Result, check_provenance, provenance
from saltus.systems import System, driven_displacements

if TYPE_CHECKING:
    import xarray

    from saltus.orbits.beyond.special_point import SpecialPoint

START = End(OrbitEnd.START)
OF_CYCLES = ("rounds", "through")  # names of a table of cycles alone


@with_answers
@dataclass(frozen=True, eq=False)
class Branch(Result, Course[OrbitPoint, SpecialPoint]):
    """A branch: its points in order, its special points, and why it ends on both sides.

    Attributes
    ----------
    points
        The points in order, each with its `orbit` and its parameters.
    special
        The special points, each a `SpecialPoint`.
    ends
        Why the branch ends at its first point and at its last one.
    missed
        The special points that were noticed on the way and could not be located, each with its
        reason.
    path
        The dotted path of the parameter.
    origin
        Where the branch begins: at an orbit that was given, or at a special point of another
        branch.

    Examples
    --------
    >>> branch.ends[0].parameter, len(branch.at(0.88))
    (0.8, 3)
    """

    path: str
    origin: End = START

    def __post_init__(self) -> None:
        object.__setattr__(self, "special", SpecialPoints(self.special))

    @property
    def orbits(self) -> list[PeriodicOrbit]:
        """The orbits, in order."""
        return [point.orbit for point in self.points]

    @cached_property
    def amplitudes(self) -> np.ndarray:
        """The amplitudes along it, (n,); of several coordinates those of the one that the load
        drives.
        """
        return np.array([point.orbit.amplitude for point in self.points])

    @cached_property
    def sizes(self) -> np.ndarray:
        """The `size` of each orbit, (n,)."""
        return np.array([point.orbit.size for point in self.points])

    def quantity(self, which: str | Callable[[Motion], Any] = "amplitude") -> np.ndarray:
        """A quantity of the motions along it, (n,).

        Parameters
        ----------
        which
            A quantity as `PeriodicOrbit.quantity` takes it: a name, or a function of a motion.

        Raises
        ------
        ParameterError
            There is no such quantity.

        Examples
        --------
        >>> bool((branch.quantity("largest_theta") <= branch.amplitudes).all())
        True
        """
        return np.array([point.orbit.quantity(which) for point in self.points])

    @cached_property
    def stable(self) -> np.ndarray:
        """Whether each orbit is stable, (n,)."""
        return np.array([point.orbit.stable for point in self.points])

    def at(self, value: float) -> list[PeriodicOrbit]:
        """All orbits of the branch at a value of the parameter, solved there.

        Parameters
        ----------
        value
            The parameter's value.

        Raises
        ------
        ParameterError
            `value` is no finite number.
        """
        check_number("value", value)
        return [point.orbit for point in self.solved_at(value)]

    def to_xarray(self, functions: Functions | None = None) -> xarray.Dataset:
        """The branch as a dataset, see `branch_dataset`.

        Parameters
        ----------
        functions
            Further quantities of the motions by name, as `frequency_sweep` takes them: each has a
            column.
        """
        return branch_dataset(self, functions)

    def _repr_html_(self) -> str:
        facts = {
            f"{i + 1}. {p.kind}": (
                f"{self.path} = {p.parameter:.9g}, amplitude {p.orbit.amplitude:.6g}"
            )
            for i, p in enumerate(self.special)
        }
        ends = {"begins": str(self.ends[0]), "ends": str(self.ends[1])}
        span = (
            f"{self.parameters.min():.6g} to {self.parameters.max():.6g}"
            if len(self.points)
            else "none"
        )
        return html_table(
            f"Branch along {self.path}", {"points": len(self.points), "from": span, **facts, **ends}
        )

    def __repr__(self) -> str:
        kinds = ", ".join(f"{p.kind} {p.parameter:.6g}" for p in self.special)
        span = (
            f"{self.path} from {self.parameters.min():.6g} to {self.parameters.max():.6g}"
            if len(self.points)
            else self.path
        )
        missed = f"; not located: {', '.join(map(str, self.missed))}" if self.missed else ""
        ends = f"ends: {self.ends[0]} | {self.ends[1]}"
        return (
            f"Branch({span}, {len(self.points)} points, special: {kinds or 'none'}; {ends}{missed})"
        )


def branch_dataset(branch: Branch, functions: Functions | None = None) -> xarray.Dataset:
    """The dataset of a branch: points along `point`, special points along `special`.

    A quantity `x` of the points has the name `special_x` at the special points.

    `stable` and `symmetric` are 0 or 1; `unknowns` and `sides` are those of each orbit (see
    `equations/`), padded with nan and 0 to one length. Orbits that rest also have the times of
    their `releases` and `rests`. The attributes hold, for both ends, the sentence (`ends`), the
    reason as a word (`end_reasons`) and the kind of the special point there, if any (`end_kinds`).
    """
    import xarray

    orbits = branch.orbits
    equations = orbits[0].equations
    data: dict[str, Any] = {"parameter": ("point", branch.parameters, {"long_name": branch.path})}
    data |= {name: ("point", values, attrs) for name, values, attrs in _columns(orbits, equations)}
    own = own_quantities(equations.given, functions)
    data |= (
        multiplier_columns(orbits)
        | solution_columns(orbits)
        | _special(branch.special, equations, own)
        | _rests(orbits)
    )
    table = xarray.Dataset(data)
    check_new_names(own, {*table.variables, *table.dims, *OF_CYCLES})
    data |= {
        quantity.name: ("point", values, _attributes(quantity))
        for quantity, values in zip(own, _values(orbits, own), strict=True)
    }
    attributes: dict[str, Any] = {
        "kind": "branch",
        "path": branch.path,
        "coordinate": " ".join(equations.given.model.coordinates),
        "ends": [str(end) for end in branch.ends],
        "end_reasons": [end.reason.code for end in branch.ends],
        "end_kinds": [str(end.kind) for end in branch.ends],
        "origin": str(branch.origin),
        "closed": int(branch.closed),
        "missed": "; ".join(map(str, branch.missed)),
    }
    attributes["shown"] = " ".join(driven_displacements(equations.given))
    return xarray.Dataset(data, attrs=provenance(equations.given, tol=equations.tol, **attributes))


def _columns(
    orbits: list[PeriodicOrbit], equations: OrbitEquations
) -> list[tuple[str, np.ndarray, dict[str, str]]]:
    """The quantities that are one number for each orbit."""
    given = equations.given
    model = given.model
    coordinate = " or ".join(driven_displacements(given))
    angle = {"units": unit_of(given, driven_displacements(given)[0])}

    def column(value: Any, kind: Any = float) -> np.ndarray:
        return np.array([value(orbit) for orbit in orbits], dtype=kind)

    columns = [
        (
            "amplitude",
            column(lambda o: o.amplitude),
            {**angle, "long_name": f"max abs({coordinate})"},
        ),
        ("highest", column(lambda o: o.highest), {**angle, "long_name": f"max {coordinate}"}),
        ("lowest", column(lambda o: o.lowest), {**angle, "long_name": f"min {coordinate}"}),
        ("stable", column(lambda o: o.stable, np.int8), {}),
        (
            "impact_count",
            column(lambda o: o.impact_count, int),
            {"long_name": "impacts in one period of the orbit"},
        ),
        ("slowest", column(lambda o: o.slowest), {"long_name": "least speed of an impact"}),
        (
            "clearance",
            column(lambda o: o.clearance),
            {"long_name": "least inner minimum of the gap"},
        ),
        ("residual", column(lambda o: o.residual), {}),
        ("rest_share", column(lambda o: o.rest_share), {}),
    ]
    if len(model.coordinates) > 1:
        for extreme in extremes_of(given):
            values = column(lambda o, which=extreme: which.over(o.ranges))
            columns.append((extreme.name, values, _attributes(extreme)))
    for name in equations.margins:
        attrs = {"long_name": f"least {name}", "margin_kind": str(model.margin_kind(name))}
        columns.append((f"margin_{name}", column(lambda o, name=name: o.margins[name]), attrs))
    return columns


def _attributes(quantity: Quantity) -> dict[str, str]:
    """The unit and the text of a quantity."""
    return {"units": quantity.unit, "long_name": quantity.text}


def _values(orbits: Iterable[PeriodicOrbit], own: Sequence[Quantity]) -> np.ndarray:
    """The quantities of orbits, (quantities, orbits): each orbit is followed once."""
    rows = []
    for orbit in orbits:
        motion = orbit.motion() if own else None
        rows.append([quantity.of(motion) for quantity in own if motion is not None])
    return np.array(rows, dtype=float).reshape(len(rows), len(own)).T


def _rests(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """Releases and rests of orbits that rest, in rows of one length."""
    width = max(len(orbit.releases) for orbit in orbits)
    if not width:
        return {}

    def rows(name: str) -> np.ndarray:
        return np.array(
            [
                np.pad(getattr(o, name), (0, width - len(o.releases)), constant_values=np.nan)
                for o in orbits
            ]
        )

    return {name: (("point", "rest"), rows(name)) for name in ("releases", "rests")}


def multiplier_columns(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """The multipliers of each orbit, in rows of one length."""
    # their number varies: what contacts hold has none
    every = [orbit.multipliers for orbit in orbits]
    values = np.array([np.pad(one, (0, max(map(len, every)) - len(one))) for one in every])
    dims = ("point", "multiplier")
    return {"multiplier_real": (dims, values.real), "multiplier_imag": (dims, values.imag)}


def solution_columns(orbits: list[PeriodicOrbit]) -> dict[str, Any]:
    """The signature of each orbit and the unknowns of its equations, in rows of one length, as
    `orbits_of` reads them.
    """
    width = max(orbit.equations.size for orbit in orbits)
    unknowns = np.full((len(orbits), width), np.nan)
    sides = np.zeros(
        (len(orbits), max(1, max(len(orbit.signature.sides) for orbit in orbits))), dtype=np.int8
    )
    for row, side, orbit in zip(unknowns, sides, orbits, strict=True):
        row[: orbit.equations.size] = orbit.solution.unknowns
        side[: len(orbit.signature.sides)] = orbit.signature.sides
    data: dict[str, Any] = {
        "unknowns": (("point", "unknown"), unknowns),
        "sides": (("point", "impact"), sides),
        "symmetric": ("point", np.array([orbit.symmetric for orbit in orbits], dtype=np.int8)),
        "period": (
            "point",
            np.array([orbit.period for orbit in orbits]),
            {"long_name": "forcing periods in one period of the orbit, or the time of a cycle"},
        ),
        "side": (
            "point",
            np.array([orbit.signature.side for orbit in orbits], dtype=np.int8),
            {"long_name": "side of an orbit without impacts"},
        ),
    }
    events = np.full(
        (len(orbits), max(1, max(len(orbit.signature.events) for orbit in orbits)), 3), -1
    )
    for table, orbit in zip(events, orbits, strict=True):
        for row, event in zip(table, orbit.signature.events, strict=False):
            row[:] = event.is_impact, event.contact, event.closed
    closed = np.array([orbit.signature.closed for orbit in orbits])
    sections = np.array(
        [np.nan if orbit.signature.section is None else orbit.signature.section for orbit in orbits]
    )
    # of cycles, whose period is a time: how often they go round, and their section
    through = [orbit.signature.through for orbit in orbits]
    if any(through):
        rounds, plane = OF_CYCLES
        data[rounds] = ("point", np.array([orbit.signature.period for orbit in orbits]))
        data[plane] = (("point", "section_number"), np.array(through))
    relays = [orbit.signature.relays for orbit in orbits]
    if any(relays):
        data["relays"] = (("point", "relay"), np.array(relays, dtype=np.int8))
    return data | {
        "section": ("point", sections),
        "events": (("point", "event_mark"), events.reshape(len(orbits), -1)),
        "closed_contacts": ("point", closed),
    }


def _special(
    special: tuple[SpecialPoint, ...], equations: OrbitEquations, own: Sequence[Quantity]
) -> dict[str, Any]:
    """The special points with their evidence and their quantities."""
    rows: dict[str, list[Any]] = {
        "kind": [str(s.kind) for s in special],
        "special_parameter": [s.parameter for s in special],
        "special_amplitude": [s.amplitude for s in special],
        "special_highest": [s.orbit.highest for s in special],
        "special_lowest": [s.orbit.lowest for s in special],
        "special_slowest": [s.orbit.slowest for s in special],
        "special_impact_count": [s.orbit.impact_count for s in special],
        "special_period": [s.orbit.period for s in special],
        "special_residual": [s.evidence.residual for s in special],
        "bracket": [s.evidence.bracket for s in special],
        "test_before": [s.evidence.before for s in special],
        "test_after": [s.evidence.after for s in special],
        "test_value": [s.evidence.value for s in special],
        "special_defect": [s.defect for s in special],
    }
    for quantity, values in zip(own, _values([s.orbit for s in special], own), strict=True):
        rows[f"special_{quantity.name}"] = values.tolist()
    for name, values, _ in _columns([s.orbit for s in special], equations):
        if name != "stable":
            rows.setdefault(f"special_{name}", values.tolist())
    proofs = [s.evidence.proof for s in special]
    if any(proof is not None for proof in proofs):
        rows["special_proved"] = [int(p is not None and bool(p.proved)) for p in proofs]
        rows["special_enclosure"] = [np.nan if p is None else p.parameter[0] for p in proofs]
        rows["special_radius"] = [np.inf if p is None else p.parameter[1] for p in proofs]
    return {
        name: ("special", np.array(values, dtype=_dtype(name, values)))
        for name, values in rows.items()
    }


def _dtype(name: str, values: list[Any]) -> type:
    """The type of a column of special points, which NumPy cannot tell if the column has no rows."""
    if name == "special_period":
        return float if any(isinstance(value, float) for value in values) else int
    return (
        str
        if name == "kind"
        else int
        if name in ("special_impact_count", "special_proved")
        else float
    )


NEEDED = ("parameter", "unknowns")


@answered
def orbits_of(dataset: xarray.Dataset) -> list[PeriodicOrbit]:
    """The orbits along `point` of a dataset that `Branch.to_xarray` or `SpecialCurve.to_xarray`
    made, bit for bit, in order.

    The equations are evaluated at the kept unknowns, which must solve them. `continue_orbit` can go
    on from each of these orbits.

    Parameters
    ----------
    dataset
        The dataset that `to_xarray` of a branch or a curve gave.

    Raises
    ------
    ParameterError
        The dataset is of another kind, of other equations than the model has now, or of another
        version of saltus; its unknowns do not solve the equations; or the model is the user's own
        and not registered (`saltus.register`).

    Examples
    --------
    >>> again = saltus.orbits.orbits_of(branch.to_xarray())
    >>> again[0].amplitude == branch.orbits[0].amplitude
    True
    """
    check_dataset(dataset, "a branch or a curve of special points", NEEDED, ("system", "tol"))
    system = System.from_json(dataset.attrs["system"])
    tol = float(dataset.attrs["tol"])
    check_provenance(dataset.attrs, system, "the dataset of these orbits")
    paths = (
        tuple(map(str, dataset["path"].values))
        if "path" in dataset.coords
        else (str(dataset.attrs["path"]),)
    )
    values = np.atleast_2d(dataset["parameter"].values.T).T
    known: dict[Signature, OrbitEquations] = {}
    orbits = []
    for signature, row, value in zip(
        _signatures(dataset), dataset["unknowns"].values, values, strict=True
    ):
        if signature not in known:
            known[signature] = equations_of(system, signature, paths, tol)
        orbits.append(_orbit(known[signature], row, value))
    return orbits


def _signatures(dataset: xarray.Dataset) -> list[Signature]:
    """The signature of each orbit."""
    rounds = "rounds" if "rounds" in dataset else "period"
    columns = (dataset[name].values for name in ("sides", rounds, "symmetric", "side"))
    signatures = [_signature(*row) for row in zip(*columns, strict=True)]
    changes = [
        tuple(ModeChange(bool(k), int(i), int(c)) for k, i, c in table.reshape(-1, 3) if k >= 0)
        for table in dataset["events"].values
    ]
    more = zip(
        signatures,
        changes,
        dataset["closed_contacts"].values,
        dataset["section"].values,
        dataset["through"].values if "through" in dataset else [()] * len(signatures),
        dataset["relays"].values if "relays" in dataset else [()] * len(signatures),
        strict=True,
    )
    return [
        replace(
            signature,
            events=events,
            closed=int(closed),
            section=None if np.isnan(section) else float(section),
            through=tuple(map(float, through)),
            relays=tuple(map(int, relays)),
        )
        for signature, events, closed, section, through, relays in more
    ]


def _signature(sides: np.ndarray, periods: Any, symmetric: Any, side: Any) -> Signature:
    """The signature in one row of the dataset, where the sides are padded with 0."""
    return Signature(tuple(int(s) for s in sides if s), int(periods), bool(symmetric), int(side))


def _orbit(equations: OrbitEquations, row: np.ndarray, value: np.ndarray) -> PeriodicOrbit:
    values = value.astype(float)
    orbit = PeriodicOrbit.known(equations, row[: equations.size].copy(), values)
    scale = max(1.0, float(np.abs(row[: equations.size]).max()))
    if orbit is None or not orbit.residual <= max(NEWTON.stalled * scale, equations.residual_floor):
        error = (
            "its motion cannot be followed"
            if orbit is None
            else f"its residual is {orbit.residual:.1e}"
        )
        raise ParameterError(
            f"what is kept at {equations.paths[0]} = {values[0]:g} is not an orbit ({error}): the "
            f"data are damaged"
        )
    return orbit
