"""The judge: how near discs come during a step, in closed form, sharing no formula with the filter.

During a step every robot moves straight at constant speed. Seen from one robot, the other's centre runs along
``p + s d``, s in [0, 1], with p the relative position at the start and d the relative displacement. The squared
distance is a parabola in s, so its least value is exact: there is nothing between two samples to miss.

Letters: N robots, P pairs, d dimensions. m; s is a fraction of the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray

# Discs may start exactly touching, and positions add up over a run: a nanometre is a million times their rounding.
CONTACT_TOLERANCE = 1e-9


class Pairs(NamedTuple):
    """Pairs of robots, each once.

    Attributes:
        first: Index of one robot, shape (P,).
        second: Index of the other, shape (P,).
    """

    first: IntArray
    second: IntArray


class Approach(NamedTuple):
    """How near the robots of each pair come.

    Attributes:
        start: Free distance at the start of the step, shape (P,), in m; negative where discs overlap.
        least: Least free distance at any instant of the step, shape (P,), in m.
        fraction: Part of the step after which that is, shape (P,), in [0, 1].
    """

    start: FloatArray
    least: FloatArray
    fraction: FloatArray

    @property
    def collided(self) -> BoolArray:
        """Pairs that come into contact during the step and were apart before, shape (P,)."""
        return (self.least < -CONTACT_TOLERANCE) & (self.start >= -CONTACT_TOLERANCE)


def pairs_within(world: IntArray) -> Pairs:
    """List all pairs of robots that share a world.

    Args:
        world: Number of the world that each robot is in, shape (N,).
    """
    order = np.argsort(world, kind="stable")
    _, start, size = np.unique(world[order], return_index=True, return_counts=True)
    first, second = [], []
    for number in np.unique(size):
        # All worlds of one size at once: shape (worlds, robots).
        members = order[start[size == number][:, None] + np.arange(number)]
        i, j = np.triu_indices(number, k=1)
        first.append(members[:, i].ravel())
        second.append(members[:, j].ravel())
    nobody = np.empty(0, dtype=np.int64)
    return Pairs(np.concatenate([nobody, *first]), np.concatenate([nobody, *second]))


def closest_approach(
    position: FloatArray, displacement: FloatArray, radius: FloatArray, pairs: Pairs
) -> Approach:
    """Judge one step.

    Args:
        position: Centres at the start of the step, shape (N, d), in m.
        displacement: Straight movements during the step, shape (N, d), in m.
        radius: Shape (N,), in m.
        pairs: Who is judged.
    """
    p = position[pairs.second] - position[pairs.first]
    d = displacement[pairs.second] - displacement[pairs.first]
    contact = radius[pairs.first] + radius[pairs.second]
    travelled = np.einsum("pk,pk->p", d, d)
    closing = -np.einsum("pk,pk->p", p, d)
    # The parabola's vertex; pairs that keep their distance, or part, are nearest at the start.
    fraction = np.zeros(len(closing))
    np.divide(closing, travelled, out=fraction, where=(closing > 0.0) & (closing < travelled))
    fraction[(closing > 0.0) & (closing >= travelled)] = 1.0
    nearest = p + fraction[:, None] * d
    start = np.hypot.reduce(p, axis=1) - contact
    least = np.hypot.reduce(nearest, axis=1) - contact
    return Approach(start, np.minimum(start, least), fraction)
