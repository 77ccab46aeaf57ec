"""Where people go next; see `envs.crowd` for the models and their sources.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from envs.arcs import Segment, least_distance_squared, segment_distance
from envs.noise_kernel import normal, uniform
from envs.step_kernel import RobotArrays
from envs.walls import WallArrays
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import formula, kernel

# Channels of chance, after those of `envs.sensing`.
DRIFT, FRESH = 6, 14
NUM_TRIES = 8
"""How often a person on a random walk looks for another direction when a wall is in the way."""


class CrowdSettings(NamedTuple):
    """Settings of a `Crowd`, its motion by number."""

    motion: int
    drift: float
    turn_radius: float
    relaxation_time: float
    strength: float
    fall_off: float


class Gait(NamedTuple):
    """What people keep in mind.

    Attributes:
        goes_back: Shape (W, N): on the way from the goal to the start.
        direction: Directions of random walks, shape (W, N), in rad.
    """

    goes_back: BoolArray
    direction: FloatArray


@formula
def is_blocked(
    robots: RobotArrays, walls: WallArrays, w: int, i: int, x: float, y: float, dt: float
) -> bool:
    """Would a person that walks at (x, y) touch a wall in the step, and come nearer to it?"""
    p_x, p_y = robots.position[w, i, 0], robots.position[w, i, 1]
    first = walls.first_wall[walls.map_of[w]]
    for s in range(first, first + walls.num_walls[walls.map_of[w]]):
        a_x, a_y = walls.segment[s, 0], walls.segment[s, 1]
        b_x, b_y = walls.segment[s, 2], walls.segment[s, 3]
        wall = Segment(a_x, a_y, b_x, b_y)
        nearest = segment_distance(p_x, p_y, p_x + dt * x, p_y + dt * y, wall)
        now = math.sqrt(least_distance_squared(a_x - p_x, a_y - p_y, b_x - a_x, b_y - a_y))
        if nearest < robots.radius[w, i] and nearest < now:
            return True
    return False


@formula
def to_target(
    robots: RobotArrays, gait: Gait, turn_radius: float, w: int, i: int
) -> tuple[float, float]:
    """Unit vector to where a person goes; it turns round when it is there."""
    x, y, distance = 0.0, 0.0, 0.0
    for _ in range(2):
        target = robots.start if gait.goes_back[w, i] else robots.goal
        x = target[w, i, 0] - robots.position[w, i, 0]
        y = target[w, i, 1] - robots.position[w, i, 1]
        distance = math.sqrt(x * x + y * y)
        if distance > turn_radius:
            break
        gait.goes_back[w, i] = not gait.goes_back[w, i]
    if distance == 0.0:
        return 0.0, 0.0
    return x / distance, y / distance


@formula
def walk_at_random(
    robots: RobotArrays,
    walls: WallArrays,
    gait: Gait,
    settings: CrowdSettings,
    seed: int,
    w: int,
    i: int,
    dt: float,
) -> tuple[float, float]:
    """Velocity of a person on a random walk; none if it finds no way."""
    step, speed = robots.step_count[w], robots.v_max[w, i]
    gait.direction[w, i] += settings.drift * math.sqrt(dt) * normal(seed, step, i, DRIFT)
    for k in range(NUM_TRIES):
        x = speed * math.cos(gait.direction[w, i])
        y = speed * math.sin(gait.direction[w, i])
        if not is_blocked(robots, walls, w, i, x, y, dt):
            return x, y
        gait.direction[w, i] = 2.0 * math.pi * uniform(seed, step, i, FRESH + k)
    return 0.0, 0.0


@formula
def push(distance: float, radius: float, settings: CrowdSettings) -> float:
    """Acceleration away from something at a distance, in m/s^2: ``strength exp((radius - distance) / fall_off)``."""
    return settings.strength * math.exp(min(1.0, (radius - distance) / settings.fall_off))


@formula
def social_force(
    robots: RobotArrays, walls: WallArrays, settings: CrowdSettings, w: int, i: int
) -> tuple[float, float]:
    """Acceleration by which everyone and all walls push a person away."""
    force_x, force_y = 0.0, 0.0
    p_x, p_y = robots.position[w, i, 0], robots.position[w, i, 1]
    for j in range(robots.radius.shape[1]):
        if j == i or not robots.present[w, j]:
            continue
        x, y = p_x - robots.position[w, j, 0], p_y - robots.position[w, j, 1]
        distance = math.sqrt(x * x + y * y)
        if distance > 0.0:
            size = push(distance, robots.radius[w, i] + robots.radius[w, j], settings) / distance
            force_x, force_y = force_x + size * x, force_y + size * y
    first = walls.first_wall[walls.map_of[w]]
    for s in range(first, first + walls.num_walls[walls.map_of[w]]):
        a_x, a_y = walls.segment[s, 0] - p_x, walls.segment[s, 1] - p_y
        w_x = walls.segment[s, 2] - p_x - a_x
        w_y = walls.segment[s, 3] - p_y - a_y
        length_squared = w_x * w_x + w_y * w_y
        part = 0.0
        if length_squared > 0.0:
            part = min(1.0, max(0.0, -(a_x * w_x + a_y * w_y) / length_squared))
        x, y = -(a_x + part * w_x), -(a_y + part * w_y)
        distance = math.sqrt(x * x + y * y)
        if distance > 0.0:
            size = push(distance, robots.radius[w, i], settings) / distance
            force_x, force_y = force_x + size * x, force_y + size * y
    return force_x, force_y


@formula
def walk(
    robots: RobotArrays,
    walls: WallArrays,
    gait: Gait,
    settings: CrowdSettings,
    seed: int,
    w: int,
    i: int,
    dt: float,
) -> tuple[float, float]:
    """Velocity that a person chooses for the next step."""
    if settings.motion == 1:
        return walk_at_random(robots, walls, gait, settings, seed, w, i, dt)
    e_x, e_y = to_target(robots, gait, settings.turn_radius, w, i)
    x, y = robots.v_max[w, i] * e_x, robots.v_max[w, i] * e_y
    if settings.motion == 2:
        v_x, v_y = robots.velocity[w, i, 0], robots.velocity[w, i, 1]
        force_x, force_y = social_force(robots, walls, settings, w, i)
        part = min(1.0, dt / settings.relaxation_time)
        x = v_x + part * (x - v_x) + dt * force_x
        y = v_y + part * (y - v_y) + dt * force_y
    if is_blocked(robots, walls, w, i, x, y, dt):
        return 0.0, 0.0
    return x, y


@kernel
def walk_worlds(
    first_world: int,
    last_world: int,
    action: FloatArray,
    robots: RobotArrays,
    walls: WallArrays,
    gait: Gait,
    settings: CrowdSettings,
    seed: IntArray,
    dt: float,
) -> None:
    """Write the velocities of people into ``action``, shape (W, N, 2); they face the way they go."""
    for w in range(first_world, last_world):
        for i in range(action.shape[1]):
            if robots.person[w, i] and robots.present[w, i] and not robots.collided[w, i]:
                x, y = walk(robots, walls, gait, settings, seed[w], w, i, dt)
                action[w, i, 0], action[w, i, 1] = x, y
                if x != 0.0 or y != 0.0:
                    robots.heading[w, i] = math.atan2(y, x)
