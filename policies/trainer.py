"""Trainer: Alg. 1 of Qin et al., one rollout and one improvement of the policy after the other.

The policy's own action and its log-probability are learnt from; the filter is part of the environment.

Letters: T steps, L lanes (robots), F numbers of an observation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from policies.course import Course
from policies.experience import Experience
from policies.learner import Learner
from policies.stopwatch import Stopwatch
from policies.training_settings import TrainingSettings


@dataclass(frozen=True, slots=True)
class Progress:
    """What one rollout and the improvement after it came to.

    Attributes:
        num_steps: Steps of robots since the beginning.
        figures: Values by name: of the rollout ``reward`` (a step), ``arrival_rate`` (of the episodes that ended),
            ``episodes`` (that ended), ``arrival_time`` (in s); those of `Learner.learn`; and ``learning_rate``.
    """

    num_steps: int
    figures: Mapping[str, float]


class Trainer:
    """A learner and the worlds that it learns in.

    Attributes:
        settings: What the training depends on.
        course: The worlds.
        learner: What learns.
        num_steps: Steps of robots so far.
        stopwatch: Where the time went: ``simulator``, ``filter``, ``inference``, ``update``.
    """

    def __init__(self, settings: TrainingSettings, device: str = "cpu") -> None:
        """Begin.

        Args:
            settings: What to train, and how.
            device: Where networks live, as torch names it: "cpu", "cuda".
        """
        self.settings = settings
        self.stopwatch = Stopwatch()
        self.course = Course(settings, stopwatch=self.stopwatch)
        self.learner = Learner(settings, device)
        self.num_steps = 0
        world = self.course.navigation.world
        self._experience = Experience.empty(
            settings.course.rollout_steps, world.num_worlds * world.num_robots, settings.layout.size
        )

    @property
    def is_done(self) -> bool:
        """Have all steps been made?"""
        return self.num_steps >= self.settings.num_steps

    def advance(self) -> Progress:
        """Make one rollout and learn from it."""
        rate = self.settings.ppo.rate(self.num_steps / self.settings.num_steps)
        rolled = self._roll_out()
        with self.stopwatch.measure("update"):
            learned = self.learner.learn(self._experience, rate)
        self.num_steps += int(self._experience.acts.sum())
        return Progress(self.num_steps, {**rolled, **learned, "learning_rate": rate})

    def state(self) -> dict[str, Any]:
        """Everything that a training needs to go on."""
        return {
            "num_steps": self.num_steps,
            "learner": self.learner.state(),
            "course": self.course.state(),
        }

    def restore(self, state: Any) -> None:  # as varied as what went in
        """Go on from a state that `state` returned, of a trainer with the same settings."""
        self.num_steps = state["num_steps"]
        self.learner.restore(state["learner"])
        self.course.restore(state["course"])

    def _roll_out(self) -> dict[str, float]:
        """Fill the experience; returns what became of the robots."""
        course, experience = self.course, self._experience
        with self.stopwatch.measure("simulator"):
            course.renew()
        arrived, ended, times = 0, 0, 0.0
        for t in range(len(experience.reward)):
            self._observe(t)
            with self.stopwatch.measure("inference"):
                raw, log_probability = self.learner.act(experience.observation[t])
            step = course.step(raw)
            experience.action[t] = raw
            experience.log_probability[t] = log_probability
            experience.executed[t] = step.executed.reshape(raw.shape)
            experience.reward[t] = step.reward.total.ravel()
            experience.acts[t] = step.acted.ravel()
            experience.ends[t] = step.ends.ravel()
            arrived += int(step.arrived.sum())
            ended += int(step.ends.sum())
            times += float(np.nansum(step.cycle_time))
        self._observe(len(experience.reward))
        return {
            "reward": float(experience.reward.sum()) / max(int(experience.acts.sum()), 1),
            "arrival_rate": arrived / max(ended, 1),
            "episodes": float(ended),
            "arrival_time": times / max(arrived, 1),
        }

    def _observe(self, t: int) -> None:
        with self.stopwatch.measure("simulator"):
            seen = self.course.observe()
        self._experience.observation[t] = seen.reshape(self._experience.observation[t].shape)
