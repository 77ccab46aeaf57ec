"""A polyhedron inscribed in the ball of speeds: what a polygon is to the disc.

An icosahedron with each of its 20 triangles cut into ``parts^2`` small ones, whose corners are moved out onto the
sphere: a geodesic sphere. Its faces are spread evenly, which is what keeps the loss small for their number.

Letters: S faces.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from safefilter.arrays import FloatArray, frozen

GOLDEN_RATIO = 0.5 * (1.0 + math.sqrt(5.0))
NUM_TRIANGLES = 20


def inscribed_polyhedron(parts: int) -> tuple[FloatArray, float]:
    """Cut each edge of an icosahedron into so many parts.

    Args:
        parts: From 1 up; with an even number there are corners on the axes, so full speed along them stays allowed.

    Returns:
        (sides, inner_radius) for a ball of radius 1: faces by inward normal and offset, shape (4, S), S = 20 parts^2;
        and the radius of the sphere inside all of them.
    """
    corners = np.concatenate([_small_triangles(triangle, parts) for triangle in _icosahedron()])
    corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    distance = np.einsum("sk,sk->s", normals, corners[:, 0])
    inward = -np.sign(distance)[:, np.newaxis] * normals
    sides = np.concatenate([inward.T, -np.abs(distance)[np.newaxis]])
    return frozen(sides), float(np.abs(distance).min())


def _icosahedron() -> FloatArray:
    """Its triangles, shape (20, 3, 3): whatever three corners are an edge apart from each other."""
    corners = np.array([
        np.roll([0.0, a, b * GOLDEN_RATIO], turn)
        for turn in range(3)
        for a in (-1.0, 1.0)
        for b in (-1.0, 1.0)
    ])
    edge = 2.0
    is_triangle = [
        triple
        for triple in itertools.combinations(range(len(corners)), 3)
        if all(
            np.linalg.norm(corners[i] - corners[j]) < 1.1 * edge
            for i, j in itertools.combinations(triple, 2)
        )
    ]
    triangles: FloatArray = corners[np.array(is_triangle)]
    return triangles


def _small_triangles(triangle: FloatArray, parts: int) -> FloatArray:
    """Cut a triangle by lines along its edges, shape (parts^2, 3, 3)."""
    a, b, c = triangle

    def corner(i: int, j: int) -> FloatArray:
        point: FloatArray = a + (i * (b - a) + j * (c - a)) / parts
        return point

    small = []
    for i in range(parts):
        for j in range(parts - i):
            small.append([corner(i, j), corner(i + 1, j), corner(i, j + 1)])
            if i + j < parts - 1:
                small.append([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)])
    return np.array(small)
