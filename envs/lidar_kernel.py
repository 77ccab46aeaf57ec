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
from envs.walls import WallArrays, cells_within, entries_of_row
from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula

# In m: beams find no gap between two walls that share an end, though it was rounded differently.
END_SLACK = 1e-12
EDGE_ON = 1e-18
"""A wall whose line passes this near, squared, in m^2, is seen from its edge: between its ends a rounding decides."""
FEW_BEAMS = 64
BUCKETS_PER_BEAM = 2
SMALLEST = 1e-300


class Beams(NamedTuple):
    """Directions of evenly spaced beams, counterclockwise from the heading.

    Attributes:
        cosine: Shape (2 K,).
        sine: Shape (2 K,).
        first: First beam of each equal part of [0, 4] that does not come before it, shape (buckets + 1,).
    """

    cosine: FloatArray
    sine: FloatArray
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
            np.searchsorted(diamond, edges, side="left").astype(np.int64),
        )


@formula
def diamond_angle(x: float, y: float) -> float:
    """Angle of (x, y) as a place on the unit diamond, in quarter turns: 0 along x, 1 along y, up to 4; 0 of nowhere.

    Without branches: which quarter it is comes as a surprise to a processor, again and again.
    """
    part = y / max(abs(x) + abs(y), SMALLEST)
    right = part + 4.0 if part < 0.0 else part
    return 2.0 - part if x < 0.0 else right


@formula
def beams_around(
    beams: Beams, from_x: float, from_y: float, to_x: float, to_y: float
) -> tuple[int, int]:
    """Range of beams that holds all from one direction counterclockwise to another, less than half a turn on.

    Of few beams all: to look at each costs less than to find out which.
    """
    num_beams, num_buckets = len(beams.cosine) // 2, len(beams.first) - 1
    if num_beams <= FEW_BEAMS:
        return 0, num_beams
    start, stop = diamond_angle(from_x, from_y), diamond_angle(to_x, to_y)
    # A part further on either side: rounding may have put the angle into the next one.
    first = beams.first[max(math.floor(start * (0.25 * num_buckets)) - 1, 0)]
    last = beams.first[min(math.floor(stop * (0.25 * num_buckets)) + 2, num_buckets)]
    return first, last + num_beams if stop < start else last


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
    squared, length_squared = cross * cross, w_x * w_x + w_y * w_y
    if squared > furthest * furthest * length_squared or squared <= EDGE_ON * length_squared:
        return
    if cross < 0.0:
        a_x, a_y, b_x, b_y = b_x, b_y, a_x, a_y
    first, last = beams_around(beams, a_x, a_y, b_x, b_y)
    along_x, along_y = w_y / cross, -w_x / cross
    # Slices, for k from 0 on: else numba allows for negative ones, one beam at a time.
    near, u_x, u_y = nearness[first:last], beams.cosine[first:last], beams.sine[first:last]
    for k in range(len(near)):
        is_after_a = a_x * u_y[k] - a_y * u_x[k] >= -END_SLACK
        is_before_b = u_x[k] * b_y - u_y[k] * b_x >= -END_SLACK
        inverse = along_x * u_x[k] + along_y * u_y[k]
        near[k] = max(near[k], inverse if is_after_a & is_before_b else 0.0)


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
        for k in range(len(beams.cosine) // 2):
            nearness[k] = math.inf
        return
    tangent = math.sqrt(outside)
    first, last = beams_around(
        beams,
        p_x * tangent + p_y * radius,
        p_y * tangent - p_x * radius,
        p_x * tangent - p_y * radius,
        p_y * tangent + p_x * radius,
    )
    near, u_x, u_y = nearness[first:last], beams.cosine[first:last], beams.sine[first:last]
    inverse = 1.0 / outside
    for k in range(len(near)):
        ahead = p_x * u_x[k] + p_y * u_y[k]
        beside = p_x * u_y[k] - p_y * u_x[k]
        half_chord_squared = radius * radius - beside * beside
        root = math.sqrt(max(0.0, half_chord_squared))
        is_met = (ahead > 0.0) & (half_chord_squared >= 0.0)
        # (ahead - root) (ahead + root) = outside: the inverse of the near distance, without cancellation.
        near[k] = max(near[k], (ahead + root) * inverse if is_met else 0.0)


@formula
def paint_wall(
    nearness: FloatArray,
    beams: Beams,
    walls: WallArrays,
    s: int,
    x: float,
    y: float,
    cosine: float,
    sine: float,
    furthest: float,
) -> None:
    """Paint wall s."""
    a_x, a_y = walls.segment[s, 0] - x, walls.segment[s, 1] - y
    b_x, b_y = walls.segment[s, 2] - x, walls.segment[s, 3] - y
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
    m = walls.map_of[w]
    start = walls.first_wall[m]
    left, right, bottom, top = cells_within(walls, m, x, y, furthest)
    num_near = (right - left + 1) * (top - bottom + 1)
    if num_near == walls.cells_along[m, 0] * walls.cells_along[m, 1]:
        for s in range(start, start + walls.num_walls[m]):
            paint_wall(nearness, beams, walls, s, x, y, cosine, sine, furthest)
        return
    for row in range(bottom, top + 1):
        first, end = entries_of_row(walls, m, row, left, right)
        for e in range(first, end):
            s = walls.entry[e]
            if stamp[s - start] != number:
                stamp[s - start] = number
                paint_wall(nearness, beams, walls, s, x, y, cosine, sine, furthest)


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
