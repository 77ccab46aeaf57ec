"""Lidar: what beams from each robot's centre hit first, walls or robots.

Letters: W worlds, N robots a world, K beams. m, rad.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from envs.lidar_kernel import Beams, paint_robots, paint_walls, read_range
from envs.noise_kernel import noisy_range
from envs.robot_grid_kernel import empty_robot_grid, sort_robots
from envs.rules import Rules
from envs.sensing import Sensing
from envs.walls import WallArrays
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen
from safefilter.jit import kernel
from safefilter.lidar import Lidar
from safefilter.threads import over_worlds

PERFECT = Sensing()


def cast_beams(
    world: World,
    num_beams: int,
    greatest_range: float,
    *,
    sensing: Sensing = PERFECT,
    worlds: slice = slice(None),
    chosen: BoolArray | None = None,
) -> FloatArray:
    """Scan once round, counterclockwise from each robot's heading.

    Args:
        world: State.
        num_beams: Number of beams K, evenly spaced.
        greatest_range: Distance up to which beams come back, in m.
        sensing: Noise and drop-out of beams.
        worlds: Worlds to look at; of all others nothing comes back.
        chosen: Robots that scan, shape (W, N); to all others nothing comes back. None: all.

    Returns:
        Distances from the centres, shape (W, N, K), in m; infinite where nothing came back, and for robots that
        are gone.
    """
    shape = world.num_worlds, world.num_robots, num_beams
    first, stop, _ = worlds.indices(world.num_worlds)
    # What is written anyway is not filled before.
    is_whole = first == 0 and stop == world.num_worlds
    ranges = np.empty(shape) if is_whole else np.full(shape, np.inf)
    if num_beams == 0:
        return ranges
    beams = Beams.evenly(num_beams)
    scans = world.present if chosen is None else world.present & chosen

    def cast(begin: int, end: int) -> None:
        _cast(
            begin,
            end,
            world.position,
            world.heading,
            world.radius,
            world.present,
            scans,
            world.walls.arrays,
            beams,
            greatest_range,
            sensing.lidar_noise,
            sensing.beam_dropout,
            world.seed,
            world.step_count,
            ranges,
        )

    over_worlds(lambda begin, end: cast(first + begin, first + end), stop - first, world.num_robots)
    return ranges


def scan_walls(
    world: World,
    rules: Rules,
    sensing: Sensing = PERFECT,
    worlds: slice = slice(None),
    chosen: BoolArray | None = None,
) -> Lidar:
    """What a filter without a map knows walls from: `cast_beams`, with beams and ranges as the rules say.

    Args:
        world: State.
        rules: ``num_beams``, ``lidar_range`` and ``wall_range``.
        sensing: Noise and drop-out of beams.
        worlds: Worlds to look at.
        chosen: Robots that scan, shape (W, N); None: all.

    Returns:
        Scans of all robots of these worlds.
    """
    seen = rules.lidar_range if rules.wall_range is None else rules.wall_range
    furthest = min(seen, rules.lidar_range)
    ranges = cast_beams(
        world, rules.num_beams, furthest, sensing=sensing, worlds=worlds, chosen=chosen
    )
    # Ranges that have just been cast need neither a check nor a copy.
    blank = _blank_scan(rules.num_beams)
    returned = frozen(ranges[worlds].reshape(-1, rules.num_beams))
    return Lidar(returned, blank.angles, blank.corner_angle)


@functools.cache
def _blank_scan(num_beams: int) -> Lidar:
    return Lidar.scan(np.full((1, num_beams), np.inf))


@kernel
def _cast(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    heading: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    scans: BoolArray,
    walls: WallArrays,
    beams: Beams,
    greatest_range: float,
    noise: float,
    dropout: float,
    seed: IntArray,
    step_count: IntArray,
    ranges: FloatArray,
) -> None:
    num_robots, num_beams = ranges.shape[1], ranges.shape[2]
    grid = empty_robot_grid(num_robots)
    nearness = np.empty(2 * num_beams)
    stamp = np.full(walls.num_walls.max(), -1)
    # Known before the loop: with the hash inside, a scan without noise takes five times as long.
    is_noisy = noise > 0.0 or dropout > 0.0
    for w in range(first_world, last_world):
        sort_robots(grid, w, position, present)
        largest_radius = radius[w].max()
        for i in range(num_robots):
            if not scans[w, i]:
                ranges[w, i] = np.inf
                continue
            nearness[:] = 0.0
            x, y = position[w, i, 0], position[w, i, 1]
            cosine, sine = math.cos(heading[w, i]), math.sin(heading[w, i])
            number = w * num_robots + i
            paint_walls(
                nearness, beams, walls, w, x, y, cosine, sine, greatest_range, stamp, number
            )
            paint_robots(
                nearness,
                beams,
                grid,
                position,
                radius,
                largest_radius,
                w,
                i,
                cosine,
                sine,
                greatest_range,
            )
            for k in range(num_beams):
                distance = read_range(nearness, k, num_beams, greatest_range)
                if is_noisy:
                    distance = noisy_range(
                        distance, noise, dropout, greatest_range, seed[w], step_count[w], i, k
                    )
                ranges[w, i, k] = distance
