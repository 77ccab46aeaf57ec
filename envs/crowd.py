"""Crowd: people, or other moving obstacles, who go their way and do not cooperate.

They are robots of the world like all others, discs with a radius and a greatest speed, but their actions are made
here. Nobody is judged by how people get on with each other or with walls; they stop in front of a wall.

Letters: W worlds, N robots a world. SI units. Source of the social force: Helbing and Molnar, "Social force model for
pedestrian dynamics", 1995, with the circular repulsion of Helbing, Farkas and Vicsek, 2000; strengths are scaled down
to the speeds of small robots.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np

from envs.crowd_kernel import CrowdSettings
from safefilter.arrays import BoolArray, IntArray, frozen, positive_number
from safefilter.errors import InvalidInput, OutOfRange


class Motion(Enum):
    """How people move."""

    CONSTANT_VELOCITY = "constant velocity"
    """Straight from start to goal and back, at full speed, whoever is in the way."""
    RANDOM_WALK = "random walk"
    """At full speed in a direction that drifts; a new one where a wall is in the way."""
    SOCIAL_FORCE = "social force"
    """From start to goal and back, pushed away by everyone and by walls."""


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """Who of the robots are people, and how they move.

    Attributes:
        people: Numbers of the robots that are, shape (P,), each once.
        motion: How all of them move.
        drift: Random walk: standard deviation of the direction after a second, in rad.
        turn_radius: A person turns round this near to its start or goal, in m.
        relaxation_time: Social force: time in which people get to their speed, in s.
        strength: Acceleration of the repulsion at contact, in m/s^2.
        fall_off: Distance over which it falls to 1 / e, in m.
    """

    people: IntArray
    motion: Motion = Motion.CONSTANT_VELOCITY
    drift: float = 0.6
    turn_radius: float = 0.12
    relaxation_time: float = 0.5
    strength: float = 0.6
    fall_off: float = 0.15

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is not above zero, or one of a robot below it.
            InvalidInput: If a robot is named twice, or there is no such motion.
        """
        people = np.array(self.people, dtype=np.int64).reshape(-1)
        if (people < 0).any():
            raise OutOfRange(f"people: expected numbers of robots from 0 on, got {people.tolist()}")
        if len(np.unique(people)) != len(people):
            raise InvalidInput(f"people: expected each robot once, got {people.tolist()}")
        if not isinstance(self.motion, Motion):
            raise InvalidInput(f"motion: expected one of {list(Motion)}, got {self.motion!r}")
        for field in ("drift", "turn_radius", "relaxation_time", "strength", "fall_off"):
            positive_number(getattr(self, field), field)
        object.__setattr__(self, "people", frozen(people))

    def flags(self, num_robots: int) -> BoolArray:
        """Which of ``num_robots`` robots are people, shape (N,).

        Raises:
            OutOfRange: If a robot is named that there is not.
        """
        if (self.people >= num_robots).any():
            raise OutOfRange(
                f"people: expected numbers below {num_robots}, got {self.people.tolist()}"
            )
        flags = np.zeros(num_robots, dtype=np.bool_)
        flags[self.people] = True
        return flags

    @property
    def settings(self) -> CrowdSettings:
        """For kernels."""
        return CrowdSettings(
            list(Motion).index(self.motion),
            self.drift,
            self.turn_radius,
            self.relaxation_time,
            self.strength,
            self.fall_off,
        )


@runtime_checkable
class Crowded(Protocol):
    """A scenario with people in it."""

    @property
    def crowd(self) -> Crowd:
        """Who they are, and how they move."""
        ...
