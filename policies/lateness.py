"""Lateness: what executes where a filter's answers come late, against what filters assume.

Qin et al. explain their 2.7 % collisions with "insufficient real-time computational power". These are three ways to
make that an experiment:

* ``steps``: all answers come so many steps after their scene, and execute then; till the first one robots stand still.
* ``share`` with ``repeats``: this part of the answers does not come in time, and the robot repeats its last command.
* ``share`` without: its command has expired, and its watchdog stops it for that step. This is what our filter asks for:
  to stand still keeps every budget, so that nothing can collide.

Letters: W worlds, N robots, T steps. SI units.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from safefilter.arrays import BoolArray, FloatArray
from safefilter.errors import OutOfRange

_STREAM = 1
"""Sets the chance of answers apart from that of placements, which has the same seeds."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late answers come.

    Attributes:
        steps: Steps between an answer's scene and its execution.
        share: Part of the answers that do not come in time.
        repeats: Does a robot go on with its last command then? Otherwise it stands still.
    """

    steps: int = 0
    share: float = 0.0
    repeats: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OutOfRange: If there are fewer steps than none, or the share is no probability.
        """
        if self.steps < 0:
            raise OutOfRange(f"steps: expected 0 or more, got {self.steps}")
        if not 0.0 <= self.share <= 1.0:
            raise OutOfRange(f"share: expected a number from 0 to 1, got {self.share}")


PUNCTUAL = Lateness()
"""Every answer executes in its own step, as filters assume."""


class LateAnswers:
    """Answers on their way to the robots of one run."""

    def __init__(
        self,
        lateness: Lateness,
        shape: tuple[int, int],
        num_steps: int,
        *,
        seed: int,
        first_episode: int = 0,
    ) -> None:
        """Draw which answers are late: each world by the number of its episode.

        Args:
            lateness: How late.
            shape: Worlds W and robots N.
            num_steps: Steps T of the run at most.
            seed: Of the run.
            first_episode: Number of the episode of world 0.
        """
        self._lateness = lateness
        self._waiting = deque(np.zeros((lateness.steps, *shape, 2)))
        self._last: FloatArray = np.zeros((*shape, 2))
        self._step = 0
        self._is_late: BoolArray = np.zeros((0, *shape), dtype=np.bool_)
        if lateness.share > 0.0:
            drawn = [
                np.random.default_rng([seed, first_episode + w, _STREAM]).random((
                    num_steps,
                    shape[1],
                ))
                for w in range(shape[0])
            ]
            self._is_late = np.stack(drawn, axis=1) < lateness.share

    def executed(self, answers: FloatArray) -> FloatArray:
        """What executes in this step.

        Args:
            answers: What was decided in it, shape (W, N, 2).

        Returns:
            Shape (W, N, 2).
        """
        self._waiting.append(answers)
        commands = self._waiting.popleft()
        if self._lateness.share > 0.0:
            is_late = self._is_late[self._step, ..., np.newaxis]
            commands = np.where(is_late, self._last if self._lateness.repeats else 0.0, commands)
        self._last = commands
        self._step += 1
        return commands
