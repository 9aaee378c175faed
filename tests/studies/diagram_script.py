"""Small diagrams with a store, of one contact and of two, as a script of its own that is killed
when it writes a chunk.
"""

import math
import os
import signal
import sys

import numpy as np
from shared_systems import forced

from saltus import NewtonImpact, TwoStops, bifurcation_diagram, response_spectrum
from saltus.sweep.memo import Memo
from saltus.systems import Harmonic, Load, System

FREQUENCY, BOUNDS = "load.frequency", (1.3, 1.6)  # two motions, their cascades and chaos


def diagram(**options):
    """The diagram; of few values, starts and samples, but with all that a search does."""
    values = options.pop("values", np.linspace(*BOUNDS, 3))
    return response_spectrum(
        forced(2.0),
        FREQUENCY,
        BOUNDS,
        **{"effort": "quick", "max_period": 2, "values": values, "starts": 4} | options,
    )


def contact_diagram(**options):
    """Of a mass between two stops."""
    load = Load(frequency=1.0, force=Harmonic(amplitude=0.8, phase=math.pi / 2))
    stops = System(model=TwoStops(stiffness=0.0), load=load, impact=NewtonImpact(e=0.7))
    few = {
        "effort": "quick",
        "max_period": 1,
        "values": [0.62],
        "starts": 4,
        "repelling": 0,
        "switch": False,
    }
    return bifurcation_diagram(stops, "load.force.amplitude", (0.6, 0.65), **few | options)


DIAGRAMS = {"one": diagram, "several": contact_diagram}  # by how many contacts there are


def killed_at(count):
    """Kill this process when it writes so many chunks of its memo: before some, after others, as
    the number is even or odd.
    """
    write, written = Memo._write, []

    def struck(self, name, *found):
        written.append(name)
        if len(written) == count and count % 2 == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        write(self, name, *found)
        if len(written) == count:
            os.kill(os.getpid(), signal.SIGKILL)

    Memo._write = struck


if __name__ == "__main__":
    killed_at(int(sys.argv[2]))
    DIAGRAMS[sys.argv[3]](store=sys.argv[1])
