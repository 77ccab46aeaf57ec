"""Sensing: what of the state of robots others get to know: with noise, late, and not always.

Each robot tells its own estimate of where it is, how fast and which way it faces; everyone receives the same. So both
of a pair work with the same numbers, as the guarantee of the filter asks for. That they are not true is for the radii
of the filter to allow for.

Letters: W worlds, N robots a world, D moments of delay. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from envs.noise_kernel import normal, uniform
from envs.step_kernel import RobotArrays
from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array
from safefilter.errors import OutOfRange
from safefilter.jit import formula, kernel

# Channels of chance; `normal` takes two numbers each.
POSITION_X, POSITION_Y, VELOCITY_X, VELOCITY_Y, HEADING = range(5)
DROP = 2 * HEADING + 2


@dataclass(frozen=True, slots=True)
class Sensing:
    """How well robots sense. By default perfectly, and for free.

    Attributes:
        position_noise: Standard deviation of each coordinate of a position, in m.
        velocity_noise: That of each part of a velocity, in m/s.
        heading_noise: That of a heading, in rad.
        delay: Steps after which others know a state.
        dropout: Probability that a state does not arrive; others then go on with the last one that did.
        lidar_noise: Standard deviation of a range, in m.
        beam_dropout: Probability that a beam does not come back.
    """

    position_noise: float = 0.0
    velocity_noise: float = 0.0
    heading_noise: float = 0.0
    delay: int = 0
    dropout: float = 0.0
    lidar_noise: float = 0.0
    beam_dropout: float = 0.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is below zero, or a probability above one.
        """
        for field in ("position_noise", "velocity_noise", "heading_noise", "lidar_noise"):
            if finite_array(getattr(self, field), field, ()) < 0.0:
                raise OutOfRange(f"{field}: expected 0 or more, got {getattr(self, field)}")
        for field in ("dropout", "beam_dropout"):
            if not 0.0 <= getattr(self, field) <= 1.0:
                raise OutOfRange(
                    f"{field}: expected a probability from 0 to 1, got {getattr(self, field)}"
                )
        if self.delay < 0:
            raise OutOfRange(f"delay: expected 0 steps or more, got {self.delay}")

    @property
    def is_perfect(self) -> bool:
        """Is every state known exactly and at once?"""
        noise = max(self.position_noise, self.velocity_noise, self.heading_noise)
        return noise == 0.0 and self.delay == 0 and self.dropout == 0.0


class SensedArrays(NamedTuple):
    """What everyone knows of robots.

    Attributes:
        position: Shape (W, N, 2), in m.
        velocity: Shape (W, N, 2), in m/s.
        heading: Shape (W, N), in rad.
    """

    position: FloatArray
    velocity: FloatArray
    heading: FloatArray


class Sensed:
    """What everyone knows of robots, kept up to date step by step.

    Attributes:
        sensing: How well robots sense.
        arrays: For kernels; the state of the world itself where sensing is perfect.
    """

    def __init__(self, sensing: Sensing, robots: RobotArrays) -> None:
        """Make room.

        Args:
            sensing: How well robots sense.
            robots: The true state.
        """
        self.sensing = sensing
        self._is_perfect = sensing.is_perfect
        self._robots = robots
        self.arrays = SensedArrays(robots.position, robots.velocity, robots.heading)
        self._sent = np.zeros((*robots.heading.shape, 0, 5))
        if not self._is_perfect:
            self.arrays = SensedArrays(*(array.copy() for array in self.arrays))
            self._sent = np.zeros((*robots.heading.shape, sensing.delay + 1, 5))

    def restart(self, chosen: BoolArray) -> None:
        """Everyone knows where some robots start, at once and exactly.

        Args:
            chosen: Shape (W, N).
        """
        if self._is_perfect or not chosen.any():
            return
        robots = self._robots
        for sensed, true in zip(
            self.arrays, (robots.position, robots.velocity, robots.heading), strict=True
        ):
            sensed[chosen] = true[chosen]
        state = np.concatenate(
            [robots.position, robots.velocity, robots.heading[..., np.newaxis]], axis=-1
        )
        self._sent[chosen] = state[chosen][:, np.newaxis]

    @property
    def memory(self) -> dict[str, FloatArray]:
        """Everything that is remembered, by name; nothing where sensing is perfect."""
        if self.sensing.is_perfect:
            return {}
        return {"sent": self._sent, **self.arrays._asdict()}

    def update(self, seed: IntArray) -> None:
        """Send and receive what the last step has led to.

        Args:
            seed: Of each world, shape (W,).
        """
        if not self._is_perfect:
            given = self.sensing
            noise = np.array([given.position_noise, given.velocity_noise, given.heading_noise])
            _exchange(self._robots, seed, noise, given.dropout, self._sent, self.arrays)


@formula
def send(
    robots: RobotArrays, seed: int, noise: FloatArray, sent: FloatArray, w: int, i: int, slot: int
) -> None:
    """Write what robot i takes for its own state."""
    step = robots.step_count[w]
    for part in range(2):
        error = normal(seed, step, i, POSITION_X + part)
        sent[w, i, slot, part] = robots.position[w, i, part] + noise[0] * error
        error = normal(seed, step, i, VELOCITY_X + part)
        sent[w, i, slot, 2 + part] = robots.velocity[w, i, part] + noise[1] * error
    sent[w, i, slot, 4] = robots.heading[w, i] + noise[2] * normal(seed, step, i, HEADING)


@kernel
def _exchange(  # a kernel takes arrays, not records
    robots: RobotArrays,
    seed: IntArray,
    noise: FloatArray,
    dropout: float,
    sent: FloatArray,
    known: SensedArrays,
) -> None:
    num_slots = sent.shape[2]
    for w in range(sent.shape[0]):
        step = robots.step_count[w]
        # The slot after the newest one is the oldest.
        newest, oldest = step % num_slots, (step + 1) % num_slots
        for i in range(sent.shape[1]):
            send(robots, seed[w], noise, sent, w, i, newest)
            if uniform(seed[w], step, i, DROP) < dropout:
                continue
            known.position[w, i, 0] = sent[w, i, oldest, 0]
            known.position[w, i, 1] = sent[w, i, oldest, 1]
            known.velocity[w, i, 0] = sent[w, i, oldest, 2]
            known.velocity[w, i, 1] = sent[w, i, oldest, 3]
            known.heading[w, i] = sent[w, i, oldest, 4]
