"""World: the state of many robots in many worlds, as one set of arrays.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import dataclass, fields
from typing import Self, cast

import numpy as np
import numpy.typing as npt

from envs.dynamics import Kinematics
from envs.fleet import Fleet
from envs.step_kernel import RobotArrays
from envs.under_way import find_active
from envs.walls import WallMap
from safefilter.arrays import ArrayT, BoolArray, FloatArray, IntArray
from safefilter.errors import ShapeError
from safefilter.jit import formula, kernel


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """State of all robots. The arrays are written in place, by `Navigation` only; `snapshot` keeps a moment.

    Attributes:
        position: Centres, shape (W, N, 2), in m.
        velocity: Mean velocities of the last step, as everyone observes them, shape (W, N, 2), in m/s.
        heading: Directions that differential drives face, shape (W, N), in rad; holonomic robots have none: 0.
        turn_rate: Turn rates of the last step, shape (W, N), in rad/s.
        goal: Shape (W, N, 2), in m.
        radius: Shape (W, N), in m.
        v_max: Greatest speeds, shape (W, N), in m/s.
        omega_max: Greatest turn rates of differential drives, shape (W, N), in rad/s.
        priority: Shape (W, N).
        cooperative: Shape (W, N): runs a filter and can act on it.
        present: Shape (W, N): has a body.
        arrived: Shape (W, N): has reached its goal.
        collided: Shape (W, N): has touched another robot or a wall, and stands still since.
        arrival_time: Time of the first arrival, shape (W, N), in s; NaN for robots that have not arrived.
        person: Shape (W, N): walks by a model of its own; see `envs.crowd`.
        start: Where robots were placed, shape (W, N, 2), in m.
        start_heading: Shape (W, N), in rad.
        arrivals: How often robots have arrived, shape (W, N).
        cycle_start: Step at which robots were placed or reborn, shape (W, N).
        spin_way: Way driven shortly before the time limit, shape (W, N), in m; see `Rules.spin_time`.
        spin_turn: Angles turned then, shape (W, N), in rad.
        step_count: Steps since the reset, shape (W,).
        seed: Of the chance within each world (noise, people), shape (W,).
        walls: Walls of each world.
        kinematics: How robots move.
    """

    position: FloatArray
    velocity: FloatArray
    heading: FloatArray
    turn_rate: FloatArray
    goal: FloatArray
    radius: FloatArray
    v_max: FloatArray
    omega_max: FloatArray
    priority: FloatArray
    cooperative: BoolArray
    present: BoolArray
    arrived: BoolArray
    collided: BoolArray
    arrival_time: FloatArray
    person: BoolArray
    start: FloatArray
    start_heading: FloatArray
    arrivals: IntArray
    cycle_start: IntArray
    spin_way: FloatArray
    spin_turn: FloatArray
    step_count: IntArray
    seed: IntArray
    walls: WallMap
    kinematics: Kinematics

    @classmethod
    def empty(cls, num_worlds: int, fleet: Fleet) -> Self:
        """Arrays for ``num_worlds`` worlds with this fleet each; nobody is placed yet."""
        shape = (num_worlds, fleet.num_robots)
        return cls(
            position=np.zeros((*shape, 2)),
            velocity=np.zeros((*shape, 2)),
            heading=np.zeros(shape),
            turn_rate=np.zeros(shape),
            goal=np.zeros((*shape, 2)),
            radius=_spread(fleet.radius, shape),
            v_max=_spread(fleet.v_max, shape),
            omega_max=_spread(fleet.omega_max, shape),
            priority=_spread(fleet.priority, shape),
            cooperative=_spread(fleet.cooperative, shape),
            present=np.zeros(shape, dtype=np.bool_),
            arrived=np.zeros(shape, dtype=np.bool_),
            collided=np.zeros(shape, dtype=np.bool_),
            arrival_time=np.full(shape, np.nan),
            person=np.zeros(shape, dtype=np.bool_),
            start=np.zeros((*shape, 2)),
            start_heading=np.zeros(shape),
            arrivals=np.zeros(shape, dtype=np.int64),
            cycle_start=np.zeros(shape, dtype=np.int64),
            spin_way=np.zeros(shape),
            spin_turn=np.zeros(shape),
            step_count=np.zeros(num_worlds, dtype=np.int64),
            seed=np.zeros(num_worlds, dtype=np.int64),
            walls=WallMap(num_worlds),
            kinematics=fleet.kinematics,
        )

    @property
    def arrays(self) -> RobotArrays:
        """For kernels, which write to them."""
        return RobotArrays(*(getattr(self, name) for name in RobotArrays._fields))

    @property
    def state(self) -> dict[str, npt.NDArray[np.generic]]:
        """All arrays but the walls, by name; for snapshots."""
        return {
            each.name: getattr(self, each.name)
            for each in fields(self)
            if each.name not in {"walls", "kinematics"}
        }

    def snapshot(self) -> Self:
        """Copy of this moment, which later steps do not change."""
        return deepcopy(self)

    @property
    def num_worlds(self) -> int:
        """Number of worlds W."""
        return len(self.position)

    @property
    def num_robots(self) -> int:
        """Number of robots N in each world."""
        return int(self.position.shape[1])

    def walls_of(self, number: int) -> FloatArray:
        """Walls of one world, shape (S, 2, 2), in m."""
        return self.walls.of(number)

    @property
    def is_differential(self) -> bool:
        """Are actions commands (v, w)? Velocities in world axes otherwise."""
        return self.kinematics == "differential"

    @property
    def active(self) -> BoolArray:
        """Shape (W, N): robots, not people, that are still under way."""
        return find_active(self.present, self.arrived, self.collided, self.person)

    @property
    def nobody(self) -> BoolArray:
        """Shape (W, N), all false."""
        return np.zeros_like(self.present)

    def preferred_velocity(self) -> FloatArray:
        """Straight to the goal at full speed, v_pref of Qin et al., shape (W, N, 2), in m/s; zero at the goal."""
        # As `full_speed` in half of the time: it is asked for in every step.
        velocity = np.empty(self.position.shape)
        _full_speed_to(self.position, self.goal, self.v_max, velocity)
        return velocity


def full_speed(direction: FloatArray, speed: FloatArray) -> FloatArray:
    """Velocities of the given speeds along ``direction``, zero where that has no length.

    Args:
        direction: Shape (..., 2), of any length.
        speed: Shape (...), in m/s.

    Returns:
        Shape (..., 2), in m/s.

    Raises:
        ShapeError: If there is not one speed a direction: the kernel would read beyond them.
    """
    if speed.shape != direction.shape[:-1]:
        raise ShapeError(f"speed: expected shape {direction.shape[:-1]}, got {speed.shape}")
    velocity = np.empty(direction.shape)
    _full_speed(direction.reshape(-1, 2), speed.ravel(), velocity.reshape(-1, 2))
    return velocity


@formula
def velocity_along(x: float, y: float, speed: float) -> tuple[float, float]:
    """Velocity of the given speed along (x, y), zero where that has no length."""
    length = math.hypot(x, y)
    factor = speed / length if length > 0.0 else 0.0
    return factor * x, factor * y


@kernel
def _full_speed(direction: FloatArray, speed: FloatArray, velocity: FloatArray) -> None:
    for k in range(len(direction)):
        velocity[k, 0], velocity[k, 1] = velocity_along(direction[k, 0], direction[k, 1], speed[k])


@kernel
def _full_speed_to(
    position: FloatArray, goal: FloatArray, speed: FloatArray, velocity: FloatArray
) -> None:
    for w in range(position.shape[0]):
        for i in range(position.shape[1]):
            x, y = goal[w, i, 0] - position[w, i, 0], goal[w, i, 1] - position[w, i, 1]
            velocity[w, i, 0], velocity[w, i, 1] = velocity_along(x, y, speed[w, i])


def _spread(each: ArrayT, shape: tuple[int, int]) -> ArrayT:
    """The same robots in every world, shape (W, N)."""
    # In C order: numpy would keep that of the broadcast array, and numba compile every kernel once for one world and
    # once more for several.
    return cast("ArrayT", np.array(np.broadcast_to(each, shape), order="C"))
