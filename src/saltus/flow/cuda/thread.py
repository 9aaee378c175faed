"""The entry of one motion: the driver of the lanes, for a group of one lane that holds the motion
from one launch to the next.
"""

from __future__ import annotations

from saltus.flow.lane_steps.function_types import RUN_LANES, shared
from saltus.flow.programs.lane_driver import run_all
from saltus.taylor import cached_jit

# --- compiled from here on ---------------------------------------------------


@cached_jit(RUN_LANES)
def run_thread(group):
    """Go on with the motion that the lane holds, or begin the only job."""
    lanes = shared(group)
    run_all(lanes, 1 if lanes.busy != 0 else 0)
