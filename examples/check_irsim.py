"""Test robots of a simulator that we did not write: an ir-sim world with a box in its middle (package ir-sim).

Run it as ``python examples/check_irsim.py``, or name a file of yours like a test and let pytest find `TestWorld`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import gymnasium
import irsim
import numpy as np
import numpy.typing as npt
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test

import safefilter as sf
from safefilter.testing import closed_loop
from safefilter.wrappers import SafeAction

DT, V_MAX = 0.1, 0.5  # s, m/s
WORLD = f"""
world: {{height: 6, width: 6, offset: [-3, -3], step_time: {DT}, sample_time: {DT}, collision_mode: unobstructed}}
robot:
  - number: 4
    distribution: {{name: manual}}
    state: [[-0.8, 0, 0], [0.8, 0, 0], [0, 0.7, 0], [0.5, 0.8, 0]]
    kinematics: {{name: omni}}
    shape: {{name: circle, radius: 0.2}}
    vel_min: [-1, -1]
    vel_max: [1, 1]
obstacle:
  - {{shape: {{name: rectangle, length: 0.6, width: 0.3}}, state: [0, 0, 0]}}
"""


class World(gymnasium.Env[npt.NDArray[np.floating], npt.NDArray[np.floating]]):
    """The world as a Gymnasium environment: an action is a row a robot."""

    action_space = gymnasium.spaces.Box(-V_MAX, V_MAX, (4, 2), np.float32)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (4, 2))

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "world.yaml"
            path.write_text(WORLD, encoding="utf-8")
            self.world = irsim.make(str(path), display=False, log_level="ERROR")

    def positions(self) -> npt.NDArray[np.floating]:  # noqa: D102
        return np.array([robot.state[:2, 0] for robot in self.world.robot_list])

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:  # noqa: D102
        super().reset(seed=seed, options=options)
        self.world.reset()
        return self.positions(), {}

    def step(self, action: npt.NDArray[np.floating]) -> Any:  # noqa: D102
        self.world.step(list(action.astype(np.float64)[:, :, None]))
        return self.positions(), 0.0, False, False, {}

    def scene(self) -> sf.Scene:  # noqa: D102
        velocity = [robot.velocity[:2, 0] for robot in self.world.robot_list]
        box = self.world.obstacle_list[0].vertices.T[:4]
        return sf.Scene.from_world(self.positions(), velocity, 0.2, polygons=[box])


safety_filter = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(V_MAX))
loop = closed_loop(World, lambda env: SafeAction(env, safety_filter, index=[0, 1, 2, 3]))
TestWorld = loop.TestCase

if __name__ == "__main__":
    run_state_machine_as_test(loop, settings=settings(loop.TestCase.settings, max_examples=10))
    print("10 episodes of adversarial robots around a box, no contact")
