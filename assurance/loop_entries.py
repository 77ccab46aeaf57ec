"""Entry points around the filter: wrappers, environments, `Projection`, comparisons; see `filter_entries`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from pettingzoo import ParallelEnv

import envs
import safefilter as sf
from assurance.filter_entries import Entry, Street, program, robots, scene
from envs.pettingzoo_adapter import ParallelRobots
from envs.vector_adapter import VectorRobots
from safefilter.comparison import (
    Plan,
    Problem,
    ProblemSet,
    Recorder,
    Setting,
    contenders_of,
    read_problems,
    shipped_set,
    truth_of,
)
from safefilter.differentiable import Projection, as_tensors
from safefilter.wrappers import SafeParallelEnv, SafeVectorAction

SPACE = gymnasium.spaces.Box(-1.0, 1.0, (2,))
NO_ROWS = sf.HalfSpaces.everywhere(2, 2)


class Lanes(SyncVectorEnv):
    """Two streets whose scenes may be anything."""

    def __init__(self, scenes: Any) -> None:
        self.scenes = scenes
        super().__init__(
            [lambda: Street(SPACE, scene())] * 2, autoreset_mode=AutoresetMode.DISABLED
        )

    def scene(self) -> Any:
        """What is said of where everyone is."""
        return self.scenes


class Agents(ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """Two robots whose spaces, and whose scene, may be anything."""

    metadata = {"name": "agents_v0"}  # noqa: RUF012  # as PettingZoo has it

    def __init__(self, space: Any, scene_now: Any) -> None:
        self.possible_agents = ["a", "b"]
        self.space, self.scene_now = space, scene_now

    def action_space(self, _: str) -> Any:
        """The same for both."""
        return self.space

    def observation_space(self, _: str) -> gymnasium.spaces.Box:
        """Of nothing."""
        return SPACE

    def reset(self, seed: Any = None, options: Any = None) -> tuple[Any, Any]:  # noqa: ARG002  # PettingZoo's
        """Both act."""
        self.agents = list(self.possible_agents)
        return {name: np.zeros(2) for name in self.agents}, {name: {} for name in self.agents}

    def step(self, actions: Any) -> tuple[Any, ...]:
        """Nobody is done.

        Raises:
            RuntimeError: If something executes that is no number.
        """
        if not all(np.isfinite(action).all() for action in actions.values()):
            raise RuntimeError("NaN executes")
        none = dict.fromkeys(self.agents, False)
        return {}, dict.fromkeys(self.agents, 0.0), none, none, {name: {} for name in self.agents}

    def scene(self) -> Any:
        """What is said of where everyone is."""
        return self.scene_now


def step_lanes(scenes: Any, actions: Any, index: Any, penalty: Any, options: Any) -> None:
    """One step of a filtered vector environment."""
    env = SafeVectorAction(Lanes(scenes), robots(), index=index, penalty=penalty)
    env.reset(options=options)
    env.step(actions)


def step_agents(space: Any, scene_now: Any, actions: Any, agents: Any, penalty: Any) -> None:
    """One step of a filtered environment of many agents."""
    env = SafeParallelEnv(Agents(space, scene_now), robots(), robots=agents, penalty=penalty)
    env.reset()
    env.step(actions)


@cache
def learner() -> Any:
    """One learner among eight in the crossroad, behind the filter's rules."""
    return gymnasium.make("envs:Crossroad-v0", disable_env_checker=True).unwrapped


@cache
def lanes() -> VectorRobots:
    """Every robot of two crossroads a lane."""
    return VectorRobots(num_envs=16, scenario="crossroad", kinematics="holonomic")


@cache
def agents() -> ParallelRobots:
    """Every robot of a crossroad an agent."""
    return ParallelRobots("crossroad", kinematics="holonomic")


def step_learner(action: Any) -> object:
    """One step of a Gymnasium environment of ours, without any filter."""
    learner().reset(seed=0)
    return checked(learner().step(action))


def step_vector(actions: Any) -> object:
    """The same of the vector environment."""
    lanes().reset(seed=0)
    return checked(lanes().step(actions))


def step_parallel(actions: Any) -> object:
    """The same of the PettingZoo environment."""
    agents().reset(seed=0)
    return checked(agents().step(actions))


def checked(results: Any) -> object:
    """What a step returned.

    Raises:
        RuntimeError: If an observation or a reward is no number.
    """
    for part in results[:2]:
        values = part.values() if isinstance(part, Mapping) else [part]
        if not all(np.isfinite(np.asarray(value)).all() for value in values):
            raise RuntimeError(f"an observation or a reward is no number: {part}")
    return None


def project(action: Any, normals: Any, offsets: Any, hard: Any, present: Any) -> object:
    """The differentiable filter on tensors, wherever a value can be one."""
    given = [_as_tensor(value) for value in (action, normals, offsets, hard, present)]
    answer = Projection().solve(given[0], given[1], given[2], hard=given[3], present=given[4])
    return checked((answer.point.detach().numpy(), answer.least_violation.detach().numpy()))


def _as_tensor(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    try:
        return torch.from_numpy(value.copy())
    except TypeError:
        return value


def compare(sets: Any, contenders: Any, plan: Any) -> object:
    """Compare solvers; nothing is compared where something cannot be."""
    return sf.compare_backends(sets, contenders, plan)


@cache
def problem() -> Problem:
    """One row."""
    return Problem.of("one", [1.0, 0.0], [[-1.0, 0.0]], [-0.5], [False], scale=1.0)


_ENTRIES: dict[str, tuple[Callable[..., object], Callable[[], Mapping[str, Any]]]] = {
    "Uncertainty": (
        sf.Uncertainty,
        lambda: {
            "position_error": 0.01,
            "heading_error": 0.01,
            "velocity_error": 0.01,
            "observation_delay": 0.01,
            "actuation_delay": 0.01,
            "clock_jitter": 0.01,
            "lost_messages": 1,
            "actuation_error": 0.01,
        },
    ),
    "Separation with uncertainty": (
        lambda uncertainty: sf.Separation(0.2, uncertainty=uncertainty),
        lambda: {"uncertainty": sf.Uncertainty()},
    ),
    "HalfSpaces.stacked": (sf.HalfSpaces.stacked, lambda: {"parts": [NO_ROWS]}),
    "half_spaces": (
        lambda **given: robots().half_spaces(**given),
        lambda: {"scene": scene(), "action": [[1.0, 0.0], [0.0, 0.0]], "index": [0, 1]},
    ),
    "SafeVectorAction": (
        step_lanes,
        lambda: {
            "scenes": [scene(), scene()],
            "actions": np.zeros((2, 2), np.float32),
            "index": 0,
            "penalty": 0.0,
            "options": None,
        },
    ),
    "SafeParallelEnv": (
        step_agents,
        lambda: {
            "space": SPACE,
            "scene_now": scene(),
            "actions": {"a": np.zeros(2), "b": np.zeros(2)},
            "agents": None,
            "penalty": 0.0,
        },
    ),
    "SafeParallelEnv, one action": (
        lambda action: step_agents(SPACE, scene(), {"a": action, "b": np.zeros(2)}, None, 0.0),
        lambda: {"action": np.zeros(2)},
    ),
    "Crossroad-v0": (step_learner, lambda: {"action": np.zeros(2, np.float32)}),
    "VectorRobots": (step_vector, lambda: {"actions": np.zeros((16, 2), np.float32)}),
    "ParallelRobots": (
        step_parallel,
        lambda: {"actions": {name: np.zeros(2) for name in agents().possible_agents}},
    ),
    "ParallelRobots, one action": (
        lambda action: step_parallel(
            {name: np.zeros(2) for name in agents().possible_agents} | {"robot_0": action}
        ),
        lambda: {"action": np.zeros(2)},
    ),
    "load_scenario": (envs.load_scenario, lambda: {"name": "crossroad"}),
    "Projection": (
        project,
        lambda: {
            "action": np.ones((1, 2)),
            "normals": np.eye(2),
            "offsets": np.zeros(2),
            "hard": None,
            "present": None,
        },
    ),
    "Projection's tolerance": (
        lambda tolerance: Projection(tolerance=tolerance),
        lambda: {"tolerance": 1e-9},
    ),
    "as_tensors": (as_tensors, lambda: {"rows": NO_ROWS}),
    "Problem": (
        Problem.of,
        lambda: {
            "sequence": "one",
            "wanted": [1.0, 0.0],
            "normals": [[-1.0, 0.0]],
            "offsets": [-0.5],
            "hard": [False],
            "scale": 1.0,
            "radius": 2.0,
            "padding": 0,
        },
    ),
    "ProblemSet": (
        ProblemSet,
        lambda: {
            "name": "mine",
            "description": "",
            "unit": "m/s",
            "problems": (problem(),),
            "truths": {},
        },
    ),
    "shipped_set": (shipped_set, lambda: {"name": "case_2"}),
    "read_problems": (read_problems, lambda: {"path": "nowhere.jsonl"}),
    "contenders_of": (
        contenders_of,
        lambda: {"backends": ["planar"], "settings": [Setting.TOLERANCE]},
    ),
    "truth_of": (truth_of, lambda: {"problem": problem(), "tolerance": 1e-9}),
    "Recorder": (Recorder, lambda: {"path": "new.jsonl"}),
    # Nothing is compared: without contenders that is refused.
    "compare_backends": (
        compare,
        lambda: {
            "sets": [ProblemSet("mine", "", "m/s", (problem(),), {})],
            "contenders": (),
            "plan": Plan(),
        },
    ),
    "certify a Solution": (
        lambda solution: sf.certify(program(), solution),
        lambda: {"solution": sf.Solution(sf.Status.OPTIMAL, np.ones(2), np.zeros(2), 0.0, 0.0)},
    ),
}
LOOP_ENTRIES = {name: Entry(*entry) for name, entry in _ENTRIES.items()}
"""By a name for people."""
