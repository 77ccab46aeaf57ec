"""What action spaces a filter can stand in front of: a Box with a row a robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from safefilter.arrays import IntArray, number_array
from safefilter.errors import InvalidInput, OutOfRange, ShapeError

DTYPES = (np.dtype(np.float32), np.dtype(np.float64))


def require_box(space: gymnasium.Space[Any], num_rows: int, meaning: str) -> gymnasium.spaces.Box:
    """Check the action space of robots in the plane.

    Args:
        space: Box of shape (2,) for one robot, or (N, 2), of float32 or float64.
        num_rows: Number of robots N that it is for.
        meaning: What a row is, for messages.

    Returns:
        The space.

    Raises:
        InvalidInput: If the space is no Box, or of another dtype.
        ShapeError: If its shape is another.
    """
    if not isinstance(space, gymnasium.spaces.Box):
        raise InvalidInput(
            f"action_space: expected a Box of {meaning}, got {space}; wrappers that make other spaces of it belong "
            "around the filter"
        )
    if space.dtype not in DTYPES:
        raise InvalidInput(f"action_space: expected float32 or float64, got {space.dtype}")
    shapes = {(num_rows, 2), (2,)} if num_rows == 1 else {(num_rows, 2)}
    if space.shape not in shapes:
        raise ShapeError(
            f"action_space: expected shape ({num_rows}, 2), one row a robot"
            f"{', or (2,)' if num_rows == 1 else ''}, got {space.shape}"
        )
    return space


def robots_of_rows(shape: tuple[int, ...] | None, index: int | Sequence[int] | None) -> IntArray:
    """Robot of each row of an action space, shape (N,).

    Args:
        shape: Shape of the space.
        index: One robot, the robots of the rows, or None: row i is robot i.

    Raises:
        ShapeError: If ``index`` is neither, or None for a space without rows.
        OutOfRange: If a robot is named twice, or below 0.
    """
    if index is None:
        if shape is None or len(shape) != 2:
            raise ShapeError(f"index: None needs an action space of shape (N, 2), got {shape}")
        return np.arange(shape[0])
    robots = np.atleast_1d(number_array(index, "index", "an integer, integers or None"))
    if robots.ndim != 1 or robots.dtype.kind not in "iu":
        raise ShapeError(f"index: expected an integer, integers or None, got {index!r}")
    if len(np.unique(robots)) != len(robots) or (robots < 0).any():
        raise OutOfRange(f"index: expected every robot once, from 0 up, got {robots.tolist()}")
    return robots.astype(np.int64)
