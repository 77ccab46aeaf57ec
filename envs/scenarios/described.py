"""A scenario that a file describes.

Letters: N robots, S walls, K waypoints. SI units; x points east, y north.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from envs.crowd import Crowd
from envs.fleet import MAX_SPEED
from envs.rules import Rules
from envs.scenarios.regions import Gaps, Place, draw_places
from envs.scenarios.scenario import Placement, chain
from envs.scenarios.schema import (
    Choice,
    CorridorWall,
    CrossingWall,
    Group,
    Span,
    Specification,
    UShapeWall,
    Wall,
)
from envs.scenarios.shapes import box, corridor, crossing, outline, turned_copies, u_shape
from envs.walls import NO_WALLS
from safefilter.arrays import FloatArray, frozen


@dataclass(frozen=True, slots=True)
class Member:
    """One robot of a group.

    Attributes:
        group: As the file has it.
        number: Of the robot within one copy of the group.
        angle: By which that copy is turned about the origin, in rad.
    """

    group: Group
    number: int
    angle: float

    @property
    def start(self) -> Place:
        """Where it may start."""
        return Place(self.group.start, self.number, self.angle)

    @property
    def goal(self) -> Place:
        """Where it may want to go."""
        return Place(self.group.goal, self.number, self.angle)


@dataclass(frozen=True, slots=True, eq=False)
class DescribedScenario:
    """Places robots as a file says. Build it with `load_scenario`, or from a `Specification` made in Python.

    Attributes:
        specification: What the file says.
        members: The N robots: group after group, copy after copy.
        walls: Segments, shape (S, 2, 2), in m, the same in all worlds.
        waypoints: Corners of shortest ways, shape (K, 2), in m, for policies that plan.
        half_extent: Half the side of a square around the origin that holds all starts, goals and walls, in m.
    """

    specification: Specification
    members: tuple[Member, ...]
    walls: FloatArray
    waypoints: FloatArray
    half_extent: float

    @classmethod
    def of(cls, specification: Specification) -> DescribedScenario:
        """Lay out what a specification says."""
        members = tuple(
            Member(group, number, 2.0 * math.pi * turn / group.turns)
            for group in specification.robots
            for turn in range(group.turns)
            for number in range(group.count)
        )
        kind = Peopled if any(member.group.people for member in members) else cls
        scale = specification.scale
        walls = scale * np.concatenate([NO_WALLS, *map(_segments, specification.walls)])
        areas = [
            scale * corners
            for member in members
            for place in (member.start, member.goal)
            for corners in place.outlines()
        ]
        return kind(
            specification=specification,
            members=members,
            walls=frozen(walls),
            waypoints=frozen(scale * np.array(specification.waypoints).reshape(-1, 2)),
            half_extent=max(
                float(np.abs(points).max()) for points in (walls, *areas) if points.size
            ),
        )

    @property
    def name(self) -> str:
        """What the scenario is called in tables and pictures."""
        return self.specification.name

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return len(self.members)

    @property
    def rules(self) -> Rules:
        """The rules that the layout was made for."""
        said = self.specification.rules.model_dump(exclude_none=True)
        return Rules(**said)

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts, goals, speeds and priorities.

        Raises:
            InvalidInput: If a region has no room for its robots.
        """
        said = self.specification
        gaps = Gaps(said.scale * said.least_gap, said.scale * said.wall_gap)
        starts, goals = zip(*((member.start, member.goal) for member in self.members), strict=True)
        start = draw_places(starts, self.walls, gaps, said.scale, rng)
        goal = draw_places(goals, self.walls, gaps, said.scale, rng)
        return Placement(
            start=start,
            goal=goal,
            walls=self.walls,
            heading=self._heading(start, goal),
            v_max=self._drawn(
                [member.group.v_max for member in self.members], MAX_SPEED, rng.uniform
            ),
            priority=self._drawn(
                [member.group.priority for member in self.members],
                1.0,
                lambda low, high: math.exp(rng.uniform(math.log(low), math.log(high))),
            ),
        )

    def _heading(self, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        said = [member.group.heading for member in self.members]
        if all(heading is None for heading in said):
            return None
        ahead = goal - start
        heading = np.arctan2(ahead[:, 1], ahead[:, 0])
        for i, (member, degrees) in enumerate(zip(self.members, said, strict=True)):
            if degrees is not None:
                heading[i] = math.radians(degrees) + member.angle
        return heading

    @staticmethod
    def _drawn(
        choices: list[Choice | None], default: float, draw: Callable[[float, float], float]
    ) -> FloatArray | None:
        """A number for each robot, or None where the file leaves all to the fleet."""
        if all(choice is None for choice in choices):
            return None
        return np.array([
            draw(choice.low, choice.high)
            if isinstance(choice, Span)
            else (default if choice is None else choice)
            for choice in choices
        ])


class Peopled(DescribedScenario):
    """One with people among its robots."""

    __slots__ = ()

    @property
    def crowd(self) -> Crowd:
        """Which robots are people, and how they move."""
        people = [i for i, member in enumerate(self.members) if member.group.people]
        said = self.specification.crowd.model_dump(exclude_none=True)
        return Crowd(np.array(people), **said)


def _segments(wall: Wall) -> FloatArray:
    """Segments of a wall and its copies, shape (S, 2, 2), in units of the file."""
    shape = wall.shape
    match shape:
        case UShapeWall():
            segments = u_shape(
                shape.at,
                opens=math.radians(shape.opens),
                width=shape.width,
                depth=shape.depth,
                thickness=shape.thickness,
            )
        case CrossingWall():
            segments = crossing(shape.road_width, shape.arm_length)
        case CorridorWall():
            segments = corridor(shape.ends, width=shape.width, thickness=shape.thickness)
        case _ if wall.path:
            segments = chain(*shape)
        case _ if wall.polygon:
            segments = outline(shape)
        case first, second:
            segments = box(first, second)
    return turned_copies(segments, wall.turns)
