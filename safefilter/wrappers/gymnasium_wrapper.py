"""SafeAction: a Gymnasium environment in which only certified actions execute.

Letters: N rows of the action space, one a robot. m/s.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any, SupportsFloat, TypeAlias, TypeVar

import gymnasium
import numpy as np
import numpy.typing as npt

from safefilter.arguments import real_number
from safefilter.arrays import frozen
from safefilter.comparison.recording import Recorder
from safefilter.errors import OutOfRange
from safefilter.safety_filter import SafetyFilter
from safefilter.wrappers.action_filter import ActionFilter
from safefilter.wrappers.decision_info import info_of_lanes, of_lane
from safefilter.wrappers.episode_totals import EpisodeTotals
from safefilter.wrappers.lanes import Lanes
from safefilter.wrappers.scene_source import SceneFunction, SceneSource
from safefilter.wrappers.wrapper_order import require_innermost

ObsT = TypeVar("ObsT")
Action: TypeAlias = npt.NDArray[np.floating]
ONE_LANE = frozen(np.ones(1, dtype=np.bool_))


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
        allow_stop: bool = False,
        record: str | os.PathLike[str] | None = None,
    ) -> None:
        """Put the filter around an environment.

        Args:
            env: Environment whose actions are those of the filter's kinematics: velocities in world axes in m/s, or
                commands (v, w) of a differential drive, a Box of shape (2,) for one robot, or (N, 2); or, if the
                kinematics are a `Box`, any Box of shape (d,).
            safety_filter: Who decides.
            scene: Function ``(env, observation, info) -> Scene`` of the unwrapped environment and of what its last step
                or reset returned; None for the ``scene()`` of the unwrapped environment.
            index: Robot of the scene that acts, for shape (2,). For shape (N, 2) the robots of the rows; or None if row
                i is robot i of a scene of N: then those that cooperate at the start of a step are filtered, and the
                actions of the others, which everyone takes for unfiltered, execute as they are.
            penalty: Reward taken away per m/s of correction, summed over robots.
            allow_stop: For a differential drive in a space that begins above v = 0, such as [0.01, 0.2]: the
                environment executes smaller speeds just as they are. The filter must be able to stop a robot; what
                executes is then no element of the space, which an environment may refuse, or clip to 0.01 m/s: only
                you know.
            record: File to write the problems to that a solver was needed for, while the environment runs: which solver
                is best at them says ``safefilter compare --problems FILE``. It must not exist; None writes none.

        Raises:
            WrapperOrderError: If a wrapper inside would change what was certified.
            SceneUnavailable: If there is neither ``scene`` nor ``env.unwrapped.scene()``.
            InvalidInput: If the action space is not a Box of float32 or float64, ``allow_stop`` has no use, or the file
                to record to exists or cannot be made.
            ShapeError: If its shape does not fit ``index``.
            OutOfRange: If it does not hold all actions that the filter may execute, or if ``penalty`` or ``index``
                cannot be used.
        """
        gymnasium.utils.RecordConstructorArgs.__init__(
            self,
            _disable_deepcopy=True,  # a filter may hold solvers and their processes
            safety_filter=safety_filter,
            scene=scene,
            index=index,
            penalty=penalty,
            allow_stop=allow_stop,
            record=record,
        )
        gymnasium.Wrapper.__init__(self, env)
        require_innermost(env)
        self._penalty = require_penalty(penalty)
        self._recorder = None if record is None else Recorder(record)
        self._filter = ActionFilter(
            safety_filter,
            env.action_space,
            index,
            allow_stop=allow_stop,
            env=env.unwrapped,
            recorder=self._recorder,
        )
        self._scene = SceneSource(env.unwrapped, scene, has_robots=self._filter.has_robots)
        self._latest: tuple[ObsT, dict[str, Any]] | None = None
        self._totals = EpisodeTotals()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObsT, dict[str, Any]]:
        """Start an episode, as the environment does."""
        self._totals = EpisodeTotals()
        if self._recorder is not None:
            self._recorder.start_episode()
        self._latest = self.env.reset(seed=seed, options=options)
        return self._latest

    def step(self, action: Action) -> tuple[ObsT, SupportsFloat, bool, bool, dict[str, Any]]:
        """Execute what the filter makes of ``action``.

        Args:
            action: Action wanted, of the shape of the action space. NaN is decided as standing still.

        Returns:
            Observation, reward less the penalty, terminated, truncated, info.

        Raises:
            gymnasium.error.ResetNeeded: Before the first `reset`.
            SafeFilterError: As `SafetyFilter.decide`.
        """
        lanes = self._lanes()
        wanted = self._filter.in_space(action)
        executed = self._filter(lanes, wanted, np.ones(wanted.shape[:2], dtype=np.bool_))
        given = executed.action.reshape(self.action_space.shape or ()).copy()
        self._see(lanes)
        observation, reward, terminated, truncated, info = self.env.step(given)
        self._latest = observation, info
        self._totals.add(executed.decision, executed.lane, ONE_LANE)
        columns = info_of_lanes(executed, is_single=self._filter.is_single)
        extra: dict[str, Any] = {"safefilter": of_lane(columns, 0)}
        if terminated or truncated:
            self._see(self._lanes())
            extra["safefilter_episode"] = of_lane(self._totals.numbers(), 0)
            self._totals = EpisodeTotals()
        if self._penalty:
            reward = float(reward) - self._penalty * float(executed.correction()[0])
        return observation, reward, terminated, truncated, {**info, **extra}

    def _lanes(self) -> Lanes:
        if self._latest is None:
            raise gymnasium.error.ResetNeeded("SafeAction: call reset() before step()")
        scene = self._scene(*self._latest)
        return Lanes.single(scene) if self._filter.has_robots else Lanes.of_entries(scene, 1)

    def _see(self, lanes: Lanes) -> None:
        if self._filter.has_robots:
            self._totals.see(lanes.scene, self._filter.robots(lanes), np.zeros(1, dtype=np.int64))


def require_penalty(penalty: float) -> float:
    """Check a penalty.

    Raises:
        OutOfRange: If it is not a finite number from 0 up.
    """
    if not 0.0 <= real_number(penalty, "penalty") < math.inf:
        raise OutOfRange(f"penalty: expected a finite number from 0 up, got {penalty}")
    return float(penalty)
