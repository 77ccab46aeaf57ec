"""Fleet: what the robots of a world are, before they are placed anywhere.

Letters: N robots. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self, get_args

import numpy as np
import numpy.typing as npt

from envs.dynamics import Kinematics
from safefilter.arrays import BoolArray, FloatArray, frozen, per_robot, require_positive
from safefilter.errors import InvalidInput, ShapeError

# Turtlebot3 as in section V of Qin et al.
RADIUS = 0.105
MAX_SPEED = 0.2
MAX_TURN_RATE = 2.5


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """N robots, each with its own numbers. Build it with `Fleet.of`.

    Attributes:
        radius: Radii of the discs, shape (N,), in m.
        v_max: Greatest speeds, shape (N,), in m/s.
        priority: Priorities, shape (N,), positive; only ratios matter.
        cooperative: Does the robot run a filter? Shape (N,); known to all alike.
        omega_max: Greatest turn rates, shape (N,), in rad/s; of no meaning to holonomic robots.
        kinematics: How all of them move.
    """

    radius: FloatArray
    v_max: FloatArray
    priority: FloatArray
    cooperative: BoolArray
    omega_max: FloatArray
    kinematics: Kinematics

    @classmethod
    def of(
        cls,
        num_robots: int,
        *,
        radius: npt.ArrayLike = RADIUS,
        v_max: npt.ArrayLike = MAX_SPEED,
        priority: npt.ArrayLike = 1.0,
        cooperative: npt.ArrayLike = True,
        omega_max: npt.ArrayLike = MAX_TURN_RATE,
        kinematics: Kinematics = "holonomic",
    ) -> Self:
        """Spread numbers, or one number a robot, over ``num_robots`` robots.

        Raises:
            ShapeError: If a value is neither one value nor one a robot.
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is not above zero.
            InvalidInput: If there are no such kinematics.
        """
        if kinematics not in get_args(Kinematics):
            raise InvalidInput(
                f"kinematics: expected one of {', '.join(get_args(Kinematics))}, got {kinematics!r}"
            )
        flags = np.asarray(cooperative)
        if flags.dtype != np.bool_ or flags.shape not in {(), (num_robots,)}:
            raise ShapeError(
                f"cooperative: expected a bool or bools of shape ({num_robots},), "
                f"got {flags.dtype} of shape {flags.shape}"
            )
        return cls(
            radius=_positive(radius, "radius", num_robots),
            v_max=_positive(v_max, "v_max", num_robots),
            priority=_positive(priority, "priority", num_robots),
            cooperative=frozen(np.array(np.broadcast_to(flags, (num_robots,)))),
            omega_max=_positive(omega_max, "omega_max", num_robots),
            kinematics=kinematics,
        )

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return len(self.radius)


def _positive(value: npt.ArrayLike, field: str, num_robots: int) -> FloatArray:
    return frozen(require_positive(per_robot(value, field, num_robots), field))
