"""The judge of arcs and walls: where robots are at every instant of a step, and whether any of it is too near.

Sampling alone could miss a contact between two instants. Between two samples a free distance can fall below both by no
more than ``bend * width^2 / 8``, with ``bend`` a bound on its second derivative; intervals are halved until that is
ruled out, so nothing is missed that is deeper than `CONTACT_TOLERANCE`. No formula is shared with the filter.

Letters: N robots, P pairs, S walls, K instants. m, rad; s is a fraction of the step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.closest_approach import CONTACT_TOLERANCE, Approach, Pairs

# From (which pair, fraction of the step), shape (K,) each, to free distances, shape (K,).
Gap = Callable[[IntArray, FloatArray], FloatArray]

FIRST_INTERVALS = 8
# 1/8 of a step, halved so often, is far below what the bend of any robot's path needs for `CONTACT_TOLERANCE`.
MAX_HALVINGS = 30


class Paths(NamedTuple):
    """Movements during a step at constant speed: along circles, or straight.

    Attributes:
        start: Centres at the start, shape (N, 2).
        displacement: From the start to the end of the step, shape (N, 2).
        turn: Angle turned on the way, shape (N,), in rad; 0 is straight.
    """

    start: FloatArray
    displacement: FloatArray
    turn: FloatArray

    @property
    def length(self) -> FloatArray:
        """Length of each path, shape (N,): of the arc, not of its chord."""
        chord = np.hypot(self.displacement[:, 0], self.displacement[:, 1])
        return np.asarray(chord / np.abs(_sinc(0.5 * self.turn)))

    def at(self, robot: IntArray, fraction: FloatArray) -> FloatArray:
        """Centres of robots after fractions of the step, shape (K, 2)."""
        half = 0.5 * self.turn[robot]
        part = fraction * _sinc(fraction * half) / _sinc(half)
        angle = (fraction - 1.0) * half
        cosine, sine = part * np.cos(angle), part * np.sin(angle)
        x, y = self.displacement[robot].T
        moved = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
        return np.asarray(self.start[robot] + moved)


def robots_on_paths(paths: Paths, radius: FloatArray, pairs: Pairs) -> Approach:
    """Judge robots that drive along arcs; see `nearest_on_paths` for what ``least`` is then."""
    first, second = pairs
    contact = radius[first] + radius[second]

    def gap(which: IntArray, fraction: FloatArray) -> FloatArray:
        apart = paths.at(second[which], fraction) - paths.at(first[which], fraction)
        return np.asarray(np.hypot(apart[:, 0], apart[:, 1]) - contact[which])

    length, turn = paths.length, np.abs(paths.turn)
    speed = length[first] + length[second]
    bend = speed**2 / contact + length[first] * turn[first] + length[second] * turn[second]
    return nearest_on_paths(gap, bend)


def walls_on_paths(paths: Paths, radius: FloatArray, walls: FloatArray, pairs: Pairs) -> Approach:
    """Judge robots and walls.

    Args:
        paths: Movements of the robots.
        radius: Shape (N,), in m.
        walls: Segments, shape (S, 2, 2), in m.
        pairs: Who is judged: robots first, walls second.
    """
    robot, wall = pairs
    start, along = walls[:, 0], walls[:, 1] - walls[:, 0]
    squared = np.maximum(np.einsum("sk,sk->s", along, along), np.finfo(np.float64).tiny)

    def gap(which: IntArray, fraction: FloatArray) -> FloatArray:
        w = wall[which]
        offset = paths.at(robot[which], fraction) - start[w]
        part = np.clip(np.einsum("ck,ck->c", offset, along[w]) / squared[w], 0.0, 1.0)
        apart = offset - part[:, None] * along[w]
        return np.asarray(np.hypot(apart[:, 0], apart[:, 1]) - radius[robot[which]])

    length = paths.length
    bend = length[robot] ** 2 / radius[robot] + length[robot] * np.abs(paths.turn[robot])
    return nearest_on_paths(gap, bend)


def nearest_on_paths(gap: Gap, bend: FloatArray) -> Approach:
    """Find out which free distances fall below zero within the step.

    Args:
        gap: Free distance of pairs at instants.
        bend: Bound on its second derivative while it is not negative, shape (P,), in m: squared relative path over
            the distance of what keeps apart, plus path times turn. Up to a contact it holds, and that is far enough.

    Returns:
        ``least`` is the least that was looked at, exact to `CONTACT_TOLERANCE` wherever that decides on a contact.
    """
    size = len(bend)
    everyone = np.arange(size)
    start = gap(everyone, np.zeros(size))
    least, fraction = start.copy(), np.zeros(size)
    which, width = np.repeat(everyone, FIRST_INTERVALS), 1.0 / FIRST_INTERVALS
    left = np.tile(np.arange(FIRST_INTERVALS) * width, size)
    for _ in range(MAX_HALVINGS):
        ends = np.stack([gap(which, left), gap(which, left + width)])
        for values, instants in zip(ends, (left, left + width), strict=True):
            np.minimum.at(least, which, values)
            is_least = values == least[which]
            fraction[which[is_least]] = instants[is_least]
        lowest = ends.min(axis=0) - bend[which] * width**2 / 8.0
        is_open = (lowest < -CONTACT_TOLERANCE) & (least[which] >= -CONTACT_TOLERANCE)
        if not is_open.any():
            break
        width /= 2.0
        which = np.repeat(which[is_open], 2)
        left = (left[is_open][:, None] + [0.0, width]).ravel()
    return Approach(start, least, fraction)


def _sinc(angle: FloatArray) -> FloatArray:
    return np.asarray(np.sinc(angle / np.pi))
