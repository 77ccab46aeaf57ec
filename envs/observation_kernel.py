"""Writing the blocks of observations, robot after robot; see `envs.observation_layout` for what the numbers mean.

Letters: W worlds, N robots a world, k neighbours, K beams. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from envs.lidar_kernel import read_range
from envs.noise_kernel import noisy_range
from envs.observation_layout import Observations
from envs.odometry import OdometryArrays
from envs.robot_grid_kernel import RobotGrid, cells_near
from envs.sensing import SensedArrays
from envs.step_kernel import RobotArrays
from envs.trail import HALF, add_up_trail
from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula

GOAL_SCALE = 3.0  # m
AWAY_SCALE = 1.0  # m
TIME_SCALE = 10.0  # s
SPEED_SCALE = 0.2  # m/s
GOAL_DECAY = 3.0  # 1/m
FAR_DECAY, NEAR_DECAY, BEAM_DECAY = 1.5, 8.0, 1.2  # 1/m
OWN_SIZE, NEIGHBOUR_SIZE, MEMORY_SIZE = 9, 9, 13


class ObservationSettings(NamedTuple):
    """What observations are made with.

    Attributes:
        num_neighbours: k.
        num_beams: K.
        has_memory: Is there a block of memory?
        has_trail: Is there a block of the trail?
        speed_scale: Of relative velocities, in m/s.
        sensing_range: Distance of centres up to which robots see each other, in m.
        lidar_range: In m.
        lidar_noise: Standard deviation of ranges, in m.
        beam_dropout: Probability that a beam does not come back.
        dt: Duration of a step, in s.
        drives: Are robots differential drives?
        is_exact: Do robots sense each other where they are?
    """

    num_neighbours: int
    num_beams: int
    has_memory: bool
    has_trail: bool
    speed_scale: float
    sensing_range: float
    lidar_range: float
    lidar_noise: float
    beam_dropout: float
    dt: float
    drives: bool
    is_exact: bool


class Nearest(NamedTuple):
    """Working space: the nearest robots so far, and how far away they are, shape (k,)."""

    robot: IntArray
    distance: FloatArray


@formula
def decay(x: float) -> float:
    """exp(-x) for x from 0 up, to 1e-7; below 2e-9 for x above 20.

    As (1 - y + y^2 / 2 - ...)^128 with y = x / 128 at most 0.16: seven terms are enough for single precision, and a
    processor does several of them at a time, which no library's exponential function lets it.
    """
    y = min(x, 20.0) * (1.0 / 128.0)
    p = 1.0 - y * (
        1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0 - y / 720.0))))
    )
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    return p * p


@formula
def within_one(x: float) -> float:
    """The nearest number within [-1, 1]."""
    return min(max(x, -1.0), 1.0)


@formula
def insert_nearest(nearest: Nearest, found: int, robot: int, away: float) -> int:
    """Insert a robot into a sorted list of the nearest ones; return how many are in the list now.

    Equal distances keep the order in which they came; what falls off the end is forgotten.
    """
    place = found
    while place > 0 and nearest.distance[place - 1] > away:
        place -= 1
    if place == len(nearest.robot):
        return found
    found = min(found + 1, len(nearest.robot))
    for k in range(found - 1, place, -1):
        nearest.robot[k] = nearest.robot[k - 1]
        nearest.distance[k] = nearest.distance[k - 1]
    nearest.robot[place] = robot
    nearest.distance[place] = away
    return found


@formula
def write_own(
    row: Observations,
    robots: RobotArrays,
    sensed: SensedArrays,
    w: int,
    i: int,
    cosine: float,
    sine: float,
    drives: bool,
) -> None:
    """Write the own block; where robot i is headed is given by cosine and sine."""
    x = robots.goal[w, i, 0] - sensed.position[w, i, 0]
    y = robots.goal[w, i, 1] - sensed.position[w, i, 1]
    distance = math.sqrt(x * x + y * y)
    row[w, i, 0] = distance / (distance + GOAL_SCALE)
    row[w, i, 1] = min(distance, 1.0)
    row[w, i, 2], row[w, i, 3] = 0.0, 0.0
    if distance > 0.0:
        row[w, i, 2] = within_one((cosine * x + sine * y) / distance)
        row[w, i, 3] = within_one((cosine * y - sine * x) / distance)
    v_x, v_y = sensed.velocity[w, i, 0], sensed.velocity[w, i, 1]
    v_max = robots.v_max[w, i]
    if drives:
        row[w, i, 4] = within_one(math.sqrt(v_x * v_x + v_y * v_y) / v_max)
        row[w, i, 5] = within_one(robots.turn_rate[w, i] / robots.omega_max[w, i])
    else:
        row[w, i, 4] = within_one((cosine * v_x + sine * v_y) / v_max)
        row[w, i, 5] = within_one((cosine * v_y - sine * v_x) / v_max)
    row[w, i, 6] = v_max / (v_max + SPEED_SCALE)
    row[w, i, 7] = robots.priority[w, i] / (robots.priority[w, i] + 1.0)
    row[w, i, 8] = decay(GOAL_DECAY * distance)


@formula
def find_nearest(
    nearest: Nearest, grid: RobotGrid, sensed: SensedArrays, w: int, i: int, sensing_range: float
) -> int:
    """List the nearest robots within range; return how many there are."""
    found, x, y = 0, sensed.position[w, i, 0], sensed.position[w, i, 1]
    left, right, bottom, top = cells_near(grid, x, y, sensing_range)
    for row in range(bottom, top + 1):
        start = grid.cell_start[row * grid.cells_along[0] + left]
        for e in range(start, grid.cell_start[row * grid.cells_along[0] + right + 1]):
            j = grid.order[e]
            d_x, d_y = sensed.position[w, j, 0] - x, sensed.position[w, j, 1] - y
            squared = d_x * d_x + d_y * d_y
            if j != i and squared <= sensing_range * sensing_range:
                found = insert_nearest(nearest, found, j, math.sqrt(squared))
    return found


@formula
def write_neighbour(
    row: Observations,
    first: int,
    robots: RobotArrays,
    sensed: SensedArrays,
    w: int,
    i: int,
    j: int,
    distance: float,
    cosine: float,
    sine: float,
    speed_scale: float,
) -> None:
    """Write the block of neighbour j from column ``first`` on."""
    row[w, i, first], row[w, i, first + 1] = 0.0, 0.0
    if distance > 0.0:
        x = (sensed.position[w, j, 0] - sensed.position[w, i, 0]) / distance
        y = (sensed.position[w, j, 1] - sensed.position[w, i, 1]) / distance
        row[w, i, first] = within_one(cosine * x + sine * y)
        row[w, i, first + 1] = within_one(cosine * y - sine * x)
    gap = max(0.0, distance - robots.radius[w, i] - robots.radius[w, j])
    row[w, i, first + 2] = decay(FAR_DECAY * gap)
    row[w, i, first + 3] = decay(NEAR_DECAY * gap)
    x = (sensed.velocity[w, j, 0] - sensed.velocity[w, i, 0]) / speed_scale
    y = (sensed.velocity[w, j, 1] - sensed.velocity[w, i, 1]) / speed_scale
    row[w, i, first + 4] = within_one(cosine * x + sine * y)
    row[w, i, first + 5] = within_one(cosine * y - sine * x)
    relative = sensed.heading[w, j] - sensed.heading[w, i]
    row[w, i, first + 6], row[w, i, first + 7] = math.cos(relative), math.sin(relative)
    own, other = robots.priority[w, i], robots.priority[w, j]
    row[w, i, first + 8] = other / (own + other)


@formula
def write_beams(
    row: Observations,
    first: int,
    nearness: FloatArray,
    settings: ObservationSettings,
    seed: int,
    step: int,
    w: int,
    i: int,
) -> None:
    """Write what the beams saw, from column ``first`` on; noise first, then the range beyond which nothing comes."""
    num_beams, furthest = settings.num_beams, settings.lidar_range
    for k in range(num_beams):
        nearness[k] = read_range(nearness, k, num_beams, furthest)
    if settings.lidar_noise > 0.0 or settings.beam_dropout > 0.0:
        for k in range(num_beams):
            nearness[k] = noisy_range(
                nearness[k],
                settings.lidar_noise,
                settings.beam_dropout,
                furthest,
                seed,
                step,
                i,
                k,
            )
    for k in range(num_beams):
        value = decay(BEAM_DECAY * nearness[k])
        row[w, i, first + k] = value if nearness[k] <= furthest else 0.0


@formula
def write_memory(
    row: Observations,
    first: int,
    robots: RobotArrays,
    odometry: OdometryArrays,
    w: int,
    i: int,
    cosine: float,
    sine: float,
    dt: float,
) -> None:
    """Write the block of memory from column ``first`` on."""
    num_moments, now = odometry.past.shape[2], robots.step_count[w]
    for lag in range(len(odometry.lag_steps)):
        slot = (now - odometry.lag_steps[lag]) % num_moments
        furthest = odometry.lag_steps[lag] * dt * robots.v_max[w, i]
        x = (odometry.past[w, i, slot, 0] - robots.position[w, i, 0]) / furthest
        y = (odometry.past[w, i, slot, 1] - robots.position[w, i, 1]) / furthest
        row[w, i, first + 2 * lag] = within_one(cosine * x + sine * y)
        row[w, i, first + 2 * lag + 1] = within_one(cosine * y - sine * x)
    first += 2 * len(odometry.lag_steps)
    x = robots.goal[w, i, 0] - robots.position[w, i, 0]
    y = robots.goal[w, i, 1] - robots.position[w, i, 1]
    nearest = odometry.nearest[w, i]
    away = max(0.0, math.sqrt(x * x + y * y) - nearest)
    since = (now - odometry.nearest_step[w, i]) * dt
    row[w, i, first] = nearest / (nearest + GOAL_SCALE)
    row[w, i, first + 1] = away / (away + AWAY_SCALE)
    row[w, i, first + 2] = since / (since + TIME_SCALE)


@formula
def write_trail(
    row: Observations,
    first: int,
    robots: RobotArrays,
    odometry: OdometryArrays,
    w: int,
    i: int,
    cosine: float,
    sine: float,
    total: FloatArray,
) -> None:
    """Write the block of the trail from column ``first`` on; ``total`` is working space."""
    x, y = robots.position[w, i, 0], robots.position[w, i, 1]
    add_up_trail(odometry.place[w, i], odometry.num_places[w, i], x, y, cosine, sine, total)
    for k in range(len(total)):
        row[w, i, first + k] = total[k] / (total[k] + HALF)
