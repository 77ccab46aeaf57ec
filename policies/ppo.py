"""PPO: the clipped surrogate objective, and passes over a rollout that improve it; the first part of Eq. (5).

Source: Schulman et al., "Proximal policy optimization algorithms", 2017, Eqs. (7) and (9).

Letters: B samples, F numbers of an observation.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from policies.actor_critic import ActorCritic
from safefilter.arrays import finite_array, positive_number
from safefilter.errors import OutOfRange

_POSITIVE = ("learning_rate", "clip", "max_gradient", "max_divergence", "reward_scale")
_SHARES = ("final_rate", "discount", "trace_decay")
_WEIGHTS = ("value_weight", "entropy_weight")
_COUNTS = ("epochs", "minibatch")


@dataclass(frozen=True, slots=True)
class PPOSettings:
    """How a policy is improved.

    Attributes:
        learning_rate: Of Adam, at the start.
        final_rate: Part of it that is left at the end; it falls in a straight line.
        discount: gamma.
        trace_decay: lambda of the advantages.
        clip: Largest change of an action's probability that still pays.
        epochs: Passes over each rollout.
        minibatch: Samples of one gradient step.
        value_weight: Weight of the critic's error.
        entropy_weight: Weight of the policy's entropy.
        max_gradient: Gradients are shortened to this norm.
        max_divergence: Passes stop once the policy is this far from the one that acted (Kullback-Leibler).
        reward_scale: Rewards are multiplied by it.
    """

    learning_rate: float = 1e-3
    final_rate: float = 0.05
    discount: float = 0.995
    trace_decay: float = 0.95
    clip: float = 0.2
    epochs: int = 3
    minibatch: int = 2048
    value_weight: float = 0.5
    entropy_weight: float = 0.004
    max_gradient: float = 0.5
    max_divergence: float = 0.03
    reward_scale: float = 0.05

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is below what it can be, or a share not between 0 and 1.
        """
        for field in _POSITIVE:
            positive_number(getattr(self, field), field)
        for field in _SHARES:
            if not 0.0 <= finite_array(getattr(self, field), field, ()) <= 1.0:
                raise OutOfRange(f"{field}: expected 0 to 1, got {getattr(self, field)}")
        for field in _WEIGHTS:
            if finite_array(getattr(self, field), field, ()) < 0.0:
                raise OutOfRange(f"{field}: expected 0 or more, got {getattr(self, field)}")
        for field in _COUNTS:
            if getattr(self, field) < 1:
                raise OutOfRange(f"{field}: expected 1 or more, got {getattr(self, field)}")

    def rate(self, elapsed: float) -> float:
        """Learning rate after a part of the training.

        Args:
            elapsed: The part, from 0 up to 1; what lies beyond counts as 1.
        """
        return self.learning_rate * (1.0 - min(1.0, elapsed) * (1.0 - self.final_rate))


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Samples to learn from.

    Attributes:
        observation: Shape (B, F).
        action: Raw actions of the policy, shape (B, 2).
        log_probability: Of them when they were drawn, shape (B,).
        advantage: Shape (B,).
        target: What the critic should have said, shape (B,).
    """

    observation: Tensor
    action: Tensor
    log_probability: Tensor
    advantage: Tensor
    target: Tensor

    def __getitem__(self, index: Tensor) -> Batch:
        """The samples of these numbers."""
        return Batch(
            self.observation[index],
            self.action[index],
            self.log_probability[index],
            self.advantage[index],
            self.target[index],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Losses:
    """What is minimised, each of shape ().

    Attributes:
        policy: Negative clipped surrogate, Eq. (7) of the source.
        value: Mean squared error of the critic, halved.
        entropy: Of the policy; larger is wanted.
        divergence: Estimate of how far the policy has moved; not part of the sum.
        clipped: Part of the samples beyond the clip; not part of the sum.
    """

    policy: Tensor
    value: Tensor
    entropy: Tensor
    divergence: Tensor
    clipped: Tensor

    def total(self, settings: PPOSettings) -> Tensor:
        """Weighted sum."""
        return (
            self.policy
            + settings.value_weight * self.value
            - settings.entropy_weight * self.entropy
        )


def losses(networks: ActorCritic, batch: Batch, clip: float) -> Losses:
    """Terms of the objective.

    Args:
        networks: What is learnt.
        batch: Samples, advantages normalised.
        clip: See `PPOSettings`.
    """
    log_ratio = networks.log_probability(batch.observation, batch.action) - batch.log_probability
    ratio = log_ratio.exp()
    within = ratio.clamp(1.0 - clip, 1.0 + clip)
    surrogate = torch.min(ratio * batch.advantage, within * batch.advantage)
    error = networks.value(batch.observation) - batch.target
    with torch.no_grad():
        # Never negative, and of less variance than the mean of -log_ratio: Schulman, "Approximating KL divergence".
        divergence = (ratio - 1.0 - log_ratio).mean()
        clipped = ((ratio - 1.0).abs() > clip).float().mean()
    return Losses(
        policy=-surrogate.mean(),
        value=0.5 * error.square().mean(),
        entropy=networks.entropy(),
        divergence=divergence,
        clipped=clipped,
    )
