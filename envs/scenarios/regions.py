"""Regions: places that a scenario file names, and how robots are drawn from them.

Letters: N robots. SI units; x points east, y north.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs.scenarios.scenario import jitter
from envs.scenarios.schema import AnyOf, Disc, Grid, Rectangle, Region
from envs.scenarios.shapes import box, turned
from envs.scenarios.wall_kernel import wall_distances
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput

# A region so full that a thousand draws find no place is a fault of the file.
MAX_DRAWS = 1000


@dataclass(frozen=True, slots=True)
class Place:
    """Where one robot may be put.

    Attributes:
        region: As the file has it.
        number: Number of the robot in its group: which place of a grid it takes.
        angle: By which the region is turned about the origin, in rad.
    """

    region: Region
    number: int
    angle: float

    @property
    def is_fixed(self) -> bool:
        """Is it one point?"""
        return _is_fixed(self.region)

    def draw(self, rng: np.random.Generator) -> FloatArray:
        """One point of it, shape (2,), in units of the file."""
        return turned(_draw(self.region, self.number, rng), self.angle)

    def outlines(self) -> list[FloatArray]:
        """Corners of all that a robot may be put on, each of shape (K, 2), in units of the file; for pictures."""
        return [turned(corners, self.angle) for corners in _outlines(self.region, self.number)]


@dataclass(frozen=True, slots=True)
class Gaps:
    """How far apart places are drawn.

    Attributes:
        robots: Least distance of centres, in m.
        walls: Least distance of centres from walls, in m.
    """

    robots: float
    walls: float


def draw_places(
    places: Sequence[Place], walls: FloatArray, gaps: Gaps, scale: float, rng: np.random.Generator
) -> FloatArray:
    """Draw a point from each place, apart from each other and clear of walls.

    Points that leave nothing to chance are taken as they are, even if robots share them: goals of RVO2's examples
    are shared.

    Args:
        places: One a robot.
        walls: Segments, shape (S, 2, 2), in m.
        gaps: What to keep.
        scale: Length of the file's unit, in m.
        rng: Source of chance.

    Returns:
        Shape (N, 2), in m.

    Raises:
        InvalidInput: If there is no room.
    """
    points = np.full((len(places), 2), np.nan)
    for i, place in enumerate(places):
        if place.is_fixed:
            points[i] = scale * place.draw(rng)
    for i, place in enumerate(places):
        if place.is_fixed:
            continue
        for _ in range(MAX_DRAWS):
            point = scale * place.draw(rng)
            distance = np.hypot(*(points - point).T)
            # Places not drawn yet are NaN, and so never too near.
            if not (distance < gaps.robots).any() and _is_clear(point, walls, gaps.walls):
                points[i] = point
                break
        else:
            raise InvalidInput(
                f"robot {i}: {MAX_DRAWS} draws from {place.region!r} found no place {gaps.robots} m from other "
                f"robots and {gaps.walls} m from walls; make the region larger or the gaps smaller"
            )
    return points


def _is_clear(point: FloatArray, walls: FloatArray, gap: float) -> bool:
    return bool(wall_distances(point[np.newaxis], walls)[0] >= gap)


def _is_fixed(region: Region) -> bool:
    if isinstance(region, Grid):
        return region.jitter is None
    return isinstance(region, tuple)


def _draw(region: Region, number: int, rng: np.random.Generator) -> FloatArray:
    match region:
        case Disc():
            return np.asarray(region.at + jitter(rng, 1, region.jitter)[0])
        case Rectangle():
            return np.asarray(rng.uniform(*np.sort(region.box, axis=0)))
        case Grid():
            spread = 0.0 if region.jitter is None else jitter(rng, 1, region.jitter)[0]
            return np.asarray(_grid_point(region, number) + spread)
        case AnyOf():
            return _draw(region.any_of[rng.integers(len(region.any_of))], number, rng)
        case _:
            return np.array(region)


def _grid_point(grid: Grid, number: int) -> FloatArray:
    row, column = divmod(number, grid.columns)
    return np.array(grid.first) + np.array([column, row]) * grid.step


def _outlines(region: Region, number: int) -> list[FloatArray]:
    match region:
        case Disc():
            return [_disc(np.array(region.at), region.jitter)]
        case Rectangle():
            return [box(*region.box)[:, 0]]
        case Grid():
            return [_disc(_grid_point(region, number), region.jitter or 0.0)]
        case AnyOf():
            return [outline for part in region.any_of for outline in _outlines(part, number)]
        case _:
            return [np.array([region])]


def _disc(centre: FloatArray, radius: float) -> FloatArray:
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    return centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
