"""Observation: what a robot knows, as numbers in [-1, 1].

Axes are those of the robot: parallel to the world's for holonomic robots, along the heading for differential drives;
the origin is the robot. Neighbours' goals and wanted velocities are hidden, as in section II of Qin et al.

Letters: W worlds, N robots a world, k neighbours, F = 7 + 8 k numbers.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges

OWN_SIZE = 7
"""Own block: unit vector to the goal (2), its distance up to 1 m, exp(-distance / 3 m), velocity over v_max (2),
whether it is under way."""
NEIGHBOUR_SIZE = 8
"""Block of a neighbour, nearest first: 1 for present, unit vector to it (2), exp(-1.5 gap), exp(-8 gap), relative
velocity over the sum of both speeds (2), its share pr_j / (pr_i + pr_j) of the priorities. Absent: zeros."""

GOAL_DECAY = 1.0 / 3.0  # 1/m
FAR_DECAY, NEAR_DECAY = 1.5, 8.0  # 1/m


def observation_size(num_neighbours: int) -> int:
    """Number of numbers F for ``num_neighbours`` neighbours."""
    return OWN_SIZE + NEIGHBOUR_SIZE * num_neighbours


def observe(world: World, num_neighbours: int, sensing_range: float) -> npt.NDArray[np.float32]:
    """Observations of all robots.

    Args:
        world: State.
        num_neighbours: The nearest k robots are seen.
        sensing_range: Distance of centres up to which robots see each other, in m.

    Returns:
        Shape (W, N, F), in [-1, 1].
    """
    shape = (world.num_worlds, world.num_robots, observation_size(num_neighbours))
    observation = np.zeros(shape)
    observation[..., :OWN_SIZE] = _own_block(world)

    def write(first: int, last: int) -> None:
        _write_neighbours(
            first,
            last,
            world.position,
            world.velocity,
            world.heading,
            world.radius,
            world.v_max,
            world.priority,
            world.present,
            sensing_range,
            num_neighbours,
            observation,
        )

    over_ranges(write, world.num_worlds)
    return np.clip(observation, -1.0, 1.0).astype(np.float32)


def _own_block(world: World) -> FloatArray:
    offset = world.goal - world.position
    distance = np.hypot(offset[..., 0], offset[..., 1])
    direction = np.divide(
        offset,
        distance[..., np.newaxis],
        out=np.zeros_like(offset),
        where=distance[..., np.newaxis] > 0.0,
    )
    direction = _turned(direction, world.heading)
    velocity = _turned(world.velocity / world.v_max[..., np.newaxis], world.heading)
    return np.stack(
        [
            direction[..., 0],
            direction[..., 1],
            np.minimum(distance, 1.0),
            np.exp(-GOAL_DECAY * distance),
            velocity[..., 0],
            velocity[..., 1],
            world.active.astype(np.float64),
        ],
        axis=-1,
    )


def _turned(vector: FloatArray, heading: FloatArray) -> FloatArray:
    """Vectors of world axes in the axes of robots, shape (W, N, 2)."""
    cosine, sine = np.cos(heading), np.sin(heading)
    x, y = vector[..., 0], vector[..., 1]
    return np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1)


@formula
def insert_nearest(
    nearest: IntArray, distance: FloatArray, found: int, robot: int, away: float
) -> int:
    """Insert a robot into a sorted list of the nearest ones; return how many are in the list now.

    Equal distances keep the order in which they came; what falls off the end is forgotten.
    """
    place = found
    while place > 0 and distance[place - 1] > away:
        place -= 1
    if place == len(nearest):
        return found
    found = min(found + 1, len(nearest))
    for k in range(found - 1, place, -1):
        nearest[k] = nearest[k - 1]
        distance[k] = distance[k - 1]
    nearest[place] = robot
    distance[place] = away
    return found


@kernel
def _write_neighbours(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    velocity: FloatArray,
    heading: FloatArray,
    radius: FloatArray,
    v_max: FloatArray,
    priority: FloatArray,
    present: BoolArray,
    sensing_range: float,
    num_neighbours: int,
    observation: FloatArray,
) -> None:
    num_robots = radius.shape[1]
    nearest = np.empty(num_neighbours, dtype=np.int64)
    distance = np.empty(num_neighbours)
    for w in range(first_world, last_world):
        for i in range(num_robots):
            found = 0
            cosine, sine = math.cos(heading[w, i]), math.sin(heading[w, i])
            for j in range(num_robots):
                if j == i or not present[w, j] or not present[w, i]:
                    continue
                x = position[w, j, 0] - position[w, i, 0]
                y = position[w, j, 1] - position[w, i, 1]
                away = math.hypot(x, y)
                if away <= sensing_range:
                    found = insert_nearest(nearest, distance, found, j, away)
            for k in range(found):
                j = nearest[k]
                block = observation[w, i, OWN_SIZE + NEIGHBOUR_SIZE * k :]
                gap = max(0.0, distance[k] - radius[w, i] - radius[w, j])
                speeds = v_max[w, i] + v_max[w, j]
                block[0] = 1.0
                if distance[k] > 0.0:
                    x = (position[w, j, 0] - position[w, i, 0]) / distance[k]
                    y = (position[w, j, 1] - position[w, i, 1]) / distance[k]
                    block[1] = cosine * x + sine * y
                    block[2] = cosine * y - sine * x
                block[3] = math.exp(-FAR_DECAY * gap)
                block[4] = math.exp(-NEAR_DECAY * gap)
                x = (velocity[w, j, 0] - velocity[w, i, 0]) / speeds
                y = (velocity[w, j, 1] - velocity[w, i, 1]) / speeds
                block[5] = cosine * x + sine * y
                block[6] = cosine * y - sine * x
                block[7] = priority[w, j] / (priority[w, i] + priority[w, j])
