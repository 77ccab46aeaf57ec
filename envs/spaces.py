"""Spaces: what agents may do and what they see, as Gymnasium and PettingZoo describe it.

Letters: F numbers of an observation. SI units.
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import gymnasium
import numpy as np
import numpy.typing as npt

from envs.dynamics import Kinematics
from envs.observation_layout import ObservationLayout, Observations
from safefilter.errors import InvalidInput

Action: TypeAlias = npt.NDArray[np.float32]
Observation: TypeAlias = Any
"""An array or a dict of arrays, as was asked for: `ObservationForm`."""
ObservationForm: TypeAlias = Literal["flat", "dict"]
"""All numbers of an observation in a row, or block by block under their names."""


def action_space(kinematics: Kinematics, v_max: float, omega_max: float) -> gymnasium.Space[Action]:
    """What a robot may be told.

    Args:
        kinematics: How it moves.
        v_max: Greatest speed, in m/s.
        omega_max: Greatest turn rate, in rad/s; of no meaning to a holonomic robot.

    Returns:
        Of a holonomic robot: velocity in world axes, each part within [-v_max, v_max]; of a differential drive:
        command (v, w), v within [0, v_max] and w within [-omega_max, omega_max]. Shape (2,).
    """
    if kinematics == "holonomic":
        return gymnasium.spaces.Box(np.float32(-v_max), np.float32(v_max), (2,), np.float32)
    low, high = np.array([0.0, -omega_max]), np.array([v_max, omega_max])
    return gymnasium.spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def observation_space(
    layout: ObservationLayout, form: ObservationForm
) -> gymnasium.Space[Observation]:
    """What a robot sees: numbers in [-1, 1].

    Args:
        layout: Which blocks there are.
        form: In a row, or by name.

    Returns:
        Box of shape (F,), or a Dict of a Box for each block.

    Raises:
        InvalidInput: If there is no such form.
    """
    if form not in get_args(ObservationForm):
        raise InvalidInput(
            f"observation: expected one of {', '.join(get_args(ObservationForm))}, got {form!r}"
        )
    if form == "flat":
        return gymnasium.spaces.Box(-1.0, 1.0, (layout.size,), np.float32)
    return gymnasium.spaces.Dict({
        block.name: gymnasium.spaces.Box(-1.0, 1.0, block.shape, np.float32)
        for block in layout.blocks
    })


def in_form(layout: ObservationLayout, flat: Observations, form: ObservationForm) -> Observation:
    """Show observations in the form asked for, without copying.

    Args:
        layout: Which blocks there are.
        flat: Shape (..., F).
        form: In a row, or by name.
    """
    return flat if form == "flat" else layout.as_dict(flat)
