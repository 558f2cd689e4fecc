"""Comparisons that do not hang on the last bits of a solver, and the array types of the learner."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

# Values closer than this, relative to the largest magnitude compared (at least 1), are equal.
TOLERANCE = 1e-6


def is_best(values: Floats) -> Bools:
    """Which entries equal the maximum along the last axis, within `TOLERANCE`.

    Args:
        values: (..., k).
    """
    scale = np.maximum(np.abs(values).max(axis=-1, keepdims=True), 1.0)
    best: Bools = values >= values.max(axis=-1, keepdims=True) - TOLERANCE * scale
    return best


def first_best(values: Floats) -> Ints:
    """Index of the maximum along the last axis; ties go to the lowest index.

    Args:
        values: (..., k).
    """
    index: Ints = is_best(values).argmax(axis=-1)
    return index


def entropy(distributions: Floats) -> Floats:
    """Entropy of each distribution along the last axis [nat]; 0 log 0 is 0.

    Args:
        distributions: (..., k), each row sums to 1.
    """
    logs = np.log(distributions, where=distributions > 0, out=np.zeros_like(distributions))
    nats: Floats = -(distributions * logs).sum(axis=-1)
    return nats
