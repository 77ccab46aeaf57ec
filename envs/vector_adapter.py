"""The Gymnasium vector face of many worlds: every robot of every world is a lane, for policies that all robots share.

Letters: W worlds, N robots a world of which the first M are agents, L = W M lanes. SI units.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from envs.agents import (
    Agents,
    Step,
    drives_unless_told,
    number_of_agents,
    parked_when_done,
    scenario_and_rules,
)
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
from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen, shaped_array
from safefilter.decision import Decision
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.scene import Scene


class VectorRobots(gymnasium.vector.VectorEnv[Observation, Action, npt.NDArray[Any]]):
    """All robots of all worlds; lane w M + i is robot i of world w.

    Actions, observations, rewards and ends are those of `OneLearner`, for each robot; the bounds of the actions are
    those of the fastest robot, and slower ones execute what they can. ``infos`` holds what its ``info`` does, as arrays
    with an entry a lane, and masks of the lanes that have one.

    Autoreset mode ``NEXT_STEP``. A lane's episode ends when its robot arrives or collides, or the time is over, but
    its next one can only begin with its world's. Until then the lane is in its reset, which takes more than one step:
    in each its action is ignored, its reward is 0, and it is told as terminated again. So whoever leaves out the
    steps after an end, as the mode asks, leaves out the waiting. The body stays by the rules, at rest. Where robots
    are reborn, a lane's next episode begins when its robot is.

    ``SafeVectorAction`` around it filters all lanes in one call.

    Attributes:
        navigation: The worlds.
        robot_of_lane: Row in `scene` of each lane's robot, shape (L,).
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]  # Gymnasium does not say that it is the class's
        "render_modes": RENDER_MODES,
        "render_fps": FRAMES_PER_SECOND,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        scenario: Scenario | str | Path = "crossroad",
        *,
        num_worlds: int | None = None,
        num_envs: int | None = None,
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
        """Build the worlds.

        Args:
            scenario: Places the robots: a scenario, or the name or file of one.
            num_worlds: Number of worlds W; 1 unless ``num_envs`` says otherwise.
            num_envs: Number of lanes instead, as `gymnasium.make_vec` gives it: a multiple of M.
            fleet: What the robots are; None: Turtlebots.
            kinematics: How robots move; None: as the fleet does, or as differential drives without one.
            rules: Rules of the episode; None: those that the scenario recommends, if it does. Robots that have
                arrived cannot yield, as nobody acts for them: they park.
            layout: Which blocks observations have; by default 5 neighbours and 36 beams.
            observation: Their form: ``"flat"``, shape (L, F), or ``"dict"``, block by block.
            sensing: How well robots sense; by default perfectly.
            weights: Weights of the reward.
            render_mode: ``"human"`` (a window), ``"rgb_array"`` or None; of world 0.
            layers: What pictures show beside robots and walls.
            record: Folder for a file of each episode of world 0; None: no files.

        Raises:
            OutOfRange: If there is no world, or ``num_envs`` is no multiple of M.
            InvalidInput: If both numbers are given, people stand before robots, or a mode or form is none.
            UnknownScenario: If the library has no such scenario.
            ScenarioFileError: If a scenario file cannot be used.
        """
        found, rules = scenario_and_rules(scenario, rules)
        fleet = drives_unless_told(found.num_robots, fleet, kinematics)
        one = number_of_agents(found)
        self.navigation = Navigation(
            found,
            fleet,
            parked_when_done(rules),
            num_worlds=_number_of_worlds(num_worlds, num_envs, one),
            layout=layout,
            sensing=sensing,
        )
        self.render_mode = render_mode
        self._form: ObservationForm = observation
        self._agents = Agents(self.navigation, weights)
        self._spectator = Spectator(self.navigation, render_mode, record, layers)
        world = self.navigation.world
        self.num_envs = world.num_worlds * one
        rows = np.arange(world.num_worlds * world.num_robots).reshape(world.radius.shape)
        self.robot_of_lane: IntArray = frozen(rows[:, :one].ravel())
        self.single_action_space = action_space(
            fleet.kinematics, fleet.v_max[:one].max(), fleet.omega_max[:one].max()
        )
        self.single_observation_space = observation_space(
            self.navigation.observer.layout, observation
        )
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        # Worlds that are reset in the next step, and lanes whose reborn robots begin then.
        self._ended = np.zeros(world.num_worlds, dtype=np.bool_)
        self._reborn = np.zeros((world.num_worlds, one), dtype=np.bool_)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes in all worlds; the same seed starts the same ones.

        Args:
            seed: World w draws from a generator seeded by (seed, w); None goes on with the generators.
            options: Not used.
        """
        super().reset(seed=seed, options=options)
        self._agents.reset(seed)
        self._ended[:] = False
        self._reborn[:] = False
        self._spectator.begin(seed)
        return self._observation(), {}

    def step(
        self, actions: Action
    ) -> tuple[Observation, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Move the robots of all lanes.

        Args:
            actions: Shape (L, 2). Those of lanes that are in their reset are ignored.

        Returns:
            Observations, rewards, terminations, truncations, infos.

        Raises:
            ShapeError: If the actions are of another shape.
        """
        agents, ended = self._agents, self._ended
        step = agents.step(self._given(actions))
        goes_on = ~(ended | step.world_over)[:, np.newaxis]
        # A robot that was reborn in the very step in which it arrived had its end told first.
        begins = goes_on & (self._reborn | step.reborn & ~step.acted)
        agents.is_over[begins] = False
        self._reborn = goes_on & step.reborn & step.acted
        self._ended = step.world_over & ~ended
        self._watch(step, ended)
        if ended.any():
            agents.reset(worlds=ended)
        if ended[0]:
            self._spectator.begin(None)
        waits = agents.is_over & ~step.acted
        return (
            self._observation(),
            step.reward.ravel(),
            (step.terminated | waits).ravel(),
            step.truncated.ravel(),
            self._infos(step),
        )

    def render(self) -> Picture | None:  # type: ignore[override]  # one picture, of world 0
        """Picture of world 0 now, shape (height, width, 3); None where nobody asked for pictures."""
        return self._spectator.render()

    def close_extras(self, **_: object) -> None:
        """Close window and file."""
        self._spectator.close()

    def scene(self) -> Scene:
        """All worlds as one scene; lane k is about its robot ``robot_of_lane[k]``. Serves the filter."""
        return self.navigation.scenes()

    def note_decisions(self, decision: Decision, robots: IntArray) -> None:
        """Learn from a filter what it decided for the next step; shown, recorded, and paid for by the reward.

        Args:
            decision: Decisions.
            robots: Row in `scene` of each.
        """
        self._agents.note_decisions(decision, robots)

    def _watch(self, step: Step, ended: BoolArray) -> None:
        """Show world 0, before worlds that ended in the step before are reset."""
        if not ended[0]:
            self._spectator.see(step)
            if step.world_over[0]:
                self._spectator.end()

    def _given(self, actions: Action) -> FloatArray:
        """What robots are told, shape (W, N, 2): nothing where a lane is in its reset.

        Raises:
            ShapeError: If the actions are of another shape.
        """
        wanted = shaped_array(actions, "actions", (self.num_envs, 2))
        agents = self._agents
        given = np.zeros(self.navigation.world.position.shape)
        acting = ~agents.is_over[..., np.newaxis]
        given[:, : agents.num_agents] = np.where(
            acting, wanted.reshape(*agents.is_over.shape, 2), 0.0
        )
        return given

    def _observation(self) -> Observation:
        flat = self._agents.observe()
        layout = self.navigation.observer.layout
        return in_form(layout, flat.reshape(self.num_envs, layout.size), self._form)

    def _infos(self, step: Step) -> dict[str, Any]:
        """By Gymnasium's convention: arrays, and masks of the lanes that have an entry; the others are 0."""
        infos: dict[str, Any] = {}
        mask = step.acted.ravel()
        for name, values in step.info.items():
            infos[name] = np.where(step.acted, values, np.zeros((), values.dtype)).ravel()
            infos[f"_{name}"] = mask.copy()
        return infos


def _number_of_worlds(num_worlds: int | None, num_envs: int | None, num_agents: int) -> int:
    """Worlds that make up so many lanes.

    Raises:
        InvalidInput: If both numbers are given.
        OutOfRange: If there are no such worlds.
    """
    if num_envs is None:
        return 1 if num_worlds is None else num_worlds
    if num_worlds is not None:
        raise InvalidInput("num_worlds, num_envs: expected one of them, got both")
    if num_envs < num_agents or num_envs % num_agents:
        raise OutOfRange(
            f"num_envs: every robot is a lane, and the scenario has {num_agents} robots a world; expected a multiple "
            f"of {num_agents}, got {num_envs}"
        )
    return num_envs // num_agents
