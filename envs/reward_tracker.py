"""From the world before and after a step to what is rewarded: remembers what the world itself does not.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import numpy as np

from envs.outcome import Outcome
from envs.reward import Reward, RewardWeights, reward
from envs.shortest_ways import ShortestWays
from envs.snapshot import Snapshot, SnapshotError
from envs.transition import Transition, end_of_step
from envs.world import World
from safefilter.arrays import FloatArray


class RewardTracker:
    """Rewards of all robots of all worlds, step by step.

    Call `remember` before each step and `reward` after it. A world that was reset in between starts a new episode.

    Attributes:
        weights: What is paid for.
    """

    def __init__(self, weights: RewardWeights | None = None) -> None:
        """Remember nothing yet.

        Args:
            weights: What is paid for; None: the defaults.
        """
        self.weights = RewardWeights() if weights is None else weights
        self._course = np.zeros((0, 0, 2))
        looks_at_ways = self.weights.way != 0.0 or self.weights.way_direction != 0.0
        self._ways = ShortestWays() if looks_at_ways else None
        self._way_before = np.zeros((0, 0))

    def remember(self, world: World) -> None:
        """Take note of the moment before a step."""
        if self._course.shape != world.position.shape:
            self._course = np.zeros_like(world.position)
        # Placed or reborn just now.
        self._course[world.cycle_start == world.step_count[:, np.newaxis]] = 0.0
        self._before = world.position.copy()
        self._under_way = world.active.copy()
        if self._ways is not None:
            self._ways.renew(world)
            self._way_before = self._ways.lengths(world, self._before)

    def state(self) -> Snapshot:
        """What it remembers between two steps."""
        return {"course": self._course.copy()}

    def restore(self, state: Snapshot) -> None:
        """Remember what another tracker did.

        Args:
            state: What `state` returned once.

        Raises:
            SnapshotError: If it is something else.
        """
        course = state.get("course")
        if not isinstance(course, np.ndarray) or course.shape[2:] != (2,) or course.ndim != 3:
            raise SnapshotError("state of a tracker: expected courses of shape (W, N, 2)")
        self._course = course.astype(np.float64)

    def reward(
        self, world: World, outcome: Outcome, correction: FloatArray | None = None
    ) -> Reward:
        """Pay for the step since `remember`.

        Args:
            world: The world after it.
            outcome: What it did.
            correction: How far a filter moved the velocities, shape (W, N), in m/s; None without one.

        Returns:
            Reward of each robot, term by term.
        """
        shape = outcome.arrived.shape
        position = end_of_step(world, outcome)
        way = np.zeros(shape)
        if self._ways is not None:
            way = self._way_before - self._ways.lengths(world, position)
        step = Transition(
            start=world.start,
            before=self._before,
            position=position,
            velocity=world.velocity,
            facing=self._facing(world),
            goal=world.goal,
            v_max=world.v_max,
            present=world.present & ~world.person,
            under_way=self._under_way,
            arrived=outcome.arrived,
            hit_robot=outcome.hit_robot,
            hit_wall=outcome.hit_wall,
            timed_out=np.repeat(outcome.timed_out[:, np.newaxis], shape[1], axis=1),
            correction=np.zeros(shape) if correction is None else correction,
            way=way,
        )
        return reward(step, self.weights)

    def _facing(self, world: World) -> FloatArray:
        """Headings of drives; courses of holonomic robots, which keep their last one at rest."""
        if world.is_differential:
            return np.stack([np.cos(world.heading), np.sin(world.heading)], axis=-1)
        speed = np.hypot(world.velocity[..., 0], world.velocity[..., 1])[..., np.newaxis]
        np.divide(world.velocity, speed, out=self._course, where=speed > 0.0)
        return self._course.copy()
