"""Experience: what robots saw, did and were paid in one rollout.

Letters: T steps, L lanes (robots), F numbers of an observation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray

SingleArray = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Experience:
    """Arrays of one rollout, written step by step.

    Attributes:
        observation: Before each step, and after the last, shape (T + 1, L, F).
        action: Raw actions of the policy, shape (T, L, 2).
        executed: Raw actions that stand for what was executed, shape (T, L, 2).
        log_probability: Of the policy's actions, shape (T, L).
        reward: Shape (T, L).
        acts: Shape (T, L): was under way; all else of that step counts for nothing otherwise.
        ends: Shape (T, L): its episode ended in the step.
    """

    observation: SingleArray
    action: SingleArray
    executed: SingleArray
    log_probability: SingleArray
    reward: SingleArray
    acts: BoolArray
    ends: BoolArray

    @classmethod
    def empty(cls, num_steps: int, num_lanes: int, num_inputs: int) -> Self:
        """Make room."""
        shape = (num_steps, num_lanes)
        return cls(
            observation=np.zeros((num_steps + 1, num_lanes, num_inputs), dtype=np.float32),
            action=np.zeros((*shape, 2), dtype=np.float32),
            executed=np.zeros((*shape, 2), dtype=np.float32),
            log_probability=np.zeros(shape, dtype=np.float32),
            reward=np.zeros(shape, dtype=np.float32),
            acts=np.zeros(shape, dtype=np.bool_),
            ends=np.zeros(shape, dtype=np.bool_),
        )
