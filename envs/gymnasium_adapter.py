"""The Gymnasium face of a world: robot 0 learns, the others follow a policy, through a filter or not.

Letters: N robots, k neighbours. SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt

from envs.dynamics import Kinematics
from envs.fleet import Fleet
from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout
from envs.recording import Recorder
from envs.reward import Reward, RewardWeights
from envs.reward_tracker import RewardTracker
from envs.rules import Rules
from envs.scenarios import Scenario
from envs.steering import steer
from envs.world import World
from safefilter.arrays import FloatArray, frozen
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene

Observation: TypeAlias = npt.NDArray[np.float32]
Act: TypeAlias = Callable[[World, np.random.Generator], FloatArray]
"""What other robots do: from the world and a source of chance to actions of all, shape (W, N, 2)."""

LEARNER = 0


class OneLearner(gymnasium.Env[Observation, npt.NDArray[np.float32]]):
    """One robot among others.

    Action of a holonomic robot: velocity in world axes, shape (2,), in m/s, each part within [-v_max, v_max]; faster
    than v_max along the diagonal is executed at v_max. Action of a differential drive: command (v, w), shape (2,),
    in m/s and rad/s, v within [0, v_max] and w within [-omega_max, omega_max]. Observation: see
    `envs.observation_layout`, shape (F,), in [-1, 1]. Reward: see `envs.reward`. An episode terminates when the learner
    arrives or collides, and is truncated at the time limit.

    ``info`` holds ``clearance`` and ``wall_clearance`` (least free distance to any other robot, and to any wall,
    during the step, in m), ``arrived`` and ``collided``; after a step also ``reward_...``, its terms by name.

    Attributes:
        navigation: The world, with the learner as robot 0.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 5}  # noqa: RUF012  # as Gymnasium types it

    def __init__(
        self,
        scenario: Scenario,
        *,
        fleet: Fleet | None = None,
        kinematics: Kinematics | None = None,
        rules: Rules | None = None,
        others: Act = lambda world, _: steer(world, world.preferred_velocity()),
        others_filter: SafetyFilter | None = None,
        layout: ObservationLayout | None = None,
        weights: RewardWeights | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Build the world.

        Args:
            scenario: Places the robots.
            fleet: What the robots are. Others count as cooperative only if they have a filter; the learner does
                unless the fleet says otherwise, as it is meant to be wrapped in one.
            kinematics: How robots move: ``"holonomic"`` or ``"differential"``; None: as the fleet does.
            rules: Rules of the episode.
            others: What the other robots do; by default they go straight to their goals.
            others_filter: Filter of the other cooperative robots; None executes their actions as they are.
            layout: Which blocks the observation has; by default 5 neighbours and 36 beams.
            weights: Weights of the reward.
            render_mode: ``"rgb_array"`` or None.
        """
        fleet = Fleet.of(scenario.num_robots) if fleet is None else fleet
        fleet = fleet if kinematics is None else replace(fleet, kinematics=kinematics)
        if others_filter is None:
            fleet = _only_learner_cooperates(fleet)
        self.navigation = Navigation(scenario, fleet, rules, layout=layout)
        self.render_mode = render_mode
        self._others = others
        self._others_filter = others_filter
        self._tracker = RewardTracker(weights)
        self.action_space = _action_space(fleet)
        self.observation_space = gymnasium.spaces.Box(
            -1.0, 1.0, (self.navigation.observer.layout.size,), np.float32
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed starts the same one.

        Args:
            seed: Seed; None goes on with the generator.
            options: Not used.
        """
        super().reset(seed=seed, options=options)
        self.navigation.reset(int(self.np_random.integers(2**31)))
        navigation = self.navigation
        self._recorder = Recorder(navigation.world, 0, navigation.rules.dt)
        return self._observation(), _info(np.inf, np.inf, arrived=False, collided=False)

    def step(
        self, action: npt.NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move the learner by ``action`` and the others by their policy, at the same time.

        Args:
            action: What the learner does, shape (2,).

        Returns:
            Observation, reward, terminated, truncated, info.
        """
        world = self.navigation.world
        self._tracker.remember(world)
        actions = self._actions_of_others()
        actions[0, LEARNER] = action
        outcome = self.navigation.step(actions)
        if self.render_mode is not None:
            self._recorder.record()
        arrived, collided = bool(outcome.arrived[0, LEARNER]), bool(outcome.collided[0, LEARNER])
        reward = self._tracker.reward(world, outcome)
        info = _info(
            float(outcome.clearance[0, LEARNER]),
            float(outcome.wall_clearance[0, LEARNER]),
            arrived=arrived,
            collided=collided,
        )
        info |= _paid(reward)
        return (
            self._observation(),
            float(reward.total[0, LEARNER]),
            arrived or collided,
            bool(outcome.timed_out[0]),
            info,
        )

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Picture of the present moment, shape (height, width, 3), or None without a render mode."""
        if self.render_mode is None:
            return None
        # Pillow is needed by those who look only.
        from envs.rendering import Canvas, draw_moment  # noqa: PLC0415

        recording = self._recorder.recording()
        canvas = Canvas(size=480, half_extent=self.navigation.scenario.half_extent)
        return np.asarray(draw_moment(recording, recording.num_moments - 1, canvas))

    def scene(self) -> Scene:
        """What robots know of each other now, with the learner as robot 0; serves the filter."""
        return self.navigation.scene()

    def _actions_of_others(self) -> FloatArray:
        navigation = self.navigation
        world = navigation.world
        wanted = navigation.wanted(self._others(world, self.np_random))
        if self._others_filter is None:
            return wanted
        index = np.flatnonzero(world.cooperative[0])
        index = index[index != LEARNER]
        if len(index):
            scene = navigation.scene()
            wanted[0, index] = self._others_filter.decide(scene, wanted[0, index], index).action
        return wanted

    def _observation(self) -> Observation:
        observation: Observation = self.navigation.observe()[0, LEARNER]
        return observation


def _only_learner_cooperates(fleet: Fleet) -> Fleet:
    flags = np.zeros_like(fleet.cooperative)
    flags[LEARNER] = fleet.cooperative[LEARNER]
    return replace(fleet, cooperative=frozen(flags))


def _action_space(fleet: Fleet) -> gymnasium.Space[npt.NDArray[np.float32]]:
    v_max = fleet.v_max[LEARNER]
    if fleet.kinematics == "holonomic":
        return gymnasium.spaces.Box(np.float32(-v_max), np.float32(v_max), (2,), np.float32)
    omega_max = fleet.omega_max[LEARNER]
    low, high = np.array([0.0, -omega_max]), np.array([v_max, omega_max])
    return gymnasium.spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def _info(
    clearance: float, wall_clearance: float, *, arrived: bool, collided: bool
) -> dict[str, Any]:
    return {
        "clearance": clearance,
        "wall_clearance": wall_clearance,
        "arrived": arrived,
        "collided": collided,
    }


def _paid(reward: Reward) -> dict[str, float]:
    """Terms of the learner, as plain numbers: vector environments gather them in arrays."""
    return {f"reward_{name}": float(term[0, LEARNER]) for name, term in reward.by_name().items()}
