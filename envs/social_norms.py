"""Eq. (14) of Qin et al.: whose social norm area overlaps another's.

Letters: W worlds, N robots a world, K corners of an area. SI units.
"""

from __future__ import annotations

import numpy as np

from envs.norm_area import NormArea
from safefilter.arrays import BoolArray, FloatArray, finite_array
from safefilter.errors import ShapeError
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges


def norm_overlaps(
    position: FloatArray, facing: FloatArray, present: BoolArray, area: NormArea
) -> BoolArray:
    """Whose area overlaps that of any other robot in its world: the condition of Eq. (14).

    Areas are closed: those that touch overlap, up to rounding. A robot that faces nowhere (a holonomic one that has
    never moved) has no area.

    Args:
        position: Centres, shape (W, N, 2), in m.
        facing: Unit vectors forward, shape (W, N, 2); zero is nowhere.
        present: Shape (W, N): robots with a body.
        area: Around every robot.

    Returns:
        Shape (W, N).

    Raises:
        ShapeError: If the shapes do not belong together.
        NotFinite: If a number is NaN or infinite.
    """
    position = finite_array(position, "position", ("W", "N", 2))
    facing = finite_array(facing, "facing", position.shape)
    present = _flags(present, "present", position.shape[:-1])
    overlaps = np.zeros(present.shape, dtype=np.bool_)
    corners, normals, distances = area.corners, area.edge_normals, area.edge_distances

    def judge(first: int, last: int) -> None:
        _judge_worlds(
            first,
            last,
            position,
            facing,
            present,
            corners,
            normals,
            distances,
            2.0 * area.circumradius,
            overlaps,
        )

    over_ranges(judge, len(position))
    return overlaps


def _flags(value: BoolArray, field: str, shape: tuple[int, ...]) -> BoolArray:
    flags = np.ascontiguousarray(value, dtype=np.bool_)
    if flags.shape != shape:
        raise ShapeError(f"{field}: expected shape {shape}, got {flags.shape}")
    return flags


@formula
def edge_separates(  # noqa: PLR0917  # a compiled formula takes plain numbers
    corners: FloatArray,
    normals: FloatArray,
    distances: FloatArray,
    x: float,
    y: float,
    cosine: float,
    sine: float,
) -> bool:
    """Does an edge of an area have all of another area outside?

    Two convex polygons are apart if and only if this holds for an edge of the one or of the other (separating axes).

    Args:
        corners: Of both areas in their own axes, shape (K, 2), in m.
        normals: Outward, of their edges, shape (K, 2).
        distances: Of their edges from the centre, shape (K,), in m.
        x: Centre of the other area in the axes of the first, in m.
        y: The same.
        cosine: Of the angle by which the other is turned.
        sine: The same.
    """
    for edge in range(len(normals)):
        n_x, n_y = normals[edge, 0], normals[edge, 1]
        # The normal in the axes of the other, where its corners are constant.
        m_x, m_y = cosine * n_x + sine * n_y, cosine * n_y - sine * n_x
        least = m_x * corners[0, 0] + m_y * corners[0, 1]
        for corner in range(1, len(corners)):
            least = min(least, m_x * corners[corner, 0] + m_y * corners[corner, 1])
        if n_x * x + n_y * y + least > distances[edge]:
            return True
    return False


@kernel
def _judge_worlds(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    facing: FloatArray,
    present: BoolArray,
    corners: FloatArray,
    normals: FloatArray,
    distances: FloatArray,
    reach: float,
    overlaps: BoolArray,
) -> None:
    num_robots = position.shape[1]
    for w in range(first_world, last_world):
        for i in range(num_robots):
            c_i, s_i = facing[w, i, 0], facing[w, i, 1]
            if not present[w, i] or (c_i == 0.0 and s_i == 0.0):
                continue
            for j in range(i + 1, num_robots):
                x = position[w, j, 0] - position[w, i, 0]
                y = position[w, j, 1] - position[w, i, 1]
                if x * x + y * y > reach * reach or not present[w, j]:
                    continue
                c_j, s_j = facing[w, j, 0], facing[w, j, 1]
                if (c_j == 0.0 and s_j == 0.0) or (overlaps[w, i] and overlaps[w, j]):
                    continue
                cosine, sine = c_i * c_j + s_i * s_j, c_i * s_j - s_i * c_j
                if edge_separates(
                    corners,
                    normals,
                    distances,
                    c_i * x + s_i * y,
                    c_i * y - s_i * x,
                    cosine,
                    sine,
                ):
                    continue
                if edge_separates(
                    corners,
                    normals,
                    distances,
                    -c_j * x - s_j * y,
                    s_j * x - c_j * y,
                    cosine,
                    -sine,
                ):
                    continue
                overlaps[w, i] = True
                overlaps[w, j] = True
