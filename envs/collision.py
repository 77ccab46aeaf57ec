"""Collisions of discs with each other and with walls inside a step: certified, see `envs.arcs`.

Letters: W worlds, N robots, S walls. SI units; s is a fraction of the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.arcs import Path, Segment, first_entry, least_path_distance
from envs.dynamics import Movement
from envs.walls import WallArrays, WallMap
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import kernel
from safefilter.threads import over_ranges

# Discs may start exactly touching. Coordinates of kilometres are rounded to 1e-13 m; a nanometre is no rounding.
CONTACT_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """What can touch what.

    Attributes:
        radius: Shape (W, N), in m.
        present: Shape (W, N): robots with a body.
        wrecked: Shape (W, N): robots that have collided before; two of them are not judged again, nor one and a wall.
        walls: Walls of each world.
    """

    radius: FloatArray
    present: BoolArray
    wrecked: BoolArray
    walls: WallMap


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """What touched during one step.

    Attributes:
        clearance: Least free distance of each robot to any other during the step, shape (W, N), in m; negative is
            how deep discs would have entered each other, inf is nobody there. A lower bound, up to 0.5e-9 m below.
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


def find_contacts(position: FloatArray, movement: Movement, bodies: Bodies) -> Contacts:
    """Judge one step of every pair of robots, and of every robot and wall, in every world.

    All are judged on the whole movement asked for, also where a robot is stopped by an earlier contact.

    Args:
        position: Centres at the start of the step, shape (W, N, 2), in m.
        movement: Movements during the step.
        bodies: Robots and walls.
    """
    num_worlds, num_robots = bodies.radius.shape
    contacts = Contacts.none(num_worlds, num_robots)

    def judge(first: int, last: int) -> None:
        _judge_pairs(
            first,
            last,
            position,
            movement.displacement,
            movement.turn,
            bodies.radius,
            bodies.present,
            bodies.wrecked,
            contacts.clearance,
            contacts.touched,
            contacts.fraction,
            contacts.num_pairs,
        )
        _judge_walls(
            first,
            last,
            position,
            movement.displacement,
            movement.turn,
            bodies.radius,
            bodies.present & ~bodies.wrecked,
            bodies.walls.arrays,
            contacts.wall_clearance,
            contacts.hit_wall,
            contacts.fraction,
        )

    over_ranges(judge, num_worlds)
    return contacts


@kernel
def _judge_pairs(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    displacement: FloatArray,
    turn: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    wrecked: BoolArray,
    clearance: FloatArray,
    touched: BoolArray,
    fraction: FloatArray,
    num_pairs: IntArray,
) -> None:
    point = Segment(0.0, 0.0, 0.0, 0.0)
    num_robots = radius.shape[1]
    for w in range(first_world, last_world):
        for i in range(num_robots):
            for j in range(i + 1, num_robots):
                if not (present[w, i] and present[w, j]) or (wrecked[w, i] and wrecked[w, j]):
                    continue
                path = Path(
                    position[w, j, 0] - position[w, i, 0],
                    position[w, j, 1] - position[w, i, 1],
                    displacement[w, j, 0],
                    displacement[w, j, 1],
                    turn[w, j],
                    displacement[w, i, 0],
                    displacement[w, i, 1],
                    turn[w, i],
                )
                reach = radius[w, i] + radius[w, j]
                # What is further than both robots' least clearance so far need not be known exactly.
                enough = reach + max(0.0, clearance[w, i], clearance[w, j])
                gap = least_path_distance(path, point, enough) - reach
                clearance[w, i] = min(clearance[w, i], gap)
                clearance[w, j] = min(clearance[w, j], gap)
                if gap < -CONTACT_TOLERANCE:
                    s = first_entry(path, point, reach)
                    num_pairs[w] += 1
                    touched[w, i] = True
                    touched[w, j] = True
                    fraction[w, i] = min(fraction[w, i], s)
                    fraction[w, j] = min(fraction[w, j], s)


@kernel
def _judge_walls(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    displacement: FloatArray,
    turn: FloatArray,
    radius: FloatArray,
    judged: BoolArray,
    walls: WallArrays,
    clearance: FloatArray,
    hit: BoolArray,
    fraction: FloatArray,
) -> None:
    for w in range(first_world, last_world):
        for i in range(radius.shape[1]):
            if not judged[w, i]:
                continue
            path = Path(
                position[w, i, 0],
                position[w, i, 1],
                displacement[w, i, 0],
                displacement[w, i, 1],
                turn[w, i],
                0.0,
                0.0,
                0.0,
            )
            reach = radius[w, i]
            for k in range(walls.num_walls[w]):
                a_x, a_y, b_x, b_y = walls.segment[w, k]
                wall = Segment(a_x, a_y, b_x, b_y)
                enough = reach + max(0.0, clearance[w, i])
                gap = least_path_distance(path, wall, enough) - reach
                clearance[w, i] = min(clearance[w, i], gap)
                if gap < -CONTACT_TOLERANCE:
                    hit[w, i] = True
                    fraction[w, i] = min(fraction[w, i], first_entry(path, wall, reach))
