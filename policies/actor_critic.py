"""ActorCritic: the two networks that all robots share, Alg. 1 of Qin et al.

The actor's mean is a raw action (see `policies.action_map`); its spread does not depend on the state, so that a robot
explores alike everywhere. The critic judges states.

Letters: B samples, F numbers of an observation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

NUM_ACTIONS = 2
INITIAL_LOG_STD = -0.5
HIDDEN_GAIN = math.sqrt(2.0)
"""Of orthogonal weights before a ReLU, which halves the variance."""
ACTOR_GAIN = 0.01
"""Of the last layer: a fresh policy acts alike in every state."""
CRITIC_GAIN = 1.0
LOG_SQRT_TAU = 0.5 * math.log(2.0 * math.pi)


class ActorCritic(nn.Module):
    """A Gaussian policy and a value function, each a network of its own.

    Attributes:
        actor: From observations (B, F) to means of raw actions (B, 2).
        log_std: Logarithm of the policy's spread, shape (2,).
        critic: From observations (B, F) to values (B, 1).
    """

    def __init__(self, num_inputs: int, hidden: Sequence[int] = (128, 128)) -> None:
        """Draw orthogonal weights from torch's generator.

        Args:
            num_inputs: Numbers F of an observation.
            hidden: Widths of the hidden layers.
        """
        super().__init__()
        self.actor = _network(num_inputs, hidden, NUM_ACTIONS, ACTOR_GAIN)
        self.log_std = nn.Parameter(torch.full((NUM_ACTIONS,), INITIAL_LOG_STD))
        self.critic = _network(num_inputs, hidden, 1, CRITIC_GAIN)

    def sample(
        self, observation: Tensor, generator: torch.Generator | None = None
    ) -> tuple[Tensor, Tensor]:
        """Draw raw actions.

        Args:
            observation: Shape (B, F).
            generator: Source of chance, on the CPU wherever the networks live, so that all draw the same; None: torch's
                own.

        Returns:
            Actions, shape (B, 2), not clipped, and their log-probabilities, shape (B,).
        """
        mean = self.actor(observation)
        noise = torch.randn(mean.shape, generator=generator, device="cpu").to(mean.device)
        return mean + noise * self.log_std.exp(), _log_probability(noise, self.log_std)

    def log_probability(self, observation: Tensor, action: Tensor) -> Tensor:
        """Log-probabilities of raw actions, shape (B,)."""
        deviation = (action - self.actor(observation)) * (-self.log_std).exp()
        return _log_probability(deviation, self.log_std)

    def entropy(self) -> Tensor:
        """Differential entropy of the policy, the same in every state, shape ()."""
        return (self.log_std + LOG_SQRT_TAU + 0.5).sum()

    def value(self, observation: Tensor) -> Tensor:
        """Values of states, shape (B,)."""
        value: Tensor = self.critic(observation).squeeze(-1)
        return value


def _log_probability(deviation: Tensor, log_std: Tensor) -> Tensor:
    """Of a Gaussian, with deviations from the mean in spreads."""
    return (-0.5 * deviation.square() - log_std - LOG_SQRT_TAU).sum(dim=-1)


def _network(
    num_inputs: int, hidden: Sequence[int], num_outputs: int, last_gain: float
) -> nn.Sequential:
    widths = [num_inputs, *hidden]
    layers: list[nn.Module] = []
    for fan_in, fan_out in pairwise(widths):
        layers += [_linear(fan_in, fan_out, HIDDEN_GAIN), nn.ReLU()]
    return nn.Sequential(*layers, _linear(widths[-1], num_outputs, last_gain))


def _linear(fan_in: int, fan_out: int, gain: float) -> nn.Linear:
    layer = nn.Linear(fan_in, fan_out)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer
