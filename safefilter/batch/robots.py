"""Which robots a batch decides for. Letters: B decisions, N robots (in each of W worlds)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, IntArray, number_array
from safefilter.errors import InvalidInput, NotCooperative, OutOfRange, ShapeError
from safefilter.jit import kernel
from safefilter.scene import Scene
from safefilter.scene_arrays import PLANE
from safefilter.worlds import Worlds


def robots_of(scene: Scene, index: Sequence[int] | IntArray | None) -> IntArray:
    """Check the robots asked for.

    Args:
        scene: What the robots know.
        index: Robots to decide for; None: every one that cooperates, in order.

    Returns:
        A new array of shape (B,).

    Raises:
        ShapeError: If ``index`` is not a list of integers.
        OutOfRange: If it names no robot.
        NotCooperative: If it names a robot that others take for unfiltered.
    """
    if index is None:
        return np.flatnonzero(scene.cooperative)
    given = number_array(index, "index", "integers of shape (B,)")
    # An empty list is one of floats.
    if given.ndim != 1 or (given.dtype.kind not in "iu" and given.size > 0):
        raise ShapeError(
            f"index: expected integers of shape (B,), got {given.dtype} of shape {given.shape}"
        )
    # Of a list an array was made that nobody else has.
    robots = given if type(index) is list and given.dtype == np.int64 else given.astype(np.int64)
    if not _are_cooperative(robots, scene.cooperative):
        _refuse(scene, robots)
    return robots


@kernel
def _are_cooperative(robots: IntArray, cooperative: BoolArray) -> bool:
    """Are all of them robots that cooperate? A kernel, because a single decision is short: numpy needs 3 us."""
    for robot in robots:
        if robot < 0 or robot >= len(cooperative) or not cooperative[robot]:
            return False
    return True


def robots_of_worlds(worlds: Worlds, chosen: BoolArray | None) -> IntArray:
    """Check the robots asked for in many worlds.

    Args:
        worlds: The robots.
        chosen: Which to decide for, shape (W, N); None: every one that cooperates.

    Returns:
        A new array of rows w N + i, shape (B,).

    Raises:
        ShapeError: If ``chosen`` is no flag a robot.
    """
    if chosen is None:
        chosen = worlds.kept.record.cooperative
    elif (
        not isinstance(chosen, np.ndarray)
        or chosen.dtype != np.bool_
        or chosen.shape != worlds.shape
    ):
        given = number_array(chosen, "chosen", f"bools of shape {worlds.shape}")
        raise ShapeError(
            f"chosen: expected an array of bools of shape {worlds.shape}, got {given.dtype} of shape {given.shape}"
        )
    # Half a microsecond less than `np.flatnonzero`.
    return chosen.ravel().nonzero()[0]


def actions_in_worlds(worlds: Worlds, action: npt.ArrayLike) -> npt.NDArray[Any]:
    """Check actions of all robots of many worlds, as they are.

    Raises:
        InvalidInput: If these are no worlds.
        ShapeError: If they are no numbers of shape (W, N, 2).
    """
    if not isinstance(worlds, Worlds):
        raise InvalidInput(f"worlds: expected Worlds, got {type(worlds).__name__}")
    given = number_array(action, "action", "numbers of shape (W, N, 2)")
    expected = (*worlds.shape, PLANE)
    if given.shape != expected or given.dtype.kind not in "fiu":
        raise ShapeError(
            f"action: expected numbers of shape {expected}, one row a robot, got {given.dtype} of shape {given.shape}"
        )
    return given


def _refuse(scene: Scene, robots: IntArray) -> None:
    if robots.min() < 0 or robots.max() >= scene.num_robots:
        raise OutOfRange(
            f"index: expected robots 0 to {scene.num_robots - 1}, got {robots.tolist()}"
        )
    wrong = robots[~scene.cooperative[robots]].tolist()
    raise NotCooperative(
        f"index: robots {wrong} are flagged cooperative=False, so others take them for unfiltered and leave them "
        "no share: leave them out, or flag them cooperative"
    )
