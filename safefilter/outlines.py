"""Outlines of obstacles as segments. Letters: N robots, S and M segments, K corners. m."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, IntArray, finite_array, frozen, number_array
from safefilter.errors import OutOfRange, ShapeError
from safefilter.wall_boxes import boxes_for

FEWEST_CORNERS = 3


def shared_walls(walls: npt.ArrayLike | None, polygons: Sequence[npt.ArrayLike]) -> FloatArray:
    """Segments of walls and outlines in the form of `Scene.walls`, with no margin of their own.

    A shape needs no decomposition: a segment is convex, and a robot that starts outside of the outline cannot get in
    without crossing it.

    Args:
        walls: Shape (S, 2, 2), or None.
        polygons: Outlines, each of shape (K, 2), K at least 3, open (the last corner joins the first).

    Raises:
        ShapeError: If an array has another shape.
        NotFinite: If a coordinate is NaN or infinite.
    """
    parts = [np.empty((0, 4))]
    if walls is not None:
        parts.append(finite_array(walls, "walls", ("S", 2, 2)).reshape(-1, 4))
    for number, polygon in enumerate(_list_of(polygons)):
        corners = finite_array(polygon, f"polygon {number}", ("K", 2))
        if len(corners) < FEWEST_CORNERS:
            raise ShapeError(f"polygon {number}: expected at least 3 corners, got {len(corners)}")
        parts.append(np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1))
    segments = np.concatenate(parts)
    return np.column_stack([segments, np.zeros(len(segments))])


def _list_of(polygons: Sequence[npt.ArrayLike]) -> Sequence[npt.ArrayLike]:
    if isinstance(polygons, str) or not isinstance(polygons, Sequence | np.ndarray):
        raise ShapeError(f"polygons: expected a list of outlines, got {type(polygons).__name__}")
    return polygons


@dataclass(frozen=True, slots=True, eq=False)
class OwnWalls:
    """Walls that some robots know and others do not: those of different worlds, say. Build it with `OwnWalls.of`.

    It is checked once, and may be handed to one scene after the other.

    Attributes:
        walls: In the form of `Scene.walls`, shape (M, 5), in m.
        ranges: For each robot the first of them that it knows and the one after the last, shape (N, 2).
        most: Most walls that one robot knows.
        boxes: Boxes around runs of walls, or none; see `safefilter.wall_boxes`.
    """

    walls: FloatArray
    ranges: IntArray
    most: int
    boxes: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        """Put boxes around many walls."""
        object.__setattr__(self, "boxes", boxes_for(self.walls, self.most))

    @classmethod
    def of(cls, walls: npt.ArrayLike, ranges: npt.ArrayLike) -> Self:
        """Check walls, and who knows which.

        Args:
            walls: Segments, shape (M, 2, 2), in m.
            ranges: Integers, shape (N, 2); robots may share walls.

        Raises:
            ShapeError: If an array has another shape.
            NotFinite: If a coordinate is NaN or infinite.
            OutOfRange: If a range leaves the walls.
        """
        segments = finite_array(walls, "own_walls", ("M", 2, 2)).reshape(-1, 4)
        given = number_array(ranges, "own_walls", "a range of integers a robot").copy()
        if given.dtype.kind not in "iu" or given.ndim != 2 or given.shape[1] != 2:
            raise ShapeError(
                "own_walls: expected a range of integers a robot, shape (N, 2), "
                f"got {given.dtype} of shape {given.shape}"
            )
        first, end = given[:, 0], given[:, 1]
        wrong = (first < 0) | (end < first) | (end > len(segments))
        if wrong.any():
            robot = int(np.argmax(wrong))
            raise OutOfRange(
                f"own_walls of robot {robot}: expected a range within 0 to {len(segments)}, "
                f"got {given[robot].tolist()}"
            )
        return cls(
            frozen(np.column_stack([segments, np.zeros(len(segments))])),
            frozen(given.astype(np.int64)),
            int((end - first).max(initial=0)),
        )

    @classmethod
    def none(cls, num_robots: int) -> Self:
        """No robot knows any."""
        return cls(frozen(np.empty((0, 5))), frozen(np.zeros((num_robots, 2), dtype=np.int64)), 0)

    def require_robots(self, num_robots: int) -> None:
        """Check that there is a range for each robot.

        Raises:
            ShapeError: If there are ranges of another number of robots.
        """
        if len(self.ranges) != num_robots:
            raise ShapeError(
                f"own_walls: ranges of {len(self.ranges)} robots, but the scene has {num_robots}"
            )
