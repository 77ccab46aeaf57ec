"""How actions become movement: holonomic robots drive straight, differential drives along exact arcs.

Letters: W worlds, N robots. SI units, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from envs.arcs import arc_point
from safefilter.arrays import BoolArray, FloatArray
from safefilter.jit import formula, kernel

Kinematics = Literal["holonomic", "differential"]
"""Actions of holonomic robots are velocities in world axes; of differential drives commands (v, w)."""

# A command in single precision may be this much above a limit by rounding alone; it executes as given.
SPEED_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """What robots do in one step: arcs of constant speed, straight where they do not turn.

    Attributes:
        velocity: At the start, shape (W, N, 2), in m/s.
        turn_rate: Shape (W, N), in rad/s.
        dt: Duration of the step, in s.
    """

    velocity: FloatArray
    turn_rate: FloatArray
    dt: float

    @classmethod
    def of(  # noqa: PLR0917  # what a robot is
        cls,
        action: FloatArray,
        heading: FloatArray,
        drives: BoolArray,
        v_max: FloatArray,
        omega_max: FloatArray,
        dt: float,
    ) -> Movement:
        """Movements that actions ask for, as far as motors deliver them.

        Args:
            action: Velocities in m/s, or commands (v, w) in m/s and rad/s of differential drives, shape (W, N, 2).
            heading: At the start of the step, shape (W, N), in rad.
            drives: Shape (W, N): is a differential drive.
            v_max: Greatest speeds, shape (W, N), in m/s.
            omega_max: Greatest turn rates, shape (W, N), in rad/s.
            dt: Duration of the step, in s.
        """
        velocity, turn_rate = np.empty(action.shape), np.empty(heading.shape)
        _movements(action, heading, drives, v_max, omega_max, velocity, turn_rate)
        return cls(velocity, turn_rate, dt)

    @property
    def displacement(self) -> FloatArray:
        """Where robots would get to if they did not turn, shape (W, N, 2), in m."""
        return self.velocity * self.dt

    @property
    def turn(self) -> FloatArray:
        """Angle turned, shape (W, N), in rad."""
        return self.turn_rate * self.dt

    @property
    def mean_velocity(self) -> FloatArray:
        """Displacement of the whole step over its duration, shape (W, N, 2), in m/s."""
        mean = np.empty(self.velocity.shape)
        _arc_points(self.velocity, self.turn, np.ones(self.turn_rate.shape), mean)
        return mean

    def after(self, fraction: FloatArray) -> FloatArray:
        """Displacement after a part of the step.

        Args:
            fraction: Parts of the step, shape (W, N), in [0, 1].

        Returns:
            Shape (W, N, 2), in m.
        """
        way = np.empty(self.velocity.shape)
        _arc_points(self.displacement, self.turn, fraction, way)
        return way


@formula
def executable_velocity(x: float, y: float, v_max: float) -> tuple[float, float]:
    """Velocity that the motors deliver: the one asked for, or its direction at full speed where that is less.

    Shortening towards zero is the one limit that keeps a certified velocity certified: budgets are half-planes that
    contain zero.
    """
    speed = math.hypot(x, y)
    if speed <= v_max * (1.0 + SPEED_ROUNDING):
        return x, y
    factor = v_max / speed
    return factor * x, factor * y


@formula
def executable_command(v: float, w: float, v_max: float, omega_max: float) -> tuple[float, float]:
    """Command (v, w) that the motors of a differential drive deliver: each part within its own limits, v from 0."""
    fastest, sharpest = v_max * (1.0 + SPEED_ROUNDING), omega_max * (1.0 + SPEED_ROUNDING)
    return min(max(v, 0.0), fastest), min(max(w, -sharpest), sharpest)


@formula
def start_motion(  # noqa: PLR0917  # a compiled formula takes plain numbers
    x: float, y: float, heading: float, drives: bool, v_max: float, omega_max: float
) -> tuple[float, float, float]:
    """Velocity (2) and turn rate at the start of the step, of a robot that is told (x, y)."""
    if not drives:
        v_x, v_y = executable_velocity(x, y, v_max)
        return v_x, v_y, 0.0
    v, w = executable_command(x, y, v_max, omega_max)
    return v * math.cos(heading), v * math.sin(heading), w


@kernel
def _movements(  # noqa: PLR0917  # a kernel takes arrays, not records
    action: FloatArray,
    heading: FloatArray,
    drives: BoolArray,
    v_max: FloatArray,
    omega_max: FloatArray,
    velocity: FloatArray,
    turn_rate: FloatArray,
) -> None:
    for w in range(heading.shape[0]):
        for i in range(heading.shape[1]):
            velocity[w, i, 0], velocity[w, i, 1], turn_rate[w, i] = start_motion(
                action[w, i, 0],
                action[w, i, 1],
                heading[w, i],
                drives[w, i],
                v_max[w, i],
                omega_max[w, i],
            )


@kernel
def _arc_points(
    start: FloatArray, turn: FloatArray, fraction: FloatArray, reached: FloatArray
) -> None:
    for w in range(turn.shape[0]):
        for i in range(turn.shape[1]):
            reached[w, i, 0], reached[w, i, 1] = arc_point(
                start[w, i, 0], start[w, i, 1], turn[w, i], fraction[w, i]
            )
