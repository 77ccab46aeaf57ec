"""Action map: from what a network says to commands of differential drives, and back.

Letters: (...) any leading shape. SI units.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray


def to_command(
    raw: npt.NDArray[np.floating], v_max: FloatArray, omega_max: FloatArray
) -> FloatArray:
    """Commands that raw actions stand for: v = v_max (1 + a_0) / 2 and w = omega_max a_1.

    A drive that goes forward at half its speed is where a fresh network starts from.

    Args:
        raw: Raw actions a, shape (..., 2); beyond [-1, 1] they count as the nearest of its ends.
        v_max: Greatest speeds, shape (...), in m/s.
        omega_max: Greatest turn rates, shape (...), in rad/s.

    Returns:
        Commands (v, w), shape (..., 2), in m/s and rad/s.
    """
    within = np.clip(raw, -1.0, 1.0)
    command = np.empty(within.shape)
    command[..., 0] = v_max * (0.5 + 0.5 * within[..., 0])
    command[..., 1] = omega_max * within[..., 1]
    return command


def to_raw(command: FloatArray, v_max: FloatArray, omega_max: FloatArray) -> FloatArray:
    """Raw actions that stand for commands: the inverse of `to_command`.

    Args:
        command: Commands (v, w), shape (..., 2), in m/s and rad/s.
        v_max: Greatest speeds, shape (...), in m/s.
        omega_max: Greatest turn rates, shape (...), in rad/s.

    Returns:
        Raw actions, shape (..., 2).
    """
    raw = np.empty(command.shape)
    raw[..., 0] = 2.0 * command[..., 0] / v_max - 1.0
    raw[..., 1] = command[..., 1] / omega_max
    return raw
