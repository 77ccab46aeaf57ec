"""Lidar: what beams from each robot's centre hit first, walls or robots.

Letters: W worlds, N robots a world, K beams, S walls. m, rad.
"""

from __future__ import annotations

import math

import numpy as np

from envs.walls import WallArrays
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges

# Of a segment's length: beams find no gap between two walls that share an end.
END_SLACK = 1e-9


def cast_beams(world: World, num_beams: int, greatest_range: float) -> FloatArray:
    """Scan once round, counterclockwise from each robot's heading.

    Args:
        world: State.
        num_beams: Number of beams K, evenly spaced.
        greatest_range: Distance up to which beams come back, in m.

    Returns:
        Distances from the centres, shape (W, N, K), in m; infinite where nothing came back, and for robots that
        are gone.
    """
    ranges = np.full((world.num_worlds, world.num_robots, num_beams), np.inf)

    def cast(first: int, last: int) -> None:
        _cast(
            first,
            last,
            world.position,
            world.heading,
            world.radius,
            world.present,
            world.walls.arrays,
            greatest_range,
            ranges,
        )

    over_ranges(cast, world.num_worlds)
    return ranges


@formula
def distance_to_disc(p_x: float, p_y: float, u_x: float, u_y: float, radius: float) -> float:
    """Distance along the unit vector u to a disc around p, in m; infinite if the beam misses it, 0 inside."""
    ahead, beside = p_x * u_x + p_y * u_y, p_x * u_y - p_y * u_x
    if p_x * p_x + p_y * p_y <= radius * radius:
        return 0.0
    if ahead < 0.0 or abs(beside) > radius:
        return math.inf
    return ahead - math.sqrt(radius * radius - beside * beside)


@formula
def distance_to_segment(  # noqa: PLR0917  # a compiled formula takes plain numbers
    a_x: float, a_y: float, b_x: float, b_y: float, u_x: float, u_y: float
) -> float:
    """Distance from the origin along the unit vector u to a segment, in m; infinite if the beam misses it."""
    w_x, w_y = b_x - a_x, b_y - a_y
    across = u_x * w_y - u_y * w_x
    if across == 0.0:
        return math.inf  # along the wall: the walls that it ends at are hit instead
    part = (a_x * u_y - a_y * u_x) / across
    distance = (a_x * w_y - a_y * w_x) / across
    if distance < 0.0 or part < -END_SLACK or part > 1.0 + END_SLACK:
        return math.inf
    return distance


@kernel
def _cast(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    heading: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    walls: WallArrays,
    greatest_range: float,
    ranges: FloatArray,
) -> None:
    num_robots, num_beams = ranges.shape[1], ranges.shape[2]
    for w in range(first_world, last_world):
        for i in range(num_robots):
            if not present[w, i]:
                continue
            x, y = position[w, i]
            for k in range(num_beams):
                angle = heading[w, i] + k * (2.0 * math.pi / num_beams)
                u_x, u_y = math.cos(angle), math.sin(angle)
                nearest = math.inf
                for s in range(walls.num_walls[w]):
                    hit = distance_to_segment(
                        walls.segment[w, s, 0] - x,
                        walls.segment[w, s, 1] - y,
                        walls.segment[w, s, 2] - x,
                        walls.segment[w, s, 3] - y,
                        u_x,
                        u_y,
                    )
                    nearest = min(nearest, hit)
                for j in range(num_robots):
                    if j != i and present[w, j]:
                        p_x, p_y = position[w, j, 0] - x, position[w, j, 1] - y
                        nearest = min(nearest, distance_to_disc(p_x, p_y, u_x, u_y, radius[w, j]))
                if nearest <= greatest_range:
                    ranges[w, i, k] = nearest
