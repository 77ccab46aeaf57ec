"""Scenarios that the simulator is timed in: pairs of robots, and walls that nobody comes near."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from envs import Crossroad
from envs.scenarios import Placement

NUM_ROBOTS = 8
NEAREST_FAR_WALL, FURTHEST_FAR_WALL = 10.0, 30.0  # m from the middle; lidars reach 3.5 m
PAIR_DISTANCE = 8.0  # m; robots see 3 m far, and their lidars 3.5 m


@dataclass(frozen=True, slots=True)
class Pairs:
    """Pairs of robots that pass each other, out of reach of all other pairs: the same work a robot in every number.

    Attributes:
        num_robots: An even number.
    """

    num_robots: int
    name: str = "pairs"

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts and goals, in m."""
        return PAIR_DISTANCE * (1 + math.isqrt(self.num_robots // 2)) / 2.0

    def place(self, rng: np.random.Generator) -> Placement:  # noqa: ARG002  # nothing is drawn
        """Robots 2 m from each other, on lanes 0.5 m apart, pair after pair on a square."""
        pair, side = np.arange(self.num_robots) // 2, 1 + math.isqrt(self.num_robots // 2)
        middle = PAIR_DISTANCE * (np.stack([pair % side, pair // side], axis=1) - (side - 1) / 2.0)
        first = np.where(np.arange(self.num_robots) % 2 == 0, -1.0, 1.0)
        lane = np.stack([np.zeros(self.num_robots), 0.25 * first], axis=1)
        along = np.stack([first, np.zeros(self.num_robots)], axis=1)
        return Placement(start=middle + lane + along, goal=middle + lane - along)


@dataclass(frozen=True, slots=True)
class WithFarWalls:
    """The walled crossroad, and short walls all around that nobody ever comes near.

    Attributes:
        num_far: How many.
        is_listed_around: Are they listed as maps list them, beside each other those that are? In no order otherwise.
    """

    num_far: int
    is_listed_around: bool = True
    name: str = "crossroad among far walls"
    num_robots: int = NUM_ROBOTS
    half_extent: float = FURTHEST_FAR_WALL + 1.0

    @property
    def about(self) -> str:
        """In words."""
        return f"{self.num_far} walls far away{'' if self.is_listed_around else ', in no order'}"

    def place(self, rng: np.random.Generator) -> Placement:
        """The crossroad's placement; the walls far away are the same in every world."""
        placement = Crossroad(is_walled=True).place(rng)
        far = np.random.default_rng(0)
        angle = far.uniform(0.0, 2.0 * np.pi, self.num_far)
        angle = np.sort(angle) if self.is_listed_around else angle
        away = far.uniform(NEAREST_FAR_WALL, FURTHEST_FAR_WALL, self.num_far)
        middle = away[:, np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        half = far.uniform(-0.5, 0.5, (self.num_far, 2))
        walls = np.stack([middle - half, middle + half], axis=1)
        return replace(placement, walls=np.concatenate([placement.walls, walls]))
