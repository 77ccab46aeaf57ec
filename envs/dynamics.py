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
        displacement: Velocity at the start times the duration of the step, shape (W, N, 2), in m: where a robot would
            get to if it did not turn.
        turn: Angle turned, shape (W, N), in rad.
    """

    displacement: FloatArray
    turn: FloatArray

    def after(self, fraction: FloatArray) -> FloatArray:
        """Displacement after a part of the step.

        The chord of an arc of angle a is sin(a / 2) / (a / 2) times as long as the arc, and turned by a / 2.

        Args:
            fraction: Parts of the step, shape (W, N), in [0, 1].

        Returns:
            Shape (W, N, 2), in m.
        """
        half = 0.5 * fraction * self.turn
        part = fraction * np.sinc(half / np.pi)
        cosine, sine = np.cos(half), np.sin(half)
        x, y = self.displacement[..., 0], self.displacement[..., 1]
        chord = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
        return np.asarray(part[..., np.newaxis] * chord)

    def mean_velocity(self, dt: float) -> FloatArray:
        """Displacement of the whole step over its duration, shape (W, N, 2), in m/s."""
        if not self.turn.any():
            return self.displacement / dt
        return self.after(np.ones_like(self.turn)) / dt


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
    return Movement(velocity * dt, np.zeros(velocity.shape[:-1]))


def arc_movement(command: FloatArray, heading: FloatArray, dt: float) -> Movement:
    """Movement of differential drives.

    Args:
        command: (v, w), shape (W, N, 2), in m/s and rad/s.
        heading: At the start of the step, shape (W, N), in rad.
        dt: Duration of the step, in s.
    """
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return Movement(command[..., :1] * dt * ahead, command[..., 1] * dt)
