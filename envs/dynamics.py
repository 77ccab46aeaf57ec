"""How actions become movement: holonomic robots drive straight, differential drives along exact arcs.

Letters: W worlds, N robots. SI units, rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from safefilter.arrays import FloatArray

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
        return _chord(self.velocity, self.turn)

    def after(self, fraction: FloatArray) -> FloatArray:
        """Displacement after a part of the step.

        Args:
            fraction: Parts of the step, shape (W, N), in [0, 1].

        Returns:
            Shape (W, N, 2), in m.
        """
        return fraction[..., np.newaxis] * _chord(self.displacement, fraction * self.turn)


def _chord(arc: FloatArray, turn: FloatArray) -> FloatArray:
    """Chords of arcs that start along ``arc`` and are as long: sin(a / 2) / (a / 2) times that, turned by a / 2."""
    half = 0.5 * turn
    part = np.sinc(half / np.pi)
    cosine, sine = np.cos(half), np.sin(half)
    x, y = arc[..., 0], arc[..., 1]
    turned = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    return np.asarray(part[..., np.newaxis] * turned)


def executable_velocity(command: FloatArray, v_max: FloatArray) -> FloatArray:
    """Velocity that the motors deliver: the command, or its direction at full speed where it asks for more.

    Shortening towards zero is the one limit that keeps a certified command certified: budgets are half-planes that
    contain zero.

    Args:
        command: Shape (..., 2), in m/s.
        v_max: Greatest speeds, shape (...), in m/s.

    Returns:
        Shape (..., 2), in m/s.
    """
    speed = np.hypot(command[..., 0], command[..., 1])
    factor = np.ones_like(speed)
    np.divide(v_max, speed, out=factor, where=speed > v_max * (1.0 + SPEED_ROUNDING))
    return command * factor[..., np.newaxis]


def executable_command(command: FloatArray, v_max: FloatArray, omega_max: FloatArray) -> FloatArray:
    """Command (v, w) that the motors of a differential drive deliver: each part within its own limits.

    Args:
        command: Shape (..., 2), in m/s and rad/s.
        v_max: Greatest speeds, shape (...), in m/s; drives do not go backwards.
        omega_max: Greatest turn rates, shape (...), in rad/s.

    Returns:
        Shape (..., 2), in m/s and rad/s.
    """
    fastest, sharpest = v_max * (1.0 + SPEED_ROUNDING), omega_max * (1.0 + SPEED_ROUNDING)
    speed = np.clip(command[..., 0], 0.0, fastest)
    return np.stack([speed, np.clip(command[..., 1], -sharpest, sharpest)], axis=-1)


def straight_movement(velocity: FloatArray, dt: float) -> Movement:
    """Movement of holonomic robots.

    Args:
        velocity: Shape (W, N, 2), in m/s.
        dt: Duration of the step, in s.
    """
    return Movement(velocity, np.zeros(velocity.shape[:-1]), dt)


def arc_movement(command: FloatArray, heading: FloatArray, dt: float) -> Movement:
    """Movement of differential drives.

    Args:
        command: (v, w), shape (W, N, 2), in m/s and rad/s.
        heading: At the start of the step, shape (W, N), in rad.
        dt: Duration of the step, in s.
    """
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return Movement(command[..., :1] * ahead, command[..., 1], dt)
