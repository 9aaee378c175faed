"""The types that a file may name: models, impact laws and pulses. A new one is one new file and one line here."""

from __future__ import annotations

from typing import Any, TypeVar

from saltus.errors import ParameterError, near, shown
from saltus.systems.cell_chain import FourCells, ThreeCells, TwoCells
from saltus.systems.impact_laws import EnergyRestitution, ImpactLaw, InelasticImpact, NewtonImpact, VelocityReduction
from saltus.systems.metainterface import Metainterface
from saltus.systems.model import Model, OneContactModel, check_one_contact
from saltus.systems.oscillators import BeltOscillator, ImpactPair, TwoStops, WallOscillator
from saltus.systems.pulses import Chirp, HalfSine, MavroeidisPapageorgiou, OneCosine, OneSine, Pulse, Ramp, Ricker
from saltus.systems.rocking_block import RockingBlock
from saltus.systems.two_layer import TwoLayer

MODELS: dict[str, type[Model]] = {
    "Metainterface": Metainterface,
    "RockingBlock": RockingBlock,
    "TwoLayer": TwoLayer,
    "WallOscillator": WallOscillator,
    "TwoStops": TwoStops,
    "ImpactPair": ImpactPair,
    "BeltOscillator": BeltOscillator,
    "TwoCells": TwoCells,
    "ThreeCells": ThreeCells,
    "FourCells": FourCells,
}
IMPACTS: dict[str, type[ImpactLaw]] = {
    "VelocityReduction": VelocityReduction,
    "EnergyRestitution": EnergyRestitution,
    "InelasticImpact": InelasticImpact,
    "NewtonImpact": NewtonImpact,
}
PULSES: dict[str, type[Pulse]] = {
    pulse.__name__: pulse for pulse in (HalfSine, OneSine, OneCosine, MavroeidisPapageorgiou, Ricker, Ramp, Chirp)
}

T = TypeVar("T", type[Model], type[ImpactLaw])


def register(cls: T) -> T:
    """Make a model or an impact law of your own known by its class name, so that files can name it; use as a decorator.

    Raises
    ------
    ParameterError
        A class that is neither; a model whose sides and reset do not go together.

    Examples
    --------
    >>> saltus.register(saltus.WallOscillator) is saltus.WallOscillator
    True
    """
    if not isinstance(cls, type):
        raise ParameterError(f"register takes a Model or an ImpactLaw, got {shown(cls)}", "cls")
    if issubclass(cls, Model):
        if issubclass(cls, OneContactModel):
            check_one_contact(cls)
        MODELS[cls.__name__] = cls
    elif issubclass(cls, ImpactLaw):
        IMPACTS[cls.__name__] = cls
    else:
        raise ParameterError(f"register takes a Model or an ImpactLaw, got {shown(cls)}", "cls")
    return cls


def find(kind: str, name: str) -> type[Model] | type[ImpactLaw]:
    """The class called `name`, of the `kind` "model" or "impact"."""
    known: dict[str, Any] = MODELS if kind == "model" else IMPACTS
    if name not in known:
        hint = f"{near(name, known)} (one of your own is made known by saltus.register)"
        raise ParameterError(f"{kind}.type {shown(name)} is not known; {hint}", f"{kind}.type")
    found: type[Model] | type[ImpactLaw] = known[name]
    return found
