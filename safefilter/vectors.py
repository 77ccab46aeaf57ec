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


@formula
def first_largest(numbers: FloatArray) -> tuple[int, float]:
    """The first of the largest numbers, and that; (-1, -inf) where none is above -inf. NaN is none.

    By four searches, each through every fourth number, because one would wait at every number for the one before.
    """
    count = len(numbers)
    i, j, k, m = -1, -1, -1, -1
    a, b, c, d = -math.inf, -math.inf, -math.inf, -math.inf
    for n in range(0, count - 3, 4):
        if numbers[n] > a:
            i, a = n, numbers[n]
        if numbers[n + 1] > b:
            j, b = n + 1, numbers[n + 1]
        if numbers[n + 2] > c:
            k, c = n + 2, numbers[n + 2]
        if numbers[n + 3] > d:
            m, d = n + 3, numbers[n + 3]
    i, a = earlier_larger(i, a, j, b)
    k, c = earlier_larger(k, c, m, d)
    i, a = earlier_larger(i, a, k, c)
    for n in range(count - count % 4, count):
        if numbers[n] > a:
            i, a = n, numbers[n]
    return i, a


@formula
def earlier_larger(i: int, first: float, j: int, second: float) -> tuple[int, float]:
    """Of two numbers and their places the larger, of equal ones that at the smaller place."""
    if second > first or (second == first and j < i):
        return j, second
    return i, first
