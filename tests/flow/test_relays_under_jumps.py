"""Machines with relays and resets under loads that jump, beside SciPy's DOP853 from one event, or one
jump, to the next. `campaign(range(300))` is the whole of it.
"""

import math

import numpy as np
import pytest
from test_relays_and_resets import Reference, compared

from saltus import MotionError, Square, Table


class Jumping(Reference):
    """The same under a load that is a line between instants of each forcing period."""

    def __init__(self, model, frequency, restitution):
        super().__init__(model, frequency, restitution)
        draw = np.random.default_rng(int(1e9 * frequency)).uniform
        self.period = 2.0 * math.pi / frequency
        self.square = draw() < 0.5
        if self.square:
            size, mean, duty = draw(0.5, 1.2), draw(-0.3, 0.3), draw(0.2, 0.8)
            self.signal = Square(amplitude=size, mean=mean, duty=duty)
            self.shares = np.array([0.0, duty, duty, 1.0])
            self.values = mean + size * np.array([1.0, 1.0, -1.0, -1.0])
        else:  # two jumps within the period, and one at its end
            inner = np.sort(draw(0.05, 0.95, 3))
            self.shares = np.array([0.0, inner[0], inner[0], inner[1], inner[2], inner[2], 1.0])
            self.values = draw(-1.2, 1.2, 7)
            self.signal = Table(self.shares, self.values)

    def next_corner(self, t):
        at = self.period * (self.round + self.shares[self.piece + 1])
        return at if at > t else math.inf

    def enter(self, t):
        """The piece that begins at t."""
        if t == 0.0:
            self.round, self.piece = 0, -1
        self.piece += 1
        while self.piece + 1 < len(self.shares) and (
            self.shares[self.piece] == self.shares[self.piece + 1]
        ):
            self.piece += 1
        if self.piece + 1 == len(self.shares):
            self.round, self.piece = self.round + 1, 0

    def drive(self, t):
        first, last = self.shares[self.piece : self.piece + 2]
        begin, end = self.values[self.piece : self.piece + 2]
        return begin + (end - begin) * ((t / self.period - self.round) - first) / (last - first)


def campaign(seeds):
    """The machines whose events differ, those that are refused, the number of events, and the
    largest differences of instants and of states."""
    differ, refused, count, late, apart = [], [], 0, 0.0, 0.0
    for seed in seeds:
        try:
            named, expected, between, off = compared(seed, Jumping, lambda known: known.signal)
        except MotionError as error:
            refused.append((seed, str(error)))
            continue
        count += len(named)
        if named != expected:
            differ.append((seed, named, expected))
            continue
        late, apart = max(late, between), max(apart, off)
        if max(between, off) > 1e-9:
            differ.append((seed, between, off))
    return differ, refused, count, late, apart


@pytest.mark.parametrize("first", [0, 4])
def test_random_machines_under_loads_that_jump_beside_dop853(first):
    differ, refused, count, late, apart = campaign(range(first, first + 4))
    assert not differ
    assert not refused
    assert count > 40
    assert max(late, apart) < 1e-9
