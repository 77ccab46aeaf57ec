"""Course: the worlds in which robots are trained, stepped through the filter, with rewards.

A robot that arrives is reborn at its start; the time a world has for a map is over between two rollouts only, where
the learner's estimates are cut anyway, so that it is no end of an episode.

Letters: W worlds, N robots a world, F numbers of an observation. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from envs.fleet import Fleet
from envs.navigation import Navigation
from envs.observation_layout import Observations
from envs.reward import Reward
from envs.reward_tracker import RewardTracker
from envs.rules import AfterArrival, Rules
from envs.scenarios import Scenario, Town
from policies.action_map import to_command, to_raw
from policies.experience import SingleArray
from policies.stopwatch import Stopwatch
from policies.training_settings import TrainingSettings
from safefilter.arrays import BoolArray, FloatArray
from safefilter.safety_filter import SafetyFilter

LOST_PART = 0.5
"""A world in which more than this part of the robots are wrecks gets another map."""
LAST_STEPS = 1
"""Names a generator beside those of the worlds, which are seeded by (seed, number of the world)."""


@dataclass(frozen=True, slots=True, eq=False)
class CourseStep:
    """What one step did.

    Attributes:
        acted: Shape (W, N): was under way. What befalls one who waits at its goal to be reborn is nobody's doing.
        executed: Raw actions that stand for the commands that were executed, shape (W, N, 2).
        reward: Of each robot, term by term.
        ends: Shape (W, N): its episode ended, by arrival or collision.
        arrived: Shape (W, N).
        collided: Shape (W, N).
        cycle_time: Of those that arrived, time of their way, shape (W, N), in s; NaN for all others.
    """

    acted: BoolArray
    executed: FloatArray
    reward: Reward
    ends: BoolArray
    arrived: BoolArray
    collided: BoolArray
    cycle_time: FloatArray


class Course:
    """Worlds of differential drives, one map after the other.

    Attributes:
        navigation: The worlds.
    """

    def __init__(
        self,
        settings: TrainingSettings,
        scenario: Scenario | None = None,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """Place everybody.

        Args:
            settings: What to train on.
            scenario: Where; None: the training half of the town.
            stopwatch: Told of the time that the ``simulator`` and the ``filter`` take.
        """
        self._stopwatch = Stopwatch() if stopwatch is None else stopwatch
        course = settings.course
        town = (
            Town(course.num_robots, "training", course.num_maps, course.has_deep_traps)
            if scenario is None
            else scenario
        )
        # Worlds are given another map from outside, so their own time limit must not come first.
        limit = 2.0 * (course.map_steps + course.rollout_steps)
        rules = settings.filtering.rules(
            Rules(after_arrival=AfterArrival.REBORN, time_limit=limit * Rules().dt)
        )
        self.navigation = Navigation(
            town,
            Fleet.of(town.num_robots, kinematics="differential"),
            rules,
            num_worlds=course.num_worlds,
            layout=settings.layout,
        )
        self._settings = settings
        self._tracker = RewardTracker(settings.reward)
        self._filter: SafetyFilter | None = None
        self.navigation.reset(settings.seed)
        # Worlds change their maps at different times, so that no rollout is all beginnings.
        rng = np.random.default_rng([settings.seed, course.num_worlds, LAST_STEPS])
        self._last_step = rng.integers(1, course.map_steps + 1, course.num_worlds)
        self._rebuild_filter()

    def renew(self) -> None:
        """Give other maps to worlds whose time is over, or whose robots are mostly lost; between two rollouts."""
        world = self.navigation.world
        is_lost = world.collided.mean(axis=1) > LOST_PART
        is_due = (world.step_count >= self._last_step) | is_lost
        if is_due.any():
            self.navigation.reset(worlds=is_due)
            self._last_step[is_due] = self._settings.course.map_steps
            self._rebuild_filter()

    def observe(self) -> Observations:
        """Observations of all robots, shape (W, N, F)."""
        return self.navigation.observe()

    def step(self, raw: SingleArray) -> CourseStep:
        """Move all robots for one step.

        Args:
            raw: Raw actions of the policy, one row a robot, shape (W N, 2).
        """
        navigation, world = self.navigation, self.navigation.world
        acted, limits = world.active, (world.v_max, world.omega_max)
        wanted = to_command(raw.reshape(world.position.shape), *limits)
        commands = navigation.wanted(wanted)
        with self._stopwatch.measure("filter"):
            commands, correction = self._made_safe(commands, acted)
        with self._stopwatch.measure("simulator"):
            self._tracker.remember(world)
            outcome = navigation.step(commands)
            reward = self._tracker.reward(world, outcome, correction)
        return CourseStep(
            acted=acted,
            executed=to_raw(commands, *limits),
            reward=reward,
            ends=acted & (outcome.arrived | outcome.collided),
            arrived=outcome.arrived,
            collided=acted & outcome.collided,
            cycle_time=outcome.cycle_time,
        )

    def state(self) -> dict[str, Any]:
        """Everything that the worlds go on with."""
        return {"navigation": self.navigation.state(), "last_step": self._last_step.copy()}

    def restore(self, state: Any) -> None:  # as varied as what went in
        """Go on from a state that `state` returned, of a course with the same settings."""
        self.navigation.restore(state["navigation"])
        self._last_step = state["last_step"].copy()
        self._rebuild_filter()

    def _made_safe(
        self, commands: FloatArray, acted: BoolArray
    ) -> tuple[FloatArray, FloatArray | None]:
        """Commands as the filter decides them, and how far it moved the velocities, in m/s."""
        if self._filter is None:
            return commands, None
        executed, decision = self.navigation.decide(self._filter, commands, acted)
        correction = np.zeros(acted.shape)
        correction.reshape(-1)[decision.index] = decision.correction
        return executed, correction

    def _rebuild_filter(self) -> None:
        # Speeds come with the placements, and the filter has to know them.
        navigation = self.navigation
        self._filter = self._settings.filtering.build(navigation.world, navigation.rules.dt)
