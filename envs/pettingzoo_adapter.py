"""The PettingZoo face of a world: every robot is an agent.

Letters: N robots of which the first M are agents. SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt

from envs.agents import Agents, Step, drives_unless_told, parked_when_done, scenario_and_rules
from envs.dynamics import Kinematics
from envs.fleet import Fleet
from envs.layers import Layers
from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout
from envs.reward import RewardWeights
from envs.rules import Rules
from envs.scenarios import Scenario
from envs.sensing import Sensing
from envs.spaces import (
    Action,
    Observation,
    ObservationForm,
    action_space,
    in_form,
    observation_space,
)
from envs.spectator import FRAMES_PER_SECOND, RENDER_MODES, Picture, RenderMode, Spectator
from safefilter.arguments import require_mapping
from safefilter.arrays import FloatArray, IntArray, shaped_array
from safefilter.decision import Decision
from safefilter.errors import InvalidInput
from safefilter.scene import Scene

try:
    from pettingzoo import ParallelEnv
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "ParallelRobots needs PettingZoo: pip install 'safefilter[learn]'", name=error.name
    ) from error

Results = tuple[
    dict[str, Observation],
    dict[str, float],
    dict[str, bool],
    dict[str, bool],
    dict[str, dict[str, Any]],
]


class ParallelRobots(ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """All robots of a world; agent ``robot_i`` is robot i of `scene`.

    Actions, observations, rewards, ends and ``infos`` are those of `OneLearner`, for each robot. An agent that is done
    leaves ``agents``; its body stays by the rules, at rest. Where robots are reborn an arrival is not the end, and an
    agent that waits for its rebirth acts in vain.

    Attributes:
        navigation: The world.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "robots_v0",
        "render_modes": RENDER_MODES,
        "render_fps": FRAMES_PER_SECOND,
    }

    def __init__(
        self,
        scenario: Scenario | str | Path = "crossroad",
        *,
        fleet: Fleet | None = None,
        kinematics: Kinematics | None = None,
        rules: Rules | None = None,
        layout: ObservationLayout | None = None,
        observation: ObservationForm = "flat",
        sensing: Sensing | None = None,
        weights: RewardWeights | None = None,
        render_mode: RenderMode | None = None,
        layers: Layers | None = None,
        record: str | Path | None = None,
    ) -> None:
        """Build the world.

        Args:
            scenario: Places the robots: a scenario, or the name or file of one.
            fleet: What the robots are; None: Turtlebots.
            kinematics: How robots move; None: as the fleet does, or as differential drives without one.
            rules: Rules of the episode; None: those that the scenario recommends, if it does. Robots that have
                arrived cannot yield, as nobody acts for them: they park.
            layout: Which blocks observations have; by default 5 neighbours and 36 beams.
            observation: Their form: ``"flat"``, shape (F,), or ``"dict"``, block by block.
            sensing: How well robots sense; by default perfectly.
            weights: Weights of the reward.
            render_mode: ``"human"`` (a window), ``"rgb_array"`` or None.
            layers: What pictures show beside robots and walls.
            record: Folder for a file of each episode; None: no files.

        Raises:
            InvalidInput: If people stand before robots, or a mode or form is none.
            UnknownScenario: If the library has no such scenario.
            ScenarioFileError: If a scenario file cannot be used.
        """
        found, rules = scenario_and_rules(scenario, rules)
        fleet = drives_unless_told(found.num_robots, fleet, kinematics)
        self.navigation = Navigation(
            found, fleet, parked_when_done(rules), layout=layout, sensing=sensing
        )
        self.render_mode = render_mode
        self._form: ObservationForm = observation
        self._agents = Agents(self.navigation, weights, goes_on_when_reborn=True)
        self._spectator = Spectator(self.navigation, render_mode, record, layers)
        self.possible_agents = [f"robot_{i}" for i in range(self._agents.num_agents)]
        self.agents: list[str] = []
        self.action_spaces = {
            agent: action_space(fleet.kinematics, fleet.v_max[i], fleet.omega_max[i])
            for i, agent in enumerate(self.possible_agents)
        }
        self.observation_spaces = {
            agent: observation_space(self.navigation.observer.layout, observation)
            for agent in self.possible_agents
        }

    def observation_space(self, agent: str) -> gymnasium.Space[Observation]:
        """What an agent sees: always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Action]:
        """What an agent may do: always the same object."""
        return self.action_spaces[agent]

    def reset(
        self,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002  # PettingZoo's signature
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode; the same seed starts the same one.

        Args:
            seed: Seed; None goes on with the generators.
            options: Not used.
        """
        self._agents.reset(seed)
        self._spectator.begin(seed)
        self.agents = list(self.possible_agents)
        return self._observations(self.agents), {agent: {} for agent in self.agents}

    def step(self, actions: Mapping[str, npt.ArrayLike]) -> Results:
        """Move all robots.

        Args:
            actions: Action of each agent that is not done, shape (2,).

        Returns:
            Observations, rewards, terminations, truncations, infos of the agents that acted.

        Raises:
            InvalidInput: If the actions are not those of the agents that are not done.
            ShapeError: If one is something else.
        """
        acting = self.agents
        if set(require_mapping(actions, "actions")) != set(acting):
            raise InvalidInput(
                f"actions: expected one for each of {acting}, got them for {list(actions)}"
            )
        if not acting:
            return {}, {}, {}, {}, {}
        step = self._agents.step(self._given(actions))
        self._spectator.see(step)
        self.agents = [
            agent
            for agent, is_over in zip(self.possible_agents, self._agents.is_over[0], strict=True)
            if not is_over
        ]
        if not self.agents:
            self._spectator.end()
        return (self._observations(acting), *self._told(step, acting))

    def render(self) -> Picture | None:
        """Picture of the present moment, shape (height, width, 3); None where nobody asked for pictures."""
        return self._spectator.render()

    def close(self) -> None:
        """Close window and file."""
        self._spectator.close()

    def scene(self) -> Scene:
        """What robots know of each other now, agents or not; serves the filter."""
        return self.navigation.scene()

    def note_decisions(self, decision: Decision, robots: IntArray) -> None:
        """Learn from a filter what it decided for the next step; shown, recorded, and paid for by the reward.

        Args:
            decision: Decisions.
            robots: Robot of each.
        """
        self._agents.note_decisions(decision, robots)

    def _given(self, actions: Mapping[str, npt.ArrayLike]) -> FloatArray:
        """What robots are told, shape (1, N, 2): to stand still where nobody acts.

        Raises:
            ShapeError: If an action is of another shape.
        """
        given = np.zeros(self.navigation.world.position.shape)
        for i, agent in enumerate(self.possible_agents):
            if agent in actions:
                given[0, i] = shaped_array(actions[agent], f"action of {agent}", (2,))
        return given

    def _observations(self, agents: list[str]) -> dict[str, Observation]:
        flat, layout = self._agents.observe()[0], self.navigation.observer.layout
        return {
            agent: in_form(layout, flat[self.possible_agents.index(agent)].copy(), self._form)
            for agent in agents
        }

    def _told(
        self, step: Step, acting: list[str]
    ) -> tuple[dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        rewards, terminated, truncated, infos = {}, {}, {}, {}
        for agent in acting:
            i = self.possible_agents.index(agent)
            rewards[agent] = float(step.reward[0, i])
            terminated[agent] = bool(step.terminated[0, i])
            truncated[agent] = bool(step.truncated[0, i])
            infos[agent] = {name: values[0, i].item() for name, values in step.info.items()}
        return rewards, terminated, truncated, infos
