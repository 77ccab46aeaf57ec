"""Make any policy safe: a lambda drives a robot over a crossroad among seven filtered ones, itself bare and filtered.

Run it as ``python examples/wrap_any_policy.py``. The policy and the environment know nothing of the filter; all it needs
is the environment's ``scene()``: positions, velocities, radii and priorities of the robots.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import safefilter as sf
from safefilter.wrappers import SafeAction

EPISODES = 20


def main() -> None:
    """Count the learner's collisions in both ways."""
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(time_horizon=2.0), sf.Separation(dt=0.2)], sf.Holonomic(v_max=0.2)
    )
    bare, inner = (
        gymnasium.make("envs:Crossroad-v0", others_filter=safety_filter) for _ in range(2)
    )
    filtered = SafeAction(inner, safety_filter)

    # The first two numbers of the observation are the unit vector to the goal.
    policy: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]] = (
        lambda observation: 0.2 * observation[:2]
    )
    for name, env in (("off", bare), ("on", filtered)):
        collided, arrived = drive(env, policy)
        print(f"filter {name}: {collided} of {EPISODES} collided, {arrived} arrived")


def drive(
    env: gymnasium.Env[Any, Any], policy: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]
) -> tuple[int, int]:
    """Drive some episodes; returns how many ended in a collision and how many at the goal."""
    collided = arrived = 0
    for seed in range(EPISODES):
        observation, info = env.reset(seed=seed)
        is_over = False
        while not is_over:
            observation, _, terminated, truncated, info = env.step(policy(observation))
            is_over = terminated or truncated
        collided += info["collided"]
        arrived += info["arrived"]
    return collided, arrived


if __name__ == "__main__":
    main()
