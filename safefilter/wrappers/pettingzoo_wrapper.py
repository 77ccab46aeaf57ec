"""SafeParallelEnv: a PettingZoo environment in which only certified actions execute.

Letters: N agents, each a robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_mapping, whole_number
from safefilter.arrays import BoolArray, IntArray, frozen, number_array
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.wrappers.action_filter import Action, ActionFilter, Executed
from safefilter.wrappers.action_limits import rows_space
from safefilter.wrappers.decision_info import info_of_lanes, of_lane
from safefilter.wrappers.episode_totals import EpisodeTotals
from safefilter.wrappers.gymnasium_wrapper import require_penalty
from safefilter.wrappers.lanes import Lanes
from safefilter.wrappers.scene_source import SceneFunction, SceneSource
from safefilter.wrappers.wrapper_order import refuse

try:
    from pettingzoo.utils import BaseParallelWrapper
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "SafeParallelEnv needs PettingZoo: pip install 'safefilter[learn]'", name=error.name
    ) from error

Agent: TypeAlias = Any
Results: TypeAlias = tuple[
    dict[Agent, Any], dict[Agent, float], dict[Agent, bool], dict[Agent, bool], dict[Agent, Any]
]


class SafeParallelEnv(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo has no types
    """Filters the actions of all agents by one call of the filter a step.

    An agent that is done leaves the environment's lists, but its body stays in the world: as a robot that does not
    cooperate, which everyone else goes around. So the scene holds the robots of all possible agents, done or not.

    ``infos[agent]["safefilter"]`` tells of an agent's step, as in `SafeAction` for one robot; in its last step
    ``infos[agent]["safefilter_episode"]`` tells of its episode.
    """

    changes_actions = "filters actions"

    def __init__(
        self,
        env: Any,
        safety_filter: SafetyFilter,
        *,
        scene: SceneFunction | None = None,
        robots: Mapping[Agent, int] | None = None,
        penalty: float = 0.0,
        allow_stop: bool = False,
    ) -> None:
        """Put the filter around an environment.

        Args:
            env: Parallel environment whose agents act by velocities in world axes in m/s, or by commands (v, w) of a
                differential drive: a Box of shape (2,) each.
            safety_filter: Who decides.
            scene: Function ``(env, observations, infos) -> Scene`` of the unwrapped environment and of what its last
                step or reset returned; None for the ``scene()`` of the unwrapped environment. Robots that belong to no
                agent are as the scene says.
            robots: Robot of the scene of each possible agent; None: in the order of ``env.possible_agents``.
            penalty: Reward taken away from an agent per m/s of correction.
            allow_stop: As in `SafeAction`.

        Raises:
            WrapperOrderError: If a wrapper inside would change what was certified.
            SceneUnavailable: If there is neither ``scene`` nor ``env.unwrapped.scene()``.
            InvalidInput: If ``robots`` is not for all possible agents, or an action space is not a Box of float32 or
                float64.
            ShapeError: If an action space has another shape.
            OutOfRange: If it does not hold all actions that the filter may execute, or if ``penalty`` or ``robots``
                cannot be used.
        """
        super().__init__(env)
        self._agents: list[Agent] = list(env.possible_agents)
        _require_innermost(env, self._agents)
        places = dict(zip(self._agents, range(len(self._agents)), strict=True))
        index = places if robots is None else require_mapping(robots, "robots")
        if set(index) != set(self._agents):
            raise InvalidInput(
                f"robots: expected a robot for each of the agents {self._agents}, got {index}"
            )
        self._robots = np.array(
            [whole_number(index[agent], f"robots[{agent!r}]", 0) for agent in self._agents],
            dtype=np.int64,
        )
        self._penalty = require_penalty(penalty)
        space = rows_space([env.action_space(agent) for agent in self._agents])
        self._filter = ActionFilter(
            safety_filter,
            space,
            self._robots.tolist(),
            allow_stop=allow_stop,
            env=env.unwrapped,
        )
        self._scene = SceneSource(env.unwrapped, scene)
        self._latest: tuple[Any, dict[Agent, Any]] | None = None
        self._totals = EpisodeTotals(len(self._agents))

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[Agent, Any], dict[Agent, Any]]:
        """Start an episode, as the environment does."""
        self._latest = self.env.reset(seed=seed, options=options)
        self._totals = EpisodeTotals(len(self._agents))
        return self._latest

    def step(self, actions: Mapping[Agent, npt.ArrayLike]) -> Results:
        """Execute what the filter makes of ``actions``.

        Args:
            actions: Action wanted by each agent that is not done. NaN is decided as standing still.

        Returns:
            Observations, rewards less the penalty, terminations, truncations, infos.

        Raises:
            gymnasium.error.ResetNeeded: Before the first `reset`.
            InvalidInput: If an agent's action is missing, or it is done or unknown.
            SafeFilterError: As `SafetyFilter.decide`.
        """
        require_mapping(actions, "actions")
        if not actions and not self.agents:
            return self.env.step({})  # type: ignore[no-any-return]  # PettingZoo has no types
        acts = self._acting(actions)
        lanes = Lanes.single(self._bodies(acts))
        wanted = self._wanted(actions)
        is_asked = acts & lanes.scene.cooperative[self._robots]
        executed = self._filter(lanes, wanted, is_asked[np.newaxis])
        self._see(lanes.scene, acts)
        given = {
            agent: executed.action[0, row].copy()
            for row, agent in enumerate(self._agents)
            if acts[row]
        }
        observations, rewards, terminated, truncated, infos = self.env.step(given)
        self._latest = observations, infos
        self._totals.add(executed.decision, executed.row, acts)
        done = np.array(
            [terminated.get(agent, False) or truncated.get(agent, False) for agent in self._agents],
            dtype=np.bool_,
        )
        infos = self._told(executed, acts, done, infos)
        return observations, self._less_penalty(rewards, executed), terminated, truncated, infos

    def _acting(self, actions: Mapping[Agent, npt.ArrayLike]) -> BoolArray:
        """Agents whose actions execute, shape (N,).

        Raises:
            InvalidInput: If these are not the agents that are not done.
        """
        if set(require_mapping(actions, "actions")) != set(self.agents):
            missing = [agent for agent in self.agents if agent not in actions]
            surplus = [agent for agent in actions if agent not in self.agents]
            raise InvalidInput(
                f"actions: expected one for each of {list(self.agents)}; missing {missing}, and {surplus} do not act"
            )
        return np.array([agent in actions for agent in self._agents], dtype=np.bool_)

    def _wanted(self, actions: Mapping[Agent, npt.ArrayLike]) -> Action:
        """Actions of all possible agents, zero for those that do not act, shape (1, N, 2).

        Raises:
            ShapeError: If one is of another shape than (2,).
        """
        rows = np.zeros((len(self._agents), 2))
        for row, agent in enumerate(self._agents):
            if agent in actions:
                action = number_array(actions[agent], f"action of {agent!r}", "two numbers")
                if action.shape != (2,):
                    raise ShapeError(
                        f"action of {agent!r}: expected shape (2,), got {action.shape}"
                    )
                rows[row] = action
        return self._filter.in_space(rows)

    def _bodies(self, acts: BoolArray) -> Scene:
        """The scene, in which agents that do not act do not cooperate.

        Raises:
            gymnasium.error.ResetNeeded: Before the first `reset`.
            OutOfRange: If the scene lacks an agent's robot.
        """
        if self._latest is None:
            raise gymnasium.error.ResetNeeded("SafeParallelEnv: call reset() before step()")
        scene: Scene = self._scene(*self._latest)
        if self._robots.max() >= scene.num_robots:
            raise OutOfRange(
                f"scene: it has {scene.num_robots} robots, but the agents are robots {self._robots.tolist()}; those "
                "of agents that are done stay in the world, and in the scene"
            )
        parked = self._robots[~acts]
        if not scene.cooperative[parked].any():
            return scene
        cooperative = scene.cooperative.copy()
        cooperative[parked] = False
        return replace(scene, cooperative=frozen(cooperative))

    def _see(self, scene: Scene, which: BoolArray) -> None:
        rows: IntArray = np.flatnonzero(which)
        self._totals.see(scene, self._robots[rows, np.newaxis], rows)

    def _told(
        self, executed: Executed, acts: BoolArray, done: BoolArray, infos: dict[Agent, Any]
    ) -> dict[Agent, Any]:
        """The environment's infos, with what the filter did."""
        columns = info_of_lanes(_by_agent(executed), is_single=True)
        over = acts & done
        if over.any():
            self._see(self._bodies(acts & ~done), over)
        totals = self._totals.numbers()
        told = dict(infos)
        for row in np.flatnonzero(acts).tolist():
            agent = self._agents[row]
            told[agent] = {**infos.get(agent, {}), "safefilter": of_lane(columns, row)}
            if over[row]:
                told[agent]["safefilter_episode"] = of_lane(totals, row)
        self._totals.begin(over)
        return told

    def _less_penalty(self, rewards: dict[Agent, float], executed: Executed) -> dict[Agent, float]:
        if not self._penalty:
            return rewards
        correction = _by_agent(executed).correction()
        return {
            agent: reward - self._penalty * float(correction[self._agents.index(agent)])
            for agent, reward in rewards.items()
        }


def _by_agent(executed: Executed) -> Executed:
    """Each agent a lane with one row."""
    return Executed(
        executed.action[0][:, np.newaxis],
        executed.decision,
        executed.row,
        np.zeros_like(executed.row),
    )


def _require_innermost(env: Any, agents: list[Agent]) -> None:
    layer = env
    while isinstance(layer, BaseParallelWrapper):
        # Asked of the class: these wrappers answer with the attributes of what they wrap.
        change = getattr(type(layer), "changes_actions", "")
        if any(layer.action_space(agent) != layer.env.action_space(agent) for agent in agents):
            change = change or "has another action space"
        if change:
            refuse(layer, change)
        layer = layer.env
