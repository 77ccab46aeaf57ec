"""Uncertainty: by how much what robots know, and what they do, may be off. All bounds are for all robots alike.

A scene then need not be exact, nor the same for everyone: `Separation` keeps robots apart wherever these bounds hold.
Standing still is exact: a robot that is told to stand has brakes. Without them no filter can promise anything for ever.

SI units: m, m/s, s, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from safefilter.arguments import real_number, whole_number
from safefilter.errors import NotFinite, OutOfRange


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Bounds on errors; zero means exact.

    Attributes:
        position_error: How far each position in a scene may be from where the robot was when it was measured, in m.
        heading_error: The same for the robot's own heading, in rad; only differential drives move by it.
        velocity_error: How far a robot that does not cooperate may be off its observed velocity, from when it was
            measured to the end of the step, in m/s. Of the others only the speed limit is relied on.
        observation_delay: Age of the newest measurement when a step is due, in s.
        actuation_delay: The longest from a decision to its execution, in s; the command before executes meanwhile.
        clock_jitter: The longest from when a step is due to when a robot takes it, in s. Steps may so last longer
            than dt, and those of two robots are not aligned.
        lost_messages: How many measurements in a row may be lost: each is one step more of age.
        actuation_error: How far a robot may be off its commanded course at any instant of a step, as a part of the
            way commanded until then. A turn rate that is off by w adds w times half of the longest step.
    """

    position_error: float = 0.0
    heading_error: float = 0.0
    velocity_error: float = 0.0
    observation_delay: float = 0.0
    actuation_delay: float = 0.0
    clock_jitter: float = 0.0
    lost_messages: int = 0
    actuation_error: float = 0.0

    def __post_init__(self) -> None:
        """Check the bounds.

        Raises:
            NotFinite: If one is NaN or infinite.
            OutOfRange: If one is negative, `actuation_error` not below 1, or `heading_error` not below a quarter turn.
            InvalidInput: If the number of messages is no integer.
        """
        for field in BOUNDS:
            value = real_number(getattr(self, field), field)
            if not math.isfinite(value):
                raise NotFinite(f"{field}: expected a finite number, got {value}")
            if value < 0.0:
                raise OutOfRange(f"{field}: expected a bound from 0 up, got {value}")
            object.__setattr__(self, field, value)
        object.__setattr__(
            self, "lost_messages", whole_number(self.lost_messages, "lost_messages", 0)
        )
        if self.actuation_error >= 1.0:
            raise OutOfRange(
                f"actuation_error: expected a part of the way below 1, got {self.actuation_error}"
            )
        if self.heading_error >= math.pi / 2:
            raise OutOfRange(
                f"heading_error: expected less than a quarter turn, got {self.heading_error} rad"
            )

    @property
    def lateness(self) -> float:
        """The longest from when a step is due until its command executes, in s; by so much may it outlast dt."""
        return self.clock_jitter + self.actuation_delay

    def stale_time(self, dt: float) -> float:
        """The longest from a measurement until the command that relies on it executes, in s."""
        return self.observation_delay + self.lost_messages * dt + self.lateness


BOUNDS = tuple(field for field in Uncertainty.__slots__ if field != "lost_messages")
EXACT = Uncertainty()
