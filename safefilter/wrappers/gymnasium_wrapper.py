"""SafeAction: a Gymnasium environment in which only certified actions execute.

Letters: N rows of the action space, one a robot. m/s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, SupportsFloat, TypeAlias, TypeVar

import gymnasium
import numpy as np
import numpy.typing as npt

from safefilter.arrays import IntArray
from safefilter.decision import Decision
from safefilter.errors import OutOfRange, ShapeError
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.wrappers.action_box import ActionBox
from safefilter.wrappers.decision_info import info_of_robot, info_of_robots
from safefilter.wrappers.episode_totals import EpisodeTotals
from safefilter.wrappers.scene_source import SceneFunction, SceneSource
from safefilter.wrappers.wrapper_order import require_innermost

ObsT = TypeVar("ObsT")
Action: TypeAlias = npt.NDArray[np.floating]


class SafeAction(
    gymnasium.Wrapper[ObsT, Action, ObsT, Action], gymnasium.utils.RecordConstructorArgs
):
    """Filters the actions of one robot, or of many that share an action space.

    It must be the innermost wrapper that has to do with actions: whatever clips or rescales them belongs around it.
    Each action is decided in the scene at the start of its step, and what `SafetyFilter.decide` returns executes,
    bit for bit. Bounds of the action space that the robots could exceed become hard rows of the filter.

    ``info["safefilter"]`` tells of the step, see `info_of_robots`; in the last step of an episode
    ``info["safefilter_episode"]`` tells of the episode, see `EpisodeTotals.numbers`.

    Example:
        >>> from safefilter import Holonomic, PriorityORCA, Scene, SafetyFilter, Separation
        >>> class Street(gymnasium.Env):
        ...     action_space = gymnasium.spaces.Box(-0.2, 0.2, (2,))
        ...     observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))
        ...     def reset(self, *, seed=None, options=None):
        ...         super().reset(seed=seed)
        ...         self.position = np.zeros(2)
        ...         return self.position.astype(np.float32), {}
        ...     def step(self, action):
        ...         self.position = self.position + 0.2 * action
        ...         return self.position.astype(np.float32), 0.0, False, False, {}
        ...     def scene(self):  # a parked car one metre ahead
        ...         return Scene.from_world(
        ...             [self.position, [1, 0]], [[0, 0], [0, 0]], 0.2, cooperative=[True, False]
        ...         )
        >>> env = SafeAction(
        ...     Street(), SafetyFilter([PriorityORCA(2.0), Separation(0.2)], Holonomic(0.2))
        ... )
        >>> _ = env.reset(seed=0)
        >>> for _ in range(100):
        ...     observation, *_, info = env.step(np.array([0.2, 0.0], dtype=np.float32))
        >>> bool(0.59 < observation[0] < 0.6), info["safefilter"]["certified"]
        (True, True)
    """

    # For whoever looks for wrappers that do: a filter inside a filter is refused.
    changes_actions = "filters actions"

    def __init__(
        self,
        env: gymnasium.Env[ObsT, Action],
        safety_filter: SafetyFilter,
        *,
        scene: SceneFunction | None = None,
        index: int | Sequence[int] | None = 0,
        penalty: float = 0.0,
    ) -> None:
        """Put the filter around an environment.

        Args:
            env: Environment whose actions are velocities in world axes, in m/s: a Box of shape (2,) for one robot, or
                (N, 2).
            safety_filter: Who decides.
            scene: Function ``(env, observation, info) -> Scene`` of the unwrapped environment and of what its last step
                or reset returned; None for the ``scene()`` of the unwrapped environment.
            index: Robot of the scene that acts, for shape (2,). For shape (N, 2) the robots of the rows; or None if row
                i is robot i of a scene of N: then those that cooperate at the start of a step are filtered, and the
                actions of the others, which everyone takes for unfiltered, execute as they are.
            penalty: Reward taken away per m/s of correction, summed over robots.

        Raises:
            WrapperOrderError: If a wrapper inside would change what was certified.
            SceneUnavailable: If there is neither ``scene`` nor ``env.unwrapped.scene()``.
            InvalidInput: If the action space is not a Box of float32 or float64.
            ShapeError: If its shape does not fit ``index``.
            OutOfRange: If it does not permit standing still, or if ``penalty`` or ``index`` cannot be used.
        """
        gymnasium.utils.RecordConstructorArgs.__init__(
            self,
            _disable_deepcopy=True,  # a filter may hold solvers and their processes
            safety_filter=safety_filter,
            scene=scene,
            index=index,
            penalty=penalty,
        )
        gymnasium.Wrapper.__init__(self, env)
        require_innermost(env)
        if not (math.isfinite(penalty) and penalty >= 0.0):
            raise OutOfRange(f"penalty: expected a finite number from 0 up, got {penalty}")
        self._scene = SceneSource(env.unwrapped, scene)
        self._is_single = env.action_space.shape == (2,)
        self._follows_scene = index is None
        self._box = ActionBox(env.action_space, _robots(env.action_space.shape, index))
        self._penalty = float(penalty)
        self._filter = safety_filter
        self._filter_in_box = safety_filter.with_constraints(self._box)
        self._latest: tuple[ObsT, dict[str, Any]] | None = None
        self._totals = EpisodeTotals()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObsT, dict[str, Any]]:
        """Start an episode, as the environment does."""
        self._totals = EpisodeTotals()
        self._latest = self.env.reset(seed=seed, options=options)
        return self._latest

    def step(self, action: Action) -> tuple[ObsT, SupportsFloat, bool, bool, dict[str, Any]]:
        """Execute what the filter makes of ``action``.

        Args:
            action: Velocity wanted, of the shape of the action space, in m/s. NaN is decided as standing still.

        Returns:
            Observation, reward less the penalty, terminated, truncated, info.

        Raises:
            gymnasium.error.ResetNeeded: Before the first `reset`.
            SafeFilterError: As `SafetyFilter.decide`.
        """
        if self._latest is None:
            raise gymnasium.error.ResetNeeded("SafeAction: call reset() before step()")
        scene = self._scene(*self._latest)
        rows = self._rows(scene)
        executed = self._in_space(action)
        decision = self._decide(scene, executed[rows], self._box.robots[rows])
        executed[rows] = decision.action
        given = executed[0] if self._is_single else executed
        observation, reward, terminated, truncated, info = self.env.step(given.copy())
        self._latest = observation, info
        self._totals.see(scene, self._box.robots)
        self._totals.add(decision)
        extra: dict[str, Any] = {
            "safefilter": info_of_robot(decision, executed)
            if self._is_single
            else info_of_robots(decision, rows, executed)
        }
        if terminated or truncated:
            self._totals.see(self._scene(observation, info), self._box.robots)
            extra["safefilter_episode"] = self._totals.numbers()
            self._totals = EpisodeTotals()
        if self._penalty:
            reward = float(reward) - self._penalty * float(decision.correction.sum())
        return observation, reward, terminated, truncated, {**info, **extra}

    def _rows(self, scene: Scene) -> IntArray:
        # Rows of the action that are decided on.
        robots = self._box.robots
        if self._follows_scene and scene.num_robots != len(robots):
            raise ShapeError(
                f"scene: the action space has {len(robots)} rows, but the scene {scene.num_robots} robots; pass "
                "index=, the robots of the rows"
            )
        if robots.max() >= scene.num_robots:
            raise OutOfRange(
                f"index: the scene has robots 0 to {scene.num_robots - 1}, got {robots.tolist()}"
            )
        return np.flatnonzero(scene.cooperative) if self._follows_scene else np.arange(len(robots))

    def _in_space(self, action: Action) -> Action:
        space = self.action_space
        # What is too large for the dtype becomes infinite, and is decided as standing still.
        with np.errstate(over="ignore", invalid="ignore"):
            given = np.array(action, dtype=space.dtype)
        if given.shape != space.shape:
            raise ShapeError(f"action: expected shape {space.shape}, got {given.shape}")
        return given.reshape(-1, 2)

    def _decide(self, scene: Scene, wanted: Action, robots: IntArray) -> Decision:
        # Rows of the user's cost: where the speed limit says it all, there are none.
        is_bound = self._box.binds(self._filter.kinematics.speed_limit(scene))
        safety_filter = self._filter_in_box if is_bound else self._filter
        return safety_filter.decide(scene, wanted, robots)


def _robots(shape: tuple[int, ...] | None, index: int | Sequence[int] | None) -> IntArray:
    # Robot of each row of an action space.
    if index is None:
        if shape is None or len(shape) != 2:
            raise ShapeError(f"index: None needs an action space of shape (N, 2), got {shape}")
        return np.arange(shape[0])
    robots = np.atleast_1d(np.asarray(index))
    if robots.ndim != 1 or robots.dtype.kind not in "iu":
        raise ShapeError(f"index: expected an integer, integers or None, got {index!r}")
    if len(np.unique(robots)) != len(robots) or (robots < 0).any():
        raise OutOfRange(f"index: expected every robot once, from 0 up, got {robots.tolist()}")
    return robots.astype(np.int64)
