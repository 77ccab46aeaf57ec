"""Outlines of obstacles as segments. Letters: S segments, K corners. m."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, finite_array
from safefilter.errors import ShapeError

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
    for number, polygon in enumerate(polygons):
        corners = finite_array(polygon, f"polygon {number}", ("K", 2))
        if len(corners) < FEWEST_CORNERS:
            raise ShapeError(f"polygon {number}: expected at least 3 corners, got {len(corners)}")
        parts.append(np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1))
    segments = np.concatenate(parts)
    return np.column_stack([segments, np.zeros(len(segments))])
