"""SafePolicy: a policy whose actions are certified, for deployment: no environment, no learning.

Letters: B actions. The unit of the filter's kinematics.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from safefilter.arrays import IntArray, number_array
from safefilter.constraints.constraint import AnyScene
from safefilter.decision import Decision
from safefilter.errors import InvalidInput, ShapeError
from safefilter.safety_filter import SafetyFilter

ObsT = TypeVar("ObsT")
Action = npt.NDArray[np.floating]


class Predictor(Protocol):
    """A policy as Stable-Baselines3 has it."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,  # as Stable-Baselines3 has it
    ) -> tuple[Any, Any]:
        """Give the action for an observation, and the next state of a recurrent policy."""
        ...


class SafePolicy(Generic[ObsT]):
    """A policy and the filter behind it.

    Actions must come in the unit of the filter's kinematics. A model that was trained on actions scaled to [-1, 1]
    needs a function around it that scales them back.

    Example:
        >>> from safefilter import Holonomic, PriorityORCA, Scene, SafetyFilter, Separation
        >>> safe = SafePolicy(
        ...     lambda position: np.array([0.2, 0.0]),  # east, whatever is there
        ...     SafetyFilter([PriorityORCA(2.0), Separation(0.2)], Holonomic(0.2)),
        ...     scene=lambda position: Scene.from_world([position, [1, 0]], np.zeros((2, 2)), 0.2),
        ... )
        >>> safe.predict(np.array([0.6, 0.0]))[0].round(3).tolist()  # in contact
        [0.0, 0.0]
    """

    def __init__(
        self,
        policy: Predictor | Callable[[ObsT], npt.ArrayLike],
        safety_filter: SafetyFilter,
        *,
        scene: Callable[[ObsT], AnyScene],
        index: int | Sequence[int] | None = 0,
    ) -> None:
        """Put the filter behind a policy.

        Args:
            policy: A function from an observation to an action; or something with Stable-Baselines3's ``predict``,
                which then is asked.
            safety_filter: Who decides.
            scene: Function from an observation to what the robots know now.
            index: Robot that acts, for actions of shape (2,); the robots of the rows, for shape (B, 2); or None as in
                `SafetyFilter.decide`. With a `Box` of actions the entry of the scene, or None.

        Raises:
            InvalidInput: If ``policy`` is neither.
        """
        predict = getattr(policy, "predict", None)
        if not callable(predict) and not callable(policy):
            raise InvalidInput(
                f"policy: expected a function, or an object with predict(), got {policy!r}"
            )
        self._predict = predict if callable(predict) else None
        self._policy: Any = policy
        self._filter = safety_filter
        self._scene = scene
        self._index = index

    def predict(
        self,
        observation: ObsT,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,  # as Stable-Baselines3 has it
    ) -> tuple[Action, Any]:
        """Give a certified action; see `decide` for why it is what it is.

        Args:
            observation: What the policy and the scene are made of.
            state: State of a recurrent policy; handed on.
            episode_start: Handed on.
            deterministic: Handed on. Unlike in Stable-Baselines3 True by default: this is for deployment.

        Returns:
            Action, in the shape that the policy gave it, and the policy's next state; a function has none.

        Raises:
            ShapeError: If the action does not fit ``index``.
            SafeFilterError: As `SafetyFilter.decide`.
        """
        if self._predict is None:
            wanted, next_state = self._policy(observation), state
        else:
            wanted, next_state = self._predict(observation, state, episode_start, deterministic)
        executed = self.decide(observation, wanted).action
        return executed.reshape(np.shape(wanted)), next_state

    def decide(self, observation: ObsT, action: npt.ArrayLike) -> Decision:
        """Decide what an action becomes, the policy's or anybody's; it depends on nothing but the arguments.

        Args:
            observation: What the scene is made of.
            action: Shape (d,) for one robot, or (B, d); in float32 or float64, or it is taken as float64.

        Raises:
            ShapeError: If it does not fit ``index``.
            SafeFilterError: As `SafetyFilter.decide`.
        """
        wanted = number_array(action, "action", "numbers of shape (d,) or (B, d)")
        if wanted.ndim not in {1, 2}:
            raise ShapeError(f"action: expected shape (d,) or (B, d), got {wanted.shape}")
        rows = np.atleast_2d(wanted)
        index: IntArray | None = None
        if self._index is not None:
            index = np.atleast_1d(number_array(self._index, "index", "an integer, or integers"))
            if len(index) != len(rows):
                raise ShapeError(
                    f"action: expected {len(index)} rows, one for each robot of index={self._index}, got {wanted.shape}"
                )
        return self._filter.decide(self._scene(observation), rows, index)
