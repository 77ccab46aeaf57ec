"""SafeVectorAction: a Gymnasium vector environment in which only certified actions execute.

It equals a vector of `SafeAction` environments bit for bit, in every autoreset mode, but decides for all lanes at once.

Letters: L lanes, one an environment; N rows of the single action space, one a robot.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from safefilter.arguments import require_kind
from safefilter.arrays import BoolArray, FloatArray, number_array
from safefilter.constraints.constraint import AnyScene
from safefilter.errors import InvalidInput, ShapeError
from safefilter.safety_filter import SafetyFilter
from safefilter.wrappers.action_filter import Action, ActionFilter, Executed
from safefilter.wrappers.decision_info import Columns, info_of_lanes, put_columns
from safefilter.wrappers.episode_totals import EpisodeTotals
from safefilter.wrappers.gymnasium_wrapper import require_penalty
from safefilter.wrappers.lanes import Lanes
from safefilter.wrappers.vector_scenes import VectorScenes
from safefilter.wrappers.wrapper_order import require_innermost_in_lanes

Results: TypeAlias = tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]
VectorSceneFunction: TypeAlias = Callable[[Any, Any, dict[str, Any]], AnyScene]
"""From (unwrapped vector environment, latest observations, latest infos) to a `Scene` a lane, or one for all."""

if TYPE_CHECKING:
    Wrapper = gymnasium.vector.VectorWrapper[Any, Action, Any, Action, npt.NDArray[Any]]
else:
    # Generic with other parameters in each release.
    Wrapper = gymnasium.vector.VectorWrapper


class SafeVectorAction(Wrapper, gymnasium.utils.RecordConstructorArgs):
    """Filters the actions of all lanes of a vector environment by one call of the filter a step.

    What `SafeAction` says holds here as well, lane by lane. ``infos`` follows Gymnasium's convention: arrays with an
    entry a lane, and masks of the lanes that have one. Autoreset modes:

    * ``NEXT_STEP``: in the step in which a lane resets nothing is decided for it, as its action is not executed.
    * ``SAME_STEP``: the last step of an episode is told of in ``infos["final_info"]``. The lane has been reset before
      anyone can look: ``min_clearance`` leaves the last state out.
    * ``DISABLED``: lanes that ``reset(options={"reset_mask": ...})`` names start anew.

    Wrappers inside the lanes are checked like those around a single environment; in an ``AsyncVectorEnv`` they live in
    other processes, and the order is up to you.
    """

    changes_actions = "filters actions"

    def __init__(
        self,
        env: gymnasium.vector.VectorEnv[Any, Action, npt.NDArray[Any]],
        safety_filter: SafetyFilter,
        *,
        scene: VectorSceneFunction | None = None,
        index: int | Sequence[int] | None = 0,
        penalty: float = 0.0,
        allow_stop: bool = False,
    ) -> None:
        """Put the filter around a vector environment.

        Args:
            env: Vector environment; its single action space as in `SafeAction`.
            safety_filter: Who decides. It sees the robots of all lanes as one scene, one lane's after the other's: a
                ``v_max`` of one a robot is for all of those, and so are the indices that your own constraints get.
            scene: Function ``(vector_env, observations, infos)`` of the unwrapped vector environment and of what its
                last step or reset returned, to a `Scene` a lane, or to one scene for all with ``world=``, the lane of
                each robot. None: the unwrapped vector environment's own ``scene()``, or those of its lanes, asked for
                by ``call("scene")``. Where lanes are robots that share worlds, the vector environment's attribute
                ``robot_of_lane`` says which robot of its one scene each is about, whatever their worlds. For a `Box`
                of actions, what the constraints read: lane k is entry k.
            index: Robots of a lane that its rows are about; as in `SafeAction`.
            penalty: Reward taken away per m/s of correction, summed over the robots of a lane.
            allow_stop: As in `SafeAction`.

        Raises:
            WrapperOrderError: If a wrapper inside would change what was certified.
            SceneUnavailable: If nobody says where everyone is.
            InvalidInput: If ``metadata["autoreset_mode"]`` is missing; or as `SafeAction`.
            ShapeError: As `SafeAction`.
            OutOfRange: As `SafeAction`.
        """
        gymnasium.utils.RecordConstructorArgs.__init__(
            self,
            _disable_deepcopy=True,
            safety_filter=safety_filter,
            scene=scene,
            index=index,
            penalty=penalty,
            allow_stop=allow_stop,
        )
        super().__init__(env)
        require_innermost_in_lanes(env)
        self._mode = _autoreset_mode(env)
        self._penalty = require_penalty(penalty)
        self._filter = ActionFilter(
            safety_filter,
            env.single_action_space,
            index,
            allow_stop=allow_stop,
            env=env.unwrapped,
        )
        self._scenes = VectorScenes(
            env.unwrapped, env.num_envs, scene, has_robots=self._filter.has_robots
        )
        self._latest: tuple[Any, dict[str, Any]] | None = None
        self._totals = EpisodeTotals(env.num_envs)
        self._is_over = np.zeros(env.num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start episodes, in all lanes or in those of ``options["reset_mask"]``, as the environment does.

        Raises:
            InvalidInput: If the options are no dictionary.
            ShapeError: If the mask is not a flag a lane.
        """
        # Read first: the environment takes the mask out of the options.
        begun = np.ones(self.num_envs, dtype=np.bool_)
        if options is not None and "reset_mask" in require_kind(options, "options", dict):
            begun = number_array(options["reset_mask"], "reset_mask", "flags").astype(np.bool_)
            if begun.shape != (self.num_envs,):
                raise ShapeError(
                    f"reset_mask: expected shape ({self.num_envs},), got {begun.shape}"
                )
        # A list of seeds, one a lane, is what vector environments take and what the base class does not say.
        self._latest = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        self._totals.begin(begun)
        self._is_over &= ~begun
        return self._latest

    def step(self, actions: Action) -> Results:
        """Execute what the filter makes of ``actions``.

        Args:
            actions: Actions wanted, of the shape of the action space.

        Returns:
            Observations, rewards less the penalty, terminations, truncations, infos.

        Raises:
            gymnasium.error.ResetNeeded: Before the first `reset`.
            SafeFilterError: As `SafetyFilter.decide`.
        """
        lanes = self._lanes()
        wanted = self._filter.in_space(actions, self.num_envs)
        # A lane that is over resets in this step, and does not execute its action.
        stepped = (
            ~self._is_over if self._mode == AutoresetMode.NEXT_STEP else np.ones_like(self._is_over)
        )
        executed = self._filter(
            lanes, wanted, np.repeat(stepped[:, np.newaxis], wanted.shape[1], 1)
        )
        self._see(lanes, stepped)
        given = executed.action.reshape(self.action_space.shape or ())
        observations, rewards, terminations, truncations, infos = self.env.step(given.copy())
        self._latest = observations, infos
        self._totals.add(executed.decision, executed.lane, stepped)
        self._is_over = np.asarray(terminations | truncations, dtype=np.bool_)
        infos = self._told(executed, stepped, infos)
        if self._penalty:
            rewards = rewards - self._penalty * executed.correction()
        return observations, rewards, terminations, truncations, infos

    def _told(
        self, executed: Executed, stepped: BoolArray, infos: dict[str, Any]
    ) -> dict[str, Any]:
        """The environment's infos, with what the filter did."""
        over = self._is_over & stepped
        told = dict(infos)
        columns = info_of_lanes(executed, is_single=self._filter.is_single)
        if self._mode != AutoresetMode.SAME_STEP:
            put_columns(told, "safefilter", columns, stepped)
            if over.any():
                self._see(self._lanes(), over)
                self._end(told, over)
            return told
        put_columns(told, "safefilter", columns, ~over)
        if over.any():
            final = dict(told.get("final_info", {}))
            put_columns(final, "safefilter", columns, over)
            self._end(final, over)
            told["final_info"], told["_final_info"] = final, over
        return told

    def _end(self, told: dict[str, Any], over: BoolArray) -> None:
        totals: Columns = dict(self._totals.numbers())
        put_columns(told, "safefilter_episode", totals, over)
        self._totals.begin(over)

    def _lanes(self) -> Lanes:
        if self._latest is None:
            raise gymnasium.error.ResetNeeded("SafeVectorAction: call reset() before step()")
        return self._scenes(*self._latest)

    def _see(self, lanes: Lanes, which: BoolArray) -> None:
        if self._filter.has_robots:
            episodes = np.flatnonzero(which)
            self._totals.see(lanes.scene, self._filter.robots(lanes)[episodes], episodes)


def _autoreset_mode(env: gymnasium.vector.VectorEnv[Any, Any, Any]) -> AutoresetMode:
    mode = env.metadata.get("autoreset_mode")
    if not isinstance(mode, AutoresetMode):
        raise InvalidInput(
            f'{env}: metadata["autoreset_mode"] must say how lanes reset, a gymnasium.vector.AutoresetMode, because '
            f"that says which actions execute; got {mode!r}"
        )
    return mode
