"""Vectors in kernels, in any number of dimensions: arrays of shape (d,), and columns of rows."""

from __future__ import annotations

import math

from safefilter.arrays import FloatArray
from safefilter.jit import formula


@formula
def dot(left: FloatArray, right: FloatArray) -> float:
    """Inner product."""
    total = 0.0
    for c in range(len(left)):
        total += left[c] * right[c]
    return total


@formula
def length(vector: FloatArray) -> float:
    """Euclidean length."""
    return math.sqrt(dot(vector, vector))


@formula
def along(rows: FloatArray, k: int, point: FloatArray) -> float:
    """Inner product of a point with the normal of row k; ``rows`` has shape (d + 1, capacity), offsets last."""
    total = 0.0
    for c in range(len(point)):
        total += rows[c, k] * point[c]
    return total


@formula
def is_finite(vector: FloatArray) -> bool:
    """Is every component finite?"""
    finite = True
    for c in range(len(vector)):
        finite = finite and math.isfinite(vector[c])
    return finite
