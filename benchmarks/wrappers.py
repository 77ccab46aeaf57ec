"""What each wrapper costs a step, on top of the bare filter: the same robots, the same decisions.

The environments do next to nothing, so that the wrapper is what is timed; making the scene is part of every row.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import gymnasium
import numba
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from pettingzoo import ParallelEnv

from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved, on_threads
from safefilter import Holonomic, PriorityORCA, SafetyFilter, Scene, Separation
from safefilter.arrays import FloatArray
from safefilter.wrappers import SafeAction, SafeParallelEnv, SafePolicy, SafeVectorAction

BARE = "scene and decide"
ONE_ROBOT, ALL_ROBOTS, LANES = (
    "one of 10 robots",
    "all of 10 robots",
    "32 lanes, one of 10 robots each",
)
NUM_ROBOTS, NUM_LANES = 10, 32
RADIUS, V_MAX, DT = 0.1, 0.2, 0.2
ROUNDS, QUICK_ROUNDS = 1000, 50
FILTER = SafetyFilter([PriorityORCA(2.0), Separation(DT)], Holonomic(V_MAX))
# Robots on a grid, 0.5 m apart, all heading east: near enough for rows, and nobody is corrected.
PLACE = np.arange(NUM_ROBOTS)
POSITION: FloatArray = np.stack([0.5 * (PLACE % 5), 0.5 * (PLACE // 5)], axis=1)
VELOCITY: FloatArray = np.tile([0.1, 0.0], (NUM_ROBOTS, 1))
EAST = VELOCITY.astype(np.float32)


def scene() -> Scene:
    """Make the scene of one environment."""
    return Scene.from_world(POSITION, VELOCITY, RADIUS)


class Still(gymnasium.Env[Any, Any]):
    """An environment in which nothing happens."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def __init__(self, shape: tuple[int, ...] = (2,)) -> None:
        """Take actions of a shape."""
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, shape)
        self._observation = np.zeros(2, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Do nothing."""
        super().reset(seed=seed, options=options)
        return self._observation, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:  # noqa: ARG002
        """Do nothing."""
        return self._observation, 0.0, False, False, {}

    def scene(self) -> Scene:
        """Say where everyone is."""
        return scene()


class StillCrowd(ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """A crowd to which nothing happens."""

    def __init__(self) -> None:
        """Name the agents."""
        self.possible_agents = [f"robot_{robot}" for robot in range(NUM_ROBOTS)]
        self._space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
        self._nothing = {agent: np.zeros(2) for agent in self.possible_agents}

    def action_space(self, agent: str) -> gymnasium.spaces.Box:  # noqa: ARG002
        """Velocities."""
        return self._space

    def reset(self, seed: int | None = None, options: Any = None) -> tuple[Any, Any]:  # noqa: ARG002
        """Do nothing."""
        self.agents = list(self.possible_agents)
        return self._nothing, {agent: {} for agent in self.agents}

    def step(self, actions: Any) -> tuple[Any, ...]:
        """Do nothing."""
        no = dict.fromkeys(actions, False)
        return self._nothing, dict.fromkeys(actions, 0.0), no, no, {agent: {} for agent in actions}

    def scene(self) -> Scene:
        """Say where everyone is."""
        return scene()


def measure(*, quick: bool = False) -> Result:
    """Time each wrapper beside the bare filter.

    Args:
        quick: Few rounds.
    """
    rows: list[Row] = []
    groups = {ONE_ROBOT: one_robot(), ALL_ROBOTS: all_robots(), LANES: lanes()}
    for (name_of_group, actions), threads in product(
        groups.items(), (1, 2)[: numba.get_num_threads()]
    ):
        group = f"{name_of_group}, {threads} thread{'s' if threads > 1 else ''}"
        with on_threads(threads):
            times = interleaved(actions, rounds=QUICK_ROUNDS if quick else ROUNDS)
        median = {name: float(np.median(time)) for name, time in times.items()}
        rows += [
            Row(
                name,
                group,
                {"median us": 1e6 * time, "on top us": 1e6 * (time - median[BARE])},
                time / median[BARE],
            )
            for name, time in median.items()
        ]
    return Result(
        name="wrappers",
        title="One step through each wrapper, in us",
        ratio_of=BARE,
        rows=tuple(rows),
        notes=(
            "PriorityORCA, Separation and 64 sides; environments that do nothing; nobody is corrected.",
            f"'{BARE}': Scene.from_world and SafetyFilter.decide, without any wrapper.",
            "Batches this small stay on the caller's thread, however many there are.",
        ),
    )


def one_robot() -> dict[str, Action]:
    """Steps of one robot."""
    env = SafeAction(Still(), FILTER)
    env.reset(seed=0)
    policy: SafePolicy[Any] = SafePolicy(lambda _: EAST[0], FILTER, scene=lambda _: scene())
    return {
        BARE: lambda: FILTER.decide(scene(), EAST[:1], [0]),
        "SafeAction": partial(env.step, EAST[0]),
        "SafePolicy": partial(policy.predict, None),
    }


def all_robots() -> dict[str, Action]:
    """Steps of a crowd."""
    env = SafeAction(Still((NUM_ROBOTS, 2)), FILTER, index=None)
    crowd = SafeParallelEnv(StillCrowd(), FILTER)
    env.reset(seed=0)
    crowd.reset(seed=0)
    wishes = dict(zip(crowd.possible_agents, EAST, strict=True))
    return {
        BARE: lambda: FILTER.decide(scene(), EAST),
        "SafeAction": partial(env.step, EAST),
        "SafeParallelEnv": partial(crowd.step, wishes),
    }


def lanes() -> dict[str, Action]:
    """Steps of a vector environment: filtered lane by lane, and all at once."""
    modes = AutoresetMode.NEXT_STEP
    wishes = np.tile(EAST[0], (NUM_LANES, 1))

    def filtered() -> gymnasium.Env[Any, Any]:
        return SafeAction(Still(), FILTER)

    envs: dict[str, Any] = {
        "SyncVectorEnv alone": SyncVectorEnv([Still] * NUM_LANES, autoreset_mode=modes),
        "SyncVectorEnv of SafeAction": SyncVectorEnv([filtered] * NUM_LANES, autoreset_mode=modes),
        "SafeVectorAction, a scene a lane": SafeVectorAction(
            SyncVectorEnv([Still] * NUM_LANES, autoreset_mode=modes), FILTER
        ),
        "SafeVectorAction, one scene for all": SafeVectorAction(
            SyncVectorEnv([Still] * NUM_LANES, autoreset_mode=modes),
            FILTER,
            scene=lambda *_: scene_of_all(),
        ),
    }
    steps: dict[str, Callable[[], object]] = {
        BARE: lambda: FILTER.decide(scene_of_all(), wishes, np.arange(NUM_LANES) * NUM_ROBOTS)
    }
    for name, env in envs.items():
        env.reset(seed=0)
        steps[name] = partial(env.step, wishes)
    return steps


def scene_of_all() -> Scene:
    """Make one scene of all lanes."""
    return Scene.from_world(
        np.tile(POSITION, (NUM_LANES, 1)),
        np.tile(VELOCITY, (NUM_LANES, 1)),
        RADIUS,
        world=np.repeat(np.arange(NUM_LANES), NUM_ROBOTS),
        reach=3.0,
    )
