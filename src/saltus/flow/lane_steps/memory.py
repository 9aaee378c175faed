"""The memory of a group of lanes in words: the named tuples and records that the driver and its
callers share.

A `LaneGroup` is all that the driver needs: its `memory` consists of slots of one vector, with a
number for each lane. The first slots are those of `Slots`; the parts of `Parts` follow, each with
as many slots as the structure needs. Compiled code reads and writes all of them by their names (see
`taylor/lane_memory.py`): `lanes.now`, `lanes.position[row]`, `lane.impacts`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from saltus.flow.kernel.layout import SERIES_LENGTH
from saltus.taylor import RECORD_WIDTH, inline_jit, lean_jit

Slot = tuple[str, int]  # an array of the memory, and one of its slots


class Slots(NamedTuple):
    """The slots that every structure has, by their places."""

    now: int = 0  # time within the forcing period
    origin: int = 1  # time at which the forcing period began
    side: int = 2
    new_time: int = 3  # at the end of the step
    new_side: int = 4  # after an impact
    period_end: int = 5  # the time at which the forcing period, or the motion, ends
    # the coordinate at the contact; the gap's rate of change with it on side +1 and on side -1
    # follow
    contact: int = 6
    rate_up: int = 7
    rate_down: int = 8
    # motions whose gap has a lower speed after an impact are proved to be captured
    capture_speed: int = 9
    # the largest coordinate since the forcing period began; the next three slots are of the same
    # time
    highest: int = 10
    lowest: int = 11
    least_speed: int = 12  # before an impact
    impacts: int = 13
    # the same four for the last forcing period that has ended, then the side at its end
    ended_highest: int = 14
    ended_lowest: int = 15
    ended_least_speed: int = 16
    ended_impacts: int = 17
    ended_side: int = 18
    # the same four from the start to the end of the last forcing period that has ended
    overall_highest: int = 19
    overall_lowest: int = 20
    overall_least_speed: int = 21
    overall_impacts: int = 22
    step_limit: int = 23  # the time that no step goes beyond; it may lie beyond `period_end`
    period: int = 24  # number of the forcing period
    # time at which the trajectory began within its first forcing period: all of its periods begin
    # there
    period_start: int = 25
    period_length: int = 26
    periods_done: int = 27
    passed_together: int = 28  # forcing periods below this number are ended for all lanes at once
    # the number of impacts at which it is checked next that they do not accumulate without end
    next_check: int = 29
    last_check: int = 30  # the time at which that was last checked
    new_speed: int = 31  # for a model with several contacts: the speed before an impact
    free_position: int = 32  # where only one coordinate is free: this coordinate
    free_velocity: int = 33
    step_share: int = 34  # the share of the step allowed by the series that the next step takes
    recorded_from: int = 35  # number of the first forcing period in which extrema are recorded
    # natural scales, the largest so far: of the acceleration at an impact, and of its speed
    pull: int = 36
    fastest: int = 37


class Parts(NamedTuple):
    """The parts behind these slots, by the first slot of each."""

    position: int
    velocity: int
    new_position: int  # at the end of the step
    new_velocity: int
    after_position: int  # after an impact at the end of the step
    after_velocity: int
    ended_position: int  # at the end of the last forcing period
    ended_velocity: int
    parameters: int
    free: int  # with several contacts: 1 for each local coordinate that no contact holds, else 0
    contacts: int  # the contacts' positions
    mass: int  # the mass matrix at the new state, by rows
    restitution: int  # E by rows
    impulse_free: int  # at an impact: 1 for each coordinate on which no impulse acts, else 0
    jump: int  # of the velocities at an impact
    matrix: int  # of the equations for the jumps
    rates: int  # of the gaps after an impact
    stays: int  # 1 for each contact that is closed after it
    constant_guards: int  # margins that do not change while one coordinate is free
    constants: int
    records: int
    positions: int  # from here on Taylor series, each of SERIES_LENGTH slots
    velocities: int
    accelerations: int
    margins: int  # with the reactions of several contacts before them


SLOTS = Slots()
SERIES = dict.fromkeys(("positions", "velocities", "accelerations", "margins"), SERIES_LENGTH)


@dataclass(frozen=True)
class MemoryPlan:
    """The sizes of the parts of the memory that a structure needs, in slots."""

    rows: int  # coordinates, those of the sensitivities included
    own: int  # the model's own coordinates
    local: int  # the first of these, on which impacts act
    parameters: int
    contacts: int  # of a model with several
    frictions: int
    constants: int
    data: int  # of the modes of a structure, behind the constants
    records: int
    stops: int
    guards: int | None = None  # where one coordinate is free; None without such equations
    constant_guards: int = 0

    @cached_property
    def places(self) -> Parts:
        """The first slot of each part."""
        several = self.local if self.contacts or self.frictions else 0
        contacts = self.contacts
        # slidings, and an instant, of which lanes know without it
        behind = self.frictions + (2 if several else 0)
        sizes = [self.rows] * 8 + [
            self.parameters + behind,
            several,
            contacts,
            several**2,
            contacts**2,
        ]
        sizes += [several, several, several**2, contacts, contacts]
        sizes += [self.constant_guards, self.constants + self.data, self.records * RECORD_WIDTH]
        sizes += [rows * SERIES_LENGTH for rows in (self.rows, self.rows, self.own, self.stops)]
        return Parts(*(len(SLOTS) + sum(sizes[:part]) for part in range(len(sizes))))

    def slot(self, part: str, number: int = 0) -> Slot:
        """A slot of a part, for the functions of a structure: the number of modes moves the parts,
        and is no part of the code.
        """
        return (part, number) if self.data else ("m", getattr(self.places, part) + number)

    @property
    def end(self) -> int:
        """How many slots there are."""
        return self.places.margins + self.stops * SERIES_LENGTH


class LaneSizes(NamedTuple):
    """Numbers of a structure and of a call."""

    own: int  # the model's own coordinates
    local: int  # the first of these, on which impacts act
    first_order: int  # how many of these, the last ones, are of first order
    jumps: int  # whether those jump at impacts
    dependent: int  # how many of these are sums of the others, on which contacts act
    rows: int  # those of the tangent's columns included
    columns: int  # of the tangent
    margins: int
    sides: int
    checked: int  # whether steps are checked, as in the scalar kernel
    records: int
    order: int  # of the lanes' series
    scalar_order: int
    workspace: int  # rows, of the scalar kernel
    kept: int  # for how many of the last forcing periods samples are kept
    extrema: int  # whether extrema are recorded
    from_start: int  # whether from the start, not only in the forcing periods that are kept
    settle: int  # whether a trajectory ends when it repeats itself
    ends_asked: int  # whether the ends of forcing periods are asked for at all
    # whether every end of a forcing period needs work, as for samples or recurrences
    every_end: int
    # whether there is a series for lanes in which one coordinate is free (see `one_free.py`)
    one_free: int
    guards: int  # of that series
    constant_guards: int
    contacts: int  # the number of contacts of a model with several
    frictions: int
    repeats: int  # whether the load's breakpoints return in each forcing period
    contact_numbers: int  # that events of several contacts need
    coordinates: np.ndarray  # of each contact, of each friction, and -1 less that of each surface
    signs: np.ndarray  # of each contact


class LaneSettings(NamedTuple):
    """Tolerances of a call, and what follows from them."""

    tolerance: float
    natural_time: float  # of what moves without a forcing period, inf where the load has one
    shortest_step: float
    # after an impact with a lower speed of the gap, in natural speeds, the end of an accumulation
    # may be near
    slowest_impact: float
    limits: tuple[Any, ...]  # `step_limits` of the coordinates
    column_limits: tuple[Any, ...]  # of the tangent's columns
    natural_length: float  # in which states that recur are compared


ROW = np.dtype(
    [
        ("trajectory", "i8"),  # its row in the jobs
        ("last_period", "i8"),
        ("piece", "i8"),
        ("mode", "i8"),
        ("held", "i8"),
        ("skip", "i8"),
        ("leave_by", "i8"),
        ("grazings", "i8"),
        ("end_time", "f8"),  # of the motion, within its last forcing period
        ("chatter_speed", "f8"),
    ]
)  # of each lane, besides its slots
FLAGS = np.dtype(
    [
        ("busy", "i8"),  # it holds a trajectory
        ("at_contact", "i8"),  # its arc starts at the contact
        ("scalar", "i8"),  # it is not on an arc, so the scalar kernel moves it
    ]
)  # bits, one for each lane
JOB = np.dtype(
    [
        ("start_time", "f8"),  # within the first forcing period
        ("period_length", "f8"),
        ("end_time", "f8"),  # within the last forcing period
        ("capture_speed", "f8"),
        ("first_period", "i8"),
        ("last_period", "i8"),
        ("leave_by", "i8"),
        ("piece", "i8"),
    ]
)  # of each trajectory, besides its first state and its parameters
END = np.dtype(
    [
        ("status", "i8"),
        ("detail", "i8"),  # the period of a recurrence, or the margin that was reached
        ("mode", "i8"),
        ("side", "i8"),
        ("period", "i8"),
        ("impacts", "i8"),
        ("grazings", "i8"),
        ("periods_done", "i8"),
        ("time", "f8"),
        ("chatter_speed", "f8"),
        ("highest", "f8"),
        ("lowest", "f8"),
        ("least_speed", "f8"),
    ]
)  # of each trajectory, besides its last state


class Code(NamedTuple):
    """The functions of a structure, by their addresses."""

    series: Any
    impact: Any
    field: Any
    constants: Any
    geometry: Any  # or `matrices`
    # of a model with several contacts: the series where one coordinate is free; else None
    one_free: Any


class Helpers(NamedTuple):
    """The functions that work on one lane at a time, or on its motion, by their addresses."""

    first_root: Any
    turning_range: Any
    scalar_motion: Any
    impact: Any  # of a model with several contacts; else None
    advance: Any  # the scalar kernel


class Work(NamedTuple):
    """Jobs, an array with a row for each trajectory, and what is made of them."""

    states: np.ndarray  # first states (n, 2 coordinates): coordinates, then velocities
    jobs: np.ndarray  # (n,), see `JOB`
    parameters: np.ndarray
    # record breakpoints and pieces, a row for each trajectory, or one
    tables: tuple[np.ndarray, np.ndarray]
    last: np.ndarray  # last states
    ends: np.ndarray  # (n,), see `END`
    # accelerations at the end, then the shifts of the last event along each column
    rates: np.ndarray
    samples: np.ndarray
    control: np.ndarray  # see `Control`


class Control(IntEnum):
    """The numbers with which a call of the driver is bounded: it returns when as many forcing
    periods, or calls of the scalar kernel, are done.
    """

    MOST_PERIODS = 0  # 0: return now
    PERIODS = 1  # done so far
    MOST_CALLS = 2
    CALLS = 3


UNBOUNDED = [1 << 62, 0, 1 << 62, 0]  # of a call that is ended by its last trajectory


class LaneGroup(NamedTuple):
    """A group of lanes."""

    memory: np.ndarray
    places: np.ndarray  # the `Parts`
    sizes: LaneSizes
    settings: LaneSettings
    code: Code
    helpers: Helpers
    kernel: tuple[Any]  # the functions of the structure that the scalar kernel calls
    flags: np.ndarray
    rows: np.ndarray
    constants_of: np.ndarray  # a row for each lane, as in the following
    geometry: np.ndarray  # of its contact; with several contacts the numbers that `matrices` gives
    stroboscopic: np.ndarray  # the last states, of which the oldest is overwritten
    # for each q, how many states in a row agreed with those q forcing periods before
    agreements: np.ndarray
    contact_rows: np.ndarray  # the scalar kernel's rows of contacts and frictions
    polynomial: np.ndarray  # room for two polynomials of one lane
    gap: np.ndarray
    impact_space: Any  # with several contacts, room for an impact: the scalar kernel's memory
    work: Work


class Gap(NamedTuple):
    """The gap of a contact in a step: `sign` times a coordinate, measured from the contact."""

    row: Any  # of the coordinate
    start: Any  # the coordinate, measured from the contact, at the start of the step
    sign: Any
    skip: Any  # bits of the lanes whose step starts at the contact


class Step(NamedTuple):
    """A step of all lanes."""

    h: Any  # its length
    taken: Any  # the part of it that is taken, up to an impact
    bend: Any  # the bound of `sweep` for the first coordinate, or for the one that is free
    # with several contacts, the number of the one that closes, or whose coordinate is free
    contact: Any


class Stretch(NamedTuple):
    """The motion of a coordinate from `begin` to `end` in a step, for the record of its extrema."""

    begin: Any
    end: Any
    v_begin: Any  # velocity
    x: Any  # position and velocity at the end
    v: Any
    h: Any  # the length of the whole step
    bend: Any  # the bound of `sweep` for it


class Closing(NamedTuple):
    """The impacts of a step in a model with several contacts."""

    hit: Any  # bits of the lanes
    contact: Any  # the number of the contact that closes
    speed: Any
    together: Any  # whether impulses act at all closed contacts too, or at this one alone


# --- compiled from here on ---------------------------------------------------


@inline_jit
def is_over(control):
    """Whether a call of the driver has done what it may."""
    return (
        control[Control.PERIODS] >= control[Control.MOST_PERIODS]
        or control[Control.CALLS] >= control[Control.MOST_CALLS]
    )


# in a natural time: more are an accumulation that is not resolved
MOST_IMPACTS = 1e6
# impacts between two checks of their rate with several contacts, where each takes a pass of the
# scalar kernel
BURST = 2e4
# at this share of the usual step, the scalar search for roots decides what a shorter step could not
SMALLEST_SHARE = 0.25
# instead of the time of a lane's root
NO_ROOT = -1.0
TOUCH = -2.0
FAST = 1e300  # A state beyond this has left the range of numbers.
# the longest period for which a recurrence is looked for, in forcing periods
LONGEST_RECURRENCE = 16


@lean_jit
def natural_time_of(lane):
    """The natural time of a lane's load, or of its system (`kernel_state.natural_time`)."""
    length = lane.period_length
    longest = lane.settings.natural_time
    return min(length / (2.0 * math.pi), longest) if length > 0.0 else longest
