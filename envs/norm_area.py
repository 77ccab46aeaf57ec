"""The social norm area: the region around a robot that others are to stay out of, Fig. 2(a) of Qin et al.

The paper prints the key points z_1 ... z_6 without naming their axes. They are (to the right, forward): only so are
the statements of its text true; see `docs/paper.md`. Here, as everywhere in `envs`, body axes are (forward, left).

Letters: K corners. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, finite_array, frozen
from safefilter.errors import OutOfRange, ShapeError

KEY_POINTS = (
    (0.07, 0.126),
    (0.21, 0.07),
    (0.21, -0.07),
    (0.07, -0.182),
    (-0.14, -0.07),
    (-0.14, 0.07),
)
"""z_1 ... z_6 as printed, (right, forward), in m."""


@dataclass(frozen=True, slots=True, eq=False)
class NormArea:
    """A convex polygon around the robot, in its own axes.

    Convex, so that two areas are apart if and only if an edge of one separates them. The paper's is.

    Attributes:
        corners: Anticlockwise, (forward, left) of the robot's centre, shape (K, 2), in m.
    """

    corners: FloatArray

    def __post_init__(self) -> None:
        """Check the corners, and order them anticlockwise.

        Raises:
            ShapeError: If there are fewer than three corners, or they are not of shape (K, 2).
            NotFinite: If a corner is NaN or infinite.
            OutOfRange: If the polygon is not strictly convex, or the robot's centre is outside.
        """
        corners = finite_array(self.corners, "corners", ("K", 2))
        if len(corners) < 3:
            raise ShapeError(f"corners: expected 3 or more, got {len(corners)}")
        turns = _turns(corners)
        if (turns < 0.0).all():
            corners = np.ascontiguousarray(corners[::-1])
            turns = _turns(corners)
        # A star that winds twice also turns left at every corner: its corners are not in order of bearing.
        bearing = np.unwrap(np.arctan2(corners[:, 1], corners[:, 0]))
        if not (turns > 0.0).all() or abs(bearing[-1] - bearing[0]) >= 2.0 * np.pi:
            raise OutOfRange(
                "corners: expected a strictly convex polygon with its corners in order, "
                f"got {corners.tolist()}"
            )
        object.__setattr__(self, "corners", frozen(corners))
        if not (self.edge_distances > 0.0).all():
            raise OutOfRange(
                f"corners: expected the robot's centre (0, 0) inside, got {corners.tolist()}"
            )

    @classmethod
    def of_paper(cls) -> Self:
        """The area of Fig. 2(a)."""
        return cls.of_key_points(KEY_POINTS)

    @classmethod
    def of_key_points(cls, points: npt.ArrayLike) -> Self:
        """Area with corners given as the paper does.

        Args:
            points: (right, forward) of the robot's centre, shape (K, 2), in m.
        """
        right, forward = finite_array(points, "points", ("K", 2)).T
        return cls(np.stack([forward, -right], axis=1))

    def mirrored(self) -> Self:
        """The same area with left and right exchanged."""
        return type(self)(self.corners * [1.0, -1.0])

    @property
    def edge_normals(self) -> FloatArray:
        """Outward unit normals of the edges, shape (K, 2); edge k goes from corner k to corner k + 1."""
        along = np.roll(self.corners, -1, axis=0) - self.corners
        length = np.hypot(along[:, 0], along[:, 1])[:, np.newaxis]
        return np.asarray(np.stack([along[:, 1], -along[:, 0]], axis=1) / length)

    @property
    def edge_distances(self) -> FloatArray:
        """Distances of the centre to the lines through the edges, shape (K,), in m."""
        return np.asarray((self.edge_normals * self.corners).sum(axis=1))

    @property
    def circumradius(self) -> float:
        """Distance of the farthest corner, in m: areas farther apart than two of these cannot overlap."""
        return float(np.hypot(self.corners[:, 0], self.corners[:, 1]).max())

    def placed(self, position: FloatArray, facing: FloatArray) -> FloatArray:
        """Corners in world axes.

        Args:
            position: Centres, shape (..., 2), in m.
            facing: Unit vectors forward, shape (..., 2).

        Returns:
            Shape (..., K, 2), in m.
        """
        left = np.stack([-facing[..., 1], facing[..., 0]], axis=-1)
        axes = np.stack([facing, left], axis=-2)
        return np.asarray(position[..., np.newaxis, :] + self.corners @ axes)


def _turns(corners: FloatArray) -> FloatArray:
    """Twice the signed areas of the triangles of three corners in a row, shape (K,): positive where it turns left."""
    along = np.roll(corners, -1, axis=0) - corners
    after = np.roll(along, -1, axis=0)
    return np.asarray(along[:, 0] * after[:, 1] - along[:, 1] * after[:, 0])
