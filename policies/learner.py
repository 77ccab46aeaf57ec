"""Learner: the networks, and how a rollout improves them: the joint objective of Eq. (5) of Qin et al.

Letters: T steps, L lanes (robots), B samples, F numbers of an observation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from policies.actor_critic import ActorCritic
from policies.advantages import advantages, normalised
from policies.curiosity import Curiosity
from policies.experience import Experience, SingleArray
from policies.ppo import Batch, losses
from policies.torch_state import as_arrays, as_tensors
from policies.training_settings import TrainingSettings
from safefilter.arrays import IntArray

ADAM_EPSILON = 1e-5
"""Larger than torch's, as is usual for PPO, whose gradients almost vanish at times."""


@dataclass(frozen=True, slots=True, eq=False)
class Transitions:
    """Steps after which the same episode went on, as curiosity sees them.

    Attributes:
        observation: Before, shape (B, F).
        action: Raw actions, shape (B, 2).
        next_observation: After, shape (B, F).
        index: Which of the rollout's T L steps, shape (B,).
    """

    observation: Tensor
    action: Tensor
    next_observation: Tensor
    index: IntArray

    def __getitem__(self, chosen: Tensor) -> Transitions:
        """Those of these numbers."""
        return Transitions(
            self.observation[chosen],
            self.action[chosen],
            self.next_observation[chosen],
            self.index[chosen.cpu().numpy()],
        )


class Learner:
    """Actor, critic and curiosity, and what improves them.

    Attributes:
        networks: Actor and critic.
        curiosity: Networks that foresee; None without.
        optimiser: Adam, over all of them.
        generator: Source of chance, on the CPU wherever networks live: a training can go on elsewhere.
    """

    def __init__(self, settings: TrainingSettings, device: str = "cpu") -> None:
        """Draw networks from the seed.

        Args:
            settings: What to learn, and how.
            device: Where networks live, as torch names it: "cpu", "cuda".
        """
        self._settings = settings
        self._device = torch.device(device)
        self.generator = torch.Generator("cpu").manual_seed(settings.seed)
        # Networks draw from torch's own generator, on the CPU wherever they will live; nobody else is disturbed.
        with torch.random.fork_rng(devices=[]):
            torch.default_generator.manual_seed(settings.seed)
            self.networks = ActorCritic(settings.layout.size, settings.hidden).to(self._device)
            self.curiosity: Curiosity | None = None
            if settings.curiosity is not None:
                self.curiosity = Curiosity(settings.layout.size, settings.curiosity)
                self.curiosity.to(self._device)
        self._modules = [self.networks, *([] if self.curiosity is None else [self.curiosity])]
        self.optimiser = torch.optim.Adam(
            [parameter for module in self._modules for parameter in module.parameters()],
            settings.ppo.learning_rate,
            eps=ADAM_EPSILON,
            fused=True,
        )

    @torch.no_grad()
    def act(self, observation: SingleArray) -> tuple[SingleArray, SingleArray]:
        """Draw raw actions.

        Args:
            observation: Shape (L, F).

        Returns:
            Raw actions, shape (L, 2), and their log-probabilities, shape (L,).
        """
        raw, log_probability = self.networks.sample(self._tensor(observation), self.generator)
        return raw.cpu().numpy(), log_probability.cpu().numpy()

    def learn(self, experience: Experience, rate: float) -> dict[str, float]:
        """Improve everything by one rollout. Curiosity adds its rewards to those of the experience.

        Args:
            experience: The rollout.
            rate: Learning rate.

        Returns:
            Figures by name; none if nobody acted, for there is nothing to learn then.
        """
        if not experience.acts.any():
            return {}
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        transitions = self._transitions(experience)
        paid = self._pay_curiosity(experience, transitions)
        batch, explained = self._batch(experience)
        return {
            **self._improve(batch, transitions),
            "entropy": float(self.networks.entropy().detach()),
            "explained_variance": explained,
            "curiosity": paid,
        }

    def state(self) -> dict[str, Any]:
        """Everything that has been learnt, and what learning goes on with."""
        return {
            "modules": [as_arrays(module.state_dict()) for module in self._modules],
            "optimiser": as_arrays(self.optimiser.state_dict()),
            "generator": as_arrays(self.generator.get_state()),
        }

    def restore(self, state: Any) -> None:  # as varied as what went in
        """Go on from a state that `state` returned, of a learner with the same settings."""
        for module, kept in zip(self._modules, state["modules"], strict=True):
            module.load_state_dict(as_tensors(kept))
        self.optimiser.load_state_dict(as_tensors(state["optimiser"]))
        self.generator.set_state(as_tensors(state["generator"]))

    def _transitions(self, experience: Experience) -> Transitions | None:
        if self.curiosity is None:
            return None
        is_executed = self.curiosity.settings.sees_executed
        seen = experience.executed if is_executed else experience.action
        # After an end comes another episode, which nobody could foresee.
        goes_on = np.flatnonzero(experience.acts & ~experience.ends)
        chosen = torch.from_numpy(goes_on).to(self._device)
        observation = self._tensor(experience.observation)
        return Transitions(
            observation[:-1].flatten(0, 1)[chosen],
            self._tensor(seen).flatten(0, 1)[chosen],
            observation[1:].flatten(0, 1)[chosen],
            goes_on,
        )

    def _pay_curiosity(self, experience: Experience, transitions: Transitions | None) -> float:
        """Add what was not foreseen to the rewards, Eq. (4); returns the mean of it a step."""
        if self.curiosity is None or transitions is None:
            return 0.0
        bonus = self.curiosity.reward(
            transitions.observation, transitions.action, transitions.next_observation
        )
        experience.reward.reshape(-1)[transitions.index] += bonus.cpu().numpy()
        return float(bonus.sum()) / max(1, int(experience.acts.sum()))

    def _batch(self, experience: Experience) -> tuple[Batch, float]:
        """Samples of those who acted, and how much of the returns' variance the critic explains."""
        settings, acts = self._settings.ppo, experience.acts
        observation = self._tensor(experience.observation)
        with torch.no_grad():
            value = self.networks.value(observation.flatten(0, 1)).cpu().numpy()
        value = value.reshape(observation.shape[:2])
        advantage = advantages(
            settings.reward_scale * experience.reward,
            value,
            acts,
            experience.ends,
            settings.discount,
            settings.trace_decay,
        )
        target = advantage + value[:-1]
        explained = 1.0 - advantage[acts].var() / max(target[acts].var(), 1e-12)
        batch = Batch(
            observation=observation[:-1].flatten(0, 1),
            action=self._tensor(experience.action).flatten(0, 1),
            log_probability=self._tensor(experience.log_probability).flatten(),
            advantage=self._tensor(normalised(advantage, acts)).flatten(),
            target=self._tensor(target).flatten(),
        )
        acted = torch.from_numpy(np.flatnonzero(acts)).to(self._device)
        return batch[acted], float(explained)

    def _improve(self, batch: Batch, transitions: Transitions | None) -> dict[str, float]:
        """Pass over the samples until the policy has moved far enough; returns means over all gradient steps."""
        settings, number = self._settings.ppo, len(batch.target)
        # Of one size, or the last few samples would make a step of their own that counts as much as all others.
        num_parts = math.ceil(number / settings.minibatch)
        steps: list[dict[str, Tensor]] = []
        for _ in range(settings.epochs):
            parts = torch.tensor_split(self._shuffled(number), num_parts)
            others = self._parts_of(transitions, num_parts)
            steps += [
                self._descend(batch[part], other) for part, other in zip(parts, others, strict=True)
            ]
            if _mean("divergence", steps[-num_parts:]) > settings.max_divergence:
                break
        return {name: _mean(name, steps) for name in steps[0]}

    def _shuffled(self, number: int) -> Tensor:
        order = torch.randperm(number, generator=self.generator, device="cpu")
        return order.to(self._device)

    def _parts_of(
        self, transitions: Transitions | None, num_parts: int
    ) -> Sequence[Transitions | None]:
        """Transitions in random order, in so many parts; None where there are none."""
        if transitions is None or len(transitions.index) < num_parts:
            return [None] * num_parts
        order = self._shuffled(len(transitions.index))
        return [transitions[part] for part in torch.tensor_split(order, num_parts)]

    def _descend(self, batch: Batch, transitions: Transitions | None) -> dict[str, Tensor]:
        """One gradient step on the joint objective; returns what it was made of."""
        settings = self._settings.ppo
        terms = losses(self.networks, batch, settings.clip)
        loss = terms.total(settings)
        figures = {
            "policy_loss": terms.policy,
            "value_loss": terms.value,
            "clipped": terms.clipped,
            "divergence": terms.divergence,
        }
        if self.curiosity is not None and transitions is not None:
            inverse, forward = self.curiosity.losses(
                transitions.observation, transitions.action, transitions.next_observation
            )
            loss = self.curiosity.objective(loss, inverse, forward)
            figures |= {"inverse_loss": inverse, "forward_loss": forward}
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        # Each by itself: what one has to learn does not shorten the others' steps.
        for module in self._modules:
            nn.utils.clip_grad_norm_(module.parameters(), settings.max_gradient)
        self.optimiser.step()
        # As tensors: asking for numbers would make a GPU wait at every step.
        return {name: value.detach() for name, value in figures.items()}

    def _tensor(self, array: SingleArray) -> Tensor:
        return torch.from_numpy(array).to(self._device)


def _mean(name: str, steps: Sequence[dict[str, Tensor]]) -> float:
    """Mean of one figure over gradient steps."""
    return float(torch.stack([step[name] for step in steps]).mean())
