"""Motions in plain Python, from one event to the next."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import wraps
from types import FunctionType
from typing import Any

import numpy as np

from saltus.checks import Speeds
from saltus.errors import ParameterError, near
from saltus.flow.kernel.layout import Mode, Status
from saltus.flow.motion.kernel_state import ContactState, KernelState, Recorder
from saltus.flow.motion.motion import Motion, in_own_coordinates
from saltus.flow.motion.simulate import GOES_ON, MotionRequest, collected, refuse
from saltus.flow.programs.compiled import known_program, taylor_order
from saltus.flow.programs.plain import PlainKernel, Words
from saltus.systems import System

# The numbers of a motion that are printed at a pause, in this order.
SHOWN = ("period", "time", "piece", "order", "press", "pull", "fastest", "swiftest", "ties")


@dataclass(frozen=True)
class Pause:
    """A motion just after an event, or at its end.

    Attributes
    ----------
    motion
        The motion up to here.
    event
        What has just happened; None at the end of a motion that ends without an event.
    memory
        What the kernel knows, in words: `memory.press`, `memory.contacts`, `memory.gap_series`. It
        goes on with the motion.
    passes
        How many passes of the kernel's loop led here from the pause before.
    """

    motion: Motion
    event: Any
    memory: Words
    passes: int

    def __str__(self) -> str:
        what = "the end" if self.event is None else _in_words(self.event)
        model = self.motion.system.model
        pairs = zip(
            model.coordinates,
            np.atleast_1d(self.motion.position),
            np.atleast_1d(self.motion.velocity),
            strict=True,
        )
        lines = [
            f"time {self.motion.time:.12g}: {what}, after {self.passes} passes",
            *(f"  {name} = {place:.12g}, {name}' = {speed:.12g}" for name, place, speed in pairs),
            f"  {_modes(self.motion, self.memory)}",
            "  " + ", ".join(f"{name} = {getattr(self.memory, name):.6g}" for name in SHOWN),
        ]
        return "\n".join(lines)


def _in_words(event: Any) -> str:
    """An event with the name of its contact, friction or surface, where there are several."""
    contact = getattr(event, "contact", "")
    return f"{event.kind} of {contact}" if contact else str(event.kind)


def _modes(motion: Motion, memory: Words) -> str:
    """What is closed, sticks and slides, and on which sides of its surfaces a motion is."""
    model = motion.system.model
    if not model.holds_coordinates:
        return f"mode {Mode(memory.mode).name}, side {memory.side}"
    closed = motion.closed_at(motion.time)
    names = [contact.name for i, contact in enumerate(model.contacts) if closed >> i & 1]
    ways = {0: "sticks", 2: "rubs nothing"}
    return "; ".join(
        [
            f"closed: {', '.join(names) or 'nothing'}",
            *(f"{name} {ways.get(s, f'slides to {s:+d}')}" for name, s in motion.sliding.items()),
            *(f"on the side {side:+d} of {name}" for name, side in motion.sides.items()),
        ]
    )


def step_through(
    system: System,
    *,
    velocity: Speeds = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    side: int | None = None,
    relays: Mapping[str, bool] | None = None,
    stop_at: Iterable[str] = (),
    break_in: str | None = None,
    when: Callable[[Any], bool] = bool,
    **coordinates: float,
) -> Iterator[Pause]:
    """A motion in plain Python, from one event to the next: as `simulate`, and some thousand times
    slower.

    The kernel is executed from its own sources, so that a debugger stops at any line of
    `flow/kernel/`, `flow/one_contact/` and `flow/contacts/` below their markers.

    Parameters
    ----------
    system, velocity, periods, duration, tol, time, side, relays, stop_at, coordinates
        As for `simulate`.
    break_in
        The name of a function of the kernel, such as "choose_closed": Python's `breakpoint` is
        called whenever it is entered.
    when
        A function of the kernel's memory that says whether to stop there; by default always.

    Yields
    ------
    Pause
        After each event, and at the end.

    Raises
    ------
    ParameterError
        An argument has no meaning, or the kernel has no function of this name.
    MotionError
        As for `simulate`.

    Examples
    --------
    >>> for pause in saltus.debug.step_through(system, theta=0.3, periods=0.1):
    ...     print(pause.event, pause.memory.order)
    None 16
    """
    request = MotionRequest(
        system=system,
        coordinates=coordinates,
        velocity=velocity,
        periods=periods,
        duration=duration,
        tol=tol,
        time=time,
        side=side,
        relays=relays,
        stop_at=stop_at,
        dense=True,
    )
    run = known_program(request.system, request.limits, None)
    kernel = PlainKernel(run.structure.several)
    if break_in is not None:
        _break(kernel, break_in, when)
    now = (ContactState if run.structure.several else KernelState)(request, run)
    return _paused(request, run, kernel, now)


def _break(kernel: PlainKernel, name: str, when: Callable[[Any], bool]) -> None:
    """Stop in a debugger where the kernel enters a function."""
    functions = [
        known for known, value in kernel.functions.items() if isinstance(value, FunctionType)
    ]
    if name not in functions:
        raise ParameterError(
            f"the kernel has no function {name!r}; {near(name, functions)}", "break_in"
        )
    function = kernel.functions[name]

    @wraps(function)
    def stopped(*given: Any) -> Any:
        if kernel.motion is None or when is bool or when(kernel.motion):
            sys.breakpointhook()
        return function(*given)

    kernel.functions[name] = stopped


def _paused(
    request: MotionRequest, run: Any, kernel: PlainKernel, now: KernelState
) -> Iterator[Pause]:
    """The pauses of a motion."""
    recorder = Recorder(request, run, taylor_order(request.tol))
    passes = 0
    while True:
        buffers = recorder.steps, recorder.events
        status = kernel.advance(now.array, now.state, run.env, run.model, now.rows, buffers)
        passes += 1
        numbers = now.numbers
        events = numbers.recorded_events
        recorder.take(numbers)
        ended = status not in GOES_ON
        if ended and status != Status.DONE:
            refuse(request.system, status, now)
        if events or ended:
            motion = in_own_coordinates(
                request.given, collected(request, now, status, numbers, recorder)
            )
            assert kernel.motion is not None
            event = motion.events[-1] if events else None
            yield Pause(motion, event, kernel.motion, passes)
            passes = 0
        if ended:
            return
        now.with_empty_buffers()
        recorder.make_buffers()
