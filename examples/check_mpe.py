"""Test robots of an environment that we did not write: three particles of MPE (PettingZoo's, in the package mpe2).

Run it as ``python examples/check_mpe.py``, or name a file of yours like a test and let pytest find `TestParticles`. MPE
takes forces, and moves before it accelerates: `Velocities` turns a velocity into the force that gives it, and the scene
shows where robots will be when it does.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test
from mpe2 import simple_spread_v3
from pettingzoo import ParallelEnv

import safefilter as sf
from safefilter.testing import closed_loop
from safefilter.wrappers import SafeParallelEnv

DT, DAMPING, FORCE = 0.1, 0.25, 5.0  # of MPE
V_MAX = 0.28  # m/s: from any velocity to any other takes less than the force of a step
MARGIN = 0.01  # m: nearer than this MPE itself pushes particles apart


class Velocities(ParallelEnv[str, Any, Any]):  # type: ignore[misc]  # PettingZoo has no types
    """MPE's simple_spread, driven by velocities."""

    metadata: dict[str, Any] = {"name": "velocities"}  # noqa: RUF012  # as PettingZoo has it

    def __init__(self) -> None:
        self.mpe = simple_spread_v3.parallel_env(N=3, continuous_actions=True)
        self.possible_agents = self.mpe.possible_agents

    @property
    def agents(self) -> list[str]:  # noqa: D102
        return self.mpe.agents  # type: ignore[no-any-return]

    def observation_space(self, agent: str) -> Any:  # noqa: D102
        return self.mpe.observation_space(agent)

    def action_space(self, agent: str) -> gymnasium.spaces.Box:  # noqa: ARG002, D102
        return gymnasium.spaces.Box(-V_MAX, V_MAX, (2,), np.float32)

    def reset(self, seed: int | None = None, options: Any = None) -> Any:  # noqa: D102
        return self.mpe.reset(seed=seed, options=options)

    def step(self, actions: dict[str, Any]) -> Any:  # noqa: D102
        forces = {}
        for particle in self.mpe.unwrapped.world.agents:
            change = actions[particle.name] - (1.0 - DAMPING) * particle.state.p_vel
            x, y = change / (FORCE * DT)
            push = [0.0, max(-x, 0.0), max(x, 0.0), max(-y, 0.0), max(y, 0.0)]
            forces[particle.name] = np.array(push, np.float32)
        return self.mpe.step(forces)

    def scene(self) -> sf.Scene:
        """Where everybody will be when the next velocity is theirs."""
        states = [(p.state.p_pos, p.state.p_vel, p.size) for p in self.mpe.unwrapped.world.agents]
        position, velocity, size = map(np.array, zip(*states, strict=True))
        return sf.Scene.from_world(position + DT * velocity, velocity, size)


safety_filter = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(DT, MARGIN)], sf.Holonomic(V_MAX)
)
loop = closed_loop(Velocities, lambda env: SafeParallelEnv(env, safety_filter))
TestParticles = loop.TestCase

if __name__ == "__main__":
    run_state_machine_as_test(loop, settings=settings(loop.TestCase.settings, max_examples=10))
    print("10 episodes of adversarial particles, no contact")
