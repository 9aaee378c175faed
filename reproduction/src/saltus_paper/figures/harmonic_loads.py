"""The systems of Figs.

9 to 15: the paper's metainterface at V = -0.5 under its harmonic loads (i) to (iii).
"""

from __future__ import annotations

import math

from saltus import Harmonic, Load, Metainterface, System

# degrees, C, Vbar
BETA0 = 80.0
DAMPING = 0.1
VERTICAL = -0.5
SWING = 0.25  # Vhat of load (iii)
FREQUENCY = "load.frequency"
AMPLITUDE = "load.horizontal.amplitude"
GROUND_AMPLITUDE = "load.ground_horizontal.amplitude"


def under_force(
    frequency: float = 1.0,
    amplitude: float = 1.0,
    *,
    beta0: float = BETA0,
    damping: float = DAMPING,
) -> System:
    """Load (i), `loadpatha`: a horizontal force; `beta0` in degrees."""
    load = Load(frequency=frequency, horizontal=Harmonic(amplitude=amplitude), vertical=VERTICAL)
    return System(model=Metainterface(beta0=math.radians(beta0), damping=damping), load=load)


def on_ground(frequency: float = 1.0, amplitude: float = 1.0) -> System:
    """Load (ii), `loadpathaa`: a horizontal motion of the ground."""
    load = Load(
        frequency=frequency, ground_horizontal=Harmonic(amplitude=amplitude), vertical=VERTICAL
    )
    return System(model=Metainterface(beta0=math.radians(BETA0), damping=DAMPING), load=load)


def under_both(frequency: float = 1.0, amplitude: float = 1.0, swing: float = SWING) -> System:
    """Load (iii), `loadpathb`: horizontal and vertical forces; `swing` is Vhat."""
    vertical = Harmonic(mean=VERTICAL, amplitude=swing, phase=math.pi / 2)
    load = Load(frequency=frequency, horizontal=Harmonic(amplitude=amplitude), vertical=vertical)
    return System(model=Metainterface(beta0=math.radians(BETA0), damping=DAMPING), load=load)
