"""A convex polygon inside the set S_AHV of velocities that a differential drive can track.

S_AHV is a wide sector ahead and little behind; it is not convex, and its hull breaks the error bound. Polygons of a
family (an arc ahead, a corner on each side and some behind) are pulled in until they fit; the largest is taken.

Letters: S sides. m/s, rad. Source: Alonso-Mora et al., 2013, section on P_AHV.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.spatial import ConvexHull

from safefilter.arrays import BoolArray, FloatArray, frozen
from safefilter.errors import OutOfRange

# Directions in which a polygon is checked to lie inside the rim.
CHECKED_DIRECTIONS = 2880
ARC_CORNERS = 17
HALF_ARCS = np.linspace(0.05, 0.5 * math.pi, 30)
PULLS = (0.2, 0.4, 0.6, 0.8, 1.0)


def inscribed_polygon(rim: Callable[[float], float], v_max: float) -> tuple[FloatArray, float]:
    """Find the polygon.

    Args:
        rim: Largest speed at an angle from the heading, in m/s.
        v_max: Largest speed of all, in m/s.

    Returns:
        (sides, inner_radius) for a speed of 1 and heading 0, as in `Holonomic`.

    Raises:
        OutOfRange: If no polygon of the family fits.
    """
    direction = np.linspace(-math.pi, math.pi, CHECKED_DIRECTIONS, endpoint=False)
    speeds = np.array([rim(angle) for angle in direction])
    hulls = [ConvexHull(_corners(rim, half_arc, pull)) for half_arc in HALF_ARCS for pull in PULLS]
    fitting = [hull for hull in hulls if _fits(hull, direction, speeds)]
    if not fitting:
        raise OutOfRange(
            'tracking_error: it leaves no polygon of velocities; raise it, or use mapping="cut"'
        )
    equations = np.unique(max(fitting, key=lambda hull: float(hull.volume)).equations, axis=0)
    sides = np.stack([-equations[:, 0], -equations[:, 1], equations[:, 2] / v_max])
    return frozen(sides), float(-sides[2].max())


def _corners(rim: Callable[[float], float], half_arc: float, pull: float) -> FloatArray:
    ahead = np.linspace(-half_arc, half_arc, ARC_CORNERS)
    behind = math.pi * np.array([-0.75, 0.75, 1.0, 0.5, -0.5])
    angle = np.concatenate([ahead, behind])
    scale = np.concatenate([np.ones(ARC_CORNERS), np.full(len(behind), pull)])
    speed = scale * np.array([rim(float(a)) for a in angle])
    return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=1)


def _fits(hull: ConvexHull, direction: FloatArray, speeds: FloatArray) -> bool:
    """Is the origin inside the hull, and the hull inside the rim in every direction?"""
    normals, offsets = hull.equations[:, :2], -hull.equations[:, 2]
    if not (offsets > 0.0).all():
        return False
    along = np.stack([np.cos(direction), np.sin(direction)], axis=1) @ normals.T
    is_ahead: BoolArray = along > 0.0
    reach = np.where(is_ahead, offsets / np.where(is_ahead, along, 1.0), np.inf).min(axis=1)
    return bool((reach <= speeds * (1.0 + 1e-9)).all())
