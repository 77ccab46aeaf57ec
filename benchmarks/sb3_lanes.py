"""Our vector environment as Stable-Baselines3 takes it: every robot of every world an environment of its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

Lanes = gymnasium.vector.VectorEnv[Any, Any, Any]


class SB3Lanes(VecEnv):
    """Lanes of which the step after an end is their reset: it counts as a step, of reward 0."""

    def __init__(self, lanes: Lanes, seed: int) -> None:
        """Take lanes.

        Args:
            lanes: The environment, filtered or not.
            seed: Of its first reset.
        """
        self._lanes = lanes
        self._seed = seed
        super().__init__(lanes.num_envs, lanes.single_observation_space, lanes.single_action_space)

    def reset(self) -> npt.NDArray[np.float32]:
        """First observations."""
        observations, _ = self._lanes.reset(seed=self._seed)
        return np.asarray(observations, dtype=np.float32)

    def step_async(self, actions: npt.NDArray[np.float32]) -> None:
        """Remember actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Make the step."""
        observations, rewards, terminated, truncated, _ = self._lanes.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for lane in np.flatnonzero(truncated):
            infos[lane] = {
                "TimeLimit.truncated": True,
                "terminal_observation": observations[lane],
            }
        return observations, rewards.astype(np.float32), terminated | truncated, infos

    def close(self) -> None:
        """Close the lanes."""
        self._lanes.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the lanes, once a lane."""
        return [getattr(self._lanes, attr_name, None)] * len(list(self._get_indices(indices)))

    def set_attr(  # theirs is the signature
        self,
        attr_name: str,
        value: Any,
        indices: VecEnvIndices = None,  # noqa: ARG002
    ) -> None:
        """Set an attribute of the lanes."""
        setattr(self._lanes, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,  # noqa: ARG002
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method of the lanes, once."""
        return [getattr(self._lanes, method_name)(*method_args, **method_kwargs)]

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]],  # noqa: ARG002
        indices: VecEnvIndices = None,
    ) -> list[bool]:
        """Whether each lane is wrapped: they are not, singly."""
        return [False] * len(list(self._get_indices(indices)))

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed of the next reset."""
        self._seed = 0 if seed is None else seed
        return [self._seed] * self.num_envs

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """No pictures."""
        return [None] * self.num_envs

    def _get_indices(self, indices: VecEnvIndices) -> Iterable[int]:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else indices
