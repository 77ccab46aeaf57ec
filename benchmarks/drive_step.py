"""One step of many robots, `Scene.from_world` and `SafetyFilter.decide`: what drives, walls and lidars add to it.

Robots stand on a grid and head where they like; walls are short pieces between them. Everything is compared with the
bare filter: holonomic robots without walls, on the same number of threads.

Letters: N robots, S walls. m, m/s, rad.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numba
import numpy as np

from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved, on_threads
from envs import Fleet
from envs.lidar import cast_beams
from envs.world import World
from safefilter import (
    DifferentialDrive,
    Holonomic,
    Lidar,
    PriorityORCA,
    SafetyFilter,
    Scene,
    Separation,
    StaticObstacles,
)
from safefilter.arrays import FloatArray
from safefilter.kinematics.differential_drive import Mapping

BARE = "bare filter"
SIZES = (10, 100, 1000)
NUM_WALLS = (0, 10, 50, 200)
NUM_BEAMS = 360
SPACING, WALL_LENGTH = 0.4, 0.15  # m
RADIUS, V_MAX, OMEGA_MAX, DT = 0.105, 0.2, 2.5, 0.2
REACH = 3.0  # m
# Robot-steps timed for each row.
ROBOT_STEPS, MIN_ROUNDS, QUICK_ROUNDS = 100_000, 100, 5


class Crowd(NamedTuple):
    """Robots on a grid.

    Attributes:
        position: Shape (N, 2), in m.
        heading: Shape (N,), in rad.
        velocity: Shape (N, 2), in m/s.
        command: Wanted (v, w), shape (N, 2).
        corners: Places between robots for walls, shape (N, 2), in m.
    """

    position: FloatArray
    heading: FloatArray
    velocity: FloatArray
    command: FloatArray
    corners: FloatArray

    @classmethod
    def of(cls, num_robots: int) -> Crowd:
        """Lay out N robots."""
        rng = np.random.default_rng(0)
        place, side = np.arange(num_robots), int(np.ceil(np.sqrt(num_robots)))
        grid = SPACING * np.stack([place % side, place // side], axis=1)
        heading = rng.uniform(-np.pi, np.pi, num_robots)
        ahead = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        command = np.stack(
            [np.full(num_robots, V_MAX), rng.uniform(-OMEGA_MAX, OMEGA_MAX, num_robots)], axis=1
        )
        jitter = rng.uniform(-0.05, 0.05, (num_robots, 2))
        corners = np.asarray(grid + 0.5 * SPACING, dtype=np.float64)
        return cls(grid + jitter, heading, V_MAX * ahead, command, corners)

    def walls(self, num_walls: int) -> FloatArray:
        """Pieces of wall between robots, then more of them further away, shape (S, 2, 2), in m."""
        number = np.arange(num_walls)
        rows = SPACING * np.array([0.0, 1.0]) * (number // len(self.corners))[:, None]
        middle = self.corners[number % len(self.corners)] + 100.0 * rows
        half = 0.5 * WALL_LENGTH * np.array([1.0, 0.0])
        return np.stack([middle - half, middle + half], axis=1)

    def scan(self, walls: FloatArray) -> Lidar:
        """What the robots' lidars see."""
        num_robots = len(self.position)
        world = World.empty(1, Fleet.of(num_robots, radius=RADIUS, kinematics="differential"))
        world.position[0], world.heading[0], world.present[...] = self.position, self.heading, True
        world.walls.replace({0: walls})
        return Lidar.scan(cast_beams(world, NUM_BEAMS, REACH)[0])


def measure(*, quick: bool = False) -> Result:
    """Time every size on one thread and on two.

    Args:
        quick: Only few robots, and few rounds.
    """
    rows: list[Row] = []
    for size in SIZES[:2] if quick else SIZES:
        actions = steps(Crowd.of(size))
        rounds = QUICK_ROUNDS if quick else max(MIN_ROUNDS, ROBOT_STEPS // size)
        for threads in (1, 2)[: numba.get_num_threads()]:
            with on_threads(threads):
                times = interleaved(actions, rounds=rounds)
            group = f"{size} robots, {threads} thread{'s' if threads > 1 else ''}"
            rows.extend(_rows(times, group))
    return Result(
        name="drive_step",
        title="One step of differential drives, walls and lidars, in us",
        ratio_of=BARE,
        rows=tuple(rows),
        notes=(
            "Scene.from_world and decide, with PriorityORCA, Separation and 64 sides, robots 0.4 m apart.",
            f"'{BARE}': holonomic robots without walls. Drives: the same crowd by commands (v, w), by each mapping.",
            "Walls: StaticObstacles as well; all robots know every wall, and most are out of reach of most robots.",
            f"Lidar: {NUM_BEAMS} beams among 50 walls become walls of each robot's own; casting is not timed.",
        ),
    )


def steps(crowd: Crowd) -> dict[str, Action]:
    """What is timed, by name."""
    holonomic = SafetyFilter([PriorityORCA(2.0), Separation(DT)], Holonomic(V_MAX))
    actions: dict[str, Action] = {BARE: _step(crowd, holonomic, crowd.velocity)}
    actions["holonomic, 200 walls"] = _step(
        crowd, _walled(Holonomic(V_MAX)), crowd.velocity, walls=crowd.walls(200)
    )
    mappings: tuple[Mapping, ...] = ("cut", "polygon")
    for mapping in mappings:
        drives = DifferentialDrive(V_MAX, OMEGA_MAX, DT, tracking_error=0.02, mapping=mapping)
        plain = SafetyFilter([PriorityORCA(2.0), Separation(DT)], drives)
        actions[f"drive, {mapping}"] = _step(crowd, plain, crowd.command)
    walled = _walled(DifferentialDrive(V_MAX, OMEGA_MAX, DT, tracking_error=0.02))
    for number in NUM_WALLS:
        name = f"drive, cut, {number} walls"
        actions[name] = _step(crowd, walled, crowd.command, walls=crowd.walls(number))
    scan = crowd.scan(crowd.walls(50))
    actions[f"drive, cut, lidar of {NUM_BEAMS} beams"] = _step(
        crowd, walled, crowd.command, lidar=scan
    )
    return actions


def _walled(kinematics: Holonomic) -> SafetyFilter:
    return SafetyFilter([PriorityORCA(2.0), Separation(DT), StaticObstacles(1.0)], kinematics)


def _step(
    crowd: Crowd,
    safety_filter: SafetyFilter,
    wanted: FloatArray,
    *,
    walls: FloatArray | None = None,
    lidar: Lidar | None = None,
) -> Action:
    def step() -> object:
        scene = Scene.from_world(
            crowd.position,
            crowd.velocity,
            RADIUS,
            heading=crowd.heading,
            reach=REACH,
            walls=walls,
            lidar=lidar,
        )
        return safety_filter.decide(scene, wanted)

    return step


def _rows(times: dict[str, FloatArray], group: str) -> Iterator[Row]:
    for name, taken in times.items():
        numbers = {"best": 1e6 * float(taken.min()), "median": 1e6 * float(np.median(taken))}
        yield Row(name, group, numbers, float(taken.min() / times[BARE].min()))
