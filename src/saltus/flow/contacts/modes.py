"""The modes of models with contacts or frictions, which are encoded in the number `side` of a motion."""

from __future__ import annotations

import numpy as np

from saltus.systems import Model


def modes_of(model: Model, side: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Closed contacts as bits, and the direction in which each friction slides, from the numbers `side` of motions."""
    count, number = len(model.contacts), np.asarray(side).astype(np.int64) - 1
    slides = [(number >> (count + 2 * k) & 3) - 1 for k in range(len(model.frictions))]
    return number & ((1 << count) - 1), slides
