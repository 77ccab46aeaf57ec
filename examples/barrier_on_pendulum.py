"""Keep a pendulum upright whatever the policy asks for: two barriers on Gymnasium's Pendulum-v1, bare and filtered.

Run it as ``python examples/barrier_on_pendulum.py``. A state is safe if ``STIFFNESS * (LIMIT - angle) >= rate``, and
likewise on the other side: the nearer the limit, the slower towards it. After a step these are affine in the torque, so
the rows of the filter are exact; and the torque suffices to keep both of them in every safe state.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt

import safefilter as sf
from safefilter.wrappers import SafeAction

Numbers: TypeAlias = npt.NDArray[np.floating]
Policy: TypeAlias = Callable[[Numbers, np.random.Generator], Any]

LIMIT = 0.3  # rad, 0 is upright
STIFFNESS = 2.0  # 1/s
STEP, GRAVITY, TORQUE = 0.05, 15.0, 3.0  # of the environment: s, rad/s^2, rad/s^2 per N m
EPISODES = 5

POLICIES: Mapping[str, Policy] = {
    "nothing": lambda _observation, _rng: np.zeros(1, np.float32),
    "random": lambda _observation, rng: rng.uniform(-2.0, 2.0, 1).astype(np.float32),
    "push over": lambda observation, _rng: np.float32(2.0) * np.sign(observation[1:2]),
}


def barrier(side: float) -> sf.AffineBarrier:
    """The barrier against falling to one side, 1 or -1, for states (angle, rate)."""

    def value(state: Numbers) -> float:
        return float(STIFFNESS * (LIMIT - side * state[0]) - side * state[1])

    def change_without_torque(state: Numbers) -> float:
        rate = state[1] + GRAVITY * np.sin(state[0]) * STEP
        return value(np.array([state[0] + rate * STEP, rate])) - value(state)

    change_by_torque = [-side * (STIFFNESS * STEP + 1.0) * TORQUE * STEP]
    return sf.AffineBarrier(value, change_without_torque, lambda _: change_by_torque, gain=0.5)


def drive(env: gymnasium.Env[Any, Any], policy: Policy) -> tuple[float, float]:
    """Run some episodes; returns the largest angle, and the mean correction of the torque."""
    largest = correction = 0.0
    for seed in range(EPISODES):
        rng = np.random.default_rng(seed)
        observation, info = env.reset(seed=seed, options={"x_init": 0.1, "y_init": 0.1})
        truncated = False
        while not truncated:
            observation, _, _, truncated, info = env.step(policy(observation, rng))
            largest = max(largest, abs(env.get_wrapper_attr("state")[0]))
        correction += info.get("safefilter_episode", {}).get("mean_correction", 0.0) / EPISODES
    return largest, correction


def main() -> None:
    """Print a table."""
    bare = gymnasium.make("Pendulum-v1")
    barriers = [barrier(1.0), barrier(-1.0)]
    safety = sf.SafetyFilter(barriers, sf.Box(bare.action_space), backend="qpsolvers:daqp")
    safe = SafeAction(bare, safety, scene=lambda env, _observation, _info: env.state)
    print("policy     filter  largest angle  mean correction")
    for name, policy in POLICIES.items():
        for env, word in ((bare, "off"), (safe, "on")):
            largest, correction = drive(env, policy)
            print(f"{name:<10} {word:<6}  {largest:>9.3f} rad  {correction:>11.3f} N m")


if __name__ == "__main__":
    main()
