"""Observation: what robots know, as numbers in [-1, 1]; see `envs.observation_layout` for what they mean.

Letters: W worlds, N robots a world, F numbers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from envs.lidar_kernel import Beams, paint_robots, paint_walls
from envs.observation_kernel import (
    MEMORY_SIZE,
    NEIGHBOUR_SIZE,
    OWN_SIZE,
    Nearest,
    ObservationSettings,
    find_nearest,
    write_beams,
    write_memory,
    write_neighbour,
    write_own,
    write_trail,
)
from envs.observation_layout import ObservationLayout, Observations
from envs.odometry import Odometry, OdometryArrays
from envs.robot_grid_kernel import empty_robot_grid, sort_robots
from envs.rules import Rules
from envs.sensing import Sensed, SensedArrays, Sensing
from envs.step_kernel import RobotArrays
from envs.trail import NUM_SECTORS
from envs.walls import WallArrays
from envs.world import World
from safefilter.arrays import BoolArray, IntArray
from safefilter.jit import kernel
from safefilter.kept import Kept, KeptRecord
from safefilter.threads import over_worlds


class Observer:
    """Makes the observations of a world, and keeps the memory that they need.

    Attributes:
        layout: Which blocks there are.
        sensed: What robots know of each other.
    """

    def __init__(
        self,
        world: World,
        rules: Rules,
        layout: ObservationLayout | None = None,
        sensing: Sensing | None = None,
    ) -> None:
        """Watch a world.

        Args:
            world: State.
            rules: Ranges, and the duration of a step.
            layout: Which blocks there are; by default 5 neighbours and 36 beams.
            sensing: How well robots sense; by default perfectly.
        """
        self.layout = ObservationLayout() if layout is None else layout
        given = Sensing() if sensing is None else sensing
        self._world = world
        self._shape = (world.num_worlds, world.num_robots, self.layout.size)
        self._robots = world.arrays
        self._beams = Beams.evenly(self.layout.num_beams)
        self._odometry = Odometry(
            world.num_worlds,
            world.num_robots,
            rules.dt,
            is_used=self.layout.has_memory or self.layout.has_trail,
        )
        self.sensed = Sensed(given, self._robots)
        self._kept: Kept[ObservationInputs] | None = None
        self._settings = ObservationSettings(
            num_neighbours=self.layout.num_neighbours,
            num_beams=self.layout.num_beams,
            has_memory=self.layout.has_memory,
            has_trail=self.layout.has_trail,
            speed_scale=self.layout.speed_scale,
            sensing_range=rules.sensing_range,
            lidar_range=rules.lidar_range,
            lidar_noise=given.lidar_noise,
            beam_dropout=given.beam_dropout,
            dt=rules.dt,
            drives=world.is_differential,
            is_exact=given.is_perfect,
        )

    def restart(self, chosen: np.typing.NDArray[np.bool_]) -> None:
        """Some robots have been placed or reborn, shape (W, N)."""
        self.sensed.restart(chosen)
        self._odometry.restart(self._robots, chosen)

    def update(self) -> None:
        """A step has been made."""
        self.sensed.update(self._world.seed)
        self._odometry.update(self._robots)

    @property
    def memory(self) -> dict[str, np.typing.NDArray[np.generic]]:
        """Everything that is remembered beside the world, by name; for snapshots."""
        sensed = {f"sensed.{name}": array for name, array in self.sensed.memory.items()}
        driven = {f"odometry.{name}": array for name, array in self._odometry.memory.items()}
        return {**sensed, **driven}

    def observe(self, chosen: BoolArray | None = None) -> Observations:
        """Observations of robots now; of those that are gone, or not chosen, zeros.

        Args:
            chosen: Which robots, shape (W, N); None: all.

        Returns:
            Shape (W, N, F), in [-1, 1].
        """
        world, walls = self._world, self._world.walls.arrays
        observed = world.present if chosen is None else world.present & chosen
        written = np.zeros(self._shape, dtype=np.float32)
        kept = self._kept
        if kept is None or kept.record.walls is not walls:
            kept = self._kept = Kept(
                ObservationInputs(
                    self._robots,
                    self.sensed.arrays,
                    world.seed,
                    walls,
                    self._beams,
                    self._odometry.arrays,
                    self._settings,
                )
            )
        num_worlds, num_robots, _ = self._shape
        over_worlds(_observe, num_worlds, num_robots, observed, kept.handle, written)
        return written


class ObservationInputs(NamedTuple):
    """What observations are made from."""

    robots: RobotArrays
    sensed: SensedArrays
    seed: IntArray
    walls: WallArrays
    beams: Beams
    odometry: OdometryArrays
    settings: ObservationSettings


@kernel
def _observe(
    observed: BoolArray,
    kept: KeptRecord,
    written: Observations,
    first_world: int,
    last_world: int,
) -> None:
    robots, sensed, seed, walls, beams, odometry, settings = kept.record
    num_robots = robots.radius.shape[1]
    true_grid = empty_robot_grid(num_robots)
    sensed_grid = true_grid if settings.is_exact else empty_robot_grid(num_robots)
    nearness = np.empty(2 * settings.num_beams)
    stamp = np.full(walls.num_walls.max(), -1)
    nearest = Nearest(
        np.empty(settings.num_neighbours, dtype=np.int64), np.empty(settings.num_neighbours)
    )
    total = np.empty(NUM_SECTORS)
    furthest = settings.lidar_range
    for w in range(first_world, last_world):
        if not observed[w].any():
            continue
        sort_robots(true_grid, w, robots.position, robots.present)
        if not settings.is_exact:
            sort_robots(sensed_grid, w, sensed.position, robots.present)
        largest_radius = robots.radius[w].max()
        for i in range(num_robots):
            if not observed[w, i]:
                continue
            heading = sensed.heading[w, i]
            cosine, sine = math.cos(heading), math.sin(heading)
            drives = settings.drives and not robots.person[w, i]
            write_own(written, robots, sensed, w, i, cosine, sine, drives)
            found = find_nearest(nearest, sensed_grid, sensed, w, i, settings.sensing_range)
            for k in range(found):
                write_neighbour(
                    written,
                    OWN_SIZE + k * NEIGHBOUR_SIZE,
                    robots,
                    sensed,
                    w,
                    i,
                    nearest.robot[k],
                    nearest.distance[k],
                    cosine,
                    sine,
                    settings.speed_scale,
                )
            first = OWN_SIZE + settings.num_neighbours * NEIGHBOUR_SIZE
            if settings.num_beams > 0:
                nearness[:] = 0.0
                x, y = robots.position[w, i, 0], robots.position[w, i, 1]
                ahead, aside = math.cos(robots.heading[w, i]), math.sin(robots.heading[w, i])
                number = w * num_robots + i
                paint_walls(nearness, beams, walls, w, x, y, ahead, aside, furthest, stamp, number)
                paint_robots(
                    nearness,
                    beams,
                    true_grid,
                    robots.position,
                    robots.radius,
                    largest_radius,
                    w,
                    i,
                    ahead,
                    aside,
                    furthest,
                )
                step = robots.step_count[w]
                write_beams(written, first, nearness, settings, seed[w], step, w, i)
            first += settings.num_beams
            if settings.has_memory:
                write_memory(written, first, robots, odometry, w, i, cosine, sine, settings.dt)
                first += MEMORY_SIZE
            if settings.has_trail:
                write_trail(written, first, robots, odometry, w, i, cosine, sine, total)
