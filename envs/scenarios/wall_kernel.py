"""Distances of many points and lines from walls, compiled.

SI units.
"""

from __future__ import annotations

import math

import numpy as np

from envs.arcs import Segment, least_distance, segment_distance
from safefilter.arrays import FloatArray
from safefilter.jit import kernel


@kernel
def wall_distances(points: FloatArray, walls: FloatArray) -> FloatArray:
    """Distance of each point from the nearest wall, infinite where there is none.

    Args:
        points: Shape (K, 2), in m.
        walls: Segments, shape (S, 2, 2), in m.

    Returns:
        Shape (K,), in m.
    """
    distances = np.full(len(points), math.inf)
    for k in range(len(points)):
        x, y = points[k]
        for s in range(len(walls)):
            a_x, a_y, b_x, b_y = walls[s, 0, 0], walls[s, 0, 1], walls[s, 1, 0], walls[s, 1, 1]
            distance = least_distance(a_x - x, a_y - y, b_x - a_x, b_y - a_y)
            distances[k] = min(distances[k], distance)
    return distances


@kernel
def sight_lines(lines: FloatArray, walls: FloatArray) -> FloatArray:
    """Distance of each line from the nearest wall: 0 where they cross, infinite where there is none.

    Args:
        lines: Segments, shape (K, 2, 2), in m.
        walls: Segments, shape (S, 2, 2), in m.

    Returns:
        Shape (K,), in m.
    """
    distances = np.full(len(lines), math.inf)
    for k in range(len(lines)):
        p_x, p_y, q_x, q_y = lines[k, 0, 0], lines[k, 0, 1], lines[k, 1, 0], lines[k, 1, 1]
        for s in range(len(walls)):
            wall = Segment(walls[s, 0, 0], walls[s, 0, 1], walls[s, 1, 0], walls[s, 1, 1])
            distances[k] = min(distances[k], segment_distance(p_x, p_y, q_x, q_y, wall))
    return distances
