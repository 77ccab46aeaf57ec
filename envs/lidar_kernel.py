"""Painting walls and robots onto the beams of a lidar: each touches only the beams that it covers.

Everything is seen from the robot: the origin is its centre, x points along its heading, so that the directions of the
beams are the same for all. Along the beam u the line through a and b comes at the distance d with

    1 / d = (u x (b - a)) / (a x b),

which is linear in u: what is nearest has the largest inverse distance, and a beam costs a product. Which beams a thing
covers is told by the diamond angle of its ends, which grows with the angle and needs one division.

Letters: K beams. Beams stand twice in a row, k and k + K the same, so that a span never has to be split. m, rad.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from envs.robot_grid_kernel import RobotGrid, cells_near
from envs.walls import WallArrays, first_and_last_cell
from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula

# Of a quarter turn: beams find no gap between two walls that share an end, though it was rounded differently.
END_SLACK = 1e-10
BUCKETS_PER_BEAM = 2


class Beams(NamedTuple):
    """Directions of evenly spaced beams, counterclockwise from the heading.

    Attributes:
        cosine: Shape (2 K,).
        sine: Shape (2 K,).
        diamond: Diamond angles, rising, shape (K,).
        first: First beam of each equal part of [0, 4] that does not come before it, shape (buckets + 1,).
    """

    cosine: FloatArray
    sine: FloatArray
    diamond: FloatArray
    first: IntArray

    @classmethod
    @functools.cache
    def evenly(cls, num_beams: int) -> Beams:
        """Once round. Kept, for every scan asks."""
        angle = np.arange(num_beams) * (2.0 * math.pi / max(num_beams, 1))
        cosine, sine = np.cos(angle), np.sin(angle)
        # Quarter turns in floating point are off by 1e-16; they are the ends of everything that is symmetric.
        for quarter in range(4):
            if (quarter * num_beams) % 4 == 0 and num_beams:
                place = quarter * num_beams // 4
                cosine[place], sine[place] = (
                    (1.0, 0.0, -1.0, 0.0)[quarter],
                    (0.0, 1.0, 0.0, -1.0)[quarter],
                )
        diamond = np.array([
            diamond_angle(x, y) for x, y in zip(cosine.tolist(), sine.tolist(), strict=True)
        ])
        edges = np.linspace(0.0, 4.0, BUCKETS_PER_BEAM * max(num_beams, 1) + 1)
        return cls(
            np.tile(cosine, 2),
            np.tile(sine, 2),
            diamond,
            np.searchsorted(diamond, edges, side="left").astype(np.int64),
        )


@formula
def diamond_angle(x: float, y: float) -> float:
    """Angle of (x, y) as a place on the unit diamond, in quarter turns: 0 along x, 1 along y, up to 4."""
    if y >= 0.0:
        return y / (x + y) if x > 0.0 else (1.0 - x / (y - x) if y > 0.0 or x < 0.0 else 0.0)
    return 2.0 + y / (x + y) if x < 0.0 else 3.0 + x / (x - y)


@formula
def first_beam_after(beams: Beams, angle: float) -> int:
    """First beam whose diamond angle is not below ``angle``; K if there is none."""
    num_beams, num_buckets = len(beams.diamond), len(beams.first) - 1
    bucket = math.floor(max(angle, 0.0) * (0.25 * num_buckets))
    # One part earlier: rounding may have put the angle into the next one.
    k: int = beams.first[min(max(bucket - 1, 0), num_buckets)]
    while k < num_beams and beams.diamond[k] < angle:
        k += 1
    return k


@formula
def beams_between(
    beams: Beams, from_x: float, from_y: float, to_x: float, to_y: float
) -> tuple[int, int]:
    """Beams from one direction counterclockwise to another, less than half a turn on: first, and one after the last."""
    start, stop = diamond_angle(from_x, from_y), diamond_angle(to_x, to_y)
    first = first_beam_after(beams, start - END_SLACK)
    # The first one strictly beyond: beams on the end itself belong to both of its walls.
    last = first_beam_after(beams, stop + END_SLACK)
    if stop < start:
        last += len(beams.diamond)
    return first, last


@formula
def paint_segment(
    nearness: FloatArray,
    beams: Beams,
    a_x: float,
    a_y: float,
    b_x: float,
    b_y: float,
    furthest: float,
) -> None:
    """Raise the inverse distances of the beams that a wall covers; a wall along a beam is met at the walls it joins."""
    w_x, w_y = b_x - a_x, b_y - a_y
    cross = a_x * b_y - a_y * b_x
    if cross * cross > furthest * furthest * (w_x * w_x + w_y * w_y) or cross == 0.0:
        return
    if cross > 0.0:
        first, last = beams_between(beams, a_x, a_y, b_x, b_y)
    else:
        first, last = beams_between(beams, b_x, b_y, a_x, a_y)
    along_x, along_y = w_y / cross, -w_x / cross
    for k in range(first, last):
        nearness[k] = max(nearness[k], along_x * beams.cosine[k] + along_y * beams.sine[k])


@formula
def paint_disc(
    nearness: FloatArray, beams: Beams, p_x: float, p_y: float, radius: float, furthest: float
) -> None:
    """Raise the inverse distances of the beams that a disc around p covers; within it all are infinite."""
    squared = p_x * p_x + p_y * p_y
    if squared > (furthest + radius) * (furthest + radius):
        return
    outside = squared - radius * radius
    if outside <= 0.0:
        for k in range(len(beams.diamond)):
            nearness[k] = math.inf
        return
    tangent = math.sqrt(outside)
    first, last = beams_between(
        beams,
        p_x * tangent + p_y * radius,
        p_y * tangent - p_x * radius,
        p_x * tangent - p_y * radius,
        p_y * tangent + p_x * radius,
    )
    for k in range(first, last):
        ahead = p_x * beams.cosine[k] + p_y * beams.sine[k]
        beside = p_x * beams.sine[k] - p_y * beams.cosine[k]
        # (ahead - root) (ahead + root) = outside: the inverse of the near distance, without cancellation.
        root = math.sqrt(max(0.0, radius * radius - beside * beside))
        nearness[k] = max(nearness[k], (ahead + root) / outside)


@formula
def paint_walls(
    nearness: FloatArray,
    beams: Beams,
    walls: WallArrays,
    w: int,
    x: float,
    y: float,
    cosine: float,
    sine: float,
    furthest: float,
    stamp: IntArray,
    number: int,
) -> None:
    """Paint the walls of world w that pass through cells within range; ``stamp`` keeps those of this ``number``."""
    size, columns = walls.cell_size[w], walls.cells_along[w, 0]
    left, right = first_and_last_cell(x - furthest, x + furthest, walls.corner[w, 0], size, columns)
    bottom, top = first_and_last_cell(
        y - furthest, y + furthest, walls.corner[w, 1], size, walls.cells_along[w, 1]
    )
    for row in range(bottom, top + 1):
        start = walls.cell_start[w, row * columns + left]
        stop = walls.cell_start[w, row * columns + right + 1]
        for e in range(start, stop):
            s = walls.entry[w, e]
            if stamp[s] == number:
                continue
            stamp[s] = number
            a_x, a_y = walls.segment[w, s, 0] - x, walls.segment[w, s, 1] - y
            b_x, b_y = walls.segment[w, s, 2] - x, walls.segment[w, s, 3] - y
            paint_segment(
                nearness,
                beams,
                cosine * a_x + sine * a_y,
                cosine * a_y - sine * a_x,
                cosine * b_x + sine * b_y,
                cosine * b_y - sine * b_x,
                furthest,
            )


@formula
def paint_robots(
    nearness: FloatArray,
    beams: Beams,
    grid: RobotGrid,
    position: FloatArray,
    radius: FloatArray,
    largest_radius: float,
    w: int,
    i: int,
    cosine: float,
    sine: float,
    furthest: float,
) -> None:
    """Paint the other robots of world w."""
    x, y = position[w, i, 0], position[w, i, 1]
    left, right, bottom, top = cells_near(grid, x, y, furthest + largest_radius)
    for row in range(bottom, top + 1):
        start = grid.cell_start[row * grid.cells_along[0] + left]
        stop = grid.cell_start[row * grid.cells_along[0] + right + 1]
        for e in range(start, stop):
            j = grid.order[e]
            if j != i:
                p_x, p_y = position[w, j, 0] - x, position[w, j, 1] - y
                paint_disc(
                    nearness,
                    beams,
                    cosine * p_x + sine * p_y,
                    cosine * p_y - sine * p_x,
                    radius[w, j],
                    furthest,
                )


@formula
def read_range(nearness: FloatArray, k: int, num_beams: int, furthest: float) -> float:
    """Distance along beam k; infinite where nothing comes back."""
    largest = max(nearness[k], nearness[k + num_beams])
    distance = 1.0 / largest if largest > 0.0 else math.inf
    return distance if distance <= furthest else math.inf
