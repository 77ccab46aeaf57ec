"""A differential drive as kernels take it, and the velocities that its commands ask for.

Letters: B decisions, N robots.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula, kernel
from safefilter.kinematics.arc import chord_velocity

# Columns of a drive's command in what is asked, behind the velocity that it amounts to.
SPEED, TURN_RATE = 2, 3


class Drive(NamedTuple):
    """How velocities become commands (v, w).

    Attributes:
        is_used: False for holonomic robots: then the rest means nothing.
        omega_max: Largest turn rate, in rad/s.
        dt: Duration of the step, in s.
        turn_time: T, in s.
        tracking_error: eps, in m.
        has_polygon: Are solved velocities inside the polygon of S_AHV? If not, they are cut to it.
    """

    is_used: bool
    omega_max: float
    dt: float
    turn_time: float
    tracking_error: float
    has_polygon: bool


NO_DRIVE = Drive(
    is_used=False, omega_max=0.0, dt=1.0, turn_time=1.0, tracking_error=0.0, has_polygon=False
)


@kernel
def with_wanted_velocities(
    command: FloatArray, heading: FloatArray, index: IntArray, dt: float
) -> FloatArray:
    """Velocities that commands amount to, exact displacements of a step divided by dt, and the commands: shape (B, 4).

    Args:
        command: (v, w), shape (B, 2).
        heading: Of all robots, shape (N,), in rad.
        index: Whose commands they are, shape (B,).
        dt: Duration of the step, in s.
    """
    asked = np.empty((len(index), 4))
    for k in range(len(index)):
        ask_command(asked, k, command[k, 0], command[k, 1], heading[index[k]], dt)
    return asked


@formula
def ask_command(
    asked: FloatArray, k: int, speed: float, turn_rate: float, heading: float, dt: float
) -> None:
    """Write what decision k is asked for: the velocity that a command amounts to, and the command."""
    asked[k, 0], asked[k, 1] = chord_velocity(speed, turn_rate, heading, dt)
    asked[k, SPEED], asked[k, TURN_RATE] = speed, turn_rate
