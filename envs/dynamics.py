"""How commands become movement: holonomic robots, straight and at constant speed during a step.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import FloatArray

# A command in single precision may be this much above the greatest speed by rounding alone; it executes as given.
SPEED_ROUNDING = 1e-6


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
