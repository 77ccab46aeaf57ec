"""The Gymnasium face of a world: robot 0 learns, the others follow a policy, through a filter or not.

Letters: N robots. SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import gymnasium
import numpy as np

from envs.agents import Agents, drives_unless_told, scenario_and_rules
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
from envs.steering import steer
from envs.world import World
from safefilter.arrays import FloatArray, IntArray, frozen, shaped_array
from safefilter.decision import Decision
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene

Act: TypeAlias = Callable[[World, np.random.Generator], FloatArray]
"""What other robots do: from the world and a source of chance to actions of all, shape (W, N, 2)."""

LEARNER = 0


class OneLearner(gymnasium.Env[Observation, Action]):
    """One robot among others.

    Action: see `envs.spaces.action_space`, shape (2,); a holonomic robot executes velocities beyond v_max along the
    diagonal at v_max. Observation: see `envs.observation_layout`, in [-1, 1]. Reward: see `envs.reward`. An episode
    terminates when the learner arrives or collides, and is truncated at the time limit.

    ``info`` holds ``clearance`` and ``wall_clearance`` (least free distance to any other robot, and to any wall,
    during the step, in m), ``arrived`` and ``collided``; after a step also ``reward_...``, its terms by name.

    Attributes:
        navigation: The world, with the learner as robot 0.
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": FRAMES_PER_SECOND}  # noqa: RUF012  # as Gymnasium types it

    def __init__(
        self,
        scenario: Scenario | str | Path,
        *,
        fleet: Fleet | None = None,
        kinematics: Kinematics | None = None,
        rules: Rules | None = None,
        others: Act = lambda world, _: steer(world, world.preferred_velocity()),
        others_filter: SafetyFilter | None = None,
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
            fleet: What the robots are. Others count as cooperative only if they have a filter; the learner does
                unless the fleet says otherwise, as it is meant to be wrapped in one.
            kinematics: How robots move: ``"holonomic"`` or ``"differential"``; None: as the fleet does, or as
                differential drives without one.
            rules: Rules of the episode; None: those that the scenario recommends, if it does.
            others: What the other robots do; by default they go straight to their goals.
            others_filter: Filter of the other cooperative robots; None executes their actions as they are.
            layout: Which blocks the observation has; by default 5 neighbours and 36 beams.
            observation: Its form: ``"flat"``, shape (F,), or ``"dict"``, block by block.
            sensing: How well robots sense; by default perfectly.
            weights: Weights of the reward.
            render_mode: ``"human"`` (a window), ``"rgb_array"`` or None.
            layers: What pictures show beside robots and walls.
            record: Folder for a file of each episode; see `envs.recording_file`. None: no files.

        Raises:
            InvalidInput: If robot 0 is a person, or a mode or form is none.
            UnknownScenario: If the library has no such scenario.
            ScenarioFileError: If a scenario file cannot be used.
        """
        found, rules = scenario_and_rules(scenario, rules)
        fleet = drives_unless_told(found.num_robots, fleet, kinematics)
        if others_filter is None:
            fleet = _only_learner_cooperates(fleet)
        self.navigation = Navigation(found, fleet, rules, layout=layout, sensing=sensing)
        self.render_mode = render_mode
        self._form: ObservationForm = observation
        self._others = others
        self._others_filter = others_filter
        self._agents = Agents(self.navigation, weights)
        self._spectator = Spectator(self.navigation, render_mode, record, layers)
        self.action_space = action_space(
            fleet.kinematics, fleet.v_max[LEARNER], fleet.omega_max[LEARNER]
        )
        self.observation_space = observation_space(self.navigation.observer.layout, observation)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed starts the same one.

        Args:
            seed: Seed; None goes on with the generators.
            options: Not used.
        """
        super().reset(seed=seed, options=options)
        self._agents.reset(seed)
        self._spectator.begin(seed)
        start = {"clearance": np.inf, "wall_clearance": np.inf, "arrived": False, "collided": False}
        return self._observation(), start

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move the learner by ``action`` and the others by their policy, at the same time.

        Args:
            action: What the learner does, shape (2,).

        Returns:
            Observation, reward, terminated, truncated, info.

        Raises:
            ShapeError: If the action is something else.
        """
        actions = self._actions_of_others()
        actions[0, LEARNER] = shaped_array(action, "action", (2,))
        step = self._agents.step(actions)
        self._spectator.see(step)
        is_over = bool(self._agents.is_over[0, LEARNER])
        if is_over:
            self._spectator.end()
        # Plain numbers: vector environments gather them in arrays.
        info = {name: values[0, LEARNER].item() for name, values in step.info.items()}
        return (
            self._observation(),
            float(step.reward[0, LEARNER]),
            bool(step.terminated[0, LEARNER]),
            bool(step.truncated[0, LEARNER]),
            info,
        )

    def render(self) -> Picture | None:
        """Picture of the present moment, shape (height, width, 3); None where nobody asked for pictures."""
        return self._spectator.render()

    def close(self) -> None:
        """Close window and file."""
        self._spectator.close()

    def scene(self) -> Scene:
        """What robots know of each other now, with the learner as robot 0; serves the filter."""
        return self.navigation.scene()

    def note_decisions(self, decision: Decision, robots: IntArray) -> None:
        """Learn from a filter what it decided for the next step; shown, recorded, and paid for by the reward.

        Args:
            decision: Decisions.
            robots: Robot of each.
        """
        self._agents.note_decisions(decision, robots)

    def _actions_of_others(self) -> FloatArray:
        """Actions of all, in the numbers that an action space has, so that it does not matter who asks for them."""
        navigation = self.navigation
        world = navigation.world
        wanted = navigation.wanted(self._others(world, self.np_random)).astype(np.float32)
        if self._others_filter is None:
            return wanted.astype(np.float64)
        index = np.flatnonzero(world.cooperative[0])
        index = index[index != LEARNER]
        if len(index):
            decision = self._others_filter.decide(navigation.scene(), wanted[0, index], index)
            wanted[0, index] = decision.action
            self._agents.note_decisions(decision, index)
        return wanted.astype(np.float64)

    def _observation(self) -> Observation:
        navigation = self.navigation
        return in_form(navigation.observer.layout, navigation.observe()[0, LEARNER], self._form)


def _only_learner_cooperates(fleet: Fleet) -> Fleet:
    flags = np.zeros_like(fleet.cooperative)
    flags[LEARNER] = fleet.cooperative[LEARNER]
    return replace(fleet, cooperative=frozen(flags))
