"""Holonomic robots: any velocity up to a speed limit.

The permitted set is a regular polygon inscribed in the speed disc, in space a polyhedron inscribed in the ball, so that
programs are linear in their rows; the last word and Case-1 use disc and ball themselves.

Letters: B decisions, N robots, S sides, d dimensions. m/s.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
import numpy.typing as npt

from safefilter.arguments import whole_number
from safefilter.arrays import FloatArray, frozen, number_array, per_robot, require_positive
from safefilter.constraints.row_buffers import RowLabels
from safefilter.errors import OutOfRange, ShapeError
from safefilter.jit import formula
from safefilter.kinematics.drive import NO_DRIVE, Drive
from safefilter.kinematics.inscribed_polyhedron import NUM_TRIANGLES, inscribed_polyhedron
from safefilter.scene_arrays import PLANE, SPACE

# A speed of exactly v_max may come as a float32 a little above it: this much is let through, and everyone's reach in
# a step is computed with it.
SPEED_SLACK = 1e-6
MIN_SIDES = 3
# So many sides hold every speed up to 0.05 ppm below v_max: more is a slip of the pen, and would take all memory.
MAX_SIDES, MAX_FACES = 10_000, 20_000


@formula
def is_within_speed(x: float, y: float, limit: float) -> bool:
    """Is a velocity within the speed limit?"""
    return x * x + y * y <= limit * limit


@formula
def add_polygon_rows(
    rows: RowLabels, count: int, sides: FloatArray, v_max: float, cosine: float, sine: float
) -> int:
    """Write the sides of the polygon of allowed velocities; returns the new count.

    ``sides`` holds (inward n_x, inward n_y, offset) for a speed limit of 1, shape (3, S); it is scaled by ``v_max``
    and turned by the angle given by its cosine and sine.
    """
    for k in range(sides.shape[1]):
        rows.array[0, count] = cosine * sides[0, k] - sine * sides[1, k]
        rows.array[1, count] = sine * sides[0, k] + cosine * sides[1, k]
        rows.array[2, count] = sides[2, k] * v_max
        rows.label[0, count] = 0
        rows.label[1, count] = k
        count += 1
    return count


class Counted(Protocol):
    """A `Scene`, or `Worlds`."""

    @property
    def num_robots(self) -> int:
        """Number of all robots."""


class Holonomic:
    """A robot that can take any velocity up to ``v_max``, at once.

    Attributes:
        name: ``allowed_velocities``.
        tracking_error: How far off its velocity's course a robot may be, in m: not at all.
        omega_max: Largest turn rate, in rad/s: discs that take any velocity need not turn.
        is_uniform: Is there one ``v_max`` for all robots?
        dimension: d: 2 in the plane, 3 in space.
        sides: Sides of the polygon or faces of the polyhedron, shape (d + 1, S): inward normal and offset for a disc or
            ball of radius 1.
        inner_radius: Radius of the circle or sphere inside them, for a disc or ball of radius 1.

    Example:
        >>> drone = Holonomic(v_max=2.0, dimension=3)
        >>> drone.sides.shape, round(drone.inner_radius, 3)
        ((4, 320), 0.982)
    """

    name = "allowed_velocities"
    tracking_error = 0.0
    omega_max = 0.0

    def __init__(
        self, v_max: npt.ArrayLike, sides: int = 64, *, dimension: int = PLANE, faces: int = 320
    ) -> None:
        """Check the settings.

        Args:
            v_max: Largest speed in m/s: one for all robots of a scene, or one a robot, shape (N,). Every cooperating
                robot must keep to it.
            sides: Sides of the polygon; it holds every speed up to ``cos(pi / sides) * v_max``, 0.9988 for 64.
            dimension: 2 for robots in the plane, 3 for robots in space, such as drones.
            faces: Faces of the polyhedron in space: 20, 80, 180, 320, ..., 20 n^2. It holds every speed up to 0.795,
                0.934, 0.972, 0.982 times ``v_max``, and ``v_max`` itself along the axes if n is even.

        Raises:
            ShapeError: If ``v_max`` is neither a number nor of shape (N,).
            NotFinite: If it is NaN or infinite.
            OutOfRange: If it is not above zero, there are fewer than 3 sides or more than `MAX_SIDES`, robots are to
                live in neither plane nor space, no polyhedron has so many faces, or they are more than `MAX_FACES`.
            InvalidInput: If the number of sides, dimensions or faces is no integer.
        """
        given = number_array(v_max, "v_max", "a number or shape (N,)")
        if given.ndim > 1:
            raise ShapeError(f"v_max: expected a number or shape (N,), got {given.shape}")
        limits = per_robot(given, "v_max", given.size)
        self._v_max = frozen(require_positive(limits, "v_max"))
        self.is_uniform = given.ndim == 0
        sides = whole_number(sides, "sides", MIN_SIDES)
        if sides > MAX_SIDES or whole_number(faces, "faces", NUM_TRIANGLES) > MAX_FACES:
            raise OutOfRange(
                f"sides, faces: expected up to {MAX_SIDES} and {MAX_FACES}, got {sides} and {faces}"
            )
        self.dimension = whole_number(dimension, "dimension", PLANE)
        if self.dimension > SPACE:
            raise OutOfRange(f"dimension: expected 2 (plane) or 3 (space), got {dimension}")
        parts = math.isqrt(faces // NUM_TRIANGLES)
        if NUM_TRIANGLES * parts * parts != faces:
            raise OutOfRange(f"faces: expected 20 n^2, such as 80 or 320, got {faces}")
        if self.dimension == SPACE:
            self.sides, self.inner_radius = inscribed_polyhedron(parts)
            return
        # Corners at multiples of 2 pi / sides, so that full speed along the axes stays allowed.
        angle = (np.arange(sides) + 0.5) * (2.0 * math.pi / sides)
        self.inner_radius = math.cos(math.pi / sides)
        self.sides = frozen(
            np.stack([-np.cos(angle), -np.sin(angle), np.full(sides, -self.inner_radius)])
        )

    @property
    def top_speed(self) -> float:
        """Largest speed of any robot, in m/s."""
        return float(self._v_max.max())

    def v_max(self, scene: Counted) -> FloatArray:
        """Largest speed of each robot of a scene, or of worlds, shape (N,), in m/s.

        Raises:
            ShapeError: If ``v_max`` was given for another number of robots.
        """
        if self.is_uniform:
            return np.full(scene.num_robots, self._v_max[0])
        if len(self._v_max) != scene.num_robots:
            raise ShapeError(
                f"v_max: given for {len(self._v_max)} robots, but the scene has {scene.num_robots}"
            )
        return self._v_max.copy()

    def speed_limit(self, scene: Counted) -> FloatArray:
        """Bound on each robot's executed speed, shape (N,), in m/s: ``v_max`` and the rounding let through."""
        return self.v_max(scene) * (1.0 + SPEED_SLACK)

    @property
    def drive(self) -> Drive:
        """What kernels need to know of how velocities become actions: nothing, they are actions."""
        return NO_DRIVE
