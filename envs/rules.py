"""Rules: what a step is, what counts as arriving, and what becomes of robots that have.

SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from envs.step_kernel import StepSettings
from safefilter.arrays import positive_number
from safefilter.errors import InvalidInput, OutOfRange


class AfterArrival(Enum):
    """What becomes of a robot at its goal."""

    YIELD = "yield"
    """It stays, wants to stand still and goes on executing actions: a filter may move it out of the way. Others
    may count on that: it keeps its ``cooperative`` flag."""
    PARK = "park"
    """It stands still whatever it is told, like a parked car: not cooperative from then on."""
    VANISH = "vanish"
    """Its body is taken out of the world."""
    REBORN = "reborn"
    """It starts anew where it started, as in the paper's video, as soon as nobody stands there; until then it is
    parked at its goal."""


_POSITIVE = (
    "dt",
    "goal_radius",
    "time_limit",
    "sensing_range",
    "lidar_range",
    "spin_time",
    "spin_distance",
    "spin_angle",
    "birth_gap",
)


@dataclass(frozen=True, slots=True)
class Rules:
    """Rules of an episode, the same in all worlds.

    Attributes:
        dt: Duration of a step, in s.
        goal_radius: A robot has arrived when its centre ends a step this near to its goal, q of Eq. (13), in m.
        time_limit: An episode ends after this time, in s.
        sensing_range: Distance of centres up to which robots see each other, in m.
        after_arrival: What becomes of robots that have arrived.
        wrecks_vanish: Are bodies of robots that have collided taken out of the world?
        num_beams: Beams of each robot's lidar, from which alone it knows walls; 0: all robots have the map.
        lidar_range: Distance up to which beams come back, in m.
        wall_range: Distance up to which ``num_beams`` are looked at, in m; None: all of ``lidar_range``. Walls beyond
            what the horizons of a filter's rows reach, such as 0.4 m at 0.2 m/s, change no decision and cost time.
        spin_time: A robot that is under way at the time limit has rotated in place, as the paper's table counts it, if
            over this time before it
        spin_distance: the way that it drove was shorter than this, in m, and
        spin_angle: the angles that it turned, either way, add up to more than this, in rad.
        birth_gap: Free distance that a start needs to all robots before one is reborn there, in m.
    """

    dt: float = 0.2
    goal_radius: float = 0.12
    time_limit: float = 80.0
    sensing_range: float = 3.0
    after_arrival: AfterArrival = AfterArrival.YIELD
    wrecks_vanish: bool = False
    num_beams: int = 0
    lidar_range: float = 3.5
    wall_range: float | None = None
    spin_time: float = 10.0
    spin_distance: float = 0.2
    spin_angle: float = 2.0 * math.pi
    birth_gap: float = 0.1

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is not above zero, or the number of beams below it.
            InvalidInput: If ``after_arrival`` is not one of its values.
        """
        for field in _POSITIVE:
            positive_number(getattr(self, field), field)
        if self.wall_range is not None:
            positive_number(self.wall_range, "wall_range")
        if self.num_beams < 0:
            raise OutOfRange(f"num_beams: expected 0 or more, got {self.num_beams}")
        if not isinstance(self.after_arrival, AfterArrival):
            raise InvalidInput(
                f"after_arrival: expected one of {list(AfterArrival)}, got {self.after_arrival!r}"
            )

    @property
    def max_steps(self) -> int:
        """Number of steps after which the time is over."""
        # 80 s are 400 steps of 0.2 s, though 80 / 0.2 may come out a rounding above.
        return math.ceil(self.time_limit / self.dt - 1e-9)

    def settings(self, *, drives: bool) -> StepSettings:
        """The numbers of a step, for kernels.

        Args:
            drives: Are robots differential drives?
        """
        return StepSettings(
            dt=self.dt,
            goal_radius=self.goal_radius,
            horizon=self.sensing_range,
            max_steps=self.max_steps,
            spin_steps=math.ceil(self.spin_time / self.dt - 1e-9),
            spin_distance=self.spin_distance,
            spin_angle=self.spin_angle,
            birth_gap=self.birth_gap,
            after_arrival=list(AfterArrival).index(self.after_arrival),
            wrecks_vanish=self.wrecks_vanish,
            drives=drives,
        )
