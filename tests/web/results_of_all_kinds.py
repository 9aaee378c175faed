"""One small result of each kind that a page shows, of one system."""

from functools import cache

import numpy as np

import saltus

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=0.9, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
)  # beyond its resonance, where three orbits are beside one another
RESTING = saltus.System(
    model=SYSTEM.model, load=saltus.Load(vertical=-1.5 / np.sin(np.deg2rad(80)))
)
FREQUENCY, AMPLITUDE = "load.frequency", "load.horizontal.amplitude"


@cache
def branch():
    """The branch of the resonance, with both folds."""
    return saltus.continue_orbit(saltus.find_orbit(SYSTEM, theta=0.3), FREQUENCY, (0.83, 0.92))


@cache
def spectrum():
    """A response spectrum beside the fold."""
    return saltus.response_spectrum(SYSTEM, FREQUENCY, (0.88, 0.92), effort="quick", starts=4)


@cache
def diagram():
    """A diagram over the amplitude of the load."""
    return saltus.bifurcation_diagram(SYSTEM, AMPLITUDE, (0.48, 0.52), effort="quick", starts=4)


@cache
def chart():
    """A chart, with a cell in which nothing moves for long."""
    return saltus.stability_chart(SYSTEM, horizontal=[0.02, 0.3, 0.5], vertical=[-1.0, -0.5])


@cache
def basins():
    """Basins of few cells, with the curve between them."""
    theta, velocity = np.linspace(-2.5, 2.5, 6), np.linspace(-2.0, 2.0, 5)
    return saltus.basins_of_attraction(SYSTEM, theta=theta, velocity=velocity, curves=True)


@cache
def manifold():
    """The stable manifold of the unstable orbit of the resonance."""
    saddle = next(orbit for orbit in branch().at(0.9) if not orbit.stable)
    return saltus.stable_manifold(saddle, periods=3)


@cache
def separatrices():
    """The separatrices under a constant load."""
    return saltus.separatrices(RESTING, window=((-2.0, 2.0), (-2.0, 2.0)), step=0.5)
