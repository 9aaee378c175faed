"""A system: a model, a load and an impact law, frozen and complete; and its mirror symmetry, images
of states and contacts.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from saltus.checks import Numbers
from saltus.errors import ParameterError, near, shown
from saltus.files import parsed_json
from saltus.number_ranges import settle_numbers
from saltus.progress import html_table
from saltus.systems.contracts.contact_model import ContactModel
from saltus.systems.contracts.model import Model, OneContactModel
from saltus.systems.gap_coordinates import in_gap_coordinates
from saltus.systems.impact_laws import ImpactLaw, VelocityReduction
from saltus.systems.loads.load import DeclaredLoad, Load
from saltus.systems.mirror import mirror_of
from saltus.systems.model_checks import check_contact, check_traces, check_works
from saltus.systems.serial import (
    children,
    differ_in_numbers,
    from_dict,
    is_fixed,
    numbers,
    replace,
    to_dict,
)
from saltus.systems.system_units import units_of_gaps

OWN_TIME = "own time"  # that of a system with which numbers
# what a copy with other numbers remembers of the system that it is a copy of
HANDED_OVER = ("structure", OWN_TIME)
PARTS = ("model", "load", "impact")  # of a system, in the order of its numbers


@dataclass(frozen=True, kw_only=True)
class System:
    """A model, its load and its impact law: all that is needed to repeat a motion.

    `System(model=Metainterface(beta0=...), load=Load(...), impact=VelocityReduction(1.0))`. Every
    number has a dotted path: `model.damping`, `load.frequency`, `load.horizontal.amplitude`,
    `load.vertical`, `impact.e`.

    Parameters
    ----------
    model
        The equations of motion.
    load
        The load that acts on it; by default none.
    impact
        The impact law; by default the model's `usual_impact`, which is Housner's for a rocking
        block, and else the velocity is kept (e = 1).

    Raises
    ------
    ParameterError
        A load channel that the model does not read, or one that cannot act on it.

    Examples
    --------
    >>> system.get("load.frequency"), system.with_({"load.frequency": 0.9}).get("load.frequency")
    (1.0, 0.9)
    >>> saltus.System.from_json(system.to_json()) == system
    True
    """

    _in_gaps = None  # this system in coordinates of its gaps, if it has others

    model: Model
    load: Load = field(default_factory=Load)
    impact: ImpactLaw = None  # type: ignore[assignment]  # until `__post_init__`, which knows the model

    def __post_init__(self) -> None:
        if self.impact is None:
            object.__setattr__(
                self, "impact", getattr(self.model, "usual_impact", None) or VelocityReduction()
            )
        _check_parts(self)
        for channel in self.load.channels:
            if channel not in self.model.channels:
                hint = near(channel, [*self.model.channels, "frequency"])
                raise ParameterError(
                    f"{type(self.model).__name__} does not read load.{channel}; {hint}",
                    f"load.{channel}",
                )
        self.model.check_load(self.load)
        if _passes(self.model, self.impact):  # refuses sums that cannot be coordinates
            inner = System(model=in_gap_coordinates(self.model), load=self.load, impact=self.impact)
            object.__setattr__(self, "_in_gaps", inner)
        check_traces(self)

    def _remembered(self, what: Any, make: Callable[[], Any]) -> Any:
        """What follows from this system alone, made when it is first asked for; for those who make
        a motion of it.

        A copy makes it anew, and so does at every time a system of which a part may change, as an
        array or a class that is not frozen does.
        """
        memory = vars(self).get("_memory")
        if memory is None:
            memory = vars(self).setdefault("_memory", {} if is_fixed(self) else ())
        if what in memory:
            return memory[what]
        made = make()
        return memory.setdefault(what, made) if isinstance(memory, dict) else made

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_memory"}

    def _repr_html_(self) -> str:
        parts = {name: type(getattr(self, name)).__name__ for name in ("model", "impact")}
        return html_table("System", parts | self.parameters)

    def with_(self, changes: Mapping[str, Any] | None = None, **more: Any) -> System:
        """A copy with the parts at the given dotted paths replaced:
        `system.with_({"load.frequency": 1.1})`.

        Parameters
        ----------
        changes
            The new parts by their dotted paths.
        more
            New parts by paths without a dot: model=..., load=..., impact=....

        Raises
        ------
        ParameterError
            A path that leads nowhere (the error names similar ones), or a value that is refused
            there.
        """
        if changes is not None and not isinstance(changes, Mapping):
            raise ParameterError(
                "changes must be a dict of parts by their paths, as {'load.frequency': 1.1}, "
                f"got {shown(changes)}",
                "changes",
            )
        given = {**(changes or {}), **more}
        for path in given:
            if str(path).partition(".")[0] not in children(self):
                hint = near(str(path), [*children(self), *self.parameters])
                raise ParameterError(
                    f"no parameter {shown(path)}; {hint} (as in with_({{'load.frequency': 1.1}}))",
                    str(path),
                )
        system: System = replace(self, given)
        self._hand_over(system, given)
        return system

    def _hand_over(self, other: System, changes: Mapping[str, Any]) -> None:
        """Let a copy in which numbers alone are others remember what does not depend on them: the
        key of its structure, and the numbers of the parts that it shares. In a loop over numbers
        these take longer than a short motion.
        """
        memory = vars(self).get("_memory")
        if isinstance(memory, dict) and differ_in_numbers(self, other, changes):
            kept = {name: memory[name] for name in HANDED_OVER if name in memory}
            if "numbers" in memory:
                kept["shared numbers"] = {
                    name: memory["numbers"][name]
                    for name in PARTS
                    if getattr(self, name) is getattr(other, name)
                }
            vars(other)["_memory"] = kept
            in_gaps = self._in_gaps
            other_in_gaps = other._in_gaps
            within = None if in_gaps is None else vars(in_gaps).get("_memory")
            if isinstance(within, dict) and OWN_TIME in within and other_in_gaps is not None:
                vars(other_in_gaps)["_memory"] = {OWN_TIME: within[OWN_TIME]}

    @property
    def numbers_in_order(self) -> list[float]:
        """Every number of the system, in the order of `parameters`, with those that follow from
        others."""
        found = self._remembered("numbers", self._numbers_by_part)
        return [value for name in PARTS for value in found[name]]

    def _numbers_by_part(self) -> dict[str, tuple[float, ...]]:
        memory = vars(self).get("_memory")
        known = memory.get("shared numbers", {}) if isinstance(memory, dict) else {}
        return {
            name: known.get(name) or tuple(value for _, value in numbers(getattr(self, name)))
            for name in PARTS
        }

    def get(self, path: str) -> Any:
        """The part at a dotted path; a constant channel is its number.

        Parameters
        ----------
        path
            The dotted path, such as "load.horizontal.amplitude".
        """
        if not isinstance(path, str):
            raise ParameterError(
                f"a path must be a text such as 'load.frequency', got {shown(path)}", "path"
            )
        node: Any = self
        for name in path.split("."):
            parts = children(node)
            if name not in parts:
                raise ParameterError(
                    f"no parameter {shown(path)}; {near(path, self.parameters)}", path
                )
            node = parts[name]
        return node.value if type(node).__name__ == "Constant" else node

    @property
    def dimension(self) -> int:
        """The number of its state variables, coordinates and their velocities."""
        return 2 * len(self.model.coordinates)

    @property
    def parameters(self) -> dict[str, float]:
        """Every number of the system by its dotted path."""
        return dict(numbers(self, given=True))

    @property
    def in_gap_coordinates(self) -> System:
        """This system in coordinates of which each contact of its model holds one; itself, if each
        does already.

        A sum of coordinates that a contact keeps on one side then is a coordinate, in the place of
        one of its terms: y_minus_x in the place of y. All other numbers are the same, under the
        same paths.
        """
        return self._in_gaps or self

    @property
    def dependent(self) -> int:
        """How many coordinates of `in_gap_coordinates`, the last ones, are sums that follow from
        the others.
        """
        return int(getattr(self.in_gap_coordinates.model, "dependent", 0))

    def from_gaps(self, time: Any, position: Any, velocity: Numbers) -> tuple[Any, Any]:
        """Coordinates and velocities of this system, for those of `in_gap_coordinates`; the same
        objects where that is itself.

        Parameters
        ----------
        time
            The dimensionless time, a number or an array (n,).
        position, velocity
            A number or an array (n,) for each coordinate.
        """
        if self._in_gaps is None:
            return position, velocity
        model: Any = self._in_gaps.model
        return model.own_states(time, position, velocity, self.load)

    def to_gaps(self, time: Any, position: Any, velocity: Numbers) -> tuple[Any, Any]:
        """The inverse of `from_gaps`. Gaps of closed contacts, and their rates, are 0 if they are
        so up to rounding.

        Parameters
        ----------
        time
            The dimensionless time, a number or an array (n,).
        position, velocity
            A number or an array (n,) for each coordinate.
        """
        if self._in_gaps is None:
            return position, velocity
        model: Any = self._in_gaps.model
        return model.gap_states(time, position, velocity, self.load, units_of_gaps(self))

    def _with_rates(self, time: float, state: np.ndarray) -> np.ndarray:
        """A state (d,), changed in place: velocities of coordinates of first order are those that
        follow from it at a time.
        """
        model = self.model
        if model.first_order:
            q, v = (x.item() if x.size == 1 else tuple(x.tolist()) for x in np.split(state, 2))
            rates = np.atleast_1d(
                np.array(
                    model.acceleration(time, q, v, 1, DeclaredLoad(self.load, model)), dtype=float
                )
            )
            state[len(state) - len(model.first_order) :] = rates[len(model.moving) :]
            getattr(model, "closed_exactly", lambda *given: given)(*np.split(state, 2))
        return state

    def mirrored(self) -> System | None:
        """The system in which 2 c - theta(t) is a motion wherever theta(t) is one in this system,
        with the mirror's centre c; None without the symmetry.

        With several coordinates the mirror image may swap some (`Model.images`); contacts and
        frictions must be images of one another, with the same laws.

        Raises
        ------
        ParameterError
            A `mirror` of the model that is no such symmetry, as a test at one state shows.
        """
        mirror = mirror_of(self)
        return (
            None
            if mirror is None
            else System(model=self.model, load=mirror.load, impact=self.impact)
        )

    @property
    def one_contact(self) -> OneContactModel:
        """Its model, for what only a model with one contact has.

        Raises
        ------
        ParameterError
            The model is of another class.
        """
        if not isinstance(self.model, OneContactModel):
            raise ParameterError(f"{type(self.model).__name__} is not a OneContactModel", "system")
        return self.model

    @property
    def contact_model(self) -> ContactModel:
        """Its model, for what only a model with contacts and frictions of single coordinates has.

        Raises
        ------
        ParameterError
            The model is of another class.
        """
        if not isinstance(self.model, ContactModel):
            raise ParameterError(f"{type(self.model).__name__} is not a ContactModel", "system")
        return self.model

    def to_dict(self) -> dict[str, Any]:
        """Plain nested dictionaries, as written to JSON and TOML."""
        return {
            "model": to_dict(self.model),
            "load": to_dict(self.load),
            "impact": to_dict(self.impact),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> System:
        """The inverse of `to_dict`; `load` and `impact` may be left out.

        Parameters
        ----------
        data
            A dictionary as `to_dict` returns it.
        """
        if not isinstance(data, Mapping):
            raise ParameterError(
                f"a system is a table with a model, a load and an impact law, got {shown(data)}",
                "data",
            )
        unknown = set(data) - {"model", "load", "impact"}
        if unknown:
            name = min(map(str, unknown))
            raise ParameterError(
                f"unknown key {name!r} of a system; {near(name, ('model', 'load', 'impact'))}",
                "data",
            )
        if "model" not in data:
            raise ParameterError(
                "a system needs a model, such as {'type': 'Metainterface', 'beta0': 1.4}", "model"
            )
        parts: dict[str, Any] = {name: from_dict(name, value) for name, value in data.items()}
        return cls(**parts)

    def to_json(self) -> str:
        """The system as one line of JSON; numbers are exact."""
        return json.dumps(self.to_dict())

    @classmethod
    def from_json(cls, text: str) -> System:
        """The inverse of `to_json`.

        Parameters
        ----------
        text
            What `to_json` gave.

        Raises
        ------
        ParameterError
            Text that is no JSON, or no system.
        """
        return cls.from_dict(_parsed(text, parsed_json, "JSON"))

    def to_toml(self) -> str:
        """The system as TOML."""
        import tomli_w

        return tomli_w.dumps(self.to_dict())

    @classmethod
    def from_toml(cls, text: str) -> System:
        """The inverse of `to_toml`.

        Parameters
        ----------
        text
            What `to_toml` gave.

        Raises
        ------
        ParameterError
            Text that is no TOML, or no system.
        """
        import tomllib

        return cls.from_dict(_parsed(text, tomllib.loads, "TOML"))


class _CheckedParts(NamedTuple):
    """A model and an impact law that have passed their checks, and whether the model has contacts
    of sums of coordinates.
    """

    model: Any = None
    impact: Any = None
    has_sums: bool = False


# the last ones: `with_` makes systems by the thousand whose loads alone differ
_passed = _CheckedParts()


def _passes(model: Model, impact: ImpactLaw) -> bool:
    """Refuse a model and an impact law that cannot be simulated; returns whether contacts of it are
    of sums of coordinates.
    """
    global _passed
    last = _passed
    if last.model is not model or last.impact is not impact or not is_fixed(model):
        _settle("model", model)
        _settle("impact", impact)
        has_sums = check_works(model)
        _check_impact(model, impact)
        _passed = last = _CheckedParts(model, impact, has_sums)
    return last.has_sums


def _settle(name: str, part: Any) -> None:
    """Check the declared ranges of a class of one's own; saltus's check them where they are made."""
    if not type(part).__module__.startswith("saltus."):
        try:
            settle_numbers(part)
        except ParameterError as error:
            raise error.inside(name) from None


def _check_parts(system: System) -> None:
    """Refuse parts of a system that are of no class for their place."""
    if not isinstance(system.model, Model):
        raise ParameterError(
            f"model must be a Model, such as Metainterface(beta0=1.4), got {shown(system.model)}",
            "model",
        )
    if not isinstance(system.load, Load):
        raise ParameterError(
            f"load must be a Load, such as Load(frequency=1.0, ...), got {shown(system.load)}",
            "load",
        )
    if not isinstance(system.impact, ImpactLaw):
        raise ParameterError(
            "impact must be an ImpactLaw: VelocityReduction(e) where a motion passes the contact,"
            " NewtonImpact(e) where it bounces, EnergyRestitution(...) or InelasticImpact(); got"
            f" {shown(system.impact)}",
            "impact",
        )


def _check_impact(model: Model, impact: ImpactLaw) -> None:
    """Refuse an impact law that means nothing for the contacts of a model."""
    if isinstance(model, ContactModel) and model.contacts:
        impact.restitution_matrix(model)
    elif isinstance(model, OneContactModel) and model.sides:
        impact.check_one_contact(model)
        check_contact(model, impact)
    elif impact != VelocityReduction():
        raise ParameterError(
            f"this {type(model).__name__} has no impacts, so {impact!r} cannot act; leave it out",
            "impact",
        )


def _parsed(text: str, parse: Callable[[str], Any], language: str) -> Any:
    try:
        return parse(text)
    except RecursionError:
        raise ParameterError(
            f"this is not the {language} of a system: it is nested too deeply", "text"
        ) from None
    except (
        TypeError,
        ValueError,
        AttributeError,
    ) as error:  # not a text, or not one of this format
        raise ParameterError(
            f"this is not the {language} of a system: {error!s:.120}", "text"
        ) from None


def _modes_of(system: System) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of the relays of a system's model, and of the surfaces that reset its state."""
    model = system.model
    found: tuple[tuple[str, ...], tuple[str, ...]] = system._remembered(
        "modes", lambda: (tuple(part.name for part in model.relays), model.resets)
    )
    return found


def _check_modes(system: System, asking: str, resets: bool) -> None:
    """Refuse relays and, without `resets`, surfaces that reset the state."""
    known, resetting = _modes_of(system)
    kind = type(system.model).__name__
    if known:
        raise ParameterError(
            f"{asking} does not follow relays so far, and {kind} has {known[0]!r}; simulate,"
            " simulate_many, find_orbit and find_attractors do",
            "system",
        )
    if resetting and not resets:
        raise ParameterError(
            f"{asking} does not follow surfaces with an after_event so far, and {kind} has"
            f" {resetting[0]!r}; simulate, simulate_many, find_orbit and find_attractors do",
            "system",
        )


def check_system(
    system: Any,
    asking: str,
    *,
    coordinates: int | None = None,
    several_contacts: bool = False,
    sums: bool = True,
    multipliers: bool = False,
    switches: bool = False,
    jumps: bool = False,
    resets: bool = False,
    relays: bool = False,
) -> None:
    """Refuse anything but a System whose model has the contacts and the number of coordinates that
    `asking` is for.

    Without `sums` each contact and surface must be of a single coordinate; without `multipliers`
    none may be a `distance`, and no friction a `rate`; without `switches` no surface a `function`,
    and the force must have no switches of its own; without `jumps` none at which it may jump;
    without `resets` no surface resets the state, and without `relays` none remembers its side.

    Raises
    ------
    ParameterError
        The error says which systems `asking` takes.
    """
    if not isinstance(system, System):
        raise ParameterError(
            f"{asking} takes a System(model=..., load=..., impact=...), got {shown(system)}",
            "system",
        )
    if not multipliers and system.model.has_multipliers:
        held = [part.name for part in system.model.contacts if part.distance is not None]
        held += [part.name for part in system.model.frictions if part.rate is not None]
        raise ParameterError(
            f"{asking} does not follow contacts of a distance and frictions of a rate so far, and"
            f" {type(system.model).__name__} has {', '.join(held)}; simulate, simulate_many,"
            " find_orbit and find_attractors do",
            "system",
        )
    if not (resets and relays):
        _check_modes(system, asking, resets)
    if not switches and system.model.has_switches:
        raise ParameterError(
            f"{asking} does not follow surfaces that are functions, and forces with abs, sign, maximum"
            f" or comparisons, so far, and {type(system.model).__name__} has some; simulate does",
            "system",
        )
    if not jumps and system.model.has_switches and system.model.has_multipliers:
        raise ParameterError(
            f"{asking} does not follow surfaces that are functions beside a distance or a rate so far;"
            " simulate does",
            "system",
        )
    if not jumps and system.model.force_jumps:
        raise ParameterError(
            f"{asking} does not follow forces that may jump with np.sign or a comparison of their own"
            f" so far, as that of {type(system.model).__name__}: name what they switch with as a"
            " method, Surface(function=...), and read its side; simulate does",
            "system",
        )
    if several_contacts and sums and coordinates is None:
        return
    inner = system.in_gap_coordinates
    names = system.model.coordinates
    if inner is not system and not sums:
        raise ParameterError(
            f"{asking} needs a coordinate for each gap: give it"
            f" system.in_gap_coordinates, which has {', '.join(inner.model.coordinates)}",
            "system",
        )
    if coordinates is not None and (len(names) != coordinates or system.model.first_order):
        wanted = "one coordinate" if coordinates == 1 else f"{coordinates} coordinates"
        what = ", ".join(names) + " of first order" * (len(names) == coordinates)
        raise ParameterError(
            f"{asking} is for models with {wanted}, and this one has {what}", "system"
        )
    if system.model.holds_coordinates and not several_contacts:
        model = system.model
        parts = ", ".join(
            [
                *(c.name for c in model.contacts),
                *(f.name for f in model.frictions),
                *(s.name for s in model.surfaces),
            ]
        )
        raise ParameterError(
            f"{asking} is for models with one contact so far, and {type(system.model).__name__} has"
            f" {parts}; use simulate",
            "system",
        )
