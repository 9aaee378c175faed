"""A small diagram with a store, as a script of its own that is killed when it writes a chunk."""

import os
import signal
import sys

import numpy as np
from shared_systems import forced

from saltus.studies import response_spectrum
from saltus.sweep.store import Store

FREQUENCY, BOUNDS = "load.frequency", (1.3, 1.6)  # two motions, their cascades and chaos


def diagram(**options):
    """The diagram; of few values, starts and samples, but with all that a search does."""
    values = options.pop("values", np.linspace(*BOUNDS, 3))
    return response_spectrum(
        forced(2.0), FREQUENCY, BOUNDS, **{"effort": "quick", "max_period": 2, "values": values, "starts": 4} | options
    )


def killed_at(count):
    """Kill this process when it writes so many chunks of stores: before some, after the others, as the number is even or odd."""
    write, written = Store.write, []

    def struck(self, index, values):
        written.append(index)
        if len(written) == count and count % 2 == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        write(self, index, values)
        if len(written) == count:
            os.kill(os.getpid(), signal.SIGKILL)

    Store.write = struck


if __name__ == "__main__":
    killed_at(int(sys.argv[2]))
    diagram(store=sys.argv[1])
