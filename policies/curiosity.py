"""Curiosity: networks that foresee what actions lead to, and pay for what they did not foresee; Eqs. (2) to (5).

Source: section IV-A of Qin et al., after Pathak et al., "Curiosity-driven exploration by self-supervised prediction",
2017. What an action has no influence on does not help to guess it, so the encoder has no reason to look at it, and
robots are not paid for noise.

Letters: B samples, F numbers of an observation, D features; lambda the encoder, f the inverse and h the forward model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn

from safefilter.arrays import finite_array, positive_number
from safefilter.errors import OutOfRange

NUM_ACTIONS = 2
CHUNK = 8192
"""Samples that rewards are computed for at once: what is in between stays in the cache."""


@dataclass(frozen=True, slots=True)
class CuriositySettings:
    """How curious robots are.

    Attributes:
        strength: delta of Eq. (4); 0.01 in the paper.
        policy_weight: alpha of Eq. (5), which the paper does not tell.
        forward_share: beta of Eq. (5), which the paper does not tell; 0.2 is that of Pathak et al.
        num_features: Features D.
        hidden: Widths of the hidden layers of all three networks.
        sees_executed: Which action is shown as the one that led to the next state: that which was executed, or the
            policy's own? The paper can be read both ways; but what a filter has changed leads nowhere.
        is_joint: Does the error of the forward model train the encoder too, as Eq. (5) says when its minimum is taken
            over everything? Eqs. (2) and (3) name what each loss trains; and an encoder that is paid for being foreseen
            says less.
    """

    strength: float = 0.01
    policy_weight: float = 1.0
    forward_share: float = 0.2
    num_features: int = 32
    hidden: tuple[int, ...] = (64,)
    sees_executed: bool = True
    is_joint: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is below what it can be, or a share not between 0 and 1.
        """
        positive_number(self.policy_weight, "policy_weight")
        if finite_array(self.strength, "strength", ()) < 0.0:
            raise OutOfRange(f"strength: expected 0 or more, got {self.strength}")
        if not 0.0 <= self.forward_share <= 1.0:
            raise OutOfRange(f"forward_share: expected 0 to 1, got {self.forward_share}")
        if min(self.num_features, *self.hidden, 1) < 1:
            raise OutOfRange(
                f"num_features, hidden: expected 1 or more, got {self.num_features}, {self.hidden}"
            )


class Curiosity(nn.Module):
    """The encoder, the action estimation network theta^A and the state estimation network theta^S of the paper.

    Give it pairs of states of one episode only: what follows a rebirth or a new map was caused by no action.
    Raw actions beyond [-1, 1] count as the nearest of its ends, as in `policies.action_map`: that is what they do.

    Attributes:
        settings: How curious robots are.
        encoder: lambda, from observations (B, F) to features (B, D); part of theta^A.
        inverse_model: f, from the features of two states (B, 2 D) to the raw action between them (B, 2); theta^A.
        forward_model: h, from features and raw action (B, D + 2) to the features of the next state (B, D); theta^S.
    """

    def __init__(self, num_inputs: int, settings: CuriositySettings | None = None) -> None:
        """Draw weights from torch's generator.

        Args:
            num_inputs: Numbers F of an observation.
            settings: How curious robots are; None: the defaults.
        """
        super().__init__()
        self.settings = CuriositySettings() if settings is None else settings
        features, hidden = self.settings.num_features, self.settings.hidden
        self.encoder = _network(num_inputs, hidden, features)
        self.inverse_model = _network(2 * features, hidden, NUM_ACTIONS)
        self.forward_model = _network(features + NUM_ACTIONS, hidden, features)

    @torch.no_grad()
    def reward(self, observation: Tensor, action: Tensor, next_observation: Tensor) -> Tensor:
        """Rewards R^C = delta / 2 ||h(lambda(s), a) - lambda(s')||^2 of Eq. (4); no gradients.

        Args:
            observation: States s, shape (B, F).
            action: Raw actions a that led from s to s', shape (B, 2).
            next_observation: States s', shape (B, F).

        Returns:
            Shape (B,).
        """
        samples = (observation, action, next_observation)
        parts = zip(*(torch.split(part, CHUNK) for part in samples), strict=True)
        errors = [self._surprise(self.encoder(s), a, self.encoder(then)) for s, a, then in parts]
        return self.settings.strength * torch.cat(errors)

    def losses(
        self, observation: Tensor, action: Tensor, next_observation: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Losses L_A of Eq. (2) and L_S of Eq. (3): half the squared lengths of the errors, averaged over the samples.

        L_A trains encoder and inverse model; L_S the forward model, and the encoder only if ``is_joint``.

        Args:
            observation: States s, shape (B, F).
            action: Raw actions a that led from s to s', shape (B, 2).
            next_observation: States s', shape (B, F).

        Returns:
            Two of shape ().
        """
        now, then = self.encoder(observation), self.encoder(next_observation)
        guess = self.inverse_model(torch.cat([now, then], dim=-1))
        inverse_loss = _half_square(guess - action.clamp(-1.0, 1.0)).mean()
        if not self.settings.is_joint:
            now, then = now.detach(), then.detach()
        return inverse_loss, self._surprise(now, action, then).mean()

    def objective(self, policy_loss: Tensor, inverse_loss: Tensor, forward_loss: Tensor) -> Tensor:
        """What theta^P, theta^A and theta^S are to minimise together, Eq. (5).

        The policy shares no weight with the others. So alpha and beta matter to an optimiser that steps along gradients
        as they are, or shortens all of them together, but next to nothing to Adam, which scales each on its own.

        Args:
            policy_loss: Minus E[L], the clipped surrogate of PPO to be minimised, shape ().
            inverse_loss: L_A, shape ().
            forward_loss: L_S, shape ().

        Returns:
            alpha policy_loss + (1 - beta) L_A + beta L_S, shape ().
        """
        alpha, beta = self.settings.policy_weight, self.settings.forward_share
        return alpha * policy_loss + (1.0 - beta) * inverse_loss + beta * forward_loss

    def _surprise(self, now: Tensor, action: Tensor, then: Tensor) -> Tensor:
        """Half the squared error of the forward model for each sample, shape (B,)."""
        known = torch.cat([now, action.clamp(-1.0, 1.0)], dim=-1)
        return _half_square(self.forward_model(known) - then)


def _half_square(error: Tensor) -> Tensor:
    """1 / 2 ||error||^2 along the last axis."""
    return 0.5 * error.square().sum(dim=-1)


def _network(num_inputs: int, hidden: Sequence[int], num_outputs: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for fan_in, fan_out in pairwise([num_inputs, *hidden]):
        layers += [nn.Linear(fan_in, fan_out), nn.ReLU()]
    return nn.Sequential(*layers, nn.Linear([num_inputs, *hidden][-1], num_outputs))
