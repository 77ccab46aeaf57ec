"""Make any policy safe: a function drives a robot over a crossroad among seven filtered ones, bare and then filtered.

Run it as ``python examples/wrap_any_policy.py``. The policy knows nothing of the filter, and the filter nothing of the
policy; all it needs is the environment's ``scene()``: positions, velocities, radii and priorities of the robots.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

import safefilter as sf
from safefilter.wrappers import SafeAction

EPISODES = 20
MAX_SPEED = 0.2  # m/s


def policy(observation: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Straight to the goal at full speed: the third and fourth number observed are the unit vector to it."""
    return np.float32(MAX_SPEED) * observation[2:4]


def main() -> None:
    """Count the robot's collisions in both ways."""
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(time_horizon=2.0), sf.Separation(dt=0.2)], sf.Holonomic(v_max=MAX_SPEED)
    )
    bare = gymnasium.make("envs:Crossroad-v0", others_filter=safety_filter)
    filtered = SafeAction(
        gymnasium.make("envs:Crossroad-v0", others_filter=safety_filter), safety_filter
    )
    for name, env in (("off", bare), ("on", filtered)):
        collided, arrived = drive(env)
        print(f"filter {name}: {collided} of {EPISODES} collided, {arrived} arrived")


def drive(env: gymnasium.Env[Any, Any]) -> tuple[int, int]:
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
