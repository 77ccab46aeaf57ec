"""What other simulators of robots with a lidar do in a second, each in the world nearest to ours that it offers.

What cannot be compared: none judges collisions inside of a step, and only vmas steps many worlds at once, in torch.

* vmas (navigation): holonomic discs on forces, no walls; its lidar sees the 7 other robots. 36 rays, many worlds.
* navground: differential drives told to go on, one world with two of the walls; its lidar is read once a step and
  robot. It has no observation: the ranges are all.
* ir-sim: differential drives, one world with the walls of our crossroad; its step includes its lidar.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import torch

from benchmarks.results import Row
from benchmarks.timing import interleaved
from safefilter.errors import InvalidInput

NUM_ROBOTS = 8
NUM_BEAMS = 36
VMAS_WORLDS = (8, 512)
STEPS = 5
GROUP = "other simulators, one thread"

NAVGROUND_WORLD = f"""
walls:
  - line: [[-0.7, -3], [-0.7, -0.7]]
  - line: [[0.7, -3], [0.7, -0.7]]
groups:
  - type: thymio
    number: {NUM_ROBOTS}
    radius: 0.105
    control_period: 0.2
    kinematics: {{type: 2WDiff, wheel_axis: 0.16, max_speed: 0.2}}
    behavior: {{type: Dummy}}
    task: {{type: Waypoints, waypoints: [[3, 0]]}}
    state_estimation: {{type: Lidar, range: 3.5, resolution: {NUM_BEAMS}, start_angle: 0.0, field_of_view: 6.2832}}
    position: {{sampler: uniform, from: [-2, -2], to: [2, 2]}}
"""

IRSIM_WORLD = f"""
world: {{height: 6, width: 6, offset: [-3, -3], step_time: 0.2, sample_time: 0.2, collision_mode: stop}}
robot:
  - number: {NUM_ROBOTS}
    distribution: {{name: circle, radius: 0.5, center: [0, 0]}}
    kinematics: {{name: diff}}
    shape: {{name: circle, radius: 0.105}}
    vel_min: [0, -2.5]
    vel_max: [0.2, 2.5]
    behavior: {{name: dash}}
    sensors:
      - {{type: lidar2d, range_min: 0, range_max: 3.5, angle_range: 6.2832, number: {NUM_BEAMS}, noise: False}}
obstacle:
  - shape:
      name: linestring
      vertices: [[0.7, 0.7], [0.7, 2.8], [-0.7, 2.8], [-0.7, 0.7], [-2.8, 0.7], [-2.8, -0.7], [-0.7, -0.7],
                 [-0.7, -2.8], [0.7, -2.8], [0.7, -0.7], [2.8, -0.7], [2.8, 0.7], [0.7, 0.7]]
"""


def other_simulators(rounds: int) -> Iterator[Row]:
    """Time those that are installed, on one thread.

    Args:
        rounds: How often each is timed.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        for name, make, robots in _simulators():
            with contextlib.suppress(ImportError):
                taken = interleaved({name: make()}, rounds=rounds)[name]
                rate = STEPS * robots / taken / 1e3
                yield Row(name, GROUP, {"best": rate.max(), "median": float(np.median(rate))})
    finally:
        torch.set_num_threads(threads)


def _simulators() -> Iterator[tuple[str, Callable[[], Callable[[], object]], int]]:
    for num_worlds in VMAS_WORLDS:
        yield f"vmas, {num_worlds} worlds", partial(_vmas, num_worlds), NUM_ROBOTS * num_worlds
    yield "navground, 1 world", _navground, NUM_ROBOTS
    yield "ir-sim, 1 world", _irsim, NUM_ROBOTS


def _vmas(num_worlds: int) -> Callable[[], object]:
    import vmas  # noqa: PLC0415  # loads the gym of old, with its warnings: on request only

    env = vmas.make_env(
        scenario="navigation",
        num_envs=num_worlds,
        device="cpu",
        continuous_actions=True,
        seed=0,
        n_agents=NUM_ROBOTS,
        n_lidar_rays=NUM_BEAMS,
        lidar_range=3.5,
        agent_radius=0.105,
    )
    env.reset()
    actions = [torch.full((num_worlds, 2), 0.1) for _ in range(NUM_ROBOTS)]

    def run() -> None:
        for _ in range(STEPS):
            env.step(actions)

    return run


def _navground() -> Callable[[], object]:
    from navground import core, sim  # noqa: PLC0415  # on request only

    world = sim.World()
    # Loading gives None where the text is wrong.
    scenario = sim.load_scenario(NAVGROUND_WORLD)
    if scenario is None:
        raise InvalidInput(
            "navground does not take NAVGROUND_WORLD; look for what its version changed"
        )
    scenario.init_world(world, seed=1)
    scans = [(agent, core.SensingState()) for agent in world.agents]
    for agent, _ in scans:
        agent.state_estimations[0].prepare(agent, world)

    def run() -> None:
        for _ in range(STEPS):
            world.update(0.2)
            for agent, scan in scans:
                agent.state_estimations[0].update(agent, world, scan)

    return run


def _irsim() -> Callable[[], object]:
    import irsim  # noqa: PLC0415  # loads pyplot: on request only

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.yaml"
        path.write_text(IRSIM_WORLD, encoding="utf-8")
        env = irsim.make(str(path), display=False, log_level="ERROR")

    def run() -> None:
        for _ in range(STEPS):
            env.step()

    return run
