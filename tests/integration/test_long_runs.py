"""Random actions for a long time leave no NaN, no growing memory and no warning (those are errors in all tests).

CI runs 1000 steps of each; ``LONG_RUN_STEPS=100000 pytest -s tests/integration/test_long_runs.py`` runs 10^5 and says
how much memory the process holds.
"""

import gc
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import safefilter as sf
from envs import Fleet, Rules
from envs.gymnasium_adapter import OneLearner
from envs.pettingzoo_adapter import ParallelRobots
from envs.vector_adapter import VectorRobots
from safefilter.wrappers import SafeAction, SafeParallelEnv, SafeVectorAction

NUM_STEPS = int(os.environ.get("LONG_RUN_STEPS", "1000"))
MOST_GROWTH = 100
"""Blocks of memory that Python may hold more after each quarter; a leak of one a step would be 250 and more."""
FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
    sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
)
RULES = Rules(time_limit=12.0)


def require_finite(*parts: Any) -> None:
    for part in parts:
        if isinstance(part, dict):
            require_finite(*part.values())
        else:
            assert np.isfinite(np.asarray(part, dtype=np.float64)).all()


def single(num_steps: int, *, is_filtered: bool) -> None:
    fleet = Fleet.of(10, kinematics="differential")
    env: Any = OneLearner("corridor_people", fleet=fleet, rules=RULES)
    env = SafeAction(env, FILTER) if is_filtered else env
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(num_steps):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        require_finite(observation, reward)
        if terminated or truncated:
            env.reset()


def parallel(num_steps: int, *, is_filtered: bool) -> None:
    env: Any = ParallelRobots("passing", rules=RULES, observation="dict")
    env = SafeParallelEnv(env, FILTER) if is_filtered else env
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    for _ in range(num_steps):
        actions = {
            agent: rng.uniform([0.0, -2.5], [0.2, 2.5]).astype(np.float32) for agent in env.agents
        }
        observations, rewards, *_ = env.step(actions)
        require_finite(observations, rewards)
        if not env.agents:
            env.reset()


def vector(num_steps: int, *, is_filtered: bool) -> None:
    env: Any = VectorRobots("crossroad", num_worlds=2, rules=RULES)
    env = SafeVectorAction(env, FILTER) if is_filtered else env
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(num_steps):
        observations, rewards, _, _, infos = env.step(env.action_space.sample())
        require_finite(observations, rewards)
        assert not is_filtered or not infos["collided"].any()


def held_memory() -> float:
    """What the process holds, in MB, where the system says so."""
    status = Path("/proc/self/statm")
    pages = int(status.read_text().split()[1]) if status.exists() else 0
    return pages * 4096 / 1e6


@pytest.mark.stress
@pytest.mark.parametrize("is_filtered", [False, True], ids=["bare", "filtered"])
@pytest.mark.parametrize("run", [single, parallel, vector])
def test_random_actions_for_long(run: Callable[..., None], *, is_filtered: bool) -> None:
    run(100, is_filtered=is_filtered)  # compiles, and fills the caches
    held = []
    for _ in range(4):
        run(NUM_STEPS // 4, is_filtered=is_filtered)
        gc.collect()
        held.append((sys.getallocatedblocks(), held_memory()))
    print(f"{run.__name__}: blocks, MB: {held}")  # noqa: T201  # figures of the full run
    # A leak grows in every quarter; what other tests left behind, or a late cache, in one.
    assert min(np.diff([blocks for blocks, _ in held])) < MOST_GROWTH
