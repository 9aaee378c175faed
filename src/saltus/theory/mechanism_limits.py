"""The amplitudes beyond which a motion is no longer one of the real mechanism."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from saltus.systems import Metainterface, System


@dataclass(frozen=True)
class AmplitudeLimit:
    """An amplitude beyond which a motion is not one of the real mechanism.

    Attributes
    ----------
    name
        The name of the margin.
    value
        The limit, rad; an array if it varies with a parameter that is given as an array.
    meaning
        The meaning of the limit, in words.

    Examples
    --------
    >>> saltus.theory.amplitude_limits(system)[0].name
    'line'
    """

    name: str
    value: Any
    meaning: str


def amplitude_limits(system: System, parameters: Mapping[str, Any] | None = None) -> tuple[AmplitudeLimit, ...]:
    """The limits of the metainterface (erratum 20), pi - beta0 and 2 (pi - beta0); none are known for other models.

    Parameters
    ----------
    system
        What moves.
    parameters
        Values, by dotted path, that replace those of the system; numbers or arrays.

    Examples
    --------
    >>> [round(float(limit.value), 9) for limit in saltus.theory.amplitude_limits(system)]  # 100 and 200 degrees
    [1.745329252, 3.490658504]
    """
    if not isinstance(system.model, Metainterface):
        return ()
    straight = math.pi - (parameters or {}).get("model.beta0", system.model.beta0)
    return (
        AmplitudeLimit("line", straight, "the straight line, pi - beta0"),
        AmplitudeLimit("kinematic", 2 * straight, "2 (pi - beta0), where the slider closes again"),
    )
