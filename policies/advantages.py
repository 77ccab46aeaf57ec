"""Advantages of actions by generalised estimation (GAE), over lanes in which nobody may be acting for a while.

Source: Schulman et al., "High-dimensional continuous control using generalized advantage estimation", 2016, Eq. (16).

Letters: T steps, L lanes (robots).
"""

from __future__ import annotations

import numpy as np

from policies.experience import SingleArray
from safefilter.arrays import BoolArray
from safefilter.jit import kernel
from safefilter.threads import over_ranges


def advantages(  # noqa: PLR0917  # the symbols of the equation
    reward: SingleArray,
    value: SingleArray,
    acts: BoolArray,
    ends: BoolArray,
    discount: float,
    trace_decay: float,
) -> SingleArray:
    """Estimate how much better than expected each action was.

    What follows an end is another episode and counts for nothing. At the last step, where the rollout was cut, the
    value of the state that it led to stands for all that would have come: so it does where time was up.

    Args:
        reward: Of each step, shape (T, L).
        value: Of the state before each step, and of the last one, shape (T + 1, L).
        acts: Shape (T, L): the robot of the lane was under way.
        ends: Shape (T, L): its episode ended in this step, by arrival or collision.
        discount: gamma.
        trace_decay: lambda.

    Returns:
        Shape (T, L); zero where nobody acted.
    """
    advantage = np.zeros_like(reward)

    def estimate(first: int, last: int) -> None:
        _estimate(first, last, reward, value, acts, ends, discount, trace_decay, advantage)

    over_ranges(estimate, reward.shape[1])
    return advantage


@kernel
def _estimate(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_lane: int,
    last_lane: int,
    reward: SingleArray,
    value: SingleArray,
    acts: BoolArray,
    ends: BoolArray,
    discount: float,
    trace_decay: float,
    advantage: SingleArray,
) -> None:
    num_steps = reward.shape[0]
    for lane in range(first_lane, last_lane):
        following = 0.0
        for t in range(num_steps - 1, -1, -1):
            if not acts[t, lane]:
                following = 0.0
                continue
            # No product with 0: the value of a state that is of no account may be anything.
            after = value[t + 1, lane]
            if ends[t, lane]:
                after, following = 0.0, 0.0
            surprise = reward[t, lane] + discount * after - value[t, lane]
            following = surprise + discount * trace_decay * following
            advantage[t, lane] = following


def normalised(advantage: SingleArray, acts: BoolArray) -> SingleArray:
    """Advantages with mean 0 and spread 1 over all who acted; zero for all others.

    Args:
        advantage: Shape (T, L).
        acts: Shape (T, L): was under way.
    """
    known = advantage[acts]
    return np.where(acts, (advantage - known.mean()) / (known.std() + 1e-8), 0.0).astype(np.float32)
