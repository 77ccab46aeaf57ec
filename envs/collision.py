"""Collisions of discs with each other and with walls inside a step: certified, see `envs.arcs`.

Letters: W worlds, N robots, S walls. SI units; s is a fraction of the step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs.arcs import point_distance_squared
from envs.collision_kernel import (
    CONTACT_TOLERANCE,
    ContactArrays,
    StepArrays,
    judge_robots,
    judge_walls,
    wall_of,
)
from envs.dynamics import Movement
from envs.robot_grid_kernel import empty_robot_grid, sort_robots
from envs.walls import WallArrays, WallMap, most_entries
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import kernel
from safefilter.threads import over_worlds

__all__ = ["CONTACT_TOLERANCE", "Bodies", "Contacts", "find_contacts", "start_clearances"]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """What can touch what.

    Attributes:
        radius: Shape (W, N), in m.
        present: Shape (W, N): robots with a body.
        wrecked: Shape (W, N): robots that have collided before; two of them are not judged again, nor one and a wall.
        walls: Walls of each world.
        person: Shape (W, N): people, who look after each other and after walls themselves; None: nobody.
    """

    radius: FloatArray
    present: BoolArray
    wrecked: BoolArray
    walls: WallMap
    person: BoolArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """What touched during one step.

    Attributes:
        clearance: Least free distance of each robot to any other during the step, shape (W, N), in m; negative is
            how deep discs would have entered each other, inf is nobody within the horizon. A lower bound, at most
            0.5e-9 m below, or a twentieth of it, whichever is more.
        wall_clearance: The same to the nearest wall.
        touched: Shape (W, N): entered another robot.
        hit_wall: Shape (W, N): entered a wall.
        fraction: Part of the step before the first contact, shape (W, N); 1 for robots that touched nothing.
        num_pairs: Number of pairs that touched, shape (W,).
    """

    clearance: FloatArray
    wall_clearance: FloatArray
    touched: BoolArray
    hit_wall: BoolArray
    fraction: FloatArray
    num_pairs: IntArray

    @property
    def arrays(self) -> ContactArrays:
        """For kernels, which write to them."""
        return ContactArrays(
            self.clearance,
            self.wall_clearance,
            self.touched,
            self.hit_wall,
            self.fraction,
            self.num_pairs,
        )

    @classmethod
    def none(cls, num_worlds: int, num_robots: int) -> Contacts:
        """Nobody has met anything."""
        shape = (num_worlds, num_robots)
        return cls(
            clearance=np.full(shape, np.inf),
            wall_clearance=np.full(shape, np.inf),
            touched=np.zeros(shape, dtype=np.bool_),
            hit_wall=np.zeros(shape, dtype=np.bool_),
            fraction=np.ones(shape),
            num_pairs=np.zeros(num_worlds, dtype=np.int64),
        )


def find_contacts(
    position: FloatArray,
    movement: Movement,
    bodies: Bodies,
    *,
    horizon: float = np.inf,
) -> Contacts:
    """Judge one step of every pair of robots, and of every robot and wall, in every world.

    All are judged on the whole movement asked for, also where a robot is stopped by an earlier contact.

    Args:
        position: Centres at the start of the step, shape (W, N, 2), in m.
        movement: Movements during the step.
        bodies: Robots and walls.
        horizon: Free distance at the start up to which clearances are reported, in m. Contacts are found anyway.
    """
    num_worlds, num_robots = bodies.radius.shape
    contacts = Contacts.none(num_worlds, num_robots)
    step = StepArrays(
        position=position,
        displacement=movement.displacement,
        turn=movement.turn,
        travel=np.hypot(movement.displacement[..., 0], movement.displacement[..., 1]),
        radius=bodies.radius,
        present=bodies.present,
        wrecked=bodies.wrecked,
        person=np.zeros_like(bodies.present) if bodies.person is None else bodies.person,
    )

    def judge(first: int, last: int) -> None:
        _judge(first, last, step, contacts.arrays, bodies.walls.arrays, horizon)

    over_worlds(judge, num_worlds, num_robots)
    return contacts


def start_clearances(world: World, worlds: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Free distances of robots that stand still.

    Args:
        world: State.
        worlds: Worlds to look at, K of them.

    Returns:
        To the nearest other robot, and to the nearest wall, each of shape (K, N), in m; negative is how deep they are
        in each other, inf is nobody there.
    """
    to_robot = np.full((len(worlds), world.num_robots), np.inf)
    to_wall = to_robot.copy()
    _start_clearances(
        np.array(worlds, dtype=np.int64),
        world.position,
        world.radius,
        world.present,
        world.walls.arrays,
        to_robot,
        to_wall,
    )
    return to_robot, to_wall


@kernel
def _start_clearances(  # noqa: PLR0917  # a kernel takes arrays, not records
    worlds: IntArray,
    position: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    walls: WallArrays,
    to_robot: FloatArray,
    to_wall: FloatArray,
) -> None:
    for row in range(len(worlds)):
        w = worlds[row]
        for i in range(radius.shape[1]):
            if not present[w, i]:
                continue
            for j in range(i):
                if present[w, j]:
                    x, y = (
                        position[w, i, 0] - position[w, j, 0],
                        position[w, i, 1] - position[w, j, 1],
                    )
                    gap = math.sqrt(x * x + y * y) - radius[w, i] - radius[w, j]
                    to_robot[row, i] = min(to_robot[row, i], gap)
                    to_robot[row, j] = min(to_robot[row, j], gap)
            first = walls.first_wall[walls.map_of[w]]
            for s in range(first, first + walls.num_walls[walls.map_of[w]]):
                squared = point_distance_squared(
                    wall_of(walls, s), position[w, i, 0], position[w, i, 1]
                )
                to_wall[row, i] = min(to_wall[row, i], math.sqrt(squared) - radius[w, i])


@kernel
def _judge(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    step: StepArrays,
    contacts: ContactArrays,
    walls: WallArrays,
    horizon: float,
) -> None:
    grid = empty_robot_grid(step.radius.shape[1])
    squared = np.empty(most_entries(walls))
    for w in range(first_world, last_world):
        sort_robots(grid, w, step.position, step.present)
        judge_robots(step, contacts, grid, w, horizon)
        judge_walls(step, contacts, walls, w, horizon, squared)
