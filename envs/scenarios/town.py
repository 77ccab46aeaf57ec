"""Town: streets to train in, and others to test in.

The paper trains in "a simulated town with multiple intersections and many obstacles" (Fig. 4(b)) and prints no plan
of it. Maps are drawn by `town_map`; traffic is drawn anew in every episode: robots with an obstacle ahead, robots that
meet head-on or at a crossing, fast ones behind slow ones, and others that go anywhere.

Letters: N robots. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from envs.fleet import MAX_SPEED
from envs.rules import Rules
from envs.scenarios import town_obstacles
from envs.scenarios.scenario import Placement, jitter
from envs.scenarios.town_cells import PITCH
from envs.scenarios.town_map import BLOCK_SHARE, TownMap, town_map
from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import InvalidInput, OutOfRange

Split = Literal["training", "held-out"]

JITTER = 0.1
"""Starts and goals are this far from the middle of a cell at most, in m."""
AVENUE_JITTER = 0.28
"""The same on avenues, across whose whole width they lie: 0.065 m are left to the walls of the narrowest at least."""
SLOW_SHARE = (0.15, 0.25)
"""Part of the robots that are slow, from the least to the greatest."""
SLOW_SPEED = (0.08, 0.12)
"""Their greatest speeds, in m/s."""
PRIORITIES = (1.0, 16.0)
"""Least and greatest priority; drawn evenly over ratios."""
NEAREST_GOAL = 2
"""Goals are at least so many cells away."""
FURTHEST_GOAL = 6
"""Goals of robots that meet, or overtake, are at most so many cells away."""
MEETING_SHARE = 0.6
"""Part of the draws that are for robots that meet: head-on, overtaking and at a crossing alike."""
MAX_DRAWS = 50
"""Draws for robots that meet, until single ones fill the town up."""
TIME_LIMIT = 200.0
"""In s: enough for 16 m at the least speed; ways through the mazes of eight robots are some 13 m at most."""
MOST_OBSTRUCTED = 0.5
"""Part of the robots, at most, on whose straight way to the goal something stands on purpose."""


@dataclass(frozen=True, slots=True)
class Trip:
    """Where one robot goes.

    Attributes:
        start: Cell.
        goal: Cell.
        is_overtaken: A faster robot starts behind it.
        overtakes: It starts behind a slower robot.
    """

    start: int
    goal: int
    is_overtaken: bool = False
    overtakes: bool = False


@dataclass(frozen=True, slots=True)
class Town:
    """A map, and traffic on it, drawn for each episode.

    Attributes:
        num_robots: Number of robots N, at least 2.
        split: Which maps: those to train in have even numbers, those to test in odd ones. None is in both.
        num_maps: Number of maps of the split.
        has_deep_traps: May there be traps 0.8 m to 1.2 m deep?
    """

    num_robots: int = 8
    split: Split = "training"
    num_maps: int = 160
    has_deep_traps: bool = True

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OutOfRange: If there are fewer than two robots, or no map.
            InvalidInput: If there is no such split.
        """
        if self.num_robots < 2:
            raise OutOfRange(f"num_robots: expected 2 or more, got {self.num_robots}")
        if self.num_maps < 1:
            raise OutOfRange(f"num_maps: expected 1 or more, got {self.num_maps}")
        if self.split not in get_args(Split):
            raise InvalidInput(
                f"split: expected one of {', '.join(get_args(Split))}, got {self.split!r}"
            )

    @property
    def name(self) -> str:
        """What the scenario is called in tables and pictures."""
        return "town" if self.split == "training" else "town, held out"

    @property
    def size(self) -> int:
        """Cells along each side: streets for all starts, twice over, beside blocks and obstacles."""
        streets = 1.0 - BLOCK_SHARE - town_obstacles.SHARE
        return max(4, math.ceil(math.sqrt(1.8 * self.num_robots / streets)))

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts, goals and walls, in m."""
        return self.size * PITCH / 2.0

    @property
    def rules(self) -> Rules:
        """Rules that are recommended: time for twice the longest way at the least speed."""
        return Rules(time_limit=TIME_LIMIT)

    def map_number(self, draw: int) -> int:
        """Number of a map of this split: even to train in, odd to test in.

        Args:
            draw: Which of its maps, from 0 on.
        """
        return 2 * draw + (self.split == "held-out")

    def map(self, draw: int) -> TownMap:
        """One of the maps of this split.

        Args:
            draw: Which, from 0 up to ``num_maps``.
        """
        return town_map(
            self.map_number(draw),
            self.size,
            has_deep_traps=self.has_deep_traps,
            # Starts and goals are all different, and so is the last one's start from its goal.
            least_streets=self.num_robots + 1,
        )

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw a map, and trips on it."""
        town = self.map(int(rng.integers(self.num_maps)))
        trips = _trips(rng, town, self.num_robots)
        start = town.centres[[trip.start for trip in trips]]
        goal = town.centres[[trip.goal for trip in trips]]
        low, high = np.log(PRIORITIES)
        radius = AVENUE_JITTER if town.has_avenues else JITTER
        return Placement(
            start=start + jitter(rng, self.num_robots, radius),
            goal=goal + jitter(rng, self.num_robots, radius),
            walls=town.walls,
            v_max=_speeds(rng, trips),
            priority=np.exp(rng.uniform(low, high, self.num_robots)),
        )


def _trips(rng: np.random.Generator, town: TownMap, num_robots: int) -> list[Trip]:
    """Trips whose starts are all in different cells, and so are their goals."""
    trips: list[Trip] = []
    num_obstructed = rng.integers(int(MOST_OBSTRUCTED * num_robots) + 1)
    # Those across a square first: there is one at most, and it is the hardest place.
    ends = [*_shuffled(rng, town.across_square), *_shuffled(rng, town.obstructed)]
    for start, goal in ends[:num_obstructed]:
        trip = [Trip(start, goal)]
        if _is_room(town, trips, trip):
            trips += trip
    for _ in range(MAX_DRAWS):
        if rng.uniform() > MEETING_SHARE or len(trips) > num_robots - 2:
            break
        group = _meeting(rng, town)
        if len(trips) + len(group) <= num_robots and _is_room(town, trips, group):
            trips += group
    # Drawn at every reset: flags of cells take a microsecond, sets of numpy's forty.
    may_start, may_end = town.is_street.copy(), town.is_street.copy()
    may_start[[trip.start for trip in trips]] = False
    may_end[[trip.goal for trip in trips]] = False
    while len(trips) < num_robots:
        start = _drawn(rng, np.flatnonzero(may_start))
        goals = np.flatnonzero(may_end)
        far = goals[town.hops[start, goals] >= NEAREST_GOAL]
        # In a small town all that is left may be near, but the same cell is no trip.
        goal = _drawn(rng, far if len(far) else goals[goals != start])
        may_start[start] = may_end[goal] = False
        trips.append(Trip(start, goal))
    return trips


def _shuffled(rng: np.random.Generator, trips: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Trips in random order."""
    return [trips[number] for number in rng.permutation(len(trips)).tolist()]


def _drawn(rng: np.random.Generator, cells: IntArray) -> int:
    """One of some cells."""
    return int(cells[rng.integers(len(cells))])


def _meeting(rng: np.random.Generator, town: TownMap) -> list[Trip]:
    """Robots that meet; none if the draw is no good."""
    kind = rng.integers(3)
    if kind == 0:
        return _crossing(rng, town)
    first, last = rng.choice(town.streets, 2, replace=False).tolist()
    way = town.way(first, last)
    if not NEAREST_GOAL <= len(way) - 1 <= FURTHEST_GOAL:
        return []
    if kind == 1:
        return [Trip(first, last), Trip(last, first)]
    if len(way) - 1 <= NEAREST_GOAL:
        return []
    return [Trip(first, last, overtakes=True), Trip(way[1], way[-2], is_overtaken=True)]


def _crossing(rng: np.random.Generator, town: TownMap) -> list[Trip]:
    """Robots that come to one cell from all cells around it at once, and go on to where another has come from."""
    middle = _drawn(rng, town.streets)
    around = np.flatnonzero((town.hops[middle] == 1.0) & town.is_street)
    if len(around) < 3:
        return []
    starts = rng.permutation(around)
    return [
        Trip(int(start), int(goal)) for start, goal in zip(starts, np.roll(starts, 1), strict=True)
    ]


def _is_room(town: TownMap, trips: list[Trip], more: list[Trip]) -> bool:
    """Would all cells still be streets, and each the start of one robot, and the goal of one?"""
    both = [*trips, *more]
    starts, goals = {trip.start for trip in both}, {trip.goal for trip in both}
    on_streets = all(town.is_street[cell] for trip in more for cell in (trip.start, trip.goal))
    return len(starts) == len(goals) == len(both) and on_streets


def _speeds(rng: np.random.Generator, trips: list[Trip]) -> FloatArray:
    """Greatest speeds, shape (N,), in m/s: those who are overtaken are slow, those who overtake are not."""
    v_max = np.full(len(trips), MAX_SPEED)
    num_slow = max(1, round(rng.uniform(*SLOW_SHARE) * len(trips)))
    slow = [i for i, trip in enumerate(trips) if trip.is_overtaken]
    others = [i for i, trip in enumerate(trips) if not (trip.is_overtaken or trip.overtakes)]
    slow += rng.permutation(others).tolist()
    chosen = slow[: max(num_slow, sum(trip.is_overtaken for trip in trips))]
    v_max[chosen] = rng.uniform(*SLOW_SPEED, len(chosen))
    return v_max
