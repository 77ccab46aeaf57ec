"""LearnedPolicy: the trained network drives. Numpy alone, no torch.

Letters: W worlds, N robots a world, F numbers of an observation, B robots under way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

import numpy as np

from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout, Observations
from envs.world import World
from policies.action_map import to_command
from policies.checkpoint_errors import TensorError
from policies.policy_weights import Float32Array, Weights
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput, ShapeError


class LearnedPolicy:
    """Commands of a trained network for differential drives; the same actor for all robots.

    Attributes:
        name: What the policy is called in tables.
        weights: What it has learnt.
        is_deterministic: Does it give the mean of its actions, or draw them?
    """

    def __init__(
        self,
        weights: Weights,
        observe: Callable[[], Observations],
        *,
        is_deterministic: bool = True,
        name: str | None = None,
    ) -> None:
        """Take weights.

        Args:
            weights: What was learnt.
            observe: Gives the observations of all robots now, shape (W, N, F), laid out as ``weights.layout`` says:
                such as `Navigation.observe`.
            is_deterministic: Give the mean of the actions, or draw them?
            name: What the policy is called in tables; by default as on its card.
        """
        self.name = weights.card.name if name is None else name
        self.weights = weights
        self.is_deterministic = is_deterministic
        self._observe = observe
        self._layers = [(weight.T, bias) for weight, bias in weights.layers]
        self._spread = np.exp(weights.log_std.astype(np.float64))

    @classmethod
    def of(
        cls,
        weights: Weights,
        navigation: Navigation,
        *,
        is_deterministic: bool = True,
        name: str | None = None,
    ) -> Self:
        """Drive the robots of a navigation.

        Args:
            weights: What was learnt.
            navigation: Worlds that the policy observes.
            is_deterministic: Give the mean of the actions, or draw them?
            name: What the policy is called in tables; by default as on its card.

        Raises:
            TensorError: If the navigation's observations are laid out differently.
        """
        require_layout(weights.layout, navigation)

        def observe() -> Observations:
            # To observe costs as much as to move: not for those that do not act.
            return navigation.observe(navigation.world.active)

        return cls(weights, observe, is_deterministic=is_deterministic, name=name)

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Commands (v, w), shape (W, N, 2); zero for robots that are not under way.

        Raises:
            InvalidInput: If robots are not differential drives.
            ShapeError: If the observations are of another shape.
        """
        observation = checked_observations(self._observe(), world, self.weights.layout)
        under_way = world.active
        raw = self.mean(observation[under_way]).astype(np.float64)
        if not self.is_deterministic:
            # Drawn for all: who else is under way does not change what a robot draws.
            noise = rng.standard_normal((*under_way.shape, 2))
            raw += self._spread * noise[under_way]
        action = np.zeros((*under_way.shape, 2))
        action[under_way] = to_command(raw, world.v_max[under_way], world.omega_max[under_way])
        return action

    def mean(self, observation: Observations) -> Float32Array:
        """Means of the raw actions.

        Args:
            observation: Shape (B, F).

        Returns:
            Shape (B, 2), not clipped.
        """
        signal = observation
        for weight, bias in self._layers[:-1]:
            signal = signal @ weight
            signal += bias
            np.maximum(signal, 0.0, out=signal)
        weight, bias = self._layers[-1]
        mean: Float32Array = signal @ weight + bias
        return mean

    def command(
        self, observation: Observations, v_max: FloatArray, omega_max: FloatArray
    ) -> FloatArray:
        """Commands of the mean actions of B robots, for use without a world.

        Args:
            observation: Shape (B, F).
            v_max: Greatest speeds, shape (B,), in m/s.
            omega_max: Greatest turn rates, shape (B,), in rad/s.

        Returns:
            Shape (B, 2), in m/s and rad/s.
        """
        return to_command(self.mean(observation).astype(np.float64), v_max, omega_max)


def require_layout(layout: ObservationLayout, navigation: Navigation) -> None:
    """A navigation gives the observations that a policy was trained on.

    Args:
        layout: What the policy observes.
        navigation: Worlds.

    Raises:
        TensorError: If they are laid out differently.
    """
    given = navigation.observer.layout
    if given != layout:
        raise TensorError(
            f"the weights observe {layout}, the navigation gives {given}; "
            "make it with Navigation(..., layout=weights.layout)"
        )


def checked_observations(
    observation: Observations, world: World, layout: ObservationLayout
) -> Observations:
    """Observations that a policy of differential drives can use.

    Args:
        observation: Of all robots.
        world: Worlds that they are of.
        layout: How they are to be laid out.

    Returns:
        The same, shape (W, N, F).

    Raises:
        InvalidInput: If robots are not differential drives.
        ShapeError: If the observations are of another shape.
    """
    if not world.is_differential:
        raise InvalidInput(
            "a learned policy gives commands (v, w): make the fleet with kinematics='differential'"
        )
    expected = (*world.v_max.shape, layout.size)
    if observation.shape != expected:
        raise ShapeError(
            f"observations: expected shape {expected} for {layout}, got {observation.shape}"
        )
    return observation
