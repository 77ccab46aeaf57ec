"""Arguments of a `Scene`: one value for all robots, or one a robot. Letters: N robots, d dimensions."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from safefilter.arguments import real_number, require_kind
from safefilter.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    frozen,
    numbers_of_shape,
    numbers_per_robot,
)
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.lidar import Lidar
from safefilter.neighbours import UNLIMITED_LIMIT, longest_list
from safefilter.outlines import OwnWalls
from safefilter.scene_arrays import PLANE, SPACE

NO_WALLS = frozen(np.empty((0, 5)))
# All robots are in the world of this number, if nothing else is said.
ONE_WORLD = 0
# Of the state.
PLANE_COLUMNS, SPACE_COLUMNS = 3 * PLANE + 2, 3 * SPACE + 2


def one_or_each(value: npt.ArrayLike, field: str, num_robots: int) -> float | npt.NDArray[Any]:
    """Take one number, or one a robot, finite or not. Spreading a number is left to the assignment, which is faster."""
    return value if isinstance(value, int | float) else numbers_per_robot(value, field, num_robots)


def numbers_of_positions(value: npt.ArrayLike) -> npt.NDArray[Any]:
    """Check the shape of positions; how many columns they have says where the robots live. Not a copy.

    Raises:
        ShapeError: If that is neither the plane nor space.
    """
    position = numbers_of_shape(value, "position", ("N", "2 or 3"))
    if position.shape[1] not in {PLANE, SPACE}:
        raise ShapeError(f"position: expected shape (N, 2 or 3), got {position.shape}")
    return position


def require_laid_out(
    state: FloatArray, heading: FloatArray | None, cooperative: BoolArray, world: IntArray
) -> None:
    """Check shapes and dtypes of arrays that are laid out as a scene's own: kernels read them as they are.

    Raises:
        ShapeError: If one has another.
    """
    shape = state.shape
    if (
        len(shape) != 2
        or shape[1] not in {PLANE_COLUMNS, SPACE_COLUMNS}
        or state.dtype != np.float64
    ):
        raise ShapeError(
            f"state: expected float64 of shape (N, {PLANE_COLUMNS} or {SPACE_COLUMNS}), "
            f"got {state.dtype} of shape {shape}"
        )
    expected = shape[:1]
    if heading is not None and (heading.shape != expected or heading.dtype != np.float64):
        raise ShapeError(_unlike("heading", heading, expected))
    if cooperative.shape != expected or cooperative.dtype != np.bool_:
        raise ShapeError(_unlike("cooperative", cooperative, expected))
    if world.shape != expected or world.dtype != np.int64:
        raise ShapeError(_unlike("world", world, expected))


def _unlike(field: str, array: npt.NDArray[Any], expected: tuple[int, ...]) -> str:
    return f"{field}: expected shape {expected}, got {array.dtype} of shape {array.shape}"


def require_no(**is_given: bool) -> None:
    """Refuse what only the plane has.

    Raises:
        InvalidInput: If something of it is given.
    """
    for name, given in is_given.items():
        if given:
            raise InvalidInput(
                f"{name}: robots in space have none; drop it, and write rows for what is around them as a Constraint "
                "of your own"
            )


def walls_of_each(
    own_walls: OwnWalls | None,
    lidar: Lidar | None,
    state: FloatArray,
    heading: FloatArray | None,
    world: IntArray,
) -> OwnWalls:
    """Walls that some robots know and others do not: given, or seen in scans.

    Raises:
        ShapeError: If they are those of another number of robots.
        InvalidInput: If there are scans but no headings, or scans and walls of robots' own.
    """
    num_robots = len(state)
    if own_walls is not None:
        require_kind(own_walls, "own_walls", OwnWalls).require_robots(num_robots)
    if lidar is None:
        return _no_own_walls(num_robots) if own_walls is None else own_walls
    if heading is None:
        raise InvalidInput("lidar: scans need heading= as well: beams are relative to it")
    if own_walls is not None:
        raise InvalidInput("lidar: robots have a map or scans; drop own_walls= or lidar=")
    position = np.ascontiguousarray(state[:, :PLANE])
    seen, first = require_kind(lidar, "lidar", Lidar).walls(
        position, heading, state[:, -2].copy(), world
    )
    return OwnWalls(seen, np.stack([first[:-1], first[1:]], axis=1), longest_list(first))


# What most scenes have in common is made once for as many robots, and shared: nobody can write to it.
@functools.lru_cache(maxsize=4)
def _no_own_walls(num_robots: int) -> OwnWalls:
    return OwnWalls.none(num_robots)


@functools.lru_cache(maxsize=4)
def _all_cooperate(num_robots: int) -> BoolArray:
    return frozen(np.ones(num_robots, dtype=np.bool_))


@functools.lru_cache(maxsize=4)
def _one_world(num_robots: int) -> IntArray:
    return frozen(np.zeros(num_robots, dtype=np.int64))


def cooperative_flags(value: npt.ArrayLike, num_robots: int) -> BoolArray:
    """Spread one flag, or one a robot, to shape (N,).

    Raises:
        ShapeError: If it is neither.
    """
    if value is True:
        return _all_cooperate(num_robots)
    flags = _as_array(value, "cooperative")
    if flags.dtype != np.bool_ or flags.shape not in {(), (num_robots,)}:
        raise ShapeError(
            f"cooperative: expected a bool or bools of shape ({num_robots},), "
            f"got {flags.dtype} of shape {flags.shape}"
        )
    return np.full(num_robots, flags) if flags.ndim == 0 else flags.astype(np.bool_)


def world_numbers(value: npt.ArrayLike, num_robots: int) -> IntArray:
    """Spread one integer, or one a robot, to shape (N,).

    Raises:
        ShapeError: If it is neither.
    """
    if type(value) is int and value == ONE_WORLD:
        return _one_world(num_robots)
    numbers = _as_array(value, "world")
    if numbers.dtype.kind not in "iu" or numbers.shape not in {(), (num_robots,)}:
        raise ShapeError(
            f"world: expected an integer or integers of shape ({num_robots},), "
            f"got {numbers.dtype} of shape {numbers.shape}"
        )
    if numbers.ndim == 0:
        return np.full(num_robots, numbers, dtype=np.int64)
    return numbers.astype(np.int64)


def _as_array(value: npt.ArrayLike, field: str) -> npt.NDArray[np.generic]:
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ShapeError(f"{field}: expected one value, or one a robot: {error}") from None


def reach_of(value: float | None, num_robots: int) -> float:
    """Check a reach, in m; None is infinite, for crowds that are not too large.

    Raises:
        OutOfRange: If it is not above zero, or there are too many robots to see each other.
    """
    if value is None:
        if num_robots > UNLIMITED_LIMIT:
            raise OutOfRange(
                f"reach: {num_robots} robots that all see each other make {num_robots**2:.1e} pairs; "
                "pass reach= (in m)"
            )
        return math.inf
    reach = real_number(value, "reach")
    if not reach > 0.0:
        raise OutOfRange(f"reach: expected a distance above 0 m, got {value}")
    return reach
