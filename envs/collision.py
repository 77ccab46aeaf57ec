"""Collisions of discs with each other and with walls inside a step: certified, see `envs.arcs`.

Letters: W worlds, N robots, S walls. SI units; s is a fraction of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs.collision_kernel import (
    CONTACT_TOLERANCE,
    ContactArrays,
    StepArrays,
    judge_robots,
    judge_walls,
)
from envs.dynamics import Movement
from envs.robot_grid_kernel import empty_robot_grid, sort_robots
from envs.walls import WallArrays, WallMap
from envs.world import over_worlds
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import kernel

__all__ = ["CONTACT_TOLERANCE", "Bodies", "Contacts", "find_contacts"]


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
    worlds: Sequence[int] | None = None,
) -> Contacts:
    """Judge one step of every pair of robots, and of every robot and wall, in every world.

    All are judged on the whole movement asked for, also where a robot is stopped by an earlier contact.

    Args:
        position: Centres at the start of the step, shape (W, N, 2), in m.
        movement: Movements during the step.
        bodies: Robots and walls.
        horizon: Free distance at the start up to which clearances are reported, in m. Contacts are found anyway.
        worlds: Worlds to look at; None: all.
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

    if worlds is None:
        over_worlds(judge, num_worlds, num_robots)
    else:
        for w in worlds:
            judge(w, w + 1)
    return contacts


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
    squared = np.empty(walls.entry.shape[1])
    for w in range(first_world, last_world):
        sort_robots(grid, w, step.position, step.present)
        judge_robots(step, contacts, grid, w, horizon)
        judge_walls(step, contacts, walls, w, horizon, squared)
