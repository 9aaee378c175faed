"""
A design grid, stopped and continued
====================================

Which dashpot and which stops harvest most: a quantity of one's own over three parameters. The run
is stopped half way, as a key or a power cut would do it, and the same call goes on. With the widest
damping nothing is hit: P = c (W X)^2 / 2.
"""

import tempfile

import numpy as np

import saltus

harvester = saltus.System(
    model=saltus.TwoStops(), load=saltus.Load(frequency=1.0, ground=saltus.Harmonic(amplitude=0.3))
)


def harvested(frequency, damping, restitution):
    system = harvester.with_(
        {
            "load.frequency": frequency,
            "model.damping": damping,
            "impact": saltus.NewtonImpact(restitution),
        }
    )
    return {
        "power": saltus.energies(saltus.simulate(system, x=0.0, periods=60)).power.sel(
            part="damping"
        )
    }


grid = {
    "frequency": np.linspace(0.5, 2.0, 16),
    "damping": 0.05 * 2.0 ** np.arange(5),
    "restitution": np.linspace(0, 1, 5),
}


def key(fraction, what):
    """The key is pressed."""
    if fraction > 0.6:
        raise KeyboardInterrupt


done = []  # shares of the grid that the second run tells of
# workers=2 computes in two processes
settings = {"store": tempfile.mkdtemp() + "/grid.zarr", "chunk": {"frequency": 16}}
try:
    saltus.map_over(harvested, grid, progress=key, **settings)
except KeyboardInterrupt:
    print("stopped half way")
found = saltus.map_over(
    harvested, grid, progress=lambda fraction, what: done.append(fraction), **settings
)
found.power.mean("frequency").plot.line("o-", x="damping")
W = found.frequency.values
linear = 0.4 * (W * 0.3 * W**2 / np.abs(1 - W**2 + 0.8j * W)) ** 2
error = np.abs(found.power.sel(damping=0.8).isel(restitution=3).values / linear - 1).max()
print(
    f"gone on with {1 - min(done):.0%} of the points; without impacts the power is that of the "
    f"formula to {error:.0e}"
)
assert min(done) > 0.5
assert error < 1e-8
